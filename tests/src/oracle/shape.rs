//! What a curve can be: cubic, arc, polynomial over a polynomial. `f64`, parameter u in [0, 1].

use super::spline::{distance, norm, Cubic, Point};

/// A polynomial per axis over one denominator, constant first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rational {
    /// Numerators; one degree more, for an axis that is linear whatever the denominator.
    pub over: [[f64; 7]; 5],
    /// Denominator.
    pub under: [f64; 6],
}

/// An arc in a plane; the other axes go linearly with the angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arc {
    /// First and second axis of the plane.
    pub plane: [usize; 2],
    /// Centre.
    pub centre: [f64; 2],
    /// Angle of the start, rad.
    pub angle: f64,
    /// Signed angle to the end, rad; more than a turn for `TURN`.
    pub sweep: f64,
    /// Radius at the start and at the end (they agree but for printed digits).
    pub radius: [f64; 2],
    /// Start.
    pub from: Point,
    /// End.
    pub to: Point,
}

/// A curve over u in [0, 1].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// Cubic; straight lines as well.
    Cubic(Cubic),
    /// Circle or helix.
    Arc(Arc),
    /// Polynomial, rational spline.
    Rational(Rational),
}

fn horner(c: &[f64], u: f64) -> f64 {
    c.iter().rev().fold(0.0, |sum, c| sum * u + c)
}

fn derivative(c: &[f64], u: f64) -> f64 {
    (1..c.len())
        .rev()
        .fold(0.0, |sum, k| sum * u + k as f64 * c[k])
}

impl Shape {
    /// P(u).
    #[must_use]
    pub fn at(&self, u: f64) -> Point {
        match self {
            Self::Cubic(cubic) => cubic.at(u),
            Self::Rational(r) => {
                let under = horner(&r.under, u);
                core::array::from_fn(|i| horner(&r.over[i], u) / under)
            }
            Self::Arc(arc) => {
                let mut p: Point =
                    core::array::from_fn(|i| arc.from[i] + u * (arc.to[i] - arc.from[i]));
                let (sin, cos) = (arc.angle + u * arc.sweep).sin_cos();
                let r = arc.radius[0] + u * (arc.radius[1] - arc.radius[0]);
                p[arc.plane[0]] = arc.centre[0] + r * cos;
                p[arc.plane[1]] = arc.centre[1] + r * sin;
                p
            }
        }
    }

    /// P'(u).
    #[must_use]
    pub fn slope(&self, u: f64) -> Point {
        match self {
            Self::Cubic(cubic) => cubic.slope(u),
            Self::Rational(r) => {
                let (under, slope) = (horner(&r.under, u), derivative(&r.under, u));
                core::array::from_fn(|i| {
                    let p = horner(&r.over[i], u) / under;
                    (derivative(&r.over[i], u) - p * slope) / under
                })
            }
            Self::Arc(arc) => {
                let mut d: Point = core::array::from_fn(|i| arc.to[i] - arc.from[i]);
                let (sin, cos) = (arc.angle + u * arc.sweep).sin_cos();
                let grow = arc.radius[1] - arc.radius[0];
                let r = arc.radius[0] + u * grow;
                d[arc.plane[0]] = grow * cos - r * sin * arc.sweep;
                d[arc.plane[1]] = grow * sin + r * cos * arc.sweep;
                d
            }
        }
    }

    /// No bend at all.
    #[must_use]
    pub fn is_straight(&self) -> bool {
        matches!(self, Self::Cubic(c) if norm(&c.0[2]) == 0.0 && norm(&c.0[3]) == 0.0)
    }

    /// Samples that show every bend.
    fn samples(&self) -> u32 {
        match self {
            Self::Arc(arc) => 400 + (100.0 * arc.sweep.abs()) as u32,
            _ => 400,
        }
    }

    /// Points of the curve so dense that straight lines between them stay within `sag` of it; the end is not among them.
    pub fn dense(&self, sag: f64, out: &mut Vec<Point>) {
        let pieces = if self.is_straight() { 1 } else { 8 };
        for k in 0..pieces {
            let at = |k: u32| f64::from(k) / f64::from(pieces);
            self.halve(at(k), at(k + 1), sag, 0, out);
        }
    }

