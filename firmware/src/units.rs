//! The numbers that cross module borders: axis count, positions, programmed coordinates.

use core::fmt;

use fixed::types::I32F32;

/// Axes of the machine. Five, by design: loops over axes unroll and arrays have no length field.
pub const AXES: usize = 5;

/// Position or distance of one axis in steps, Q32.32.
///
/// Range: [`POSITION_MAX`](crate::envelope::POSITION_MAX); resolution 2^-32 step (2.3e-13 mm at 1 um per step), fine
/// enough for jerk to be taken from third differences of a recorded trace.
pub type Steps = I32F32;

/// Absolute position of all axes in steps.
pub type Position = [Steps; AXES];

/// One `f32` per axis, in millimetres for linear axes and degrees for rotary axes (or a derivative of those).
pub type AxisVec = [f32; AXES];

/// Programmed coordinate in 1e-6 mm (nanometres) or 1e-6 degree.
///
/// Programs print decimals; an integer of this unit holds every decimal a control accepts without
/// rounding, and binary rounding happens once, on the way to [`Steps`].
pub type Nano = i64;

/// [`Nano`] per millimetre or degree.
pub const NANO_PER_UNIT: Nano = 1_000_000;

/// A number of thousandths, printed as a decimal. (What the core library prints floating point with is 10 KB of flash.)
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Thousandths(pub i64);

impl Thousandths {
    /// The nearest to `x`; of two, the even one.
    #[must_use]
    pub fn nearest(x: f32) -> Self {
        // Exact: 24 bits by ten.
        Self(libm::rint(f64::from(x) * 1000.0) as i64)
    }
}

impl fmt::Display for Thousandths {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sign = if self.0 < 0 { "-" } else { "" };
        let size = self.0.unsigned_abs();
        write!(f, "{sign}{}.{:03}", size / 1000, size % 1000)
    }
}

/// Servo ticks since power-up. Wraps after 2^64 ticks.
pub type Tick = u64;

/// Square root through one door: correctly rounded on host and target. (The FPU's `VSQRT` in its place has no stable name
/// and would make planning 1 % cheaper.)
#[must_use]
pub fn sqrt(x: f32) -> f32 {
    libm::sqrtf(x)
}

/// The smaller of two numbers; `a` if they are equal or one of them is NaN.
///
/// `f32::min` passes NaN over, which makes it a call on a core whose FPU has no instruction for that.
#[inline(always)]
#[must_use]
pub fn smaller(a: f32, b: f32) -> f32 {
    if b < a {
        b
    } else {
        a
    }
}

/// The larger of two numbers, the twin of [`smaller`].
#[inline(always)]
#[must_use]
pub fn larger(a: f32, b: f32) -> f32 {
    if b > a {
        b
    } else {
        a
    }
}

/// Commanded position of one axis as the servo interrupt keeps it: steps modulo 2^14 in Q14.50, half a step added.
///
/// The half makes the whole part the number of steps emitted, modulo 2^14. Neighbouring ticks lie closer together than
/// [`SPAN_MAX`](crate::envelope::SPAN_MAX), so whoever counts the steps has lost nothing.
pub type Phase = i64;

/// Fractional bits of a [`Phase`].
pub const PHASE_FRAC: u32 = 50;

/// Phase of a position in Q32.32 steps; exact.
#[inline]
#[must_use]
pub fn phase(bits: i64) -> Phase {
    bits.wrapping_add(1 << 31) << (PHASE_FRAC - 32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn thousandths_print_as_the_standard_library_does(bits in any::<u32>()) {
            let x = f32::from_bits(bits);
            prop_assume!(x.abs() < 1e15);
            let expected = format!("{x:.3}");
            let expected = if expected == "-0.000" { "0.000" } else { &expected };
            prop_assert_eq!(Thousandths::nearest(x).to_string(), expected);
        }
    }
}
