//! Segments against the cubic they stand for: its points and its arc length in f64.

use proptest::prelude::*;

use super::*;
use crate::config::tests::test_config;
use crate::interpolator::segment::fine_bits;

/// A cubic in axis units.
struct Cubic {
    start: [f64; AXES],
    /// Coefficients of u, u^2, u^3.
    c: [[f64; 3]; AXES],
}

impl Cubic {
    fn new(segment: &HermiteSegment) -> Self {
        let unit = |x: Steps| x.to_num::<f64>() / 1000.0;
        let mut c = [[0.0; 3]; AXES];
        for a in 0..AXES {
            let delta = unit(segment.end[a]) - unit(segment.start[a]);
            let t = [segment.slope_start[a], segment.slope_end[a]].map(f64::from);
            c[a] = [
                t[0],
                3.0 * delta - 2.0 * t[0] - t[1],
                t[0] + t[1] - 2.0 * delta,
            ];
        }
        Self {
            start: segment.start.map(unit),
            c,
        }
    }

    fn at(&self, u: f64) -> [f64; AXES] {
        core::array::from_fn(|a| {
            let [c1, c2, c3] = self.c[a];
            self.start[a] + u * (c1 + u * (c2 + u * c3))
        })
    }

    /// The point nearest to `q`, looked for upwards from `u`: its parameter and distance.
    fn nearest(&self, q: &[f64; AXES], u: f64) -> (f64, f64) {
        let off = |u: f64| -> f64 {
            let p = self.at(u);
            (0..AXES).map(|a| (p[a] - q[a]).powi(2)).sum()
        };
        let mut step = 1e-3;
        let mut best = u;
        while step > 1e-14 {
            while off(best + step) < off(best) {
                best += step;
            }
            while off(best - step) < off(best) {
                best -= step;
            }
            step *= 0.25;
        }
        (best, off(best).sqrt())
    }
}

/// Position and first three derivatives over s of a segment in axis units at a share of its length, from the integers it
/// holds and the formula they are coefficients of.
fn motion(driven: &Driven, share: f64) -> [[f64; AXES]; 4] {
    let config = test_config();
    let length = driven.segment.length as f64 * 0.5_f64.powi(S_FRAC as i32);
    let polynomial = |a: usize, t: f64| -> [f64; 4] {
        let curve = &driven.segment.axes[a];
        let fine = 0.5_f64.powi(fine_bits(&config, a) as i32);
        let mut c = curve.fine.map(|c| f64::from(c) * fine / 1000.0);
        c[0] += f64::from(curve.slope) * 0.5_f64.powi(19) / 1000.0;
        let mut d = [0.0; 4];
        for (k, c) in (1..).zip(c) {
            // n-th derivative of t^k; s rises as t falls.
            let mut factor = c;
            for (n, d) in (0..=k.min(3)).zip(&mut d) {
                *d += factor * t.powi(k - n);
                factor *= -f64::from(k - n) / length;
            }
        }
        d
    };
    let mut out = [[0.0; AXES]; 4];
    for a in 0..AXES {
        let d = polynomial(a, 0.5 - share);
        let end = driven.end[a].to_num::<f64>() / 1000.0;
        out[0][a] = end + d[0] - polynomial(a, -0.5)[0];
        for k in 1..4 {
            out[k][a] = d[k];
        }
    }
    out
}

fn split(segment: &HermiteSegment) -> Vec<Driven> {
    let config = test_config();
    let mut splitter = ArcSplitter::new();
    splitter.push(&config, segment, 1).unwrap();
    let mut out = Vec::new();
    while let Some(driven) = splitter.next(&config).unwrap() {
        out.push(driven);
    }
    out
}

