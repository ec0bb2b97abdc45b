//! Runs program text through the core the way a sender and a servo clock would.
//!
//! [`Rig`] is the core on a bench: bytes in, ticks, bytes out, everything recorded. [`drive`] plays a whole
//! [`Script`] on it.

use std::collections::VecDeque;

use pentaspline::config::Config;
use pentaspline::machine::{Controller, Core, Event, Servo, State};
use pentaspline::stepgen::record::FrameDigest;
use pentaspline::units::AXES;

use crate::rng::Rng;

/// Background calls within one tick after which the core counts as stuck.
const POLLS_MAX: u32 = 1_000_000;

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

    /// Lines of the controller that are neither empty nor `ok`.
    pub fn remarks(&self) -> impl Iterator<Item = &str> {
        let lines = self.output.lines().map(str::trim);
        lines.filter(|line| !line.is_empty() && *line != "ok")
    }

    /// Ticks in motion.
    #[must_use]
    pub fn moving(&self) -> usize {
        self.ticks.iter().filter(|tick| tick.moving).count()
    }
}

/// How text reaches the controller. No sender writes more than the receive buffer takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sender {
    /// As fast as the buffer takes it.
    Full,
    /// Bursts of 1..=`bytes` bytes, 0..=`gap` ticks apart, drawn from `seed`.
    Bursts {
        /// Seed.
        seed: u64,
        /// Longest burst.
        bytes: u64,
        /// Longest pause.
        gap: u64,
    },
}

/// How to drive.
pub struct Script<'a> {
    /// Program text, lines end in `\n`.
    pub text: &'a str,
    /// Events at exact ticks, in order. A reset ends the text.
    pub events: Vec<(u64, Event)>,
    /// Sender.
    pub sender: Sender,
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
            sender: Sender::Full,
            limit: 2_000_000,
            auto_start: true,
            poll_every: 1,
        }
    }

    /// The same with events.
    #[must_use]
    pub fn with_events(text: &'a str, events: Vec<(u64, Event)>) -> Self {
        Self {
            events,
            ..Self::new(text)
        }
    }
}

/// The core on a bench.
pub struct Rig<'a> {
    /// Background half.
    pub controller: Controller<'a>,
    servo: Servo<'a>,
    /// Ticks so far.
    pub now: u64,
    /// Record.
    pub run: Run,
    digest: FrameDigest,
    summed: [i64; AXES],
}

/// Gives `work` a fresh core for `config`, and its record back.
pub fn with_rig(config: &Config, work: impl FnOnce(&mut Rig<'_>)) -> Run {
    let mut core = Box::new(Core::new());
    let (controller, servo) = core.split(config);
    let mut rig = Rig {
        controller,
        servo,
        now: 0,
        run: Run::default(),
        digest: FrameDigest::default(),
        summed: [0; AXES],
    };
    work(&mut rig);
    rig.run.digest = rig.digest.value();
    rig.run
}

impl Rig<'_> {
    /// Background work until there is none, and everything said collected; `true` if there was any.
    ///
    /// # Panics
    /// If it never ends.
    pub fn settle(&mut self) -> bool {
        let mut busy = false;
        for _ in 0..POLLS_MAX {
            let more = self.controller.poll(self.now);
            while let Some(byte) = self.controller.transmit() {
                self.run.output.push(char::from(byte));
            }
            if !more {
                return busy;
            }
            busy = true;
        }
        panic!("tick {}: background work never ends", self.now);
    }

    /// Bytes onto the wire, and the background work they cause.
    pub fn send(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.controller.receive(byte);
        }
        self.settle();
    }

    /// One servo tick, recorded.
    pub fn tick(&mut self) {
        self.servo.tick();
        let frame = self.servo.frame().copied().unwrap_or_default();
        let sample = self.servo.sample();
        if sample.moving {
            self.digest.update(&frame);
        }
        for (sum, axis) in self.summed.iter_mut().zip(&frame.axes) {
            *sum += i64::from(axis.signed_count());
        }
        self.run.ticks.push(Tick {
            commanded: sample.commanded.map(|p| p.to_bits()),
            emitted: sample.emitted,
            summed: self.summed,
            feed: sample.feed,
            block: sample.block,
            moving: sample.moving,
        });
        self.now += 1;
    }

    /// Ticks with background work between them.
    pub fn advance(&mut self, ticks: u64) {
        for _ in 0..ticks {
            self.settle();
            self.tick();
        }
        self.settle();
    }

    /// Ticks until nothing is left to do; `false` if that takes more than `limit`.
    pub fn until_idle(&mut self, limit: u64) -> bool {
        for _ in 0..limit {
            self.settle();
            if self.controller.is_idle() {
                return true;
            }
            self.tick();
        }
        false
    }

    /// What the controller has said since the last call.
    pub fn said(&mut self) -> String {
        std::mem::take(&mut self.run.output)
    }
}

/// Drives the core through `script` until it is idle (and no event is left) or the limit.
#[must_use]
pub fn drive(config: &Config, script: &Script<'_>) -> Run {
    let mut text: VecDeque<u8> = script.text.bytes().collect();
    let mut events: VecDeque<_> = script.events.iter().copied().collect();
    let mut rng = Rng::new(match script.sender {
        Sender::Bursts { seed, .. } => seed,
        Sender::Full => 0,
    });
    let mut next_burst = 0;
    with_rig(config, |rig| {
        rig.controller.set_program_stops(!script.auto_start);
        for now in 0..script.limit {
            while events.front().is_some_and(|&(tick, _)| tick <= now) {
                let (_, event) = events.pop_front().expect("front was seen");
                rig.controller.event(event);
                if event == Event::Reset {
                    text.clear();
                }
            }
            let mut burst = match script.sender {
                Sender::Full => u64::MAX,
                Sender::Bursts { bytes, gap, .. } if now >= next_burst => {
                    next_burst = now + 1 + rng.within(0, gap);
                    rng.within(1, bytes)
                }
                Sender::Bursts { .. } => 0,
            };
            // Text and background work take turns until neither gets further in this tick.
            loop {
                let mut busy = false;
                while burst > 0 && !text.is_empty() && rig.controller.receive_free() > 2 {
                    rig.controller.receive(text.pop_front().expect("not empty"));
                    burst -= 1;
                    busy = true;
                }
                if now % script.poll_every == 0 {
                    busy |= rig.settle();
                } else {
                    busy = false;
                }
                if !busy {
                    break;
                }
            }
            rig.tick();
            let stuck = rig.controller.state() == State::Alarm;
            if (text.is_empty() || stuck) && events.is_empty() && rig.controller.is_idle() {
                rig.run.finished = true;
                break;
            }
        }
    })
}
