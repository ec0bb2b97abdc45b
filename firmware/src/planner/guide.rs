//! The feed that limits of jerk allow along the path ahead: where to slow down early so as to go on fast.
//!
//! In: the motion and the segments ahead. Out: [`Guide`], velocity and acceleration over the path, which the planner tries to follow
//! before anything else. Nothing is taken from it that has not been run: it may be off a little.
//!
//! The square b of the velocity is a quadratic B-spline over the path with a knot at each joint; a = b'/2, and with that the
//! acceleration of an axis q' a + q'' b is linear in b, and its jerk is v = sqrt(b) times d/ds of it. What is sought is the least of
//!
//!   sum of the time at each knot, (1 - mu log barriers of all limits) ds / sqrt(b)
//!
//! that is an interior-point method with a barrier that stays (Boyd, Vandenberghe, Convex Optimization, 11.2), continued as a
//! parabola where it is near or beyond a limit (Hauser, Saccon, A barrier function method for the optimization of trajectory
//! functionals with constraints, CDC 2006), so that any beginning will do. Each decision makes one step of Newton's method from
//! where the last one has left it (Diehl, Bock, Schlöder, A real-time iteration scheme, SIAM J. Control Optim. 43(5), 2005). Its matrix
//! has two diagonals beside the main one.

use super::course::Motion;
use super::limits::Part;
use super::profile::View;
use crate::units::{larger, smaller, sqrt, AXES};

/// Segments that are looked at.
const AHEAD: usize = 24;
/// Coefficients that belong to them.
const COEFFICIENTS: usize = AHEAD + 2;

#[derive(Clone, Copy, Debug)]
pub(super) struct Guide {
    /// Coefficients; three in a row belong to a segment.
    c: [f32; COEFFICIENTS],
    /// Running number of the first segment.
    first: u32,
    /// Segments.
    len: usize,
    /// What is left of the first segment where the guide begins, path units.
    left: f32,
}

/// Values over the coefficients of a segment: b, b' and b'' at one of its ends.
type Basis = [[f32; 3]; 3];

/// The basis at the beginning and at the end of a segment of length `h` between segments of `before` and `after`.
fn bases([before, h, after]: [f32; 3]) -> [Basis; 2] {
    let (x, y) = (1.0 / (before + h), 1.0 / (h + after));
    let (e0, e2) = (2.0 * x / h, 2.0 * y / h);
    let bent = [e0, -e0 - e2, e2];
    [
        [[h * x, before * x, 0.0], [-2.0 * x, 2.0 * x, 0.0], bent],
        [[0.0, after * y, h * y], [0.0, -2.0 * y, 2.0 * y], bent],
    ]
}

/// First and second derivative of -log(x), continued below `NEAR`.
fn barrier(x: f32) -> [f32; 2] {
    let near = crate::knob(10, 0.01);
    if x > near {
        let per = 1.0 / x;
        [-per, per * per]
    } else {
        let per = 1.0 / near;
        [((x - near) * per - 1.0) * per, per * per]
    }
}

impl Guide {
    pub(super) const NONE: Self = Self {
        c: [0.0; COEFFICIENTS],
        first: 0,
        len: 0,
        left: 0.0,
    };

    /// Lengths of segment `i` and its neighbours.
    fn lengths(&self, view: &View<'_>, i: usize) -> [f32; 3] {
        let base = self.first.wrapping_sub(view.first) as usize;
        let of = |i: usize| {
            if i == 0 {
                self.left
            } else {
                view.nodes.get(base + i).length
            }
        };
        let h = of(i);
        [
            if i == 0 { h } else { of(i - 1) },
            h,
            if i + 1 < self.len { of(i + 1) } else { h },
        ]
    }

