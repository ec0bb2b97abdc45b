//! The servo interrupt's arithmetic: s(t) by forward differences, positions from s by one quintic per axis.
//!
//! In: [`ServoSegment`](segment::ServoSegment)s and profile [`Piece`]s from the queues. Out: commanded positions.
//! What both sides of the queue must agree on lies here; what only the interrupt does, in the modules.

pub mod braking;
pub mod motion;
pub mod segment;

use braking::BrakeLimits;

/// How a [`Piece`] ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PieceEnd {
    /// Another piece follows.
    Continue,
    /// At rest at the end of the segment with this running number.
    StopAfter(u32),
    /// At rest, wherever on the path that is.
    StopHere,
}

/// A stretch of constant jerk, whole ticks long.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Piece {
    /// Jerk, path units per tick^3, [`T_FRAC`] fractional bits.
    pub jerk: i64,
    /// Duration.
    pub ticks: u32,
    /// What the last tick does.
    pub end: PieceEnd,
    /// How to come to rest on the path if a hold comes or nothing follows.
    pub brake: BrakeLimits,
    /// Pieces planned before the interrupt braked are void: it takes only those of its own generation.
    pub generation: u32,
}

/// Fractional bits of the path coordinate s: 2^-54 mm, range 512 mm per segment.
pub const S_FRAC: u32 = 54;

/// Fractional bits of s(t) and its differences: 18 more than a path coordinate, so that a landing of
/// thousands of ticks, whose rounding grows with their cube, still ends within 2^-32 step.
pub const T_FRAC: u32 = S_FRAC + EXTRA;

const EXTRA: u32 = 18;

/// Path coordinate in Q10.54 as seen by s(t).
#[must_use]
pub fn widen(s: i64) -> i128 {
    i128::from(s) << EXTRA
}

/// The state s(t): position, velocity and acceleration as backward differences per tick, [`T_FRAC`] fractional bits.
///
/// One tick is `a += j; v += a; s += v`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PathState {
    /// Path coordinate within the current segment.
    pub s: i128,
    /// Path units per tick.
    pub v: i128,
    /// Path units per tick^2.
    pub a: i128,
}

impl PathState {
    /// One tick at jerk `j`.
    #[inline]
    pub fn step(&mut self, j: i64) {
        self.a += i128::from(j);
        self.v += self.a;
        self.s += self.v;
    }

    /// Path coordinate in Q10.54.
    #[inline]
    #[must_use]
    pub fn coordinate(&self) -> i64 {
        (self.s >> EXTRA) as i64
    }

    /// `n` ticks at jerk `j` in closed form; the same integers as `n` times [`Self::step`].
    /// `None` if a result leaves `i128`.
    #[must_use]
    pub fn after(&self, j: i64, n: u32) -> Option<Self> {
        let (j, n) = (i128::from(j), i128::from(n));
        let n2 = n * (n + 1) / 2;
        let n3 = n2 * (n + 2) / 3;
        let sum = |x: i128, terms: &[(i128, i128)]| {
            terms
                .iter()
                .try_fold(x, |sum, &(k, y)| sum.checked_add(k.checked_mul(y)?))
        };
        Some(Self {
            s: sum(self.s, &[(n, self.v), (n2, self.a), (n3, j)])?,
            v: sum(self.v, &[(n, self.a), (n2, j)])?,
            a: sum(self.a, &[(n, j)])?,
        })
    }
}

#[cfg(test)]
mod tests;
