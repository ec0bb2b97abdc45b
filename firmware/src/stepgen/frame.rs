//! The step frame: what one servo tick asks of the step port.

use crate::units::AXES;

/// Slots per servo tick. 5 kHz x 560 = 2.8 MHz, 60 timer clocks of 168 MHz; 280 pulses of two slots
/// carry 84 m/min at 1 um per step, more than twice the envelope of 40 m/min.
pub const SLOTS: u16 = 560;

/// Step edges of one axis within one tick.
///
/// The k-th rising edge (k = 0..count) falls in slot `(first + k * pitch) >> 16`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AxisSteps {
    /// Number of steps in this tick; without any, the rest has no meaning.
    pub count: u16,
    /// Direction: true counts down.
    pub negative: bool,
    /// Slot of the first edge, Q16.16.
    pub first: u32,
    /// Distance between edges, Q16.16 slots.
    pub pitch: u32,
}

impl AxisSteps {
    /// Slots of the rising edges, in order.
    pub fn slots(self) -> impl Iterator<Item = u16> {
        (0..u32::from(self.count)).map(move |k| ((self.first + k * self.pitch) >> 16) as u16)
    }

    /// Signed number of steps.
    #[must_use]
    pub fn signed_count(self) -> i32 {
        let n = i32::from(self.count);
        if self.negative {
            -n
        } else {
            n
        }
    }
}

/// All step edges of one servo tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StepFrame {
    /// Per axis, in configuration order.
    pub axes: [AxisSteps; AXES],
}
