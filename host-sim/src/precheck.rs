//! Looks a whole program through before anything moves: language, geometry, cutter compensation and travel.
//!
//! In: the lines that would be streamed. Out: the first complaint, the one a controller would raise on the way. The
//! stages are the core's own, in the order its controller wires them, up to the arc length; what comes behind (limits,
//! look-ahead, profile) never refuses a program, so nothing is planned and no servo tick runs.
//!
//! The tool is taken to start at machine zero, as after power-up.

use std::collections::VecDeque;

use pentaspline::catalogue::{machine as message, Message};
use pentaspline::compensation::{CompensationError, Compensator, Output};
use pentaspline::config::Config;
use pentaspline::geometry::arc::{ArcError, ArcSplitter};
use pentaspline::geometry::rounding::Rounder;
use pentaspline::geometry::travel::outside_travel;
use pentaspline::geometry::{GeometryError, GeometryErrorKind, PathSegment, SegmentBuilder};
use pentaspline::nc::{Command, Interpreter, NcError};
use pentaspline::units::{Steps, AXES};

use crate::feeder::Complaint;
use crate::machine_file::Machine;
use crate::program::Program;

/// Looks `program` through for `machine`, whose dialect it is written in.
///
/// # Errors
/// The first thing wrong, with its place in the streamed lines.
pub fn check(program: &Program, machine: &Machine) -> Result<(), Complaint> {
    let mut road = Road::new(&machine.config);
    let mut interpreter = Interpreter::new(&machine.config);
    let mut commands = VecDeque::new();
    for (index, line) in program.lines().enumerate() {
        let result = interpreter.line(&machine.config, line, &mut |command| {
            commands.push_back(command);
        });
        result.map_err(|error| wrong_line(index + 1, &error))?;
        while let Some(command) = commands.pop_front() {
            road.take(command)?;
        }
    }
    let result = interpreter.flush(&machine.config, &mut |command| commands.push_back(command));
    // What is missing is missed behind the last line: shown there.
    result.map_err(|error| wrong_line(program.len(), &error))?;
    while let Some(command) = commands.pop_front() {
        road.take(command)?;
    }
    road.finish()
}

/// The stages behind the interpreter.
struct Road<'a> {
    config: &'a Config,
    builder: Box<SegmentBuilder>,
    compensator: Box<Compensator>,
    rounder: Box<Rounder>,
    splitter: Box<ArcSplitter>,
}

impl<'a> Road<'a> {
    fn new(config: &'a Config) -> Self {
        let zero = [Steps::ZERO; AXES];
        let mut compensator = Box::new(Compensator::new());
        compensator.reset(zero);
        Self {
            config,
            builder: Box::new(SegmentBuilder::new(config, zero)),
            compensator,
            rounder: Box::new(Rounder::new()),
            splitter: Box::new(ArcSplitter::new()),
        }
    }

    fn take(&mut self, command: Command) -> Result<(), Complaint> {
        match command {
            Command::Message(_) => Ok(()),
            Command::Move(block) => loop {
                match self.builder.push(self.config, &block) {
                    Ok(()) => return self.drain(),
                    // The end of a spline before this block comes first.
                    Err(error) if error.kind == GeometryErrorKind::NotDrained => self.drain()?,
                    Err(error) => return Err(wrong_curve(&error)),
                }
            },
            _ => {
                self.end_curve()?;
                let mut passed = Ok(());
                if command == Command::ProgramEnd {
                    passed = self.compensator.finish(self.config, &mut || {});
                }
                passed
                    .and_then(|()| self.compensator.push_command(self.config, command))
                    .map_err(|error| wrong_offset(&error))?;
                self.drain()
            }
        }
    }

    /// The path ends: a text without `M30`.
    fn finish(&mut self) -> Result<(), Complaint> {
        if self.builder.can_finish() {
            self.end_curve()?;
        }
        self.compensator
            .finish(self.config, &mut || {})
            .map_err(|error| wrong_offset(&error))?;
        self.drain()?;
        self.rounder.finish(true);
        self.drive_rounded()
    }

    fn end_curve(&mut self) -> Result<(), Complaint> {
        while self.builder.is_open() {
            self.builder
                .finish(self.config)
                .map_err(|error| wrong_curve(&error))?;
            self.drain()?;
        }
        Ok(())
    }

    /// Lets everything finished go down the road, the lower end first.
    fn drain(&mut self) -> Result<(), Complaint> {
        loop {
            match self.compensator.next(self.config, &mut || {}) {
                Ok(Some(Output::Segment(segment))) => {
                    self.round(&segment)?;
                    continue;
                }
                Ok(Some(Output::Command(_))) => {
                    self.rounder.finish(true);
                    self.drive_rounded()?;
                    continue;
                }
                Ok(None) => {}
                Err(error) => return Err(wrong_offset(&error)),
            }
            if let Some(segment) = self.builder.next(self.config) {
                self.compensator
                    .push_segment(self.config, &segment, &mut || {})
                    .map_err(|error| wrong_offset(&error))?;
                continue;
            }
            return match self.builder.take_failure() {
                Some(error) => Err(wrong_curve(&error)),
                None => Ok(()),
            };
        }
    }

