//! One line of conversational text to the words it has: bytes come in, a [`Line`] goes out. Knows the letters of the
//! axes and nothing of the state of the program.

use crate::catalogue::{dialect, nc};
use crate::config::Config;
use crate::nc::command::{Plane, Side};
use crate::nc::error::{Fault, EXCERPT};
use crate::nc::number::{Decimal, NumberError};
use crate::nc::LINE_MAX;
use crate::units::AXES;

/// What a line is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Statement {
    /// Empty, a comment, `* - structure`, `BLK FORM`.
    Nothing,
    /// `BEGIN PGM name MM`; true for `INCH`.
    Begin(bool),
    /// `END PGM`.
    End,
    /// `L`.
    Line,
    /// `CC`.
    Centre,
    /// `C`.
    Arc,
    /// `CR`.
    Radius,
    /// `SPL`.
    Spline,
    /// Words without a statement: `M` functions, or more words of an `SPL` block.
    Words,
    /// `STOP`.
    Stop,
    /// `TOOL CALL`.
    ToolCall,
}

/// Kinds of words, one bit each: what a statement may have.
mod kinds {
    pub const AXES: u8 = 1;
    pub const FEED: u8 = 2;
    pub const SIDE: u8 = 4;
    pub const RADIUS: u8 = 8;
    pub const DIRECTION: u8 = 16;
    pub const COEFFICIENTS: u8 = 32;
    pub const MISC: u8 = 64;
}

/// `M` functions, one bit each, in acting order.
pub(super) mod misc {
    pub const TOOL_CHANGE: u16 = 1;
    pub const CLOCKWISE: u16 = 2;
    pub const COUNTER_CLOCKWISE: u16 = 4;
    pub const COOLANT_ON: u16 = 8;
    /// All of these act before the motion of their line, the others behind it.
    pub const BEFORE: u16 = TOOL_CHANGE | CLOCKWISE | COUNTER_CLOCKWISE | COOLANT_ON;
    pub const SPINDLE_STOP: u16 = 16;
    pub const COOLANT_OFF: u16 = 32;
    pub const STOP: u16 = 64;
    pub const OPTIONAL_STOP: u16 = 128;
    pub const PROGRAM_END: u16 = 256;
    /// Sets of which a line has at most one.
    pub const GROUPS: [u16; 3] = [
        CLOCKWISE | COUNTER_CLOCKWISE | SPINDLE_STOP,
        COOLANT_ON | COOLANT_OFF,
        STOP | OPTIONAL_STOP | PROGRAM_END,
    ];
}

/// `F`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Feed {
    /// `FMAX`.
    Max,
    /// `F1000`.
    Value(Decimal),
}

/// The tool of a `TOOL CALL`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ToolName<'a> {
    /// `TOOL CALL 5`.
    Number(u32),
    /// `TOOL CALL "FR_4"`.
    Text(&'a [u8]),
}

/// A value and the byte index of its word.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placed<T> {
    pub at: usize,
    pub value: T,
}

/// One line, read.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line<'a> {
    pub statement: Statement,
    /// Byte index of the statement.
    pub at: usize,
    /// One bit per axis with a coordinate.
    pub axes: u8,
    /// One bit per axis with an incremental coordinate.
    pub incremental: u8,
    /// Coordinates as printed.
    pub values: [Decimal; AXES],
    /// Byte index of the first word of each axis: coordinate or coefficient.
    pub places: [usize; AXES],
    pub feed: Option<Placed<Feed>>,
    /// `R0 RL RR`.
    pub side: Option<Placed<Side>>,
    /// `R` of `CR`.
    pub radius: Option<Placed<Decimal>>,
    /// `DR-` is true.
    pub clockwise: Option<bool>,
    /// [`misc`].
    pub misc: u16,
    /// `[K3, K2, K1]` per axis as printed.
    pub coefficients: [[f64; 3]; AXES],
    /// Bit `3 * axis + 3 - n` for a word `Kn`.
    pub given: u16,
    /// First coefficient.
    pub coefficient_at: usize,
    /// Tool of a `TOOL CALL`.
    pub tool: Option<Placed<ToolName<'a>>>,
    /// Tool axis of a `TOOL CALL`: the normal of this plane.
    pub plane: Option<Plane>,
    pub speed: Option<Placed<Decimal>>,
    /// `DL`.
    pub longer: Option<Placed<Decimal>>,
    /// `DR` of a `TOOL CALL`.
    pub larger: Option<Placed<Decimal>>,
}

