//! Laws of a run, through the real core.

use pentaspline::units::AXES;

use super::*;
use crate::summary::{Summary, SummaryBuilder};

/// Keeps the samples.
#[derive(Default)]
struct Samples(Vec<Sample>);

impl Observer for Samples {
    fn tick(&mut self, tick: Tick, sample: &Sample, _frame: &StepFrame) -> io::Result<()> {
        assert_eq!(tick, self.0.len() as Tick);
        self.0.push(*sample);
        Ok(())
    }
}

fn play(text: &str, auto_start: bool, events: &[(Tick, Event)]) -> (Outcome, Vec<Sample>) {
    let program = Program::from_text("p.mpf", text).unwrap();
    let machine = Machine::built_in().unwrap();
    let events = events
        .iter()
        .map(|&(tick, event)| Row { tick, event })
        .collect();
    let options = Options {
        auto_start,
        events,
        max_ticks: 200_000,
    };
    let mut samples = Samples::default();
    let outcome = run(&program, &machine, &options, &mut samples).unwrap();
    assert_eq!(outcome.ticks, samples.0.len() as Tick);
    (outcome, samples.0)
}

fn summary(samples: &[Sample]) -> Summary {
    let machine = Machine::built_in().unwrap();
    let mut builder = SummaryBuilder::new(&machine, &Sample::default());
    samples.iter().for_each(|sample| builder.tick(sample));
    builder.finish(&machine, "p", 0)
}

fn last_steps(samples: &[Sample]) -> [i32; AXES] {
    samples
        .last()
        .map(|sample| sample.emitted)
        .unwrap_or_default()
}

const LINE: &str = "G1 F6000 X20 Y10\nM30\n";

#[test]
fn a_program_runs_to_its_end_point() {
    let (outcome, samples) = play(LINE, false, &[]);
    assert_eq!(outcome.end, End::Finished);
    assert_eq!(last_steps(&samples), [20_000, 10_000, 0, 0, 0]);
    let summary = summary(&samples);
    assert!((summary.path.length_mm - 500.0_f64.sqrt()).abs() < 1e-6);
    assert!(
        summary.path.feed_fluctuation < 1e-3,
        "{}",
        summary.path.feed_fluctuation
    );
    assert_eq!(summary.blocks, 1);
}

#[test]
fn a_refused_line_ends_the_run_at_rest_where_the_text_before_it_leads() {
    let (outcome, samples) = play("G1 F6000 X5\nG1 X9 Q3\nG1 X400\n", false, &[]);
    match outcome.end {
        End::Refused(complaint) => assert_eq!((complaint.line, complaint.column), (2, 7)),
        other => panic!("{other:?}"),
    }
    assert_eq!(last_steps(&samples)[0], 5000);
    assert!(!samples.last().unwrap().moving);
}

#[test]
fn a_program_stop_waits_unless_it_is_passed_or_resumed() {
    let text = "G1 F6000 X2\nM0\nG1 X4\nM30\n";
    let (outcome, samples) = play(text, false, &[]);
    assert_eq!(
        outcome.end,
        End::Waiting {
            held: false,
            after_block: 1
        }
    );
    assert_eq!(last_steps(&samples)[0], 2000);
    let (passed, samples) = play(text, true, &[]);
    assert_eq!((passed.end, last_steps(&samples)[0]), (End::Finished, 4000));
    let (resumed, samples) = play(text, false, &[(9000, Event::Resume)]);
    assert_eq!(
        (resumed.end, last_steps(&samples)[0]),
        (End::Finished, 4000)
    );
    // The steps do not depend on how long the machine waited.
    assert_eq!(resumed.digest, passed.digest);
}

#[test]
fn a_hold_stops_on_the_path_and_a_resume_finishes_it() {
    let (free, _) = play(LINE, false, &[]);
    let (held, samples) = play(LINE, false, &[(900, Event::Hold)]);
    assert_eq!(
        held.end,
        End::Waiting {
            held: true,
            after_block: 1
        }
    );
    let stopped = last_steps(&samples);
    assert!(stopped[0] > 0 && stopped[0] < 20_000, "{stopped:?}");
    let (resumed, samples) = play(LINE, false, &[(900, Event::Hold), (5000, Event::Resume)]);
    assert_eq!(
        (resumed.end, last_steps(&samples)),
        (End::Finished, [20_000, 10_000, 0, 0, 0])
    );
    assert!(resumed.ticks > free.ticks);
}

#[test]
fn a_reset_forgets_the_program() {
    let (outcome, samples) = play("G1 F6000 X20\nG1 X40\nM30\n", false, &[(900, Event::Reset)]);
    assert_eq!(outcome.end, End::Reset);
    // Somewhere between the reset and the programmed end.
    let stopped = last_steps(&samples)[0];
    assert!(
        samples[899].emitted[0] < stopped && stopped < 40_000,
        "{stopped}"
    );
    assert!(!samples.last().unwrap().moving);
}

#[test]
fn events_behind_the_end_are_counted() {
    assert_eq!(
        play(LINE, false, &[(199_999, Event::Hold)]).0.unused_events,
        1
    );
}

#[test]
fn a_run_that_takes_too_long_is_given_up() {
    let (outcome, _) = play("G4 F1000\nM30\n", false, &[]);
    assert_eq!((outcome.end, outcome.ticks), (End::TimeBound, 200_000));
}
