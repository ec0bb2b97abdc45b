//! A way to rest: whether the motion can still be stopped within every limit, and how it slows down.
//!
//! In: a motion. Out: a [`Course`] down to a lower velocity at zero acceleration from whose end there is another way to
//! rest, or straight to rest. Every state that is planned has one, so nothing that lies ahead can be run over.

use super::brake::{brake, slow, Grip, Phases};
use super::course::{Course, Motion, Tolerance, PREDICTING, TAKING};
use super::profile::{View, UNIT};

/// Longest phase of a braking manoeuvre, ticks: the rounding of its jerk to 2^-72 grows with the cube.
const MANOEUVRE_MAX: u32 = 8192;

/// Velocity limits ahead that a braking manoeuvre is tried for.
const TRIES: u32 = 3;

/// Manoeuvres on a way to rest.
const MANOEUVRES: u32 = 2;

/// What rounding may put a halt behind the end of the window, of its distance.
const ROUNDING: f32 = 1.0e-6;

/// Shares of the limits at its beginning that a manoeuvre is tried with: what lies ahead may allow less.
const SHARES: [f32; 3] = [0.99, 0.75, 0.5];

/// Down to a velocity.
#[derive(Clone, Copy)]
struct Manoeuvre {
    /// Path units/s.
    to: f32,
    course: Course,
}

impl View<'_> {
    /// Whether there is a way to rest from `at` that keeps every limit: straight on, or after a manoeuvre or two.
    pub(super) fn has_refuge(&self, at: &Motion) -> bool {
        self.is_refuge(at, MANOEUVRES)
    }

    fn is_refuge(&self, at: &Motion, most: u32) -> bool {
        self.halting(at, PREDICTING).is_some()
            || (most > 0 && self.braking(at, most, PREDICTING).is_some())
    }

    /// How to slow down from the planned state. Nothing is planned from which there is no way, but for what a change of the
    /// limits leaves.
    pub(super) fn slow_down(&self) -> Phases {
        let at = self.motion();
        self.braking(&at, MANOEUVRES, TAKING)
            .or_else(|| self.halting(&at, TAKING))
            .and_then(|manoeuvre| self.exactly(&manoeuvre))
            .or_else(|| self.exactly(&self.shape(&at, 0.0, self.grip(&at))?))
            .unwrap_or([(0, 1); 3])
    }

    /// The phases of `manoeuvre` from the planned state in whole units of jerk.
    fn exactly(&self, manoeuvre: &Manoeuvre) -> Option<Phases> {
        let ticks = manoeuvre.course.ticks;
        if ticks[0] == 0 {
            // Only the release is left; where that leads is given.
            let n = i128::from(ticks[2]);
            return Some([
                (0, 0),
                (0, 0),
                (i64::try_from(-self.state.a / n).ok()?, ticks[2]),
            ]);
        }
        let to = (manoeuvre.to / self.hz * UNIT) as i128;
        slow(&self.state, to, ticks)
    }

    /// What braking may do at `at`: jerk where the deceleration is built up, and where it is all there.
    pub(super) fn grip(&self, at: &Motion) -> Grip {
        self.grip_of(at.node, at.v, at.a)
    }

    fn grip_of(&self, node: usize, v: f32, a: f32) -> Grip {
        let limits = &self.nodes.get(node).limits;
        let most = limits.acceleration(v).down;
        let (here, there) = (limits.jerk(v, a), limits.jerk(v, -most.min(crate::units::sqrt(v * limits.jerk(v, 0.0).down))));
        Grip {
            a: most,
            down: here.down.min(there.down),
            up: there.up,
        }
    }

    /// To rest straight on, if that keeps every limit.
    fn halting(&self, at: &Motion, tolerance: Tolerance) -> Option<Manoeuvre> {
        let grip = self.grip(at);
        let last = self.end - 1;
        SHARES.iter().find_map(|&share| {
            let halt = self.shape(at, 0.0, grip.share(share))?;
            let end = self.follow(at, &halt.course, last, tolerance)?;
            let fits = end.node < last || end.left >= -ROUNDING * self.nodes.get(last).length;
            fits.then_some(halt)
        })
    }

    /// A manoeuvre from whose end there is a way to rest with `most` - 1 more at most: letting the acceleration go; down to
    /// the velocity limit ahead that leaves the least room, or to one of the first; down to a share of the velocity.
    fn braking(&self, at: &Motion, most: u32, tolerance: Tolerance) -> Option<Manoeuvre> {
        let here = self.grip(at);
        let rising = at.a.max(0.0);
        let peak = at.v + rising * rising / (2.0 * here.down);
        let to = |v: f32, grip: Grip| {
            SHARES.iter().find_map(|&share| {
                let manoeuvre = self.shape(at, v, grip.share(share))?;
                let end = self.follow(at, &manoeuvre.course, self.end - 1, tolerance)?;
                self.is_refuge(&end, most - 1).then_some(manoeuvre)
            })
        };
        if at.a != 0.0 {
            if let Some(manoeuvre) = to(peak.min(self.nodes.get(at.node).limits.v), here) {
                return Some(manoeuvre);
            }
        }
        let mut distance = at.left;
        let mut lowest = peak;
        let mut tries = 0;
        let mut tightest = None;
        let mut room = f32::MAX;
        for index in at.node..self.end {
            let node = self.nodes.get(index);
            let next = self.nodes.get(index + 1);
            let cap = node.exit_v.min(next.limits.v);
            if node.stop {
                break;
            }
            if cap < lowest {
                lowest = cap;
                let grip = here.least(self.grip_of(index, cap.min(node.limits.v), 0.0));
                let left = distance - brake(at.v, at.a, cap, grip).distance;
                if left < room {
                    room = left;
                    tightest = Some((cap, grip));
                }
                if tries < TRIES {
                    tries += 1;
                    if let Some(manoeuvre) = to(cap, grip) {
                        return Some(manoeuvre);
                    }
                }
            }
            if brake(at.v, at.a, 0.0, here).distance < distance {
                break;
            }
            distance += next.length;
        }
        tightest.and_then(|(cap, grip)| to(cap, grip)).or_else(|| {
            let shares = [0.9, 0.75, 0.5, 0.25].iter();
            shares
                .map(|share| share * at.v.min(lowest))
                .find_map(|v| to(v, here))
        })
    }

    /// Down to `to` and zero acceleration within `grip`, in whole ticks.
    fn shape(&self, at: &Motion, to: f32, grip: Grip) -> Option<Manoeuvre> {
        let h = 1.0 / self.hz;
        let time = brake(at.v, at.a, to, grip).time;
        let ticks = time.map(|t| libm::ceilf(t * self.hz) as u32);
        let mut ticks = [ticks[0], ticks[1], ticks[2].max(1)];
        if to <= 0.0 {
            ticks[0] = ticks[0].max(1);
        }
        if ticks.iter().any(|&n| n > MANOEUVRE_MAX) {
            return None;
        }
        let course = if ticks[0] == 0 {
            Course::release(at, ticks[2], h)
        } else {
            Course::slowing(at, to, ticks, h)?
        };
        Some(Manoeuvre { to, course })
    }
}
