//! From blocks to cubic segments: one path, whatever mixture of lines, arcs, splines, `POLY` and `G6` it is programmed in.
//!
//! In: blocks ([`SegmentBuilder::push`]). Out: segments ([`SegmentBuilder::next`]), some of them cut only when they are
//! asked for: a circle may be thousands.

use super::akima::AkimaSpline;
use super::boundary::Boundary;
use super::bspline::{self, BSpline, Piece};
use super::chord::{delta, position, Chord, Measure};
use super::circle::Circle;
use super::cubic::CubicSpline;
use super::error::{GeometryError, GeometryErrorKind};
use super::fit::{curve_length, displacement};
use super::g6;
use super::lazy::Lazy;
use super::line;
use super::polynomial::Fraction;
use super::queue::{Knot, SegmentQueue};
use super::segment::PathSegment;
use super::singular;
use super::tool_vector::{HeadAxes, JUMP};
use super::travel::TravelBounds;
use crate::config::Config;
use crate::nc::command::{BoundaryCondition, Motion, Move, SplineKind, SplineSpec};
use crate::units::{AxisVec, Position};

/// The spline being collected.
#[derive(Clone, Copy)]
struct Open {
    kind: SplineKind,
    /// Start condition in force.
    begin: BoundaryCondition,
    /// End condition of the newest block.
    end: BoundaryCondition,
    /// `SPLINEPATH` in force.
    axes: u8,
    /// Points so far of an A- or C-spline, the start among them; counts up to 255.
    points: u8,
    /// Text line of the newest point.
    block: u32,
    /// Over what the newest chord is measured.
    measure: Measure,
    /// A block without motion has ended it; it waits for the direction of the next one that moves.
    closing: bool,
}

impl Open {
    /// Points without which an A- or C-spline has no shape, its start among them.
    fn least(&self) -> u8 {
        let is_auto = |condition| condition == BoundaryCondition::NotAKnot;
        if is_auto(self.begin) || is_auto(self.end) {
            3
        } else {
            2
        }
    }
}

