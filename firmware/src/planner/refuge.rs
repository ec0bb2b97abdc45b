//! A way to rest: whether the motion can still be stopped within every limit, and how it slows down.
//!
//! In: a motion. Out: a [`Way`]: a leg to rest, perhaps behind another one that lets the acceleration go or leads down to a
//! velocity limit ahead, or behind stretches ([`super::descent`]). Every state that is planned has one, so nothing that lies
//! ahead can be run over. A leg is shaped
//! with the limits at its ends, tried with smaller and smaller shares of them, and run along the nodes before it counts:
//! what lies between may allow less.

use heapless::Vec;

use super::brake::{brake, slow, Grip, Phases};
use super::course::{Breach, Course, Motion};
use super::descent::{Stretch, STRETCHES};
use super::profile::{View, UNIT};
use crate::units::{larger, smaller, sqrt};

/// Longest phase of a leg, ticks: the rounding of its jerk to 2^-72 grows with the cube.
const PHASE_MAX: u32 = 8192;

/// Legs of a way to rest.
const LEGS: usize = 2;

/// Shares of the limits that a leg to rest is tried with, and any other.
const HALTS: [f32; 9] = [0.99, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.25, 0.15];
const OTHERS: [f32; 2] = [0.99, 0.7];

const UP: usize = 1;

/// Where between its ends a leg's deceleration is judged, as the share of the first velocity.
const MIDDLE: f32 = 0.7;

/// What a leg leads to.
#[derive(Clone, Copy, Debug)]
enum Goal {
    /// No acceleration, at whatever velocity that is.
    Release,
    /// The velocity limit at the end of a node.
    Limit {
        /// Path units/s.
        to: f32,
        /// Running number of the node: a way is kept while the window moves on.
        number: u32,
    },
    /// Rest.
    Halt,
}

/// A slowing down to zero acceleration.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leg {
    goal: Goal,
    /// Share of the limits that it takes.
    share: f32,
    /// Velocity at its end, path units/s; of no use for a release.
    to: f32,
    /// Its phases. A release has only the last one.
    ticks: [u32; 3],
}

impl Leg {
    /// Its course from `at`.
    pub(super) fn course(&self, at: &Motion, h: f32) -> Option<Course> {
        match self.goal {
            Goal::Release => Some(Course::release(at, self.ticks[2], h)),
            _ => Course::slowing(at, self.to, self.ticks, h),
        }
    }
}

/// What `run` finds with one of `shares`, which fall: looked for from `hint` on, which is left where the search has ended. With
/// less of the limits no change breaks that more of them kept, and with more no velocity.
pub(super) fn nearest<T>(
    shares: &[f32],
    hint: &mut usize,
    mut run: impl FnMut(f32) -> Result<T, Breach>,
) -> Option<T> {
    let mut last = None;
    loop {
        let next = match run(*shares.get(*hint)?) {
            Ok(found) => return Some(found),
            Err(Breach::Change) => *hint + 1,
            Err(Breach::Velocity) => hint.wrapping_sub(1),
        };
        if next >= shares.len() || last == Some(next) {
            return None;
        }
        last = Some(*hint);
        *hint = next;
    }
}

/// What `run` finds with the largest of `shares` that keeps the limits; they fall. Where a velocity breaks, less of them is of no
/// use.
pub(super) fn largest<T>(
    shares: &[f32],
    mut run: impl FnMut(f32) -> Result<T, Breach>,
) -> Option<T> {
    for &share in shares {
        match run(share) {
            Ok(found) => return Some(found),
            Err(Breach::Velocity) => return None,
            Err(Breach::Change) => {}
        }
    }
    None
}

/// A way to rest: stretches, then legs.
#[derive(Clone, Debug)]
pub(super) struct Way {
    /// The last of them first.
    stretches: Vec<Stretch, STRETCHES>,
    /// The last of them first.
    legs: Vec<Leg, LEGS>,
}

