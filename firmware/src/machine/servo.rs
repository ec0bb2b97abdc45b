//! The interrupt half: one call per servo tick.
//!
//! Budget: the work of a tick is one forward-difference step, one evaluation of sigma, u and P on five
//! axes, and one frame. Joints crossed within a tick add a dequeue each.

use core::sync::atomic::Ordering::{Acquire, Relaxed, Release};

use heapless::spsc::Consumer;

use super::shared::Shared;
use super::Sample;
use crate::config::Config;
use crate::geometry::arc::ServoSegment;
use crate::interpolator::{position, widen, PathState, Piece, PieceEnd, T_FRAC};
use crate::stepgen::{generator::emitted, StepFrame, StepGenerator};
use crate::units::{Steps, AXES};

/// Segments thrown away per tick while draining.
const DRAIN_PER_TICK: usize = 16;

/// What is running.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Run {
    Rest,
    Piece(Piece),
    /// Coming to rest because no piece followed; index of the phase.
    Escape(Piece, usize),
}

/// Interrupt half of the machine.
pub struct Servo<'a> {
    segments: Consumer<'a, ServoSegment>,
    pieces: Consumer<'a, Piece>,
    shared: &'a Shared,
    hz: f32,
    run: Run,
    /// Ticks left of what is running.
    left: u32,
    state: PathState,
    sequence: u32,
    generation: u32,
    executed: u32,
    steps: StepGenerator,
    moved: bool,
    block: u32,
}

impl<'a> Servo<'a> {
    pub(super) fn new(
        segments: Consumer<'a, ServoSegment>,
        pieces: Consumer<'a, Piece>,
        shared: &'a Shared,
        config: &Config,
    ) -> Self {
        Self {
            segments,
            pieces,
            shared,
            hz: config.servo_hz as f32,
            run: Run::Rest,
            left: 0,
            state: PathState::default(),
            sequence: 0,
            generation: 0,
            executed: 0,
            steps: StepGenerator::new([0; AXES], config.pulse_slots, config.dir_setup_slots),
            moved: false,
            block: 0,
        }
    }

    /// Advances one servo tick.
    pub fn tick(&mut self) -> StepFrame {
        self.moved = false;
        if self.shared.fault.load(Relaxed) {
            self.freeze();
            return StepFrame::default();
        }
        if self.left == 0 {
            self.next_run();
        }
        let jerk = match self.run {
            Run::Rest => {
                self.drain();
                return StepFrame::default();
            }
            Run::Piece(piece) => piece.jerk,
            Run::Escape(piece, phase) => piece.escape[phase].0,
        };
        self.state.step(jerk);
        self.left -= 1;
        let mut target = self.follow();
        if self.left == 0 {
            target = self.finish_run(target);
        }
        let frame = self.steps.advance(&target);
        self.moved = true;
        self.executed = self.executed.wrapping_add(1);
        self.publish();
        frame
    }

    /// Picks what comes after a finished run.
    fn next_run(&mut self) {
        if self.run == Run::Rest && !self.shared.ready.load(Acquire) {
            // The first pieces of a path may be short; starting on them would outrun the planner.
            return;
        }
        while let Some(piece) = self.pieces.dequeue() {
            if piece.generation == self.generation && piece.ticks > 0 {
                self.run = Run::Piece(piece);
                self.left = piece.ticks;
                self.shared.moving.store(true, Relaxed);
                return;
            }
        }
        match self.run {
            Run::Piece(piece) if piece.end == PieceEnd::Continue => {
                // Nothing follows although the machine moves. What is planned later does not fit on.
                self.generation = self.generation.wrapping_add(1);
                self.shared.generation.store(self.generation, Release);
                self.escape(piece, 0);
            }
            Run::Escape(piece, phase) => self.escape(piece, phase + 1),
            _ => self.rest(),
        }
    }

    fn escape(&mut self, piece: Piece, from: usize) {
        for phase in from..piece.escape.len() {
            if piece.escape[phase].1 > 0 {
                self.run = Run::Escape(piece, phase);
                self.left = piece.escape[phase].1;
                return;
            }
        }
        self.state.v = 0;
        self.state.a = 0;
        self.rest();
    }

