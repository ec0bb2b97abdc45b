//! Look-ahead: segments in, velocity profile out.
//!
//! In: [`ServoSegment`]s with their [`PathShape`]. Out, through two single-producer queues: the same segments,
//! and [`Piece`]s of constant jerk that say how to run along them. Segments never change once queued; hold
//! and starvation only change s(t), so the tool cannot leave the path.

pub mod brake;
mod change;
mod course;
mod descent;
mod guide;
mod halt;
pub mod joint;
pub mod limits;
pub mod nodes;
pub mod profile;
mod refuge;
mod scarce;
pub mod span;
pub mod tempo;

use core::sync::atomic::Ordering::{Acquire, Relaxed, Release};

use heapless::spsc::{Consumer, Producer};

use crate::config::Config;
use crate::geometry::arc::{Driven, PathShape, ServoSegment, S_FRAC};
use crate::interpolator::{widen, PathState, Piece, PieceEnd};
use crate::machine::shared::Shared;
use crate::machine::Event;
use crate::units::Position;
use change::Pace;
use guide::Guide;
use halt::Hint;
use joint::{joint, Joint};
use limits::{velocity_limit, CurveLimits, Rates};
use nodes::{Node, Nodes};
use profile::{Decision, View, LOOK_AHEAD};
use refuge::Way;
use scarce::Supply;
use tempo::{Request, Schedule, Tempo, FEED_MAX};

/// Ticks planned ahead of the interrupt. Covers the longest stretch of background work between two calls.
pub const LEAD_TICKS: u32 = 40;

/// Pieces that one decision makes, at most.
const PIECES_AT_ONCE: usize = 4;

// Planned but not yet driven (a joint per tick at most) and what is looked ahead: all fits into the window.
const _: () = assert!(LEAD_TICKS as usize + LOOK_AHEAD < nodes::NODES);

/// What the block says about a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SegmentOrder {
    /// Programmed feed, mm/s or degree/s; infinite for rapid motion.
    pub feed: f32,
    /// Come to rest at the end.
    pub exact_stop: bool,
    /// Jerk-limited.
    pub soft: bool,
}

/// The newest segment: its end joint is known only when the next one arrives.
#[derive(Clone, Copy)]
struct Pending {
    length_q: i64,
    block: u32,
    shape: PathShape,
    order: SegmentOrder,
    /// Velocity its own curve allows.
    curve_v: f32,
    /// Velocity the program asks for.
    programmed_v: f32,
}

impl Pending {
    /// Largest velocity at a feed override of `percent`, and a rapid override of 100.
    fn velocity(&self, percent: u8) -> f32 {
        let percent = if self.order.feed.is_finite() {
            percent
        } else {
            100
        };
        self.curve_v
            .min(self.programmed_v * (f32::from(percent) / 100.0))
    }
}

/// The two verdicts on a joint.
#[derive(Clone, Copy)]
struct Joints {
    programmed: Joint,
    raised: Joint,
}

impl Joints {
    const STOP: Self = Self {
        programmed: Joint::STOP,
        raised: Joint::STOP,
    };

    fn between(config: &Config, rates: &[Rates; 2], before: &Pending, after: &Pending) -> Self {
        // A joint of jerk-limited motion with any other is jerk-limited.
        let soft = before.order.soft || after.order.soft;
        let rates = &rates[usize::from(!soft)];
        let (ends, starts) = (&before.shape.end, &after.shape.start);
        let slower = |percent| before.velocity(percent).min(after.velocity(percent));
        let (v, most) = (slower(100), slower(FEED_MAX));
        let programmed = joint(config, ends, starts, v, rates, soft);
        let mut raised = programmed;
        if most > v && programmed.v > 0.0 {
            let faster = joint(config, ends, starts, most, rates, soft);
            // Whether the path rests there does not depend on the override.
            if faster.v > 0.0 {
                raised = faster;
            }
        }
        Self { programmed, raised }
    }
}

/// The planner. One per machine.
pub struct Planner<'a> {
    segments: Producer<'a, ServoSegment>,
    pieces: Producer<'a, Piece>,
    /// From the interrupt.
    requests: Consumer<'a, Request>,
    shared: &'a Shared,
    nodes: &'a mut Nodes,
    schedule: Schedule,
    pace: Pace,
    supply: Supply,
    /// For a hold.
    guide: Guide,
    braking: Hint,
    /// An event of the interrupt that the controller has not seen yet.
    raised: Option<Event>,
    /// Running number of the oldest node.
    first: u32,
    /// Node the planned state is in.
    cursor: usize,
    pending: Option<Pending>,
    state: PathState,
    planned: u32,
    generation: u32,
    /// A hold was answered: nothing is planned until it is taken back.
    held: bool,
    end: Option<Position>,
    /// Running number of the last node that the state was made safe for: the motion can be at rest at its end.
    last: u32,
    /// Limits of the axes, with jerk and without.
    rates: [Rates; 2],
}

