//! Finished segments on their way to the planner, and the gate every one of them passes.

use heapless::Deque;

use super::chord::{delta, in_range, measure};
use super::error::{GeometryError, GeometryErrorKind};
use super::segment::{HermiteSegment, PathSegment};
use crate::config::Config;
use crate::nc::command::{Cutter, Motion, Move};
use crate::units::{AxisVec, Position, AXES};

/// Most segments one block can finish: a C-spline's whole window, and the block itself.
const CAPACITY: usize = super::cubic::WINDOW + 4;

/// A programmed point with what its block said about it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Knot {
    /// Where.
    pub at: Position,
    /// Text line.
    pub block: u32,
    /// Feed on the way there, mm/s or degree/s; infinite for rapid motion.
    pub feed: f32,
    /// Come to rest there.
    pub exact_stop: bool,
    /// Jerk-limited on the way there.
    pub soft: bool,
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
            exact_stop: block.exact_stop,
            soft: block.soft,
            cutter: block.cutter,
        }
    }

    /// A point no block of the spline programmed: where it starts.
    pub const fn origin(at: Position) -> Self {
        Self {
            at,
            block: 0,
            feed: 0.0,
            exact_stop: false,
            soft: false,
            cutter: Cutter::OFF,
        }
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
    /// A segment that is a single point is dropped (its exact stop goes to the segment before).
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
            if !in_range(config, axis, start[axis], slope_start[axis] / 3.0)
                || !in_range(config, axis, end.at[axis], -slope_end[axis] / 3.0)
            {
                return Err(end.error(GeometryErrorKind::OutOfRange { axis }));
            }
        }
        self.out
            .push_back(PathSegment {
                segment: HermiteSegment {
                    start: *start,
                    end: end.at,
                    slope_start,
                    slope_end,
                },
                block: end.block,
                feed: end.feed,
                exact_stop: end.exact_stop,
                soft: end.soft,
                cutter: end.cutter,
            })
            .map_err(|_| end.error(GeometryErrorKind::NotDrained))?;
        self.tail = if measure(config, &slope_end).is_some() {
            Some(slope_end)
        } else {
            // P'(1) = 0 (a doubled last control point): the path leaves along -P''(1) = 6 (P1 - P0) - 2 P'(0).
            let by = delta(config, start, &end.at).map_err(|kind| end.error(kind))?;
            let away: AxisVec = core::array::from_fn(|axis| 3.0 * by[axis] - slope_start[axis]);
            measure(config, &away).map(|_| away)
        };
        Ok(())
    }
}
