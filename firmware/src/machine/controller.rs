//! The background half: text in, segments and answers out.
//!
//! [`Controller::poll`] works from the downstream end: plan, then split curves, then geometry, then commands, then
//! text. A line is answered when everything it stands for has been handed to the planner, so back-pressure reaches the
//! sender by itself and an error is answered on the line that caused it.

use core::fmt::Write;
use core::sync::atomic::Ordering::{Acquire, Relaxed, Release};

use heapless::Deque;
use micromath::F32;

use super::shared::Shared;
use super::{Event, State};
use crate::config::Config;
use crate::geometry::arc::ArcSplitter;
use crate::geometry::travel::outside_travel;
use crate::geometry::SegmentBuilder;
use crate::nc::{Auxiliary, Command, Interpreter};
use crate::planner::{nodes::NODES, Planner, SegmentOrder};
use crate::protocol::{classify, report, Incoming, Wire, RECEIVE_SIZE};
use crate::units::{Nano, Position, Steps, Tick, AXES, NANO_PER_UNIT};

/// Commands one line can give.
const COMMANDS: usize = 8;

/// Codes of errors that arise behind the interpreter and the builder.
mod code {
    /// A line while an error is latched.
    pub const LOCKED: u16 = 9;
    /// `$` command not known.
    pub const DOLLAR: u16 = 3;
    /// A curve leaves the travel of an axis.
    pub const TRAVEL: u16 = 201;
    /// A curve has a cusp or leaves the number range.
    pub const CURVE: u16 = 202;
    /// A line gives more commands than fit.
    pub const COMMANDS: u16 = 203;
}

/// What the next command waits for.
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

