//! A way to rest: whether the motion can still be stopped within every limit, and how it slows down.
//!
//! In: a motion. Out: a [`Way`]: steps of constant jerk that brake as hard as the limits allow at each place, perhaps behind
//! a leg down to a velocity limit ahead, and a last leg onto rest. Every state that is planned has one, so nothing that
//! lies ahead can be run over.

use heapless::Vec;

use super::brake::{brake, slow, Grip, Phases};
use super::course::{Course, Motion, PREDICTING};
use super::profile::{View, UNIT};
use crate::units::sqrt;

/// Longest phase of a leg, ticks: the rounding of its jerk to 2^-72 grows with the cube.
const PHASE_MAX: u32 = 8192;

/// Parts of a way to rest.
const PARTS: usize = 48;

/// What rounding may put a halt behind the end of the window, of its length.
const ROUNDING: f32 = 1.0e-6;

/// Kinds of ways in the order they are tried: in one leg or step by step, and the share of the limits they take. What lies
/// ahead may allow less than what is here.
const KINDS: [(bool, f32); 4] = [(true, 0.99), (false, 0.99), (false, 0.7), (true, 0.6)];

/// Ticks from rest in which whole ticks matter.
const SOON: f32 = 16.0;

/// Shares of the limits of its ends that a leg is tried with.
const LEGS: [f32; 2] = [0.99, 0.7];

/// Where between its ends a leg's deceleration is judged, as the share of the first velocity.
const MIDDLE: f32 = 0.7;

/// Share of the jerk that braking step by step takes.
const JERK: f32 = 0.99;

/// Share of the jerk at which it lets go of the last deceleration, and share of that it plans with before.
const RELEASE: f32 = 0.88;
const CLOSING: f32 = 0.95;

/// Share of the deceleration wanted within which it counts as reached.
const STEADY: f32 = 0.02;

/// Share of the velocity that one step of steady braking takes.
const PART: f32 = 0.15;

/// Part of what is left of a change of deceleration that one step makes.
const RAMP: f32 = 0.5;

/// Longest step, ticks.
const STEP_MAX: f32 = 1000.0;

/// A part of a way to rest.
#[derive(Clone, Copy, Debug)]
pub(super) enum Part {
    /// Constant jerk, path units/s^3, for whole ticks.
    Step { jerk: f32, ticks: u32 },
    /// Down to velocity `to`, path units/s, and zero acceleration, in phases of whole ticks.
    Leg { to: f32, ticks: [u32; 3] },
}

impl Part {
    /// Its course from `at`.
    pub(super) fn course(&self, at: &Motion, h: f32) -> Option<Course> {
        match *self {
            Self::Step { jerk, ticks } => Some(Course {
                jerk: [jerk, 0.0, 0.0],
                ticks: [ticks, 0, 0],
            }),
            Self::Leg { to, ticks } => Course::slowing(at, to, ticks, h),
        }
    }
}

/// A way to rest.
#[derive(Clone, Debug)]
pub(super) struct Way {
    /// The last of them first.
    parts: Vec<Part, PARTS>,
    /// Share of the limits it brakes with.
    share: f32,
    /// In one leg.
    straight: bool,
    /// Velocity limit that a leg leads to first, and share of the limits that takes.
    via: Option<(f32, usize, f32)>,
}

impl Way {
    /// At rest.
    pub(super) const fn new() -> Self {
        Self {
            parts: Vec::new(),
            share: 1.0,
            straight: true,
            via: None,
        }
    }

    pub(super) fn len(&self) -> usize { self.parts.len() }
    pub(super) fn kind(&self) -> (bool, Option<(f32, usize, f32)>) { (self.straight, self.via) }
    /// The next part.
    pub(super) fn next(&self) -> Option<&Part> {
        self.parts.last()
    }

    /// Takes the next part.
    pub(super) fn pop(&mut self) -> Option<Part> {
        self.parts.pop()
    }
}

