//! One decision: which jerk to run next, so that the motion stays under the ceiling ([`super::ceiling`]).
//!
//! A state is safe if letting go of its acceleration, and braking as hard as the ceiling does, leads onto the ceiling
//! from below, with every limit kept on the way. A decision takes the largest jerk whose outcome is safe. Where a
//! programmed stop comes within reach, the rest of the way is solved to end exactly on it ([`super::brake::land`],
//! [`super::brake::hop`]).

use super::brake::{brake, hop, land, slow, Phases};
use super::ceiling::{before, Branch, PREDICTED};
use super::limits::PathLimits;
use super::nodes::Nodes;
use crate::interpolator::{widen, PathState, T_FRAC};

/// Longest piece, ticks.
const TICKS_MAX: u32 = 10;

/// Acceleration counts as none if it is below this share of what one tick of jerk changes.
const NO_ACCELERATION: f32 = 0.1;

/// From this share of the velocity limit on the motion cruises: closing the rest would only dither.
const CRUISE: f32 = 1.0 - 5.0e-5;

/// Slack on comparisons, relative.
pub(super) const SLACK: f32 = 1.0 + 5.0e-5;

/// Halvings of the range of jerks.
const HALVINGS: u32 = 8;

/// Steps in which a prediction lets go of the acceleration within one node.
const STEPS: f32 = 4.0;

/// From this share of its velocity on a motion counts as under the ceiling.
const CLOSE: f32 = 0.995;

/// Share of the limits that a long landing may leave unused.
const GENTLE: f32 = 0.04;

/// Steps after which a prediction that has not ended counts as unsafe.
const PREDICTIONS: u32 = 400;

/// Share of the phases around the peak of deceleration that is flattened; the jerk grows by its square.
const PEAK: f32 = 0.04;

/// What rounding may leave of a velocity or an acceleration of zero.
pub(super) const FINE: i128 = 1 << (T_FRAC - 42);

pub(super) const UNIT: f32 = (1_u128 << T_FRAC) as f32;

/// The window and the state at the end of what has been planned.
pub struct View<'a> {
    /// All nodes.
    pub nodes: &'a Nodes,
    /// Node the state is in.
    pub cursor: usize,
    /// Last node under the ceiling; the motion is planned to be at rest at its end.
    pub last: usize,
    /// State at the end of the last piece.
    pub state: PathState,
    /// Ticks per second.
    pub hz: f32,
}

/// What to run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Decision {
    /// One piece: jerk, ticks.
    Go(i64, u32),
    /// Three pieces to rest, wherever that is.
    Rest(Phases),
    /// Three pieces to rest at the end of node `stop`.
    Land {
        /// The pieces.
        phases: Phases,
        /// Index of the node that ends there.
        stop: usize,
    },
}

/// The nearest programmed stop ahead, with the limits of the way there at the present velocity.
struct StopAhead {
    index: usize,
    distance_q: i128,
    distance: f32,
    v: f32,
    limits: PathLimits,
}

/// Motion in SI-like units, continuous in time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    pub(super) node: usize,
    /// Distance left in `node`.
    pub(super) left: f32,
    pub(super) v: f32,
    pub(super) a: f32,
}

