//! `POLY` blocks: a polynomial per axis over one common denominator.
//!
//! In: a [`crate::nc::command::Polynomial`], where the path stands and where the block ends. Out: the curve as an offset
//! from its start over t = p / PL in [0, 1], or, for a cubic without denominator, its two slopes.
//!
//! With `A_k = a_k PL^k`, `B_k = b_k PL^k` (shared facts 6), `A_1` and `B_1` from the values at the end,
//!
//! ```text
//! P(t) = (a0 + A_1 t + .. + A_5 t^5) / D(t),   D(t) = 1 + B_1 t + .. + B_5 t^5
//! P(t) - a0 = ((A_1 - a0 B_1) t + .. + (A_5 - a0 B_5) t^5) / D(t)
//! ```
//!
//! The numerator ends on the end point times the denominator there. a0 counts from the origin the coefficients were
//! written for, here that of the machine: whoever moves the origin of a program by o adds `o b_k` to its `a_k`, k = 2..5.
//! An axis without a numerator goes linearly in t (shared facts 6), whatever the denominator is.

use super::error::GeometryErrorKind;
use super::fit::{displacement, Curve, Sample};
use crate::config::Config;
use crate::nc::command::Polynomial;
use crate::units::{AxisVec, Position, Steps, AXES};

/// Least value of a denominator.
const DENOMINATOR_MIN: f64 = 1.0e-6;

/// Steps after which a denominator counts as too close to zero.
const STEPS_MAX: u16 = 4096;

/// A rational curve of degree five on [0, 1].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Fraction {
    /// Numerator of the offset, coefficients of t to t^5.
    over: [[f64; 5]; AXES],
    /// Denominator less one, the same way.
    under: [f64; 5],
    /// One bit per axis that is divided by the denominator.
    rational: u8,
}

/// `(k1 t + .. + k5 t^5, its derivative)`.
fn horner(k: &[f64; 5], t: f64) -> (f64, f64) {
    let (mut value, mut slope) = (0.0, 0.0);
    for k in k.iter().rev() {
        slope = slope * t + value;
        value = value * t + k;
    }
    (value * t, slope * t + value)
}

/// Coefficients of t to t^5 from those of p^2 to p^5 and the difference between the ends.
fn scaled(k: &[f64; 4], length: f64, difference: f64) -> [f64; 5] {
    let mut out = [difference, 0.0, 0.0, 0.0, 0.0];
    let mut power = length;
    for (index, k) in k.iter().enumerate() {
        power *= length;
        // A zero stays zero even where the power is infinite.
        let value = if *k == 0.0 { 0.0 } else { k * power };
        out[index + 1] = value;
        out[0] -= value;
    }
    out
}

impl Fraction {
    /// The curve of a block.
    ///
    /// # Errors
    /// `KnotInterval` for `PL`, `Denominator`, `NotFinite`, `OutOfRange`.
    pub fn new(
        config: &Config,
        start: &Position,
        end: &Position,
        block: &Polynomial,
    ) -> Result<Self, GeometryErrorKind> {
        let length = block.length;
        if !(length > 0.0 && length.is_finite()) {
            return Err(GeometryErrorKind::KnotInterval);
        }
        let [at_end, higher @ ..] = &block.denominator;
        let under = scaled(higher, length, at_end - 1.0);
        if !stays_positive(&under) {
            return Err(GeometryErrorKind::Denominator);
        }
        let by = displacement(config, start, end)?;
        let origin = displacement(config, &[Steps::ZERO; AXES], start)?;
        let mut curve = Self {
            over: [[0.0; 5]; AXES],
            under,
            rational: block.numerators,
        };
        for axis in 0..AXES {
            if !curve.is_rational(axis) {
                curve.over[axis][0] = by[axis];
                continue;
            }
            let coefficients = &block.coefficients[axis];
            // A_1 = end D(1) - a0 - .., hence the difference of the relative numerator is (end - a0) D(1).
            let mut over = scaled(coefficients, length, by[axis] * at_end);
            for (index, under) in under.iter().enumerate().skip(1) {
                let part = origin[axis] * under;
                over[index] -= part;
                over[0] += part;
            }
            if !over.iter().all(|value| value.is_finite()) {
                return Err(GeometryErrorKind::NotFinite);
            }
            curve.over[axis] = over;
        }
        Ok(curve)
    }