    /// Makes it go on from `at`, and takes a step towards what is best.
    pub(super) fn go_on(&mut self, view: &View<'_>, at: &Motion) {
        let number = view.first.wrapping_add(at.node as u32);
        let passed = number.wrapping_sub(self.first) as usize;
        let mut len = 0;
        let mut stops = false;
        for index in at.node..view.end.min(at.node + AHEAD) {
            let node = view.nodes.get(index);
            if node.brisk {
                break;
            }
            len += 1;
            if node.stop {
                stops = true;
                break;
            }
        }
        if len < 4 || at.v <= 0.0 || !(at.left > 0.0) {
            self.len = 0;
            return;
        }
        let cold = passed + 2 >= self.len;
        let b = at.v * at.v;
        if cold {
            let low = (at.node..at.node + len)
                .map(|k| smaller(view.nodes.get(k).limits.v, 1.0e6))
                .fold(f32::MAX, smaller);
            self.c = [larger(b, 0.05 * low * low); COEFFICIENTS];
        } else {
            self.c.copy_within(passed.., 0);
            let known = self.len - passed + 2;
            let last = self.c[known - 1];
            for c in &mut self.c[known..] {
                *c = last;
            }
        }
        (self.first, self.len, self.left) = (number, len, at.left);
        // b and b' at the beginning.
        let half = at.a * at.left;
        self.c[0] = b - half;
        self.c[1] = b + half;
        let free = if stops {
            let rest = crate::knob(11, 1.0e-3)
                * self.c[2..len].iter().fold(0.0, |x: f32, &y| larger(x, y));
            self.c[len] = rest;
            self.c[len + 1] = rest;
            len
        } else {
            len + 2
        };
        let steps = if cold {
            crate::knob(12, 8.0) as usize
        } else {
            crate::knob(13, 1.0) as usize
        };
        for _ in 0..steps {
            self.improve(view, free);
        }
    }

