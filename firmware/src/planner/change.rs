//! From one tempo to another: planned anew where the motion is slow enough for it, else after slowing down.
//!
//! In: the tempo asked for and the planned state. Out: nodes limited by that tempo, and the pieces that lead there.
//!
//! A tempo is taken up in a state that is safe under its limits. A motion that is too fast for that slows down first,
//! as hard as the limits allow, to a velocity from which it is. Where not even that can be done, as in front of a
//! programmed stop or a sharp corner, the plan goes on as it was: it slows down anyway, and at rest every tempo will do.

use core::sync::atomic::Ordering::Acquire;

use super::brake::{brake, slow, Grip, Phases};
use super::course::{Course, Motion, TAKING};
use super::limits::{Demand, PathLimits, Share};
use super::profile::{View, SLACK, UNIT};
use super::refuge::{Hints, Way};
use super::tempo::{Change, Request, Schedule, Tempo};
use super::Planner;
use crate::config::Config;
use crate::interpolator::PieceEnd;
use crate::machine::Event;

/// Shares of the limits a slowing down is tried with: whole ticks and joints on the way take some.
const SHARES: [f32; 4] = [0.97, 0.85, 0.6, 0.4];

/// Shares of the velocity the new tempo allows here that are tried to slow down to. Zero is rest, and always safe.
const TARGETS: [f32; 3] = [1.0, 0.6, 0.0];

/// Ticks until a change that could not be made is tried again.
const AGAIN: u32 = 20;

/// The rest of a slowing down.
#[derive(Clone, Copy)]
pub(super) struct Slowing {
    phases: Phases,
    /// Tempo at its end.
    then: Tempo,
}

/// How the tempo stands.
pub(super) struct Pace {
    /// Under which the state is within its limits.
    now: Tempo,
    /// The last one asked for, whether it counts already or not.
    asked: Tempo,
    /// The one that counts.
    wanted: Tempo,
    slowing: Option<Slowing>,
    /// The way to rest from the end of the slowing down, or from the planned state.
    way: Way,
    /// The next try begins at this planned tick.
    again: u32,
}

impl Pace {
    pub(super) const NEW: Self = Self {
        now: Tempo::PROGRAMMED,
        asked: Tempo::PROGRAMMED,
        wanted: Tempo::PROGRAMMED,
        slowing: None,
        way: Way::new(),
        again: 0,
    };
}

impl View<'_> {
    /// The way to rest from `at` within the limits of the nodes, if the motion can go on there.
    fn settled(&self, at: &Motion) -> Option<Way> {
        let node = self.nodes.get(at.node);
        let demand = Demand::new([at.v, at.a, 0.0]);
        let within = at.v <= node.limits.v * SLACK
            && self.keeps(
                node,
                || self.ahead(at),
                &demand,
                Share { a: SLACK, j: SLACK },
            );
        within
            .then(|| self.refuge(at, &mut Hints::default()))
            .flatten()
    }

    /// The least velocity allowed on the way that braking to it takes.
    fn allowed_ahead(&self) -> f32 {
        let at = self.motion();
        let mut v = self.nodes.get(at.node).limits.v;
        let mut left = at.left;
        let mut index = at.node;
        while index < self.last {
            let PathLimits { a, j } = self.at(index, self.whole(index), at.v);
            if !(a > 0.0) || left > 1.2 * brake(at.v, at.a, v.min(at.v), Grip::even(a, j)).distance
            {
                break;
            }
            index += 1;
            let next = self.nodes.get(index);
            v = v.min(next.limits.v);
            left += next.length;
        }
        v.min(at.v)
    }

    /// Phases that slow down to `to` (path units/s), with the motion at their end. `None` if the limits of the nodes do not
    /// let it.
    fn slow_to(&self, to: f32) -> Option<(Phases, Motion)> {
        let at = self.motion();
        let end = (f64::from(to) / f64::from(self.hz) * f64::from(UNIT)) as i128;
        let here = self.grip(&at, to, at.node);
        SHARES.iter().find_map(|share| {
            let ticks = brake(at.v, at.a, to, here.share(*share)).ticks(self.hz);
            let phases = slow(&self.state, end, ticks)?;
            let there = self
                .follow(&at, &self.course(&phases), self.last, TAKING)
                .ok()?;
            (there.left >= 0.0).then_some((phases, there))
        })
    }
}

