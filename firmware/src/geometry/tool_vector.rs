//! Rotary axes that follow a tool vector (`XH YH ZH`) along one knot span.
//!
//! In: the Bezier points of the vector V over the span, the head, the angles at which the axes stand. Out: both angles
//! and their slopes at any parameter, continuous from where they stand. No state between evaluations.
//!
//! Write the part of V across Z as a complex number z with `z = |V| sin(tilt) e^(i turn)` and the part along Z as
//! `w = |V| cos(tilt)` ([`Head`]). Where z is never 0, `turn = arg z` and `tilt = atan2(|z|, w)`. At the pole z is 0 and
//! its argument undefined; but z is a polynomial, so there `z = (t - r) y` with a polynomial y that is not 0, and
//! `turn = arg y`, `tilt = atan2((t - r) |y|, w)` pass through smoothly: the turn stays, the tilt changes its sign.

use super::error::GeometryErrorKind;
use crate::config::{Config, Head};
use crate::units::{Nano, AXES, NANO_PER_UNIT};

/// Closer to the pole than this (radian; 1e-4 degree) counts as at the pole.
const POLE: f64 = 1.75e-6;

/// Largest difference between the angles the vector asks for and those the axes have, degrees. Next to the pole angles
/// are not known any better.
pub(super) const JUMP: f64 = 0.01;

/// Vectors shorter than this part of the longest one of the span have no direction.
const NO_LENGTH: f64 = 1e-6;

/// Parameter intervals after each of which the turn is known without ambiguity of 360 degrees.
const INTERVALS: usize = 16;

const DEGREES: f64 = 180.0 / core::f64::consts::PI;

/// Complex polynomial in powers of t.
type Complex = [[f64; 2]; 4];

/// Which axes the head turns the tool with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct HeadAxes {
    /// X Y Z.
    pub linear: [usize; 3],
    /// Index of A or B.
    pub tilt: usize,
    /// Index of C.
    pub turn: usize,
    head: Head,
}

impl HeadAxes {
    /// Axes of the configured head.
    ///
    /// # Errors
    /// `ToolVector` without a head, or if one of its axes is missing.
    pub fn new(config: &Config) -> Result<Self, GeometryErrorKind> {
        let letters = match config.head {
            Head::None => return Err(GeometryErrorKind::ToolVector),
            Head::CA => *b"XYZAC",
            Head::CB => *b"XYZBC",
        };
        let mut index = [0; AXES];
        for (index, letter) in index.iter_mut().zip(letters) {
            *index = config
                .axes
                .iter()
                .position(|axis| axis.letter == letter)
                .ok_or(GeometryErrorKind::ToolVector)?;
        }
        let [x, y, z, tilt, turn] = index;
        Ok(Self {
            linear: [x, y, z],
            tilt,
            turn,
            head: config.head,
        })
    }

    /// Unit vector of the tool at these angles, degrees.
    pub fn vector(&self, tilt: f64, turn: f64) -> [f64; 3] {
        let (tilt, turn) = (tilt / DEGREES, turn / DEGREES);
        let across = libm::sin(tilt);
        let (c, s) = (libm::cos(turn), libm::sin(turn));
        let up = libm::cos(tilt);
        match self.head {
            Head::CB => [across * c, across * s, up],
            _ => [across * s, -across * c, up],
        }
    }

    /// z of a vector.
    fn lean(&self, vector: &[f64; 3]) -> [f64; 2] {
        let [x, y, _] = *vector;
        match self.head {
            Head::CB => [x, y],
            _ => [-y, x],
        }
    }
}

