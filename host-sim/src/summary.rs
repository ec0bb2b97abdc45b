//! The summary of a run: what the JSON file says and standard output shows.
//!
//! In: one [`Sample`] per servo tick. Out: [`Summary`]. Velocity, acceleration and jerk are differences of
//! the commanded Q32.32 positions, taken exactly in integers and only then turned into `f64`; before the
//! first and after the last tick the machine counts as being at rest.

use pentaspline::config::AxisKind;
use pentaspline::machine::Sample;
use pentaspline::units::{Tick, AXES};
use serde::Serialize;

use crate::machine_file::Machine;
use crate::program::Program;
use crate::travel::{TravelWatch, Violation};

/// A limit counts as exceeded from this share above it.
pub const LIMIT_TOLERANCE: f64 = 0.005;
/// Ticks over which a feed must stand still to be compared with the path.
const STEADY_TICKS: u32 = 4;
/// Relative difference below which two feeds are the same (a few units of the last place of `f32`).
const STEADY: f32 = 1e-6;

/// Everything the JSON file holds. Units: mm or degrees, s.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// Program as it was named on the command line.
    pub program: String,
    /// Name of the machine.
    pub machine: String,
    /// Servo ticks per second.
    pub servo_hz: u32,
    /// `ticks / servo_hz`.
    pub duration_s: f64,
    /// Servo ticks simulated.
    pub ticks: Tick,
    /// Motion blocks seen in execution; a block shorter than one tick may be missed.
    pub blocks: u64,
    /// FNV-1a over the frames of all ticks in motion, 16 hexadecimal digits.
    pub digest: String,
    /// Per axis.
    pub axes: Vec<AxisSummary>,
    /// Along the path.
    pub path: PathSummary,
    /// Of the machine model; `null` where it was not simulated.
    pub plant: Option<PlantSummary>,
    /// What the user should know, one sentence each.
    pub warnings: Vec<String>,
    /// How the run ended: `finished`, `reset`, `waiting`, `program_error`, `alarm`, `time_bound` or `stuck`.
    pub outcome: String,
    /// The error that ended the run.
    pub error: Option<ErrorSummary>,
    /// Excursions beyond the travel.
    pub violations: Vec<Violation>,
}

/// One axis.
#[derive(Clone, Debug, Serialize)]
pub struct AxisSummary {
    /// Letter.
    pub name: String,
    /// `mm` or `degree`.
    pub unit: &'static str,
    /// Steps per unit.
    pub steps_per_unit: f64,
    /// Limit of velocity.
    pub v_limit: f64,
    /// Limit of acceleration.
    pub a_limit: f64,
    /// Limit of jerk.
    pub j_limit: f64,
    /// Largest |velocity|.
    pub v_max: f64,
    /// Largest |acceleration|.
    pub a_max: f64,
    /// Largest |jerk|.
    pub j_max: f64,
    /// Steps emitted since power-up, signed.
    pub final_steps: i32,
}

/// The path.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct PathSummary {
    /// Length over the linear axes, mm.
    pub length_mm: f64,
    /// Largest distance between the commanded point and the point of the integer steps emitted, mm, linear
    /// axes only: what rounding to steps costs.
    pub max_deviation_mm: f64,
    /// Largest relative difference between the feed measured on the commanded positions and the feed the
    /// core reports, over all ticks within a stretch of constant feed.
    pub feed_fluctuation: f64,
}

/// The machine model.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct PlantSummary {
    /// Largest |command - motor| of a linear axis, mm.
    pub max_following_error_mm: f64,
    /// Largest distance of the tool from the commanded path, mm.
    pub max_contour_error_mm: f64,
}

/// The error that ended a run.
#[derive(Clone, Debug, Serialize)]
pub struct ErrorSummary {
    /// Number of the controller's `error:N` or `ALARM:N`.
    pub code: u32,
    /// File, as named.
    pub file: String,
    /// Line in it, from 1; 0 if unknown.
    pub line: usize,
    /// Column, from 1; 0 if unknown.
    pub column: usize,
    /// Line of the streamed text, from 1; 0 if unknown.
    pub streamed_line: usize,
    /// The line itself.
    pub text: String,
    /// What is wrong.
    pub message: String,
}

/// Derivatives of one axis, exact. They saturate at 2^31 steps per tick (tick^2, tick^3),
/// beyond anything a tick can step.
#[derive(Clone, Copy, Debug, Default)]
struct AxisState {
    /// Last difference of each order, in bits of Q32.32.
    differences: [i64; 2],
    /// Largest |difference| of each order.
    peaks: [u64; 3],
}

impl AxisState {
    #[inline]
    fn push(&mut self, velocity: i64) {
        let acceleration = difference(velocity, self.differences[0]);
        let jerk = difference(acceleration, self.differences[1]);
        self.differences = [velocity, acceleration];
        for (peak, value) in self.peaks.iter_mut().zip([velocity, acceleration, jerk]) {
            *peak = (*peak).max(value.unsigned_abs());
        }
    }

