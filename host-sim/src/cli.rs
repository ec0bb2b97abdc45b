//! The command line. Fixed, because scripts depend on it (README, "Commands").

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use pentaspline::config::Dialect;

use crate::diagnostics::EXIT_CODE_HELP;
use crate::program::Reading;

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
    /// Run a published study again and compare with what it printed.
    Study(crate::commands::study::StudyArgs),
    /// List every error: number, message, reason, what to do.
    Errors(ErrorsArgs),
}

/// Arguments of `errors`.
#[derive(Args, Clone, Debug)]
pub struct ErrorsArgs {
    /// Write the list as a Markdown page instead of printing it.
    #[arg(long, value_name = "FILE")]
    pub markdown: Option<PathBuf>,
}

/// How a program is read, for all commands that take one.
#[derive(Args, Clone, Copy, Debug, Default)]
pub struct LanguageArgs {
    /// Language of the program instead of the one the machine has at power-up.
    #[arg(long, value_name = "NAME")]
    pub dialect: Option<DialectName>,
    /// Leave out lines that begin with `/`.
    #[arg(long)]
    pub block_skip: bool,
}

/// A dialect as it is named on the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum DialectName {
    /// Sinumerik 840D and System 800.
    Sinumerik,
    /// Fanuc.
    Fanuc,
    /// Heidenhain conversational.
    Heidenhain,
}

impl DialectName {
    /// The dialect itself.
    #[must_use]
    pub fn dialect(self) -> Dialect {
        match self {
            Self::Sinumerik => Dialect::Sinumerik,
            Self::Fanuc => Dialect::Fanuc,
            Self::Heidenhain => Dialect::Heidenhain,
        }
    }
}

impl LanguageArgs {
    /// How to read a program for a machine whose power-up dialect is `machine`.
    #[must_use]
    pub fn reading(&self, machine: Dialect) -> Reading {
        Reading {
            dialect: self.dialect.map_or(machine, DialectName::dialect),
            block_skip: self.block_skip,
            ..Reading::default()
        }
    }

    /// The line that tells a controller about the dialect asked for, without its line end.
    #[must_use]
    pub fn preamble(&self) -> Option<&'static str> {
        self.dialect.map(|name| match name {
            DialectName::Sinumerik => "$DIALECT SINUMERIK",
            DialectName::Fanuc => "$DIALECT FANUC",
            DialectName::Heidenhain => "$DIALECT HEIDENHAIN",
        })
    }
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
    /// Play `tick,event` rows (hold, resume, reset, override=PERCENT, rapid=PERCENT, starve=TICKS) at exact ticks.
    #[arg(long, value_name = "FILE.csv")]
    pub events: Option<PathBuf>,
    /// Pass M0 and M1 without waiting for cycle start.
    #[arg(long)]
    pub auto_start: bool,
    /// Begin to move before the whole program has been looked through.
    #[arg(long)]
    pub no_check: bool,
    /// How the program is read.
    #[command(flatten)]
    pub language: LanguageArgs,
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
    /// How the program is read.
    #[command(flatten)]
    pub language: LanguageArgs,
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
            "host-sim run P.MPF --dialect fanuc --block-skip --no-check",
            "host-sim check P.H --dialect heidenhain",
            "host-sim send /dev/ttyACM0 P.H --dialect heidenhain --block-skip --no-check --machine m.toml",
            "host-sim emulate P.MPF --dialect sinumerik --block-skip",
        ] {
            Cli::try_parse_from(line.split(' ')).unwrap();
        }
        assert!(Cli::try_parse_from(["host-sim", "run", "p", "--max-time", "0"]).is_err());
    }
}