    fn rest(&mut self) {
        if self.run != Run::Rest || self.shared.moving.load(Relaxed) {
            self.run = Run::Rest;
            self.shared.ready.store(false, Relaxed);
            self.announce_rest();
        }
    }

    fn announce_rest(&self) {
        self.shared.rest_s.store(self.state.s);
        for (wide, &position) in self.shared.rest_position.iter().zip(self.steps.position()) {
            wide.store(position);
        }
        self.shared.feed.store(0, Relaxed);
        self.shared.moving.store(false, Release);
    }

    /// Moves to the segment the path coordinate lies in and evaluates it.
    fn follow(&mut self) -> [i64; AXES] {
        while let Some(segment) = self.segments.peek() {
            if self.state.coordinate() < segment.length {
                self.block = segment.block;
                return position(segment, self.state.coordinate().max(0));
            }
            if self.segments.len() < 2 {
                // The last segment known: its end is where the path ends.
                return segment.end();
            }
            self.state.s -= widen(segment.length);
            self.segments.dequeue();
            self.sequence = self.sequence.wrapping_add(1);
        }
        *self.steps.position()
    }

    fn finish_run(&mut self, target: [i64; AXES]) -> [i64; AXES] {
        let Run::Piece(piece) = self.run else {
            return target;
        };
        match piece.end {
            PieceEnd::Continue => target,
            PieceEnd::StopHere => {
                self.state.v = 0;
                self.state.a = 0;
                target
            }
            PieceEnd::StopAfter(last) => {
                // Exactly on the end point, whatever the rounding of s.
                let mut end = target;
                if last.wrapping_add(1) == self.sequence {
                    if let Some(segment) = self.segments.peek() {
                        end = segment.start;
                    }
                }
                while last.wrapping_sub(self.sequence) < u32::MAX / 2 {
                    let Some(segment) = self.segments.dequeue() else {
                        break;
                    };
                    end = segment.end();
                    self.sequence = self.sequence.wrapping_add(1);
                }
                self.state = PathState::default();
                end
            }
        }
    }

    /// Throws away what is queued, a few items per tick, when asked to.
    fn drain(&mut self) {
        if !self.shared.drain.load(Acquire) {
            return;
        }
        while self.pieces.dequeue().is_some() {}
        for _ in 0..DRAIN_PER_TICK {
            if self.segments.dequeue().is_none() {
                self.state = PathState::default();
                self.announce_rest();
                self.shared.sequence.store(self.sequence, Release);
                self.shared.drain.store(false, Release);
                return;
            }
            self.sequence = self.sequence.wrapping_add(1);
        }
    }

    /// Emergency: no step from now on; the commanded position stays where it is.
    fn freeze(&mut self) {
        self.left = 0;
        self.state.v = 0;
        self.state.a = 0;
        if self.run != Run::Rest {
            self.generation = self.generation.wrapping_add(1);
            self.shared.generation.store(self.generation, Release);
        }
        self.rest();
        self.drain();
    }

    fn publish(&self) {
        for (word, &position) in self.shared.emitted.iter().zip(self.steps.position()) {
            word.store(emitted(position), Relaxed);
        }
        self.shared.feed.store(self.feed().to_bits(), Relaxed);
        self.shared.block.store(self.block, Relaxed);
        self.shared.sequence.store(self.sequence, Release);
        self.shared.executed.store(self.executed, Release);
    }

    /// Path velocity to 2^-30 units per tick: 32 bits convert in hardware, 128 would not.
    fn feed(&self) -> f32 {
        ((self.state.v + (1 << (T_FRAC - 31))) >> (T_FRAC - 30)) as i32 as f32
            * (self.hz / (1_u32 << 30) as f32)
    }

    /// What the last tick did.
    #[must_use]
    pub fn sample(&self) -> Sample {
        let position = self.steps.position();
        Sample {
            commanded: position.map(Steps::from_bits),
            emitted: position.map(emitted),
            feed: if self.moved { self.feed() } else { 0.0 },
            block: if self.moved { self.block } else { 0 },
            moving: self.moved,
        }
    }
}
