//! What happens between two pieces of contour, and the pieces that bridge an outer corner.

use super::offset::{cross, dot, Point};
use super::piece::{Kind, Piece};
use crate::config::Config;
use crate::geometry::PathSegment;
use crate::nc::command::Corner;
use crate::units::Position;

/// Joints flatter than this, radian, may be passed without a bridge.
const FLAT: f64 = 0.5e-3;
/// ... if the gap between the offsets is no more than this, mm.
const FLAT_GAP: f64 = 2.0e-4;
/// A gap smaller than this is none, mm.
const NO_GAP: f64 = 1.0e-6;
/// `G451`: an intersection further than this many radii from the corner is replaced by the arc.
const FARTHEST: f64 = 2.0;

/// How two pieces of contour meet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Joint {
    /// Without a corner: the offsets meet.
    Tangent,
    /// The tool goes round the corner; the tangent turns by this angle, radian.
    Outer(f64),
    /// The offsets cross; the tangent turns by this angle, radian, without sign.
    Inner(f64),
}

/// Turn from unit tangent `before` to `after`, radian, left positive. A reversal turns around the contour, away from the
/// side the tool is on (`d`: signed radius).
pub(super) fn turn(before: Point, after: Point, d: f64) -> f64 {
    let angle = libm::atan2(cross(before, after), dot(before, after));
    if angle.abs() > core::f64::consts::PI - 1.0e-6 {
        -angle.abs().copysign(d)
    } else {
        angle
    }
}

/// Classifies the joint between unit tangents.
pub(super) fn classify(before: Point, after: Point, d: f64) -> Joint {
    let angle = turn(before, after, d);
    let gap = 2.0 * d.abs() * libm::sin(0.5 * angle.abs());
    if gap < NO_GAP || (angle.abs() < FLAT && gap < FLAT_GAP) {
        Joint::Tangent
    } else if angle * d < 0.0 {
        Joint::Outer(angle)
    } else {
        Joint::Inner(angle.abs())
    }
}

/// The pieces around an outer corner at `corner`, in path order. They belong to the block behind it, `next`.
pub(super) fn bridge(
    config: &Config,
    axes: [usize; 2],
    corner: &Position,
    next: &PathSegment,
    [before, after]: [Point; 2],
    angle: f64,
) -> [Option<Piece>; 2] {
    let mut source = *next;
    source.exact_stop = false;
    source.segment.start = *corner;
    source.segment.end = *corner;
    for k in 0..2 {
        source.segment.slope_start[axes[k]] = before[k] as f32;
        source.segment.slope_end[axes[k]] = after[k] as f32;
    }
    let piece = |kind| Some(Piece::new(config, axes, &source, kind, [0.0, 1.0]));
    // The intersection lies r / cos(angle / 2) from the corner.
    if next.cutter.corner == Corner::Arc || FARTHEST * libm::cos(0.5 * angle) < 1.0 {
        [piece(Kind::Arc), None]
    } else {
        [piece(Kind::LegIn), piece(Kind::LegOut)]
    }
}
