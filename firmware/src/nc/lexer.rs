//! One physical line of bytes to words: nothing is copied, every word knows its bytes and its place.
//!
//! Blanks separate nothing and join nothing (two senders remove them): a word ends where its number
//! or its keyword ends, so `ASPLINEX1.5Y2.5` and `BTANETAN` are what they look like. A letter in front
//! of a letter begins a keyword, else it is an address.

use super::error::{Excerpt, Fault, NcErrorKind, EXCERPT};
use super::number::{Decimal, NumberError};
use super::table::{Keyword, KEYWORDS};

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

/// Letters that are addresses of the language: the axis letters of all machines and F G I K M N P S T.
const ADDRESSES: u32 = letter_bits(b"ABCUVWXYZFGIKMNPST");

/// [`NcErrorKind::UnexpectedByte`] as a [`Fault`] wants it.
fn unexpected_byte(text: Excerpt) -> NcErrorKind {
    NcErrorKind::UnexpectedByte(text.as_bytes().first().copied().unwrap_or(0))
}

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
    text: &'a [u8],
    at: usize,
}

impl<'a> Lexer<'a> {
    /// Begins at the start of `text`; a carriage return at its end does not count.
    pub fn new(text: &'a [u8]) -> Result<Self, Fault> {
        let text = text.strip_suffix(b"\r").unwrap_or(text);
        if text.len() > LINE_MAX {
            return Err(Fault::new(LINE_MAX, 0, |_| NcErrorKind::LineTooLong));
        }
        Ok(Self { text, at: 0 })
    }

    #[inline]
    fn peek(&self) -> Option<u8> {
        self.text.get(self.at).copied()
    }

    #[inline]
    fn skip_blanks(&mut self) {
        while let Some(b' ' | b'\t') = self.peek() {
            self.at += 1;
        }
    }

