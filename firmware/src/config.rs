//! Machine configuration in SI-like units (mm, degree, s) as the machine file states it.
//!
//! State inside the core is in machine units (steps, ticks); the conversions live here.

use crate::units::{Nano, Steps, AXES, NANO_PER_UNIT};

/// What an axis moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AxisKind {
    /// Millimetres; counts towards path length.
    Linear,
    /// Degrees; moves along.
    Rotary,
}

/// One axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisConfig {
    /// Address letter in NC text, upper case.
    pub letter: u8,
    /// Linear or rotary.
    pub kind: AxisKind,
    /// Steps per mm or degree.
    pub steps_per_unit: Steps,
    /// Largest velocity, mm/s or degree/s.
    pub v_max: f32,
    /// Largest acceleration, mm/s^2 or degree/s^2.
    pub a_max: f32,
    /// Largest jerk, mm/s^3 or degree/s^3 (`SOFT`).
    pub j_max: f32,
    /// Velocity step allowed at a corner under `G64`, mm/s or degree/s; 0 asks for an exact stop.
    pub corner_step: f32,
    /// Lower end of travel, machine coordinates.
    pub travel_min: Nano,
    /// Upper end of travel, machine coordinates.
    pub travel_max: Nano,
}

/// Whole machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Config {
    /// Name shown in reports.
    pub name: &'static str,
    /// Axes in the order of all per-axis arrays.
    pub axes: [AxisConfig; AXES],
    /// Servo interrupts per second.
    pub servo_hz: u32,
    /// Width of a step pulse in slots of the step frame.
    pub pulse_slots: u16,
    /// Slots a direction must stand before a step edge.
    pub dir_setup_slots: u16,
    /// `G54`: zero offset added to programmed coordinates.
    pub zero_offset: [Nano; AXES],
    /// Feed assumed until a program gives `F`, mm/s. 0 refuses `G1` without `F`.
    pub default_feed: f32,
    /// True if `SOFT` is in force at power-up.
    pub default_soft: bool,
    /// Ticks without a new line after which a window that is not full is committed all the same.
    pub starve_ticks: u32,
}

impl Config {
    /// Converts a programmed coordinate of `axis` to steps, rounding to nearest 2^-32 step.
    ///
    /// Returns `None` if the result leaves the range of [`Steps`].
    #[must_use]
    pub fn steps_from_nano(&self, axis: usize, nano: Nano) -> Option<Steps> {
        let scaled = i128::from(nano) * i128::from(self.axes[axis].steps_per_unit.to_bits());
        let unit = i128::from(NANO_PER_UNIT);
        let half = if scaled < 0 { -unit / 2 } else { unit / 2 };
        i64::try_from((scaled + half) / unit)
            .ok()
            .map(Steps::from_bits)
    }

    /// Millimetres or degrees per step of `axis`.
    #[must_use]
    pub fn units_per_step(&self, axis: usize) -> f32 {
        1.0 / self.axes[axis].steps_per_unit.to_num::<f32>()
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// The MCV 1210 of `machines/mcv1210.toml`, written out by hand.
    pub(crate) fn test_config() -> Config {
        let linear = |letter, half: i64| AxisConfig {
            letter,
            kind: AxisKind::Linear,
            steps_per_unit: Steps::from_num(1000),
            v_max: 666.6667,
            a_max: 5000.0,
            j_max: 50_000.0,
            corner_step: 0.0,
            travel_min: -half * NANO_PER_UNIT,
            travel_max: half * NANO_PER_UNIT,
        };
        let rotary = |letter, half| AxisConfig {
            kind: AxisKind::Rotary,
            v_max: 1.0,
            a_max: 5.0,
            j_max: 50.0,
            ..linear(letter, half)
        };
        Config {
            name: "test",
            axes: [
                linear(b'X', 500),
                linear(b'Y', 400),
                linear(b'Z', 300),
                rotary(b'A', 115),
                rotary(b'C', 200),
            ],
            servo_hz: 5000,
            pulse_slots: 2,
            dir_setup_slots: 4,
            zero_offset: [0; AXES],
            default_feed: 0.0,
            default_soft: true,
            starve_ticks: 1500,
        }
    }

    #[test]
    fn programmed_decimals_become_steps_rounded_to_nearest() {
        let mut config = test_config();
        config.axes[1].steps_per_unit = Steps::from_bits((400 << 32) / 3);
        for (nano, axis) in [(1_800_000, 0), (-1, 0), (7, 1), (-123_456_789, 1), (1, 4)] {
            let steps = config.steps_from_nano(axis, nano).unwrap();
            let exact = nano as f64 * config.axes[axis].steps_per_unit.to_num::<f64>() / 1e6;
            assert!((steps.to_num::<f64>() - exact).abs() < 3e-10 * (1.0 + exact.abs()));
        }
        assert_eq!(
            config.steps_from_nano(0, 1_800_000),
            Some(Steps::from_num(1800))
        );
        assert_eq!(config.steps_from_nano(0, i64::MAX), None);
    }
}
