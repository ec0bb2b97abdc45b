//! Numbers of a read block to values in machine units, with their range checks: one function per word
//! or group of words. Comes in a [`Block`], goes out a value or a [`Fault`] at the word's place.

use super::block::Block;
use super::error::Fault;
use super::frames::COORDINATE_MAX;
use super::number::Decimal;
use crate::catalogue::nc as message;
use crate::units::Nano;

/// Largest `F`, per minute.
const FEED_MAX: f32 = 1.0e6;
/// Largest `S`, rpm.
const SPEED_MAX: f32 = 1.0e6;
/// Longest dwell, milliseconds.
const DWELL_MAX_MS: i64 = 100_000_000;
/// Millimetres per inch.
const INCH: f32 = 25.4;
/// The same, times ten.
const INCH_TENTHS: u8 = 254;

/// Error if the line has a word with `letter`.
#[inline]
pub(super) fn refuse(block: &Block, letter: u8) -> Result<(), Fault> {
    if block.has(letter) {
        return Err(Fault::new(
            block.place(letter),
            1,
            &message::UNEXPECTED_WORD,
        ));
    }
    Ok(())
}

/// Programmed value in 1e-6 mm or degree, `None` out of range.
#[inline]
pub(super) fn coordinate(value: Decimal, inch: bool) -> Option<Nano> {
    let nano = if inch {
        value.scaled(INCH_TENTHS, 5)
    } else {
        value.scaled(1, 6)
    };
    nano.filter(|nano| nano.unsigned_abs() <= COORDINATE_MAX.unsigned_abs())
}

/// `ADIS`, `ADISPOS`: modal distances in mm; inch counts.
#[inline]
pub(super) fn settle_distances(block: &mut Block) {
    let factor = if block.modal.inch { INCH } else { 1.0 };
    if let Some(distance) = block.adis {
        block.modal.distance = distance * factor;
    }
    if let Some(distance) = block.adispos {
        block.modal.rapid_distance = distance * factor;
    }
}

/// `F` as feed: units per minute to units per second.
#[inline]
pub(super) fn settle_feed(block: &mut Block) -> Result<(), Fault> {
    if !block.has(b'F') {
        return Ok(());
    }
    let programmed = block.f.to_f32();
    if programmed <= 0.0 {
        return Err(Fault::new(
            block.place(b'F'),
            0,
            &message::FEED_NOT_POSITIVE,
        ));
    }
    // NaN and infinity cannot be printed, but a large exponent gives infinity
    if programmed > FEED_MAX {
        return Err(Fault::new(block.place(b'F'), 1, &message::OUT_OF_RANGE));
    }
    let per_second = programmed / 60.0;
    block.modal.feed_rotary = per_second;
    block.modal.feed_linear = if block.modal.inch {
        per_second * INCH
    } else {
        per_second
    };
    Ok(())
}

#[inline]
pub(super) fn settle_speed(block: &mut Block) -> Result<(), Fault> {
    if block.has(b'S') {
        let speed = block.s.to_f32();
        if !(0.0..=SPEED_MAX).contains(&speed) {
            return Err(Fault::new(block.place(b'S'), 1, &message::OUT_OF_RANGE));
        }
        block.modal.speed = speed;
    }
    Ok(())
}

/// Milliseconds of a `G4` line, whose `G4` stands at byte index `at`: `F` or `P` seconds, or `S` revolutions at the
/// speed in force.
#[cold]
pub(super) fn dwell_time(block: &Block, at: usize) -> Result<u32, Fault> {
    for &letter in b"XYZABCUVW" {
        if block.has(letter) {
            return Err(Fault::new(
                block.place(letter),
                0,
                &message::DWELL_NOT_ALONE,
            ));
        }
    }
    let times = b"FPS".map(|letter| block.has(letter));
    let (letter, milliseconds) = match times {
        [true, false, false] => (b'F', block.f.scaled(1, 3)),
        [false, true, false] => (b'P', block.p.scaled(1, 3)),
        [false, false, true] => (b'S', Some(revolutions(block)?)),
        [false, false, false] => return Err(Fault::new(at, 0, &message::MISSING_DWELL_TIME)),
        [_, true, _] => return refuse(block, b'P').map(|()| 0),
        _ => return refuse(block, b'S').map(|()| 0),
    };
    milliseconds
        .filter(|ms| (0..=DWELL_MAX_MS).contains(ms))
        .and_then(|ms| u32::try_from(ms).ok())
        .ok_or_else(|| Fault::new(block.place(letter), 1, &message::OUT_OF_RANGE))
}

/// Milliseconds of `S` revolutions, -1 if the number makes no sense.
fn revolutions(block: &Block) -> Result<i64, Fault> {
    let speed = block.modal.speed;
    if speed <= 0.0 {
        return Err(Fault::new(block.place(b'S'), 0, &message::MISSING_SPEED));
    }
    let milliseconds = block.s.to_f32() / speed * 60_000.0;
    Ok(if (0.0..=DWELL_MAX_MS as f32).contains(&milliseconds) {
        libm::roundf(milliseconds) as i64
    } else {
        -1
    })
}

/// `I` of a `G6` block. The coefficients count in thousandths of a millimetre along an absolute path, so
/// neither inch nor incremental dimensions make sense.
pub(super) fn cubic_length(block: &Block) -> Result<Nano, Fault> {
    if !block.has(b'I') {
        return Err(Fault::new(block.first_axis, 0, &message::MISSING_LENGTH));
    }
    if block.modal.inch || !block.modal.absolute || block.incremental != 0 {
        return Err(Fault::new(block.first_axis, 0, &message::CUBIC_DIMENSION));
    }
    coordinate(block.ijk[0], false)
        .filter(|length| *length > 0)
        .ok_or_else(|| Fault::new(block.place(b'I'), 1, &message::OUT_OF_RANGE))
}

/// Checks that the K words of the line are whole triples and not more than the axes of its block.
pub(super) fn triples_up_to(block: &Block, axes: usize) -> Result<(), Fault> {
    if block.k_count > 3 * axes {
        return refuse(block, b'K');
    }
    if !block.k_count.is_multiple_of(3) {
        return Err(Fault::new(
            block.place(b'K'),
            0,
            &message::COEFFICIENT_TRIPLE,
        ));
    }
    Ok(())
}
