//! The path on one side of a corner, as seen from it.
//!
//! In: the segment that ends at a corner, or the one that begins there. Out: points, directions and curvature at a path
//! distance from the corner, and what is left of the segment there. Everything is relative to the corner, so that the
//! resolution of `f32` is that of the rounding and not that of the segment.

use super::super::arc::ROTARY_RATIO;
use super::super::chord::{delta, offset};
use super::super::quadrature::GAUSS_4;
use super::super::segment::HermiteSegment;
use crate::config::{AxisKind, Config};
use crate::units::{sqrt, AxisVec, Position, AXES};

/// Slopes this close to the chord (share of its largest component) are those of a line.
const STRAIGHT: f32 = 1.0e-6;
/// A direction needs at least this share of the segment's mean speed.
const LEAST_SPEED: f32 = 1.0e-3;
/// Newton steps towards a path distance.
const STEPS: usize = 5;

/// Which axes make up the path length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Counts(pub [bool; AXES]);

impl Counts {
    /// Product of two vectors over the axes that count.
    pub fn dot(&self, x: &AxisVec, y: &AxisVec) -> f32 {
        let mut sum = 0.0;
        for ((x, y), counts) in x.iter().zip(y).zip(self.0) {
            if counts {
                sum += x * y;
            }
        }
        sum
    }

    fn norm(&self, x: &AxisVec) -> f32 {
        sqrt(self.dot(x, x))
    }
}

/// Which side of the corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    /// The segment that ends there.
    Before,
    /// The segment that begins there.
    Behind,
}

/// A place on a branch.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    /// Where, exactly.
    pub at: Position,
    /// The same relative to the corner, mm or degree.
    pub from: AxisVec,
    /// dq/ds in the direction of travel; one path unit long over the axes that count.
    pub tangent: AxisVec,
    /// d2q/ds2.
    pub curvature: AxisVec,
    /// Path distance to the corner.
    pub distance: f32,
    /// Share of the segment between here and the corner.
    pub share: f32,
}

/// `R(w) = c1 w + c2 w^2 + c3 w^3`, w from 0 at the corner to 1 at the far end of the segment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Branch {
    c: [AxisVec; 3],
    side: Side,
    segment: HermiteSegment,
    /// It is a line.
    pub straight: bool,
    pub counts: Counts,
    /// Path length.
    pub length: f32,
}

impl Branch {
    /// The branch `segment` is; `None` where it has no length or no direction at the corner.
    pub fn new(config: &Config, segment: &HermiteSegment, side: Side) -> Option<Self> {
        let by = delta(config, &segment.start, &segment.end).ok()?;
        let (s0, s1) = (&segment.slope_start, &segment.slope_end);
        let size = |v: &AxisVec| v.iter().fold(0.0_f32, |most, x| most.max(x.abs()));
        let close = STRAIGHT * size(&by);
        let straight =
            (0..AXES).all(|a| (s0[a] - by[a]).abs() <= close && (s1[a] - by[a]).abs() <= close);
        let bend = |near: &AxisVec, far: &AxisVec, sign: f32| {
            [
                near.map(|value| sign * value),
                core::array::from_fn(|a| sign * (3.0 * by[a] - 2.0 * near[a] - far[a])),
                core::array::from_fn(|a| sign * (near[a] + far[a] - 2.0 * by[a])),
            ]
        };
        let zero = [0.0; AXES];
        let c = match (side, straight) {
            (Side::Before, true) => [by.map(|value| -value), zero, zero],
            (Side::Behind, true) => [by, zero, zero],
            (Side::Before, false) => bend(s1, s0, -1.0),
            (Side::Behind, false) => bend(s0, s1, 1.0),
        };
        let mut extent = [0.0_f32; 2];
        for a in 0..AXES {
            let kind = usize::from(config.axes[a].kind == AxisKind::Rotary);
            extent[kind] = extent[kind]
                .max(by[a].abs())
                .max(s0[a].abs())
                .max(s1[a].abs());
        }
        let [linear, rotary] = extent;
        let in_degrees = rotary > ROTARY_RATIO * linear;
        let counts = Counts(core::array::from_fn(|a| {
            (config.axes[a].kind == AxisKind::Rotary) == in_degrees
        }));
        let mut branch = Self {
            c,
            side,
            segment: *segment,
            straight,
            counts,
            length: 0.0,
        };
        branch.length = branch.distance(1.0);
        let speed = counts.norm(&branch.slope(0.0));
        // Written so that what is not a number has no direction.
        (branch.length > 0.0 && branch.length.is_finite() && speed >= LEAST_SPEED * branch.length)
            .then_some(branch)
    }

