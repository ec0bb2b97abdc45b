//! One span of a rational B-spline as a rational Bezier curve.
//!
//! In: the homogeneous control points of the span (relative to where it starts) and the knots around it. Out: a
//! [`Curve`] for the fitter. The Bezier points are blossoms of the control points in homogeneous coordinates (L.
//! Ramshaw, "Blossoming: a connect-the-dots approach to splines", 1987; L. Piegl, W. Tiller, "The NURBS Book", 4.2):
//! every division in them is by the distance of two knots with the span between them, so equal knots need no care.
//! Spans of a lower degree are raised to degree three.

use super::error::GeometryErrorKind;
use super::fit::{displacement, place, Curve, Sample};
use super::tool_vector::{HeadAxes, ToolSpan};
use crate::config::Config;
use crate::units::{Position, AXES};

/// Weight, weight times offset per axis, weight times tool vector.
pub(super) type Homogeneous = [f64; 1 + AXES + 3];

/// A point between two others.
fn mix(a: &Homogeneous, b: &Homogeneous, part: f64) -> Homogeneous {
    core::array::from_fn(|k| (1.0 - part) * a[k] + part * b[k])
}

/// Bezier points, raised to degree three, of the span from knot `degree - 1` to knot `degree`.
///
/// `knots`: the first 2 `degree` count, in order, that span not empty. `points`: the first `degree` + 1 count.
fn bezier(degree: usize, knots: &[f64; 6], points: &[Homogeneous; 4]) -> [Homogeneous; 4] {
    let mut out = *points;
    for (index, to) in out.iter_mut().enumerate().take(degree + 1) {
        // The blossom with `index` arguments at the end of the span and the others at its start.
        let mut p = *points;
        for level in 1..=degree {
            let x = if level <= index {
                knots[degree]
            } else {
                knots[degree - 1]
            };
            for i in 0..=degree - level {
                let (low, high) = (knots[i + level - 1], knots[i + degree]);
                p[i] = mix(&p[i], &p[i + 1], (x - low) / (high - low));
            }
        }
        *to = p[0];
    }
    let [a, b, c, _] = out;
    match degree {
        1 => [a, mix(&a, &b, 1.0 / 3.0), mix(&a, &b, 2.0 / 3.0), b],
        2 => [a, mix(&a, &b, 2.0 / 3.0), mix(&b, &c, 1.0 / 3.0), c],
        _ => out,
    }
}

/// What one span is made of.
pub(super) struct Span<'a> {
    /// 1, 2 or 3.
    pub degree: usize,
    /// 2 `degree` knots, the span from number `degree` - 1 to number `degree`; not empty.
    pub knots: [f64; 6],
    /// `degree` + 1 control points relative to `start`.
    pub points: [Homogeneous; 4],
    /// Where the path stands: the curve at the first knot of the span.
    pub start: &'a Position,
    /// Programmed end of the block the span belongs to.
    pub target: &'a Position,
    /// The curve ends on `target`.
    pub ends_there: bool,
    /// One bit per axis that goes straight to `target`.
    pub linear: u8,
    /// The rotary axes follow the tool vector.
    pub tool: Option<&'a HeadAxes>,
}

/// A span as a [`Curve`].
#[derive(Clone, Copy)]
pub(crate) struct RationalSpan {
    weights: [f64; 4],
    /// Bezier points 1 to 3 times their weights; point 0 is the start of the span.
    points: [[f64; AXES]; 3],
    /// One bit per axis that goes along linearly, to `points[2]`.
    linear: u8,
    tool: Option<(ToolSpan, [usize; 2])>,
}

