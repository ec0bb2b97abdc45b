//! Circles: arcs, full circles, helices and the shallow spirals that rounding of a program makes of them.
//!
//! In: a [`crate::nc::command::Arc`], where the path stands and where the block ends. Out, lazily: cubic segments whose
//! distance from the circle stays below [`TOLERANCE`] at any radius, the last of which ends on the programmed point.
//!
//! With the angle `d` of one piece and slopes `4 tan(d/4)` times the derivative by the angle, the cubic is the well-known
//! one of sixth order: it touches the circle at both ends and in the middle and leaves it by at most
//! `2/27 r (d/4)^6` (T. Dokken et al., "Good approximation of circles by curvature-continuous Bezier curves", CAGD 7
//! (1990) 33-41). Axes outside the plane go linearly with the angle. Given the same ratio of slope to chord as the angle
//! has, `tan(d/4) / (d/4)`, they do so within `1.2e-4 d^4` of their way in the piece.

use super::error::GeometryErrorKind;
use super::fit::{displacement, place, Piece, Sample};
use super::quadrature::GAUSS_5;
use crate::config::{AxisKind, Config};
use crate::nc::command::{Arc, Centre};
use crate::units::{sqrt, AxisVec, Nano, Position, AXES, NANO_PER_UNIT};

/// Largest distance between the circle and its cubics, mm. Half of it is for their form, half for `f32` slopes.
const TOLERANCE: f32 = 5.0e-5;

/// Longest piece per millimetre of tolerance: slopes rounded to 24 bits move the middle of a piece of length l by
/// up to 4/27 2^-23 l.
const LENGTH_PER_TOLERANCE: f32 = 2.0e7;

/// Radii and arcs up to this long are none, mm: half the resolution of programs, and all of it.
const NO_RADIUS: f64 = 0.5e-6;
const NO_ARC: f64 = 1.0e-6;

/// Allowance for rounding when lengths are compared with a tolerance, mm.
const ROUNDING: f64 = 1.0e-9;

const TAU: f64 = core::f64::consts::TAU;

/// An arc on its way to the planner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Circle {
    /// First and second axis of the plane.
    axes: [usize; 2],
    /// From the centre to the start, mm.
    radius: [f64; 2],
    /// Radius at the end over radius at the start, less one.
    growth: f64,
    /// Whole angle, radian; positive from the first axis to the second.
    angle: f64,
    /// Way of the axes outside the plane, mm or degree.
    along: [f64; AXES],
    /// Pieces in all, and so far.
    pieces: u32,
    done: u32,
}

/// Nanometres for a message.
fn nano(length: f64) -> Nano {
    // Saturates.
    (length * NANO_PER_UNIT as f64) as Nano
}

fn norm(v: [f64; 2]) -> f64 {
    libm::sqrt(v[0] * v[0] + v[1] * v[1])
}

impl Circle {
    /// The arc from `start` to `end`.
    ///
    /// # Errors
    /// `ArcPlane`, `ArcRadii`, `ArcReach`, `ArcNoRadius`, `ArcNoChord`; `OutOfRange` if an end or the centre is beyond the
    /// range of positions.
    pub fn new(
        config: &Config,
        start: &Position,
        end: &Position,
        arc: &Arc,
    ) -> Result<Self, GeometryErrorKind> {
        let letters = arc.plane.letters();
        let found = config.plane_axes(arc.plane);
        let axis = |index: usize| {
            found[index].ok_or(GeometryErrorKind::ArcPlane {
                letter: letters[index],
            })
        };
        let axes = [axis(0)?, axis(1)?];
        let mut along = displacement(config, start, end)?;
        let chord = axes.map(|axis| along[axis]);
        for axis in axes {
            along[axis] = 0.0;
        }
        let tolerance = f64::from(config.arc_tolerance) + ROUNDING;
        let (to_centre, angle) = match arc.centre {
            Centre::Point(point) => {
                let mut centre = *start;
                for (axis, nano) in axes.into_iter().zip(point) {
                    centre[axis] = config
                        .steps_from_nano(axis, nano)
                        .ok_or(GeometryErrorKind::OutOfRange { axis })?;
                }
                let by = displacement(config, start, &centre)?;
                let to_centre = axes.map(|axis| by[axis]);
                (to_centre, sweep(to_centre, chord, arc.clockwise))
            }
            Centre::Radius(signed) => centre_by_radius(signed, chord, arc.clockwise, tolerance)?,
        };
        // A centre that is a position keeps all of this within what f64 resolves.
        let mut by = [0.0; AXES];
        for (axis, value) in axes.into_iter().zip(to_centre) {
            by[axis] = value;
        }
        place(config, start, &by)?;
        let radius = to_centre.map(|value| -value);
        let (first, last) = (
            norm(radius),
            norm([radius[0] + chord[0], radius[1] + chord[1]]),
        );
        let differ = (last - first).abs();
        // Comparisons this way round refuse NaN.
        if !(differ <= tolerance) {
            return Err(GeometryErrorKind::ArcRadii {
                start: nano(first),
                end: nano(last),
            });
        }
        if !(first > NO_RADIUS && last > NO_RADIUS) {
            return Err(GeometryErrorKind::ArcNoRadius);
        }
        let angle = angle + f64::from(arc.turns) * TAU.copysign(angle);
        let mut circle = Self {
            axes,
            radius,
            growth: last / first - 1.0,
            angle,
            along,
            pieces: 1,
            done: 0,
        };
        circle.pieces = circle.count(config, first as f32, differ as f32);
        Ok(circle)
    }