    fn is_rational(&self, axis: usize) -> bool {
        self.rational & (1 << axis) != 0
    }

    /// True only if the whole curve stays `margin` inside `room` (see [`super::travel::TravelBounds::room`]).
    ///
    /// A quick bound: on [0, 1] a polynomial lies between the sums of its negative and of its positive coefficients.
    pub fn is_within(&self, [low, high]: &[[f64; AXES]; 2], margin: f64) -> bool {
        let sums = |k: &[f64; 5]| {
            k.iter().fold([0.0, 0.0], |[down, up], k| {
                [down + k.min(0.0), up + k.max(0.0)]
            })
        };
        let least = 1.0 + sums(&self.under)[0];
        (0..AXES).all(|axis| {
            let [down, up] = sums(&self.over[axis]);
            let divisor = if self.is_rational(axis) { least } else { 1.0 };
            let moves = down != 0.0 || up != 0.0;
            !moves
                || divisor > 0.0
                    && down >= (low[axis] + margin) * divisor
                    && up <= (high[axis] - margin) * divisor
        })
    }

    /// Slopes at the start and end, if the curve is a cubic.
    pub fn cubic(&self) -> Option<(AxisVec, AxisVec)> {
        let is_cubic = self.under == [0.0; 5]
            && self
                .over
                .iter()
                .all(|over| over[3] == 0.0 && over[4] == 0.0);
        let ends = |t| self.at(t).map(|at| at.slope.map(|value| value as f32));
        ends(0.0).zip(ends(1.0)).filter(|_| is_cubic)
    }

    /// Direction in which the curve leaves its start: that of its first derivative that does not vanish.
    pub fn direction(&self) -> Option<AxisVec> {
        // Derivatives of the quotient and of the numerator differ by lower ones, which vanish.
        (0..5)
            .map(|k| self.over.map(|over| over[k] as f32))
            .find(|direction| direction.iter().any(|value| *value != 0.0))
    }
}

impl Curve for Fraction {
    fn at(&self, t: f64) -> Option<Sample> {
        let (under, under_slope) = horner(&self.under, t);
        let scale = 1.0 / (1.0 + under);
        let mut out = Sample {
            offset: [0.0; AXES],
            slope: [0.0; AXES],
        };
        for axis in 0..AXES {
            let (over, slope) = horner(&self.over[axis], t);
            if !self.is_rational(axis) {
                out.offset[axis] = over;
                out.slope[axis] = slope;
                continue;
            }
            let offset = over * scale;
            out.offset[axis] = offset;
            out.slope[axis] = (slope - offset * under_slope) * scale;
        }
        (scale > 0.0).then_some(out)
    }
}

/// True if 1 + k1 t + .. + k5 t^5 is at least [`DENOMINATOR_MIN`] everywhere on [0, 1].
///
/// From a point where it is D it needs at least D / M to fall to zero, M being a bound of its slope; half of that is a
/// safe step to the next point.
fn stays_positive(k: &[f64; 5]) -> bool {
    let mut steepest = 0.0;
    let mut factor = 0.0;
    for k in k {
        factor += 1.0;
        steepest += factor * k.abs();
    }
    if !steepest.is_finite() {
        return false;
    }
    let mut t = 0.0;
    for _ in 0..STEPS_MAX {
        let value = 1.0 + horner(k, t).0;
        if !(value >= DENOMINATOR_MIN) {
            return false;
        }
        if t >= 1.0 {
            return true;
        }
        t = (t + 0.5 * value / steepest).min(1.0);
    }
    false
}
