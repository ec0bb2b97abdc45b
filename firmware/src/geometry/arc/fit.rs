//! One piece of curve to one servo segment: quintics over the arc length, as integers.
//!
//! In: a [`Piece`]. Out: [`ServoSegment`] and [`PathShape`], or the order to halve the piece first.
//!
//! Per axis the quintic Hermite polynomial over s matches position, dq/ds and d2q/ds2 of the curve at both ends, so
//! velocity and acceleration are continuous over joints. With D = end - start, and d0, d1, h0, h1 the derivatives at the
//! ends times L and L^2, its coefficients about the middle are
//!
//!   a5 = (h1 - h0) / 2 - 3 (d0 + d1 - 2 D)      a4 = (h0 + h1) / 4 - (d1 - d0) / 2
//!   a3 = d0 + d1 - 2 D - a5 / 2                 a2 = (d1 - d0 - a4) / 2
//!   a1 = D - a3 / 4 - a5 / 16
//!
//! All sums are sums of integers: what neighbours share, they share exactly.

use crate::envelope::{FINE_MAX, LENGTH_MIN, TRAVEL_MAX};
use crate::interpolator::segment::{AxisCurve, Place, ServoSegment, SLOPE_FRAC};
use crate::interpolator::S_FRAC;
use crate::units::{larger, phase, sqrt, AxisVec, AXES};

use super::piece::{float, whole, Piece, Units};
use super::shape::{PathShape, Quintic};
use super::{FEED_TOLERANCE, LENGTH_MAX, PATH_TOLERANCE, ROTARY_RATIO, TINY};

/// Fractional bits of coefficients while they are worked out; 19 bits are left for steps and a sign.
const FRAC: u32 = 44;

/// Pieces shorter than this are not halved for being rough.
const ROUGH_MIN: f32 = 1.0e-3;

/// What became of a piece. Passed on at once, never stored: the size of its largest variant does not matter.
#[allow(clippy::large_enum_variant)]
pub enum Built {
    /// It is driven as this.
    Done(ServoSegment, PathShape),
    /// It must be halved first.
    Halve,
    /// It is too short to be driven.
    Nothing,
    /// It is a straight line, and is driven in this many parts of this length (Q10.54).
    Line(u32, i64, PathShape),
}

/// Formats of the fine coefficients, per axis.
#[derive(Clone, Copy)]
pub struct Format {
    /// Fractional bits.
    pub bits: [u32; AXES],
    /// Phase units per unit.
    pub scale: [i32; AXES],
}

/// What measures the path of a piece.
struct Measure {
    /// Axes that make up the path length.
    counts: [bool; AXES],
    rotary_only: bool,
    /// Nothing of its shape is kept.
    tiny: bool,
}

impl Measure {
    fn new(piece: &Piece, units: &Units, delta: &AxisVec) -> Self {
        // Extent of the control polygon over linear and over rotary axes.
        let mut extent = [0.0_f32; 2];
        for a in 0..AXES {
            let slopes = larger(piece.slope[0][a].abs(), piece.slope[1][a].abs());
            let size = larger(delta[a].abs(), slopes);
            let kind = usize::from(units.rotary[a]);
            extent[kind] = larger(extent[kind], size);
        }
        let [linear, rotary] = extent;
        // Where linear motion all but vanishes while rotary axes turn, the path is measured in degrees: a unit of s
        // would otherwise move an axis by more than positions resolve.
        let any_linear = rotary == 0.0
            || (linear > 0.0 && rotary <= TINY)
            || (linear > TINY && rotary < ROTARY_RATIO * linear);
        Self {
            counts: units.rotary.map(|rotary| rotary != any_linear),
            rotary_only: !any_linear,
            tiny: linear <= TINY && rotary <= TINY,
        }
    }

    /// In degrees what was in millimetres, and the other way round.
    fn other(&self) -> Self {
        Self {
            counts: self.counts.map(|counts| !counts),
            rotary_only: !self.rotary_only,
            tiny: self.tiny,
        }
    }

    /// Path units per unit of what the feed refers to, over a piece of `length` that is `rest` long over the other axes.
    fn feed_scale(&self, length: f32, rest: f32) -> f32 {
        if self.rotary_only && rest > 0.0 {
            length / rest
        } else {
            1.0
        }
    }

    fn dot(&self, x: &AxisVec, y: &AxisVec) -> f32 {
        let mut sum = 0.0;
        for a in 0..AXES {
            if self.counts[a] {
                sum += x[a] * y[a];
            }
        }
        sum
    }
}

/// Makes a segment of `piece`, which is a straight line if `line` says so.
#[inline(never)]
pub fn build(units: &Units, format: &Format, piece: &Piece, line: bool, block: u32) -> Built {
    let delta = piece.delta(units);
    let measure = Measure::new(piece, units, &delta);
    if line || measure.tiny {
        return chord(format, piece, &delta, &measure, block);
    }
    if (0..AXES).any(|a| steps(piece, a) >= TRAVEL_MAX) {
        return Built::Halve;
    }
    curve(units, format, piece, &measure, block)
        .map_or(Built::Halve, |(segment, shape)| Built::Done(segment, shape))
}

