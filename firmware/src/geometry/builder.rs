//! From blocks to cubic segments: one path, whatever mixture of lines, splines and `G6` it is programmed in.

use super::akima::AkimaSpline;
use super::boundary::Boundary;
use super::bspline::{self, BSpline};
use super::chord::{delta, position, Chord, Measure};
use super::cubic::CubicSpline;
use super::error::{GeometryError, GeometryErrorKind};
use super::g6;
use super::line;
use super::queue::{Knot, SegmentQueue};
use super::segment::PathSegment;
use crate::config::Config;
use crate::nc::command::{BoundaryCondition, Motion, Move, SplineKind, SplineSpec};
use crate::units::{AxisVec, Position};

/// The spline being collected.
#[derive(Clone, Copy)]
struct Open {
    kind: SplineKind,
    /// End condition of the newest block.
    end: BoundaryCondition,
    /// Over what the newest chord is measured.
    measure: Measure,
    /// A block without motion has ended it; it waits for the direction of the next one that moves.
    closing: bool,
}

/// Takes motion blocks, yields cubic segments in path order. Holds at most one open spline, in bounded memory.
///
/// Segments join exactly: each starts on the bits on which the last one ended. Inside a spline, neighbours share one
/// slope per unit of parameter, so their tangents agree to the rounding of `f32`.
///
/// Blocks without motion make no segment. An exact stop asked for by one applies where the path then stands: at the
/// newest knot of an open spline; after anything else the segment has already been handed on and the stop is lost.
pub struct SegmentBuilder {
    position: Position,
    open: Option<Open>,
    akima: AkimaSpline,
    cubic: CubicSpline,
    bspline: BSpline,
    queue: SegmentQueue,
}

impl SegmentBuilder {
    /// A builder whose path begins at `start`.
    #[must_use]
    pub const fn new(_config: &Config, start: Position) -> Self {
        Self {
            position: start,
            open: None,
            akima: AkimaSpline::new(),
            cubic: CubicSpline::new(),
            bspline: BSpline::new(),
            queue: SegmentQueue::new(),
        }
    }

    /// Forgets everything; the path begins anew at `start`, with no block before it.
    pub fn reset(&mut self, start: Position) {
        self.position = start;
        self.open = None;
        self.queue.clear();
    }

    /// Position of the last accepted end point.
    #[must_use]
    pub fn position(&self) -> Position {
        self.position
    }

    /// True while a spline is being collected or segments wait to be drained.
    #[must_use]
    pub fn is_open(&self) -> bool {
        self.open.is_some() || !self.queue.is_empty()
    }

    /// Next finished segment, in path order.
    pub fn next(&mut self, _config: &Config) -> Option<PathSegment> {
        self.queue.pop()
    }

    /// Takes the next block. [`SegmentBuilder::next`] must have been called until it gave `None`.
    ///
    /// A spline is complete when a block of another kind arrives; its end tangent (`ETAN`) is the direction of that
    /// block where that is known from the block alone (straight blocks, `G6`, the polygon of a B-spline).
    ///
    /// # Errors
    /// The block is not accepted. Where the block itself is wrong (everything but `NotFinite` and `OutOfRange`
    /// in the course of a curve), an open spline stands as it was and [`SegmentBuilder::finish`] completes it up to the
    /// block before. Where the curve is wrong, the open spline is dropped: call [`SegmentBuilder::reset`].
    pub fn push(&mut self, config: &Config, block: &Move) -> Result<(), GeometryError> {
        let fail = |kind| GeometryError {
            block: block.block,
            kind,
        };
        if !self.queue.is_empty() {
            return Err(fail(GeometryErrorKind::NotDrained));
        }
        if block.motion != Motion::Rapid && !(block.feed.is_finite() && block.feed > 0.0) {
            return Err(fail(GeometryErrorKind::Feed));
        }
        let knot = Knot::new(position(config, &block.target).map_err(fail)?, block);
        let by = delta(config, &self.position, &knot.at).map_err(fail)?;
        match block.motion {
            Motion::Rapid | Motion::Linear => {
                if knot.at == self.position {
                    self.rest(block.exact_stop);
                    return Ok(());
                }
                self.complete(config, Some(by))?;
                line::emit(config, &mut self.queue, &self.position, &knot, &by)?;
            }
            Motion::Cubic(cubic) => {
                let (start, end) =
                    g6::slopes(config, &self.position, &block.target, &cubic).map_err(fail)?;
                self.complete(config, Some(start))?;
                let start = g6::smooth_start(start, self.queue.tail());
                self.queue.emit(config, &self.position, &knot, start, end)?;
            }
            Motion::Spline(spec) => self.spline(config, &spec, knot, &by)?,
            Motion::Arc(_) | Motion::Polynomial(_) => {
                return Err(fail(GeometryErrorKind::NotFinite));
            }
        }
        self.position = knot.at;
        Ok(())
    }