    /// Takes one segment of the tool's path on to its rounded corners.
    fn round(&mut self, next: &PathSegment) -> Result<(), Complaint> {
        if self.rounder.passes(next) {
            return self.drive(next);
        }
        self.check_travel(next)?;
        self.rounder.push(self.config, next);
        self.drive_rounded()
    }

    fn drive_rounded(&mut self) -> Result<(), Complaint> {
        while let Some(next) = self.rounder.pop() {
            self.drive(&next)?;
        }
        Ok(())
    }

    fn check_travel(&self, next: &PathSegment) -> Result<(), Complaint> {
        outside_travel(self.config, &next.segment).map_or(Ok(()), |axis| {
            let letter = char::from(self.config.axes[axis].letter);
            Err(wrong_segment(
                next.block,
                &message::TRAVEL,
                &letter.to_string(),
            ))
        })
    }

    /// Travel and arc length of one segment of what is driven.
    fn drive(&mut self, next: &PathSegment) -> Result<(), Complaint> {
        self.check_travel(next)?;
        let refuse = |error| {
            let message = match error {
                ArcError::Cusp => &message::INTERNAL,
                ArcError::Range => &message::RANGE,
            };
            wrong_segment(next.block, message, "")
        };
        self.splitter
            .push(self.config, &next.segment, next.block)
            .map_err(refuse)?;
        while self.splitter.next(self.config).map_err(refuse)?.is_some() {}
        Ok(())
    }
}

fn complaint(code: u16, line: usize, column: u16, text: String) -> Complaint {
    Complaint {
        code: u32::from(code),
        line,
        column: usize::from(column),
        text,
    }
}

fn wrong_line(line: usize, error: &NcError) -> Complaint {
    complaint(
        error.kind.code(),
        line,
        error.column,
        error.kind.to_string(),
    )
}

fn wrong_curve(error: &GeometryError) -> Complaint {
    complaint(
        error.code(),
        error.block as usize,
        1,
        error.kind.to_string(),
    )
}

fn wrong_offset(error: &CompensationError) -> Complaint {
    complaint(
        error.code(),
        error.block as usize,
        1,
        error.kind.to_string(),
    )
}

fn wrong_segment(block: u32, message: &Message, value: &str) -> Complaint {
    complaint(
        message.code,
        block as usize,
        1,
        message.text.replace("{}", value),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn looked_through(text: &str) -> Result<(), Complaint> {
        let program = Program::from_text("p.mpf", text).unwrap();
        check(&program, &Machine::built_in().unwrap())
    }

    #[test]
    fn what_a_controller_would_refuse_on_the_way_is_refused_before_anything_moves() {
        for (text, line, code) in [
            ("G1 X1 F100\nG1 X2 Q3\nM30\n", 2, None),
            // A control point within travel whose spline leaves it, and a line that leaves it.
            ("G1 X400 F1000\nG1 X501\nM30\n", 2, Some(201)),
            (
                "F1000\nG1 Y390\nCSPLINE X10 Y399.9\nX20 Y399.9\nX30 Y300\nM30\n",
                4,
                Some(201),
            ),
            // Coefficients that never come are missed at the last line.
            ("G1 X1 F100\nG6 X2 I1\n", 2, None),
        ] {
            let complaint = looked_through(text).unwrap_err();
            assert_eq!(complaint.line, line, "{text} {complaint:?}");
            if let Some(code) = code {
                assert_eq!(complaint.code, code, "{text} {complaint:?}");
            }
        }
        let good = "G1 X1 F100\nCSPLINE X2 Y1\nX3 Y0\nX4 Y1\nG0 X0 Y0\nM30\n";
        assert_eq!(looked_through(good), Ok(()));
    }

    #[test]
    fn looking_through_complains_as_the_controller_does() {
        use crate::runner::{run, End, Observer, Options};
        use pentaspline::machine::Sample;
        use pentaspline::stepgen::StepFrame;
        use pentaspline::units::Tick;

        struct Nobody;
        impl Observer for Nobody {
            fn tick(&mut self, _: Tick, _: &Sample, _: &StepFrame) -> std::io::Result<()> {
                Ok(())
            }
        }
        let machine = Machine::built_in().unwrap();
        for text in [
            "G1 X1 F100\nG1 X2 Q3\nM30\n",
            "G1 X1 F6000\nG1 X501\nM30\n",
            "X1\n",
            "G1 X1 F6000\nX2\nG2 X5\n",
        ] {
            let program = Program::from_text("p.mpf", text).unwrap();
            let options = Options {
                auto_start: true,
                events: Vec::new(),
                max_ticks: 100_000,
            };
            let outcome = run(&program, &machine, &options, &mut Nobody).unwrap();
            let End::Refused(complaint) = outcome.end else {
                panic!("{text}: {:?}", outcome.end);
            };
            assert_eq!(check(&program, &machine), Err(complaint), "{text}");
        }
    }
}
