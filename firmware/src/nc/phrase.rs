//! Words that are more than a letter or a keyword with a number: assigned values and expressions, labels, jumps,
//! messages, lists. The rarely used half of [`Lexer`]; plain words never come here.

use super::error::Fault;
use super::expression;
use super::lexer::{begins, letter_bit, Lexer, Measure, Word, WordKind, AXIS_LETTERS};
use super::number::Decimal;
use super::parameters::Parameters;
use crate::catalogue::dialect::PUNCTUATION;
use crate::catalogue::nc as message;

/// Coefficients of one axis or denominator in one list.
pub(super) const COEFFICIENTS: usize = 5;

impl<'a> Lexer<'a> {
    /// The address at `begin` whose letter is not one of the frequent ones: `R5`, or `R5=` and its value.
    #[cold]
    pub(super) fn rare(
        &mut self,
        begin: usize,
        letter: u8,
        parameters: &Parameters,
    ) -> Result<Word<'a>, Fault> {
        if letter != b'R' {
            return Err(Fault::new(begin, 1, &message::UNKNOWN_WORD));
        }
        let equals = self.skip_to_value();
        let number = if equals {
            self.assigned(begin, begin + 1, parameters)?
        } else {
            self.number(begin, begin + 1)?
        };
        let end = self.at;
        if equals || !self.skip_to_value() {
            self.at = end;
            return Ok(self.word(begin, WordKind::Address(letter, number)));
        }
        let length = end - begin;
        let index = number
            .index(u32::from(u8::MAX))
            .and_then(|index| u8::try_from(index).ok());
        let Some(index) = index.filter(|index| parameters.get(usize::from(*index)).is_some())
        else {
            return Err(Fault::new(begin, length, &message::OUT_OF_RANGE));
        };
        if self.peek().is_none() {
            return Err(Fault::new(begin, length, &message::MISSING_NUMBER));
        }
        let value = self.expression(parameters)?;
        Ok(self.word(begin, WordKind::Assign(index, value)))
    }

    /// The expression that begins here.
    fn expression(&mut self, parameters: &Parameters) -> Result<f64, Fault> {
        expression::evaluate(self.text, &mut self.at, parameters)
            .map_err(|fault| Fault::new(fault.at, fault.length, fault.kind.message()))
    }

    /// What stands behind `=` of the word from `begin` to `end`: a number, exact as printed, or an expression.
    pub(super) fn assigned(
        &mut self,
        begin: usize,
        end: usize,
        parameters: &Parameters,
    ) -> Result<Decimal, Fault> {
        let start = self.at;
        let rest = self.text.get(start..).unwrap_or(&[]);
        let missing = || Fault::new(begin, end - begin, &message::MISSING_NUMBER);
        match *rest {
            // a lone sign belongs to an operand
            [b'+' | b'-', b' ' | b'(' | b'A'..=b'Z' | b'a'..=b'z', ..] | [b'(', ..] => {}
            [b'0'..=b'9' | b'+' | b'-' | b'.', ..] => {
                let number = self.digits()?;
                let behind = self.at;
                self.skip_blanks();
                let next = self.text.get(self.at..).unwrap_or(&[]);
                let goes_on = matches!(next.first(), Some(b'+' | b'-' | b'*' | b'/'))
                    || ["DIV", "MOD", "EX"].iter().any(|name| begins(next, name));
                if !goes_on {
                    self.at = behind;
                    return Ok(number);
                }
                self.at = start;
            }
            [b'R' | b'r', b'0'..=b'9' | b'[' | b' ', ..] => {}
            [first, second, ..] if first.is_ascii_alphabetic() && second.is_ascii_alphabetic() => {}
            _ => return Err(missing()),
        }
        let value = self.expression(parameters)?;
        Decimal::from_f64(value)
            .ok_or_else(|| Fault::new(begin, end - begin, &message::OUT_OF_RANGE))
    }

    /// The value of address `letter` at `begin` behind its `=`: as [`Lexer::assigned`], or `AC(5)`.
    pub(super) fn assigned_coordinate(
        &mut self,
        begin: usize,
        letter: u8,
        parameters: &Parameters,
    ) -> Result<WordKind<'a>, Fault> {
        match self.measure(letter) {
            Some(measure) => {
                let number = self.measured(begin, parameters)?;
                Ok(WordKind::Measured(letter, number, measure))
            }
            None => self
                .assigned(begin, begin + 1, parameters)
                .map(|number| WordKind::Address(letter, number)),
        }
    }

    /// Steps over `AC`, `IC` or `DC` if it begins here and `letter` can have it.
    fn measure(&mut self, letter: u8) -> Option<Measure> {
        let centre = matches!(letter, b'I' | b'J' | b'K');
        if !centre && AXIS_LETTERS & letter_bit(letter) == 0 {
            return None;
        }
        let rest = self.text.get(self.at..).unwrap_or(&[]);
        let measure = match [rest.first()?, rest.get(1)?].map(u8::to_ascii_uppercase) {
            [b'A', b'C'] => Measure::Absolute,
            [b'I', b'C'] => Measure::Incremental,
            [b'D', b'C'] if !centre => Measure::Direct,
            _ => return None,
        };
        self.at += 2;
        Some(measure)
    }

    /// The number behind `AC` of the word at `begin`: `(expression)`, or a plain number.
    fn measured(&mut self, begin: usize, parameters: &Parameters) -> Result<Decimal, Fault> {
        self.skip_to_value();
        let end = self.at;
        if self.peek() != Some(b'(') {
            return self.number(begin, end);
        }
        // the parentheses are those of an expression
        self.assigned(begin, end, parameters)
    }

    /// The name of a label, and it is used up, if it begins the line here: `NAME:`.
    pub(super) fn label(&mut self, begin: usize) -> Option<&'a [u8]> {
        let before = self.text.get(..begin)?;
        let number = |byte: &u8| matches!(byte, b' ' | b'\t' | b'/' | b'N' | b'n' | b'0'..=b'9');
        if !before.iter().all(number) {
            return None;
        }
        let rest = self.text.get(begin..)?;
        let length = name_length(rest);
        let behind = rest.get(length..)?;
        let blanks = behind
            .iter()
            .take_while(|byte| matches!(byte, b' ' | b'\t'))
            .count();
        if length < 2 || behind.get(blanks) != Some(&b':') {
            return None;
        }
        self.at = begin + length + blanks + 1;
        rest.get(..length)
    }

    /// The word at `begin` that is not in the table of keywords.
    #[cold]
    pub(super) fn phrase(
        &mut self,
        begin: usize,
        parameters: &Parameters,
    ) -> Result<Word<'a>, Fault> {
        let rest = self.text.get(begin..).unwrap_or(&[]);
        let first = rest.first().map_or(0, u8::to_ascii_uppercase);
        if begins(rest, "GOTOF") {
            self.at = begin + 5;
            self.skip_blanks();
            let from = self.at;
            self.at += name_length(self.text.get(from..).unwrap_or(&[]));
            if self.at == from {
                return Err(Fault::new(begin, 5, &message::MISSING_WORDS));
            }
            return Ok(self.word(begin, WordKind::GotoForward(self.since(from))));
        }
        if begins(rest, "MSG") {
            self.at = begin + 3;
            let text = self.message()?;
            return Ok(self.word(begin, WordKind::Message(text)));
        }
        if begins(rest, "SPLINEPATH") {
            self.at = begin + 10;
            return Ok(self.word(begin, WordKind::SplinePath));
        }
        if begins(rest, "PO") {
            if let Some(letter) = self.polynomial(begin + 2) {
                return Ok(self.word(begin, WordKind::Polynomial(letter)));
            }
        }
        self.at = begin + 1;
        if let Some(measure) = self.measure(first) {
            let behind = self.text.get(self.at);
            if matches!(
                behind,
                Some(b'0'..=b'9' | b'+' | b'-' | b'.' | b'(' | b'=' | b' ')
            ) {
                let number = self.measured(begin, parameters)?;
                return Ok(self.word(begin, WordKind::Measured(first, number, measure)));
            }
        }
        self.at = begin + 1;
        if self.bare && AXIS_LETTERS & letter_bit(first) != 0 {
            return Ok(self.word(begin, WordKind::Address(first, Decimal::ZERO)));
        }
        Err(Fault::new(begin, name_length(rest), &message::UNKNOWN_WORD))
    }

    /// The axis letter behind `PO` at `at`, and it is used up: `[X]` or `X`; 0 for the denominator, `[]` or `D`.
    fn polynomial(&mut self, at: usize) -> Option<u8> {
        let rest = self.text.get(at..)?;
        let upper = |byte: u8| byte.to_ascii_uppercase();
        let (letter, length) = match *rest {
            [b'[', b']', ..] => (0, 2),
            [b'[', letter, b']', ..] => (upper(letter), 3),
            [b'D' | b'd', ..] => (0, 1),
            [letter, ..] => (upper(letter), 1),
            [] => return None,
        };
        if letter != 0 && (!letter.is_ascii_alphabetic() || AXIS_LETTERS & letter_bit(letter) == 0)
        {
            return None;
        }
        self.at = at + length;
        Some(letter)
    }

    /// The numbers of a [`WordKind::Polynomial`] word: how many, and whether they stand in a list `=( , )`, which begins
    /// with the value at the end, rather than in `Q` words.
    ///
    /// # Errors
    /// More than [`COEFFICIENTS`] numbers, or something else between them; `begin` is the place of the word.
    pub(super) fn coefficients(
        &mut self,
        begin: usize,
        parameters: &Parameters,
        into: &mut [f64; COEFFICIENTS],
    ) -> Result<(usize, bool), Fault> {
        let named = self.at - begin;
        let list = self.skip_to_value();
        if list {
            self.expect(b'(')?;
        }
        let mut count = 0;
        loop {
            self.skip_blanks();
            let at = self.at;
            if !list {
                if !matches!(self.peek(), Some(b'Q' | b'q')) {
                    break;
                }
                self.at += 1;
            }
            let value = if list {
                self.expression(parameters)?
            } else if self.skip_to_value() {
                self.assigned(at, at + 1, parameters)?.to_f64()
            } else {
                self.number(at, at + 1)?.to_f64()
            };
            match into.get_mut(count) {
                Some(entry) => *entry = value,
                None => return Err(Fault::new(at, 1, &message::UNEXPECTED_WORD)),
            }
            count += 1;
            if list {
                self.skip_blanks();
                if self.peek() != Some(b',') {
                    self.expect(b')')?;
                    break;
                }
                self.at += 1;
            }
        }
        if count == 0 {
            return Err(Fault::new(begin, named, &message::MISSING_NUMBER));
        }
        Ok((count, list))
    }

    /// The beginning of `SPLINEPATH(1,X,Y)`, and it is used up; false for `SPLINEPATH XY`.
    pub(super) fn path_list(&mut self) -> Result<bool, Fault> {
        self.skip_blanks();
        if self.peek() != Some(b'(') {
            return Ok(false);
        }
        self.at += 1;
        self.skip_blanks();
        // only one path can be defined
        self.expect(b'1')?;
        Ok(true)
    }

    /// The next letter of `SPLINEPATH(1,X,Y)` (`list`) or `SPLINEPATH XY`; `None` behind the last.
    ///
    /// # Errors
    /// A list that is not closed; bytes that are neither a letter nor the beginning of the next word.
    pub(super) fn path_axis(&mut self, list: bool) -> Result<Option<u8>, Fault> {
        self.skip_blanks();
        if list {
            if self.peek() != Some(b',') {
                return self.expect(b')').map(|()| None);
            }
            self.at += 1;
            self.skip_blanks();
            return match self.peek().map(|byte| byte.to_ascii_uppercase()) {
                Some(letter @ b'A'..=b'Z') => {
                    self.at += 1;
                    Ok(Some(letter))
                }
                Some(_) => Err(Fault::new(self.at, 1, &message::UNEXPECTED_BYTE)),
                None => Err(Fault::new(self.at, 0, &PUNCTUATION)),
            };
        }
        let Some(letter) = self.peek().map(|byte| byte.to_ascii_uppercase()) else {
            return Ok(None);
        };
        if !letter.is_ascii_alphabetic() {
            return match letter {
                b';' | b'(' => Ok(None),
                _ => Err(Fault::new(self.at, 1, &message::UNEXPECTED_BYTE)),
            };
        }
        // a letter with a number begins the next word
        let number = self.text.get(self.at + 1);
        if AXIS_LETTERS & letter_bit(letter) == 0
            || matches!(number, Some(b'0'..=b'9' | b'+' | b'-' | b'.' | b'='))
        {
            return Ok(None);
        }
        self.at += 1;
        Ok(Some(letter))
    }

    /// The text of `MSG`: `("text")`, `"text"`, `()` or nothing (one sender removes parentheses and what they hold).
    fn message(&mut self) -> Result<&'a [u8], Fault> {
        self.skip_blanks();
        let parenthesis = self.peek() == Some(b'(');
        if parenthesis {
            self.at += 1;
            self.skip_blanks();
        }
        let text = if self.peek() == Some(b'"') {
            self.string()?
        } else {
            &[]
        };
        if parenthesis {
            self.skip_blanks();
            self.expect(b')')?;
        }
        Ok(text)
    }

    /// `"text"` here: the text.
    pub(super) fn string(&mut self) -> Result<&'a [u8], Fault> {
        let open = self.at;
        self.at += 1;
        loop {
            match self.peek() {
                None => return Err(Fault::new(open, 0, &message::UNCLOSED_STRING)),
                Some(b'"') => break,
                Some(b' '..=b'~') => self.at += 1,
                Some(_) => return Err(Fault::new(self.at, 1, &message::UNEXPECTED_BYTE)),
            }
        }
        let text = self.since(open + 1);
        self.at += 1;
        Ok(text)
    }

    /// Steps over `byte`, or an error where it should be.
    fn expect(&mut self, byte: u8) -> Result<(), Fault> {
        match self.peek() {
            Some(found) if found == byte => {
                self.at += 1;
                Ok(())
            }
            Some(_) => Err(Fault::new(self.at, 1, &message::UNEXPECTED_BYTE)),
            None => Err(Fault::new(self.at, 0, &PUNCTUATION)),
        }
    }
}

/// Bytes of the name at the beginning of `text`.
fn name_length(text: &[u8]) -> usize {
    text.iter()
        .take_while(|byte| byte.is_ascii_alphanumeric() || **byte == b'_')
        .count()
}
