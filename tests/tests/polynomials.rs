//! `POLY` blocks: on the rational polynomial within the curve tolerance, ends exact, both spellings the same steps.

use proptest::prelude::*;
use whole_product_tests::campaign::{cases, hold, ran_on};
use whole_product_tests::generate::curves::{polynomial, program, OFFSETS};
use whole_product_tests::laws;
use whole_product_tests::oracle::read::Setup;

fn setup() -> Setup {
    Setup {
        offsets: OFFSETS,
        ..Setup::default()
    }
}

proptest! {
    #![proptest_config(cases(60))]

    #[test]
    fn the_path_is_the_polynomial(text in program(polynomial(), 4)) {
        hold(&setup(), &text, |config, run, curves| {
            let tolerance = f64::from(config.curve_tolerance) + 2e-5;
            laws::follows(config, run, curves, tolerance).map(|_| ())
        }).map_err(TestCaseError::fail)?;
    }

    #[test]
    fn every_end_of_a_polynomial_is_met_and_the_last_exactly(text in program(polynomial(), 4)) {
        hold(&setup(), &text, |config, run, curves| {
            laws::meets_the_points(config, run, curves)?;
            laws::stays_within_limits(config, run, &laws::brisk_lines(curves), 0.005)?;
            let end = curves.last().and_then(|curve| curve.end).unwrap_or_default();
            laws::ends_exactly_on(run, &laws::bits(config, &end))
        }).map_err(TestCaseError::fail)?;
    }
}

#[test]
fn both_spellings_give_the_same_steps() {
    let setup = Setup::default();
    let digest = |text: &str| {
        ran_on(&setup, text)
            .unwrap_or_else(|broken| panic!("{broken}"))
            .digest
    };
    for (brackets, wire) in [
        (
            "G1 F3000 X1\nPOLY PO[X]=(10,2,-1) PO[Y]=(5,0.5) Z1 PL=4\nM30\n",
            "G1 F3000 X1\nPOLY\nPOX Q2 Q-1 POY Q0.5\nX10 Y5 Z1 PL4\nM30\n",
        ),
        (
            "G1 F3000 X10\nPOLY PO[X]=(0,-10) PO[Y]=(10) PO[]=(2,1)\nM30\n",
            "G1 F3000 X10\nPOLY\nPOXQ-10POYQ0\nPODQ2Q1\nX0Y10\nM30\n",
        ),
    ] {
        assert_eq!(digest(brackets), digest(wire), "{brackets}");
    }
}

#[test]
fn a_denominator_makes_a_circle() {
    // 10 (1 - p^2, 2 p) / (1 + p^2).
    hold(
        &Setup::default(),
        "G0 X10\nPOLY F3000 PO[X]=(0,-10) PO[Y]=(10) PO[]=(2,1)\nM30\n",
        |config, run, _| {
            for tick in run.ticks.iter().filter(|t| t.moving && t.block == 2) {
                let p = laws::place(config, tick);
                let off = (p[0].hypot(p[1]) - 10.0).abs();
                if off > f64::from(config.curve_tolerance) + 2e-5 {
                    return Err(format!("{off} off the circle"));
                }
            }
            Ok(())
        },
    )
    .unwrap_or_else(|broken| panic!("{broken}"));
}
