//! Where phases of constant jerk lead, and whether they keep the limits of the nodes: predicted in `f32`.
//!
//! In: a [`Motion`] and [`Phases`](super::brake::Phases)-like jerks over whole ticks. Out: the motion at their end, or which
//! limit breaks on the way. Sums over ticks in closed form, as [`PathState::after`](crate::interpolator::PathState::after)
//! has them in integers; many of these predictions are made for each piece that is planned.

use super::joint::Taken;
use super::limits::{Demand, Part, Share, BUILDS_UP};
use super::nodes::Node;
use super::profile::View;
use crate::units::{larger, smaller};

/// Motion in SI-like units.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    /// Node it is in.
    pub(super) node: usize,
    /// Distance left in `node`, path units.
    pub(super) left: f32,
    /// Path units/s.
    pub(super) v: f32,
    /// Path units/s^2.
    pub(super) a: f32,
}

impl Motion {
    /// After `n` ticks of `h` seconds at `jerk`: with a += j, v += a, s += v per tick, sums of the numbers to n and of
    /// their sums.
    fn after(&self, jerk: f32, n: f32, h: f32) -> Self {
        let step = jerk * h;
        let half = 0.5 * h * (n + 1.0);
        let third = (n + 2.0) * (1.0 / 3.0);
        Self {
            node: self.node,
            left: self.left - h * n * (self.v + half * (self.a + step * third)),
            v: self.v + n * (h * self.a + half * step),
            a: self.a + step * n,
        }
    }

    /// Least and largest velocity on the way to `to` at `jerk`, in ticks of `h` seconds.
    fn speeds(&self, to: &Self, jerk: f32, h: f32) -> [f32; 2] {
        let (low, high) = (smaller(self.v, to.v), larger(self.v, to.v));
        let step = jerk * h;
        if self.a * to.a >= 0.0 || to.a.abs() <= NO_TICK * step.abs() {
            return [low, high];
        }
        // The acceleration changes its sign on the way. The parabola through the velocities of the ticks,
        // v + n (a + j (n + 1) / 2) with a and j per tick, has its peak at n = -a / j - 1/2.
        let a = self.a + 0.5 * step;
        let extreme = self.v - 0.5 * a * a / jerk;
        [smaller(low, extreme), larger(high, extreme)]
    }
}

/// Jerks over whole ticks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Course {
    /// Seconds per tick.
    pub(super) h: f32,
    /// Path units/s^3.
    pub(super) jerk: [f32; 3],
    /// How long each holds.
    pub(super) ticks: [u32; 3],
}

impl Course {
    /// From `at` to velocity `to` and zero acceleration in phases of `ticks`, the middle one without jerk: the two equations of
    /// [`slow`](super::brake::slow).
    pub(super) fn slowing(at: &Motion, to: f32, ticks: [u32; 3], h: f32) -> Option<Self> {
        let n = ticks.map(|n| n as f32);
        let sum = |n: f32| 0.5 * n * (n + 1.0);
        // What a unit of jerk per tick adds to velocity at the end, in the first phase and in the last.
        let (x, z) = (sum(n[0]) + n[0] * (n[1] + n[2]), sum(n[2]));
        let d = n[0] * z - n[2] * x;
        if d == 0.0 {
            return None;
        }
        let (a, v) = (-at.a, (to - at.v) / h - at.a * (n[0] + n[1] + n[2]));
        let per_tick = 1.0 / (h * d);
        Some(Self {
            h,
            jerk: [
                (a * z - n[2] * v) * per_tick,
                0.0,
                (n[0] * v - a * x) * per_tick,
            ],
            ticks,
        })
    }

    /// The jerk that in `ticks` leads to the same velocity; none counts behind the end of the course.
    pub(super) fn mean(&self, ticks: u32) -> f32 {
        let all = ticks as f32;
        let (mut left, mut sum) = (all, 0.0);
        for (&jerk, &n) in self.jerk.iter().zip(&self.ticks) {
            // What a tick builds up counts from then on: n of them, with `left` to go before the first.
            let n = smaller(n as f32, left);
            sum += jerk * n * (left - 0.5 * (n - 1.0));
            left -= n;
        }
        sum / (0.5 * all * (all + 1.0))
    }