/// `target` with its rotary axes where they are once the tool has been led from where it points at `from` straight to
/// the direction from `target` to `point`. Positions in 1e-6 mm or degree, machine coordinates.
///
/// These are the angles at which a B-spline through these points leaves the axes, unless its curve and its polygon pass
/// the pole on different sides. `None` without a head or a direction, or where the axes would have to jump.
pub(crate) fn led(
    config: &Config,
    from: &[Nano; AXES],
    target: &[Nano; AXES],
    point: &[Nano; 3],
) -> Option<[Nano; AXES]> {
    const UNIT: f64 = NANO_PER_UNIT as f64;
    let head = HeadAxes::new(config).ok()?;
    let axes = [head.tilt, head.turn];
    let now = axes.map(|axis| from[axis] as f64 / UNIT);
    let mut vector = [0.0; 3];
    for ((value, axis), to) in vector.iter_mut().zip(head.linear).zip(point) {
        *value = to.checked_sub(target[axis])? as f64 / UNIT;
    }
    let length = libm::sqrt(vector.iter().map(|x| x * x).sum());
    let shown = head.vector(now[0], now[1]).map(|x| x * length);
    let part = |part: f64| -> [f64; 3] {
        core::array::from_fn(|k| shown[k] + part * (vector[k] - shown[k]))
    };
    let vectors = [shown, part(1.0 / 3.0), part(2.0 / 3.0), vector];
    let by = ToolSpan::new(&head, &vectors, now).ok()?.at(1.0)?.offset;
    let mut out = *target;
    for ((axis, now), by) in axes.into_iter().zip(now).zip(by) {
        // Within a few turns.
        out[axis] = libm::round((now + by) * UNIT) as Nano;
    }
    Some(out)
}

/// Angles and their slopes by t, degrees: tilt, turn.
pub(super) struct Angles {
    /// From where the axes stand at t = 0.
    pub offset: [f64; 2],
    /// By t.
    pub slope: [f64; 2],
}

/// The angles over one span.
#[derive(Clone, Copy)]
pub(super) struct ToolSpan {
    /// y: z without its real roots.
    lean: Complex,
    /// w.
    up: [f64; 4],
    /// Real roots of z in [0, 1].
    roots: [f64; 3],
    count: usize,
    /// Sign of the tilt in front of the product over the roots; 0 where the vector is along Z throughout.
    sign: f64,
    /// Angles the vector asks for at t = 0.
    start: [f64; 2],
    /// `start` less the angles the axes have there: made up for over the span.
    lag: [f64; 2],
    /// Turn at k / INTERVALS from that at 0.
    turns: [f32; INTERVALS + 1],
    /// Square of the length below which a vector has no direction.
    least: f64,
}

impl ToolSpan {
    /// The span with Bezier points `vectors` (of any common scale, a rational curve's weight included), entered at
    /// `now` degrees of tilt and turn.
    ///
    /// # Errors
    /// `ToolVector` if the vector vanishes; `ToolJump` if the axes are not where the vector begins.
    pub fn new(
        axes: &HeadAxes,
        vectors: &[[f64; 3]; 4],
        now: [f64; 2],
    ) -> Result<Self, GeometryErrorKind> {
        let square = |v: &[f64; 3]| v.iter().map(|x| x * x).sum::<f64>();
        let longest = libm::sqrt(vectors.iter().map(square).fold(0.0, f64::max));
        let leans = vectors.map(|v| axes.lean(&v));
        let mut lean = [[0.0; 2]; 4];
        for part in 0..2 {
            for (to, from) in lean.iter_mut().zip(powers(&leans.map(|z| z[part]))) {
                to[part] = from;
            }
        }
        let mut out = Self {
            lean,
            up: powers(&vectors.map(|v| v[2])),
            roots: [0.0; 3],
            count: 0,
            sign: 1.0,
            start: now,
            lag: [0.0; 2],
            turns: [0.0; INTERVALS + 1],
            least: longest * longest * (NO_LENGTH * NO_LENGTH),
        };
        let ends = [&vectors[0], &vectors[3]];
        if !(longest > 0.0) || ends.iter().any(|v| square(v) <= out.least) {
            return Err(GeometryErrorKind::ToolVector);
        }
        let pole = longest * POLE;
        if leans.iter().all(|z| size(z) <= pole * pole) {
            return out.along_z(now);
        }
        out.divide_by_roots(pole)?;
        out.enter(now)?;
        out.unwrap_turns();
        Ok(out)
    }

