//! The example programs obey every law, and run the curves their text asks for.
//!
//! Programs of the thesis run with cutter compensation: the laws of motion are held against them as they stand, the tool
//! has to keep its radius from the contour, and the contour is what the same program runs without compensation.

use std::ops::RangeInclusive;

use pentaspline::units::AXES;
use whole_product_tests::compensated::{bare, clearance};
use whole_product_tests::drive::{drive, Run, Script};
use whole_product_tests::oracle::path::{path, Curve};
use whole_product_tests::{examples, laws};

/// Runs `text` and holds against it what holds with and without compensation.
fn moves_well(name: &str, text: &str) -> (Run, Vec<Curve>) {
    let config = examples::machine().config;
    let curves = path(text);
    let run = drive(&config, &Script::new(text));
    assert!(run.finished, "{name}: {}", run.output);
    let remarks: Vec<_> = run
        .remarks()
        .filter(|line| line.contains("error"))
        .collect();
    assert!(remarks.is_empty(), "{name}: {remarks:?}");
    let hold = |law: Result<(), String>| law.unwrap_or_else(|broken| panic!("{name}: {broken}"));
    let end = curves.last().and_then(|curve| curve.end).expect("an end");
    hold(laws::stays_within_limits(
        &config,
        &run,
        &laws::brisk_lines(&curves),
        0.005,
    ));
    hold(laws::emits_exactly_the_commanded_steps(&run));
    hold(laws::ends_exactly_on(&run, &laws::bits(&config, &end)));
    hold(laws::never_runs_backwards(&run));
    (run, curves)
}

/// Holds every law against `text`; returns the largest deviation from the programmed curves, mm.
fn follows(name: &str, text: &str) -> f64 {
    let config = examples::machine().config;
    let (run, curves) = moves_well(name, text);
    let hold = |law: Result<(), String>| law.unwrap_or_else(|broken| panic!("{name}: {broken}"));
    hold(laws::meets_the_points(&config, &run, &curves));
    let followed = laws::follows(&config, &run, &curves, 0.001);
    let followed = followed.unwrap_or_else(|broken| panic!("{name}: {broken}"));
    assert_eq!(followed.curves, curves.len(), "{name}: every curve is run");
    println!("{name}: {:.6} mm off at most", followed.deviation);
    followed.deviation
}

macro_rules! obeys {
    ($($test:ident: $name:literal)*) => {$(
        #[test]
        fn $test() {
            follows($name, &examples::text($name));
        }
    )*};
}

obeys! {
    a_spline_obeys: "akima_demo.nc"
    b_spline_obeys: "bspline_demo.nc"
    b_spline_with_intervals_obeys: "bspline_pl_sd2.nc"
    c_spline_with_all_ends_obeys: "cspline_ends.nc"
    five_axes_obey: "five_axis_sweep.nc"
    printed_blocks_obey: "golden/spln150.nc"
    long_rapids_obey: "long_rapid.nc"
    mixed_modes_obey: "mixed_modes.nc"
    brisk_motion_obeys: "pocket_brisk.nc"
    rotary_axes_alone_obey: "rotary_only.nc"
    exact_stops_obey: "square_corners.nc"
    tiny_moves_obey: "tiny_moves.nc"
    wire_spellings_obey: "wire_forms.nc"
}

/// Radius of the tool FR_4 on the built-in machine, mm.
const RADIUS: f64 = 2.0;
/// Allowed on either side of the radius, mm.
const MICROMETRE: f64 = 1e-3;

/// Lines of `text` with knots, one range per stretch without other lines between.
fn stretches(text: &str) -> Vec<RangeInclusive<u32>> {
    let mut found: Vec<RangeInclusive<u32>> = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let letters = ["X", "Y", "Z"];
        if !letters.iter().all(|&letter| line.contains(letter)) {
            continue;
        }
        match found.last_mut() {
            Some(last) if *last.end() + 1 == number => *last = *last.start()..=number,
            _ => found.push(number..=number),
        }
    }
    found.retain(|lines| lines.clone().count() > 10);
    found
}

/// Compensated program `name` of the thesis: per stretch of knots, less `margin` of them at either end where the path
/// comes from and goes to elsewhere, the tool stays at its radius, on the right.
fn keeps_its_radius(name: &str, knots: usize, margin: u32) {
    let config = examples::machine().config;
    let text = examples::text(name);
    let (run, _) = moves_well(name, &text);
    let stretches = stretches(&text);
    assert_eq!(
        stretches.iter().map(|s| s.clone().count()).sum::<usize>(),
        knots,
        "{name}: {stretches:?}"
    );
    for lines in stretches {
        let lines = lines.start() + margin..=lines.end() - margin;
        let seen = clearance(&config, &run, &text, &lines, 3.0 * RADIUS)
            .unwrap_or_else(|broken| panic!("{name}: {broken}"));
        println!("{name}, lines {lines:?}: {seen:?}");
        assert!(seen.least > RADIUS - MICROMETRE, "{name}: {seen:?}");
        assert!(seen.most < RADIUS + MICROMETRE, "{name}: {seen:?}");
        assert_eq!(seen.left, 0.0, "{name}: {seen:?}");
    }
}

#[test]
fn thesis_programs_keep_the_radius_from_their_contour() {
    let of_57 = 3 * 56 + 1 + 2 * 2;
    keeps_its_radius("thesis/CSPLINE_57.MPF", of_57 + 1, 15);
    keeps_its_radius("thesis/FINISH_EKVI_15_B.MPF", of_57 + 1, 15);
    keeps_its_radius("thesis/FINISH_EKVI_15_A.MPF", of_57 + 1, 15);
    keeps_its_radius("thesis/LINEAR_57.MPF", of_57 + 1, 15);
}

#[test]
fn thesis_roughing_keeps_the_radius_from_each_of_its_contours() {
    keeps_its_radius("thesis/ROUGH_POLAR_5_C.MPF", 4 * 73, 6);
}

#[test]
fn thesis_programs_without_compensation_run_their_contour() {
    for name in ["LINEAR_57", "FINISH_EKVI_15_A", "FINISH_EKVI_15_B"] {
        let text = examples::text(&format!("thesis/{name}.MPF"));
        follows(name, &bare(&text));
    }
}

#[test]
fn thesis_spline_without_compensation_keeps_to_the_dense_solution() {
    // 1 um and half a step are allowed to what comes out; the commanded path has no step in it.
    let name = "thesis/CSPLINE_57.MPF";
    let text = bare(&examples::text(name));
    assert!(follows(name, &text) <= 0.001);
    let end = path(&text).last().and_then(|curve| curve.end);
    let [x, y, z] = [30, 100, 10].map(|mm: i64| mm * 1_000_000);
    assert_eq!(end, Some([x, y, z, 0, 0]) as Option<[i64; AXES]>);
}
