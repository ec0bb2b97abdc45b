//! C-splines.

use super::oracle::{self, End};
use super::support::*;
use crate::geometry::SegmentBuilder;
use crate::nc::command::{BoundaryCondition, Motion, SplineKind};
use crate::units::AXES;
use proptest::prelude::*;

#[derive(Clone, Copy, Debug)]
enum Condition {
    Auto,
    Natural,
    /// A straight block on that side.
    Line(Point),
}

fn conditions() -> impl Strategy<Value = Condition> {
    prop_oneof![
        Just(Condition::Auto),
        Just(Condition::Natural),
        prop::array::uniform5(-9_000_i32..9_000).prop_map(|by| {
            let mut by = by.map(|value| f64::from(value) / 1000.0);
            by[2] += 10.0;
            Condition::Line(by)
        }),
    ]
}

fn of(condition: Condition, axis: usize) -> End {
    match condition {
        Condition::Auto => End::NotAKnot,
        Condition::Natural => End::Natural,
        Condition::Line(by) => {
            End::Slope(by[axis] / by[..3].iter().map(|x| x * x).sum::<f64>().sqrt())
        }
    }
}

fn name(condition: Condition) -> BoundaryCondition {
    match condition {
        Condition::Auto => BoundaryCondition::NotAKnot,
        Condition::Natural => BoundaryCondition::Natural,
        Condition::Line(_) => BoundaryCondition::Tangent,
    }
}

proptest! {
    /// The oracle solves over all knots at once, so this bounds the error of the window, too.
    #[test]
    fn streamed_c_spline_is_the_global_one(
        points in points(2..90),
        begin in conditions(),
        end in conditions(),
    ) {
        // Where the spline moves rotary axes only, a neighbour with linear motion has no slope to share: natural.
        let linear = |k: usize| points[k][..3] != points[k + 1][..3];
        let want = |condition, chord: usize, axis: usize| match condition {
            Condition::Line(_) if !linear(chord) => End::Natural,
            _ => of(condition, axis),
        };
        let config = config();
        let spec = spec(SplineKind::Cubic, name(begin), name(end));
        let mut blocks = Vec::new();
        let mut start = points[0];
        if let Condition::Line(by) = begin {
            for axis in 0..AXES {
                start[axis] -= by[axis];
            }
            blocks.push(block(1000, Motion::Linear, &points[0]));
        }
        for (index, point) in points[1..].iter().enumerate() {
            blocks.push(block(index as u32 + 1, Motion::Spline(spec), point));
        }
        if let Condition::Line(by) = end {
            let last = points[points.len() - 1];
            let target = core::array::from_fn(|axis| last[axis] + by[axis]);
            blocks.push(block(1001, Motion::Rapid, &target));
        }
        let mut segments = run(&start, &blocks).unwrap();
        joins_exactly(&steps(&config, &start), &segments);
        segments.retain(|path| path.block < 1000);
        hits_knots(&points, &segments);
        let h = oracle::chords(&points);
        for axis in 0..AXES {
            let y: Vec<f64> = points.iter().map(|point| point[axis]).collect();
            let pieces = oracle::cubic(&h, &y, want(begin, 0, axis), want(end, points.len() - 2, axis));
            for (path, piece) in segments.iter().zip(&pieces) {
                for u in [0.1, 0.3, 0.5, 0.7, 0.9] {
                    let error = evaluate(&path.segment, u)[0][axis] - oracle::value(piece, u);
                    prop_assert!(error.abs() < 2e-6 * scale(&path.segment), "{}: {error}", path.block);
                }
            }
        }
    }

    #[test]
    fn tangent_and_curvature_are_continuous(points in points(3..120)) {
        let auto = BoundaryCondition::NotAKnot;
        let segments = spline(&points, spec(SplineKind::Cubic, auto, auto));
        is_tangent_continuous(&segments, 1e-6);
        let h = oracle::chords(&points);
        for (k, pair) in segments.windows(2).enumerate() {
            let a = evaluate(&pair[0].segment, 1.0)[2].map(|x| x / (h[k] * h[k]));
            let b = evaluate(&pair[1].segment, 0.0)[2].map(|x| x / (h[k + 1] * h[k + 1]));
            let size = scale(&pair[0].segment) / (h[k] * h[k]) + scale(&pair[1].segment) / (h[k + 1] * h[k + 1]);
            prop_assert!(distance(&a, &b) < 1e-5 * size, "line {}", pair[1].block);
        }
    }
}

