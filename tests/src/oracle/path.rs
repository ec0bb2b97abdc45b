//! From what a program does to the curves it asks for, and how far a point is from them.

use super::read::{blocks, End, Item, Kind, Motion, Target};
use super::spline::{akima, b_spline, chord, cubic, distance, norm, Condition, Cubic, Point};

/// One curve: the part of the path that one text line is responsible for.
#[derive(Clone, Debug)]
pub struct Curve {
    /// Text line.
    pub line: u32,
    /// The curve.
    pub shape: Cubic,
    /// Programmed end, 1e-6 mm or degree; `None` where the line programs a control point that is not on the path.
    pub end: Option<Target>,
    /// Programmed feed, mm/s; infinite for rapid motion.
    pub feed: f64,
    /// Comes to rest at its end because the program says so.
    pub stop: bool,
    /// Jerk-limited.
    pub soft: bool,
}

fn point(target: &Target) -> Point {
    target.map(|nano| nano as f64 * 1e-6)
}

/// A spline being collected.
struct Open {
    kind: Kind,
    ends: [End; 2],
    degree: usize,
    /// Direction of the path before it.
    before: Option<Point>,
    start: Target,
    /// Line, target, interval, feed, stop, soft per block.
    points: Vec<(u32, Target, f64, f64, bool, bool)>,
}

fn condition(end: End, direction: Option<Point>, like: f64) -> Condition {
    match (end, direction) {
        (End::Auto, _) => Condition::Auto,
        (End::Tangent, Some(v)) => {
            let linear = norm(&[v[0], v[1], v[2], 0.0, 0.0]);
            // Millimetres and degrees of length have no common slope.
            if (linear > 0.0) != (like > 0.0) || norm(&v) == 0.0 {
                return Condition::Natural;
            }
            let length = if linear > 0.0 { linear } else { norm(&v) };
            Condition::Slope(v.map(|x| x / length))
        }
        _ => Condition::Natural,
    }
}

impl Open {
    fn close(self, next: Option<Point>, out: &mut Vec<Curve>) {
        let mut knots = vec![point(&self.start)];
        knots.extend(self.points.iter().map(|p| point(&p.1)));
        let linear = |k: usize| {
            chord(&knots[k], &knots[k + 1])
                * f64::from(u8::from(knots[k][..3] != knots[k + 1][..3]))
        };
        let begin = condition(self.ends[0], self.before, linear(0));
        let end = condition(self.ends[1], next, linear(knots.len() - 2));
        // Blocks before the first span have no curve of their own.
        let mut early = 0;
        let shapes = match self.kind {
            Kind::A => akima(&knots, begin, end),
            Kind::C => cubic(&knots, begin, end),
            Kind::B => {
                let degree = self.degree.min(self.points.len());
                early = degree - 1;
                let spans: Vec<f64> = self.points[early..].iter().map(|p| p.2).collect();
                b_spline(degree, &knots, &spans)
            }
        };
        let early_stop = self.points[..early].iter().any(|p| p.4);
        let count = shapes.len();
        for (k, (shape, p)) in shapes.into_iter().zip(&self.points[early..]).enumerate() {
            out.push(Curve {
                line: p.0,
                shape,
                end: (self.kind != Kind::B || k + 1 == count).then_some(p.1),
                feed: p.3,
                stop: p.4 || (k == 0 && early_stop),
                soft: p.5,
            });
        }
    }
}