    /// The acceleration of `at` let go in `ticks`.
    pub(super) fn release(at: &Motion, ticks: u32, h: f32) -> Self {
        Self {
            h,
            jerk: [0.0, 0.0, -at.a / (h * ticks as f32)],
            ticks: [0, 0, ticks],
        }
    }
}

/// What a course breaks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Breach {
    /// A velocity, or the end of the path: braking less hard would break it as well.
    Velocity,
    /// An acceleration or a jerk.
    Change,
}

/// Ticks around a joint whose differences see both sides of it, third ones with jerk limited and otherwise second ones, and a
/// little more.
const AROUND: [f32; 2] = [2.0, 1.01];

/// Ticks within one node from which on the middle of a step is looked at, too: with jerk limited, and without.
const LONG: [f32; 2] = [6.0, 2.0];

/// Which tick's differences of positions are looked at: of the one that a motion is the end of, or of the one that begins there.
#[derive(Clone, Copy)]
enum Tick {
    Ending,
    Beginning,
}

impl Tick {
    /// Ticks by which the middle of its second differences lies behind the motion. That of third ones is half a tick further.
    fn behind(self) -> f32 {
        match self {
            Self::Ending => 1.0,
            Self::Beginning => 0.0,
        }
    }
}

/// Steps in which the end of a node is approached: Newton's method where the motion slows down.
const APPROACHES: u32 = 4;

/// An acceleration of the other sign that is less than this share of a tick of jerk is rounding.
const NO_TICK: f32 = 1.0 / 256.0;

/// What rounding may add to a velocity, relative to the largest on the way.
const ROUNDING: f32 = 3.0e-7;

/// What of a limit may be exceeded, relative.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tolerance {
    v: f32,
    a: f32,
    /// Jerk as so many times what there is of it.
    j: f32,
    /// What a joint takes counts so many times.
    taken: f32,
    /// Velocity backwards, of that at the beginning.
    back: f32,
}

impl Tolerance {
    /// Share of the limits that may be used.
    fn all(&self) -> Share {
        Share {
            a: self.a,
            j: self.j,
        }
    }
}

/// For what is to come.
pub(super) const PREDICTING: Tolerance = Tolerance {
    v: 1.000_004,
    a: 1.001,
    j: 1.001,
    taken: 1.0,
    back: 1.0e-5,
};

/// For braking that may begin at any tick, of which only some are tried: where it meets a joint is known less well.
pub(super) const BRAKING: Tolerance = Tolerance {
    taken: 1.06,
    ..PREDICTING
};

/// For what has come: a little more, for the rounding of the prediction.
pub(super) const TAKING: Tolerance = Tolerance {
    v: 1.000_008,
    a: 1.0015,
    j: 1.0015,
    taken: 1.0,
    back: 2.0e-5,
};

/// For what turns an acceleration into its opposite within a tick, where jerk is not limited.
pub(super) const DASHING: Tolerance = Tolerance {
    j: 2.0 / BUILDS_UP * 1.001,
    ..PREDICTING
};

