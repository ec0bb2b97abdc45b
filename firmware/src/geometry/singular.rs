//! Segments whose slope vanishes at an end: doubled control points, paths that fold back on themselves.
//!
//! The curve is fine there, its parameter is not: speed along it grows from nothing, and no polynomial u(s) follows
//! that. In: a cubic in Hermite form. Out: the same path on parameters that move everywhere. A straight piece becomes
//! a line. Of a bent one, the first sixteenth of the parameter (1/256 of the way, and all but straight) becomes a
//! cubic of its own with the same end points and directions.

use super::chord::{delta, measure, offset};
use super::error::GeometryError;
use super::queue::{Knot, SegmentQueue};
use crate::config::Config;
use crate::units::{sqrt, AxisVec, Position};

/// Parameter length e of the part that is replaced.
///
/// With P'(0) = 0 the curve is e^2 D + e^3 E, D = 3 chord - P'(1), E = P'(1) - 2 chord. Its direction turns by about
/// e |E| / |D| over a length of e^2 |D|, so the replacement stays within 4/27 e^3 |E|: 0.2 um for |E| = 5 mm.
const PART: f32 = 1.0 / 16.0;

/// A slope shorter than this fraction of the chord is as good as none.
const STILL: f32 = 1e-4;

/// Slopes this far from the chord's direction (fraction of the chord) are rounding.
const STRAIGHT: f32 = 2e-6;

fn dot(a: &AxisVec, b: &AxisVec) -> f32 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn norm(a: &AxisVec) -> f32 {
    sqrt(dot(a, a))
}

/// Slopes of the segment with difference `by`: the chord's where the segment is straight, monotone, and starts or
/// ends at rest; otherwise as they are.
pub(super) fn straighten(
    by: &AxisVec,
    slope_start: AxisVec,
    slope_end: AxisVec,
) -> (AxisVec, AxisVec) {
    let chord = dot(by, by);
    // Twice the square of what is_still asks: no rounding matters, and most segments need no root.
    let is_moving = |slope: &AxisVec| dot(slope, slope) > 2.0 * STILL * STILL * chord;
    if is_moving(&slope_start) && is_moving(&slope_end) {
        return (slope_start, slope_end);
    }
    let chord = sqrt(chord);
    let along = |slope: &AxisVec| dot(slope, by) / (chord * chord);
    let is_straight = |slope: &AxisVec| {
        let part = along(slope);
        let aside: AxisVec = core::array::from_fn(|axis| slope[axis] - part * by[axis]);
        // At most three chords long: beyond that the cubic may overshoot its end.
        norm(&aside) <= STRAIGHT * chord && (-STILL..=3.0 + STILL).contains(&part)
    };
    let is_still = |slope: &AxisVec| norm(slope) <= STILL * chord;
    if chord > 0.0
        && (is_still(&slope_start) || is_still(&slope_end))
        && is_straight(&slope_start)
        && is_straight(&slope_end)
    {
        (*by, *by)
    } else {
        (slope_start, slope_end)
    }
}

/// The part of a curve next to an end at rest.
struct Part {
    /// Its far end, relative to the end at rest.
    to: AxisVec,
    /// Slope there, per unit u of the whole curve, away from the end at rest.
    slope: AxisVec,
    /// Slopes of its replacement, away from the end at rest: there, and at the far end.
    near: AxisVec,
    far: AxisVec,
}

/// `by` and `slope` lead away from the end at rest, `slope` being that at the other end.
fn part(by: &AxisVec, slope: &AxisVec) -> Part {
    let d: AxisVec = core::array::from_fn(|axis| 3.0 * by[axis] - slope[axis]);
    let e: AxisVec = core::array::from_fn(|axis| slope[axis] - 2.0 * by[axis]);
    let to: AxisVec = core::array::from_fn(|axis| PART * PART * (d[axis] + PART * e[axis]));
    let out: AxisVec = core::array::from_fn(|axis| PART * (2.0 * d[axis] + 3.0 * PART * e[axis]));
    let length = norm(&to);
    let scaled = |v: &AxisVec| {
        let scale = length / norm(v);
        v.map(|value| value * scale)
    };
    Part {
        near: scaled(&d),
        far: scaled(&out),
        slope: out,
        to,
    }
}

/// As [`SegmentQueue::emit`], for segments that may start or end at rest. Emits up to three.
pub(super) fn emit(
    config: &Config,
    queue: &mut SegmentQueue,
    start: &Position,
    end: &Knot,
    slope_start: AxisVec,
    slope_end: AxisVec,
) -> Result<(), GeometryError> {
    let fail = |kind| end.error(kind);
    let passing = |at: Position| Knot {
        at,
        exact_stop: false,
        ..*end
    };
    let by = delta(config, start, &end.at).map_err(fail)?;
    let end = &end.timed_by_cubic(config, &by, &slope_start, &slope_end)?;
    let (mut first, mut last) = straighten(&by, slope_start, slope_end);
    let at_rest = |slope: &AxisVec| measure(config, slope).is_none();
    // P = u^2 D + u^3 E needs D: where it vanishes, too, the piece is straight and has been dealt with.
    let bends = |by: &AxisVec, other: &AxisVec| {
        let d: AxisVec = core::array::from_fn(|axis| 3.0 * by[axis] - other[axis]);
        norm(&d) > STILL * norm(by)
    };
    let mut from = *start;
    if at_rest(&first) && bends(&by, &last) {
        let part = part(&by, &last);
        let to = offset(config, start, &part.to).map_err(fail)?;
        queue.emit(config, start, &passing(to), part.near, part.far)?;
        from = to;
        first = part.slope.map(|value| value * (1.0 - PART));
        last = last.map(|value| value * (1.0 - PART));
    }
    let by = delta(config, &end.at, &from).map_err(fail)?;
    let back = first.map(|value| -value);
    if at_rest(&last) && bends(&by, &back) {
        let part = part(&by, &back);
        let to = offset(config, &end.at, &part.to).map_err(fail)?;
        let turn = |v: AxisVec| v.map(|value| -value);
        let inner = first.map(|value| value * (1.0 - PART));
        let slope = turn(part.slope).map(|value| value * (1.0 - PART));
        queue.emit(config, &from, &passing(to), inner, slope)?;
        return queue.emit(config, &to, end, turn(part.far), turn(part.near));
    }
    queue.emit(config, &from, end, first, last)
}
