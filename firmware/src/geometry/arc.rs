//! Constant speed on any parametrisation: a cubic becomes segments that carry u(s), the inverse of
//! their arc length.
//!
//! In: [`HermiteSegment`]. Out: [`ServoSegment`]s in fixed point, each with the [`PathShape`] the planner
//! takes its limits from. The curve is halved until the tool-path feed that u(s) gives is within
//! [`FEED_TOLERANCE`] of the commanded one everywhere.
//!
//! u(s) is the quintic Hermite polynomial on sigma = s / L: position, slope and second derivative match
//! the true inverse arc length at both ends, so velocity and acceleration are continuous over joints of
//! neighbouring pieces. du/dsigma = L / |P'|, d2u/dsigma2 = -L^2 (P' . P'') / |P'|^4.
//!
//! A curve that never leaves a straight line is driven as the line it is; where it turns back on itself, the path
//! has a corner of 180 degrees there, and the machine stops at it.

use crate::config::{AxisKind, Config};
use crate::units::{sqrt, AxisVec, Steps, AXES};

use super::quadrature::GAUSS_5;
use super::HermiteSegment;

/// Largest relative error of the path feed inside a segment (1e-5 is 0.001 %).
pub const FEED_TOLERANCE: f32 = 1.0e-5;

/// Fractional bits of the path coordinate s: 2^-54 mm, range 512 mm per segment.
pub const S_FRAC: u32 = 54;

/// Degrees per millimetre from which on the path is measured in degrees.
pub(super) const ROTARY_RATIO: f32 = 30.0;

/// Longest segment in path units; longer ones are halved.
const LENGTH_MAX: f32 = 250.0;

/// Fractional bits of the coefficients of u(sigma); range +-256.
pub const U_FRAC: u32 = 55;

/// Fractional bits of sigma and of the powers of u.
pub const Q: u32 = 62;

/// Halvings of one programmed segment before it is refused. Enough to reach [`TINY`] from 250 mm.
const DEPTH_MAX: usize = 26;

/// A piece of curve that fits into this, mm or degree, is driven as its chord; the path is off by no more. What is left of
/// a cusp at this size becomes a corner, and the machine stops at it as at any other.
const TINY: f32 = 2.0e-5;

/// What the servo interrupt evaluates: sigma(s), u(sigma), P(u), all integers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ServoSegment {
    /// Text line.
    pub block: u32,
    /// Arc length L, path units in Q10.54.
    pub length: i64,
    /// Left shift that brings s into [0, 2^62).
    pub shift: u32,
    /// 2^124 / (L << shift): sigma in Q2.62 is `((s << shift) * inverse) >> 62`.
    pub inverse: i64,
    /// u = sum of `u[k] sigma^(k+1)`, Q8.55; the coefficients add up to exactly one.
    pub u: [i64; 5],
    /// P(0), Q32.32 steps.
    pub start: [i64; AXES],
    /// `[a1, a2, a3]` per axis, Q32.32 steps: P(u) = start + a1 u + a2 u^2 + a3 u^3.
    pub cubic: [[i64; 3]; AXES],
}

impl ServoSegment {
    /// P(1), exact.
    #[must_use]
    pub fn end(&self) -> [i64; AXES] {
        core::array::from_fn(|a| {
            let [a1, a2, a3] = self.cubic[a];
            self.start[a] + a1 + a2 + a3
        })
    }
}

/// Derivatives of the axis positions with respect to path length at one point, axis units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PathDerivatives {
    /// dq/ds.
    pub first: AxisVec,
    /// d2q/ds2.
    pub second: AxisVec,
    /// d3q/ds3.
    pub third: AxisVec,
}

/// What the planner must know of a segment's curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathShape {
    /// Largest absolute derivatives over the segment.
    pub bound: PathDerivatives,
    /// At s = 0.
    pub start: PathDerivatives,
    /// At s = L.
    pub end: PathDerivatives,
    /// True if s counts degrees: no linear axis moves, or so little that rotary motion is what takes the time.
    pub rotary_only: bool,
    /// Path units per unit of what the feed refers to: 1, but where s counts degrees although linear axes move.
    pub feed_scale: f32,
}

