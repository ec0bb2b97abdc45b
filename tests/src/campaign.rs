//! Running random programs: how many, with which seed, and what to say when one fails.

use pentaspline::config::{Config, Dialect};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

use crate::drive::{drive, Run, Script};
use crate::examples;
use crate::laws;
use crate::oracle::path::{path_on, Curve};
use crate::oracle::read::{Language, Setup};
use crate::oracle::shape::nearest;

/// `usual` programs of a fixed seed, the same for everybody; `PENTASPLINE_CASES=N` draws N of its own.
#[must_use]
pub fn cases(usual: u32) -> ProptestConfig {
    let named = std::env::var("PENTASPLINE_CASES").ok();
    ProptestConfig {
        cases: named.as_ref().and_then(|n| n.parse().ok()).unwrap_or(usual),
        max_shrink_iters: 60,
        failure_persistence: None,
        rng_seed: if named.is_some() {
            RngSeed::Random
        } else {
            RngSeed::Fixed(1210)
        },
        ..ProptestConfig::default()
    }
}

/// The built-in machine as `setup` has it.
#[must_use]
pub fn machine(setup: &Setup) -> Config {
    let mut config = examples::machine().config;
    config.zero_offsets = setup.offsets;
    config.dialect = match setup.language {
        Language::Sinumerik => Dialect::Sinumerik,
        Language::Fanuc => Dialect::Fanuc,
        Language::Heidenhain => Dialect::Heidenhain,
    };
    config
}

/// Runs `script` to its end without complaint.
///
/// # Errors
/// The complaint, or that there is no end, with the program.
pub fn ran(config: &Config, script: &Script<'_>) -> Result<Run, String> {
    let run = drive(config, script);
    let complaint = run.remarks().find(|line| line.contains("error"));
    if let Some(complaint) = complaint {
        return Err(format!("{complaint}\n{}", script.text));
    }
    if run.finished {
        Ok(run)
    } else {
        Err(format!("does not come to an end\n{}", script.text))
    }
}

/// Runs `text` on the machine `setup`.
///
/// # Errors
/// As [`ran`].
pub fn ran_on(setup: &Setup, text: &str) -> Result<Run, String> {
    ran(&machine(setup), &Script::new(text))
}

/// Runs `text` on the machine `setup` and holds `law` against the run and the curves the oracle reads.
///
/// # Errors
/// What is broken, with the program.
pub fn hold(
    setup: &Setup,
    text: &str,
    law: impl Fn(&Config, &Run, &[Curve]) -> Result<(), String>,
) -> Result<(), String> {
    let config = machine(setup);
    let run = ran(&config, &Script::new(text))?;
    law(&config, &run, &path_on(setup, text)).map_err(|broken| format!("{broken}\n{text}"))
}

/// Every commanded position lies within `tolerance` of the curves, which are run in order and forward, whatever text
/// lines they are accounted to. Returns the largest distance, mm or degree.
///
/// # Errors
/// Says where the path is left, or that it does not reach the last curve.
pub fn stays_on(
    config: &Config,
    run: &Run,
    curves: &[Curve],
    tolerance: f64,
) -> Result<f64, String> {
    let (mut at, mut u, mut worst) = (0, 0.0, 0.0_f64);
    for (i, tick) in run.ticks.iter().enumerate().filter(|(_, t)| t.moving) {
        let place = laws::place(config, tick);
        let mut best = None;
        // A tick may pass short curves whole.
        for (k, curve) in curves.iter().enumerate().skip(at) {
            let guess = if k == at { u } else { 0.0 };
            let (next, off) = nearest(&curve.shape, &place, guess, tolerance);
            if off <= tolerance && (k > at || next >= u - 1e-3) {
                best = Some((k, next, off));
                break;
            }
            if k > at + 40 {
                break;
            }
        }
        let Some((k, next, off)) = best else {
            let line = curves.get(at).map_or(0, |c| c.line);
            return Err(format!(
                "tick {i}, line {}: off the path behind line {line} at {place:?}",
                tick.block
            ));
        };
        worst = worst.max(off);
        (at, u) = (k, if k > at { next } else { next.max(u) });
    }
    if at + 1 < curves.len() {
        return Err(format!("ends on line {}", curves[at].line));
    }
    Ok(worst)
}
