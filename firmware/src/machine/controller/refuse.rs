//! What happens when a line is refused: it is told, the error latches, and what it leaves unknown is dropped.

use super::Controller;
use crate::catalogue::{machine as message, Message};
use crate::compensation::CompensationError;
use crate::geometry::arc::ArcError;
use crate::geometry::GeometryError;

impl Controller<'_> {
    /// Refuses line `line` with a message of the catalogue.
    pub(super) fn refuse(
        &mut self,
        line: u32,
        message: Message,
        values: &[&dyn core::fmt::Display],
    ) {
        self.say(format_args!("[MSG:error line {line} column 1: "));
        let _ = message.write(&mut self.wire, values);
        self.say(format_args!("]\r\nerror:{}\r\n", message.code));
        self.latch();
    }

    /// Refuses a line for what a stage behind the interpreter says about it.
    fn refuse_for(&mut self, line: u32, code: u16, reason: &dyn core::fmt::Display) -> bool {
        self.say(format_args!(
            "[MSG:error line {line} column 1: {reason}]\r\nerror:{code}\r\n"
        ));
        self.latch();
        true
    }

    pub(super) fn refuse_geometry(&mut self, error: &GeometryError) -> bool {
        let kind = error.kind.with_letters(self.config);
        self.refuse_for(error.block, error.code(), &kind)
    }

    pub(super) fn refuse_compensation(&mut self, error: &CompensationError) -> bool {
        self.refuse_for(error.block, error.code(), &error.kind)
    }

    /// Refuses line `line`, whose path leaves the travel of `axis`.
    pub(super) fn refuse_travel(&mut self, line: u32, axis: usize) {
        let letter = char::from(self.config.axes[axis].letter);
        self.refuse(line, message::TRAVEL, &[&letter]);
    }

    pub(super) fn refuse_curve(&mut self, line: u32, error: ArcError) {
        // What comes behind a curve that cannot be driven starts where the machine will not be.
        self.rounder.reset();
        let message = match error {
            ArcError::Cusp => message::INTERNAL,
            ArcError::Range => message::RANGE,
        };
        self.refuse(line, message, &[]);
    }

    /// Latches the error that has just been told. Segments already finished run to their end; the windows of an open
    /// spline and of the compensation, whose course the bad line leaves unknown, are dropped. Nothing after the line
    /// moves until `~` or a reset.
    pub(super) fn latch(&mut self) {
        self.alarm = true;
        self.answer_due = false;
        self.commands.clear();
        self.standstill = None;
        if let Some(end) = self.rounder.finish(true) {
            // Accepted before the line that is refused: it still runs to its end, and stops there.
            self.path_end = end;
        } else {
            self.splitter.clear();
            self.planner.flush();
            self.path_end = self.planner.end_position().unwrap_or(self.path_end);
        }
        self.take_position(self.path_end);
    }
}
