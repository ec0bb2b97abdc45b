//! Machine limits along one segment, and across the joint between two.
//!
//! With path velocity v, acceleration a and jerk j, an axis at q(s) sees
//! `q' v`, `q' a + q'' v^2` and `q' j + 3 q'' v a + q''' v^3` (chain rule). What the curve terms leave of the axis
//! limits is free for changing speed, and it is the more the slower the motion is: limits are functions of v.

use core::sync::atomic::Ordering::Relaxed;
use super::span::Span;
use crate::config::{AxisConfig, Config};
use crate::geometry::arc::{PathDerivatives, PathShape};
use crate::units::{sqrt, AxisVec, AXES};

/// Share of an axis' acceleration that curvature may take.
const CURVATURE_SHARE: f32 = 0.96;
/// Share of an axis' jerk that changing curvature may take at constant velocity.
const TORSION_SHARE: f32 = 0.85;
/// Share of an axis' jerk that curvature may take in all; the rest is for changing the acceleration.
const NEUTRAL_SHARE: f32 = 0.9;
/// Jerk that is always counted on, share of what there is at standstill.
const LEAST_JERK: f32 = 0.02;
/// Slope below which an axis does not count as moving along, axis units per path unit.
const LEAST_SLOPE: f32 = 1.0e-6;
/// Share of an axis' jerk that passing a joint may take.
const JOINT_SHARE: f32 = 0.3;
/// A joint slower than this share of the feed becomes an exact stop.
const STOP_SHARE: f32 = 0.02;

/// Limits at one velocity, whichever way: mm (or degree), s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathLimits {
    /// Acceleration along the path, either sign.
    pub a: f32,
    /// Jerk along the path, either sign.
    pub j: f32,
}

impl PathLimits {
    /// The lesser of both.
    #[must_use]
    pub fn least(self, other: Self) -> Self {
        Self {
            a: self.a.min(other.a),
            j: self.j.min(other.j),
        }
    }
}

/// What may be done at one velocity, or at one velocity and acceleration: braking and speeding up, both as sizes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Least value with its sign turned round.
    pub down: f32,
    /// Largest value.
    pub up: f32,
}

impl Range {
    const ALL: Self = Self {
        down: f32::MAX,
        up: f32::MAX,
    };

    /// `per x` is to stay within `below` downwards and `above` upwards, for every `per` from `low` to `high`.
    #[inline]
    fn keep(&mut self, low: f32, high: f32, below: f32, above: f32) {
        let least = |limit: &mut f32, room: f32, per: f32| {
            if *limit * per > room {
                *limit = room / per;
            }
        };
        if high > LEAST_SLOPE {
            least(&mut self.up, above, high);
            least(&mut self.down, below, high);
        }
        if low < -LEAST_SLOPE {
            least(&mut self.up, below, -low);
            least(&mut self.down, above, -low);
        }
    }
}

/// Limits on path motion within one segment: mm (or degree), s.
///
/// Derivatives of the axes are ranges with their signs: which way an axis is bent decides whether braking or speeding
/// up is limited. They are a little wider than the segment's own ([`Span`]): there are many of these.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurveLimits {
    /// Largest velocity.
    pub v: f32,
    /// q', q'' and q''' of the axes.
    ranges: [[Span; AXES]; 3],
    /// Acceleration and jerk of the axes that the joints leave, axis units.
    a: AxisVec,
    j: AxisVec,
}

impl CurveLimits {
    /// Nothing may move.
    pub const NONE: Self = Self {
        v: 0.0,
        ranges: [[Span::ZERO; AXES]; 3],
        a: [0.0; AXES],
        j: [0.0; AXES],
    };

    /// q', q'' and q''' of axis `i`.
    #[inline]
    fn of_axis(&self, i: usize) -> [Span; 3] {
        let [first, second, third] = &self.ranges;
        [first[i], second[i], third[i]]
    }

    /// Accelerations allowed at velocity `v`: `|q' a + q'' v^2|` within the acceleration of every axis, and
    /// `|3 q'' v a + q''' v^3|` within what jerk leaves, so that it can be changed again.
    #[must_use]
    pub fn acceleration(&self, v: f32) -> Range {
        crate::planner::CNT[1].fetch_add(1, Relaxed);
        let v = v.min(self.v);
        let (square, thrice) = (v * v, 3.0 * v);
        let cube = square * v;
        let mut range = Range::ALL;
        for i in 0..AXES {
            let [first, second, third] = self.of_axis(i);
            let below = (self.a[i] + square * second.low()).max(0.0);
            let above = (self.a[i] - square * second.high()).max(0.0);
            range.keep(first.low(), first.high(), below, above);
            let rate = NEUTRAL_SHARE * self.j[i];
            let below = (rate + cube * third.low()).max(0.0);
            let above = (rate - cube * third.high()).max(0.0);
            range.keep(thrice * second.low(), thrice * second.high(), below, above);
        }
        range
    }

