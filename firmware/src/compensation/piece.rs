//! One piece of the centre path as the window keeps it, and the border between positions in steps and millimetres.

use super::corner::turn;
use super::offset::{add, dot, left, unit, Shape};
use crate::config::Config;
use crate::geometry::PathSegment;
use crate::nc::command::Side;
use crate::units::{AxisVec, Position, Steps, AXES};

/// What a piece follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Part of a programmed segment.
    Contour,
    /// Arc about an outer corner (`G450`). Corner pieces: start = end = corner, slopes = unit tangents.
    Arc,
    /// From the offset of the block before to the intersection (`G451`).
    LegIn,
    /// From the intersection to the offset of the next block.
    LegOut,
}

/// What has become of a piece.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum State {
    /// Will be run.
    Live,
    /// Nothing before it meets it (yet).
    Swallowed,
    /// The tool does not fit into the curve.
    Dropped,
}

/// One piece.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    /// The programmed segment.
    pub source: PathSegment,
    /// What it follows.
    pub kind: Kind,
    /// What has become of it.
    pub state: State,
    /// Straight at constant speed in all axes.
    pub straight: bool,
    /// Part of the segment's u this piece is.
    pub part: [f32; 2],
    /// What is left of it.
    pub cut: [f64; 2],
    /// Box around the centre path, mm; empty for a piece that is not live.
    pub bounds: [f32; 4],
    /// Come to rest at its end.
    pub stop: bool,
    /// Turn of the inner joint it begins at, radian; 0 at any other.
    pub turn: f32,
}

impl Piece {
    /// A live piece, not yet cut.
    pub fn new(
        config: &Config,
        axes: [usize; 2],
        source: &PathSegment,
        kind: Kind,
        part: [f32; 2],
    ) -> Self {
        let mut piece = Self {
            source: *source,
            kind,
            state: State::Live,
            straight: kind == Kind::Contour && is_straight(config, source),
            part,
            cut: part.map(f64::from),
            bounds: [0.0; 4],
            stop: source.exact_stop && part[1] == 1.0,
            turn: 0.0,
        };
        piece.bounds = piece.shape(config, axes).bounds(piece.whole());
        piece
    }

    /// Its whole range of u.
    pub fn whole(&self) -> [f64; 2] {
        self.part.map(f64::from)
    }

    /// Its centre path.
    pub fn shape(&self, config: &Config, axes: [usize; 2]) -> Shape {
        let segment = &self.source.segment;
        let d = signed_radius(&self.source);
        let point = |p: &Position| axes.map(|axis| mm(config, axis, p[axis]));
        let slope = |m: &AxisVec| axes.map(|axis| f64::from(m[axis]));
        let start = point(&segment.start);
        let (m0, m1) = (slope(&segment.slope_start), slope(&segment.slope_end));
        if self.kind == Kind::Contour {
            let end = point(&segment.end);
            if !self.straight {
                return Shape::cubic(start, end, m0, m1, d);
            }
            let mut line = Shape::line(start, end);
            if let Shape::Cubic { d: to, .. } = &mut line {
                *to = d;
            }
            return line;
        }
        let (before, after) = (unit(m0), unit(m1));
        if self.kind == Kind::Arc {
            return Shape::Arc {
                centre: start,
                tangent: before,
                sweep: turn(before, after, d),
                d,
            };
        }
        // Intersection of the end tangents: C + d (n1 + n2) / (1 + n1 . n2); not parallel by the choice of the kind.
        let (n1, n2) = (left(before), left(after));
        let share = d / (1.0 + dot(n1, n2)).max(0.1);
        let tip = add(add(start, n1, share), n2, share);
        if self.kind == Kind::LegIn {
            Shape::line(add(start, n1, d), tip)
        } else {
            Shape::line(tip, add(start, n2, d))
        }
    }
}

/// Radius, positive where the tool is on the left.
pub(super) fn signed_radius(path: &PathSegment) -> f64 {
    let radius = path.cutter.radius as f64 * 1.0e-6;
    match path.cutter.side {
        Side::On => 0.0,
        Side::Left => radius,
        Side::Right => -radius,
    }
}

/// True if no axis leaves the straight line at constant speed (to the rounding of `f32`).
pub(super) fn is_straight(config: &Config, path: &PathSegment) -> bool {
    let by = difference(config, &path.segment.start, &path.segment.end);
    let close = 1.0e-6 * by.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
    (0..AXES).all(|axis| {
        [&path.segment.slope_start, &path.segment.slope_end]
            .iter()
            .all(|slope| (f64::from(slope[axis]) - by[axis]).abs() <= close)
    })
}

/// 2^32: bits of [`Steps`] per step.
const BITS: f64 = 4_294_967_296.0;

/// Steps to millimetres or degrees.
pub(super) fn mm(config: &Config, axis: usize, steps: Steps) -> f64 {
    steps.to_bits() as f64 / BITS / config.axes[axis].steps_per_unit.to_num::<f64>()
}

/// Millimetres or degrees to steps; `None` out of range.
pub(super) fn steps(config: &Config, axis: usize, mm: f64) -> Option<Steps> {
    let bits = libm::round(mm * config.axes[axis].steps_per_unit.to_num::<f64>() * BITS);
    // 2^31 steps less the rounding of what is computed from it.
    (bits.abs() < 2_147_483_000.0 * BITS).then(|| Steps::from_bits(bits as i64))
}

/// `to - from`, mm or degree; the difference is taken in steps (saturated), so it keeps the resolution of positions.
pub(super) fn difference(config: &Config, from: &Position, to: &Position) -> [f64; AXES] {
    core::array::from_fn(|axis| mm(config, axis, to[axis].saturating_sub(from[axis])))
}
