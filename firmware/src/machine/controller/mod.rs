//! The background half: text in, segments and answers out.
//!
//! [`Controller::poll`] works from the downstream end: plan, split curves, round corners, stand still where a command asks for it,
//! compensation, geometry, commands, text. A line is answered when everything it stands for has been handed to the planner, so back-pressure reaches the
//! sender by itself and an error is answered on the line that caused it.

mod dollar;
mod refuse;

use core::fmt::Write;
use core::sync::atomic::Ordering::{Acquire, Relaxed, Release};

use heapless::Deque;
use micromath::F32;

use super::servo::path_feed;
use super::shared::Shared;
use super::timetable::Standing;
use super::{Event, Place, State};
use crate::catalogue::machine as message;
use crate::compensation::{Compensator, Output};
use crate::config::Config;
use crate::geometry::arc::ArcSplitter;
use crate::geometry::rounding::Rounder;
use crate::geometry::travel::TravelBounds;
use crate::geometry::{GeometryErrorKind, SegmentBuilder};
use crate::nc::{Auxiliary, Command, Interpreter};
use crate::planner::tempo::{Change, FEED_MAX};
use crate::planner::{Planner, SegmentOrder};
use crate::protocol::{report, Incoming, Sorter, Wire};
use crate::units::{Nano, Position, Steps, Tick, AXES, NANO_PER_UNIT};

/// Commands one line can give.
const COMMANDS: usize = 8;

/// What a command at standstill waits for.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Wait {
    /// The machine to stand still with everything before done.
    Standstill,
    /// The end of a dwell.
    Until(Tick),
    /// Cycle start.
    Resume,
}

/// Progress of a soft reset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Reset {
    No,
    Stopping,
    Draining,
}

/// What of the background half is too large for the stack; lies in [`super::Core`].
pub(super) struct Stages {
    splitter: Place<ArcSplitter>,
    rounder: Place<Rounder>,
    compensator: Place<Compensator>,
    builder: Place<SegmentBuilder>,
    interpreter: Place<Interpreter>,
    commands: Place<Deque<Command, COMMANDS>>,
}

impl Stages {
    pub(super) const fn empty() -> Self {
        Self {
            splitter: Place::empty(),
            rounder: Place::empty(),
            compensator: Place::empty(),
            builder: Place::empty(),
            interpreter: Place::empty(),
            commands: Place::empty(),
        }
    }
}

/// Background half of the machine.
pub struct Controller<'a> {
    config: &'a Config,
    shared: &'a Shared,
    planner: Planner<'a>,
    splitter: &'a mut ArcSplitter,
    order: SegmentOrder,
    /// Text line of the curve in the splitter.
    splitting: u32,
    travel: TravelBounds,
    rounder: &'a mut Rounder,
    compensator: &'a mut Compensator,
    builder: &'a mut SegmentBuilder,
    interpreter: &'a mut Interpreter,
    commands: &'a mut Deque<Command, COMMANDS>,
    /// A command that acts where the path now ends, and what it waits for.
    standstill: Option<(Command, Wait)>,
    /// A line has been taken and not yet answered.
    answer_due: bool,
    wire: Wire,
    sorter: Sorter,
    status_due: bool,
    banner_due: bool,
    /// An error or fault latched.
    alarm: bool,
    fault: bool,
    reset: Reset,
    stops: bool,
    /// End of the last curve handed to the splitter.
    path_end: Position,
    last_text: Tick,
    received: bool,
}

impl<'a> Controller<'a> {
    pub(super) fn new(
        config: &'a Config,
        planner: Planner<'a>,
        shared: &'a Shared,
        stages: &'a mut Stages,
    ) -> Self {
        let origin = [Steps::ZERO; AXES];
        Self {
            config,
            shared,
            planner,
            splitter: stages.splitter.fill(ArcSplitter::new),
            order: SegmentOrder {
                feed: 0.0,
                exact_stop: false,
                soft: true,
            },
            splitting: 0,
            travel: TravelBounds::new(config),
            rounder: stages.rounder.fill(Rounder::new),
            compensator: stages.compensator.fill(Compensator::new),
            builder: stages.builder.fill(|| SegmentBuilder::new(config, origin)),
            interpreter: stages.interpreter.fill(|| Interpreter::new(config)),
            commands: stages.commands.fill(Deque::new),
            standstill: None,
            answer_due: false,
            wire: Wire::new(),
            sorter: Sorter::new(),
            status_due: false,
            banner_due: true,
            alarm: false,
            fault: false,
            reset: Reset::No,
            stops: true,
            path_end: origin,
            last_text: 0,
            received: false,
        }
    }