    /// Jerks allowed at velocity `v` and acceleration `a`: `|q' j + 3 q'' v a + q''' v^3|` within the jerk of every
    /// axis.
    #[must_use]
    pub fn jerk(&self, v: f32, a: f32) -> Range {
        crate::planner::CNT[2].fetch_add(1, Relaxed);
        let v = v.min(self.v);
        let (cross, cube) = (3.0 * v * a, v * v * v);
        let mut range = Range::ALL;
        for i in 0..AXES {
            let [first, second, third] = self.of_axis(i);
            let (x, y) = (cross * second.low(), cross * second.high());
            let rate = self.j[i];
            let floor = LEAST_JERK * self.j[i];
            let below = (rate + x.min(y) + cube * third.low()).max(floor);
            let above = (rate - x.max(y) - cube * third.high()).max(floor);
            range.keep(first.low(), first.high(), below, above);
        }
        range
    }

    /// Whether every axis stays within its jerk and within its acceleration at velocity `v`, acceleration `a`
    /// and jerk `j` of the path (formulae above), both a little loosened by `slack`.
    #[must_use]
    pub fn keeps(&self, [v, a, j]: [f32; 3], slack: f32) -> bool {
        #[cfg(not(target_os = "none"))] crate::planner::CNT[0].fetch_add(1, Relaxed);
        let (square, cross, cube) = (v * v, 3.0 * v * a, v * v * v);
        (0..AXES).all(|i| {
            let [first, second, third] = self.of_axis(i);
            let [low, high] = sum([scaled(first, a), scaled(second, square), [0.0; 2]]);
            let most = slack * self.a[i];
            let [least, largest] = sum([
                scaled(first, j),
                scaled(second, cross),
                scaled(third, cube),
            ]);
            let jerk = slack * self.j[i];
            low >= -most && high <= most && least >= -jerk && largest <= jerk
        })
    }

    /// Limits that hold at `v`, whichever way the motion is changed.
    #[must_use]
    pub fn at(&self, v: f32) -> PathLimits {
        let Range { down, up } = self.acceleration(v);
        let a = down.min(up);
        let [x, y] = [a, -a].map(|a| self.jerk(v, a));
        PathLimits {
            a,
            j: x.down.min(x.up).min(y.down).min(y.up),
        }
    }

    /// Inside a segment whose largest velocity is `v`, with what its joints already take.
    #[must_use]
    pub fn new(
        config: &Config,
        shape: &PathShape,
        v: f32,
        soft: bool,
        joints: &[JointCost; 2],
    ) -> Self {
        let PathShape { low, high, .. } = shape;
        let span = |low: &AxisVec, high: &AxisVec| -> [Span; AXES] {
            core::array::from_fn(|i| Span::new(low[i], high[i]))
        };
        let [before, after] = joints;
        Self {
            v,
            ranges: [
                span(&low.first, &high.first),
                span(&low.second, &high.second),
                span(&low.third, &high.third),
            ],
            a: core::array::from_fn(|i| config.axes[i].a_max - before.a[i].max(after.a[i])),
            j: core::array::from_fn(|i| {
                axis_jerk(config, i, soft) - before.j[i].max(after.j[i])
            }),
        }
    }
}

/// Least and largest of `span` times `by`.
#[inline]
fn scaled(span: Span, by: f32) -> [f32; 2] {
    let (low, high) = (span.low() * by, span.high() * by);
    if by < 0.0 {
        [high, low]
    } else {
        [low, high]
    }
}

#[inline]
fn sum(parts: [[f32; 2]; 3]) -> [f32; 2] {
    let [x, y, z] = parts;
    [x[0] + y[0] + z[0], x[1] + y[1] + z[1]]
}

/// What passing a joint costs each axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointCost {
    /// Acceleration seen in the tick of the joint.
    pub a: AxisVec,
    /// Jerk seen in the ticks around the joint.
    pub j: AxisVec,
}

impl Joint {
    /// The path comes to rest there: nothing is passed, nothing is taken.
    pub const STOP: Self = Self {
        v: 0.0,
        cost: JointCost {
            a: [0.0; AXES],
            j: [0.0; AXES],
        },
    };
}

/// Verdict on one joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joint {
    /// Largest path velocity over the joint; 0 is an exact stop.
    pub v: f32,
    /// Cost at that velocity.
    pub cost: JointCost,
}

