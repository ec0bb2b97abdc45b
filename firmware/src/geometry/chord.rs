//! From absolute integer positions to relative `f32` geometry and back: the only place where the two meet.
//!
//! Differences are taken in integers and turned to millimetres (degrees) afterwards, so the resolution of
//! relative geometry does not depend on where in the envelope it lies.

use super::error::GeometryErrorKind;
use crate::config::{AxisKind, Config};
use crate::units::{sqrt, AxisVec, Nano, Position, Steps, AXES};

/// 2^-32: from the bits of [`Steps`] to steps.
const STEP_PER_BIT: f32 = 1.0 / 4_294_967_296.0;

/// Points and curves stay below this many steps: 2^31 less the rounding of `f32` at that size.
const RANGE_STEPS: f32 = 2_147_483_000.0;

/// What a length was measured over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Measure {
    /// Millimetres over the linear axes.
    Linear,
    /// Degrees over the rotary axes, where no linear axis moves.
    Rotary,
}

/// Steps per mm (degree) of an axis, rounded as `to_num` rounds it; whole numbers, the usual case, in one instruction.
#[inline]
pub(super) fn per_unit(config: &Config, axis: usize) -> f32 {
    let bits = config.axes[axis].steps_per_unit.to_bits();
    if bits as u32 == 0 {
        (bits >> 32) as i32 as f32
    } else {
        steps(bits)
    }
}

/// `bits` of [`Steps`] as steps: `bits as f32 * 2^-32`, without a call to the run-time library.
#[inline]
pub(super) fn steps(bits: i64) -> f32 {
    let size = bits.unsigned_abs();
    let (high, low) = ((size >> 32) as u32, size as u32);
    let value = if high == 0 {
        low as f32 * STEP_PER_BIT
    } else {
        // The leading 32 bits. Of those behind them only counts whether they are nothing: the rounding is at bit 8.
        let shift = high.leading_zeros();
        let leading = high << shift | (low >> 1) >> (31 - shift);
        let lost = u32::from(low << shift != 0);
        (leading | lost) as f32 * f32::from_bits((127 - shift) << 23)
    };
    if bits < 0 {
        -value
    } else {
        value
    }
}

/// `to - from`, mm or degree. Exactly zero where the positions are equal.
pub(super) fn delta(
    config: &Config,
    from: &Position,
    to: &Position,
) -> Result<AxisVec, GeometryErrorKind> {
    let mut out = [0.0; AXES];
    for (axis, value) in out.iter_mut().enumerate() {
        let bits = to[axis]
            .checked_sub(from[axis])
            .ok_or(GeometryErrorKind::OutOfRange { axis })?
            .to_bits();
        // Divided, not multiplied by the reciprocal: one rounding less, so round numbers stay round.
        *value = steps(bits) / per_unit(config, axis);
    }
    Ok(out)
}

/// `from` moved by `by` (mm or degree), rounded once to 2^-32 step.
pub(super) fn offset(
    config: &Config,
    from: &Position,
    by: &AxisVec,
) -> Result<Position, GeometryErrorKind> {
    let mut out = *from;
    for (axis, value) in out.iter_mut().enumerate() {
        let steps = by[axis] * per_unit(config, axis);
        if steps.is_nan() {
            return Err(GeometryErrorKind::NotFinite);
        }
        if steps.abs() > RANGE_STEPS {
            return Err(GeometryErrorKind::OutOfRange { axis });
        }
        // A power of two: the product is exact, and in range after the test above.
        let bits = (steps * (1.0 / STEP_PER_BIT)) as i64;
        *value = value
            .checked_add(Steps::from_bits(bits))
            .ok_or(GeometryErrorKind::OutOfRange { axis })?;
    }
    Ok(out)
}

/// True if `at` moved by `by` steps is a position; the test for inner Bezier points.
#[inline]
pub(super) fn in_range(at: Steps, by: f32) -> bool {
    // Whole steps: the range is hundreds of steps short of what a position can hold.
    let steps = (at.to_bits() >> 32) as i32 as f32 + by;
    steps.abs() <= RANGE_STEPS
}

/// Programmed end point to steps.
pub(super) fn position(
    config: &Config,
    target: &[Nano; AXES],
) -> Result<Position, GeometryErrorKind> {
    let mut out = [Steps::ZERO; AXES];
    for (axis, value) in out.iter_mut().enumerate() {
        *value = config
            .steps_from_nano(axis, target[axis])
            .ok_or(GeometryErrorKind::OutOfRange { axis })?;
    }
    Ok(out)
}

/// Length over the linear axes, or over the rotary axes where no linear axis moves; `None` for no motion.
///
/// This is the spline parameter (shared facts 6: chord length).
pub(super) fn measure(config: &Config, by: &AxisVec) -> Option<(Measure, f32)> {
    let mut linear = 0.0;
    let mut rotary = 0.0;
    for (axis, value) in by.iter().enumerate() {
        match config.axes[axis].kind {
            AxisKind::Linear => linear += value * value,
            AxisKind::Rotary => rotary += value * value,
        }
    }
    if linear > 0.0 {
        Some((Measure::Linear, sqrt(linear)))
    } else if rotary > 0.0 {
        Some((Measure::Rotary, sqrt(rotary)))
    } else {
        None
    }
}

/// True if there is a length to [`measure`].
#[inline]
pub(super) fn moves(by: &AxisVec) -> bool {
    by.iter().map(|value| value * value).sum::<f32>() > 0.0
}

/// A chord between two knots: how far, and the slope per unit of length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Chord {
    /// What `length` was measured over.
    pub measure: Measure,
    /// Chord length h, mm (degree); greater than zero.
    pub length: f32,
    /// Slope d = difference / h per axis.
    pub slope: AxisVec,
}

impl Chord {
    /// Chord of a difference; `None` for no motion.
    pub fn new(config: &Config, by: &AxisVec) -> Option<Self> {
        let (measure, length) = measure(config, by)?;
        Some(Self {
            measure,
            length,
            slope: by.map(|value| value / length),
        })
    }
}

/// `f` of every axis of two vectors.
pub(super) fn zip(a: &AxisVec, b: &AxisVec, f: impl Fn(f32, f32) -> f32) -> AxisVec {
    core::array::from_fn(|axis| f(a[axis], b[axis]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// The conversion of the language, rounded to nearest even, and a power of two.
        #[test]
        fn steps_are_the_nearest_single(bits: i64, shift in 0_u32..64, tie in 0_u32..40) {
            let tied = (bits >> shift | 1) << (tie % (shift + 1));
            // half a unit of the last place, and a little more far behind it
            let more = bits & (0xff_ffff << 39) | 1 << 62 | 1 << 38 | 1;
            for bits in [bits, bits >> shift, tied, more, i64::MIN, i64::MAX, 0] {
                let nearest = bits as f32 * STEP_PER_BIT;
                prop_assert_eq!(steps(bits).to_bits(), nearest.to_bits(), "{}", bits);
            }
        }
    }
}
