//! Segments come more slowly than they are used: drive what is known so that it can end in a rest.
//!
//! In: a planner that knows too little to go on as usual, while the motion is about to run out. Out: a ceiling that ends
//! at rest with the last segment known, at a velocity the supply can sustain.
//!
//! The end of what is known is taken for a stop as long as nothing more comes. While it does, the ceiling is made anew
//! over what has come, and no faster than covers the known path in [`HORIZON`]: velocity then follows the supply as a
//! filter of first order with that time constant, instead of rushing to the end of each segment and braking there.
//! Only a landing that has begun makes the stop final; a machine that comes to rest there was underrun.

use core::sync::atomic::Ordering::Relaxed;

use super::{Planner, LEAD_TICKS};
use crate::geometry::arc::S_FRAC;

/// Time in which the known path would be covered at the velocity chosen, s.
const HORIZON: f32 = 0.5;

/// What is left of the lead when a motion that knows too little goes on: enough to plan in, little enough for more
/// segments to come before.
const LAST_MOMENT: u32 = LEAD_TICKS / 2;

/// Planned ticks between two ceilings over what has come meanwhile.
const EVERY: u32 = 50;

/// A supply that is said to fail, whatever comes.
#[derive(Clone, Copy)]
struct Cut {
    /// It fails for decisions before this planned tick.
    until: u32,
    /// Running number of the last node that counts as known.
    last: u32,
}

/// How the supply of segments stands.
pub(super) struct Supply {
    /// The motion is planned to rest at the end of what is known.
    scarce: bool,
    /// Running number of the node whose end is taken for a stop, for now.
    taken: Option<u32>,
    /// Planned tick at which the ceiling was made, and the number of nodes known then.
    made: u32,
    known: u32,
    /// The motion lands where it does because nothing followed.
    underrun: bool,
    /// Number and text line of the node that a time-out made the last one while the machine moved.
    timed_out: Option<(u32, u32)>,
    cut: Option<Cut>,
}

impl Supply {
    pub(super) const NEW: Self = Self {
        scarce: false,
        taken: None,
        made: 0,
        known: 0,
        underrun: false,
        timed_out: None,
        cut: None,
    };
}

impl Planner<'_> {
    /// Nodes that may be looked at.
    pub(super) fn known(&self) -> usize {
        let all = self.nodes.len();
        self.supply.cut.map_or(all, |cut| {
            all.min(cut.last.wrapping_sub(self.first) as usize + 1)
        })
    }

    pub(super) fn stands(&self) -> bool {
        self.state.v == 0 && self.state.a == 0
    }

    /// From here on for `ticks` planned ticks nothing counts that lies behind the ceiling in force. At rest nothing can
    /// fail to come in time.
    pub(super) fn cut_supply(&mut self, ticks: u32) {
        if !self.stands() && !self.supply.scarce {
            self.supply.cut = Some(Cut {
                until: self.planned.wrapping_add(ticks.min(u32::MAX / 4)),
                last: self.last,
            });
        }
    }

    /// Everything is there again, or the motion rests.
    pub(super) fn end_scarcity(&mut self) {
        self.take_back();
        self.supply.cut = None;
        if self.supply.scarce {
            self.supply.scarce = false;
            self.limit_tempo(f32::INFINITY);
        }
    }

    /// Makes sure of a ceiling over what lies ahead; `false` if the motion has to wait for segments.
    pub(super) fn cover(&mut self, executed: u32) -> bool {
        if self.supply.underrun {
            return false;
        }
        if let Some(cut) = self.supply.cut {
            if self.stands() || self.planned.wrapping_sub(cut.until) <= u32::MAX / 2 {
                self.end_scarcity();
            }
        }
        let full = !self.has_room();
        if self.supply.scarce && (self.stands() || (full && self.supply.cut.is_none())) {
            self.end_scarcity();
        }
        if !self.supply.scarce && self.knows_enough() {
            return true;
        }
        if self.stands() {
            return false;
        }
        // A motion that has not begun can wait, too.
        let lead = self.planned.wrapping_sub(executed);
        let late = lead <= LAST_MOMENT && self.shared.ready.load(Relaxed);
        if self.supply.cut.is_none() && !late {
            return false;
        }
        self.reach();
        true
    }

    /// The motion ends with what is known, for now.
    fn reach(&mut self) {
        let known = self.known();
        let number = self.first.wrapping_add(known as u32);
        if self.supply.scarce {
            let new = number != self.supply.known;
            let ends = self.nodes.get(known - 1).stop && self.supply.taken.is_some();
            let early = self.planned.wrapping_sub(self.supply.made) < EVERY;
            if !new || (early && !ends) {
                return;
            }
        }
        self.take_back();
        let stop = (self.cursor..known).find(|&index| self.nodes.get(index).stop);
        let last = stop.unwrap_or(known.saturating_sub(1)).max(self.cursor);
        let end = self.first.wrapping_add(last as u32);
        if stop.is_none() {
            if let Some(node) = self.nodes.get_mut(last) {
                node.stop = true;
                self.supply.taken = Some(end);
            }
        }
        self.supply.scarce = true;
        self.supply.made = self.planned;
        self.supply.known = number;
        self.last = end;
        let mut distance = -(self.state.coordinate() as f32 / (1_u64 << S_FRAC) as f32);
        for index in self.cursor..known {
            distance += self.nodes.get(index).length;
        }
        self.limit_tempo(distance / HORIZON);
    }

    /// The end of what was known is no stop any more.
    fn take_back(&mut self) {
        if let Some(number) = self.supply.taken.take() {
            let index = number.wrapping_sub(self.first) as usize;
            if let Some(node) = self.nodes.get_mut(index) {
                node.stop = false;
            }
        }
    }

    /// No text has come for a time: the path ends with the newest segment, for now.
    pub fn time_out(&mut self) {
        let Some(last) = &self.pending else {
            return;
        };
        let number = self.first.wrapping_add(self.nodes.len() as u32);
        self.supply.timed_out = (!self.stands()).then_some((number, last.block));
        self.flush();
    }

    /// A landing at the end of node `number` has been planned.
    pub(super) fn lands(&mut self, number: u32) {
        if self.supply.taken == Some(number) {
            self.supply.taken = None;
            self.supply.underrun = true;
        }
    }

    /// Text line at whose end the machine has come to rest because nothing followed in time; once.
    ///
    /// After a time-out that is known only when something follows after all: the program may have ended.
    pub fn take_underrun(&mut self) -> Option<u32> {
        if let Some((number, block)) = self.supply.timed_out {
            let next = self.first.wrapping_add(self.cursor as u32);
            let rests = self.stands() && next == number.wrapping_add(1);
            if rests && (self.pending.is_some() || self.cursor < self.nodes.len()) {
                self.supply.timed_out = None;
                return Some(block);
            }
        }
        if !self.supply.underrun || !self.at_rest() {
            return None;
        }
        self.supply.underrun = false;
        Some(self.shared.block.load(Relaxed))
    }
}
