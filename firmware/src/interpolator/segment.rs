//! What the servo interrupt evaluates: per axis one quintic over the arc length of a segment.
//!
//! In: a [`ServoSegment`] and the way left to its end. Out: a [`Phase`] per axis. Additions, 32-bit products and
//! shifts only; the work does not depend on the data.
//!
//! The variable is t = (way left) / L - 1/2, from 1/2 at the start to -1/2 at the end: about the middle, powers of t and
//! with them rounding stay small. The linear term is exact to the last bit of a phase, since it carries nearly all of
//! the motion and third differences of positions are held against jerk limits. The rest is small and has 32 bits; how many
//! of them are behind the point is up to the jerk limit of the axis ([`fine_bits`]).

use super::motion::Wide;
use super::{widen, S_FRAC, T_FRAC};
use crate::config::Config;
use crate::envelope::{LENGTH_MAX, LENGTH_MIN, SCALE_MAX};
use crate::units::{Phase, AXES, PHASE_FRAC};

/// Fractional bits of [`AxisCurve::slope`].
pub const SLOPE_FRAC: u32 = PHASE_FRAC - 31;

/// Coefficients of one axis: position = base + slope t + sum of `fine[k] t^(k+1)`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AxisCurve {
    /// Position at t = 0, chosen so that the position at the end of the segment is exact.
    pub base: Phase,
    /// Most of the linear coefficient, Q12.19 steps: [`TRAVEL_MAX`](crate::envelope::TRAVEL_MAX) of +-4096.
    pub slope: i32,
    /// What is left of the linear coefficient, and the others; steps with [`fine_bits`] fractional bits, below
    /// [`FINE_MAX`](crate::envelope::FINE_MAX) units.
    pub fine: [i32; 5],
}

impl AxisCurve {
    /// Position at `place`; `scale` is that of the axis ([`fine_scale`]).
    ///
    /// Wraps as a phase does. Rounding: below the last bit of a phase for the slope; of the rest, two units of `fine` at most
    /// for what products lose, and as much for the bits of t that [`Place::fine`] does not hold.
    #[inline(always)]
    #[must_use]
    pub fn at(&self, place: &Place, scale: i32) -> Phase {
        let t = place.fine;
        let [c1, c2, c3, c4, c5] = self.fine;
        let sum = c1 + high(c2 + high(c3 + high(c4 + high(c5, t), t), t), t);
        self.with(place, sum, scale)
    }

    /// [`Self::at`] of an axis that [`Self::is_straight`], the same bits.
    #[inline(always)]
    #[must_use]
    pub fn at_straight(&self, place: &Place, scale: i32) -> Phase {
        self.with(place, self.fine[0], scale)
    }

    /// Nothing but the linear term.
    #[must_use]
    pub fn is_straight(&self) -> bool {
        let [_, higher @ ..] = self.fine;
        higher == [0; 4]
    }

    /// The linear term, and `sum` times t.
    #[inline(always)]
    fn with(&self, place: &Place, sum: i32, scale: i32) -> Phase {
        let slope = i64::from(self.slope);
        self.base
            .wrapping_add(slope * i64::from(place.high))
            .wrapping_add(i64::from(high(self.slope, place.low)))
            .wrapping_add(i64::from(high(sum, place.fine)) * i64::from(scale))
    }
}

/// Upper word of a product, rounded down: one instruction on the target, with the addition of another word too.
#[inline(always)]
fn high(a: i32, b: i32) -> i32 {
    ((i64::from(a) * i64::from(b)) >> 32) as i32
}

/// t in the forms the terms want.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// t rounded down, Q0.31.
    pub high: i32,
    /// The next 32 bits of t, half a unit of `high` subtracted so that they have a sign.
    pub low: i32,
    /// t rounded down, Q0.32.
    pub fine: i32,
}

impl Place {
    /// The end of a segment.
    pub const END: Self = Self {
        high: -(1 << 30),
        low: i32::MIN,
        fine: i32::MIN,
    };
}

/// One segment of the path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ServoSegment {
    /// Text line.
    pub block: u32,
    /// Left shift after which the way left fills 64 bits above the lowest word of [`Wide`].
    shift: u8,
    /// Arc length L, path units in Q10.54.
    pub length: i64,
    /// 2^127 / (L << leading zeros), rounded down to less.
    inverse: u64,
    /// Every axis [`AxisCurve::is_straight`].
    straight: bool,
    /// Coefficients.
    pub axes: [AxisCurve; AXES],
}

impl ServoSegment {
    /// A segment of `length` (Q10.54), from [`LENGTH_MIN`] to [`LENGTH_MAX`]; what is beyond is brought there.
    #[must_use]
    pub fn new(block: u32, length: i64, axes: [AxisCurve; AXES]) -> Self {
        let length = length.clamp(LENGTH_MIN, LENGTH_MAX);
        let zeros = length.leading_zeros();
        Self {
            block,
            // A length has 64 - zeros bits of its own and T_FRAC - S_FRAC below; a wide number has 96.
            shift: (32 - (T_FRAC - S_FRAC) + zeros) as u8,
            length,
            inverse: reciprocal((length as u64) << zeros),
            straight: axes.iter().all(AxisCurve::is_straight),
            axes,
        }
    }

