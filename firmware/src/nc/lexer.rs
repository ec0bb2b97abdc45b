//! One physical line of bytes to words: nothing is copied, every word knows its bytes and its place.
//!
//! Blanks separate nothing and join nothing (two senders remove them): a word ends where its number
//! or its keyword ends, so `ASPLINEX1.5Y2.5` and `BTANETAN` are what they look like. A letter in front
//! of a letter begins a keyword, else it is an address. What takes more than a number stands in `phrase`.

use super::error::{Fault, EXCERPT};
use super::number::{Decimal, NumberError};
use super::parameters::Parameters;
use super::table::{Keyword, KEYWORDS};
use crate::catalogue::nc as message;

/// Longest physical line in bytes, without its end.
pub const LINE_MAX: usize = 96;

/// What a word is.
#[derive(Clone, Copy, Debug)]
pub(super) enum WordKind<'a> {
    /// Address letter (upper case) and number.
    Address(u8, Decimal),
    /// `T="name"`.
    ToolName(&'a [u8]),
    /// Keyword, and its number (zero if it takes none).
    Keyword(&'static Keyword, Decimal),
    /// Address, number, and what it counts from: `X=AC(5)`, `XAC5`.
    Measured(u8, Decimal, Measure),
    /// `R1=2.5`: index and value.
    Assign(u8, f64),
    /// `LABEL:`, before every other word but `N`.
    Label(&'a [u8]),
    /// `GOTOF name`.
    GotoForward(&'a [u8]),
    /// `MSG("text")`.
    Message(&'a [u8]),
    /// `SPLINEPATH`; [`Lexer::path_axis`] reads its letters.
    SplinePath,
    /// `PO[X]` or `POX` (with the letter), `PO[]` or `POD` (with 0); [`Lexer::coefficients`] reads its numbers.
    Polynomial(u8),
}

/// What the number of a coordinate counts from, whatever `G90` and `G91` say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Measure {
    /// `AC`: the origin.
    Absolute,
    /// `DC`: the origin; rotary axes only.
    Direct,
    /// `IC`: the position.
    Incremental,
}

/// A word and where it stands.
#[derive(Clone, Copy, Debug)]
pub(super) struct Word<'a> {
    /// Index of the first byte.
    pub at: usize,
    /// Bytes from the first letter to the end of the number.
    pub length: usize,
    /// What it is.
    pub kind: WordKind<'a>,
}

/// Letters that are addresses of the language: the axis letters of all machines and the others but `R`, which has a
/// path of its own.
const ADDRESSES: u32 = letter_bits(b"ABCUVWXYZDFGIJKLMNPST");
/// Letters of axes of any machine.
pub(super) const AXIS_LETTERS: u32 = letter_bits(b"ABCUVWXYZ");

const fn letter_bits(letters: &[u8]) -> u32 {
    let mut bits = 0;
    let mut i = 0;
    while i < letters.len() {
        bits |= letter_bit(letters[i]);
        i += 1;
    }
    bits
}

/// One bit per upper-case letter.
pub(super) const fn letter_bit(letter: u8) -> u32 {
    1 << (letter.wrapping_sub(b'A') & 31)
}

/// Walks along one line.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lexer<'a> {
    pub(super) text: &'a [u8],
    pub(super) at: usize,
    /// Axis letters may stand without a number, which is then zero (`G74 X Z`).
    pub bare: bool,
}

impl<'a> Lexer<'a> {
    /// Begins at the start of `text`; a carriage return at its end does not count.
    pub fn new(text: &'a [u8]) -> Result<Self, Fault> {
        let text = text.strip_suffix(b"\r").unwrap_or(text);
        if text.len() > LINE_MAX {
            return Err(Fault::new(LINE_MAX, 0, &message::LINE_TOO_LONG));
        }
        Ok(Self {
            text,
            at: 0,
            bare: false,
        })
    }

    #[inline]
    pub(super) fn peek(&self) -> Option<u8> {
        self.text.get(self.at).copied()
    }

    #[inline]
    pub(super) fn skip_blanks(&mut self) {
        while let Some(b' ' | b'\t') = self.peek() {
            self.at += 1;
        }
    }

    /// Place of the `%`, and the line is used up, if it is a program header: `%`, `%MPF 150`,
    /// `%_N_NAME_MPF`. To be asked before the first word. Steps over the mark of an optional block, `/` or `/3`.
    #[inline]
    pub fn header(&mut self) -> Result<Option<usize>, Fault> {
        self.skip_blanks();
        match self.peek() {
            Some(b'%') => self.header_line().map(Some),
            Some(b'/') => {
                self.at += 1;
                if let Some(b'0'..=b'9') = self.peek() {
                    self.at += 1;
                }
                Ok(None)
            }
            _ => Ok(None),
        }
    }

    #[cold]
    fn header_line(&mut self) -> Result<usize, Fault> {
        let begin = self.at;
        self.at += 1;
        while let Some(byte) = self.peek() {
            match byte {
                b'0'..=b'9' | b'A'..=b'Z' | b'a'..=b'z' | b'_' | b' ' | b'\t' => self.at += 1,
                b';' | b'(' => self.skip_comment(byte)?,
                _ => return Err(Fault::new(self.at, 1, &message::UNEXPECTED_BYTE)),
            }
        }
        Ok(begin)
    }

    /// Steps over the comment that begins here with `first`.
    #[cold]
    fn skip_comment(&mut self, first: u8) -> Result<(), Fault> {
        if first == b';' {
            self.at = self.text.len();
            return Ok(());
        }
        let rest = self.text.get(self.at..).unwrap_or(&[]);
        match rest.iter().position(|byte| *byte == b')') {
            Some(close) => {
                self.at += close + 1;
                Ok(())
            }
            None => Err(Fault::new(self.at, 0, &message::UNCLOSED_COMMENT)),
        }
    }

    /// The next word, `None` at the end of the line.
    ///
    /// # Errors
    /// Bytes that begin no word, unknown words, missing or malformed numbers, open comments and strings.
    #[inline]
    pub fn next_word(&mut self, parameters: &Parameters) -> Result<Option<Word<'a>>, Fault> {
        let first = loop {
            match self.peek() {
                None => return Ok(None),
                Some(b' ' | b'\t') => self.at += 1,
                Some(byte) if byte.is_ascii_alphabetic() => break byte,
                Some(byte @ (b';' | b'(')) => self.skip_comment(byte)?,
                Some(_) => return Err(Fault::new(self.at, 1, &message::UNEXPECTED_BYTE)),
            }
        };
        let begin = self.at;
        match self.text.get(begin + 1) {
            Some(b'A'..=b'Z' | b'a'..=b'z' | b'_') => {
                return self.keyword(begin, parameters).map(Some)
            }
            _ => self.at += 1,
        }
        let letter = first.to_ascii_uppercase();
        if ADDRESSES & letter_bit(letter) == 0 {
            return self.rare(begin, letter, parameters).map(Some);
        }
        let kind = match self.text.get(self.at) {
            Some(b'0'..=b'9' | b'-' | b'.') => WordKind::Address(letter, self.digits()?),
            _ => self.spaced_value(begin, letter, parameters)?,
        };
        Ok(Some(Word {
            at: begin,
            length: self.at - begin,
            kind,
        }))
    }

    pub(super) fn since(&self, begin: usize) -> &'a [u8] {
        self.text.get(begin..self.at).unwrap_or(&[])
    }

    /// The value of an address that does not follow at once: behind blanks or `=`, or a name.
    #[cold]
    fn spaced_value(
        &mut self,
        begin: usize,
        letter: u8,
        parameters: &Parameters,
    ) -> Result<WordKind<'a>, Fault> {
        let blank = self.at;
        let equals = self.skip_to_value();
        if letter == b'T' && self.peek() == Some(b'"') {
            return self.tool_name().map(WordKind::ToolName);
        }
        if equals && letter == b'N' {
            return Err(Fault::new(begin + 1, 1, &message::UNEXPECTED_BYTE));
        }
        if equals {
            return self.assigned_coordinate(begin, letter, parameters);
        }
        if self.bare && AXIS_LETTERS & letter_bit(letter) != 0 && !self.at_number() {
            self.at = blank;
            return Ok(WordKind::Address(letter, Decimal::ZERO));
        }
        self.number(begin, begin + 1)
            .map(|number| WordKind::Address(letter, number))
    }

    /// Steps over blanks and one `=`; true if there was one.
    pub(super) fn skip_to_value(&mut self) -> bool {
        self.skip_blanks();
        let equals = self.peek() == Some(b'=');
        if equals {
            self.at += 1;
            self.skip_blanks();
        }
        equals
    }

    /// True if a number may begin here.
    pub(super) fn at_number(&self) -> bool {
        matches!(self.peek(), Some(b'0'..=b'9' | b'+' | b'-' | b'.'))
    }

    /// A number, or an error about the word from `begin` to `end` that needs it.
    pub(super) fn number(&mut self, begin: usize, end: usize) -> Result<Decimal, Fault> {
        if self.at_number() {
            self.digits()
        } else {
            Err(Fault::new(begin, end - begin, &message::MISSING_NUMBER))
        }
    }

    /// The number that begins here with a sign, point or digit.
    #[inline]
    pub(super) fn digits(&mut self) -> Result<Decimal, Fault> {
        let begin = self.at;
        Decimal::read(self.text, &mut self.at).map_err(|error| self.number_fault(begin, error))
    }

    #[cold]
    fn number_fault(&self, begin: usize, error: NumberError) -> Fault {
        let rest = self.text.get(begin..).unwrap_or(&[]);
        let numeric = |byte: &u8| byte.is_ascii_digit() || matches!(byte, b'+' | b'-' | b'.');
        let length = rest
            .iter()
            .position(|byte| !numeric(byte))
            .unwrap_or(rest.len());
        match error {
            NumberError::NoDigits => Fault::new(begin, length, &message::MALFORMED_NUMBER),
            NumberError::TooLong => Fault::new(begin, length, &message::TOO_MANY_DIGITS),
        }
    }

    /// `"name"` here: the name.
    fn tool_name(&mut self) -> Result<&'a [u8], Fault> {
        let open = self.at;
        let name = self.string()?;
        if name.is_empty() || name.len() > EXCERPT {
            return Err(Fault::new(open, 0, &message::TOOL_NAME));
        }
        Ok(name)
    }

    /// The keyword at `begin`, which may be glued to the next word.
    #[cold]
    fn keyword(&mut self, begin: usize, parameters: &Parameters) -> Result<Word<'a>, Fault> {
        let rest = self.text.get(begin..).unwrap_or(&[]);
        if let Some(label) = self.label(begin) {
            return Ok(self.word(begin, WordKind::Label(label)));
        }
        for row in &KEYWORDS {
            let end = begin + row.name.len();
            if !begins(rest, row.name) {
                continue;
            }
            self.at = end;
            let mut number = Decimal::ZERO;
            if row.takes_number {
                if let Some(b'A'..=b'Z' | b'a'..=b'z' | b'_') = self.peek() {
                    break;
                }
                number = if self.skip_to_value() {
                    self.assigned(begin, end, parameters)?
                } else {
                    self.number(begin, end)?
                };
            }
            return Ok(self.word(begin, WordKind::Keyword(row, number)));
        }
        self.at = begin;
        self.phrase(begin, parameters)
    }

    /// The word from `begin` to here.
    pub(super) fn word(&self, begin: usize, kind: WordKind<'a>) -> Word<'a> {
        Word {
            at: begin,
            length: self.at - begin,
            kind,
        }
    }
}

/// True if `text` begins with `name` (upper case), in any case.
pub(super) fn begins(text: &[u8], name: &str) -> bool {
    text.get(..name.len())
        .is_some_and(|text| text.eq_ignore_ascii_case(name.as_bytes()))
}
