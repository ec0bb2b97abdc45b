//! The command line. Fixed, because scripts depend on it (README, "Commands").

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

use crate::diagnostics::EXIT_CODE_HELP;

/// Simulator of the Pentaspline five-axis motion core.
#[derive(Debug, Parser)]
#[command(name = "host-sim", version, about, after_help = EXIT_CODE_HELP)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run a program on the simulated machine; write trace, summary and report.
    Run(RunArgs),
    /// Parse and plan a program: time, travel, errors.
    Check(CheckArgs),
    /// Run a program on the firmware image under QEMU, over its serial port.
    #[cfg(unix)]
    Emulate(crate::commands::emulate::EmulateArgs),
    /// Measure what the core costs: instructions, memory, speed.
    #[cfg(unix)]
    Bench(crate::commands::bench::BenchArgs),
    /// Be a controller on a pseudo-terminal, in real time.
    #[cfg(unix)]
    Serve(crate::commands::serve::ServeArgs),
    /// Stream a program to a controller on a serial port.
    Send(crate::commands::send::SendArgs),
}

/// Arguments of `run`.
#[derive(Args, Clone, Debug)]
pub struct RunArgs {
    /// Part program; sub-programs are looked for beside it.
    pub program: PathBuf,
    /// Machine file instead of the built-in MCV 1210.
    #[arg(long, value_name = "FILE")]
    pub machine: Option<PathBuf>,
    /// Write one CSV row per servo tick.
    #[arg(long, value_name = "FILE.csv")]
    pub trace: Option<PathBuf>,
    /// Write the summary as JSON.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Write a report, one self-contained HTML file.
    #[arg(long, value_name = "FILE.html")]
    pub report: Option<PathBuf>,
    /// Play `tick,event` rows (hold, resume, reset) at exact servo ticks.
    #[arg(long, value_name = "FILE.csv")]
    pub events: Option<PathBuf>,
    /// Pass M0 and M1 without waiting for cycle start.
    #[arg(long)]
    pub auto_start: bool,
    /// Give up after this much simulated time, s.
    #[arg(long, value_name = "SECONDS", default_value_t = 36_000.0, value_parser = positive)]
    pub max_time: f64,
}

/// Arguments of `check`.
#[derive(Args, Clone, Debug)]
pub struct CheckArgs {
    /// Part program; sub-programs are looked for beside it.
    pub program: PathBuf,
    /// Write the result as JSON.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Machine file instead of the built-in MCV 1210.
    #[arg(long, value_name = "FILE")]
    pub machine: Option<PathBuf>,
    /// Give up after this much simulated time, s.
    #[arg(long, value_name = "SECONDS", default_value_t = 36_000.0, value_parser = positive)]
    pub max_time: f64,
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err("expected a number of seconds above 0".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn the_fixed_command_lines_are_understood() {
        for line in [
            "host-sim run P.MPF",
            "host-sim run P.MPF --machine m.toml --trace t.csv --json s.json --report r.html --events e.csv --auto-start",
            "host-sim check P.MPF --json s.json",
        ] {
            Cli::try_parse_from(line.split(' ')).unwrap();
        }
        assert!(Cli::try_parse_from(["host-sim", "run", "p", "--max-time", "0"]).is_err());
    }
}
