//! The example programs obey every law, and run the curves their text asks for.

use whole_product_tests::drive::{drive, Script};
use whole_product_tests::oracle::path::path;
use whole_product_tests::{examples, laws};

/// Runs `name` and holds every law against it; returns the largest deviation from the programmed curves, mm.
fn check(name: &str) -> f64 {
    let config = examples::machine().config;
    let text = examples::text(name);
    let curves = path(&text);
    let run = drive(&config, &Script::new(&text));
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
            check($name);
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
    thesis_lines_obey: "thesis/LINEAR_57.MPF"
    tiny_moves_obey: "tiny_moves.nc"
    wire_spellings_obey: "wire_forms.nc"
}

#[test]
fn thesis_spline_obeys_and_keeps_to_the_dense_solution() {
    // 1 um and half a step are allowed to what comes out; the commanded path has no step in it.
    assert!(check("thesis/CSPLINE_57.MPF") <= 0.001);
}
