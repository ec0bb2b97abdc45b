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

/// Share of the limits that the last leg of a way in steps takes.
const SURE: f32 = 0.97;

/// Moves of a way to rest, and those before the last one.
const MOVES: usize = DEPTH + 1;
const DEPTH: usize = 1;

/// Rest, wherever that is.
const RESTING: Motion = Motion {
    node: 0,
    left: 0.0,
    v: 0.0,
    a: 0.0,
};

/// Ticks from rest in which whole ticks matter.
const SOON: f32 = 16.0;

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
    /// The acceleration let go in whole ticks.
    Release { ticks: u32 },
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
            Self::Release { ticks } => Some(Course::release(at, ticks, h)),
        }
    }
}

/// How a part of a way is made.
#[derive(Clone, Copy, Debug)]
enum Kind {
    /// The acceleration is let go.
    Release,
    /// Down to the velocity limit at the end of a node.
    Limit { to: f32, index: usize },
    /// Down to a part of the velocity.
    Slower(f32),
    /// To rest in one leg.
    Halt,
    /// To rest step by step.
    Descend,
}

/// A kind, and the share of the limits that is taken.
type Move = (Kind, f32);

/// A way to rest.
#[derive(Clone, Debug)]
pub(super) struct Way {
    /// The last of them first.
    parts: Vec<Part, PARTS>,
    moves: Vec<Move, MOVES>,
}

impl Way {
    /// At rest.
    pub(super) const fn new() -> Self {
        Self {
            parts: Vec::new(),
            moves: Vec::new(),
        }
    }

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
    /// A way to rest from `at` that keeps every limit, made by the same moves as `known`.
    pub(super) fn same_refuge(&self, at: &Motion, known: &Way) -> Option<Way> {
        crate::planner::CNT[7].fetch_add(1, core::sync::atomic::Ordering::Relaxed);
        let mut way = Way::new();
        let mut at = *at;
        for &to in &known.moves {
            at = self.go(&mut way, &at, to)?;
        }
        way.parts.reverse();
        (at.v <= 0.0).then_some(way)
    }

    /// A way to rest from `at` that keeps every limit.
    pub(super) fn refuge(&self, at: &Motion) -> Option<Way> {
        crate::planner::CNT[4].fetch_add(1, core::sync::atomic::Ordering::Relaxed);
        let mut way = Way::new();
        let found = self.search(&mut way, at, DEPTH);
        way.parts.reverse();
        found.then_some(way)
    }

    /// Adds a way to rest from `at` of at most `depth` + 1 moves to `way`; leaves it as it is if there is none.
    fn search(&self, way: &mut Way, at: &Motion, depth: usize) -> bool {
        let (parts, moves) = (way.parts.len(), way.moves.len());
        let back = |way: &mut Way| {
            way.parts.truncate(parts);
            way.moves.truncate(moves);
        };
        let ends: &[Move] = &[(Kind::Halt, 0.99), (Kind::Halt, 0.8), (Kind::Halt, 0.6), (Kind::Halt, 0.4), (Kind::Halt, 0.25), (Kind::Halt, 0.15)];
        for &to in ends {
            if self.go(way, at, to).is_some() {
                return true;
            }
            back(way);
        }
        if depth == 0 {
            return false;
        }
        let mut next = |way: &mut Way, to: Move| {
            let found = self
                .go(way, at, to)
                .is_some_and(|end| self.search(way, &end, depth - 1));
            if !found {
                back(way);
            }
            found
        };
        if at.a != 0.0 && [0.99, 0.7].iter().any(|&share| next(way, (Kind::Release, share))) {
            return true;
        }
        let Some((to, index)) = self.tightest(at) else {
            return false;
        };
        [0.99, 0.7]
            .iter()
            .any(|&share| next(way, (Kind::Limit { to, index }, share)))

    }

    /// Adds `kind` with `share` of the limits to `way`; the motion at its end.
    fn go(&self, way: &mut Way, at: &Motion, (kind, share): Move) -> Option<Motion> {
        let end = match kind {
            Kind::Halt => {
                self.halt(way, at, share)?;
                RESTING
            }
            Kind::Descend => {
                self.descend(way, *at, share)?;
                RESTING
            }
            Kind::Slower(part) => {
                let to = part * at.v;
                let leg = self.leg(at, to, self.grip(at, to, at.node).share(share))?;
                self.take(way, at, leg)?
            }
            Kind::Release => {
                let jerks = self.nodes.get(at.node).limits.jerk(at.v, at.a);
                let jerk = share * if at.a > 0.0 { jerks.down } else { jerks.up };
                let ticks = libm::ceilf(at.a.abs() / jerk * self.hz).max(1.0);
                if !(ticks <= PHASE_MAX as f32) {
                    return None;
                }
                self.take(way, at, Part::Release { ticks: ticks as u32 })?
            }
            Kind::Limit { to, index } => {
                if index < at.node || to >= at.v + at.a.max(0.0) {
                    // Passed, or nothing to do for it.
                    return way.moves.push((kind, share)).is_ok().then_some(*at);
                }
                let part = self.leg(at, to, self.grip(at, to, index).share(share))?;
                self.take(way, at, part)?
            }
        };
        way.moves.push((kind, share)).ok()?;
        Some(end)
    }

    /// Adds the leg to rest.
    fn halt(&self, way: &mut Way, at: &Motion, share: f32) -> Option<()> {
        let part = self.leg(at, 0.0, self.grip(at, 0.0, at.node).share(share))?;
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
    fn descend(&self, way: &mut Way, mut at: Motion, share: f32) -> Option<()> {
        loop {
            if !(at.v > 0.0) {
                return (at.a == 0.0).then_some(());
            }
            let limits = &self.nodes.get(at.node).limits;
            let jerks = limits.jerk(at.v, at.a);
            let rest = limits.jerk(0.0, 0.0).up;
            let release = RELEASE * jerks.up.min(rest);
            let soon = SOON / self.hz;
            if at.v <= release * soon * soon && self.halt(way, &at, SURE).is_some() {
                return Some(());
            }
            if at.a < 0.0 && at.a * at.a >= 1.9 * release * at.v {
                return self.rest(way, &at);
            }
            let grip = Grip {
                a: share * self.deceleration(&at, jerks.up),
                down: JERK * jerks.down,
                up: JERK * jerks.up,
            };
            at = self.brake_step(way, &at, grip, release)?;
        }
    }

    /// Adds one step of braking.
    fn brake_step(
        &self,
        way: &mut Way,
        at: &Motion,
        grip: Grip,
        release: f32,
    ) -> Option<Motion> {
        let tick = 1.0 / self.hz;
        let Grip { a, down, up } = grip;
        let goal = -a;
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
            Part::Release { ticks } => {
                // Where that leads is given.
                let jerk = -self.state.a / i128::from(ticks);
                Some([(i64::try_from(jerk).ok()?, ticks), (0, 0), (0, 0)])
            }
            Part::Leg { to, ticks } => slow(&self.state, (to / self.hz * UNIT) as i128, ticks),
        }
    }

    /// To rest whatever that takes.
    pub(super) fn forced(&self) -> Phases {
        #[cfg(not(target_os = "none"))]
        if std::env::var("PE").is_ok() { std::eprintln!("FORCED"); }
        let at = self.motion();
        self.leg(&at, 0.0, self.grip(&at, 0.0, at.node))
            .and_then(|leg| self.exactly(&leg))
            .unwrap_or([(0, 1); 3])
    }
}