/// A part of a way.
pub(super) enum Part {
    Stretch(Stretch),
    Leg(Leg),
}

impl Way {
    /// None: at rest.
    pub(super) const fn new() -> Self {
        Self {
            stretches: Vec::new(),
            legs: Vec::new(),
        }
    }

    /// Its first part.
    pub(super) fn first(&self) -> Option<Part> {
        let stretch = self.stretches.last().copied().map(Part::Stretch);
        stretch.or_else(|| self.legs.last().copied().map(Part::Leg))
    }

    /// Its first part, which it has no more.
    pub(super) fn take_first(&mut self) -> Option<Part> {
        let stretch = self.stretches.pop().map(Part::Stretch);
        stretch.or_else(|| self.legs.pop().map(Part::Leg))
    }

    /// Which of the shares it comes to rest with.
    fn share(&self) -> usize {
        let share = self.legs.first().map_or(HALTS[0], |leg| leg.share);
        let index = HALTS.iter().position(|&halt| halt == share);
        index.unwrap_or(0)
    }
}

impl Part {
    /// Its course from `at`.
    pub(super) fn course(&self, at: &Motion, h: f32) -> Option<Course> {
        match self {
            Self::Stretch(stretch) => Some(stretch.course(at, h)),
            Self::Leg(leg) => leg.course(at, h),
        }
    }
}

/// Which of the shares a leg to rest was found with last, by what comes before it: nothing, a release, a velocity limit.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Hints([usize; 3]);

impl Hints {
    /// Those of `way`.
    pub(super) fn of(way: &Way) -> Self {
        Self([way.share().saturating_sub(UP); 3])
    }
}

