//! Test machine, programs, and the laws every path must obey.

use crate::config::{AxisConfig, AxisKind, Config};
use crate::geometry::{
    GeometryError, GeometryErrorKind, HermiteSegment, PathSegment, SegmentBuilder,
};
use crate::nc::command::{BoundaryCondition, Motion, Move, SplineKind, SplineSpec};
use crate::units::{Nano, Position, Steps, AXES};
use proptest::prelude::*;

pub type Point = [f64; AXES];

/// X Y Z linear, A C rotary, all 1000 steps per unit.
pub fn config() -> Config {
    let axis = |letter, kind| AxisConfig {
        letter,
        kind,
        steps_per_unit: Steps::from_num(1000),
        v_max: 600.0,
        a_max: 5000.0,
        j_max: 50_000.0,
        corner_step: 0.0,
        rounding_tolerance: 0.01,
        travel_min: -2_140_000_000_000,
        travel_max: 2_140_000_000_000,
    };
    Config {
        name: "test",
        axes: [
            axis(b'X', AxisKind::Linear),
            axis(b'Y', AxisKind::Linear),
            axis(b'Z', AxisKind::Linear),
            axis(b'A', AxisKind::Rotary),
            axis(b'C', AxisKind::Rotary),
        ],
        servo_hz: 5000,
        pulse_slots: 1,
        dir_setup_slots: 1,
        zero_offsets: [[0; AXES]; crate::config::ZERO_OFFSETS],
        reference_point: [0; AXES],
        fixed_point: [0; AXES],
        tools: [crate::config::ToolData::FREE; crate::config::TOOLS],
        head: crate::config::Head::CA,
        dialect: crate::config::Dialect::Sinumerik,
        plane: crate::nc::command::Plane::Xy,
        spline_begin: BoundaryCondition::Natural,
        spline_end: BoundaryCondition::Natural,
        arc_tolerance: 0.01,
        curve_tolerance: 1.0e-4,
        contour_tolerance: 0.05,
        default_feed: 0.0,
        default_soft: true,
        starve_ticks: 1000,
    }
}

pub fn spec(kind: SplineKind, begin: BoundaryCondition, end: BoundaryCondition) -> SplineSpec {
    SplineSpec {
        kind,
        begin,
        end,
        degree: 3,
        interval: None,
        weight: 1.0,
        first: false,
        axes: u8::MAX,
        tool_point: None,
    }
}

pub fn nano(point: &Point) -> [Nano; AXES] {
    point.map(|value| (value * 1e6).round() as Nano)
}

pub fn block(number: u32, motion: Motion, target: &Point) -> Move {
    Move {
        block: number,
        motion,
        target: nano(target),
        feed: 10.0,
        feed_type: Default::default(),
        exact_stop: false,
        soft: true,
        rounding: Default::default(),
        cutter: Default::default(),
    }
}

pub fn steps(config: &Config, point: &Point) -> Position {
    let target = nano(point);
    core::array::from_fn(|axis| config.steps_from_nano(axis, target[axis]).unwrap())
}

/// Runs blocks from `start`; segments after every block and after the end.
pub fn run(start: &Point, blocks: &[Move]) -> Result<Vec<PathSegment>, GeometryError> {
    let config = config();
    let mut builder = SegmentBuilder::new(&config, steps(&config, start));
    let mut out = Vec::new();
    for block in blocks {
        // Twice at most: a block that ends a rational B-spline waits for its last spans.
        if let Err(error) = builder.push(&config, block) {
            if error.kind != GeometryErrorKind::NotDrained {
                return Err(error);
            }
            out.extend(core::iter::from_fn(|| builder.next(&config)));
            builder.push(&config, block)?;
        }
        out.extend(core::iter::from_fn(|| builder.next(&config)));
    }
    while builder.is_open() {
        builder.finish(&config)?;
        out.extend(core::iter::from_fn(|| builder.next(&config)));
    }
    Ok(out)
}

/// A spline through (or along) `points`, the first being the start.
pub fn spline(points: &[Point], spec: SplineSpec) -> Vec<PathSegment> {
    let blocks: Vec<Move> = points[1..]
        .iter()
        .enumerate()
        .map(|(index, point)| block(index as u32 + 1, Motion::Spline(spec), point))
        .collect();
    run(&points[0], &blocks).unwrap()
}

