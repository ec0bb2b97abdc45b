//! One decision: which jerk to run next, so that the motion stays safe.
//!
//! A state is safe if braking from it, with the limits of the segments ahead, meets every velocity limit
//! ahead. While the motion may gain speed, a decision takes the largest jerk whose outcome is safe. When it may
//! not, the current state is still safe, so a whole braking manoeuvre fits: it is solved in whole ticks and taken as
//! one. Where a programmed stop comes within reach, the rest of the way is solved to end exactly on it
//! ([`super::brake::land`], [`super::brake::hop`]).

use super::brake::{brake, dash, hop, land, slow, Phases};
use super::course::{Course, Motion, DASHING, PREDICTING, TAKING};
use super::guide::Guide;
use super::joint::Taken;
use super::limits::{Demand, Part, PathLimits, Range, Rates, Share};
use super::nodes::{Node, Nodes};
use super::refuge::{Hints, Way};
use crate::interpolator::{widen, PathState, T_FRAC};
use crate::units::{larger, smaller, sqrt};

/// Segments looked at ahead of the one being driven.
pub const LOOK_AHEAD: usize = 116;

/// How closely decisions are looked for: with jerk limited, where a piece bends the motion little, and without.
pub(super) struct Effort {
    /// Longest piece while speeding up or cruising, ticks.
    ticks: u32,
    /// Longest piece of a slowing down, ticks: a request that counts meanwhile waits for its end at most.
    pub(super) slowing: u32,
    /// Halvings of the range of jerks.
    halvings: u32,
    /// The first of them in which a way to rest of another kind is looked for.
    full: u32,
}

const EFFORTS: [Effort; 2] = [
    Effort {
        ticks: 10,
        slowing: 16,
        halvings: 5,
        full: 1,
    },
    Effort {
        ticks: 8,
        slowing: 10,
        halvings: 6,
        full: 3,
    },
];

/// Ticks below which a piece is not made shorter to end with its segment.
const SHORTEST: u32 = 4;

/// Phases of a rest-to-rest move, in ticks, that are tried at most where they are longer than the limits ask for.
const HOPS: u32 = 6;

/// The same for a rest-to-rest move with one acceleration, and its longest half that is tried, ticks.
const DASHES: u32 = 6;
const DASH_MAX: f32 = 256.0;

/// Part of that range that is tried first where jerk is limited.
const LEAST_GAIN: f32 = 1.0 / 8.0;

/// Lengths that the phases of a move from rest to rest are tried with, each twice the one before.
const CREEPS: u32 = 14;

/// Share of the limits that a landing takes at least: one that is taken early brakes too gently.
const GENTLE: f32 = 0.97;

/// The same where nothing is better: there the motion is to stop, and exactly there.
const LATE: f32 = 0.9;

/// Acceleration below this share of the limit counts as none: what rounding leaves after a manoeuvre.
const NO_ACCELERATION: f32 = 1.0e-5;

/// From this share of the velocity limit on the motion cruises: closing the rest would only dither.
const CRUISE: f32 = 1.0 - 1.0e-5;

/// Slack on velocity comparisons, relative.
pub(super) const SLACK: f32 = 1.0 + 2.0e-6;

/// What rounding may leave of a velocity or an acceleration of zero: path units per tick, per tick^2.
pub(super) const FINE: i128 = 1 << (T_FRAC - 42);

pub(super) const UNIT: f32 = (1_u128 << T_FRAC) as f32;

/// The window and the state at the end of what has been planned.
pub struct View<'a> {
    /// All nodes.
    pub nodes: &'a Nodes,
    /// Running number of the oldest of them.
    pub first: u32,
    /// Node the state is in.
    pub cursor: usize,
    /// Nodes that are looked at, from the oldest on. Beyond the last one the path is taken to end.
    pub end: usize,
    /// Node at whose end the motion can be at rest: the state was made safe for that.
    pub last: usize,
    /// State at the end of the last piece.
    pub state: PathState,
    /// Limits of the axes, with jerk and without.
    pub(super) rates: &'a [Rates; 2],
    /// The feed to follow.
    pub(super) guide: &'a Guide,
    /// Ticks per second.
    pub hz: f32,
}

/// Pieces that end in a programmed stop.
pub(super) type Landing = [(i64, u32); 4];

