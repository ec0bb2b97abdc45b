//! The report: one HTML file that shows a run and needs nothing but a browser.
//!
//! In: one [`TickRecord`] per servo tick, and what the runner knows about the run as a whole ([`ReportData`]).
//! Out: [`write()`]. Memory does not grow with the length of a run: curves are reduced while they arrive to a
//! minimum/maximum envelope (a peak of a single tick is never lost), paths to polylines within a tolerance.
//! Velocity, acceleration and jerk are differences of the commanded Q32.32 positions, taken in integers.

mod blocks;
mod envelope;
mod page;
mod polyline;

use std::io;
use std::path::Path;

use pentaspline::units::AXES;

use blocks::BlockTable;
use envelope::Envelope;
use polyline::Polyline;

/// What the report says about an axis. Lengths are mm for a linear axis and degrees for a rotary one.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisInfo {
    /// Letter or name.
    pub name: String,
    /// Linear (mm) or rotary (degrees).
    pub linear: bool,
    /// Steps per mm or degree.
    pub steps_per_unit: f64,
    /// Largest velocity, per s.
    pub v_limit: f64,
    /// Largest acceleration, per s^2.
    pub a_limit: f64,
    /// Largest jerk, per s^3.
    pub j_limit: f64,
}

/// One servo tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TickRecord {
    /// Number of the tick. Ticks left out between two records were spent at rest.
    pub tick: u64,
    /// Time, s.
    pub t_s: f64,
    /// Text line of the block in execution, counted from 1; 0 at rest.
    pub block: u32,
    /// Path feed, mm/s (degree/s in a block that moves rotary axes only).
    pub feed_mm_s: f64,
    /// Commanded positions: bits of the Q32.32 step value.
    pub commanded: [i64; AXES],
    /// Table positions, mm or degrees.
    pub actual: [f64; AXES],
    /// Following errors, mm or degrees.
    pub following: [f64; AXES],
    /// Contour error, mm. The i-th value given belongs to the i-th record, however late it comes; values
    /// that come after the last record go to [`ReportData::push_contour`].
    pub contour_mm: Option<f64>,
}

/// Everything a report shows.
#[derive(Clone, Debug)]
pub struct ReportData {
    /// Name of the program.
    pub program: String,
    /// Name of the machine.
    pub machine: String,
    /// Digest of the step stream, as it is to be printed.
    pub digest: String,
    /// What the user should know, one sentence each.
    pub warnings: Vec<String>,
    /// Further facts for the head of the report: label and value.
    pub facts: Vec<(String, String)>,
    /// Text of the program as it was sent; element i is line i + 1.
    pub lines: Vec<String>,
    servo_hz: f64,
    axes: [AxisInfo; AXES],
    ticks: u64,
    /// Last commanded positions: this tick, one, two ticks before.
    history: Option<(u64, [[i64; AXES]; 3])>,
    time: Envelope,
    feed: Envelope,
    velocity: [Envelope; AXES],
    acceleration: [Envelope; AXES],
    jerk: [Envelope; AXES],
    following: [Envelope; AXES],
    contour: Envelope,
    commanded_path: Polyline,
    actual_path: Polyline,
    length_mm: f64,
    blocks: BlockTable,
}

impl ReportData {
    /// Empty report of a run at `servo_hz` ticks per second.
    #[must_use]
    pub fn new(program: &str, machine: &str, servo_hz: f64, axes: [AxisInfo; AXES]) -> Self {
        let five = || core::array::from_fn(|_| Envelope::new());
        Self {
            program: program.into(),
            machine: machine.into(),
            digest: String::new(),
            warnings: Vec::new(),
            facts: Vec::new(),
            lines: Vec::new(),
            servo_hz,
            axes,
            ticks: 0,
            history: None,
            time: Envelope::new(),
            feed: Envelope::new(),
            velocity: five(),
            acceleration: five(),
            jerk: five(),
            following: five(),
            contour: Envelope::new(),
            commanded_path: Polyline::new(),
            actual_path: Polyline::new(),
            length_mm: 0.0,
            blocks: BlockTable::default(),
        }
    }

    /// The machine rests at `commanded` (Q32.32 steps) before tick 0, so that the way of tick 0 counts.
    pub fn starts_from(&mut self, commanded: [i64; AXES]) {
        self.history = Some((u64::MAX, [commanded; 3]));
    }

    /// Takes the next tick in.
    pub fn push(&mut self, record: &TickRecord) {
        let now = record.commanded;
        // At the first record (unless `starts_from` says where it rests), and after ticks left out, the machine
        // comes from rest.
        let past = match self.history {
            Some((tick, past)) if tick.wrapping_add(1) == record.tick => past,
            Some((_, past)) => [past[0]; 3],
            None => [now; 3],
        };
        self.history = Some((record.tick, [now, past[0], past[1]]));
        self.ticks += 1;

        self.time.push(record.t_s);
        self.feed.push(record.feed_mm_s);
        let mut moved = [0.0; AXES];
        for a in 0..AXES {
            let [p0, p1, p2, p3] = [now[a], past[0][a], past[1][a], past[2][a]].map(i128::from);
            let unit = 1.0 / (4_294_967_296.0 * self.axes[a].steps_per_unit);
            let hz = self.servo_hz;
            moved[a] = (p0 - p1) as f64 * unit;
            self.velocity[a].push(moved[a] * hz);
            self.acceleration[a].push((p0 - 2 * p1 + p2) as f64 * unit * hz * hz);
            self.jerk[a].push((p0 - 3 * p1 + 3 * p2 - p3) as f64 * unit * hz * hz * hz);
            self.following[a].push(record.following[a]);
        }
        if let Some(contour) = record.contour_mm {
            self.contour.push(contour);
        }

        let space = self.space();
        let at = |all: &dyn Fn(usize) -> f64| space.map(|a| a.map_or(0.0, all));
        let commanded = at(&|a| now[a] as f64 / (4_294_967_296.0 * self.axes[a].steps_per_unit));
        let actual = at(&|a| record.actual[a]);
        self.commanded_path
            .push(commanded, record.feed_mm_s, record.block);
        self.actual_path.push(actual, 0.0, 0);

        let norm = |linear: bool| {
            let picked = (0..AXES).filter(|&a| self.axes[a].linear == linear);
            picked.map(|a| moved[a] * moved[a]).sum::<f64>().sqrt()
        };
        let (linear, rotary) = (norm(true), norm(false));
        self.length_mm += linear;
        self.blocks
            .push(record, 1.0 / self.servo_hz, linear, rotary);
    }

    /// Takes in a contour error that became known after the last record, mm.
    pub fn push_contour(&mut self, contour_mm: f64) {
        self.contour.push(contour_mm);
    }

    /// The linear axes drawn as x, y, z of the path.
    fn space(&self) -> [Option<usize>; 3] {
        let mut linear = (0..AXES).filter(|&a| self.axes[a].linear);
        core::array::from_fn(|_| linear.next())
    }
}

/// Writes the report to `path`, replacing what is there.
///
/// # Errors
/// Those of the file system.
pub fn write(path: &Path, data: &ReportData) -> io::Result<()> {
    std::fs::write(path, page::html(data))
}

#[cfg(test)]
mod tests;