impl<'a> Planner<'a> {
    pub(crate) fn new(
        segments: Producer<'a, ServoSegment>,
        pieces: Producer<'a, Piece>,
        requests: Consumer<'a, Request>,
        shared: &'a Shared,
        nodes: &'a mut Nodes,
    ) -> Self {
        Self {
            segments,
            pieces,
            requests,
            shared,
            nodes,
            schedule: Schedule::default(),
            pace: Pace::NEW,
            supply: Supply::NEW,
            braking: Hint::default(),
            guide: Guide::NONE,
            raised: None,
            first: 0,
            cursor: 0,
            pending: None,
            state: PathState::default(),
            planned: 0,
            generation: 0,
            held: false,
            end: None,
            last: 0,
            rates: [Rates::NONE; 2],
        }
    }

    /// True if [`Self::push`] can take a segment.
    #[must_use]
    pub fn has_room(&self) -> bool {
        self.segments.ready() && self.nodes.len() + 1 < nodes::NODES
    }

    /// Segments it can take.
    #[must_use]
    pub fn room(&self) -> usize {
        (self.segments.capacity() - self.segments.len()).min(nodes::NODES - 1 - self.nodes.len())
    }

    /// End of the newest segment taken, if there was one since the last [`Self::clear`].
    #[must_use]
    pub fn end_position(&self) -> Option<Position> {
        self.end
    }

    /// Takes the next segment of the path. The caller has checked [`Self::has_room`].
    #[inline(never)]
    pub fn push(&mut self, config: &Config, driven: &Driven, order: SegmentOrder) {
        let Driven {
            segment,
            shape,
            end,
        } = driven;
        if self.rates[0] == Rates::NONE {
            self.rates = [true, false].map(|soft| Rates::new(config, soft));
        }
        let next = Pending {
            length_q: segment.length,
            block: segment.block,
            shape: *shape,
            order,
            curve_v: velocity_limit(config, shape, length_of(segment.length), order.soft),
            programmed_v: programmed(config, shape, order.feed),
        };
        if let Some(before) = self.pending.take() {
            if before.order.exact_stop || before.shape.rotary_only != shape.rotary_only {
                self.complete(&before, &Joints::STOP);
            } else {
                let joints = Joints::between(config, &self.rates, &before, &next);
                self.complete(&before, &joints);
            }
        }
        self.pending = Some(next);
        self.end = Some(*end);
        let queued = self.segments.enqueue(*segment);
        debug_assert!(queued.is_ok(), "the caller checks has_room");
    }

    fn complete(&mut self, segment: &Pending, joints: &Joints) {
        let Pending {
            length_q,
            block: _,
            shape,
            order,
            curve_v,
            programmed_v,
        } = segment;
        let before = self.nodes.get(self.nodes.len().wrapping_sub(1));
        let entry = (&before.exit_taken, before.exit_v.max(before.other_v));
        let exit = (&joints.raised.taken, joints.raised.v);
        let rates = &self.rates[usize::from(!order.soft)];
        let length = length_of(*length_q);
        let mut node = Node {
            length_q: *length_q,
            length,
            limits: CurveLimits::new(shape, length, segment.velocity(100)).without_idle(
                rates,
                length,
                segment.velocity(FEED_MAX),
                [entry, exit],
            ),
            exit_v: joints.programmed.v,
            // At the higher velocity: what is nothing there is nothing below.
            exit_taken: joints.raised.taken,
            stop: joints.programmed.v <= 0.0,
            brisk: !order.soft,
            curve_v: *curve_v,
            programmed_v: *programmed_v,
            rapid: !order.feed.is_finite(),
            raised: false,
            other_v: joints.raised.v,
        };
        let tempo = self.tempo_now();
        if tempo != Tempo::PROGRAMMED {
            node.set_tempo(&tempo);
        }
        self.nodes.push(node);
    }

    /// The path ends with the newest segment, for now.
    pub fn flush(&mut self) {
        if let Some(last) = self.pending.take() {
            self.complete(&last, &Joints::STOP);
        }
    }

    /// True if a segment waits for its successor.
    #[must_use]
    pub fn has_pending(&self) -> bool {
        self.pending.is_some()
    }