    /// Pieces that keep the tolerance.
    fn count(&self, config: &Config, radius: f32, growth: f32) -> u32 {
        let tolerance = config.curve_tolerance.clamp(1.0e-6, TOLERANCE);
        // What moves linearly with the angle, per radian.
        let angle = self.angle.abs() as f32;
        let squares: f32 = self.along.iter().map(|way| (way * way) as f32).sum();
        let linear = sqrt(squares + growth * growth) / angle;
        let mut step = core::f32::consts::FRAC_PI_2.min(angle);
        // 1.57 0.9^140 is 6e-7 radian.
        for _ in 0..140 {
            let (square, quarter) = (step * step, step * step / 16.0);
            let form = radius * (2.0 / 27.0) * 1.05 * quarter * quarter * quarter
                + linear * 1.2e-4 * square * square * step;
            if form <= 0.5 * tolerance
                && (radius + linear) * step <= LENGTH_PER_TOLERANCE * tolerance
            {
                break;
            }
            step *= 0.9;
        }
        ((angle / step) as u32).saturating_add(1)
    }

    /// Point and derivative at a share of the whole angle.
    fn at(&self, share: f64) -> Sample {
        let turned = self.angle * share;
        let (sin, cos) = (libm::sin(turned), libm::cos(turned));
        let [x, y] = self.radius;
        let unit = [x * cos - y * sin, x * sin + y * cos];
        let size = 1.0 + self.growth * share;
        let mut joint = Sample {
            offset: self.along.map(|way| way * share),
            slope: self.along,
        };
        let across = [-unit[1], unit[0]];
        for (index, axis) in self.axes.into_iter().enumerate() {
            joint.offset[axis] = size * unit[index] - self.radius[index];
            joint.slope[axis] = size * self.angle * across[index] + self.growth * unit[index];
        }
        joint
    }

    /// First axis of the plane that goes beyond `room` (see [`super::travel::TravelBounds::room`]) between the ends.
    ///
    /// The extremes of an arc lie where the radius is parallel to an axis; those of a spiral, whose radius R grows by
    /// R' per radian, a little beside, at `sqrt(R^2 + R'^2)` from the centre, and on the first or last turn.
    pub fn outside(&self, [low, high]: &[[f64; AXES]; 2]) -> Option<usize> {
        let radius = norm(self.radius);
        let sweep = self.angle.abs();
        for quarter in 0..4_u8 {
            let index = usize::from(quarter & 1);
            let axis = self.axes[index];
            let is_inside = |size: f64| {
                let reach = radius * norm([size, self.growth / sweep]) + ROUNDING;
                if quarter < 2 {
                    reach - self.radius[index] <= high[axis]
                } else {
                    -reach - self.radius[index] >= low[axis]
                }
            };
            // The whole circle is, as a rule.
            if is_inside(1.0 + self.growth.max(0.0)) {
                continue;
            }
            let first = libm::atan2(self.radius[1], self.radius[0]);
            let ahead = (f64::from(quarter) * (0.25 * TAU) - first) * 1.0_f64.copysign(self.angle);
            let ahead = ahead - TAU * libm::floor(ahead / TAU);
            if ahead > sweep {
                continue;
            }
            let last = ahead + TAU * libm::floor((sweep - ahead) / TAU);
            let size = |angle: f64| 1.0 + self.growth * angle / sweep;
            if !(is_inside(size(ahead)) && is_inside(size(last))) {
                return Some(axis);
            }
        }
        None
    }

