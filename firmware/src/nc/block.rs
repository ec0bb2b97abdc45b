//! Words of one line to one block: comes in a line and the modal state before it, goes out the modal
//! state behind it and what the line itself asks for. Nothing outside changes, so a line that fails
//! half way leaves no trace.

use super::error::{Excerpt, Fault};
use super::lexer::{letter_bit, Lexer, Word, WordKind};
use super::modal::{Lists, Modal, Placed, Tool};
use super::number::Decimal;
use super::parameters::Parameters;
use super::table::{find, Mode, Row, Special, G_FUNCTIONS, M_FUNCTIONS};
use crate::catalogue::{nc as message, Message};
use crate::config::Dialect;
use crate::units::AXES;

/// Largest block number.
const BLOCK_NUMBER_MAX: u32 = 99_999_999;
/// Largest G and M number looked up.
const FUNCTION_MAX: u32 = 999;
/// Largest tool number.
const TOOL_NUMBER_MAX: u32 = 99_999_999;

/// One line, read.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block {
    /// Modal state behind the line, but for what needs the whole line (feed, speed, degree).
    pub modal: Modal,
    /// Letters present, one bit each.
    pub letters: u32,
    /// Groups present, one bit each.
    pub groups: u32,
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
    /// `F`, `S`, `P`.
    pub f: Decimal,
    pub s: Decimal,
    pub p: Decimal,
    /// `I`, `J`, `K` of a circle, or `XH`, `YH`, `ZH`.
    pub ijk: [Decimal; 3],
    /// `R`, or `CR`.
    pub r: Decimal,
    /// `T`.
    pub tool: Option<Tool>,
    /// Function of group 2 and its place.
    pub special: Option<Placed<Special>>,
    /// `G9`.
    pub exact_stop: bool,
    /// `G53`.
    pub suppress: bool,
    /// [`super::table::Misc`] bits.
    pub misc: u16,
    /// `M41` to `M45`: 1 to 5.
    pub gear: u8,
    /// `L`.
    pub l: u8,
    /// `TURN`.
    pub turns: Option<Placed<u16>>,
    /// Place of `CR`.
    pub radius: Option<usize>,
    /// `AC`, `DC`: one bit per axis, then I, J, K.
    pub absolute: u8,
    /// `IC`: the same.
    pub incremental: u8,
    /// `XH`, `YH`, `ZH` present, one bit each, and the place of the first.
    pub tool_point: u8,
    pub tool_point_at: usize,
    /// `PW` in 1e-4.
    pub weight: Option<Placed<u16>>,
    /// `SD`.
    pub degree: Option<Placed<u8>>,
    /// `PL`.
    pub interval: Option<Placed<Decimal>>,
    /// `ADIS`, `ADISPOS`, as printed.
    pub adis: Option<f32>,
    pub adispos: Option<f32>,
    /// Coefficients in the list `k`, old and new.
    pub k_count: usize,
    /// Axes (and [`super::modal::DENOMINATOR`]) with coefficients of `POLY`, old and new.
    pub polynomial: u8,
    /// Place of the first polynomial of the line.
    pub polynomial_at: Option<usize>,
    /// Place of the word that may not stand under compensation.
    pub needs_g40: Option<Placed<usize>>,
    /// Place of `G41` or `G42`.
    pub side_at: Option<usize>,
    /// `MSG`.
    pub message: Option<Excerpt>,
    /// `GOTOF`.
    pub label: Option<Excerpt>,
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
    /// Axes of a `POLY` block to come that have their coefficients already.
    pub polynomial: u8,
    /// Dialect in force.
    pub dialect: Dialect,
    /// Linear axes, one bit each.
    pub linear: u8,
}

