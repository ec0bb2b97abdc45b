//! Any smooth curve to cubic segments: evaluated in `f64`, halved until each cubic stays within the tolerance.
//!
//! In: a [`Curve`] that starts where the path stands. Out, lazily and in path order: [`Piece`]s, Hermite cubics whose end
//! points and end slopes are the curve's own, so that neighbours share position and tangent. Used for polynomials above
//! degree three, rational curves and offset curves (circles have a closed form, see `circle`). Touches nothing.
//!
//! How to drive a curve:
//!
//! ```text
//! let mut fitter = Fitter::new();                        // 16 bytes; keep it beside the curve and its start position
//! while let Some(piece) = fitter.next(&curve, tolerance)? {
//!     let start = place(config, &origin, &piece.start)?; // the bits on which the last piece ended
//!     let end = if piece.is_last { knot } else { place(config, &origin, &piece.end)? };
//!     // cubic from start to end with piece.slope_start, piece.slope_end
//! }
//! ```
//!
//! `f64` is software on a Cortex-M4 and this is background work: single precision resolves 0.06 um at 1 m, which is the
//! whole tolerance of a circle. One call of [`Fitter::next`] evaluates the curve about ten times.

use super::error::GeometryErrorKind;
use super::quadrature::GAUSS_5;
use crate::config::{AxisKind, Config};
use crate::units::{sqrt, AxisVec, Position, Steps, AXES};

/// A curve over t in [0, 1], relative to its own start.
pub(crate) trait Curve {
    /// Offset from the start and derivative by t, mm or degree per axis.
    ///
    /// Offset is zero at t = 0. `None` where the curve has no value (a denominator that vanishes).
    fn at(&self, t: f64) -> Option<Sample>;
}

/// Value and first derivative of a [`Curve`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sample {
    /// Offset from the start of the curve, mm or degree.
    pub offset: [f64; AXES],
    /// Derivative by t.
    pub slope: [f64; AXES],
}

/// A part of a [`Curve`] as a cubic over its own u in [0, 1], t = t0 + u (t1 - t0).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Piece {
    /// Curve parameter at the start.
    pub t0: f64,
    /// Curve parameter at the end.
    pub t1: f64,
    /// Offset of the piece's start from the start of the curve, mm or degree.
    pub start: [f64; AXES],
    /// Offset of the piece's end from the start of the curve.
    pub end: [f64; AXES],
    /// dP/du at u = 0, mm or degree, rounded as a segment holds it.
    pub slope_start: AxisVec,
    /// dP/du at u = 1.
    pub slope_end: AxisVec,
    /// The curve ends here.
    pub is_last: bool,
}

/// Why a curve has no next piece.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FitError {
    /// Even the smallest step strays from the curve: a pole, a jump, or slopes beyond any machine.
    Steep,
    /// The curve has no finite value or slope.
    NotFinite,
}

impl From<FitError> for GeometryErrorKind {
    fn from(error: FitError) -> Self {
        match error {
            FitError::Steep => Self::Steep,
            FitError::NotFinite => Self::NotFinite,
        }
    }
}

/// Smallest step of t.
const STEP_MIN: f64 = 1.0 / 1_048_576.0;

/// Where in a piece its distance from the curve is taken; the middle first, it refuses most steps that are too long.
///
/// A Hermite cubic misses a smooth curve by `P''''(x)/24 h^4 u^2 (1-u)^2` (at most `P''''/384 h^4`, at u = 1/2). With v
/// = u - 1/2 the error is `(1/4 - v^2)^2 (a + b v + c v^2 + ..)`, each coefficient being one power of h / (distance to
/// the nearest pole) smaller than the one before. Five points determine five coefficients, that is, every error up to
/// that of a polynomial of degree 8; with a and b alone, which rule when a step is accepted, the largest error is at
/// most 1.06 times the largest of the five.
const PROBES: [f64; 5] = [0.5, 0.14, 0.86, 0.32, 0.68];

/// Share of the tolerance the error at [`PROBES`] may use; the rest covers what lies between them.
const SHARE: f64 = 0.7;

/// Cuts one [`Curve`] into [`Piece`]s, front to back. Small and resumable: it holds where it is, not the curve.
///
/// Steps of t are powers of two, so parameters are exact and every joint is evaluated to the same bits from both sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Fitter {
    t: f64,
    step: f64,
}

impl Fitter {
    /// At the start of a curve.
    pub const fn new() -> Self {
        Self { t: 0.0, step: 1.0 }
    }

    /// The next piece, `None` behind the last one.
    ///
    /// Its distance from the curve, point by point at equal t and over all axes at once, is at most `tolerance` (mm,
    /// degree), the rounding of its slopes to `f32` included. Tolerances below 1e-7 of the length of a curve cannot
    /// hold, because of that rounding, and end in [`FitError::Steep`].
    ///
    /// # Errors
    /// [`FitError`]; the fitter stays where it is.
    pub fn next(&mut self, curve: &impl Curve, tolerance: f64) -> Result<Option<Piece>, FitError> {
        let rest = 1.0 - self.t;
        if rest <= 0.0 {
            return Ok(None);
        }
        let start = sample(curve, self.t)?;
        let mut step = self.step;
        // The rest is a sum of powers of two, none below the smallest step: a step that fits divides what remains.
        while step > rest {
            step *= 0.5;
        }
        loop {
            let t1 = self.t + step;
            let end = sample(curve, t1)?;
            let piece = Piece {
                t0: self.t,
                t1,
                start: start.offset,
                end: end.offset,
                slope_start: start.slope.map(|value| (value * step) as f32),
                slope_end: end.slope.map(|value| (value * step) as f32),
                is_last: t1 >= 1.0,
            };
            if fits(curve, &piece, SHARE * tolerance)? {
                self.t = t1;
                self.step = 2.0 * step;
                return Ok(Some(piece));
            }
            step *= 0.5;
            if step < STEP_MIN {
                return Err(FitError::Steep);
            }
        }
    }
}

