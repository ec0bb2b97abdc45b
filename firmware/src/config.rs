//! Machine configuration in SI-like units (mm, degree, s) as the machine file states it.
//!
//! State inside the core is in machine units (steps, ticks); the conversions live here.

use crate::nc::command::{BoundaryCondition, Plane};
use crate::units::{Nano, Steps, AXES, NANO_PER_UNIT};

/// [`AxisConfig::rounding_tolerance`] of an axis whose machine file gives none, mm or degree.
pub const ROUNDING_TOLERANCE: f32 = 0.01;
/// Tools a machine file can name, and the tool table of the core holds.
pub const TOOLS: usize = 16;
/// Settable zero offsets: `G54` to `G57`.
pub const ZERO_OFFSETS: usize = 4;
/// Bytes of a tool name.
pub const TOOL_NAME: usize = 16;

/// One row of the tool table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ToolData {
    /// `T5`; 0 marks a free row.
    pub number: u32,
    /// `T="FR_4"`; padded with zero bytes, all zero for a tool without a name.
    pub name: [u8; TOOL_NAME],
    /// Cutter radius, 1e-6 mm.
    pub radius: Nano,
    /// Length, added along the normal of the working plane, 1e-6 mm.
    pub length: Nano,
}

impl ToolData {
    /// A row without a tool.
    pub const FREE: Self = Self {
        number: 0,
        name: [0; TOOL_NAME],
        radius: 0,
        length: 0,
    };
}

/// How the rotary axes turn the tool (`XH YH ZH`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Head {
    /// The axes do not turn the tool: `XH YH ZH` are refused.
    None,
    /// Rotation C about Z carries tilt A about X: tool vector `(sin A sin C, -sin A cos C, cos A)`.
    CA,
    /// Rotation C about Z carries tilt B about Y: tool vector `(sin B cos C, sin B sin C, cos B)`.
    CB,
}

