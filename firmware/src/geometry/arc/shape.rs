//! What the planner must know of a segment's curve: derivatives along the path at its ends, and their bounds.
//!
//! In: the quintics of all axes, in floats. Out: [`PathShape`], and the error of the path feed that comes for free.

use crate::units::{larger, AxisVec, AXES};

pub use super::range::Quintic;
use super::range::Ranges;

/// Derivatives of the axis positions with respect to path length at one point, axis units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PathDerivatives {
    /// dq/ds.
    pub first: AxisVec,
    /// d2q/ds2.
    pub second: AxisVec,
    /// d3q/ds3.
    pub third: AxisVec,
}

/// What the planner must know of a segment's curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathShape {
    /// Least derivatives over the segment.
    pub low: PathDerivatives,
    /// Largest derivatives over the segment.
    pub high: PathDerivatives,
    /// At s = 0.
    pub start: PathDerivatives,
    /// At s = L.
    pub end: PathDerivatives,
    /// True if s counts degrees: no linear axis moves, or so little that rotary motion is what takes the time.
    pub rotary_only: bool,
    /// Path units per unit of what the feed refers to: 1, but where s counts degrees although linear axes move.
    pub feed_scale: f32,
}

/// Points inside a segment at which the path feed is taken, and their distance over x.
const SAMPLES: usize = 7;
const APART: f32 = 1.0 / (SAMPLES + 1) as f32;

impl PathShape {
    /// Largest size of the third derivatives over this segment and `other`.
    #[must_use]
    pub fn steepest_third(&self, other: &Self) -> AxisVec {
        let most = |shape: &Self, i: usize| shape.high.third[i].max(-shape.low.third[i]);
        core::array::from_fn(|i| most(self, i).max(most(other, i)))
    }

    /// Shape of a straight line with `first` = dq/ds.
    #[must_use]
    pub fn straight(first: AxisVec, rotary_only: bool, feed_scale: f32) -> Self {
        let along = PathDerivatives {
            first,
            ..PathDerivatives::default()
        };
        Self {
            low: along,
            high: along,
            start: along,
            end: along,
            rotary_only,
            feed_scale,
        }
    }

    /// Shape of `curve` over `length` path units, and the largest relative error of the path feed between the ends: the
    /// axes that `count` should cover `length` at a constant rate.
    ///
    /// `ends` are dq/ds and d2q/ds2 at both ends as neighbouring segments have them, too.
    #[must_use]
    pub fn of(
        curve: &[Quintic; AXES],
        length: f32,
        counts: &[bool; AXES],
        ends: &[[AxisVec; 2]; 2],
    ) -> (Self, f32) {
        let per = 1.0 / length;
        let scale = [per, per * per, per * per * per];
        let [start, end] = ends.map(|[first, second]| PathDerivatives {
            first,
            second,
            third: AxisVec::default(),
        });
        let mut shape = Self {
            low: PathDerivatives::default(),
            high: PathDerivatives::default(),
            start,
            end,
            rotary_only: false,
            feed_scale: 1.0,
        };
        for a in 0..AXES {
            let Ranges { of, third } = Ranges::of(&curve[a]);
            shape.low.first[a] = of[0].low * scale[0];
            shape.high.first[a] = of[0].high * scale[0];
            shape.low.second[a] = of[1].low * scale[1];
            shape.high.second[a] = of[1].high * scale[1];
            shape.low.third[a] = of[2].low * scale[2];
            shape.high.third[a] = of[2].high * scale[2];
            shape.start.third[a] = third[0] * scale[2];
            shape.end.third[a] = third[1] * scale[2];
        }
        (shape, feed_error(curve, per, counts))
    }

    /// True if an axis turns within the segment by so much that bounds for all of it are far from what most of it allows: over
    /// half of its largest q' between start and end.
    #[must_use]
    pub fn is_rough(&self) -> bool {
        (0..AXES).any(|a| {
            let turn = (self.end.first[a] - self.start.first[a]).abs();
            let most = larger(self.high.first[a], -self.low.first[a]);
            turn > 0.5 * larger(most, 0.01) && most > 1.0
        })
    }
}

/// Largest relative error of the path feed at [`SAMPLES`] points inside the segment, `per` being 1 over its length.
fn feed_error(curve: &[Quintic; AXES], per: f32, counts: &[bool; AXES]) -> f32 {
    let mut squares = [0.0_f32; SAMPLES];
    for (&[a1, a2, a3, a4, a5], _) in curve.iter().zip(counts).filter(|(_, counts)| **counts) {
        let (b3, b4, b5) = (3.0 * a3, 4.0 * a4, 5.0 * a5);
        for (i, square) in (1..).zip(&mut squares) {
            let x = i as f32 * APART - 0.5;
            let d = a1 + x * (2.0 * a2 + x * (b3 + x * (b4 + x * b5)));
            *square += d * d;
        }
    }
    let mut error = 0.0_f32;
    for square in squares {
        // (1 + e)^2 = 1 + 2 e but for e^2.
        error = error.max((0.5 * (square * (per * per) - 1.0)).abs());
    }
    error
}
