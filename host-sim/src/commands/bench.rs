//! `host-sim bench`: measures the core and prints the table.

use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;

use crate::bench::budget::{self, Budgets};
use crate::bench::report::Report;
use crate::bench::scale::{self, Took};
use crate::bench::{self, markdown, readme, report, BenchError, Images, Scope};
use crate::cli::{CheckArgs, LanguageArgs};
use crate::commands::check;
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
    /// Replace the paragraph on performance in this page.
    #[arg(long, value_name = "FILE.md")]
    pub readme: Option<PathBuf>,
    /// Instruction meter instead of target/firmware/bench.elf.
    #[arg(long, value_name = "FILE.elf")]
    pub image: Option<PathBuf>,
    /// Fail (exit code 9) if a count or a size is over its budget by more than 2 %.
    #[arg(long)]
    pub check: bool,
    /// Lower budgets to what is measured.
    #[arg(long)]
    pub bless: bool,
    /// Budgets instead of docs/budgets.toml.
    #[arg(long, value_name = "FILE.toml")]
    pub budgets: Option<PathBuf>,
    /// Leave out the rows that depend on this PC.
    #[arg(long)]
    pub counts: bool,
    /// Run programs of 10^3 to 10^6 blocks as well.
    #[arg(long, conflicts_with = "counts")]
    pub scale: bool,
    /// Check this program and print what that took; for `--scale`.
    #[arg(long, hide = true, value_name = "PROGRAM")]
    pub measure_check: Option<PathBuf>,
    /// Stream this many blocks and print what that took; for `--scale`.
    #[arg(long, hide = true, value_name = "BLOCKS")]
    pub measure_stream: Option<u32>,
}

/// Measures; the table goes to stdout, what is being done to stderr. Files asked for are written all the same when a
/// budget is exceeded.
///
/// # Errors
/// Exit code 9 if a budget is exceeded, 6 if the emulator or an image fails, 5 if a file cannot be read or written, 2 if
/// the budgets are not understood or are those of another compiler and must be lowered.
pub fn bench(args: &BenchArgs) -> Result<Exit, Failure> {
    if let Some(took) = one_length(args)? {
        println!("{}", took.line());
        return Ok(Exit::Success);
    }
    let mut images = Images::find();
    if let Some(image) = &args.image {
        images.meter.clone_from(image);
    }
    let file = args.budgets.clone().unwrap_or_else(Budgets::default_file);
    let mut budgets = read_budgets(&file)?;
    let scope = Scope {
        pc: !args.counts,
        scale: args.scale,
    };
    let mut progress = |step: &str| eprintln!("bench: {step}");
    let measured = bench::measure(&images, scope, &mut progress).map_err(|e| failure(&e))?;
    if scope.pc && report::host_build() == "debug" {
        eprintln!("bench: this is a debug build; the sim_ rows are those of a release build only with --release");
    }
    print!("{}", measured.table());
    if args.bless {
        budgets.lower(&measured).map_err(|other| {
            let help = format!(
                "to begin anew with this compiler, delete the line `compiler` and the budgets in {}",
                file.display()
            );
            Failure::new(Exit::Usage, Located::new(other.to_string()).help(help))
        })?;
        write(&file, &budgets.text(&measured))?;
    }
    if let Some(path) = &args.json {
        let failed = |e: std::io::Error| Failure::io("write", path, &e);
        let mut text = serde_json::to_string_pretty(&measured).map_err(|e| failed(e.into()))?;
        text.push('\n');
        write(path, &text)?;
    }
    if let Some(path) = &args.markdown {
        write(path, &markdown::page(&measured, &budgets))?;
    }
    if let Some(path) = &args.readme {
        write_readme(path, &readme::block(&measured.values(), &budgets))?;
    }
    if args.check {
        hold(&measured, &budgets)?;
    }
    Ok(Exit::Success)
}

/// What a process that `--scale` starts has to do, and what it took.
fn one_length(args: &BenchArgs) -> Result<Option<Took>, Failure> {
    if let Some(program) = &args.measure_check {
        let check = CheckArgs {
            program: program.clone(),
            json: None,
            machine: None,
            language: LanguageArgs::default(),
            max_time: f64::INFINITY,
        };
        return Took::by(|| check::check(&check).map(drop)).map(Some);
    }
    let stream = |blocks| Took::by(|| scale::stream(blocks));
    args.measure_stream
        .map(stream)
        .transpose()
        .map_err(|e| failure(&e))
}

fn read_budgets(file: &Path) -> Result<Budgets, Failure> {
    let text = fs::read_to_string(file).map_err(|e| Failure::io("read budgets", file, &e))?;
    Budgets::parse(&text).map_err(|e| {
        let located = Located::new(format!("{} is no list of budgets", file.display())).help(e);
        Failure::new(Exit::Usage, located)
    })
}

fn write_readme(path: &Path, block: &str) -> Result<(), Failure> {
    let page = fs::read_to_string(path).map_err(|e| Failure::io("read", path, &e))?;
    let page = readme::replace(&page, block).ok_or_else(|| {
        let message = format!("{} has no place for the paragraph", path.display());
        let help = format!(
            "it stands between the lines\n{}{}",
            readme::BEGIN,
            readme::END
        );
        Failure::new(Exit::Usage, Located::new(message).help(help))
    })?;
    write(path, &page)
}

/// Compares with the budgets; says what can be lowered.
fn hold(measured: &Report, budgets: &Budgets) -> Result<(), Failure> {
    if budgets.slack(&measured.compiler) > budget::SLACK {
        eprintln!(
            "bench: WARNING: the budgets were measured with `{}`, these images come from `{}`: {:.0} % are allowed instead of {:.0} %",
            budgets.compiler,
            measured.compiler,
            budget::OTHER_COMPILER_SLACK * 100.0,
            budget::SLACK * 100.0
        );
    }
    let breaches = budgets.breaches(measured);
    if breaches.is_empty() {
        let held = measured.rows.iter().filter(|row| row.is_repeatable());
        eprintln!("bench: {} values within their budgets", held.count());
        return Ok(());
    }
    let list: Vec<String> = breaches.iter().map(ToString::to_string).collect();
    let message = format!("over budget:\n  {}", list.join("\n  "));
    let help =
        "make it cheaper; or, if it is worth it, delete the budget's line in docs/budgets.toml, \
                run `bash docs/refresh benchmarks` and say why in the commit";
    Err(Failure::new(Exit::Budget, Located::new(message).help(help)))
}

fn write(path: &Path, text: &str) -> Result<(), Failure> {
    fs::write(path, text).map_err(|e| Failure::io("write", path, &e))
}

fn failure(error: &BenchError) -> Failure {
    let exit = match error {
        BenchError::Io(_) => Exit::Io,
        _ => Exit::Emulator,
    };
    Failure::new(exit, Located::new(error.to_string()).help(error.help()))
}
