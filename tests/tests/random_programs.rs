//! The laws of motion on random programs. `PENTASPLINE_CASES=N` runs N programs per law instead of the usual few.

use proptest::prelude::*;
use whole_product_tests::drive::{drive, Run, Script, Sender};
use whole_product_tests::oracle::path::{path, Curve};
use whole_product_tests::{examples, generate, laws};

fn cases(usual: u32) -> ProptestConfig {
    let named = std::env::var("PENTASPLINE_CASES").ok();
    ProptestConfig {
        cases: named.and_then(|n| n.parse().ok()).unwrap_or(usual),
        max_shrink_iters: 400,
        failure_persistence: None,
        ..ProptestConfig::default()
    }
}

/// Deviation allowed between commanded path and programmed curve, mm or degree.
const DEVIATION: f64 = 0.001;

fn ran(text: &str) -> Result<Run, TestCaseError> {
    let run = drive(&examples::machine().config, &Script::new(text));
    let complaint = run.remarks().find(|line| line.contains("error"));
    prop_assert!(complaint.is_none(), "{}\n{text}", complaint.unwrap_or(""));
    prop_assert!(run.finished, "does not come to an end\n{text}");
    Ok(run)
}

fn holds<T>(law: Result<T, String>, text: &str) -> Result<T, TestCaseError> {
    law.map_err(|broken| TestCaseError::fail(format!("{broken}\n{text}")))
}

fn last_point(curves: &[Curve]) -> [i64; 5] {
    curves
        .last()
        .and_then(|curve| curve.end)
        .unwrap_or_default()
}

proptest! {
    #![proptest_config(cases(150))]

    #[test]
    fn limits_steps_end_and_path_hold_on_any_mixture(text in generate::program(10)) {
        let config = examples::machine().config;
        let curves = path(&text);
        let run = ran(&text)?;
        if curves.is_empty() {
            prop_assert_eq!(run.moving(), 0);
            return Ok(());
        }
        holds(laws::stays_within_limits(&config, &run, &laws::brisk_lines(&curves), 0.005), &text)?;
        holds(laws::emits_exactly_the_commanded_steps(&run), &text)?;
        holds(laws::ends_exactly_on(&run, &laws::bits(&config, &last_point(&curves))), &text)?;
        holds(laws::never_runs_backwards(&run), &text)?;
        holds(laws::follows(&config, &run, &curves, DEVIATION), &text)?;
        holds(laws::meets_the_points(&config, &run, &curves), &text)?;
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
        let config = examples::machine().config;
        let all_at_once = ran(&text)?;
        let late = Script {
            sender: Sender::Bursts { seed, bytes: 600, gap: 10 },
            poll_every,
            ..Script::new(&text)
        };
        let late = drive(&config, &late);
        prop_assert!(late.finished, "{}", text);
        prop_assert_eq!(late.digest, all_at_once.digest, "poll_every {} seed {}\n{}", poll_every, seed, text);
    }
}