/// Why a curve cannot be made constant-speed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArcError {
    /// The curve has a cusp or turns back on itself: its speed vanishes inside.
    Cusp,
    /// A coordinate difference exceeds 2^28 steps.
    Range,
}

impl core::fmt::Display for ArcError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Cusp => "curve has a cusp: path speed vanishes",
            Self::Range => "curve exceeds the coordinate range",
        })
    }
}

impl core::error::Error for ArcError {}

/// A cubic with integer slopes, so that halving is exact to one unit of 2^-32 step.
#[derive(Clone, Copy)]
struct Piece {
    start: [i64; AXES],
    end: [i64; AXES],
    slope_start: [i64; AXES],
    slope_end: [i64; AXES],
}

impl Piece {
    fn halves(&self) -> [Self; 2] {
        let mut first = *self;
        let mut second = *self;
        for a in 0..AXES {
            let delta = self.end[a] - self.start[a];
            let (t0, t1) = (self.slope_start[a], self.slope_end[a]);
            let middle = self.start[a] + delta / 2 + (t0 - t1) / 8;
            // dP/du at 1/2 is 3/2 delta - (t0 + t1) / 4, halved for the halved parameter.
            let slope = (3 * delta - (t0 + t1) / 2) / 4;
            first.end[a] = middle;
            first.slope_start[a] = t0 / 2;
            first.slope_end[a] = slope;
            second.start[a] = middle;
            second.slope_start[a] = slope;
            second.slope_end[a] = t1 / 2;
        }
        [first, second]
    }

    /// The curve as one or more straight pieces if it never leaves a line, in path order: up to three, cut where
    /// it turns back on itself.
    fn straight_pieces(&self, config: &Config) -> Option<heapless::Vec<Self, 3>> {
        let vector = |f: &dyn Fn(usize) -> i64| -> AxisVec {
            core::array::from_fn(|a| {
                f(a) as f32 * (config.units_per_step(a) * (1.0 / 4_294_967_296.0))
            })
        };
        let vectors = [
            vector(&|a| self.end[a] - self.start[a]),
            vector(&|a| self.slope_start[a]),
            vector(&|a| self.slope_end[a]),
        ];
        let dot = |x: &AxisVec, y: &AxisVec| x.iter().zip(y).map(|(x, y)| x * y).sum::<f32>();
        let mut along = &vectors[0];
        for v in &vectors[1..] {
            if dot(v, v) > dot(along, along) {
                along = v;
            }
        }
        let size = dot(along, along);
        if !(size > 0.0) {
            return None;
        }
        // Scalar cubic along the line: distance and end slopes in multiples of `along`.
        let [delta, t0, t1] = [0, 1, 2].map(|i| dot(&vectors[i], along) / size);
        // p'(u) = t0 + 2 b u + 3 c u^2
        let (b, c) = (3.0 * delta - 2.0 * t0 - t1, t0 + t1 - 2.0 * delta);
        let root = b * b - 3.0 * c * t0;
        let q = -(b + sqrt(root.max(0.0)).copysign(b));
        let (x, y) = (q / (3.0 * c), t0 / q);
        // Turning points within the rounding of an end are that end.
        let turns =
            [x.min(y), x.max(y)].map(|u| (root > 0.0 && u > 1e-4 && u < 1.0 - 1e-4).then_some(u));
        // How far off counts as straight: a few units of f32 rounding; where the curve turns back, the size below
        // which nothing about its shape is kept anyway.
        let slack = if turns == [None, None] {
            0.0
        } else {
            TINY * TINY
        };
        for (v, share) in vectors.iter().zip([delta, t0, t1]) {
            let off: AxisVec = core::array::from_fn(|a| v[a] - share * along[a]);
            if !(dot(&off, &off) <= slack + 4e-13 * size) {
                return None;
            }
        }
        let mut pieces = heapless::Vec::new();
        let mut rest = *self;
        for u in turns.into_iter().flatten() {
            let far = u * (t0 + u * (b + u * c));
            let mut first = rest;
            for a in 0..AXES {
                let scale = config.axes[a].steps_per_unit.to_num::<f32>() * 4_294_967_296.0;
                first.end[a] = self.start[a] + (far * along[a] * scale) as i64;
            }
            rest.start = first.end;
            // Cannot fail: two turning points at most.
            let _ = pieces.push(first.line());
        }
        let _ = pieces.push(rest.line());
        Some(pieces)
    }

