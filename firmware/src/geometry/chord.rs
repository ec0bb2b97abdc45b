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
fn per_unit(config: &Config, axis: usize) -> f32 {
    let bits = config.axes[axis].steps_per_unit.to_bits();
    if bits as u32 == 0 {
        (bits >> 32) as i32 as f32
    } else {
        bits as f32 * STEP_PER_BIT
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
        *value = bits as f32 * STEP_PER_BIT / per_unit(config, axis);
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

/// True if `at` moved by `by` is a position; the test for inner Bezier points.
pub(super) fn in_range(config: &Config, axis: usize, at: Steps, by: f32) -> bool {
    // Whole steps: the range is hundreds of steps short of what a position can hold.
    let steps = (at.to_bits() >> 32) as i32 as f32 + by * per_unit(config, axis);
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