/// Begin of a line to its statement and the kinds of words it may have. A name that begins another stands behind it.
static STATEMENTS: [(&[u8], Statement, u8); 7] = {
    use kinds::{AXES, COEFFICIENTS, DIRECTION, FEED, MISC, RADIUS, SIDE};
    [
        (b"CC", Statement::Centre, AXES),
        (
            b"CR",
            Statement::Radius,
            AXES | RADIUS | DIRECTION | SIDE | FEED | MISC,
        ),
        (b"C", Statement::Arc, AXES | DIRECTION | SIDE | FEED | MISC),
        (b"L", Statement::Line, AXES | SIDE | FEED | MISC),
        (
            b"SPL",
            Statement::Spline,
            AXES | COEFFICIENTS | SIDE | FEED | MISC,
        ),
        (b"STOP", Statement::Stop, MISC),
        (b"", Statement::Words, COEFFICIENTS | SIDE | FEED | MISC),
    ]
};

/// Statements of the language this reader does not have, where the begin of the name could be taken for another.
static REFUSED: [&[u8]; 9] = [
    b"LBL", b"LP", b"LCT", b"LT", b"LN", b"CP", b"CT", b"CYCL", b"CALL",
];

/// Reads one physical line, without its line end.
///
/// # Errors
/// Everything that is wrong with a word or a pair of words, whatever the state of the program.
pub(super) fn read<'a>(config: &Config, text: &'a [u8]) -> Result<Line<'a>, Fault> {
    let text = text.strip_suffix(b"\r").unwrap_or(text);
    if text.len() > LINE_MAX {
        return Err(Fault::new(LINE_MAX, 0, &nc::LINE_TOO_LONG));
    }
    let end = text.iter().position(|byte| *byte == b';');
    let mut scanner = Scanner {
        text: text.get(..end.unwrap_or(text.len())).unwrap_or(text),
        at: 0,
        config,
    };
    scanner.skip_blanks();
    while let Some(b'0'..=b'9') = scanner.peek() {
        scanner.at += 1;
    }
    scanner.skip_blanks();
    let mut line = Line::new(scanner.at);
    scanner.statement(&mut line)?;
    Ok(line)
}

impl Line<'_> {
    fn new(at: usize) -> Self {
        Self {
            statement: Statement::Nothing,
            at,
            axes: 0,
            incremental: 0,
            values: [Decimal::ZERO; AXES],
            places: [usize::MAX; AXES],
            feed: None,
            side: None,
            radius: None,
            clockwise: None,
            misc: 0,
            coefficients: [[0.0; 3]; AXES],
            given: 0,
            coefficient_at: 0,
            tool: None,
            plane: None,
            speed: None,
            longer: None,
            larger: None,
        }
    }
}

struct Scanner<'a, 'c> {
    text: &'a [u8],
    at: usize,
    config: &'c Config,
}

