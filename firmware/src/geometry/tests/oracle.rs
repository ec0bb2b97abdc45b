//! Splines computed another way: `f64`, textbook formulas, the whole spline at once.

use super::support::Point;
use crate::units::AXES;

/// Chord lengths over X Y Z, over A C where X Y Z rest.
pub fn chords(points: &[Point]) -> Vec<f64> {
    points
        .windows(2)
        .map(|pair| {
            let square = |axes: core::ops::Range<usize>| {
                axes.map(|axis| (pair[1][axis] - pair[0][axis]).powi(2))
                    .sum::<f64>()
            };
            let linear = square(0..3);
            if linear > 0.0 { linear } else { square(3..5) }.sqrt()
        })
        .collect()
}

/// End condition of one axis.
#[derive(Clone, Copy, Debug)]
pub enum End {
    NotAKnot,
    Natural,
    Slope(f64),
}

/// A piecewise cubic of one axis: (length, value, first, second, third coefficient) per interval.
pub type Pieces = Vec<[f64; 5]>;

pub fn value(piece: &[f64; 5], u: f64) -> f64 {
    let [h, a, b, c, d] = *piece;
    let t = u * h;
    a + t * (b + t * (c + t * d))
}

/// Derivative by the parameter.
pub fn slope(piece: &[f64; 5], u: f64) -> f64 {
    let [h, _, b, c, d] = *piece;
    let t = u * h;
    b + t * (2.0 * c + 3.0 * t * d)
}

/// Interpolating cubic spline from its second derivatives (moments), one dense linear system over all knots.
pub fn cubic(h: &[f64], y: &[f64], begin: End, end: End) -> Pieces {
    let n = h.len();
    let slope: Vec<f64> = (0..n).map(|k| (y[k + 1] - y[k]) / h[k]).collect();
    let mut rows = vec![vec![0.0; n + 2]; n + 1];
    for k in 1..n {
        rows[k][k - 1] = h[k - 1];
        rows[k][k] = 2.0 * (h[k - 1] + h[k]);
        rows[k][k + 1] = h[k];
        rows[k][n + 1] = 6.0 * (slope[k] - slope[k - 1]);
    }
    match begin {
        End::Natural => rows[0][0] = 1.0,
        End::Slope(t) => {
            rows[0][0] = 2.0 * h[0];
            rows[0][1] = h[0];
            rows[0][n + 1] = 6.0 * (slope[0] - t);
        }
        End::NotAKnot => {
            rows[0][0] = -1.0 / h[0];
            rows[0][1] = 1.0 / h[0] + 1.0 / h[1];
            rows[0][2] = -1.0 / h[1];
        }
    }
    match end {
        End::Natural => rows[n][n] = 1.0,
        End::Slope(t) => {
            rows[n][n] = 2.0 * h[n - 1];
            rows[n][n - 1] = h[n - 1];
            rows[n][n + 1] = 6.0 * (t - slope[n - 1]);
        }
        End::NotAKnot if n == 2 && matches!(begin, End::NotAKnot) => {
            // One condition twice leaves a cubic open: take the parabola.
            rows[n][0] = 1.0;
            rows[n][2] = -1.0;
        }
        End::NotAKnot => {
            rows[n][n] = -1.0 / h[n - 1];
            rows[n][n - 1] = 1.0 / h[n - 1] + 1.0 / h[n - 2];
            rows[n][n - 2] = -1.0 / h[n - 2];
        }
    }
    let moment = solve(rows);
    (0..n)
        .map(|k| {
            [
                h[k],
                y[k],
                slope[k] - h[k] * (2.0 * moment[k] + moment[k + 1]) / 6.0,
                moment[k] / 2.0,
                (moment[k + 1] - moment[k]) / (6.0 * h[k]),
            ]
        })
        .collect()
}

/// Gaussian elimination with row pivoting; the last column is the right side.
fn solve(mut rows: Vec<Vec<f64>>) -> Vec<f64> {
    let n = rows.len();
    for column in 0..n {
        let pivot = (column..n)
            .max_by(|a, b| rows[*a][column].abs().total_cmp(&rows[*b][column].abs()))
            .unwrap();
        rows.swap(column, pivot);
        let top = rows[column].clone();
        for (index, row) in rows.iter_mut().enumerate() {
            let factor = row[column] / top[column];
            if index != column && factor != 0.0 {
                for (value, above) in row.iter_mut().zip(&top) {
                    *value -= factor * above;
                }
            }
        }
    }
    (0..n).map(|k| rows[k][n] / rows[k][k]).collect()
}

/// Akima's spline with two invented chords at each end (1970, equations 1, 12).
pub fn akima(h: &[f64], y: &[f64], begin: End, end: End) -> Pieces {
    let n = h.len();
    let inner: Vec<f64> = (0..n).map(|k| (y[k + 1] - y[k]) / h[k]).collect();
    if n == 1 {
        return vec![[h[0], y[0], inner[0], 0.0, 0.0]];
    }
    let first = inner[0] - inner[1];
    let last = inner[n - 1] - inner[n - 2];
    let mut d = vec![inner[0] + 2.0 * first, inner[0] + first];
    d.extend(&inner);
    d.extend([inner[n - 1] + last, inner[n - 1] + 2.0 * last]);
    let mut m: Vec<f64> = (0..=n)
        .map(|k| {
            let (before, after) = ((d[k + 1] - d[k]).abs(), (d[k + 3] - d[k + 2]).abs());
            if before + after < 1e-9 {
                (d[k + 1] + d[k + 2]) / 2.0
            } else {
                (after * d[k + 1] + before * d[k + 2]) / (before + after)
            }
        })
        .collect();
    match begin {
        End::NotAKnot => {}
        End::Natural => m[0] = (3.0 * inner[0] - m[1]) / 2.0,
        End::Slope(t) => m[0] = t,
    }
    match end {
        End::NotAKnot => {}
        End::Natural => m[n] = (3.0 * inner[n - 1] - m[n - 1]) / 2.0,
        End::Slope(t) => m[n] = t,
    }
    (0..n)
        .map(|k| {
            [
                h[k],
                y[k],
                m[k],
                (3.0 * inner[k] - 2.0 * m[k] - m[k + 1]) / h[k],
                (m[k] + m[k + 1] - 2.0 * inner[k]) / (h[k] * h[k]),
            ]
        })
        .collect()
}

/// Clamped knot vector over spans of these lengths.
pub fn clamped(degree: usize, spans: &[f64]) -> Vec<f64> {
    let mut at = 0.0;
    let mut out = vec![0.0; degree + 1];
    for span in spans {
        at += span;
        out.push(at);
    }
    out.extend(vec![at; degree]);
    out
}

/// B-spline point by the Cox-de Boor recursion; `t` strictly inside the knot vector.
pub fn b_spline(degree: usize, knots: &[f64], points: &[Point], t: f64) -> Point {
    let mut out = [0.0; AXES];
    for (index, point) in points.iter().enumerate() {
        let weight = basis(degree, knots, index, t);
        for axis in 0..AXES {
            out[axis] += weight * point[axis];
        }
    }
    out
}

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
