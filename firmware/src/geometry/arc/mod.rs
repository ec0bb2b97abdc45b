//! Constant speed on any parametrisation: a cubic becomes segments that are polynomials over their arc length.
//!
//! In: [`HermiteSegment`]. Out: [`ServoSegment`]s in fixed point, each with the [`PathShape`] the planner
//! takes its limits from. The curve is halved until, everywhere, the tool-path feed is within [`FEED_TOLERANCE`] of the
//! commanded one and the position within [`PATH_TOLERANCE`] of the curve.
//!
//! A curve that never leaves a straight line is driven as the line it is; where it turns back on itself, the path
//! has a corner of 180 degrees there, and the machine stops at it.

mod fit;
mod parts;
mod piece;
mod shape;

use crate::config::Config;
use crate::interpolator::segment::{fine_bits, fine_scale};
use crate::units::{Position, Steps, AXES};

use super::HermiteSegment;
use fit::{build, Built, Format};
use parts::Parts;
use piece::{Piece, Units};

pub use crate::interpolator::segment::ServoSegment;
pub use crate::interpolator::S_FRAC;
pub use shape::{PathDerivatives, PathShape};

/// Largest relative error of the path feed inside a segment (1e-5 is 0.001 %).
pub const FEED_TOLERANCE: f32 = 1.0e-5;

/// Largest distance of a segment from the programmed cubic, mm or degree.
pub const PATH_TOLERANCE: f32 = 1.0e-5;

/// Degrees per millimetre from which on the path is measured in degrees.
pub(super) const ROTARY_RATIO: f32 = 30.0;

/// Longest segment in path units; longer ones are halved.
const LENGTH_MAX: f32 = 250.0;

/// Halvings of one programmed segment before it is refused. Enough to reach [`TINY`] from 250 mm.
const DEPTH_MAX: usize = 26;

/// A piece of curve that fits into this, mm or degree, is driven as its chord; the path is off by no more. What is left of
/// a cusp at this size becomes a corner, and the machine stops at it as at any other.
const TINY: f32 = 2.0e-5;

/// Why a curve cannot be made constant-speed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArcError {
    /// The curve has a cusp or turns back on itself: its speed vanishes inside.
    Cusp,
    /// A coordinate difference exceeds [`CURVE_MAX`](crate::envelope::CURVE_MAX), or a point
    /// [`POSITION_MAX`](crate::envelope::POSITION_MAX).
    Range,
}

impl core::fmt::Display for ArcError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Cusp => "curve has a cusp: path speed vanishes",
            Self::Range => "curve exceeds the coordinate range",
        })
    }
}

impl core::error::Error for ArcError {}

/// One segment, what the planner must know of it, and where it ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Driven {
    /// For the interrupt.
    pub segment: ServoSegment,
    /// For the planner.
    pub shape: PathShape,
    /// End of the segment; exact.
    pub end: Position,
}

/// Pulls [`ServoSegment`]s out of one [`HermiteSegment`], front to back.
pub struct ArcSplitter {
    /// Pieces still to be looked at, how often they were halved, and whether they are straight.
    stack: heapless::Vec<(Piece, u8, bool), { DEPTH_MAX + 2 }>,
    parts: Option<Parts>,
    units: Units,
    format: Format,
    block: u32,
}

impl Default for ArcSplitter {
    fn default() -> Self {
        Self::new()
    }
}

impl ArcSplitter {
    /// Empty splitter.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            stack: heapless::Vec::new(),
            parts: None,
            units: Units::ZERO,
            format: Format {
                bits: [0; AXES],
                scale: [0; AXES],
            },
            block: 0,
        }
    }

    /// Forgets what is left.
    pub fn clear(&mut self) {
        self.stack.clear();
        self.parts = None;
    }

    /// True when everything has been pulled.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.stack.is_empty() && self.parts.is_none()
    }

    /// Takes the next curve. The previous one must have been pulled empty.
    ///
    /// # Errors
    /// [`ArcError::Range`] if a coordinate difference or slope exceeds [`CURVE_MAX`](crate::envelope::CURVE_MAX) steps or
    /// axis units or is not finite, or a point of the hull [`POSITION_MAX`](crate::envelope::POSITION_MAX).
    pub fn push(
        &mut self,
        config: &Config,
        segment: &HermiteSegment,
        block: u32,
    ) -> Result<(), ArcError> {
        self.units = Units::new(config);
        self.format = Format {
            bits: core::array::from_fn(|a| fine_bits(config, a)),
            scale: fine_scale(config),
        };
        let piece = Piece::new(&self.units, segment)?;
        self.block = block;
        self.clear();
        // None of these can fail: the stack was just emptied.
        if let Some(lines) = piece.straight_pieces(&self.units) {
            for line in lines.iter().rev() {
                let _ = self.stack.push((*line, 0, true));
            }
        } else {
            let _ = self.stack.push((piece, 0, false));
        }
        Ok(())
    }

    /// Next segment, or `None` when the curve is used up.
    ///
    /// # Errors
    /// [`ArcError::Cusp`] if the feed tolerance cannot be met; the rest of the curve is dropped.
    #[inline(never)]
    pub fn next(&mut self, _: &Config) -> Result<Option<Driven>, ArcError> {
        if let Some(driven) = self.next_part() {
            return Ok(Some(driven));
        }
        while let Some((piece, depth, line)) = self.stack.pop() {
            match build(&self.units, &self.format, &piece, line, self.block) {
                Built::Done(segment, shape) => {
                    return Ok(Some(Driven {
                        segment,
                        shape,
                        end: piece.end.map(Steps::from_bits),
                    }))
                }
                Built::Nothing => continue,
                Built::Line(parts, length, shape) => {
                    self.parts = Some(Parts::new(
                        &self.format,
                        &piece,
                        parts,
                        length,
                        shape,
                        self.block,
                    ));
                    return Ok(self.next_part());
                }
                Built::Halve => {}
            }
            let [first, second] = piece.halves(&self.units);
            if usize::from(depth) >= DEPTH_MAX
                || self.stack.push((second, depth + 1, line)).is_err()
                || self.stack.push((first, depth + 1, line)).is_err()
            {
                self.stack.clear();
                return Err(ArcError::Cusp);
            }
        }
        Ok(None)
    }

    /// The next part of a long line.
    fn next_part(&mut self) -> Option<Driven> {
        let (driven, more) = self.parts.as_mut()?.next(&self.format);
        if !more {
            self.parts = None;
        }
        Some(driven)
    }
}

#[cfg(test)]
mod tests;
