//! The trace: one CSV row per servo tick, with nothing rounded away.
//!
//! Columns `tick,t_s,block,feed_mm_s` and one per axis, named as in the machine file. `tick` counts from 0,
//! `t_s` is `tick / servo_hz`, `block` the running number of the streamed text line (0 at rest), `feed_mm_s`
//! the path velocity after the tick. Positions are the commanded value after the tick in steps with ten
//! decimals, correctly rounded (ties to even) from the Q32.32 bits. The grid of ten decimals is finer than 2^-32, so the bits
//! can be had back from the text, and the steps emitted so far are the value rounded half up.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use pentaspline::machine::Sample;
use pentaspline::units::{Steps, Tick};

use crate::machine_file::Machine;

/// Writes a trace file.
#[derive(Debug)]
pub struct TraceWriter<W: Write> {
    out: W,
    servo_hz: u32,
    row: Vec<u8>,
}

impl TraceWriter<BufWriter<File>> {
    /// Creates `path` and writes the head line.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn create(path: &Path, machine: &Machine) -> io::Result<Self> {
        Self::new(
            BufWriter::with_capacity(1 << 16, File::create(path)?),
            machine,
        )
    }
}

impl<W: Write> TraceWriter<W> {
    /// Writes the head line to `out`.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn new(mut out: W, machine: &Machine) -> io::Result<Self> {
        write!(out, "tick,t_s,block,feed_mm_s")?;
        for axis in &machine.config.axes {
            write!(out, ",{}", char::from(axis.letter))?;
        }
        writeln!(out)?;
        Ok(Self {
            out,
            servo_hz: machine.config.servo_hz,
            row: Vec::with_capacity(256),
        })
    }

    /// Writes the row of one tick.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn tick(&mut self, tick: Tick, sample: &Sample) -> io::Result<()> {
        let row = &mut self.row;
        row.clear();
        push_u64(row, tick);
        row.push(b',');
        push_time(row, tick, self.servo_hz);
        row.push(b',');
        push_u64(row, u64::from(sample.block));
        write!(row, ",{:.6}", sample.feed)?;
        for position in sample.commanded {
            row.push(b',');
            push_steps(row, position);
        }
        row.push(b'\n');
        self.out.write_all(row)
    }

    /// Brings everything to the file and gives the writer back.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn finish(mut self) -> io::Result<W> {
        self.out.flush()?;
        Ok(self.out)
    }
}

/// `steps` with ten decimals, correctly rounded from its bits, ties to even.
#[must_use]
pub fn steps_text(steps: Steps) -> String {
    let mut out = Vec::with_capacity(24);
    push_steps(&mut out, steps);
    out.into_iter().map(char::from).collect()
}

fn push_steps(out: &mut Vec<u8>, steps: Steps) {
    const SCALE: u128 = 10_000_000_000;
    let bits = steps.to_bits();
    if bits < 0 {
        out.push(b'-');
    }
    let scaled = u128::from(bits.unsigned_abs()) * SCALE;
    let (floor, rest) = (scaled >> 32, scaled & 0xffff_ffff);
    let up = rest > 1 << 31 || (rest == 1 << 31 && floor & 1 == 1);
    let rounded = floor + u128::from(up);
    push_u64(out, (rounded / SCALE) as u64);
    out.push(b'.');
    push_padded(out, (rounded % SCALE) as u64, 10);
}

/// `tick / servo_hz` in seconds with nine decimals, rounded to nearest.
fn push_time(out: &mut Vec<u8>, tick: Tick, servo_hz: u32) {
    const SCALE: u128 = 1_000_000_000;
    let hz = u128::from(servo_hz.max(1));
    let nanos = (u128::from(tick) * SCALE + hz / 2) / hz;
    push_u64(out, (nanos / SCALE) as u64);
    out.push(b'.');
    push_padded(out, (nanos % SCALE) as u64, 9);
}

fn push_u64(out: &mut Vec<u8>, value: u64) {
    let digits = value.checked_ilog10().unwrap_or(0) as usize + 1;
    push_padded(out, value, digits);
}

