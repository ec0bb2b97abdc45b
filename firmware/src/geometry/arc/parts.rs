//! Long straight lines in equal parts: the polynomials of all of them are the same but for their place.

use crate::interpolator::segment::ServoSegment;
use crate::units::{Steps, AXES, PHASE_FRAC};

use super::fit::{line, Format};
use super::piece::Piece;
use super::{Driven, PathShape};

/// What is left of a line.
pub struct Parts {
    /// Parts left, the one at hand among them.
    left: u32,
    /// The part at hand.
    driven: Driven,
    /// From part to part, Q32.32 steps.
    step: [i64; AXES],
    /// End of the line.
    end: [i64; AXES],
}

impl Parts {
    /// `parts` (2 or more) parts of a straight `piece`, each `length` (Q10.54) long.
    #[inline(never)]
    pub fn new(
        format: &Format,
        piece: &Piece,
        parts: u32,
        length: i64,
        shape: PathShape,
        block: u32,
    ) -> Self {
        let step =
            core::array::from_fn(|a| (piece.end[a] - piece.start[a]) / i64::from(parts.max(1)));
        let end: [i64; AXES] = core::array::from_fn(|a| piece.start[a] + step[a]);
        let segment = line(format, &piece.start, &end, length, block);
        Self {
            left: parts,
            driven: driven(segment, shape, end),
            step,
            end: piece.end,
        }
    }

    /// The part at hand; `true` if there are more behind it, the next of which is now at hand.
    pub fn next(&mut self, format: &Format) -> (Driven, bool) {
        let now = self.driven;
        self.left = self.left.saturating_sub(1);
        let start = now.end.map(Steps::to_bits);
        if self.left == 1 {
            // What division left over is in the last part.
            let ServoSegment { length, block, .. } = now.segment;
            let segment = line(format, &start, &self.end, length, block);
            self.driven = driven(segment, now.shape, self.end);
        } else {
            for a in 0..AXES {
                let base = &mut self.driven.segment.axes[a].base;
                *base = base.wrapping_add(self.step[a] << (PHASE_FRAC - 32));
            }
            let end =
                core::array::from_fn(|a| Steps::from_bits(start[a].wrapping_add(self.step[a])));
            self.driven.end = end;
        }
        (now, self.left > 0)
    }
}

fn driven(segment: ServoSegment, shape: PathShape, end: [i64; AXES]) -> Driven {
    Driven {
        segment,
        shape,
        end: end.map(Steps::from_bits),
    }
}
