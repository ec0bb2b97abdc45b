//! Lines that read their words in their own way: `G4`, `G10`, `G74`, `G75`, lines of a NURBS curve, and what may stand
//! between the coefficients of a `POLY` block and its end point. The rarely used half of [`Interpreter`].

use super::block::Block;
use super::command::{Command, Cutter, Motion, Move, Side};
use super::error::{Excerpt, Fault};
use super::fanuc::{NurbsWords, Refusal};
use super::frames::{target, Frame};
use super::interpreter::Interpreter;
use super::lexer::letter_bit;
use super::modal::{Placed, Tool};
use super::motion::{check_words, moves};
use super::number::Decimal;
use super::table::{FeedUnit, Group, Misc, Mode, Special};
use super::tools::Mounted;
use super::values::{coordinate, dwell_time, refuse, settle_feed, settle_speed};
use crate::catalogue::nc as message;
use crate::config::Config;
use crate::geometry::tool_vector::led;
use crate::units::Nano;

/// Largest tool number of `G10`.
const TOOL_NUMBER_MAX: u32 = 99_999_999;

/// Feed of a block under `G93` or `G95`; `feed` is the programmed number per 60.
#[cold]
pub(super) fn other_feed(block: &Block, feed: f32) -> Result<f32, Fault> {
    let modal = &block.modal;
    let fault = |message| Err(Fault::new(block.first_axis, 0, message));
    if modal.feed_unit == FeedUnit::Inverse {
        return if block.has(b'F') {
            // the number counts blocks, whatever the unit of length
            Ok(modal.feed_rotary)
        } else {
            fault(&message::MISSING_INVERSE_FEED)
        };
    }
    if feed <= 0.0 {
        return fault(&message::MISSING_FEED);
    }
    if modal.speed <= 0.0 {
        return fault(&message::MISSING_SPEED);
    }
    // Per minute first: what `F` in mm/min gives has few digits, too.
    Ok(feed * 60.0 * modal.speed / 60.0)
}

impl Interpreter {
    /// A line with a function of group 2.
    #[cold]
    pub(super) fn special(
        &mut self,
        config: &Config,
        block: &mut Block,
        special: Placed<Special>,
        mounted: Mounted,
        emit: &mut dyn FnMut(Command),
    ) -> Result<(), Fault> {
        if self.polynomial != 0 {
            return Err(Fault::new(special.at, 0, &message::MISSING_END_POINT));
        }
        check_words(block, true)?;
        let waiting = match special.value {
            Special::Dwell => {
                let milliseconds = dwell_time(block, special.at)?;
                self.commit(block, mounted, emit);
                emit(Command::Dwell { milliseconds });
                return self.finish(config, block.misc, emit);
            }
            Special::Tool => self.tool_data(config, block, special.at)?,
            Special::ReferencePoint | Special::FixedPoint => {
                return self.named_point(config, block, special, mounted, emit)
            }
        };
        let (row, number, radius, length) = waiting;
        self.commit(block, mounted, emit);
        self.tools.set(row, number, radius, length);
        self.finish(config, block.misc, emit)
    }

    /// `G10 L1 P R Z`: row, number, radius and length.
    fn tool_data(
        &self,
        config: &Config,
        block: &mut Block,
        at: usize,
    ) -> Result<(usize, u32, Option<Nano>, Option<Nano>), Fault> {
        if block.modal.side != Side::On || self.applied != Side::On {
            return Err(Fault::new(at, 3, &message::COMPENSATION_ON));
        }
        settle_speed(block)?;
        settle_feed(block)?;
        let fault = |letter, message| Err(Fault::new(block.place(letter), 1, message));
        for &axis in block.order.iter().take(block.axes) {
            match config.axes.get(usize::from(axis)) {
                Some(axis) if axis.letter != b'Z' => {
                    return fault(axis.letter, &message::UNEXPECTED_WORD)
                }
                _ => {}
            }
        }
        if !block.has(b'L') || !block.has(b'P') || !block.has(b'R') && !block.has(b'Z') {
            return Err(Fault::new(at, 3, &message::MISSING_WORDS));
        }
        if block.l != 1 {
            return fault(b'L', &message::OUT_OF_RANGE);
        }
        let Some(number) = block.p.index(TOOL_NUMBER_MAX).filter(|number| *number > 0) else {
            return fault(b'P', &message::OUT_OF_RANGE);
        };
        let inch = block.modal.inch;
        let radius = coordinate(block.r, inch).filter(|radius| *radius >= 0);
        if block.has(b'R') && radius.is_none() {
            return fault(b'R', &message::OUT_OF_RANGE);
        }
        let z = config.axes.iter().position(|axis| axis.letter == b'Z');
        let length = z
            .and_then(|axis| block.values.get(axis))
            .and_then(|value| coordinate(*value, inch));
        if block.has(b'Z') && length.is_none() {
            return fault(b'Z', &message::OUT_OF_RANGE);
        }
        let Some(row) = self.tools.room(number) else {
            return fault(b'P', &message::TOOL_TABLE_FULL);
        };
        Ok((
            row,
            number,
            radius.filter(|_| block.has(b'R')),
            length.filter(|_| block.has(b'Z')),
        ))
    }