    /// One byte from the wire. Real-time bytes act at once and never take buffer space.
    #[inline]
    pub fn receive(&mut self, byte: u8) {
        match self.sorter.sort(byte) {
            Incoming::Text => {
                self.received = true;
                self.wire.receive(byte);
            }
            other => self.request(other),
        }
    }

    /// What is no text.
    #[inline(never)]
    fn request(&mut self, incoming: Incoming) {
        match incoming {
            Incoming::Event(event) => self.event(event),
            Incoming::Status => self.status_due = true,
            Incoming::FeedBy(percent) => {
                let asked = i16::from(self.planner.tempo().feed) + i16::from(percent);
                self.event(Event::Feed(asked.clamp(0, FEED_MAX.into()) as u8));
            }
            Incoming::Text | Incoming::Nothing => {}
        }
    }

    /// Bytes the receive buffer can still take.
    #[must_use]
    pub fn receive_free(&self) -> usize {
        self.wire.free()
    }

    /// Next byte for the wire.
    pub fn transmit(&mut self) -> Option<u8> {
        self.wire.transmit()
    }

    /// With `false` (power-up value `true`), `M0` and `M1` do not wait.
    pub fn set_program_stops(&mut self, wait: bool) {
        self.stops = wait;
    }

    /// Real-time request, the same as its byte on the wire.
    pub fn event(&mut self, event: Event) {
        match event {
            Event::Hold => self.planner.hold(),
            Event::Resume => {
                if self.fault || self.reset != Reset::No {
                    return;
                }
                self.alarm = false;
                if self.planner.is_holding() {
                    self.planner.resume();
                } else if self.waits_for_start() {
                    self.standstill = None;
                }
            }
            Event::Reset => {
                if self.reset == Reset::No {
                    self.planner.hold();
                    self.reset = Reset::Stopping;
                }
                self.wire.clear();
                self.commands.clear();
                self.standstill = None;
                self.answer_due = false;
            }
            Event::Feed(percent) => self.planner.request(Change::Feed(percent)),
            Event::Rapid(percent) => self.planner.request(Change::Rapid(percent)),
            Event::Starve(ticks) => self.planner.request(Change::Starve(ticks)),
            Event::Fault => {
                self.shared.fault.store(true, Release);
                self.alarm = true;
                self.fault = true;
                self.rounder.reset();
                self.wire.clear();
                self.commands.clear();
                self.standstill = None;
                self.answer_due = false;
            }
        }
    }

    /// Current state.
    #[must_use]
    pub fn state(&self) -> State {
        if self.alarm {
            State::Alarm
        } else if self.planner.is_holding() || self.waits_for_start() {
            State::Hold
        } else if self.is_idle() {
            State::Idle
        } else if self.planner.is_barred() {
            State::Hold
        } else {
            State::Run
        }
    }

    /// Why the machine is at rest although there is work, if it is the operator's doing.
    #[must_use]
    pub fn standing(&self) -> Standing {
        if self.waits_for_start() {
            Standing::ProgramStop
        } else if self.planner.is_barred() && self.planner.at_rest() && !self.is_idle() {
            Standing::Barred
        } else {
            Standing::No
        }
    }

