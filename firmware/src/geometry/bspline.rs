//! B-splines of degree 1 to 3, clamped at both ends, with any weights and knots, streamed with a bounded look-ahead.
//!
//! In: control points; the position where the spline starts is the first. Coincident ones are legal: they pull.
//! Out: knot spans in path order. A span whose control points have equal weights is one cubic; any other (unequal
//! weights, axes outside `SPLINEPATH`, a tool vector) is a [`Piece`] for the fitter, see [`super::rational`].
//!
//! Of the cubics: per knot, the Bezier points next to it are blossoms of the control points (L. Ramshaw, "Blossoming:
//! a connect-the-dots approach to splines", 1987). With F and G the Bezier points before and after the knot, b and
//! c the spans before and after it, the curve passes at `(c F + b G) / (b + c)` with slope `m = degree (G - F) / (b + c)`
//! per unit of knot parameter. Both neighbours use one point, rounded once, and one m times their own span. Where knots
//! coincide one of b and c is zero, and the formulas give the slope on the side of the other.
//!
//! A span belongs to the block of the last control point that shapes it: Q_(j + degree) for span j. That block
//! gives its feed, its dynamics, its exact stop and its length (`PL`), so the last span ends with the last block; what
//! the blocks before Q_degree say about stops counts at the end of the first span, their `PL` counts for nothing
//! (at a clamped end there is no span for it). Axes outside `SPLINEPATH` go linearly in the knot parameter from the
//! point programmed in the block before to that of the span's own block; over the first span, from the start.
//!
//! The start has no block of its own. Its weight is that of the blocks of the first span if these agree, and 1
//! otherwise; its tool vector is the one the rotary axes show, as long as that of the first block. A first block that
//! stays at the start with an interval of 0 is not a control point but says both (Fanuc programs the start with `R`).

use super::chord::{delta, offset, zip};
use super::error::{GeometryError, GeometryErrorKind};
use super::fit::displacement;
use super::line;
use super::queue::{Knot, SegmentQueue};
use super::rational::{Homogeneous, RationalSpan, Span};
use super::singular;
use super::tool_vector::HeadAxes;
use crate::config::Config;
use crate::nc::command::SplineSpec;
use crate::units::{AxisVec, Nano, Position, Steps, AXES};

/// Control points that matter for one knot of a cubic: three, and the blocks of the two spans behind it.
const POINTS: usize = 6;

/// `SPLINEPATH` with every axis.
const ALL_AXES: u8 = (1 << AXES) - 1;

/// A control point and the knot span it completes.
#[derive(Clone, Copy)]
struct Control {
    knot: Knot,
    /// Length of span (index - degree); 0 where there is none.
    span: f32,
    weight: f32,
    /// From the control point to that of the second curve, mm.
    tool: [f32; 3],
}

const NOWHERE: Control = Control {
    knot: Knot::origin([Steps::ZERO; AXES]),
    span: 0.0,
    weight: 1.0,
    tool: [0.0; 3],
};

/// A knot of the curve.
#[derive(Clone, Copy)]
struct Break {
    at: Position,
    /// Slope per unit of knot parameter, weights being equal; on the right where it has two.
    m: AxisVec,
}

/// A span that takes more than one cubic.
pub(super) struct Piece {
    /// Where the path stands.
    pub start: Position,
    /// Where the span ends, and what its block says.
    pub end: Knot,
    /// The way there.
    pub curve: RationalSpan,
}

/// An open B-spline.
pub(super) struct BSpline {
    points: [Control; POINTS],
    degree: u8,
    /// One bit per axis outside `SPLINEPATH`.
    linear: u8,
    /// The head, where there is a tool vector.
    head: Option<HeadAxes>,
    has_tool: bool,
    /// Programmed control points so far, up to `POINTS`.
    count: u8,
    /// The start has been given a weight and a tool vector.
    has_origin: bool,
    /// Knots that coincide with the newest one, less one.
    equal: u8,
    /// Spans that may still come of a spline that has ended.
    draining: u8,
    /// Exact stop asked for before the first span.
    early_stop: bool,
    last_break: Option<Break>,
}

impl BSpline {
    pub const fn new() -> Self {
        Self {
            points: [NOWHERE; POINTS],
            degree: 3,
            linear: 0,
            head: None,
            has_tool: false,
            count: 0,
            has_origin: false,
            equal: 0,
            draining: 0,
            early_stop: false,
            last_break: None,
        }
    }

    /// Begins a spline at `origin`; `spec` is that of its first block and must be valid.
    pub fn start(&mut self, origin: Knot, spec: &SplineSpec) {
        *self = Self::new();
        self.points[POINTS - 1].knot = origin;
        self.degree = spec.degree;
        self.linear = ALL_AXES & !spec.axes;
        self.has_tool = spec.tool_point.is_some();
        // The clamped knot at the start is full.
        self.equal = spec.degree.saturating_sub(1);
        if spec.degree == 1 {
            self.last_break = Some(Break {
                at: origin.at,
                m: [0.0; AXES],
            });
        }
    }