impl View<'_> {
    /// The state as a motion continuous in time.
    ///
    /// The differences of a tick belong to places between ticks: acceleration to the tick before, velocity to half a tick
    /// before. All of it together is the motion one tick ago, on the same curve.
    pub(super) fn motion(&self) -> Motion {
        let left = widen(self.nodes.get(self.cursor).length_q) - self.state.s + self.state.v;
        let a = self.state.a as f32 / UNIT * self.hz * self.hz;
        Motion {
            node: self.cursor,
            left: left as f32 / UNIT,
            v: self.state.v as f32 / UNIT * self.hz - 0.5 * a / self.hz,
            a,
        }
    }

    /// The ceiling at the end of node `index`.
    fn ceiling_behind(&self, index: usize) -> Branch {
        if index >= self.last {
            Branch::REST
        } else {
            self.nodes.get(index + 1).start
        }
    }

    fn ceiling_at(&self, at: &Motion) -> Branch {
        before(
            self.nodes.get(at.node),
            self.ceiling_behind(at.node),
            at.left,
        )
    }

    /// The stop at the end of the stretch under the ceiling, if it is a programmed one.
    fn stop_ahead(&self) -> Option<StopAhead> {
        if !self.nodes.get(self.last).stop {
            return None;
        }
        let v = self.motion().v;
        let mut found = StopAhead {
            index: self.last,
            distance_q: -self.state.s,
            distance: 0.0,
            v: f32::MAX,
            limits: PathLimits {
                a: f32::MAX,
                j: f32::MAX,
            },
        };
        for index in self.cursor..=self.last {
            let node = self.nodes.get(index);
            found.distance_q += widen(node.length_q);
            found.v = found.v.min(node.limits.v);
            let here = node.limits.acceleration(v);
            found.limits.a = found.limits.a.min(here);
            // The acceleration that braking from here builds up.
            let free = node.limits.jerk(v, 0.0);
            let peak = crate::units::sqrt(free * v).min(here);
            found.limits.j = found.limits.j.min(node.limits.jerk(v, peak));
            if index < self.last {
                found.v = found.v.min(node.exit_v);
            }
        }
        found.distance = found.distance_q as f32 / UNIT;
        Some(found)
    }

    /// Whether the motion can get from `at` onto the ceiling from below.
    pub(super) fn safe(&self, mut at: Motion) -> bool {
        if at.v < 0.0 {
            return false;
        }
        for _ in 0..PREDICTIONS {
            let ceiling = self.ceiling_at(&at);
            if at.v > ceiling.v * SLACK {
                return false;
            }
            let node = self.nodes.get(at.node);
            let jerk = PREDICTED * node.limits.jerk(at.v, at.a);
            // A small part of what a tick changes.
            if at.a <= 0.05 * jerk / self.hz - ceiling.d || at.v <= 0.0 {
                return true;
            }
            // Let go for a part of the time it takes, at most to the end of the node.
            let limit = node.limits.acceleration(at.v);
            if at.a > limit * 1.001 {
                return false;
            }
            // The jerk there is falls while the velocity rises.
            let rise = at.a.max(0.0) * at.a / (2.0 * jerk);
            let near = (at.v + rise.min(0.25 * at.v)).min(node.limits.v);
            let jerk = jerk.min(PREDICTED * node.limits.jerk(near, at.a));
            let whole = (at.a + ceiling.d) / jerk;
            let part = whole.min((at.a.max(0.1 * limit) / (STEPS * jerk)).max(0.5 / self.hz));
            let covered = part * (at.v + part * (0.5 * at.a - part * jerk * (1.0 / 6.0)));
            if covered < at.left {
                at.left -= covered;
                at.v += part * (at.a - 0.5 * jerk * part);
                at.a -= jerk * part;
                continue;
            }
            // Uniform acceleration is near enough over what is left of the node.
            let time = 2.0 * at.left / (at.v + (at.v + part * (at.a - 0.5 * jerk * part)).max(0.0));
            at.v += time * (at.a - 0.5 * jerk * time);
            at.a -= jerk * time;
            if at.node >= self.last {
                return at.v <= 0.0;
            }
            at.node += 1;
            at.left = self.nodes.get(at.node).length;
        }
        false
    }

    /// Runs `jerk` (path units / s^3) for `time` and says where that leads, or `None` if a limit breaks on the way.
    fn probe(&self, start: &Motion, jerk: f32, time: f32) -> Option<Motion> {
        let v = start.v + time * (start.a + 0.5 * jerk * time);
        let a = start.a + jerk * time;
        let covered = time * (start.v + time * (0.5 * start.a + time * jerk * (1.0 / 6.0)));
        // Velocity over the way between the two, as of uniform acceleration.
        let (b0, b1) = (start.v * start.v, v.max(0.0) * v.max(0.0));
        let mut at = Motion {
            node: start.node,
            left: start.left - covered,
            v,
            a,
        };
        let high = start.a.abs().max(a.abs());
        let mut passed = start.left;
        loop {
            let node = self.nodes.get(at.node);
            if at.left >= 0.0 {
                break;
            }
            if at.node >= self.last {
                return None;
            }
            let next = self.nodes.get(at.node + 1);
            let here = crate::units::sqrt(b0 + (b1 - b0) * (passed / covered).min(1.0));
            if here > node.exit_v.min(next.limits.v).min(next.start.v) * SLACK
                || jerk.abs() > next.limits.jerk(here, high) * 1.001
                || high > next.limits.acceleration(here) * 1.001
            {
                return None;
            }
            at.node += 1;
            at.left += next.length;
            passed += next.length;
        }
        let limits = &self.nodes.get(at.node).limits;
        (v <= limits.v * SLACK
            && jerk.abs() <= limits.jerk(v.max(start.v), high) * 1.001
            && (a <= limits.acceleration(v) * 1.001 || jerk < 0.0))
            .then_some(at)
    }

    /// The next thing to run.
    #[must_use]
    pub fn decide(&self) -> Decision {
        if let Some(stop) = self.stop_ahead() {
            // What rounding leaves of a standstill is one.
            let at_rest = self.state.v.abs() < FINE && self.state.a.abs() < FINE;
            let landing = if at_rest {
                self.try_hop(&stop)
            } else {
                self.try_land(&stop).or_else(|| self.try_touch(&stop))
            };
            if let Some(phases) = landing {
                return Decision::Land {
                    phases,
                    stop: stop.index,
                };
            }
            if !at_rest && self.must_brake(&stop) {
                // No landing in whole ticks ends on the stop: rest before it, and go the rest of the way from there.
                let (phases, _) = self.halt();
                let fits = |(end, node): (PathState, usize)| {
                    node < self.last || end.coordinate() <= self.nodes.get(node).length_q
                };
                if self.follow(&phases, self.last).is_some_and(fits) {
                    return Decision::Rest(phases);
                }
            }
        }
        self.greedy()
    }

    fn greedy(&self) -> Decision {
        let start = self.motion();
        let node = self.nodes.get(start.node);
        let a_max = node.limits.acceleration(start.v);
        let j_max = node.limits.jerk(start.v, start.a);
        let cruising = start.v >= node.limits.v * CRUISE
            && start.a.abs()
                <= (NO_ACCELERATION * j_max / self.hz)
                    .min(0.1 * (1.0 - CRUISE) * start.v * self.hz);
        // Short against the time the acceleration takes to build up.
        let steady = cruising || (start.a >= 0.999 * a_max && node.brisk);
        let scale = (a_max / j_max).min(crate::units::sqrt(start.v / j_max));
        let most = if steady {
            TICKS_MAX
        } else {
            ((scale * self.hz * 0.125) as u32).clamp(1, TICKS_MAX)
        };
        let mut ticks = most;
        loop {
            let time = ticks as f32 / self.hz;
            let j_max = j_max.min(self.jerk_limit(&start, time));
            let high = if cruising {
                -start.a / time
            } else {
                j_max.min((a_max - start.a) / time).max(-j_max)
            };
            // Acceleration must be gone again before the motion is.
            let low = (-j_max)
                .max((-a_max - start.a) / time)
                .max(-(start.v + start.a * time) / (0.5 * time * time));
            let ok = |jerk: f32| {
                self.probe(&start, jerk, time)
                    .is_some_and(|at| self.safe(at))
            };
            let found = if high >= low && ok(high) {
                Some(high)
            } else if high >= low && ok(low) {
                let (mut good, mut bad) = (low, high);
                for _ in 0..HALVINGS {
                    let middle = 0.5 * (good + bad);
                    if ok(middle) {
                        good = middle;
                    } else {
                        bad = middle;
                    }
                }
                Some(good)
            } else {
                None
            };
            if let Some(jerk) = found {
                return Decision::Go(self.units(jerk), ticks);
            }
            if ticks == 1 {
                return Decision::Go(self.units(low.min(high).max(-j_max)), 1);
            }
            ticks = (ticks / 2).max(1);
        }
    }

    /// Jerk allowed for `time` from `at` on: everywhere the motion may come to, at whatever velocity and acceleration it
    /// may reach, and at the joints passed or close by.
    fn jerk_limit(&self, at: &Motion, time: f32) -> f32 {
        let first = &self.nodes.get(at.node).limits;
        let most = first.jerk(at.v, at.a);
        let (rise, a) = (at.a.max(0.0), at.a.abs() + most * time);
        let v = at.v + time * (rise + 0.5 * most * time);
        let mut jerk = first.jerk(v, a.min(first.acceleration(v)));
        let close = 1.5 * at.v / self.hz;
        if at.node > 0 && self.nodes.get(at.node).length - at.left < close {
            jerk = jerk.min(self.nodes.get(at.node - 1).exit_j);
        }
        let mut left = at.left - close - time * (at.v + 0.5 * rise * time);
        let mut index = at.node;
        while left < 0.0 && index < self.last {
            jerk = jerk.min(self.nodes.get(index).exit_j);
            index += 1;
            let next = self.nodes.get(index);
            let a = a.min(next.limits.acceleration(v));
            jerk = jerk.min(next.limits.jerk(v, a));
            left += next.length;
        }
        jerk
    }

    fn units(&self, jerk: f32) -> i64 {
        (jerk * (UNIT / (self.hz * self.hz * self.hz))) as i64
    }

    fn try_hop(&self, stop: &StopAhead) -> Option<Phases> {
        if stop.distance_q <= 0 {
            // Rounding has carried the motion onto the stop.
            return Some([(0, 1), (0, 0), (0, 1)]);
        }
        let PathLimits { a: _, j } = stop.limits;
        let time = libm::cbrtf(stop.distance / (2.0 * j));
        let m = libm::ceilf(time * self.hz).max(1.0);
        let j = stop.distance / (2.0 * m * m * m);
        let (v, a) = (j * m * m * self.hz, j * m * self.hz * self.hz);
        let holds = |index: usize| {
            let below = self.nodes.get(index).limits.below(v);
            a <= below.a && j * self.hz * self.hz * self.hz <= below.j
        };
        if v > stop.v || !(self.cursor..=self.last).all(holds) {
            return None;
        }
        let m = m as u32;
        let j = hop(stop.distance_q, m);
        Some([(j, m), (-j, 2 * m), (j, m)])
    }

    /// Whether braking with all that is allowed barely ends before the stop.
    fn must_brake(&self, stop: &StopAhead) -> bool {
        let m = self.motion();
        let PathLimits { a, j } = stop.limits;
        let distance = stop.distance + m.v / self.hz;
        let full = brake(m.v, m.a, 0.0, a, j);
        full.distance + 0.5 * m.v / self.hz > distance
            && full.distance < 1.2 * distance
            && full.time.iter().sum::<f32>() * self.hz < 40.0
    }

    /// One tick onto the stop, if that keeps the limits.
    fn try_touch(&self, stop: &StopAhead) -> Option<Phases> {
        let node = self.nodes.get(stop.index);
        let scale = self.hz * self.hz;
        let per_tick = |x: i128| x as f32 / UNIT;
        let by = per_tick(stop.distance_q);
        let a0 = per_tick(self.state.a);
        let a1 = by - per_tick(self.state.v);
        let limits = node.limits.below(0.0);
        let fits = |a: f32, before: f32| {
            a.abs() * scale <= limits.a
                && (node.brisk || (a - before).abs() * scale * self.hz <= limits.j)
        };
        // Rounding must not leave the motion beyond the stop for ever.
        let beyond = stop.distance_q <= 0 && (by * scale).abs() <= limits.a;
        (beyond || (fits(a1, a0) && fits(-by, a1) && fits(0.0, -by))).then_some([
            (0, 0),
            (0, 0),
            (0, 1),
        ])
    }

    fn try_land(&self, stop: &StopAhead) -> Option<Phases> {
        let m = self.motion();
        let PathLimits { a, j } = stop.limits;
        let reach = |share: f32| brake(m.v, m.a, 0.0, share * a, share * j);
        // The gentlest landing worth taking; the shorter it is, the more whole ticks take away. Along the ceiling there is
        // nothing better.
        let ticks = self.hz * reach(1.0).time.iter().sum::<f32>();
        let ceiling = self.ceiling_at(&m);
        let (mut low, mut high) = if ceiling.d > 0.0 && m.v > CLOSE * ceiling.v {
            (if self.cursor == self.last { 0.2 } else { 0.85 }, 0.995)
        } else {
            (1.0 - GENTLE - 4.0 / ticks.max(8.0), 0.995)
        };
        let distance = stop.distance + m.v / self.hz;
        if !(stop.distance > 0.0)
            || reach(low).distance < distance
            || reach(high).distance > distance
        {
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
        let mut time = reach(high).time;
        // Three jerks over a middle phase of next to nothing would have to be huge; flattening the peak costs little.
        let flat = PEAK * time[0].min(time[2]);
        if time[1] < 2.0 * flat {
            time = [time[0] - flat, time[1] + 2.0 * flat, time[2] - flat];
        }
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
                if self.follow(&phases, stop.index).is_some() {
                    return Some(phases);
                }
            }
        }
        None
    }

    /// Runs `phases`; the state at their end and the node it lies in, or `None` if a limit breaks on the way.
    /// Does not go beyond node `last`.
    pub(super) fn follow(&self, phases: &Phases, last: usize) -> Option<(PathState, usize)> {
        const CHUNK: u32 = 8;
        let jerk_scale = self.hz * self.hz * self.hz / UNIT;
        let mut state = self.state;
        let mut node = self.cursor;
        for &(j, ticks) in phases {
            let jerk = (j as f32 * jerk_scale).abs();
            let mut left = ticks;
            while left > 0 {
                let mut n = left.min(CHUNK);
                let mut next = state.after(j, n)?;
                if node < last && next.coordinate() > self.nodes.get(node).length_q {
                    // Over joints tick by tick.
                    n = 1;
                    next = state.after(j, n)?;
                }
                left -= n;
                let v = state.v.max(next.v) as f32 / UNIT * self.hz;
                let a = next.a.abs() as f32 / UNIT * self.hz * self.hz;
                let within = |index: usize| {
                    let limits = &self.nodes.get(index).limits;
                    v <= limits.v * 1.0001
                        && a <= limits.acceleration(v) * 1.001
                        && (self.nodes.get(index).brisk || jerk <= limits.jerk(v, a) * 1.001)
                };
                // The release phase may undershoot standstill by the rounding of three integer jerks only.
                if !within(node) || next.v < -(1 << 26) {
                    return None;
                }
                while node < last && next.coordinate() > self.nodes.get(node).length_q {
                    let passed = self.nodes.get(node);
                    next.s -= widen(passed.length_q);
                    node += 1;
                    if passed.stop
                        || v > passed.exit_v * 1.0001
                        || jerk > passed.exit_j * 1.001
                        || !within(node)
                    {
                        return None;
                    }
                }
                state = next;
            }
        }
        Some((state, node))
    }

    /// Phases that come to rest on the path as soon as the limits allow. Also returns the distance that takes.
    #[must_use]
    pub fn halt(&self) -> (Phases, f32) {
        let m = self.motion();
        let v =
            m.v + m.a.max(0.0) * m.a.max(0.0) / (2.0 * self.nodes.get(m.node).limits.below(m.v).j);
        let PathLimits { mut a, mut j } = self.nodes.get(self.cursor).limits.below(v);
        let mut b = brake(m.v, m.a, 0.0, a, j);
        let mut covered = m.left;
        let mut index = self.cursor;
        while covered < b.distance && index < self.last {
            index += 1;
            let node = self.nodes.get(index);
            let limits = node.limits.below(v);
            if limits.a < a || limits.j < j {
                a = a.min(limits.a);
                j = j.min(limits.j);
                b = brake(m.v, m.a, 0.0, a, j);
            }
            covered += node.length;
        }
        let ticks = b.time.map(|t| libm::ceilf(t * self.hz) as u32);
        let ticks = [ticks[0].max(1), ticks[1], ticks[2].max(1)];
        let phases = slow(&self.state, 0, ticks).unwrap_or([(0, 0); 3]);
        (phases, b.distance)
    }

    /// Distance to the nearest programmed stop in the window.
    #[must_use]
    pub fn distance_to_stop(&self) -> Option<f32> {
        self.stop_ahead().map(|stop| stop.distance)
    }
}
