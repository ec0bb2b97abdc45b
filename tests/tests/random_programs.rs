//! The laws of motion on random programs. `PENTASPLINE_CASES=N` runs N programs per law instead of the usual few.

use pentaspline::config::Config;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use whole_product_tests::drive::{drive, Run, Script, Sender};
use whole_product_tests::oracle::path::{path, Curve};
use whole_product_tests::{examples, generate, laws};

/// Deviation allowed between commanded path and programmed curve, mm or degree. What comes out is the commanded
/// path rounded to steps, which is a law of its own.
const DEVIATION: f64 = 0.001;

fn cases(usual: u32) -> ProptestConfig {
    let named = std::env::var("PENTASPLINE_CASES").ok();
    ProptestConfig {
        cases: named.as_ref().and_then(|n| n.parse().ok()).unwrap_or(usual),
        max_shrink_iters: 60,
        failure_persistence: None,
        // The same programs in every run: what fails here fails for everybody. A campaign draws its own.
        rng_seed: if named.is_some() {
            RngSeed::Random
        } else {
            RngSeed::Fixed(1210)
        },
        ..ProptestConfig::default()
    }
}

fn ran(text: &str, script: &Script<'_>) -> Result<Run, TestCaseError> {
    let run = drive(&examples::machine().config, script);
    let complaint = run.remarks().find(|line| line.contains("error"));
    prop_assert!(complaint.is_none(), "{:?}\n{}", complaint, text);
    prop_assert!(run.finished, "does not come to an end\n{}", text);
    Ok(run)
}

/// Runs `text` and holds `law` against it.
fn hold(
    text: &str,
    law: impl Fn(&Config, &Run, &[Curve]) -> Result<(), String>,
) -> Result<(), TestCaseError> {
    let run = ran(text, &Script::new(text))?;
    law(&examples::machine().config, &run, &path(text))
        .map_err(|broken| TestCaseError::fail(format!("{broken}\n{text}")))
}

/// The spline ends at an exact stop, and rounding leaves 2^-72 path units per tick of the velocity there.
#[test]
fn what_rounding_leaves_of_a_standstill_does_not_keep_the_machine_from_its_stop() {
    let text = "G90 G64 BRISK\nG1 X0 Y0 Z0 F500\nG1 X-0.1529 Y-0.6253 Z-0.1403\nCSPLINE\nX0.0765 Y0.6730 Z-0.3253\n\
        X-0.2808 Y-0.7189 Z0.6666\nX-0.1070 Y0.2920 Z-0.6668\nX-0.6776 Y0.3860 Z0.2417\nX0.1442 Y-0.2670 Z0.5742\nG9\n\
        G1 X0.2316 Y0.1796 Z-0.4085\nM30\n";
    let config = examples::machine().config;
    let run = drive(&config, &Script::new(text));
    assert!(run.finished, "does not come to an end");
    laws::stays_within_limits(&config, &run, &laws::brisk_lines(&path(text)), 0.005)
        .unwrap_or_else(|broken| panic!("{broken}\n{text}"));
}

/// Steeper than the random programs are: the path is a micrometre long while an axis turns by most of a degree.
#[test]
fn rotary_axes_beside_a_tiny_linear_move_keep_their_limits() {
    for text in [
        "G1 X0.003 A-0.044 F1500\nX0.004 C0.060\nM30\n",
        "G1 X0.001 A-0.713 C0.844 F1500\nX0.002 C0.843\nX0.005\nM30\n",
    ] {
        let config = examples::machine().config;
        let run = drive(&config, &Script::new(text));
        assert!(run.finished);
        laws::stays_within_limits(&config, &run, &laws::brisk_lines(&path(text)), 0.005)
            .unwrap_or_else(|broken| panic!("{broken}\n{text}"));
    }
}

/// Early in the fifth piece of the spline the linear axes all but stand still, and the tool is near many points of the curve; over
/// all five axes it is near one.
#[test]
fn axes_that_turn_where_the_tool_all_but_stands_still_are_on_the_path() {
    let text = "G90 G64 SOFT\nG1 X0 Y0 Z0 A0 C0 F3000\nG1 X0.0607 Y-0.0531 Z0.0700 A0.0059 C0.0347\nCSPLINE\n\
        X-0.0444 Y-0.0676 Z0.0215 A-0.0089 C-0.0159\nX0.0037 Y0.0233 Z-0.0004 A-0.0077 C-0.0599\n\
        X-0.0272 Y0.0541 Z0.0223 A-0.0670 C0.0250\nX0.0561 Y-0.0483 Z-0.0719 A0.0097 C0.0695\n\
        X-0.0712 Y-0.0539 Z-0.0525 A-0.0375 C-0.0640\nX-0.0392 Y0.0288 Z0.0168 A0.0139 C-0.0559\n\
        X-0.0421 Y0.0133 Z-0.0137 A-0.0267 C-0.0687\nX-0.0062 Y0.0539 Z-0.0010 A0.0350 C-0.0323\nM30\n";
    let config = examples::machine().config;
    let run = drive(&config, &Script::new(text));
    assert!(
        run.finished && !run.output.contains("error"),
        "{}",
        run.output
    );
    // The tolerance of the arc length, and rounding of the oracle's own.
    let found = laws::follows(&config, &run, &path(text), 2e-5)
        .unwrap_or_else(|broken| panic!("{broken}\n{text}"));
    assert_eq!(found.curves, 9, "curves run\n{text}");
}

proptest! {
    #![proptest_config(cases(120))]

    #[test]
    fn no_axis_exceeds_a_limit(text in generate::program(10)) {
        hold(&text, |config, run, curves| {
            laws::stays_within_limits(config, run, &laws::brisk_lines(curves), 0.005)
        })?;
    }

    #[test]
    fn the_steps_emitted_are_the_steps_commanded(text in generate::program(10)) {
        hold(&text, |_, run, _| laws::emits_exactly_the_commanded_steps(run))?;
    }

    #[test]
    fn a_run_ends_exactly_on_the_programmed_end(text in generate::program(10)) {
        hold(&text, |config, run, curves| {
            let end = curves.last().and_then(|curve| curve.end).unwrap_or_default();
            laws::ends_exactly_on(run, &laws::bits(config, &end))
        })?;
    }

    #[test]
    fn the_path_is_never_run_backwards(text in generate::program(10)) {
        hold(&text, |_, run, _| laws::never_runs_backwards(run))?;
    }

    #[test]
    fn the_path_is_the_programmed_curve(text in generate::program(10)) {
        hold(&text, |config, run, curves| {
            laws::follows(config, run, curves, DEVIATION).map(|_| ())
        })?;
    }

    #[test]
    fn every_programmed_point_is_met(text in generate::program(10)) {
        hold(&text, laws::meets_the_points)?;
    }
}

proptest! {
    #![proptest_config(cases(40))]

    #[test]
    fn the_arrival_of_bytes_does_not_change_the_steps(
        text in generate::program(8),
        seed in any::<u64>(),
        poll_every in 1_u64..=20,
    ) {
        let all_at_once = ran(&text, &Script::new(&text))?;
        let bursts = Script {
            sender: Sender::Bursts { seed, bytes: 600, gap: 10 },
            poll_every,
            ..Script::new(&text)
        };
        let bursts = ran(&text, &bursts)?;
        prop_assert_eq!(
            bursts.digest, all_at_once.digest,
            "poll_every {} seed {}\n{}", poll_every, seed, text
        );
    }
}