impl View<'_> {
    /// Runs `course` from `from`; the motion at its end, or which limit breaks on the way. Does not go beyond node `last`.
    pub(super) fn follow(
        &self,
        from: &Motion,
        course: &Course,
        last: usize,
        tolerance: Tolerance,
    ) -> Result<Motion, Breach> {
        let h = course.h;
        let mut at = *from;
        let mut here = self.nodes.get(at.node);
        let mut fastest = from.v;
        let all = tolerance.all();
        // Braking for a hold is run in parts of a tick.
        let in_ticks = h * self.hz > 0.5;
        for (&jerk, &ticks) in course.jerk.iter().zip(&course.ticks) {
            // In a tick that sees the joint that takes `taken`, in `node` from where `left` of it is left.
            let passes = |node: &Node, left: f32, taken: &Taken, at: &Motion, tick: Tick| {
                let part = || self.seen_from(node, at, [left, at.left], tick);
                let passed = [at.v, tolerance.taken];
                let demand = self.demand(at, jerk, tick);
                self.keeps_beside(node, part, taken, &demand, all, passed)
            };
            // What is left of the node where this jerk has not been looked at yet.
            let mut open = at.left;
            // Where jerk is not limited, the first tick may be all of the acceleration.
            let first = if here.brisk && !in_ticks {
                Tick::Ending
            } else {
                Tick::Beginning
            };
            if ticks > 0 && !self.beside(here, &at, jerk, first, last, tolerance) {
                return Err(Breach::Change);
            }
            let mut remaining = ticks;
            while remaining > 0 {
                let mut n = remaining;
                let mut next = at.after(jerk, n as f32, h);
                let mut speeds = at.speeds(&next, jerk, h);
                if at.node < last && next.left < 0.0 {
                    // As far as it surely stays inside; over the joint tick by tick.
                    let end = next;
                    (n, next) = (0, at);
                    for _ in 0..APPROACHES {
                        speeds = next.speeds(&end, jerk, h);
                        let more = (next.left / (h * speeds[1])) as u32;
                        if more == 0 || more >= remaining - n {
                            break;
                        }
                        let there = at.after(jerk, (n + more) as f32, h);
                        if there.left < 0.0 {
                            break;
                        }
                        (n, next) = (n + more, there);
                    }
                    if n == 0 {
                        (n, next) = (1, at.after(jerk, 1.0, h));
                    }
                    speeds = at.speeds(&next, jerk, h);
                }
                remaining -= n;
                let v = speeds[1];
                fastest = larger(fastest, v);
                let rounded = fastest * ROUNDING;
                if v > here.limits.v * tolerance.v + rounded
                    || speeds[0] < -tolerance.back * fastest
                {
                    return Err(Breach::Velocity);
                }
                // Where the jerk or the node ends; within, what is asked of the axes hardly bends. Where jerk is not limited, a tick may
                // be all of the acceleration.
                let over = next.node < last && next.left < 0.0;
                let near = n > 1 && here.brisk && in_ticks;
                let inside = near || remaining == 0;
                if over && !passes(here, open, &here.exit_taken, &next, Tick::Ending) {
                    return Err(Breach::Change);
                }
                // Each point stands for its surroundings, where velocity may be above the straight line between two of them.
                let long = n as f32 * h * self.hz > LONG[usize::from(here.brisk)];
                let apart = h * if long { 0.5 } else { 1.0 } * n as f32;
                let bulge = larger(0.0, -0.125 * jerk * apart * apart);
                let holds = |point: &Motion, tick: Tick, surroundings: [f32; 2]| {
                    let v = point.v + bulge;
                    self.holds(here, &Motion { v, ..*point }, jerk, tick, surroundings, all)
                };
                let (mut middle, mut early) = (at, 0.5 * (at.left + next.left));
                let mut late = early;
                if long {
                    middle = at.after(jerk, (n / 2) as f32, h);
                    [early, late] = [at.left, next.left].map(|left| 0.5 * (middle.left + left));
                }
                let begins = long || remaining + n == ticks;
                if (begins && !holds(&at, first, [open, early]))
                    || (!over && inside && !holds(&next, Tick::Ending, [late, next.left]))
                    || (long && !holds(&middle, Tick::Ending, [early, late]))
                {
                    return Err(Breach::Change);
                }
                open = if !over && inside { next.left } else { late };
                while next.node < last && next.left < 0.0 {
                    let before = here;
                    next.node += 1;
                    here = self.nodes.get(next.node);
                    next.left += here.length;
                    open = here.length;
                    if before.stop
                        || v > smaller(before.exit_v, here.limits.v) * tolerance.v + rounded
                    {
                        return Err(Breach::Velocity);
                    }
                    let taken = &before.exit_taken;
                    let ends = remaining == 0 || !in_ticks || (taken.is_none() && !here.brisk);
                    // The differences of the tick behind a joint see it, too.
                    if !(passes(here, open, taken, &next, Tick::Ending)
                        && (ends || passes(here, open, taken, &next, Tick::Beginning)))
                    {
                        return Err(Breach::Change);
                    }
                    open = next.left;
                }
                at = next;
            }
            if ticks > 0 && !self.beside(here, &at, jerk, Tick::Ending, last, tolerance) {
                return Err(Breach::Change);
            }
        }
        Ok(at)
    }

    /// Runs `course` from `at` as far as the path is known.
    pub(super) fn run_on(&self, at: &Motion, course: &Course) -> Result<Motion, Breach> {
        self.follow(at, course, self.end - 1, PREDICTING)
    }

    /// What the differences of positions see of the motion in the tick that ends or begins at `at`: second ones the mean of two
    /// velocities, third ones the velocity between them.
    fn demand(&self, at: &Motion, jerk: f32, tick: Tick) -> Demand {
        let step = jerk / self.hz;
        let [a, v] = match tick {
            Tick::Ending => [at.a, at.v - at.a / self.hz],
            Tick::Beginning => [at.a + step, at.v],
        };
        let second = larger(0.0, v + 0.5 * a / self.hz);
        Demand::seen([second, a], [larger(0.0, v), a - 0.5 * step], jerk)
    }

    /// Whether `jerk` is allowed in `node` at `at`, over the part of it that this stands for.
    #[inline(never)]
    fn holds(
        &self,
        node: &Node,
        at: &Motion,
        jerk: f32,
        tick: Tick,
        surroundings: [f32; 2],
        share: Share,
    ) -> bool {
        let demand = self.demand(at, jerk, tick);
        let part = || self.seen_from(node, at, surroundings, tick);
        self.keeps(node, part, &demand, share)
    }

    /// The part of `node` that the differences of ticks see while its end is approached from `from` to `to`, about as fast as `at` is.
    fn seen_from(&self, node: &Node, at: &Motion, [from, to]: [f32; 2], tick: Tick) -> Part {
        let per_tick = at.v / self.hz;
        let (second, third) = (tick.behind(), if node.brisk { 0.0 } else { 0.5 });
        Part::between(
            node.length,
            [from + per_tick * (second + third), to + per_tick * second],
        )
    }

    /// Where `jerk` leads from `from` in `ticks`, whatever the limits.
    pub(super) fn along(&self, from: &Motion, jerk: f32, ticks: u32) -> Motion {
        let mut at = from.after(jerk, ticks as f32, 1.0 / self.hz);
        while at.left < 0.0 && at.node + 1 < self.end && !self.nodes.get(at.node).stop {
            at.node += 1;
            at.left += self.nodes.get(at.node).length;
        }
        at
    }

    /// Whether `jerk` is allowed beyond the joints that the differences of a few ticks see from `at`, which is in node `here`.
    fn beside(
        &self,
        here: &Node,
        at: &Motion,
        jerk: f32,
        tick: Tick,
        last: usize,
        tolerance: Tolerance,
    ) -> bool {
        let near = AROUND[usize::from(here.brisk)] * at.v / self.hz;
        let both = |before: &Node, after: &Node| {
            let parts = [[near, 0.0], [after.length, after.length - near]];
            [before, after].into_iter().zip(parts).all(|(node, part)| {
                let v = smaller(at.v, node.limits.v);
                let demand = self.demand(&Motion { v, ..*at }, jerk, tick);
                let passed = [at.v, tolerance.taken];
                let part = || Part::between(node.length, part);
                self.keeps_beside(
                    node,
                    part,
                    &before.exit_taken,
                    &demand,
                    tolerance.all(),
                    passed,
                )
            })
        };
        if at.node > 0 && here.length - at.left < near {
            let before = self.nodes.get(at.node - 1);
            if !before.stop && !both(before, here) {
                return false;
            }
        }
        let ahead = at.node < last && at.left < near && !here.stop;
        !ahead || both(here, self.nodes.get(at.node + 1))
    }
}
