//! What a program costs by its length: 10^3 to 10^6 blocks through `check`, and through core and feeder alone.
//!
//! In: lengths. Out: rows of time per block and peak memory. Each length has a process of its own, this program once more,
//! since the kernel counts peak memory per process. All of it depends on the PC; what does not is held by
//! `tests/tests/linear_cost.rs`.

use std::fs;
use std::io::{self, Write};
use std::path::Path;
use std::process::{Command, Stdio};

use pentaspline::units::Tick;
use tempfile::NamedTempFile;

use super::report::{Group, Report};
use super::{vectors, BenchError};
use crate::feeder::Line;
use crate::machine_file::Machine;
use crate::runner::{self, End, Options};
use crate::watch::Watch;

/// Lengths in blocks, as they are called in keys, and runs of which the fastest counts.
const LENGTHS: [(u32, &str, u32); 4] = [
    (1_000, "1e3", 5),
    (10_000, "1e4", 3),
    (100_000, "1e5", 2),
    (1_000_000, "1e6", 1),
];
/// Beyond the longest run here.
const MAX_TICKS: Tick = 1_000_000_000;
/// First word of the line in which a process says what it took.
const TOOK: &str = "took";

/// What a process took.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Took {
    /// Time on a processor, s: what else the PC does counts little.
    pub seconds: f64,
    /// Peak of resident memory, KiB.
    pub peak_kib: f64,
}

impl Took {
    /// Does `work`, then looks at the time it took and at the memory this process has taken so far.
    ///
    /// # Errors
    /// Those of `work`, or if the kernel does not say.
    pub fn by<E: From<io::Error>>(work: impl FnOnce() -> Result<(), E>) -> Result<Self, E> {
        let start = processor_ns()?;
        work()?;
        let seconds = (processor_ns()? - start) / 1e9;
        let status = fs::read_to_string("/proc/self/status")?;
        let peak = status
            .lines()
            .find_map(|line| line.strip_prefix("VmHWM:"))
            .and_then(|rest| rest.trim().strip_suffix("kB")?.trim().parse().ok());
        let peak_kib = peak.ok_or_else(|| io::Error::other("/proc/self/status has no VmHWM"))?;
        Ok(Self { seconds, peak_kib })
    }

    /// The line that `Took::read` reads.
    #[must_use]
    pub fn line(&self) -> String {
        format!("{TOOK} {} {}", self.seconds, self.peak_kib)
    }

    fn read(text: &str) -> Option<Self> {
        let line = text.lines().rev().find(|line| line.starts_with(TOOK))?;
        let mut words = line.split(' ').skip(1);
        Some(Self {
            seconds: words.next()?.parse().ok()?,
            peak_kib: words.next()?.parse().ok()?,
        })
    }
}

/// Time this thread has spent on a processor, ns (first number of `schedstat`, Linux' `Documentation/scheduler/sched-stats.rst`).
fn processor_ns() -> io::Result<f64> {
    let text = fs::read_to_string("/proc/thread-self/schedstat")?;
    let ns = text.split(' ').next().and_then(|word| word.parse().ok());
    ns.ok_or_else(|| io::Error::other("/proc/thread-self/schedstat has no time"))
}

/// Runs [`vectors::long`] of `blocks` blocks, each line made when it is sent.
///
/// # Errors
/// [`BenchError::Refused`] if it does not run to its end.
pub fn stream(blocks: u32) -> Result<(), BenchError> {
    let machine = Machine::built_in()?;
    let options = Options {
        auto_start: true,
        events: Vec::new(),
        max_ticks: MAX_TICKS,
    };
    let mut watch = Watch::new(&machine);
    let lines = vectors::long(blocks).map(|line| Line::Owned(line.into_bytes()));
    match runner::run_lines(lines, &machine, &options, &mut watch)?.end {
        End::Finished => Ok(()),
        _ => Err(BenchError::Refused {
            errors: 1,
            first_line: vectors::long(0).next().unwrap_or_default(),
        }),
    }
}

/// A program in the folder for temporary files, gone with its owner.
fn temporary(lines: impl Iterator<Item = String>) -> io::Result<NamedTempFile> {
    let program = NamedTempFile::with_suffix(".mpf")?;
    let mut file = io::BufWriter::new(&program);
    for line in lines {
        writeln!(file, "{line}")?;
    }
    file.flush()?;
    drop(file);
    Ok(program)
}

/// Runs this program with `arguments`; the fastest of `runs` counts.
fn fastest(runs: u32, arguments: &[&std::ffi::OsStr]) -> Result<Took, BenchError> {
    let mut best: Option<Took> = None;
    for _ in 0..runs {
        let output = Command::new(std::env::current_exe()?)
            .arg("bench")
            .args(arguments)
            .stderr(Stdio::inherit())
            .output()?;
        let took = Took::read(&String::from_utf8_lossy(&output.stdout))
            .ok_or_else(|| io::Error::other("a process that was to be measured failed"))?;
        if best.is_none_or(|best| took.seconds < best.seconds) {
            best = Some(took);
        }
    }
    best.ok_or_else(|| io::Error::other("nothing was measured").into())
}

fn through_check(path: &Path, runs: u32) -> Result<Took, BenchError> {
    fastest(runs, &["--measure-check".as_ref(), path.as_os_str()])
}

fn streamed(blocks: u32) -> Result<Took, BenchError> {
    let blocks = blocks.to_string();
    fastest(1, &["--measure-stream".as_ref(), blocks.as_ref()])
}

/// Adds the rows.
///
/// # Errors
/// [`BenchError::Io`] if a process fails.
pub fn measure(progress: &mut dyn FnMut(&str), report: &mut Report) -> Result<(), BenchError> {
    report.group(Group::Length);
    let mut rows = Vec::new();
    for (blocks, name, runs) in LENGTHS {
        progress(&format!("{name} blocks"));
        let program = temporary(vectors::long(blocks))?;
        rows.push((
            blocks,
            name,
            through_check(program.path(), runs)?,
            streamed(blocks)?,
        ));
    }
    for (blocks, name, check, _) in &rows {
        report.add(
            &format!("block_us_{name}"),
            check.seconds * 1e6 / f64::from(*blocks),
            "us",
            &format!("processor time of `check` per block, {blocks} blocks of a C-spline, 0.5 mm apart at 200 mm/s; depends on the PC"),
        );
    }
    for (blocks, name, check, _) in &rows {
        report.add(
            &format!("check_kib_{name}"),
            check.peak_kib,
            "KiB",
            &format!("peak memory of that `check`, {blocks} blocks: it keeps the text, to follow jumps and to show errors"),
        );
    }
    for (blocks, name, _, stream) in &rows {
        report.add(
            &format!("stream_kib_{name}"),
            stream.peak_kib,
            "KiB",
            &format!("peak memory of core, feeder and summary, {blocks} blocks, each line made when it is sent"),
        );
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_process_took_is_read_from_the_last_of_its_lines() {
        let took = Took {
            seconds: 0.5,
            peak_kib: 6000.0,
        };
        let text = format!("took off\n  time 3 s\n{}\n", took.line());
        assert_eq!(Took::read(&text), Some(took));
        assert_eq!(Took::read("took off\n"), None);
        assert_eq!(Took::read(""), None);
    }

    #[test]
    fn a_long_program_runs_to_its_end() {
        assert!(stream(1200).is_ok());
    }
}
