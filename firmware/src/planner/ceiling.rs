//! The ceiling over the path ahead: how fast the motion may be at every place and still meet every limit behind it.
//!
//! In: the limits of the nodes of a stretch. Out: velocity and deceleration of the ceiling at the start of each.
//!
//! A motion that is time-optimal has its local minima of velocity at places where a limit holds it down, and at a
//! minimum its acceleration is zero. So the ceiling is put together, from the end of the stretch to its beginning, of
//! S-curves that leave those low points with zero acceleration (in reversed time: they speed up at the jerk and the
//! acceleration that the nodes allow), and that reach the largest velocity of a node with zero acceleration, too.
//! Where one S-curve would have to be left at once for the next, the low point is put so deep that the next can be
//! reached from it with zero acceleration.

use super::brake::brake;
use super::limits::PathLimits;
use super::nodes::{Node, Nodes};
use crate::units::sqrt;

/// The ceiling is made with this share of the limits; the rest is for what whole ticks and rounding cost.
pub const PREDICTED: f32 = 0.98;

/// State of the ceiling at one place: path units, s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Branch {
    /// Velocity.
    pub v: f32,
    /// Deceleration, not negative.
    pub d: f32,
}

impl Branch {
    /// Standstill.
    pub const REST: Self = Self { v: 0.0, d: 0.0 };
}

/// An upper bound of [`time_for`]: none of the terms alone would take less.
fn bound(v: f32, a: f32, j: f32, x: f32, most: f32) -> f32 {
    let mut t = most;
    if v * t > x {
        t = x / v;
    }
    if j >= 0.0 {
        if 0.5 * a * t * t > x {
            t = sqrt(2.0 * x / a);
        }
        if j * t * t * t > 6.0 * x {
            t = libm::cbrtf(6.0 * x / j);
        }
    }
    t
}

/// Time in which a motion of velocity `v`, acceleration `a` and jerk `j` covers `x`; at most `most`, by which it has.
///
/// Newton's method from above: velocity is positive on the way, and with `j >= 0` it rises.
fn time_for(v: f32, a: f32, j: f32, x: f32, most: f32) -> f32 {
    let mut t = bound(v, a, j, x, most);
    for _ in 0..8 {
        let velocity = v + t * (a + 0.5 * j * t);
        let off = t * (v + t * (0.5 * a + t * j * (1.0 / 6.0))) - x;
        if !(velocity > 0.0) || off.abs() <= 1e-6 * x {
            break;
        }
        t = (t - off / velocity).clamp(0.0, most);
    }
    t
}

/// Limits of `node` for a ceiling that rises from `from` over the distance `x`: those at the velocity and the
/// acceleration it cannot exceed there.
fn limits(node: &Node, from: Branch, x: f32) -> PathLimits {
    let Branch { v, d } = from;
    let jerk = node.limits.jerk(v, 0.0);
    let time = bound(v, d, jerk, x, f32::MAX);
    let most = node.limits.acceleration(v);
    let high = (v + time * (d + 0.5 * jerk * time))
        .min(sqrt(v * v + 2.0 * most * x))
        .min(node.limits.v);
    let a = node.limits.acceleration(high);
    PathLimits {
        a: PREDICTED * a,
        j: PREDICTED * node.limits.jerk(high, (d + jerk * time).min(a)),
    }
}

/// The ceiling at `x` before a place of `node` at which it is `from`.
#[must_use]
pub fn before(node: &Node, from: Branch, x: f32) -> Branch {
    let top = node.limits.v;
    let Branch { mut v, mut d } = from;
    if !(x > 0.0) {
        return from;
    }
    let PathLimits { a, j } = limits(node, from, x);
    if v + d * d / (2.0 * j) >= top {
        // Only letting go of the acceleration is left.
        let t = d / j;
        let covered = t * (v + t * (0.5 * d - j * t * (1.0 / 6.0)));
        if covered <= x {
            return Branch { v: top, d: 0.0 };
        }
        let t = time_for(v, d, -j, x, t);
        return Branch {
            v: (v + t * (d - 0.5 * j * t)).min(top),
            d: d - j * t,
        };
    }
    let peak = sqrt(j * (top - v) + 0.5 * d * d).min(a);
    let mut left = x;
    // A node behind may allow more deceleration than this one does at this velocity: less of it, first.
    let bend = if peak < d { -j } else { j };
    let rise = (peak - d) / bend;
    let hold = ((top - v - 0.5 * rise * (d + peak)) / peak - 0.5 * peak / j).max(0.0);
    for (jerk, time) in [(bend, rise), (0.0, hold), (-j, peak / j)] {
        let covered = time * (v + time * (0.5 * d + jerk * time * (1.0 / 6.0)));
        let t = if covered <= left {
            time
        } else {
            time_for(v, d, jerk, left, time)
        };
        v += t * (d + 0.5 * jerk * t);
        d += jerk * t;
        if covered > left {
            return Branch {
                v: v.min(top),
                d: d.max(0.0),
            };
        }
        left -= covered;
    }
    Branch { v: top, d: 0.0 }
}

/// The lowest place the ceiling was hung up at last.
struct Low {
    v: f32,
    /// From here on to there.
    distance: f32,
    limits: PathLimits,
}

/// Makes the ceiling of the nodes `first..=last`; the path is at rest at the end of `last`.
pub fn build(nodes: &mut Nodes, first: usize, last: usize) {
    let mut end = Branch::REST;
    let mut low = Low {
        v: 0.0,
        distance: 0.0,
        limits: PathLimits {
            a: f32::MAX,
            j: f32::MAX,
        },
    };
    let mut index = last;
    loop {
        let node = *nodes.get(index);
        let start = before(&node, end, node.length);
        low.distance += node.length;
        let here = limits(&node, end, node.length);
        low.limits.a = low.limits.a.min(here.a);
        low.limits.j = low.limits.j.min(here.j);
        if let Some(node) = nodes.get_mut(index) {
            node.start = start;
        }
        if index == first {
            return;
        }
        index -= 1;
        let earlier = nodes.get(index);
        let cap = earlier.exit_v.min(earlier.limits.v).min(node.limits.v);
        let release = start.d * start.d / (2.0 * here.j);
        end = start;
        if start.v > cap || start.v + release > earlier.limits.v {
            let mut v = cap.min(start.v);
            if v > start.v - 2.0 * release {
                v = sustainable(&low, v);
            }
            end = Branch { v, d: 0.0 };
            low = Low {
                v,
                distance: 0.0,
                limits: PathLimits {
                    a: f32::MAX,
                    j: f32::MAX,
                },
            };
            if let Some(node) = nodes.get_mut(index + 1) {
                node.start = end;
            }
        }
    }
}

/// Largest velocity up to `most` from which, with zero acceleration, braking reaches `low` in time.
fn sustainable(low: &Low, most: f32) -> f32 {
    let reaches = |v: f32| {
        v <= low.v || brake(v, 0.0, low.v, low.limits.a, low.limits.j).distance <= low.distance
    };
    if reaches(most) {
        return most;
    }
    let (mut good, mut bad) = (low.v.min(most), most);
    for _ in 0..12 {
        let middle = 0.5 * (good + bad);
        if reaches(middle) {
            good = middle;
        } else {
            bad = middle;
        }
    }
    good
}