    /// The straight line from start to end.
    fn line(mut self) -> Self {
        for a in 0..AXES {
            self.slope_start[a] = self.end[a] - self.start[a];
            self.slope_end[a] = self.slope_start[a];
        }
        self
    }
}

/// Polynomial coefficients of the derivative curves in axis units.
struct Curve {
    /// P'(u) = c[0] + c[1] u + c[2] u^2 per axis.
    c: [[f32; 3]; AXES],
    /// Axes that make up the path length.
    counts: [bool; AXES],
}

impl Curve {
    fn first(&self, u: f32) -> AxisVec {
        core::array::from_fn(|a| self.c[a][0] + u * (self.c[a][1] + u * self.c[a][2]))
    }
    fn second(&self, u: f32) -> AxisVec {
        core::array::from_fn(|a| self.c[a][1] + 2.0 * u * self.c[a][2])
    }
    fn third(&self) -> AxisVec {
        core::array::from_fn(|a| 2.0 * self.c[a][2])
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
    fn speed(&self, u: f32) -> f32 {
        let d = self.first(u);
        sqrt(self.dot(&d, &d))
    }

    /// Derivatives of P(u(s)) with respect to s at sigma, for u = sum `c[k] sigma^(k+1)` and s = `length` sigma
    /// (chain rule). These are those of the motion as it will be commanded, the error of u(s) included.
    fn path_derivatives(&self, c: &[f32; 5], length: f32, sigma: f32) -> PathDerivatives {
        let r = 1.0 / length;
        let x = sigma;
        let u = x * (c[0] + x * (c[1] + x * (c[2] + x * (c[3] + x * c[4]))));
        let u1 =
            r * (c[0] + x * (2.0 * c[1] + x * (3.0 * c[2] + x * (4.0 * c[3] + x * 5.0 * c[4]))));
        let u2 = r * r * (2.0 * c[1] + x * (6.0 * c[2] + x * (12.0 * c[3] + x * 20.0 * c[4])));
        let u3 = r * r * r * (6.0 * c[2] + x * (24.0 * c[3] + x * 60.0 * c[4]));
        let (p1, p2, p3) = (self.first(u), self.second(u), self.third());
        let mut d = PathDerivatives::default();
        for a in 0..AXES {
            d.first[a] = p1[a] * u1;
            d.second[a] = p2[a] * u1 * u1 + p1[a] * u2;
            d.third[a] = p3[a] * u1 * u1 * u1 + 3.0 * p2[a] * u1 * u2 + p1[a] * u3;
        }
        d
    }
}

/// Pulls [`ServoSegment`]s out of one [`HermiteSegment`], front to back.
pub struct ArcSplitter {
    stack: heapless::Vec<(Piece, u8), { DEPTH_MAX + 2 }>,
    block: u32,
}

impl Default for ArcSplitter {
    fn default() -> Self {
        Self::new()
    }
}

impl ArcSplitter {
    /// Empty splitter.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            stack: heapless::Vec::new(),
            block: 0,
        }
    }

    /// Forgets what is left.
    pub fn clear(&mut self) {
        self.stack.clear();
    }

    /// True when everything has been pulled.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.stack.is_empty()
    }

    /// Takes the next curve. The previous one must have been pulled empty.
    ///
    /// # Errors
    /// [`ArcError::Range`] if a coordinate difference or slope exceeds 2^28 steps or is not finite.
    pub fn push(
        &mut self,
        config: &Config,
        segment: &HermiteSegment,
        block: u32,
    ) -> Result<(), ArcError> {
        const LIMIT: i64 = 1 << (28 + 32);
        let mut piece = Piece {
            start: segment.start.map(Steps::to_bits),
            end: segment.end.map(Steps::to_bits),
            slope_start: [0; AXES],
            slope_end: [0; AXES],
        };
        for a in 0..AXES {
            let delta = piece.end[a]
                .checked_sub(piece.start[a])
                .ok_or(ArcError::Range)?;
            let scale = config.axes[a].steps_per_unit.to_num::<f32>();
            for (slope, out) in [
                (segment.slope_start[a], &mut piece.slope_start[a]),
                (segment.slope_end[a], &mut piece.slope_end[a]),
            ] {
                // f32 to integer saturates and maps NaN to 0; both are refused here first.
                let steps = slope * scale * 4_294_967_296.0;
                if !(steps.abs() < LIMIT as f32) {
                    return Err(ArcError::Range);
                }
                *out = steps as i64;
            }
            if delta.abs() >= LIMIT {
                return Err(ArcError::Range);
            }
        }
        self.block = block;
        self.stack.clear();
        // None of these can fail: the stack was just emptied.
        if let Some(lines) = piece.straight_pieces(config) {
            for line in lines.iter().rev() {
                let _ = self.stack.push((*line, 0));
            }
        } else {
            let _ = self.stack.push((piece, 0));
        }
        Ok(())
    }

    /// Next segment, or `None` when the curve is used up.
    ///
    /// # Errors
    /// [`ArcError::Cusp`] if the feed tolerance cannot be met; the rest of the curve is dropped.
    pub fn next(&mut self, config: &Config) -> Result<Option<(ServoSegment, PathShape)>, ArcError> {
        while let Some((piece, depth)) = self.stack.pop() {
            match build(config, &piece, self.block) {
                Built::Done(segment, shape) => return Ok(Some((segment, shape))),
                Built::Nothing => continue,
                Built::Halve => {}
            }
            let [first, second] = piece.halves();
            if usize::from(depth) >= DEPTH_MAX
                || self.stack.push((second, depth + 1)).is_err()
                || self.stack.push((first, depth + 1)).is_err()
            {
                self.stack.clear();
                return Err(ArcError::Cusp);
            }
        }
        Ok(None)
    }
}

