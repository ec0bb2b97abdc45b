//! Machine limits along one segment, and across the joint between two.
//!
//! With path velocity v, acceleration a and jerk j, an axis at q(s) sees
//! `q' v`, `q' a + q'' v^2` and `q' j + 3 q'' v a + q''' v^3` (chain rule). What the curve terms leave of the axis
//! limits is free for changing speed, and it is the more the slower the motion is: limits are functions of v.

use super::span::Span;
use crate::config::{AxisConfig, Config};
use crate::geometry::arc::{PathDerivatives, PathShape};
use crate::interpolator::T_FRAC;
use crate::units::{larger, smaller, sqrt, AxisVec, AXES};

/// What curvature alone may take of an axis' acceleration and of its jerk at the largest velocity of a segment: more than there
/// is, since speeding up or slowing down may make up for it. What is planned is run, so this only ends the search.
const CURVATURE_SHARE: f32 = 2.0;
const TORSION_SHARE: f32 = 2.0;
/// Share of an acceleration that a tick may build up where jerk is not limited: two ticks for all of it.
pub(super) const BUILDS_UP: f32 = 1.0 / 2.0;
/// Share of an axis' jerk that curvature may take in all; the rest is for changing the acceleration.
const NEUTRAL_SHARE: f32 = 0.9;
/// Jerk that is always counted on, share of what there is at standstill.
const LEAST_JERK: f32 = 0.02;
/// Largest jerk of a piece, path units per tick^3: half of what its integer can be, 2^63 units of 2^-T_FRAC.
const PIECE_JERK: f32 = 1.0 / (1_u64 << (T_FRAC - 62)) as f32;
/// Slope below which an axis does not count as moving along, axis units per path unit.
const LEAST_SLOPE: f32 = 1.0e-6;
/// Share of an axis' jerk that passing a joint may take.
const JOINT_SHARE: f32 = 0.98;
/// What ranges of derivatives are wider than the derivatives, at most ([`Span`]).
const WIDER: f32 = 1.0 + 1.0 / 60.0;
/// Halvings of the range in which the velocity over a joint is looked for.
const JOINT_HALVINGS: u32 = 12;
/// Share of an axis' acceleration that passing a joint may take where jerk is not limited.
const JOINT_ACCELERATION: f32 = 0.97;
/// Step of an axis' q' that is stopped at where it is too fast to be passed, without jerk limit: one that is passed in four ticks of
/// acceleration from rest saves nothing.
const SHARP: f32 = 0.25;
/// Share of its limits up to which an axis need not be looked at ([`CurveLimits::without_idle`]).
const IDLE: f32 = 0.9;
/// What passing a joint may take of the limits of an axis and still is as good as nothing.
const SMOOTH: f32 = 0.004;
/// A step in the second derivative falls between two ticks; the third difference sees at most this share of it at once
/// (a step at the fraction f of a tick is seen as (1-f)^2/2, 1/2 + f - f^2 and f^2/2 in three successive ticks).
const SAMPLED_STEP: f32 = 0.75;
/// A joint slower than this share of the feed becomes an exact stop.
const STOP_SHARE: f32 = 0.02;

/// Limits of the axes that path motion has to keep: acceleration and jerk, axis units, s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rates {
    /// Acceleration.
    pub a: AxisVec,
    /// Jerk.
    pub j: AxisVec,
    /// Largest jerk along the path that a piece can hold, path units/s^3.
    pub most: f32,
    /// Ticks per second.
    hz: f32,
    /// The same where jerk is limited, otherwise 0: jerk per step of acceleration.
    jerk_hz: f32,
}

impl Rates {
    /// None yet.
    pub const NONE: Self = Self {
        a: [0.0; AXES],
        j: [0.0; AXES],
        most: 0.0,
        hz: 0.0,
        jerk_hz: 0.0,
    };

