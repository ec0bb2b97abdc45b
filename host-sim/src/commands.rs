//! The commands: each takes its arguments and returns the exit code, or a failure to print.

use std::io::IsTerminal;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use indicatif::{ProgressBar, ProgressStyle};
use pentaspline::config::AxisConfig;
use pentaspline::units::NANO_PER_UNIT;

use crate::cli::{Cli, Command};
use crate::diagnostics::{Exit, Failure, Located};
use crate::feeder::Complaint;
use crate::machine_file::Machine;
use crate::program::{words, Location, Program};
use crate::runner::{End, Outcome};
use crate::summary::{ErrorSummary, Summary};

#[cfg(unix)]
pub mod bench;
pub mod check;
#[cfg(unix)]
pub mod emulate;
pub mod errors;
pub mod run;
pub mod send;
#[cfg(unix)]
pub mod serve;
pub mod study;

/// `error:N` of the core for a curve that leaves the travel of an axis.
const TRAVEL_ERROR: u32 = 201;
/// `error:N` of the core for the letter of an axis the machine does not have.
const AXIS_ERROR: u32 = 117;

/// Does what the command line asks for.
///
/// # Errors
/// What is to be printed, with its exit code.
pub fn dispatch(cli: Cli) -> Result<Exit, Failure> {
    match cli.command {
        Command::Run(args) => run::run(&args),
        Command::Check(args) => check::check(&args),
        #[cfg(unix)]
        Command::Emulate(args) => emulate::emulate(&args),
        #[cfg(unix)]
        Command::Bench(args) => bench::bench(&args),
        #[cfg(unix)]
        Command::Serve(args) => serve::serve(&args),
        Command::Send(args) => send::send(&args),
        Command::Study(args) => study::study(&args),
        Command::Errors(args) => errors::errors(&args),
    }
}

/// Progress over `lines` lines on stderr; hidden unless that is a terminal.
fn progress_bar(lines: usize) -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(lines as u64);
    if let Ok(style) = ProgressStyle::with_template("{bar:40} line {pos}/{len} {elapsed} eta {eta}")
    {
        bar.set_style(style);
    }
    bar
}

/// Sets `stop` at Ctrl-C and at a termination signal instead of ending the process.
fn stop_on_signal(stop: &'static AtomicBool) -> Result<(), Failure> {
    ctrlc::set_handler(move || stop.store(true, Ordering::Relaxed))
        .map_err(|e| Failure::new(Exit::Io, Located::new(format!("cannot catch signals: {e}"))))
}

/// Writes `summary` to `path` as JSON.
fn write_json(path: &Path, summary: &Summary) -> Result<(), Failure> {
    let failed = |e: std::io::Error| Failure::io("write", path, &e);
    let mut text = serde_json::to_string_pretty(summary).map_err(|e| failed(e.into()))?;
    text.push('\n');
    std::fs::write(path, text).map_err(failed)
}

/// Servo ticks in `seconds`.
fn ticks(seconds: f64, servo_hz: u32) -> u64 {
    // Saturates, which is what an absurdly long time asks for.
    (seconds * f64::from(servo_hz)).ceil() as u64
}

/// What of the machine a person has to know to mend error `code`.
fn advice(machine: &Machine, code: u32) -> String {
    let axes = machine.config.axes.iter();
    match code {
        TRAVEL_ERROR => {
            let unit = NANO_PER_UNIT as f64;
            let of = |axis: &AxisConfig| {
                let (min, max) = (axis.travel_min as f64, axis.travel_max as f64);
                let letter = char::from(axis.letter);
                format!("{letter} {} to {}", min / unit, max / unit)
            };
            let list: Vec<String> = axes.map(of).collect();
            format!("travel of {}: {}", machine.config.name, list.join(", "))
        }
        AXIS_ERROR => {
            let letters: String = axes.map(|axis| char::from(axis.letter)).collect();
            format!(
                "the axes of {} are {letters}; --machine names another machine file",
                machine.config.name
            )
        }
        _ => String::new(),
    }
}

