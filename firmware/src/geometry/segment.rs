//! The one curve type behind the geometry stage: a five-axis cubic in Hermite form.

use crate::nc::command::{Cutter, Rounding};
use crate::units::{AxisVec, Position};

/// A cubic from `start` to `end`, parameter u in [0, 1].
///
/// The end points are exact; slopes are relative geometry and may be `f32`. Everything (lines, splines,
/// `G6`) is handed on in this form, so that a block ends exactly on its end point by construction and
/// neighbours that share a slope value share a tangent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HermiteSegment {
    /// P(0), steps.
    pub start: Position,
    /// P(1), steps.
    pub end: Position,
    /// dP/du at u = 0, mm or degree.
    pub slope_start: AxisVec,
    /// dP/du at u = 1, mm or degree.
    pub slope_end: AxisVec,
}

/// A segment with what the planner must know of the block it came from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathSegment {
    /// The curve.
    pub segment: HermiteSegment,
    /// Text line ([`crate::nc::Move::block`]).
    pub block: u32,
    /// Programmed feed, mm/s or degree/s; infinite for rapid motion.
    pub feed: f32,
    /// Come to rest at the end of this segment.
    pub exact_stop: bool,
    /// Jerk-limited (`SOFT`) rather than acceleration-limited (`BRISK`).
    pub soft: bool,
    /// What may become of the corner at the end of this segment.
    pub rounding: Rounding,
    /// Part of a spline: its points are programmed, the curve between them is the control's.
    pub spline: bool,
    /// Cutter compensation in force; done by the compensation stage.
    pub cutter: Cutter,
}
