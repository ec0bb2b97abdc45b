//! Curved contours: the centre path keeps its distance within half a micrometre everywhere, and stays smooth.

use super::support::*;
use crate::geometry::PathSegment;
use crate::nc::command::{BoundaryCondition, Cutter, Side, SplineKind};
use proptest::prelude::*;

#[test]
fn a_circle_becomes_the_circle_one_radius_larger_or_smaller() {
    for (side, want) in [(Side::Left, 8.0), (Side::Right, 12.0)] {
        let round = circle(10.0, 8, cutter(side, 2.0));
        let path = contour(&round);
        is_smooth(&path, 1e-5);
        for p in sample(&path, 50) {
            assert!((p[0].hypot(p[1]) - want).abs() < 5e-4, "{p:?}");
        }
        let last = xy(mm(&path.last().unwrap().segment.end));
        assert!(distance(last, [want, 0.0]) < 1e-6, "{last:?}");
    }
}

/// Ellipse as cubics at even steps of its angle.
fn ellipse(a: f64, b: f64, pieces: usize, cutter: Cutter) -> Vec<PathSegment> {
    let step = std::f64::consts::TAU / pieces as f64;
    (0..pieces)
        .map(|i| {
            let on = |i: usize| {
                let (s, c) = (step * i as f64).sin_cos();
                ([a * c, b * s], [-a * s * step, b * c * step])
            };
            let ((p0, m0), (p1, m1)) = (on(i), on(i + 1));
            curve(i as u32 + 1, p0, p1, m0, m1, cutter)
        })
        .collect()
}

#[test]
fn an_ellipse_is_followed_on_both_sides() {
    // Least radius of curvature b^2 / a = 5 mm.
    for side in [Side::Left, Side::Right] {
        let oval = ellipse(20.0, 10.0, 24, cutter(side, 4.0));
        let path = contour(&oval);
        touches(&oval, &path, 4.0, 400);
        is_smooth(&path, 1e-4);
    }
}

#[test]
fn the_tool_may_leave_what_the_tolerance_allows_in_a_tight_curve() {
    // Least radius 1.8 mm, tool 2 mm: an A-spline through points of the thesis contour does the same.
    let b = (20.0_f64 * 1.8).sqrt();
    let oval = ellipse(20.0, b, 48, cutter(Side::Left, 2.0));
    // From the flat side, so that both tight ends lie inside the contour.
    let mut turned = oval[12..].to_vec();
    turned.extend_from_slice(&oval[..12]);
    let path = contour(&turned);
    touches(&turned, &path, 2.0, 400);
    // What is left is within the tolerance: seen from the contour.
    let centres = sample(&path, 50);
    let left = sample(&turned, 20)
        .iter()
        .map(|p| distance_to(*p, &centres) - 2.0)
        .fold(0.0, f64::max);
    assert!((0.001..0.0505).contains(&left), "{left}");
}

/// The thesis contour r = 18 + 4 cos 2t cos 6t on `count` knots as an A-spline, closed by hand.
fn thesis(kind: SplineKind, count: usize, cutter: Cutter) -> Vec<PathSegment> {
    use crate::geometry::SegmentBuilder;
    use crate::nc::command::{Motion, Move, SplineSpec};
    let config = config();
    let point = |k: usize| {
        let t = std::f64::consts::TAU * k as f64 / count as f64;
        let r = 18.0 + 4.0 * (2.0 * t).cos() * (6.0 * t).cos();
        [r * t.cos(), r * t.sin()].map(|v| (v * 1e3).round() as i64 * 1000)
    };
    let first = point(0);
    let target = |p: [i64; 2]| [p[0], p[1], 0, 0, 0];
    let start = core::array::from_fn(|k| config.steps_from_nano(k, target(first)[k]).unwrap());
    let mut builder = SegmentBuilder::new(&config, start);
    let mut out = Vec::new();
    for k in 1..=count {
        let spec = SplineSpec {
            kind,
            begin: BoundaryCondition::NotAKnot,
            end: BoundaryCondition::NotAKnot,
            degree: 3,
            interval: None,
            weight: 1.0,
            first: k == 1,
            axes: u8::MAX,
            tool_point: None,
        };
        let block = Move {
            block: k as u32,
            motion: Motion::Spline(spec),
            target: target(point(k)),
            feed: 20.0,
            feed_type: Default::default(),
            exact_stop: false,
            soft: true,
            rounding: Default::default(),
            cutter,
        };
        builder.push(&config, &block).unwrap();
        while let Some(segment) = builder.next(&config) {
            out.push(segment);
        }
    }
    builder.finish(&config).unwrap();
    while let Some(segment) = builder.next(&config) {
        out.push(segment);
    }
    out
}

