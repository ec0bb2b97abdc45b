//! The programs that are measured: committed as formulas, the same text on every machine.
//!
//! Out: NC text for a machine whose five axes all do what the X axis of the built-in one does (the instruction
//! meter's image sets that up; [`machine`] is its twin for the simulator).

use std::fmt::Write;

use pentaspline::config::{AxisKind, Config};
use pentaspline::units::{AXES, NANO_PER_UNIT};

use crate::diagnostics::Failure;
use crate::machine_file::Machine;

/// The built-in machine with five axes as fast as its X axis, the rotary ones in degrees.
///
/// # Errors
/// As [`Machine::built_in`].
pub fn machine() -> Result<Machine, Failure> {
    let mut machine = Machine::built_in()?;
    let x = machine.config.axes[0];
    for axis in &mut machine.config.axes {
        axis.v_max = x.v_max;
        axis.a_max = x.a_max;
        axis.j_max = x.j_max;
        axis.steps_per_unit = x.steps_per_unit;
        axis.travel_min = -600 * NANO_PER_UNIT;
        axis.travel_max = 600 * NANO_PER_UNIT;
    }
    Ok(machine)
}

/// A dwell: 0.2 s at rest.
#[must_use]
pub fn rest() -> String {
    "G4 F0.2\nM30\n".to_owned()
}

/// Five axes along a straight line, each at `steps_per_s`, in `blocks` blocks of `pitch` mm per axis from `from` mm.
///
/// The feed counts the linear axes only; each of them moves by the same amount.
#[must_use]
pub fn line(config: &Config, steps_per_s: f64, from: f64, pitch: f64, blocks: u32) -> String {
    let linear = config
        .axes
        .iter()
        .filter(|axis| axis.kind == AxisKind::Linear)
        .count();
    let per_axis = steps_per_s / config.axes[0].steps_per_unit.to_num::<f64>();
    let feed = per_axis * (linear as f64).sqrt() * 60.0;
    let mut text = format!("G0{}\nG1F{feed:.4}\n", point(config, [from; AXES]));
    for k in 1..=blocks {
        text.push_str(&point(config, [from + pitch * f64::from(k); AXES]));
        text.push('\n');
    }
    text.push_str("M30\n");
    text
}

/// A five-axis C-spline through `knots` points about `pitch` mm apart: a circle of 20 mm radius with a ripple in
/// the plane, rising, while both rotary axes swing.
#[must_use]
pub fn spline(config: &Config, knots: u32, pitch: f64, feed: f64) -> String {
    let mut text = format!("G64 SOFT\nG1 F{feed}\nCSPLINE\n");
    for k in 1..=knots {
        let t = f64::from(k) * pitch / 25.0;
        let at = [
            20.0 * t.sin(),
            20.0 * (1.0 - t.cos()) + 3.0 * (3.0 * t).sin(),
            // Rises and falls again, so that a long program stays inside the travel.
            40.0 * (t / 20.0).sin(),
            5.0 * (t / 2.0).sin(),
            8.0 * (t / 3.0).sin(),
        ];
        text.push_str(&point(config, at));
        text.push('\n');
    }
    text.push_str("M30\n");
    text
}

/// The same path as [`spline`] without the rotary axes, which are slow on the machine an image is built for.
#[must_use]
pub fn plane_spline(config: &Config, knots: u32, pitch: f64, feed: f64) -> String {
    // An address with its number; keywords begin with the same letters.
    let rotary = |word: &str| {
        config.axes.iter().any(|axis| {
            axis.kind == AxisKind::Rotary
                && word
                    .strip_prefix(char::from(axis.letter))
                    .is_some_and(|number| !number.starts_with(char::is_alphabetic))
        })
    };
    spline(config, knots, pitch, feed)
        .lines()
        .map(|line| {
            let words = line.split(' ').filter(|word| !rotary(word));
            words.collect::<Vec<_>>().join(" ") + "\n"
        })
        .collect()
}

/// Blocks after which [`long`] repeats its path.
pub const PERIOD: u32 = 500;

/// Lines of a C-spline through `blocks` points about 0.5 mm apart at 200 mm/s, each made when it is asked for: a rippled
/// circle in three axes, over and over, for the built-in machine as it is.
pub fn long(blocks: u32) -> impl Iterator<Item = String> {
    let head = ["G64 SOFT", "G1 F12000", "CSPLINE"].map(str::to_owned);
    let points = (1..=blocks).map(|k| {
        let t = f64::from(k % PERIOD) / f64::from(PERIOD) * std::f64::consts::TAU;
        let at = [
            35.0 * t.sin() + 2.0 * (5.0 * t).sin(),
            35.0 * (1.0 - t.cos()),
            5.0 * (2.0 * t).sin(),
        ];
        // Minus zero is a word clients send, but not what is measured here.
        let [x, y, z] = at.map(|value| value + 0.0);
        format!("X{x:.4} Y{y:.4} Z{z:.4}")
    });
    head.into_iter().chain(points).chain(["M30".to_owned()])
}

