//! The thesis run again: 24 finishing programs, their errors, times and feeds beside the printed ones.
//!
//! In: a machine. Out: the programs ([`programs`]), 24 [`Row`]s, and pages made of them ([`table`], [`page`]).
//! Each row is found three times: on the programmed curve itself ([`curve`]), on the commanded path of the cutter and
//! on the path the machine model drives ([`simulate`], [`envelope`]).

pub mod contour;
pub mod curve;
pub mod envelope;
pub mod knots;
pub mod page;
pub mod programs;
mod scratch;
pub mod simulate;
pub mod table;
pub mod thesis;
pub mod turns;

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::Mutex;

use pentaspline::config::{ToolData, TOOL_NAME};
use pentaspline::units::NANO_PER_UNIT;

use crate::diagnostics::{Exit, Failure, Located};
use crate::machine_file::Machine;
use contour::Control;
use curve::Programmed;
use knots::{KnotSet, FINISHING};
use programs::{Job, Method, METHODS, TOOL, TOOL_RADIUS_MM};
use scratch::Scratch;
use thesis::{Printed, Verdict, FLOOR_MM};

/// Errors at the eleven control points, mm: measured less theoretical coordinate.
pub type Errors = [f64; 11];

/// One finishing program, measured.
#[derive(Clone, Debug)]
pub struct Row {
    /// How the knots are joined.
    pub method: Method,
    /// The knots.
    pub set: KnotSet,
    /// Errors of the programmed curve.
    pub geometry: Errors,
    /// Errors of the edge the commanded path of the cutter leaves.
    pub commanded: Errors,
    /// Errors of the edge the driven path of the cutter leaves.
    pub machined: Errors,
    /// Normal error of the programmed curve per degree, mm, positive outside.
    pub by_degree: [f64; 360],
    /// Time in motion behind `M0` and `G4`, s.
    pub time_s: f64,
    /// Smallest feed of the cutter's centre over the middle turn, mm/min.
    pub min_feed_mm_min: f64,
    /// Size of the sub-program, bytes.
    pub file_bytes: usize,
    /// What the thesis prints.
    pub printed: Printed,
}

impl Row {
    /// Suitable or not: mean geometric error with what measuring adds.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        Verdict::of(mae(&self.geometry) + FLOOR_MM)
    }
}

/// Mean absolute error (equation 37), mm.
#[must_use]
pub fn mae(errors: &Errors) -> f64 {
    errors.iter().map(|error| error.abs()).sum::<f64>() / errors.len() as f64
}

/// Writes every program of the study into `folder`, which is made if it does not exist; the number of files.
///
/// # Errors
/// Exit code 5.
pub fn write_programs(folder: &Path) -> Result<usize, Failure> {
    std::fs::create_dir_all(folder).map_err(|e| Failure::io("make", folder, &e))?;
    let mut written = std::collections::BTreeSet::new();
    for job in programs::all() {
        for file in job.subs.iter().chain([&job.main]) {
            if written.insert(file.name.clone()) {
                let path = folder.join(&file.name);
                std::fs::write(&path, &file.text).map_err(|e| Failure::io("write", &path, &e))?;
            }
        }
    }
    Ok(written.len())
}

/// Measures the 24 finishing programs on `machine`, in the order of Tables 3.14.1 and 3.14.2, on `threads` threads;
/// `done` is told after each one.
///
/// The programs run as printed. A machine without the tool gets it.
///
/// # Errors
/// Exit code 2 for a machine without axes X and Y, 3 if a program is refused, 4 if one does not end, 5 if the programs
/// cannot be written for the run.
pub fn run(
    machine: &Machine,
    threads: usize,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<Row>, Failure> {
    let jobs: Vec<(Method, KnotSet)> = FINISHING
        .iter()
        .flat_map(|&set| METHODS.map(|method| (method, set)))
        .collect();
    let bench = Bench::new(machine)?;
    let scratch = Scratch::new()?;
    let next = AtomicUsize::new(0);
    let results = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..threads.max(1) {
            scope.spawn(|| loop {
                let index = next.fetch_add(1, Ordering::Relaxed);
                let Some(&(method, set)) = jobs.get(index) else {
                    break;
                };
                let row = bench.measure(&scratch, method, set);
                if row.is_err() {
                    next.store(jobs.len(), Ordering::Relaxed);
                }
                if let Ok(mut results) = results.lock() {
                    results.push((index, row));
                }
                done();
            });
        }
    });
    let mut results = results
        .into_inner()
        .unwrap_or_else(|poisoned| poisoned.into_inner());
    results.sort_by_key(|(index, _)| *index);
    results.into_iter().map(|(_, row)| row).collect()
}

