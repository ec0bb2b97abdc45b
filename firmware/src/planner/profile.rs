//! One decision: which jerk to run next, so that the motion stays under the ceiling ([`super::ceiling`]).
//!
//! A state is safe if letting go of its acceleration, and braking as hard as the ceiling does, leads onto the ceiling
//! from below, with every limit kept on the way. A decision takes the largest jerk whose outcome is safe. Where a
//! programmed stop comes within reach, the rest of the way is solved to end exactly on it ([`super::brake::land`],
//! [`super::brake::hop`]).

use super::brake::{brake, hop, land, slow, Phases};
use super::ceiling::{Branch, Motion, Stretch, LOOSE, SLACK};
use super::limits::{PathLimits, Range, Rates};
use super::nodes::Nodes;
use crate::interpolator::{widen, PathState, T_FRAC};

/// Longest piece, ticks.
const TICKS_MAX: u32 = 10;

/// From this share of the velocity limit on the motion cruises: closing the rest would only dither.
const CRUISE: f32 = 1.0 - 5.0e-5;

/// Halvings of the range of jerks.
const HALVINGS: u32 = 6;

/// Shares of that range that are tried first.
const ANCHORS: [f32; 5] = [0.0, 0.3, 0.6, 0.8, 0.9];

/// Shares of the least jerk that are tried then: what may be done falls off along the way.
const LAST: [f32; 4] = [0.96, 0.98, 0.99, 1.0];

/// From this share of its velocity on a motion counts as under the ceiling.
const CLOSE: f32 = 0.995;

/// Most that a motion above the ceiling is braked harder than the ceiling, in velocities.
const RETURN: f32 = 1.15;

/// Most of the limits of the way at the present velocity that a landing along the ceiling may take: they are the least
/// whichever way the motion is changed.
const MOST_ALONG: f32 = 1.5;

/// A motion that is faster than the ceiling by this factor has to be forced.
const ABOVE: f32 = 1.02;

/// Most of the limits that a forced landing takes.
const MOST_FORCE: f32 = 4.0;

/// Ticks below which a landing is tried however bent the way is.
const SHORT: f32 = 80.0;

/// Share of the jerk at standstill above which a way counts as straight.
const UNBENT: f32 = 0.9;

/// Share of the limits that a long landing may leave unused.
const GENTLE: f32 = 0.04;

/// Ticks more than rounded that the phases of a landing may last.
const MORE_TICKS: [[u32; 3]; 7] = [
    [0, 0, 0],
    [0, 1, 0],
    [1, 0, 0],
    [0, 0, 1],
    [1, 0, 1],
    [1, 1, 1],
    [2, 1, 2],
];

