//! Machine limits along one segment, and across the joint between two.
//!
//! With path velocity v, acceleration a and jerk j, an axis at q(s) sees
//! `q' v`, `q' a + q'' v^2` and `q' j + 3 q'' v a + q''' v^3` (chain rule). What the curve terms leave of the axis
//! limits is free for changing speed, and it is the more the slower the motion is: limits are functions of v.

use crate::config::Config;
use crate::geometry::arc::{PathDerivatives, PathShape};
use crate::units::{sqrt, AxisVec, AXES};

/// Share of an axis' acceleration that curvature may take.
const CURVATURE_SHARE: f32 = 0.92;
/// Shares of an axis' jerk: change of curvature; curvature while accelerating; joints.
const TORSION_SHARE: f32 = 0.5;
const CROSS_SHARE: f32 = 0.6;
/// Jerk that is left to let go of an acceleration that has become too high, share of what it is without acceleration.
const LEAST_JERK: f32 = 0.2;
/// Slope below which an axis does not count as moving along, axis units per path unit.
const LEAST_SLOPE: f32 = 1.0e-6;
const JOINT_SHARE: f32 = 0.7;
/// A step in the second derivative falls between two ticks; the third difference sees at most this share of it at once
/// (a step at the fraction f of a tick is seen as (1-f)^2/2, 1/2 + f - f^2 and f^2/2 in three successive ticks).
const SAMPLED_STEP: f32 = 0.75;
/// Room for rounding below every velocity limit.
pub(super) const ROUNDING: f32 = 5.0e-5;
/// A joint slower than this share of the feed becomes an exact stop.
const STOP_SHARE: f32 = 0.02;

/// Limits on path motion within one segment as functions of its velocity: mm (or degree), s.
///
/// Per axis i with bounds q' and q'' of its derivatives, acceleration is limited to `alpha - beta v^2`, jerk to
/// `gamma - 3 beta v a - delta v^3`; the path's limits are the least of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurveLimits {
    /// Largest velocity.
    pub v: f32,
    /// What the axis has left, over q'.
    alpha: AxisVec,
    /// q'' / q'.
    beta: AxisVec,
    /// Jerk of the axis over q'.
    gamma: AxisVec,
    /// q''' / q'.
    delta: AxisVec,
}

/// Limits at one velocity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathLimits {
    /// Acceleration along the path, either sign.
    pub a: f32,
    /// Jerk along the path, either sign.
    pub j: f32,
}

impl CurveLimits {
    /// Nothing may move.
    pub const NONE: Self = Self {
        v: 0.0,
        alpha: [0.0; AXES],
        beta: [0.0; AXES],
        gamma: [0.0; AXES],
        delta: [0.0; AXES],
    };

    /// Largest acceleration at velocity `v`, either sign. Leaves a share of the jerk for changing it.
    #[must_use]
    pub fn acceleration(&self, v: f32) -> f32 {
        let v = v.min(self.v);
        let square = v * v;
        let mut limit = f32::MAX;
        for i in 0..AXES {
            limit = limit.min(self.alpha[i] - self.beta[i] * square);
            let cross = 3.0 * self.beta[i] * v;
            let left = CROSS_SHARE * (self.gamma[i] - self.delta[i] * v * square);
            if limit * cross > left {
                limit = left / cross;
            }
        }
        limit
    }

    /// Largest jerk at velocity `v` and acceleration `a`, either sign.
    #[must_use]
    pub fn jerk(&self, v: f32, a: f32) -> f32 {
        let v = v.min(self.v);
        let (cross, cube) = (3.0 * v * a.abs(), v * v * v);
        let mut limit = f32::MAX;
        for i in 0..AXES {
            let left = self.gamma[i] - self.delta[i] * cube;
            limit = limit.min((left - self.beta[i] * cross).max(LEAST_JERK * left));
        }
        limit
    }

    /// Limits that hold at `v` and everywhere below it.
    #[must_use]
    pub fn below(&self, v: f32) -> PathLimits {
        let a = self.acceleration(v);
        PathLimits {
            a,
            j: self.jerk(v, a),
        }
    }
}

/// What passing a joint costs each axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointCost {
    /// Acceleration seen in the tick of the joint.
    pub a: AxisVec,
    /// Jerk seen in the ticks around the joint.
    pub j: AxisVec,
}

/// Verdict on one joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joint {
    /// Largest path velocity over the joint; 0 is an exact stop.
    pub v: f32,
    /// Largest path jerk in the ticks around it.
    pub j: f32,
    /// Cost at that velocity.
    pub cost: JointCost,
}

