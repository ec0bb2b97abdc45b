//! Text that comes too slowly or not at all: the machine comes to rest on the path, says so, and goes on; slow feeding
//! settles at what it can sustain.

use pentaspline::config::Config;
use pentaspline::machine::Event;
use whole_product_tests::drive::{drive, with_rig, Run, Script};
use whole_product_tests::{examples, laws};

/// From the path, mm.
const ON_PATH: f64 = 0.0005;

/// `points` short lines, 0.2 mm each, at 50 mm/s: what is looked ahead over them takes half a second to drive.
fn dashes(points: usize) -> String {
    let mut text = String::from("G64 SOFT G1 F3000\n");
    for i in 1..=points {
        let x = 0.16 * i as f64;
        text += &format!("X{x:.4} Y{:.4}\n", 0.75 * x);
    }
    text + "M30\n"
}

/// Sends line after line, each when `at` says, in ticks.
fn streamed(config: &Config, text: &str, at: impl Fn(usize) -> u64) -> Run {
    with_rig(config, |rig| {
        rig.controller.set_program_stops(false);
        let mut lines = text.lines().enumerate().peekable();
        for _ in 0..500_000 {
            while let Some(&(index, line)) = lines.peek() {
                if rig.now < at(index) || rig.controller.receive_free() <= line.len() + 2 {
                    break;
                }
                rig.send(line.as_bytes());
                rig.send(b"\n");
                lines.next();
            }
            if lines.peek().is_none() && rig.controller.is_idle() {
                rig.run.finished = true;
                return;
            }
            rig.advance(1);
        }
    })
}

fn underruns(run: &Run) -> Vec<&str> {
    run.remarks()
        .filter(|line| line.contains("UNDERRUN"))
        .collect()
}

/// All laws of a run that must not leave the path of `calm`.
fn holds(config: &Config, run: &Run, calm: &Run) {
    assert!(run.finished);
    let none = std::collections::BTreeSet::new();
    laws::stays_within_limits(config, run, &none, 0.005).unwrap();
    laws::emits_exactly_the_commanded_steps(run).unwrap();
    laws::never_runs_backwards(run).unwrap();
    laws::stays_on_the_path_of(config, run, calm, ON_PATH).unwrap();
    assert_eq!(run.end(), calm.end(), "total of the steps");
}

/// Stretches at rest between the first motion and the last.
fn rests(run: &Run) -> usize {
    let moving: Vec<bool> = run.ticks.iter().map(|tick| tick.moving).collect();
    moving.windows(2).filter(|pair| pair[0] && !pair[1]).count() - 1
}

#[test]
fn a_supply_that_stalls_brings_the_machine_to_rest_on_the_path_and_it_goes_on() {
    let config = examples::machine().config;
    let text = dashes(700);
    let calm = drive(&config, &Script::new(&text));
    for (line, pause) in [(250, 6000), (300, 30_000), (431, 9000)] {
        let run = streamed(&config, &text, |i| if i < line { 0 } else { 2500 + pause });
        holds(&config, &run, &calm);
        let said = underruns(&run);
        println!(
            "stall at {line} for {pause}: {said:?}, {} rests",
            rests(&run)
        );
        assert_eq!(said.len(), 1, "{said:?}");
        assert!(rests(&run) >= 1);
        let number: usize = said[0]
            .split(|c: char| !c.is_ascii_digit())
            .find(|n| !n.is_empty())
            .unwrap()
            .parse()
            .unwrap();
        // The last line that had come, or the one before: that one waits for its successor.
        assert!((line - 1..=line).contains(&number), "{said:?} at {line}");
    }
}

#[test]
fn a_program_that_ends_is_no_underrun() {
    let config = examples::machine().config;
    for text in [dashes(500), dashes(500).replace("M30\n", "")] {
        let run = drive(&config, &Script::new(&text));
        assert!(run.finished);
        assert_eq!(underruns(&run), Vec::<&str>::new());
    }
}

#[test]
fn slow_feeding_settles_instead_of_pumping() {
    let config = examples::machine().config;
    let text = dashes(1200);
    let calm = drive(&config, &Script::new(&text));
    // 0.2 mm each 60 ticks of 0.2 ms is a third of the feed, each 120 ticks a sixth.
    for every in [60_u64, 120] {
        let run = streamed(&config, &text, |i| i as u64 * every);
        holds(&config, &run, &calm);
        let sustained = 0.2 / (every as f32 / 5000.0);
        let begin = run.ticks.iter().position(|tick| tick.moving).unwrap();
        let end = 1190 * every as usize;
        // The stock the motion began with is used up first.
        let from = begin + (end - begin) / 2;
        let feeds = run.ticks[from..end].iter().map(|tick| tick.feed);
        let (low, high) = feeds.fold((f32::MAX, 0.0_f32), |(l, h), f| (l.min(f), h.max(f)));
        println!("each {every} ticks: {low:.2} to {high:.2} mm/s, sustained {sustained:.2}");
        assert!(
            low > 0.85 * sustained && high < 1.15 * sustained,
            "{low} to {high}, sustained {sustained}"
        );
        assert_eq!(underruns(&run), Vec::<&str>::new());
    }
}

#[test]
fn a_supply_said_to_fail_is_the_same_as_one_that_does() {
    let config = examples::machine().config;
    let text = dashes(700);
    let calm = drive(&config, &Script::new(&text));
    for (at, ticks) in [(2000, 20_000), (3000, 900), (3000, 2000), (9000, 20_000)] {
        let run = drive(
            &config,
            &Script::with_events(&text, vec![(at, Event::Starve(ticks))]),
        );
        holds(&config, &run, &calm);
        println!(
            "{at} {ticks}: {:?}, {} ticks instead of {}",
            underruns(&run),
            run.ticks.len(),
            calm.ticks.len()
        );
        assert_eq!(underruns(&run).len(), usize::from(ticks == 20_000));
    }
}
