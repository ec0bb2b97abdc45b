//! The part of a programmed cubic that is looked at: exact ends, and derivatives that its neighbours share.
//!
//! In: a [`HermiteSegment`]. Out: halves and straight pieces of it. The ends of neighbouring pieces are the same
//! integers, and slopes and second derivatives there the same floats but for a power of two.

use crate::config::{AxisKind, Config};
use crate::envelope::{CURVE_MAX, POSITION_MAX};
use crate::units::{sqrt, AxisVec, Steps, AXES};

use super::super::HermiteSegment;
use super::{ArcError, TINY};

/// Units of Q32.32 per step.
const STEP: f32 = 4_294_967_296.0;

/// Conversions of all axes, worked out once per curve.
#[derive(Clone, Copy)]
pub struct Units {
    /// mm or degrees per 2^-32 step.
    pub unit: AxisVec,
    /// 2^-32 steps per mm or degree.
    pub scale: AxisVec,
    /// The axis is rotary.
    pub rotary: [bool; AXES],
}

impl Units {
    /// None yet.
    pub const ZERO: Self = Self {
        unit: [0.0; AXES],
        scale: [0.0; AXES],
        rotary: [false; AXES],
    };

    /// Those of `config`.
    #[must_use]
    pub fn new(config: &Config) -> Self {
        let steps: AxisVec =
            core::array::from_fn(|a| config.axes[a].steps_per_unit.to_num::<f32>());
        Self {
            unit: steps.map(|steps| 1.0 / (steps * STEP)),
            scale: steps.map(|steps| steps * STEP),
            rotary: core::array::from_fn(|a| config.axes[a].kind == AxisKind::Rotary),
        }
    }
}

/// A 64-bit integer as a float, 24 bits of it, the rest cut off. Words and shifts: a conversion of 64 bits is a long call
/// on the target.
#[must_use]
pub fn float(x: i64) -> f32 {
    let magnitude = x.unsigned_abs();
    let shift = 40_u32.saturating_sub(magnitude.leading_zeros());
    // Below 2^24: exact as a float, and so is the power of two.
    let mantissa = (magnitude >> shift) as u32 as f32 * f32::from_bits((127 + shift) << 23);
    if x < 0 {
        -mantissa
    } else {
        mantissa
    }
}

/// A float of magnitude below 2^63 as an integer, cut off towards zero; the twin of [`float`].
#[must_use]
pub fn whole(x: f32) -> i64 {
    let bits = x.to_bits();
    let exponent = (bits >> 23) & 0xff;
    let mantissa = u64::from((bits & 0x7f_ffff) | 0x80_0000);
    let magnitude = if exponent >= 150 {
        // The caller has looked at the range; what is beyond is nothing that moves.
        mantissa.checked_shl(exponent - 150).unwrap_or(0)
    } else {
        mantissa >> (150 - exponent).min(63)
    } as i64;
    if bits >> 31 == 0 {
        magnitude
    } else {
        magnitude.wrapping_neg()
    }
}

/// True for a position that may be driven, Q32.32 steps.
fn in_range(position: i64) -> bool {
    position.unsigned_abs() <= POSITION_MAX as u64
}

/// A point of a curve whose hull is in range: rounding of slopes alone could carry it out.
fn limited(from: i64, by: i64) -> i64 {
    from.saturating_add(by).clamp(-POSITION_MAX, POSITION_MAX)
}

/// A cubic P(u), 0 <= u <= 1.
#[derive(Clone, Copy)]
pub struct Piece {
    /// P(0), Q32.32 steps.
    pub start: [i64; AXES],
    /// P(1).
    pub end: [i64; AXES],
    /// P' at both ends, axis units.
    pub slope: [AxisVec; 2],
    /// P'' at both ends.
    pub bend: [AxisVec; 2],
}

impl Piece {
    /// The whole of `segment`.
    ///
    /// # Errors
    /// [`ArcError::Range`] if a coordinate difference or slope exceeds [`CURVE_MAX`] steps or axis units or is not finite, or
    /// if the hull of the curve exceeds [`POSITION_MAX`].
    pub fn new(units: &Units, segment: &HermiteSegment) -> Result<Self, ArcError> {
        const LIMIT: i64 = CURVE_MAX << 32;
        let mut piece = Self {
            start: segment.start.map(Steps::to_bits),
            end: segment.end.map(Steps::to_bits),
            slope: [segment.slope_start, segment.slope_end],
            bend: [[0.0; AXES]; 2],
        };
        for a in 0..AXES {
            let delta = piece.end[a].checked_sub(piece.start[a]);
            let delta = delta.filter(|delta| delta.unsigned_abs() < LIMIT as u64);
            let delta = float(delta.ok_or(ArcError::Range)?) * units.unit[a];
            let [t0, t1] = [piece.slope[0][a], piece.slope[1][a]];
            // NaN is refused, too.
            let fits =
                |x: f32| x.abs() * units.scale[a] < LIMIT as f32 && x.abs() < CURVE_MAX as f32;
            if !(fits(t0) && fits(t1) && delta.abs() < CURVE_MAX as f32) {
                return Err(ArcError::Range);
            }
            // Bezier points: a slope is three times the way to the next.
            let next =
                |from: i64, t: f32| from.checked_add(whole(t * units.scale[a] * (1.0 / 3.0)));
            let (start, end) = (piece.start[a], piece.end[a]);
            let hull = [Some(start), next(start, t0), next(end, -t1), Some(end)];
            if !hull.iter().all(|point| point.is_some_and(in_range)) {
                return Err(ArcError::Range);
            }
            piece.bend[0][a] = 6.0 * delta - 4.0 * t0 - 2.0 * t1;
            piece.bend[1][a] = 2.0 * t0 + 4.0 * t1 - 6.0 * delta;
        }
        Ok(piece)
    }