#[test]
fn the_thesis_contour_runs_with_the_thesis_tool() {
    for kind in [SplineKind::Akima, SplineKind::Cubic] {
        for count in [24, 57, 72] {
            // Inside the contour, coarse knots leave more than the tolerance; it was machined outside.
            let sides = if count < 72 { 1 } else { 2 };
            for side in [Side::Right, Side::Left].into_iter().take(sides) {
                let spline = thesis(kind, count, cutter(side, 2.0));
                let path = contour(&spline);
                // The ends of an open spline do not join smoothly; the window does not reach around the whole contour.
                let margin = count as u32 / 12;
                let inner: Vec<PathSegment> = path
                    .iter()
                    .copied()
                    .filter(|s| s.block > margin && s.block <= count as u32 - margin)
                    .collect();
                touches(&spline, &inner, 2.0, 150);
                let centres = sample(&path, 50);
                for p in sample(&spline, 10) {
                    let left = distance_to(p, &centres) - 2.0;
                    assert!(left < 0.0505, "{kind:?} {count} {side:?}: {left}");
                }
            }
        }
    }
}

/// Smooth wave along x: heights at even knots, C-spline like slopes by central differences.
fn wave(heights: &[f64], cutter: Cutter) -> Vec<PathSegment> {
    let at = |k: usize| [6.0 * k as f64, heights[k]];
    let slope = |k: usize| {
        let (a, b) = (k.saturating_sub(1), (k + 1).min(heights.len() - 1));
        [6.0, (heights[b] - heights[a]) / (b - a) as f64]
    };
    (1..heights.len())
        .map(|k| curve(k as u32, at(k - 1), at(k), slope(k - 1), slope(k), cutter))
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn no_random_wave_is_gouged(
        heights in prop::collection::vec(-4.0_f64..4.0, 4..14),
        left in any::<bool>(),
        radius in 0.5_f64..5.0,
    ) {
        let side = if left { Side::Left } else { Side::Right };
        let radius = (radius * 1e3).round() / 1e3;
        let wave = wave(&heights, cutter(side, radius));
        let (path, error) = try_contour(&wave);
        if let Some(error) = error {
            prop_assert!((170..173).contains(&error.code()), "{error}");
            // Nothing that was handed out gouges.
            touches(&wave, &path, radius, 300);
        } else {
            touches(&wave, &path, radius, 300);
            // Nothing is left but what the tolerance allows (the knots are smooth).
            let centres = sample(&path, 60);
            for p in sample(&wave, 10) {
                let left = distance_to(p, &centres) - radius;
                prop_assert!(left < 0.051, "{left}");
            }
        }
    }
}

#[test]
fn inner_corners_between_curves_are_cut_at_the_crossing() {
    // Two quarter circles of 10 mm that meet in an inner corner.
    let k = 4.0 * 10.0 * (std::f64::consts::FRAC_PI_8).tan();
    let g41 = cutter(Side::Left, 3.0);
    let arcs = vec![
        curve(1, [0.0, 0.0], [10.0, 10.0], [k, 0.0], [0.0, k], g41),
        curve(2, [10.0, 10.0], [0.0, 20.0], [-k, 0.0], [0.0, k], g41),
    ];
    let path = contour(&arcs);
    touches(&arcs, &path, 3.0, 2000);
    assert!(path.iter().any(|s| s.block == 1) && path.iter().any(|s| s.block == 2));
}

#[test]
fn a_cusp_inside_one_cubic_is_run_around() {
    // x = u^2 - u, y = (u - 1/2)^3: cusp at u = 1/2.
    for side in [Side::Left, Side::Right] {
        let cusp = vec![curve(
            1,
            [0.0, -5.0],
            [0.0, 5.0],
            [-40.0, 30.0],
            [40.0, 30.0],
            cutter(side, 0.5),
        )];
        let (path, error) = try_contour(&cusp);
        match error {
            None => touches(&cusp, &path, 0.5, 2000),
            Some(error) => assert!((170..173).contains(&error.code()), "{error}"),
        }
    }
}
