//! `host-sim emulate`: the firmware image under QEMU, fed over its serial port.

use std::path::PathBuf;

use clap::Args;
use indicatif::ProgressBar;
use pentaspline::board::MACHINE;
use pentaspline::config::AxisKind;
use serde::Serialize;

use super::progress_bar;
use crate::cli::LanguageArgs;
use crate::diagnostics::{Exit, Failure, Located};
use crate::emulate::{self, EmulateError, Emulated, Observer, Options, SHIFT_AHEAD};
use crate::events;
use crate::program::Program;
use crate::runner::End;
use crate::summary::ErrorSummary;

/// Arguments of `emulate`.
#[derive(Args, Clone, Debug)]
pub struct EmulateArgs {
    /// Part program; sub-programs are looked for beside it.
    pub program: PathBuf,
    /// Write the summary as JSON.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Play the `tick,event` rows that `run --events` plays.
    #[arg(long, value_name = "FILE.csv")]
    pub events: Option<PathBuf>,
    /// Pass M0 and M1 without waiting for cycle start.
    #[arg(long)]
    pub auto_start: bool,
    /// Firmware image instead of target/firmware/qemu.elf.
    #[arg(long, value_name = "FILE.elf")]
    pub image: Option<PathBuf>,
    /// 2^N ns per instruction, and 1.6 ms per tick: 6 is about the speed of the board.
    #[arg(long, value_name = "N", default_value_t = SHIFT_AHEAD, value_parser = clap::value_parser!(u8).range(..=10))]
    pub shift: u8,
    /// How the program is read.
    #[command(flatten)]
    pub language: LanguageArgs,
}

/// What the JSON file holds; keys mean what they mean in the summary of `run`.
#[derive(Clone, Debug, Serialize)]
pub struct EmulationSummary {
    /// Program as it was named on the command line.
    pub program: String,
    /// Name of the machine the image was built for.
    pub machine: String,
    /// Servo ticks per second.
    pub servo_hz: u32,
    /// Time in motion: `ticks / servo_hz`.
    pub duration_s: f64,
    /// Servo ticks in motion.
    pub ticks: u64,
    /// FNV-1a over the frames of all ticks in motion, 16 hexadecimal digits.
    pub digest: String,
    /// Per axis.
    pub axes: Vec<EmulatedAxis>,
    /// First line the firmware said.
    pub banner: String,
    /// Bytes of stack used at the deepest.
    pub stack_bytes: u32,
    /// Bytes the stack can take.
    pub stack_size_bytes: u32,
    /// What the user should know, one sentence each.
    pub warnings: Vec<String>,
    /// How the run ended: `finished`, `waiting`, `program_error` or `alarm`.
    pub outcome: String,
    /// The error that ended the run.
    pub error: Option<ErrorSummary>,
}

/// One axis.
#[derive(Clone, Debug, Serialize)]
pub struct EmulatedAxis {
    /// Letter.
    pub name: String,
    /// `mm` or `degree`.
    pub unit: &'static str,
    /// Steps per unit.
    pub steps_per_unit: f64,
    /// Steps emitted since power-up, signed.
    pub final_steps: i32,
}

struct Bar(ProgressBar);

impl Observer for Bar {
    fn progress(&mut self, lines: usize, _ticks: u64) {
        if self.0.position() != lines as u64 {
            self.0.set_position(lines as u64);
        }
    }
}

/// Runs a program on the emulated board; prints the summary on stdout.
///
/// # Errors
/// Exit code 6 if the emulator, the image or the trace fails; else as `run`.
pub fn emulate(args: &EmulateArgs) -> Result<Exit, Failure> {
    let reading = args.language.reading(MACHINE.dialect);
    let program = Program::load_as(&args.program, &reading)?;
    let events = match &args.events {
        Some(path) => events::load(path)?,
        None => Vec::new(),
    };
    let options = Options {
        events,
        image: args.image.clone(),
        auto_start: args.auto_start,
        preamble: args.language.preamble(),
        shift: args.shift,
        ..Options::default()
    };
    let mut bar = Bar(progress_bar(program.len()));
    let result = emulate::emulate(&program, &options, &mut bar);
    bar.0.finish_and_clear();
    let emulated = result.map_err(|error| failure(&error))?;
    let (summary, failure) = conclude(&program, &emulated);
    if let Some(path) = &args.json {
        write_json(path, &summary)?;
    }
    print!("{}", table(&summary));
    failure.map_or(Ok(Exit::Success), Err)
}