/// Three phases as a landing.
fn landing([x, y, z]: Phases) -> Landing {
    [(0, 0), x, y, z]
}

/// What to run.
#[derive(Clone, Debug)]
pub(super) enum Decision {
    /// One piece: jerk, ticks, and the way to rest from its end.
    Go(i64, u32, Way),
    /// On along the way to rest.
    GoOn,
    /// Two pieces onto the velocity limit, and the way to rest from there.
    Settle([(i64, u32); 2], Way),
    /// Three pieces from rest to rest.
    Creep(Phases),
    /// To rest at the end of node `stop`.
    Land {
        /// The pieces; the first ones may be empty.
        phases: Landing,
        /// Index of the node that ends there.
        stop: usize,
    },
}

/// The nearest programmed stop ahead.
struct StopAhead {
    index: usize,
    distance_q: i128,
    distance: f32,
}

impl View<'_> {
    fn rates(&self, index: usize) -> &Rates {
        &self.rates[usize::from(self.nodes.get(index).brisk)]
    }

    /// How closely decisions are looked for in node `index`.
    pub(super) fn effort(&self, index: usize) -> &'static Effort {
        &EFFORTS[usize::from(self.nodes.get(index).brisk)]
    }

    /// Accelerations allowed in node `index` over `part` at velocity `v`.
    pub(super) fn acceleration(&self, index: usize, part: Part, v: f32) -> Range {
        let limits = &self.nodes.get(index).limits;
        limits.acceleration(self.rates(index), part, v)
    }

    /// The same where both may be of one sign ([`CurveLimits::accelerations`](super::limits::CurveLimits::accelerations)).
    pub(super) fn accelerations(&self, index: usize, part: Part, v: f32) -> [f32; 2] {
        let limits = &self.nodes.get(index).limits;
        limits.accelerations(self.rates(index), part, v)
    }

    /// Jerks allowed in node `index` over `part` at velocity `v` and acceleration `a`.
    pub(super) fn jerk(&self, index: usize, part: Part, v: f32, a: f32) -> Range {
        let limits = &self.nodes.get(index).limits;
        limits.jerk(self.rates(index), part, v, a)
    }

    /// Whether `node` allows `demand` over `part` within `share` of the limits.
    #[inline]
    pub(super) fn keeps(
        &self,
        node: &Node,
        part: impl FnOnce() -> Part,
        demand: &Demand,
        share: Share,
    ) -> bool {
        node.limits
            .keeps(&self.rates[usize::from(node.brisk)], part, demand, share)
    }

    /// The same in a tick that sees a joint passed at velocity `over`, which takes `weight` times what is `taken`.
    #[inline]
    pub(super) fn keeps_beside(
        &self,
        node: &Node,
        part: impl FnOnce() -> Part,
        taken: &Taken,
        demand: &Demand,
        share: Share,
        passed: [f32; 2],
    ) -> bool {
        let rates = &self.rates[usize::from(node.brisk)];
        node.limits
            .keeps_beside(rates, part, demand, share, taken, passed)
    }

    /// Limits in node `index` over `part` at velocity `v`, whichever way the motion is changed.
    pub(super) fn at(&self, index: usize, part: Part, v: f32) -> PathLimits {
        let limits = &self.nodes.get(index).limits;
        limits.at(self.rates(index), part, v)
    }

    /// Jerk allowed in node `index` at standstill.
    fn still_jerk(&self, index: usize) -> f32 {
        let limits = &self.nodes.get(index).limits;
        limits.still_jerk(self.rates(index), self.whole(index))
    }

    /// All of node `index`.
    pub(super) fn whole(&self, index: usize) -> Part {
        Part::whole(self.nodes.get(index).length)
    }

    /// What is left of its node from `at` on.
    pub(super) fn ahead(&self, at: &Motion) -> Part {
        Part::between(self.nodes.get(at.node).length, [at.left, 0.0])
    }

    pub(super) fn motion(&self) -> Motion {
        let left = widen(self.nodes.get(self.cursor).length_q) - self.state.s;
        Motion {
            node: self.cursor,
            left: left as f32 / UNIT,
            v: self.state.v as f32 / UNIT * self.hz,
            a: self.state.a as f32 / UNIT * self.hz * self.hz,
        }
    }

    fn stop_ahead(&self) -> Option<StopAhead> {
        let mut distance_q = -self.state.s;
        for index in self.cursor..self.end {
            let node = self.nodes.get(index);
            distance_q += widen(node.length_q);
            if node.stop {
                return Some(StopAhead {
                    index,
                    distance_q,
                    distance: distance_q as f32 / UNIT,
                });
            }
        }
        None
    }

    /// Length of a phase of a rest-to-rest move over the distance to `stop`, s, if it is less than `below`: such a move takes
    /// about 4 cbrt(D / 2 J) with the jerk J at standstill.
    fn hop_time(&self, stop: &StopAhead, below: f32) -> Option<f32> {
        let time = |j: f32| libm::cbrtf(larger(stop.distance, 0.0) / (2.0 * j));
        // The window is long: the jerk on the way is of no matter where that here is too much already.
        if time(self.still_jerk(self.cursor)) >= below {
            return None;
        }
        let jerks = (self.cursor..=stop.index).map(|index| self.still_jerk(index));
        Some(time(jerks.fold(f32::MAX, smaller))).filter(|&time| time < below)
    }

    /// The next thing to run; `begun` is the slowing down that can be gone on with, and must be where nothing better is
    /// found.
    #[must_use]
    pub(super) fn decide(&self, begun: Option<&Course>, known: &Way) -> Decision {
        let stop = self.stop_ahead();
        if let Some(stop) = &stop {
            // What rounding leaves of a standstill is one: nothing could be done from it a whole tick long.
            let at_rest = self.state.v.abs() < FINE && self.state.a.abs() < FINE;
            let decision = if at_rest {
                let dash = self.try_dash(stop);
                dash.or_else(|| self.try_hop(stop).map(landing))
            } else {
                self.try_land(stop, GENTLE).map(landing)
            };
            if let Some(phases) = decision {
                return Decision::Land {
                    phases,
                    stop: stop.index,
                };
            }
        }
        self.greedy(stop.as_ref(), begun, known)
    }

    fn greedy(&self, stop: Option<&StopAhead>, begun: Option<&Course>, known: &Way) -> Decision {
        let start = self.motion();
        let node = self.nodes.get(start.node);
        let limits = &node.limits;
        let effort = self.effort(start.node);
        let here = self.ahead(&start);
        let range = self.acceleration(start.node, here, start.v);
        let jerks = self.jerk(start.node, here, start.v, start.a);
        // Short against the time the acceleration takes to build up.
        let still = self.at(start.node, here, 0.0);
        let mut scale = still.a / still.j;
        if let Some(time) = stop.and_then(|stop| self.hop_time(stop, scale)) {
            scale = time;
        }
        // Nothing builds up while cruising, nor at the limit of acceleration where jerk is no matter.
        let top = limits.v;
        let cruising = start.v >= top * CRUISE && start.a.abs() <= NO_ACCELERATION * still.a;
        let mut ticks = if cruising || (start.a >= 0.999 * range.up && node.brisk) {
            effort.ticks
        } else {
            ((scale * self.hz * 0.125) as u32).clamp(1, effort.ticks)
        };
        // Behind the joint there is another acceleration to be had, at once.
        if node.brisk && !cruising && ticks > SHORTEST {
            let inside = smaller(start.left / start.v * self.hz, ticks as f32) as u32;
            ticks = ticks.min(inside + 1).max(SHORTEST);
        }
        // Nothing is to be gained before the joint where the next segment is faster.
        let next = self.nodes.get(start.node + 1).limits.v;
        if cruising && smaller(node.exit_v, next) > top {
            let inside = smaller(start.left / start.v * self.hz, ticks as f32) as u32;
            ticks = ticks.min(inside + 1);
        }
        let floor = begun.map_or(0.0, |course| course.mean(ticks));
        let unit = UNIT / (self.hz * self.hz * self.hz);
        let time = ticks as f32 / self.hz;
        let after = |jerk: f32, ticks: u32| {
            let course = Course {
                h: 1.0 / self.hz,
                jerk: [jerk, 0.0, 0.0],
                ticks: [ticks, 0, 0],
            };
            self.run_on(&start, &course).ok()
        };
        let end = |jerk: f32| after(jerk, ticks);
        let like = |jerk: f32, way: &Way| self.same_refuge(&end(jerk)?, way);
        let same = |jerk: f32| like(jerk, known);
        let hints = core::cell::Cell::new(Hints::of(known));
        let refuge = |at: &Motion| {
            let mut found = hints.get();
            let way = self.refuge(at, &mut found);
            hints.set(found);
            way
        };
        let any = |jerk: f32| refuge(&end(jerk)?);
        let go = |jerk: f32, way: Way| Decision::Go((jerk * unit) as i64, ticks, way);
        let release = -start.a / time;
        if cruising && release >= floor {
            if let Some(way) = same(release).or_else(|| any(release)) {
                return go(release, way);
            }
            // A stop is near: on as far as it can still be met.
            let shorter = [ticks / 2, ticks / 4, 1];
            let found = shorter.into_iter().find_map(|ticks| {
                let release = -start.a * self.hz / ticks as f32;
                let way = refuge(&after(release, ticks)?)?;
                Some(Decision::Go((release * unit) as i64, ticks, way))
            });
            if let Some(decision) = found {
                return decision;
            }
        }
        if let Some((jerk, ticks)) = self.guided(&start) {
            if let Some(at) = after(jerk, ticks) {
                let way = self.guided_refuge(&at, known);
                if let Some(way) = way {
                    return Decision::Go((jerk * unit) as i64, ticks, way);
                }
            }
        }
        let high = smaller(jerks.up, (range.up - start.a) / time);
        if high <= floor {
            return Decision::GoOn;
        }
        if let Some((phases, way)) = self.settle(&start, floor, jerks) {
            return Decision::Settle(phases, way);
        }
        if let Some(way) = same(high) {
            return go(high, way);
        }
        // Where not even a small gain can be had, as while braking is gone on with, nothing else is tried. Not so where acceleration
        // builds up at once: near the floor it takes as many ticks as there are.
        let (mut good, mut bad) = (floor, high);
        let mut found = None;
        if !node.brisk {
            good += LEAST_GAIN * (high - floor);
            found = same(good).or_else(|| any(good));
        }
        if node.brisk || found.is_some() {
            if let Some(way) = any(high) {
                return go(high, way);
            }
            for k in 0..effort.halvings {
                let middle = 0.5 * (good + bad);
                let full = || (k < effort.full).then(|| any(middle)).flatten();
                let way = like(middle, found.as_ref().unwrap_or(known));
                if let Some(way) = way.or_else(full) {
                    found = Some(way);
                    good = middle;
                } else {
                    bad = middle;
                }
            }
        }
        if let Some(way) = found {
            return go(good, way);
        }
        if begun.is_none() && self.state.v == 0 {
            return self.creep();
        }
        if let Some(stop) = stop {
            if let Some(phases) = self.try_land(stop, LATE) {
                return Decision::Land {
                    phases: landing(phases),
                    stop: stop.index,
                };
            }
        }
        Decision::GoOn
    }

    /// Onto the velocity limit of the node, exactly, where that is near and there is next to no acceleration.
    fn settle(&self, at: &Motion, floor: f32, jerks: Range) -> Option<([(i64, u32); 2], Way)> {
        let top = self.nodes.get(at.node).limits.v;
        let gap = top - at.v;
        let jerk = smaller(jerks.up, jerks.down);
        let n = libm::ceilf(sqrt(gap / jerk) * self.hz);
        if !(floor <= 0.0 && 0.0 < gap && n <= self.effort(at.node).ticks as f32) {
            return None;
        }
        let n = (n as u32).max(1);
        let to = f64::from(top) / f64::from(self.hz) * f64::from(UNIT);
        let phases = slow(&self.state, to as i128, [n, 0, n])?;
        let course = self.course(&phases);
        let end = self.run_on(at, &course).ok()?;
        let [up, _, down] = phases;
        Some(([up, down], self.refuge(&end, &mut Hints::default())?))
    }

    /// From rest over the next joint and to rest again, as slowly as that takes: slowed down far enough, every motion keeps
    /// every limit.
    fn creep(&self) -> Decision {
        let start = self.motion();
        let here = self.nodes.get(start.node);
        let beyond = if here.stop || start.node + 1 >= self.end {
            0
        } else {
            widen(self.nodes.get(start.node + 1).length_q) / 2
        };
        let distance = widen(here.length_q) - self.state.s + beyond;
        let found = (0..CREEPS).find_map(|k| {
            let m = 2 << k;
            let j = hop(distance, m);
            let phases = [(j, m), (-j, 2 * m), (j, m)];
            let course = self.course(&phases);
            let end = self.run_on(&start, &course);
            end.is_ok().then_some(phases)
        });
        found.map_or(Decision::GoOn, Decision::Creep)
    }

    /// From rest to rest at `stop` with one acceleration, where jerk is not limited.
    fn try_dash(&self, stop: &StopAhead) -> Option<Landing> {
        let start = self.motion();
        if !self.nodes.get(start.node).brisk || stop.distance_q <= 0 {
            return None;
        }
        let time = |a: f32| libm::ceilf(sqrt(stop.distance / a) * self.hz);
        let still = |index: usize| {
            let Range { down, up } = self.acceleration(index, self.whole(index), 0.0);
            smaller(down, up)
        };
        // The window is long: what lies behind is of no matter where it is too far already.
        if !(time(still(start.node)) <= DASH_MAX) {
            return None;
        }
        let least = (start.node..=stop.index).map(still).fold(f32::MAX, smaller);
        let n = (time(least).max(1.0)) as u32;
        // With the pause it takes a tick more, and less acceleration.
        ((2 * n - 1).max(2)..2 * n + DASHES).find_map(|ticks| {
            let phases = dash(stop.distance_q, ticks / 2, ticks % 2)?;
            let [w, x, y, z] = phases;
            let run = |at: &Motion, phases: &Phases| {
                self.follow(at, &self.course(phases), stop.index, DASHING)
                    .ok()
            };
            run(&run(&start, &[w, x, y])?, &[z, (0, 0), (0, 0)])?;
            Some(phases)
        })
    }

    fn try_hop(&self, stop: &StopAhead) -> Option<Phases> {
        if stop.distance_q <= 0 {
            // Rounding has carried the motion onto the stop.
            return Some([(0, 1), (0, 0), (0, 1)]);
        }
        let start = self.motion();
        let time = self.hop_time(stop, f32::INFINITY)?;
        let shortest = libm::ceilf(time * self.hz).max(1.0) as u32;
        // A longer one where a tick is all the difference.
        (shortest..shortest.max(HOPS) + 2).find_map(|m| {
            let j = hop(stop.distance_q, m);
            let phases = [(j, m), (-j, 2 * m), (j, m)];
            let course = self.course(&phases);
            let end = self.follow(&start, &course, stop.index, PREDICTING);
            end.is_ok().then_some(phases)
        })
    }

    fn try_land(&self, stop: &StopAhead, least: f32) -> Option<Phases> {
        let m = self.motion();
        let grip = self.grip(&m, 0.0, m.node);
        let reach = |share: f32| brake(m.v, m.a, 0.0, grip.share(share));
        let (mut low, mut high) = (least, 1.0);
        let distance = stop.distance;
        if !(distance > 0.0) || reach(low).distance < distance || reach(high).distance > distance {
            return None;
        }
        for _ in 0..14 {
            let middle = 0.5 * (low + high);
            if reach(middle).distance > distance {
                low = middle;
            } else {
                high = middle;
            }
        }
        let time = reach(high).time;
        let whole = time.map(|t| (libm::roundf(t * self.hz) as u32).max(1));
        for [x, y, z] in [
            [0, 0, 0],
            [0, 1, 0],
            [1, 0, 0],
            [0, 0, 1],
            [1, 0, 1],
            [1, 1, 1],
            [2, 1, 2],
        ] {
            let ticks = [whole[0] + x, whole[1] + y, whole[2] + z];
            if let Some(phases) = land(&self.state, stop.distance_q, ticks) {
                if self
                    .follow(&m, &self.course(&phases), stop.index, TAKING)
                    .is_ok()
                {
                    return Some(phases);
                }
            }
        }
        None
    }

    /// Path units/s^3 of a jerk per tick.
    pub(super) fn jerk_of(&self, jerk: i64) -> f32 {
        jerk as f32 * (self.hz * self.hz * self.hz / UNIT)
    }

    /// `phases` as a course.
    pub(super) fn course(&self, phases: &Phases) -> Course {
        Course {
            h: 1.0 / self.hz,
            jerk: phases.map(|(jerk, _)| self.jerk_of(jerk)),
            ticks: phases.map(|(_, ticks)| ticks),
        }
    }
}
