//! Words of one line to one block: comes in a line and the modal state before it, goes out the modal
//! state behind it and what the line itself asks for. Nothing outside changes, so a line that fails
//! half way leaves no trace.

use super::command::BoundaryCondition;
use super::error::{Excerpt, Fault, NcErrorKind};
use super::lexer::{letter_bit, Lexer, Word, WordKind};
use super::number::Decimal;
use super::table::{find, Action, Group, Keyword, Mode, Row, G_FUNCTIONS, M_FUNCTIONS};
use crate::units::AXES;

/// Largest block number.
const BLOCK_NUMBER_MAX: u32 = 99_999_999;
/// Largest G and M number looked up.
const FUNCTION_MAX: u32 = 999;
/// Largest tool number.
const TOOL_NUMBER_MAX: u32 = 99_999_999;
/// Largest `PW` in units of 1e-4.
const WEIGHT_MAX: i64 = 30_000;

/// Coefficients of one `G6` block: K3, K2, K1 of up to all axes, in the order of the text.
pub(super) type Coefficients = [i64; 3 * AXES];

/// State that stays from line to line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Modal {
    /// Group 1.
    pub mode: Mode,
    /// Group 19.
    pub begin: BoundaryCondition,
    /// Group 20.
    pub end: BoundaryCondition,
    /// `SD`.
    pub degree: u8,
    /// `G90`.
    pub absolute: bool,
    /// `G70`.
    pub inch: bool,
    /// `G60`.
    pub exact_stop: bool,
    /// `SOFT`.
    pub soft: bool,
    /// Feed of moves with linear axes, mm/s; 0 until programmed.
    pub feed_linear: f32,
    /// Feed of moves of rotary axes alone, degree/s; 0 until programmed.
    pub feed_rotary: f32,
    /// `S`, rpm.
    pub speed: f32,
    /// Weight of the first point of the B-spline under way, 1e-4; 0 before its first point.
    pub first_weight: u16,
}

/// `T`: the tool that `M6` changes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tool {
    /// `T5`.
    Number(u32),
    /// `T="FR_4"`.
    Name(Excerpt),
}

/// A number and the index of its word.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placed<T> {
    pub at: usize,
    pub value: T,
}

/// One line, read.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block {
    /// Modal state behind the line, but for what needs the whole line (feed, speed, degree).
    pub modal: Modal,
    /// Letters present, one bit each.
    pub letters: u32,
    /// Groups present, one bit each.
    groups: u32,
    /// Byte index of the first word of each letter present.
    places: [u8; 26],
    /// Coordinates as printed, per axis; zero where the axis has no word.
    pub values: [Decimal; AXES],
    /// Axes in the order of their words.
    pub order: [u8; AXES],
    /// How many entries of `order` count.
    pub axes: usize,
    /// Byte index of the first coordinate.
    pub first_axis: usize,
    /// `F`, `S`, `P`, `I`.
    pub f: Decimal,
    pub s: Decimal,
    pub p: Decimal,
    pub i: Decimal,
    /// `T`.
    pub tool: Option<Tool>,
    /// `G4` and its place.
    pub dwell: Option<usize>,
    /// `G9`.
    pub exact_stop: bool,
    /// [`Misc`] bits.
    pub misc: u16,
    /// `PW` in 1e-4.
    pub weight: Option<Placed<u16>>,
    /// `SD`.
    pub degree: Option<Placed<u8>>,
    /// `PL`.
    pub interval: Option<Placed<f32>>,
    /// Coefficients in the buffer, old and new.
    pub k_count: usize,
}

/// What the reader of a line needs to know besides its text.
#[derive(Clone, Copy, Debug)]
pub(super) struct Before<'a> {
    /// Axis index per letter, [`AXES`] or more for none.
    pub axis_of: &'a [u8; 26],
    /// Modal state in force.
    pub modal: &'a Modal,
    /// A `G6` block waits for K words: nothing else may come.
    pub only_k: bool,
    /// Coefficients that block has already.
    pub k_count: usize,
}

impl Block {
    /// An empty line with the modal state before it.
    pub fn new(before: &Before) -> Self {
        Self {
            modal: *before.modal,
            letters: 0,
            groups: 0,
            places: [0; 26],
            values: [Decimal::ZERO; AXES],
            order: [0; AXES],
            axes: 0,
            first_axis: 0,
            f: Decimal::ZERO,
            s: Decimal::ZERO,
            p: Decimal::ZERO,
            i: Decimal::ZERO,
            tool: None,
            dwell: None,
            exact_stop: false,
            misc: 0,
            weight: None,
            degree: None,
            interval: None,
            k_count: before.k_count,
        }
    }

