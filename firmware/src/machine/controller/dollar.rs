//! `$` commands: questions to the control and settings that are no part of a program.

use super::Controller;
use crate::catalogue::{machine as message, Message};
use crate::planner::nodes::NODES;
use crate::protocol::{report, RECEIVE_SIZE};

/// Longest command with its blanks removed.
const COMMAND_MAX: usize = 24;

impl Controller<'_> {
    /// Takes one line that begins with `$` and answers it.
    pub(super) fn dollar(&mut self, line: &[u8]) {
        // Two senders remove blanks, and case is the sender's choice.
        let mut command: heapless::Vec<u8, COMMAND_MAX> = heapless::Vec::new();
        for byte in line.iter().filter(|byte| **byte != b' ') {
            if command.push(byte.to_ascii_uppercase()).is_err() {
                break;
            }
        }
        match command.as_slice() {
            b"$I" => {
                let config = self.config;
                // The answer fits: `can_answer` was checked before the line was taken.
                let _ = report::identity(&mut self.wire, config, NODES - 1, RECEIVE_SIZE - 1);
            }
            b"$X" => self.alarm &= self.fault,
            b"$" => self.say(format_args!("[HLP:$I $X $DIALECT $T ~ ! ? ctrl-x]\r\n")),
            b"$T" => {
                for tool in self.interpreter.tools().rows() {
                    // A table longer than the transmit buffer is cut; every row is a line of its own.
                    let _ = report::tool(&mut self.wire, tool);
                }
            }
            b"$DIALECT" => {
                let name = report::dialect_name(self.interpreter.dialect());
                self.say(format_args!("[DIALECT:{name}]\r\n"));
            }
            other => {
                let dialect = other.strip_prefix(b"$DIALECT").and_then(report::dialect);
                match dialect {
                    None => return self.answer_error(message::DOLLAR),
                    Some(_) if !self.is_between_programs() => {
                        return self.answer_error(message::NOT_AT_REST)
                    }
                    Some(dialect) => self.interpreter.set_dialect(dialect),
                }
            }
        }
        self.say(format_args!("ok\r\n"));
    }

    /// Nothing that was read still waits to be driven.
    fn is_between_programs(&self) -> bool {
        self.standstill.is_none()
            && !self.interpreter.is_open()
            && !self.builder.is_open()
            && !self.compensator.has_pending()
            && !self.rounder.has_pending()
    }

    fn answer_error(&mut self, message: Message) {
        self.say(format_args!(
            "[MSG:{}]\r\nerror:{}\r\n",
            message.text, message.code
        ));
    }
}