    /// True if motion is planned as far as the nodes go and the machine stands there.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        self.pending.is_none() && self.cursor >= self.nodes.len() && self.at_rest()
    }

    /// True if the interrupt has run all that was planned.
    #[must_use]
    pub fn at_rest(&self) -> bool {
        self.shared.executed.load(Acquire) == self.planned
            && !self.shared.moving.load(Acquire)
            && self.shared.generation.load(Acquire) == self.generation
    }

    /// Feed hold: come to rest on the path.
    pub fn hold(&mut self) {
        self.shared.request_hold(true);
    }

    /// Takes the motion up again.
    pub fn resume(&mut self) {
        self.held = false;
        self.shared.request_hold(false);
    }

    /// A hold was asked for and not yet taken back.
    #[must_use]
    pub fn is_holding(&self) -> bool {
        self.shared.is_holding()
    }

    /// A hold was asked for and the machine has come to rest.
    #[must_use]
    pub fn is_held(&self) -> bool {
        self.held && self.at_rest()
    }

    /// True if the planner can do nothing without more segments although motion is under way or waiting.
    #[must_use]
    pub fn is_starved(&self) -> bool {
        !self.is_holding()
            && !self.is_barred()
            && (self.cursor < self.nodes.len() || self.pending.is_some())
            && !self.is_ahead(self.shared.executed.load(Relaxed))
    }

    /// Forgets everything. The interrupt must be at rest and its queues drained.
    pub fn clear(&mut self) {
        // First: a hold that the interrupt answers later would void the new generation.
        self.resume();
        self.first = self.shared.sequence.load(Acquire);
        self.nodes.clear();
        self.cursor = 0;
        self.pending = None;
        self.state = PathState::default();
        self.generation = self.shared.generation.load(Acquire);
        self.planned = self.shared.executed.load(Acquire);
        self.end = None;
        self.clear_tempo();
        self.supply = Supply::NEW;
    }

    /// Plans at most one decision further; `true` if something was done.
    ///
    /// Never inlined: it is called from below other stages' frames too.
    #[inline(never)]
    pub fn advance(&mut self, config: &Config) -> bool {
        let more = self.decide(config);
        let current = self.generation == self.shared.generation.load(Acquire);
        let executed = self.shared.executed.load(Acquire);
        let waiting = self.planned != executed;
        let ends = self.stands() || self.cursor >= self.nodes.len();
        let ahead = ends || self.is_ahead(executed);
        if !more && waiting && current && ahead && !self.is_holding() {
            // Far enough ahead, or to rest: motion may begin.
            self.shared.ready.store(true, Release);
        }
        more
    }

    fn decide(&mut self, config: &Config) -> bool {
        let driven = self.shared.sequence.load(Acquire);
        // The node before the planned state stays: decisions look back at it, and must not depend on what has been driven.
        while self.first != driven && !self.nodes.is_empty() && self.cursor > 1 {
            self.nodes.pop();
            self.first = self.first.wrapping_add(1);
            self.cursor -= 1;
        }
        if self.shared.generation.load(Acquire) != self.generation {
            return self.resynchronise();
        }
        let executed = self.shared.executed.load(Acquire);
        // After `executed`: a request made by then is among them.
        self.take_requests();
        if self.is_ahead(executed) {
            return false;
        }
        if self.held || self.cursor >= self.nodes.len() {
            return false;
        }
        if self.is_barred() && self.state.v == 0 && self.state.a == 0 {
            return false;
        }
        if self.keep_slowing(config) {
            return true;
        }
        if !self.cover(executed) {
            return false;
        }
        if self.change_tempo(config) {
            return true;
        }
        let mut guide = self.guide;
        {
            let view = self.view(config);
            guide.go_on(&view, &view.motion());
        }
        self.guide = guide;
        if crate::knob(19, 0.0) > 0.0 {
            let view = self.view(config);
            let m = view.motion();
            std::eprintln!(
                "G {} {} v {} a {} left {} len {} caps {:?} guide {:?}",
                self.planned,
                m.node as u32 + self.first,
                m.v,
                m.a,
                m.left,
                view.nodes.get(m.node).length,
                [0, 3, 8, 15].map(|k| view.nodes.get(m.node + k).exit_v),
                guide.shown()
            );
        }
        match self
            .view(config)
            .decide(self.begun(config).as_ref(), self.known_way())
        {
            Decision::Go(jerk, ticks, way) => {
                self.take_way(way);
                self.emit(config, &[(jerk, ticks)], PieceEnd::Continue);
            }
            Decision::Settle(phases, way) => {
                self.take_way(way);
                self.emit(config, &phases, PieceEnd::Continue);
            }
            Decision::GoOn => self.go_on(config),
            Decision::Creep(phases) => self.run_slowly(config, phases),
            Decision::Land { phases, stop } => {
                self.take_way(Way::new());
                let number = self.first.wrapping_add(stop as u32);
                self.lands(number);
                self.emit(config, &phases, PieceEnd::StopAfter(number));
            }
        }
        true
    }

    /// True if nothing is to be planned before the interrupt has run more.
    fn is_ahead(&self, executed: u32) -> bool {
        self.planned.wrapping_sub(executed) >= LEAD_TICKS
            || self.pieces.capacity() - self.pieces.len() < PIECES_AT_ONCE
    }

    /// After the interrupt has braked: takes up the state the interrupt came to rest in.
    fn resynchronise(&mut self) -> bool {
        if self.shared.moving.load(Acquire) {
            return false;
        }
        self.generation = self.shared.generation.load(Acquire);
        self.planned = self.shared.executed.load(Acquire);
        let driven = self.shared.sequence.load(Acquire);
        self.cursor = driven.wrapping_sub(self.first) as usize;
        self.drop_slowing();
        self.end_scarcity();
        self.state = PathState {
            s: self.shared.rest_s.load(),
            v: 0,
            a: 0,
        };
        self.held = self.is_holding();
        true
    }

    /// Queues `phases` and moves the planned state to their end.
    fn emit(&mut self, config: &Config, phases: &[(i64, u32)], end: PieceEnd) {
        for (i, &(jerk, ticks)) in phases.iter().enumerate() {
            let last = i + 1 == phases.len();
            if ticks == 0 && !last {
                continue;
            }
            let before = self.view(config).motion();
            if let Some(next) = self.state.after(jerk, ticks) {
                self.state = next;
            }
            let piece_end = if last { end } else { PieceEnd::Continue };
            match piece_end {
                PieceEnd::StopAfter(number) => {
                    self.cursor = number.wrapping_sub(self.first) as usize + 1;
                    self.state = PathState::default();
                }
                PieceEnd::StopHere => {
                    self.state.v = 0;
                    self.state.a = 0;
                    self.cross_joints();
                }
                PieceEnd::Continue => self.cross_joints(),
            }
            let mut hint = self.braking;
            let mut brake = {
                let view = self.view(config);
                view.brake_limits(&before, view.jerk_of(jerk), ticks, &mut hint)
            };
            self.braking = hint;
            brake.last = self.last;
            self.planned = self.planned.wrapping_add(ticks);
            let piece = Piece {
                jerk,
                ticks,
                end: piece_end,
                brake,
                generation: self.generation,
            };
            let queued = self.pieces.enqueue(piece);
            debug_assert!(queued.is_ok(), "room was checked for a whole landing");
        }
    }

    fn cross_joints(&mut self) {
        while self.cursor + 1 < self.nodes.len()
            && !self.nodes.get(self.cursor).stop
            && self.state.coordinate() >= self.nodes.get(self.cursor).length_q
        {
            self.state.s -= widen(self.nodes.get(self.cursor).length_q);
            self.cursor += 1;
        }
    }

    fn view(&self, config: &Config) -> View<'_> {
        View {
            nodes: self.nodes,
            first: self.first,
            cursor: self.cursor,
            end: self.known().min(self.cursor + LOOK_AHEAD + 1),
            last: self.last.wrapping_sub(self.first) as usize,
            state: self.state,
            rates: &self.rates,
            guide: &self.guide,
            hz: config.servo_hz as f32,
        }
    }

    /// Makes sure that enough of what lies ahead is known: a stop, or all that decisions look at. `false` if not.
    ///
    /// How far decisions look depends on where the state is only, never on what else has come: they do not depend on when
    /// segments arrive.
    fn knows_enough(&mut self) -> bool {
        let end = self.cursor + LOOK_AHEAD;
        let known = self.known().min(end + 1);
        let stop = (self.cursor..known).find(|&index| self.nodes.get(index).stop);
        let last = match stop {
            Some(stop) => stop,
            None if known > end => end,
            None => return false,
        };
        self.last = self.first.wrapping_add(last as u32);
        true
    }
}

/// Path units of a length in Q10.54.
fn length_of(length_q: i64) -> f32 {
    length_q as f32 / (1_u64 << S_FRAC) as f32
}

/// Velocity a block asks for on a segment: `feed`, or where that is infinite the largest at which no axis is too fast.
fn programmed(config: &Config, shape: &PathShape, feed: f32) -> f32 {
    if feed.is_finite() {
        return feed * shape.feed_scale;
    }
    let mut v = f32::MAX;
    for (i, axis) in config.axes.iter().enumerate() {
        let slope = shape.most.first[i];
        if slope > 0.0 {
            v = v.min(axis.v_max / slope);
        }
    }
    v
}