impl View<'_> {
    /// A way to rest from `at` that keeps every limit, of the same kind as `known`.
    pub(super) fn same_refuge(&self, at: &Motion, known: &Way) -> Option<Way> {
        crate::planner::CNT[7].fetch_add(1, core::sync::atomic::Ordering::Relaxed);
        self.way(at, known.straight, known.share, known.via)
    }

    /// A way to rest from `at` that keeps every limit.
    pub(super) fn refuge(&self, at: &Motion) -> Option<Way> {
        crate::planner::CNT[4].fetch_add(1, core::sync::atomic::Ordering::Relaxed);
        let any = |via| {
            KINDS
                .iter()
                .find_map(|&(straight, share)| self.way(at, straight, share, via))
        };
        any(None).or_else(|| {
            let (to, last) = self.tightest(at)?;
            LEGS.iter().find_map(|&leg| any(Some((to, last, leg))))
        })
    }

    /// Braking from `at` with `share` of what is allowed, behind a leg `via` some velocity.
    fn way(
        &self,
        at: &Motion,
        straight: bool,
        share: f32,
        via: Option<(f32, usize, f32)>,
    ) -> Option<Way> {
        let mut way = Way {
            parts: Vec::new(),
            share,
            straight,
            via: None,
        };
        let mut at = *at;
        if let Some((to, last, leg)) = via {
            if to < at.v && last >= at.node {
                let part = self.leg(&at, to, self.grip(&at, to, last).share(leg))?;
                at = self.take(&mut way, &at, part)?;
                way.via = via;
            }
        }
        if straight {
            self.halt(&mut way, &at)?;
        } else {
            self.descend(&mut way, at)?;
        }
        way.parts.reverse();
        Some(way)
    }

    /// Adds the leg to rest.
    fn halt(&self, way: &mut Way, at: &Motion) -> Option<()> {
        let part = self.leg(at, 0.0, self.grip(at, 0.0, at.node).share(way.share))?;
        let end = self.take(way, at, part)?;
        self.rests(&end)
    }

    /// The motion at `end` of a leg to rest lies on the path.
    fn rests(&self, end: &Motion) -> Option<()> {
        let last = self.end - 1;
        let fits = end.node < last || end.left >= -ROUNDING * self.nodes.get(last).length;
        fits.then_some(())
    }

    /// Adds `part`, which begins at `at`, to `way`; the motion at its end.
    fn take(&self, way: &mut Way, at: &Motion, part: Part) -> Option<Motion> {
        let course = part.course(at, 1.0 / self.hz)?;
        let end = self.follow(at, &course, self.end - 1, PREDICTING)?;
        way.parts.push(part).ok()?;
        Some(end)
    }

    /// Adds the parts down to rest.
    fn descend(&self, way: &mut Way, mut at: Motion) -> Option<()> {
        loop {
            if !(at.v > 0.0) {
                return (at.a == 0.0).then_some(());
            }
            let limits = &self.nodes.get(at.node).limits;
            let jerks = limits.jerk(at.v, at.a);
            let rest = limits.jerk(0.0, 0.0).up;
            let release = RELEASE * jerks.up.min(rest);
            let soon = SOON / self.hz;
            if at.v <= release * soon * soon && self.halt(way, &at).is_some() {
                return Some(());
            }
            if at.a < 0.0 && at.a * at.a >= 1.9 * release * at.v {
                return self.rest(way, &at);
            }
            at = self.brake_step(way, &at, JERK * jerks.down, JERK * jerks.up, release)?;
        }
    }

    /// Adds one step of braking.
    fn brake_step(
        &self,
        way: &mut Way,
        at: &Motion,
        down: f32,
        up: f32,
        release: f32,
    ) -> Option<Motion> {
        let tick = 1.0 / self.hz;
        let goal = -way.share * self.deceleration(at, up);
        let ramp = (goal - at.a).abs();
        let scale = if ramp < STEADY * goal.abs() {
            PART * at.v / goal.abs()
        } else {
            (RAMP * ramp / up.min(down)).min(0.3 * sqrt(at.v / release))
        };
        let mut ticks = libm::floorf((scale * self.hz).clamp(1.0, STEP_MAX));
        loop {
            let time = ticks * tick;
            // Where velocity runs out, no more deceleration than can be let go of at its end: a^2 = 2 j v there.
            let half = 0.5 * CLOSING * release * time;
            let room = half * half + 2.0 * CLOSING * release * (at.v + 0.5 * time * at.a);
            let goal = goal.max(half - sqrt(room.max(0.0)));
            let jerk = ((goal - at.a) / time).clamp(-down, up);
            let step = Part::Step {
                jerk,
                ticks: ticks as u32,
            };
            if let Some(end) = self.take(way, at, step) {
                return Some(end);
            }
            if ticks <= 1.0 {
                return None;
            }
            ticks = libm::floorf(0.5 * ticks);
        }
    }

    /// Deceleration allowed from `at` on for as long as it takes to let go of it.
    fn deceleration(&self, at: &Motion, up: f32) -> f32 {
        let mut most = self.nodes.get(at.node).limits.acceleration(at.v).down;
        let mut covered = at.left;
        let mut index = at.node;
        while index + 1 < self.end && covered < at.v * (most.max(-at.a) / up) {
            index += 1;
            let node = self.nodes.get(index);
            let v = sqrt((at.v * at.v + 2.0 * at.a.min(0.0) * covered).max(0.0));
            most = most.min(node.limits.acceleration(v).down);
            covered += node.length;
        }
        most
    }

    /// Adds the leg onto rest, where velocity and deceleration end together.
    fn rest(&self, way: &mut Way, at: &Motion) -> Option<()> {
        let ticks = libm::ceilf(-2.0 * at.v / at.a * self.hz).clamp(2.0, PHASE_MAX as f32) as u32;
        let part = Part::Leg {
            to: 0.0,
            ticks: [ticks / 2, 0, ticks - ticks / 2],
        };
        let end = self.take(way, at, part)?;
        self.rests(&end)
    }

    /// The velocity limit ahead that leaves the least room for braking to it, and the node before it.
    fn tightest(&self, at: &Motion) -> Option<(f32, usize)> {
        let here = self.grip(at, 0.0, at.node);
        let rising = at.a.max(0.0);
        let mut lowest = at.v + rising * rising / (2.0 * here.down);
        let mut distance = at.left;
        let mut tightest = None;
        let mut room = f32::MAX;
        let halt = brake(at.v, at.a, 0.0, here).distance;
        for index in at.node..self.end {
            let node = self.nodes.get(index);
            let next = self.nodes.get(index + 1);
            let cap = node.exit_v.min(next.limits.v);
            if node.stop {
                break;
            }
            if cap < lowest {
                lowest = cap;
                let left = distance - brake(at.v, at.a, cap, here).distance;
                if left < room {
                    room = left;
                    tightest = Some((cap, index));
                }
            }
            if halt < distance {
                break;
            }
            distance += next.length;
        }
        tightest
    }

    /// What braking from `at` to velocity `to` in node `last` may do: jerk where the deceleration is built up, deceleration
    /// halfway, jerk where it is let go.
    pub(super) fn grip(&self, at: &Motion, to: f32, last: usize) -> Grip {
        let first = &self.nodes.get(at.node).limits;
        let end = &self.nodes.get(last).limits;
        let middle = MIDDLE * at.v + (1.0 - MIDDLE) * to;
        let most = first.acceleration(middle).down;
        let free = sqrt((at.v - to).max(0.0) * first.jerk(middle, 0.0).down);
        let half = first.jerk(middle, -0.5 * most.min(free)).down;
        Grip {
            a: most,
            down: first.jerk(at.v, at.a).down.min(half),
            up: end.jerk(to, 0.0).up,
        }
    }

    /// Down to `to` and zero acceleration within `grip`, in whole ticks.
    fn leg(&self, at: &Motion, to: f32, grip: Grip) -> Option<Part> {
        let time = brake(at.v, at.a, to, grip).time;
        let ticks = time.map(|t| (libm::ceilf(t * self.hz) as u32).max(1));
        let short = ticks.iter().all(|&n| n <= PHASE_MAX);
        short.then_some(Part::Leg { to, ticks })
    }

    /// The phases of `part` from the planned state in whole units of jerk.
    pub(super) fn exactly(&self, part: &Part) -> Option<Phases> {
        match *part {
            Part::Step { jerk, ticks } => {
                let unit = UNIT / (self.hz * self.hz * self.hz);
                Some([((jerk * unit) as i64, ticks), (0, 0), (0, 0)])
            }
            Part::Leg { to, ticks } => slow(&self.state, (to / self.hz * UNIT) as i128, ticks),
        }
    }

    /// To rest whatever that takes.
    pub(super) fn forced(&self) -> Phases {
        let at = self.motion();
        self.leg(&at, 0.0, self.grip(&at, 0.0, at.node))
            .and_then(|leg| self.exactly(&leg))
            .unwrap_or([(0, 1); 3])
    }
}
