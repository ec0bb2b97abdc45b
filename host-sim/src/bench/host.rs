//! What is measured on this PC: speed of the simulator, and where edges stand in a frame.

use std::io;
use std::time::Instant;

use pentaspline::machine::Sample;
use pentaspline::stepgen::{StepFrame, SLOTS};
use pentaspline::units::{Tick, AXES};

use super::BenchError;
use crate::machine_file::Machine;
use crate::program::Program;
use crate::runner::{self, End, Observer, Options};

/// Longest run, ticks: beyond any program measured here.
const MAX_TICKS: Tick = 100_000_000;
/// Runs of which the fastest counts: whatever else the PC does only makes a run longer.
const RUNS: u32 = 3;

/// Speed of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Speed {
    /// Simulated over wall-clock time.
    pub realtime_factor: f64,
    /// Lines per wall-clock second.
    pub lines_per_s: f64,
}

/// Runs `text` tick by tick, without plant or recording, on one core.
///
/// # Errors
/// [`BenchError::Refused`] if the program does not run to its end.
pub fn speed(machine: &Machine, text: &str) -> Result<Speed, BenchError> {
    let mut best = f64::INFINITY;
    let mut ticks = 0;
    for _ in 0..RUNS {
        let start = Instant::now();
        ticks = run(machine, text, &mut ())?;
        best = best.min(start.elapsed().as_secs_f64());
    }
    Ok(Speed {
        realtime_factor: ticks as f64 / f64::from(machine.config.servo_hz) / best,
        lines_per_s: text.lines().count() as f64 / best,
    })
}

fn run(machine: &Machine, text: &str, observer: &mut impl Observer) -> Result<Tick, BenchError> {
    let refused = || BenchError::Refused {
        errors: 1,
        first_line: text.lines().next().unwrap_or_default().to_owned(),
    };
    let program = Program::from_text("bench", text).map_err(|_| refused())?;
    let options = Options {
        auto_start: true,
        events: Vec::new(),
        max_ticks: MAX_TICKS,
    };
    let outcome = runner::run(&program, machine, &options, observer)?;
    match outcome.end {
        End::Finished => Ok(outcome.ticks),
        _ => Err(refused()),
    }
}

/// Largest distance of a step edge from its exact place, in slots.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Jitter {
    /// In ticks that keep the direction.
    pub steady: f64,
    /// In ticks that change it: edges make room for the set-up time of the direction pin.
    pub turning: f64,
    /// Edges looked at.
    pub edges: u64,
    last: Option<[i64; AXES]>,
    negative: [bool; AXES],
}

impl Jitter {
    /// Compares a frame with the motion from the position before to `now` (Q32.32 steps), linear within the tick:
    /// an edge belongs where that line crosses the border between two whole steps, which is half way.
    pub fn take(&mut self, now: &[i64; AXES], frame: &StepFrame) {
        const HALF: i128 = 1 << 31;
        let Some(last) = self.last.replace(*now) else {
            return;
        };
        for a in 0..AXES {
            let axis = frame.axes[a];
            if axis.count == 0 {
                continue;
            }
            let (from, to) = (i128::from(last[a]) + HALF, i128::from(now[a]) + HALF);
            let worst = if axis.negative == self.negative[a] {
                &mut self.steady
            } else {
                &mut self.turning
            };
            self.negative[a] = axis.negative;
            for (k, slot) in (0..).zip(axis.slots()) {
                let whole = from >> 32;
                let border = if axis.negative {
                    whole - k
                } else {
                    whole + 1 + k
                };
                let way = (border << 32) - from;
                let exact = way as f64 / (to - from) as f64 * f64::from(SLOTS);
                *worst = worst.max((f64::from(slot) - exact).abs());
                self.edges += 1;
            }
        }
    }
}

impl Observer for Jitter {
    fn tick(&mut self, _: Tick, sample: &Sample, frame: &StepFrame) -> io::Result<()> {
        self.take(&sample.commanded.map(|steps| steps.to_bits()), frame);
        Ok(())
    }
}

/// Runs `text` and looks at every edge.
///
/// # Errors
/// As [`speed`].
pub fn jitter(machine: &Machine, text: &str) -> Result<Jitter, BenchError> {
    let mut jitter = Jitter::default();
    run(machine, text, &mut jitter)?;
    Ok(jitter)
}

#[cfg(test)]
mod tests {
    use super::*;
    use pentaspline::stepgen::AxisSteps;

    #[test]
    fn an_edge_that_stands_off_is_measured_in_slots() {
        let mut jitter = Jitter::default();
        let mut frame = StepFrame::default();
        jitter.take(&[0; AXES], &frame);
        // One step in the tick: half way up it passes from 0 to 1, in the middle of 560 slots.
        frame.axes[1] = AxisSteps {
            count: 1,
            negative: false,
            first: 283 << 16,
            pitch: 0,
        };
        jitter.take(&[0, 1 << 32, 0, 0, 0], &frame);
        assert_eq!((jitter.steady, jitter.turning, jitter.edges), (3.0, 0.0, 1));
        // And down again in the first slot.
        frame.axes[1].negative = true;
        frame.axes[1].first = 0;
        jitter.take(&[0; AXES], &frame);
        assert_eq!(
            (jitter.steady, jitter.turning, jitter.edges),
            (3.0, 280.0, 2)
        );
    }
}