/// Puts the end of the run into `summary` and returns the failure it stands for, if it is one.
fn conclude(
    program: &Program,
    machine: &Machine,
    outcome: &Outcome,
    summary: &mut Summary,
) -> Option<Failure> {
    summary.warnings.extend(
        outcome
            .messages
            .iter()
            .filter(|text| text.starts_with("warning"))
            .cloned(),
    );
    if outcome.unused_events > 0 {
        summary.warnings.push(format!(
            "{} events come after the end of the run",
            outcome.unused_events
        ));
    }
    if let Some(line) = program.unused_from() {
        summary.warnings.push(format!(
            "text from line {line} on stands behind the program end and was not run"
        ));
    }
    let (name, failure) = match &outcome.end {
        End::Finished => {
            if summary.axes.iter().all(|axis| axis.v_max == 0.0) {
                summary
                    .warnings
                    .push("the program moved nothing".to_owned());
            }
            ("finished", None)
        }
        End::Reset => {
            summary
                .warnings
                .push("a reset event ended the run before the program did".to_owned());
            ("reset", None)
        }
        End::Refused(complaint) => {
            let line = complaint.line.min(program.len());
            let place = program.locate(line, complaint.column);
            summary.error = Some(refusal(complaint, place));
            ("program_error", Some(refused(program, machine, complaint)))
        }
        End::Alarm(code) => {
            let message = format!("the controller raised ALARM:{code}");
            summary.error = Some(ErrorSummary {
                code: *code,
                file: String::new(),
                line: 0,
                column: 0,
                streamed_line: 0,
                text: String::new(),
                message: message.clone(),
            });
            (
                "alarm",
                Some(Failure::new(Exit::Program, Located::new(message))),
            )
        }
        End::Waiting { held: true, .. } => {
            let located = Located::new("the run is held and no event resumes it")
                .help("add a `resume` row to the event file");
            ("waiting", Some(Failure::new(Exit::Waiting, located)))
        }
        End::Waiting {
            held: false,
            after_block,
        } => ("waiting", Some(waiting(program, *after_block as usize))),
        End::TimeBound => {
            let located =
                Located::new("the bound on simulated time was reached before the program ended");
            (
                "time_bound",
                Some(Failure::new(
                    Exit::TimeBound,
                    located.help("--max-time sets the bound"),
                )),
            )
        }
        End::Stuck => {
            let located = Located::new("the controller does not come to an end of its work");
            ("stuck", Some(Failure::new(Exit::TimeBound, located)))
        }
    };
    summary.outcome = name.to_owned();
    failure
}

/// What is shown of a line refused with `complaint`.
fn refused(program: &Program, machine: &Machine, complaint: &Complaint) -> Failure {
    // A `G6` block without its K lines is missed behind the last line: show the last one.
    let line = complaint.line.min(program.len());
    let label = format!("error:{}", complaint.code);
    let exit = if complaint.code == TRAVEL_ERROR {
        Exit::Limit
    } else {
        Exit::Program
    };
    let located = program
        .error_at(line, complaint.column, &complaint.text, &label)
        .more_help(&advice(machine, complaint.code));
    Failure::new(exit, located)
}

/// The program waits at the first `M0` or `M1` from streamed line `block` on.
fn waiting(program: &Program, block: usize) -> Failure {
    let message = "the program waits for cycle start";
    let help =
        "--auto-start passes M0 and M1, a `resume` row in --events gives cycle start at a tick";
    let from = block.saturating_sub(1);
    let stop = program
        .lines()
        .enumerate()
        .skip(from)
        .find_map(|(index, line)| {
            words::program_stop(&String::from_utf8_lossy(line))
                .map(|column| (index + 1, column + 1))
        });
    let located = match stop {
        Some((line, column)) => program.error_at(line, column, message, "waits here"),
        None => Located::new(message),
    };
    Failure::new(Exit::Waiting, located.help(help))
}

/// True if no line of `program` switches the jerk limit off.
fn always_jerk_limited(program: &Program) -> bool {
    program.lines().all(|line| {
        let code = line.split(|&b| b == b';').next().unwrap_or_default();
        !code
            .to_ascii_uppercase()
            .windows(5)
            .any(|word| word == b"BRISK")
    })
}

/// What the summary says of a refused line that stands at `place`.
fn refusal(complaint: &Complaint, place: Option<Location>) -> ErrorSummary {
    ErrorSummary {
        code: complaint.code,
        file: place.as_ref().map(|p| p.file.clone()).unwrap_or_default(),
        line: place.as_ref().map_or(0, |p| p.line),
        column: place.as_ref().map_or(0, |p| p.column),
        streamed_line: complaint.line,
        text: place.map(|p| p.text).unwrap_or_default(),
        message: complaint.text.clone(),
    }
}