    /// Place of the `%`, and the line is used up, if it is a program header: `%`, `%MPF 150`,
    /// `%_N_NAME_MPF`. To be asked before the first word.
    pub fn header(&mut self) -> Result<Option<usize>, Fault> {
        self.skip_blanks();
        if self.peek() != Some(b'%') {
            return Ok(None);
        }
        let begin = self.at;
        self.at += 1;
        while let Some(byte) = self.peek() {
            match byte {
                b'0'..=b'9' | b'A'..=b'Z' | b'a'..=b'z' | b'_' | b' ' | b'\t' => self.at += 1,
                b';' | b'(' => self.skip_comment(byte)?,
                _ => return Err(Fault::new(self.at, 1, unexpected_byte)),
            }
        }
        Ok(Some(begin))
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
            None => Err(Fault::new(self.at, 0, |_| NcErrorKind::UnclosedComment)),
        }
    }

    /// The next word, `None` at the end of the line.
    ///
    /// # Errors
    /// Bytes that begin no word, unknown words, missing or malformed numbers, open comments and strings.
    #[inline]
    pub fn next_word(&mut self) -> Result<Option<Word<'a>>, Fault> {
        let first = loop {
            match self.peek() {
                None => return Ok(None),
                Some(b' ' | b'\t') => self.at += 1,
                Some(byte) if byte.is_ascii_alphabetic() => break byte,
                Some(byte @ (b';' | b'(')) => self.skip_comment(byte)?,
                Some(_) => return Err(Fault::new(self.at, 1, unexpected_byte)),
            }
        };
        let begin = self.at;
        match self.text.get(begin + 1) {
            Some(b'A'..=b'Z' | b'a'..=b'z' | b'_') => return self.keyword(begin).map(Some),
            _ => self.at += 1,
        }
        let letter = first.to_ascii_uppercase();
        if ADDRESSES & letter_bit(letter) == 0 {
            return Err(Fault::new(begin, 1, NcErrorKind::UnknownWord));
        }
        let kind = match self.text.get(self.at) {
            Some(b'0'..=b'9' | b'-' | b'.') => WordKind::Address(letter, self.digits()?),
            _ => self.spaced_value(begin, letter)?,
        };
        Ok(Some(Word {
            at: begin,
            length: self.at - begin,
            kind,
        }))
    }

    fn since(&self, begin: usize) -> &'a [u8] {
        self.text.get(begin..self.at).unwrap_or(&[])
    }

    /// The value of an address that does not follow at once: behind blanks or `=`, or a name.
    #[cold]
    fn spaced_value(&mut self, begin: usize, letter: u8) -> Result<WordKind<'a>, Fault> {
        let equals = self.skip_to_value();
        if letter == b'T' && self.peek() == Some(b'"') {
            return self.tool_name().map(WordKind::ToolName);
        }
        if equals && letter == b'N' {
            return Err(Fault::new(begin + 1, 1, unexpected_byte));
        }
        self.number(begin, begin + 1)
            .map(|number| WordKind::Address(letter, number))
    }

    /// Steps over blanks and one `=`; true if there was one.
    fn skip_to_value(&mut self) -> bool {
        self.skip_blanks();
        let equals = self.peek() == Some(b'=');
        if equals {
            self.at += 1;
            self.skip_blanks();
        }
        equals
    }

    /// A number, or an error about the word from `begin` to `end` that needs it.
    fn number(&mut self, begin: usize, end: usize) -> Result<Decimal, Fault> {
        match self.peek() {
            Some(b'0'..=b'9' | b'+' | b'-' | b'.') => self.digits(),
            _ => Err(Fault::new(begin, end - begin, NcErrorKind::MissingNumber)),
        }
    }

    /// The number that begins here with a sign, point or digit.
    #[inline]
    fn digits(&mut self) -> Result<Decimal, Fault> {
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
            NumberError::NoDigits => Fault::new(begin, length, NcErrorKind::MalformedNumber),
            NumberError::TooLong => Fault::new(begin, length, NcErrorKind::TooManyDigits),
        }
    }

    /// `"name"` here: the name.
    fn tool_name(&mut self) -> Result<&'a [u8], Fault> {
        let open = self.at;
        self.at += 1;
        loop {
            match self.peek() {
                None => return Err(Fault::new(open, 0, |_| NcErrorKind::UnclosedString)),
                Some(b'"') => break,
                Some(b' '..=b'~') => self.at += 1,
                Some(_) => return Err(Fault::new(self.at, 1, unexpected_byte)),
            }
        }
        let name = self.since(open + 1);
        self.at += 1;
        if name.is_empty() || name.len() > EXCERPT {
            return Err(Fault::new(open, 0, |_| NcErrorKind::ToolName));
        }
        Ok(name)
    }

    /// The keyword at `begin`, which may be glued to the next word.
    #[cold]
    fn keyword(&mut self, begin: usize) -> Result<Word<'a>, Fault> {
        let rest = self.text.get(begin..).unwrap_or(&[]);
        for row in &KEYWORDS {
            let name = row.name.as_bytes();
            if !rest
                .get(..name.len())
                .is_some_and(|text| text.eq_ignore_ascii_case(name))
            {
                continue;
            }
            let end = begin + name.len();
            self.at = end;
            let mut number = Decimal::ZERO;
            if row.takes_number {
                if let Some(b'A'..=b'Z' | b'a'..=b'z' | b'_') = self.peek() {
                    break;
                }
                self.skip_to_value();
                number = self.number(begin, end)?;
            }
            return Ok(Word {
                at: begin,
                length: self.at - begin,
                kind: WordKind::Keyword(row, number),
            });
        }
        let named = |byte: &u8| byte.is_ascii_alphanumeric() || *byte == b'_';
        let length = rest
            .iter()
            .position(|byte| !named(byte))
            .unwrap_or(rest.len());
        Err(Fault::new(begin, length, NcErrorKind::UnknownWord))
    }
}
