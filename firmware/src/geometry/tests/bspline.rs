//! B-splines.

use super::oracle;
use super::support::*;
use crate::geometry::GeometryErrorKind;
use crate::nc::command::{BoundaryCondition, Motion, Move, SplineKind, SplineSpec};
use crate::units::AXES;
use proptest::prelude::*;

fn base(degree: u8) -> SplineSpec {
    SplineSpec {
        degree,
        ..spec(
            SplineKind::BSpline,
            BoundaryCondition::NotAKnot,
            BoundaryCondition::NotAKnot,
        )
    }
}

fn blocks(points: &[Point], degree: u8, intervals: &[Option<f32>]) -> Vec<Move> {
    points[1..]
        .iter()
        .enumerate()
        .map(|(index, point)| {
            let spec = SplineSpec {
                interval: intervals.get(index).copied().flatten(),
                ..base(degree)
            };
            block(index as u32 + 1, Motion::Spline(spec), point)
        })
        .collect()
}

proptest! {
    #[test]
    fn b_spline_is_cox_de_boors(
        points in points(3..30),
        degree in 2_u8..=3,
        intervals in prop::collection::vec(prop::option::of(0.2_f32..4.0), 0..30),
    ) {
        let degree_size = usize::from(degree);
        let segments = run(&points[0], &blocks(&points, degree, &intervals)).unwrap();
        joins_exactly(&steps(&config(), &points[0]), &segments);
        is_tangent_continuous(&segments, 1e-5);
        // Span j is as long as the block of control point j + degree says.
        let spans: Vec<f64> = (degree_size..points.len())
            .map(|index| intervals.get(index - 1).copied().flatten().map_or(1.0, f64::from))
            .collect();
        prop_assert_eq!(segments.len(), spans.len());
        let knots = oracle::clamped(degree_size, &spans);
        for (index, path) in segments.iter().enumerate() {
            prop_assert_eq!(path.block as usize, index + degree_size);
            for u in [0.1, 0.3, 0.5, 0.7, 0.9] {
                let t = knots[index + degree_size] + u * spans[index];
                let want = oracle::b_spline(degree_size, &knots, &points, t);
                let error = distance(&evaluate(&path.segment, u)[0], &want);
                prop_assert!(error < 2e-6 * (scale(&path.segment) + 50.0), "{}: {error}", path.block);
            }
        }
        let last = segments[segments.len() - 1];
        prop_assert_eq!(last.segment.end, steps(&config(), &points[points.len() - 1]));
    }

    #[test]
    fn both_ends_are_tangent_to_the_polygon(points in points(1..30), degree in 2_u8..=3) {
        prop_assume!(points.len() > usize::from(degree));
        let segments = run(&points[0], &blocks(&points, degree, &[])).unwrap();
        let unit = |v: Point| v.map(|x| x / norm(&v));
        let edge = |a: usize, b: usize| unit(core::array::from_fn(|axis| points[b][axis] - points[a][axis]));
        let n = points.len() - 1;
        let first = unit(segments[0].segment.slope_start.map(f64::from));
        let last = unit(segments[segments.len() - 1].segment.slope_end.map(f64::from));
        prop_assert!(distance(&first, &edge(0, 1)) < 1e-6);
        prop_assert!(distance(&last, &edge(n - 1, n)) < 1e-6);
    }

    #[test]
    fn coincident_control_points_are_legal(
        corners in points(1..12),
        repeat in prop::collection::vec(1_usize..6, 13),
        degree in 2_u8..=3,
    ) {
        let points: Vec<Point> = corners
            .iter()
            .zip(&repeat)
            .flat_map(|(point, count)| core::iter::repeat_n(*point, *count))
            .collect();
        prop_assume!(points.len() > usize::from(degree));
        let segments = run(&points[0], &blocks(&points, degree, &[])).unwrap();
        joins_exactly(&steps(&config(), &points[0]), &segments);
        // The parameter moves everywhere, and the path is the curve.
        let size = usize::from(degree);
        let spans = vec![1.0; points.len() - size];
        let knots = oracle::clamped(size, &spans);
        let curve: Vec<Point> = (0..spans.len() * 200)
            .map(|k| oracle::b_spline(size, &knots, &points, k as f64 / 200.0))
            .chain([points[points.len() - 1]])
            .collect();
        for path in &segments {
            for slope in [path.segment.slope_start, path.segment.slope_end] {
                prop_assert!(norm(&slope.map(f64::from)) > 0.0, "line {}", path.block);
            }
            for u in [0.25, 0.5, 0.75] {
                let at = evaluate(&path.segment, u)[0];
                let near = curve.windows(2).map(|pair| to_line(&at, &pair[0], &pair[1]));
                let error = near.fold(f64::INFINITY, f64::min);
                prop_assert!(error < 2e-3, "line {}: {error}", path.block);
            }
        }
        if let Some(last) = segments.last() {
            prop_assert_eq!(last.segment.end, steps(&config(), &points[points.len() - 1]));
        }
    }
}

/// Distance of a point from the line between two others.
fn to_line(at: &Point, a: &Point, b: &Point) -> f64 {
    let edge: Point = core::array::from_fn(|axis| b[axis] - a[axis]);
    let square = norm(&edge).powi(2).max(1e-30);
    let along: f64 = (0..AXES)
        .map(|axis| (at[axis] - a[axis]) * edge[axis])
        .sum();
    let part = (along / square).clamp(0.0, 1.0);
    let foot = core::array::from_fn(|axis| a[axis] + part * edge[axis]);
    distance(at, &foot)
}

