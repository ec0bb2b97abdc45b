//! `host-sim study`: runs a published study again and compares.

use std::io::IsTerminal;
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use indicatif::{ProgressBar, ProgressStyle};

use crate::diagnostics::{Exit, Failure};
use crate::machine_file::Machine;
use crate::study::{self, page, table};

/// Threads that measure.
const THREADS: usize = 2;

/// Arguments of `study`.
#[derive(Args, Clone, Debug)]
pub struct StudyArgs {
    /// Which study.
    #[command(subcommand)]
    pub study: Study,
}

/// The studies.
#[derive(Clone, Debug, Subcommand)]
pub enum Study {
    /// 24 finishing programs of the milling thesis: three splines and straight lines on six sets of knots.
    Thesis(ThesisArgs),
}

/// Arguments of `study thesis`.
#[derive(Args, Clone, Debug)]
pub struct ThesisArgs {
    /// Machine file instead of the built-in MCV 1210.
    #[arg(long, value_name = "FILE")]
    pub machine: Option<PathBuf>,
    /// Write the 24 rows as a JSON array.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Write the tables and charts, one self-contained HTML file.
    #[arg(long, value_name = "FILE.html")]
    pub report: Option<PathBuf>,
    /// Write the finishing and roughing programs into a folder.
    #[arg(long, value_name = "DIR")]
    pub write: Option<PathBuf>,
}

/// Runs the study; prints the table on stdout.
///
/// # Errors
/// See [`study::run`]; exit code 5 if a file cannot be written.
pub fn study(args: &StudyArgs) -> Result<Exit, Failure> {
    let Study::Thesis(args) = &args.study;
    thesis(args)
}

fn thesis(args: &ThesisArgs) -> Result<Exit, Failure> {
    let machine = Machine::load(args.machine.as_deref())?;
    if let Some(folder) = &args.write {
        let count = study::write_programs(folder)?;
        eprintln!("study: {count} files in {}", folder.display());
    }
    let bar = bar();
    let rows = study::run(&machine, THREADS, &|| bar.inc(1))?;
    bar.finish_and_clear();
    // First of all: a file that cannot be written does not cost the result.
    print!("{}", table::text(&rows));
    if let Some(path) = &args.json {
        let text = table::json(&rows).map_err(|e| Failure::io("write", path, &e.into()))?;
        write(path, &text)?;
    }
    if let Some(path) = &args.report {
        write(path, &page::html(&rows, machine.config.name))?;
    }
    Ok(Exit::Success)
}

fn write(path: &Path, text: &str) -> Result<(), Failure> {
    std::fs::write(path, text).map_err(|e| Failure::io("write", path, &e))
}

/// Progress over the programs on stderr; hidden unless that is a terminal.
fn bar() -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(24);
    if let Ok(style) = ProgressStyle::with_template("{bar:40} program {pos}/{len} {elapsed}") {
        bar.set_style(style);
    }
    bar
}
