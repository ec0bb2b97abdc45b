//! The ceiling over the path ahead: how fast the motion may be at every place and still meet every limit behind it.
//!
//! In: the limits of the nodes of a stretch. Out: velocity and deceleration of the ceiling at the start of each, and for
//! any motion whether it can still get under it.
//!
//! Seen backwards from the end of the stretch, the fastest motion speeds up with all the jerk and acceleration that each
//! place allows until a velocity limit cuts it off. At the cut the motion has as little deceleration as it can, so that
//! what lies before it is not held down more than it must: none, where it can still build up enough of it behind the cut,
//! else the least with which it can.

use super::limits::{PathLimits, Range, Rates};
use super::nodes::{Node, Nodes};
use crate::units::sqrt;

/// The ceiling is made with this share of the limits; the rest is for what whole ticks and rounding cost.
pub const PREDICTED: f32 = 0.98;

/// And with this share of them where it ends: whole ticks cost more there.
const LANDING: f32 = 0.95;

/// Slack on comparisons, relative.
pub const SLACK: f32 = 1.0 + 5.0e-5;

/// Slack on accelerations and jerks, relative.
pub const LOOSE: f32 = 1.001;

/// Steps after which a prediction that has not ended counts as unsafe.
const PREDICTIONS: u32 = 200;

/// Share of the acceleration that a prediction changes in one step.
const STEP: f32 = 0.25;

/// Ticks around a joint in which the limits of both sides hold.
const AROUND: f32 = 1.5;

/// Attempts to find where prediction and ceiling are closest.
const CLOSER: u32 = 4;

/// Ticks of travel that are predicted in one step at least.
const NEAR: f32 = 4.0;

/// Share of the velocity that a prediction changes in one step.
const CHANGE: f32 = 0.08;

/// Halvings of the range in which the state at a cut is looked for.
const HALVINGS: u32 = 6;

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

/// Motion continuous in time: path units, s.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    /// Index of the node it is in.
    pub node: usize,
    /// Distance left in it.
    pub left: f32,
    /// Velocity.
    pub v: f32,
    /// Acceleration.
    pub a: f32,
}

impl Motion {
    /// Distance covered in `time` while `jerk` lets go of acceleration.
    fn covered(&self, jerk: f32, time: f32) -> f32 {
        time * (self.v + time * (0.5 * self.a - time * jerk * (1.0 / 6.0)))
    }

    /// After `time` in which `jerk` lets go of acceleration, in the same node.
    fn after(&self, jerk: f32, time: f32) -> Self {
        Self {
            node: self.node,
            left: self.left - self.covered(jerk, time),
            v: self.v + time * (self.a - 0.5 * jerk * time),
            a: self.a - jerk * time,
        }
    }
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

/// The nodes of a stretch and the limits of the axes on them.
#[derive(Clone, Copy)]
pub struct Stretch<'a> {
    /// All nodes.
    pub nodes: &'a Nodes,
    /// Last node under the ceiling; the motion is planned to be at rest at its end.
    pub last: usize,
    /// Limits of the axes, jerk-limited and not.
    pub rates: &'a [Rates; 2],
    /// Ticks per second.
    pub hz: f32,
}

