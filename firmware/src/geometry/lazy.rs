//! Blocks that make many segments: cut one at a time, as the planner asks for them.
//!
//! In: a circle, a rational curve or a span of a rational B-spline, where it starts and the knot it ends on. Out: its
//! segments, through the queue, in path order. Holds where it is and nothing else, so the number of segments does not
//! matter. [`Lazy::check`] looks at all of it first: a block that cannot be driven to its end must not begin.

use super::circle::Circle;
use super::error::{GeometryError, GeometryErrorKind};
use super::fit::{place, Curve, FitError, Fitter, Piece};
use super::polynomial::Fraction;
use super::queue::{Knot, SegmentQueue};
use super::rational::RationalSpan;
use super::segment::HermiteSegment;
use super::singular;
use super::travel::TravelBounds;
use crate::config::Config;
use crate::nc::command::Side;
use crate::units::Position;

/// What is being cut.
enum Shape {
    Circle(Circle),
    Fraction(Fraction, Fitter),
    Span(RationalSpan, Fitter),
}

/// A block under way.
pub(super) struct Lazy {
    origin: Position,
    end: Knot,
    shape: Shape,
}

impl Lazy {
    /// A circle from `origin` to `end`, whose feed is per time.
    pub fn circle(origin: Position, end: Knot, circle: Circle) -> Self {
        Self {
            origin,
            end,
            shape: Shape::Circle(circle),
        }
    }

    /// A rational curve from `origin` to `end`, whose feed is per time.
    pub fn fraction(origin: Position, end: Knot, fraction: Fraction) -> Self {
        Self {
            origin,
            end,
            shape: Shape::Fraction(fraction, Fitter::new()),
        }
    }

    /// A span of a B-spline from `origin` to `end`, whose feed is per time.
    pub fn span(origin: Position, end: Knot, span: RationalSpan) -> Self {
        Self {
            origin,
            end,
            shape: Shape::Span(span, Fitter::new()),
        }
    }

    /// Emits the next piece; `false` once the last one is out.
    ///
    /// # Errors
    /// `OutOfRange`, `NotFinite`, `Steep`: the block ends before its end point.
    pub fn advance(
        &mut self,
        config: &Config,
        queue: &mut SegmentQueue,
    ) -> Result<bool, GeometryError> {
        let end = self.end;
        let fail = |kind| end.error(kind);
        let piece = self.piece(config).map_err(|error| fail(error.into()))?;
        let Some(piece) = piece else {
            return Ok(false);
        };
        let start = place(config, &self.origin, &piece.start).map_err(fail)?;
        let knot = if piece.is_last {
            end
        } else {
            Knot {
                at: place(config, &self.origin, &piece.end).map_err(fail)?,
                exact_stop: false,
                ..end
            }
        };
        singular::emit(
            config,
            queue,
            &start,
            &knot,
            piece.slope_start,
            piece.slope_end,
        )?;
        Ok(!piece.is_last)
    }

    /// Looks at the whole block before any of it is driven.
    ///
    /// Under cutter compensation this is not the path, so there is nothing to be seen.
    ///
    /// # Errors
    /// `Travel` with the first axis that leaves its travel; what [`Lazy::advance`] would meet before the end.
    pub fn check(&self, config: &Config, bounds: &TravelBounds) -> Result<(), GeometryError> {
        if self.end.cutter.side != Side::On {
            return Ok(());
        }
        let room = bounds.room(config, &self.origin);
        let margin = f64::from(config.curve_tolerance);
        let axis = bounds.outside_at(&self.end.at);
        let axis = match &self.shape {
            _ if axis.is_some() => axis,
            Shape::Circle(circle) => circle.outside(&room),
            Shape::Fraction(curve, _) if curve.is_within(&room, margin) => None,
            Shape::Span(curve, _) if curve.is_within(&room, margin) => None,
            Shape::Fraction(curve, _) => self.rehearse(config, bounds, curve)?,
            Shape::Span(curve, _) => self.rehearse(config, bounds, curve)?,
        };
        axis.map_or(Ok(()), |axis| {
            Err(self.end.error(GeometryErrorKind::Travel { axis }))
        })
    }

    /// Cuts the whole curve as [`Lazy::advance`] will: the first axis that leaves its travel.
    fn rehearse(
        &self,
        config: &Config,
        bounds: &TravelBounds,
        curve: &impl Curve,
    ) -> Result<Option<usize>, GeometryError> {
        let fail = |kind| self.end.error(kind);
        let mut fitter = Fitter::new();
        let mut start = self.origin;
        let tolerance = f64::from(config.curve_tolerance);
        loop {
            let piece = fitter.next(curve, tolerance);
            let Some(piece) = piece.map_err(|error| fail(error.into()))? else {
                return Ok(None);
            };
            let end = if piece.is_last {
                self.end.at
            } else {
                place(config, &self.origin, &piece.end).map_err(fail)?
            };
            let segment = HermiteSegment {
                start,
                end,
                slope_start: piece.slope_start,
                slope_end: piece.slope_end,
            };
            let axis = bounds.outside(config, &segment);
            if axis.is_some() {
                return Ok(axis);
            }
            start = end;
        }
    }

    fn piece(&mut self, config: &Config) -> Result<Option<Piece>, FitError> {
        let tolerance = f64::from(config.curve_tolerance);
        match &mut self.shape {
            Shape::Circle(circle) => Ok(circle.next()),
            Shape::Fraction(fraction, fitter) => fitter.next(fraction, tolerance),
            Shape::Span(span, fitter) => fitter.next(span, tolerance),
        }
    }
}