    /// The newest control point.
    pub fn last_mut(&mut self) -> &mut Knot {
        &mut self.points[POINTS - 1].knot
    }

    /// The block continues the spline that is open.
    ///
    /// # Errors
    /// `Degree`, `SplineAxes`.
    pub fn accepts(&self, spec: &SplineSpec) -> Result<(), GeometryErrorKind> {
        if spec.degree != self.degree {
            Err(GeometryErrorKind::Degree)
        } else if self.linear != ALL_AXES & !spec.axes || self.has_tool != spec.tool_point.is_some()
        {
            Err(GeometryErrorKind::SplineAxes)
        } else {
            Ok(())
        }
    }

    /// True if there are as many control points as the degree asks for.
    pub fn has_enough(&self) -> bool {
        self.count >= self.degree
    }

    /// True while spans of a spline that has ended may still come.
    pub fn is_draining(&self) -> bool {
        self.draining > 0
    }

    /// Where the spans so far have led: behind the last one, the end of the path with its rotary angles.
    ///
    /// `None` before the first knot.
    pub fn end(&self) -> Option<Position> {
        self.last_break.map(|last| last.at)
    }

    /// Takes the next control point, which completes at most one span: queued, or given back.
    ///
    /// # Errors
    /// `KnotInterval`, `ToolVector`: the block is not taken. `Weight`, `ToolJump`, `ToolVector`, `NotFinite`, `OutOfRange`:
    /// in the curve.
    pub fn push(
        &mut self,
        config: &Config,
        queue: &mut SegmentQueue,
        mut knot: Knot,
        spec: &SplineSpec,
    ) -> Result<Option<Piece>, GeometryError> {
        let block = knot.block;
        let fail = |kind| GeometryError { block, kind };
        let tool = match &spec.tool_point {
            Some(point) => self.vector(config, &knot, point).map_err(fail)?,
            None => [0.0; 3],
        };
        let interval = spec.interval.unwrap_or(1.0);
        if self.count == 0 && !self.has_origin && interval == 0.0 && self.is_at_start(&knot) {
            let origin = &mut self.points[POINTS - 1];
            origin.weight = spec.weight;
            origin.tool = tool;
            origin.knot.block = knot.block;
            self.has_origin = true;
            self.early_stop |= knot.exact_stop;
            return Ok(None);
        }
        let mut span = 0.0;
        if self.count + 1 < self.degree {
            self.early_stop |= knot.exact_stop;
        } else {
            span = interval;
            if span > 0.0 {
                self.equal = 0;
            } else if self.equal + 1 < self.degree {
                self.equal += 1;
            } else {
                return Err(fail(GeometryErrorKind::KnotInterval));
            }
            knot.exact_stop |= self.early_stop;
            self.early_stop = false;
        }
        if self.count == 0 && !self.has_origin {
            self.show_tool(config, &tool);
        }
        if usize::from(self.count) < POINTS {
            self.count += 1;
        }
        let control = Control {
            knot,
            span,
            weight: spec.weight,
            tool,
        };
        self.advance(config, queue, control)
    }

    /// The spline ends at the newest control point: its last spans come from [`BSpline::drain`].
    ///
    /// # Errors
    /// `TooFewPoints`; `KnotInterval` if knots inside coincide with the last one; `Weight` if the last point has none.
    pub fn finish(&mut self) -> Result<(), GeometryError> {
        let end = self.points[POINTS - 1];
        if !self.has_enough() {
            return Err(end.knot.error(GeometryErrorKind::TooFewPoints {
                least: self.degree.saturating_add(1),
                got: self.count.saturating_add(1),
            }));
        }
        if end.span == 0.0 {
            return Err(end.knot.error(GeometryErrorKind::KnotInterval));
        }
        if end.weight == 0.0 {
            return Err(end.knot.error(GeometryErrorKind::Weight));
        }
        // At least one, so that every B-spline ends the same way.
        self.draining = self.degree.saturating_sub(1).max(1);
        Ok(())
    }

    /// The next span of a spline that has ended: queued, given back, or none where knots coincide.
    ///
    /// # Errors
    /// As those of [`BSpline::push`] in the curve; the spline is over.
    pub fn drain(
        &mut self,
        config: &Config,
        queue: &mut SegmentQueue,
    ) -> Result<Option<Piece>, GeometryError> {
        if self.draining == 0 {
            return Ok(None);
        }
        self.draining -= 1;
        if self.degree == 1 {
            return Ok(None);
        }
        // No span behind the end; the point itself has no influence.
        let nothing = Control {
            span: 0.0,
            ..self.points[POINTS - 1]
        };
        let result = self.advance(config, queue, nothing);
        if result.is_err() {
            self.draining = 0;
        }
        result
    }

