//! A way to rest: whether the motion can still be stopped within every limit, and how it slows down.
//!
//! In: a motion. Out: a [`Course`] down to a lower velocity at zero acceleration from whose end there is another way to
//! rest, or straight to rest. Every state that is planned has one, so nothing that lies ahead can be run over.

use super::brake::{brake, slow, Phases};
use super::course::{Course, Motion, Tolerance, PREDICTING, TAKING};
use super::profile::{View, UNIT};

/// Longest phase of a braking manoeuvre, ticks: the rounding of its jerk to 2^-72 grows with the cube.
const MANOEUVRE_MAX: u32 = 8192;

/// Velocity limits ahead that a braking manoeuvre is tried for.
const TRIES: u32 = 3;

/// Manoeuvres on a way to rest.
const MANOEUVRES: u32 = 2;

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
            // Every way of braking begins by letting the acceleration go, with the jerk allowed here and
            // beyond the next joint.
            .or_else(|| self.letting_go(&at))
            .and_then(|manoeuvre| self.exactly(&manoeuvre))
            .or_else(|| self.exactly(&self.halt(&at)))
            .unwrap_or([(0, 1); 3])
    }

    fn letting_go(&self, at: &Motion) -> Option<Manoeuvre> {
        let here = self.nodes.get(at.node).limits;
        let rising = at.a.max(0.0);
        let j = here.j.min(self.beyond(at.node).j);
        let peak = at.v + rising * rising / (2.0 * j);
        let manoeuvre = self.shape(at, peak, here.a, j)?;
        let kept = self.follow(at, &manoeuvre.course, self.end - 1, TAKING);
        (rising > 0.0 && kept.is_some()).then_some(manoeuvre)
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

    /// To rest straight on, if that keeps every limit.
    fn halting(&self, at: &Motion, tolerance: Tolerance) -> Option<Manoeuvre> {
        let halt = self.halt(at);
        let last = self.end - 1;
        let end = self.follow(at, &halt.course, last, tolerance)?;
        let fits = end.node < last || end.left >= 0.0;
        fits.then_some(halt)
    }

    /// A manoeuvre from whose end there is a way to rest with `most` - 1 more at most: letting the acceleration go; down to
    /// the velocity limit ahead that leaves the least room, or to one of the first; down to a share of the velocity.
    fn braking(&self, at: &Motion, most: u32, tolerance: Tolerance) -> Option<Manoeuvre> {
        let here = self.nodes.get(at.node).limits;
        let (mut limit_a, mut limit_j) = (here.a, here.j);
        let rising = at.a.max(0.0);
        let peak = at.v + rising * rising / (2.0 * limit_j);
        let to = |v: f32, a: f32, j: f32| {
            let manoeuvre = self.shape(at, v, a, j)?;
            let end = self.follow(at, &manoeuvre.course, self.end - 1, tolerance)?;
            (self.safe(end) && self.is_refuge(&end, most - 1)).then_some(manoeuvre)
        };
        if at.a != 0.0 {
            if let Some(manoeuvre) = to(peak.min(here.v), limit_a, limit_j) {
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
                let left = distance - brake(at.v, at.a, cap, limit_a, limit_j).distance;
                if left < room {
                    room = left;
                    tightest = Some((cap, limit_a, limit_j));
                }
                if tries < TRIES {
                    tries += 1;
                    if let Some(manoeuvre) = to(cap, limit_a, limit_j) {
                        return Some(manoeuvre);
                    }
                }
            }
            if brake(at.v, at.a, 0.0, limit_a, limit_j).distance < distance {
                break;
            }
            distance += next.length;
            limit_a = limit_a.min(next.limits.a);
            limit_j = limit_j.min(next.limits.j);
        }
        tightest.and_then(|(cap, a, j)| to(cap, a, j)).or_else(|| {
            let shares = [0.9, 0.75, 0.5, 0.25].iter();
            shares
                .map(|share| share * at.v.min(lowest))
                .find_map(|v| to(v, limit_a, limit_j))
        })
    }

    /// Down to `to` and zero acceleration with the limits given, in whole ticks.
    fn shape(&self, at: &Motion, to: f32, limit_a: f32, limit_j: f32) -> Option<Manoeuvre> {
        let h = 1.0 / self.hz;
        let time = brake(at.v, at.a, to, limit_a, limit_j).time;
        let ticks = time.map(|t| libm::ceilf(t * self.hz) as u32);
        let ticks = [ticks[0], ticks[1], ticks[2].max(1)];
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

    /// To rest on the path as soon as the limits allow.
    fn halt(&self, at: &Motion) -> Manoeuvre {
        let here = self.nodes.get(at.node).limits;
        let (mut a, mut j) = (here.a, here.j);
        let mut b = brake(at.v, at.a, 0.0, a, j);
        let mut covered = at.left;
        let mut index = at.node;
        while covered < b.distance && !self.nodes.get(index).stop && index + 1 < self.end {
            index += 1;
            let node = self.nodes.get(index);
            if node.limits.a < a || node.limits.j < j {
                a = a.min(node.limits.a);
                j = j.min(node.limits.j);
                b = brake(at.v, at.a, 0.0, a, j);
            }
            covered += node.length;
        }
        let ticks = b.time.map(|t| libm::ceilf(t * self.hz) as u32);
        let ticks = [ticks[0].max(1), ticks[1], ticks[2].max(1)];
        let nothing = Course {
            jerk: [0.0; 3],
            ticks: [1, 0, 1],
        };
        Manoeuvre {
            to: 0.0,
            course: Course::slowing(at, 0.0, ticks, 1.0 / self.hz).unwrap_or(nothing),
        }
    }
}