proptest! {
    #[test]
    fn knots_may_coincide_as_often_as_the_degree(
        points in points(4..24),
        degree in 1_u8..=3,
        lengths in prop::collection::vec((0.2_f32..4.0, any::<bool>()), 24),
    ) {
        let size = usize::from(degree);
        let count = points.len() - size;
        let mut equal = size;
        let spans: Vec<f32> = lengths[..count]
            .iter()
            .enumerate()
            .map(|(index, (length, zero))| {
                equal += 1;
                if *zero && equal < size && index + 1 < count {
                    return 0.0;
                }
                equal = 0;
                *length
            })
            .collect();
        let intervals: Vec<Option<f32>> = core::iter::repeat_n(None, size - 1)
            .chain(spans.iter().copied().map(Some))
            .collect();
        let segments = run(&points[0], &blocks(&points, degree, &intervals)).unwrap();
        joins_exactly(&steps(&config(), &points[0]), &segments);
        let wide: Vec<f64> = spans.iter().map(|span| f64::from(*span)).collect();
        let knots = oracle::clamped(size, &wide);
        let solid: Vec<usize> = (0..count).filter(|k| spans[*k] > 0.0).collect();
        prop_assert_eq!(segments.len(), solid.len());
        for (path, index) in segments.iter().zip(solid) {
            prop_assert_eq!(path.block as usize, index + size);
            for u in [0.1, 0.3, 0.5, 0.7, 0.9] {
                let t = knots[index + size] + u * wide[index];
                let want = oracle::b_spline(size, &knots, &points, t);
                let error = distance(&evaluate(&path.segment, u)[0], &want);
                prop_assert!(error < 2e-6 * (scale(&path.segment) + 50.0), "{}: {error}", path.block);
            }
        }
    }

    #[test]
    fn cubic_is_curvature_continuous_at_simple_knots(points in points(4..20)) {
        let segments = run(&points[0], &blocks(&points, 3, &[])).unwrap();
        for pair in segments.windows(2) {
            let [before, after] = [evaluate(&pair[0].segment, 1.0)[2], evaluate(&pair[1].segment, 0.0)[2]];
            let size = scale(&pair[0].segment) + scale(&pair[1].segment);
            prop_assert!(distance(&before, &after) < 1e-5 * size);
        }
    }
}

#[test]
fn knots_that_tear_the_curve_are_refused() {
    let points: Vec<Point> = (0..9)
        .map(|k| [f64::from(k), f64::from(k * k % 5), 0.0, 0.0, 0.0])
        .collect();
    for degree in 1..=3_u8 {
        let size = usize::from(degree);
        let zeros = |at: &[usize]| {
            let mut intervals = vec![Some(1.0); 8];
            for index in at {
                intervals[index - 1] = Some(0.0);
            }
            run(&points[0], &blocks(&points, degree, &intervals))
                .map_err(|error| (error.block, error.kind))
        };
        // At the start, one too many inside, at the end.
        let torn = |block: usize| Err((block as u32, GeometryErrorKind::KnotInterval));
        assert_eq!(zeros(&[size]), torn(size));
        let inside: Vec<usize> = (size + 1..=2 * size).collect();
        assert_eq!(zeros(&inside), torn(2 * size));
        assert_eq!(zeros(&[8]), torn(8));
        assert!(zeros(&inside[1..]).is_ok());
    }
}

#[test]
fn fewer_points_than_the_degree_asks_for_are_refused() {
    let points = [
        [0.0; AXES],
        [1.0; AXES],
        [2.0, 3.0, 1.0, 0.0, 0.0],
        [4.0; AXES],
    ];
    for degree in 1..=3_u8 {
        for count in 2..=4_usize {
            let result = run(&points[0], &blocks(&points[..count], degree, &[]));
            if count > usize::from(degree) {
                assert!(result.is_ok());
            } else {
                let error = result.unwrap_err();
                let kind = GeometryErrorKind::TooFewPoints {
                    least: degree + 1,
                    got: count as u8,
                };
                assert_eq!((error.block as usize, error.kind), (count - 1, kind));
            }
        }
    }
}

#[test]
fn a_cubic_span_needs_the_two_spans_behind_it() {
    let config = config();
    let mut builder = crate::geometry::SegmentBuilder::new(&config, steps(&config, &[0.0; AXES]));
    for knot in 1..40_u32 {
        let x = f64::from(knot);
        let at = [x, (x * 0.7).sin(), 0.0, 0.0, 0.0];
        builder
            .push(&config, &block(knot, Motion::Spline(base(3)), &at))
            .unwrap();
        let got = builder.next(&config).map(|path| path.block);
        assert_eq!(got, knot.checked_sub(2).filter(|k| *k > 2));
    }
}

#[test]
fn degree_and_interval_must_make_sense() {
    let points = [[0.0; AXES], [1.0; AXES], [2.0, 3.0, 1.0, 0.0, 0.0]];
    for degree in [0, 4] {
        let error = run(&points[0], &blocks(&points, degree, &[])).unwrap_err();
        assert_eq!((error.block, error.kind), (1, GeometryErrorKind::Degree));
    }
    for interval in [-1.0, f32::NAN, f32::INFINITY] {
        let error = run(&points[0], &blocks(&points, 3, &[None, Some(interval)])).unwrap_err();
        assert_eq!(
            (error.block, error.kind),
            (2, GeometryErrorKind::KnotInterval)
        );
    }
    let mut mixed = blocks(&points, 3, &[]);
    mixed[1].motion = Motion::Spline(base(2));
    assert_eq!(
        run(&points[0], &mixed).unwrap_err().kind,
        GeometryErrorKind::Degree
    );
}
