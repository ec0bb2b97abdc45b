//! With which limits the interrupt may come to rest while it runs what is planned ([`crate::interpolator::braking`]).
//!
//! In: the planned state and the nodes ahead of it. Out: one deceleration and one jerk that every node allows from here
//! to where braking with them ends.

use super::brake::{brake, Brake};
use super::limits::PathLimits;
use super::profile::View;
use crate::interpolator::braking::BrakeLimits;
use crate::interpolator::{widen, PathState, T_FRAC};

const UNIT: f32 = (1_u128 << T_FRAC) as f32;

/// Share of the acceleration at rest below which no limit falls: a curve may take all of it at speed.
const LEAST: f32 = 0.02;

/// Rounding of a braking distance, relative.
const ROUNDING: f32 = 2.0e-5;

/// Attempts to fit braking into the way to the end.
const FITTINGS: u32 = 4;

impl View<'_> {
    /// Limits while the motion gets from velocity `before` (units of [`PathState`]) in node `from` to the state.
    ///
    /// [`BrakeLimits::lands`] where they leave no room before a programmed stop: the way there is planned with the limits of
    /// each of its nodes, and gets to rest before braking with the least of them all would.
    #[must_use]
    pub fn brake_limits(&self, from: usize, before: i128) -> BrakeLimits {
        let scale = self.hz / UNIT;
        let a = self.state.a as f32 * scale * self.hz;
        // The differences of a tick belong to places between ticks; all of it is the motion one tick ago.
        let v = self.state.v as f32 * scale - 0.5 * a / self.hz;
        let way = widen(self.nodes.get(self.cursor).length_q) - self.state.s + self.state.v;
        let mut way = way as f32 / UNIT;
        let highest = v.max(before as f32 * scale);
        let mut limits = self.limits_at(from, highest);
        let rise = a.max(0.0) * a.max(0.0) / (2.0 * limits.j);
        for index in from..=self.cursor {
            limits = least(limits, self.limits_at(index, highest + rise));
        }
        let mut halt = brake(v, a, 0.0, limits.a, limits.j);
        let mut index = self.cursor;
        while way < self.room(&halt, limits.j) && index < self.last {
            index += 1;
            let here = least(limits, self.limits_at(index, highest + rise));
            if here != limits {
                limits = here;
                halt = brake(v, a, 0.0, limits.a, limits.j);
            }
            way += self.nodes.get(index).length;
        }
        let fits = self.room(&halt, limits.j) <= way;
        for _ in 0..FITTINGS {
            let room = self.room(&halt, limits.j);
            if room <= way || !(way > 0.0) {
                break;
            }
            // Distance goes with 1 / a, at one and the same shape of the curve.
            let share = room / way;
            limits.a *= share;
            limits.j *= share * share;
            halt = brake(v, a, 0.0, limits.a, limits.j);
        }
        BrakeLimits {
            lands: !fits && self.nodes.get(self.last).stop,
            ..self.in_units(limits)
        }
    }

    /// Limits while the motion runs `phases` to rest: at least as hard as they are.
    #[must_use]
    pub fn landing_limits(&self, phases: &[(i64, u32)]) -> BrakeLimits {
        let (mut state, mut v) = (self.state, self.state.v);
        let (mut a, mut j) = (state.a.abs(), 0);
        for &(jerk, ticks) in phases {
            state = state.after(jerk, ticks).unwrap_or(state);
            // Where the acceleration passes zero in the next phase, the velocity is at most this much higher.
            let PathState { a: end, .. } = state;
            let rise = if end > 0 { end * i128::from(ticks) } else { 0 };
            v = v.max(state.v + rise);
            a = a.max(end.abs());
            j = j.max(jerk.saturating_abs());
        }
        let v = v as f32 / UNIT * self.hz;
        let all = (self.cursor..=self.last).map(|index| self.limits_at(index, v));
        let limits = all.reduce(least).unwrap_or(PathLimits { a: 0.0, j: 0.0 });
        let free = self.in_units(limits);
        BrakeLimits {
            a: free.a.max(i64::try_from(a).unwrap_or(i64::MAX)),
            j: free.j.max(j),
            ..free
        }
    }

    /// Way that braking in whole ticks takes: behind the continuous motion by half a tick of jerk in velocity, at most.
    fn room(&self, halt: &Brake, j: f32) -> f32 {
        let time: f32 = halt.time.iter().sum();
        halt.distance * (1.0 + ROUNDING) + 0.5 * time * j / (self.hz * self.hz)
    }

    fn limits_at(&self, index: usize, v: f32) -> PathLimits {
        let node = &self.nodes.get(index).limits;
        let limits = node.below(v);
        let rest = LEAST * node.acceleration(0.0);
        PathLimits {
            a: limits.a.max(rest),
            j: limits.j,
        }
    }

    fn in_units(&self, limits: PathLimits) -> BrakeLimits {
        let scale = UNIT / (self.hz * self.hz);
        BrakeLimits {
            a: (limits.a * scale) as i64,
            j: (limits.j * (scale / self.hz)) as i64,
            ..BrakeLimits::default()
        }
    }
}

fn least(x: PathLimits, y: PathLimits) -> PathLimits {
    PathLimits {
        a: x.a.min(y.a),
        j: x.j.min(y.j),
    }
}
