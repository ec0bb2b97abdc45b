//! What the words with a meaning of their own do to a [`Block`]: rows of the tables, measured coordinates, lists.

use super::block::{natural, Before, Block};
use super::error::{Excerpt, Fault};
use super::lexer::{letter_bit, Lexer, Measure, Word, WordKind, AXIS_LETTERS};
use super::modal::{Lists, Placed, Tool, DEGREE, DENOMINATOR};
use super::number::Decimal;
use super::parameters::Parameters;
use super::phrase::COEFFICIENTS;
use super::table::{Action, Group, Misc, Mode};
use crate::catalogue::{nc as message, Message};
use crate::config::Dialect;
use crate::units::AXES;

/// Largest `PW` in units of 1e-4.
const WEIGHT_MAX: i64 = 30_000;
/// Most turns of `TURN`.
const TURNS_MAX: u32 = 999;
/// Largest `ADIS`, `ADISPOS`, mm or inch.
const DISTANCE_MAX: f32 = 1000.0;
/// `G06.2` in tenths.
const NURBS: i64 = 62;

impl Block {
    /// Applies a row of the tables.
    #[inline]
    pub(super) fn act(
        &mut self,
        word: &Word,
        group: Group,
        action: Action,
        number: Decimal,
    ) -> Result<(), Fault> {
        let bit = group.bit();
        if self.groups & bit != 0 && group != Group::ToolPoint {
            return Err(Fault::new(word.at, word.length, &message::SAME_GROUP));
        }
        self.groups |= bit;
        match action {
            Action::Nothing => {}
            Action::Motion(mode) => {
                let modal = &mut self.modal;
                modal.mode = mode;
                modal.first = true;
                modal.degree = DEGREE;
            }
            Action::Special(special) => self.special = Some(Placed::new(word, special)),
            Action::ExactStopOnce => self.exact_stop = true,
            Action::ExactStop => self.modal.exact_stop = true,
            Action::Continuous(smoothing) => {
                self.modal.exact_stop = false;
                self.modal.smoothing = smoothing;
            }
            Action::Inch(on) => self.modal.inch = on,
            Action::Absolute(on) => self.modal.absolute = on,
            Action::Begin(condition) => self.modal.begin = condition,
            Action::End(condition) => self.modal.end = condition,
            Action::Soft(on) => self.modal.soft = on,
            Action::Plane(plane) => {
                if plane != self.modal.plane {
                    self.needs_g40(word);
                }
                self.modal.plane = plane;
            }
            Action::Side(side) => {
                self.modal.side = side;
                self.side_at = Some(word.at);
            }
            Action::ZeroOffset(index) => self.modal.zero_offset = index,
            Action::SuppressOffset => self.suppress = true,
            Action::FeedUnit(unit) => {
                let modal = &mut self.modal;
                if unit != modal.feed_unit {
                    // a number of the other unit would be a different feed altogether
                    modal.feed_linear = 0.0;
                    modal.feed_rotary = 0.0;
                }
                modal.feed_unit = unit;
            }
            Action::FeedReference(reference) => self.modal.feed_reference = reference,
            Action::Corner(corner) => self.modal.corner = corner,
            Action::Misc(misc) => {
                if misc == Misc::ToolChange {
                    self.needs_g40(word);
                }
                self.misc |= misc.bit();
            }
            Action::Gear(stage) => {
                self.gear = stage;
                self.misc |= Misc::GearStage.bit();
            }
            _ => return self.rare(word, action, number),
        }
        Ok(())
    }

    /// The rest of [`Block::act`]: rows with a number, and refusals.
    #[cold]
    fn rare(&mut self, word: &Word, action: Action, number: Decimal) -> Result<(), Fault> {
        let fault = |message| Fault::new(word.at, word.length, message);
        match action {
            Action::Weight => {
                let weight = number
                    .scaled(1, 4)
                    .filter(|weight| (0..=WEIGHT_MAX).contains(weight))
                    .and_then(|weight| u16::try_from(weight).ok());
                let weight = weight.ok_or_else(|| fault(&message::OUT_OF_RANGE))?;
                self.weight = Some(Placed::new(word, weight));
            }
            Action::Degree => {
                let degree = match number.whole() {
                    Some(2) => 2,
                    Some(3) => 3,
                    _ => return Err(fault(&message::OUT_OF_RANGE)),
                };
                self.degree = Some(Placed::new(word, degree));
            }
            Action::Interval => {
                // the range of the 840D, and what f32 arithmetic can use
                if !(0.0001..=99_999.999).contains(&number.to_f32()) {
                    return Err(fault(&message::OUT_OF_RANGE));
                }
                self.interval = Some(Placed::new(word, number));
            }
            Action::Radius => {
                self.radius = Some(word.at);
                self.r = number;
            }
            Action::Turns => {
                // at most 999
                let turns = natural(word, number, TURNS_MAX)? as u16;
                self.turns = Some(Placed::new(word, turns));
            }
            Action::ToolPoint(index) => {
                let bit = 1 << index;
                if self.tool_point & bit != 0 {
                    return Err(Fault::new(word.at, 2, &message::REPEATED_WORD));
                }
                if self.tool_point == 0 {
                    self.tool_point_at = word.at;
                }
                self.tool_point |= bit;
                if let Some(entry) = self.ijk.get_mut(usize::from(index)) {
                    *entry = number;
                }
            }
            Action::Distance | Action::RapidDistance => {
                let distance = number.to_f32();
                if !(0.0..=DISTANCE_MAX).contains(&distance) {
                    return Err(fault(&message::OUT_OF_RANGE));
                }
                if action == Action::Distance {
                    self.adis = Some(distance);
                } else {
                    self.adispos = Some(distance);
                }
            }
            Action::HostOnly => return Err(fault(&message::HOST_ONLY)),
            _ => return Err(fault(&message::SPINDLE_FEEDBACK)),
        }
        Ok(())
    }

