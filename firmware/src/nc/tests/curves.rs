//! Laws of the words of splines and polynomials.

use super::{equipped, micro, moves, refusal, specs, xyzac};
use crate::config::{Config, Head};
use crate::nc::command::Polynomial;
use crate::nc::{Motion, Move};
use crate::units::{Nano, AXES, NANO_PER_UNIT};

#[test]
fn a_spline_path_stays_until_the_next_one_or_the_end_of_the_program() {
    let paths: Vec<_> = specs(
        &xyzac(),
        "F60 CSPLINE X1\nSPLINEPATH(1,X,Y,Z,A)\nX2\nG1 X3\nCSPLINE X4\nSPLINEPATH XC X5\nSPLINEPATHYX6\n\
         SPLINEPATH\nX7\nSPLINEPATH X\nM30\nF60 CSPLINE X1",
    )
    .iter()
    .map(|spec| spec.axes)
    .collect();
    assert_eq!(paths, [255, 0b01111, 0b01111, 0b10001, 0b00010, 255, 255]);
}

#[test]
fn the_second_curve_is_shifted_like_the_first() {
    let program = "T4 M6 G55 G1 F60 X0 Y0 Z0\nBSPLINE X1 XH=1 YH=2 ZH=10\nX2XH2YH3ZH11";
    let points: Vec<_> = specs(&equipped(), program)
        .iter()
        .map(|spec| {
            spec.tool_point
                .map(|point| point.map(|value| value / NANO_PER_UNIT))
        })
        .collect();
    assert_eq!(points, [Some([2, 4, 93]), Some([3, 5, 94])]);
    assert_eq!(specs(&equipped(), "F60 BSPLINE X1\nX2")[1].tool_point, None);
    let mut stiff = equipped();
    stiff.head = Head::None;
    assert_eq!(
        refusal(&stiff, "F60 BSPLINE X1 XH=1 YH=2 ZH=3"),
        "1:16 144 XH YH ZH need rotary axes that turn the tool"
    );
}

/// The only polynomial of `program`, where it ends, and where it starts.
fn polynomial(config: &Config, program: &str) -> (Polynomial, [Nano; AXES], [Nano; AXES]) {
    match moves(config, program)[..] {
        [Move {
            motion: Motion::Polynomial(polynomial),
            target,
            ..
        }] => (polynomial, target, [0; AXES]),
        [Move { target: start, .. }, Move {
            motion: Motion::Polynomial(polynomial),
            target,
            ..
        }] => (polynomial, target, start),
        ref other => panic!("{other:?}"),
    }
}

#[test]
fn both_spellings_of_a_polynomial_mean_the_same() {
    let config = xyzac();
    let of = |program: &str| polynomial(&config, program);
    let list = of("POLY PO[X]=(10,0.25,-1E-3) PO[Y]=(5,1,2,3,4) PO[]=(2,0.5) Z=1 PL=2 F60");
    assert_eq!(list.0.length, 2.0);
    assert_eq!(list.0.coefficients[0], [0.25, -0.001, 0.0, 0.0]);
    assert_eq!(list.0.coefficients[1], [1.0, 2.0, 3.0, 4.0]);
    assert_eq!(list.0.coefficients[2..], [[0.0; 4]; 3]);
    assert_eq!(list.0.denominator, [2.0, 0.5, 0.0, 0.0, 0.0]);
    assert_eq!(list.1, micro([10_000, 5000, 1000, 0, 0]));
    for wire in [
        "F60POLY\nPOXQ0.25Q-1E-3\nPOYQ1Q2Q3Q4PODQ2Q.5\nX10Y5Z1PL2",
        "F60 POLY\nPOD Q2 Q0.5\n\nN5 ; coefficients\nPOX Q=1/4 Q-0.001 POY Q1 Q2 Q3 Q4 X10 Y5 Z1 PL=2",
    ] {
        assert_eq!(of(wire), list, "{wire}");
    }
    let plain = of("F60 POLY X1");
    assert_eq!(plain.0.length, 1.0);
    assert_eq!(plain.0.coefficients, [[0.0; 4]; 5]);
    assert_eq!(plain.0.denominator, [1.0, 0.0, 0.0, 0.0, 0.0]);
    // coefficients of linear axes are lengths
    let inch = of("F60 G70 POLY PO[X]=(1,0.5) PO[A]=(1,0.5)");
    assert_eq!(
        (inch.0.coefficients[0][0], inch.0.coefficients[3][0]),
        (12.7, 0.5)
    );
    // and are forgotten behind their block
    let two = moves(&config, "F60 POLY PO[X]=(1,5)\nX2");
    let Motion::Polynomial(second) = two[1].motion else {
        panic!("{two:?}")
    };
    assert_eq!(second.coefficients, [[0.0; 4]; 5]);
}