/// Whole steps from start to end.
fn steps(piece: &Piece, axis: usize) -> i32 {
    let delta = piece.end[axis] - piece.start[axis];
    // The range check of the curve keeps this below 2^29, bulges of the curve included.
    (delta.unsigned_abs() >> 32) as i32
}

/// A straight piece.
fn chord(format: &Format, piece: &Piece, delta: &AxisVec, measure: &Measure, block: u32) -> Built {
    const SHORTEST: f32 = LENGTH_MIN as f32 / (1_u64 << S_FRAC) as f32;
    let other = measure.other();
    let [mut length, mut rest] = [measure, &other].map(|m| sqrt(m.dot(delta, delta)));
    let mut measure = measure;
    if length < SHORTEST && rest > length {
        // What moves at all is driven, whatever the control polygon is measured in.
        (measure, length, rest) = (&other, rest, length);
    }
    let most = (0..AXES).map(|a| steps(piece, a)).max().unwrap_or(0);
    let parts = 1 + (most / TRAVEL_MAX).max((length * (1.0 / LENGTH_MAX)) as i32);
    let part = if parts > 1 {
        length / parts as f32
    } else {
        length
    };
    let length_q = whole(part * (1_u64 << S_FRAC) as f32);
    if length_q < LENGTH_MIN {
        return Built::Nothing;
    }
    let per = 1.0 / length;
    let shape = PathShape::straight(
        delta.map(|d| d * per),
        measure.rotary_only,
        measure.feed_scale(length, rest),
    );
    if parts > 1 {
        return Built::Line(parts as u32, length_q, shape);
    }
    Built::Done(
        line(format, &piece.start, &piece.end, length_q, block),
        shape,
    )
}

/// Segment along a straight line of `length` (Q10.54) and at most [`TRAVEL_MAX`] steps per axis.
pub fn line(
    format: &Format,
    start: &[i64; AXES],
    end: &[i64; AXES],
    length: i64,
    block: u32,
) -> ServoSegment {
    let axes = core::array::from_fn(|a| {
        let delta = end[a] - start[a];
        // Cannot fail: nothing but a slope that fits.
        axis(end[a], [delta << (FRAC - 32), 0, 0, 0, 0], format, a).unwrap_or_default()
    });
    ServoSegment::new(block, length, axes)
}

/// Coefficients in integers with [`FRAC`] fractional bits, steps, x = -t running from start to end, as the interrupt
/// wants them; `None` if they do not fit.
fn axis(end: i64, a: [i64; 5], format: &Format, index: usize) -> Option<AxisCurve> {
    const SLOPE: u32 = FRAC - SLOPE_FRAC;
    // Nearest, so that the rest has the smaller magnitude.
    let slope = (-a[0] + (1 << (SLOPE - 1))) >> SLOPE;
    let rest = -a[0] - (slope << SLOPE);
    let bits = format.bits[index];
    let mut fine = [0; 5];
    for (fine, c) in fine.iter_mut().zip([rest, a[1], -a[2], a[3], -a[4]]) {
        let shift = FRAC - bits;
        let c = (c + (1 << (shift - 1))) >> shift;
        // Sums of Horner's scheme stay below twice the largest of them.
        if c.unsigned_abs() >= FINE_MAX as u64 {
            return None;
        }
        *fine = c as i32;
    }
    let mut curve = AxisCurve {
        base: 0,
        slope: i32::try_from(slope).ok()?,
        fine,
    };
    curve.base = phase(end).wrapping_sub(curve.at(&Place::END, format.scale[index]));
    Some(curve)
}

/// Abscissae and weights of the five-point Lobatto rule on [0, 1] (Abramowitz and Stegun, table 25.6); the ends, and
/// the inner points in order.
const LOBATTO_END: f32 = 0.05;
const LOBATTO: [(f32, f32); 3] = [
    (0.172_673_16, 0.272_222_22),
    (0.5, 0.355_555_56),
    (0.827_326_84, 0.272_222_22),
];

