//! Runs the core on a program: text in over the wire, one servo tick after the other, samples out.
//!
//! Simulated time is the tick count, so a run repeats bit for bit. Per tick: due events act, text goes in as
//! far as the receive buffer takes it, the background works until it has nothing to do, the servo ticks.

use std::io;

use pentaspline::machine::timetable::{Clock, Row};
use pentaspline::machine::{Core, Event, Sample, State};
use pentaspline::stepgen::record::FrameDigest;
use pentaspline::stepgen::StepFrame;
use pentaspline::units::Tick;

use crate::feeder::{Complaint, Feeder, Line, Reply};
use crate::machine_file::Machine;
use crate::program::Program;

/// Background calls after which a tick counts as stuck.
const POLLS_MAX: u32 = 1_000_000;
/// Messages kept.
const MESSAGES_MAX: usize = 1000;

/// How to run.
#[derive(Clone, Debug)]
pub struct Options {
    /// `M0` and `M1` do not wait.
    pub auto_start: bool,
    /// What happens when, in order of the clock of [`pentaspline::machine::timetable`].
    pub events: Vec<Row>,
    /// Ticks after which the run is given up.
    pub max_ticks: Tick,
}

/// Takes the ticks in.
pub trait Observer {
    /// One servo tick is over.
    ///
    /// # Errors
    /// An error ends the run.
    fn tick(&mut self, tick: Tick, sample: &Sample, frame: &StepFrame) -> io::Result<()>;

    /// `lines` streamed lines have been answered.
    fn progress(&mut self, lines: usize) {
        let _ = lines;
    }
}

/// Looks at nothing.
impl Observer for () {
    fn tick(&mut self, _: Tick, _: &Sample, _: &StepFrame) -> io::Result<()> {
        Ok(())
    }
}

/// How a run ended.
#[derive(Clone, Debug, PartialEq)]
pub enum End {
    /// All text sent, machine at rest.
    Finished,
    /// An event reset the controller; the program was forgotten.
    Reset,
    /// Waits for cycle start, and no event gives it. `held` after a hold, else at `M0` or `M1`.
    Waiting {
        /// A hold event was the reason.
        held: bool,
        /// Last block that was in execution.
        after_block: u32,
    },
    /// The controller refused the text; the machine came to rest.
    Refused(Complaint),
    /// `ALARM:N`; the machine came to rest.
    Alarm(u32),
    /// The bound on simulated time was reached.
    TimeBound,
    /// The background never came to an end of its work.
    Stuck,
}

/// What came of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// How it ended.
    pub end: End,
    /// Servo ticks done.
    pub ticks: Tick,
    /// Digest of the frames of all ticks in motion.
    pub digest: u64,
    /// What the controller said in `[MSG:..]`.
    pub messages: Vec<String>,
    /// Events that would have come after the end.
    pub unused_events: usize,
    /// Background calls, those that found nothing to do included.
    pub background_calls: u64,
}

impl Outcome {
    /// A program refused before anything moved.
    #[must_use]
    pub fn refused(complaint: Complaint) -> Self {
        Self {
            end: End::Refused(complaint),
            ticks: 0,
            digest: FrameDigest::default().value(),
            messages: Vec::new(),
            unused_events: 0,
            background_calls: 0,
        }
    }
}

/// Where the run stands.
#[derive(Default)]
struct Progress {
    ended_by: Option<End>,
    held: bool,
    /// Consecutive ticks at rest.
    resting: u32,
    last_block: u32,
}

/// Runs `program` on `machine` and shows every tick to `observer`.
///
/// # Errors
/// Only those of `observer`.
pub fn run(
    program: &Program,
    machine: &Machine,
    options: &Options,
    observer: &mut (impl Observer + ?Sized),
) -> io::Result<Outcome> {
    let lines = program.lines().map(Line::Borrowed);
    run_lines(lines, machine, options, observer)
}

