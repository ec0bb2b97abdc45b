//! A range of numbers in one word, and two numbers in one.
//!
//! In: the ends of a range. Out: middle and half width of one that contains it, each end further out by at most 2^-9 of the
//! middle and 2^-6 of the half width. The middle is an `f32` of eighteen bits, the half width one of fourteen and without sign.

/// Bits of the middle.
const MIDDLE: u32 = 0xffff_c000;
/// Half of what is cut off it.
const HALF: u32 = 0x2000;
/// The half width's place in an `f32`: eight bits of exponent, six of the fraction.
const SHIFT: u32 = 17;
/// What is cut off it.
const CUT: u32 = (1 << SHIFT) - 1;

/// A range as middle and half width.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Span(u32);

impl Span {
    /// Nothing but zero.
    pub const ZERO: Self = Self(0);
    /// Every number.
    const ANY: Self = Self(f32::INFINITY.to_bits() >> SHIFT);

    /// A span that contains `low` to `high`. Where they are not finite, or the range is wider than numbers go, it contains
    /// everything.
    #[must_use]
    pub fn new(low: f32, high: f32) -> Self {
        let middle = 0.5 * low + 0.5 * high;
        let middle = f32::from_bits((middle.to_bits() + HALF) & MIDDLE);
        // Rounded, so a little more.
        let half = (high - middle).max(middle - low).max(0.0) * (1.0 + 2.0 * f32::EPSILON);
        if !(half < f32::MAX && low <= high) {
            return Self::ANY;
        }
        // Positive, so the next pattern is the next number.
        let half = (half.to_bits() + CUT) >> SHIFT;
        Self(middle.to_bits() | half)
    }

    /// A span that contains what is up to `off` from `middle`.
    #[must_use]
    pub fn about(middle: f32, off: f32) -> Self {
        Self::new(middle - off, middle + off)
    }

    /// Whether all of them are nothing but zero.
    #[inline]
    #[must_use]
    pub fn are_zero([a, b, c]: [Self; 3]) -> bool {
        (a.0 | b.0 | c.0) == 0
    }

    /// Middle and half width.
    #[inline]
    #[must_use]
    pub fn parts(self) -> [f32; 2] {
        [
            f32::from_bits(self.0 & MIDDLE),
            f32::from_bits((self.0 & !MIDDLE) << SHIFT),
        ]
    }
}

/// The upper half of a word.
const UPPER: u32 = 0xffff_0000;

/// The upper halves of two `f32` in a word, each rounded away from zero.
#[inline]
#[must_use]
pub fn halves(first: f32, second: f32) -> u32 {
    let half = |x: f32| x.to_bits().saturating_add(!UPPER);
    half(first) & UPPER | half(second) >> 16
}

/// The two of them.
#[inline]
#[must_use]
pub fn of_halves(word: u32) -> [f32; 2] {
    [word & UPPER, word << 16].map(f32::from_bits)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn span_contains_its_range_and_is_hardly_wider(
            x in prop::num::f32::NORMAL | prop::num::f32::ZERO,
            y in prop::num::f32::NORMAL | prop::num::f32::ZERO,
            near in prop::bool::ANY,
        ) {
            let (x, y) = (x.clamp(-1.0e38, 1.0e38), y.clamp(-1.0e38, 1.0e38));
            let y = if near { x * (1.0 + y.rem_euclid(1.0) * 1.0e-3) } else { y };
            let (low, high) = (x.min(y), x.max(y));
            let [middle, half] = Span::new(low, high).parts().map(f64::from);
            let (low, high) = (f64::from(low), f64::from(high));
            // The last of a span is the least normal number.
            let far = (low + high).abs() / 2.0 / 512.0 + (high - low) / 2.0 / 64.0;
            let far = far * 1.01 + 2.0 * f64::from(f32::MIN_POSITIVE);
            let (below, above) = (low - (middle - half), middle + half - high);
            prop_assert!(0.0 <= below && below <= far, "{low} to {high}: {middle} +- {half}");
            prop_assert!(0.0 <= above && above <= far, "{low} to {high}: {middle} +- {half}");
        }

        #[test]
        fn span_of_any_bits_contains_what_is_a_number(low in any::<u32>(), high in any::<u32>()) {
            let (low, high) = (f32::from_bits(low), f32::from_bits(high));
            let [middle, half] = Span::new(low, high).parts().map(f64::from);
            if low <= high || low.is_nan() || high.is_nan() {
                prop_assert!(low.is_nan() || middle - half <= f64::from(low));
                prop_assert!(high.is_nan() || f64::from(high) <= middle + half);
            }
        }
    }

    #[test]
    fn numbers_of_ten_binary_digits_stay_as_they_are() {
        for n in -1023..=1023 {
            for scale in [1.0, 1.0 / 1024.0, 4096.0] {
                let x = n as f32 * scale;
                assert_eq!(Span::new(x, x).parts(), [x, 0.0]);
            }
        }
        assert_eq!(Span::new(0.0, 0.0), Span::ZERO);
    }
}