impl RationalSpan {
    /// The curve and the point at which it ends, rounded once.
    ///
    /// # Errors
    /// `Weight` if the denominator may vanish; `NotFinite`, `OutOfRange`; `ToolVector`, `ToolJump`.
    pub fn new(config: &Config, span: &Span) -> Result<(Self, Position), GeometryErrorKind> {
        let rows = bezier(span.degree, &span.knots, &span.points);
        let weights = rows.map(|row| row[0]);
        // Weights inside are not negative, so this is enough for all of [0, 1].
        if !(weights[0] > 0.0 && weights[3] > 0.0) {
            return Err(GeometryErrorKind::Weight);
        }
        // Where the span ends, from where it starts.
        let mut by = displacement(config, span.start, span.target)?;
        if !span.ends_there {
            for (axis, value) in by.iter_mut().enumerate() {
                if span.linear & (1 << axis) == 0 {
                    *value = rows[3][1 + axis] / weights[3];
                }
            }
        }
        let mut tool = None;
        if let Some(head) = span.tool {
            let axes = [head.tilt, head.turn];
            let now = axes.map(|axis| {
                span.start[axis].to_num::<f64>() / config.axes[axis].steps_per_unit.to_num::<f64>()
            });
            let vectors = rows.map(|row| [row[1 + AXES], row[2 + AXES], row[3 + AXES]]);
            let angles = ToolSpan::new(head, &vectors, now)?;
            let last = angles.at(1.0).ok_or(GeometryErrorKind::ToolVector)?;
            for (axis, to) in axes.into_iter().zip(last.offset) {
                by[axis] = to;
            }
            tool = Some((angles, axes));
        }
        let mut end = place(config, span.start, &by)?;
        if span.ends_there || span.linear != 0 {
            // On the bits of the program, not a rounding of the way there.
            for (axis, at) in end.iter_mut().enumerate() {
                let follows = span
                    .tool
                    .is_some_and(|head| axis == head.tilt || axis == head.turn);
                if !follows && (span.ends_there || span.linear & (1 << axis) != 0) {
                    *at = span.target[axis];
                }
            }
        }
        let by = displacement(config, span.start, &end)?;
        let points = [1, 2, 3].map(|k| {
            core::array::from_fn(|axis| match k {
                // The rounded end, so that the curve ends where the next one starts.
                3 if span.linear & (1 << axis) != 0 => by[axis],
                3 => by[axis] * weights[3],
                _ => rows[k][1 + axis],
            })
        });
        let curve = Self {
            weights,
            points,
            linear: span.linear,
            tool,
        };
        Ok((curve, end))
    }
}

impl RationalSpan {
    /// True only if the whole curve stays `margin` inside `room` (see [`super::travel::TravelBounds::room`]): it lies in
    /// the hull of its Bezier points. Nothing is known so quickly of angles, nor of weights that differ by much.
    pub fn is_within(&self, [low, high]: &[[f64; AXES]; 2], margin: f64) -> bool {
        let least = self.weights.iter().copied().fold(f64::INFINITY, f64::min);
        if self.tool.is_some() || !self.weights.iter().all(|weight| *weight < 1e4 * least) {
            return false;
        }
        let [_, wb, wc, wd] = self.weights;
        let [b, c, d] = &self.points;
        (0..AXES).all(|axis| {
            let (low, high) = (low[axis] + margin, high[axis] - margin);
            let is_within = |at: f64, weight: f64| at >= low * weight && at <= high * weight;
            if self.linear & (1 << axis) != 0 {
                return d[axis] == 0.0 || is_within(0.0, 1.0) && is_within(d[axis], 1.0);
            }
            let moves = b[axis] != 0.0 || c[axis] != 0.0 || d[axis] != 0.0;
            !moves
                || is_within(0.0, 1.0)
                    && is_within(b[axis], wb)
                    && is_within(c[axis], wc)
                    && is_within(d[axis], wd)
        })
    }
}

impl Curve for RationalSpan {
    fn at(&self, t: f64) -> Option<Sample> {
        let s = 1.0 - t;
        let basis = [s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t];
        let dbasis = [
            -3.0 * s * s,
            3.0 * s * (s - 2.0 * t),
            3.0 * t * (2.0 * s - t),
            3.0 * t * t,
        ];
        let sum = |with: &[f64; 4]| -> f64 {
            self.weights
                .iter()
                .zip(with)
                .map(|(weight, part)| weight * part)
                .sum()
        };
        let (weight, dweight) = (sum(&basis), sum(&dbasis));
        if !(weight > 0.0) {
            return None;
        }
        let [b, c, d] = &self.points;
        let mut out = Sample {
            offset: [0.0; AXES],
            slope: [0.0; AXES],
        };
        for axis in 0..AXES {
            if self.linear & (1 << axis) != 0 {
                out.offset[axis] = t * d[axis];
                out.slope[axis] = d[axis];
                continue;
            }
            let sum = |with: &[f64; 4]| b[axis] * with[1] + c[axis] * with[2] + d[axis] * with[3];
            let offset = sum(&basis) / weight;
            out.offset[axis] = offset;
            out.slope[axis] = (sum(&dbasis) - offset * dweight) / weight;
        }
        if let Some((tool, axes)) = &self.tool {
            let angles = tool.at(t)?;
            for (k, axis) in axes.iter().enumerate() {
                out.offset[*axis] = angles.offset[k];
                out.slope[*axis] = angles.slope[k];
            }
        }
        Some(out)
    }
}
