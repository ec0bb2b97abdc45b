//! A range of numbers in one word.
//!
//! In: the ends of a range. Out: those of one that contains it, at most 2^-7 of each end wider. Both are `f32`s cut to
//! their upper half, which keeps sign, exponent and seven bits of the fraction, and rounded outward.

/// Bits that an end keeps.
const KEPT: u32 = 0xffff_0000;
/// The least change of what is kept.
const STEP: u32 = 1 << 16;
/// The sign.
const SIGN: u32 = 1 << 31;

/// A range, least and largest value in 16 bits each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Span(u32);

impl Span {
    /// Nothing but zero.
    pub const ZERO: Self = Self(0);

    /// The narrowest span that contains `low` and `high`. Of numbers beyond 3.39e38 infinity is made; ends that are not
    /// numbers stay so, or become infinite.
    #[must_use]
    pub fn new(low: f32, high: f32) -> Self {
        // Rounding down is rounding the negative up.
        let low = rounded_up(-low) ^ SIGN;
        Self((low & KEPT) | (rounded_up(high) >> 16))
    }

    /// Least value.
    #[inline]
    #[must_use]
    pub fn low(self) -> f32 {
        f32::from_bits(self.0 & KEPT)
    }

    /// Largest value.
    #[inline]
    #[must_use]
    pub fn high(self) -> f32 {
        f32::from_bits(self.0 << 16)
    }
}

/// Bits of the least number not below `x` of those with an empty lower half.
fn rounded_up(x: f32) -> u32 {
    // Towards zero: upwards if negative.
    let cut = x.to_bits() & KEPT;
    if x > f32::from_bits(cut) {
        // Positive and finite, so the next pattern is the next number.
        cut + STEP
    } else {
        cut
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn span_contains_its_range_and_is_wider_by_a_128th_at_most(
            x in prop::num::f32::NORMAL | prop::num::f32::ZERO,
            y in prop::num::f32::NORMAL | prop::num::f32::ZERO,
        ) {
            let (x, y) = (x.clamp(-3.0e38, 3.0e38), y.clamp(-3.0e38, 3.0e38));
            let (low, high) = (x.min(y), x.max(y));
            let span = Span::new(low, high);
            // Differences of these are exact in twice the digits.
            let below = f64::from(low) - f64::from(span.low());
            let above = f64::from(span.high()) - f64::from(high);
            let wider = |end: f32| f64::from(end).abs() / 128.0;
            prop_assert!(0.0 <= below && below <= wider(low), "{low} became {}", span.low());
            prop_assert!(0.0 <= above && above <= wider(high), "{high} became {}", span.high());
        }

        #[test]
        fn span_of_any_bits_contains_what_is_a_number(low in any::<u32>(), high in any::<u32>()) {
            let (low, high) = (f32::from_bits(low), f32::from_bits(high));
            let span = Span::new(low, high);
            prop_assert!(low.is_nan() || span.low() <= low);
            prop_assert!(high.is_nan() || span.high() >= high);
        }
    }

    #[test]
    fn numbers_of_eight_digits_stay_as_they_are() {
        for n in -255..=255 {
            for scale in [1.0, 1.0 / 1024.0, 4096.0] {
                let x = n as f32 * scale;
                let span = Span::new(x, x);
                assert_eq!((span.low(), span.high()), (x, x));
            }
        }
        assert_eq!(Span::new(0.0, 0.0), Span::ZERO);
    }
}
