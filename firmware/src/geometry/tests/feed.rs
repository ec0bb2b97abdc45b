//! `G93`: what leaves is millimetres (degrees) per second, whatever the block is.

use super::support::*;
use crate::geometry::PathSegment;
use crate::nc::command::{
    Arc, BoundaryCondition, Centre, CubicBlock, FeedType, Motion, Move, Plane, Polynomial,
    SplineKind,
};
use crate::units::AXES;
use core::f64::consts::PI;

/// Blocks per second.
const RATE: f32 = 0.25;

fn timed(motion: Motion, at: &Point) -> Move {
    let mut block = block(1, motion, at);
    block.feed = RATE;
    block.feed_type = FeedType::Inverse;
    block
}

/// Length of a path over the linear axes, or over the rotary ones: 2000 chords per segment.
fn length(path: &[PathSegment]) -> f64 {
    let mut sums = [0.0, 0.0];
    for path in path {
        let mut last = evaluate(&path.segment, 0.0)[0];
        for k in 1..=2000 {
            let at = evaluate(&path.segment, f64::from(k) / 2000.0)[0];
            let square = |axes: core::ops::Range<usize>| -> f64 {
                axes.map(|axis| (at[axis] - last[axis]).powi(2)).sum()
            };
            sums[0] += square(0..3).sqrt();
            sums[1] += square(3..5).sqrt();
            last = at;
        }
    }
    if sums[0] > 0.0 {
        sums[0]
    } else {
        sums[1]
    }
}

/// Law: all segments of the block take `1 / RATE` together, at one feed.
fn takes_its_time(path: &[PathSegment]) {
    let want = length(path) * f64::from(RATE);
    for path in path {
        let error = f64::from(path.feed) / want - 1.0;
        assert!(
            error.abs() < 1e-4,
            "line {}: {} for {want}",
            path.block,
            path.feed
        );
    }
}

#[test]
fn a_line_takes_the_programmed_time() {
    let path = run(
        &[0.0; AXES],
        &[timed(Motion::Linear, &[3.0, 4.0, 0.0, 90.0, 0.0])],
    )
    .unwrap();
    assert_eq!(path[0].feed, 5.0 * RATE);
    let path = run(
        &[0.0; AXES],
        &[timed(Motion::Linear, &[0.0, 0.0, 0.0, 30.0, -40.0])],
    )
    .unwrap();
    assert_eq!(path[0].feed, 50.0 * RATE);
    let path = run(
        &[0.0; AXES],
        &[timed(Motion::Rapid, &[3.0, 4.0, 0.0, 0.0, 0.0])],
    )
    .unwrap();
    assert_eq!(path[0].feed, f32::INFINITY);
}

#[test]
fn an_arc_takes_the_programmed_time() {
    let arc = |turns| {
        Motion::Arc(Arc {
            plane: Plane::Xy,
            clockwise: false,
            centre: Centre::Point([0, 0]),
            turns,
        })
    };
    let start = [10.0, 0.0, 0.0, 0.0, 0.0];
    let path = run(&start, &[timed(arc(0), &[-10.0, 0.0, 0.0, 45.0, 0.0])]).unwrap();
    assert!((f64::from(path[0].feed) - 10.0 * PI * 0.25).abs() < 1e-5);
    takes_its_time(&path);
    // A helix with a pitch, and radii of 10 and 10.009 mm.
    let path = run(&start, &[timed(arc(2), &[-10.009, 0.0, 70.0, 0.0, 0.0])]).unwrap();
    takes_its_time(&path);
}

#[test]
fn a_spiral_of_small_radius_takes_the_programmed_time() {
    let arc = Motion::Arc(Arc {
        plane: Plane::Xy,
        clockwise: false,
        centre: Centre::Point([0, 0]),
        turns: 0,
    });
    // An eighth of a turn, the radius from 0.05 to 0.06 mm: the mean radius alone is 1e-2 off.
    let start = [0.05, 0.0, 0.0, 0.0, 0.0];
    let by = 0.06 * 0.5_f64.sqrt();
    let path = run(&start, &[timed(arc, &[by, by, 0.0, 0.0, 0.0])]).unwrap();
    // Radius R over an angle of a, growing by g: the integral of sqrt((R a)^2 + g^2) over its share.
    let (a, g) = (PI / 4.0, 0.01);
    let speed = |t: f64| ((0.05 + g * t) * a).hypot(g);
    let parts = 2000;
    let sum: f64 = (0..parts)
        .map(|k| speed((f64::from(k) + 0.5) / f64::from(parts)))
        .sum();
    let want = sum / f64::from(parts) * f64::from(RATE);
    let error = f64::from(path[0].feed) / want - 1.0;
    // End points are whole 1e-6 mm.
    assert!(error.abs() < 2e-5, "{error}");
}

#[test]
fn curves_take_the_programmed_time() {
    let curve = |a4| {
        Motion::Polynomial(Polynomial {
            length: 1.0,
            numerators: u8::MAX,
            coefficients: [
                [5.0, 0.0, a4, 0.0],
                [-30.0, 3.0, 0.0, 0.0],
                [0.0; 4],
                [0.0; 4],
                [0.0; 4],
            ],
            denominator: [1.0, 0.0, 0.0, 0.0, 0.0],
        })
    };
    for a4 in [0.0, 20.0] {
        let path = run(
            &[0.0; AXES],
            &[timed(curve(a4), &[40.0, 1.0, 0.0, 0.0, 0.0])],
        )
        .unwrap();
        assert_eq!(path.len() > 1, a4 != 0.0);
        takes_its_time(&path);
    }
    // x = 10 (1 - s)^2 towards its start at rest: P(i) = K2 i^2, I = 10, ends with no slope.
    let mut k = [[0; 3]; AXES];
    k[0] = [0, (0.1 * (1_u64 << 41) as f64 / 1000.0) as i64, 0];
    k[1] = [0, 0, 1 << 28];
    let cubic = Motion::Cubic(CubicBlock {
        length: 10_000_000,
        k,
    });
    let path = run(&[10.0, 10.0, 0.0, 0.0, 0.0], &[timed(cubic, &[0.0; AXES])]).unwrap();
    takes_its_time(&path);
}

#[test]
fn every_point_of_a_spline_takes_the_programmed_time() {
    for kind in [SplineKind::Akima, SplineKind::Cubic, SplineKind::BSpline] {
        let auto = BoundaryCondition::NotAKnot;
        let blocks: Vec<Move> = (1..60)
            .map(|k| {
                let x = f64::from(k);
                let mut block = timed(
                    Motion::Spline(spec(kind, auto, auto)),
                    &[x * 2.0, 5.0 * (x * 0.8).sin(), 0.0, x, 0.0],
                );
                block.block = k;
                block
            })
            .collect();
        let path = run(&[0.0; AXES], &blocks).unwrap();
        for of_block in path.chunk_by(|a, b| a.block == b.block) {
            takes_its_time(of_block);
        }
    }
}
