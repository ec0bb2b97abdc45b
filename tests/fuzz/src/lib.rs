//! What the fuzz targets share: a machine, and what must hold for every segment the core hands on.

use pentaspline::config::{
    AxisConfig, AxisKind, Config, Dialect, Head, ToolData, TOOLS, ZERO_OFFSETS,
};
use pentaspline::geometry::travel::outside_travel;
use pentaspline::geometry::HermiteSegment;
use pentaspline::nc::command::{BoundaryCondition, Plane};
use pentaspline::units::{Steps, AXES, NANO_PER_UNIT};

/// Segments one block may give before the target calls it endless.
pub const SEGMENTS_MAX: usize = 1_000_000;

/// How far `f32` may lead the travel check astray, mm or degree.
const TRAVEL_ROUNDING: f64 = 2e-3;

/// The MCV 1210 with a tool in the table, speaking `dialect`.
pub fn config(dialect: Dialect) -> Config {
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
    let mut tools = [ToolData::FREE; TOOLS];
    tools[0] = ToolData {
        number: 1,
        name: *b"FR_4\0\0\0\0\0\0\0\0\0\0\0\0",
        radius: 2 * NANO_PER_UNIT,
        length: 50 * NANO_PER_UNIT,
    };
    Config {
        name: "fuzz",
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
        tools,
        head: Head::CA,
        dialect,
        plane: Plane::Xy,
        spline_begin: BoundaryCondition::Natural,
        spline_end: BoundaryCondition::Natural,
        arc_tolerance: 0.01,
        curve_tolerance: 1.0e-4,
        contour_tolerance: 0.05,
        default_feed: 10.0,
        default_soft: true,
        starve_ticks: 1500,
    }
}

/// The dialect a byte of the input chooses.
pub fn dialect(byte: u8) -> Dialect {
    [Dialect::Sinumerik, Dialect::Fanuc, Dialect::Heidenhain][usize::from(byte % 3)]
}

/// Finite slopes; and where the travel check passes the segment, every point of it lies within travel.
///
/// # Panics
/// If not.
pub fn check(config: &Config, segment: &HermiteSegment) {
    for axis in 0..AXES {
        assert!(
            segment.slope_start[axis].is_finite() && segment.slope_end[axis].is_finite(),
            "{segment:?}"
        );
    }
    if outside_travel(config, segment).is_some() {
        return;
    }
    for (a, axis) in config.axes.iter().enumerate() {
        let unit = axis.steps_per_unit.to_num::<f64>();
        let (p, q) = (
            segment.start[a].to_num::<f64>() / unit,
            segment.end[a].to_num::<f64>() / unit,
        );
        let (m, n) = (
            f64::from(segment.slope_start[a]),
            f64::from(segment.slope_end[a]),
        );
        let (low, high) = (axis.travel_min as f64 * 1e-6, axis.travel_max as f64 * 1e-6);
        for k in 0..=32 {
            let u = f64::from(k) / 32.0;
            let at = p + u * (m + u * (3.0 * (q - p) - 2.0 * m - n + u * (2.0 * (p - q) + m + n)));
            assert!(
                at > low - TRAVEL_ROUNDING && at < high + TRAVEL_ROUNDING,
                "axis {a} reaches {at} at u = {u}: {segment:?}"
            );
        }
    }
}
