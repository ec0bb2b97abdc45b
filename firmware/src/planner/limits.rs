//! Machine limits along one segment, and across the joint between two.
//!
//! With path velocity v, acceleration a and jerk j, an axis at q(s) sees
//! `q' v`, `q' a + q'' v^2` and `q' j + 3 q'' v a + q''' v^3` (chain rule). The programmed feed and the
//! curve terms fix v; what they leave of the axis limits is free for changing speed.

use crate::config::{AxisConfig, Config};
use crate::geometry::arc::{PathDerivatives, PathShape};
use crate::units::{sqrt, AxisVec, AXES};

/// Share of an axis' acceleration that curvature may take.
const CURVATURE_SHARE: f32 = 0.7;
/// Shares of an axis' jerk: change of curvature, curvature while accelerating, joints.
const TORSION_SHARE: f32 = 0.3;
const CROSS_SHARE: f32 = 0.3;
const JOINT_SHARE: f32 = 0.3;
/// A joint slower than this share of the feed becomes an exact stop.
const STOP_SHARE: f32 = 0.02;

/// Limits on path motion within one segment: mm (or degree), s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathLimits {
    /// Velocity.
    pub v: f32,
    /// Acceleration along the path, either sign.
    pub a: f32,
    /// Jerk along the path, either sign.
    pub j: f32,
}

impl PathLimits {
    /// Nothing may move.
    pub const NONE: Self = Self {
        v: 0.0,
        a: 0.0,
        j: 0.0,
    };
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

/// Limits inside a segment of `length` path units driven at no more than `feed`, with what its joints already take.
#[must_use]
pub fn path_limits(
    config: &Config,
    shape: &PathShape,
    length: f32,
    feed: f32,
    soft: bool,
    joints: &[JointCost; 2],
) -> PathLimits {
    let most = |low: &AxisVec, high: &AxisVec| -> AxisVec {
        core::array::from_fn(|i| high[i].max(-low[i]))
    };
    let PathShape { low, high, .. } = shape;
    let first = most(&low.first, &high.first);
    let second = most(&low.second, &high.second);
    let third = most(&low.third, &high.third);
    // No more than one joint per tick: what the interrupt does in a tick stays bounded, and so does what joints add up to.
    let mut v = feed.min(length * config.servo_hz as f32);
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
    let mut limit_a = f32::MAX;
    for a in 0..AXES {
        let taken = joints[0].a[a].max(joints[1].a[a]);
        if first[a] > 0.0 {
            limit_a = limit_a.min((config.axes[a].a_max - taken - second[a] * v * v) / first[a]);
        }
        if second[a] > 0.0 {
            let jerk = CROSS_SHARE * axis_jerk(config, a, soft);
            limit_a = limit_a.min(jerk / (3.0 * second[a] * v));
        }
    }
    let mut limit_j = f32::MAX;
    for a in 0..AXES {
        if first[a] > 0.0 {
            let taken = joints[0].j[a].max(joints[1].j[a])
                + 3.0 * second[a] * v * limit_a
                + third[a] * v * v * v;
            limit_j = limit_j.min((axis_jerk(config, a, soft) - taken) / first[a]);
        }
    }
    PathLimits {
        v,
        a: limit_a,
        j: limit_j,
    }
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