    /// At rest for three ticks: another tick at rest changes nothing.
    #[inline]
    fn rests(&self) -> bool {
        self.differences == [0; 2]
    }
}

/// `a - b`, saturated; the two lie close to each other unless something is badly wrong.
#[inline]
fn difference(a: i64, b: i64) -> i64 {
    #[cold]
    fn bound(b: i64) -> i64 {
        if b < 0 {
            i64::MAX
        } else {
            i64::MIN
        }
    }
    match a.checked_sub(b) {
        Some(difference) => difference,
        None => bound(b),
    }
}

/// Square of what rounding to steps costs `axis`, `unit` being the units per bit.
#[inline]
fn rounding(sample: &Sample, axis: usize, unit: f64) -> f64 {
    let emitted = i64::from(sample.emitted[axis]) << 32;
    let off = difference(sample.commanded[axis].to_bits(), emitted) as f64 * unit;
    off * off
}

/// Collects a [`Summary`] tick by tick.
#[derive(Clone, Debug)]
pub struct SummaryBuilder {
    servo_hz: f64,
    linear: [bool; AXES],
    /// mm or degrees per bit of Q32.32.
    unit: [f64; AXES],
    axes: [AxisState; AXES],
    last: Sample,
    /// Square of what rounding to steps costs per axis now, and the largest sum of them, mm^2.
    rounding: [f64; AXES],
    worst_rounding: f64,
    ticks: Tick,
    blocks: u64,
    block: u32,
    path: PathSummary,
    steady: u32,
    /// |measured / reported - 1| of the tick before; counts once the next tick shows the feed still stands.
    candidate: Option<f64>,
}

impl SummaryBuilder {
    /// Starts at `initial`, the state before the first tick.
    #[must_use]
    pub fn new(machine: &Machine, initial: &Sample) -> Self {
        let linear = machine
            .config
            .axes
            .map(|axis| axis.kind == AxisKind::Linear);
        let unit = std::array::from_fn(|a| 1.0 / (4_294_967_296.0 * machine.steps_per_unit(a)));
        Self {
            servo_hz: f64::from(machine.config.servo_hz),
            linear,
            unit,
            axes: [AxisState::default(); AXES],
            last: *initial,
            rounding: std::array::from_fn(|a| {
                if linear[a] {
                    rounding(initial, a, unit[a])
                } else {
                    0.0
                }
            }),
            worst_rounding: 0.0,
            ticks: 0,
            blocks: 0,
            block: 0,
            path: PathSummary::default(),
            steady: 0,
            candidate: None,
        }
    }

    /// Takes the next tick in.
    pub fn tick(&mut self, sample: &Sample) {
        self.ticks += 1;
        if sample.block != self.block {
            self.blocks += u64::from(sample.block != 0);
            self.block = sample.block;
        }
        let (mut linear, mut rotary) = (0.0, 0.0);
        for (a, axis) in self.axes.iter_mut().enumerate() {
            let now = sample.commanded[a].to_bits();
            let moved = difference(now, self.last.commanded[a].to_bits());
            let stepped = sample.emitted[a] != self.last.emitted[a];
            if moved == 0 && !stepped && axis.rests() {
                continue;
            }
            axis.push(moved);
            let distance = moved as f64 * self.unit[a];
            if self.linear[a] {
                linear += distance * distance;
                self.rounding[a] = rounding(sample, a, self.unit[a]);
            } else {
                rotary += distance * distance;
            }
        }
        let off = self.rounding.iter().sum();
        self.worst_rounding = self.worst_rounding.max(off);
        let way = linear.sqrt();
        self.path.length_mm += way;
        self.feed(sample, if linear > 0.0 { way } else { rotary.sqrt() });
        self.last = *sample;
    }

    /// Compares the way of one tick with the reported feed, where that stands still before, in and after the tick.
    fn feed(&mut self, sample: &Sample, way: f64) {
        let same = sample.feed > 0.0
            && self.last.block == sample.block
            && (sample.feed - self.last.feed).abs() <= STEADY * sample.feed;
        if !same {
            self.steady = 0;
            self.candidate = None;
            return;
        }
        if let Some(candidate) = self.candidate.take() {
            self.path.feed_fluctuation = self.path.feed_fluctuation.max(candidate);
        }
        self.steady += 1;
        if self.steady >= STEADY_TICKS {
            self.candidate = Some((way * self.servo_hz / f64::from(sample.feed) - 1.0).abs());
        }
    }