/// The curves `text` asks for, in order.
///
/// # Panics
/// On text that is not a good program.
#[must_use]
pub fn path(text: &str) -> Vec<Curve> {
    let mut out: Vec<Curve> = Vec::new();
    let mut open: Option<Open> = None;
    let mut at: Target = [0; 5];
    for item in blocks(text) {
        let Item::Block {
            line,
            motion,
            target,
            feed,
            stop,
            soft,
        } = item
        else {
            if let Some(spline) = open.take() {
                spline.close(None, &mut out);
            }
            if let Some(last) = out.last_mut() {
                last.stop = true;
            }
            continue;
        };
        let (from, to) = (point(&at), point(&target));
        match motion {
            Motion::Rapid | Motion::Linear => {
                if at == target {
                    continue;
                }
                let direction = core::array::from_fn(|i| to[i] - from[i]);
                if let Some(spline) = open.take() {
                    spline.close(Some(direction), &mut out);
                }
                out.push(Curve {
                    line,
                    shape: Cubic::line(&from, &to),
                    end: Some(target),
                    feed: if motion == Motion::Rapid {
                        f64::INFINITY
                    } else {
                        feed
                    },
                    stop,
                    soft,
                });
            }
            Motion::Cubic(length, k) => {
                // facts: i runs from I down to 0; K1 is Q28, K2 Q41, K3 Q53 in thousandths.
                let b = |axis: usize, term: usize| {
                    let scale = [
                        1e6 / 53_f64.exp2(),
                        1e3 / 41_f64.exp2(),
                        1.0 / 28_f64.exp2(),
                    ];
                    k[axis][term] * scale[term] * length.powi(3 - term as i32)
                };
                // P = end + b3 v^3 + b2 v^2 + b1 v with v = 1 - u.
                let shape = Cubic([
                    core::array::from_fn(|i| to[i] + b(i, 0) + b(i, 1) + b(i, 2)),
                    core::array::from_fn(|i| -3.0 * b(i, 0) - 2.0 * b(i, 1) - b(i, 2)),
                    core::array::from_fn(|i| 3.0 * b(i, 0) + b(i, 1)),
                    core::array::from_fn(|i| -b(i, 0)),
                ]);
                if let Some(spline) = open.take() {
                    spline.close(Some(shape.slope(0.0)), &mut out);
                }
                out.push(Curve {
                    line,
                    shape,
                    end: Some(target),
                    feed,
                    stop,
                    soft,
                });
            }
            Motion::Spline {
                kind,
                ends,
                degree,
                interval,
            } => {
                let next = (line, target, interval, feed, stop, soft);
                match &mut open {
                    Some(spline) if spline.kind == kind => {
                        spline.ends[1] = ends[1];
                        spline.points.push(next);
                    }
                    _ => {
                        // Only the polygon of a B-spline is known to be tangent to it.
                        let direction =
                            (kind == Kind::B).then(|| core::array::from_fn(|i| to[i] - from[i]));
                        if let Some(spline) = open.take() {
                            spline.close(direction, &mut out);
                        }
                        open = Some(Open {
                            kind,
                            ends,
                            degree,
                            before: out.last().map(|curve| curve.shape.slope(1.0)),
                            start: at,
                            points: vec![next],
                        });
                    }
                }
            }
        }
        at = target;
    }
    if let Some(spline) = open.take() {
        spline.close(None, &mut out);
    }
    if let Some(last) = out.last_mut() {
        last.stop = true;
    }
    out
}

/// Nearest point of `curve` to `q`: parameter and distance. Looks near `guess` first, everywhere if that is not
/// within `enough`.
#[must_use]
pub fn nearest(curve: &Cubic, q: &Point, guess: f64, enough: f64) -> (f64, f64) {
    let refine = |mut u: f64| {
        for _ in 0..8 {
            let (p, d) = (curve.at(u), curve.slope(u));
            let dot: f64 = (0..5).map(|i| (q[i] - p[i]) * d[i]).sum();
            let square = norm(&d).powi(2);
            if square == 0.0 {
                break;
            }
            let step = dot / square;
            u = (u + step).clamp(0.0, 1.0);
            if step.abs() < 1e-12 {
                break;
            }
        }
        (u, distance(&curve.at(u), q))
    };
    let near = refine(guess);
    if near.1 <= enough {
        return near;
    }
    let coarse = (0..=400)
        .map(|k| f64::from(k) / 400.0)
        .min_by(|a, b| distance(&curve.at(*a), q).total_cmp(&distance(&curve.at(*b), q)))
        .unwrap_or(0.0);
    let far = refine(coarse);
    if far.1 < near.1 {
        far
    } else {
        near
    }
}
