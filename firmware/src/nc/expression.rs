//! Arithmetic of the program text: bytes and R parameters come in, a number (or a truth value) goes out.
//!
//! The core evaluates the values of addresses and assignments with [`evaluate`]; the host, which follows `IF` and the
//! jumps, uses the same function and [`compare`], so both always agree. Nothing is changed: not the parameters, and
//! on an error not even the reading place.
//!
//! # The language
//! | words | meaning |
//! |---|---|
//! | `2`, `-.5`, `1.5EX-3`, `1.5E-3` | numbers, exponent with `EX` or `E` |
//! | `R7`, `R[R1+1]` | parameters; a computed index must be whole |
//! | `+ -`, then `* / DIV MOD`, then signs | from loose to tight, left to right; `DIV` is the whole part of the quotient, `a MOD b` is `a - b * (a DIV b)` |
//! | `SIN COS TAN` | of degrees |
//! | `ASIN ACOS ATAN`, `ATAN2(y,x)` | degrees: -90 to 90, 0 to 180, -90 to 90, -180 to 180 |
//! | `SQRT ABS POT ROUND TRUNC LN EXP` | `POT` is the square; `ROUND` goes away from zero at one half |
//! | `== <> < > <= >=` | [`compare`] only; numbers within 1e-12 of each other, relative to the larger, are equal |
//! | `NOT AND XOR OR`, from tight to loose | [`compare`] only, between comparisons in parentheses |
//!
//! Blanks mean nothing. An expression ends before the first byte that cannot continue it: `R2+3X5` ends before `X`.
//! Every operation gives the same bits on host and target. Results that are not finite are refused where they arise.

mod condition;
mod functions;

use super::number::{Decimal, NumberError};
use super::parameters::Parameters;
use crate::catalogue::{dialect, Message};
use core::fmt;
use functions::{apply, Function, FUNCTIONS};

/// Parentheses, brackets and functions that may be open at one time; bounds the stack.
const NESTING_MAX: u8 = 10;

/// Why there is no result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExpressionError {
    /// No number, parameter, function or parenthesis where a value must be.
    ValueExpected,
    /// Signs and points without digits, an exponent that is not whole, or more than 19 digits.
    Number,
    /// A name that is no function.
    UnknownFunction,
    /// A `$` variable.
    SystemVariable,
    /// `(`, `,`, `)` or `]` missing here.
    Punctuation,
    /// A parameter beyond `R99` or below `R0`, or an index that is not whole.
    Parameter,
    /// Division by zero (`/`, `DIV`, `MOD`, `TAN` at 90 degrees).
    DivisionByZero,
    /// A function outside its domain.
    Domain,
    /// A result too large for a number.
    TooLarge,
    /// Too many open parentheses.
    Nesting,
    /// No comparison operator where one must be.
    ComparisonExpected,
    /// `AND`, `OR`, `XOR` or `NOT` beside a comparison without parentheses.
    BareComparison,
}

impl ExpressionError {
    /// Number and text in the catalogue.
    #[must_use]
    pub const fn message(self) -> &'static Message {
        match self {
            Self::ValueExpected => &dialect::VALUE_EXPECTED,
            Self::Number => &dialect::EXPRESSION_NUMBER,
            Self::UnknownFunction => &dialect::UNKNOWN_FUNCTION,
            Self::SystemVariable => &dialect::SYSTEM_VARIABLE,
            Self::Punctuation => &dialect::PUNCTUATION,
            Self::Parameter => &dialect::PARAMETER,
            Self::DivisionByZero => &dialect::DIVISION_BY_ZERO,
            Self::Domain => &dialect::DOMAIN,
            Self::TooLarge => &dialect::TOO_LARGE,
            Self::Nesting => &dialect::NESTING,
            Self::ComparisonExpected => &dialect::COMPARISON_EXPECTED,
            Self::BareComparison => &dialect::BARE_COMPARISON,
        }
    }
}

impl fmt::Display for ExpressionError {
    /// Text of the catalogue; its `{}` stands as it is.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.message().text)
    }
}

impl core::error::Error for ExpressionError {}

/// An error and its place in the text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Byte index where it is.
    pub at: usize,
    /// Bytes it is about; 0 where something is missing.
    pub length: usize,
    /// What it is.
    pub kind: ExpressionError,
}

/// Value of the expression at `*at`; moves `*at` behind it (and behind blanks that follow).
///
/// Angles in degrees. The result is finite.
///
/// # Errors
/// See [`ExpressionError`]; `*at` is then where it was.
pub fn evaluate(text: &[u8], at: &mut usize, parameters: &Parameters) -> Result<f64, Fault> {
    let mut reader = Reader::new(text, *at, parameters);
    let value = reader.sum()?;
    *at = reader.at;
    Ok(value)
}

