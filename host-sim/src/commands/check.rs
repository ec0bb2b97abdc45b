//! `host-sim check`: parse and plan only. Nothing is recorded; the same core runs, so the time is the true one.

use std::io;

use indicatif::ProgressBar;
use pentaspline::machine::Sample;
use pentaspline::stepgen::StepFrame;
use pentaspline::units::Tick;

use super::{always_jerk_limited, conclude, progress_bar, ticks, write_json};
use crate::cli::CheckArgs;
use crate::diagnostics::{Exit, Failure, Located};
use crate::machine_file::Machine;
use crate::program::Program;
use crate::runner::{self, Observer, Options};
use crate::watch::Watch;

struct WithBar {
    watch: Watch,
    bar: ProgressBar,
}

impl Observer for WithBar {
    fn tick(&mut self, tick: Tick, sample: &Sample, frame: &StepFrame) -> io::Result<()> {
        self.watch.tick(tick, sample, frame)
    }

    fn progress(&mut self, lines: usize) {
        self.bar.set_position(lines as u64);
    }
}

/// Checks a program; prints the summary on stdout. `M0` and `M1` do not wait.
///
/// # Errors
/// See [`Exit`]; the JSON file is written all the same when the program fails.
pub fn check(args: &CheckArgs) -> Result<Exit, Failure> {
    let mut machine = Machine::load(args.machine.as_deref())?;
    let reading = args.language.reading(machine.config.dialect);
    machine.config.dialect = reading.dialect;
    let program = Program::load_as(&args.program, &reading)?;
    let max_ticks = ticks(args.max_time, machine.config.servo_hz);
    let options = Options {
        auto_start: true,
        events: Vec::new(),
        max_ticks,
    };
    let mut observer = WithBar {
        watch: Watch::new(&machine),
        bar: progress_bar(program.len()),
    };
    let outcome = runner::run(&program, &machine, &options, &mut observer)
        .map_err(|e| Failure::new(Exit::Io, Located::new(e.to_string())))?;
    observer.bar.finish_and_clear();

    let watch = observer.watch;
    let mut summary = watch.finish(&machine, program.name(), outcome.digest);
    let failure = conclude(&program, &machine, &outcome, &mut summary);
    summary.warnings.extend(
        summary.limit_warnings(machine.config.default_soft && always_jerk_limited(&program)),
    );
    summary.place_violations(&program);
    print!("{}", summary.table());
    if let Some(path) = &args.json {
        write_json(path, &summary)?;
    }
    match failure {
        Some(failure) => Err(failure),
        None if !summary.violations.is_empty() => Ok(Exit::Limit),
        None => Ok(Exit::Success),
    }
}