fn failure(error: &EmulateError) -> Failure {
    Failure::new(
        Exit::Emulator,
        Located::new(error.to_string()).help(error.help()),
    )
}

fn write_json(path: &std::path::Path, summary: &EmulationSummary) -> Result<(), Failure> {
    let failed = |e: std::io::Error| Failure::io("write", path, &e);
    let mut text = serde_json::to_string_pretty(summary).map_err(|e| failed(e.into()))?;
    text.push('\n');
    std::fs::write(path, text).map_err(failed)
}

/// The summary, and the failure its end stands for.
fn conclude(program: &Program, emulated: &Emulated) -> (EmulationSummary, Option<Failure>) {
    let mut error = None;
    let (outcome, failure) = match &emulated.end {
        End::Refused(complaint) => {
            let place = program.locate(complaint.line, complaint.column);
            error = Some(super::refusal(complaint, place));
            let label = format!("error:{}", complaint.code);
            let exit = if complaint.code == super::TRAVEL_ERROR {
                Exit::Limit
            } else {
                Exit::Program
            };
            let located =
                program.error_at(complaint.line, complaint.column, &complaint.text, &label);
            ("program_error", Some(Failure::new(exit, located)))
        }
        End::Alarm(code) => {
            let located = Located::new(format!("the controller raised ALARM:{code}"));
            ("alarm", Some(Failure::new(Exit::Program, located)))
        }
        End::Waiting { .. } => {
            let located = Located::new("the program waits for cycle start");
            let located = located.help("--auto-start passes M0 and M1");
            ("waiting", Some(Failure::new(Exit::Waiting, located)))
        }
        End::Reset => ("reset", None),
        // The emulated board ends in no other way.
        _ => ("finished", None),
    };
    let warnings = emulated
        .messages
        .iter()
        .filter(|text| text.starts_with("warning"));
    let axes = MACHINE.axes.iter().zip(emulated.final_steps);
    let summary = EmulationSummary {
        program: program.name().to_owned(),
        machine: MACHINE.name.to_owned(),
        servo_hz: MACHINE.servo_hz,
        duration_s: emulated.ticks as f64 / f64::from(MACHINE.servo_hz),
        ticks: emulated.ticks,
        digest: format!("{:016x}", emulated.digest),
        axes: axes
            .map(|(axis, final_steps)| EmulatedAxis {
                name: char::from(axis.letter).to_string(),
                unit: match axis.kind {
                    AxisKind::Linear => "mm",
                    AxisKind::Rotary => "degree",
                },
                steps_per_unit: axis.steps_per_unit.to_num(),
                final_steps,
            })
            .collect(),
        banner: emulated.banner.clone(),
        stack_bytes: emulated.stack.0,
        stack_size_bytes: emulated.stack.1,
        warnings: warnings.cloned().collect(),
        outcome: outcome.to_owned(),
        error,
    };
    (summary, failure)
}

fn table(summary: &EmulationSummary) -> String {
    let mut text = format!(
        "program  {}\nmachine  {} (emulated board)\nfirmware {}\noutcome  {}\nmotion   {:.3} s in {} servo ticks of {} Hz\ndigest   {}\nstack    {} of {} bytes\n",
        summary.program,
        summary.machine,
        summary.banner,
        summary.outcome,
        summary.duration_s,
        summary.ticks,
        summary.servo_hz,
        summary.digest,
        summary.stack_bytes,
        summary.stack_size_bytes,
    );
    for axis in &summary.axes {
        let at = f64::from(axis.final_steps) / axis.steps_per_unit;
        text.push_str(&format!(
            "{}        {} steps, {at:.3} {}\n",
            axis.name, axis.final_steps, axis.unit
        ));
    }
    for warning in &summary.warnings {
        text.push_str(&format!("warning  {warning}\n"));
    }
    text
}