    /// The path ends here (program end, standstill function, time-out): completes an open spline.
    ///
    /// Without a block behind it, `ETAN` is taken as `ENAT`.
    ///
    /// # Errors
    /// `NotFinite` or `OutOfRange` in the last part of the spline, which is then dropped.
    pub fn finish(&mut self, config: &Config) -> Result<(), GeometryError> {
        self.complete(config, None)
    }

    /// One point of a spline.
    fn spline(
        &mut self,
        config: &Config,
        spec: &SplineSpec,
        knot: Knot,
        by: &AxisVec,
    ) -> Result<(), GeometryError> {
        let fail = |kind| knot.error(kind);
        if spec.kind == SplineKind::BSpline {
            bspline::validate(spec).map_err(fail)?;
        }
        let chord = Chord::new(config, by);
        let continues = self
            .open
            .is_some_and(|open| open.kind == spec.kind && !open.closing);
        let measure = match (&chord, self.open) {
            (Some(chord), _) => chord.measure,
            (None, Some(open)) if continues => open.measure,
            (None, _) => Measure::Linear,
        };
        if chord.is_none() && spec.kind != SplineKind::BSpline {
            self.rest_in_spline(spec, knot.exact_stop, continues);
            return Ok(());
        }
        if !continues {
            // The polygon is tangent to a B-spline; how A and C begin is not known yet.
            let direction = (spec.kind == SplineKind::BSpline).then_some(*by);
            self.complete(config, direction)?;
            let origin = Knot::origin(self.position);
            let begin = Boundary::resolve(config, spec.begin, self.queue.tail(), measure);
            match spec.kind {
                SplineKind::Akima => self.akima.start(origin, begin),
                SplineKind::Cubic => self.cubic.start(origin, begin),
                SplineKind::BSpline => self.bspline.start(origin, spec),
            }
        } else if spec.kind == SplineKind::BSpline {
            self.bspline.accepts(spec).map_err(fail)?;
        }
        self.open = Some(Open {
            kind: spec.kind,
            end: spec.end,
            measure,
            closing: false,
        });
        let queue = &mut self.queue;
        let result = match (spec.kind, chord) {
            (SplineKind::BSpline, _) => self.bspline.push(config, queue, knot, spec.interval),
            (SplineKind::Akima, Some(chord)) => self.akima.push(config, queue, knot, &chord),
            (SplineKind::Cubic, Some(chord)) => self.cubic.push(config, queue, knot, &chord),
            (_, None) => Ok(()),
        };
        if result.is_err() {
            self.open = None;
        }
        result
    }

    /// A straight block without motion.
    fn rest(&mut self, exact_stop: bool) {
        if let Some(open) = &mut self.open {
            open.closing = true;
        }
        if exact_stop {
            self.stop_here();
        }
    }

    /// A point of an A- or C-spline that coincides with the one before.
    fn rest_in_spline(&mut self, spec: &SplineSpec, exact_stop: bool, continues: bool) {
        if let Some(open) = &mut self.open {
            if continues {
                open.end = spec.end;
            } else {
                open.closing = true;
            }
        }
        if exact_stop {
            self.stop_here();
        }
    }

    /// Makes the path rest at the newest point that is still in this stage.
    fn stop_here(&mut self) {
        let knot = match self.open.map(|open| open.kind) {
            Some(SplineKind::Akima) => Some(self.akima.last_mut()),
            Some(SplineKind::Cubic) => self.cubic.last_mut(),
            Some(SplineKind::BSpline) => Some(self.bspline.last_mut()),
            None => None,
        };
        if let Some(knot) = knot {
            knot.exact_stop = true;
        }
    }

    /// Completes an open spline; `next` is the direction of the block behind it.
    fn complete(&mut self, config: &Config, next: Option<AxisVec>) -> Result<(), GeometryError> {
        let Some(open) = self.open.take() else {
            return Ok(());
        };
        let end = Boundary::resolve(config, open.end, next, open.measure);
        match open.kind {
            SplineKind::Akima => self.akima.finish(config, &mut self.queue, end),
            SplineKind::Cubic => self.cubic.finish(config, &mut self.queue, end),
            SplineKind::BSpline => self.bspline.finish(config, &mut self.queue),
        }
    }
}