/// Words a program is written in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Dialect {
    /// Sinumerik 840D and System 800 (`G6`).
    #[default]
    Sinumerik,
    /// Fanuc: `G06.2`.
    Fanuc,
    /// Heidenhain conversational: `L`, `CC`, `C`, `SPL`.
    Heidenhain,
}

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
    /// Furthest this axis may leave the programmed path where `G642` rounds a corner, mm or degree; 0: corners stay.
    /// [`ROUNDING_TOLERANCE`] where the machine file says nothing.
    pub rounding_tolerance: f32,
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
    /// `G54` to `G57`: zero offsets added to programmed coordinates; `G54` is in force at power-up.
    pub zero_offsets: [[Nano; AXES]; ZERO_OFFSETS],
    /// `G74`: reference point, machine coordinates.
    pub reference_point: [Nano; AXES],
    /// `G75`: fixed point, machine coordinates.
    pub fixed_point: [Nano; AXES],
    /// Tool table at power-up.
    pub tools: [ToolData; TOOLS],
    /// Which way the rotary axes turn the tool.
    pub head: Head,
    /// Dialect at power-up.
    pub dialect: Dialect,
    /// Working plane at power-up.
    pub plane: Plane,
    /// Start condition of A- and C-splines at power-up.
    pub spline_begin: BoundaryCondition,
    /// End condition of A- and C-splines at power-up.
    pub spline_end: BoundaryCondition,
    /// Largest difference between the radii of an arc at its start and end, mm.
    pub arc_tolerance: f32,
    /// Largest distance between a programmed curve and the cubic segments it is driven as, mm or degree.
    pub curve_tolerance: f32,
    /// Most material a compensated tool may leave where the contour is tighter than the tool, mm; beyond it the
    /// contour is refused. Inner corners of the programmed contour do not count.
    pub contour_tolerance: f32,
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
        if let Some(steps) = self.steps_from_near(axis, nano) {
            return Some(steps);
        }
        // In whole units and rests, all of one sign: 64 bits hold every product, and a division of 128 is 3000 instructions.
        let unit = NANO_PER_UNIT;
        let per_unit = self.axes[axis].steps_per_unit.to_bits();
        let (whole, rest) = (nano / unit, nano % unit);
        // |rest| < 10^6 on either side: neither product overflows.
        let (part, small) = (rest * (per_unit / unit), rest * (per_unit % unit));
        let half = if small < 0 { -unit / 2 } else { unit / 2 };
        whole
            .checked_mul(per_unit)?
            .checked_add(part)?
            .checked_add((small + half) / unit)
            .map(Steps::from_bits)
    }

    /// [`Config::steps_from_nano`] for coordinates up to 274 877 units on an axis of less than 2048 steps per unit, in 32-bit
    /// divisions by a constant, which are multiplications: a division of 64 bits is 130 instructions. `None` beyond.
    #[inline]
    fn steps_from_near(&self, axis: usize, nano: Nano) -> Option<Steps> {
        // 10^6 = 2^6 * 5^6
        const FIVES: u32 = 15_625;
        let per_unit = self.axes[axis].steps_per_unit.to_bits();
        let size = nano.unsigned_abs();
        if size >> 38 != 0 || !(0..1 << 43).contains(&per_unit) {
            return None;
        }
        let per_unit = per_unit as u64;
        let whole = (size >> 6) as u32 / FIVES;
        // the difference fits 32 bits though its terms do not
        let rest = (size as u32).wrapping_sub(whole.wrapping_mul(NANO_PER_UNIT as u32));
        // below 2^20 * 2^43, and digits of 16 bits of the quotient by 5^6
        let part = (u64::from(rest) * per_unit + NANO_PER_UNIT as u64 / 2) >> 6;
        let (high, low) = ((part >> 32) as u32, part as u32);
        let middle = (high % FIVES) << 16 | low >> 16;
        let last = (middle % FIVES) << 16 | low & 0xffff;
        let quotient = (u64::from(high / FIVES) << 32)
            + u64::from((middle / FIVES) << 16)
            + u64::from(last / FIVES);
        // below 2^19 * 2^43
        let bits = (u64::from(whole) * per_unit + quotient) as i64;
        Some(Steps::from_bits(if nano < 0 { -bits } else { bits }))
    }

    /// Indices of the first axis, second axis and normal of `plane`; `None` for a letter the machine does not have.
    #[must_use]
    pub fn plane_axes(&self, plane: Plane) -> [Option<usize>; 3] {
        plane
            .letters()
            .map(|letter| self.axes.iter().position(|axis| axis.letter == letter))
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
            rounding_tolerance: 0.01,
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
            zero_offsets: [[0; AXES]; ZERO_OFFSETS],
            reference_point: [0; AXES],
            fixed_point: [0; AXES],
            tools: [ToolData::FREE; TOOLS],
            head: Head::CA,
            dialect: Dialect::Sinumerik,
            plane: Plane::Xy,
            spline_begin: BoundaryCondition::Natural,
            spline_end: BoundaryCondition::Natural,
            arc_tolerance: 0.01,
            curve_tolerance: 1.0e-4,
            contour_tolerance: 0.05,
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

    proptest::proptest! {
        /// Exact rational arithmetic in 128 bits: the nearest 2^-32 step, halves away from zero, or out of range.
        #[test]
        fn every_coordinate_becomes_the_nearest_bit_of_a_step(
            nano in proptest::num::i64::ANY,
            shift in 0_u32..40,
            per_unit in 1_i64..1 << 50,
            coarser in 0_u32..50,
        ) {
            let per_unit = (per_unit >> coarser).max(1);
            let mut config = test_config();
            config.axes[2].steps_per_unit = Steps::from_bits(per_unit);
            let nano = nano >> shift;
            let twice = 2 * i128::from(nano) * i128::from(per_unit);
            let magnitude = (twice.abs() + 1_000_000) / 2_000_000;
            let want = i64::try_from(magnitude * twice.signum()).ok().map(Steps::from_bits);
            proptest::prop_assert_eq!(config.steps_from_nano(2, nano), want);
        }
    }
}