    /// Closes the books: the machine rests from here on.
    #[must_use]
    pub fn finish(mut self, machine: &Machine, program: &str, digest: u64) -> Summary {
        self.path.max_deviation_mm = self.worst_rounding.sqrt();
        for axis in &mut self.axes {
            for _ in 0..3 {
                axis.push(0);
            }
        }
        let axes = machine.config.axes.iter().enumerate().map(|(a, config)| {
            let peak = |order: usize| {
                let hz = self.servo_hz.powi(order as i32 + 1);
                self.axes[a].peaks[order] as f64 * self.unit[a] * hz
            };
            AxisSummary {
                name: machine.axis_name(a).to_string(),
                unit: if self.linear[a] { "mm" } else { "degree" },
                steps_per_unit: machine.steps_per_unit(a),
                v_limit: decimal(config.v_max),
                a_limit: decimal(config.a_max),
                j_limit: decimal(config.j_max),
                v_max: peak(0),
                a_max: peak(1),
                j_max: peak(2),
                final_steps: self.last.emitted[a],
            }
        });
        Summary {
            program: program.to_owned(),
            machine: machine.config.name.to_owned(),
            servo_hz: machine.config.servo_hz,
            duration_s: self.ticks as f64 / self.servo_hz,
            ticks: self.ticks,
            blocks: self.blocks,
            digest: format!("{digest:016x}"),
            axes: axes.collect(),
            path: self.path,
            plant: None,
            warnings: Vec::new(),
            outcome: String::new(),
            error: None,
            violations: Vec::new(),
        }
    }
}

/// The `f32` as the decimal a person wrote: 666.6667 and not 666.6666870117188.
fn decimal(value: f32) -> f64 {
    value
        .to_string()
        .parse()
        .unwrap_or_else(|_| f64::from(value))
}

impl Summary {
    /// Axes and orders that exceed their limit by more than [`LIMIT_TOLERANCE`], one sentence each. Jerk
    /// counts only with `jerk_limited` (no `BRISK` in the program).
    #[must_use]
    pub fn limit_warnings(&self, jerk_limited: bool) -> Vec<String> {
        let mut warnings = Vec::new();
        for axis in &self.axes {
            let orders = [
                ("velocity", axis.v_max, axis.v_limit, true),
                ("acceleration", axis.a_max, axis.a_limit, true),
                ("jerk", axis.j_max, axis.j_limit, jerk_limited),
            ];
            for (order, reached, limit, counts) in orders {
                if counts && reached > limit * (1.0 + LIMIT_TOLERANCE) {
                    warnings.push(format!(
                        "{order} of axis {} reaches {reached:.3}, its limit is {limit}",
                        axis.name
                    ));
                }
            }
        }
        warnings
    }

    /// Takes over what the watch has found.
    pub fn take_violations(&mut self, watch: TravelWatch) {
        let (violations, left_out) = watch.finish();
        self.violations = violations;
        if left_out > 0 {
            self.warnings.push(format!(
                "{left_out} more excursions beyond the travel are not listed"
            ));
        }
    }

    /// Fills in the file and line of every violation.
    pub fn place_violations(&mut self, program: &Program) {
        for violation in &mut self.violations {
            if let Some(place) = program.locate(violation.streamed_line as usize, 1) {
                violation.file = place.file;
                violation.line = place.line;
            }
        }
    }

    /// The summary as a person reads it.
    #[must_use]
    pub fn table(&self) -> String {
        use std::fmt::Write;
        let mut out = String::new();
        let path = &self.path;
        // Writing to a String cannot fail.
        let _ = writeln!(
            out,
            "{} on {}: {}",
            self.program, self.machine, self.outcome
        );
        let _ = writeln!(
            out,
            "  time {:.4} s ({} ticks of 1/{} s), {} blocks, digest {}",
            self.duration_s, self.ticks, self.servo_hz, self.blocks, self.digest
        );
        let _ = writeln!(
            out,
            "  path {:.4} mm, step rounding {:.6} mm, feed fluctuation {:.2e}",
            path.length_mm, path.max_deviation_mm, path.feed_fluctuation
        );
        if let Some(plant) = &self.plant {
            let _ = writeln!(
                out,
                "  following error {:.4} mm, contour error {:.4} mm",
                plant.max_following_error_mm, plant.max_contour_error_mm
            );
        }
        let _ = writeln!(out, "  axis        v_max /      limit        a_max /      limit        j_max /      limit  final steps");
        for a in &self.axes {
            let _ = writeln!(
                out,
                "  {:<4} {:>12.4} / {:>10} {:>12.3} / {:>10} {:>12.1} / {:>10} {:>12}",
                a.name, a.v_max, a.v_limit, a.a_max, a.a_limit, a.j_max, a.j_limit, a.final_steps
            );
        }
        for v in &self.violations {
            let _ = writeln!(out, "  {v}");
        }
        for warning in &self.warnings {
            let _ = writeln!(out, "  warning: {warning}");
        }
        out
    }
}

#[cfg(test)]
mod tests;