    /// The vector is along Z throughout: the turn stays.
    fn along_z(mut self, now: [f64; 2]) -> Result<Self, GeometryErrorKind> {
        let turn = now[1] / DEGREES;
        self.lean = [[0.0; 2]; 4];
        self.lean[0] = [libm::cos(turn), libm::sin(turn)];
        self.sign = 0.0;
        let first = self.up[0];
        for k in 0..=INTERVALS {
            let (up, _) = real(&self.up, fraction(k));
            if up * first <= 0.0 || up * up <= self.least {
                return Err(GeometryErrorKind::ToolVector);
            }
        }
        let tilt = libm::atan2(0.0, first) * DEGREES;
        self.start = [near(tilt, now[0]), now[1]];
        self.settle(now)?;
        Ok(self)
    }

    /// Finds where the vector is at the pole, and takes these roots out of z.
    fn divide_by_roots(&mut self, pole: f64) -> Result<(), GeometryErrorKind> {
        for slot in 0..self.roots.len() {
            let Some(root) = self.root(pole) else {
                return Ok(());
            };
            let (up, _) = real(&self.up, root);
            if up * up <= self.least {
                return Err(GeometryErrorKind::ToolVector);
            }
            // Synthetic division; the remainder, z at the root, is dropped.
            let mut carry = [0.0; 2];
            for k in (0..self.lean.len()).rev() {
                let here = self.lean[k];
                self.lean[k] = carry;
                carry = [here[0] + root * carry[0], here[1] + root * carry[1]];
            }
            self.roots[slot] = root;
            self.count = slot + 1;
        }
        Ok(())
    }

    /// A parameter at which y vanishes, to within `pole`.
    fn root(&self, pole: f64) -> Option<f64> {
        let at = |t: f64| size(&complex(&self.lean, t).0);
        let limit = pole * pole;
        if at(0.0) <= limit {
            return Some(0.0);
        }
        if at(1.0) <= limit {
            return Some(1.0);
        }
        for k in 0..=INTERVALS {
            let mut t = fraction(k);
            let here = at(t);
            let higher = |k: usize| k > INTERVALS || at(fraction(k)) >= here;
            if !(higher(k + 1) && higher(k.wrapping_sub(1))) {
                continue;
            }
            // Gauss-Newton for the least |y|: quadratic at a root, and only roots matter.
            for _ in 0..12 {
                let (y, slope) = complex(&self.lean, t);
                let steep = size(&slope);
                if steep > 0.0 {
                    t = (t - (y[0] * slope[0] + y[1] * slope[1]) / steep).clamp(0.0, 1.0);
                }
            }
            if at(t) <= limit {
                return Some(t);
            }
        }
        None
    }

    /// Chooses between (tilt, turn) and (-tilt, turn + 180): the one at which the axes stand.
    fn enter(&mut self, now: [f64; 2]) -> Result<(), GeometryErrorKind> {
        let mut best = f64::INFINITY;
        let mut chosen = *self;
        for sign in [1.0, -1.0] {
            let mut other = *self;
            other.sign = sign;
            other.lean = self.lean.map(|z| z.map(|part| part * sign));
            let (y, _) = complex(&other.lean, 0.0);
            let (up, _) = real(&other.up, 0.0);
            let across = sign * self.product(0.0).0 * libm::sqrt(size(&y));
            let tilt = near(libm::atan2(across, up) * DEGREES, now[0]);
            let turn = near(libm::atan2(y[1], y[0]) * DEGREES, now[1]);
            let miss = libm::fabs(tilt - now[0]).max(libm::fabs(turn - now[1]));
            if miss < best {
                best = miss;
                other.start = [tilt, turn];
                chosen = other;
            }
        }
        *self = chosen;
        self.settle(now)
    }

    /// Notes by how much the axes are off, if that is little enough.
    fn settle(&mut self, now: [f64; 2]) -> Result<(), GeometryErrorKind> {
        self.lag = [self.start[0] - now[0], self.start[1] - now[1]];
        if self.lag.iter().all(|lag| libm::fabs(*lag) <= JUMP) {
            Ok(())
        } else {
            Err(GeometryErrorKind::ToolJump)
        }
    }

