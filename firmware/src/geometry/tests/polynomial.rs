//! `POLY` against Horner's scheme in `f64`, and a circle.

use super::support::*;
use crate::geometry::{GeometryErrorKind, PathSegment};
use crate::nc::command::{Motion, Polynomial};
use crate::units::AXES;
use proptest::prelude::*;

const ONE: [f64; 5] = [1.0, 0.0, 0.0, 0.0, 0.0];

fn poly(length: f64, coefficients: [[f64; 4]; AXES], denominator: [f64; 5]) -> Motion {
    Motion::Polynomial(Polynomial {
        length,
        numerators: u8::MAX,
        coefficients,
        denominator,
    })
}

/// a0 + a1 p + .. with a1 from the value at `length`.
fn horner(start: f64, end: f64, k: &[f64], length: f64, p: f64) -> f64 {
    let higher = |p: f64| k.iter().rev().fold(0.0, |sum, k| (sum + k) * p) * p;
    let a1 = (end - start - higher(length)) / length;
    start + a1 * p + higher(p)
}

/// The published curve of a block.
fn curve(start: &Point, end: &Point, block: &Polynomial, p: f64) -> Point {
    let [at_end, b @ ..] = block.denominator;
    let under = horner(1.0, at_end, &b, block.length, p);
    core::array::from_fn(|axis| {
        if block.numerators & (1 << axis) == 0 {
            return start[axis] + (end[axis] - start[axis]) * p / block.length;
        }
        let k = &block.coefficients[axis];
        horner(start[axis], end[axis] * at_end, k, block.length, p) / under
    })
}

/// Law: every segment runs within `tolerance` of the true curve; parameters are found by the shares of pieces.
fn is_curve(start: &Point, end: &Point, block: &Polynomial, path: &[PathSegment], tolerance: f64) {
    // Segments do not say which part of p they cover: the nearest point of a fine sampling is good enough an oracle.
    let fine: Vec<Point> = (0..=40_000)
        .map(|k| curve(start, end, block, block.length * f64::from(k) / 40_000.0))
        .collect();
    let grain = fine
        .windows(2)
        .map(|w| distance(&w[0], &w[1]))
        .fold(0.0, f64::max);
    let mut near = 0;
    for path in path {
        for k in 0..16 {
            let at = evaluate(&path.segment, f64::from(k) / 16.0)[0];
            // The curve is followed from front to back.
            while near + 1 < fine.len()
                && distance(&fine[near + 1], &at) <= distance(&fine[near], &at)
            {
                near += 1;
            }
            let [before, after] = [near.saturating_sub(1), (near + 1).min(fine.len() - 1)];
            let off = to_chord(&at, &fine[before], &fine[near]).min(to_chord(
                &at,
                &fine[near],
                &fine[after],
            ));
            assert!(
                off < tolerance + grain * 1e-3,
                "{off} at {k}, grain {grain}"
            );
        }
    }
    assert!(fine.len() - near < 4000, "{near}");
}

fn to_chord(at: &Point, a: &Point, b: &Point) -> f64 {
    let by: Point = core::array::from_fn(|axis| b[axis] - a[axis]);
    let square = norm(&by).powi(2);
    let along: f64 = (0..AXES).map(|axis| (at[axis] - a[axis]) * by[axis]).sum();
    let part = if square > 0.0 {
        (along / square).clamp(0.0, 1.0)
    } else {
        0.0
    };
    distance(at, &core::array::from_fn(|axis| a[axis] + part * by[axis]))
}

proptest! {
    #[test]
    fn cubics_are_one_exact_segment(
        k in prop::array::uniform5(prop::array::uniform2(-20.0..20.0_f64)),
        end in prop::array::uniform5(-50_000..50_000_i32),
        length in 0.2..3.0_f64,
    ) {
        let start = [1.5, -2.25, 100.0, 3.0, -4.0];
        let end = end.map(|value| f64::from(value) / 1000.0);
        let coefficients = k.map(|[a2, a3]| [a2, a3, 0.0, 0.0]);
        let motion = poly(length, coefficients, ONE);
        let path = run(&start, &[block(1, motion, &end)]).unwrap();
        prop_assert_eq!(path.len(), 1);
        for u in [0.0, 0.25, 0.5, 0.75, 1.0] {
            let at = evaluate(&path[0].segment, u)[0];
            for axis in 0..AXES {
                let want = horner(start[axis], end[axis], &coefficients[axis], length, u * length);
                prop_assert!((at[axis] - want).abs() < 1e-4, "{} for {want}", at[axis]);
            }
        }
        prop_assert_eq!(path[0].segment.end, steps(&config(), &end));
    }

    #[test]
    fn quintic_and_rational_curves_stay_within_the_tolerance(
        k in prop::array::uniform3(prop::array::uniform4(-20.0..20.0_f64)),
        b in prop::array::uniform4(0.0..0.5_f64),
        at_end in 0.7..3.0_f64,
        rational: bool,
        numerators in 0u8..32,
        length in 0.5..2.0_f64,
    ) {
        let (start, end) = ([1.5, -2.25, 100.0, 3.0, -4.0], [40.0, 3.0, 90.0, 8.0, -4.0]);
        let mut coefficients = [k[0], k[1], k[2], [0.0, 1.0, 0.0, 0.0], [0.0; 4]];
        for (axis, row) in coefficients.iter_mut().enumerate() {
            if numerators & (1 << axis) == 0 {
                *row = [0.0; 4];
            }
        }
        let denominator = if rational {
            [at_end, b[0], b[1], b[2], b[3]]
        } else {
            ONE
        };
        let curve = Polynomial { length, numerators, coefficients, denominator };
        // A b1 that makes the denominator small is another test.
        let path = match run(&start, &[block(1, Motion::Polynomial(curve), &end)]) {
            Err(error) if error.kind == GeometryErrorKind::Denominator => return Ok(()),
            other => other.unwrap(),
        };
        joins_exactly(&steps(&config(), &start), &path);
        prop_assert_eq!(path[path.len() - 1].segment.end, steps(&config(), &end));
        is_curve(&start, &end, &curve, &path, 1.0e-4);
        is_tangent_continuous(&path, 1e-4);
    }
}