    /// `G74`, `G75`: the named axes go to their point in rapid.
    fn named_point(
        &mut self,
        config: &Config,
        block: &mut Block,
        special: Placed<Special>,
        mounted: Mounted,
        emit: &mut dyn FnMut(Command),
    ) -> Result<(), Fault> {
        if block.modal.side != Side::On || self.applied != Side::On {
            return Err(Fault::new(special.at, 3, &message::COMPENSATION_ON));
        }
        settle_speed(block)?;
        settle_feed(block)?;
        for letter in *b"LPR" {
            refuse(block, letter)?;
        }
        if block.axes == 0 {
            return Err(Fault::new(special.at, 3, &message::MISSING_WORDS));
        }
        let point = if special.value == Special::ReferencePoint {
            &config.reference_point
        } else {
            &config.fixed_point
        };
        let mut target = self.position;
        for &axis in block.order.iter().take(block.axes) {
            let axis = usize::from(axis);
            let (Some(to), Some(from), Some(value)) = (
                target.get_mut(axis),
                point.get(axis),
                block.values.get(axis),
            ) else {
                continue;
            };
            if value.mantissa != 0 {
                let letter = config.axes.get(axis).map_or(b'X', |axis| axis.letter);
                return Err(Fault::new(block.place(letter), 1, &message::OUT_OF_RANGE));
            }
            *to = *from;
        }
        // a spline cannot go on behind it
        block.modal.first = true;
        self.commit(block, mounted, emit);
        self.position = target;
        emit(Command::Move(Move {
            block: self.line,
            motion: Motion::Rapid,
            target,
            feed: block.modal.feed_linear,
            feed_type: Default::default(),
            exact_stop: true,
            soft: block.modal.soft,
            rounding: block.modal.rounding(),
            cutter: Cutter::OFF,
        }));
        self.finish(config, block.misc, emit)
    }

    /// `XH YH ZH`: the rotary axes go along, so that blocks behind the spline find them where it has left them.
    #[cold]
    pub(super) fn lead_tool(
        &self,
        config: &Config,
        block: &Block,
        motion: &mut Move,
        point: &[Nano; 3],
    ) -> Result<(), Fault> {
        // what cannot be followed is refused with the curve
        if let Some(target) = led(config, &self.position, &motion.target, point) {
            motion.target = target;
            motion.feed = self.feed(config, block, &target)?;
        }
        Ok(())
    }

    /// Coefficients of a `POLY` block wait: only more of them or the end point may come.
    #[cold]
    pub(super) fn check_polynomial(&self, block: &Block) -> Result<(), Fault> {
        let nothing = block.letters & !letter_bit(b'N') == 0
            && block.groups == 0
            && block.message.is_none()
            && block.label.is_none();
        let goes_on = block.modal.mode == Mode::Polynomial
            && (block.axes != 0 || block.polynomial_at.is_some());
        if nothing || goes_on {
            Ok(())
        } else {
            Err(Fault::new(
                block.first_word(),
                0,
                &message::MISSING_END_POINT,
            ))
        }
    }

    /// A line while a NURBS curve is under way or `G06.2` is in force; true if that is all there was to do.
    #[cold]
    pub(super) fn nurbs_line(
        &mut self,
        config: &Config,
        block: &mut Block,
        mounted: Mounted,
        emit: &mut dyn FnMut(Command),
    ) -> Result<bool, Fault> {
        let begins = block.groups & Group::Motion.bit() != 0;
        let place = |refusal: Refusal| {
            let at = if block.has(refusal.letter) {
                block.place(refusal.letter)
            } else {
                block.first_word()
            };
            Fault::new(at, 1, refusal.message)
        };
        let mut nurbs = self.nurbs;
        if block.modal.mode != Mode::Nurbs {
            // the curve is forgotten when the line is committed
            return nurbs.end().map(|()| false).map_err(place);
        }
        check_words(block, false)?;
        let mut out = None;
        let mut position = self.position;
        if begins || moves(block) {
            let frame = Frame::new(
                config,
                &block.modal,
                block.suppress,
                self.length(block, mounted),
            );
            let target = target(config, block, &frame, &self.position)?;
            let template = self.template(config, block, &target, mounted)?;
            let number = |letter, value: Decimal| block.has(letter).then(|| value.to_f64());
            let axes = block.order.iter().take(block.axes);
            let words = NurbsWords {
                begins,
                order: number(b'P', block.p),
                knot: number(b'K', block.ijk[2]),
                weight: number(b'R', block.r),
                axes: axes.fold(0, |bits, axis| bits | 1 << (axis & 7)),
                target,
            };
            let mut hold = |command| out = Some(command);
            nurbs
                .block(&words, &self.position, &template, &mut hold)
                .map_err(place)?;
            if !begins {
                position = target;
            }
        }
        if block.misc & Misc::ProgramEnd.bit() != 0 {
            nurbs.end().map_err(place)?;
        }
        self.commit(block, mounted, emit);
        self.nurbs = nurbs;
        self.position = position;
        if let Some(command) = out {
            emit(command);
        }
        self.finish(config, block.misc, emit).map(|()| true)
    }
}

/// `T` as text, for errors: the name, or the digits of the number.
#[cold]
pub(super) fn tool_text(tool: Option<Tool>) -> Excerpt {
    match tool {
        None => Excerpt::new(&[]),
        Some(Tool::Name(name)) => name,
        Some(Tool::Number(mut number)) => {
            let mut digits = [b'0'; 10];
            let mut begin = digits.len();
            for entry in digits.iter_mut().rev() {
                // a digit
                *entry = b'0' + (number % 10) as u8;
                begin -= 1;
                number /= 10;
                if number == 0 {
                    break;
                }
            }
            Excerpt::new(digits.get(begin..).unwrap_or(&[]))
        }
    }
}