/// The machine as the study uses it.
struct Bench {
    machine: Machine,
    /// Indices of the axes X and Y.
    plane: [usize; 2],
    tool_radius: f64,
    controls: [Control; 11],
}

impl Bench {
    fn new(machine: &Machine) -> Result<Self, Failure> {
        let mut machine = machine.clone();
        let refuse = |text: &str| Failure::new(Exit::Usage, Located::new(text));
        let config = &mut machine.config;
        let axis = |letter: u8| {
            let found = config.axes.iter().position(|axis| axis.letter == letter);
            found.ok_or_else(|| refuse("the machine has no axes X and Y"))
        };
        let plane = [axis(b'X')?, axis(b'Y')?];
        let mut name = [0; TOOL_NAME];
        name.iter_mut()
            .zip(TOOL.bytes())
            .for_each(|(to, from)| *to = from);
        let radius = match config.tools.iter().find(|tool| tool.name == name) {
            Some(tool) => tool.radius as f64 / NANO_PER_UNIT as f64,
            None => {
                let number = config
                    .tools
                    .iter()
                    .map(|tool| tool.number)
                    .max()
                    .unwrap_or(0)
                    + 1;
                let free = config.tools.iter_mut().find(|tool| tool.number == 0);
                let row = free.ok_or_else(|| refuse("the tool table is full; FR_4 has no row"))?;
                *row = ToolData {
                    number,
                    name,
                    radius: (TOOL_RADIUS_MM * NANO_PER_UNIT as f64) as i64,
                    length: 0,
                };
                TOOL_RADIUS_MM
            }
        };
        // The contour is measured about the machine's own zero.
        config.zero_offsets = Default::default();
        Ok(Self {
            machine,
            plane,
            tool_radius: radius,
            controls: contour::controls(),
        })
    }

    fn measure(&self, scratch: &Scratch, method: Method, set: KnotSet) -> Result<Row, Failure> {
        let job = programs::finishing(method, &set);
        let file_bytes = job.subs.iter().map(|file| file.text.len()).sum();
        let bare = scratch.load(&uncompensated(&job))?;
        let programmed = Programmed::of(&self.machine.config, self.plane, &bare)?;
        let run = simulate::run(&self.machine, self.plane, &scratch.load(&job)?)?;
        let errors = |what: &str, crossing: &dyn Fn(&Control) -> Option<f64>| {
            let mut errors = [0.0; 11];
            for (error, control) in errors.iter_mut().zip(&self.controls) {
                let at = crossing(control).ok_or_else(|| {
                    let text = format!(
                        "{}: the {what} does not pass control point {}",
                        job.main.name, control.number
                    );
                    Failure::new(Exit::Program, Located::new(text))
                })?;
                *error = at - control.at[control.measured];
            }
            Ok::<_, Failure>(errors)
        };
        let knots = set.printed_count();
        let printed = thesis::printed(method, set.distribution, knots).ok_or_else(|| {
            Failure::new(Exit::Usage, Located::new("a set the thesis did not mill"))
        })?;
        Ok(Row {
            method,
            set,
            geometry: errors("programmed curve", &|c| programmed.crossing(c))?,
            commanded: errors("commanded path", &|c| {
                run.commanded.crossing(self.tool_radius, c)
            })?,
            machined: errors("driven path", &|c| run.actual.crossing(self.tool_radius, c))?,
            by_degree: programmed.error_by_degree(),
            time_s: run.time_s,
            min_feed_mm_min: run.min_feed_mm_min,
            file_bytes,
            printed,
        })
    }
}

/// `job` without its `G42` and `G40` blocks: its path is the programmed curve.
#[must_use]
pub fn uncompensated(job: &Job) -> Job {
    let mut bare = job.clone();
    let kept = |line: &&str| !line.ends_with(" G42") && !line.ends_with(" G40");
    let mut lines: Vec<&str> = job.main.text.lines().filter(kept).collect();
    lines.push("");
    bare.main.text = lines.join("\n");
    bare
}

#[cfg(test)]
mod tests;
