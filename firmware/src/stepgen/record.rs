//! The recorded form of a frame: what a trace stores, a digest hashes, and the emulated board sends.
//!
//! One record per tick in motion, little-endian: a mask byte (bit a set: axis a has steps), then for each
//! such axis `count | negative << 15` (u16), `first` (u32), `pitch` (u32).

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
///
/// The records are not written for it, and a pitch of zero is taken in at once: the simulator takes one in for every tick.
#[derive(Clone, Copy, Debug)]
pub struct FrameDigest(u64);

/// Start and factor of 64-bit FNV-1a (RFC 9923).
const FNV_START: u64 = 0xcbf2_9ce4_8422_2325;
const FNV_FACTOR: u64 = 0x0100_0000_01b3;
/// What four zero bytes do.
const FOUR_ZEROS: u64 = FNV_FACTOR.wrapping_pow(4);

impl Default for FrameDigest {
    fn default() -> Self {
        Self(FNV_START)
    }
}

impl FrameDigest {
    /// Takes the next frame in. A call of its own, which has registers for all of it.
    #[inline(never)]
    pub fn update(&mut self, frame: &StepFrame) {
        let mask = |(a, axis): (usize, &AxisSteps)| u8::from(axis.count != 0) << a;
        self.take([frame.axes.iter().enumerate().map(mask).sum()]);
        for axis in frame.axes.iter().filter(|axis| axis.count != 0) {
            self.take((axis.count | u16::from(axis.negative) << 15).to_le_bytes());
            self.take(axis.first.to_le_bytes());
            if axis.pitch == 0 {
                self.0 = self.0.wrapping_mul(FOUR_ZEROS);
            } else {
                self.take(axis.pitch.to_le_bytes());
            }
        }
    }

    #[inline(always)]
    fn take<const BYTES: usize>(&mut self, bytes: [u8; BYTES]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(FNV_FACTOR);
        }
    }

    /// Digest so far.
    #[must_use]
    pub fn value(&self) -> u64 {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::hash::Hasher;
    use proptest::prelude::*;

    prop_compose! {
        /// Small numbers and zero as often as large ones: their upper bytes are zero.
        fn axis()(
            count in prop_oneof![Just(0_u16), 1..300_u16, 1..0x8000_u16],
            negative in any::<bool>(),
            first in prop_oneof![Just(0), 0..1_u32 << 16, any::<u32>()],
            pitch in prop_oneof![Just(0), 0..1_u32 << 16, any::<u32>()],
        ) -> AxisSteps {
            AxisSteps { count, negative, first, pitch }
        }
    }

    proptest! {
        #[test]
        fn the_digest_is_fnv_1a_over_the_records(
            frames in prop::collection::vec(prop::array::uniform(axis()), 0..20),
        ) {
            let mut digest = FrameDigest::default();
            let mut hasher = fnv::FnvHasher::default();
            for axes in frames {
                let frame = StepFrame { axes };
                digest.update(&frame);
                let mut record = [0; RECORD_MAX];
                let len = encode(&frame, &mut record);
                hasher.write(&record[..len]);
            }
            prop_assert_eq!(digest.value(), hasher.finish());
        }
    }
}
