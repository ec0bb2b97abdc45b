//! The thesis's C-spline (57 knots, three turns) runs today as it ran when `tests/golden/cspline_57.txt` was written.
//!
//! After a wanted change write the table anew with
//! `PENTASPLINE_BLESS=1 cargo test -p whole-product-tests --test golden` and look at the difference. Blessing cannot hide a
//! fault: the run is held against the laws first, and the cutter's distance from a dense solution of the spline.

use std::fmt::Write;
use std::path::PathBuf;

use pentaspline::units::AXES;
use whole_product_tests::compensated::clearance;
use whole_product_tests::drive::{drive, Run, Script};
use whole_product_tests::oracle::path::path;
use whole_product_tests::{examples, laws};

/// Ticks between two rows.
const EVERY: usize = 500;

/// 1e-4 mm, rounded to nearest, of a Q32.32 position in steps of 1 um.
fn tenths(position: i64) -> i128 {
    (i128::from(position) * 10 + (1 << 31)) >> 32
}

fn table(run: &Run) -> String {
    let mut out = String::from(
        "# examples/thesis/CSPLINE_57.MPF on the built-in MCV 1210, M0 passed at once.\n\
         # Commanded position every 500 servo ticks in 1e-4 mm (1e-4 degree); final: steps emitted.\n\
         # PENTASPLINE_BLESS=1 cargo test -p whole-product-tests --test golden   writes this file.\n",
    );
    let _ = writeln!(out, "digest {:016x}", run.digest);
    let _ = writeln!(out, "ticks {} moving {}", run.ticks.len(), run.moving());
    let _ = writeln!(out, "final {}", run.end().map(|x| x.to_string()).join(" "));
    let _ = writeln!(
        out,
        "  tick line        X        Y        Z        A        C"
    );
    for (i, tick) in run.ticks.iter().enumerate().step_by(EVERY) {
        let _ = write!(out, "{i:6} {:4}", tick.block);
        for position in tick.commanded {
            let _ = write!(out, " {:8}", tenths(position));
        }
        out.push('\n');
    }
    out
}

#[test]
fn the_thesis_spline_runs_as_recorded() {
    let config = examples::machine().config;
    let text = examples::text("thesis/CSPLINE_57.MPF");
    let run = drive(&config, &Script::new(&text));
    assert!(run.finished);

    let curves = path(&text);
    let hold = |law: Result<(), String>| law.unwrap_or_else(|broken| panic!("{broken}"));
    // The knots of the sub-program but for a quarter turn at either end, where the tool comes and goes.
    let seen = clearance(&config, &run, &text, &(34..=177), 6.0);
    let seen = seen.unwrap_or_else(|broken| panic!("{broken}"));
    assert!((seen.least - 2.0).abs() < 0.001 && (seen.most - 2.0).abs() < 0.001);
    assert_eq!(seen.left, 0.0, "the tool is on the right");
    hold(laws::stays_within_limits(
        &config,
        &run,
        &laws::brisk_lines(&curves),
        0.005,
    ));
    hold(laws::emits_exactly_the_commanded_steps(&run));
    let end: [i64; AXES] = [30, 100, 10, 0, 0].map(|mm: i64| mm * 1_000_000);
    hold(laws::ends_exactly_on(&run, &laws::bits(&config, &end)));

    let file = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("golden/cspline_57.txt");
    let now = table(&run);
    if std::env::var_os("PENTASPLINE_BLESS").is_some() {
        std::fs::write(&file, &now).expect("the table is written");
    }
    let recorded = std::fs::read_to_string(&file).unwrap_or_default();
    for (number, (was, is)) in (1..).zip(recorded.lines().zip(now.lines())) {
        assert_eq!(is, was, "{}:{number} differs", file.display());
    }
    assert_eq!(now.lines().count(), recorded.lines().count(), "rows");
}