    /// The whole segment.
    pub fn segment(&self) -> &HermiteSegment {
        &self.segment
    }

    /// R(w).
    pub fn place(&self, w: f32) -> AxisVec {
        let [c1, c2, c3] = &self.c;
        core::array::from_fn(|a| w * (c1[a] + w * (c2[a] + w * c3[a])))
    }

    /// dR/dw.
    fn slope(&self, w: f32) -> AxisVec {
        let [c1, c2, c3] = &self.c;
        core::array::from_fn(|a| c1[a] + w * (2.0 * c2[a] + 3.0 * w * c3[a]))
    }

    /// Path distance of the share w from the corner.
    pub fn distance(&self, w: f32) -> f32 {
        if self.straight {
            return w * self.counts.norm(&self.c[0]);
        }
        let speed = |(u, weight): (f32, f32)| weight * self.counts.norm(&self.slope(u * w));
        w * GAUSS_4.map(speed).iter().sum::<f32>()
    }

    /// The share of the segment that lies within `distance` of the corner, at most `most`.
    fn share(&self, distance: f32, most: f32) -> f32 {
        // All there is, to the bit: nothing may be left of it.
        if distance >= self.distance(most) {
            return most;
        }
        let mut w = (distance / self.length).clamp(0.0, most);
        if self.straight {
            return w;
        }
        for _ in 0..STEPS {
            let speed = self
                .counts
                .norm(&self.slope(w))
                .max(LEAST_SPEED * self.length);
            w = (w - (self.distance(w) - distance) / speed).clamp(0.0, most);
        }
        // Never further than asked for, whatever Newton did.
        let reached = self.distance(w);
        if reached > distance {
            w *= distance / reached;
        }
        w
    }

    /// Direction of travel at the corner.
    pub fn direction(&self) -> AxisVec {
        self.tangent(&self.slope(0.0))
    }

    fn tangent(&self, slope: &AxisVec) -> AxisVec {
        let speed = self.counts.norm(slope);
        let scale = match self.side {
            Side::Before => -1.0 / speed,
            Side::Behind => 1.0 / speed,
        };
        slope.map(|value| value * scale)
    }

    /// The place at most `distance` from the corner and at most the share `most` of the segment away. `None` if that is the
    /// corner itself or nowhere.
    ///
    /// `corner` is where the branches meet.
    pub fn spot(
        &self,
        config: &Config,
        corner: &Position,
        distance: f32,
        most: f32,
    ) -> Option<Spot> {
        let w = self.share(distance, most);
        let whole = w >= 1.0;
        let from = self.place(w);
        let at = match self.side {
            Side::Before if whole => self.segment.start,
            Side::Behind if whole => self.segment.end,
            _ => offset(config, corner, &from).ok()?,
        };
        let slope = self.slope(w);
        let square = self.counts.dot(&slope, &slope);
        let [_, c2, c3] = &self.c;
        let second: AxisVec = core::array::from_fn(|a| 2.0 * c2[a] + 6.0 * w * c3[a]);
        // d2q/ds2 = (R'' - R' (R' R'') / |R'|^2) / |R'|^2, the same in either direction
        let along = self.counts.dot(&slope, &second) / square;
        let curvature = core::array::from_fn(|a| (second[a] - slope[a] * along) / square);
        let spot = Spot {
            at,
            from,
            tangent: self.tangent(&slope),
            curvature,
            distance: self.distance(w),
            share: w,
        };
        let finite = |v: &AxisVec| v.iter().all(|value| value.is_finite());
        (spot.distance > 0.0 && finite(&spot.tangent) && finite(&spot.curvature)).then_some(spot)
    }

    /// The segment without what lies between `spot` and the corner; `None` if nothing is left.
    pub fn rest(&self, config: &Config, spot: &Spot) -> Option<HermiteSegment> {
        let left = 1.0 - spot.share;
        if left <= 0.0 {
            return None;
        }
        let mut rest = self.segment;
        match self.side {
            Side::Before => rest.end = spot.at,
            Side::Behind => rest.start = spot.at,
        }
        if self.straight {
            let by = delta(config, &rest.start, &rest.end).ok()?;
            rest.slope_start = by;
            rest.slope_end = by;
            return Some(rest);
        }
        // A part of a cubic is the cubic with the slopes of the part.
        let slope = self.slope(spot.share);
        match self.side {
            Side::Before => {
                rest.slope_start = rest.slope_start.map(|value| value * left);
                rest.slope_end = slope.map(|value| -value * left);
            }
            Side::Behind => {
                rest.slope_start = slope.map(|value| value * left);
                rest.slope_end = rest.slope_end.map(|value| value * left);
            }
        }
        Some(rest)
    }
}
