//! Runs program text through the core the way a sender and a servo clock would.

use std::collections::VecDeque;

use pentaspline::config::Config;
use pentaspline::machine::{Core, Event, State};
use pentaspline::stepgen::record::FrameDigest;
use pentaspline::units::AXES;

/// One servo tick as recorded.
#[derive(Clone, Copy, Debug)]
pub struct Tick {
    /// Commanded position, Q32.32 steps.
    pub commanded: [i64; AXES],
    /// Steps emitted so far.
    pub emitted: [i32; AXES],
    /// Sum of the step counts of all frames so far.
    pub summed: [i64; AXES],
    /// Path velocity as the core states it, mm/s.
    pub feed: f32,
    /// Text line.
    pub block: u32,
    /// In motion.
    pub moving: bool,
}

/// Everything one run did.
#[derive(Debug, Default)]
pub struct Run {
    /// Per servo tick.
    pub ticks: Vec<Tick>,
    /// All text the controller sent.
    pub output: String,
    /// Digest of the frames of ticks in motion.
    pub digest: u64,
    /// The run ended by itself, at rest.
    pub finished: bool,
}

impl Run {
    /// Final emitted steps.
    #[must_use]
    pub fn end(&self) -> [i32; AXES] {
        self.ticks.last().map_or([0; AXES], |t| t.emitted)
    }
}

/// How to drive.
pub struct Script<'a> {
    /// Program text, lines end in `\n`.
    pub text: &'a str,
    /// Events at exact ticks, in order.
    pub events: Vec<(u64, Event)>,
    /// Ticks between two bytes the sender offers (0: as fast as the buffer takes them).
    pub byte_every: u64,
    /// Give up after this many ticks.
    pub limit: u64,
    /// `M0` does not wait.
    pub auto_start: bool,
    /// Background work runs only every so many ticks (1: always).
    pub poll_every: u64,
}

impl<'a> Script<'a> {
    /// Plain run of `text`.
    #[must_use]
    pub fn new(text: &'a str) -> Self {
        Self {
            text,
            events: Vec::new(),
            byte_every: 0,
            limit: 2_000_000,
            auto_start: true,
            poll_every: 1,
        }
    }
}

/// Drives the core through `script` until it is idle (and no event is left) or the limit.
#[must_use]
pub fn drive(config: &Config, script: &Script<'_>) -> Run {
    let mut core = Box::new(Core::new());
    let (mut controller, mut servo) = core.split(config);
    controller.set_program_stops(!script.auto_start);
    let mut text: VecDeque<u8> = script.text.bytes().collect();
    let mut events: VecDeque<_> = script.events.iter().copied().collect();
    let mut run = Run::default();
    let mut digest = FrameDigest::default();
    let mut summed = [0_i64; AXES];
    for now in 0..script.limit {
        while events.front().is_some_and(|&(tick, _)| tick <= now) {
            let (_, event) = events.pop_front().expect("front was seen");
            controller.event(event);
        }
        // Text and background work take turns until neither gets further in this tick.
        loop {
            let mut busy = false;
            let offer = script.byte_every == 0 || now % script.byte_every == 0;
            while offer && !text.is_empty() && controller.receive_free() > 2 {
                controller.receive(text.pop_front().expect("not empty"));
                busy = true;
                if script.byte_every != 0 {
                    break;
                }
            }
            if now % script.poll_every == 0 {
                while controller.poll(now) {
                    busy = true;
                }
            }
            while let Some(byte) = controller.transmit() {
                run.output.push(char::from(byte));
            }
            if !busy || script.byte_every != 0 {
                break;
            }
        }
        let frame = servo.tick();
        let sample = servo.sample();
        if sample.moving {
            digest.update(&frame);
        }
        for (sum, axis) in summed.iter_mut().zip(&frame.axes) {
            *sum += i64::from(axis.signed_count());
        }
        run.ticks.push(Tick {
            commanded: sample.commanded.map(|p| p.to_bits()),
            emitted: sample.emitted,
            summed,
            feed: sample.feed,
            block: sample.block,
            moving: sample.moving,
        });
        let stuck = controller.state() == State::Alarm;
        if (text.is_empty() || stuck) && events.is_empty() && controller.is_idle() {
            run.finished = true;
            break;
        }
    }
    run.digest = digest.value();
    run
}
