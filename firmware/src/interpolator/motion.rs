//! s(t) as the servo interrupt advances it: three additions of 96 bits per tick.
//!
//! In: a jerk per tick. Out: the way left in a segment. The same integers as [`PathState`](super::PathState), which has
//! 128 bits and is what the background works with: within [`V_MAX`](crate::envelope::V_MAX) and
//! [`A_MAX`](crate::envelope::A_MAX) at both ends of a piece of up to [`TICKS_MAX`](crate::envelope::TICKS_MAX), none of them
//! ever needs more than 96.

/// A two's complement number of 96 bits, [`T_FRAC`](super::T_FRAC) of them behind the point: +-2^23 path units.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wide {
    low: u64,
    high: i32,
}

impl Wide {
    /// The lowest 96 bits of `value`.
    #[inline(always)]
    #[must_use]
    pub const fn new(value: i128) -> Self {
        Self {
            low: value as u64,
            high: (value >> 64) as i32,
        }
    }

    /// The number.
    #[inline(always)]
    #[must_use]
    pub const fn get(self) -> i128 {
        (self.high as i128) << 64 | self.low as i128
    }

    /// True below zero.
    #[inline(always)]
    #[must_use]
    pub const fn is_negative(self) -> bool {
        self.high < 0
    }

    /// The number without its lowest `bits`, as far as it fits into 32.
    #[inline(always)]
    #[must_use]
    pub const fn above(self, bits: u32) -> i32 {
        (self.get() >> bits) as i32
    }

    /// Its words, lowest first.
    #[inline(always)]
    #[must_use]
    pub const fn words(self) -> [u32; 3] {
        [self.low as u32, (self.low >> 32) as u32, self.high as u32]
    }
}

/// The way left, and what changes it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Motion {
    /// Path units to the end of the segment, [`LENGTH_MAX`](crate::envelope::LENGTH_MAX) at most.
    pub left: Wide,
    /// Path units per tick, below [`V_MAX`](crate::envelope::V_MAX).
    pub v: Wide,
    /// Path units per tick^2, below [`A_MAX`](crate::envelope::A_MAX).
    pub a: Wide,
}

impl Motion {
    /// The motion is over the end of the segment, or goes backwards and may be over its start.
    #[inline(always)]
    #[must_use]
    pub const fn is_beyond(&self) -> bool {
        (self.left.high | self.v.high) < 0
    }

    /// One tick at jerk `j`.
    #[inline(always)]
    pub fn step(&mut self, j: i64) {
        self.a = Wide::new(self.a.get().wrapping_add(j as i128));
        self.v = Wide::new(self.v.get().wrapping_add(self.a.get()));
        self.left = Wide::new(self.left.get().wrapping_sub(self.v.get()));
    }

    /// Stands still where it is.
    pub fn halt(&mut self) {
        self.v = Wide::default();
        self.a = Wide::default();
    }
}
