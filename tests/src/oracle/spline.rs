//! Spline formulas on whole splines, `f64`.
//!
//! In: knots (or control points), one row of five axes each. Out: one [`Cubic`] per interval, parameter u in [0, 1].

use super::shape::{Rational, Shape};

/// A point or vector, mm and degrees.
pub type Point = [f64; 5];

/// P(u) = c0 + c1 u + c2 u^2 + c3 u^3.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cubic(pub [Point; 4]);

fn each(f: impl Fn(usize) -> f64) -> Point {
    core::array::from_fn(f)
}

/// Euclidean norm over all axes.
#[must_use]
pub fn norm(v: &Point) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Distance of two points over all axes, mm and degrees alike.
#[must_use]
pub fn distance(a: &Point, b: &Point) -> f64 {
    norm(&each(|i| a[i] - b[i]))
}

impl Cubic {
    /// Straight from `a` to `b`.
    #[must_use]
    pub fn line(a: &Point, b: &Point) -> Self {
        Self([*a, each(|i| b[i] - a[i]), [0.0; 5], [0.0; 5]])
    }

    /// From end points and slopes per unit of u.
    fn hermite(a: &Point, b: &Point, m: &Point, n: &Point) -> Self {
        Self([
            *a,
            *m,
            each(|i| 3.0 * (b[i] - a[i]) - 2.0 * m[i] - n[i]),
            each(|i| 2.0 * (a[i] - b[i]) + m[i] + n[i]),
        ])
    }

    /// P(u).
    #[must_use]
    pub fn at(&self, u: f64) -> Point {
        let c = &self.0;
        each(|i| c[0][i] + u * (c[1][i] + u * (c[2][i] + u * c[3][i])))
    }

    /// P'(u).
    #[must_use]
    pub fn slope(&self, u: f64) -> Point {
        let c = &self.0;
        each(|i| c[1][i] + u * (2.0 * c[2][i] + u * 3.0 * c[3][i]))
    }
}

/// Chord length over the linear axes; over the rotary axes where those rest.
#[must_use]
pub fn chord(a: &Point, b: &Point) -> f64 {
    let d = each(|i| b[i] - a[i]);
    let linear = norm(&[d[0], d[1], d[2], 0.0, 0.0]);
    if linear > 0.0 {
        linear
    } else {
        norm(&d)
    }
}

/// What holds at one end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Condition {
    /// Not-a-knot; Akima's own extrapolation.
    Auto,
    /// Second derivative zero.
    Natural,
    /// First derivative by chord length.
    Slope(Point),
}

/// Gaussian elimination with row pivoting, five right sides.
fn solve(mut a: Vec<Vec<f64>>, mut b: Vec<Point>) -> Vec<Point> {
    let n = a.len();
    for column in 0..n {
        let pivot = (column..n)
            .max_by(|&i, &j| a[i][column].abs().total_cmp(&a[j][column].abs()))
            .unwrap_or(column);
        a.swap(column, pivot);
        b.swap(column, pivot);
        let (top, right) = (a[column].clone(), b[column]);
        for row in 0..n {
            let factor = a[row][column] / top[column];
            if row != column && factor != 0.0 {
                for k in column..n {
                    a[row][k] -= factor * top[k];
                }
                for i in 0..5 {
                    b[row][i] -= factor * right[i];
                }
            }
        }
    }
    (0..n).map(|k| each(|i| b[k][i] / a[k][k])).collect()
}

/// Interpolating cubic spline on chord length: one dense system for the second derivatives at all knots.
#[must_use]
pub fn cubic(knots: &[Point], begin: Condition, end: Condition) -> Vec<Cubic> {
    let n = knots.len() - 1;
    if n == 1 {
        return vec![Cubic::line(&knots[0], &knots[1])];
    }
    let h: Vec<f64> = knots.windows(2).map(|k| chord(&k[0], &k[1])).collect();
    let d: Vec<Point> = (0..n)
        .map(|k| each(|i| (knots[k + 1][i] - knots[k][i]) / h[k]))
        .collect();
    let mut a = vec![vec![0.0; n + 1]; n + 1];
    let mut b = vec![[0.0; 5]; n + 1];
    for k in 1..n {
        a[k][k - 1] = h[k - 1];
        a[k][k] = 2.0 * (h[k - 1] + h[k]);
        a[k][k + 1] = h[k];
        b[k] = each(|i| 6.0 * (d[k][i] - d[k - 1][i]));
    }
    match begin {
        Condition::Natural => a[0][0] = 1.0,
        Condition::Slope(t) => {
            a[0][0] = 2.0 * h[0];
            a[0][1] = h[0];
            b[0] = each(|i| 6.0 * (d[0][i] - t[i]));
        }
        Condition::Auto => {
            a[0][0] = h[1];
            a[0][1] = -(h[0] + h[1]);
            a[0][2] = h[0];
        }
    }
    match end {
        Condition::Natural => a[n][n] = 1.0,
        Condition::Slope(t) => {
            a[n][n] = 2.0 * h[n - 1];
            a[n][n - 1] = h[n - 1];
            b[n] = each(|i| 6.0 * (t[i] - d[n - 1][i]));
        }
        Condition::Auto if n == 2 && begin == Condition::Auto => {
            // The same condition twice; of all cubics the parabola.
            a[n][0] = 1.0;
            a[n][2] = -1.0;
        }
        Condition::Auto => {
            a[n][n] = h[n - 2];
            a[n][n - 1] = -(h[n - 2] + h[n - 1]);
            a[n][n - 2] = h[n - 1];
        }
    }
    let m = solve(a, b);
    (0..n)
        .map(|k| {
            let h = h[k];
            Cubic([
                knots[k],
                each(|i| h * d[k][i] - h * h * (2.0 * m[k][i] + m[k + 1][i]) / 6.0),
                each(|i| h * h * m[k][i] / 2.0),
                each(|i| h * h * (m[k + 1][i] - m[k][i]) / 6.0),
            ])
        })
        .collect()
}