impl<'a> Stretch<'a> {
    /// Limits of the axes on `node`.
    #[must_use]
    pub fn rates(&self, node: &Node) -> &'a Rates {
        &self.rates[usize::from(node.brisk)]
    }

    /// Accelerations allowed on `node` at velocity `v`.
    #[must_use]
    pub fn acceleration(&self, node: &Node, v: f32) -> Range {
        node.limits.acceleration(self.rates(node), v)
    }

    /// Jerks allowed on `node` at velocity `v` and acceleration `a` within `share` of the limits.
    #[must_use]
    pub fn jerk(&self, node: &Node, v: f32, a: f32, share: f32) -> Range {
        node.limits.jerk(self.rates(node), v, a, share)
    }

    /// Limits on `node` at velocity `v`, whichever way the motion is changed.
    #[must_use]
    pub fn at(&self, node: &Node, v: f32) -> PathLimits {
        node.limits.at(self.rates(node), v)
    }

    /// The ceiling at the end of node `index`.
    #[must_use]
    pub fn behind(&self, index: usize) -> Branch {
        if index >= self.last {
            Branch::REST
        } else {
            self.nodes.get(index + 1).start
        }
    }

    /// The ceiling at `x` before a place of `node` at which it is `from`, whatever the largest velocity.
    #[must_use]
    pub fn before(&self, node: &Node, from: Branch, x: f32) -> Branch {
        let Branch { v, d } = from;
        if !(x > 0.0) {
            return from;
        }
        let share = if v > 0.0 { PREDICTED } else { LANDING };
        // Deceleration comes down to `d` with jerk upwards: what is allowed of it where it begins and where it ends.
        let first = share * self.jerk(node, v, -d, 1.0).up;
        let lowest = self.acceleration(node, v).down;
        let time = bound(v, d, first, x, f32::MAX);
        let high = (v + time * (d + 0.5 * first * time))
            .min(sqrt(v * v + 2.0 * lowest.max(d) * x))
            .min(node.limits.v);
        let most = share * lowest.min(self.acceleration(node, high).down);
        let there = self.jerk(node, high, -(d + first * time).min(most), 1.0);
        let jerk = first.min(share * there.up);
        // Behind, more deceleration may be allowed than here: less of it, first.
        let bend = if most < d { -share * there.down } else { jerk };
        let rise = (most - d) / bend;
        let covered = rise * (v + rise * (0.5 * d + bend * rise * (1.0 / 6.0)));
        if covered > x {
            let t = time_for(v, d, bend, x, rise);
            return Branch {
                v: v + t * (d + 0.5 * bend * t),
                d: d + bend * t,
            };
        }
        let v = v + rise * (d + 0.5 * bend * rise);
        Branch {
            v: sqrt(v * v + 2.0 * most * (x - covered)),
            d: most,
        }
    }

    /// Whether the motion can get from `at` onto the ceiling from below, by letting go of its acceleration and building up
    /// deceleration as hard as the limits allow.
    #[must_use]
    pub fn merges(&self, mut at: Motion) -> bool {
        if at.v < 0.0 {
            return false;
        }
        let mut ceiling = self.before(self.nodes.get(at.node), self.behind(at.node), at.left);
        for _ in 0..PREDICTIONS {
            let node = self.nodes.get(at.node);
            let limit = self.acceleration(node, at.v);
            if at.v > ceiling.v.min(node.limits.v) * SLACK || at.a > limit.up * LOOSE {
                return false;
            }
            let jerk = PREDICTED * self.jerk(node, at.v, at.a, 1.0).down;
            // A small part of what a tick changes.
            let small = 0.05 * jerk / self.hz;
            if at.a <= small - ceiling.d || at.v <= 0.0 {
                return true;
            }
            let floor = -PREDICTED * limit.down;
            // Long nodes not at one go: what the ceiling does on the way would not be seen.
            let half = 0.5 * at.left.max(at.v * NEAR / self.hz) / at.v;
            let (jerk, part) = if at.a <= floor {
                (0.0, half)
            } else {
                // Not over the peak of the velocity.
                let goal = if at.a > small {
                    0.0
                } else {
                    floor.max(-ceiling.d)
                };
                let whole = |jerk: f32| (at.a - goal) / jerk;
                let step = STEP * (at.a - floor).max(0.2 * limit.up.min(limit.down)) / jerk;
                let change = CHANGE * at.v / at.a.abs();
                let part = whole(jerk)
                    .min(step.min(change).max(0.5 / self.hz))
                    .min(half);
                // What jerk there is changes on the way.
                let then = at.after(jerk, part);
                let then = PREDICTED * self.jerk(node, then.v, then.a, 1.0).down;
                let jerk = 0.5 * (jerk + then);
                (jerk, whole(jerk).min(part))
            };
            let mut time = if at.covered(jerk, part) < at.left {
                part
            } else {
                time_for(at.v, at.a, -jerk, at.left, part)
            };
            // As far as the place at which it decelerates like the ceiling: there the two are closest.
            let over = at.a + ceiling.d;
            for _ in 0..CLOSER {
                let there = at.after(jerk, time);
                ceiling = self.before(node, self.behind(at.node), there.left);
                let under = there.a + ceiling.d;
                if under >= -small - 0.01 * ceiling.d {
                    break;
                }
                time *= over / (over - under);
            }
            at = at.after(jerk, time);
            if at.left > 1e-6 * node.length {
                continue;
            }
            if at.node >= self.last {
                return false;
            }
            at.node += 1;
            let next = self.nodes.get(at.node);
            at.left = next.length;
            // Around the joint only what both sides allow and the joint leaves.
            let both =
                node.exit_share * jerk.min(PREDICTED * self.jerk(next, at.v, at.a, 1.0).down);
            at.a += (jerk - both) * AROUND / self.hz;
            if at.v > next.start.v * SLACK {
                return false;
            }
            if at.a <= small - next.start.d {
                return true;
            }
            ceiling = next.start;
        }
        false
    }

    /// Where a velocity limit `cap` cuts the ceiling off at the start of node `index`, at which its deceleration is `d`.
    fn cut(&self, index: usize, cap: f32, d: f32) -> Branch {
        let node = self.nodes.get(index);
        let before = self.nodes.get(index.max(1) - 1);
        let merges = |v: f32, d: f32| {
            self.merges(Motion {
                node: index,
                left: node.length,
                v,
                a: -d,
            })
        };
        if merges(cap, 0.0) {
            return Branch { v: cap, d: 0.0 };
        }
        let most = |v: f32| {
            let allowed = |node| self.acceleration(node, v).down;
            d.min(PREDICTED * allowed(node).min(allowed(before)))
        };
        let highest = most(cap);
        if merges(cap, highest) {
            let (mut good, mut bad) = (highest, 0.0);
            for _ in 0..HALVINGS {
                let middle = 0.5 * (good + bad);
                if merges(cap, middle) {
                    good = middle;
                } else {
                    bad = middle;
                }
            }
            return Branch { v: cap, d: good };
        }
        let (mut good, mut bad) = (0.0, cap);
        for _ in 0..2 * HALVINGS {
            let middle = 0.5 * (good + bad);
            if merges(middle, most(middle)) {
                good = middle;
            } else {
                bad = middle;
            }
        }
        Branch {
            v: good,
            d: most(good),
        }
    }
}

/// Makes the ceiling of the nodes `first..=last`; the path is at rest at the end of `last`.
pub fn build(nodes: &mut Nodes, rates: &[Rates; 2], hz: f32, first: usize, last: usize) {
    for index in (first..=last).rev() {
        let stretch = Stretch {
            nodes,
            last,
            rates,
            hz,
        };
        let node = nodes.get(index);
        let mut start = stretch.before(node, stretch.behind(index), node.length);
        let cap = if index > first {
            let before = nodes.get(index - 1);
            before.exit_v.min(before.limits.v).min(node.limits.v)
        } else {
            node.limits.v
        };
        if start.v > cap {
            start = stretch.cut(index, cap, start.d);
        }
        if let Some(node) = nodes.get_mut(index) {
            node.start = start;
        }
    }
}