impl Before<'_> {
    /// Index of the axis with `letter`.
    pub fn axis(&self, letter: u8) -> Option<usize> {
        self.axis_of
            .get(usize::from(letter.wrapping_sub(b'A')))
            .map(|axis| usize::from(*axis))
            .filter(|axis| *axis < AXES)
    }
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
            ijk: [Decimal::ZERO; 3],
            r: Decimal::ZERO,
            tool: None,
            special: None,
            exact_stop: false,
            suppress: false,
            misc: 0,
            gear: 0,
            l: 0,
            turns: None,
            radius: None,
            absolute: 0,
            incremental: 0,
            tool_point: 0,
            tool_point_at: 0,
            weight: None,
            degree: None,
            interval: None,
            adis: None,
            adispos: None,
            k_count: before.k_count,
            polynomial: before.polynomial,
            polynomial_at: None,
            needs_g40: None,
            side_at: None,
            message: None,
            label: None,
        }
    }

    /// Reads one line. New coefficients go into `lists` beside those `before` counts, parameters of assignments into
    /// `parameters`, whose state before the line then goes into `saved`.
    ///
    /// # Errors
    /// Everything that is wrong with a word or a pair of words, whatever the state of the machine.
    pub fn read(
        &mut self,
        text: &[u8],
        before: &Before,
        lists: &mut Lists,
        parameters: &mut Parameters,
        saved: &mut Option<Parameters>,
    ) -> Result<(), Fault> {
        let mut lexer = Lexer::new(text)?;
        if let Some(at) = lexer.header()? {
            if before.only_k {
                return Err(Fault::new(at, 0, &message::MISSING_COEFFICIENTS));
            }
            return Ok(());
        }
        while let Some(word) = lexer.next_word(parameters)? {
            match word.kind {
                WordKind::Address(letter, number) => {
                    self.address(&word, letter, number, before, lists)?;
                    if let Some(Placed {
                        value: Special::ReferencePoint | Special::FixedPoint,
                        ..
                    }) = self.special
                    {
                        lexer.bare = true;
                    }
                }
                _ if before.only_k => {
                    return Err(Fault::new(word.at, 0, &message::MISSING_COEFFICIENTS))
                }
                WordKind::Keyword(row, number) => self.act(&word, row.group, row.action, number)?,
                WordKind::Assign(index, value) => {
                    saved.get_or_insert_with(|| parameters.clone());
                    parameters.set(usize::from(index), value);
                }
                WordKind::Polynomial(letter) => {
                    self.coefficients(&word, letter, &mut lexer, parameters, before, lists)?;
                }
                _ => self.phrase(&word, &mut lexer, before)?,
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

    /// Byte index of the first address but `N`, 0 without one.
    #[cold]
    pub fn first_word(&self) -> usize {
        let letters = (b'A'..=b'Z').filter(|letter| *letter != b'N' && self.has(*letter));
        letters.map(|letter| self.place(letter)).min().unwrap_or(0)
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
    pub(super) fn once(&mut self, word: &Word, letter: u8) -> Result<(), Fault> {
        if self.enter(word.at, letter) {
            Ok(())
        } else {
            Err(Fault::new(word.at, 1, &message::REPEATED_WORD))
        }
    }

    #[inline]
    fn address(
        &mut self,
        word: &Word,
        letter: u8,
        number: Decimal,
        before: &Before,
        lists: &mut Lists,
    ) -> Result<(), Fault> {
        if before.only_k && letter != b'N' && letter != b'K' {
            return Err(Fault::new(word.at, 0, &message::MISSING_COEFFICIENTS));
        }
        match letter {
            b'G' => {
                self.enter(word.at, letter);
                self.function(
                    word,
                    number,
                    &G_FUNCTIONS,
                    before,
                    &message::G_NOT_AVAILABLE,
                )
            }
            b'M' => {
                self.enter(word.at, letter);
                self.function(
                    word,
                    number,
                    &M_FUNCTIONS,
                    before,
                    &message::M_NOT_AVAILABLE,
                )
            }
            b'K' if before.only_k || self.modal.mode == Mode::Cubic => {
                self.enter(word.at, letter);
                self.coefficient(word, number, lists)
            }
            b'N' => {
                if self.groups != 0 || self.letters & !letter_bit(b'N') != 0 {
                    return Err(Fault::new(word.at, 0, &message::BLOCK_NUMBER_NOT_FIRST));
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
            b'I' | b'J' | b'K' => {
                if let Some(entry) = self.ijk.get_mut(usize::from(letter.wrapping_sub(b'I'))) {
                    *entry = number;
                }
                self.once(word, letter)
            }
            b'R' => {
                self.r = number;
                self.once(word, letter)
            }
            b'D' => {
                self.modal.offsets = natural(word, number, 1)? == 1;
                self.once(word, letter)
            }
            b'L' => {
                // whatever it is, a number that is not small is no table of G10
                self.l = natural(word, number, BLOCK_NUMBER_MAX)?.min(u32::from(u8::MAX)) as u8;
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
    pub(super) fn axis(
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
            _ => Err(Fault::new(word.at, 1, &message::AXIS_NOT_CONFIGURED)),
        }
    }

    #[inline]
    fn function(
        &mut self,
        word: &Word,
        number: Decimal,
        rows: &'static [Row],
        before: &Before,
        missing: &'static Message,
    ) -> Result<(), Fault> {
        match number
            .index(FUNCTION_MAX)
            .and_then(|number| find(rows, number))
        {
            Some((_, group, action)) => self.act(word, *group, *action, Decimal::ZERO),
            None => self.decimal_function(word, number, before.dialect, missing),
        }
    }

    fn coefficient(
        &mut self,
        word: &Word,
        number: Decimal,
        lists: &mut Lists,
    ) -> Result<(), Fault> {
        let Some(value) = number.whole() else {
            let kind = if number.exponent < 0 {
                &message::NOT_WHOLE
            } else {
                &message::OUT_OF_RANGE
            };
            return Err(Fault::new(word.at, word.length, kind));
        };
        match lists.k.get_mut(self.k_count) {
            Some(entry) => {
                *entry = value;
                self.k_count += 1;
                Ok(())
            }
            None => Err(Fault::new(word.at, word.length, &message::UNEXPECTED_WORD)),
        }
    }
}

/// A number of digits only, at most `max`.
pub(super) fn natural(word: &Word, number: Decimal, max: u32) -> Result<u32, Fault> {
    number.index(max).ok_or_else(|| {
        let kind = if number.exponent == 0 {
            &message::OUT_OF_RANGE
        } else {
            &message::NOT_WHOLE
        };
        Fault::new(word.at, word.length, kind)
    })
}