/// Pieces shorter than this are not halved for being rough.
const ROUGH_MIN: f32 = 1.0e-3;

/// True if an axis turns within the piece by so much that samples may miss a peak of its velocity: over half of its largest
/// q' between start and end.
fn is_rough(shape: &PathShape) -> bool {
    (0..AXES).any(|a| {
        (shape.end.first[a] - shape.start.first[a]).abs() > 0.5 * shape.bound.first[a].max(0.01)
            && shape.bound.first[a] > 1.0
    })
}

/// Allowances for what samples miss of the peak of a derivative between them. Random programs exceed a limit by up to
/// 1 % without.
const SAMPLED_FIRST: f32 = 1.01;
const SAMPLED_HIGHER: f32 = 1.03;

/// Points at which derivative bounds are taken.
const SAMPLES: usize = 9;

/// What became of a piece. Passed on at once, never stored: the size of its largest variant does not matter.
#[allow(clippy::large_enum_variant)]
enum Built {
    Done(ServoSegment, PathShape),
    /// It must be halved first.
    Halve,
    /// It is too short to be driven.
    Nothing,
}

fn build(config: &Config, piece: &Piece, block: u32) -> Built {
    let mut cubic = [[0_i64; 3]; AXES];
    let mut curve = Curve {
        c: [[0.0; 3]; AXES],
        counts: [false; AXES],
    };
    let mut straight = true;
    // Extent of the control polygon over linear and over rotary axes.
    let mut extent = [0.0_f32; 2];
    for a in 0..AXES {
        let delta = piece.end[a] - piece.start[a];
        let (t0, t1) = (piece.slope_start[a], piece.slope_end[a]);
        cubic[a] = [t0, 3 * delta - 2 * t0 - t1, t0 + t1 - 2 * delta];
        let scale = config.units_per_step(a) * (1.0 / 4_294_967_296.0);
        curve.c[a] = [
            t0 as f32 * scale,
            2.0 * (cubic[a][1] as f32 * scale),
            3.0 * (cubic[a][2] as f32 * scale),
        ];
        // A line handed over with f32 slopes is straight up to their rounding.
        let slack = (delta.abs() >> 20) + 16;
        if (t0 - delta).abs() > slack || (t1 - delta).abs() > slack {
            straight = false;
        }
        let size = delta.abs().max(t0.abs()).max(t1.abs()) as f32 * scale;
        let kind = usize::from(config.axes[a].kind == AxisKind::Rotary);
        extent[kind] = extent[kind].max(size);
    }
    // Where linear motion all but vanishes while rotary axes turn, the path is measured in degrees: a unit of s would
    // otherwise move an axis by more than positions resolve.
    let any_linear = extent[1] == 0.0
        || (extent[0] > 0.0 && extent[1] <= TINY)
        || (extent[0] > TINY && extent[1] < ROTARY_RATIO * extent[0]);
    let feed_scale = if any_linear || extent[0] == 0.0 {
        1.0
    } else {
        extent[1] / extent[0]
    };
    straight |= extent[0] <= TINY && extent[1] <= TINY;
    for a in 0..AXES {
        curve.counts[a] = (config.axes[a].kind == AxisKind::Linear) == any_linear;
    }
    if straight {
        for a in 0..AXES {
            let delta = piece.end[a] - piece.start[a];
            cubic[a] = [delta, 0, 0];
            curve.c[a] = [
                delta as f32 * (config.units_per_step(a) * (1.0 / 4_294_967_296.0)),
                0.0,
                0.0,
            ];
        }
    }

    let length = if straight {
        curve.speed(0.0)
    } else {
        GAUSS_5.iter().map(|&(u, w)| w * curve.speed(u)).sum()
    };
    if !(length < LENGTH_MAX) {
        return Built::Halve;
    }
    let length_q = (length * (1_u64 << S_FRAC) as f32) as i64;
    if length_q < 1 << 20 {
        // Shorter than 2^-34 path units. A curve may still go out and back.
        return if straight {
            Built::Nothing
        } else {
            Built::Halve
        };
    }
    let u = if straight {
        [1 << U_FRAC, 0, 0, 0, 0]
    } else {
        match inverse_arc_length(&curve, length) {
            Some(u) => u,
            None => return Built::Halve,
        }
    };
    let mut shape = shape_of(
        &curve,
        &u.map(|c| c as f32 * (1.0 / ONE)),
        length,
        straight,
        !any_linear,
    );

    shape.feed_scale = feed_scale;
    if !straight && length > ROUGH_MIN && is_rough(&shape) {
        return Built::Halve;
    }
    let shift = (length_q as u64).leading_zeros() - 2;
    let normalised = (length_q as u64) << shift;
    let inverse = ((1_u128 << 124) / u128::from(normalised)).min(i64::MAX as u128) as i64;
    let segment = ServoSegment {
        block,
        length: length_q,
        shift,
        inverse,
        u,
        start: piece.start,
        cubic,
    };
    Built::Done(segment, shape)
}

