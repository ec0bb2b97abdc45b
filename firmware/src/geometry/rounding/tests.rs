//! Laws of rounded corners. The oracle is a path in `f64`, sampled, and distances to it found by search.

use super::*;
use crate::config::tests::test_config;
use crate::units::{Steps, AXES};
use proptest::prelude::*;

type Point = [f64; AXES];

/// Steps per mm and degree of the test machine.
const STEPS: f64 = 1000.0;

/// Tolerances of the axes, each its own.
const TOLERANCE: [f32; AXES] = [0.01, 0.02, 0.015, 0.03, 0.005];

fn config() -> Config {
    let mut config = test_config();
    for (axis, tolerance) in config.axes.iter_mut().zip(TOLERANCE) {
        axis.rounding_tolerance = tolerance;
    }
    config
}

fn position(point: &Point) -> Position {
    point.map(|value| Steps::from_num((value * STEPS).round()))
}

fn point(at: &Position) -> Point {
    at.map(|steps| steps.to_num::<f64>() / STEPS)
}

fn path(start: &Point, end: &Point, slopes: Option<[Point; 2]>, rounding: Rounding) -> PathSegment {
    let (start, end) = (position(start), position(end));
    let by: Point = core::array::from_fn(|a| point(&end)[a] - point(&start)[a]);
    let [slope_start, slope_end] = slopes.unwrap_or([by, by]).map(|s| s.map(|v| v as f32));
    PathSegment {
        segment: HermiteSegment {
            start,
            end,
            slope_start,
            slope_end,
        },
        block: 1,
        feed: 50.0,
        exact_stop: false,
        soft: true,
        rounding,
        spline: false,
        cutter: Cutter::OFF,
    }
}

fn polyline(points: &[Point], rounding: Rounding) -> Vec<PathSegment> {
    points
        .windows(2)
        .map(|pair| path(&pair[0], &pair[1], None, rounding))
        .collect()
}

/// What comes out without an end of the path.
fn open(rounder: &mut Rounder, config: &Config, segments: &[PathSegment]) -> Vec<PathSegment> {
    let mut out = Vec::new();
    for segment in segments {
        rounder.push(config, segment);
        out.extend(core::iter::from_fn(|| rounder.pop()));
    }
    out
}

fn round(config: &Config, segments: &[PathSegment]) -> Vec<PathSegment> {
    let mut rounder = Rounder::new();
    let mut out = open(&mut rounder, config, segments);
    rounder.finish(false);
    out.extend(core::iter::from_fn(|| rounder.pop()));
    assert!(!rounder.has_pending());
    out
}

/// Place and derivatives of a cubic, in f64.
fn sample(segment: &HermiteSegment, u: f64) -> [Point; 3] {
    let (p0, p1) = (point(&segment.start), point(&segment.end));
    let mut out = [[0.0; AXES]; 3];
    for a in 0..AXES {
        let (s0, s1) = (
            f64::from(segment.slope_start[a]),
            f64::from(segment.slope_end[a]),
        );
        let by = p1[a] - p0[a];
        let (c2, c3) = (3.0 * by - 2.0 * s0 - s1, s0 + s1 - 2.0 * by);
        out[0][a] = p0[a] + u * (s0 + u * (c2 + u * c3));
        out[1][a] = s0 + u * (2.0 * c2 + 3.0 * u * c3);
        out[2][a] = 2.0 * c2 + 6.0 * u * c3;
    }
    out
}

