//! Lines too long for the wire: `PO[X]=(..)` terms go out in the wire's own spelling, one line each.
//!
//! In: a line longer than the core takes. Out: lines that mean the same, each with the column of the file's line it
//! stands for, or nothing where the line cannot be parted; the core then refuses it as it is.

use pentaspline::nc::LINE_MAX;

use super::words::skip_blanks;

/// One of the lines that stand for a long one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Piece {
    /// What is sent.
    pub text: Vec<u8>,
    /// Character of the long line, from 0, it comes from.
    pub column: usize,
}

/// Parts `line`: `POLY PO[X]=(1,2,3) PL=2` is sent as `POX Q2 Q3` and `POLY X1 PL=2`.
///
/// Only plain numbers are moved; `None` if there are no such terms, or if a line would still be too long.
#[must_use]
pub fn split(line: &[u8]) -> Option<Vec<Piece>> {
    let code = line.to_ascii_uppercase();
    let mut pieces = Vec::new();
    let mut last = Vec::new();
    let mut at = 0;
    while at < code.len() {
        match code[at] {
            // The comment is not what the line is for.
            b';' => break,
            b'P' if code[at..].starts_with(b"PO[") => {
                let term = Term::read(&code, at)?;
                // Also without coefficients: a coordinate of its own would be linear beside a denominator.
                pieces.push(Piece {
                    text: term.preparation(),
                    column: at,
                });
                if let Some(axis) = term.axis {
                    last.push(axis);
                    last.extend_from_slice(term.values.first()?);
                }
                at = term.end;
            }
            byte => {
                last.push(byte);
                at += 1;
            }
        }
    }
    let kept = last.trim_ascii_end().len();
    last.truncate(kept);
    if pieces.is_empty() {
        return None;
    }
    pieces.push(Piece {
        text: last,
        column: 0,
    });
    let fits = pieces.iter().all(|piece| piece.text.len() <= LINE_MAX);
    fits.then_some(pieces)
}

/// `PO[X]=(xe,a2,..)` or `PO[]=(e,b2,..)`.
struct Term<'a> {
    /// `None` for the denominator.
    axis: Option<u8>,
    values: Vec<&'a [u8]>,
    /// Behind the closing parenthesis.
    end: usize,
}

impl<'a> Term<'a> {
    fn read(code: &'a [u8], at: usize) -> Option<Self> {
        let mut at = skip_blanks(code, at + b"PO[".len());
        let axis = code.get(at).copied().filter(u8::is_ascii_uppercase);
        at = skip_blanks(code, at + usize::from(axis.is_some()));
        for expected in b"]=(" {
            if code.get(at) != Some(expected) {
                return None;
            }
            at = skip_blanks(code, at + 1);
        }
        let close = at + code.get(at..)?.iter().position(|&b| b == b')')?;
        let values: Vec<&[u8]> = code[at..close]
            .split(|&b| b == b',')
            .map(<[u8]>::trim_ascii)
            .collect();
        let number = |text: &&[u8]| {
            !text.is_empty()
                && text
                    .iter()
                    .all(|b| b.is_ascii_digit() || b"+-.".contains(b))
        };
        values.iter().all(number).then_some(Self {
            axis,
            values,
            end: close + 1,
        })
    }

    /// The preparation line: an axis leaves its end point to the last line, the denominator brings its own.
    fn preparation(&self) -> Vec<u8> {
        let (letter, skip) = self.axis.map_or((b'D', 0), |axis| (axis, 1));
        let mut text = vec![b'P', b'O', letter];
        for value in self.values.iter().skip(skip) {
            text.extend_from_slice(b" Q");
            text.extend_from_slice(value);
        }
        if self.values.len() <= skip {
            text.extend_from_slice(b" Q0");
        }
        text
    }
}
