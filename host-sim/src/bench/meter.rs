//! The instruction meter: the image `bench.elf` in the emulator, which counts.
//!
//! In: a header and a program. Out: named counts. The emulator gives every instruction one nanosecond of
//! virtual time (`-icount shift=0`) and the image reads a timer of 1 GHz, so its readings count instructions.
//! Nothing depends on the speed of the host.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, ErrorKind, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{channel, RecvTimeoutError};
use std::thread;
use std::time::Duration;

use super::BenchError;
use crate::emulate::EmulateError;

/// Name under which the emulator is looked for in `PATH`.
const EMULATOR: &str = "qemu-system-arm";
/// One instruction is one nanosecond, and a sleeping core does not wait for real time.
const ICOUNT: &str = "shift=0,sleep=off";
/// The timer counts nanoseconds.
const TIMER_CLOCK: &str = "driver=stm32f2xx-timer,property=clock-frequency,value=1000000000";
/// What ends the program on the wire.
const END_OF_PROGRAM: &str = "\x04\n";
/// Wall-clock time between two lines of the image. It says nothing while it counts.
const PATIENCE: Duration = Duration::from_secs(300);

/// Counts of one kind of call.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Stat {
    /// Calls.
    pub n: u64,
    /// Instructions in all.
    pub sum: u64,
    /// Instructions of the longest.
    pub max: u64,
}

impl Stat {
    /// Instructions per call; 0 without calls.
    #[must_use]
    pub fn mean(&self) -> f64 {
        ratio(self.sum, self.n)
    }
}

/// `sum / n`, 0 for nothing.
#[must_use]
pub fn ratio(sum: u64, n: u64) -> f64 {
    if n == 0 {
        0.0
    } else {
        sum as f64 / n as f64
    }
}

/// What the image said.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Counts(BTreeMap<String, u64>);

impl Counts {
    /// The value called `name`.
    ///
    /// # Errors
    /// [`BenchError::Missing`]: the image is of another version.
    pub fn get(&self, name: &str) -> Result<u64, BenchError> {
        let value = self.0.get(name).copied();
        value.ok_or_else(|| BenchError::Missing(name.to_owned()))
    }

    /// The calls called `name`.
    ///
    /// # Errors
    /// As [`Counts::get`].
    pub fn stat(&self, name: &str) -> Result<Stat, BenchError> {
        Ok(Stat {
            n: self.get(&format!("{name}.n"))?,
            sum: self.get(&format!("{name}.sum"))?,
            max: self.get(&format!("{name}.max"))?,
        })
    }

    /// Takes a line `name value`; other lines say nothing.
    fn take(&mut self, line: &str) {
        if let Some((name, value)) = line.trim().split_once(' ') {
            if let Ok(value) = value.parse() {
                self.0.insert(name.to_owned(), value);
            }
        }
    }
}

/// The child ends with its owner.
struct Emulator(Child);

impl Drop for Emulator {
    fn drop(&mut self) {
        // Both fail only if the child has ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Runs `program` under `header` (`core LOW HIGH` or `parts`, see the image) on `image`.
///
/// # Errors
/// [`BenchError::Emulate`] if emulator or image fail; [`BenchError::Memory`] if the image copies memory wrongly;
/// [`BenchError::Refused`] if the core refuses the program.
pub fn count(image: &Path, header: &str, program: &str) -> Result<Counts, BenchError> {
    if !image.is_file() {
        return Err(EmulateError::NoImage(image.to_owned()).into());
    }
    let child = Command::new(EMULATOR)
        .args(["-M", "netduinoplus2", "-nodefaults", "-display", "none"])
        .args(["-monitor", "none", "-icount", ICOUNT])
        .args(["-global", TIMER_CLOCK])
        .args(["-chardev", "stdio,id=host,signal=off"])
        .args(["-serial", "null", "-serial", "chardev:host", "-kernel"])
        .arg(image)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .map_err(|e| match e.kind() {
            ErrorKind::NotFound => EmulateError::NoEmulator,
            _ => e.into(),
        })?;
    let mut emulator = Emulator(child);
    let mut input = emulator.0.stdin.take();
    let Some(output) = emulator.0.stdout.take() else {
        return Err(EmulateError::NoAnswer(PATIENCE).into());
    };
    let (sender, lines) = channel();
    thread::spawn(move || {
        for line in BufReader::new(output).split(b'\n').map_while(Result::ok) {
            if sender.send(line).is_err() {
                break;
            }
        }
    });
    let text = format!("{header}\n{program}{END_OF_PROGRAM}");
    let mut counts = Counts::default();
    loop {
        let line = lines.recv_timeout(PATIENCE).map_err(|e| match e {
            RecvTimeoutError::Timeout => EmulateError::NoAnswer(PATIENCE),
            RecvTimeoutError::Disconnected => EmulateError::Exited {
                stderr: "before the last count".to_owned(),
            },
        })?;
        let line = String::from_utf8_lossy(&line);
        if line.starts_with("ready") {
            if let Some(mut input) = input.take() {
                let text = text.clone();
                // Fails only when the child has ended, and then there is an error already.
                thread::spawn(move || input.write_all(text.as_bytes()));
            }
        } else if line.starts_with("end") {
            break;
        } else {
            counts.take(&line);
        }
    }
    let faults = counts.get("memory")?;
    if faults != 0 {
        return Err(BenchError::Memory(faults));
    }
    match counts.get("errors")? {
        0 => Ok(counts),
        errors => Err(BenchError::Refused {
            errors,
            first_line: program.lines().next().unwrap_or_default().to_owned(),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_read_by_name_and_a_missing_one_is_an_error() {
        let mut counts = Counts::default();
        for line in ["tick.n 4", "tick.sum 10\r", "tick.max 7", "noise", "a b c"] {
            counts.take(line);
        }
        let stat = counts.stat("tick").unwrap();
        assert_eq!((stat.n, stat.sum, stat.max), (4, 10, 7));
        assert_eq!(stat.mean(), 2.5);
        assert!(counts.stat("other").is_err());
        assert_eq!(Stat::default().mean(), 0.0);
    }
}