impl Planner<'_> {
    /// Asks for a change of tempo at this instant of the motion. At rest, with nothing planned, it counts at once.
    pub fn request(&mut self, change: Change) {
        if self.at_rest() && self.state.v == 0 {
            self.pace.asked.apply(change);
            self.take_change(change);
        } else {
            let tick = self.shared.executed.load(Acquire);
            self.schedule_request(Request { tick, change });
        }
    }

    fn schedule_request(&mut self, request: Request) {
        self.pace.asked.apply(request.change);
        self.schedule.put(request);
    }

    /// The tempo asked for last, in force or not.
    #[must_use]
    pub fn tempo(&self) -> Tempo {
        self.pace.asked
    }

    /// An override of 0 % keeps the path from being run.
    #[must_use]
    pub fn is_barred(&self) -> bool {
        self.pace.wanted.is_barred()
    }

    fn take_change(&mut self, change: Change) {
        self.pace.wanted.apply(change);
        if let Change::Starve(ticks) = change {
            self.cut_supply(ticks);
        }
        self.pace.again = self.planned;
    }

    /// What the interrupt was asked for that is the controller's business.
    pub fn take_raised(&mut self) -> Option<Event> {
        self.raised.take()
    }

    /// Takes in the requests that count from here on.
    pub(super) fn take_requests(&mut self) {
        while let Some(request) = self.requests.dequeue() {
            match request.change {
                Change::Resume => self.raised = Some(Event::Resume),
                Change::Reset => self.raised = Some(Event::Reset),
                _ => self.schedule_request(request),
            }
        }
        while let Some(change) = self.schedule.due(self.planned) {
            self.take_change(change);
        }
        // Ticks of motion do not go on at rest, and nothing is planned while an override keeps it there.
        while self.is_barred() && self.at_rest() {
            let Some(change) = self.schedule.next() else {
                break;
            };
            self.take_change(change);
        }
    }

    /// No faster than `most`, path units/s.
    pub(super) fn limit_tempo(&mut self, most: f32) {
        self.pace.wanted.most = most;
        self.pace.again = self.planned;
    }

    /// Back to what the program says.
    pub(super) fn clear_tempo(&mut self) {
        while self.requests.dequeue().is_some() {}
        self.schedule = Schedule::default();
        self.pace = Pace::NEW;
    }

    /// Forgets a slowing down: the state is another one now, and at rest.
    pub(super) fn drop_slowing(&mut self) {
        self.take_way(Way::new());
        self.pace.again = self.planned;
    }

    /// Brings the tempo in force nearer to the one asked for; `true` if that has planned something.
    ///
    /// Call it with enough known of what lies ahead, or at rest.
    pub(super) fn change_tempo(&mut self, config: &Config) -> bool {
        let due = self.planned.wrapping_sub(self.pace.again) <= u32::MAX / 2;
        if self.settled_wish() != self.pace.wanted && due {
            self.pace.again = self.planned.wrapping_add(AGAIN);
            self.replan(config);
        }
        self.settled_wish() != self.pace.now && self.run_slowing(config)
    }

    /// The tempo there will be if nothing else is planned.
    fn settled_wish(&self) -> Tempo {
        self.pace
            .slowing
            .map_or(self.pace.now, |slowing| slowing.then)
    }

    fn replan(&mut self, config: &Config) {
        let Pace { now, wanted, .. } = self.pace;
        self.set_tempo(&wanted, self.cursor);
        let view = self.view(config);
        let rests = self.state.v == 0 && self.state.a == 0;
        let way = if rests {
            Some(Way::new())
        } else if wanted.is_barred() {
            None
        } else {
            view.settled(&view.motion())
        };
        if let Some(way) = way {
            self.pace.now = wanted;
            self.take_way(way);
            return;
        }
        let allowed = self.view(config).allowed_ahead();
        for share in TARGETS {
            if wanted.is_barred() && share > 0.0 {
                continue;
            }
            self.set_tempo(&now, self.cursor);
            let Some((phases, there)) = self.view(config).slow_to(share * allowed) else {
                continue;
            };
            self.set_tempo(&wanted, there.node);
            let way = if share == 0.0 {
                Some(Way::new())
            } else {
                self.view(config).settled(&there)
            };
            if let Some(way) = way {
                self.pace.slowing = Some(Slowing {
                    phases,
                    then: wanted,
                });
                self.pace.way = way;
                return;
            }
        }
        self.set_tempo(&now, self.cursor);
    }

    /// Goes on with a slowing down to a tempo that is still wanted and not in force yet; `true` if there is one.
    pub(super) fn keep_slowing(&mut self, config: &Config) -> bool {
        let wish = self.settled_wish();
        wish == self.pace.wanted && wish != self.pace.now && self.run_slowing(config)
    }

    /// The next slowing down on the way to rest, or what is left of it.
    pub(super) fn begun(&self, config: &Config) -> Option<Course> {
        let view = self.view(config);
        match &self.pace.slowing {
            Some(slowing) => Some(view.course(&slowing.phases)),
            None => {
                let part = self.pace.way.first()?;
                part.course(&view.motion(), 1.0 / view.hz)
            }
        }
    }

    /// The way to rest from the planned state; its first part may have begun.
    pub(super) fn known_way(&self) -> &Way {
        &self.pace.way
    }

    /// The way to rest from the planned state is `way`.
    pub(super) fn take_way(&mut self, way: Way) {
        self.pace.slowing = None;
        self.pace.way = way;
    }

    /// From rest to rest by `phases`.
    pub(super) fn run_slowly(&mut self, config: &Config, phases: Phases) {
        self.take_way(Way::new());
        self.pace.slowing = Some(Slowing {
            phases,
            then: self.pace.now,
        });
        self.run_slowing(config);
    }

    /// On along the way to rest.
    pub(super) fn go_on(&mut self, config: &Config) {
        if self.pace.slowing.is_none() {
            let part = self.pace.way.take_first();
            let view = self.view(config);
            let phases = part.and_then(|part| view.exactly(&part));
            let phases = phases.unwrap_or_else(|| view.forced());
            self.pace.slowing = Some(Slowing {
                phases,
                then: self.pace.now,
            });
        }
        self.run_slowing(config);
    }

    /// Plans the next piece of a slowing down, if there is one.
    fn run_slowing(&mut self, config: &Config) -> bool {
        let Some(mut slowing) = self.pace.slowing else {
            return false;
        };
        let Some(phase) = slowing.phases.iter_mut().find(|phase| phase.1 > 0) else {
            self.pace.slowing = None;
            return false;
        };
        // Two halves of what is little more than a piece: a short one is as much work as a long one.
        let piece = self.view(config).effort(self.cursor).slowing;
        let ticks = match phase.1 {
            left if left <= piece => left,
            left if left < 2 * piece => left / 2,
            _ => piece,
        };
        phase.1 -= ticks;
        let jerk = phase.0;
        let more = slowing.phases.iter().any(|phase| phase.1 > 0);
        let mut end = PieceEnd::Continue;
        if !more {
            let rest = self
                .state
                .after(jerk, ticks)
                .is_some_and(|state| state.v.abs() < super::profile::FINE);
            if rest {
                end = PieceEnd::StopHere;
            }
        }
        self.pace.slowing = more.then_some(slowing);
        self.emit(config, &[(jerk, ticks)], end);
        if !more {
            self.pace.now = slowing.then;
            self.set_tempo(&slowing.then, self.cursor);
        }
        true
    }

    /// Limits the nodes from `first` on by `tempo`.
    fn set_tempo(&mut self, tempo: &Tempo, first: usize) {
        for index in first..self.nodes.len() {
            if let Some(node) = self.nodes.get_mut(index) {
                node.set_tempo(tempo);
            }
        }
    }

    /// The tempo in force.
    pub(super) fn tempo_now(&self) -> Tempo {
        self.pace.now
    }
}
