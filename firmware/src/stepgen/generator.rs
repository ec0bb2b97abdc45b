//! Commanded positions to a step frame.
//!
//! The emitted count of an axis is its commanded position rounded half up. Within a tick the position is
//! taken as linear in time; an edge falls where it crosses the next half step. Consecutive edges are then
//! never closer than the pitch of the faster of two neighbouring ticks, also across the tick border.

use super::{AxisSteps, StepFrame, SLOTS};
use crate::units::{phase, Phase, AXES, PHASE_FRAC};

/// Fractional bits of the upper word of a [`Phase`].
const UPPER_FRAC: u32 = PHASE_FRAC - 32;

/// Steps emitted for a commanded position in Q32.32 steps: rounded half up.
#[inline]
#[must_use]
pub fn emitted(commanded: i64) -> i32 {
    (commanded.wrapping_add(1 << 31) >> 32) as i32
}

/// Turns successive positions into frames.
#[derive(Clone, Debug)]
pub struct StepGenerator {
    /// Where each axis is, and how many steps it has made.
    at: [Phase; AXES],
    emitted: [i32; AXES],
    /// An axis without steps keeps its direction.
    frame: StepFrame,
    /// The frame holds steps.
    stepped: bool,
    /// Slots kept free before the first edge after a change of direction.
    turn_slots: u32,
    /// Share of the tick that is left then, Q16.
    turn_share: u32,
}

impl StepGenerator {
    /// Starts at `position` (Q32.32 steps) with all directions positive. After a change of direction the
    /// first `2 * pulse_slots + dir_setup_slots` slots of the frame stay free of edges.
    #[must_use]
    pub fn new(position: [i64; AXES], pulse_slots: u16, dir_setup_slots: u16) -> Self {
        let slots = u32::from(SLOTS);
        let turn_slots = (2 * u32::from(pulse_slots) + u32::from(dir_setup_slots)).min(slots / 2);
        Self {
            at: position.map(phase),
            emitted: position.map(emitted),
            frame: StepFrame::default(),
            stepped: false,
            turn_slots,
            turn_share: ((slots - turn_slots) << 16) / slots,
        }
    }

    /// Last position taken, Q32.32 steps; what a phase holds beyond that is cut off.
    #[inline]
    #[must_use]
    pub fn position(&self) -> [i64; AXES] {
        core::array::from_fn(|a| {
            let fraction = (self.at[a] >> (PHASE_FRAC - 32)) & 0xffff_ffff;
            ((i64::from(self.emitted[a]) << 32) | fraction).wrapping_sub(1 << 31)
        })
    }

    /// Steps emitted so far.
    #[inline]
    #[must_use]
    pub fn emitted(&self) -> &[i32; AXES] {
        &self.emitted
    }

    /// The frame of this tick, if any axis steps in it.
    #[inline]
    #[must_use]
    pub fn frame(&self) -> Option<&StepFrame> {
        self.stepped.then_some(&self.frame)
    }

    /// Begins a tick: no axis has moved yet.
    #[inline(always)]
    pub fn begin(&mut self) {
        if self.stepped {
            self.stepped = false;
            for axis in &mut self.frame.axes {
                axis.count = 0;
            }
        }
    }

    /// Moves `axis` to `next`, where it is at the end of this tick. At most once per tick and axis.
    ///
    /// Less than [`SPAN_MAX`](crate::envelope::SPAN_MAX); the configuration bounds velocities at
    /// [`STEPS_MAX`](crate::envelope::STEPS_MAX) steps per tick.
    #[inline(always)]
    pub fn lead(&mut self, axis: usize, next: Phase) {
        let before = core::mem::replace(&mut self.at[axis], next);
        if upper(before ^ next) >> UPPER_FRAC != 0 {
            self.stepped = true;
            let train = &mut self.frame.axes[axis];
            if edges(train, &mut self.emitted[axis], before, next) {
                self.turn(axis);
            }
        }
    }

    /// The edges of an axis that changes its direction make room for the direction's set-up time.
    #[cold]
    #[inline(never)]
    fn turn(&mut self, axis: usize) {
        let squeeze = |x: u32| ((u64::from(x) * u64::from(self.turn_share)) >> 16) as u32;
        let train = &mut self.frame.axes[axis];
        train.first = (self.turn_slots << 16) + squeeze(train.first);
        train.pitch = squeeze(train.pitch);
    }
}