/// The last `digits` decimal digits of `value`.
fn push_padded(out: &mut Vec<u8>, mut value: u64, digits: usize) {
    let start = out.len();
    out.resize(start + digits, b'0');
    for slot in out[start..].iter_mut().rev() {
        *slot = b'0' + (value % 10) as u8;
        value /= 10;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Digits of |bits| / 2^32 by long division, thirty-two of them: exact, since 2^-32 has 32 decimals.
    fn exact_decimals(bits: i64) -> (u64, Vec<u8>) {
        let magnitude = bits.unsigned_abs();
        let mut rest = magnitude & 0xffff_ffff;
        let digits = (0..32).map(|_| {
            rest *= 10;
            let digit = (rest >> 32) as u8;
            rest &= 0xffff_ffff;
            digit
        });
        (magnitude >> 32, digits.collect())
    }

    proptest! {
        #[test]
        fn the_text_is_the_nearest_ten_decimals_of_the_exact_value(bits in prop_oneof![any::<i64>(), -(1_i64 << 40)..1 << 40, (-(1_i64 << 40)..1 << 40).prop_map(|n| n << 21)]) {
            let text = steps_text(Steps::from_bits(bits));
            prop_assert_eq!(text.starts_with('-'), bits < 0);
            let (whole, decimals) = text.trim_start_matches('-').split_once('.').unwrap();
            prop_assert_eq!(decimals.len(), 10);
            // Both as integers of 1e-32: |shown - exact| <= half of 1e-10, and an even last digit on a tie.
            let (exact_whole, exact) = exact_decimals(bits);
            let value = |digits: &[u8]| digits.iter().fold(0_i128, |v, d| v * 10 + i128::from(*d));
            let shown_digits: Vec<u8> = decimals.bytes().map(|b| b - b'0').chain([0; 22]).collect();
            let carry = i128::from(whole.parse::<u64>().unwrap()) - i128::from(exact_whole);
            let error = carry * 10_i128.pow(32) + value(&shown_digits) - value(&exact);
            let half = 5 * 10_i128.pow(21);
            prop_assert!(error.abs() <= half);
            prop_assert!(error.abs() < half || shown_digits[9].is_multiple_of(2));
        }

        #[test]
        fn the_bits_come_back_from_the_text(bits in any::<i64>()) {
            let text = steps_text(Steps::from_bits(bits));
            let (whole, decimals) = text.trim_start_matches('-').split_once('.').unwrap();
            let scaled = whole.parse::<u128>().unwrap() * 10_u128.pow(10) + decimals.parse::<u128>().unwrap();
            let magnitude = ((scaled << 32) + 5 * 10_u128.pow(9)) / 10_u128.pow(10);
            let back = if bits < 0 { -(magnitude as i128) } else { magnitude as i128 };
            prop_assert_eq!(back, i128::from(bits));
        }
    }

    #[test]
    fn extreme_and_small_values_are_printed_in_full() {
        assert_eq!(steps_text(Steps::from_bits(0)), "0.0000000000");
        assert_eq!(steps_text(Steps::from_bits(-1)), "-0.0000000002");
        assert_eq!(
            steps_text(Steps::from_bits(i64::MIN)),
            "-2147483648.0000000000"
        );
        assert_eq!(
            steps_text(Steps::from_bits(i64::MAX)),
            "2147483647.9999999998"
        );
    }

    #[test]
    fn a_row_has_the_documented_columns() {
        let machine = Machine::built_in().unwrap();
        let mut trace = TraceWriter::new(Vec::new(), &machine).unwrap();
        let mut sample = Sample {
            feed: 25.5,
            block: 7,
            ..Sample::default()
        };
        sample.commanded[0] = Steps::from_num(-1.5);
        sample.commanded[4] = Steps::from_num(200_000);
        trace.tick(12_345, &sample).unwrap();
        let text = String::from_utf8(trace.finish().unwrap()).unwrap();
        let zero = "0.0000000000";
        let row = format!(
            "12345,2.469000000,7,25.500000,-1.5000000000,{zero},{zero},{zero},200000.0000000000\n"
        );
        assert_eq!(text, format!("tick,t_s,block,feed_mm_s,X,Y,Z,A,C\n{row}"));
    }
}
