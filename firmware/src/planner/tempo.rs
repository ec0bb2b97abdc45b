//! Feed and rapid override: what is asked for, from which planned tick on it counts, and what it makes of a node's
//! limits.
//!
//! In: requests with the tick of motion at which they were made. Out: a [`Tempo`], and nodes limited by it.
//!
//! A request made at tick T of the motion counts from the first decision on that begins at T + [`LEAD_TICKS`] or later.
//! No decision that early has been made when the request comes, however far ahead the planner is. So the motion depends
//! on T alone, and not on when the background gets round to it.

use heapless::Deque;

use super::nodes::Node;
use super::LEAD_TICKS;

/// Largest feed override, percent.
pub const FEED_MAX: u8 = 200;
/// Largest rapid override, percent.
pub const RAPID_MAX: u8 = 100;

/// Requests that can wait to count.
const WAITING: usize = 16;

/// How fast the path is to be run in relation to the program.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tempo {
    /// Percent of the programmed feed, up to [`FEED_MAX`].
    pub feed: u8,
    /// Percent of the axes' largest velocities in rapid motion, up to [`RAPID_MAX`].
    pub rapid: u8,
    /// No faster than this, path units/s: what the supply of segments can sustain.
    pub most: f32,
}

impl Tempo {
    /// As programmed.
    pub const PROGRAMMED: Self = Self {
        feed: 100,
        rapid: 100,
        most: f32::INFINITY,
    };

    /// Takes up `change` as far as it is one of the tempo.
    pub(super) fn apply(&mut self, change: Change) {
        match change {
            Change::Feed(percent) => self.feed = percent.min(FEED_MAX),
            Change::Rapid(percent) => self.rapid = percent.min(RAPID_MAX),
            Change::Starve(_) | Change::Resume | Change::Reset => {}
        }
    }

    /// An override of 0 %: nothing moves.
    #[must_use]
    pub fn is_barred(&self) -> bool {
        self.feed == 0 || self.rapid == 0
    }
}

/// What can be asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// Feed override, percent.
    Feed(u8),
    /// Rapid override, percent.
    Rapid(u8),
    /// For this many planned ticks, plan as if no further segments came.
    Starve(u32),
    /// For the controller.
    Resume,
    /// For the controller.
    Reset,
}

/// A change and the tick of motion at which it was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Request {
    /// Ticks of motion at that time, wrapping.
    pub tick: u32,
    /// What is asked for.
    pub change: Change,
}

/// Requests that do not count yet, in the order they came.
#[derive(Debug, Default)]
pub(super) struct Schedule {
    waiting: Deque<Request, WAITING>,
}

impl Schedule {
    /// Puts a request in. Without room the last one waiting makes place: it would have counted for an instant only.
    pub(super) fn put(&mut self, request: Request) {
        if self.waiting.is_full() {
            self.waiting.pop_back();
        }
        // There is room now.
        let _ = self.waiting.push_back(request);
    }

    /// Takes the next request that counts in a decision which begins at `planned`.
    pub(super) fn due(&mut self, planned: u32) -> Option<Change> {
        let front = self.waiting.front()?;
        let from = front.tick.wrapping_add(LEAD_TICKS);
        if planned.wrapping_sub(from) > u32::MAX / 2 {
            return None;
        }
        self.next()
    }

    /// Takes the next request, whether it counts yet or not.
    pub(super) fn next(&mut self) -> Option<Change> {
        self.waiting.pop_front().map(|request| request.change)
    }
}

impl Node {
    /// Limits the node by `tempo`.
    pub(super) fn set_tempo(&mut self, tempo: &Tempo) {
        let raised = tempo.feed > 100;
        if self.raised != raised {
            self.raised = raised;
            (self.exit_v, self.other_v) = (self.other_v, self.exit_v);
        }
        let percent = if self.rapid { tempo.rapid } else { tempo.feed };
        self.limits.v = self.velocity(percent).min(tempo.most);
    }

    /// Velocity at an override of `percent`: that of the program, as far as the curve allows.
    fn velocity(&self, percent: u8) -> f32 {
        self.curve_v
            .min(self.programmed_v * (f32::from(percent) / 100.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_counts_a_lead_after_it_was_made_and_in_order() {
        let mut schedule = Schedule::default();
        // The count wraps before the request counts.
        let start = u32::MAX - 20;
        for (tick, change) in [(start, Change::Feed(50)), (start + 7, Change::Rapid(25))] {
            schedule.put(Request { tick, change });
        }
        assert_eq!(schedule.due(start.wrapping_add(LEAD_TICKS - 1)), None);
        assert_eq!(
            schedule.due(start.wrapping_add(LEAD_TICKS)),
            Some(Change::Feed(50))
        );
        assert_eq!(schedule.due(start.wrapping_add(LEAD_TICKS)), None);
        assert_eq!(
            schedule.due(start.wrapping_add(500)),
            Some(Change::Rapid(25))
        );
        assert_eq!(schedule.due(start.wrapping_add(500)), None);
    }

    #[test]
    fn of_too_many_requests_the_last_is_kept() {
        let mut schedule = Schedule::default();
        for percent in 1..=40 {
            let change = Change::Feed(percent);
            schedule.put(Request { tick: 0, change });
        }
        let last = core::iter::from_fn(|| schedule.due(LEAD_TICKS)).last();
        assert_eq!(last, Some(Change::Feed(40)));
    }
}
