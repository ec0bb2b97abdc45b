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
use crate::interpolator::braking::{BrakeLimits, Braking};
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
    Piece,
    /// Coming to rest because of a hold, or because no piece followed.
    Brake,
}

/// From so many ticks before the end of a landing on, a hold lets it end: braking would take as long, and rounding may
/// already have carried the motion over the stop.
const LANDED: u32 = 3;

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
    /// Jerk of what is running, and ticks left of it; how it ends, and how to come to rest instead.
    jerk: i64,
    ticks: u32,
    end: PieceEnd,
    limits: BrakeLimits,
    braking: Braking,
    /// The last request of [`Shared::hold`] that was answered.
    answered: u32,
    /// The way left counts to the end of the segment at the head of the queue if that is `entered`, else to its start.
    motion: Motion,
    entered: bool,
    /// End of the segment before that, and whether it was passed at a crawl; if not, it is of no interest.
    passed: [Phase; AXES],
    crawled: bool,
    sequence: u32,
    generation: u32,
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
            end: PieceEnd::Continue,
            limits: BrakeLimits::default(),
            braking: Braking::default(),
            answered: 0,
            motion: Motion::default(),
            entered: false,
            passed: [0; AXES],
            crawled: false,
            sequence: 0,
            generation: 0,
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
        let hold = self.shared.hold.load(Relaxed);
        if (self.ticks == 0 || hold != self.answered) && !self.next_run(hold) {
            return;
        }
        self.ticks -= 1;
        if !self.glide() {
            self.turn();
        }
        if self.steps.frame().is_some() {
            self.publish_steps();
        }
        let executed = &self.shared.executed;
        executed.store(executed.load(Relaxed).wrapping_add(1), Release);
    }

    /// A request between two ticks. A hold acts with the next tick, and so does the one that a reset begins with. Any other
    /// request carries the tick, so what comes of it does not depend on how far ahead the planner is. `false` if there is
    /// no room for it yet. A fault is not for the interrupt to ask for.
    pub fn request(&mut self, event: Event) -> bool {
        let change = match event {
            Event::Feed(percent) => Change::Feed(percent),
            Event::Rapid(percent) => Change::Rapid(percent),
            Event::Starve(ticks) => Change::Starve(ticks),
            Event::Hold => {
                self.shared.request_hold(true);
                return true;
            }
            Event::Resume => Change::Resume,
            Event::Reset => {
                self.shared.request_hold(true);
                Change::Reset
            }
            Event::Fault => return true,
        };
        let tick = self.shared.executed.load(Relaxed);
        self.requests.enqueue(Request { tick, change }).is_ok()
    }

    /// What this tick asks of the step port; `None` if no axis steps.
    #[inline]
    #[must_use]
    pub fn frame(&self) -> Option<&StepFrame> {
        self.steps.frame()
    }

    /// Picks what comes after a finished run, or after a request to hold; `false` at rest.
    #[inline(never)]
    fn next_run(&mut self, hold: u32) -> bool {
        if hold != self.answered {
            self.answer(hold);
        }
        match self.run {
            Run::Brake => self.slow_down(),
            Run::Piece if self.ticks == 0 => self.follow_run(),
            Run::Piece => {}
            Run::Rest => {
                self.drop_void();
                // The first pieces of a path may be short; starting on them would outrun the planner.
                if hold & 1 == 0 && self.shared.ready.load(Acquire) {
                    self.follow_run();
                }
            }
        }
        self.moved = self.run != Run::Rest;
        if !self.moved {
            self.drain();
        }
        self.moved
    }

    /// Answers a request to hold, at once unless the motion is about to land; one to go on needs no answer.
    fn answer(&mut self, hold: u32) {
        if hold & 1 != 0 {
            match self.run {
                Run::Brake => {}
                Run::Rest => self.give_up(),
                Run::Piece if self.ticks == 0 && self.end != PieceEnd::Continue => {
                    self.give_up();
                    self.rest();
                }
                Run::Piece if self.is_landing() => return,
                Run::Piece => self.brake(),
            }
        }
        self.answered = hold;
    }

    /// The plan ends at rest as soon as braking would, or braking would run over the stop.
    fn is_landing(&self) -> bool {
        let beyond = self.sequence.wrapping_sub(self.limits.last).wrapping_sub(1);
        let ends = self.end != PieceEnd::Continue && self.ticks <= LANDED;
        self.limits.waits || ends || beyond < u32::MAX / 2
    }

    /// What is planned from now on does not fit on what is queued.
    fn give_up(&mut self) {
        self.generation = self.generation.wrapping_add(1);
        self.shared.generation.store(self.generation, Release);
    }

    fn brake(&mut self) {
        self.give_up();
        let Motion { v, a, .. } = self.motion;
        self.braking = Braking::new(&self.limits, v.get(), -a.get());
        self.run = Run::Brake;
    }

    /// The next tick of braking.
    fn slow_down(&mut self) {
        let Motion { v, a, .. } = self.motion;
        if v.get() <= 0 {
            self.motion.halt();
            self.rest();
            return;
        }
        self.motion.a = Wide::new(-self.braking.next(v.get(), -a.get()));
        (self.jerk, self.ticks) = (0, 1);
    }

    fn follow_run(&mut self) {
        while let Some(piece) = self.pieces.peek() {
            let fits = piece.generation == self.generation && piece.ticks > 0;
            if fits {
                (self.jerk, self.ticks) = (piece.jerk, piece.ticks);
                (self.end, self.limits) = (piece.end, piece.brake);
            }
            self.pieces.dequeue();
            if fits {
                self.run = Run::Piece;
                self.enter();
                self.shared.moving.store(true, Relaxed);
                return;
            }
        }
        if self.run == Run::Piece && self.end == PieceEnd::Continue {
            // Nothing follows although the machine moves.
            self.brake();
            self.slow_down();
        } else {
            self.rest();
        }
    }

    /// Pieces of an older generation make room for those to come.
    fn drop_void(&mut self) {
        let generation = self.generation;
        let void = |piece: &Piece| piece.generation != generation;
        while self.pieces.peek().is_some_and(void) {
            self.pieces.dequeue();
        }
    }

    fn rest(&mut self) {
        self.ticks = 0;
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
    ///
    /// What is of interest in it is looked at where it lies, before: taken out, it would be copied.
    #[inline(always)]
    fn leave(&mut self) {
        if self.segments.dequeue().is_none() {
            return;
        }
        self.sequence = self.sequence.wrapping_add(1);
        self.shared.sequence.store(self.sequence, Release);
        self.entered = false;
    }

    /// Where the segment at the head of the queue ends.
    #[inline(never)]
    fn segment_end(&self) -> Option<[Phase; AXES]> {
        self.segments.peek().map(|segment| segment.end(&self.scale))
    }

    /// One tick along the segment at hand; `false` if the motion has left it, or a run ends, and [`Self::turn`] is due.
    #[inline(always)]
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
        let (steps, scale, axes) = (&mut self.steps, &self.scale, &segment.axes);
        macro_rules! each_axis {
            ($at:ident: $($a:literal)*) => {
                $(steps.lead($a, axes[$a].$at(&place, scale[$a]));)*
            };
        }
        if segment.is_straight() {
            each_axis!(at_straight: 0 1 2 3 4);
        } else {
            each_axis!(at: 0 1 2 3 4);
        }
        const _: () = assert!(AXES == 5);
    }

    /// The end of a tick that crosses a joint or ends a run.
    #[inline(never)]
    fn turn(&mut self) {
        self.publish_feed();
        // The end of the last segment known is where the path ends.
        self.enter();
        while self.motion.left.is_negative() {
            if self.run == Run::Brake && self.sequence == self.limits.last {
                // Braking does not run over a stop.
                self.stop_after(self.limits.last);
                return;
            }
            if self.segments.len() <= 1 {
                break;
            }
            self.crawled = self.motion.v.get() < CRAWL;
            if self.crawled {
                self.passed = self.segment_end().unwrap_or(self.passed);
            }
            self.leave();
            self.enter();
        }
        if self.ticks == 0 && self.run == Run::Piece {
            match self.end {
                PieceEnd::StopAfter(last) => {
                    self.stop_after(last);
                    return;
                }
                PieceEnd::StopHere => self.motion.halt(),
                PieceEnd::Continue => {}
            }
        }
        // Rounding may carry the motion over either end; the position stays inside.
        let mut left = self.motion.left;
        if left.is_negative() {
            left = Wide::default();
        } else if self.motion.v.is_negative() {
            let length = self.segments.peek().map_or(0, |next| widen(next.length));
            left = Wide::new(left.get().min(length));
        }
        self.evaluate(left);
    }

    /// Stands still exactly on the end of segment `last`, whatever the rounding of s.
    fn stop_after(&mut self, last: u32) {
        let mut end = None;
        if last.wrapping_add(1) == self.sequence {
            // Passed faster than that, it was not a landing: within rounding of the end is near enough.
            let next = self.segments.peek();
            end = if self.crawled {
                Some(self.passed)
            } else {
                next.map(|next| next.start(&self.scale))
            };
            self.entered = false;
        }
        while last.wrapping_sub(self.sequence) < u32::MAX / 2 {
            let Some(at) = self.segment_end() else {
                break;
            };
            end = Some(at);
            self.leave();
        }
        self.motion = Motion::default();
        for (axis, &phase) in end.iter().flatten().enumerate() {
            self.steps.lead(axis, phase);
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
        self.motion.halt();
        if self.run != Run::Rest {
            self.give_up();
        }
        self.rest();
        self.drain();
    }

    /// For status reports: with every step, and wherever a piece or a segment ends, is often enough.
    fn publish_feed(&self) {
        let feed = self.motion.v.above(T_FRAC - FEED_FRAC);
        self.shared.feed.store(feed, Relaxed);
    }

    fn publish_steps(&self) {
        self.publish_feed();
        for (word, &steps) in self.shared.emitted.iter().zip(self.steps.emitted()) {
            word.store(steps, Relaxed);
        }
    }

    /// What the last tick did.
    #[inline]
    #[must_use]
    pub fn sample(&self) -> Sample {
        // Rounded to nearest: what is left of v at rest is none. Of 96 bits, 55 are left.
        let feed = ((self.motion.v.get() >> (T_FRAC - FEED_FRAC - 1)) as i64 + 1) >> 1;
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