    fn halve(&self, a: f64, b: f64, sag: f64, depth: u32, out: &mut Vec<Point>) {
        let (p, q) = (self.at(a), self.at(b));
        let m = (a + b) / 2.0;
        let middle = core::array::from_fn(|i| (p[i] + q[i]) / 2.0);
        // A curve that is symmetric about the middle of the chord crosses it there: look at the quarter as well.
        let quarter: Point = core::array::from_fn(|i| 0.75 * p[i] + 0.25 * q[i]);
        let off =
            distance(&self.at(m), &middle).max(distance(&self.at(0.75 * a + 0.25 * b), &quarter));
        if depth < 18 && !self.is_straight() && off > sag {
            self.halve(a, m, sag, depth + 1, out);
            self.halve(m, b, sag, depth + 1, out);
        } else {
            out.push(p);
        }
    }
}

/// Nearest point of `curve` to `q`: parameter and distance. Looks near `guess` first, everywhere if that is not
/// within `enough`.
#[must_use]
pub fn nearest(curve: &Shape, q: &Point, guess: f64, enough: f64) -> (f64, f64) {
    let refine = |mut u: f64| {
        for _ in 0..12 {
            let (p, d) = (curve.at(u), curve.slope(u));
            let dot: f64 = (0..5).map(|i| (q[i] - p[i]) * d[i]).sum();
            let square = norm(&d).powi(2);
            if square == 0.0 {
                break;
            }
            let step = dot / square;
            u = (u + step).clamp(0.0, 1.0);
            if step.abs() < 1e-12 {
                break;
            }
        }
        (u, distance(&curve.at(u), q))
    };
    let near = refine(guess);
    if near.1 <= enough {
        return near;
    }
    let samples = curve.samples();
    let coarse = (0..=samples)
        .map(|k| f64::from(k) / f64::from(samples))
        .min_by(|a, b| distance(&curve.at(*a), q).total_cmp(&distance(&curve.at(*b), q)))
        .unwrap_or(0.0);
    let far = refine(coarse);
    if far.1 < near.1 {
        far
    } else {
        near
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_the_derivatives_of_the_curves() {
        let arc = Shape::Arc(Arc {
            plane: [2, 0],
            centre: [1.0, 2.0],
            angle: 0.3,
            sweep: -9.0,
            radius: [4.0, 4.1],
            from: [0.0, 1.0, 2.0, 3.0, 4.0],
            to: [5.0, 3.0, 1.0, 3.0, 2.0],
        });
        let rational = Shape::Rational(Rational {
            over: [
                [1.0, 2.0, -1.0, 0.5, 0.25, -0.1, 0.0],
                [0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.3],
                [3.0, -1.0, 2.0, 0.0, 0.0, 0.0, 0.0],
                [0.0; 7],
                [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0],
            ],
            under: [1.0, 0.5, 0.25, 0.0, 0.1, 0.0],
        });
        for curve in [arc, rational] {
            for k in 1..10 {
                let (u, h) = (f64::from(k) / 10.0, 1e-6);
                let (a, b) = (curve.at(u - h), curve.at(u + h));
                let difference: Point = core::array::from_fn(|i| (b[i] - a[i]) / (2.0 * h));
                assert!(distance(&difference, &curve.slope(u)) < 1e-6);
            }
        }
    }

    #[test]
    fn dense_points_stay_on_the_curve() {
        let arc = Shape::Arc(Arc {
            plane: [0, 1],
            centre: [0.0, 0.0],
            angle: 0.0,
            sweep: 7.0,
            radius: [5.0, 5.0],
            from: [5.0, 0.0, 0.0, 0.0, 0.0],
            to: [0.0; 5],
        });
        let mut points = Vec::new();
        arc.dense(1e-5, &mut points);
        for pair in points.windows(2) {
            let middle = [
                (pair[0][0] + pair[1][0]) / 2.0,
                (pair[0][1] + pair[1][1]) / 2.0,
            ];
            assert!((middle[0].hypot(middle[1]) - 5.0).abs() < 1.1e-5);
        }
    }
}
