//! B-splines of degree 2 or 3 with equal weights, clamped at both ends, streamed with a bounded look-ahead.
//!
//! In: control points; the position where the spline starts is the first. Coincident ones are legal: they pull.
//! Out: one cubic per knot span.
//!
//! Per knot, the Bezier points next to it are blossoms of the control points (L. Ramshaw, "Blossoming: a
//! connect-the-dots approach to splines", 1987). With F and G the Bezier points before and after the knot, b and
//! c the spans before and after it, the curve passes at `(c F + b G) / (b + c)` with slope `m = degree (G - F) / (b + c)`
//! per unit of knot parameter. Both neighbours use this one point, rounded once, and this one m times their own span.
//!
//! A span belongs to the block of the last control point that shapes it: Q_(j + degree) for span j. That block
//! gives its feed, its dynamics, its exact stop and its length (`PL`), so the last span ends with the last block; what
//! the blocks before Q_degree say about stops counts at the end of the first span, their `PL` counts for nothing
//! (at a clamped end there is no span for it).

use super::chord::{delta, offset, zip};
use super::error::{GeometryError, GeometryErrorKind};
use super::line;
use super::queue::{Knot, SegmentQueue};
use super::singular;
use crate::config::Config;
use crate::nc::command::SplineSpec;
use crate::units::{AxisVec, Position, Steps, AXES};

/// Control points that matter for one knot of a cubic: three, and the blocks of the two spans behind it.
const POINTS: usize = 6;

/// Where in the window the first control point of the knot lies that the newest control point completes.
fn knot_index(degree: u8) -> usize {
    if degree == 2 {
        3
    } else {
        1
    }
}

/// A control point and the knot span it completes.
#[derive(Clone, Copy)]
struct Control {
    knot: Knot,
    /// Length of span (index - degree); 0 where there is none.
    span: f32,
}

const NOWHERE: Control = Control {
    knot: Knot::origin([Steps::ZERO; AXES]),
    span: 0.0,
};

/// A knot of the curve.
#[derive(Clone, Copy)]
struct Break {
    at: Position,
    /// Slope per unit of knot parameter.
    m: AxisVec,
}

/// An open B-spline.
pub(super) struct BSpline {
    points: [Control; POINTS],
    degree: u8,
    weight: f32,
    /// Programmed control points so far, up to `POINTS`.
    count: u8,
    /// Exact stop asked for before the first span.
    early_stop: bool,
    last_break: Option<Break>,
}

impl BSpline {
    pub const fn new() -> Self {
        Self {
            points: [NOWHERE; POINTS],
            degree: 3,
            weight: 0.0,
            count: 0,
            early_stop: false,
            last_break: None,
        }
    }

    /// Begins a spline at `origin`; `spec` is that of its first block and must be valid.
    pub fn start(&mut self, origin: Knot, spec: &SplineSpec) {
        self.points = [NOWHERE; POINTS];
        self.points[POINTS - 1].knot = origin;
        self.degree = spec.degree;
        self.weight = spec.weight;
        self.count = 0;
        self.early_stop = false;
        self.last_break = None;
    }

    /// The newest control point.
    pub fn last_mut(&mut self) -> &mut Knot {
        &mut self.points[POINTS - 1].knot
    }

    /// Degree and weight agree with the spline that is open.
    ///
    /// # Errors
    /// `Degree`, `Weight`.
    pub fn accepts(&self, spec: &SplineSpec) -> Result<(), GeometryErrorKind> {
        if spec.degree != self.degree {
            Err(GeometryErrorKind::Degree)
        } else if spec.weight != self.weight {
            Err(GeometryErrorKind::Weight)
        } else {
            Ok(())
        }
    }

    /// Takes the next control point; `interval` is `PL`, already found positive.
    pub fn push(
        &mut self,
        config: &Config,
        queue: &mut SegmentQueue,
        mut knot: Knot,
        interval: Option<f32>,
    ) -> Result<(), GeometryError> {
        if usize::from(self.count) < POINTS {
            self.count += 1;
        }
        let mut span = 0.0;
        if self.count < self.degree {
            self.early_stop |= knot.exact_stop;
        } else {
            span = interval.unwrap_or(1.0);
            knot.exact_stop |= self.early_stop;
            self.early_stop = false;
        }
        self.advance(config, queue, Control { knot, span })
    }

    /// The spline ends at the newest control point.
    pub fn finish(
        &mut self,
        config: &Config,
        queue: &mut SegmentQueue,
    ) -> Result<(), GeometryError> {
        let end = self.points[POINTS - 1].knot;
        let fail = |kind| end.error(kind);
        if self.count < self.degree {
            // Fewer points than the degree asks for: one polynomial of the degree they allow.
            let first = self.points[POINTS - 1 - usize::from(self.count)].knot.at;
            if self.count == 1 {
                let by = delta(config, &first, &end.at).map_err(fail)?;
                return line::emit(config, queue, &first, &end, &by);
            }
            let middle = self.points[POINTS - 2].knot.at;
            let before = delta(config, &first, &middle).map_err(fail)?;
            let after = delta(config, &middle, &end.at).map_err(fail)?;
            return singular::emit(
                config,
                queue,
                &first,
                &end,
                before.map(|value| 2.0 * value),
                after.map(|value| 2.0 * value),
            );
        }
        for _ in 1..self.degree {
            // No span behind the end; the point itself has no influence.
            let nothing = Control {
                knot: end,
                span: 0.0,
            };
            self.advance(config, queue, nothing)?;
        }
        Ok(())
    }

    /// Moves the window on by one control point and emits the span this completes.
    fn advance(
        &mut self,
        config: &Config,
        queue: &mut SegmentQueue,
        control: Control,
    ) -> Result<(), GeometryError> {
        self.points.rotate_left(1);
        self.points[POINTS - 1] = control;
        let end = self.points[POINTS - usize::from(self.degree)].knot;
        let Some(next) = self.knot(config).map_err(|kind| end.error(kind))? else {
            return Ok(());
        };
        if let Some(last) = self.last_break {
            let span = self.points[POINTS - usize::from(self.degree)].span;
            let knot = Knot { at: next.at, ..end };
            let slope_start = last.m.map(|value| value * span);
            let slope_end = next.m.map(|value| value * span);
            singular::emit(config, queue, &last.at, &knot, slope_start, slope_end)?;
        }
        self.last_break = Some(next);
        Ok(())
    }

    /// The knot whose neighbourhood the window now covers; `None` before the first.
    fn knot(&self, config: &Config) -> Result<Option<Break>, GeometryErrorKind> {
        let window = &self.points[knot_index(self.degree)..];
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
        } else if c == 0.0 {
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
    if !matches!(spec.degree, 2 | 3) {
        return Err(GeometryErrorKind::Degree);
    }
    if !(spec.weight > 0.0) {
        return Err(GeometryErrorKind::Weight);
    }
    match spec.interval {
        Some(interval) if !(interval.is_finite() && interval > 0.0) => {
            Err(GeometryErrorKind::KnotInterval)
        }
        _ => Ok(()),
    }
}
