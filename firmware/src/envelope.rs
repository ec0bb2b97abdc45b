//! The envelope: how far every number of the fixed point reaches, from the piece of curve to the step edge.
//!
//! In: nothing. Out: constants. Each says who keeps it; `docs/fixed-point.md` lists what follows for every accumulator,
//! and `tests/oracle/fixed_point_proof.py` proves it.

use crate::interpolator::{S_FRAC, T_FRAC};
use crate::stepgen::SLOTS;
use crate::units::PHASE_FRAC;

/// Largest magnitude of a position, Q32.32 steps: 2^31 - 1 steps, so that the count of steps, rounded, fits a word.
///
/// Kept by [`ArcSplitter::push`](crate::geometry::arc::ArcSplitter::push), which refuses a curve whose hull leaves it.
pub const POSITION_MAX: i64 = ((1 << 31) - 1) << 32;

/// Coordinate differences and end slopes of one curve stay below this many steps; also below as many axis units.
///
/// Kept by [`ArcSplitter::push`](crate::geometry::arc::ArcSplitter::push).
pub const CURVE_MAX: i64 = 1 << 28;

/// Most steps an axis moves in one segment, but for what rounding leaves to the last part of a line: less than one.
///
/// Kept by the splitter, which halves curves and cuts lines.
pub const TRAVEL_MAX: i32 = 4000;

/// Shortest segment, Q10.54 path units: 2^-34 of one. The splitter drops what is shorter.
pub const LENGTH_MIN: i64 = 1 << (S_FRAC - 34);

/// Longest segment, Q10.54 path units: just below 256 of them. The splitter cuts at 250.
pub const LENGTH_MAX: i64 = (1 << (S_FRAC + 8)) - 1;

/// Fine coefficients stay below this many units: half of a word, so that no sum of Horner's scheme leaves the word.
///
/// Kept by the splitter, which halves curves.
pub const FINE_MAX: i32 = 1 << 30;

/// Largest number of [`Phase`](crate::units::Phase) units per unit of the fine coefficients.
pub const SCALE_MAX: i32 = 1 << 30;

/// Path velocity stays below this, path units per tick with [`T_FRAC`] fractional bits: two units, which at 5 kHz is
/// 600 m/min.
///
/// Kept by the limits of the axes: no axis moves faster than [`STEPS_MAX`], and machine files whose axes could carry the
/// path faster than this are refused ([`axis_velocity`]).
pub const V_MAX: i128 = 2 << T_FRAC;

/// Path acceleration stays below this, path units per tick^2 with [`T_FRAC`] fractional bits: an eighth of a unit, which
/// is 3 km/s^2 at 5 kHz.
///
/// Kept by the limits of the axes: machine files whose axes could accelerate the path harder are refused
/// ([`axis_acceleration`]).
pub const A_MAX: i128 = 1 << (T_FRAC - 3);

/// Longest piece in which the acceleration is not zero throughout, ticks: 14 minutes at 5 kHz, in which [`A_MAX`] passes
/// [`V_MAX`] a hundred thousand times.
pub const TICKS_MAX: u32 = 1 << 22;

/// Steps of an axis in one tick: half the slots, since a pulse takes two. Machine files with a faster axis are refused.
pub const STEPS_MAX: u16 = SLOTS / 2;

/// Largest distance of two successive phases: beyond it their order may be lost. Far above [`STEPS_MAX`].
pub const SPAN_MAX: i64 = ((1 << 13) - 1) << PHASE_FRAC;

/// The most an axis may move per tick, mm or degree, lest the path leave [`V_MAX`].
///
/// Of the axes that make up the path length, at most five, one carries a fifth of its square at least, and the root of five
/// is below 2.5.
#[must_use]
pub fn axis_velocity() -> f64 {
    (V_MAX >> T_FRAC) as f64 / 2.5
}

/// The most an axis may accelerate per tick^2, mm or degree, lest the path leave [`A_MAX`].
///
/// As for the velocity, and twice that: where the path bends, centripetal acceleration adds as much at most.
#[must_use]
pub fn axis_acceleration() -> f64 {
    1.0 / (1_u32 << (T_FRAC - A_MAX.ilog2())) as f64 / 5.0
}

const _: () = {
    assert!(A_MAX == 1 << A_MAX.ilog2());
    assert!((STEPS_MAX as i64) << PHASE_FRAC < SPAN_MAX);
    assert!(LENGTH_MIN > 0 && LENGTH_MIN < LENGTH_MAX);
};