    /// Follows the turn from 0 to 1, in steps over which it changes by less than a right angle.
    fn unwrap_turns(&mut self) {
        let turn = |t: f64| {
            let (y, _) = complex(&self.lean, t);
            libm::atan2(y[1], y[0]) * DEGREES
        };
        let mut turns = [0.0_f32; INTERVALS + 1];
        let mut total = 0.0;
        let mut last = turn(0.0);
        for (k, slot) in turns.iter_mut().enumerate().skip(1) {
            let end = fraction(k);
            let mut t = fraction(k - 1);
            let mut step = end - t;
            while t < end {
                let next = if t + step >= end { end } else { t + step };
                let here = turn(next);
                let by = near(here - last, 0.0);
                if libm::fabs(by) > 90.0 && step > 1e-6 {
                    step *= 0.5;
                    continue;
                }
                total += by;
                last = here;
                t = next;
                step *= 2.0;
            }
            *slot = total as f32;
        }
        self.turns = turns;
    }

    /// Product over the roots, and its derivative.
    fn product(&self, t: f64) -> (f64, f64) {
        let (mut value, mut slope) = (1.0, 0.0);
        for root in self.roots.iter().take(self.count) {
            slope = slope * (t - root) + value;
            value *= t - root;
        }
        (value, slope)
    }

    /// Angles at `t` in [0, 1]; `None` where the vector has no direction.
    pub fn at(&self, t: f64) -> Option<Angles> {
        let (y, dy) = complex(&self.lean, t);
        let (up, dup) = real(&self.up, t);
        let (product, dproduct) = self.product(t);
        let square = size(&y);
        let length = libm::sqrt(square);
        let dlength = (y[0] * dy[0] + y[1] * dy[1]) / length;
        let across = self.sign * product * length;
        let dacross = self.sign * (dproduct * length + product * dlength);
        let whole = up * up + across * across;
        if !(square > 0.0 && whole > self.least) {
            return None;
        }
        let tilt = libm::atan2(across, up) * DEGREES - self.start[0];
        let turn = libm::atan2(y[1], y[0]) * DEGREES - self.start[1];
        let known = self
            .turns
            .get(libm::round(t * INTERVALS as f64) as usize)
            .copied()
            .unwrap_or(0.0);
        let slope = [
            (up * dacross - across * dup) / whole * DEGREES + self.lag[0],
            (y[0] * dy[1] - y[1] * dy[0]) / square * DEGREES + self.lag[1],
        ];
        Some(Angles {
            offset: [
                near(tilt, 0.0) + t * self.lag[0],
                near(turn, f64::from(known)) + t * self.lag[1],
            ],
            slope,
        })
    }
}

/// k / INTERVALS.
fn fraction(k: usize) -> f64 {
    k as f64 / INTERVALS as f64
}

/// `angle` moved by full turns to within half a turn of `to`, degrees.
fn near(angle: f64, to: f64) -> f64 {
    angle - 360.0 * libm::round((angle - to) / 360.0)
}

fn size(z: &[f64; 2]) -> f64 {
    z[0] * z[0] + z[1] * z[1]
}

/// Bezier points to powers of t.
fn powers(b: &[f64; 4]) -> [f64; 4] {
    [
        b[0],
        3.0 * (b[1] - b[0]),
        3.0 * (b[0] - 2.0 * b[1] + b[2]),
        b[3] - b[0] + 3.0 * (b[1] - b[2]),
    ]
}

/// Value and derivative.
fn real(c: &[f64; 4], t: f64) -> (f64, f64) {
    (
        c[0] + t * (c[1] + t * (c[2] + t * c[3])),
        c[1] + t * (2.0 * c[2] + t * 3.0 * c[3]),
    )
}

/// Value and derivative.
fn complex(c: &Complex, t: f64) -> ([f64; 2], [f64; 2]) {
    let (x, dx) = real(&c.map(|z| z[0]), t);
    let (y, dy) = real(&c.map(|z| z[1]), t);
    ([x, y], [dx, dy])
}