impl Joint {
    /// The path comes to rest there.
    pub const STOP: Self = Self {
        v: 0.0,
        j: f32::MAX,
        cost: JointCost {
            a: [0.0; AXES],
            j: [0.0; AXES],
        },
    };
}

/// Jerk limit of an axis. Without `SOFT` the acceleration may build up within four ticks.
fn axis_jerk(config: &Config, axis: usize, soft: bool) -> f32 {
    if soft {
        config.axes[axis].j_max
    } else {
        config.axes[axis].a_max * config.servo_hz as f32 * 0.25
    }
}

/// Largest velocity inside a segment of `length` path units driven at no more than `feed`.
#[must_use]
pub fn velocity_limit(
    config: &Config,
    shape: &PathShape,
    length: f32,
    feed: f32,
    soft: bool,
) -> f32 {
    let PathDerivatives {
        first,
        second,
        third,
    } = shape.bound;
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
    (1.0 - ROUNDING) * v
}

/// Limits inside a segment whose largest velocity is `v`, with what its joints already take.
#[must_use]
pub fn curve_limits(
    config: &Config,
    shape: &PathShape,
    v: f32,
    soft: bool,
    joints: &[JointCost; 2],
) -> CurveLimits {
    let mut limits = CurveLimits {
        v,
        alpha: [f32::MAX; AXES],
        beta: [0.0; AXES],
        gamma: [f32::MAX; AXES],
        delta: [0.0; AXES],
    };
    for i in 0..AXES {
        let (q1, q2, q3) = (
            shape.bound.first[i],
            shape.bound.second[i],
            shape.bound.third[i],
        );
        if !(q1 > 0.0) {
            continue;
        }
        // An axis that hardly moves along still limits what it can turn, through `v`.
        let along = 1.0 / q1.max(LEAST_SLOPE);
        let taken = joints[0].a[i].max(joints[1].a[i]);
        limits.alpha[i] = (config.axes[i].a_max - taken) * along;
        limits.gamma[i] = axis_jerk(config, i, soft) * along;
        limits.beta[i] = q2 * along;
        limits.delta[i] = q3 * along;
    }
    limits
}

/// How fast the joint from `before` to `after` may be passed, given the velocity `v` both sides allow.
///
/// A step in q' is a velocity step within one servo tick: `|dq'| v / dt` of acceleration and
/// `|dq'| v / dt^2` of jerk in the sampled motion; a step in q'' is [`SAMPLED_STEP`] `|dq''| v^2 / dt` of jerk; path
/// acceleration a turned by a step in q' is `|dq'| a / dt`. All must fit into the share of the axis' jerk set aside for
/// joints, or the axis' configured corner velocity step must cover the first.
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
    // The second time with what the change of curvature takes on either side at the velocity found.
    for _ in 0..2 {
        let cube = allowed * allowed * allowed;
        for a in 0..AXES {
            let step1 = (after.first[a] - before.first[a]).abs();
            let step2 = SAMPLED_STEP * (after.second[a] - before.second[a]).abs();
            // Path acceleration changes its direction with the tangent, too. A kink that turns the largest acceleration into
            // more than the share leaves nothing for passing at speed.
            let turned = step1 * config.axes[a].a_max * hz;
            let third = before.third[a].abs().max(after.third[a].abs());
            let limit = axis_jerk(config, a, soft);
            let taken = turned + (third * cube).min(0.5 * limit);
            let jerk = (JOINT_SHARE * limit - taken).max(0.0);
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
    }
    if allowed < STOP_SHARE * v {
        // The joint is a stop: nothing is passed, nothing is taken.
        return Joint::STOP;
    }
    let mut cost = JointCost::default();
    let mut j = f32::MAX;
    for a in 0..AXES {
        let step1 = (after.first[a] - before.first[a]).abs();
        let step2 = SAMPLED_STEP * (after.second[a] - before.second[a]).abs();
        let limit = axis_jerk(config, a, soft);
        cost.a[a] = (step1 * allowed * hz).min(0.5 * config.axes[a].a_max);
        let turned = step1 * config.axes[a].a_max * hz;
        cost.j[a] = (turned + step1 * allowed * hz * hz + step2 * allowed * allowed * hz)
            .min(JOINT_SHARE * limit);
        let along = before.first[a].abs().max(after.first[a].abs());
        let third = before.third[a].abs().max(after.third[a].abs());
        if along > 0.0 {
            let taken = cost.j[a] + third * allowed * allowed * allowed;
            j = j.min((limit - taken).max(0.1 * limit) / along);
        }
    }
    Joint {
        v: allowed,
        j,
        cost,
    }
}