/// Index of the parameter at `*at`, which stands on its `R`: for the left side of `R1=..` and `R[R2]=..`.
/// Moves `*at` behind it.
///
/// # Errors
/// As [`evaluate`]; [`ExpressionError::ValueExpected`] if no index follows.
pub fn parameter_index(
    text: &[u8],
    at: &mut usize,
    parameters: &Parameters,
) -> Result<usize, Fault> {
    let mut reader = Reader::new(text, *at, parameters);
    let index = reader.index()?;
    *at = reader.at;
    Ok(index)
}

/// Truth of the condition at `*at`; moves `*at` behind it: `R1 < 5`, `(R1==1) AND NOT (R2 >= R3*2)`.
///
/// # Errors
/// See [`ExpressionError`]; `*at` is then where it was.
pub fn compare(text: &[u8], at: &mut usize, parameters: &Parameters) -> Result<bool, Fault> {
    let mut reader = Reader::new(text, *at, parameters);
    let value = reader.condition()?;
    *at = reader.at;
    Ok(value)
}

#[derive(Clone, Copy, PartialEq)]
enum Operator {
    Plus,
    Minus,
    Times,
    Over,
    Div,
    Mod,
}

struct Reader<'a> {
    text: &'a [u8],
    at: usize,
    parameters: &'a Parameters,
    depth: u8,
}

impl<'a> Reader<'a> {
    fn new(text: &'a [u8], at: usize, parameters: &'a Parameters) -> Self {
        let mut reader = Self {
            text,
            at,
            parameters,
            depth: 0,
        };
        reader.skip_blanks();
        reader
    }