    /// Reads one line. New coefficients go into `k` behind those `before` counts.
    ///
    /// # Errors
    /// Everything that is wrong with a word or a pair of words, whatever the state of the machine.
    pub fn read(
        &mut self,
        text: &[u8],
        before: &Before,
        k: &mut Coefficients,
    ) -> Result<(), Fault> {
        let mut lexer = Lexer::new(text)?;
        if let Some(at) = lexer.header()? {
            if before.only_k {
                return Err(Fault::new(at, 0, |_| NcErrorKind::MissingCoefficients));
            }
            return Ok(());
        }
        while let Some(word) = lexer.next_word()? {
            match word.kind {
                WordKind::Address(letter, number) => {
                    self.address(&word, letter, number, before, k)?
                }
                _ if before.only_k => {
                    return Err(Fault::new(word.at, 0, |_| NcErrorKind::MissingCoefficients))
                }
                WordKind::Keyword(row, number) => self.keyword(&word, row, number)?,
                WordKind::ToolName(name) => {
                    self.once(&word, b'T')?;
                    self.tool = Some(Tool::Name(Excerpt::new(name)));
                }
            }
        }
        Ok(())
    }

    /// True if the line has a word with `letter`.
    pub fn has(&self, letter: u8) -> bool {
        self.letters & letter_bit(letter) != 0
    }

    /// Byte index of the first word with `letter`.
    pub fn place(&self, letter: u8) -> usize {
        self.places
            .get(usize::from(letter.wrapping_sub(b'A')))
            .map_or(0, |place| usize::from(*place))
    }

    /// Enters a letter; false if it stood in the line before.
    #[inline]
    fn enter(&mut self, at: usize, letter: u8) -> bool {
        let bit = letter_bit(letter);
        if self.letters & bit != 0 {
            return false;
        }
        self.letters |= bit;
        if let Some(place) = self.places.get_mut(usize::from(letter.wrapping_sub(b'A'))) {
            // a line has at most 96 bytes
            *place = at as u8;
        }
        true
    }

    #[inline]
    fn once(&mut self, word: &Word, letter: u8) -> Result<(), Fault> {
        if self.enter(word.at, letter) {
            Ok(())
        } else {
            Err(Fault::new(word.at, 1, NcErrorKind::RepeatedWord))
        }
    }

    #[inline]
    fn address(
        &mut self,
        word: &Word,
        letter: u8,
        number: Decimal,
        before: &Before,
        k: &mut Coefficients,
    ) -> Result<(), Fault> {
        if before.only_k && letter != b'N' && letter != b'K' {
            return Err(Fault::new(word.at, 0, |_| NcErrorKind::MissingCoefficients));
        }
        match letter {
            b'G' => {
                self.enter(word.at, letter);
                self.function(word, number, &G_FUNCTIONS, NcErrorKind::GNotAvailable)
            }
            b'M' => {
                self.enter(word.at, letter);
                self.function(word, number, &M_FUNCTIONS, NcErrorKind::MNotAvailable)
            }
            b'K' => {
                self.enter(word.at, letter);
                self.coefficient(word, number, k)
            }
            b'N' => {
                if self.groups != 0 || self.letters & !letter_bit(b'N') != 0 {
                    return Err(Fault::new(word.at, 0, |_| NcErrorKind::BlockNumberNotFirst));
                }
                self.once(word, letter)?;
                natural(word, number, BLOCK_NUMBER_MAX).map(drop)
            }
            b'F' => {
                self.f = number;
                self.once(word, letter)
            }
            b'S' => {
                self.s = number;
                self.once(word, letter)
            }
            b'P' => {
                self.p = number;
                self.once(word, letter)
            }
            b'I' => {
                self.i = number;
                self.once(word, letter)
            }
            b'T' => {
                self.tool = Some(Tool::Number(natural(word, number, TOOL_NUMBER_MAX)?));
                self.once(word, letter)
            }
            _ => self.axis(word, letter, number, before.axis_of),
        }
    }

