//! `host-sim send`: a program to a controller on a serial port.

use std::io::IsTerminal;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use clap::Args;

use super::{progress_bar, refused, stop_on_signal, TRAVEL_ERROR};
use crate::cli::LanguageArgs;
use crate::diagnostics::{Exit, Failure, Located};
use crate::machine_file::Machine;
use crate::precheck;
use crate::program::Program;
use crate::send::{reply, stream, Notice, Options, SendError};

/// How long one read of the port waits.
const READ_WAIT: Duration = Duration::from_millis(10);

/// Arguments of `send`.
#[derive(Args, Clone, Debug)]
pub struct SendArgs {
    /// Serial port or pseudo-terminal of the controller.
    pub port: String,
    /// Part program; sub-programs are looked for beside it.
    pub program: PathBuf,
    /// Bits per second.
    #[arg(long, default_value_t = 115_200)]
    pub baud: u32,
    /// Answer every hold (M0, M1) with cycle start instead of waiting for a person.
    #[arg(long)]
    pub auto_start: bool,
    /// Machine file of the machine behind the port, for the look through the program, instead of the built-in MCV 1210.
    #[arg(long, value_name = "FILE")]
    pub machine: Option<PathBuf>,
    /// Send without having looked through the whole program.
    #[arg(long)]
    pub no_check: bool,
    /// How the program is read.
    #[command(flatten)]
    pub language: LanguageArgs,
}

/// Streams the program and waits until the machine is at rest.
///
/// # Errors
/// Exit code 3 with the line at the caret if the controller refuses one (4 for the travel of an axis), 7 if
/// the controller is not idle to begin with, 5 for the port, an alarm, silence, or an interruption.
pub fn send(args: &SendArgs) -> Result<Exit, Failure> {
    static STOP: AtomicBool = AtomicBool::new(false);
    let mut machine = Machine::load(args.machine.as_deref())?;
    let reading = args.language.reading(machine.config.dialect);
    machine.config.dialect = reading.dialect;
    let program = Program::load_as(&args.program, &reading)?;
    if !args.no_check {
        precheck::check(&program, &machine).map_err(|complaint| {
            let Failure { exit, report } = refused(&program, &machine, &complaint);
            let help = "nothing has been sent; --no-check sends all the same";
            Failure::new(exit, report.more_help(help))
        })?;
    }
    let port_failed = |e: &dyn std::fmt::Display| {
        Failure::new(
            Exit::Io,
            Located::new(format!("cannot open {}: {e}", args.port)),
        )
    };
    let port = serialport::new(&args.port, args.baud)
        .timeout(READ_WAIT)
        .open()
        .map_err(|e| port_failed(&e))?;
    stop_on_signal(&STOP)?;

    let bar = progress_bar(program.len());
    let quiet = !std::io::stderr().is_terminal();
    let mut state = String::new();
    let mut notify = |notice: Notice<'_>| match notice {
        Notice::Acknowledged(lines) => bar.set_position(lines as u64),
        Notice::Message(text) if quiet => eprintln!("{text}"),
        Notice::Message(text) => bar.println(text),
        Notice::State(now) if now != state => {
            now.clone_into(&mut state);
            let text = "held: waiting for cycle start (~)";
            match (now == "Hold" && !args.auto_start, quiet) {
                (true, true) => eprintln!("{text}"),
                (true, false) => bar.println(text),
                (false, _) => {}
            }
        }
        Notice::State(_) | Notice::Ready(_) => {}
    };
    let lines: Vec<&[u8]> = program.lines().collect();
    let options = Options {
        auto_start: args.auto_start,
        stop: Some(&STOP),
        preamble: args.language.preamble(),
    };
    let result = stream(port, &lines, options, &mut notify);
    bar.finish_and_clear();
    match result {
        Ok(sent) => {
            println!(
                "{} lines, {} bytes, at most {} of {} in flight",
                sent.lines, sent.bytes, sent.in_flight_max, sent.window
            );
            Ok(Exit::Success)
        }
        Err(error) => Err(explain(&program, &error)),
    }
}

/// Puts the caret where the trouble is.
fn explain(program: &Program, error: &SendError) -> Failure {
    match error {
        SendError::Refused {
            line,
            code,
            message,
        } => {
            let text = message
                .as_deref()
                .unwrap_or("the controller refused this line");
            // A spline is refused when its geometry is known, which may be some lines behind the culprit.
            let named = reply::place(text).filter(|&(named, _)| (1..=*line).contains(&named));
            let (line, column) = named.unwrap_or((*line, 1));
            let text = text
                .split_once(": ")
                .filter(|_| named.is_some())
                .map_or(text, |(_, rest)| rest);
            let exit = if code.parse() == Ok(TRAVEL_ERROR) {
                Exit::Limit
            } else {
                Exit::Program
            };
            Failure::new(
                exit,
                program.error_at(line, column, text, &format!("error:{code}")),
            )
        }
        SendError::LineTooLong { line, .. } => Failure::new(
            Exit::Program,
            program.error_at(*line, 1, &error.to_string(), "this line"),
        ),
        SendError::NotReady { .. } => {
            let help = "resume it (~) or reset it (0x18), then send again";
            Failure::new(Exit::Waiting, Located::new(error.to_string()).help(help))
        }
        SendError::Alarm { line, .. }
        | SendError::Restarted { line }
        | SendError::Silent { line }
        | SendError::Interrupted { line } => Failure::new(
            Exit::Io,
            program.error_at(*line, 1, &error.to_string(), "oldest line not yet answered"),
        ),
        SendError::Port(_) | SendError::NoAnswer => {
            Failure::new(Exit::Io, Located::new(error.to_string()))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(line: usize, code: &str, message: Option<&str>) -> (Exit, String) {
        let program = Program::from_text("part.mpf", "G1 X1 F100\nG1 Y2 Q3\nM30\n").unwrap();
        let message = message.map(str::to_owned);
        let failure = explain(
            &program,
            &SendError::Refused {
                line,
                code: code.to_owned(),
                message,
            },
        );
        (failure.exit, failure.render())
    }

    #[test]
    fn a_refusal_points_at_the_place_the_controller_names() {
        let (exit, text) = shown(3, "20", Some("error line 2 column 7: unknown address Q"));
        assert_eq!(exit, Exit::Program);
        for part in ["unknown address Q", "part.mpf:2:7", "G1 Y2 Q3", "error:20"] {
            assert!(text.contains(part), "{part:?} not in\n{text}");
        }
    }

    #[test]
    fn a_refusal_without_a_place_points_at_the_oldest_line_in_flight() {
        assert!(shown(2, "20", None).1.contains("part.mpf:2:1"));
        // A count that does not fit this program is not believed.
        assert!(shown(2, "20", Some("error line 99 column 1: bad"))
            .1
            .contains("part.mpf:2:1"));
    }

    #[test]
    fn leaving_the_travel_has_an_exit_code_of_its_own() {
        assert_eq!(shown(1, "201", None).0, Exit::Limit);
    }
}