/// Akima's spline (J. ACM 17, 1970) on chord length.
#[must_use]
pub fn akima(knots: &[Point], begin: Condition, end: Condition) -> Vec<Cubic> {
    let n = knots.len() - 1;
    if n == 1 {
        return vec![Cubic::line(&knots[0], &knots[1])];
    }
    let h: Vec<f64> = knots.windows(2).map(|k| chord(&k[0], &k[1])).collect();
    let inner: Vec<Point> = (0..n)
        .map(|k| each(|i| (knots[k + 1][i] - knots[k][i]) / h[k]))
        .collect();
    let slopes: Vec<Vec<f64>> = (0..5)
        .map(|i| {
            let d = |k: usize| inner[k][i];
            // Two invented chords at each end continue the parabola (equation 12 of the paper).
            let (down, up) = (d(0) - d(1), d(n - 1) - d(n - 2));
            let mut all = vec![d(0) + 2.0 * down, d(0) + down];
            all.extend((0..n).map(d));
            all.extend([d(n - 1) + up, d(n - 1) + 2.0 * up]);
            let mut m: Vec<f64> = (0..=n)
                .map(|k| {
                    let w = &all[k..k + 4];
                    let (left, right) = ((w[3] - w[2]).abs(), (w[1] - w[0]).abs());
                    if left + right < 1e-9 {
                        (w[1] + w[2]) / 2.0
                    } else {
                        (left * w[1] + right * w[2]) / (left + right)
                    }
                })
                .collect();
            match begin {
                Condition::Auto => {}
                Condition::Natural => m[0] = (3.0 * d(0) - m[1]) / 2.0,
                Condition::Slope(t) => m[0] = t[i],
            }
            match end {
                Condition::Auto => {}
                Condition::Natural => m[n] = (3.0 * d(n - 1) - m[n - 1]) / 2.0,
                Condition::Slope(t) => m[n] = t[i],
            }
            m
        })
        .collect();
    (0..n)
        .map(|k| {
            let scaled = |k: usize, h: f64| each(|i| slopes[i][k] * h);
            Cubic::hermite(
                &knots[k],
                &knots[k + 1],
                &scaled(k, h[k]),
                &scaled(k + 1, h[k]),
            )
        })
        .collect()
}

/// Cox-de Boor recursion.
fn basis(degree: usize, knots: &[f64], index: usize, t: f64) -> f64 {
    if degree == 0 {
        return f64::from(u8::from(knots[index] <= t && t < knots[index + 1]));
    }
    let ratio = |a: f64, b: f64| if b == 0.0 { 0.0 } else { a / b };
    let end = index + degree;
    ratio(t - knots[index], knots[end] - knots[index]) * basis(degree - 1, knots, index, t)
        + ratio(knots[end + 1] - t, knots[end + 1] - knots[index + 1])
            * basis(degree - 1, knots, index + 1, t)
}

/// Clamped B-spline; `spans` are the lengths of its knot intervals. One cubic per interval, found by
/// evaluating the recursion at four places: that determines a cubic.
#[must_use]
pub fn b_spline(degree: usize, points: &[Point], spans: &[f64]) -> Vec<Cubic> {
    assert_eq!(spans.len() + degree, points.len());
    let mut knots = vec![0.0; degree + 1];
    let mut at = 0.0;
    for span in spans {
        at += span;
        knots.push(at);
    }
    knots.extend(vec![at; degree]);
    (0..spans.len())
        .map(|k| {
            let value = |u: f64| -> Point {
                let t = knots[degree + k] + u * spans[k];
                let mut sum = [0.0; 5];
                for index in k..=k + degree {
                    let weight = basis(degree, &knots, index, t);
                    sum = each(|i| sum[i] + weight * points[index][i]);
                }
                sum
            };
            let [p, q, r, s] = [0.0, 0.25, 0.5, 0.75].map(value);
            // Newton's divided differences on a grid of 1/4, expanded.
            let d1 = each(|i| q[i] - p[i]);
            let d2 = each(|i| r[i] - 2.0 * q[i] + p[i]);
            let d3 = each(|i| s[i] - 3.0 * r[i] + 3.0 * q[i] - p[i]);
            Cubic([
                p,
                each(|i| 4.0 * d1[i] - 2.0 * d2[i] + 4.0 / 3.0 * d3[i]),
                each(|i| 8.0 * d2[i] - 8.0 * d3[i]),
                each(|i| 32.0 / 3.0 * d3[i]),
            ])
        })
        .collect()
}