/// Takes motion blocks, yields cubic segments in path order. Holds at most one open spline, in bounded memory.
///
/// Segments join exactly: each starts on the bits on which the last one ended. Inside a spline, neighbours share one
/// slope per unit of parameter, so their tangents agree to the rounding of `f32`.
///
/// Blocks without motion make no segment. An exact stop asked for by one applies where the path then stands: at the
/// newest knot of an open spline; after anything else the segment has already been handed on, and the caller learns of
/// the stop from [`SegmentBuilder::take_stop`].
///
/// Feeds leave as mm/s (degree/s where no linear axis moves): `G93` is multiplied by the length of its block here.
pub struct SegmentBuilder {
    position: Position,
    open: Option<Open>,
    akima: AkimaSpline,
    cubic: CubicSpline,
    bspline: BSpline,
    queue: SegmentQueue,
    lazy: Option<Lazy>,
    /// Made when the first curve asks for it.
    travel: Option<TravelBounds>,
    /// A curve under way has failed; reported by the next call that can.
    failed: Option<GeometryError>,
    /// An exact stop where the path stands, whose segment has left.
    stop: bool,
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
            lazy: None,
            travel: None,
            failed: None,
            stop: false,
        }
    }

    /// Forgets everything; the path begins anew at `start`, with no block before it.
    pub fn reset(&mut self, start: Position) {
        self.position = start;
        self.open = None;
        self.cubic.clear();
        self.bspline = BSpline::new();
        self.queue.clear();
        self.lazy = None;
        self.failed = None;
        self.stop = false;
    }

    /// Position of the last accepted end point.
    #[must_use]
    pub fn position(&self) -> Position {
        self.position
    }

    /// True while a spline is being collected, segments wait to be drained or an error waits to be reported.
    #[must_use]
    pub fn is_open(&self) -> bool {
        self.open.is_some() || self.is_cutting() || self.failed.is_some()
    }

    /// True if [`SegmentBuilder::finish`] would not cut a spline short of the points it needs: with nothing open, or
    /// enough of it. A sender that merely pauses should not end a spline while this is false.
    #[must_use]
    pub fn can_finish(&self) -> bool {
        match self.open {
            Some(open) if open.kind == SplineKind::BSpline => self.bspline.has_enough(),
            Some(open) => open.points >= open.least(),
            None => true,
        }
    }

    /// What a curve met while [`SegmentBuilder::next`] cut it, once; the curve has been dropped.
    pub fn take_failure(&mut self) -> Option<GeometryError> {
        self.failed.take()
    }

    /// True once after a block without motion asked for an exact stop where the path stands, while the segment that leads
    /// there has already been handed on: whoever holds that segment stops at its end.
    pub fn take_stop(&mut self) -> bool {
        core::mem::take(&mut self.stop)
    }

    /// True while segments wait to be drained.
    fn is_cutting(&self) -> bool {
        !self.queue.is_empty()
            || self.lazy.is_some()
            || self.bspline.is_draining()
            || self.cubic.is_draining()
    }

    /// Next finished segment, in path order.
    ///
    /// `None` also if a curve fails on the way; the error is what the next [`SegmentBuilder::push`] or
    /// [`SegmentBuilder::finish`] returns.
    pub fn next(&mut self, config: &Config) -> Option<PathSegment> {
        loop {
            if let Some(segment) = self.queue.pop() {
                return Some(segment);
            }
            let result = if self.lazy.is_some() || self.bspline.is_draining() {
                self.cut(config)
            } else if self.cubic.is_draining() {
                self.cubic.drain(config, &mut self.queue)
            } else {
                return None;
            };
            if let Err(error) = result {
                self.failed = Some(error);
                self.lazy = None;
                self.drop_spline();
                return None;
            }
        }
    }

    /// The next piece of what makes many segments. Apart, because the common kinds need nothing of its large frame.
    #[inline(never)]
    fn cut(&mut self, config: &Config) -> Result<(), GeometryError> {
        let Some(lazy) = &mut self.lazy else {
            return self.drain(config);
        };
        if !lazy.advance(config, &mut self.queue)? {
            self.lazy = None;
        }
        Ok(())
    }

    /// Takes the next block. [`SegmentBuilder::next`] must have been called until it gave `None`.
    ///
    /// A spline is complete when a block of another kind arrives; its end tangent (`ETAN`) is the direction of that
    /// block where that is known from the block alone (all but A- and C-splines; of a B-spline its polygon).
    ///
    /// # Errors
    /// `NotDrained`: the block has not been taken; call `next` until `None` and push it again. Besides a caller that
    /// forgot, this happens where the block ends a spline.
    ///
    /// The block is not accepted. Where the block itself is wrong (everything but `NotFinite` and `OutOfRange`
    /// in the course of a curve), an open spline stands as it was and [`SegmentBuilder::finish`] completes it up to the
    /// block before. Where the curve is wrong, the open spline is dropped: call [`SegmentBuilder::reset`].
    pub fn push(&mut self, config: &Config, block: &Move) -> Result<(), GeometryError> {
        let fail = |kind| GeometryError {
            block: block.block,
            kind,
        };
        if let Some(error) = self.failed.take() {
            return Err(error);
        }
        if self.is_cutting() {
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
                self.complete_before(config, Some(by), &knot)?;
                line::emit(config, &mut self.queue, &self.position, &knot, &by)?;
            }
            Motion::Cubic(cubic) => {
                let (start, end) =
                    g6::slopes(config, &self.position, &block.target, &cubic).map_err(fail)?;
                self.complete_before(config, Some(start), &knot)?;
                let start = g6::smooth_start(start, self.queue.tail());
                self.queue.emit(config, &self.position, &knot, start, end)?;
            }
            Motion::Spline(spec) => self.spline(config, &spec, &knot, &by)?,
            Motion::Arc(arc) => {
                let circle = Circle::new(config, &self.position, &knot.at, &arc).map_err(fail)?;
                let timed = knot.timed(|| Some(circle.length(config)))?;
                let lazy = Lazy::circle(self.position, timed, circle);
                lazy.check(config, self.travel(config))?;
                self.complete_before(config, Some(circle.direction()), &knot)?;
                self.lazy = Some(lazy);
            }
            Motion::Polynomial(polynomial) => {
                let curve =
                    Fraction::new(config, &self.position, &knot.at, &polynomial).map_err(fail)?;
                let Some(direction) = curve.direction() else {
                    self.rest(block.exact_stop);
                    return Ok(());
                };
                let timed = knot.timed(|| curve_length(config, &curve))?;
                let Some(slopes) = curve.cubic() else {
                    let lazy = Lazy::fraction(self.position, timed, curve);
                    lazy.check(config, self.travel(config))?;
                    self.complete_before(config, Some(direction), &knot)?;
                    self.lazy = Some(lazy);
                    self.position = knot.at;
                    return Ok(());
                };
                self.complete_before(config, Some(direction), &knot)?;
                self.polynomial(config, slopes, timed)?;
            }
        }
        self.position = knot.at;
        Ok(())
    }

    /// The path ends here (program end, standstill function, time-out): completes an open spline.
    ///
    /// Without a block behind it, `ETAN` is taken as `ENAT`. Call [`SegmentBuilder::next`] until `None` afterwards, and
    /// this once more if [`SegmentBuilder::is_open`] still says so.
    ///
    /// # Errors
    /// `NotFinite`, `OutOfRange` or `TooFewPoints` in the last part of the spline, which is then dropped; what a curve
    /// has met since the last call.
    pub fn finish(&mut self, config: &Config) -> Result<(), GeometryError> {
        if let Some(error) = self.failed.take() {
            return Err(error);
        }
        self.complete(config, None)
    }

    fn travel(&mut self, config: &Config) -> &TravelBounds {
        self.travel.get_or_insert_with(|| TravelBounds::new(config))
    }

    /// A `POLY` block that is one cubic.
    ///
    /// Its start turns by up to 0.1 degree into the direction of the path, as that of a `G6` block does: printed
    /// coefficients are rounded.
    fn polynomial(
        &mut self,
        config: &Config,
        (slope_start, slope_end): (AxisVec, AxisVec),
        end: Knot,
    ) -> Result<(), GeometryError> {
        let slope_start = g6::smooth_start(slope_start, self.queue.tail());
        let queue = &mut self.queue;
        singular::emit(config, queue, &self.position, &end, slope_start, slope_end)
    }

    /// One point of a spline.
    fn spline(
        &mut self,
        config: &Config,
        spec: &SplineSpec,
        knot: &Knot,
        by: &AxisVec,
    ) -> Result<(), GeometryError> {
        let fail = |kind| knot.error(kind);
        if spec.kind == SplineKind::BSpline {
            bspline::validate(spec).map_err(fail)?;
        }
        let chord = Chord::new(config, by);
        let continues = !spec.first
            && self.open.is_some_and(|open| {
                open.kind == spec.kind && open.axes == spec.axes && !open.closing
            });
        let measure = match (&chord, self.open) {
            (Some(chord), _) => chord.measure,
            (None, Some(open)) if continues => open.measure,
            (None, _) => Measure::Linear,
        };
        if chord.is_none() && spec.kind != SplineKind::BSpline {
            self.rest_in_spline(spec, knot, continues);
            return Ok(());
        }
        if !continues {
            // The polygon is tangent to a B-spline; how A and C begin is not known yet.
            let direction = (spec.kind == SplineKind::BSpline).then_some(*by);
            self.complete_before(config, direction, knot)?;
            let origin = Knot::origin(self.position);
            let begin = Boundary::resolve(config, spec.begin, self.queue.tail(), measure);
            match spec.kind {
                SplineKind::Akima => self.akima.start(origin, begin, spec.axes),
                SplineKind::Cubic => self.cubic.start(origin, begin, spec.axes),
                SplineKind::BSpline => self.bspline.start(origin, spec),
            }
        } else if spec.kind == SplineKind::BSpline {
            self.bspline.accepts(spec).map_err(fail)?;
        }
        let before = self.open.filter(|_| continues);
        self.open = Some(Open {
            kind: spec.kind,
            begin: before.map_or(spec.begin, |open| open.begin),
            end: spec.end,
            axes: spec.axes,
            points: before.map_or(1, |open| open.points).saturating_add(1),
            block: knot.block,
            measure,
            closing: false,
        });
        let queue = &mut self.queue;
        let result = match (spec.kind, chord) {
            (SplineKind::BSpline, _) => self
                .bspline
                .push(config, queue, *knot, spec)
                .and_then(|span| self.span(config, span)),
            (SplineKind::Akima, Some(chord)) => self.akima.push(config, queue, *knot, &chord),
            (SplineKind::Cubic, Some(chord)) => {
                self.cubic.push(knot, &chord);
                Ok(())
            }
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
    fn rest_in_spline(&mut self, spec: &SplineSpec, knot: &Knot, continues: bool) {
        if let Some(open) = &mut self.open {
            if continues {
                open.end = spec.end;
                open.block = knot.block;
            } else {
                open.closing = true;
            }
        }
        if knot.exact_stop {
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
        match knot {
            Some(knot) => knot.exact_stop = true,
            None => self.stop = true,
        }
    }

    /// Completes an open spline before `block`, whose direction is `next`.
    ///
    /// # Errors
    /// As [`SegmentBuilder::complete`]; `NotDrained` if there was one: its end has to be drained first.
    fn complete_before(
        &mut self,
        config: &Config,
        next: Option<AxisVec>,
        block: &Knot,
    ) -> Result<(), GeometryError> {
        let position = self.position;
        self.complete(config, next)?;
        // A tool vector has turned the rotary axes to where no block said.
        if self.is_cutting() || self.position != position {
            return Err(block.error(GeometryErrorKind::NotDrained));
        }
        Ok(())
    }

    /// Takes a span of a B-spline that makes several segments.
    fn span(&mut self, config: &Config, span: Option<Piece>) -> Result<(), GeometryError> {
        if let Some(span) = span {
            let end = span.end.timed(|| curve_length(config, &span.curve))?;
            let lazy = Lazy::span(span.start, end, span.curve);
            lazy.check(config, self.travel(config))?;
            self.lazy = Some(lazy);
        }
        Ok(())
    }

    /// The next span of a B-spline that has ended.
    ///
    /// # Errors
    /// What is wrong with the curve; the spline is dropped.
    fn drain(&mut self, config: &Config) -> Result<(), GeometryError> {
        let result = self.drain_span(config);
        if result.is_err() {
            self.drop_spline();
        }
        result
    }

    #[cold]
    fn drop_spline(&mut self) {
        self.open = None;
        self.cubic.clear();
        self.bspline = BSpline::new();
    }

    fn drain_span(&mut self, config: &Config) -> Result<(), GeometryError> {
        let mut span = self.bspline.drain(config, &mut self.queue)?;
        if !self.bspline.is_draining() {
            let programmed = self.position;
            self.position = self.bspline.end().unwrap_or(programmed);
            if let Some(span) = &mut span {
                let kind = settle_tool(config, &mut span.end.at, &programmed);
                kind.map_err(|kind| span.end.error(kind))?;
                self.position = span.end.at;
            }
        }
        self.span(config, span)
    }

    /// Completes an open spline; `next` is the direction of the block behind it.
    fn complete(&mut self, config: &Config, next: Option<AxisVec>) -> Result<(), GeometryError> {
        let Some(open) = self.open.take() else {
            return Ok(());
        };
        if open.kind != SplineKind::BSpline && open.points < open.least() {
            return Err(GeometryError {
                block: open.block,
                kind: GeometryErrorKind::TooFewPoints {
                    least: open.least(),
                    got: open.points,
                },
            });
        }
        let end = Boundary::resolve(config, open.end, next, open.measure);
        match open.kind {
            SplineKind::Akima => self.akima.finish(config, &mut self.queue, end),
            SplineKind::Cubic => {
                self.cubic.finish(end);
                Ok(())
            }
            SplineKind::BSpline => self.bspline.finish(),
        }
    }
}

/// Ends a spline on the very angles its last block names: the program goes on from there, and what it does not turn must
/// not turn.
///
/// # Errors
/// `ToolJump` if the tool points where the block says, but with other angles.
fn settle_tool(
    config: &Config,
    end: &mut Position,
    programmed: &Position,
) -> Result<(), GeometryErrorKind> {
    if end == programmed {
        return Ok(());
    }
    let off = displacement(config, programmed, end)?;
    if off.iter().all(|by| libm::fabs(*by) <= JUMP) {
        *end = *programmed;
        return Ok(());
    }
    let head = HeadAxes::new(config)?;
    let [is, asked] = [&*end, programmed].map(|at| {
        let [tilt, turn] = [head.tilt, head.turn].map(|axis| {
            at[axis].to_num::<f64>() / config.axes[axis].steps_per_unit.to_num::<f64>()
        });
        head.vector(tilt, turn)
    });
    // Radian; a degree is 0.017.
    let differs = |(a, b): (f64, f64)| libm::fabs(a - b) > 0.02 * JUMP;
    if is.into_iter().zip(asked).any(differs) {
        Ok(())
    } else {
        Err(GeometryErrorKind::ToolJump)
    }
}
