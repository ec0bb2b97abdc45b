//! One decision: which jerk to run next, so that the motion stays safe.
//!
//! A state is safe if braking from it, with the limits of the segments ahead, meets every velocity limit
//! ahead. While the motion may gain speed, a decision takes the largest jerk whose outcome is safe. When it may
//! not, the current state is still safe, so a whole braking manoeuvre fits: it is solved in whole ticks and taken as
//! one. Where a programmed stop comes within reach, the rest of the way is solved to end exactly on it
//! ([`super::brake::land`], [`super::brake::hop`]).

use super::brake::{brake, hop, land, Phases};
use super::course::Motion;
use super::limits::PathLimits;
use super::nodes::Nodes;
use crate::interpolator::{widen, PathState, T_FRAC};

/// Segments looked at ahead of the one being driven.
pub const LOOK_AHEAD: usize = 128;

/// Longest greedy piece.
const TICKS_MAX: u32 = 10;

/// Braking is predicted with this share of the limits; the rest absorbs the rounding of phases to whole ticks.
const PREDICTED: f32 = 0.97;

/// Acceleration below this share of the limit counts as none: what rounding leaves after a manoeuvre.
const NO_ACCELERATION: f32 = 1.0e-5;

/// From this share of the velocity limit on the motion cruises: closing the rest would only dither.
const CRUISE: f32 = 1.0 - 1.0e-5;

/// Slack on velocity comparisons, relative.
pub(super) const SLACK: f32 = 1.0 + 2.0e-6;

/// What rounding may leave of a velocity or an acceleration of zero: path units per tick, per tick^2.
pub(super) const FINE: i128 = 1 << (T_FRAC - 42);

/// Velocity backwards that a release may end with: the rounding of three integer jerks.
const BACKWARDS: f32 = (1_u32 << 26) as f32;

pub(super) const UNIT: f32 = (1_u128 << T_FRAC) as f32;

/// The window and the state at the end of what has been planned.
pub struct View<'a> {
    /// All nodes.
    pub nodes: &'a Nodes,
    /// Node the state is in.
    pub cursor: usize,
    /// Nodes that are looked at, from the oldest on. Beyond the last one the path is taken to end.
    pub end: usize,
    /// Node at whose end the motion can be at rest: the state was made safe for that.
    pub last: usize,
    /// State at the end of the last piece.
    pub state: PathState,
    /// Ticks per second.
    pub hz: f32,
}

/// What to run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Decision {
    /// One greedy piece: jerk, ticks.
    Go(i64, u32),
    /// Three pieces down to a lower velocity at zero acceleration.
    Slow(Phases),
    /// Three pieces to rest at the end of node `stop`.
    Land {
        /// The pieces.
        phases: Phases,
        /// Index of the node that ends there.
        stop: usize,
    },
}

/// The nearest programmed stop ahead.
struct StopAhead {
    index: usize,
    distance_q: i128,
    distance: f32,
    v: f32,
    a: f32,
    j: f32,
}