    fn rest(&self) -> &'a [u8] {
        self.text.get(self.at..).unwrap_or(&[])
    }

    fn peek(&self) -> Option<u8> {
        self.text.get(self.at).copied()
    }

    fn skip_blanks(&mut self) {
        while let Some(b' ' | b'\t') = self.peek() {
            self.at += 1;
        }
    }

    /// Steps over `token` and the blanks behind it if it is here, whatever its case.
    fn take(&mut self, token: &[u8]) -> bool {
        let here = self.rest().get(..token.len());
        if !here.is_some_and(|here| here.eq_ignore_ascii_case(token)) {
            return false;
        }
        self.at += token.len();
        self.skip_blanks();
        true
    }

    #[cold]
    fn fault(at: usize, length: usize, kind: ExpressionError) -> Fault {
        Fault { at, length, kind }
    }

    fn expect(&mut self, token: &[u8]) -> Result<(), Fault> {
        if self.take(token) {
            Ok(())
        } else {
            Err(Self::fault(self.at, 0, ExpressionError::Punctuation))
        }
    }

    /// Sum of products. The only way into the recursion, so it counts the depth.
    fn sum(&mut self) -> Result<f64, Fault> {
        if self.depth > NESTING_MAX {
            return Err(Self::fault(self.at, 0, ExpressionError::Nesting));
        }
        self.depth += 1;
        let mut total = 0.0;
        let mut product = self.operand()?;
        loop {
            let begin = self.at;
            let Some(operator) = self.operator() else {
                break;
            };
            let length = if matches!(operator, Operator::Div | Operator::Mod) {
                3
            } else {
                1
            };
            let right = self.operand()?;
            match operator {
                Operator::Plus | Operator::Minus => {
                    total = finite(total + product, begin, length)?;
                    product = if operator == Operator::Minus {
                        -right
                    } else {
                        right
                    };
                }
                Operator::Times => product = finite(product * right, begin, length)?,
                _ if right == 0.0 => {
                    return Err(Self::fault(begin, length, ExpressionError::DivisionByZero))
                }
                _ => {
                    let quotient = finite(product / right, begin, length)?;
                    product = match operator {
                        Operator::Over => quotient,
                        Operator::Div => libm::trunc(quotient),
                        _ => finite(product - right * libm::trunc(quotient), begin, length)?,
                    };
                }
            }
        }
        self.depth -= 1;
        finite(total + product, self.at, 0)
    }

    fn operator(&mut self) -> Option<Operator> {
        [
            (b"+".as_slice(), Operator::Plus),
            (b"-", Operator::Minus),
            (b"*", Operator::Times),
            (b"/", Operator::Over),
            (b"DIV", Operator::Div),
            (b"MOD", Operator::Mod),
        ]
        .into_iter()
        .find_map(|(token, operator)| self.take(token).then_some(operator))
    }

    /// A value with its signs.
    fn operand(&mut self) -> Result<f64, Fault> {
        let mut negative = false;
        loop {
            if self.take(b"-") {
                negative = !negative;
            } else if !self.take(b"+") {
                break;
            }
        }
        let value = self.value()?;
        self.skip_blanks();
        Ok(if negative { -value } else { value })
    }

    fn value(&mut self) -> Result<f64, Fault> {
        let begin = self.at;
        let next = self.text.get(begin + 1);
        match self.peek() {
            Some(b'0'..=b'9' | b'.') => self.number(),
            Some(b'(') => {
                self.take(b"(");
                let value = self.sum()?;
                self.expect(b")")?;
                Ok(value)
            }
            Some(b'R' | b'r') if !next.is_some_and(u8::is_ascii_alphabetic) => {
                let index = self.index()?;
                let value = self.parameters.get(index);
                value.ok_or(Self::fault(
                    begin,
                    self.at - begin,
                    ExpressionError::Parameter,
                ))
            }
            Some(b'A'..=b'Z' | b'a'..=b'z') => self.function(),
            Some(b'$') => Err(Self::fault(
                begin,
                1 + named(self.text, begin + 1),
                ExpressionError::SystemVariable,
            )),
            _ => Err(Self::fault(begin, 0, ExpressionError::ValueExpected)),
        }
    }

    fn number(&mut self) -> Result<f64, Fault> {
        let begin = self.at;
        let fail = |end: usize| Self::fault(begin, end - begin, ExpressionError::Number);
        let mut decimal = Decimal::read(self.text, &mut self.at).map_err(|error| {
            let long = begin
                + run(self.text, begin, |byte| {
                    byte.is_ascii_digit() || byte == b'.'
                });
            fail(match error {
                NumberError::NoDigits => begin + 1,
                NumberError::TooLong => long,
            })
        })?;
        let exponent = self.rest().get(..3);
        if let Some([b'E' | b'e', b'X' | b'x', b'0'..=b'9' | b'+' | b'-']) = exponent {
            self.at += 2;
            let power = Decimal::read(self.text, &mut self.at)
                .ok()
                .and_then(Decimal::whole)
                .ok_or_else(|| fail(self.at))?;
            let power = power.clamp(-1000, 1000) as i16;
            decimal.exponent = decimal.exponent.saturating_add(power);
        }
        finite(decimal.to_f64(), begin, self.at - begin)
    }

    /// `R` and its index.
    fn index(&mut self) -> Result<usize, Fault> {
        let begin = self.at;
        let refuse = |end: usize| Self::fault(begin, end - begin, ExpressionError::Parameter);
        if !self.take(b"R") {
            return Err(Self::fault(begin, 0, ExpressionError::ValueExpected));
        }
        let index = if self.take(b"[") {
            let value = self.sum()?;
            self.expect(b"]")?;
            let index = libm::round(value);
            // whole but for the rounding of what it was computed from
            if !(0.0..1.0e6).contains(&index) || libm::fabs(value - index) > 1.0e-9 {
                return Err(refuse(self.at));
            }
            index as usize
        } else {
            let digits = run(self.text, self.at, |byte| byte.is_ascii_digit());
            if digits == 0 {
                return Err(Self::fault(self.at, 0, ExpressionError::ValueExpected));
            }
            let mut index = 0usize;
            for digit in self.rest().iter().take(digits) {
                index = (index * 10 + usize::from(digit.wrapping_sub(b'0'))).min(100_000);
            }
            self.at += digits;
            index
        };
        if index >= super::parameters::PARAMETERS {
            return Err(refuse(self.at));
        }
        Ok(index)
    }

    fn function(&mut self) -> Result<f64, Fault> {
        let begin = self.at;
        let length = named(self.text, begin);
        let word = self.rest().get(..length).unwrap_or(&[]);
        let known = |row: &&(&[u8], Function)| word.eq_ignore_ascii_case(row.0);
        let Some((_, function)) = FUNCTIONS.iter().find(known) else {
            return Err(Self::fault(begin, length, ExpressionError::UnknownFunction));
        };
        self.at += length;
        self.skip_blanks();
        self.expect(b"(")?;
        let first = self.sum()?;
        let mut second = 1.0;
        if let Function::Atan2 = function {
            self.expect(b",")?;
            second = self.sum()?;
        }
        self.expect(b")")?;
        let length = self.at - begin;
        let value =
            apply(*function, first, second).map_err(|kind| Self::fault(begin, length, kind))?;
        finite(value, begin, length)
    }
}

/// Names of the functions.
#[cfg(not(target_os = "none"))]
pub(super) fn function_names() -> impl Iterator<Item = &'static str> {
    FUNCTIONS
        .iter()
        .filter_map(|(name, _)| core::str::from_utf8(name).ok())
}

/// Bytes from `at` on that satisfy `wanted`.
fn run(text: &[u8], at: usize, wanted: fn(u8) -> bool) -> usize {
    let rest = text.get(at..).unwrap_or(&[]);
    rest.iter().take_while(|byte| wanted(**byte)).count()
}

/// Length of the name at `at`.
fn named(text: &[u8], at: usize) -> usize {
    run(text, at, |byte| {
        byte.is_ascii_alphanumeric() || byte == b'_'
    })
}

fn finite(value: f64, at: usize, length: usize) -> Result<f64, Fault> {
    if value.is_finite() {
        Ok(value)
    } else {
        Err(Reader::fault(at, length, ExpressionError::TooLarge))
    }
}
