//! From pieces of the centre path to cubic segments, one at a time.
//!
//! In: a [`Piece`] whose range is final, and where the path stands. Out: Hermite cubics within [`TOLERANCE`] of the offset,
//! their slopes along its tangent. The other axes go along with the share of the piece that is done, from where they
//! stand to where the piece ends, however little of it is left in the plane: a shortened block still turns the rotary axes
//! all the way.

use super::offset::{cross, dot, Point, Shape};
use super::piece::{difference, mm, signed_radius, steps, Kind, Piece};
use crate::config::{AxisKind, Config};
use crate::geometry::{HermiteSegment, PathSegment};
use crate::nc::command::FeedReference;
use crate::units::{AxisVec, Position, AXES};

/// Largest distance between offset and cubic at the points looked at, mm.
const TOLERANCE: f64 = 3.0e-4;
/// Shortest share of a piece that is halved again.
const SHORTEST: f64 = 1.0e-3;

/// A piece on its way out.
pub(super) struct Emission {
    piece: Piece,
    axes: [usize; 2],
    /// Share already handed out.
    done: f64,
    /// Share to try next.
    step: f64,
    /// Where the path stood less where the piece begins; worn off over the piece.
    miss: [f64; AXES],
}

impl Emission {
    /// Begins at `at`; `axes` are the axes of the plane.
    pub fn new(config: &Config, axes: [usize; 2], piece: Piece, at: &Position) -> Self {
        let mut out = Self {
            piece,
            axes,
            done: 0.0,
            step: 1.0,
            miss: [0.0; AXES],
        };
        let shape = piece.shape(config, axes);
        let (start, _) = out.at(config, &shape, 0.0, at);
        out.miss = core::array::from_fn(|axis| mm(config, axis, at[axis]) - start[axis]);
        out
    }

    /// Text line of the piece.
    pub fn block(&self) -> u32 {
        self.piece.source.block
    }

    /// Position and slope of all axes at share `w` of the piece.
    fn at(
        &self,
        config: &Config,
        shape: &Shape,
        w: f64,
        stand: &Position,
    ) -> ([f64; AXES], [f64; AXES]) {
        let piece = &self.piece;
        let segment = &piece.source.segment;
        let width = piece.cut[1] - piece.cut[0];
        let u = if w == 1.0 {
            piece.cut[1]
        } else {
            piece.cut[0] + w * width
        };
        let sample = shape.at(u, piece.whole());
        let [from, to] = piece.whole();
        let other = from + w * (to - from);
        // 1 - w^2 (3 - 2 w) and its derivative: leaves the slopes at both ends alone.
        let (fade, fading) = (1.0 - w * w * (3.0 - 2.0 * w), -6.0 * w * (1.0 - w));
        let mut position = [0.0; AXES];
        let mut slope = [0.0; AXES];
        for axis in 0..AXES {
            if let Some(k) = self.axes.iter().position(|a| *a == axis) {
                position[axis] = sample.centre[k];
                slope[axis] = sample.tangent[k] * sample.speed * width;
            } else if piece.kind == Kind::Contour {
                let start = mm(config, axis, segment.start[axis]);
                let by = mm(
                    config,
                    axis,
                    segment.end[axis].saturating_sub(segment.start[axis]),
                );
                let (m0, m1) = (
                    f64::from(segment.slope_start[axis]),
                    f64::from(segment.slope_end[axis]),
                );
                let (c2, c3) = (3.0 * by - 2.0 * m0 - m1, m0 + m1 - 2.0 * by);
                position[axis] = if other == 1.0 {
                    start + by
                } else {
                    start + ((c3 * other + c2) * other + m0) * other
                };
                slope[axis] = ((3.0 * c3 * other + 2.0 * c2) * other + m0) * (to - from);
            } else {
                position[axis] = mm(config, axis, stand[axis]);
            }
            position[axis] += fade * self.miss[axis];
            slope[axis] += fading * self.miss[axis];
        }
        (position, slope)
    }

    /// The next segment, starting at `stand`, which moves to its end; `None` when the piece is done.
    ///
    /// # Errors
    /// `OutOfRange` if a position leaves the range.
    pub fn next(
        &mut self,
        config: &Config,
        stand: &mut Position,
    ) -> Result<Option<PathSegment>, OutOfRange> {
        while self.done < 1.0 {
            let from = *stand;
            let out = self.advance(config, stand)?;
            if from != *stand || out.exact_stop {
                return Ok(Some(out));
            }
        }
        Ok(None)
    }