    /// Those of the machine; jerk-limited if `soft`.
    #[must_use]
    pub fn new(config: &Config, soft: bool) -> Self {
        let hz = config.servo_hz as f32;
        Self {
            a: core::array::from_fn(|i| config.axes[i].a_max),
            j: core::array::from_fn(|i| axis_jerk(config, i, soft)),
            most: PIECE_JERK * hz * hz * hz,
            hz,
            jerk_hz: if soft { hz } else { 0.0 },
        }
    }
}

/// Shares of the limits of the axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Share {
    /// Of acceleration.
    pub a: f32,
    /// Of jerk.
    pub j: f32,
}

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
            a: smaller(self.a, other.a),
            j: smaller(self.j, other.j),
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
    /// Up to `most` either way.
    fn within(most: f32) -> Self {
        Self {
            down: most,
            up: most,
        }
    }

    /// `per x` is to stay within `below` downwards and `above` upwards, for every `per` from `low` to `high`.
    #[inline]
    fn keep(&mut self, [low, high]: [f32; 2], below: f32, above: f32) {
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
}

impl CurveLimits {
    /// Nothing may move.
    pub const NONE: Self = Self {
        v: 0.0,
        ranges: [[Span::ZERO; AXES]; 3],
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
    pub fn acceleration(&self, rates: &Rates, v: f32) -> Range {
        let v = smaller(v, self.v);
        let (square, thrice) = (v * v, 3.0 * v);
        let cube = square * v;
        let mut range = Range::within(f32::MAX);
        for i in 0..AXES {
            let [first, second, third] = self.of_axis(i).map(Span::ends);
            let below = larger(0.0, rates.a[i] + square * second[0]);
            let above = larger(0.0, rates.a[i] - square * second[1]);
            range.keep(first, below, above);
            let rate = NEUTRAL_SHARE * rates.j[i];
            let below = larger(0.0, rate + cube * third[0]);
            let above = larger(0.0, rate - cube * third[1]);
            range.keep(second.map(|end| thrice * end), below, above);
        }
        range
    }

    /// Jerks allowed at velocity `v` and acceleration `a`: `|q' j + 3 q'' v a + q''' v^3|` within the jerk of every
    /// axis.
    #[must_use]
    pub fn jerk(&self, rates: &Rates, v: f32, a: f32) -> Range {
        let v = smaller(v, self.v);
        let (cross, cube) = (3.0 * v * a, v * v * v);
        let mut range = Range::within(rates.most);
        for i in 0..AXES {
            let [first, second, third] = self.of_axis(i).map(Span::ends);
            let (x, y) = (cross * second[0], cross * second[1]);
            let rate = rates.j[i];
            let floor = LEAST_JERK * rates.j[i];
            let below = larger(floor, rate + smaller(x, y) + cube * third[0]);
            let above = larger(floor, rate - larger(x, y) - cube * third[1]);
            range.keep(first, below, above);
        }
        range
    }

    /// Whether every axis stays within `share` of its acceleration and jerk at velocity `v`, acceleration `a` and
    /// jerk `j` of the path (formulae above).
    #[must_use]
    pub fn keeps(&self, rates: &Rates, [v, a, j]: [f32; 3], share: Share) -> bool {
        let (square, cross, cube) = (v * v, 3.0 * v * a, v * v * v);
        let wide = [a, j, cross].map(f32::abs);
        for i in 0..AXES {
            let spans = self.of_axis(i);
            if Span::are_zero(spans) {
                continue;
            }
            let [[q1, r1], [q2, r2], [q3, r3]] = spans.map(Span::parts);
            let acceleration = (q1 * a + q2 * square).abs() + (r1 * wide[0] + r2 * square);
            let jerk =
                (q1 * j + q2 * cross + q3 * cube).abs() + (r1 * wide[1] + r2 * wide[2] + r3 * cube);
            if !(acceleration <= share.a * rates.a[i] && jerk <= share.j * rates.j[i]) {
                return false;
            }
        }
        true
    }

    /// The same in a tick that sees a joint passed at velocity `over`: what that takes, `weight` times, comes on top of what this
    /// segment asks for.
    #[must_use]
    pub fn keeps_beside(
        &self,
        rates: &Rates,
        [v, a, j]: [f32; 3],
        share: Share,
        taken: &Taken,
        [over, weight]: [f32; 2],
    ) -> bool {
        let (square, cross, cube) = (v * v, 3.0 * v * a, v * v * v);
        let wide = [a, j, cross].map(f32::abs);
        // A step in q' adds what it turns, in one tick or two; a step in q'' up to its share of what it bends.
        let bent = 0.5 * SAMPLED_STEP * over * over * rates.jerk_hz * weight;
        let turned = (over * rates.hz + wide[0]) * rates.jerk_hz * weight;
        let kinked = 0.5 * over * rates.hz * weight;
        for i in 0..AXES {
            let spans = self.of_axis(i);
            if Span::are_zero(spans) {
                continue;
            }
            let [[q1, r1], [q2, r2], [q3, r3]] = spans.map(Span::parts);
            let (a_max, j_max) = (rates.a[i], rates.j[i]);
            let inside = [q1 * a + q2 * square, q1 * j + q2 * cross + q3 * cube];
            let mut most = inside.map(f32::abs);
            if !taken.spares(i) {
                let [step1, step2] = taken.of_axis(i);
                let [bend, kink] = [bent * step2, kinked * step1];
                // A corner that the machine file allows may take more than there is: then it leaves a little.
                most = [
                    smaller(
                        (inside[0] + kink).abs() + kink.abs(),
                        most[0] + JOINT_ACCELERATION * a_max,
                    ),
                    smaller(
                        (inside[1] + bend).abs() + bend.abs() + turned * step1.abs(),
                        most[1] + JOINT_SHARE * j_max,
                    ),
                ];
            }
            let acceleration = most[0] + (r1 * wide[0] + r2 * square);
            let jerk = most[1] + (r1 * wide[1] + r2 * wide[2] + r3 * cube);
            if !(acceleration <= share.a * a_max && jerk <= share.j * j_max) {
                return false;
            }
        }
        true
    }

    /// Limits that hold at `v`, whichever way the motion is changed.
    #[must_use]
    pub fn at(&self, rates: &Rates, v: f32) -> PathLimits {
        let Range { down, up } = self.acceleration(rates, v);
        let a = smaller(down, up);
        let [x, y] = [a, -a].map(|a| self.jerk(rates, v, a));
        PathLimits {
            a,
            j: smaller(smaller(x.down, x.up), smaller(y.down, y.up)),
        }
    }

    /// Jerk allowed at standstill, either sign.
    #[must_use]
    pub fn still_jerk(&self, rates: &Rates) -> f32 {
        let mut range = Range::within(rates.most);
        for (first, &j) in self.ranges[0].iter().zip(&rates.j) {
            range.keep(first.ends(), j, j);
        }
        range.up
    }

    /// Inside a segment whose largest velocity is `v`.
    #[must_use]
    pub fn new(shape: &PathShape, v: f32) -> Self {
        let PathShape { low, high, .. } = shape;
        let span = |low: &AxisVec, high: &AxisVec| -> [Span; AXES] {
            core::array::from_fn(|i| Span::new(low[i], high[i]))
        };
        Self {
            v,
            ranges: [
                span(&low.first, &high.first),
                span(&low.second, &high.second),
                span(&low.third, &high.third),
            ],
        }
    }

    /// Forgets the axes that never limit anything: with whatever the others allow at up to velocity `v`, and with what passing the
    /// joints at both ends takes at their velocities, they keep their limits by far. Limits are looked at much more often than set.
    #[must_use]
    pub fn without_idle(self, rates: &Rates, v: f32, joints: [(&Taken, f32); 2]) -> Self {
        let (square, cube) = (v * v, v * v * v);
        let axes: [_; AXES] = core::array::from_fn(|i| {
            self.of_axis(i).map(|span| {
                let [middle, half] = span.parts();
                (middle.abs(), half)
            })
        });
        // Bounds from above: what bends an axis may make up for what speeds it up.
        let (mut a, mut j) = (f32::MAX, rates.most);
        for (&[(q1, r1), (q2, _), _], &a_max) in axes.iter().zip(&rates.a) {
            a = smaller(a, (a_max + q2 * square) / (q1 + r1));
        }
        let cross = 3.0 * v * a;
        for (&[(q1, r1), (q2, _), (q3, _)], &j_max) in axes.iter().zip(&rates.j) {
            j = smaller(j, (j_max + q2 * cross + q3 * cube) / (q1 + r1));
        }
        let mut left = self;
        for (i, axis) in axes.iter().enumerate() {
            let [q1, q2, q3] = axis.map(|(middle, half)| middle + half);
            let mut most = [q1 * a + q2 * square, q1 * j + q2 * cross + q3 * cube];
            for (taken, over) in joints {
                let [step1, step2] = taken.of_axis(i).map(f32::abs);
                let turned = step1 * (over * rates.hz + a);
                most[0] += step1 * over * rates.hz;
                most[1] += (turned + SAMPLED_STEP * step2 * over * over) * rates.jerk_hz;
            }
            if most[0] <= IDLE * rates.a[i] && most[1] <= IDLE * rates.j[i] {
                for spans in &mut left.ranges {
                    spans[i] = Span::ZERO;
                }
            }
        }
        left
    }
}

/// What passing a joint takes of the axes: the steps of their q' and q'' there, from the segment before it to the one behind.
/// Each is the upper half of an `f32`, rounded away from zero: what is taken is a little more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Taken([u32; AXES]);

/// The upper half of a word.
const UPPER: u32 = 0xffff_0000;

impl Taken {
    /// Nothing.
    pub const NONE: Self = Self([0; AXES]);