/// A piece that turns.
#[inline(never)]
fn curve(
    units: &Units,
    format: &Format,
    piece: &Piece,
    measure: &Measure,
    block: u32,
) -> Option<(ServoSegment, PathShape)> {
    // P'(u) = t0 + u (b0 + u (b1 - b0) / 2)
    let derivative = |u: f32| -> AxisVec {
        core::array::from_fn(|a| {
            let (b0, b1) = (piece.bend[0][a], piece.bend[1][a]);
            piece.slope[0][a] + u * (b0 + u * (0.5 * (b1 - b0)))
        })
    };
    let lengths = |measure: &Measure| {
        let speed = |d: &AxisVec| sqrt(measure.dot(d, d));
        let ends = [0, 1].map(|i| speed(&piece.slope[i]));
        let mut length = LOBATTO_END * (ends[0] + ends[1]);
        for (u, weight) in LOBATTO {
            length += weight * speed(&derivative(u));
        }
        (length, ends)
    };
    let (length, ends) = lengths(measure);
    if !(length < LENGTH_MAX) {
        return None;
    }
    let length_q = whole(length * (1_u64 << S_FRAC) as f32);
    // A curve may still go out and back.
    if length_q < LENGTH_MIN {
        return None;
    }
    // dq/ds = P' / |P'|, d2q/ds2 = (P'' - dq/ds (dq/ds . P'')) / |P'|^2.
    let along = [0, 1].map(|i| {
        let per = 1.0 / ends[i];
        let first = piece.slope[i].map(|t| t * per);
        let push = measure.dot(&first, &piece.bend[i]);
        let second: AxisVec =
            core::array::from_fn(|a| (piece.bend[i][a] - first[a] * push) * (per * per));
        [first, second]
    });
    if !stays_on(piece, measure, length, &along) {
        return None;
    }
    let mut axes = [AxisCurve::default(); AXES];
    let mut curve = [Quintic::default(); AXES];
    for a in 0..AXES {
        let scale = units.scale[a];
        // Also refuses NaN and infinity, which a vanishing end speed gives.
        let slope = |m: f32| {
            let most = m.abs() * length * scale < (TRAVEL_MAX as f32) * 8.0 * 4_294_967_296.0;
            most.then(|| product(m * scale, length_q)).flatten()
        };
        let bend = |k: f32| {
            let h = k * (length * length) * (scale * (1 << (FRAC - 32)) as f32);
            (h.abs() < 5e17).then(|| whole(h))
        };
        let (d0, d1) = (slope(along[0][0][a])?, slope(along[1][0][a])?);
        let (h0, h1) = (bend(along[0][1][a])?, bend(along[1][1][a])?);
        let way = (piece.end[a] - piece.start[a]) << (FRAC - 32);
        let k = d0 + d1 - 2 * way;
        let a5 = (h1 - h0) / 2 - 3 * k;
        let a3 = k - a5 / 2;
        let a4 = (h0 + h1) / 4 - (d1 - d0) / 2;
        let a2 = (d1 - d0 - a4) / 2;
        let a1 = way - a3 / 4 - a5 / 16;
        let coefficients = [a1, a2, a3, a4, a5];
        axes[a] = axis(piece.end[a], coefficients, format, a)?;
        let unit = units.unit[a] * (1.0 / (1 << (FRAC - 32)) as f32);
        curve[a] = coefficients.map(|c| float(c) * unit);
    }
    let (mut shape, error) = PathShape::of(&curve, length, &measure.counts, &along);
    if !(error < FEED_TOLERANCE) || (length > ROUGH_MIN && shape.is_rough()) {
        return None;
    }
    shape.rotary_only = measure.rotary_only;
    if measure.rotary_only {
        shape.feed_scale = measure.feed_scale(length, lengths(&measure.other()).0);
    }
    Some((ServoSegment::new(block, length_q, axes), shape))
}

/// `m` (2^-32 steps per path unit) times a length in Q10.54, with [`FRAC`] fractional bits in steps: all bits of the float
/// count, so that the slopes of neighbours of any length agree. `None` for slopes so steep that the product has fewer bits.
fn product(m: f32, length: i64) -> Option<i64> {
    let bits = m.to_bits();
    let mantissa = i64::from((bits & 0x7f_ffff) | 0x80_0000);
    // m = mantissa 2^(exponent - 150); the product has S_FRAC + 32 fractional bits and is wanted with FRAC.
    let shift = 150 + S_FRAC as i32 + 32 - FRAC as i32 - ((bits >> 23) & 0xff) as i32;
    let wide = i128::from(mantissa) * i128::from(length);
    let size = i64::try_from(wide >> u32::try_from(shift).ok()?.min(127)).ok()?;
    Some(if bits >> 31 == 0 { size } else { -size })
}

/// Whether the quintics stay within [`PATH_TOLERANCE`] of the curve: in the middle, where they are furthest from it, what
/// is left of the distance once the motion along the curve is taken away.
fn stays_on(piece: &Piece, measure: &Measure, length: f32, along: &[[AxisVec; 2]; 2]) -> bool {
    let mut off = AxisVec::default();
    let mut tangent = AxisVec::default();
    let mut bend = AxisVec::default();
    for a in 0..AXES {
        let (t0, t1) = (piece.slope[0][a], piece.slope[1][a]);
        let (b0, b1) = (piece.bend[0][a], piece.bend[1][a]);
        let d = along[0][0][a] - along[1][0][a];
        let h = along[0][1][a] + along[1][1][a];
        // Hermite polynomials at 1/2, less the half sum of the ends that both have.
        off[a] = length * (0.156_25 * d + length * (0.015_625 * h)) - 0.125 * (t0 - t1);
        tangent[a] = t0 + 0.5 * (b0 + 0.25 * (b1 - b0));
        bend[a] = 0.5 * (b0 + b1);
    }
    let du = measure.dot(&off, &tangent) / measure.dot(&tangent, &tangent);
    let limit = 0.2 * PATH_TOLERANCE;
    (0..AXES).all(|a| (off[a] - du * (tangent[a] + 0.5 * du * bend[a])).abs() < limit)
}
