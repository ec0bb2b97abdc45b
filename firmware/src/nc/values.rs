//! Numbers of a read block to values in machine units, with their range checks: one function per word
//! or group of words. Comes in a [`Block`], goes out a value or a [`Fault`] at the word's place.

use super::block::Block;
use super::command::{SplineKind, SplineSpec};
use super::error::{Fault, NcErrorKind};
use super::number::Decimal;
use crate::units::{Nano, NANO_PER_UNIT};

/// Largest programmed and machine coordinate: 100 m or 100 000 degrees. Sums of two stay far inside `i64`.
pub(super) const COORDINATE_MAX: Nano = 100_000 * NANO_PER_UNIT;
/// Largest `F`, per minute.
const FEED_MAX: f32 = 1.0e6;
/// Largest `S`, rpm.
const SPEED_MAX: f32 = 1.0e6;
/// Longest dwell, milliseconds.
const DWELL_MAX_MS: i64 = 100_000_000;
/// Millimetres per inch, times ten.
const INCH_TENTHS: u8 = 254;
/// Weight of a point without `PW`, 1e-4.
const WEIGHT_ONE: u16 = 10_000;
/// Degree of a B-spline without `SD`.
pub(super) const DEGREE: u8 = 3;

/// Error if the line has a word with `letter`.
#[inline]
pub(super) fn refuse(block: &Block, letter: u8) -> Result<(), Fault> {
    if block.has(letter) {
        return Err(Fault::new(
            block.place(letter),
            1,
            NcErrorKind::UnexpectedWord,
        ));
    }
    Ok(())
}

/// Error if the line has `PW` or `PL`.
#[inline]
pub(super) fn refuse_point_words(block: &Block) -> Result<(), Fault> {
    match (block.weight, block.interval) {
        (None, None) => Ok(()),
        (Some(weight), _) => Err(Fault::new(weight.at, 2, NcErrorKind::UnexpectedWord)),
        (None, Some(interval)) => Err(Fault::new(interval.at, 2, NcErrorKind::UnexpectedWord)),
    }
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

/// `F` as feed: units per minute to units per second.
#[inline]
pub(super) fn settle_feed(block: &mut Block) -> Result<(), Fault> {
    if !block.has(b'F') {
        return Ok(());
    }
    let programmed = block.f.to_f32();
    if programmed <= 0.0 {
        return Err(Fault::new(block.place(b'F'), 0, |_| {
            NcErrorKind::FeedNotPositive
        }));
    }
    // NaN and infinity cannot be printed, but a large exponent gives infinity
    if programmed > FEED_MAX {
        return Err(Fault::new(block.place(b'F'), 1, NcErrorKind::OutOfRange));
    }
    let per_second = programmed / 60.0;
    block.modal.feed_rotary = per_second;
    block.modal.feed_linear = if block.modal.inch {
        per_second * 25.4
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
            return Err(Fault::new(block.place(b'S'), 1, NcErrorKind::OutOfRange));
        }
        block.modal.speed = speed;
    }
    Ok(())
}

/// Milliseconds of a `G4` line, whose `G4` stands at byte index `at`.
#[cold]
pub(super) fn dwell_time(block: &Block, at: usize) -> Result<u32, Fault> {
    for &letter in b"XYZABCUVW" {
        if block.has(letter) {
            return Err(Fault::new(block.place(letter), 0, |_| {
                NcErrorKind::DwellNotAlone
            }));
        }
    }
    for letter in *b"IKS" {
        refuse(block, letter)?;
    }
    refuse_point_words(block)?;
    let (letter, seconds) = match (block.has(b'F'), block.has(b'P')) {
        (true, true) => return refuse(block, b'P').map(|()| 0),
        (true, false) => (b'F', block.f),
        (false, true) => (b'P', block.p),
        (false, false) => return Err(Fault::new(at, 0, |_| NcErrorKind::MissingDwellTime)),
    };
    let milliseconds = seconds
        .scaled(1, 3)
        .filter(|ms| (0..=DWELL_MAX_MS).contains(ms));
    milliseconds
        .and_then(|ms| u32::try_from(ms).ok())
        .ok_or_else(|| Fault::new(block.place(letter), 1, NcErrorKind::OutOfRange))
}

/// Spline state of a block with coordinates; notes the first weight of a B-spline.
#[inline]
pub(super) fn spline_spec(kind: SplineKind, block: &mut Block) -> Result<SplineSpec, Fault> {
    let first_axis = block.first_axis;
    let modal = &mut block.modal;
    let mut weight = WEIGHT_ONE;
    let mut interval = None;
    if kind == SplineKind::BSpline {
        weight = block.weight.map_or(WEIGHT_ONE, |weight| weight.value);
        interval = block.interval.map(|interval| interval.value);
        if modal.first_weight == 0 {
            modal.first_weight = weight;
        }
        if modal.first_weight != weight {
            let at = block.weight.map_or(first_axis, |weight| weight.at);
            return Err(Fault::new(at, 0, |_| NcErrorKind::UnequalWeights));
        }
    }
    Ok(SplineSpec {
        kind,
        begin: modal.begin,
        end: modal.end,
        degree: modal.degree,
        interval,
        weight: f32::from(weight) / 1.0e4,
        first: false,
        axes: u8::MAX,
        tool_point: None,
    })
}

/// `I` of a `G6` block. The coefficients count in thousandths of a millimetre along an absolute path, so
/// neither inch nor incremental dimensions make sense.
pub(super) fn cubic_length(block: &Block) -> Result<Nano, Fault> {
    if !block.has(b'I') {
        return Err(Fault::new(block.first_axis, 0, |_| {
            NcErrorKind::MissingLength
        }));
    }
    if block.modal.inch || !block.modal.absolute {
        return Err(Fault::new(block.first_axis, 0, |_| {
            NcErrorKind::CubicDimension
        }));
    }
    coordinate(block.i, false)
        .filter(|length| *length > 0)
        .ok_or_else(|| Fault::new(block.place(b'I'), 1, NcErrorKind::OutOfRange))
}

/// Checks that the K words of the line are whole triples and not more than the axes of its block.
pub(super) fn triples_up_to(block: &Block, axes: usize) -> Result<(), Fault> {
    if block.k_count > 3 * axes {
        return refuse(block, b'K');
    }
    if !block.k_count.is_multiple_of(3) {
        return Err(Fault::new(block.place(b'K'), 0, |_| {
            NcErrorKind::CoefficientTriple
        }));
    }
    Ok(())
}
