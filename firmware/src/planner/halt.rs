//! With which limits the interrupt may come to rest while it runs what is planned ([`crate::interpolator::braking`]).
//!
//! In: the planned state and the nodes ahead of it. Out: one deceleration and one jerk that every node allows from here
//! to where braking with them ends.

use super::brake::{brake, Brake, Grip};
use super::limits::PathLimits;
use super::profile::View;
use crate::interpolator::braking::{
    BrakeLimits, BrakeStage, STAGES, STAGE_A_FRAC, STAGE_J_FRAC, STAGE_V_FRAC,
};
use crate::interpolator::{widen, PathState, T_FRAC};
use crate::units::sqrt;

const UNIT: f32 = (1_u128 << T_FRAC) as f32;

/// Share of the acceleration at rest below which no limit falls: a curve may take all of it at speed.
const LEAST: f32 = 0.02;

/// Rounding of a braking distance, relative.
const ROUNDING: f32 = 2.0e-5;

/// Shares of the velocity from which on the stages hold.
const SHARES: [f32; STAGES] = [1.0, 0.7, 0.4];

/// How far from the border of a stage its nodes count for the other, too.
const NEAR: f32 = 1.1;

/// No limit yet.
const FREE: PathLimits = PathLimits {
    a: f32::MAX,
    j: f32::MAX,
};

/// Attempts to fit braking into the way to the end.
const FITTINGS: u32 = 4;

/// Excess over a velocity limit that counts as none.
const SLACK: f32 = 1.002;

/// The same where the motion does not slow down yet: what is predicted here is less than what braking does.
const GAINING: f32 = 1.03;

impl View<'_> {
    /// Limits while the motion gets from velocity `before` (units of [`PathState`]) in node `from` to the state.
    ///
    /// Goes along the path as braking would, node by node, with what each node allows at the velocity left there.
    /// [`BrakeLimits::waits`] where a velocity limit or a programmed stop ahead would be run over: each stage brakes with the
    /// least its nodes allow, the plan with what every one of them does.
    #[must_use]
    pub fn brake_limits(&self, from: usize, before: i128) -> BrakeLimits {
        let scale = self.hz / UNIT;
        let a = self.state.a as f32 * scale * self.hz;
        // The differences of a tick belong to places between ticks; all of it is the motion one tick ago.
        let v = self.state.v as f32 * scale - 0.5 * a / self.hz;
        let way = widen(self.nodes.get(self.cursor).length_q) - self.state.s + self.state.v;
        let mut way = way as f32 / UNIT;
        let start = self.limits_at(from, v.max(before as f32 * scale));
        let highest = v.max(before as f32 * scale) + a.max(0.0) * a.max(0.0) / (2.0 * start.j);
        let mut first = self.limits_at(from, highest);
        for index in from + 1..=self.cursor {
            first = first.least(self.limits_at(index, highest));
        }
        // What already slows down does not have to do so less.
        first.a = first.a.max(-a);
        let mut stages = [first, FREE, FREE];
        let (mut index, mut square) = (self.cursor, highest * highest);
        let mut waits = false;
        // Braking begins late by the time the deceleration takes to build up.
        let free = sqrt(first.j * v.max(0.0) + 0.5 * a * a);
        let peak = first.a.min(free).max(f32::MIN_POSITIVE);
        let mut late = v * (peak + a).max(0.0) * (peak + a) / (2.0 * first.j * peak);
        let mut left = way;
        loop {
            let braked = left - late;
            late = (-braked).max(0.0);
            let entry = sqrt(square);
            let now = (0..STAGES).rev().find(|&k| entry <= SHARES[k] * highest);
            let here = stages[now.unwrap_or(0)].least(self.limits_at(index, entry));
            square -= 2.0 * here.a.min(free) * braked.max(0.0);
            let exit = sqrt(square.max(0.0));
            for (k, limits) in stages.iter_mut().enumerate() {
                // Around the borders for the stages on either side: the prediction is not exact.
                let high = SHARES[k] * highest * NEAR;
                let low = SHARES
                    .get(k + 1)
                    .map_or(0.0, |share| share * highest / NEAR);
                if entry >= low && exit <= high {
                    *limits = limits.least(self.limits_at(index, entry.min(high)));
                }
            }
            if square <= 0.0 || index >= self.last {
                break;
            }
            let node = self.nodes.get(index);
            index += 1;
            let next = self.nodes.get(index);
            // What already slows down is worth waiting for, and what will have to.
            let slack = if a < 0.0 { SLACK } else { GAINING };
            waits |= exit > slack * node.exit_v.min(next.limits.v);
            left = next.length;
            way += left;
        }
        for (k, limits) in stages.iter_mut().enumerate() {
            if limits.a >= FREE.a {
                *limits = self.limits_at(index, SHARES[k] * highest);
            }
        }
        // Limits rise from stage to stage, so that the motion fits the next one whenever it comes.
        for k in (0..STAGES - 1).rev() {
            stages[k] = stages[k].least(stages[k + 1]);
        }
        stages[0].a = stages[0].a.max(-a);
        if index >= self.last && way > 0.0 {
            for _ in 0..FITTINGS {
                let halt = brake(v, a, 0.0, Grip::even(stages[0].a, stages[0].j));
                let room = self.room(&halt, stages[0].j);
                if room <= way {
                    break;
                }
                waits = true;
                // Distance goes with 1 / a, at one and the same shape of the curve. Without a plan to wait for, there is no other
                // way to stop in time.
                let share = room / way;
                for limits in &mut stages {
                    limits.a *= share;
                    limits.j *= share * share;
                }
            }
        }
        BrakeLimits {
            stages: core::array::from_fn(|k| self.in_units(stages[k], SHARES[k] * highest)),
            last: 0,
            waits,
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
        let mut limits = all
            .reduce(PathLimits::least)
            .unwrap_or(PathLimits { a: 0.0, j: 0.0 });
        limits.a = limits.a.max(a as f32 / UNIT * self.hz * self.hz);
        limits.j = limits.j.max(j as f32 / UNIT * self.hz * self.hz * self.hz);
        BrakeLimits {
            stages: [self.in_units(limits, v); STAGES],
            last: 0,
            waits: false,
        }
    }

    /// Way that braking in whole ticks takes: behind the continuous motion by half a tick of jerk in velocity, at most.
    fn room(&self, halt: &Brake, j: f32) -> f32 {
        let time: f32 = halt.time.iter().sum();
        halt.distance * (1.0 + ROUNDING) + 0.5 * time * j / (self.hz * self.hz)
    }

    fn limits_at(&self, index: usize, v: f32) -> PathLimits {
        let PathLimits { a, j } = self.at(index, v);
        let still = self.acceleration(index, 0.0);
        PathLimits {
            a: a.max(LEAST * still.down.min(still.up)),
            j,
        }
    }

    fn in_units(&self, limits: PathLimits, v: f32) -> BrakeStage {
        let units = |x: f32, bits: u32| (x * (1_u64 << bits) as f32) as u32;
        let PathLimits { a, j } = limits;
        let tick = 1.0 / self.hz;
        BrakeStage {
            v: units(v * tick, STAGE_V_FRAC),
            a: units(a * tick * tick, STAGE_A_FRAC),
            j: units(j * tick * tick * tick, STAGE_J_FRAC),
        }
    }
}