/// What rounding of commanded positions may add to a third difference of them, units of 2^-32 step: each is off by half a
/// unit, and the first of a segment by three more.
const ROUNDED: f32 = 12.0;

/// Units of a step.
const STEP: f32 = (1_u64 << 32) as f32;

/// Jerk limit of an axis, less what rounding adds to it in the sampled motion. Without `SOFT` the acceleration may build up within four ticks.
fn axis_jerk(config: &Config, axis: usize, soft: bool) -> f32 {
    if soft {
        let hz = config.servo_hz as f32;
        let AxisConfig { j_max, .. } = config.axes[axis];
        let per_step = ROUNDED * (1.0 / STEP) * hz * hz * hz;
        j_max - (per_step / config.axes[axis].steps_per_unit.to_num::<f32>()).min(0.5 * j_max)
    } else {
        config.axes[axis].a_max * config.servo_hz as f32 * 0.25
    }
}

/// Largest velocity inside a segment of `length` path units.
#[must_use]
pub fn velocity_limit(
    config: &Config,
    shape: &PathShape,
    length: f32,
    soft: bool,
) -> f32 {
    let most = |low: &AxisVec, high: &AxisVec| -> AxisVec {
        core::array::from_fn(|i| high[i].max(-low[i]))
    };
    let first = most(&shape.low.first, &shape.high.first);
    let second = most(&shape.low.second, &shape.high.second);
    let third = most(&shape.low.third, &shape.high.third);
    // No more than one joint per tick: what the interrupt does in a tick stays bounded, and so does what joints add up to.
    let mut v = length * config.servo_hz as f32;
    for a in 0..AXES {
        let axis = &config.axes[a];
        if first[a] > 0.0 {
            v = v.min(axis.v_max / first[a]);
        }
        if second[a] > 0.0 {
            v = v.min(sqrt(CURVATURE_SHARE * axis.a_max / second[a]));
        }
        if third[a] > 0.0 {
            v = v.min(libm::cbrtf(
                TORSION_SHARE * axis_jerk(config, a, soft) / third[a],
            ));
        }
    }
    v
}

/// How fast the joint from `before` to `after` may be passed, given the velocity `v` both sides allow.
///
/// A step in q' is a velocity step within one servo tick: `|dq'| v / dt` of acceleration and
/// `|dq'| v / dt^2` of jerk in the sampled motion; a step in q'' is `|dq''| v^2 / dt` of jerk; path
/// acceleration a turned by a step in q' is `|dq'| a / dt`. All must fit into the share of the axis' jerk set aside for joints, or the axis' configured corner
/// velocity step must cover the first.
#[must_use]
pub fn joint(
    config: &Config,
    before: &PathDerivatives,
    after: &PathDerivatives,
    v: f32,
    soft: bool,
) -> Joint {
    let hz = config.servo_hz as f32;
    let mut allowed = v;
    for a in 0..AXES {
        let step1 = (after.first[a] - before.first[a]).abs();
        let step2 = (after.second[a] - before.second[a]).abs();
        // Path acceleration changes its direction with the tangent, too. A kink that turns the largest acceleration into
        // more than the share leaves nothing for passing at speed.
        let turned = step1 * config.axes[a].a_max * hz;
        let jerk = (JOINT_SHARE * axis_jerk(config, a, soft) - turned).max(0.0);
        // Positive root of step2 hz v^2 + step1 hz^2 v = jerk, in the form that does not cancel.
        let b = step1 * hz * hz;
        let root = sqrt(b * b + 4.0 * step2 * hz * jerk);
        let smooth = if b + root > 0.0 {
            2.0 * jerk / (b + root)
        } else {
            f32::MAX
        };
        let corner = if step1 > 0.0 {
            config.axes[a].corner_step / step1
        } else {
            0.0
        };
        allowed = allowed.min(smooth.max(corner));
    }
    if allowed < STOP_SHARE * v {
        return Joint::STOP;
    }
    let mut cost = JointCost::default();
    for a in 0..AXES {
        let step1 = (after.first[a] - before.first[a]).abs();
        let step2 = (after.second[a] - before.second[a]).abs();
        let share = JOINT_SHARE * axis_jerk(config, a, soft);
        cost.a[a] = (step1 * allowed * hz).min(0.5 * config.axes[a].a_max);
        let turned = step1 * config.axes[a].a_max * hz;
        cost.j[a] =
            (turned + step1 * allowed * hz * hz + step2 * allowed * allowed * hz).min(share);
    }
    Joint { v: allowed, cost }
}
