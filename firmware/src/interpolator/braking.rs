//! Coming to rest: the next deceleration, tick by tick.
//!
//! In: [`BrakeLimits`] from the background, velocity and deceleration of the last tick. Out: the deceleration of the
//! next. Integers in the units of [`PathState`](super::PathState), no division but of words: this runs in the interrupt. No
//! velocity or deceleration of 96 bits overflows them.
//!
//! Let d be the deceleration of a tick and J the jerk. Released at J per tick, d still takes
//! R(d) = sum over k >= 1 of max(d - k J, 0) off the velocity. A tick takes the largest d within J of the last one and
//! up to A with d + R(d) <= v: so v never falls below what the release takes, and both end at zero. Between m J and
//! (m+1) J the sum is d + R(d) = (m+1) d - J m (m+1) / 2, solved for d with one division by m + 1.

use super::T_FRAC;

/// Fractional bits of [`BrakeLimits::a`]: up to 2^-8 path units per tick^2.
pub const BRAKE_A_FRAC: u32 = 40;
/// Fractional bits of [`BrakeLimits::j`]: up to 2^-12 path units per tick^3, a third of which takes 3 ticks to the
/// highest acceleration.
pub const BRAKE_J_FRAC: u32 = 44;

/// Limits of coming to rest, and where that has to have happened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BrakeLimits {
    /// Deceleration, path units per tick^2, [`BRAKE_A_FRAC`] fractional bits.
    pub a: u32,
    /// Jerk, path units per tick^3, [`BRAKE_J_FRAC`] fractional bits.
    pub j: u32,
    /// Running number of the segment at whose end the path stops, or the plan ends.
    pub last: u32,
    /// What is planned slows down before braking within these limits would: a hold waits for it.
    pub waits: bool,
}

/// Most ticks a release takes, as a power of two.
const TICKS_BITS: u32 = 15;

/// Braking under way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Braking {
    a: i128,
    j: i128,
}

impl Braking {
    /// Limits for braking from velocity `v` and deceleration `d`.
    ///
    /// Where the jerk of `limits` is too small to let go of `d` before the motion turns round, it is raised, at most by a
    /// quarter more than needed.
    #[must_use]
    pub fn new(limits: &BrakeLimits, v: i128, d: i128) -> Self {
        let (a, j) = limits.wide();
        Self::within(a, j, v, d)
    }

    /// The same for deceleration `a` and jerk `j` in units of [`PathState`](super::PathState).
    fn within(a: i128, j: i128, v: i128, d: i128) -> Self {
        let mut j = j.max(1).max(d >> TICKS_BITS);
        let a = a.clamp(1, j << TICKS_BITS);
        loop {
            let braking = Self { a, j };
            // With the jerk as large as d nothing is left to let go of, so this ends.
            if d <= j || braking.taken(d - j, braking.ticks(d - j)) <= v {
                return braking;
            }
            j += (j >> 2) + 1;
        }
    }

    /// The next deceleration, at velocity `v >= 0` after a tick of deceleration `d`; never more than `v`.
    #[must_use]
    pub fn next(&self, v: i128, d: i128) -> i128 {
        let low = d - self.j;
        let most = self.a.min(d + self.j).max(low);
        let mut m = self.ticks(most);
        if self.taken(most, m) <= v {
            return most.min(v);
        }
        while m > 0 && self.triangle(m) > v {
            m -= 1;
        }
        let over = quotient((v - self.triangle(m)).unsigned_abs(), m + 1);
        (self.j * i128::from(m) + i128::from(over)).max(low).min(v)
    }

    /// Whole ticks of the jerk in `d`, fewer than 2^16: `d` is hardly more than 2^15 of them ([`Self::new`]).
    fn ticks(&self, d: i128) -> u32 {
        let (mut left, mut part, mut ticks) = (d, self.j << TICKS_BITS, 0);
        for _ in 0..=TICKS_BITS {
            ticks <<= 1;
            if left >= part {
                left -= part;
                ticks |= 1;
            }
            part >>= 1;
        }
        ticks
    }

    /// J m (m+1) / 2: what deceleration m J and its release take off the velocity.
    fn triangle(&self, m: u32) -> i128 {
        self.j * i128::from(m * (m + 1) / 2)
    }

    /// What deceleration `d`, of `m` whole ticks, and its release take off the velocity.
    fn taken(&self, d: i128, m: u32) -> i128 {
        d * i128::from(m + 1) - self.triangle(m)
    }
}