#[test]
fn the_published_quarter_circle_is_a_circle() {
    let curve = poly(
        1.0,
        [
            [-10.0, 0.0, 0.0, 0.0],
            [0.0; 4],
            [0.0; 4],
            [0.0; 4],
            [0.0; 4],
        ],
        [2.0, 1.0, 0.0, 0.0, 0.0],
    );
    let path = run(
        &[10.0, 0.0, 0.0, 0.0, 0.0],
        &[block(1, curve, &[0.0, 10.0, 0.0, 0.0, 0.0])],
    )
    .unwrap();
    assert!(path.len() > 1);
    for path in &path {
        for k in 0..=16 {
            let at = evaluate(&path.segment, f64::from(k) / 16.0)[0];
            let radius = at[0].hypot(at[1]);
            assert!((radius - 10.0).abs() < 1e-4, "{radius}");
            assert!(at[0] > -1e-4 && at[1] > -1e-4 && at[2..] == [0.0; 3]);
        }
    }
}

#[test]
fn axes_that_stand_still_do_so_under_a_denominator() {
    let curve = Motion::Polynomial(Polynomial {
        length: 2.0,
        numerators: 0b1,
        coefficients: [[0.0, 0.3, 0.0, 0.1], [0.0; 4], [0.0; 4], [0.0; 4], [0.0; 4]],
        denominator: [1.5, 0.2, 0.0, 0.0, 0.0],
    });
    let start = [10.0, 77.0, -3.0, 5.0, 1.0];
    let end = [15.0, 77.0, -3.0, 5.0, 1.0];
    for path in run(&start, &[block(1, curve, &end)]).unwrap() {
        assert_eq!(path.segment.slope_start[1..], [0.0; 4]);
        assert_eq!(path.segment.end[1..], steps(&config(), &start)[1..]);
    }
}

#[test]
fn a_denominator_that_vanishes_is_refused_by_name() {
    // 1 + b1 p + b2 p^2 with b1 = e - 1 - b2: least at p = -b1 / 2 b2, 1 - b1^2 / 4 b2 there.
    for (at_end, b2, good) in [
        (1.0, 3.99, true),
        (1.0, 4.01, false),
        (1.0, 400.0, false),
        (0.0, 0.0, false),
        (-1.0, 0.0, false),
        (1e-3, 0.0, true),
        (f64::NAN, 0.0, false),
        (f64::INFINITY, 0.0, false),
        (1.0, f64::NAN, false),
        (2.0, -5.0, true),
    ] {
        let curve = poly(
            1.0,
            [[1.0, 0.0, 0.0, 0.0]; AXES],
            [at_end, b2, 0.0, 0.0, 0.0],
        );
        let result =
            run(&[0.0; AXES], &[block(1, curve, &[1.0; AXES])]).map_err(|error| error.kind);
        if good {
            result.unwrap();
        } else {
            assert_eq!(result, Err(GeometryErrorKind::Denominator), "{at_end} {b2}");
        }
    }
}

#[test]
fn numbers_beyond_reason_are_refused_by_name() {
    let with = |length, a5| {
        let curve = poly(length, [[0.0, 0.0, 0.0, a5]; AXES], ONE);
        run(&[0.0; AXES], &[block(1, curve, &[1.0; AXES])])
            .unwrap_err()
            .kind
    };
    for length in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert_eq!(with(length, 1.0), GeometryErrorKind::KnotInterval);
    }
    assert_eq!(with(1.0, f64::NAN), GeometryErrorKind::NotFinite);
    assert_eq!(with(1e200, 1.0), GeometryErrorKind::NotFinite);
    for a5 in [1e15, 1e30, 1e300] {
        let kind = with(1.0, a5);
        assert!(
            matches!(
                kind,
                GeometryErrorKind::OutOfRange { .. }
                    | GeometryErrorKind::Steep
                    | GeometryErrorKind::NotFinite
            ),
            "{kind:?}"
        );
    }
}