/// As [`run`], of `lines` that need not exist before they are sent: memory does not depend on how many there are.
///
/// # Errors
/// Only those of `observer`.
pub fn run_lines<'p>(
    lines: impl Iterator<Item = Line<'p>> + 'p,
    machine: &Machine,
    options: &Options,
    observer: &mut (impl Observer + ?Sized),
) -> io::Result<Outcome> {
    let config = machine.config;
    let mut core = Box::new(Core::new());
    let (mut controller, mut servo) = core.split(&config);
    controller.set_program_stops(!options.auto_start);
    let mut feeder = Feeder::of_lines(lines, controller.receive_free());
    let mut messages = Vec::new();
    let mut digest = FrameDigest::default();
    let mut events = options.events.iter().peekable();
    let mut clock = Clock::new();
    let mut progress = Progress::default();
    let mut background_calls = 0;
    let mut answered = 0;
    // After an error the machine is at rest only if nothing that waits for more text can still begin to move.
    let settle = config.starve_ticks.saturating_add(config.servo_hz / 100);
    let patience = (config.servo_hz / 10).max(1);
    let still = StepFrame::default();
    let mut tick: Tick = 0;

    let end = loop {
        while let Some(row) = events.next_if(|row| clock.is_due(row) && servo.request(row.event)) {
            clock.acted(row.event);
            match row.event {
                Event::Hold => progress.held = true,
                Event::Resume => progress.held = false,
                Event::Reset => {
                    feeder.stop();
                    progress.ended_by.get_or_insert(End::Reset);
                }
                Event::Fault | Event::Feed(_) | Event::Rapid(_) | Event::Starve(_) => {}
            }
            progress.resting = 0;
        }

        let mut polls = 0;
        loop {
            let mut busy = false;
            while let Some(bytes) = feeder.offer(controller.receive_free()) {
                bytes.iter().for_each(|&byte| controller.receive(byte));
                busy = true;
            }
            busy |= controller.poll(tick);
            while let Some(byte) = controller.transmit() {
                let Some(reply) = feeder.take(byte) else {
                    continue;
                };
                busy = true;
                match reply {
                    Reply::Error(complaint) => {
                        feeder.stop();
                        progress.ended_by.get_or_insert(End::Refused(complaint));
                    }
                    Reply::Alarm(code) => {
                        feeder.stop();
                        progress.ended_by.get_or_insert(End::Alarm(code));
                    }
                    Reply::Message(text) if messages.len() < MESSAGES_MAX => messages.push(text),
                    Reply::Ok | Reply::Message(_) | Reply::Other(_) => {}
                }
            }
            polls += 1;
            if !busy || polls >= POLLS_MAX {
                break;
            }
        }
        background_calls += u64::from(polls);
        if feeder.answered() != answered {
            answered = feeder.answered();
            observer.progress(answered);
        }

        if polls >= POLLS_MAX {
            break End::Stuck;
        }
        if progress.ended_by.is_none() && feeder.is_done() && controller.is_idle() {
            break End::Finished;
        }
        if progress.resting >= settle {
            if let Some(end) = progress.ended_by.take() {
                break end;
            }
        }
        if progress.resting >= patience
            && controller.state() == State::Hold
            && events.peek().is_none()
        {
            let waiting = End::Waiting {
                held: progress.held,
                after_block: progress.last_block,
            };
            break progress.ended_by.take().unwrap_or(waiting);
        }
        if tick >= options.max_ticks {
            break progress.ended_by.take().unwrap_or(End::TimeBound);
        }

        servo.tick();
        let frame = servo.frame().unwrap_or(&still);
        let sample = servo.sample();
        if sample.moving {
            digest.update(frame);
        }
        observer.tick(tick, &sample, frame)?;
        progress.resting = if sample.moving {
            0
        } else {
            progress.resting.saturating_add(1)
        };
        if sample.block != 0 {
            progress.last_block = sample.block;
        }
        // Only a row that is still to come reads the clock.
        if let Some(next) = events.peek().copied() {
            clock.tick(sample.moving, controller.standing(), Some(next));
        }
        tick += 1;
    };
    Ok(Outcome {
        end,
        ticks: tick,
        digest: digest.value(),
        messages,
        unused_events: events.count(),
        background_calls,
    })
}

#[cfg(test)]
mod tests;