    /// A line: [`AxisCurve::at_straight`] serves all axes.
    #[inline(always)]
    #[must_use]
    pub const fn is_straight(&self) -> bool {
        self.straight
    }

    /// Where the way `left` (0 to L) is.
    #[inline(always)]
    #[must_use]
    pub fn place(&self, left: Wide) -> Place {
        let words = left.words();
        let shift = u32::from(self.shift);
        let (upper, lower) = if shift < 32 {
            aligned(words, shift)
        } else {
            aligned_tiny(words, shift)
        };
        let (upper, lower) = (u64::from(upper), u64::from(lower));
        let (inverse_upper, inverse_lower) = (self.inverse >> 32, u64::from(self.inverse as u32));
        // Without the product of the lower halves: at most three units of 2^-63 too little, so always below one.
        let share = upper * inverse_upper
            + ((upper * inverse_lower) >> 32)
            + ((lower * inverse_upper) >> 32);
        let high = ((share >> 32) as u32).wrapping_sub(1 << 30) as i32;
        Place {
            high,
            low: (share as u32 ^ (1 << 31)) as i32,
            fine: high << 1,
        }
    }

    /// Position of the start: the end of the segment before, but for rounding; `scale` per axis ([`fine_scale`]).
    #[must_use]
    pub fn start(&self, scale: &[i32; AXES]) -> [Phase; AXES] {
        let place = self.place(Wide::new(widen(self.length)));
        core::array::from_fn(|a| self.axes[a].at(&place, scale[a]))
    }

    /// Position of the end, exact; `scale` per axis ([`fine_scale`]).
    #[must_use]
    pub fn end(&self, scale: &[i32; AXES]) -> [Phase; AXES] {
        core::array::from_fn(|a| self.axes[a].at(&Place::END, scale[a]))
    }
}

/// The upper 64 of 96 bits shifted left by less than 32.
#[inline(always)]
fn aligned([low, mid, top]: [u32; 3], shift: u32) -> (u32, u32) {
    let join = |upper: u32, lower: u32| (upper << shift) | ((lower >> 1) >> (31 - shift));
    (join(top, mid), join(mid, low))
}

/// The same for a shift of 32 and more, that is for segments of a few micrometres: a call, so that the others do not select.
#[cold]
#[inline(never)]
fn aligned_tiny([low, mid, _]: [u32; 3], shift: u32) -> (u32, u32) {
    aligned([0, low, mid], shift & 31)
}

/// 2^127 / `x` for `x` with its top bit set: less than that by a few units, never more, never all of it.
///
/// Newton's method from a 16-bit quotient; every step squares the error, and all of them stay below.
fn reciprocal(x: u64) -> u64 {
    let high = |a: u64, b: u64| ((u128::from(a) * u128::from(b)) >> 64) as u64;
    let mut r = u64::from(u32::MAX / ((x >> 48) as u32 + 1)) << 47;
    for _ in 0..3 {
        // 2^63 - r x / 2^64: what is missing, two units of rounding less.
        let missing = (1_u64 << 63).saturating_sub(high(r, x)).saturating_sub(2);
        r = r.saturating_add(2 * high(r, missing));
    }
    r
}

/// Fractional bits of the fine coefficients of `axis`: rounding of a position must not show in third differences.
///
/// A unit is at most 2^-10 of the axis' jerk limit per tick^3. Coefficients of +-2^31 units then allow a quadratic
/// term that takes longer than 50 ticks at most accelerations a machine has; shorter segments serve the others.
#[must_use]
pub fn fine_bits(config: &Config, axis: usize) -> u32 {
    let hz = config.servo_hz as f32;
    let axis = &config.axes[axis];
    let jerk = axis.j_max * axis.steps_per_unit.to_num::<f32>() / (hz * hz * hz);
    // The exponent of an f32, floored: 2^exponent <= jerk.
    let exponent = ((jerk.to_bits() >> 23) & 0xff) as i32 - 127;
    (10 - exponent).clamp(FINE_MIN, FINE_MAX) as u32
}

/// Least and most [`fine_bits`]: a scale must fit into 31 bits, and a segment holds a quarter of a step at least.
const FINE_MIN: i32 = 20;
const FINE_MAX: i32 = 33;
const _: () = assert!(SCALE_MAX == 1 << (PHASE_FRAC as i32 - FINE_MIN));

/// Units of a phase per unit of the fine coefficients.
#[must_use]
pub fn fine_scale(config: &Config) -> [i32; AXES] {
    core::array::from_fn(|a| 1 << (PHASE_FRAC - fine_bits(config, a)))
}
