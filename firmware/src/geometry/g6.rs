//! System 800 `G6` blocks: printed polynomials to Hermite form.
//!
//! In: K1 (Q28), K2 (Q41), K3 (Q53) per axis and the parameter length I, which runs down to 0 at the printed end
//! point (shared facts 1). With i and P in 1e-6 mm (degree), where the printed formats count in thousandths:
//!
//! ```text
//! P(i) - end = ((K3 i / (1000 2^12) + K2) i / (1000 2^13) + K1) i / 2^28
//! ```
//!
//! Start offset and slopes are evaluated in 128-bit integers with [`GUARD`] more bits, because the terms cancel.
//! A cubic is given by its end points and end slopes; the end point is the printed one, the start is the end of the
//! block before (the printed I has three decimals, so blocks close only within about a micrometre: the curve moves
//! by at most that much).

use super::chord::{delta, position, zip};
use super::error::GeometryErrorKind;
use crate::config::Config;
use crate::nc::command::CubicBlock;
use crate::units::{sqrt, AxisVec, Nano, Position, AXES, NANO_PER_UNIT};

/// Bits kept below the printed formats while multiplying out.
const GUARD: u32 = 16;

/// Largest gap between the end of the block before and P(I), 1e-6 mm (degree): twice what rounding explains.
const GAP: Nano = 2_000;

/// Directions that differ by less than this (radian; 0.1 degree) are one direction rounded twice.
const TANGENT_STEP: f32 = 1.745e-3;

/// P(I) - end in 1e-6 unit, and dP/du at u = 0 and u = 1 in units, for one axis; `None` out of range.
fn evaluate(length: Nano, [k3, k2, k1]: [i64; 3]) -> Option<(Nano, f32, f32)> {
    let i = i128::from(length);
    let widen = |k: i64| i128::from(k) << GUARD;
    let inner = |x: i128, shift: u32| Some(x.checked_mul(i)? / (1000_i128 << shift));
    let cube = inner(widen(k3), 12)?;
    let value = inner(cube.checked_add(widen(k2))?, 13)?.checked_add(widen(k1))?;
    let offset = value.checked_mul(i)? >> (28 + GUARD);
    let slope = inner(
        cube.checked_mul(3)?
            .checked_add(widen(k2).checked_mul(2)?)?,
        13,
    )?;
    let slope = slope.checked_add(widen(k1))?;
    // du = -di / I; from 1e-6 units to units.
    let per_u = |s: i128| {
        let nano = i64::try_from(s.checked_mul(-i)? >> (28 + GUARD - 8)).ok()?;
        Some(nano as f32 / (256.0 * NANO_PER_UNIT as f32))
    };
    Some((
        Nano::try_from(offset).ok()?,
        per_u(slope)?,
        per_u(widen(k1))?,
    ))
}

/// Slopes dP/du at the start and end of a `G6` block that begins at `start`, mm or degree.
///
/// # Errors
/// `G6Length`, `G6Gap`, `OutOfRange`.
pub(super) fn slopes(
    config: &Config,
    start: &Position,
    target: &[Nano; AXES],
    block: &CubicBlock,
) -> Result<(AxisVec, AxisVec), GeometryErrorKind> {
    if block.length <= 0 {
        return Err(GeometryErrorKind::G6Length);
    }
    let mut begins = *target;
    let mut slope_start = [0.0; AXES];
    let mut slope_end = [0.0; AXES];
    for axis in 0..AXES {
        let (offset, at_start, at_end) =
            evaluate(block.length, block.k[axis]).ok_or(GeometryErrorKind::OutOfRange { axis })?;
        begins[axis] = begins[axis]
            .checked_add(offset)
            .ok_or(GeometryErrorKind::OutOfRange { axis })?;
        slope_start[axis] = at_start;
        slope_end[axis] = at_end;
    }
    let gap = delta(config, start, &position(config, &begins)?)?;
    for (axis, miss) in gap.iter().enumerate() {
        // Rounding of both points to steps is far below 1e-6 mm; half of one is allowed for it.
        let nano = miss.abs() * NANO_PER_UNIT as f32;
        if nano > GAP as f32 + 0.5 {
            return Err(GeometryErrorKind::G6Gap {
                axis,
                gap: nano as Nano,
            });
        }
    }
    Ok((slope_start, slope_end))
}

/// Turns a start slope into the direction the path already has, if the two differ by less than 0.1 degree.
///
/// Printed coefficients and I are rounded, so neighbouring blocks of a smooth contour leave a corner of a few
/// hundredths of a degree, at which a planner would have to stop. Angles are taken in the space of all five axes
/// (mm and degrees alike). The slope keeps its length |m|; turning it by an angle a moves the curve by at most
/// a |m| max(u (1-u)^2) = 4/27 a |m|, that is 2.6 um per 10 mm of block at the full 0.1 degree.
pub(super) fn smooth_start(slope: AxisVec, tail: Option<AxisVec>) -> AxisVec {
    let Some(tail) = tail else {
        return slope;
    };
    let norm = |v: &AxisVec| sqrt(v.iter().map(|value| value * value).sum());
    let (own, other) = (norm(&slope), norm(&tail));
    if own.is_normal() && other.is_normal() {
        let scale = own / other;
        let step = norm(&zip(&slope, &tail, |a, b| a - b * scale));
        if step < TANGENT_STEP * own {
            return tail.map(|value| value * scale);
        }
    }
    slope
}