/// Edges of an axis that makes steps between `before` and `next`. In `train`, what it did before; true if its direction changes.
#[inline(never)]
fn edges(train: &mut AxisSteps, emitted: &mut i32, before: Phase, next: Phase) -> bool {
    // Whole parts modulo 2^14, so the difference has 14 bits and a sign.
    let border = |x: Phase| upper(x) & !((1 << UPPER_FRAC) - 1);
    let steps = border(next).wrapping_sub(border(before)) as i32 >> UPPER_FRAC;
    let negative = steps < 0;
    let count = steps.unsigned_abs();
    // Distance to the first crossing, Q0.32 steps, a unit too short at most.
    let fraction = (before >> (PHASE_FRAC - 32)) as u32;
    let first = if negative { fraction } else { !fraction };
    let span = next.wrapping_sub(before).unsigned_abs();
    let (first, pitch) = place(first, span);
    let turned = (steps as u32 >> 31) ^ u32::from(train.negative);
    *train = AxisSteps {
        count: count as u16,
        negative,
        first: first.saturating_sub(1),
        pitch: if count > 1 { pitch } else { 0 },
    };
    *emitted = emitted.wrapping_add(steps);
    turned != 0
}

/// The upper word of a phase.
#[inline(always)]
fn upper(x: Phase) -> u32 {
    (x as u64 >> 32) as u32
}

/// Time of the first edge and time between edges, Q16.16 slots, for a way of `first` (Q0.32 steps) to the first edge and
/// `span` (steps with [`PHASE_FRAC`] fractional bits) in the whole tick. Rounded down, so that no edge is pushed out of
/// the tick. The pitch is zero where no second edge can be.
///
/// One division of words: 1 / span has 16 bits, which places the last of 280 edges within 1/50 slot.
#[inline(always)]
fn place(first: u32, span: u64) -> (u32, u32) {
    const SLOT: u32 = SLOTS as u32;
    let whole = (span >> 32) as u32;
    if whole >> UPPER_FRAC != 0 {
        // A step or more: whole = mantissa 2^(16 - zeros), at most one less than the way.
        let zeros = whole.leading_zeros();
        let mantissa = ((whole << zeros) >> 16) + 1;
        // slots / way = SLOT 2^16 2^UPPER_FRAC / (mantissa 2^(16 - zeros))
        let pitch = (SLOT * (u32::MAX / mantissa)) >> (32 - UPPER_FRAC - zeros);
        let first = (u64::from(first) * u64::from(pitch)) >> 32;
        (first as u32, pitch)
    } else {
        // Less than a step, so one edge: both ways are fractions of a step.
        let way = ((span >> (PHASE_FRAC - 32)) as u32).max(1);
        let zeros = way.leading_zeros();
        let mantissa = ((way << zeros) >> 16) + 1;
        // 6 bits behind the point: 2^16 SLOT 2^6 is just below 2^32.
        let share = ((first.min(way) << zeros) >> 16) * (SLOT << 6) / mantissa;
        (share << 10, 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const HALF: i64 = 1 << 31;

    proptest! {
        /// Edges add up to the rounded position, lie inside the tick, rise in time, and stand where the
        /// straight line between the two positions crosses a half step (exact rational oracle, one slot).
        #[test]
        fn edges_follow_the_commanded_line(
            start in -1_000_000_i64..1_000_000,
            fraction in 0_i64..1 << 32,
            moves in prop::collection::vec(-200_i64 << 32..200 << 32, 1..50),
            slow in any::<bool>(),
        ) {
            let mut at = (start << 32) + fraction;
            let mut generator = StepGenerator::new([at; AXES], 2, 4);
            let mut counted = emitted(at);
            let mut negative = false;
            for delta in moves {
                let delta = if slow { delta >> 9 } else { delta };
                let next = at + delta;
                generator.begin();
                (0..AXES).for_each(|a| generator.lead(a, phase(next)));
                let edges = generator.frame().copied().unwrap_or_default().axes[3];
                prop_assert_eq!(generator.position()[3], next);
                prop_assert_eq!(generator.emitted()[3], emitted(next));
                counted += edges.signed_count();
                prop_assert_eq!(counted, emitted(next));
                let slots: Vec<u16> = edges.slots().collect();
                prop_assert!(slots.windows(2).all(|w| w[0] <= w[1]));
                prop_assert!(slots.iter().all(|&s| s < SLOTS));
                if edges.count > 0 {
                    if edges.negative == negative {
                        for (k, &slot) in slots.iter().enumerate() {
                            // Half-step boundary crossed by edge k, in Q32 steps offset by one half.
                            let base = (at + HALF) >> 32;
                            let boundary = if delta > 0 { base + 1 + k as i64 } else { base - k as i64 };
                            let distance = ((i128::from(boundary) << 32) - i128::from(at + HALF)).unsigned_abs();
                            let exact = distance as f64 * f64::from(SLOTS) / (delta.unsigned_abs() as f64);
                            prop_assert!((f64::from(slot) - exact).abs() <= 1.05, "{} {}", slot, exact);
                        }
                    } else {
                        prop_assert!(slots[0] >= 8);
                    }
                    negative = edges.negative;
                }
                at = next;
            }
        }
    }
}
