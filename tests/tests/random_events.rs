//! Random programs with holds, overrides and failing supply at random instants: every law holds, and the end is the same.
//!
//! Always the same programs; `PENTASPLINE_CASES=N` draws N of its own. `tests/oracle/campaign.py` does so on a larger scale, from the traces
//! of the simulator.

use pentaspline::machine::Event;
use proptest::prelude::*;
use whole_product_tests::campaign::{cases, ran};
use whole_product_tests::drive::Script;
use whole_product_tests::oracle::path::path;
use whole_product_tests::{examples, generate, laws};

/// Largest use of velocity and acceleration, and of jerk.
const MOST: [f64; 2] = [1.005, 1.02];

/// From the path of the undisturbed run, mm or degree: one step.
const ON_PATH: f64 = 0.001;

/// Something that happens, and for how many ticks it lasts where that is said.
fn event() -> impl Strategy<Value = (Event, u64)> {
    prop_oneof![
        2 => (1_u64..2000).prop_map(|ticks| (Event::Hold, ticks)),
        2 => (10_u8..=200).prop_map(|percent| (Event::Feed(percent), 0)),
        1 => (10_u8..=100).prop_map(|percent| (Event::Rapid(percent), 0)),
        1 => (1_u32..2000).prop_map(|ticks| (Event::Starve(ticks), 0)),
    ]
}

/// Events with the share of the undisturbed time at which they come.
fn events() -> impl Strategy<Value = Vec<(f64, (Event, u64))>> {
    prop::collection::vec((0.0..1.0, event()), 1..14)
}

/// Rows for a run that takes `ticks` undisturbed; each hold has its resume, and the last row is one.
fn rows(events: &[(f64, (Event, u64))], ticks: usize) -> Vec<(u64, Event)> {
    let mut rows = Vec::new();
    for &(share, (event, lasts)) in events {
        let at = (share * ticks as f64) as u64;
        rows.push((at, event));
        if event == Event::Hold {
            rows.push((at + lasts, Event::Resume));
        }
    }
    rows.sort_by_key(|&(at, _)| at);
    let end = rows.last().map_or(0, |&(at, _)| at);
    rows.push((end.max(ticks as u64) + 4000, Event::Resume));
    rows
}

proptest! {
    #![proptest_config(cases(60))]

    #[test]
    fn limits_hold_and_the_end_is_the_same_whatever_happens(text in generate::program(10), events in events()) {
        let config = examples::machine().config;
        let brisk = laws::brisk_lines(&path(&text));
        let calm = ran(&config, &Script::new(&text)).map_err(TestCaseError::fail)?;
        let rows = rows(&events, calm.ticks.len());
        let run = ran(&config, &Script::with_events(&text, rows.clone())).map_err(TestCaseError::fail)?;
        let peaks = laws::peaks(&config, &run, &brisk);
        for (what, shares, most) in [("velocity", peaks.v, MOST[0]), ("acceleration", peaks.a, MOST[0]), ("jerk", peaks.j, MOST[1])] {
            let share = shares.into_iter().fold(0.0, f64::max);
            prop_assert!(share <= most, "{} reaches {:.4} of its limit\n{:?}\n{}", what, share, rows, text);
        }
        let laws = [
            laws::emits_exactly_the_commanded_steps(&run),
            laws::never_runs_backwards(&run),
            laws::stays_on_the_path_of(&config, &run, &calm, ON_PATH),
        ];
        for law in laws {
            law.map_err(|broken| TestCaseError::fail(format!("{broken}\n{rows:?}\n{text}")))?;
        }
        prop_assert_eq!(run.end(), calm.end(), "{:?}\n{}", rows, text);
    }
}
