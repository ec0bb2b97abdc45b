//! Finished segments on their way to the planner, and the gate every one of them passes.

use heapless::Deque;

use super::chord::{delta, in_range, measure, moves, per_unit};
use super::error::{GeometryError, GeometryErrorKind};
use super::fit;
use super::segment::{HermiteSegment, PathSegment};
use crate::config::Config;
use crate::nc::command::{Cutter, FeedType, Motion, Move, Rounding};
use crate::units::{AxisVec, Position, AXES};

/// Most segments that are made at a time: the last two cubics of an A-spline, each in three parts.
const CAPACITY: usize = 6;

/// A programmed point with what its block said about it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Knot {
    /// Where.
    pub at: Position,
    /// Text line.
    pub block: u32,
    /// Feed on the way there, mm/s or degree/s; infinite for rapid motion. Ways per second where `inverse` is set.
    pub feed: f32,
    /// `G93`: the feed waits for the length of the way ([`Knot::timed`]).
    pub inverse: bool,
    /// Come to rest there.
    pub exact_stop: bool,
    /// Jerk-limited on the way there.
    pub soft: bool,
    /// What may become of the corner there.
    pub rounding: Rounding,
    /// A point of a spline.
    pub spline: bool,
    /// Cutter compensation on the way there.
    pub cutter: Cutter,
}

impl Knot {
    /// The point a block programs.
    pub fn new(at: Position, block: &Move) -> Self {
        let feed = match block.motion {
            Motion::Rapid => f32::INFINITY,
            _ => block.feed,
        };
        Self {
            at,
            block: block.block,
            feed,
            inverse: block.feed_type == FeedType::Inverse && block.motion != Motion::Rapid,
            exact_stop: block.exact_stop,
            soft: block.soft,
            rounding: block.rounding,
            spline: matches!(block.motion, Motion::Spline(_)),
            cutter: block.cutter,
        }
    }

    /// A point no block of the spline programmed: where it starts.
    pub const fn origin(at: Position) -> Self {
        Self {
            at,
            block: 0,
            feed: 0.0,
            inverse: false,
            exact_stop: false,
            soft: false,
            rounding: Rounding::None,
            spline: false,
            cutter: Cutter::OFF,
        }
    }

    /// This knot with a feed per time, once the length of the whole way there is known (mm or degree).
    ///
    /// Does nothing to a knot whose feed is per time already, so that a part of a way cannot be taken for the whole.
    ///
    /// # Errors
    /// `Feed` if the product is no feed; `NotFinite` without a length.
    pub fn timed(&self, length: impl FnOnce() -> Option<f32>) -> Result<Self, GeometryError> {
        if !self.inverse {
            return Ok(*self);
        }
        let length = length().ok_or_else(|| self.error(GeometryErrorKind::NotFinite))?;
        let feed = self.feed * length;
        if !(feed.is_finite() && feed > 0.0) {
            return Err(self.error(GeometryErrorKind::Feed));
        }
        Ok(Self {
            feed,
            inverse: false,
            ..*self
        })
    }

    /// [`Knot::timed`] where the way is one cubic that makes `by`.
    pub fn timed_by_cubic(
        &self,
        config: &Config,
        by: &AxisVec,
        slope_start: &AxisVec,
        slope_end: &AxisVec,
    ) -> Result<Self, GeometryError> {
        self.timed(|| {
            if slope_start == by && slope_end == by {
                return measure(config, by).map(|(_, length)| length);
            }
            fit::length(config, |u| {
                // Derivatives of the Hermite polynomials.
                let v = 1.0 - u;
                Some(core::array::from_fn(|axis| {
                    6.0 * u * v * by[axis]
                        + v * (v - 2.0 * u) * slope_start[axis]
                        + u * (u - 2.0 * v) * slope_end[axis]
                }))
            })
        })
    }

    /// This knot's block is to blame.
    pub fn error(&self, kind: GeometryErrorKind) -> GeometryError {
        GeometryError {
            block: self.block,
            kind,
        }
    }
}