    /// The next segment, however short.
    fn advance(
        &mut self,
        config: &Config,
        stand: &mut Position,
    ) -> Result<PathSegment, OutOfRange> {
        let shape = self.piece.shape(config, self.axes);
        let straight = self.piece.straight || matches!(self.piece.kind, Kind::LegIn | Kind::LegOut);
        let mut step = self.step.min(1.0 - self.done);
        let (_, slope) = self.at(config, &shape, self.done, stand);
        let (end, end_slope) = loop {
            let w = if step >= 1.0 - self.done {
                1.0
            } else {
                self.done + step
            };
            let (end, end_slope) = self.at(config, &shape, w, stand);
            if straight
                || step < SHORTEST
                || self.fits(config, &shape, step, stand, &slope, &end, &end_slope)
            {
                break (end, end_slope);
            }
            step *= 0.5;
        };
        let done = if step >= 1.0 - self.done {
            1.0
        } else {
            self.done + step
        };
        let mut target = *stand;
        for axis in 0..AXES {
            let in_plane = self.axes.contains(&axis);
            if !in_plane && self.piece.kind != Kind::Contour {
                continue;
            }
            target[axis] = if !in_plane && done == 1.0 && self.piece.part[1] == 1.0 {
                self.piece.source.segment.end[axis]
            } else {
                steps(config, axis, end[axis]).ok_or(OutOfRange)?
            };
        }
        let (slope_start, slope_end): (AxisVec, AxisVec) = if straight {
            let chord = difference(config, stand, &target).map(|by| by as f32);
            (chord, chord)
        } else {
            (
                slope.map(|v| (v * step) as f32),
                end_slope.map(|v| (v * step) as f32),
            )
        };
        let source = &self.piece.source;
        let out = PathSegment {
            segment: HermiteSegment {
                start: *stand,
                end: target,
                slope_start,
                slope_end,
            },
            exact_stop: done == 1.0 && self.piece.stop,
            ..*source
        };
        self.done = done;
        self.step = 2.0 * step;
        *stand = target;
        Ok(PathSegment {
            feed: self.feed(config, &out),
            ..out
        })
    }

    /// True if the cubic over the next `step` stays with the offset.
    #[allow(clippy::too_many_arguments)]
    fn fits(
        &self,
        config: &Config,
        shape: &Shape,
        step: f64,
        stand: &Position,
        m0: &[f64; AXES],
        end: &[f64; AXES],
        m1: &[f64; AXES],
    ) -> bool {
        [0.25, 0.5, 0.75].iter().all(|&x| {
            let (wanted, _) = self.at(config, shape, self.done + x * step, stand);
            let mut square = 0.0;
            for axis in self.axes {
                let start = mm(config, axis, stand[axis]);
                let by = end[axis] - start;
                let (m0, m1) = (m0[axis] * step, m1[axis] * step);
                let (c2, c3) = (3.0 * by - 2.0 * m0 - m1, m0 + m1 - 2.0 * by);
                let miss = start + ((c3 * x + c2) * x + m0) * x - wanted[axis];
                square += miss * miss;
            }
            square <= TOLERANCE * TOLERANCE
        })
    }

    /// Feed of the segment `out` of the centre path.
    ///
    /// An offset of signed radius d along a piece of length L whose tangent turns by a is L - d a long (Steiner), so the
    /// length of the contour follows from the segment alone.
    fn feed(&self, config: &Config, out: &PathSegment) -> f32 {
        let reference = out.cutter.feed;
        if reference == FeedReference::Centre
            || self.piece.kind != Kind::Contour
            || self.piece.straight
            || !out.feed.is_finite()
        {
            return out.feed;
        }
        let segment = &out.segment;
        let by = difference(config, &segment.start, &segment.end);
        let [m0, m1] = [&segment.slope_start, &segment.slope_end]
            .map(|slope| self.axes.map(|axis| f64::from(slope[axis])));
        let chord = self.axes.map(|axis| by[axis]);
        let own = length(chord, m0, m1);
        let angle = libm::atan2(cross(m0, m1), dot(m0, m1));
        let contour = own + signed_radius(out) * angle;
        let rise: f64 = (0..AXES)
            .filter(|axis| !self.axes.contains(axis) && config.axes[*axis].kind == AxisKind::Linear)
            .map(|axis| by[axis] * by[axis])
            .sum();
        let ratio = libm::sqrt((own * own + rise) / (contour * contour + rise).max(1.0e-18));
        let ratio = if reference == FeedReference::Inside {
            ratio.min(1.0)
        } else {
            ratio
        };
        // A feed of zero would never arrive.
        out.feed * (ratio as f32).max(1.0e-3)
    }
}

/// A position of the tool centre leaves the range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct OutOfRange;

/// Length of a plane cubic by Gauss' rule of five points.
fn length(chord: Point, m0: Point, m1: Point) -> f64 {
    const NODES: [[f64; 2]; 5] = [
        [0.046_910_077_030_668, 0.118_463_442_528_094_5],
        [0.230_765_344_947_158_5, 0.239_314_335_249_683_2],
        [0.5, 0.284_444_444_444_444_4],
        [0.769_234_655_052_841_5, 0.239_314_335_249_683_2],
        [0.953_089_922_969_332, 0.118_463_442_528_094_5],
    ];
    NODES
        .iter()
        .map(|[u, weight]| {
            let slope: Point = core::array::from_fn(|k| {
                let (c2, c3) = (
                    3.0 * chord[k] - 2.0 * m0[k] - m1[k],
                    m0[k] + m1[k] - 2.0 * chord[k],
                );
                (3.0 * c3 * u + 2.0 * c2) * u + m0[k]
            });
            weight * super::offset::norm(slope)
        })
        .sum()
}