/// Ticks more than rounded that a landing in even phases may last.
const EVEN_MORE: u32 = 6;

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
    /// Limits of the axes, jerk-limited and not.
    pub rates: [Rates; 2],
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
    /// Jerk at standstill.
    rest_j: f32,
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

    pub(super) fn stretch(&self) -> Stretch<'_> {
        Stretch {
            nodes: self.nodes,
            last: self.last,
            rates: &self.rates,
            hz: self.hz,
        }
    }

    fn ceiling_at(&self, at: &Motion) -> Branch {
        let stretch = self.stretch();
        stretch.before(self.nodes.get(at.node), stretch.behind(at.node), at.left)
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
            rest_j: f32::MAX,
        };
        for index in self.cursor..=self.last {
            let node = self.nodes.get(index);
            found.distance_q += widen(node.length_q);
            found.v = found.v.min(node.limits.v);
            let rates = self.stretch().rates(node);
            let here = node.limits.acceleration(rates, v);
            let here = here.down.min(here.up);
            found.limits.a = found.limits.a.min(here);
            // The acceleration that braking from here builds up.
            let free = node.limits.least_jerk(rates, v, 0.0);
            found.rest_j = found.rest_j.min(node.limits.least_jerk(rates, 0.0, 0.0));
            let peak = crate::units::sqrt(free * v).min(here);
            found.limits.j = found.limits.j.min(node.limits.least_jerk(rates, v, peak));
            if index < self.last {
                found.v = found.v.min(node.exit_v);
            }
        }
        found.distance = found.distance_q as f32 / UNIT;
        Some(found)
    }

    /// Whether node `index` allows velocity `v` and acceleration `a` while `jerk` runs within `share` of the limits; what
    /// is beyond a limit may be on its way back.
    fn allows(&self, index: usize, v: f32, a: f32, jerk: f32, share: f32) -> bool {
        let stretch = self.stretch();
        let node = self.nodes.get(index);
        let Range { down, up } = stretch.jerk(node, v, a, share);
        let limit = stretch.acceleration(node, v);
        v <= node.limits.v * SLACK
            && jerk <= up * LOOSE
            && -jerk <= down * LOOSE
            && (a <= limit.up * LOOSE || jerk < 0.0)
            && (-a <= limit.down * LOOSE || jerk > 0.0)
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
        let close = 1.5 * at.v / self.hz;
        let mut passed = start.left;
        loop {
            let node = self.nodes.get(at.node);
            if at.left >= close || at.node >= self.last {
                break;
            }
            let next = self.nodes.get(at.node + 1);
            let part = (passed / covered).min(1.0);
            let here = crate::units::sqrt(b0 + (b1 - b0) * part);
            let there = start.a + (a - start.a) * part;
            let over = at.left < 0.0;
            if (over && here > node.exit_v.min(next.start.v) * SLACK)
                || !self.allows(at.node, here, there, jerk, node.exit_share)
                || !self.allows(at.node + 1, here, there, jerk, node.exit_share)
            {
                return None;
            }
            if !over {
                break;
            }
            at.node += 1;
            at.left += next.length;
            passed += next.length;
        }
        if at.left < 0.0 {
            return None;
        }
        // Deceleration can be let go of before the motion is over.
        let node = self.nodes.get(at.node);
        let stretch = self.stretch();
        let up = stretch
            .jerk(node, v, a, 1.0)
            .up
            .min(stretch.jerk(node, 0.0, 0.0, 1.0).up);
        let stops = a < 0.0 && a * a > 2.0 * up * v;
        (!stops && self.allows(at.node, v, a, jerk, 1.0)).then_some(at)
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
            if let Some(phases) = (!at_rest).then(|| self.force_landing(&stop)).flatten() {
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
        let stretch = self.stretch();
        let node = self.nodes.get(start.node);
        let limit = stretch.acceleration(node, start.v);
        let close = 1.5 * start.v / self.hz;
        let Range { mut down, mut up } = stretch.jerk(node, start.v, start.a, 1.0);
        if start.node > 0 && node.length - start.left < close {
            // The ticks after a joint still see what was before it.
            let behind = self.nodes.get(start.node - 1);
            for side in [node, behind] {
                let range = stretch.jerk(side, start.v, start.a, behind.exit_share);
                (down, up) = (down.min(range.down), up.min(range.up));
            }
        }
        let (a_max, j_max) = (limit.up.min(limit.down), up.min(down));
        let top = node.limits.v;
        let cruising =
            start.v >= top * CRUISE && start.a.abs() <= 0.1 * (1.0 - CRUISE) * start.v * self.hz;
        // Short against the time the acceleration takes to build up.
        let steady = cruising || (start.a >= 0.999 * limit.up && node.brisk);
        let scale = (a_max / j_max).min(crate::units::sqrt(start.v / j_max));
        let most = if steady {
            TICKS_MAX
        } else {
            ((scale * self.hz * 0.125) as u32).clamp(1, TICKS_MAX)
        };
        let mut ticks = most;
        loop {
            let time = ticks as f32 / self.hz;
            // Onto the largest velocity, to stay there.
            let settled = start.v + 0.5 * start.a * time;
            let high = if settled >= top * CRUISE && settled <= top * SLACK {
                -start.a / time
            } else {
                (limit.up - start.a) / time
            };
            let high = high.min(up).max(-down);
            // Acceleration must be gone again before the motion is.
            let low = (-down)
                .max((-limit.down - start.a) / time)
                .max(-(start.v + start.a * time) / (0.5 * time * time));
            if let Some(jerk) = self.largest(&start, low, high, time) {
                return Decision::Go(self.units(jerk), ticks);
            }
            if ticks == 1 {
                // Nothing keeps every limit: back onto the ceiling, as gently as that goes.
                let ceiling = self.ceiling_at(&start);
                let over = (start.v / ceiling.v).clamp(1.0, RETURN);
                let least = crate::units::sqrt(1.8 * up * start.v.max(0.0));
                let wanted = (-(ceiling.d * over * over).min(least) - start.a) / time;
                if !(start.v > 0.0) {
                    return Decision::Rest(self.halt().0);
                }
                if start.left < close + start.v / self.hz && start.node < self.last {
                    let next = self.nodes.get(start.node + 1);
                    let there = stretch.jerk(next, start.v, start.a, node.exit_share);
                    (down, up) = (down.min(there.down), up.min(there.up));
                }
                return Decision::Go(self.units(wanted.clamp(-down, up)), 1);
            }
            ticks = (ticks / 2).max(1);
        }
    }

    /// The largest jerk from `low` to `high` that may run for `time`.
    fn largest(&self, start: &Motion, low: f32, high: f32, time: f32) -> Option<f32> {
        let stretch = self.stretch();
        let ok = |jerk: f32| {
            self.probe(start, jerk, time)
                .is_some_and(|at| stretch.merges(at))
        };
        if !(high >= low) {
            return None;
        }
        // Neither of the ends need be allowed, and what lies between them be.
        let mut bad = None;
        let spread = ANCHORS.map(|part| high + (low - high) * part);
        let last = LAST.map(|part| (part * low).min(high));
        for jerk in spread.into_iter().chain(last) {
            if !ok(jerk) {
                bad = Some(jerk);
                continue;
            }
            let mut good = jerk;
            if let Some(mut bad) = bad {
                for _ in 0..HALVINGS {
                    let middle = 0.5 * (good + bad);
                    if ok(middle) {
                        good = middle;
                    } else {
                        bad = middle;
                    }
                }
            }
            return Some(good);
        }
        None
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
            let below = self.stretch().at(self.nodes.get(index), v);
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
        let limits = self.stretch().at(node, 0.0);
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
        let along = m.v > CLOSE * ceiling.v && m.a < -0.8 * ceiling.d && ceiling.d > 0.0;
        let (mut low, mut high) = if along {
            // What the limits really are on the way, the trial run below knows.
            (if ticks < 24.0 { 0.2 } else { 0.85 }, MOST_ALONG)
        } else {
            let most = if ticks < SHORT { MOST_ALONG } else { 0.995 };
            (1.0 - GENTLE - 4.0 / ticks.max(8.0), most)
        };
        if m.a < 0.0 && m.v > 0.0 {
            // With less, letting go of the deceleration takes more velocity than there is.
            low = low.max(LOOSE * m.a * m.a / (2.0 * j * m.v));
        }
        let distance = stop.distance + m.v / self.hz;
        if !(stop.distance > 0.0)
            || !(along || ticks < SHORT || stop.limits.j > UNBENT * stop.rest_j)
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
        self.in_ticks(stop, reach(high).time)
            .find(|phases| self.follow(phases, stop.index).is_some())
    }

    /// Landings on `stop` whose phases last about `time`, in whole ticks.
    fn in_ticks<'b>(
        &'b self,
        stop: &'b StopAhead,
        mut time: [f32; 3],
    ) -> impl Iterator<Item = Phases> + 'b {
        // Three jerks over a middle phase of next to nothing would have to be huge; flattening the peak costs little.
        let flat = PEAK * time[0].min(time[2]);
        if time[1] < 2.0 * flat {
            time = [time[0] - flat, time[1] + 2.0 * flat, time[2] - flat];
        }
        let whole = time.map(|t| (libm::roundf(t * self.hz) as u32).max(1));
        let nearly = MORE_TICKS
            .iter()
            .map(move |more| core::array::from_fn(|i| whole[i] + more[i]));
        // Where little more is left than letting go, three even phases need the least jerk.
        let sum = whole[0] + whole[1] + whole[2];
        let even =
            (sum.max(5) - 2..sum + EVEN_MORE).map(|sum| [sum / 3, sum - 2 * (sum / 3), sum / 3]);
        nearly
            .chain(even)
            .filter_map(|ticks| land(&self.state, stop.distance_q, ticks))
    }

    /// Where rounding has left too little way to the stop: a landing with as little more than the limits as it takes.
    fn force_landing(&self, stop: &StopAhead) -> Option<Phases> {
        let m = self.motion();
        let PathLimits { a, j } = stop.limits;
        let reach = |share: f32| brake(m.v, m.a, 0.0, share * a, share * j);
        let distance = stop.distance + m.v / self.hz;
        let (mut low, mut high) = (1.0, MOST_FORCE);
        let above = m.v > self.ceiling_at(&m).v * ABOVE;
        if !above || stop.index != self.cursor || !(m.v > 0.0) || reach(low).distance <= distance {
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
        let largest = |phases: &Phases| phases.iter().map(|(jerk, _)| jerk.abs()).max();
        self.in_ticks(stop, reach(high).time).min_by_key(largest)
    }

    /// Runs `phases`; the state at their end and the node it lies in, or `None` if a limit breaks on the way.
    /// Does not go beyond node `last`.
    pub(super) fn follow(&self, phases: &Phases, last: usize) -> Option<(PathState, usize)> {
        const CHUNK: u32 = 8;
        let jerk_scale = self.hz * self.hz * self.hz / UNIT;
        let mut state = self.state;
        let mut node = self.cursor;
        for &(j, ticks) in phases {
            let jerk = j as f32 * jerk_scale;
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
                let a = next.a as f32 / UNIT * self.hz * self.hz;
                let keeps = |index: usize, share: f32| {
                    let stretch = self.stretch();
                    let node = self.nodes.get(index);
                    let limit = stretch.acceleration(node, v);
                    let range = stretch.jerk(node, v, a, share);
                    v <= node.limits.v * 1.0001
                        && a <= limit.up * LOOSE
                        && -a <= limit.down * LOOSE
                        && (node.brisk || (jerk <= range.up * LOOSE && -jerk <= range.down * LOOSE))
                };
                let within = |index: usize| keeps(index, 1.0);
                // The release phase may undershoot standstill by the rounding of three integer jerks only.
                if !within(node) || next.v < -(1 << 26) {
                    return None;
                }
                while node < last && next.coordinate() > self.nodes.get(node).length_q {
                    let passed = self.nodes.get(node);
                    next.s -= widen(passed.length_q);
                    node += 1;
                    if passed.stop || v > passed.exit_v * 1.0001 || !keeps(node, passed.exit_share)
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
        let stretch = self.stretch();
        let v =
            m.v + m.a.max(0.0) * m.a.max(0.0) / (2.0 * stretch.at(self.nodes.get(m.node), m.v).j);
        let PathLimits { mut a, mut j } = stretch.at(self.nodes.get(self.cursor), v);
        let mut b = brake(m.v, m.a, 0.0, a, j);
        let mut covered = m.left;
        let mut index = self.cursor;
        while covered < b.distance && index < self.last {
            index += 1;
            let node = self.nodes.get(index);
            let limits = stretch.at(node, v);
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
