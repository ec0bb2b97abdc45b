//! The recorded form of a frame: what a trace stores, a digest hashes, and the emulated board sends.
//!
//! One record per tick in motion, little-endian: a mask byte (bit a set: axis a has steps), then for each
//! such axis `count | negative << 15` (u16), `first` (u32), `pitch` (u32).

use core::hash::Hasher;

use super::{AxisSteps, StepFrame};
use crate::units::AXES;

/// Longest record.
pub const RECORD_MAX: usize = 1 + 10 * AXES;

/// Writes the record of `frame` into `out`; returns its length.
pub fn encode(frame: &StepFrame, out: &mut [u8; RECORD_MAX]) -> usize {
    let mut len = 1;
    out[0] = 0;
    for (a, axis) in frame.axes.iter().enumerate() {
        if axis.count == 0 {
            continue;
        }
        out[0] |= 1 << a;
        let count = axis.count | u16::from(axis.negative) << 15;
        out[len..len + 2].copy_from_slice(&count.to_le_bytes());
        out[len + 2..len + 6].copy_from_slice(&axis.first.to_le_bytes());
        out[len + 6..len + 10].copy_from_slice(&axis.pitch.to_le_bytes());
        len += 10;
    }
    len
}

/// Reads one record from the front of `bytes`; returns the frame and the bytes it took, or `None` if
/// `bytes` ends inside the record or the mask names an axis that does not exist.
#[must_use]
pub fn decode(bytes: &[u8]) -> Option<(StepFrame, usize)> {
    let mask = *bytes.first()?;
    if u32::from(mask) >> AXES != 0 {
        return None;
    }
    let mut frame = StepFrame::default();
    let mut at = 1;
    for (a, axis) in frame.axes.iter_mut().enumerate() {
        if mask & 1 << a == 0 {
            continue;
        }
        let field = bytes.get(at..at + 10)?;
        let count = u16::from_le_bytes([field[0], field[1]]);
        *axis = AxisSteps {
            count: count & 0x7fff,
            negative: count & 0x8000 != 0,
            first: u32::from_le_bytes([field[2], field[3], field[4], field[5]]),
            pitch: u32::from_le_bytes([field[6], field[7], field[8], field[9]]),
        };
        at += 10;
    }
    Some((frame, at))
}

/// 64-bit FNV-1a over the records of all ticks in motion.
#[derive(Default)]
pub struct FrameDigest(fnv::FnvHasher);

impl FrameDigest {
    /// Takes the next frame in.
    pub fn update(&mut self, frame: &StepFrame) {
        let mut record = [0; RECORD_MAX];
        let len = encode(frame, &mut record);
        self.0.write(&record[..len]);
    }

    /// Digest so far.
    #[must_use]
    pub fn value(&self) -> u64 {
        self.0.finish()
    }
}
