//! One program through the whole pipeline: interpreter to stepper, then the machine model.
//!
//! In: a machine and a program. Out: the commanded and the actual path of the cutter's centre over the middle turn, the
//! time in motion, the smallest feed. Uses [`crate::runner`] and [`crate::plant`].

use std::io;

use pentaspline::config::AxisKind;
use pentaspline::machine::Sample;
use pentaspline::stepgen::StepFrame;
use pentaspline::units::{Tick, AXES};

use super::envelope::CentrePath;
use crate::diagnostics::{Exit, Failure, Located};
use crate::machine_file::Machine;
use crate::plant::Plant;
use crate::program::{words, Program};
use crate::runner::{self, End, Observer, Options};

/// Simulated time after which a run is given up, s.
const PATIENCE_S: u32 = 3600;

/// What came of a run.
#[derive(Clone, Debug)]
pub struct Run {
    /// Commanded path of the cutter's centre.
    pub commanded: CentrePath,
    /// The same as the machine model drives it.
    pub actual: CentrePath,
    /// Time from the first motion behind the last program stop and dwell to the end of motion, s.
    pub time_s: f64,
    /// Smallest commanded feed of the cutter's centre over the middle turn, mm/min.
    pub min_feed_mm_min: f64,
}

/// Runs `program` on `machine`; `plane` holds the indices of the axes X and Y. Program stops do not wait.
///
/// # Errors
/// Exit code 3 with the place the controller refuses, 4 if the program does not come to its end.
pub fn run(machine: &Machine, plane: [usize; 2], program: &Program) -> Result<Run, Failure> {
    let config = &machine.config;
    let internal = |text: String| Failure::new(Exit::Usage, Located::new(text));
    let linear = config.axes.map(|axis| axis.kind == AxisKind::Linear);
    let plant = Plant::new(
        &machine.plant.axes,
        linear,
        1.0 / f64::from(config.servo_hz),
        [0.0; AXES],
    )
    .map_err(|e| internal(e.to_string()))?;
    let pauses = program
        .lines()
        .enumerate()
        .filter(|(_, line)| is_pause(line));
    let mut recorder = Recorder {
        plant,
        plane,
        per_bit: config
            .axes
            .map(|axis| 1.0 / (axis.steps_per_unit.to_num::<f64>() * 4_294_967_296.0)),
        pause: pauses.map(|(index, _)| index as u32 + 1).max().unwrap_or(0),
        commanded: CentrePath::default(),
        actual: CentrePath::default(),
        motion: None,
        min_feed_mm_s: f32::INFINITY,
    };
    let options = Options {
        auto_start: true,
        events: Vec::new(),
        max_ticks: Tick::from(PATIENCE_S) * Tick::from(config.servo_hz),
    };
    let outcome = runner::run(program, machine, &options, &mut recorder)
        .map_err(|e| Failure::new(Exit::Io, Located::new(e.to_string())))?;
    match outcome.end {
        End::Finished => {}
        End::Refused(complaint) => {
            let line = complaint.line.clamp(1, program.len().max(1));
            let label = format!("error:{}", complaint.code);
            let located = program.error_at(line, complaint.column, &complaint.text, &label);
            return Err(Failure::new(Exit::Program, located));
        }
        other => {
            let text = format!("{} does not come to its end: {other:?}", program.name());
            return Err(Failure::new(Exit::TimeBound, Located::new(text)));
        }
    }
    let (first, last) = recorder
        .motion
        .ok_or_else(|| internal(format!("{} moves nothing", program.name())))?;
    Ok(Run {
        commanded: recorder.commanded,
        actual: recorder.actual,
        time_s: (last + 1 - first) as f64 / f64::from(config.servo_hz),
        min_feed_mm_min: f64::from(recorder.min_feed_mm_s) * 60.0,
    })
}

/// True for a line with a program stop or a dwell.
fn is_pause(line: &[u8]) -> bool {
    let text = String::from_utf8_lossy(line);
    words::program_stop(&text).is_some() || text.split_whitespace().any(|word| word == "G4")
}

struct Recorder {
    plant: Plant,
    plane: [usize; 2],
    per_bit: [f64; AXES],
    /// Line of the last program stop or dwell.
    pause: u32,
    commanded: CentrePath,
    actual: CentrePath,
    /// First and last tick in motion behind that line.
    motion: Option<(Tick, Tick)>,
    min_feed_mm_s: f32,
}

impl Observer for Recorder {
    fn tick(&mut self, tick: Tick, sample: &Sample, _frame: &StepFrame) -> io::Result<()> {
        let command: [f64; AXES] =
            std::array::from_fn(|a| sample.commanded[a].to_bits() as f64 * self.per_bit[a]);
        let driven = self.plant.step(command);
        if !sample.moving || sample.block <= self.pause {
            return Ok(());
        }
        let first = self.motion.map_or(tick, |(first, _)| first);
        self.motion = Some((first, tick));
        self.actual.push(self.plane.map(|a| driven.actual[a]));
        if self.commanded.push(self.plane.map(|a| command[a])) {
            self.min_feed_mm_s = self.min_feed_mm_s.min(sample.feed);
        }
        Ok(())
    }
}
