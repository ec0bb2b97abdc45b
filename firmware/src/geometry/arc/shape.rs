//! What the planner must know of a segment's curve: derivatives along the path at its ends, and their bounds.
//!
//! In: the quintics of all axes, in floats. Out: [`PathShape`], and the error of the path feed that comes for free.

use crate::units::{AxisVec, AXES};

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

/// Allowances for what samples miss of the peak of a derivative between them. Random programs exceed a limit by up to
/// 1 % without.
const SAMPLED_FIRST: f32 = 0.01;
const SAMPLED_HIGHER: f32 = 0.03;

/// Points at which derivatives are taken, the ends among them.
const SAMPLES: usize = 9;

/// Quintic of one axis about the middle of its segment: position = sum of `a[k - 1] x^k`, -1/2 <= x <= 1/2, axis units.
pub type Quintic = [f32; 5];

/// Derivatives over x of all axes at `x`, first to third.
fn derivatives(curve: &[Quintic; AXES], x: f32) -> [AxisVec; 3] {
    let mut d = [[0.0; AXES]; 3];
    for (axis, &[a1, a2, a3, a4, a5]) in curve.iter().enumerate() {
        let (b3, b4, b5) = (3.0 * a3, 4.0 * a4, 5.0 * a5);
        d[0][axis] = a1 + x * (2.0 * a2 + x * (b3 + x * (b4 + x * b5)));
        d[1][axis] = 2.0 * a2 + x * (2.0 * b3 + x * (3.0 * b4 + x * (4.0 * b5)));
        d[2][axis] = 2.0 * b3 + x * (6.0 * b4 + x * (12.0 * b5));
    }
    d
}

impl PathShape {
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
        let at: [_; SAMPLES] = core::array::from_fn(|i| {
            derivatives(curve, i as f32 * (1.0 / (SAMPLES - 1) as f32) - 0.5)
        });
        let per = 1.0 / length;
        let mut error = 0.0_f32;
        for d in &at[1..SAMPLES - 1] {
            let mut square = 0.0;
            for a in 0..AXES {
                if counts[a] {
                    square += d[0][a] * d[0][a];
                }
            }
            // (1 + e)^2 = 1 + 2 e but for e^2.
            error = error.max((0.5 * (square * (per * per) - 1.0)).abs());
        }
        let scale = [per, per * per, per * per * per];
        let range = |order: usize, allowance: f32| -> [AxisVec; 2] {
            let (mut low, mut high) = (AxisVec::default(), AxisVec::default());
            for a in 0..AXES {
                let d: [f32; SAMPLES] = core::array::from_fn(|i| at[i][order][a]);
                let (mut least, mut most) = (d[0].min(d[SAMPLES - 1]), d[0].max(d[SAMPLES - 1]));
                for i in 1..SAMPLES - 1 {
                    // A parabola through three samples peaks at most 1/8 of their second difference beyond the middle
                    // one; twice that covers what the next terms of the series add.
                    let bend = 0.25 * (d[i + 1] - 2.0 * d[i] + d[i - 1]).abs();
                    least = least.min(d[i] - bend);
                    most = most.max(d[i] + bend);
                }
                let more = allowance * least.abs().max(most.abs());
                low[a] = (least - more) * scale[order];
                high[a] = (most + more) * scale[order];
            }
            [low, high]
        };
        let end = |sample: usize, [first, second]: [AxisVec; 2]| PathDerivatives {
            first,
            second,
            third: at[sample][2].map(|d| d * scale[2]),
        };
        let [first, second, third] = [
            range(0, SAMPLED_FIRST),
            range(1, SAMPLED_HIGHER),
            range(2, SAMPLED_HIGHER),
        ];
        let side = |i: usize| PathDerivatives {
            first: first[i],
            second: second[i],
            third: third[i],
        };
        let shape = Self {
            low: side(0),
            high: side(1),
            start: end(0, ends[0]),
            end: end(SAMPLES - 1, ends[1]),
            rotary_only: false,
            feed_scale: 1.0,
        };
        (shape, error)
    }

    /// True if an axis turns within the segment by so much that samples may miss a peak of its velocity: over half of its
    /// largest q' between start and end.
    #[must_use]
    pub fn is_rough(&self) -> bool {
        (0..AXES).any(|a| {
            let turn = (self.end.first[a] - self.start.first[a]).abs();
            let most = self.high.first[a].max(-self.low.first[a]);
            turn > 0.5 * most.max(0.01) && most > 1.0
        })
    }
}