/// Background half of the machine.
pub struct Controller<'a> {
    config: &'a Config,
    shared: &'a Shared,
    planner: Planner<'a>,
    splitter: ArcSplitter,
    order: SegmentOrder,
    /// Text line of the curve in the splitter.
    splitting: u32,
    builder: SegmentBuilder,
    interpreter: Interpreter,
    commands: Deque<Command, COMMANDS>,
    wait: Option<Wait>,
    /// A line has been taken and not yet answered.
    answer_due: bool,
    wire: Wire,
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
    pub(super) fn new(config: &'a Config, planner: Planner<'a>, shared: &'a Shared) -> Self {
        let origin = [Steps::ZERO; AXES];
        Self {
            config,
            shared,
            planner,
            splitter: ArcSplitter::new(),
            order: SegmentOrder {
                feed: 0.0,
                exact_stop: false,
                soft: true,
            },
            splitting: 0,
            builder: SegmentBuilder::new(config, origin),
            interpreter: Interpreter::new(config),
            commands: Deque::new(),
            wait: None,
            answer_due: false,
            wire: Wire::new(),
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
    pub fn receive(&mut self, byte: u8) {
        match classify(byte) {
            Incoming::Event(event) => self.event(event),
            Incoming::Status => self.status_due = true,
            Incoming::Text => {
                self.received = true;
                self.wire.receive(byte);
            }
            Incoming::Nothing => {}
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
                } else if self.wait == Some(Wait::Resume) {
                    self.wait = None;
                    self.commands.pop_front();
                }
            }
            Event::Reset => {
                if self.reset == Reset::No {
                    self.planner.hold();
                    self.reset = Reset::Stopping;
                }
                self.wire.clear();
                self.commands.clear();
                self.wait = None;
                self.answer_due = false;
            }
            Event::Fault => {
                self.shared.fault.store(true, Release);
                self.alarm = true;
                self.fault = true;
                self.wire.clear();
                self.commands.clear();
                self.wait = None;
                self.answer_due = false;
            }
        }
    }

    /// Current state.
    #[must_use]
    pub fn state(&self) -> State {
        if self.alarm {
            State::Alarm
        } else if self.planner.is_holding() || self.wait == Some(Wait::Resume) {
            State::Hold
        } else if self.is_idle() {
            State::Idle
        } else {
            State::Run
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
            && self.wait.is_none()
            && self.splitter.is_empty()
            && !self.builder.is_open()
            && !self.answer_due
            && !self.wire.has_line()
    }

    /// Does one bounded piece of background work at tick `now`; `true` if there may be more to do now.
    pub fn poll(&mut self, now: Tick) -> bool {
        if self.received {
            self.received = false;
            self.last_text = now;
        }
        if self.status_due && self.wire.can_answer() {
            self.status_due = false;
            self.report_status();
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
        // Planning first: the interrupt must never wait for text.
        if self.planner.advance(self.config) {
            return true;
        }
        if !self.splitter.is_empty() {
            return self.split();
        }
        if let Some(next) = self.builder.next(self.config) {
            return self.accept_segment(&next);
        }
        if !self.commands.is_empty() {
            return self.command(now);
        }
        if self.answer_due {
            if !self.wire.can_answer() {
                return false;
            }
            self.answer_due = false;
            self.say(format_args!("ok\r\n"));
            return true;
        }
        if self.wire.can_answer() {
            if let Some(line) = self.wire.take_line() {
                self.last_text = now;
                self.line(&line);
                return true;
            }
        }
        self.starve(now)
    }

    /// Nothing to do but wait for text. If none comes, the path ends here for now.
    fn starve(&mut self, now: Tick) -> bool {
        if now.saturating_sub(self.last_text) < Tick::from(self.config.starve_ticks) {
            return false;
        }
        if self.planner.has_pending() {
            if self.planner.is_starved() {
                self.planner.flush(self.config);
                return true;
            }
            return false;
        }
        if self.builder.is_open() && self.planner.is_idle() {
            // At rest, and the sender is done: an open spline ends where it is.
            if let Err(error) = self.builder.finish(self.config) {
                self.refuse(error.block, 1, error.code(), format_args!("{}", error.kind));
            }
            self.last_text = now;
            return true;
        }
        false
    }

    fn split(&mut self) -> bool {
        if !self.planner.has_room() {
            return false;
        }
        match self.splitter.next(self.config) {
            Ok(Some((segment, shape))) => {
                let mut order = self.order;
                order.exact_stop &= self.splitter.is_empty();
                self.planner.push(self.config, segment, &shape, order);
            }
            Ok(None) => {}
            Err(error) => {
                self.refuse(self.splitting, 1, code::CURVE, format_args!("{error}"));
            }
        }
        true
    }

    fn accept_segment(&mut self, next: &crate::geometry::PathSegment) -> bool {
        if let Some(axis) = outside_travel(self.config, &next.segment) {
            let letter = char::from(self.config.axes[axis].letter);
            self.refuse(
                next.block,
                1,
                code::TRAVEL,
                format_args!("axis {letter} leaves its travel on the way to this point"),
            );
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
            Err(error) => self.refuse(next.block, 1, code::CURVE, format_args!("{error}")),
        }
        true
    }

    /// Works on the command in front.
    fn command(&mut self, now: Tick) -> bool {
        let Some(command) = self.commands.front().copied() else {
            return false;
        };
        if let Command::Message(text) = &command {
            self.commands.pop_front();
            self.say(format_args!("[MSG:{text}]\r\n"));
            return true;
        }
        if let Command::Move(block) = &command {
            self.commands.pop_front();
            if let Err(error) = self.builder.push(self.config, block) {
                self.refuse(error.block, 1, error.code(), format_args!("{}", error.kind));
            }
            return true;
        }
        match self.wait {
            None => {
                // Everything else happens at standstill.
                if let Err(error) = self.builder.finish(self.config) {
                    self.refuse(error.block, 1, error.code(), format_args!("{}", error.kind));
                    return true;
                }
                self.wait = Some(Wait::Standstill);
                true
            }
            Some(Wait::Standstill) => {
                if self.planner.has_pending() {
                    self.planner.flush(self.config);
                    return true;
                }
                if !self.planner.is_idle() || self.planner.is_holding() {
                    return false;
                }
                self.at_standstill(&command, now);
                true
            }
            Some(Wait::Until(tick)) => {
                if now < tick {
                    return false;
                }
                self.done();
                true
            }
            Some(Wait::Resume) => false,
        }
    }

    fn at_standstill(&mut self, command: &Command, now: Tick) {
        match command {
            Command::Dwell { milliseconds } => {
                let ticks = Tick::from(*milliseconds) * Tick::from(self.config.servo_hz) / 1000;
                self.wait = Some(Wait::Until(now.saturating_add(ticks)));
            }
            Command::Auxiliary(Auxiliary::Stop | Auxiliary::OptionalStop) if self.stops => {
                self.wait = Some(Wait::Resume);
                self.say(format_args!("[MSG:program stop, ~ goes on]\r\n"));
            }
            Command::ProgramEnd => {
                self.say(format_args!("[MSG:Pgm End]\r\n"));
                self.done();
            }
            _ => self.done(),
        }
    }

    fn done(&mut self) {
        self.wait = None;
        self.commands.pop_front();
    }

    fn line(&mut self, line: &[u8]) {
        if line.first() == Some(&b'$') {
            self.dollar(line);
            return;
        }
        if self.alarm {
            self.say(format_args!("error:{}\r\n", code::LOCKED));
            return;
        }
        let mut overflow = false;
        let commands = &mut self.commands;
        let result = self.interpreter.line(self.config, line, &mut |command| {
            overflow |= commands.push_back(command).is_err();
        });
        match result {
            Err(error) => {
                self.refuse(
                    error.line,
                    error.column,
                    error.kind.code(),
                    format_args!("{}", error.kind),
                );
            }
            Ok(()) if overflow => {
                let number = self.interpreter.line_number();
                self.refuse(
                    number,
                    1,
                    code::COMMANDS,
                    format_args!("too many functions in one line"),
                );
            }
            Ok(()) => self.answer_due = true,
        }
    }

    fn dollar(&mut self, line: &[u8]) {
        match line {
            b"$I" | b"$i" => {
                let config = self.config;
                // The answer fits: `can_answer` was checked before the line was taken.
                let _ = report::identity(&mut self.wire, config, NODES - 1, RECEIVE_SIZE - 1);
                self.say(format_args!("ok\r\n"));
            }
            b"$X" | b"$x" => {
                if !self.fault {
                    self.alarm = false;
                }
                self.say(format_args!("ok\r\n"));
            }
            b"$" => self.say(format_args!("[HLP:$I $X ~ ! ? ctrl-x]\r\nok\r\n")),
            _ => self.say(format_args!("error:{}\r\n", code::DOLLAR)),
        }
    }

    /// Refuses the line that led here. Segments already finished run to their end; the window of an open spline, whose
    /// course the bad line leaves unknown, is dropped. Nothing after the line moves until `~` or a reset.
    fn refuse(&mut self, line: u32, column: u16, code: u16, text: core::fmt::Arguments<'_>) {
        self.say(format_args!(
            "[MSG:error line {line} column {column}: {text}]\r\nerror:{code}\r\n"
        ));
        self.alarm = true;
        self.answer_due = false;
        self.commands.clear();
        self.wait = None;
        self.splitter.clear();
        self.planner.flush(self.config);
        self.path_end = self.planner.end_position().unwrap_or(self.path_end);
        self.take_position(self.path_end);
    }

    /// Lets text continue from `position`.
    fn take_position(&mut self, position: Position) {
        self.path_end = position;
        self.builder.reset(position);
        let nano: [Nano; AXES] = core::array::from_fn(|a| {
            let unit = i128::from(self.config.axes[a].steps_per_unit.to_bits()).max(1);
            let scaled = i128::from(position[a].to_bits()) * i128::from(NANO_PER_UNIT);
            // Rounded to nearest: a programmed coordinate comes back as it was.
            (scaled.signum() * ((scaled.abs() + unit / 2) / unit)) as Nano
        });
        self.interpreter.set_position(nano);
    }

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

    fn report_status(&mut self) {
        let status = report::Status {
            state: self.state(),
            emitted: core::array::from_fn(|a| self.shared.emitted[a].load(Relaxed)),
            planner_free: self.planner.room(),
            receive_free: self.wire.free().saturating_sub(1),
            // Shown, never driven: the one place where an approximation will do.
            feed: F32(f32::from_bits(self.shared.feed.load(Relaxed)) * 60.0)
                .round()
                .0 as u32,
            block: self.shared.block.load(Relaxed),
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
