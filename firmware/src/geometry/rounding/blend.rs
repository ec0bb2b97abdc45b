//! The curves that take the place of a corner.
//!
//! In: where the path leaves the first segment and where it joins the second. Out: one to three cubics. All are driven
//! evenly: on a straight line they would be the line at constant speed, so the smaller the turn, the less they differ
//! from the programmed path.
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
use super::branch::Spot;
use crate::config::Config;
use crate::units::{AxisVec, Position, AXES};

/// Most cubics of a corner.
pub(super) const CUBICS: usize = 3;

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

/// How far a rounded corner between two lines leaves them, per unit of change of dq/ds: distance from the corner before it
/// and behind it, neither more than twice the other.
///
/// The rounded corner at path parameter s is `(distance gone on the second leg beyond what the path itself has gone) x change
/// of dq/ds` away from the path at s. The curve turns one way, so that is most at the corner.
pub(super) fn sag(shape: Shape, before: f32, behind: f32) -> f32 {
    let whole = before + behind;
    let t = before / whole;
    match shape {
        Shape::Even => whole * t * t * ((3.0 - 2.0 * t) * behind / whole - (1.0 - t)),
        Shape::Smooth => {
            // Distances of the control points on the second leg; those on the first are at none.
            let (fourth, fifth) = (behind - whole / 3.0, behind - whole / 9.0);
            // The corner lies in the second cubic; its Bezier points.
            let b = [
                fourth / 6.0,
                fourth / 3.0,
                fourth * (2.0 / 3.0),
                fourth * (7.0 / 12.0) + fifth / 4.0,
            ];
            let (u, v) = (3.0 * t - 1.0, 2.0 - 3.0 * t);
            v * v * v * b[0] + 3.0 * u * v * (v * b[1] + u * b[2]) + u * u * u * b[3]
        }
    }
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
    pub fn new(shape: Shape, first: &Spot, last: &Spot) -> Self {
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
        // Path per cubic.
        let v = whole / 3.0;
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