    /// From `before` the joint to `after` it; nothing of the axes that are `smooth` there.
    fn new(
        before: &PathDerivatives,
        after: &PathDerivatives,
        smooth: impl Fn(usize) -> bool,
    ) -> Self {
        let half = |before: f32, after: f32| (after - before).to_bits().saturating_add(!UPPER);
        Self(core::array::from_fn(|i| {
            if smooth(i) {
                return 0;
            }
            let first = half(before.first[i], after.first[i]);
            let second = half(before.second[i], after.second[i]);
            first & UPPER | second >> 16
        }))
    }

    /// Whether nothing is.
    #[inline]
    #[must_use]
    pub fn is_none(&self) -> bool {
        self.0.iter().fold(0, |all, word| all | word) == 0
    }

    /// Whether nothing is taken of axis `i`.
    #[inline]
    fn spares(&self, i: usize) -> bool {
        self.0[i] == 0
    }

    /// Steps of q' and q'' of axis `i`.
    #[inline]
    fn of_axis(&self, i: usize) -> [f32; 2] {
        [self.0[i] & UPPER, self.0[i] << 16].map(f32::from_bits)
    }
}

/// Verdict on one joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joint {
    /// Largest path velocity over the joint; 0 is an exact stop.
    pub v: f32,
    /// What passing it takes.
    pub taken: Taken,
}

