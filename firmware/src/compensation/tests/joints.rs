//! Corners of straight contours: exact coordinates, no gouge, nothing left but in corners.

use super::support::*;
use crate::nc::command::{Corner, Side};
use proptest::prelude::*;

/// Counter-clockwise square of 20 mm from the middle of its lower edge.
const SQUARE: [P; 6] = [
    [10.0, 0.0],
    [20.0, 0.0],
    [20.0, 20.0],
    [0.0, 20.0],
    [0.0, 0.0],
    [10.0, 0.0],
];

fn ends(path: &[crate::geometry::PathSegment]) -> Vec<P> {
    path.iter().map(|s| xy(mm(&s.segment.end))).collect()
}

fn near(got: &[P], want: &[P]) {
    assert_eq!(got.len(), want.len(), "{got:?}");
    for (a, b) in got.iter().zip(want) {
        assert!(distance(*a, *b) < 1e-9, "{got:?}");
    }
}

#[test]
fn inside_a_square_the_path_is_the_smaller_square() {
    let path = contour(&polyline(&SQUARE, cutter(Side::Left, 2.0)));
    near(
        &ends(&path),
        &[
            [18.0, 2.0],
            [18.0, 18.0],
            [2.0, 18.0],
            [2.0, 2.0],
            [10.0, 2.0],
        ],
    );
    let blocks: Vec<u32> = path.iter().map(|s| s.block).collect();
    assert_eq!(blocks, [1, 2, 3, 4, 5]);
}

#[test]
fn intersection_corners_outside_a_square_make_the_larger_square() {
    let mut g451 = cutter(Side::Right, 3.0);
    g451.corner = Corner::Intersection;
    let path = contour(&polyline(&SQUARE, g451));
    near(
        &ends(&path),
        &[
            [20.0, -3.0],
            [23.0, -3.0],
            [23.0, 0.0],
            [23.0, 20.0],
            [23.0, 23.0],
            [20.0, 23.0],
            [0.0, 23.0],
            [-3.0, 23.0],
            [-3.0, 20.0],
            [-3.0, 0.0],
            [-3.0, -3.0],
            [0.0, -3.0],
            [10.0, -3.0],
        ],
    );
}

#[test]
fn arcs_outside_a_square_keep_the_radius_and_run_from_edge_to_edge() {
    let square = polyline(&SQUARE, cutter(Side::Right, 3.0));
    let path = contour(&square);
    touches(&square, &path, 3.0, 1);
    is_smooth(&path, 1e-6);
    let got = ends(&path);
    for corner in [
        [20.0, -3.0],
        [23.0, 0.0],
        [23.0, 20.0],
        [20.0, 23.0],
        [0.0, 23.0],
        [-3.0, 20.0],
        [-3.0, 0.0],
        [0.0, -3.0],
    ] {
        assert!(
            got.iter().any(|p| distance(*p, corner) < 1e-9),
            "{corner:?}"
        );
    }
}

#[test]
fn a_sharp_corner_is_rounded_even_with_intersections() {
    let mut g451 = cutter(Side::Left, 1.0);
    g451.corner = Corner::Intersection;
    // 170 degrees to the right: the intersection would be 11 mm away.
    let spike = polyline(&[[0.0, 0.0], [30.0, 0.0], [0.0, -5.0]], g451);
    let path = contour(&spike);
    touches(&spike, &path, 1.0, 1);
    assert!(ends(&path).iter().all(|p| p[0] < 31.1));
}

#[test]
fn a_spur_is_run_around_its_tip() {
    let spur = polyline(
        &[[0.0, 0.0], [10.0, 0.0], [1.0, 0.0]],
        cutter(Side::Right, 2.0),
    );
    let path = contour(&spur);
    touches(&spur, &path, 2.0, 1);
    near(&ends(&path)[path.len() - 1..], &[[1.0, 2.0]]);
}

#[test]
fn a_concave_polyline_of_a_radius_slightly_over_the_tool_runs() {
    // Radius 2.05 in steps of 3 degrees: chords of 0.1 mm, the offsets are 2.6 um long.
    let points: Vec<P> = (0..=60)
        .map(|k| {
            let (s, c) = (f64::from(k) * 3.0_f64).to_radians().sin_cos();
            [2.05 * c, 2.05 * s]
        })
        .collect();
    let arc = polyline(&points, cutter(Side::Left, 2.0));
    let path = contour(&arc);
    touches(&arc, &path, 2.0, 1);
}

#[test]
fn a_short_step_between_inner_corners_is_swallowed_within_the_tolerance() {
    // A notch of 20 um in the wall of an inner corner of 150 degrees.
    let at =
        |bend: f64| -> Vec<P> { vec![[0.0, 0.0], [20.0, 0.0], [20.02, bend], [40.0, 2.0 + bend]] };
    let wall = polyline(&at(0.001), cutter(Side::Left, 5.0));
    let path = contour(&wall);
    touches(&wall, &path, 5.0, 1);
    assert!(path.iter().all(|s| s.block != 2), "block 2 has no place");
}

/// Simple star polygons about the origin, seeded by radii and a start in the middle of an edge.
fn star() -> impl Strategy<Value = Vec<P>> {
    prop::collection::vec(10.0_f64..30.0, 5..12).prop_map(|radii| {
        let count = radii.len();
        let corner = |k: usize| {
            let (s, c) = (std::f64::consts::TAU * (k % count) as f64 / count as f64).sin_cos();
            let r = radii[k % count];
            [(r * c * 1e3).round() / 1e3, (r * s * 1e3).round() / 1e3]
        };
        let (a, b) = (corner(0), corner(1));
        let middle = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
        let mut points = vec![middle];
        points.extend((1..=count).map(corner));
        points.push(middle);
        points
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn no_random_polygon_is_gouged(points in star(), left in any::<bool>(), radius in 0.2_f64..6.0) {
        let radius = (radius * 1e3).round() / 1e3;
        let side = if left { Side::Left } else { Side::Right };
        let polygon = polyline(&points, cutter(side, radius));
        let (path, error) = try_contour(&polygon);
        match error {
            // Refused by name; where the window holds the whole contour, before the tool has moved.
            Some(error) => prop_assert!(path.is_empty() || points.len() > 7, "{error}"),
            None => touches(&polygon, &path, radius, 1),
        }
    }
}
