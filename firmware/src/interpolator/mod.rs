//! The servo interrupt's arithmetic: s(t) by forward differences, sigma(s), u(sigma), P(u).
//!
//! In: [`ServoSegment`]s and profile [`Piece`]s from the queues. Out: commanded positions in Q32.32 steps.
//! Additions, multiplications and shifts only; the work of a tick does not depend on the data
//! beyond the number of joints it crosses.

use crate::geometry::arc::{ServoSegment, Q, S_FRAC, U_FRAC};
use crate::units::AXES;

/// `(a * b) >> 64`: product with a Q0.64 factor, rounded towards minus infinity. Exact for all `a` and `b`.
///
/// High half of an unsigned product from products of 32-bit halves, of which no sum below overflows (each is at most
/// (2^32 - 1)^2 + 2 (2^32 - 1) = 2^64 - 1); a negative `a` was taken as `a + 2^64`, which is `b` too much.
/// The same through `i128` costs half as many instructions again: the compiler multiplies sign extensions, too.
#[inline]
#[must_use]
pub fn mul_q(a: i64, b: u64) -> i64 {
    let low = |x: u64| u64::from(x as u32);
    let (a_low, a_high) = (low(a as u64), a as u64 >> 32);
    let (b_low, b_high) = (low(b), b >> 32);
    let first = a_low * b_high + ((a_low * b_low) >> 32);
    let second = a_high * b_low + low(first);
    let high = a_high * b_high + (first >> 32) + (second >> 32);
    let excess = b & (a >> 63) as u64;
    // Signed: for this form the compiler finds the shorter code.
    (high as i64).wrapping_sub(excess as i64)
}

/// A Q2.62 number in [0, 1) as the Q0.64 factor of [`mul_q`].
#[inline]
fn factor(x: i64) -> u64 {
    debug_assert!(
        (0..1 << Q).contains(&x),
        "{x} is outside of [0, 1) in Q2.62"
    );
    (x as u64) << (64 - Q)
}

/// Path parameter u in Q2.62 at path coordinate `s` (Q10.54) of `segment`, `0 <= s <= length`.
///
/// In [0, 1): sigma is, because its factors were rounded down, and u(sigma) rises from 0 to exactly 1 at sigma = 1
/// while every product here is rounded down.
#[inline]
#[must_use]
pub fn parameter(segment: &ServoSegment, s: i64) -> i64 {
    let sigma = factor(mul_q(segment.inverse, factor(s << segment.shift)));
    let c = &segment.u;
    let mut u = c[4];
    for k in (0..4).rev() {
        u = c[k] + mul_q(u, sigma);
    }
    mul_q(u, sigma) << (Q - U_FRAC)
}

/// Position at path coordinate `s`, Q32.32 steps per axis.
///
/// The truncation of the three products stays below three units of 2^-32 step.
#[inline]
#[must_use]
pub fn position(segment: &ServoSegment, s: i64) -> [i64; AXES] {
    let u = parameter(segment, s);
    let u1 = factor(u);
    let square = mul_q(u, u1);
    let u2 = factor(square);
    let u3 = factor(mul_q(square, u1));
    core::array::from_fn(|a| {
        let [a1, a2, a3] = segment.cubic[a];
        segment.start[a] + mul_q(a1, u1) + mul_q(a2, u2) + mul_q(a3, u3)
    })
}

/// How a [`Piece`] ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PieceEnd {
    /// Another piece follows.
    Continue,
    /// At rest at the end of the segment with this running number.
    StopAfter(u32),
    /// At rest on the path, wherever that is (feed hold).
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
    /// How to come to rest on the path if nothing follows this piece: jerk and ticks of three phases.
    pub escape: [(i64, u32); 3],
    /// Pieces planned before an escape are void: the interrupt takes only those of its own generation.
    pub generation: u32,
}

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

    /// Path coordinate in Q10.54, the form [`position`] takes.
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