    /// End minus start, axis units.
    #[must_use]
    pub fn delta(&self, units: &Units) -> AxisVec {
        core::array::from_fn(|a| float(self.end[a] - self.start[a]) * units.unit[a])
    }

    /// Both halves.
    #[must_use]
    pub fn halves(&self, units: &Units) -> [Self; 2] {
        let mut first = *self;
        let mut second = *self;
        let delta = self.delta(units);
        for a in 0..AXES {
            let (t0, t1) = (self.slope[0][a], self.slope[1][a]);
            let (b0, b1) = (self.bend[0][a], self.bend[1][a]);
            let between = self.start[a] + (self.end[a] - self.start[a]) / 2;
            let middle = limited(between, whole((t0 - t1) * 0.125 * units.scale[a]));
            // dP/du at 1/2 is 3/2 delta - (t0 + t1) / 4; derivatives shrink with the parameter.
            let slope = 0.75 * delta[a] - 0.125 * (t0 + t1);
            let bend = 0.125 * (b0 + b1);
            first.end[a] = middle;
            first.slope[0][a] = 0.5 * t0;
            first.slope[1][a] = slope;
            first.bend[0][a] = 0.25 * b0;
            first.bend[1][a] = bend;
            second.start[a] = middle;
            second.slope[0][a] = slope;
            second.slope[1][a] = 0.5 * t1;
            second.bend[0][a] = bend;
            second.bend[1][a] = 0.25 * b1;
        }
        [first, second]
    }

    /// The curve as one or more straight pieces if it never leaves a line, in path order: up to three, cut where
    /// it turns back on itself.
    pub fn straight_pieces(&self, units: &Units) -> Option<heapless::Vec<Self, 3>> {
        let vectors = [self.delta(units), self.slope[0], self.slope[1]];
        let dot = |x: &AxisVec, y: &AxisVec| x.iter().zip(y).map(|(x, y)| x * y).sum::<f32>();
        let mut along = &vectors[0];
        for v in &vectors[1..] {
            if dot(v, v) > dot(along, along) {
                along = v;
            }
        }
        let size = dot(along, along);
        if !(size > 0.0) {
            return None;
        }
        // Scalar cubic along the line: distance and end slopes in multiples of `along`.
        let [delta, t0, t1] = [0, 1, 2].map(|i| dot(&vectors[i], along) / size);
        // p'(u) = t0 + 2 b u + 3 c u^2
        let (b, c) = (3.0 * delta - 2.0 * t0 - t1, t0 + t1 - 2.0 * delta);
        let root = b * b - 3.0 * c * t0;
        let q = -(b + sqrt(root.max(0.0)).copysign(b));
        let (x, y) = (q / (3.0 * c), t0 / q);
        // Turning points within the rounding of an end are that end.
        let turns =
            [x.min(y), x.max(y)].map(|u| (root > 0.0 && u > 1e-4 && u < 1.0 - 1e-4).then_some(u));
        // How far off counts as straight: a few units of f32 rounding; where the curve turns back, the size below
        // which nothing about its shape is kept anyway.
        let slack = if turns == [None, None] {
            0.0
        } else {
            TINY * TINY
        };
        for (v, share) in vectors.iter().zip([delta, t0, t1]) {
            let off: AxisVec = core::array::from_fn(|a| v[a] - share * along[a]);
            if !(dot(&off, &off) <= slack + 4e-13 * size) {
                return None;
            }
        }
        let mut pieces = heapless::Vec::new();
        let mut rest = *self;
        for u in turns.into_iter().flatten() {
            let far = u * (t0 + u * (b + u * c));
            let mut first = rest;
            for a in 0..AXES {
                first.end[a] = limited(self.start[a], whole(far * along[a] * units.scale[a]));
            }
            rest.start = first.end;
            // Cannot fail: two turning points at most.
            let _ = pieces.push(first.line(units));
        }
        let _ = pieces.push(rest.line(units));
        Some(pieces)
    }

    /// The straight line from start to end.
    fn line(mut self, units: &Units) -> Self {
        let delta = self.delta(units);
        self.slope = [delta; 2];
        self.bend = [[0.0; AXES]; 2];
        self
    }
}