/// Rational B-spline on any knot vector (`points + degree + 1` knots, de Boor, "A Practical Guide to Splines", with one
/// more coordinate for the weight). Per interval between `knots[degree]` and `knots[points]` the curve, or `None` where
/// the interval is empty. Numerators and denominator are cubics, found from four values each.
#[must_use]
pub fn rational(
    degree: usize,
    points: &[Point],
    weights: &[f64],
    knots: &[f64],
) -> Vec<Option<Shape>> {
    assert_eq!(knots.len(), points.len() + degree + 1);
    (degree..points.len())
        .map(|k| {
            let span = knots[k + 1] - knots[k];
            (span > 0.0).then(|| {
                let value = |u: f64| -> [f64; 6] {
                    let t = knots[k] + u * span;
                    let mut sum = [0.0; 6];
                    for index in k - degree..=k {
                        let weight = weights[index] * basis(degree, knots, index, t);
                        for (sum, x) in sum.iter_mut().zip(points[index].iter().chain([&1.0])) {
                            *sum += weight * x;
                        }
                    }
                    sum
                };
                let [p, q, r, s] = [0.0, 0.25, 0.5, 0.75].map(value);
                let all: [[f64; 6]; 6] = core::array::from_fn(|i| {
                    let d1 = q[i] - p[i];
                    let d2 = r[i] - 2.0 * q[i] + p[i];
                    let d3 = s[i] - 3.0 * r[i] + 3.0 * q[i] - p[i];
                    [
                        p[i],
                        4.0 * d1 - 2.0 * d2 + 4.0 / 3.0 * d3,
                        8.0 * d2 - 8.0 * d3,
                        32.0 / 3.0 * d3,
                        0.0,
                        0.0,
                    ]
                });
                Shape::Rational(Rational {
                    over: core::array::from_fn(|axis| {
                        core::array::from_fn(|k| all[axis].get(k).copied().unwrap_or(0.0))
                    }),
                    under: all[5],
                })
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane(x: f64, y: f64) -> Point {
        [x, y, 0.0, 0.0, 0.0]
    }

    #[test]
    fn a_clamped_cubic_without_inner_knots_is_the_bezier_curve() {
        let points = [
            plane(0.0, 0.0),
            plane(1.0, 2.0),
            plane(3.0, 3.0),
            plane(4.0, -1.0),
        ];
        let curve = b_spline(3, &points, &[2.0])[0];
        for u in [0.0, 0.1, 0.5, 0.9, 1.0] {
            let v = 1.0 - u;
            let w = [v * v * v, 3.0 * u * v * v, 3.0 * u * u * v, u * u * u];
            let bezier = each(|i| (0..4).map(|k| w[k] * points[k][i]).sum());
            assert!(distance(&curve.at(u), &bezier) < 1e-12);
        }
    }

    #[test]
    fn a_natural_spline_is_twice_continuous_and_ends_flat() {
        let knots = [
            plane(0.0, 0.0),
            plane(1.0, 2.0),
            plane(4.0, 3.0),
            plane(4.5, 1.0),
            plane(9.0, -1.0),
        ];
        let pieces = cubic(&knots, Condition::Natural, Condition::Natural);
        let second =
            |c: &Cubic, u: f64, h: f64| each(|i| (2.0 * c.0[2][i] + 6.0 * c.0[3][i] * u) / (h * h));
        let h: Vec<f64> = knots.windows(2).map(|k| chord(&k[0], &k[1])).collect();
        for k in 0..pieces.len() - 1 {
            assert!(distance(&pieces[k].at(1.0), &knots[k + 1]) < 1e-12);
            let [a, b] = [
                second(&pieces[k], 1.0, h[k]),
                second(&pieces[k + 1], 0.0, h[k + 1]),
            ];
            assert!(distance(&a, &b) < 1e-12);
            let a = pieces[k].slope(1.0).map(|x| x / h[k]);
            let b = pieces[k + 1].slope(0.0).map(|x| x / h[k + 1]);
            assert!(distance(&a, &b) < 1e-12);
        }
        assert!(norm(&second(&pieces[0], 0.0, h[0])) < 1e-12);
        assert!(norm(&second(&pieces[3], 1.0, h[3])) < 1e-12);
    }

    #[test]
    fn akima_does_not_overshoot_a_flat_stretch() {
        let knots = [0.0, 1.0, 2.0, 3.0, 4.0].map(|x| plane(x, f64::from(u8::from(x > 2.5))));
        let pieces = akima(&knots, Condition::Auto, Condition::Auto);
        assert!((0..=10).all(|k| pieces[0].at(f64::from(k) / 10.0)[1].abs() < 1e-12));
    }
}