    #[inline]
    fn axis(
        &mut self,
        word: &Word,
        letter: u8,
        number: Decimal,
        axis_of: &[u8; 26],
    ) -> Result<(), Fault> {
        self.once(word, letter)?;
        let axis = axis_of
            .get(usize::from(letter.wrapping_sub(b'A')))
            .copied()
            .unwrap_or(u8::MAX);
        match (
            self.values.get_mut(usize::from(axis)),
            self.order.get_mut(self.axes),
        ) {
            (Some(value), Some(entry)) => {
                *value = number;
                *entry = axis;
                if self.axes == 0 {
                    self.first_axis = word.at;
                }
                self.axes += 1;
                Ok(())
            }
            _ => Err(Fault::new(word.at, 1, NcErrorKind::AxisNotConfigured)),
        }
    }

    #[inline]
    fn function(
        &mut self,
        word: &Word,
        number: Decimal,
        rows: &'static [Row],
        missing: fn(Excerpt) -> NcErrorKind,
    ) -> Result<(), Fault> {
        match number
            .index(FUNCTION_MAX)
            .and_then(|number| find(rows, number))
        {
            Some((_, group, action)) => self.act(word, *group, *action, Decimal::ZERO),
            None => Err(Fault::new(word.at, word.length, missing)),
        }
    }

    fn keyword(&mut self, word: &Word, row: &Keyword, number: Decimal) -> Result<(), Fault> {
        self.act(word, row.group, row.action, number)
    }

    fn coefficient(
        &mut self,
        word: &Word,
        number: Decimal,
        k: &mut Coefficients,
    ) -> Result<(), Fault> {
        let Some(value) = number.whole() else {
            let kind = if number.exponent < 0 {
                NcErrorKind::NotWhole
            } else {
                NcErrorKind::OutOfRange
            };
            return Err(Fault::new(word.at, word.length, kind));
        };
        match k.get_mut(self.k_count) {
            Some(entry) => {
                *entry = value;
                self.k_count += 1;
                Ok(())
            }
            None => Err(Fault::new(
                word.at,
                word.length,
                NcErrorKind::UnexpectedWord,
            )),
        }
    }

    /// Applies a row of the tables.
    #[inline]
    fn act(
        &mut self,
        word: &Word,
        group: Group,
        action: Action,
        number: Decimal,
    ) -> Result<(), Fault> {
        let bit = 1 << group as u32;
        if self.groups & bit != 0 {
            return Err(Fault::new(word.at, word.length, NcErrorKind::SameGroup));
        }
        self.groups |= bit;
        match action {
            Action::Nothing => {}
            Action::Motion(mode) => self.modal.mode = mode,
            Action::Dwell => self.dwell = Some(word.at),
            Action::ExactStopOnce => self.exact_stop = true,
            Action::ExactStop(on) => self.modal.exact_stop = on,
            Action::Inch(on) => self.modal.inch = on,
            Action::Absolute(on) => self.modal.absolute = on,
            Action::Begin(condition) => self.modal.begin = condition,
            Action::End(condition) => self.modal.end = condition,
            Action::Soft(on) => self.modal.soft = on,
            Action::Misc(misc) => self.misc |= misc.bit(),
            Action::Weight => {
                let weight = number
                    .scaled(1, 4)
                    .filter(|weight| (1..=WEIGHT_MAX).contains(weight));
                let value = weight.and_then(|weight| u16::try_from(weight).ok());
                self.weight = Some(Placed {
                    at: word.at,
                    value: value.ok_or_else(|| out_of_range(word))?,
                });
            }
            Action::Degree => {
                let value = match number.whole() {
                    Some(2) => 2,
                    Some(3) => 3,
                    _ => return Err(out_of_range(word)),
                };
                self.degree = Some(Placed { at: word.at, value });
            }
            Action::Interval => {
                let value = number.to_f32();
                // the range of the 840D, and what f32 arithmetic can use
                if !(0.0001..=99_999.999).contains(&value) {
                    return Err(out_of_range(word));
                }
                self.interval = Some(Placed { at: word.at, value });
            }
            Action::RefuseCompensation => {
                return Err(Fault::new(word.at, 0, |_| {
                    NcErrorKind::CompensationNotAvailable
                }));
            }
        }
        Ok(())
    }
}

#[cold]
fn out_of_range(word: &Word) -> Fault {
    Fault::new(word.at, word.length, NcErrorKind::OutOfRange)
}

/// A number of digits only, at most `max`.
fn natural(word: &Word, number: Decimal, max: u32) -> Result<u32, Fault> {
    number.index(max).ok_or_else(|| {
        let kind = if number.exponent == 0 {
            NcErrorKind::OutOfRange
        } else {
            NcErrorKind::NotWhole
        };
        Fault::new(word.at, word.length, kind)
    })
}