    /// Remembers a word that may not stand under compensation.
    fn needs_g40(&mut self, word: &Word) {
        self.needs_g40.get_or_insert(Placed::new(word, word.length));
    }

    /// A G function that no row has: Fanuc's `G06.2`, or none at all.
    #[cold]
    pub(super) fn decimal_function(
        &mut self,
        word: &Word,
        number: Decimal,
        dialect: Dialect,
        missing: &'static Message,
    ) -> Result<(), Fault> {
        let nurbs = number.exponent == -1 && number.scaled(1, 1) == Some(NURBS);
        if dialect == Dialect::Fanuc && nurbs {
            return self.act(word, Group::Motion, Action::Motion(Mode::Nurbs), number);
        }
        Err(Fault::new(word.at, word.length, missing))
    }

    /// Everything but addresses, keywords, assignments and polynomials.
    #[cold]
    pub(super) fn phrase(
        &mut self,
        word: &Word,
        lexer: &mut Lexer,
        before: &Before,
    ) -> Result<(), Fault> {
        match word.kind {
            WordKind::ToolName(name) => {
                self.once(word, b'T')?;
                self.tool = Some(Tool::Name(Excerpt::new(name)));
            }
            WordKind::Measured(letter, number, measure) => {
                return self.measured(word, letter, number, measure, before)
            }
            WordKind::Message(text) => {
                if self.message.is_some() {
                    return Err(Fault::new(word.at, 3, &message::REPEATED_WORD));
                }
                self.message = Some(Excerpt::new(text));
            }
            WordKind::GotoForward(label) => {
                if self.label.is_some() {
                    return Err(Fault::new(word.at, 5, &message::REPEATED_WORD));
                }
                self.label = Some(Excerpt::new(label));
            }
            WordKind::SplinePath => {
                let mut path = 0;
                let list = lexer.path_list()?;
                while let Some(letter) = lexer.path_axis(list)? {
                    match before.axis(letter) {
                        Some(axis) => path |= 1 << axis,
                        None => {
                            let at = lexer.at.saturating_sub(1);
                            return Err(Fault::new(at, 1, &message::AXIS_NOT_CONFIGURED));
                        }
                    }
                }
                self.modal.path = if path == 0 { u8::MAX } else { path };
            }
            // labels
            _ => {}
        }
        Ok(())
    }

    /// `X=AC(5)` and its like.
    fn measured(
        &mut self,
        word: &Word,
        letter: u8,
        number: Decimal,
        measure: Measure,
        before: &Before,
    ) -> Result<(), Fault> {
        let bit = if AXIS_LETTERS & letter_bit(letter) != 0 {
            self.axis(word, letter, number, before.axis_of)?;
            let Some(axis) = before.axis(letter) else {
                return Ok(());
            };
            if measure == Measure::Direct && before.linear & (1 << axis) != 0 {
                return Err(Fault::new(word.at, word.length, &message::UNEXPECTED_WORD));
            }
            1 << axis
        } else {
            self.once(word, letter)?;
            let index = letter.wrapping_sub(b'I');
            if let Some(entry) = self.ijk.get_mut(usize::from(index)) {
                *entry = number;
            }
            1 << (AXES + usize::from(index))
        };
        if measure == Measure::Incremental {
            self.incremental |= bit;
        } else {
            self.absolute |= bit;
        }
        Ok(())
    }

    /// `PO[X]=(xe,a2,..)`, `POX Q.. Q..` and the same for the denominator.
    #[cold]
    pub(super) fn coefficients(
        &mut self,
        word: &Word,
        letter: u8,
        lexer: &mut Lexer,
        parameters: &Parameters,
        before: &Before,
        lists: &mut Lists,
    ) -> Result<(), Fault> {
        let mut numbers = [0.0; COEFFICIENTS];
        let (count, list) = lexer.coefficients(word.at, parameters, &mut numbers)?;
        self.polynomial_at.get_or_insert(word.at);
        let bit = match before.axis(letter) {
            Some(axis) => 1 << axis,
            None if letter == 0 => DENOMINATOR,
            None => {
                return Err(Fault::new(
                    word.at,
                    word.length,
                    &message::AXIS_NOT_CONFIGURED,
                ))
            }
        };
        if self.polynomial & bit != 0 {
            return Err(Fault::new(word.at, word.length, &message::REPEATED_WORD));
        }
        self.polynomial |= bit;
        if bit == DENOMINATOR {
            // without a value at the end the denominator would be 0 there
            if numbers[0] <= 0.0 {
                return Err(Fault::new(word.at, word.length, &message::OUT_OF_RANGE));
            }
            lists.denominator = numbers;
            return Ok(());
        }
        let mut skipped = 0;
        if list {
            let end = Decimal::from_f64(numbers[0])
                .ok_or_else(|| Fault::new(word.at, word.length, &message::OUT_OF_RANGE))?;
            self.axis(word, letter, end, before.axis_of)?;
            skipped = 1;
        } else if count == COEFFICIENTS {
            return Err(Fault::new(word.at, word.length, &message::UNEXPECTED_WORD));
        }
        let axis = before
            .axis(letter)
            .and_then(|axis| lists.numerators.get_mut(axis));
        if let Some(row) = axis {
            *row = [0.0; COEFFICIENTS - 1];
            for (to, from) in row.iter_mut().zip(numbers.iter().skip(skipped)) {
                *to = *from;
            }
        }
        Ok(())
    }
}