impl<'a> Scanner<'a, '_> {
    fn rest(&self) -> &'a [u8] {
        self.text.get(self.at..).unwrap_or(&[])
    }

    /// The byte here, upper case.
    fn peek(&self) -> Option<u8> {
        self.text.get(self.at).map(u8::to_ascii_uppercase)
    }

    /// Blanks, and the mark of a line that is continued.
    fn skip_blanks(&mut self) {
        while let Some(b' ' | b'\t' | b'~') = self.peek() {
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

    /// Length of the name here, at least 1.
    fn named(&self) -> usize {
        let part = |byte: &&u8| byte.is_ascii_alphanumeric() || **byte == b'_';
        self.rest().iter().take_while(part).count().max(1)
    }

    fn statement(&mut self, line: &mut Line<'a>) -> Result<(), Fault> {
        if matches!(self.peek(), None | Some(b'*')) || self.take(b"BLK") {
            return Ok(());
        }
        let begin = self.at;
        let unknown = |length| Fault::new(begin, length, &dialect::H_STATEMENT);
        let length = self.named();
        let end = self.take(b"END");
        if end || self.take(b"BEGIN") {
            if !self.take(b"PGM") {
                return Err(unknown(length));
            }
            let inch = self.ends_with(b"INCH");
            line.statement = match end {
                true => Statement::End,
                false if inch || self.ends_with(b"MM") => Statement::Begin(inch),
                false => return Err(Fault::new(begin, 0, &dialect::H_PROGRAM)),
            };
            return Ok(());
        }
        if REFUSED.iter().any(|name| self.take(name)) {
            return Err(unknown(length));
        }
        if self.take(b"TOOL") {
            if !self.take(b"CALL") {
                return Err(unknown(length));
            }
            line.statement = Statement::ToolCall;
            return self.tool_call(line);
        }
        let Some((_, statement, allowed)) = STATEMENTS.iter().find(|row| self.take(row.0)) else {
            return Err(unknown(length));
        };
        let first = self.peek();
        if *statement == Statement::Words && !matches!(first, Some(b'M' | b'K' | b'F' | b'R')) {
            let letter = first.is_some_and(|byte| byte.is_ascii_alphabetic());
            return Err(if letter {
                unknown(length)
            } else {
                Fault::new(begin, 1, &nc::UNEXPECTED_BYTE)
            });
        }
        line.statement = *statement;
        while let Some(first) = self.peek() {
            self.word(line, first, *allowed)?;
            self.skip_blanks();
        }
        Ok(())
    }

    fn ends_with(&self, unit: &[u8]) -> bool {
        let rest = self.rest().trim_ascii_end();
        let tail = rest.len().checked_sub(unit.len());
        tail.and_then(|at| rest.get(at..))
            .is_some_and(|tail| tail.eq_ignore_ascii_case(unit))
    }

    fn word(&mut self, line: &mut Line, first: u8, allowed: u8) -> Result<(), Fault> {
        let begin = self.at;
        let kind = match first {
            b'F' => kinds::FEED,
            b'M' => kinds::MISC,
            b'K' => kinds::COEFFICIENTS,
            b'D' => kinds::DIRECTION,
            b'R' if self.is_radius(allowed) => kinds::RADIUS,
            b'R' => kinds::SIDE,
            _ => kinds::AXES,
        };
        if kind & allowed == 0 {
            return Err(self.misplaced());
        }
        let fresh = match kind {
            kinds::FEED => {
                let value = if self.take(b"FMAX") {
                    Feed::Max
                } else {
                    Feed::Value(self.number(1)?)
                };
                line.feed.replace(Placed { at: begin, value }).is_none()
            }
            kinds::MISC => self.function(line)?,
            kinds::COEFFICIENTS => self.coefficient(line)?,
            kinds::DIRECTION => {
                let clockwise = self.take(b"DR-");
                if !clockwise && !self.take(b"DR+") {
                    return Err(self.unknown());
                }
                line.clockwise.replace(clockwise).is_none()
            }
            kinds::RADIUS => {
                let value = self.number(1)?;
                line.radius.replace(Placed { at: begin, value }).is_none()
            }
            kinds::SIDE => {
                let value = if self.take(b"R0") {
                    Side::On
                } else if self.take(b"RL") {
                    Side::Left
                } else if self.take(b"RR") {
                    Side::Right
                } else {
                    return Err(self.unknown());
                };
                line.side.replace(Placed { at: begin, value }).is_none()
            }
            _ => self.coordinate(line, first)?,
        };
        if fresh {
            Ok(())
        } else {
            let length = self.at - begin;
            Err(Fault::new(begin, length, &nc::REPEATED_WORD))
        }
    }

    /// `R` here is the radius of `CR`: `R5`, `R+5`, `R0.5`, but not `R0`, `RL`, `RR`.
    fn is_radius(&self, allowed: u8) -> bool {
        let next = |by: usize| self.text.get(self.at + by).copied();
        match next(1) {
            _ if allowed & kinds::RADIUS == 0 => false,
            Some(b'0') => matches!(next(2), Some(b'0'..=b'9' | b'.')),
            Some(b'L' | b'l' | b'R' | b'r') => false,
            _ => true,
        }
    }

    /// Index of the axis whose letter stands `by` bytes further.
    fn axis(&self, by: usize) -> Option<usize> {
        let letter = self.text.get(self.at + by)?.to_ascii_uppercase();
        self.config
            .axes
            .iter()
            .position(|axis| axis.letter == letter)
    }

    fn coordinate(&mut self, line: &mut Line, first: u8) -> Result<bool, Fault> {
        let begin = self.at;
        let incremental = first == b'I';
        let length = 1 + usize::from(incremental);
        let Some(axis) = self.axis(length - 1) else {
            let letters = matches!(first, b'I' | b'U'..=b'Z' | b'A'..=b'C');
            return Err(if letters {
                Fault::new(begin, length, &nc::AXIS_NOT_CONFIGURED)
            } else {
                self.unknown()
            });
        };
        let value = self.number(length)?;
        let bit = 1 << axis;
        let fresh = line.axes & bit == 0;
        line.axes |= bit;
        if incremental {
            line.incremental |= bit;
        }
        if let (Some(entry), Some(place)) = (line.values.get_mut(axis), line.places.get_mut(axis)) {
            *entry = value;
            *place = begin;
        }
        Ok(fresh)
    }

    /// `K3X-1.5E-2`.
    fn coefficient(&mut self, line: &mut Line) -> Result<bool, Fault> {
        let begin = self.at;
        let power = match self.text.get(begin + 1) {
            Some(b'3') => 0,
            Some(b'2') => 1,
            Some(b'1') => 2,
            _ => return Err(self.unknown()),
        };
        let Some(axis) = self.axis(2) else {
            return Err(Fault::new(begin, 3, &dialect::H_COEFFICIENT));
        };
        let value = self.number(3)?;
        if line.given == 0 {
            line.coefficient_at = begin;
        }
        let bit = 1 << (3 * axis + power);
        let fresh = line.given & bit == 0;
        line.given |= bit;
        let entry = line
            .coefficients
            .get_mut(axis)
            .and_then(|k| k.get_mut(power));
        if let (Some(entry), Some(place)) = (entry, line.places.get_mut(axis)) {
            *entry = value.to_f64();
            *place = begin.min(*place);
        }
        Ok(fresh)
    }

    fn function(&mut self, line: &mut Line) -> Result<bool, Fault> {
        let begin = self.at;
        let number = self.number(1)?.index(99);
        let bits = match number {
            Some(0) => misc::STOP,
            Some(1) => misc::OPTIONAL_STOP,
            Some(2 | 30) => misc::PROGRAM_END,
            Some(3) => misc::CLOCKWISE,
            Some(4) => misc::COUNTER_CLOCKWISE,
            Some(5) => misc::SPINDLE_STOP,
            Some(6) => misc::TOOL_CHANGE,
            Some(8) => misc::COOLANT_ON,
            Some(9) => misc::COOLANT_OFF,
            Some(13) => misc::CLOCKWISE | misc::COOLANT_ON,
            Some(14) => misc::COUNTER_CLOCKWISE | misc::COOLANT_ON,
            _ => return Err(Fault::new(begin, self.at - begin, &nc::M_NOT_AVAILABLE)),
        };
        let clash = |group: &u16| group & line.misc != 0 && group & bits != 0;
        if bits & line.misc == 0 && misc::GROUPS.iter().any(clash) {
            return Err(Fault::new(begin, self.at - begin, &nc::SAME_GROUP));
        }
        let fresh = bits & line.misc == 0;
        line.misc |= bits;
        Ok(fresh)
    }

    fn tool_call(&mut self, line: &mut Line<'a>) -> Result<(), Fault> {
        while let Some(first) = self.peek() {
            let begin = self.at;
            let fresh = match first {
                b'0'..=b'9' => {
                    let number = self.number(0)?;
                    let value = number
                        .index(99_999_999)
                        .ok_or_else(|| Fault::new(begin, self.at - begin, &nc::NOT_WHOLE))?;
                    let value = ToolName::Number(value);
                    line.tool.replace(Placed { at: begin, value }).is_none()
                }
                b'"' => {
                    let rest = self.text.get(begin + 1..).unwrap_or(&[]);
                    let close = rest
                        .iter()
                        .position(|byte| *byte == b'"')
                        .ok_or_else(|| Fault::new(begin, 0, &nc::UNCLOSED_STRING))?;
                    self.at = begin + close + 2;
                    if !(1..=EXCERPT).contains(&close) {
                        return Err(Fault::new(begin, 0, &nc::TOOL_NAME));
                    }
                    let value = ToolName::Text(rest.get(..close).unwrap_or(&[]));
                    line.tool.replace(Placed { at: begin, value }).is_none()
                }
                b'X' | b'Y' | b'Z' => {
                    self.at += 1;
                    let plane = match first {
                        b'X' => Plane::Yz,
                        b'Y' => Plane::Zx,
                        _ => Plane::Xy,
                    };
                    line.plane.replace(plane).is_none()
                }
                b'S' => {
                    let value = self.number(1)?;
                    line.speed.replace(Placed { at: begin, value }).is_none()
                }
                b'F' => {
                    let value = Feed::Value(self.number(1)?);
                    line.feed.replace(Placed { at: begin, value }).is_none()
                }
                _ => {
                    let longer = self.take(b"DL");
                    if !longer && !self.take(b"DR") {
                        return Err(Fault::new(begin, self.named(), &dialect::H_TOOL_CALL));
                    }
                    let value = self.number(0)?;
                    let entry = if longer {
                        &mut line.longer
                    } else {
                        &mut line.larger
                    };
                    entry.replace(Placed { at: begin, value }).is_none()
                }
            };
            if !fresh {
                return Err(Fault::new(begin, self.at - begin, &nc::REPEATED_WORD));
            }
            self.skip_blanks();
        }
        Ok(())
    }

    /// The number of the word here, whose letters take `length` bytes.
    fn number(&mut self, length: usize) -> Result<Decimal, Fault> {
        let begin = self.at;
        self.at = begin + length;
        self.skip_blanks();
        if !matches!(self.peek(), Some(b'0'..=b'9' | b'+' | b'-' | b'.')) {
            self.at = begin;
            return Err(Fault::new(begin, length, &nc::MISSING_NUMBER));
        }
        let at = self.at;
        Decimal::read(self.text, &mut self.at).map_err(|error| {
            let part = |byte: &&u8| matches!(**byte, b'0'..=b'9' | b'+' | b'-' | b'.');
            let length = self.rest().iter().take_while(part).count();
            match error {
                NumberError::NoDigits => Fault::new(at, length, &nc::MALFORMED_NUMBER),
                NumberError::TooLong => Fault::new(at, length, &nc::TOO_MANY_DIGITS),
            }
        })
    }

    /// A word of the language where it means nothing, or no word of the language.
    #[cold]
    fn misplaced(&self) -> Fault {
        if self.peek().is_some_and(|byte| byte.is_ascii_alphabetic()) {
            Fault::new(self.at, self.named(), &nc::UNEXPECTED_WORD)
        } else {
            Fault::new(self.at, 1, &nc::UNEXPECTED_BYTE)
        }
    }

    #[cold]
    fn unknown(&self) -> Fault {
        if self.peek().is_some_and(|byte| byte.is_ascii_alphabetic()) {
            Fault::new(self.at, self.named(), &nc::UNKNOWN_WORD)
        } else {
            Fault::new(self.at, 1, &nc::UNEXPECTED_BYTE)
        }
    }
}