/// Position, first and second derivative by u, mm or degree.
pub fn evaluate(segment: &HermiteSegment, u: f64) -> [Point; 3] {
    let [mut at, mut first, mut second] = [[0.0; AXES]; 3];
    for axis in 0..AXES {
        let p0 = segment.start[axis].to_num::<f64>() / 1000.0;
        let p1 = segment.end[axis].to_num::<f64>() / 1000.0;
        let (m0, m1) = (
            f64::from(segment.slope_start[axis]),
            f64::from(segment.slope_end[axis]),
        );
        let a = 2.0 * (p0 - p1) + m0 + m1;
        let b = 3.0 * (p1 - p0) - 2.0 * m0 - m1;
        at[axis] = ((a * u + b) * u + m0) * u + p0;
        first[axis] = (3.0 * a * u + 2.0 * b) * u + m0;
        second[axis] = 6.0 * a * u + 2.0 * b;
    }
    [at, first, second]
}

pub fn distance(a: &Point, b: &Point) -> f64 {
    (0..AXES)
        .map(|axis| (a[axis] - b[axis]).powi(2))
        .sum::<f64>()
        .sqrt()
}

pub fn norm(a: &Point) -> f64 {
    distance(a, &[0.0; AXES])
}

/// How large the numbers of a segment are: what `f32` rounding is relative to.
pub fn scale(segment: &HermiteSegment) -> f64 {
    let slope = |s: &[f32; AXES]| norm(&s.map(f64::from));
    slope(&segment.slope_start)
        + slope(&segment.slope_end)
        + distance(&evaluate(segment, 0.0)[0], &evaluate(segment, 1.0)[0])
}

/// Law: every segment starts on the bits on which the last one ended.
pub fn joins_exactly(start: &Position, segments: &[PathSegment]) {
    let mut at = *start;
    for path in segments {
        assert_eq!(path.segment.start, at, "line {}", path.block);
        at = path.segment.end;
    }
}

/// Law: segment k ends exactly on the programmed point k + 1.
pub fn hits_knots(points: &[Point], segments: &[PathSegment]) {
    let config = config();
    assert_eq!(segments.len() + 1, points.len());
    for (path, point) in segments.iter().zip(&points[1..]) {
        assert_eq!(
            path.segment.end,
            steps(&config, point),
            "line {}",
            path.block
        );
    }
}

/// Law: directions agree at every joint to `angle` radian. Cusps (a path that turns back on itself) have none.
pub fn is_tangent_continuous(segments: &[PathSegment], angle: f64) {
    for pair in segments.windows(2) {
        let a = pair[0].segment.slope_end.map(f64::from);
        let b = pair[1].segment.slope_start.map(f64::from);
        let (na, nb) = (norm(&a), norm(&b));
        if na < 1e-4 * scale(&pair[0].segment) || nb < 1e-4 * scale(&pair[1].segment) {
            continue;
        }
        let step = distance(&a.map(|x| x / na), &b.map(|x| x / nb));
        assert!(step < angle, "line {}: {step}", pair[1].block);
    }
}

/// Random points with coordinates of 0.001; some moves leave the linear axes alone, some the rotary ones.
pub fn points(count: impl Into<prop::collection::SizeRange>) -> impl Strategy<Value = Vec<Point>> {
    moves(count, 0)
}

/// As [`points`], but every move moves every axis.
pub fn flowing_points(
    count: impl Into<prop::collection::SizeRange>,
) -> impl Strategy<Value = Vec<Point>> {
    moves(count, 2)
}

fn moves(
    count: impl Into<prop::collection::SizeRange>,
    least: u8,
) -> impl Strategy<Value = Vec<Point>> {
    let move_by = (
        prop::array::uniform3(-20_000_i32..20_000),
        prop::array::uniform2(-5_000_i32..5_000),
        least..6,
    )
        .prop_map(|(linear, rotary, which)| {
            let mut by = [0.0; AXES];
            if which != 0 {
                by[..3].copy_from_slice(&linear.map(|value| f64::from(value) / 1000.0));
            }
            if which != 1 {
                by[3..].copy_from_slice(&rotary.map(|value| f64::from(value) / 1000.0));
            }
            // Never without motion.
            by[if which == 0 { 4 } else { 1 }] += 25.0;
            by
        });
    prop::collection::vec(move_by, count).prop_map(|moves| {
        let mut at = [3.0, -7.0, 1.5, 20.0, -4.0];
        let mut sign = 1.0;
        let mut out = vec![at];
        for by in moves {
            for axis in 0..AXES {
                at[axis] = ((at[axis] + sign * by[axis]) * 1000.0).round() / 1000.0;
            }
            sign = -sign;
            out.push(at);
        }
        out
    })
}
