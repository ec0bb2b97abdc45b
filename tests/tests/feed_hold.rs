//! Feed hold at random instants: the machine comes to rest on the path, within limits, and a resume ends with the same
//! steps as if nothing had happened. 200 instants over four programs, seeded.

use pentaspline::config::Config;
use pentaspline::machine::{Event, State};
use whole_product_tests::drive::{drive, with_rig, Run, Script};
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
    fn new(name: &str) -> Self {
        let config = examples::machine().config;
        let text = examples::text(name);
        let calm = drive(&config, &Script::new(&text));
        assert!(calm.finished, "{name}");
        let brisk = laws::brisk_lines(&path(&text));
        Self {
            config,
            text,
            calm,
            brisk,
        }
    }

    fn disturbed(&self, events: &[(u64, Event)]) -> Run {
        let run = drive(
            &self.config,
            &Script::with_events(&self.text, events.to_vec()),
        );
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
        run
    }
}

/// Longest stop from full rapid speed on this machine: 0.1 s to full acceleration, 0.13 s at it, 0.1 s back.
const STOPPED: u64 = 5000;

/// Holds `name` at `count` instants drawn from `seed`.
fn holds(name: &str, seed: u64, count: u64) {
    let case = Case::new(name);
    let mut rng = Rng::new(seed);
    for _ in 0..count {
        let at = rng.within(0, case.calm.ticks.len() as u64 - 1);
        // Some resumes come while the machine is still slowing down, some holds while it is held.
        let resume = at + rng.within(1, STOPPED);
        let mut events = vec![(at, Event::Hold), (resume, Event::Resume)];
        match rng.within(0, 3) {
            0 => events.insert(1, (at + (resume - at) / 2, Event::Hold)),
            1 => {
                let again = resume + rng.within(1, 400);
                events.extend([(again, Event::Hold), (again + STOPPED, Event::Resume)]);
            }
            _ => {}
        }
        let run = case.disturbed(&events);
        assert_eq!(
            run.end(),
            case.calm.end(),
            "{name} {events:?}: total of the steps"
        );
        assert_eq!(
            run.ticks.last().map(|tick| tick.commanded),
            case.calm.ticks.last().map(|tick| tick.commanded),
            "{name} {events:?}: end point"
        );
    }
}

#[test]
fn the_thesis_spline_can_be_held_anywhere() {
    holds("thesis/CSPLINE_57.MPF", 1, 60);
}

#[test]
fn a_mixture_of_all_modes_can_be_held_anywhere() {
    holds("mixed_modes.nc", 2, 50);
}

#[test]
fn five_axes_can_be_held_anywhere() {
    holds("five_axis_sweep.nc", 3, 50);
}

#[test]
fn tiny_moves_can_be_held_anywhere() {
    holds("tiny_moves.nc", 4, 40);
}

#[test]
fn a_hold_comes_to_rest_and_stays_there() {
    let case = Case::new("thesis/CSPLINE_57.MPF");
    let mut rng = Rng::new(5);
    for _ in 0..20 {
        let at = rng.within(0, case.calm.ticks.len() as u64 - 1);
        let script = Script {
            limit: at + 2 * STOPPED,
            ..Script::with_events(&case.text, vec![(at, Event::Hold)])
        };
        let run = drive(&case.config, &script);
        let rest = &run.ticks[(at + STOPPED) as usize..];
        assert!(
            rest.iter().all(|tick| !tick.moving),
            "{at}: still in motion"
        );
        assert!(
            rest.iter().all(|tick| tick.commanded == rest[0].commanded),
            "{at}: moves at rest"
        );
    }
}

#[test]
fn a_reset_during_a_hold_forgets_the_program_and_keeps_the_position() {
    let case = Case::new("thesis/CSPLINE_57.MPF");
    let mut rng = Rng::new(6);
    for _ in 0..20 {
        let at = rng.within(15_000, 120_000);
        let reset = at + rng.within(0, 800);
        let run = case.disturbed(&[(at, Event::Hold), (reset, Event::Reset)]);
        let last = run.ticks.last().expect("ran");
        assert!(!last.moving, "{at}: not at rest");
        assert_eq!(
            run.output.matches("Grbl 1.1").count(),
            2,
            "{at}: a banner per reset"
        );
    }
}

#[test]
fn work_after_a_reset_starts_where_the_machine_stands() {
    let case = Case::new("thesis/CSPLINE_57.MPF");
    let run = with_rig(&case.config, |rig| {
        rig.controller.set_program_stops(false);
        let mut text = case.text.bytes().peekable();
        while rig.now < 40_000 {
            while text.peek().is_some() && rig.controller.receive_free() > 2 {
                rig.controller.receive(text.next().expect("peeked"));
                rig.settle();
            }
            rig.advance(1);
        }
        rig.send(&[0x18]);
        assert!(rig.until_idle(20_000), "comes to rest");
        rig.send(b"G1 X1.5 Y-2 Z3 F3000\nM30\n");
        assert!(rig.until_idle(200_000), "runs the new program");
    });
    let end = [1_500_000, -2_000_000, 3_000_000, 0, 0];
    laws::ends_exactly_on(&run, &laws::bits(&case.config, &end)).expect("exact end");
    laws::stays_within_limits(&case.config, &run, &case.brisk, 0.005).expect("limits");
}

#[test]
fn a_program_stop_waits_for_cycle_start() {
    let config = examples::machine().config;
    with_rig(&config, |rig| {
        rig.advance(1);
        rig.send(b"G1 X2 F3000\nM0\nG1 X4\nM30\n");
        rig.advance(20_000);
        assert_eq!(rig.controller.state(), State::Hold);
        assert_eq!(rig.run.end()[0], 2000);
        rig.send(b"~");
        assert!(rig.until_idle(20_000));
        assert_eq!(rig.run.end()[0], 4000);
    });
}
