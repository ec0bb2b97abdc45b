//! When the rows of an event file act, on a clock that simulator and emulated board share.
//!
//! In: rows in order, and once per servo tick whether it moved. Out: which row acts before the next tick.
//!
//! The clock counts the ticks in which a path is followed, and those at rest while a hold or an override of 0 % is in
//! force or while a program stop waits for a row that resumes. It stands while the machine waits for text or for the
//! planner: how long that takes differs from one run to the next. So the same rows meet the same tick of the motion in
//! every run.

use super::Event;
use crate::units::Tick;

/// Rows a table may have: what the emulated board has room for.
pub const ROWS_MAX: usize = 64;

/// An event and the reading of the clock at which it acts, before the servo tick of that number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Row {
    /// Reading of the clock.
    pub tick: Tick,
    /// What happens.
    pub event: Event,
}

/// Why a machine with work to do is at rest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Standing {
    /// It moves, waits for text or for the planner, or has nothing to do.
    #[default]
    No,
    /// An override of 0 %.
    Barred,
    /// `M0` or `M1`.
    ProgramStop,
}

/// The clock.
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    ticks: Tick,
    held: bool,
    /// Feed and rapid override of the rows so far, percent.
    overrides: [u8; 2],
    /// A row has let the machine go on, and nothing has moved since.
    starting: bool,
}

impl Default for Clock {
    fn default() -> Self {
        Self::new()
    }
}

impl Clock {
    /// At zero.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            ticks: 0,
            held: false,
            overrides: [100; 2],
            starting: false,
        }
    }

    /// True if `row` acts now. Behind one that lets the machine go on, none does before the machine moves again.
    #[must_use]
    pub fn is_due(&self, row: &Row) -> bool {
        !self.starting && row.tick <= self.ticks
    }

    /// `event` has acted.
    pub fn acted(&mut self, event: Event) {
        let barred = self.overrides.contains(&0);
        match event {
            Event::Hold => self.held = true,
            Event::Feed(percent) => self.overrides[0] = percent,
            Event::Rapid(percent) => self.overrides[1] = percent,
            Event::Resume => {
                self.held = false;
                self.starting = true;
            }
            _ => {}
        }
        self.starting |= barred && !self.overrides.contains(&0) && !self.held;
    }

    /// A servo tick is over; `next` is the row that acts next.
    pub fn tick(&mut self, moving: bool, standing: Standing, next: Option<&Row>) {
        let counts = match standing {
            Standing::No => false,
            Standing::Barred => true,
            Standing::ProgramStop => next.is_some_and(|row| row.event == Event::Resume),
        };
        self.starting &= !moving;
        self.ticks += Tick::from(moving || self.held || (counts && !self.starting));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(tick: Tick, event: Event) -> Row {
        Row { tick, event }
    }

    #[test]
    fn waiting_for_the_planner_does_not_count_and_a_hold_does() {
        let mut clock = Clock::new();
        let (hold, resume, last) = (
            row(3, Event::Hold),
            row(7, Event::Resume),
            row(7, Event::Hold),
        );
        for moving in [false, true, false, true, false, false] {
            assert!(!clock.is_due(&hold));
            clock.tick(moving, Standing::No, Some(&hold));
        }
        clock.tick(true, Standing::No, Some(&hold));
        assert!(clock.is_due(&hold));
        clock.acted(Event::Hold);
        for moving in [true, false, false, false] {
            assert!(!clock.is_due(&resume));
            clock.tick(moving, Standing::No, Some(&resume));
        }
        assert!(clock.is_due(&resume));
        clock.acted(Event::Resume);
        // Not before the machine moves again.
        for _ in 0..3 {
            assert!(!clock.is_due(&last));
            clock.tick(false, Standing::No, Some(&last));
        }
        clock.tick(true, Standing::No, Some(&last));
        assert!(clock.is_due(&last));
    }

    #[test]
    fn a_program_stop_counts_for_a_row_that_resumes_only() {
        let mut clock = Clock::new();
        clock.tick(false, Standing::ProgramStop, Some(&row(1, Event::Feed(50))));
        assert!(!clock.is_due(&row(1, Event::Feed(50))));
        clock.tick(false, Standing::ProgramStop, Some(&row(1, Event::Resume)));
        assert!(clock.is_due(&row(1, Event::Resume)));
    }
}