/// A sample all of whose numbers are finite.
fn sample(curve: &impl Curve, t: f64) -> Result<Sample, FitError> {
    let finite = |v: &[f64; AXES]| v.iter().all(|value| value.is_finite());
    curve
        .at(t)
        .filter(|at| finite(&at.offset) && finite(&at.slope))
        .ok_or(FitError::NotFinite)
}

/// True if the piece is within `tolerance` of the curve at all [`PROBES`].
fn fits(curve: &impl Curve, piece: &Piece, tolerance: f64) -> Result<bool, FitError> {
    for u in PROBES {
        let at = sample(curve, piece.t0 + u * (piece.t1 - piece.t0))?;
        let (v, mut square) = (1.0 - u, 0.0);
        for axis in 0..AXES {
            let by = piece.end[axis] - piece.start[axis];
            let cubic = u * u * (1.0 + 2.0 * v) * by
                + u * v
                    * (v * f64::from(piece.slope_start[axis])
                        - u * f64::from(piece.slope_end[axis]));
            let miss = at.offset[axis] - piece.start[axis] - cubic;
            square += miss * miss;
        }
        // Also refuses NaN: slopes beyond f32 have become infinite.
        if !(square <= tolerance * tolerance) {
            return Ok(false);
        }
    }
    Ok(true)
}

/// The position `by` (mm or degree) away from `origin`, rounded once to 2^-32 step. `origin` itself for zero.
///
/// # Errors
/// `OutOfRange` with the axis; `NotFinite`.
pub(crate) fn place(
    config: &Config,
    origin: &Position,
    by: &[f64; AXES],
) -> Result<Position, GeometryErrorKind> {
    /// Bits per step.
    const BITS: f64 = 4_294_967_296.0;
    let mut out = *origin;
    for (axis, value) in out.iter_mut().enumerate() {
        let bits = by[axis] * config.axes[axis].steps_per_unit.to_num::<f64>() * BITS;
        if bits.is_nan() {
            return Err(GeometryErrorKind::NotFinite);
        }
        // Float to integer truncates and saturates; what saturates is out of range in the addition or at once.
        let bits = (bits + 0.5_f64.copysign(bits)) as i64;
        *value = Some(bits)
            .filter(|bits| *bits != i64::MAX && *bits != i64::MIN)
            .and_then(|bits| value.checked_add(Steps::from_bits(bits)))
            .ok_or(GeometryErrorKind::OutOfRange { axis })?;
    }
    Ok(out)
}

/// `to - from` in mm or degree.
///
/// # Errors
/// `OutOfRange` with the axis.
pub(crate) fn displacement(
    config: &Config,
    from: &Position,
    to: &Position,
) -> Result<[f64; AXES], GeometryErrorKind> {
    let mut out = [0.0; AXES];
    for (axis, value) in out.iter_mut().enumerate() {
        *value = to[axis]
            .checked_sub(from[axis])
            .ok_or(GeometryErrorKind::OutOfRange { axis })?
            .to_num::<f64>()
            / config.axes[axis].steps_per_unit.to_num::<f64>();
    }
    Ok(out)
}

/// Most parts a length is summed over. Next to a slope that vanishes the error falls with their square only.
const PARTS_MAX: u16 = 256;

/// Arc length over the linear axes in mm, or over the rotary axes in degrees where no linear axis moves.
///
/// `slope` is the derivative by u in [0, 1], `None` where there is none. Relative error below 1e-4 for curves that are
/// smooth on 1/256 of their parameter. `None` if the slope is not finite somewhere.
pub(crate) fn length(config: &Config, slope: impl Fn(f32) -> Option<AxisVec>) -> Option<f32> {
    let mut last = f32::INFINITY;
    let mut parts = 1;
    loop {
        let step = 1.0 / f32::from(parts);
        // Millimetres, degrees.
        let mut sums = [0.0_f32; 2];
        for part in 0..parts {
            for (u, weight) in GAUSS_5 {
                let at = slope((f32::from(part) + u) * step)?;
                let mut squares = [0.0_f32; 2];
                for (axis, value) in at.iter().enumerate() {
                    squares[usize::from(config.axes[axis].kind == AxisKind::Rotary)] +=
                        value * value;
                }
                sums[0] += weight * step * sqrt(squares[0]);
                sums[1] += weight * step * sqrt(squares[1]);
            }
        }
        let sum = if sums[0] > 0.0 { sums[0] } else { sums[1] };
        if !sum.is_finite() {
            return None;
        }
        if (sum - last).abs() <= 2e-5 * sum || parts >= PARTS_MAX {
            return Some(sum);
        }
        last = sum;
        parts *= 2;
    }
}

/// [`length`] of a [`Curve`].
pub(crate) fn curve_length(config: &Config, curve: &impl Curve) -> Option<f32> {
    length(config, |u| {
        let at = sample(curve, f64::from(u)).ok()?;
        Some(at.slope.map(|value| value as f32))
    })
}