    /// True when every byte received has been worked off and the machine is at rest.
    ///
    /// With an error latched, text that waits is never worked off and does not count.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        let still = self.planner.is_idle() || (self.fault && self.planner.at_rest());
        still
            && self.reset == Reset::No
            && self.commands.is_empty()
            && self.standstill.is_none()
            && self.splitter.is_empty()
            && !self.rounder.has_pending()
            && !self.compensator.has_pending()
            && !self.builder.is_open()
            && !self.answer_due
            && !self.wire.has_line()
    }

    /// Does one bounded piece of background work at tick `now`; `true` if there may be more to do now.
    ///
    /// What it calls is never inlined: one frame for all of it would lie below the deepest of it.
    pub fn poll(&mut self, now: Tick) -> bool {
        if self.received {
            self.received = false;
            self.last_text = now;
        }
        if self.status_due && self.wire.can_answer() {
            self.status_due = false;
            self.report_status();
        }
        if let Some(event) = self.planner.take_raised() {
            self.event(event);
        }
        if self.reset != Reset::No {
            return self.advance_reset();
        }
        if self.fault {
            return false;
        }
        if self.banner_due && self.wire.can_answer() {
            self.banner_due = false;
            self.say(format_args!("{}", report::BANNER));
        }
        if self.wire.can_answer() {
            if let Some(line) = self.planner.take_underrun() {
                self.say(format_args!(
                    "[MSG:warning UNDERRUN line {line}: no further blocks in time, at rest on the path]\r\n"
                ));
            }
        }
        // Planning first: the interrupt must never wait for text.
        if self.planner.advance(self.config) {
            return true;
        }
        if !self.splitter.is_empty() {
            return self.split();
        }
        if let Some(next) = self.rounder.pop() {
            return self.accept_segment(&next);
        }
        if self.standstill.is_some() {
            return self.stand_still(now);
        }
        if self.compensated() || self.built() {
            return true;
        }
        if let Some(error) = self.builder.take_failure() {
            return self.refuse_geometry(&error);
        }
        if !self.commands.is_empty() {
            return self.command();
        }
        if self.answer_due {
            if !self.wire.can_answer() {
                return false;
            }
            self.answer_due = false;
            self.say(format_args!("ok\r\n"));
            return true;
        }
        if self.wire.can_answer() && self.take_line(now) {
            return true;
        }
        self.starve(now)
    }

    /// Takes a line, if a whole one is there.
    #[inline(never)]
    fn take_line(&mut self, now: Tick) -> bool {
        let Some(line) = self.wire.take_line() else {
            return false;
        };
        self.last_text = now;
        self.line(&line);
        true
    }

    /// Takes what the compensation lets go, if there is something.
    #[inline(never)]
    fn compensated(&mut self) -> bool {
        // The interrupt must not run out of pieces while a contour is worked out.
        let mut meanwhile = || while self.planner.advance(self.config) {};
        match self.compensator.next(self.config, &mut meanwhile) {
            Ok(None) => return false,
            Ok(Some(Output::Segment(next))) => return self.round(&next),
            Ok(Some(Output::Command(command))) => {
                self.rounder.finish(true);
                self.standstill = Some((command, Wait::Standstill));
            }
            Err(error) => {
                self.refuse_compensation(&error);
            }
        }
        true
    }

    /// Hands a curve that geometry has finished to the compensation, if there is one.
    #[inline(never)]
    fn built(&mut self) -> bool {
        let Some(next) = self.builder.next(self.config) else {
            return false;
        };
        let mut meanwhile = || while self.planner.advance(self.config) {};
        let taken = self
            .compensator
            .push_segment(self.config, &next, &mut meanwhile);
        if let Err(error) = taken {
            self.refuse_compensation(&error);
        }
        true
    }

    /// Nothing to do but wait for text. If none comes, the path ends here for now.
    #[inline(never)]
    fn starve(&mut self, now: Tick) -> bool {
        if now.saturating_sub(self.last_text) < Tick::from(self.config.starve_ticks) {
            return false;
        }
        if self.planner.has_pending() {
            if self.planner.is_starved() {
                self.planner.time_out();
                return true;
            }
            return false;
        }
        if !self.planner.is_idle() {
            return false;
        }
        // At rest, and the sender is done: what waits for a continuation ends where it is. A spline that has too few
        // points yet goes on waiting.
        self.last_text = now;
        if self.builder.is_open() {
            if !self.builder.can_finish() {
                return false;
            }
            if let Err(error) = self.builder.finish(self.config) {
                self.refuse_geometry(&error);
            }
            return true;
        }
        if self.compensator.has_pending() {
            let mut meanwhile = || while self.planner.advance(self.config) {};
            if let Err(error) = self.compensator.finish(self.config, &mut meanwhile) {
                self.refuse_compensation(&error);
            }
            return true;
        }
        self.rounder.finish(true).is_some()
    }

    #[inline(never)]
    fn split(&mut self) -> bool {
        if !self.planner.has_room() {
            return false;
        }
        match self.splitter.next(self.config) {
            Ok(Some(driven)) => {
                let mut order = self.order;
                order.exact_stop &= self.splitter.is_empty();
                self.planner.push(self.config, &driven, order);
            }
            Ok(None) => {}
            Err(error) => self.refuse_curve(self.splitting, error),
        }
        true
    }

    /// Takes a segment on to where corners are rounded. Its travel is looked at here, where the line that asks for it is
    /// still unanswered.
    fn round(&mut self, next: &crate::geometry::PathSegment) -> bool {
        if self.rounder.passes(next) {
            return self.accept_segment(next);
        }
        match self.travel.outside(self.config, &next.segment) {
            Some(axis) => self.refuse_travel(next.block, axis),
            None => self.rounder.push(self.config, next),
        }
        true
    }

    fn accept_segment(&mut self, next: &crate::geometry::PathSegment) -> bool {
        if let Some(axis) = self.travel.outside(self.config, &next.segment) {
            self.rounder.reset();
            self.refuse_travel(next.block, axis);
            return true;
        }
        self.order = SegmentOrder {
            feed: next.feed,
            exact_stop: next.exact_stop,
            soft: next.soft,
        };
        self.splitting = next.block;
        match self.splitter.push(self.config, &next.segment, next.block) {
            Ok(()) => self.path_end = next.segment.end,
            Err(error) => self.refuse_curve(next.block, error),
        }
        true
    }

    /// Works on the command in front.
    #[inline(never)]
    fn command(&mut self) -> bool {
        let Some(command) = self.commands.front().copied() else {
            return false;
        };
        match &command {
            Command::Message(text) => self.say(format_args!("[MSG:{text}]\r\n")),
            Command::Move(block) => match self.builder.push(self.config, block) {
                Ok(()) => {
                    if self.builder.take_stop() {
                        self.stop_at_end();
                    }
                }
                // The end of a spline before this block has to be drained first.
                Err(error) if error.kind == GeometryErrorKind::NotDrained => return true,
                Err(error) => return self.refuse_geometry(&error),
            },
            // Everything else acts at standstill, where the path ends that was programmed before it.
            _ => {
                if self.builder.is_open() {
                    if let Err(error) = self.builder.finish(self.config) {
                        self.refuse_geometry(&error);
                    }
                    return true;
                }
                let mut passed = Ok(());
                if command == Command::ProgramEnd {
                    let mut meanwhile = || while self.planner.advance(self.config) {};
                    passed = self.compensator.finish(self.config, &mut meanwhile);
                }
                let passed =
                    passed.and_then(|()| self.compensator.push_command(self.config, command));
                if let Err(error) = passed {
                    return self.refuse_compensation(&error);
                }
            }
        }
        self.commands.pop_front();
        true
    }

    /// Makes the path rest where it now ends.
    fn stop_at_end(&mut self) {
        if self.rounder.finish(true).is_some() {
            // It stops there by itself.
        } else if !self.splitter.is_empty() {
            self.order.exact_stop = true;
        } else if !self.compensator.has_pending() {
            self.planner.flush();
        }
    }

    /// Works on the command that acts where the path now ends.
    #[inline(never)]
    fn stand_still(&mut self, now: Tick) -> bool {
        let Some((command, wait)) = self.standstill else {
            return false;
        };
        match wait {
            Wait::Standstill => {
                if self.planner.has_pending() {
                    self.planner.flush();
                    return true;
                }
                if !self.planner.is_idle() || self.planner.is_holding() {
                    return false;
                }
                self.at_standstill(&command, now);
                true
            }
            Wait::Until(tick) if now < tick => false,
            Wait::Until(_) => {
                self.standstill = None;
                true
            }
            Wait::Resume => false,
        }
    }

    fn at_standstill(&mut self, command: &Command, now: Tick) {
        self.standstill = None;
        match command {
            Command::Dwell { milliseconds } => {
                let ticks = Tick::from(*milliseconds) * Tick::from(self.config.servo_hz) / 1000;
                self.standstill = Some((*command, Wait::Until(now.saturating_add(ticks))));
            }
            Command::Auxiliary(Auxiliary::Stop | Auxiliary::OptionalStop) if self.stops => {
                self.standstill = Some((*command, Wait::Resume));
                self.say(format_args!("[MSG:program stop, ~ goes on]\r\n"));
            }
            Command::ProgramEnd => self.say(format_args!("[MSG:Pgm End]\r\n")),
            _ => {}
        }
    }

    /// True while an `M0` or `M1` waits for cycle start.
    fn waits_for_start(&self) -> bool {
        matches!(self.standstill, Some((_, Wait::Resume)))
    }

    fn line(&mut self, line: &[u8]) {
        if line.first() == Some(&b'$') {
            self.dollar(line);
            return;
        }
        if self.alarm {
            self.say(format_args!("error:{}\r\n", message::LOCKED.code));
            return;
        }
        let mut overflow = false;
        let commands = &mut self.commands;
        let result = self.interpreter.line(self.config, line, &mut |command| {
            overflow |= commands.push_back(command).is_err();
        });
        match result {
            Err(error) => {
                self.say(format_args!(
                    "[MSG:error line {} column {}: {}]\r\nerror:{}\r\n",
                    error.line,
                    error.column,
                    error.kind,
                    error.kind.code()
                ));
                self.latch();
            }
            Ok(()) if overflow => {
                self.refuse(self.interpreter.line_number(), message::INTERNAL, &[]);
            }
            Ok(()) => self.answer_due = true,
        }
    }

    /// Lets text continue from `position`.
    fn take_position(&mut self, position: Position) {
        self.path_end = position;
        self.builder.reset(position);
        self.compensator.reset(position);
        let nano: [Nano; AXES] = core::array::from_fn(|a| {
            let unit = i128::from(self.config.axes[a].steps_per_unit.to_bits()).max(1);
            let scaled = i128::from(position[a].to_bits()) * i128::from(NANO_PER_UNIT);
            // Rounded to nearest: a programmed coordinate comes back as it was.
            (scaled.signum() * ((scaled.abs() + unit / 2) / unit)) as Nano
        });
        self.interpreter.set_position(nano);
    }

    #[inline(never)]
    fn advance_reset(&mut self) -> bool {
        match self.reset {
            Reset::Stopping => {
                if self.planner.advance(self.config) {
                    return true;
                }
                if self.planner.is_held() || self.fault || self.planner.is_idle() {
                    self.shared.drain.store(true, Release);
                    self.reset = Reset::Draining;
                }
                false
            }
            Reset::Draining => {
                if self.shared.drain.load(Acquire) {
                    return false;
                }
                self.shared.fault.store(false, Release);
                self.fault = false;
                self.alarm = false;
                self.planner.clear();
                self.splitter.clear();
                self.rounder.reset();
                self.interpreter.reset(self.config);
                let rest =
                    core::array::from_fn(|a| Steps::from_bits(self.shared.rest_position[a].load()));
                self.take_position(rest);
                self.reset = Reset::No;
                self.banner_due = true;
                true
            }
            Reset::No => false,
        }
    }

    #[inline(never)]
    fn report_status(&mut self) {
        let status = report::Status {
            state: self.state(),
            emitted: core::array::from_fn(|a| self.shared.emitted[a].load(Relaxed)),
            planner_free: self.planner.room(),
            receive_free: self.wire.free().saturating_sub(1),
            // Shown, never driven: the one place where an approximation will do.
            feed: F32(path_feed(self.shared.feed.load(Relaxed), self.config.servo_hz) * 60.0)
                .round()
                .0 as u32,
            block: self.shared.block.load(Relaxed),
            overrides: {
                let tempo = self.planner.tempo();
                [tempo.feed, tempo.rapid]
            },
        };
        let config = self.config;
        // The report fits: `can_answer` was checked.
        let _ = report::status(&mut self.wire, config, &status);
    }

    fn say(&mut self, text: core::fmt::Arguments<'_>) {
        // An answer that does not fit is lost; `can_answer` keeps that from happening to a sender that reads.
        let _ = self.wire.write_fmt(text);
    }
}
