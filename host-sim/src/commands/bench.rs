//! `host-sim bench`: measures the core and prints the table.

use std::path::{Path, PathBuf};

use clap::Args;

use crate::bench::{self, markdown, report, BenchError, Images};
use crate::diagnostics::{Exit, Failure, Located};

/// Arguments of `bench`.
#[derive(Args, Clone, Debug)]
pub struct BenchArgs {
    /// Write the numbers as JSON.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Write the page docs/benchmarks.md.
    #[arg(long, value_name = "FILE.md")]
    pub markdown: Option<PathBuf>,
    /// Instruction meter instead of target/firmware/bench.elf.
    #[arg(long, value_name = "FILE.elf")]
    pub image: Option<PathBuf>,
}

/// Measures; the table goes to stdout, what is being done to stderr.
///
/// # Errors
/// Exit code 6 if the emulator or an image fails, 5 if a file cannot be written.
pub fn bench(args: &BenchArgs) -> Result<Exit, Failure> {
    let mut images = Images::find();
    if let Some(image) = &args.image {
        images.meter.clone_from(image);
    }
    let mut progress = |step: &str| eprintln!("bench: {step}");
    let measured = bench::measure(&images, &mut progress).map_err(|e| failure(&e))?;
    if report::host_build() == "debug" {
        eprintln!("bench: this is a debug build; the sim_ rows are those of a release build only with --release");
    }
    if let Some(path) = &args.json {
        let failed = |e: std::io::Error| Failure::io("write", path, &e);
        let mut text = serde_json::to_string_pretty(&measured).map_err(|e| failed(e.into()))?;
        text.push('\n');
        write(path, &text)?;
    }
    if let Some(path) = &args.markdown {
        write(path, &markdown::page(&measured))?;
    }
    print!("{}", measured.table());
    Ok(Exit::Success)
}

fn write(path: &Path, text: &str) -> Result<(), Failure> {
    std::fs::write(path, text).map_err(|e| Failure::io("write", path, &e))
}

fn failure(error: &BenchError) -> Failure {
    let exit = match error {
        BenchError::Io(_) => Exit::Io,
        _ => Exit::Emulator,
    };
    Failure::new(exit, Located::new(error.to_string()).help(error.help()))
}
