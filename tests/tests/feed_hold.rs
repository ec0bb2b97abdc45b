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

/// Positions along the program's one straight line, mm.
fn along(config: &Config, run: &Run) -> Vec<f64> {
    let places = run.ticks.iter().map(|tick| laws::place(config, tick));
    places
        .map(|p| p.iter().map(|x| x * x).sum::<f64>().sqrt())
        .collect()
}

/// Least time to rest, s: acceleration `a` built down to `-most`, held, and let go.
fn least_time(v: f64, a: f64, most: f64, jerk: f64) -> f64 {
    let peak = (jerk * v + a * a / 2.0).max(0.0).sqrt();
    if peak <= most {
        (2.0 * peak + a) / jerk
    } else {
        (2.0 * most + a) / jerk + (v + (a * a / 2.0 - most * most) / jerk) / most
    }
}

/// Smallest change of a commanded position on the built-in machine, mm: 2^-32 of its steps of 1 um; of three axes together.
const UNIT: f64 = 1.8e-3 / (1_u64 << 32) as f64;

/// Holds at random instants of a straight line: within the limits from that tick on, and at rest within the least time
/// and one tick.
fn stops_in_the_least_time(text: &str, seed: u64) {
    let config = examples::machine().config;
    let calm = drive(&config, &Script::new(text));
    let (share, end) = {
        let end = laws::place(&config, calm.ticks.last().expect("ran"));
        let length = end.iter().map(|x| x * x).sum::<f64>().sqrt();
        (end.map(|x| x.abs() / length), length)
    };
    let most = |limit: fn(&pentaspline::config::AxisConfig) -> f32| {
        let along = config.axes.iter().zip(share);
        let moving = along.filter(|(_, share)| *share > 0.0);
        moving
            .map(|(axis, share)| f64::from(limit(axis)) / share)
            .fold(f64::MAX, f64::min)
    };
    let (most_a, most_j) = (most(|axis| axis.a_max), most(|axis| axis.j_max));
    let hz = f64::from(config.servo_hz);
    let mut rng = Rng::new(seed);
    let mut slowest = 0.0_f64;
    for _ in 0..100 {
        let at = rng.within(3, calm.ticks.len() as u64 - 4);
        let script = Script {
            limit: at + STOPPED,
            ..Script::with_events(text, vec![(at, Event::Hold)])
        };
        let s = along(&config, &drive(&config, &script));
        let at = at as usize;
        let v = (s[at - 1] - s[at - 2]) * hz;
        let a = (s[at - 1] - 2.0 * s[at - 2] + s[at - 3]) * hz * hz;
        // Differences belong to places between ticks: velocity half a tick behind the acceleration before it.
        let least = least_time(v - a / hz / 2.0, a, most_a, most_j) * hz;
        let took = (at..s.len()).take_while(|&i| s[i] != s[i - 1]).count();
        // The last tick before an exact stop may show no motion, and the stop itself the last unit of 2^-32 step of an axis.
        let rest = s[at + took];
        assert!(
            s[at + took..].iter().all(|x| (x - rest).abs() <= UNIT),
            "{at}: moves again"
        );
        assert!(s[at + took] <= end + 1e-9, "{at}: beyond the end");
        assert!(
            took as f64 <= least + 1.0,
            "{at}: {took} ticks, least {least}"
        );
        slowest = slowest.max(took as f64 - least);
        for i in at..(at + took + 3).min(s.len()) {
            let a = (s[i] - 2.0 * s[i - 1] + s[i - 2]) * hz * hz;
            let j = (s[i] - 3.0 * s[i - 1] + 3.0 * s[i - 2] - s[i - 3]) * hz * hz * hz;
            assert!(
                a.abs() <= 1.005 * most_a,
                "{at}, tick {i}: acceleration {a} of {most_a}"
            );
            assert!(
                j.abs() <= 1.005 * most_j,
                "{at}, tick {i}: jerk {j} of {most_j}"
            );
        }
    }
    println!("at most {slowest:.3} ticks above the least time");
}

#[test]
fn a_hold_on_a_straight_line_stops_in_the_least_time_and_one_tick() {
    stops_in_the_least_time("SOFT\nG1 X40 F6000\nM30\n", 7);
    stops_in_the_least_time("SOFT\nG1 X30 Y-40 Z10 F20000\nM30\n", 8);
}

/// The background comes so seldom that the interrupt often finds nothing planned and brakes by itself.
#[test]
fn a_starved_interrupt_can_be_held_anywhere() {
    for (name, seed) in [("mixed_modes.nc", 9), ("thesis/CSPLINE_57.MPF", 10)] {
        let case = Case::new(name);
        let mut rng = Rng::new(seed);
        for _ in 0..20 {
            let at = rng.within(0, 2 * case.calm.ticks.len() as u64);
            let resume = at + rng.within(1, STOPPED);
            let run = drive(
                &case.config,
                &Script {
                    poll_every: rng.within(41, 100),
                    // it stops and starts again with each call: up to twenty times the calm run
                    limit: 20 * case.calm.ticks.len() as u64,
                    ..Script::with_events(
                        &case.text,
                        vec![(at, Event::Hold), (resume, Event::Resume)],
                    )
                },
            );
            let hold = |law: Result<(), String>| {
                law.unwrap_or_else(|broken| panic!("{name} {at} {resume}: {broken}"));
            };
            assert!(
                run.finished,
                "{name} {at} {resume}: does not come to an end"
            );
            assert_eq!(run.end(), case.calm.end(), "{name} {at} {resume}");
            hold(laws::emits_exactly_the_commanded_steps(&run));
            hold(laws::never_runs_backwards(&run));
            hold(laws::stays_on_the_path_of(
                &case.config,
                &run,
                &case.calm,
                ON_PATH,
            ));
        }
    }
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
