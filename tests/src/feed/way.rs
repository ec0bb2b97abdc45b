//! Curves of the oracle by their arc length, `f64`.
//!
//! In: a [`Shape`]. Out: its length over the axes that make up the way, and the point at any length of it.

use pentaspline::config::{AxisKind, Config};
use pentaspline::units::AXES;

use crate::oracle::shape::Shape;
use crate::oracle::spline::Point;

/// Relative error of the arc lengths of the oracle.
const LENGTH_ERROR: f64 = 1e-11;

/// Abscissae on [0, 1] and weights of the Gauss-Legendre rule of five points.
const GAUSS: [(f64, f64); 5] = [
    (0.046_910_077_030_668, 0.118_463_442_528_094_5),
    (0.230_765_344_947_158_5, 0.239_314_335_249_683_2),
    (0.5, 0.284_444_444_444_444_4),
    (0.769_234_655_052_841_5, 0.239_314_335_249_683_2),
    (0.953_089_922_969_332, 0.118_463_442_528_094_5),
];

/// Axes that make up the way.
pub type Counts = [bool; AXES];

/// Length of `v` over the axes that count.
#[must_use]
pub fn size(v: &Point, counts: &Counts) -> f64 {
    let squares = (0..AXES).filter(|a| counts[*a]).map(|a| v[a] * v[a]);
    squares.sum::<f64>().sqrt()
}

/// A curve by its arc length.
pub struct Way<'a> {
    shape: &'a Shape,
    /// Axes it is measured over: the linear ones, or the rotary ones where those rest.
    pub counts: Counts,
    /// Parameter and length up to it, so dense that one rule of five points covers an interval.
    table: Vec<(f64, f64)>,
}

impl<'a> Way<'a> {
    /// Measures `shape` over the linear axes, or over the rotary ones if it moves no linear axis.
    #[must_use]
    pub fn new(config: &Config, shape: &'a Shape) -> Self {
        let linear = config.axes.map(|axis| axis.kind == AxisKind::Linear);
        let moves = (0..=64).any(|k| size(&shape.slope(f64::from(k) / 64.0), &linear) > 0.0);
        let counts = if moves {
            linear
        } else {
            linear.map(|linear| !linear)
        };
        let mut way = Self {
            shape,
            counts,
            table: vec![(0.0, 0.0)],
        };
        let rough = way.rule(0.0, 1.0);
        for k in 0..16 {
            let at = |k: u32| f64::from(k) / 16.0;
            way.refine(at(k), at(k + 1), rough, 0);
        }
        way
    }

    /// Length from `a` to `b` by one rule.
    fn rule(&self, a: f64, b: f64) -> f64 {
        let speed = |u: f64| size(&self.shape.slope(u), &self.counts);
        let sum = GAUSS.iter().map(|(x, w)| w * speed(a + x * (b - a)));
        sum.sum::<f64>() * (b - a)
    }

    fn refine(&mut self, a: f64, b: f64, rough: f64, depth: u32) {
        let m = 0.5 * (a + b);
        let (whole, halves) = (self.rule(a, b), self.rule(a, m) + self.rule(m, b));
        if depth < 30 && (whole - halves).abs() > LENGTH_ERROR * rough {
            self.refine(a, m, rough, depth + 1);
            self.refine(m, b, rough, depth + 1);
        } else {
            let so_far = self.length();
            self.table.push((b, so_far + halves));
        }
    }

    /// All of it, mm (degrees).
    #[must_use]
    pub fn length(&self) -> f64 {
        self.table.last().map_or(0.0, |&(_, length)| length)
    }

    /// The point `s` behind the start.
    #[must_use]
    pub fn at(&self, s: f64) -> Point {
        let right = self.table.partition_point(|&(_, length)| length < s);
        let right = right.clamp(1, self.table.len() - 1);
        let ((mut low, before), (mut high, _)) = (self.table[right - 1], self.table[right]);
        let start = low;
        let mut u = 0.5 * (low + high);
        for _ in 0..60 {
            let off = before + self.rule(start, u) - s;
            if off > 0.0 {
                high = u;
            } else {
                low = u;
            }
            let next = u - off / size(&self.shape.slope(u), &self.counts);
            let next = if next > low && next < high {
                next
            } else {
                0.5 * (low + high)
            };
            if off.abs() < 1e-13 || (next - u).abs() < 1e-15 {
                break;
            }
            u = next;
        }
        self.shape.at(u)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::examples;
    use crate::oracle::spline::Cubic;

    #[test]
    fn a_line_run_at_a_vanishing_speed_has_its_length_and_is_found_by_it() {
        // (30, 40) (u - 1/2)^3, two units of way in all over each half.
        let along = [30.0, 40.0, 0.0, 7.0, 0.0];
        let c = [-0.125, 0.75, -1.5, 1.0].map(|c| along.map(|x| x * c));
        let shape = Shape::Cubic(Cubic(c));
        let way = Way::new(&examples::machine().config, &shape);
        assert!((way.length() - 12.5).abs() < 1e-9, "{}", way.length());
        for k in 1..40 {
            let s = 12.5 * f64::from(k) / 40.0;
            let x = way.at(s)[0];
            assert!((x - (0.6 * s - 3.75)).abs() < 1e-8, "{x} at {s}");
        }
    }

    #[test]
    fn a_circle_has_its_length() {
        let curves = crate::oracle::path::path("G0 X10\nG3 F1 X10 Y0 I-10 J0 Z5 A3");
        let way = Way::new(&examples::machine().config, &curves[1].shape);
        let length = (20.0 * std::f64::consts::PI).hypot(5.0);
        assert!((way.length() - length).abs() < 1e-9);
        let p = way.at(length / 8.0);
        let r = 10.0 * 0.5_f64.sqrt();
        assert!((p[0] - r).abs() < 1e-9 && (p[1] - r).abs() < 1e-9, "{p:?}");
    }
}
