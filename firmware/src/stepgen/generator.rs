//! Commanded positions to a step frame.
//!
//! The emitted count of an axis is its commanded position rounded half up. Within a tick the position is
//! taken as linear in time; an edge falls where it crosses the next half step. Consecutive edges are then
//! never closer than the pitch of the faster of two neighbouring ticks, also across the tick border.

use super::{AxisSteps, StepFrame, SLOTS};
use crate::units::AXES;

/// Adding this turns rounding half up into a plain floor.
const HALF: i64 = 1 << 31;

/// Steps emitted for a commanded position in Q32.32 steps: rounded half up.
#[inline]
#[must_use]
pub fn emitted(commanded: i64) -> i32 {
    ((commanded + HALF) >> 32) as i32
}

/// Turns successive positions into frames.
#[derive(Clone, Debug)]
pub struct StepGenerator {
    position: [i64; AXES],
    negative: [bool; AXES],
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
            position,
            negative: [false; AXES],
            turn_slots,
            turn_share: ((slots - turn_slots) << 16) / slots,
        }
    }

    /// Last position taken.
    #[must_use]
    pub fn position(&self) -> &[i64; AXES] {
        &self.position
    }

    /// Frame of the tick that ends at `next`.
    ///
    /// At most `SLOTS` steps per axis; the configuration bounds velocities well below.
    pub fn advance(&mut self, next: &[i64; AXES]) -> StepFrame {
        let mut frame = StepFrame::default();
        for a in 0..AXES {
            let (from, to) = (self.position[a] + HALF, next[a] + HALF);
            let steps = (to >> 32) - (from >> 32);
            if steps != 0 {
                frame.axes[a] = self.edges(a, from, to, steps);
            }
        }
        self.position = *next;
        frame
    }

    fn edges(&mut self, axis: usize, from: i64, to: i64, steps: i64) -> AxisSteps {
        let negative = steps < 0;
        let fraction = from & 0xffff_ffff;
        // Distance to the first crossing and distance covered, Q32 steps.
        let first = if negative {
            fraction
        } else {
            (1 << 32) - fraction
        } as u64;
        let span = to.abs_diff(from);
        // 1 / span with a 16-bit mantissa, rounded down so that no edge is pushed out of the tick.
        let zeros = span.leading_zeros();
        let mantissa = ((span << zeros) >> 48) as u32 + 1;
        let reciprocal = u64::from(u32::MAX / mantissa);
        let to_slots = |distance: u64| -> u32 {
            let ratio = (((distance << zeros) >> 32) * reciprocal) >> 16;
            ((ratio * u64::from(SLOTS)) >> 16) as u32
        };
        let mut edges = AxisSteps {
            count: steps.unsigned_abs() as u16,
            negative,
            first: to_slots(first).saturating_sub(1),
            pitch: if steps.unsigned_abs() > 1 {
                to_slots(1 << 32)
            } else {
                0
            },
        };
        if negative != self.negative[axis] {
            self.negative[axis] = negative;
            let squeeze = |x: u32| ((u64::from(x) * u64::from(self.turn_share)) >> 16) as u32;
            edges.first = (self.turn_slots << 16) + squeeze(edges.first);
            edges.pitch = squeeze(edges.pitch);
        }
        edges
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

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
                let edges = generator.advance(&[next; AXES]).axes[3];
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
