//! Feed and rapid override at random instants: limits hold, the steps add up to the same, and it takes effect within
//! 20 ms plus the time that jerk and acceleration need.

use pentaspline::config::Config;
use pentaspline::machine::Event;
use whole_product_tests::drive::{drive, Run, Script};
use whole_product_tests::oracle::path::path;
use whole_product_tests::rng::Rng;
use whole_product_tests::{examples, laws};

/// From the path, mm.
const ON_PATH: f64 = 0.0005;

/// A program, how it runs undisturbed, and on what.
struct Case {
    config: Config,
    text: String,
    calm: Run,
    brisk: std::collections::BTreeSet<u32>,
}

impl Case {
    fn new(text: String) -> Self {
        let config = examples::machine().config;
        let calm = drive(&config, &Script::new(&text));
        assert!(calm.finished);
        let brisk = laws::brisk_lines(&path(&text));
        Self {
            config,
            text,
            calm,
            brisk,
        }
    }

    /// Runs with `events`; every law holds, and the end is that of the undisturbed run.
    fn disturbed(&self, events: &[(u64, Event)]) -> Run {
        let script = Script::with_events(&self.text, events.to_vec());
        let run = drive(&self.config, &script);
        let hold = |law: Result<(), String>| {
            law.unwrap_or_else(|broken| panic!("{events:?}: {broken}"));
        };
        assert!(run.finished, "{events:?}: does not come to an end");
        hold(laws::stays_within_limits(
            &self.config,
            &run,
            &self.brisk,
            0.005,
        ));
        hold(laws::emits_exactly_the_commanded_steps(&run));
        hold(laws::never_runs_backwards(&run));
        hold(laws::stays_on_the_path_of(
            &self.config,
            &run,
            &self.calm,
            ON_PATH,
        ));
        assert_eq!(run.end(), self.calm.end(), "{events:?}: total of the steps");
        assert_eq!(
            run.ticks.last().map(|tick| tick.commanded),
            self.calm.ticks.last().map(|tick| tick.commanded),
            "{events:?}: end point"
        );
        run
    }
}

/// Overrides `name` at `count` times a few instants drawn from `seed`.
fn overrides(name: &str, seed: u64, count: u64) {
    let case = Case::new(examples::text(name));
    let mut rng = Rng::new(seed);
    for _ in 0..count {
        let mut events = Vec::new();
        for _ in 0..rng.within(1, 5) {
            let at = rng.within(0, case.calm.ticks.len() as u64 - 1);
            events.push((at, Event::Feed(rng.within(10, 200) as u8)));
            if rng.within(0, 2) == 0 {
                // While the one before is still being followed.
                events.push((
                    at + rng.within(1, 400),
                    Event::Feed(rng.within(10, 200) as u8),
                ));
            }
            if rng.within(0, 2) == 0 {
                events.push((at, Event::Rapid(rng.within(10, 100) as u8)));
            }
            if rng.within(0, 3) == 0 {
                events.push((at, Event::Feed(0)));
                events.push((
                    at + rng.within(1, 5000),
                    Event::Feed(rng.within(50, 200) as u8),
                ));
            }
        }
        events.sort_by_key(|&(at, _)| at);
        // Nothing ends at an override of zero.
        let end = events.last().map_or(0, |&(at, _)| at);
        events.push((end + 1, Event::Feed(100)));
        case.disturbed(&events);
    }
}

#[test]
fn the_thesis_spline_can_be_overridden_anywhere() {
    overrides("thesis/CSPLINE_57.MPF", 1, 30);
}

#[test]
fn a_mixture_of_all_modes_can_be_overridden_anywhere() {
    overrides("mixed_modes.nc", 2, 40);
}

#[test]
fn five_axes_can_be_overridden_anywhere() {
    overrides("five_axis_sweep.nc", 3, 40);
}

#[test]
fn tiny_moves_can_be_overridden_anywhere() {
    overrides("tiny_moves.nc", 4, 40);
}

#[test]
fn long_rapids_can_be_overridden_anywhere() {
    overrides("long_rapid.nc", 5, 20);
}

/// Time in which a jerk-limited change of velocity by `dv` can be made: acceleration builds up and goes away at `j`, and
/// stays at `a` in between if it gets there.
fn ramp(dv: f64, a: f64, j: f64) -> f64 {
    if dv < a * a / j {
        2.0 * (dv / j).sqrt()
    } else {
        dv / a + a / j
    }
}

#[test]
fn an_override_takes_effect_within_20_ms_and_the_time_of_the_ramp() {
    let config = examples::machine().config;
    let text = "G1 F3000 X200\nM30\n";
    let feed = 50.0;
    let (hz, axis) = (f64::from(config.servo_hz), &config.axes[0]);
    for (before, after) in [
        (100, 50),
        (100, 200),
        (100, 101),
        (100, 99),
        (30, 170),
        (180, 20),
        (100, 0),
    ] {
        let at = 6000_u64;
        let mut events = vec![(0, Event::Feed(before)), (at, Event::Feed(after))];
        if after == 0 {
            events.push((at + 5000, Event::Feed(100)));
        }
        let run = drive(&config, &Script::with_events(text, events));
        assert!(run.finished);
        let (from, to) = (
            f64::from(before) / 100.0 * feed,
            f64::from(after) / 100.0 * feed,
        );
        let there = |feed: f32| (f64::from(feed) - to).abs() <= 0.002 * from.max(to);
        let needed = ramp(
            (to - from).abs(),
            f64::from(axis.a_max),
            f64::from(axis.j_max),
        );
        let moved = run.ticks[at as usize - 1].feed;
        assert!(
            (f64::from(moved) - from).abs() < 0.002 * from,
            "{before}: runs at {moved}"
        );
        let took = run.ticks[at as usize..]
            .iter()
            .position(|tick| there(tick.feed));
        let took = took.expect("reaches the new feed") as f64 / hz;
        println!("{before} to {after} %: {took:.4} s, ramp {needed:.4} s");
        // A tenth of the ramp is what whole ticks and the share of the limits that a ceiling leaves take.
        assert!(
            took <= 0.020 + 1.1 * needed + 0.002,
            "{before} to {after}: {took} s, ramp {needed} s"
        );
    }
}
