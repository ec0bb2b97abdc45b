//! What the planner must know of a segment's curve: derivatives along the path at its ends, and their bounds.
//!
//! In: the quintics of all axes, in floats. Out: [`PathShape`], and the error of the path feed that comes for free.

use crate::units::{larger, AxisVec, AXES};

/// Quintic of one axis about the middle of its segment: position = sum of `a[k - 1] x^k`, -1/2 <= x <= 1/2, axis units.
pub type Quintic = [f32; 5];

/// What rounding of `f32` may add to a derivative: share of the sum of the sizes of all its terms, 16 units in the last place.
const ROUNDING: f32 = 1.0 / 1_048_576.0;

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
    /// The derivatives over the segment as lines: their values at its middle. The slope of each line is the value of the next
    /// one, that of the third is `fourth`.
    pub middle: PathDerivatives,
    /// d4q/ds4.
    pub fourth: AxisVec,
    /// How far from these lines they may be, either way.
    pub off: PathDerivatives,
    /// Their largest sizes.
    pub most: PathDerivatives,
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
    /// Shape of a straight line with `first` = dq/ds.
    #[must_use]
    pub fn straight(first: AxisVec, rotary_only: bool, feed_scale: f32) -> Self {
        let along = PathDerivatives {
            first,
            ..PathDerivatives::default()
        };
        Self {
            middle: along,
            fourth: AxisVec::default(),
            off: PathDerivatives::default(),
            most: PathDerivatives {
                first: first.map(f32::abs),
                ..along
            },
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
            middle: PathDerivatives::default(),
            fourth: AxisVec::default(),
            off: PathDerivatives::default(),
            most: PathDerivatives::default(),
            start,
            end,
            rotary_only: false,
            feed_scale: 1.0,
        };
        for (a, curve) in curve.iter().enumerate() {
            let Lines {
                middle,
                off,
                third_ends,
            } = Lines::of(curve);
            let most = |k: usize| middle[k].abs() + 0.5 * middle[k + 1].abs() + off[k];
            let of = |shape: &mut PathDerivatives, value: [f32; 3]| {
                let [first, second, third] = value;
                shape.first[a] = first * scale[0];
                shape.second[a] = second * scale[1];
                shape.third[a] = third * scale[2];
            };
            let [first, second, third, fourth] = middle;
            of(&mut shape.middle, [first, second, third]);
            of(&mut shape.off, off);
            of(&mut shape.most, [most(0), most(1), most(2)]);
            shape.fourth[a] = fourth * (scale[2] * per);
            shape.start.third[a] = third_ends[0] * scale[2];
            shape.end.third[a] = third_ends[1] * scale[2];
        }
        (shape, feed_error(curve, per, counts))
    }

    /// True if an axis turns within the segment by so much that bounds for all of it are far from what most of it allows: over
    /// half of its largest q' between start and end.
    #[must_use]
    pub fn is_rough(&self) -> bool {
        (0..AXES).any(|a| {
            let turn = (self.end.first[a] - self.start.first[a]).abs();
            let most = self.most.first[a];
            turn > 0.5 * larger(most, 0.01) && most > 1.0
        })
    }
}

/// Derivatives of one axis over x as lines.
struct Lines {
    /// First to fourth derivative in the middle; each is the slope of the one before.
    middle: [f32; 4],
    /// How far from the lines the first three may be.
    off: [f32; 3],
    /// The third at both ends.
    third_ends: [f32; 2],
}

impl Lines {
    /// With y = 2 x, what is left of each derivative beside its line:
    ///
    ///   first   (3 a3 / 8) (2 y^2 - 1) + (a4 / 4) (2 y^3 - 3 y) + (5 a5 / 32) (2 y^4 - 1)
    ///   second  (3 a4 / 2) (2 y^2 - 1) + (5 a5 / 4) (2 y^3 - 3 y)
    ///   third   (15 a5 / 2) (2 y^2 - 1)
    ///
    /// For |y| <= 1 the even ones are 1 at most, and 2 y^3 - 3 y is sqrt(2), at y = sqrt(1/2).
    fn of(&[a1, a2, a3, a4, a5]: &Quintic) -> Self {
        const PEAK: f32 = core::f32::consts::SQRT_2;
        let [s1, s2, s3, s4, s5] = [a1, a2, a3, a4, a5].map(f32::abs);
        let rounded = |terms: f32| ROUNDING * terms;
        Self {
            middle: [
                a1 + 0.375 * a3 + 0.15625 * a5,
                2.0 * a2 + 1.5 * a4,
                6.0 * a3 + 7.5 * a5,
                24.0 * a4,
            ],
            off: [
                0.375 * s3
                    + (0.25 * PEAK) * s4
                    + 0.15625 * s5
                    + rounded(s1 + s2 + 0.75 * s3 + 0.5 * s4 + 0.3125 * s5),
                1.5 * s4 + (1.25 * PEAK) * s5 + rounded(2.0 * s2 + 3.0 * s3 + 3.0 * s4 + 2.5 * s5),
                7.5 * s5 + rounded(6.0 * s3 + 12.0 * s4 + 15.0 * s5),
            ],
            third_ends: [-1.0, 1.0].map(|y| 6.0 * a3 + y * (12.0 * a4) + 15.0 * a5),
        }
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

#[cfg(test)]
mod tests;
