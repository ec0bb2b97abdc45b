//! `host-sim run`: the core and the machine model on a program; trace, summary and report.

use std::fs::File;
use std::io::{self, BufWriter};

use indicatif::ProgressBar;
use pentaspline::config::AxisKind;
use pentaspline::machine::Sample;
use pentaspline::stepgen::StepFrame;
use pentaspline::units::{Tick, AXES};

use super::{always_jerk_limited, conclude, progress_bar, ticks, write_json};
use crate::cli::RunArgs;
use crate::diagnostics::{Exit, Failure, Located};
use crate::events;
use crate::machine_file::Machine;
use crate::plant::Plant;
use crate::precheck;
use crate::program::Program;
use crate::report::{self, AxisInfo, ReportData, TickRecord};
use crate::runner::{self, Observer, Options, Outcome};
use crate::summary::{PlantSummary, Summary};
use crate::trace::TraceWriter;
use crate::watch::Watch;

/// Everything that looks at a run tick by tick.
struct Recorder<'a> {
    machine: &'a Machine,
    watch: Watch,
    plant: Plant,
    trace: Option<TraceWriter<BufWriter<File>>>,
    report: Option<ReportData>,
    bar: ProgressBar,
}

impl<'a> Recorder<'a> {
    fn new(machine: &'a Machine, program: &Program, args: &RunArgs) -> Result<Self, Failure> {
        let config = &machine.config;
        let linear = config.axes.map(|axis| axis.kind == AxisKind::Linear);
        let plant = Plant::new(
            &machine.plant.axes,
            linear,
            1.0 / f64::from(config.servo_hz),
            [0.0; AXES],
        )
        .map_err(|e| Failure::new(Exit::Usage, Located::new(e.to_string())))?;
        let trace = match &args.trace {
            Some(path) => Some(
                TraceWriter::create(path, machine)
                    .map_err(|e| Failure::io("write trace", path, &e))?,
            ),
            None => None,
        };
        let report = args.report.as_ref().map(|_| empty_report(machine, program));
        Ok(Self {
            machine,
            watch: Watch::new(machine),
            plant,
            trace,
            report,
            bar: progress_bar(program.len()),
        })
    }

    /// Closes all books; `Err` if the trace could not be written to its end.
    fn finish(mut self, program: &str, digest: u64) -> io::Result<(Summary, Option<ReportData>)> {
        self.bar.finish_and_clear();
        if let Some(trace) = self.trace.take() {
            trace.finish()?;
        }
        for contour in self.plant.finish() {
            if let Some(report) = &mut self.report {
                report.push_contour(contour);
            }
        }
        let mut summary = self.watch.finish(self.machine, program, digest);
        let following = self.plant.max_following();
        let linear = (0..AXES).filter(|&a| self.machine.config.axes[a].kind == AxisKind::Linear);
        summary.plant = Some(PlantSummary {
            max_following_error_mm: linear.map(|a| following[a]).fold(0.0, f64::max),
            max_contour_error_mm: self.plant.max_contour(),
        });
        Ok((summary, self.report))
    }
}

impl Observer for Recorder<'_> {
    fn tick(&mut self, tick: Tick, sample: &Sample, frame: &StepFrame) -> io::Result<()> {
        self.watch.tick(tick, sample, frame)?;
        if let Some(trace) = &mut self.trace {
            trace.tick(tick, sample)?;
        }
        let commanded = std::array::from_fn(|a| {
            sample.commanded[a].to_bits() as f64
                / (4_294_967_296.0 * self.machine.steps_per_unit(a))
        });
        let plant = self.plant.step(commanded);
        if let Some(report) = &mut self.report {
            report.push(&TickRecord {
                tick,
                t_s: tick as f64 / f64::from(self.machine.config.servo_hz),
                block: sample.block,
                feed_mm_s: f64::from(sample.feed),
                commanded: sample.commanded.map(|position| position.to_bits()),
                actual: plant.actual,
                following: plant.following,
                contour_mm: plant.contour,
            });
        }
        Ok(())
    }

    fn progress(&mut self, lines: usize) {
        self.bar.set_position(lines as u64);
    }
}

fn empty_report(machine: &Machine, program: &Program) -> ReportData {
    let config = &machine.config;
    let axes = std::array::from_fn(|a| {
        let axis = &config.axes[a];
        AxisInfo {
            name: machine.axis_name(a).to_string(),
            linear: axis.kind == AxisKind::Linear,
            steps_per_unit: machine.steps_per_unit(a),
            v_limit: f64::from(axis.v_max),
            a_limit: f64::from(axis.a_max),
            j_limit: f64::from(axis.j_max),
        }
    });
    let mut report = ReportData::new(
        program.name(),
        config.name,
        f64::from(config.servo_hz),
        axes,
    );
    report.starts_from([0; AXES]);
    report.lines = program
        .lines()
        .map(|line| String::from_utf8_lossy(line).into_owned())
        .collect();
    report
}

/// Runs a program; prints the summary on stdout.
///
/// # Errors
/// See [`Exit`]; files asked for are written all the same when the program fails.
pub fn run(args: &RunArgs) -> Result<Exit, Failure> {
    let mut machine = Machine::load(args.machine.as_deref())?;
    let reading = args.language.reading(machine.config.dialect);
    machine.config.dialect = reading.dialect;
    let program = Program::load_as(&args.program, &reading)?;
    let events = match &args.events {
        Some(path) => events::load(path)?,
        None => Vec::new(),
    };
    let max_ticks = ticks(args.max_time, machine.config.servo_hz);
    let options = Options {
        auto_start: args.auto_start,
        events,
        max_ticks,
    };

    let mut recorder = Recorder::new(&machine, &program, args)?;
    let trace_failed = |e: io::Error| match &args.trace {
        Some(path) => Failure::io("write trace", path, &e),
        None => Failure::new(Exit::Io, Located::new(e.to_string())),
    };
    let looked = if args.no_check {
        Ok(())
    } else {
        precheck::check(&program, &machine)
    };
    let outcome = match looked {
        Ok(()) => runner::run(&program, &machine, &options, &mut recorder).map_err(trace_failed)?,
        // Refused before anything moves; the files are written all the same.
        Err(complaint) => Outcome::refused(complaint),
    };
    let (mut summary, report) = recorder
        .finish(program.name(), outcome.digest)
        .map_err(trace_failed)?;
    let failure = conclude(&program, &machine, &outcome, &mut summary);
    summary.warnings.extend(
        summary.limit_warnings(machine.config.default_soft && always_jerk_limited(&program)),
    );
    summary.place_violations(&program);

    // First of all: a file that cannot be written does not cost the result.
    print!("{}", summary.table());
    if let Some(path) = &args.json {
        write_json(path, &summary)?;
    }
    if let (Some(path), Some(mut report)) = (&args.report, report) {
        report.digest = summary.digest.clone();
        report.warnings = summary.warnings.clone();
        report
            .warnings
            .extend(summary.violations.iter().map(ToString::to_string));
        report::write(path, &report).map_err(|e| Failure::io("write report", path, &e))?;
    }
    match failure {
        Some(failure) => Err(failure),
        None if !summary.violations.is_empty() => Ok(Exit::Limit),
        None => Ok(Exit::Success),
    }
}