/// First in, first out; knows the direction in which the path leaves its last segment.
pub(super) struct SegmentQueue {
    out: Deque<PathSegment, CAPACITY>,
    tail: Option<AxisVec>,
}

impl SegmentQueue {
    pub const fn new() -> Self {
        Self {
            out: Deque::new(),
            tail: None,
        }
    }

    pub fn clear(&mut self) {
        self.out.clear();
        self.tail = None;
    }

    pub fn is_empty(&self) -> bool {
        self.out.is_empty()
    }

    pub fn pop(&mut self) -> Option<PathSegment> {
        self.out.pop_front()
    }

    /// Direction of the end of the last segment, any length; `None` before the first.
    pub fn tail(&self) -> Option<AxisVec> {
        self.tail
    }

    /// Makes the path rest at the end of the last segment, if that segment is still here.
    pub fn stop_at_last(&mut self) {
        if let Some(last) = self.out.back_mut() {
            last.exact_stop = true;
        }
    }

    /// Takes the cubic from `start` to `end`, slopes per unit u in mm or degree.
    ///
    /// A segment that is a single point is dropped (its exact stop goes to the segment before). A knot whose feed still
    /// waits for a length gets that of this cubic.
    ///
    /// # Errors
    /// `NotFinite`; `OutOfRange` if its Bezier hull, hence possibly the curve, leaves the range of positions.
    pub fn emit(
        &mut self,
        config: &Config,
        start: &Position,
        end: &Knot,
        slope_start: AxisVec,
        slope_end: AxisVec,
    ) -> Result<(), GeometryError> {
        let by = delta(config, start, &end.at).map_err(|kind| end.error(kind))?;
        self.emit_by(config, start, end, &by, slope_start, slope_end)
    }

    /// [`SegmentQueue::emit`] for a caller who knows the difference `by` of the two points already.
    pub fn emit_by(
        &mut self,
        config: &Config,
        start: &Position,
        end: &Knot,
        by: &AxisVec,
        slope_start: AxisVec,
        slope_end: AxisVec,
    ) -> Result<(), GeometryError> {
        let still = |slope: &AxisVec| slope.iter().all(|value| *value == 0.0);
        if *start == end.at && still(&slope_start) && still(&slope_end) {
            if end.exact_stop {
                self.stop_at_last();
            }
            return Ok(());
        }
        for axis in 0..AXES {
            if !(slope_start[axis].is_finite() && slope_end[axis].is_finite()) {
                return Err(end.error(GeometryErrorKind::NotFinite));
            }
            let per_unit = per_unit(config, axis);
            if !in_range(start[axis], slope_start[axis] / 3.0 * per_unit)
                || !in_range(end.at[axis], -slope_end[axis] / 3.0 * per_unit)
            {
                return Err(end.error(GeometryErrorKind::OutOfRange { axis }));
            }
        }
        let feed = if end.inverse {
            let timed = end.timed_by_cubic(config, by, &slope_start, &slope_end)?;
            timed.feed
        } else {
            end.feed
        };
        if self.out.is_full() {
            return Err(end.error(GeometryErrorKind::NotDrained));
        }
        // there is room
        let _ = self.out.push_back(PathSegment {
            segment: HermiteSegment {
                start: *start,
                end: end.at,
                slope_start,
                slope_end,
            },
            block: end.block,
            feed,
            exact_stop: end.exact_stop,
            soft: end.soft,
            rounding: end.rounding,
            spline: end.spline,
            cutter: end.cutter,
        });
        self.tail = if moves(&slope_end) {
            Some(slope_end)
        } else {
            // P'(1) = 0 (a doubled last control point): the path leaves along -P''(1) = 6 (P1 - P0) - 2 P'(0).
            let away: AxisVec = core::array::from_fn(|axis| 3.0 * by[axis] - slope_start[axis]);
            moves(&away).then_some(away)
        };
        Ok(())
    }
}
