//! With which limits the interrupt may come to rest while it runs what is planned ([`crate::interpolator::braking`]).
//!
//! In: a piece and the motion it begins with. Out: one deceleration and one jerk with which braking keeps every limit ahead,
//! from its ends and its middle. Shares of what is allowed there are tried, the largest first, by running the way to rest.

use super::brake::{brake, Grip};
use super::course::{Breach, Course, Motion, BRAKING};
use super::profile::{View, UNIT};
use super::refuge::nearest;
use crate::interpolator::braking::{BrakeLimits, Braking, BRAKE_A_FRAC, BRAKE_J_FRAC};
use crate::units::{larger, smaller};

/// Shares of the limits that braking is tried with.
const SHARES: [f32; 8] = [0.999, 0.9, 0.75, 0.6, 0.45, 0.3, 0.2, 0.1];

/// Rounding of a braking distance, relative.
const ROUNDING: f32 = 2.0e-5;

/// Braking of up to so many ticks is run tick by tick.
const SHORT: u32 = 32;

/// Longest braking that is tried, ticks.
const LONGEST: f32 = 60_000.0;
/// Part of a tick in which longer braking is run.
const PART: f32 = 0.125;

/// Which of [`SHARES`] was found last, or was the last to fail. From piece to piece that changes little.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Hint(usize);

impl Hint {
    /// What `run` finds with one of [`SHARES`], looked for from one above the last on. With less of the limits it can break no
    /// change that more kept, and with more no velocity.
    fn search<T>(&mut self, run: impl FnMut(f32) -> Result<T, Breach>) -> Option<T> {
        self.0 = self.0.saturating_sub(1);
        nearest(&SHARES, &mut self.0, run)
    }
}

impl View<'_> {
    /// Limits while `jerk` leads from `before` to the planned state in `ticks`. [`BrakeLimits::waits`] where no braking within one
    /// deceleration and one jerk keeps the limits ahead: the plan does, with more than one of them.
    #[must_use]
    pub(super) fn brake_limits(
        &self,
        before: &Motion,
        jerk: f32,
        ticks: u32,
        hint: &mut Hint,
    ) -> BrakeLimits {
        let after = self.motion();
        let middle = self.along(before, jerk, ticks / 2);
        let whole = self.even(before).least(self.even(&after));
        // What already slows down does not do so less, neither here nor there.
        let least = larger(-before.a, -after.a);
        let found = hint.search(|share| {
            let grip = whole.share(share);
            let grip = Grip {
                a: larger(grip.a, least),
                ..grip
            };
            for at in [&after, before, &middle] {
                self.halts(at, grip)?;
            }
            Ok(grip)
        });
        let grip = found.unwrap_or(Grip {
            a: larger(whole.a, least),
            ..whole
        });
        BrakeLimits {
            waits: found.is_none(),
            ..self.in_units(grip)
        }
    }

    /// The same jerk for building deceleration up and letting it go.
    fn even(&self, at: &Motion) -> Grip {
        let grip = self.grip(at, 0.0, at.node);
        let hz = self.hz;
        // As much as a piece can say.
        let most = |bits: u32, unit: f32| u32::MAX as f32 / (1_u64 << bits) as f32 * unit;
        Grip::even(
            smaller(grip.a, most(BRAKE_A_FRAC, hz * hz)),
            smaller(
                smaller(grip.down, grip.up),
                most(BRAKE_J_FRAC, hz * hz * hz),
            ),
        )
    }

    /// What braking from `at` within `grip` breaks, the end of the path included.
    fn halts(&self, at: &Motion, grip: Grip) -> Result<(), Breach> {
        if at.v <= 0.0 {
            return Ok(());
        }
        let halt = brake(at.v, at.a, 0.0, grip);
        let time: f32 = halt.time.iter().sum();
        if !(time * self.hz <= LONGEST) {
            return Err(Breach::Velocity);
        }
        let last = self.end - 1;
        let end = if time * self.hz <= SHORT as f32 {
            self.halt_in_ticks(at, grip)?
        } else {
            // The interrupt keeps to no phases of whole ticks; in whole ones all would be a little gentler.
            let h = PART / self.hz;
            let parts = halt.time.map(|t| (libm::ceilf(t / h) as u32).max(1));
            let course = Course::slowing(at, 0.0, parts, h).ok_or(Breach::Velocity)?;
            self.follow(at, &course, last, BRAKING)?
        };
        // Braking in whole ticks is behind the continuous motion by half a tick of jerk in velocity, at most.
        let room = halt.distance * ROUNDING + 0.5 * time * grip.down / (self.hz * self.hz);
        if end.node < last || end.left >= room {
            Ok(())
        } else {
            Err(Breach::Velocity)
        }
    }

    /// The end of braking from `at` within `grip`, done as the interrupt does it: in a few ticks, whole phases would be much gentler.
    fn halt_in_ticks(&self, at: &Motion, grip: Grip) -> Result<Motion, Breach> {
        let per_tick = UNIT / self.hz;
        let per_tick2 = per_tick / self.hz;
        let (mut v, mut d) = ((at.v * per_tick) as i128, (-at.a * per_tick2) as i128);
        let braking = Braking::new(&self.in_units(grip), v, d);
        let mut at = *at;
        for _ in 0..2 * SHORT {
            if v <= 0 {
                return Ok(at);
            }
            let next = braking.next(v, d);
            let course = Course {
                h: 1.0 / self.hz,
                jerk: [(d - next) as f32 * self.hz / per_tick2, 0.0, 0.0],
                ticks: [1, 0, 0],
            };
            at = self.follow(&at, &course, self.end - 1, BRAKING)?;
            (v, d) = (v - next, next);
            // Sums of so few digits would miss the rest.
            (at.v, at.a) = (v as f32 / per_tick, -(d as f32) / per_tick2);
        }
        Err(Breach::Velocity)
    }

    /// What a piece says of `grip`.
    fn in_units(&self, grip: Grip) -> BrakeLimits {
        let units = |x: f32, bits: u32| (x * (1_u64 << bits) as f32) as u32;
        let tick = 1.0 / self.hz;
        BrakeLimits {
            a: units(grip.a * tick * tick, BRAKE_A_FRAC),
            j: units(grip.down * tick * tick * tick, BRAKE_J_FRAC),
            ..BrakeLimits::default()
        }
    }
}
