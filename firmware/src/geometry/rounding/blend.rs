//! The curves that take the place of a corner.
//!
//! In: where the path leaves the first segment and where it joins the second. Out: one cubic or three. Their parameter
//! runs nearly evenly along the path: without a turn they would be the line at constant speed.
//!
//! Three cubics are a clamped cubic B-spline over the knots 0 0 0 0 1 2 3 3 3 3 (C. de Boor, "A Practical Guide to Splines", IX). The first
//! three of its control points give place, direction and curvature at its start, the last three at its end, in any
//! number of axes: the path is curvature-continuous with both segments. Between lines, the six points lie on the two
//! legs of the corner, and so the curve lies in the triangle that the ends make with the corner.
//!
//! One cubic is for the joints of a polyline that stands for a curve: it turns evenly (its curvature is that of the
//! circle, where turns and lengths are even), while curvature-continuity with the lines would make it pulse.

use super::super::chord::offset;
use super::super::segment::HermiteSegment;
use super::branch::{Counts, Spot};
use crate::config::Config;
use crate::units::{sqrt, AxisVec, Position, AXES};

/// Most cubics of a corner.
pub(super) const CUBICS: usize = 3;

/// Halvings that find where a curve is furthest off: to 2 % of a cubic.
const HALVINGS: usize = 6;

/// The cubics of one corner, in path order.
pub(super) type Cubics = heapless::Vec<HermiteSegment, CUBICS>;

/// Shape of a rounded corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shape {
    /// One cubic, tangent-continuous.
    Even,
    /// Three cubics, curvature-continuous.
    Smooth,
}

/// Path per cubic of three: a third of the geometric mean of the way along the legs, `whole`, and straight across, `chord`.
///
/// Chosen for speed: at any turn up to 165 degrees, time over the corner at constant feed is within 5 % of the least any control
/// points give where the third derivative limits the feed. And without a turn the curve is the line, evenly driven.
fn pace(whole: f32, chord: f32) -> f32 {
    sqrt(whole * chord) / 3.0
}

/// How far a rounded corner between two lines leaves them, per unit of change of dq/ds: distance from the corner before it
/// and behind it, neither more than twice the other; cosine of the turn.
///
/// A point of the curve is `corner - A t0 + B t1`, A the distance to go on the first leg and B the distance gone on the second. Seen
/// from the point `B - A` on the path, it is off by `min(A, B) (t1 - t0)`; A falls and B grows, so that is most where
/// they are equal.
pub(super) fn sag(shape: Shape, before: f32, behind: f32, cosine: f32) -> f32 {
    let whole = before + behind;
    if shape == Shape::Even {
        // Beside a corner seen at an even pace; min(A, B) is no more than that.
        let t = before / whole;
        return whole * t * t * ((3.0 - 2.0 * t) * behind / whole - (1.0 - t));
    }
    let square = before * before + behind * behind + 2.0 * before * behind * cosine;
    let v = pace(whole, sqrt(square.max(0.0)));
    // They meet in the second cubic: the Bezier points of B, from there on as it is and backwards, for A.
    let points = |leg: f32| {
        let (near, far) = (leg - v, leg - v / 3.0);
        [
            near / 6.0,
            near / 3.0,
            near * (2.0 / 3.0),
            near * (7.0 / 12.0) + far / 4.0,
        ]
    };
    let (a, b) = (points(before), points(behind));
    let at = |p: &[f32; 4], u: f32| {
        let w = 1.0 - u;
        w * w * w * p[0] + 3.0 * u * w * (w * p[1] + u * p[2]) + u * u * u * p[3]
    };
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let u = 0.5 * (low + high);
        if at(&a, 1.0 - u) > at(&b, u) {
            low = u;
        } else {
            high = u;
        }
    }
    // The larger of the two on either side of where they are equal: never too little.
    at(&b, high).max(at(&a, 1.0 - low))
}

/// A corner rounded from one spot to another; all points relative to the corner.
pub(super) struct Blend {
    /// Ends and inner joints; `joints + 1` of them count.
    points: [AxisVec; CUBICS + 1],
    /// Slopes there, per unit of parameter of a cubic.
    slopes: [AxisVec; CUBICS + 1],
    cubics: usize,
}

impl Blend {
    /// The curve of `shape` from `first` to `last`.
    pub fn new(counts: &Counts, shape: Shape, first: &Spot, last: &Spot) -> Self {
        let whole = first.distance + last.distance;
        let zero = [0.0; AXES];
        if shape == Shape::Even {
            let slope = |spot: &Spot| spot.tangent.map(|value| value * whole);
            return Self {
                points: [first.from, last.from, zero, zero],
                slopes: [slope(first), slope(last), zero, zero],
                cubics: 1,
            };
        }
        let across: AxisVec = core::array::from_fn(|a| last.from[a] - first.from[a]);
        let v = pace(whole, sqrt(counts.dot(&across, &across)));
        let mut blend = Self {
            points: [first.from, zero, zero, last.from],
            slopes: [zero; 4],
            cubics: 3,
        };
        for a in 0..AXES {
            let (t0, t1) = (v * first.tangent[a], v * last.tangent[a]);
            let bend = v * v / 3.0;
            // P'(0) = 3 (p1 - p0) and P''(0) = 3 (p2 - p1) - 6 (p1 - p0)
            let p1 = first.from[a] + t0 / 3.0;
            let p2 = first.from[a] + t0 + bend * first.curvature[a];
            let p4 = last.from[a] - t1 / 3.0;
            let p3 = last.from[a] - t1 + bend * last.curvature[a];
            // Knots inserted until every cubic stands alone.
            blend.points[1][a] = 0.25 * p1 + (7.0 / 12.0) * p2 + p3 / 6.0;
            blend.points[2][a] = p2 / 6.0 + (7.0 / 12.0) * p3 + 0.25 * p4;
            blend.slopes[0][a] = t0;
            blend.slopes[1][a] = 0.25 * p2 + 0.5 * p3 - 0.75 * p1;
            blend.slopes[2][a] = 0.75 * p4 - 0.25 * p3 - 0.5 * p2;
            blend.slopes[3][a] = t1;
        }
        blend
    }

    /// Point at the share t of the curve, relative to the corner.
    pub fn place(&self, t: f32) -> AxisVec {
        let scaled = t * self.cubics as f32;
        let index = (scaled as usize).min(self.cubics - 1);
        let u = scaled - index as f32;
        let v = 1.0 - u;
        let (p0, p1) = (&self.points[index], &self.points[index + 1]);
        let (s0, s1) = (&self.slopes[index], &self.slopes[index + 1]);
        core::array::from_fn(|a| {
            v * v * (1.0 + 2.0 * u) * p0[a]
                + u * u * (1.0 + 2.0 * v) * p1[a]
                + u * v * (v * s0[a] - u * s1[a])
        })
    }

    /// The cubics, from `first` to `last` to the bit; `None` if a joint leaves the range of positions.
    pub fn cubics(
        &self,
        config: &Config,
        corner: &Position,
        first: &Position,
        last: &Position,
    ) -> Option<Cubics> {
        let mut out = Cubics::new();
        let mut start = *first;
        for index in 0..self.cubics {
            let end = if index + 1 == self.cubics {
                *last
            } else {
                offset(config, corner, &self.points[index + 1]).ok()?
            };
            let cubic = HermiteSegment {
                start,
                end,
                slope_start: self.slopes[index],
                slope_end: self.slopes[index + 1],
            };
            out.push(cubic).ok()?;
            start = end;
        }
        Some(out)
    }
}