/// `blocks` quarters of a circle of 10 mm radius, clockwise.
#[must_use]
pub fn quarter_circles(blocks: usize) -> String {
    let quarters = [
        "G2 X10 Y10 I10 J0\n",
        "G2 X20 Y0 I0 J-10\n",
        "G2 X10 Y-10 I-10 J0\n",
        "G2 X0 Y0 I0 J10\n",
    ];
    let mut text = "G17 G64 SOFT\nG1 F6000 X0 Y0\n".to_owned();
    text.extend(quarters.into_iter().cycle().take(blocks));
    text.push_str("M30\n");
    text
}

/// A cubic B-spline over `points` control points about 2 mm apart whose weights are 1 and 2 in turn.
#[must_use]
pub fn nurbs(points: u32) -> String {
    let mut text = "G64 SOFT\nG1 F6000\nBSPLINE\n".to_owned();
    for k in 1..=points {
        let t = f64::from(k) * 0.08;
        let [x, y, z] = [20.0 * t.sin(), 20.0 * (1.0 - t.cos()), (3.0 * t).sin()];
        // Writing to a String cannot fail.
        let _ = writeln!(text, "X{x:.4} Y{y:.4} Z{z:.4} PW={}", 1 + k % 2);
    }
    text.push_str("M30\n");
    text
}

/// Chooses a tool of 1 mm radius on its way to the contour.
const TOOL: &str = "G10 L1 P1 R1\nG17 G64 SOFT\nT1 M6\nD1\n";

/// A zigzag of `blocks` lines with the tool on its left: every other corner is an inner one.
#[must_use]
pub fn offset_lines(blocks: u32) -> String {
    let mut text = format!("{TOOL}G1 F6000 X0 Y0\nG41 X10 Y0\n");
    for k in 0..blocks {
        let _ = writeln!(text, "X{} Y{}", 20 + 10 * k, if k % 2 == 0 { 5 } else { 0 });
    }
    text.push_str("G40 Y30\nM30\n");
    text
}

/// A C-spline along a wave through `knots` points 2 mm apart in X with the tool on its left.
#[must_use]
pub fn offset_spline(knots: u32) -> String {
    let mut text = format!("{TOOL}G1 F6000 X-10 Y0\nG41 X0 Y0\nCSPLINE\n");
    for k in 1..=knots {
        let _ = writeln!(text, "X{} Y{:.4}", 2 * k, 4.0 * (f64::from(k) / 4.0).sin());
    }
    let _ = write!(text, "G1 X{} Y0\nG40 Y30\nM30\n", 2 * knots + 5);
    text
}

fn point(config: &Config, at: [f64; AXES]) -> String {
    let mut text = String::new();
    for (axis, value) in config.axes.iter().zip(at) {
        // Writing to a String cannot fail. Minus zero is a word clients send, but not what is measured here.
        let _ = write!(text, " {}{:.4}", char::from(axis.letter), value + 0.0);
    }
    text.split_off(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_feed_of_a_line_gives_each_axis_its_step_rate() {
        let config = machine().unwrap().config;
        let text = line(&config, 100_000.0, -5.0, 2.5, 2);
        // 100 mm/s on each of three linear axes is 173.2051 mm/s along the path.
        assert_eq!(
            text,
            "G0X-5.0000 Y-5.0000 Z-5.0000 A-5.0000 C-5.0000\nG1F10392.3048\n\
             X-2.5000 Y-2.5000 Z-2.5000 A-2.5000 C-2.5000\n\
             X0.0000 Y0.0000 Z0.0000 A0.0000 C0.0000\nM30\n"
        );
    }

    #[test]
    fn every_program_of_one_stage_runs_through_the_core() {
        let machine = machine().unwrap();
        for text in [
            quarter_circles(8),
            nurbs(20),
            offset_lines(6),
            offset_spline(40),
        ] {
            let run = crate::bench::host::speed(&machine, &text);
            assert!(run.is_ok(), "{run:?} of\n{text}");
        }
    }

    #[test]
    fn a_plane_spline_leaves_the_rotary_axes_alone() {
        let config = machine().unwrap().config;
        let text = plane_spline(&config, 3, 2.0, 1500.0);
        assert_eq!(text.lines().count(), 7);
        assert!(text.lines().skip(3).all(|l| !l.contains(['A', 'C'])));
        assert!(text.contains("CSPLINE\n"));
    }
}