    /// Direction in which the arc leaves its start.
    pub fn direction(&self) -> AxisVec {
        self.at(0.0).slope.map(|value| value as f32)
    }

    /// Length over the linear axes, mm.
    ///
    /// That of a spiral by five points: its speed `sqrt(R^2 angle^2 + R'^2)`, R linear, is nearly linear itself.
    pub fn length(&self, config: &Config) -> f32 {
        let radius = norm(self.radius);
        let out = radius * self.growth;
        let mut straight = out * out;
        for (axis, way) in self.along.iter().enumerate() {
            if config.axes[axis].kind == AxisKind::Linear {
                straight += way * way;
            }
        }
        let mut length = 0.0;
        for (share, weight) in GAUSS_5 {
            let round = self.angle * (radius + out * f64::from(share));
            length += f64::from(weight) * libm::sqrt(round * round + straight);
        }
        length as f32
    }

    /// The next piece, `None` behind the last one.
    pub fn next(&mut self) -> Option<Piece> {
        if self.done >= self.pieces {
            return None;
        }
        let count = f64::from(self.pieces);
        let [t0, t1] = [self.done, self.done + 1].map(|index| f64::from(index) / count);
        let (start, end) = (self.at(t0), self.at(t1));
        let quarter = self.angle / (4.0 * count);
        let scale = libm::sin(quarter) / (libm::cos(quarter) * quarter * count);
        self.done += 1;
        Some(Piece {
            t0,
            t1,
            start: start.offset,
            end: end.offset,
            slope_start: start.slope.map(|value| (value * scale) as f32),
            slope_end: end.slope.map(|value| (value * scale) as f32),
            is_last: self.done == self.pieces,
        })
    }
}

/// Angle from start to end about the centre, in (0, 2 pi] counter-clockwise or [-2 pi, 0) clockwise.
///
/// Ends that coincide as seen from the centre, to the resolution of programs, are a full turn apart.
fn sweep(to_centre: [f64; 2], chord: [f64; 2], clockwise: bool) -> f64 {
    let from = to_centre.map(|value| -value);
    let to = [from[0] + chord[0], from[1] + chord[1]];
    // The cross product of radius and chord is that of the two radii without its cancellation.
    let cross = from[0] * chord[1] - from[1] * chord[0];
    let angle = libm::atan2(cross, from[0] * to[0] + from[1] * to[1]);
    let full = if clockwise { -TAU } else { TAU };
    if angle.abs() * norm(from) <= NO_ARC {
        full
    } else if (angle < 0.0) == clockwise {
        angle
    } else {
        angle + full
    }
}

/// Centre (from the start) and angle of the arc over `chord` with a signed radius.
fn centre_by_radius(
    signed: Nano,
    chord: [f64; 2],
    clockwise: bool,
    tolerance: f64,
) -> Result<([f64; 2], f64), GeometryErrorKind> {
    let radius = signed.unsigned_abs() as f64 / NANO_PER_UNIT as f64;
    let half = 0.5 * norm(chord);
    if radius == 0.0 {
        return Err(GeometryErrorKind::ArcNoRadius);
    }
    if !(2.0 * half > NO_ARC) {
        return Err(GeometryErrorKind::ArcNoChord);
    }
    if !(half - radius <= tolerance) {
        return Err(GeometryErrorKind::ArcReach {
            radius: nano(radius),
            half: nano(half),
        });
    }
    // From the middle of the chord to the centre; zero for a radius that is a little too small: half a circle.
    let height = if radius > half {
        libm::sqrt((radius - half) * (radius + half))
    } else {
        0.0
    };
    let minor = 2.0 * libm::atan2(half, height);
    let angle = if signed < 0 { TAU - minor } else { minor };
    // Counter-clockwise and up to half a turn, the centre is to the left of the chord.
    let left = clockwise == (signed < 0);
    let aside = (if left { height } else { -height }) / (2.0 * half);
    let centre = [
        0.5 * chord[0] - aside * chord[1],
        0.5 * chord[1] + aside * chord[0],
    ];
    Ok((centre, if clockwise { -angle } else { angle }))
}