/// Curves of a few hundredths of a millimetre to a few dozen of them, without a cusp: X rises all the way.
fn curve() -> impl Strategy<Value = HermiteSegment> {
    (
        prop::array::uniform5(-1.0_f32..1.0),
        prop::array::uniform2(prop::array::uniform5(-1.0_f32..1.0)),
        prop::sample::select(vec![0.05_f32, 0.5, 3.0, 30.0]),
    )
        .prop_map(|(mut chord, bends, size)| {
            chord[0] = 0.6 + 0.4 * chord[0].abs();
            let slope = |bend: &[f32; AXES]| -> [f32; AXES] {
                core::array::from_fn(|a| size * (chord[a] + 0.5 * bend[a]))
            };
            HermiteSegment {
                start: [Steps::from_num(17.25); AXES],
                end: chord.map(|x| Steps::from_num(17.25 + f64::from(x * size) * 1000.0)),
                slope_start: slope(&bends[0]),
                slope_end: slope(&bends[1]),
            }
        })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]

    /// Positions lie on the cubic within the tolerance, and the feed over s is one within its own: an eighth of the length
    /// may be driven in f32, hence the half on top.
    #[test]
    fn segments_follow_the_cubic_at_constant_feed(segment in curve()) {
        let cubic = Cubic::new(&segment);
        let mut u = 0.0;
        for driven in split(&segment) {
            for k in 0..=24 {
                let [q, first, ..] = motion(&driven, f64::from(k) / 24.0);
                let (next, off) = cubic.nearest(&q, u);
                prop_assert!(off < f64::from(PATH_TOLERANCE) + 1e-6, "{} off at u = {}", off, next);
                u = next;
                if !driven.shape.rotary_only {
                    let feed = first[..3].iter().map(|x| x * x).sum::<f64>().sqrt();
                    prop_assert!((feed - 1.0).abs() < 1.5 * f64::from(FEED_TOLERANCE), "feed {}", feed);
                }
            }
        }
        prop_assert!((u - 1.0).abs() < 1e-6, "ends at u = {}", u);
    }

    /// Over a joint inside a curve position, direction and curvature go on as they were.
    #[test]
    fn neighbours_agree_on_two_derivatives(segment in curve()) {
        let pieces = split(&segment);
        for pair in pieces.windows(2) {
            let (before, after) = (motion(&pair[0], 1.0), motion(&pair[1], 0.0));
            let bend = before[2].iter().fold(1e-3_f64, |most, x| most.max(x.abs()));
            let length = pair[1].segment.length as f64 * 0.5_f64.powi(S_FRAC as i32);
            for a in 0..AXES {
                // Two units of the coefficients, and what they make of derivatives.
                let unit = 0.5_f64.powi(fine_bits(&test_config(), a) as i32) / 1000.0;
                prop_assert!((before[0][a] - after[0][a]).abs() < 3.0 * unit);
                let slopes = (before[1][a] - after[1][a]).abs();
                prop_assert!(slopes < 1e-9 + 16.0 * unit / length, "{}", slopes);
                let bends = (before[2][a] - after[2][a]).abs();
                prop_assert!(bends < 4e-6 * bend + 200.0 * unit / (length * length), "{} of {}", bends, bend);
            }
        }
    }

    /// The planner is told no less than what the motion does: how large each derivative becomes, and how far it goes from its line.
    #[test]
    fn lines_and_sizes_cover_the_motion(segment in curve()) {
        for driven in split(&segment) {
            let PathShape { middle, fourth, off, most, .. } = &driven.shape;
            let length = driven.segment.length as f64 * 0.5_f64.powi(S_FRAC as i32);
            let lines = [
                (middle.first, middle.second, off.first, most.first),
                (middle.second, middle.third, off.second, most.second),
                (middle.third, *fourth, off.third, most.third),
            ];
            for k in 0..=64 {
                let d = motion(&driven, f64::from(k) / 64.0);
                let beyond = (f64::from(k) / 64.0 - 0.5) * length;
                for (order, (value, slope, off, most)) in (1..).zip(lines) {
                    let largest = most.iter().fold(0.0_f64, |m, x| m.max(f64::from(*x)));
                    for a in 0..AXES {
                        // Coefficients are rounded by half a unit each; over short segments that adds up to this.
                        let unit = 0.5_f64.powi(fine_bits(&test_config(), a) as i32) / 1000.0;
                        let rounding = [0.0, 1.5, 4.0, 17.0][order] * unit / length.powi(order as i32);
                        let slack = 1e-4 * largest + 1e-6 + rounding;
                        let line = f64::from(value[a]) + f64::from(slope[a]) * beyond;
                        let far = (d[order][a] - line).abs();
                        prop_assert!(far <= f64::from(off[a]) + slack, "{} off, {} said", far, off[a]);
                        prop_assert!(d[order][a].abs() <= f64::from(most[a]) + slack, "{} over {}", d[order][a], most[a]);
                    }
                }
            }
        }
    }
}