impl View<'_> {
    /// A way to rest from `at` that keeps every limit, of the same kind as `known`.
    pub(super) fn same_refuge(&self, at: &Motion, known: &Way) -> Option<Way> {
        if !known.stretches.is_empty() {
            return self.descent(at, known.stretches.len() - 1, known.share());
        }
        let mut way = Way::new();
        let mut at = *at;
        for leg in known.legs.iter().rev() {
            let Some((next, end)) = self.leg(&at, leg.goal, leg.share).ok()? else {
                continue;
            };
            way.legs.insert(0, next).ok()?;
            at = end;
        }
        self.rests(&way, &at).then_some(way)
    }

    /// A way to rest from `at` that keeps every limit, by stretches and a leg to rest, which is first tried behind `least`
    /// stretches and with the share of number `share`.
    fn descent(&self, at: &Motion, least: usize, mut share: usize) -> Option<Way> {
        let mut way = Way::new();
        let mut at = *at;
        loop {
            if way.stretches.len() >= least {
                if let Some(leg) = self.halt(&at, &mut share) {
                    way.legs.push(leg).ok()?;
                    way.stretches.reverse();
                    return Some(way);
                }
            }
            let (stretch, end) = self.steepest(&at)?;
            way.stretches.push(stretch).ok()?;
            at = end;
        }
    }

    /// A way to rest from `at` along the guide.
    pub(super) fn guided_refuge(&self, at: &Motion, known: &Way) -> Option<Way> {
        self.descent(at, known.stretches.len().saturating_sub(1), known.share())
            .or_else(|| {
                if known.stretches.len() > 1 {
                    self.descent(at, 0, known.share())
                } else {
                    None
                }
            })
    }

    /// A leg from `at` to rest that keeps every limit.
    fn halt(&self, at: &Motion, hint: &mut usize) -> Option<Leg> {
        let grip = self.grip(at, 0.0, at.node);
        nearest(&HALTS, hint, |share| {
            let (leg, end) = self.run(at, Goal::Halt, 0.0, grip, share)?;
            if self.on_path(&end) {
                Ok(leg)
            } else {
                Err(Breach::Velocity)
            }
        })
    }

    /// A way to rest from `at` that keeps every limit.
    pub(super) fn refuge(&self, at: &Motion, hints: &mut Hints) -> Option<Way> {
        let halt = |at: &Motion, hint: &mut usize| {
            let mut way = Way::new();
            way.legs.push(self.halt(at, hint)?).ok()?;
            Some(way)
        };
        let behind = |goal: Goal, hint: &mut usize| {
            largest(&OTHERS, |share| {
                let (leg, end) = self.leg(at, goal, share)?.ok_or(Breach::Velocity)?;
                let mut way = halt(&end, hint).ok_or(Breach::Velocity)?;
                way.legs.push(leg).map_err(|_| Breach::Velocity)?;
                Ok(way)
            })
        };
        let [direct, released, lowered] = &mut hints.0;
        halt(at, direct)
            .or_else(|| {
                let rising = at.a != 0.0;
                rising.then(|| behind(Goal::Release, released)).flatten()
            })
            .or_else(|| behind(self.tightest(at)?, lowered))
            .or_else(|| {
                // With jerk limited, acceleration takes longer to change than segments do.
                let brisk = self.nodes.get(at.node).brisk;
                brisk.then(|| self.descent(at, 1, 0)).flatten()
            })
    }

    /// The leg from `at` to `goal` with `share` of the limits, and the motion at its end, or what that breaks; none is needed
    /// where the goal lies behind.
    fn leg(&self, at: &Motion, goal: Goal, share: f32) -> Result<Option<(Leg, Motion)>, Breach> {
        match goal {
            Goal::Halt => {
                let grip = self.grip(at, 0.0, at.node);
                self.run(at, goal, 0.0, grip, share).map(Some)
            }
            Goal::Release => {
                let jerks = self.jerk(at.node, self.ahead(at), at.v, at.a);
                let jerk = share * if at.a > 0.0 { jerks.down } else { jerks.up };
                let ticks = larger(1.0, libm::ceilf(at.a.abs() / jerk * self.hz));
                if !(ticks <= PHASE_MAX as f32) {
                    return Err(Breach::Velocity);
                }
                let ticks = [0, 0, ticks as u32];
                let to = at.v;
                let leg = Leg {
                    goal,
                    share,
                    to,
                    ticks,
                };
                Ok(Some((leg, self.end_of(at, &leg)?)))
            }
            Goal::Limit { to, number } => {
                // Behind, it is beyond the window.
                let node = number.wrapping_sub(self.first) as usize;
                if !(at.node..self.end).contains(&node) || to >= at.v + larger(0.0, at.a) {
                    return Ok(None);
                }
                let grip = self.grip(at, to, node);
                self.run(at, goal, to, grip, share).map(Some)
            }
        }
    }

    /// The leg from `at` to velocity `to` with `share` of `grip`, and the motion at its end.
    fn run(
        &self,
        at: &Motion,
        goal: Goal,
        to: f32,
        grip: Grip,
        share: f32,
    ) -> Result<(Leg, Motion), Breach> {
        let ticks = brake(at.v, at.a, to, grip.share(share)).ticks(self.hz);
        if ticks.iter().any(|&n| n > PHASE_MAX) {
            return Err(Breach::Velocity);
        }
        let leg = Leg {
            goal,
            share,
            to,
            ticks,
        };
        Ok((leg, self.end_of(at, &leg)?))
    }

    fn end_of(&self, at: &Motion, leg: &Leg) -> Result<Motion, Breach> {
        let course = leg.course(at, 1.0 / self.hz).ok_or(Breach::Velocity)?;
        self.run_on(at, &course)
    }

    /// Whether `way`, which ends in `end`, ends at rest and on the path.
    fn rests(&self, way: &Way, end: &Motion) -> bool {
        let halts = way
            .legs
            .first()
            .is_some_and(|leg| matches!(leg.goal, Goal::Halt));
        halts && self.on_path(end)
    }

    /// Whether `end` does not lie behind what is known of the path.
    fn on_path(&self, end: &Motion) -> bool {
        end.node < self.end - 1 || end.left >= 0.0
    }

    /// The velocity limit ahead that leaves the least room for braking to it.
    fn tightest(&self, at: &Motion) -> Option<Goal> {
        let here = self.grip(at, 0.0, at.node);
        let rising = larger(0.0, at.a);
        let mut lowest = at.v + rising * rising / (2.0 * here.down);
        let mut distance = at.left;
        let mut tightest = None;
        let mut room = f32::MAX;
        let halt = brake(at.v, at.a, 0.0, here).distance;
        for index in at.node..self.end {
            let node = self.nodes.get(index);
            let next = self.nodes.get(index + 1);
            let cap = smaller(node.exit_v, next.limits.v);
            if node.stop {
                break;
            }
            if cap < lowest {
                lowest = cap;
                let left = distance - brake(at.v, at.a, cap, here).distance;
                if left < room {
                    room = left;
                    tightest = Some(Goal::Limit {
                        to: cap,
                        number: self.first.wrapping_add(index as u32),
                    });
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
    /// on the way, jerk where it is let go.
    pub(super) fn grip(&self, at: &Motion, to: f32, last: usize) -> Grip {
        let middle = MIDDLE * at.v + (1.0 - MIDDLE) * to;
        let here = self.ahead(at);
        let most = self.acceleration(at.node, here, middle).down;
        let free = sqrt(larger(0.0, at.v - to) * self.jerk(at.node, here, middle, 0.0).down);
        let half = self
            .jerk(at.node, here, middle, -0.5 * smaller(most, free))
            .down;
        let there = if last == at.node {
            here
        } else {
            self.whole(last)
        };
        Grip {
            a: most,
            down: smaller(self.jerk(at.node, here, at.v, at.a).down, half),
            up: self.jerk(last, there, to, 0.0).up,
        }
    }

    /// The phases of `part` from the planned state in whole units of jerk.
    pub(super) fn exactly(&self, part: &Part) -> Option<Phases> {
        let Leg {
            goal, to, ticks, ..
        } = *match part {
            Part::Stretch(stretch) => return self.exactly_stretched(stretch),
            Part::Leg(leg) => leg,
        };
        if let Goal::Release = goal {
            // Where that leads is given.
            let jerk = -self.state.a / i128::from(ticks[2]);
            return Some([(0, 0), (0, 0), (i64::try_from(jerk).ok()?, ticks[2])]);
        }
        slow(&self.state, (to / self.hz * UNIT) as i128, ticks)
    }

    /// To rest whatever that takes. For a state without a way to rest, of which there should be none.
    pub(super) fn forced(&self) -> Phases {
        let at = self.motion();
        let grip = self.grip(&at, 0.0, at.node);
        let ticks = brake(at.v, at.a, 0.0, grip).ticks(self.hz);
        let ticks = ticks.map(|n| n.min(PHASE_MAX));
        slow(&self.state, 0, ticks).unwrap_or([(0, 1); 3])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_share_is_found_wherever_there_is_one_and_the_search_ends(
            hard in 0_usize..=HALTS.len(),
            weak in 0_usize..=HALTS.len(),
            from in 0..HALTS.len(),
        ) {
            let (first, end) = (hard.min(weak), hard.max(weak));
            let mut hint = from;
            let mut runs = 0;
            let found = nearest(&HALTS, &mut hint, |share| {
                runs += 1;
                let index = HALTS.iter().position(|&x| x == share).unwrap();
                if index < first {
                    Err(Breach::Change)
                } else if index < end {
                    Ok(index)
                } else {
                    Err(Breach::Velocity)
                }
            });
            let far = from.abs_diff(found.unwrap_or(first));
            prop_assert!(runs <= far + 2, "{runs} runs from {from} to {first}");
            prop_assert_eq!(found.is_some(), first < end);
            if let Some(index) = found {
                prop_assert!((first..end).contains(&index));
                prop_assert_eq!(index, hint);
            }
        }
    }
}