impl Joint {
    /// The path comes to rest there: nothing is passed, nothing is taken.
    pub const STOP: Self = Self {
        v: 0.0,
        taken: Taken::NONE,
    };
}

/// What rounding of commanded positions may add to a third difference of them, units of 2^-32 step: each is off by half a
/// unit, and the first of a segment by three more.
const ROUNDED: f32 = 12.0;

/// Units of a step.
const STEP: f32 = (1_u64 << 32) as f32;

/// Jerk limit of an axis, less what rounding adds to it in the sampled motion. Without `SOFT` the acceleration builds up within two ticks.
fn axis_jerk(config: &Config, axis: usize, soft: bool) -> f32 {
    if soft {
        let hz = config.servo_hz as f32;
        let AxisConfig { j_max, .. } = config.axes[axis];
        let per_step = ROUNDED * (1.0 / STEP) * hz * hz * hz;
        j_max - (per_step / config.axes[axis].steps_per_unit.to_num::<f32>()).min(0.5 * j_max)
    } else {
        config.axes[axis].a_max * config.servo_hz as f32 * BUILDS_UP
    }
}

/// Largest velocity inside a segment of `length` path units.
#[must_use]
pub fn velocity_limit(config: &Config, shape: &PathShape, length: f32, soft: bool) -> f32 {
    let most = |low: &AxisVec, high: &AxisVec| -> AxisVec {
        core::array::from_fn(|i| larger(high[i], -low[i]))
    };
    let first = most(&shape.low.first, &shape.high.first);
    let second = most(&shape.low.second, &shape.high.second);
    let third = most(&shape.low.third, &shape.high.third);
    // No more than one joint per tick: what the interrupt does in a tick stays bounded, and so does what joints add up to.
    let mut v = length * config.servo_hz as f32;
    for a in 0..AXES {
        let axis = &config.axes[a];
        if first[a] > 0.0 {
            v = smaller(v, axis.v_max / first[a]);
        }
        if second[a] > 0.0 {
            v = smaller(v, sqrt(CURVATURE_SHARE * axis.a_max / second[a]));
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
/// `|dq'| v / dt^2` of jerk in the sampled motion; a step in q'' is `SAMPLED_STEP` `|dq''| v^2 / dt` of jerk; path
/// acceleration a turned by a step in q' is `|dq'| a / dt`. All must fit into the share of the axis' jerk set aside for
/// joints, or the axis' configured corner velocity step must cover the first. Without jerk limit the step in q' must fit
/// into the share of acceleration, or into the configured step; a sharp one stops.
#[must_use]
pub fn joint(
    config: &Config,
    before: &PathDerivatives,
    after: &PathDerivatives,
    third: &AxisVec,
    v: f32,
    soft: bool,
) -> Joint {
    let hz = config.servo_hz as f32;
    let mut allowed = v;
    for a in 0..AXES {
        let axis = &config.axes[a];
        let step1 = (after.first[a] - before.first[a]).abs();
        let step2 = SAMPLED_STEP * (after.second[a] - before.second[a]).abs();
        if !soft {
            let step = larger(JOINT_ACCELERATION * axis.a_max / hz, axis.corner_step);
            if allowed * step1 > step {
                allowed = step / step1;
                if step1 > SHARP && axis.corner_step <= 0.0 {
                    return Joint::STOP;
                }
            }
            continue;
        }
        // Path acceleration changes its direction with the tangent, too. A kink that turns the largest acceleration into
        // more than the share leaves nothing for passing at speed.
        let turned = step1 * axis.a_max * hz;
        let third = WIDER * third[a];
        let room = JOINT_SHARE * axis_jerk(config, a, soft) - turned;
        let taken = |v: f32| v * (step1 * hz * hz + v * (step2 * hz + v * third));
        if step1 + step2 <= 0.0 || taken(allowed) <= room {
            continue;
        }
        // Rises with the velocity all the way.
        let (mut good, mut bad) = (0.0, allowed);
        if room > 0.0 {
            for _ in 0..JOINT_HALVINGS {
                let middle = 0.5 * (good + bad);
                if taken(middle) <= room {
                    good = middle;
                } else {
                    bad = middle;
                }
            }
        }
        let corner = if step1 > 0.0 {
            axis.corner_step / step1
        } else {
            0.0
        };
        allowed = smaller(allowed, larger(good, corner));
    }
    if allowed < STOP_SHARE * v {
        // The joint is a stop: nothing is passed, nothing is taken.
        return Joint::STOP;
    }
    let smooth = |a: usize| {
        let axis = &config.axes[a];
        let step1 = (after.first[a] - before.first[a]).abs();
        let step2 = SAMPLED_STEP * (after.second[a] - before.second[a]).abs();
        let turned = step1 * (allowed * hz + axis.a_max) + step2 * allowed * allowed;
        let jerk = if soft { turned * hz } else { 0.0 };
        step1 * allowed * hz <= SMOOTH * axis.a_max && jerk <= SMOOTH * axis_jerk(config, a, soft)
    };
    Joint {
        v: allowed,
        taken: Taken::new(before, after, smooth),
    }
}