/// Where an axis is at p, by the formula of the 840D in machine coordinates.
fn at((block, end, start): &(Polynomial, [Nano; AXES], [Nano; AXES]), axis: usize, p: f64) -> f64 {
    let [start, end] = [start, end].map(|at| at[axis] as f64 / NANO_PER_UNIT as f64);
    let length = block.length;
    if block.numerators & (1 << axis) == 0 {
        return start + (end - start) * p / length;
    }
    let sum = |first: f64, last: f64, k: &[f64], p: f64| {
        let higher = |p: f64| (2..).zip(k).map(|(n, k)| k * p.powi(n)).sum::<f64>();
        first + (last - first - higher(length)) / length * p + higher(p)
    };
    let [last, under @ ..] = block.denominator;
    let over = sum(start, end * last, &block.coefficients[axis], p);
    over / sum(1.0, last, &under, p)
}

#[test]
fn a_polynomial_counts_from_the_programmed_zero() {
    let mut config = equipped();
    config.zero_offsets[1] = micro([100_000, -20_000, 7000, 3000, 0]);
    let program = "G1 F60 X10 Y1 Z2 A1 POLY PO[X]=(3,-10,0.5) PO[Y]=(10) PO[A]=(2,0.25) Z5 PO[]=(2,1,0.1) PL=2";
    let program = program.replace(" POLY", "\nPOLY");
    let plain = polynomial(&config, &program);
    // the length of the tool shifts Z, which is linear, and under G18 Y, which is not
    for (frame, shift) in [
        ("G55", [100.0, -20.0, 7.0, 3.0]),
        ("T4 M6 G55", [100.0, -20.0, 87.0, 3.0]),
        ("G18 T4 M6 G55", [100.0, 60.0, 7.0, 3.0]),
        ("G55 G500", [0.0; 4]),
    ] {
        let program = format!("{}\n{program}", frame.replace(" G500", "\nG500"));
        let moved = polynomial(&config, &program);
        for (axis, shift) in shift.into_iter().enumerate() {
            for p in [0.0, 0.3, 1.1, 2.0] {
                let miss = at(&moved, axis, p) - at(&plain, axis, p) - shift;
                assert!(miss.abs() < 1e-12 * 1e3, "{frame} {axis} {p}: {miss}");
            }
        }
    }
    // a circle: (1 - p^2, 2p) / (1 + p^2)
    let circle = polynomial(
        &config,
        "G55 G1 F60 X10 Y0\nPOLY POX Q-10 POY Q0 POD Q2 Q1 X0 Y10",
    );
    for p in [0.0, 0.25, 0.5, 1.0] {
        let (x, y) = (at(&circle, 0, p) - 100.0, at(&circle, 1, p) + 20.0);
        assert!((x.hypot(y) - 10.0).abs() < 1e-12 * 1e2, "{x} {y}");
    }
}

#[test]
fn a_coordinate_without_a_polynomial_has_no_numerator() {
    for (program, numerators) in [
        ("F60 POLY PO[X]=(0,-10) PO[Y]=(10) Z3 PO[]=(2,1)", 0b00011),
        ("F60 POLY\nPOX Q-10 POD Q2 Q1\nX0 Y10", 0b00001),
        ("F60 POLY\nPOX Q-10 POC Q0 POD Q2 Q1\nX0 Y10", 0b10001),
        ("F60 POLY X5 PO[]=(2,1)", 0),
    ] {
        assert_eq!(
            polynomial(&xyzac(), program).0.numerators,
            numerators,
            "{program}"
        );
    }
}