/// One in Q8.55.
const ONE: f32 = (1_u64 << U_FRAC) as f32;

/// Coefficients of u(sigma) in Q8.55, or `None` if they miss the feed tolerance.
fn inverse_arc_length(curve: &Curve, length: f32) -> Option<[i64; 5]> {
    let ends = [0.0, 1.0].map(|u| {
        let (p1, p2) = (curve.first(u), curve.second(u));
        let m2 = curve.dot(&p1, &p1);
        let r = length / sqrt(m2);
        (r, -(r * r) * (curve.dot(&p1, &p2) / m2))
    });
    let [(c1, d0), (e1, d1)] = ends;
    // Also refuses NaN and infinity, which a vanishing end speed gives.
    if !(c1 < 8.0 && e1 < 8.0 && d0.abs() < 16.0 && d1.abs() < 16.0) {
        return None;
    }
    // Integers from here on: the coefficients then sum to one exactly and the segment ends on its end point.
    let (c1, e1) = ((c1 * ONE) as i64, (e1 * ONE) as i64);
    let (h0, h1) = ((d0 * (0.5 * ONE)) as i64, (d1 * (0.5 * ONE)) as i64);
    let one = 1_i64 << U_FRAC;
    let u = [
        c1,
        h0,
        10 * one - 6 * c1 - 4 * e1 - 3 * h0 + h1,
        -15 * one + 8 * c1 + 7 * e1 + 3 * h0 - 2 * h1,
        6 * one - 3 * c1 - 3 * e1 - h0 + h1,
    ];
    // du/dsigma |P'(u)| / L is the ratio of true to commanded feed.
    let c = u.map(|x| x as f32 * (1.0 / ONE));
    for sigma in [0.12_f32, 0.28, 0.42, 0.58, 0.72, 0.88] {
        let at = sigma * (c[0] + sigma * (c[1] + sigma * (c[2] + sigma * (c[3] + sigma * c[4]))));
        let rate = c[0]
            + sigma
                * (2.0 * c[1] + sigma * (3.0 * c[2] + sigma * (4.0 * c[3] + sigma * 5.0 * c[4])));
        let error = rate * curve.speed(at) / length - 1.0;
        if !(error.abs() < FEED_TOLERANCE) {
            return None;
        }
    }
    Some(u)
}