/// Metres of travel on chords of 20 um to 90 mm in turn: what the window leaves out and what `f32` rounds.
#[test]
fn over_a_metre_of_uneven_knots_the_streamed_spline_stays_on_the_global_one() {
    let chords = [40.0, 0.02, 90.0, 0.5, 7.0, 0.1, 61.0, 3.0, 0.05];
    let mut points = vec![[-500.0, 200.0, 0.0, 0.0, 0.0]];
    for k in 0..180_usize {
        let [x, y, z, a, c] = points[k];
        let (turn, h) = (k as f64 * 0.9, chords[k % chords.len()]);
        let wave = h * turn.sin();
        // To and fro between -500 mm and 500 mm.
        let by = if (k / 40).is_multiple_of(2) { h } else { -h };
        let at = [x + by, y + wave, z - 0.3 * wave, a + 0.2 * wave, c - wave];
        points.push(at.map(|value| (value * 1000.0).round() / 1000.0));
    }
    let natural = BoundaryCondition::Natural;
    let segments = spline(&points, spec(SplineKind::Cubic, natural, natural));
    hits_knots(&points, &segments);
    let h = oracle::chords(&points);
    for axis in 0..AXES {
        let y: Vec<f64> = points.iter().map(|point| point[axis]).collect();
        let pieces = oracle::cubic(&h, &y, End::Natural, End::Natural);
        for (path, piece) in segments.iter().zip(&pieces) {
            for u in [0.1, 0.3, 0.5, 0.7, 0.9] {
                let error = evaluate(&path.segment, u)[0][axis] - oracle::value(piece, u);
                assert!(
                    error.abs() < 3e-7 * scale(&path.segment),
                    "{}: {error}",
                    path.block
                );
            }
        }
    }
}

#[test]
fn segments_are_out_16_at_a_time_the_last_32_knots_after_its_end() {
    let config = config();
    let natural = BoundaryCondition::Natural;
    let motion = Motion::Spline(spec(SplineKind::Cubic, natural, natural));
    let mut builder = SegmentBuilder::new(&config, steps(&config, &[0.0; AXES]));
    for knot in 1..100_u32 {
        let x = f64::from(knot);
        let at = [x, (x * 0.7).sin(), 0.0, 0.0, 0.0];
        builder.push(&config, &block(knot, motion, &at)).unwrap();
        let out: Vec<u32> = core::iter::from_fn(|| builder.next(&config))
            .map(|path| path.block)
            .collect();
        let want = match knot.checked_sub(32) {
            Some(last) if last > 0 && last % 16 == 0 => (last - 15..=last).collect(),
            _ => Vec::new(),
        };
        assert_eq!(out, want, "after knot {knot}");
    }
}

#[test]
fn three_knots_without_a_condition_are_a_parabola() {
    let auto = BoundaryCondition::NotAKnot;
    let points = [
        [0.0; AXES],
        [3.0, 4.0, 0.0, 1.0, 0.0],
        [3.0, 14.0, 0.0, 7.0, -2.0],
    ];
    let segments = spline(&points, spec(SplineKind::Cubic, auto, auto));
    // Lagrange's parabola through (0, y0), (5, y1), (15, y2).
    let at = |t: f64, axis: usize| {
        points[0][axis] * (t - 5.0) * (t - 15.0) / 75.0
            + points[1][axis] * t * (t - 15.0) / -50.0
            + points[2][axis] * t * (t - 5.0) / 150.0
    };
    for axis in 0..AXES {
        let near = |u: f64| evaluate(&segments[0].segment, u)[0][axis] - at(5.0 * u, axis);
        let far = |u: f64| evaluate(&segments[1].segment, u)[0][axis] - at(5.0 + 10.0 * u, axis);
        assert!(near(0.4).abs() < 1e-5 && far(0.4).abs() < 1e-5);
    }
}