impl BrakeLimits {
    /// Deceleration and jerk in the units of [`PathState`](super::PathState).
    fn wide(&self) -> (i128, i128) {
        let wide = |x: u32, bits: u32| i128::from(x) << (T_FRAC - bits);
        (wide(self.a, BRAKE_A_FRAC), wide(self.j, BRAKE_J_FRAC))
    }
}

/// `x` / `by` rounded down, for `x < 2^64 by` and `0 < by <= 2^16`: digit by digit, since a word is all the target divides.
///
/// That is what is divided here: the quotient is no more than the deceleration tried before, and limits have less than 64 bits.
fn quotient(x: u128, by: u32) -> u64 {
    let (mut rest, mut found) = (0, 0);
    for digit in (0..5).rev() {
        // Less than 2^16 by.
        let part = (rest << 16) | u32::from((x >> (16 * digit)) as u16);
        found = (found << 16) | u64::from(part / by);
        rest = part % by;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Runs from `v`, `d` to rest; the ticks until the velocity is zero (what is left of `d` then ends within one more tick of
    /// jerk), or the law that broke.
    fn run(braking: Braking, v: i128, d: i128, jerk: i128) -> Result<u32, String> {
        let most = d.abs().max(braking.a);
        let (mut v, mut d, mut ticks) = (v, d, 0);
        while v != 0 {
            let next = braking.next(v, d);
            if (next - d).abs() > jerk {
                return Err(format!("tick {ticks}: jerk {} of {jerk}", next - d));
            }
            if next.abs() > most {
                return Err(format!("tick {ticks}: deceleration {next} of {most}"));
            }
            (v, d, ticks) = (v - next, next, ticks + 1);
            if v < 0 || ticks > 1 << 20 {
                return Err(format!("tick {ticks}: velocity {v}"));
            }
        }
        if d.abs() > jerk {
            return Err(format!("at rest after a deceleration of {d}, jerk {jerk}"));
        }
        Ok(ticks)
    }

    /// Velocity that letting go of `d` at `j` per tick takes, added up tick by tick.
    fn release(d: i128, j: i128) -> i128 {
        std::iter::successors(Some(d - j), |d| Some(d - j))
            .take_while(|&d| d > 0)
            .sum()
    }

    /// Least time to rest in ticks, of motion continuous in time: acceleration built up, held, let go.
    ///
    /// Differences lie between ticks: a velocity belongs half a tick behind the deceleration before it.
    fn least_time(v: f64, d: f64, a: f64, j: f64) -> f64 {
        let v = v + d / 2.0;
        if d > a {
            return d / j + (v - d * d / (2.0 * j)).max(0.0) / a;
        }
        let peak = (j * v + d * d / 2.0).max(0.0).sqrt();
        if peak <= a {
            return (2.0 * peak - d) / j;
        }
        (2.0 * a - d) / j + (v - (2.0 * a * a - d * d) / (2.0 * j)) / a
    }

    fn near(exponent: f64) -> i128 {
        exponent.exp2() as i128
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(3000))]

        /// From whatever motion the jerk can let go of, braking ends with velocity and acceleration exactly zero, within
        /// both limits at every tick, never backwards, and at most one tick later than motion continuous in time.
        #[test]
        fn braking_ends_exactly_at_rest_in_the_least_time(
            a in 1.0_f64..62.0,
            ratio in -2.0_f64..11.0,
            start in -1.0_f64..1.5,
            extra in 0.0_f64..1.0,
            hold in 0.0_f64..10.0,
            odd in 0_i128..1000,
        ) {
            let j = near((a - ratio).clamp(0.0, 61.0)).max(1);
            let a = near(a).min(j << TICKS_BITS);
            let d = (a as f64 * start) as i128;
            let v = release(d, j) + (extra * a as f64 * hold.exp2()) as i128 + odd;
            let ticks = run(Braking::within(a, j, v, d), v, d, j).map_err(TestCaseError::fail)?;
            let least = least_time(v as f64, d as f64, a as f64, j as f64);
            prop_assert!(f64::from(ticks) <= least + 1.0 + 1e-6 * least, "{} ticks, least {}", ticks, least);
        }

        /// Where the jerk is too small to let go of the deceleration, braking takes at most a quarter more than is needed.
        #[test]
        fn a_jerk_too_small_is_raised_by_no_more_than_needed(
            j in 10.0_f64..42.0,
            needed in 0.0_f64..10.0,
            d in 0.0_f64..10.0,
            odd in 0_i128..1000,
        ) {
            let j = near(j);
            let needed = near(needed) * j;
            let d = needed * near(d);
            let v = release(d, needed) + odd.min(needed);
            run(Braking::within(d, j, v, d), v, d, needed + (needed >> 2) + 2).map_err(TestCaseError::fail)?;
        }
    }
}
