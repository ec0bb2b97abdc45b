//! Any smooth curve to cubic segments: evaluated in `f64`, halved until each cubic stays within the tolerance.
//!
//! In: a [`Curve`] that starts where the path stands, and the knot it ends on. Out, lazily and in path order: Hermite
//! cubics that share their end slopes' directions, the last of which ends exactly on the programmed point. Used for
//! circles, polynomials above degree three, rational curves and offset curves.
//!
//! `f64` is software on a Cortex-M4 and this is background work: single precision resolves 0.06 um at 1 m, which is the
//! whole tolerance of a circle.

use crate::units::AXES;

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