    /// From a control point to `point`, mm.
    fn vector(
        &mut self,
        config: &Config,
        knot: &Knot,
        point: &[Nano; 3],
    ) -> Result<[f32; 3], GeometryErrorKind> {
        let head = match self.head {
            Some(head) => head,
            None => HeadAxes::new(config)?,
        };
        self.head = Some(head);
        let mut out = [0.0; 3];
        for ((value, axis), to) in out.iter_mut().zip(head.linear).zip(point) {
            let steps = config
                .steps_from_nano(axis, *to)
                .and_then(|to| to.checked_sub(knot.at[axis]))
                .ok_or(GeometryErrorKind::OutOfRange { axis })?;
            *value =
                (steps.to_num::<f64>() / config.axes[axis].steps_per_unit.to_num::<f64>()) as f32;
        }
        if out == [0.0; 3] {
            return Err(GeometryErrorKind::ToolVector);
        }
        Ok(out)
    }

    /// Gives the start the vector its rotary axes show, as long as `next`.
    fn show_tool(&mut self, config: &Config, next: &[f32; 3]) {
        let origin = &mut self.points[POINTS - 1];
        let Some(head) = &self.head else {
            return;
        };
        let [tilt, turn] = [head.tilt, head.turn].map(|axis| {
            origin.knot.at[axis].to_num::<f64>() / config.axes[axis].steps_per_unit.to_num::<f64>()
        });
        let length = next
            .iter()
            .map(|x| f64::from(*x) * f64::from(*x))
            .sum::<f64>();
        let length = libm::sqrt(length);
        origin.tool = head.vector(tilt, turn).map(|x| (x * length) as f32);
    }

    /// The block programs the point at which the spline starts.
    fn is_at_start(&self, knot: &Knot) -> bool {
        let origin = &self.points[POINTS - 1].knot;
        (0..AXES).all(|axis| self.turns(axis) || knot.at[axis] == origin.at[axis])
    }

    /// The axis follows the tool vector.
    fn turns(&self, axis: usize) -> bool {
        self.head
            .is_some_and(|head| axis == head.tilt || axis == head.turn)
    }

    /// Where in the window the control points of the newest complete span begin.
    fn first(&self) -> usize {
        POINTS - 2 * usize::from(self.degree)
    }

    /// Control points of the newest complete span.
    fn controls(&self) -> &[Control] {
        let first = self.first();
        &self.points[first..=first + usize::from(self.degree)]
    }

    /// Settles the weight of the start once the first span has all its blocks.
    fn weigh_start(&mut self) {
        if self.has_origin || self.count != self.degree {
            return;
        }
        self.has_origin = true;
        let (before, blocks) = self.points.split_at_mut(POINTS - usize::from(self.degree));
        let (Some(origin), Some(first)) = (before.last_mut(), blocks.first()) else {
            return;
        };
        if blocks.iter().all(|block| block.weight == first.weight) {
            origin.weight = first.weight;
        }
    }

    /// Moves the window on by one control point and emits the span this completes.
    fn advance(
        &mut self,
        config: &Config,
        queue: &mut SegmentQueue,
        control: Control,
    ) -> Result<Option<Piece>, GeometryError> {
        self.points.rotate_left(1);
        self.points[POINTS - 1] = control;
        self.weigh_start();
        let newest = &self.points[POINTS - usize::from(self.degree)];
        let (mut end, span) = (newest.knot, newest.span);
        let block = end.block;
        let fail = |kind| GeometryError { block, kind };
        let Some(mut next) = self.knot(config).map_err(fail)? else {
            // Knots coincide on both sides, or the spline has not begun.
            return Ok(None);
        };
        let Some(last) = self.last_break else {
            self.last_break = Some(next);
            return Ok(None);
        };
        if span == 0.0 {
            // No span between equal knots: the same point, the slope on its other side.
            next.at = last.at;
            self.last_break = Some(next);
            return Ok(None);
        }
        let mut piece = None;
        if self.is_plain() {
            end.at = next.at;
            if self.degree == 1 {
                let by = delta(config, &last.at, &end.at).map_err(fail)?;
                line::emit(config, queue, &last.at, &end, &by)?;
            } else {
                let slope_start = last.m.map(|value| value * span);
                let slope_end = next.m.map(|value| value * span);
                singular::emit(config, queue, &last.at, &end, slope_start, slope_end)?;
            }
        } else {
            let (curve, at) = self.curve(config, &last.at, &end.at).map_err(fail)?;
            next.at = at;
            end.at = at;
            piece = Some(Piece {
                start: last.at,
                end,
                curve,
            });
        }
        self.last_break = Some(next);
        Ok(piece)
    }

