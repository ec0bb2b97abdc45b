//! The thesis contour (shared facts 3) with 57 knots, against scipy: `tests/oracle/splines.py` wrote the table.

use super::support::*;
use crate::geometry::PathSegment;
use crate::nc::command::{BoundaryCondition, Motion, SplineKind};

const TABLE: &str = include_str!("../../../../tests/oracle/data/thesis57.csv");

/// (index, u, point) of all rows of `method`.
fn rows(method: &str) -> Vec<(usize, f64, Point)> {
    TABLE
        .lines()
        .skip(1)
        .map(|line| line.split(',').collect::<Vec<_>>())
        .filter(|row| row[0] == method)
        .map(|row| {
            let number = |k: usize| row[k].parse::<f64>().unwrap();
            let at = [number(3), number(4), number(5), 0.0, 0.0];
            (row[1].parse().unwrap(), number(2), at)
        })
        .collect()
}

fn knots() -> Vec<Point> {
    rows("knot").iter().map(|row| row.2).collect()
}

/// Largest distance between segments and table, mm.
fn deviation(method: &str, segments: &[PathSegment]) -> f64 {
    let table = rows(method);
    assert_eq!(table.len(), 3 * segments.len());
    table
        .iter()
        .map(|(index, u, at)| distance(&evaluate(&segments[*index].segment, *u)[0], at))
        .fold(0.0, f64::max)
}

/// A fifth of the resolution of an axis step of 1 um would do; this is `f32` slopes at their best.
const CLOSE: f64 = 2e-6;

#[test]
fn the_table_holds_57_knots_of_the_contour() {
    let knots = knots();
    assert_eq!(knots.len(), 57);
    for knot in &knots {
        let theta = knot[1].atan2(knot[0]);
        let r = 18.0 + 4.0 * (2.0 * theta).cos() * (6.0 * theta).cos();
        assert!((knot[0].hypot(knot[1]) - r).abs() < 0.004);
    }
}

#[test]
fn c_spline_agrees_with_scipy() {
    let knots = knots();
    for (method, condition) in [
        ("natural", BoundaryCondition::Natural),
        ("not-a-knot", BoundaryCondition::NotAKnot),
    ] {
        let segments = spline(&knots, spec(SplineKind::Cubic, condition, condition));
        hits_knots(&knots, &segments);
        let worst = deviation(method, &segments);
        assert!(worst < CLOSE, "{method}: {worst}");
    }
}

#[test]
fn c_spline_between_straight_blocks_agrees_with_scipy() {
    let knots = knots();
    let tangent = BoundaryCondition::Tangent;
    let motion = Motion::Spline(spec(SplineKind::Cubic, tangent, tangent));
    let mut start = knots[0];
    start[1] -= 3.0;
    let mut end = knots[56];
    end[1] += 5.0;
    let mut blocks = vec![block(1, Motion::Linear, &knots[0])];
    for knot in &knots[1..] {
        blocks.push(block(2, motion, knot));
    }
    blocks.push(block(3, Motion::Linear, &end));
    let segments = run(&start, &blocks).unwrap();
    is_tangent_continuous(&segments, 1e-6);
    let worst = deviation("clamped", &segments[1..57]);
    assert!(worst < CLOSE, "{worst}");
}

#[test]
fn a_spline_agrees_with_scipy() {
    let knots = knots();
    let auto = BoundaryCondition::NotAKnot;
    let worst = deviation(
        "akima",
        &spline(&knots, spec(SplineKind::Akima, auto, auto)),
    );
    assert!(worst < CLOSE, "{worst}");
}

#[test]
fn b_spline_agrees_with_scipy() {
    let knots = knots();
    let auto = BoundaryCondition::NotAKnot;
    let worst = deviation(
        "b-spline",
        &spline(&knots, spec(SplineKind::BSpline, auto, auto)),
    );
    assert!(worst < CLOSE, "{worst}");
}