fn shape_of(
    curve: &Curve,
    c: &[f32; 5],
    length: f32,
    straight: bool,
    rotary_only: bool,
) -> PathShape {
    let start = curve.path_derivatives(c, length, 0.0);
    if straight {
        let mut bound = start;
        bound.first = bound.first.map(f32::abs);
        return PathShape {
            bound,
            start,
            end: start,
            rotary_only,
            feed_scale: 1.0,
        };
    }
    let mut at = [start; SAMPLES];
    for (i, slot) in at.iter_mut().enumerate().skip(1) {
        *slot = curve.path_derivatives(c, length, i as f32 * (1.0 / (SAMPLES - 1) as f32));
    }
    let pick = |f: fn(&PathDerivatives) -> &AxisVec, allowance: f32| -> AxisVec {
        core::array::from_fn(|a| {
            let mut largest = 0.0_f32;
            for i in 0..SAMPLES {
                largest = largest.max(f(&at[i])[a].abs());
                if i >= 2 {
                    // A parabola through three samples peaks at most 1/8 of their second difference above the middle
                    // one; twice that covers what the next terms of the series add.
                    let bend = f(&at[i])[a] - 2.0 * f(&at[i - 1])[a] + f(&at[i - 2])[a];
                    largest = largest.max(f(&at[i - 1])[a].abs() + 0.25 * bend.abs());
                }
            }
            largest * allowance
        })
    };
    let bound = PathDerivatives {
        first: pick(|d| &d.first, SAMPLED_FIRST),
        second: pick(|d| &d.second, SAMPLED_HIGHER),
        third: pick(|d| &d.third, SAMPLED_HIGHER),
    };
    PathShape {
        bound,
        start,
        end: at[SAMPLES - 1],
        rotary_only,
        feed_scale: 1.0,
    }
}