    /// The newest complete span is a cubic.
    fn is_plain(&self) -> bool {
        let controls = self.controls();
        let weight = controls.first().map_or(0.0, |first| first.weight);
        self.linear == 0
            && !self.has_tool
            && weight > 0.0
            && controls.iter().all(|control| control.weight == weight)
    }

    /// The newest complete span, which is no cubic, and where it ends.
    fn curve(
        &self,
        config: &Config,
        start: &Position,
        target: &Position,
    ) -> Result<(RationalSpan, Position), GeometryErrorKind> {
        let degree = usize::from(self.degree);
        // Between the 2 degree knots that shape the span.
        let spans = &self.points[self.first() + 1..];
        let mut knots = [0.0; 6];
        for k in 1..degree {
            let (before, after) = (degree - 1 - k, degree - 1 + k);
            knots[before] = knots[before + 1] - f64::from(spans[before].span);
            knots[after] = knots[after - 1] + f64::from(spans[after - 1].span);
        }
        let last = 2 * degree - 1;
        knots[last] = knots[last - 1] + f64::from(spans[last - 1].span);
        let mut points: [Homogeneous; 4] = [[0.0; 1 + AXES + 3]; 4];
        for (row, control) in points.iter_mut().zip(self.controls()) {
            let weight = f64::from(control.weight);
            let by = displacement(config, start, &control.knot.at)?;
            row[0] = weight;
            let values = by.into_iter().chain(control.tool.map(f64::from));
            for (to, value) in row.iter_mut().skip(1).zip(values) {
                *to = weight * value;
            }
        }
        RationalSpan::new(
            config,
            &Span {
                degree,
                knots,
                points,
                start,
                target,
                ends_there: spans[degree..].iter().all(|after| after.span == 0.0),
                linear: self.linear,
                tool: self.head.as_ref(),
            },
        )
    }

    /// The knot whose neighbourhood the window now covers; `None` before the first.
    fn knot(&self, config: &Config) -> Result<Option<Break>, GeometryErrorKind> {
        if self.degree == 1 {
            let at = self.points[POINTS - 1].knot.at;
            return Ok(Some(Break { at, m: [0.0; AXES] }));
        }
        // The first control point of the knot that the newest control point completes.
        let window = &self.points[self.first() + 1..];
        if self.degree == 2 {
            let [q0, q1, q2] = [&window[0], &window[1], &window[2]];
            let (b, c) = (q1.span, q2.span);
            if b + c == 0.0 {
                return Ok(None);
            }
            let edge = delta(config, &q0.knot.at, &q1.knot.at)?;
            let at = if b == 0.0 {
                q0.knot.at
            } else if c == 0.0 {
                q1.knot.at
            } else {
                offset(
                    config,
                    &q1.knot.at,
                    &edge.map(|value| -(c / (b + c)) * value),
                )?
            };
            let m = edge.map(|value| 2.0 * value / (b + c));
            return Ok(Some(Break { at, m }));
        }
        let [q0, q1, q2, q3, q4] = [&window[0], &window[1], &window[2], &window[3], &window[4]];
        let (a, b, c, d) = (q1.span, q2.span, q3.span, q4.span);
        if b + c == 0.0 {
            return Ok(None);
        }
        // F and G relative to Q1.
        let first = delta(config, &q0.knot.at, &q1.knot.at)?;
        let second = delta(config, &q1.knot.at, &q2.knot.at)?;
        let f = first.map(|value| -(c / (a + b + c)) * value);
        let g = second.map(|value| b / (b + c + d) * value);
        let at = if b == 0.0 {
            q0.knot.at
        } else if c + d == 0.0 {
            q2.knot.at
        } else {
            let by = zip(&f, &g, |f, g| (c * f + b * g) / (b + c));
            offset(config, &q1.knot.at, &by)?
        };
        let m = zip(&f, &g, |f, g| 3.0 * (g - f) / (b + c));
        Ok(Some(Break { at, m }))
    }
}

/// What a B-spline block must satisfy whatever came before it.
///
/// # Errors
/// `Degree`, `Weight`, `KnotInterval`.
pub(super) fn validate(spec: &SplineSpec) -> Result<(), GeometryErrorKind> {
    if !matches!(spec.degree, 1..=3) {
        return Err(GeometryErrorKind::Degree);
    }
    if !(spec.weight.is_finite() && spec.weight >= 0.0) {
        return Err(GeometryErrorKind::Weight);
    }
    match spec.interval {
        Some(interval) if !(interval.is_finite() && interval >= 0.0) => {
            Err(GeometryErrorKind::KnotInterval)
        }
        _ => Ok(()),
    }
}
