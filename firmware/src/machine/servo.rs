//! The interrupt half: one call per servo tick.
//!
//! Budget: the work of a tick is one forward-difference step, one evaluation of five quintics, and the edges of the
//! axes that step. Joints crossed within a tick add a dequeue each. What happens less often than every tick lies in
//! functions of its own, so that a tick does not carry it.

use core::sync::atomic::Ordering::{Acquire, Relaxed, Release};

use heapless::spsc::{Consumer, Producer};

use super::shared::Shared;
use super::{Event, Sample};
use crate::config::Config;
use crate::interpolator::motion::{Motion, Wide};
use crate::interpolator::segment::{fine_scale, ServoSegment};
use crate::interpolator::{widen, Piece, PieceEnd, T_FRAC};
use crate::planner::tempo::{Change, Request};
use crate::stepgen::{StepFrame, StepGenerator};
use crate::units::{Phase, Steps, AXES};

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

/// Fractional bits of the published path velocity.
const FEED_FRAC: u32 = 30;

/// Path units per tick below which a joint may be a stop that rounding has carried the motion over: two ticks before its
/// end a landing still has the velocity of one tick of jerk, and no jerk is larger than 2^-9.
const CRAWL: i128 = 1 << (T_FRAC - 9);

/// Interrupt half of the machine.
pub struct Servo<'a> {
    segments: Consumer<'a, ServoSegment>,
    pieces: Consumer<'a, Piece>,
    requests: Producer<'a, Request>,
    shared: &'a Shared,
    hz: f32,
    /// Phase units per unit of the fine coefficients.
    scale: [i32; AXES],
    run: Run,
    /// Jerk of what is running, and ticks left of it.
    jerk: i64,
    ticks: u32,
    /// The way left counts to the end of the segment at the head of the queue if that is `entered`, else to its start.
    motion: Motion,
    entered: bool,
    /// End of the segment before that, if it was passed at a crawl.
    passed: Option<[Phase; AXES]>,
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
        requests: Producer<'a, Request>,
        shared: &'a Shared,
        config: &Config,
    ) -> Self {
        Self {
            segments,
            pieces,
            requests,
            shared,
            hz: config.servo_hz as f32,
            scale: fine_scale(config),
            run: Run::Rest,
            jerk: 0,
            ticks: 0,
            motion: Motion::default(),
            entered: false,
            passed: None,
            sequence: 0,
            generation: 0,
            executed: 0,
            steps: StepGenerator::new([0; AXES], config.pulse_slots, config.dir_setup_slots),
            moved: false,
            block: 0,
        }
    }

    /// Advances one servo tick; what it asks of the step port is in [`Self::frame`].
    pub fn tick(&mut self) {
        self.steps.begin();
        if self.shared.fault.load(Relaxed) {
            self.freeze();
            return;
        }
        if self.ticks == 0 && !self.next_run() {
            return;
        }
        self.ticks -= 1;
        if !self.glide() {
            self.turn();
        }
        self.executed = self.executed.wrapping_add(1);
        if self.steps.frame().is_some() {
            self.publish_steps();
        }
        self.shared
            .feed
            .store(self.motion.v.above(T_FRAC - FEED_FRAC), Relaxed);
        self.shared.executed.store(self.executed, Release);
    }

    /// A request between two ticks. It carries the tick, so what comes of it does not depend on how far ahead the planner
    /// is. `false` if there is no room for it yet. A fault is not for the interrupt to ask for.
    pub fn request(&mut self, event: Event) -> bool {
        let change = match event {
            Event::Feed(percent) => Change::Feed(percent),
            Event::Rapid(percent) => Change::Rapid(percent),
            Event::Starve(ticks) => Change::Starve(ticks),
            Event::Hold => Change::Hold,
            Event::Resume => Change::Resume,
            Event::Reset => Change::Reset,
            Event::Fault => return true,
        };
        let tick = self.executed;
        self.requests.enqueue(Request { tick, change }).is_ok()
    }

    /// What this tick asks of the step port; `None` if no axis steps.
    #[inline]
    #[must_use]
    pub fn frame(&self) -> Option<&StepFrame> {
        self.steps.frame()
    }

    /// Picks what comes after a finished run; `false` at rest.
    #[inline(never)]
    fn next_run(&mut self) -> bool {
        // The first pieces of a path may be short; starting on them would outrun the planner.
        if self.run != Run::Rest || self.shared.ready.load(Acquire) {
            self.follow_run();
        }
        self.moved = self.run != Run::Rest;
        if !self.moved {
            self.drain();
        }
        self.moved
    }

    fn follow_run(&mut self) {
        while let Some(piece) = self.pieces.dequeue() {
            if piece.generation == self.generation && piece.ticks > 0 {
                self.run = Run::Piece(piece);
                (self.jerk, self.ticks) = (piece.jerk, piece.ticks);
                self.enter();
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
                (self.jerk, self.ticks) = piece.escape[phase];
                return;
            }
        }
        self.motion.halt();
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
        let left = self.motion.left.get();
        let length = match self.segments.peek() {
            Some(segment) if self.entered => widen(segment.length),
            _ => 0,
        };
        self.shared.rest_s.store(length - left);
        for (wide, position) in self.shared.rest_position.iter().zip(self.steps.position()) {
            wide.store(position);
        }
        self.publish_steps();
        self.shared.feed.store(0, Relaxed);
        self.shared.moving.store(false, Release);
    }

    /// Takes up the segment at the head of the queue.
    fn enter(&mut self) {
        if self.entered {
            return;
        }
        if let Some(segment) = self.segments.peek() {
            let left = self.motion.left.get().wrapping_add(widen(segment.length));
            self.motion.left = Wide::new(left);
            self.entered = true;
            self.block = segment.block;
            self.shared.block.store(self.block, Relaxed);
        }
    }

    /// Throws the segment at the head of the queue away.
    fn leave(&mut self) -> Option<ServoSegment> {
        let segment = self.segments.dequeue()?;
        self.sequence = self.sequence.wrapping_add(1);
        self.shared.sequence.store(self.sequence, Release);
        self.entered = false;
        Some(segment)
    }

    /// One tick along the segment at hand; `false` if the motion has left it, or a run ends, and [`Self::turn`] is due.
    #[inline(never)]
    fn glide(&mut self) -> bool {
        self.motion.step(self.jerk);
        let inside = self.ticks != 0 && !self.motion.is_beyond();
        if inside {
            self.evaluate(self.motion.left);
        }
        inside
    }

    /// Moves all axes to where the way `left` in the segment at hand is.
    ///
    /// Axis by axis and not in a loop: a fifth of a tick would be counting.
    #[inline(always)]
    fn evaluate(&mut self, left: Wide) {
        let Some(segment) = self.segments.peek() else {
            return;
        };
        let place = segment.place(left);
        let steps = &mut self.steps;
        let mut axis = |a: usize| steps.lead(a, segment.axes[a].at(&place, self.scale[a]));
        axis(0);
        axis(1);
        axis(2);
        axis(3);
        axis(4);
        const _: () = assert!(AXES == 5);
    }

    /// The end of a tick that crosses a joint or ends a run.
    #[inline(never)]
    fn turn(&mut self) {
        // The end of the last segment known is where the path ends.
        self.enter();
        while self.motion.left.is_negative() && self.segments.len() > 1 {
            if let Some(segment) = self.leave() {
                let crawls = self.motion.v.get() < CRAWL;
                self.passed = crawls.then(|| segment.end(&self.scale));
            }
            self.enter();
        }
        if self.ticks == 0 {
            if let Some(end) = self.finish_run() {
                for a in 0..AXES {
                    self.steps.lead(a, end[a]);
                }
                return;
            }
        }
        // Rounding may carry the motion over either end; the position stays inside.
        let length = self.segments.peek().map_or(0, |next| widen(next.length));
        self.evaluate(Wide::new(self.motion.left.get().clamp(0, length)));
    }

    /// Does what the last tick of a run does; where the path stops, its exact end.
    fn finish_run(&mut self) -> Option<[Phase; AXES]> {
        let Run::Piece(piece) = self.run else {
            return None;
        };
        match piece.end {
            PieceEnd::Continue => None,
            PieceEnd::StopHere => {
                self.motion.halt();
                None
            }
            PieceEnd::StopAfter(last) => {
                // Exactly on the end point, whatever the rounding of s.
                let mut end = None;
                if last.wrapping_add(1) == self.sequence {
                    // Passed faster than that, it was not a landing: within rounding of the end is near enough.
                    let next = self.segments.peek();
                    end = self.passed.or_else(|| Some(next?.start(&self.scale)));
                    self.entered = false;
                }
                while last.wrapping_sub(self.sequence) < u32::MAX / 2 {
                    let Some(segment) = self.leave() else {
                        break;
                    };
                    end = Some(segment.end(&self.scale));
                }
                self.motion = Motion::default();
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
                self.motion = Motion::default();
                self.entered = false;
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
        self.moved = false;
        self.ticks = 0;
        self.motion.halt();
        if self.run != Run::Rest {
            self.generation = self.generation.wrapping_add(1);
            self.shared.generation.store(self.generation, Release);
        }
        self.rest();
        self.drain();
    }

    fn publish_steps(&self) {
        for (word, &steps) in self.shared.emitted.iter().zip(self.steps.emitted()) {
            word.store(steps, Relaxed);
        }
    }

    /// What the last tick did.
    #[must_use]
    pub fn sample(&self) -> Sample {
        // Rounded to nearest: what is left of v at rest is none.
        let feed = (self.motion.v.above(T_FRAC - FEED_FRAC - 1) + 1) >> 1;
        Sample {
            commanded: self.steps.position().map(Steps::from_bits),
            emitted: *self.steps.emitted(),
            feed: if self.moved {
                feed as f32 * (self.hz / (1_u32 << FEED_FRAC) as f32)
            } else {
                0.0
            },
            block: if self.moved { self.block } else { 0 },
            moving: self.moved,
        }
    }
}

/// A published path velocity in path units per second.
pub(super) fn path_feed(published: i32, servo_hz: u32) -> f32 {
    published as f32 * (servo_hz as f32 / (1_u32 << FEED_FRAC) as f32)
}
