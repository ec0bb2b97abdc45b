//! Comparisons and what connects them, for [`super::compare`]. Only the host links this.

use super::{ExpressionError, Fault, Reader, NESTING_MAX};

/// Relative difference of equal numbers in [`compare`], as the 840D has it.
const EQUALITY: f64 = 1.0e-12;
impl Reader<'_> {
    /// `OR` of `XOR` of `AND`.
    pub(super) fn condition(&mut self) -> Result<bool, Fault> {
        if self.depth > NESTING_MAX {
            return Err(Self::fault(self.at, 0, ExpressionError::Nesting));
        }
        self.depth += 1;
        let (mut any, mut odd) = (false, false);
        let (mut all, mut bare) = self.truth()?;
        loop {
            let begin = self.at;
            let kind = [b"AND".as_slice(), b"XOR", b"OR"]
                .into_iter()
                .position(|word| self.take(word));
            let Some(kind) = kind else {
                break;
            };
            let (right, right_bare) = self.truth()?;
            bare |= right_bare;
            if bare {
                let length = if kind == 2 { 2 } else { 3 };
                return Err(Self::fault(begin, length, ExpressionError::BareComparison));
            }
            match kind {
                0 => all &= right,
                1 => {
                    odd ^= all;
                    all = right;
                }
                _ => {
                    any |= odd ^ all;
                    odd = false;
                    all = right;
                }
            }
        }
        self.depth -= 1;
        Ok(any | (odd ^ all))
    }

    /// One condition, and whether it is a comparison without parentheses.
    fn truth(&mut self) -> Result<(bool, bool), Fault> {
        let (begin, depth) = (self.at, self.depth);
        if self.take(b"NOT") {
            return match self.truth()? {
                (value, false) => Ok((!value, false)),
                _ => Err(Self::fault(begin, 3, ExpressionError::BareComparison)),
            };
        }
        // A parenthesis may hold a condition or the beginning of a sum.
        let comparison = match self.comparison() {
            Err(fault) if self.text.get(begin) == Some(&b'(') => fault,
            result => return result.map(|value| (value, true)),
        };
        (self.at, self.depth) = (begin, depth);
        self.take(b"(");
        let value = self.condition();
        match value {
            Ok(value) if self.take(b")") => Ok((value, false)),
            // of two readings, the one that came further is the one that was meant
            Err(fault) if fault.at > comparison.at => Err(fault),
            _ => Err(comparison),
        }
    }

    fn comparison(&mut self) -> Result<bool, Fault> {
        let left = self.sum()?;
        let tokens = [b"==".as_slice(), b"<>", b"<=", b">=", b"<", b">"];
        let Some(kind) = tokens.into_iter().position(|token| self.take(token)) else {
            return Err(Self::fault(self.at, 0, ExpressionError::ComparisonExpected));
        };
        let right = self.sum()?;
        let equal = (left - right).abs() <= EQUALITY * left.abs().max(right.abs());
        Ok(match kind {
            0 => equal,
            1 => !equal,
            2 => equal || left < right,
            3 => equal || left > right,
            4 => !equal && left < right,
            _ => !equal && left > right,
        })
    }
}
