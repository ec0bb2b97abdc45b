//! A way to rest: whether the motion can still be stopped within every limit, and how it slows down.
//!
//! In: a motion. Out: a [`Course`] down to a lower velocity at zero acceleration from whose end there is another way to
//! rest, or straight to rest. Every state that is planned has one, so nothing that lies ahead can be run over.

use heapless::Vec;

use super::brake::{brake, slow, Grip, Phases};
use super::course::{Course, Motion, PREDICTING};
use super::profile::{View, UNIT};

/// Longest phase of a braking manoeuvre, ticks: the rounding of its jerk to 2^-72 grows with the cube.
const MANOEUVRE_MAX: u32 = 8192;

/// Manoeuvres on a way to rest before the last leg.
const MANOEUVRES: usize = 2;

/// Legs of a way to rest.
const LEGS: usize = MANOEUVRES + 1;

/// What rounding may put a halt behind the end of the window, of its distance.
const ROUNDING: f32 = 1.0e-6;

/// Shares of the limits at its beginning that a manoeuvre is tried with: what lies ahead may allow less.
const SHARES: [f32; 2] = [0.99, 0.7];

/// A slowing down to zero acceleration: a part of a way to rest.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leg {
    /// Velocity at its end, path units/s. Where only the release is left it is what that leads to.
    to: f32,
    /// Phases; without a first one only the release is left.
    ticks: [u32; 3],
}

impl Leg {
    /// Its course from `at`.
    pub(super) fn course(&self, at: &Motion, h: f32) -> Option<Course> {
        if self.ticks[0] == 0 {
            return Some(Course::release(at, self.ticks[2], h));
        }
        Course::slowing(at, self.to, self.ticks, h)
    }
}

/// A way to rest: its legs, the last of them first.
pub(super) type Way = Vec<Leg, LEGS>;

impl View<'_> {
    /// A way to rest from `at` that keeps every limit: straight on, or after a manoeuvre or two.
    pub(super) fn refuge(&self, at: &Motion) -> Option<Way> {
        let mut way = Way::new();
        self.is_refuge(at, MANOEUVRES, &mut way).then_some(way)
    }

    fn is_refuge(&self, at: &Motion, most: usize, way: &mut Way) -> bool {
        if let Some(leg) = self.halting(at) {
            way.clear();
            return way.push(leg).is_ok();
        }
        most > 0 && self.braking(at, most, way)
    }

    /// The phases of `leg` from the planned state in whole units of jerk.
    pub(super) fn exactly(&self, leg: &Leg) -> Option<Phases> {
        if leg.ticks[0] == 0 {
            // Only the release is left; where that leads is given.
            let n = i128::from(leg.ticks[2]);
            return Some([
                (0, 0),
                (0, 0),
                (i64::try_from(-self.state.a / n).ok()?, leg.ticks[2]),
            ]);
        }
        let to = (leg.to / self.hz * UNIT) as i128;
        slow(&self.state, to, leg.ticks)
    }

    /// To rest whatever that takes.
    pub(super) fn forced(&self) -> Phases {
        let at = self.motion();
        self.shape(&at, 0.0, self.grip(&at))
            .and_then(|leg| self.exactly(&leg))
            .unwrap_or([(0, 1); 3])
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
    fn halting(&self, at: &Motion) -> Option<Leg> {
        let grip = self.grip(at);
        let last = self.end - 1;
        SHARES.iter().find_map(|&share| {
            let halt = self.shape(at, 0.0, grip.share(share))?;
            let course = halt.course(at, 1.0 / self.hz)?;
            let end = self.follow(at, &course, last, PREDICTING)?;
            let fits = end.node < last || end.left >= -ROUNDING * self.nodes.get(last).length;
            fits.then_some(halt)
        })
    }

    /// A leg from whose end there is a way to rest with `most` - 1 more at most: letting the acceleration go, or down to the
    /// velocity limit ahead that leaves the least room.
    fn braking(&self, at: &Motion, most: usize, way: &mut Way) -> bool {
        let here = self.grip(at);
        let rising = at.a.max(0.0);
        let peak = at.v + rising * rising / (2.0 * here.down);
        let mut to = |v: f32, grip: Grip| {
            SHARES.iter().any(|&share| {
                let after = |leg: &Leg| {
                    let course = leg.course(at, 1.0 / self.hz)?;
                    self.follow(at, &course, self.end - 1, PREDICTING)
                };
                let leg = self.shape(at, v, grip.share(share));
                leg.is_some_and(|leg| {
                    after(&leg).is_some_and(|end| self.is_refuge(&end, most - 1, way))
                        && way.push(leg).is_ok()
                })
            })
        };
        if at.a != 0.0 && to(peak.min(self.nodes.get(at.node).limits.v), here) {
            return true;
        }
        let mut distance = at.left;
        let mut lowest = peak;
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
            }
            if brake(at.v, at.a, 0.0, here).distance < distance {
                break;
            }
            distance += next.length;
        }
        tightest.is_some_and(|(cap, grip)| to(cap, grip))
    }

    /// Down to `to` and zero acceleration within `grip`, in whole ticks.
    fn shape(&self, at: &Motion, to: f32, grip: Grip) -> Option<Leg> {
        let time = brake(at.v, at.a, to, grip).time;
        let ticks = time.map(|t| libm::ceilf(t * self.hz) as u32);
        let mut ticks = [ticks[0], ticks[1], ticks[2].max(1)];
        if to <= 0.0 {
            ticks[0] = ticks[0].max(1);
        }
        let short = ticks.iter().all(|&n| n <= MANOEUVRE_MAX);
        short.then_some(Leg { to, ticks })
    }
}