fn linear(v: &Point) -> f64 {
    v[..3].iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// dq/ds and d2q/ds2 over the linear axes.
fn shape(segment: &HermiteSegment, u: f64) -> [Point; 2] {
    let [_, d1, d2] = sample(segment, u);
    let speed = linear(&d1);
    let along = (0..3).map(|a| d1[a] * d2[a]).sum::<f64>() / speed.powi(4);
    [
        d1.map(|v| v / speed),
        core::array::from_fn(|a| d2[a] / speed.powi(2) - d1[a] * along),
    ]
}

/// How closely `shape` is known from places and slopes that are `f32`: eight last bits of each, for a joint within a corner
/// is a sum of rounded points, themselves such sums. Where the path is slow, as before a cusp, that is much of its shape.
fn resolution(segment: &HermiteSegment, u: f64) -> [Point; 2] {
    let [_, d1, _] = sample(segment, u);
    let (p0, p1) = (point(&segment.start), point(&segment.end));
    let speed = linear(&d1);
    let largest: Point = core::array::from_fn(|a| {
        let slope = segment.slope_start[a].abs().max(segment.slope_end[a].abs());
        f64::from(slope).max((p1[a] - p0[a]).abs())
    });
    let last = 8.0 * f64::from(f32::EPSILON);
    // Of 6 by - 4 s0 - 2 s1; along the path it also counts through the speed.
    let second = |a: usize| 12.0 * last * largest[a];
    let along = (0..3).map(second).fold(0.0, f64::max) / speed.powi(3);
    [
        largest.map(|most| last * most / speed),
        core::array::from_fn(|a| second(a) / speed.powi(2) + d1[a].abs() * along),
    ]
}

/// Largest deviation of an axis from the nearest point of `path`, in units of `scale` of the axis.
fn deviation(path: &[Point], at: &Point, scale: &Point) -> f64 {
    let off = |p: &Point| {
        (0..AXES)
            .map(|a| (p[a] - at[a]).abs() / scale[a])
            .fold(0.0, f64::max)
    };
    let mut least = f64::INFINITY;
    for pair in path.windows(2) {
        let between = |t: f64| -> Point {
            core::array::from_fn(|a| pair[0][a] + t * (pair[1][a] - pair[0][a]))
        };
        // The largest of five convex functions is convex: three parts and two of them stay.
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..48 {
            let third = (high - low) / 3.0;
            if off(&between(low + third)) < off(&between(high - third)) {
                high -= third;
            } else {
                low += third;
            }
        }
        least = least.min(off(&between(0.5 * (low + high))));
    }
    least
}

/// Points along segments, `per` each.
fn trace(segments: &[PathSegment], per: usize) -> Vec<Point> {
    let mut out = vec![point(&segments[0].segment.start)];
    for next in segments {
        out.extend((1..=per).map(|k| sample(&next.segment, k as f64 / per as f64)[0]));
    }
    out
}

prop_compose! {
    /// A vertex some way from the last, in linear axes; rotary axes go along by up to 3 degrees per mm.
    fn leg()(
        length in 0.02..30.0_f64, heading in -3.1..3.1_f64, climb in -1.0..1.0_f64,
        a in -3.0..3.0_f64, c in -3.0..3.0_f64, turns in 0..3_u8,
    ) -> Point {
        let flat = length * (1.0 - climb * climb).sqrt();
        let turn = |rate: f64| if turns == 0 { 0.0 } else { rate * length };
        [flat * heading.cos(), flat * heading.sin(), climb * length, turn(a), turn(c)]
    }
}

fn vertices(legs: &[Point]) -> Vec<Point> {
    let mut at = [0.0; AXES];
    let mut out = vec![at];
    for leg in legs {
        at = core::array::from_fn(|a| ((at[a] + leg[a]) * STEPS).round() / STEPS);
        out.push(at);
    }
    out
}

/// A path of lines and curves through `points`: curves begin and end at up to 60 degrees from the chord.
fn mixed(points: &[Point], bends: &[[f64; 2]], rounding: Rounding) -> Vec<PathSegment> {
    points
        .windows(2)
        .zip(bends)
        .map(|(pair, bend)| {
            let by: Point = core::array::from_fn(|a| pair[1][a] - pair[0][a]);
            if bend[0] < 0.0 {
                return path(&pair[0], &pair[1], None, rounding);
            }
            let slopes = bend.map(|angle| {
                let (sin, cos) = (angle - 0.5).sin_cos();
                let mut slope = by;
                slope[0] = cos * by[0] - sin * by[1];
                slope[1] = sin * by[0] + cos * by[1];
                slope[3] *= 1.0 + 0.5 * angle;
                slope
            });
            path(&pair[0], &pair[1], Some(slopes), rounding)
        })
        .collect()
}

fn rounding() -> impl Strategy<Value = Rounding> {
    prop_oneof![
        Just(Rounding::Tolerance),
        (0.001..20.0_f32).prop_map(Rounding::Distance),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn segments_join_exactly_and_stops_and_the_end_are_where_they_are_programmed(
        legs in prop::collection::vec(leg(), 2..12),
        bends in prop::collection::vec(prop::array::uniform2(-1.0..1.0_f64), 12),
        rounding in rounding(),
        stops in prop::collection::vec(0..4_u8, 12),
    ) {
        let mut program = mixed(&vertices(&legs), &bends, rounding);
        for (segment, stop) in program.iter_mut().zip(stops) {
            segment.exact_stop = stop == 0;
        }
        let out = round(&config(), &program);
        prop_assert_eq!(out[0].segment.start, program[0].segment.start);
        prop_assert_eq!(out[out.len() - 1].segment.end, program[program.len() - 1].segment.end);
        for pair in out.windows(2) {
            prop_assert_eq!(pair[0].segment.end, pair[1].segment.start);
        }
        let ends = |path: &[PathSegment]| -> Vec<Position> {
            path.iter().filter(|s| s.exact_stop).map(|s| s.segment.end).collect()
        };
        prop_assert_eq!(ends(&out), ends(&program));
        // and no segment is a point
        prop_assert!(out.iter().all(|s| s.segment.start != s.segment.end));
    }

    #[test]
    fn tolerances_of_all_axes_hold_both_ways(
        legs in prop::collection::vec(leg(), 2..6),
        bends in prop::collection::vec(prop::array::uniform2(-1.0..1.0_f64), 6),
    ) {
        let program = mixed(&vertices(&legs), &bends, Rounding::Tolerance);
        let out = round(&config(), &program);
        let scale = TOLERANCE.map(f64::from);
        let (asked, driven) = (trace(&program, 200), trace(&out, 60));
        for at in trace(&out, 12) {
            let off = deviation(&asked, &at, &scale);
            prop_assert!(off <= 1.0, "{} of the tolerance", off);
        }
        for corner in &program {
            let off = deviation(&driven, &point(&corner.segment.end), &scale);
            prop_assert!(off <= 1.0, "corner missed by {} of the tolerance", off);
        }
    }

    #[test]
    fn what_leaves_the_path_is_near_a_corner_and_at_most_half_a_block_of_it(
        legs in prop::collection::vec(leg(), 2..8),
        adis in 0.001..20.0_f32,
    ) {
        let points = vertices(&legs);
        let program = polyline(&points, Rounding::Distance(adis));
        let out = round(&config(), &program);
        for at in trace(&out, 10) {
            // Places are f32 relative to the corner, up to 60 degrees away: 4e-6.
            if deviation(&points, &at, &[1.0; AXES]) < 1.0e-5 {
                continue;
            }
            let near = (1..points.len() - 1).any(|k| {
                let length = |i: usize| linear(&core::array::from_fn(|a| points[i + 1][a] - points[i][a]));
                let reach = f64::from(adis).min(0.5 * length(k - 1).max(length(k)));
                linear(&core::array::from_fn(|a| at[a] - points[k][a])) <= reach + 1.0e-5
            });
            prop_assert!(near, "{:?}", at);
        }
    }

    #[test]
    fn direction_is_continuous_and_so_is_curvature_where_a_corner_stands_alone(
        legs in prop::collection::vec(leg(), 2..6),
        bends in prop::collection::vec(prop::array::uniform2(-1.0..1.0_f64), 6),
    ) {
        // Legs of more than twice the distance: no joint takes all there is, so that every corner stands alone.
        let legs: Vec<Point> = legs
            .iter()
            .map(|leg| leg.map(|value| value * (1.0 + 2.0 / linear(leg))))
            .collect();
        let program = mixed(&vertices(&legs), &bends, Rounding::Distance(0.8));
        let out = round(&config(), &program);
        for pair in out.windows(2) {
            let (before, behind) = (&pair[0], &pair[1]);
            if before.rounding == Rounding::None || behind.rounding == Rounding::None {
                let ends = [(&before.segment, 1.0), (&behind.segment, 0.0)];
                let [[t0, k0], [t1, k1]] = ends.map(|(segment, u)| shape(segment, u));
                let [r0, r1] = ends.map(|(segment, u)| resolution(segment, u));
                let [l0, l1] = ends.map(|(segment, u)| linear(&sample(segment, u)[1]));
                let size = l0.min(l1);
                for a in 0..AXES {
                    let (turn, bend) = (r0[0][a] + r1[0][a], r0[1][a] + r1[1][a]);
                    prop_assert!((t0[a] - t1[a]).abs() < 2.0e-5 + turn, "tangent {} {:?} {:?}", a, t0, t1);
                    prop_assert!(
                        (k0[a] - k1[a]).abs() * size < 2.0e-4 + bend * size,
                        "curvature {} {:?} {:?} {} {}", a, k0, k1, size, bend
                    );
                }
            }
        }
    }

    #[test]
    fn what_has_come_out_does_not_depend_on_what_follows(
        legs in prop::collection::vec(leg(), 3..10),
        rounding in rounding(),
        cut in 1..9_usize,
    ) {
        let program = polyline(&vertices(&legs), rounding);
        let cut = cut.min(program.len());
        let whole = round(&config(), &program);
        let mut rounder = Rounder::new();
        let part = open(&mut rounder, &config(), &program[..cut]);
        prop_assert_eq!(&whole[..part.len()], &part[..]);
        // only the newest segment, or what is left of it, waits
        let end = part.last().map_or(program[0].segment.start, |last| last.segment.end);
        let held = rounder.finish(true).map(|_| rounder.pop().unwrap());
        prop_assert_eq!(held.unwrap().segment.start, end);
        prop_assert_eq!(held.unwrap().segment.end, program[cut - 1].segment.end);
    }
}

const SQUARE: [Point; 4] = [
    [0.0; AXES],
    [10.0, 0.0, 0.0, 0.0, 0.0],
    [10.0, 10.0, 0.0, 0.0, 0.0],
    [0.0, 10.0, 0.0, 0.0, 0.0],
];

#[test]
fn a_corner_uses_what_it_is_given() {
    let out = round(&config(), &polyline(&SQUARE, Rounding::Distance(1.5)));
    // leg, corner of three, leg, corner, leg
    assert_eq!(out.len(), 9);
    assert_eq!(point(&out[0].segment.end), [8.5, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(point(&out[4].segment.start), [10.0, 1.5, 0.0, 0.0, 0.0]);
    // ADIS beyond half the side: the whole side but its first and last half is corners
    let out = round(&config(), &polyline(&SQUARE, Rounding::Distance(100.0)));
    assert_eq!(out.len(), 8);
    assert_eq!(point(&out[3].segment.end), [10.0, 5.0, 0.0, 0.0, 0.0]);
    // 0.01 mm in X and 0.02 mm in Y: X decides, and 98 % of it is used
    let out = round(&config(), &polyline(&SQUARE, Rounding::Tolerance));
    let least = trace(&out[..4], 50)
        .iter()
        .map(|at| deviation(&SQUARE, at, &[1.0; AXES]))
        .fold(0.0, f64::max);
    assert!((0.0093..0.01).contains(&least), "{least}");
}

#[test]
fn programmed_points_stay_where_nothing_may_be_rounded() {
    let config = config();
    let rounded = Rounding::Distance(1.0);
    let unchanged = |program: &[PathSegment]| assert_eq!(round(&config, program), program);
    unchanged(&polyline(&SQUARE, Rounding::None));
    // exact stops
    let mut program = polyline(&SQUARE, rounded);
    program.iter_mut().for_each(|s| s.exact_stop = true);
    unchanged(&program);
    // between feed and rapid motion
    let mut program = polyline(&SQUARE, rounded);
    program[1].feed = f32::INFINITY;
    unchanged(&program);
    // straight on, and back
    let mut line = SQUARE;
    line[2] = [20.0, 0.0, 0.0, 0.0, 0.0];
    line[3] = [5.0, 0.0, 0.0, 0.0, 0.0];
    unchanged(&polyline(&line, rounded));
    // between a path in millimetres and one in degrees
    let mut turn = SQUARE;
    turn[2] = [10.0, 0.0, 0.0, 5.0, 0.0];
    turn[3] = [10.0, 5.0, 0.0, 5.0, 0.0];
    unchanged(&polyline(&turn, rounded));
    // an axis that may not leave the path
    let mut tight = config;
    tight.axes[1].rounding_tolerance = 0.0;
    let program = polyline(&SQUARE, Rounding::Tolerance);
    assert_eq!(round(&tight, &program), program);
}

#[test]
fn the_block_before_a_corner_says_what_becomes_of_it() {
    let mut program = polyline(&SQUARE, Rounding::None);
    program[0].rounding = Rounding::Distance(1.0);
    program[1].exact_stop = true;
    let out = round(&config(), &program);
    assert_eq!(out.len(), 6);
    assert!(out[4].exact_stop && point(&out[4].segment.end) == SQUARE[2]);
}

/// Rotary axes alone: degrees are the path.
#[test]
fn corners_between_rotary_moves_are_rounded_too() {
    let mut points = SQUARE;
    for at in &mut points {
        at.swap(0, 3);
        at.swap(1, 4);
    }
    let out = round(&config(), &polyline(&points, Rounding::Distance(1.0)));
    assert_eq!(out.len(), 9);
    assert_eq!(point(&out[0].segment.end), [0.0, 0.0, 0.0, 9.0, 0.0]);
}

/// Chords of a circle, as many systems write curves: what is driven bends as the circle does, all along.
#[test]
fn a_polygon_of_many_sides_is_driven_as_the_curve_it_stands_for() {
    let radius = 20.0;
    let points: Vec<Point> = (0..200)
        .map(|k| {
            let (sin, cos) = (f64::from(k) * 0.0314).sin_cos();
            // exact to the bit of a step is not needed: 1 um of rounding would bend more than the circle
            [radius * cos, radius * sin, 0.0, 0.0, 0.0]
        })
        .collect();
    let fine = |at: &Point| at.map(|value| Steps::from_num(value * STEPS));
    let mut program = polyline(&points, Rounding::Tolerance);
    for (segment, pair) in program.iter_mut().zip(points.windows(2)) {
        let by: Point = core::array::from_fn(|a| pair[1][a] - pair[0][a]);
        segment.segment = HermiteSegment {
            start: fine(&pair[0]),
            end: fine(&pair[1]),
            slope_start: by.map(|v| v as f32),
            slope_end: by.map(|v| v as f32),
        };
    }
    let out = round(&config(), &program);
    // half a side, a cubic per corner, half a side
    assert_eq!(out.len(), program.len() + 1);
    for next in &out[1..out.len() - 1] {
        for u in [0.0, 0.5, 1.0] {
            let [_, bend] = shape(&next.segment, u);
            assert!(
                (linear(&bend) * radius - 1.0).abs() < 0.01,
                "{}",
                linear(&bend) * radius
            );
        }
    }
}