impl View<'_> {
    pub(super) fn motion(&self) -> Motion {
        let left = widen(self.nodes.get(self.cursor).length_q) - self.state.s;
        Motion {
            node: self.cursor,
            left: left as f32 / UNIT,
            v: self.state.v as f32 / UNIT * self.hz,
            a: self.state.a as f32 / UNIT * self.hz * self.hz,
        }
    }

    /// Limits behind the joint at the end of node `index`; its own where the path stops there. What lies behind a
    /// stop may or may not have come yet, and must not be looked at.
    pub(super) fn beyond(&self, index: usize) -> PathLimits {
        let node = self.nodes.get(index);
        if node.stop || index + 1 >= self.end {
            node.limits
        } else {
            self.nodes.get(index + 1).limits
        }
    }

    fn stop_ahead(&self) -> Option<StopAhead> {
        let first = self.nodes.get(self.cursor);
        let mut found = StopAhead {
            index: self.cursor,
            distance_q: -self.state.s,
            distance: 0.0,
            v: f32::MAX,
            a: first.limits.a,
            j: first.limits.j,
        };
        for index in self.cursor..self.end {
            let node = self.nodes.get(index);
            found.distance_q += widen(node.length_q);
            found.v = found.v.min(node.limits.v);
            found.a = found.a.min(node.limits.a);
            found.j = found.j.min(node.limits.j);
            if node.stop {
                found.index = index;
                found.distance = found.distance_q as f32 / UNIT;
                return Some(found);
            }
            found.v = found.v.min(node.exit_v);
        }
        None
    }

    /// Whether braking from `at` keeps every limit ahead.
    pub(super) fn safe(&self, at: Motion) -> bool {
        let here = self.nodes.get(at.node).limits;
        let (mut limit_a, mut limit_j) = (here.a, here.j);
        let rising = at.a.max(0.0);
        if at.v < 0.0 || at.v + rising * rising / (2.0 * limit_j) > here.v * SLACK {
            return false;
        }
        // Rounding the phases of a manoeuvre to whole ticks may cost the travel of two.
        let mut distance = at.left - 2.0 * at.v / self.hz;
        for index in at.node..self.end {
            let node = self.nodes.get(index);
            let (a, j) = (PREDICTED * limit_a, PREDICTED * limit_j);
            let peak = at.v + rising * rising / (2.0 * j);
            let next = self.nodes.get(index + 1);
            let open = node.stop || index + 1 == self.end;
            let cap = if open {
                0.0
            } else {
                node.exit_v.min(next.limits.v)
            };
            if cap < peak {
                // Braking ends with zero acceleration, so the next segment may allow as little as it likes.
                if brake(at.v, at.a, cap, a, j).distance > distance {
                    return false;
                }
            } else if next.limits.a < at.a.abs() {
                let t = (at.a.abs() - next.limits.a) / j;
                let covered = t * (at.v + t * (at.a / 2.0 - j.copysign(at.a) * t / 6.0));
                if covered > distance {
                    return false;
                }
            }
            if open {
                break;
            }
            if cap > 0.0 && brake(at.v, at.a, 0.0, a, j).distance <= distance {
                break;
            }
            distance += next.length;
            limit_a = limit_a.min(next.limits.a);
            limit_j = limit_j.min(next.limits.j);
        }
        true
    }

    /// Runs `jerk` (path units / s^3) for `ticks` and says where that leads, or `None` if a limit breaks on the way.
    fn probe(&self, start: Motion, jerk: f32, ticks: u32) -> Option<Motion> {
        let dt = 1.0 / self.hz;
        let mut m = start;
        for _ in 0..ticks {
            m.a += jerk * dt;
            m.v += m.a * dt;
            m.left -= m.v * dt;
            while m.left < 0.0 && !self.nodes.get(m.node).stop {
                let node = self.nodes.get(m.node);
                let next = self.nodes.get(m.node + 1);
                let cap = node.exit_v.min(next.limits.v);
                // The tick that crosses the joint counts, and the one before it: the joint lies between.
                if m.v.max(m.v - m.a * dt) > cap * SLACK {
                    return None;
                }
                m.left += next.length;
                m.node += 1;
                if jerk.abs() > next.limits.j * SLACK || m.a.abs() > next.limits.a * 1.001 {
                    return None;
                }
            }
            if m.left < 0.0 {
                return None;
            }
        }
        Some(m)
    }

    /// The next thing to run.
    #[must_use]
    pub fn decide(&self) -> Decision {
        let stop = self.stop_ahead();
        if let Some(stop) = &stop {
            // What rounding leaves of a standstill is one: nothing could be done from it a whole tick long.
            let at_rest = self.state.v.abs() < FINE && self.state.a.abs() < FINE;
            let decision = if at_rest {
                self.try_hop(stop)
            } else {
                self.try_land(stop)
            };
            if let Some(phases) = decision {
                return Decision::Land {
                    phases,
                    stop: stop.index,
                };
            }
        }
        self.greedy(stop.as_ref())
    }

    fn greedy(&self, stop: Option<&StopAhead>) -> Decision {
        let start = self.motion();
        let limits = self.nodes.get(self.cursor).limits;
        // Short against the time the acceleration takes to build up, here and in the next segment.
        let next = self.beyond(self.cursor);
        let mut scale = (limits.a / limits.j).min(next.a / next.j);
        if let Some(stop) = stop {
            // A rest-to-rest move over this distance takes about 4 cbrt(D / 2 J).
            scale = scale.min(libm::cbrtf(stop.distance.max(0.0) / (2.0 * stop.j)));
        }
        // Nothing builds up while cruising, nor at the limit of acceleration where jerk is no matter.
        let steady = (start.v >= limits.v * CRUISE && start.a.abs() <= NO_ACCELERATION * limits.a)
            || (start.a >= 0.999 * limits.a && self.nodes.get(self.cursor).brisk);
        let ticks = if steady {
            TICKS_MAX
        } else {
            ((scale * self.hz * 0.125) as u32).clamp(1, TICKS_MAX)
        };
        let time = ticks as f32 / self.hz;
        let high = limits.j.min((limits.a - start.a) / time);
        // The least jerk worth trying: keeps the velocity, or releases the acceleration.
        let low = (-limits.j).max(-start.a / time);
        let scale = UNIT / (self.hz * self.hz * self.hz);
        let likely = |jerk: f32| self.probe(start, jerk, ticks).is_some_and(|m| self.safe(m));
        let sure = |jerk: f32| self.has_refuge(&self.advanced(&start, jerk, ticks));
        let ok = |jerk: f32| likely(jerk) && sure(jerk);
        let between = |ok: &dyn Fn(f32) -> bool| {
            let (mut good, mut bad) = (low, high);
            for _ in 0..12 {
                let middle = 0.5 * (good + bad);
                if ok(middle) {
                    good = middle;
                } else {
                    bad = middle;
                }
            }
            good
        };
        let jerk = if high >= low && ok(high) {
            high
        } else if high >= low && start.v >= limits.v * CRUISE && ok(low) {
            low
        } else if high >= low && start.a >= 0.0 && ok(low) {
            // A way to rest is looked for at the end first: that takes longer than all else.
            let jerk = between(&likely);
            if sure(jerk) {
                jerk
            } else {
                between(&ok)
            }
        } else {
            return Decision::Slow(self.slow_down());
        };
        Decision::Go((jerk * scale) as i64, ticks)
    }

    fn try_hop(&self, stop: &StopAhead) -> Option<Phases> {
        if stop.distance_q <= 0 {
            // Rounding has carried the motion onto the stop.
            return Some([(0, 1), (0, 0), (0, 1)]);
        }
        let time = libm::cbrtf(stop.distance / (2.0 * stop.j));
        let m = libm::ceilf(time * self.hz).max(1.0);
        let j = stop.distance / (2.0 * m * m * m);
        let (v, a) = (j * m * m * self.hz, j * m * self.hz * self.hz);
        if v > stop.v || a > stop.a {
            return None;
        }
        let m = m as u32;
        let j = hop(stop.distance_q, m);
        Some([(j, m), (-j, 2 * m), (j, m)])
    }

    fn try_land(&self, stop: &StopAhead) -> Option<Phases> {
        let m = self.motion();
        let reach = |j: f32| brake(m.v, m.a, 0.0, stop.a, j);
        let (mut low, mut high) = (0.5 * stop.j, stop.j);
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
                if self.run(&phases, stop.index).is_some() {
                    return Some(phases);
                }
            }
        }
        None
    }

    /// Runs `phases`; the state at their end and the node it lies in, or `None` if a limit breaks on the way.
    /// Does not go beyond node `last`.
    pub(super) fn run(&self, phases: &Phases, last: usize) -> Option<(PathState, usize)> {
        let jerk_scale = self.hz * self.hz * self.hz / UNIT;
        let mut state = self.state;
        let mut node = self.cursor;
        for &(j, ticks) in phases {
            let jerk = (j as f32 * jerk_scale).abs();
            if ticks > 0 && jerk > self.nodes.get(node).limits.j * 1.001 {
                return None;
            }
            let mut left = ticks;
            while left > 0 {
                let mut n = left;
                let mut next = state.after(j, n)?;
                let mut speeds = speeds(&state, &next, j);
                if node < last && next.coordinate() > self.nodes.get(node).length_q {
                    // As far as it surely stays inside; over the joint tick by tick.
                    let rest = widen(self.nodes.get(node).length_q) - state.s;
                    n = ((rest as f32 / speeds[1]) as u32).clamp(1, n);
                    next = state.after(j, n)?;
                    if n > 1 && next.coordinate() > self.nodes.get(node).length_q {
                        n = 1;
                        next = state.after(j, n)?;
                    }
                    speeds = self::speeds(&state, &next, j);
                }
                left -= n;
                let v = speeds[1] / UNIT * self.hz;
                let a = next.a.abs() as f32 / UNIT * self.hz * self.hz;
                let here = self.nodes.get(node).limits;
                if v > here.v * 1.0001 || a > here.a * 1.001 || speeds[0] < -BACKWARDS {
                    return None;
                }
                while node < last && next.coordinate() > self.nodes.get(node).length_q {
                    let exit = self.nodes.get(node).exit_v;
                    next.s -= widen(self.nodes.get(node).length_q);
                    node += 1;
                    let inside = self.nodes.get(node).limits;
                    if self.nodes.get(node - 1).stop
                        || v > exit.min(inside.v) * 1.0001
                        || a > inside.a * 1.001
                        || jerk > inside.j * 1.001
                    {
                        return None;
                    }
                }
                state = next;
            }
        }
        Some((state, node))
    }

    /// Distance to the nearest programmed stop in the window.
    #[must_use]
    pub fn distance_to_stop(&self) -> Option<f32> {
        self.stop_ahead().map(|stop| stop.distance)
    }
}

/// Least and largest velocity while jerk `j` leads from one state to the other.
fn speeds(from: &PathState, to: &PathState, j: i64) -> [f32; 2] {
    let (low, high) = (from.v.min(to.v) as f32, from.v.max(to.v) as f32);
    if from.a == 0 || to.a == 0 || (from.a < 0) == (to.a < 0) {
        return [low, high];
    }
    // The acceleration changes its sign on the way: v0 - a0^2 / 2 j there.
    let a = from.a as f32;
    let extreme = from.v as f32 - a / (2.0 * j as f32) * a;
    [low.min(extreme), high.max(extreme)]
}
