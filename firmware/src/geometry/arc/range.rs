//! Between which bounds the first three derivatives of a quintic stay over its segment.
//!
//! In: a [`Quintic`]. Out: [`Ranges`], safe and nearly tight, without samples between which a peak could hide. The third
//! derivative is a parabola, its peak is known in closed form. The second peaks where the third vanishes. Between those
//! places the second is monotone and vanishes once at most; there the first peaks, and since it is convex or concave on
//! both sides of that place, it stays on one side of its tangents (S. Boyd, L. Vandenberghe, "Convex Optimization", 3.1.3).

use crate::units::sqrt;

/// Quintic of one axis about the middle of its segment: position = sum of `a[k - 1] x^k`, -1/2 <= x <= 1/2, axis units.
pub type Quintic = [f32; 5];

/// The ends of the segment.
const ENDS: [f32; 2] = [-0.5, 0.5];

/// What rounding of `f32` may take from a bound: share of the sum of the sizes of all terms, 16 units in the last place.
const ROUNDING: f32 = 1.0 / 1_048_576.0;

/// Most steps towards a peak of the first derivative, and the share of its size at which no more are taken. One or two are
/// usual.
const STEPS: usize = 8;
const TIGHT: f32 = 1.0 / 4096.0;

/// Least and largest value.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Range {
    /// No value is below.
    pub low: f32,
    /// No value is above.
    pub high: f32,
}

impl Range {
    fn of([x, y]: [f32; 2]) -> Self {
        let (low, high) = if x < y { (x, y) } else { (y, x) };
        Self { low, high }
    }

    fn take(&mut self, x: f32) {
        if x < self.low {
            self.low = x;
        }
        if x > self.high {
            self.high = x;
        }
    }

    /// Wider by what rounding may take of a sum of `terms`.
    fn rounded(self, terms: f32) -> Self {
        let more = ROUNDING * terms;
        Self {
            low: self.low - more,
            high: self.high + more,
        }
    }
}

/// Derivatives of one axis over x: ranges, first to third, and the third at both ends.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ranges {
    /// Of the first, second and third derivative.
    pub of: [Range; 3],
    /// The third derivative at x = -1/2 and 1/2.
    pub third: [f32; 2],
}

/// Coefficients of the three derivatives.
struct Derivatives {
    first: [f32; 5],
    second: [f32; 4],
    third: [f32; 3],
}

impl Derivatives {
    fn first(&self, x: f32) -> f32 {
        let [c0, c1, c2, c3, c4] = self.first;
        c0 + x * (c1 + x * (c2 + x * (c3 + x * c4)))
    }

    fn second(&self, x: f32) -> f32 {
        let [c0, c1, c2, c3] = self.second;
        c0 + x * (c1 + x * (c2 + x * c3))
    }

    fn third(&self, x: f32) -> f32 {
        let [c0, c1, c2] = self.third;
        c0 + x * (c1 + x * c2)
    }

    /// Zeros of the third derivative inside the segment, in order; what is missing lies on its end.
    fn bends(&self) -> [f32; 2] {
        let [c0, c1, c2] = self.third;
        let square = c1 * c1 - 4.0 * c2 * c0;
        if !(square > 0.0) {
            return [ENDS[1]; 2];
        }
        let q = -0.5 * (c1 + sqrt(square).copysign(c1));
        // Also puts NaN and infinity on the end.
        let inside = |x: f32| {
            if x > ENDS[0] && x < ENDS[1] {
                x
            } else {
                ENDS[1]
            }
        };
        let (x, y) = (inside(q / c2), inside(c0 / q));
        if x < y {
            [x, y]
        } else {
            [y, x]
        }
    }

    /// The peak of the first derivative between two places, if there is one: no value is beyond, and one is within [`TIGHT`].
    /// The second derivative is monotone there and has the values `bend` at both.
    fn peak(&self, mut at: [f32; 2], mut bend: [f32; 2], size: f32) -> Option<f32> {
        if !(bend[0] * bend[1] < 0.0) {
            return None;
        }
        let mut value = at.map(|x| self.first(x));
        let mut x = at[0] + (at[1] - at[0]) * (bend[0] / (bend[0] - bend[1]));
        let mut left = STEPS;
        loop {
            // Where the tangents meet.
            let rise = value[1] - value[0] - bend[1] * (at[1] - at[0]);
            let peak = value[0] + bend[0] * (rise / (bend[0] - bend[1]));
            let beyond = if bend[0] > 0.0 {
                peak - larger(value[0], value[1])
            } else {
                -larger(-value[0], -value[1]) - peak
            };
            if beyond <= TIGHT * size || left == 0 {
                return Some(peak);
            }
            left -= 1;
            let there = self.second(x);
            let side = usize::from((there < 0.0) != (bend[0] < 0.0));
            (at[side], bend[side], value[side]) = (x, there, self.first(x));
            if there == 0.0 {
                return Some(value[side]);
            }
            // Newton's step, or half of the way where that leads out.
            x -= there / self.third(x);
            if !(x > at[0] && x < at[1]) {
                x = 0.5 * (at[0] + at[1]);
            }
        }
    }
}

fn larger(x: f32, y: f32) -> f32 {
    if x < y {
        y
    } else {
        x
    }
}

impl Ranges {
    /// Ranges of the derivatives of `curve` over x.
    #[must_use]
    pub fn of(curve: &Quintic) -> Self {
        let &[a1, a2, a3, a4, a5] = curve;
        let d = Derivatives {
            first: [a1, 2.0 * a2, 3.0 * a3, 4.0 * a4, 5.0 * a5],
            second: [2.0 * a2, 6.0 * a3, 12.0 * a4, 20.0 * a5],
            third: [6.0 * a3, 24.0 * a4, 60.0 * a5],
        };
        if [a2, a3, a4, a5] == [0.0; 4] {
            let mut straight = Self::default();
            straight.of[0] = Range::of([a1; 2]);
            return straight;
        }
        let ends = ENDS.map(|x| d.third(x));
        let mut third = Range::of(ends);
        let [c0, c1, c2] = d.third;
        if c1.abs() < c2.abs() {
            third.take(c0 - 0.25 * c1 * (c1 / c2));
        }
        let bends = d.bends();
        let at = [ENDS[0], bends[0], bends[1], ENDS[1]];
        let values = at.map(|x| d.second(x));
        let mut second = Range::of([values[0], values[3]]);
        second.take(values[1]);
        second.take(values[2]);
        let mut first = Range::of(ENDS.map(|x| d.first(x)));
        let size = larger(first.high, -first.low);
        for k in 0..3 {
            if let Some(peak) = d.peak([at[k], at[k + 1]], [values[k], values[k + 1]], size) {
                first.take(peak);
            }
        }
        let sum = |c: &[f32]| c.iter().rev().fold(0.0, |sum, c| 0.5 * sum + c.abs());
        Self {
            of: [
                first.rounded(sum(&d.first)),
                second.rounded(sum(&d.second)),
                third.rounded(sum(&d.third)),
            ],
            third: ends,
        }
    }
}

#[cfg(test)]
mod tests;