    /// One step of Newton's method for the coefficients from the third on and below `free`.
    fn improve(&mut self, view: &View<'_>, free: usize) {
        let mu = crate::knob(14, 0.01);
        let share = crate::knob(15, 0.98);
        let base = self.first.wrapping_sub(view.first) as usize;
        let mut g = [0.0_f32; COEFFICIENTS];
        let mut h0 = [0.0_f32; COEFFICIENTS];
        let mut h1 = [0.0_f32; COEFFICIENTS];
        let mut h2 = [0.0_f32; COEFFICIENTS];
        for i in 0..self.len {
            let node = view.nodes.get(base + i);
            let lengths = self.lengths(view, i);
            let c = [self.c[i], self.c[i + 1], self.c[i + 2]];
            let rates = &view.rates[0];
            let exits = [
                if i == 0 {
                    node.limits.v
                } else {
                    smaller(node.limits.v, view.nodes.get(base + i - 1).exit_v)
                },
                if node.stop {
                    node.limits.v
                } else {
                    smaller(node.limits.v, node.exit_v)
                },
            ];
            let lefts = [lengths[1], 0.0];
            for (end, basis) in bases(lengths).iter().enumerate() {
                let [b, p, q] = basis.map(|row| row[0] * c[0] + row[1] * c[1] + row[2] * c[2]);
                let cap = exits[end] * exits[end];
                let b = larger(b, 1.0e-4 * cap);
                let v = sqrt(b);
                let time = 0.5 * lengths[1] / v;
                let weight = mu * time;
                // By b, b', b''.
                let mut gl = [-0.5 * time / b, 0.0, 0.0];
                let mut hl = [0.75 * time / (b * b), 0.0, 0.0, 0.0, 0.0, 0.0];
                let [first, second] = barrier(1.0 - b / cap);
                gl[0] -= weight * first / cap;
                hl[0] += weight * second / (cap * cap);
                let part = Part::between(node.length, [lefts[end]; 2]);
                for axis in 0..AXES {
                    let Some([[q1, _], [q2, _], [q3, _]]) = node.limits.of_axis(axis, part) else {
                        continue;
                    };
                    let per_a = 1.0 / (share * rates.a[axis]);
                    let per_j = v / (share * rates.j[axis]);
                    let a = [q2 * per_a, 0.5 * q1 * per_a, 0.0];
                    let mut j = [q3 * per_j, 1.5 * q2 * per_j, 0.5 * q1 * per_j];
                    let x = a[0] * b + a[1] * p;
                    let y = j[0] * b + j[1] * p + j[2] * q;
                    j[0] += 0.5 * y / b;
                    for (row, x) in [(a, x), (j, y)] {
                        let [low, high] = [barrier(1.0 + x), barrier(1.0 - x)];
                        let slope = weight * (low[0] - high[0]);
                        let bend = weight * (low[1] + high[1]);
                        for k in 0..3 {
                            gl[k] += slope * row[k];
                        }
                        hl[0] += bend * row[0] * row[0];
                        hl[1] += bend * row[0] * row[1];
                        hl[2] += bend * row[0] * row[2];
                        hl[3] += bend * row[1] * row[1];
                        hl[4] += bend * row[1] * row[2];
                        hl[5] += bend * row[2] * row[2];
                    }
                }
                let full = [
                    [hl[0], hl[1], hl[2]],
                    [hl[1], hl[3], hl[4]],
                    [hl[2], hl[4], hl[5]],
                ];
                // To the coefficients.
                let column = |k: usize| [basis[0][k], basis[1][k], basis[2][k]];
                let dot = |x: &[f32; 3], y: &[f32; 3]| x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
                for k in 0..3 {
                    let x = column(k);
                    g[i + k] += dot(&x, &gl);
                    let hx = full.map(|row| dot(&row, &x));
                    h0[i + k] += dot(&hx, &x);
                    if k < 2 {
                        h1[i + k] += dot(&hx, &column(k + 1));
                    }
                    if k < 1 {
                        h2[i + k] += dot(&hx, &column(k + 2));
                    }
                }
            }
        }
        // L D L^T of the band, then the step in place of g.
        let (mut l1, mut l2, mut d) = (h1, h2, h0);
        for i in 2..free {
            let whole = d[i];
            let mut y = h1[i];
            let mut r = -g[i];
            if i > 2 {
                d[i] -= l1[i - 1] * l1[i - 1] * d[i - 1];
                y -= l1[i - 1] * d[i - 1] * l2[i - 1];
                r -= l1[i - 1] * g[i - 1];
            }
            if i > 3 {
                d[i] -= l2[i - 2] * l2[i - 2] * d[i - 2];
                r -= l2[i - 2] * g[i - 2];
            }
            d[i] = larger(d[i], 1.0e-6 * whole);
            l1[i] = y / d[i];
            l2[i] = h2[i] / d[i];
            g[i] = r;
        }
        let mut most = 0.0_f32;
        for i in (2..free).rev() {
            let mut z = g[i] / d[i];
            if i + 1 < free {
                z -= l1[i] * g[i + 1];
            }
            if i + 2 < free {
                z -= l2[i] * g[i + 2];
            }
            g[i] = z;
            most = larger(most, (z / self.c[i]).abs());
        }
        let step = if most > 0.5 { 0.5 / most } else { 1.0 };
        if !(step > 0.0) {
            self.len = 0;
            return;
        }
        for i in 2..free {
            self.c[i] = larger(self.c[i] + step * g[i], 1.0e-5 * self.c[i]);
        }
    }

    pub(super) fn shown(&self) -> (usize, [f32; 12]) {
        (
            self.len,
            core::array::from_fn(|k| sqrt(larger(0.0, self.c[2 * k]))),
        )
    }

    /// Velocity and acceleration where the motion has come to in `at`, if it is known so far.
    pub(super) fn at(&self, view: &View<'_>, at: &Motion) -> Option<[f32; 2]> {
        let number = view.first.wrapping_add(at.node as u32);
        let i = number.wrapping_sub(self.first) as usize;
        if i >= self.len {
            return None;
        }
        let lengths = self.lengths(view, i);
        let c = [self.c[i], self.c[i + 1], self.c[i + 2]];
        let [start, _] = bases(lengths);
        let [b, p, q] = start.map(|row| row[0] * c[0] + row[1] * c[1] + row[2] * c[2]);
        let x = lengths[1] - at.left;
        let (b, p) = (b + x * (p + 0.5 * x * q), p + x * q);
        (b > 0.0).then(|| [sqrt(b), 0.5 * p])
    }
}
