//! Arcs and helices: on the circle within 0.05 um, the right way round, whole turns, ends exact.

use proptest::prelude::*;
use whole_product_tests::campaign::{cases, hold, machine, ran_on};
use whole_product_tests::generate::curves::{arc, program, OFFSETS};
use whole_product_tests::laws;
use whole_product_tests::oracle::path::path_on;
use whole_product_tests::oracle::read::Setup;

/// Largest distance of the commanded path from a circle, mm: 0.05 um, and the printed sixth decimal of its end.
const CIRCLE: f64 = 0.000_052;

fn setup() -> Setup {
    Setup {
        offsets: OFFSETS,
        ..Setup::default()
    }
}

fn checked(result: Result<(), String>) -> Result<(), TestCaseError> {
    result.map_err(TestCaseError::fail)
}

proptest! {
    #![proptest_config(cases(60))]

    #[test]
    fn the_path_is_the_circle(text in program(arc(), 6)) {
        checked(hold(&setup(), &text, |config, run, curves| {
            laws::follows(config, run, curves, CIRCLE).map(|_| ())
        }))?;
    }

    #[test]
    fn every_end_of_an_arc_is_met_and_the_last_exactly(text in program(arc(), 6)) {
        checked(hold(&setup(), &text, |config, run, curves| {
            laws::meets_the_points(config, run, curves)?;
            let end = curves.last().and_then(|curve| curve.end).unwrap_or_default();
            laws::ends_exactly_on(run, &laws::bits(config, &end))
        }))?;
    }

    #[test]
    fn no_axis_exceeds_a_limit_on_arcs(text in program(arc(), 6)) {
        checked(hold(&setup(), &text, |config, run, curves| {
            laws::stays_within_limits(config, run, &laws::brisk_lines(curves), 0.005)?;
            laws::emits_exactly_the_commanded_steps(run)
        }))?;
    }
}

#[test]
fn full_circles_and_turns_are_as_long_as_they_say() {
    let setup = Setup::default();
    for (text, turns) in [
        ("G0 X10\nG3 F6000 X10 Y0 I-10\nM30\n", 1.0),
        ("G0 X10\nG2 F6000 I-10 J0 X10\nM30\n", 1.0),
        ("G0 X10\nG3 F6000 X-10 Y0 I-10 TURN=2\nM30\n", 2.5),
        ("G0 X10\nG2 F6000 X10 Y0 Z3 I-10 TURN=3\nM30\n", 4.0),
    ] {
        let config = machine(&setup);
        let run = ran_on(&setup, text).unwrap_or_else(|broken| panic!("{broken}"));
        let angles: Vec<f64> = run
            .ticks
            .iter()
            .filter(|tick| tick.moving && tick.block == 2)
            .map(|tick| laws::place(&config, tick))
            .map(|p| p[1].atan2(p[0]))
            .collect();
        let turned: f64 = angles
            .windows(2)
            .map(|pair| {
                (pair[1] - pair[0] + 3.0 * std::f64::consts::PI).rem_euclid(std::f64::consts::TAU)
                    - std::f64::consts::PI
            })
            .sum();
        let wanted = turns * std::f64::consts::TAU * if text.contains("G3") { 1.0 } else { -1.0 };
        assert!(
            (turned - wanted).abs() < 0.05,
            "{text}: {turned}, not {wanted}"
        );
        laws::follows(&config, &run, &path_on(&setup, text), CIRCLE)
            .unwrap_or_else(|broken| panic!("{broken}\n{text}"));
    }
}

#[test]
fn a_large_circle_is_as_round_as_a_small_one() {
    let setup = Setup::default();
    for radius in [0.01, 0.3, 25.0, 390.0] {
        let text = format!("G0 X{radius}\nG3 F30000 X-{radius} I-{radius}\nM30\n");
        let config = machine(&setup);
        let run = ran_on(&setup, &text).unwrap_or_else(|broken| panic!("{broken}"));
        laws::follows(&config, &run, &path_on(&setup, &text), CIRCLE)
            .unwrap_or_else(|broken| panic!("{broken}\n{text}"));
    }
}
