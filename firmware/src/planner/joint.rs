//! Joints between segments: how fast one may be passed, and what that takes of the axes in the ticks beside it.
//!
//! In: the derivatives of the axes on both sides. Out: a [`Joint`], and with it whether motion beside it keeps the limits of the
//! axes ([`CurveLimits`]).

use super::limits::{axis_jerk, share_of, CurveLimits, Demand, Part, Rates, Share};
use super::span::{halves, of_halves};
use crate::config::Config;
use crate::geometry::arc::PathDerivatives;
use crate::units::{larger, smaller, AXES};

/// Share of an axis' jerk that passing a joint may take.
const JOINT_SHARE: f32 = 0.98;
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

/// What passing a joint takes of the axes: the steps of their q' and q'' there, from the segment before it to the one behind.
/// Each is the upper half of an `f32`, rounded away from zero: what is taken is a little more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Taken {
    steps: [u32; AXES],
    /// The largest share that a step of q' takes of an acceleration, and one of q'' of a jerk.
    most: u32,
}

impl Taken {
    /// Nothing.
    pub const NONE: Self = Self {
        steps: [0; AXES],
        most: 0,
    };

    /// From `before` the joint to `after` it; nothing of the axes that are `smooth` there.
    fn new(
        before: &PathDerivatives,
        after: &PathDerivatives,
        rates: &Rates,
        smooth: impl Fn(usize) -> bool,
    ) -> Self {
        let steps = core::array::from_fn(|i| {
            if smooth(i) {
                return 0;
            }
            halves(
                after.first[i] - before.first[i],
                after.second[i] - before.second[i],
            )
        });
        let size = |k: usize| steps.map(|step| of_halves(step)[k].abs());
        Self {
            steps,
            most: halves(share_of(&size(0), &rates.a), share_of(&size(1), &rates.j)),
        }
    }

    /// Whether nothing is.
    #[inline]
    #[must_use]
    pub fn is_none(&self) -> bool {
        self.most == 0
    }

    /// Whether nothing is taken of axis `i`.
    #[inline]
    fn spares(&self, i: usize) -> bool {
        self.steps[i] == 0
    }

    /// Steps of q' and q'' of axis `i`.
    #[inline]
    fn of_axis(&self, i: usize) -> [f32; 2] {
        of_halves(self.steps[i])
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

/// What passing a joint asks for, per step of the derivatives there.
struct Passing {
    /// Jerk per step of q''.
    bent: f32,
    /// Jerk per step of q'.
    turned: f32,
    /// Acceleration per step of q'.
    kinked: f32,
}

impl CurveLimits {
    /// Whether [`Self::keeps`] holds in a tick that sees a joint passed at velocity `over`: what that takes, `weight` times, comes on top of what this
    /// segment asks for.
    #[inline]
    #[must_use]
    pub fn keeps_beside(
        &self,
        rates: &Rates,
        part: impl FnOnce() -> Part,
        demand: &Demand,
        share: Share,
        taken: &Taken,
        [over, weight]: [f32; 2],
    ) -> bool {
        if taken.is_none() {
            return self.keeps(rates, part, demand, share);
        }
        // A step in q' adds what it turns, in one tick or two; a step in q'' up to its share of what it bends.
        let [weighed, kinked] = [rates.jerk_hz * weight, over * rates.hz];
        let passing = Passing {
            bent: 0.5 * SAMPLED_STEP * over * over * weighed,
            turned: (kinked + demand.a.abs()) * weighed,
            kinked: 0.5 * kinked * weight,
        };
        let [a, j] = self.bound.shares(rates, demand);
        let [kink, bend] = of_halves(taken.most);
        let a = a + 2.0 * passing.kinked * kink;
        let j = j + passing.turned * rates.a_per_j * kink + 2.0 * passing.bent * bend;
        (a <= share.a && j <= share.j)
            || self.keeps_beside_exactly(rates, part(), demand, share, taken, &passing)
    }

    #[inline(never)]
    fn keeps_beside_exactly(
        &self,
        rates: &Rates,
        part: Part,
        demand: &Demand,
        share: Share,
        taken: &Taken,
        passing: &Passing,
    ) -> bool {
        let Passing {
            bent,
            turned,
            kinked,
        } = *passing;
        for i in 0..AXES {
            let Some(axis) = self.of_axis(i, part) else {
                continue;
            };
            let (a_max, j_max) = (rates.a[i], rates.j[i]);
            let [inside, off] = demand.of_axis(axis);
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
            let [acceleration, jerk] = [most[0] + off[0], most[1] + off[1]];
            if !(acceleration <= share.a * a_max && jerk <= share.j * j_max) {
                return false;
            }
        }
        true
    }

    /// Forgets the axes that never limit anything: with whatever the others allow at up to velocity `v`, and with what passing the
    /// joints at both ends takes at their velocities, they keep their limits by far. Limits are looked at much more often than set.
    #[must_use]
    pub fn without_idle(
        self,
        rates: &Rates,
        length: f32,
        v: f32,
        joints: [(&Taken, f32); 2],
    ) -> Self {
        let (square, cube) = (v * v, v * v * v);
        let whole = Part::whole(length);
        let axes: [_; AXES] = core::array::from_fn(|i| {
            let axis = self.of_axis(i, whole).unwrap_or([[0.0; 2]; 3]);
            axis.map(|[middle, half]| (middle.abs(), half))
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
        self.without(rates, whole, |i| {
            let [q1, q2, q3] = axes[i].map(|(middle, half)| middle + half);
            let mut most = [q1 * a + q2 * square, q1 * j + q2 * cross + q3 * cube];
            for (taken, over) in joints {
                let [step1, step2] = taken.of_axis(i).map(f32::abs);
                let turned = step1 * (over * rates.hz + a);
                most[0] += step1 * over * rates.hz;
                most[1] += (turned + SAMPLED_STEP * step2 * over * over) * rates.jerk_hz;
            }
            most[0] <= IDLE * rates.a[i] && most[1] <= IDLE * rates.j[i]
        })
    }
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
    v: f32,
    rates: &Rates,
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
        let room = JOINT_SHARE * axis_jerk(config, a, soft) - turned;
        let taken = |v: f32| v * hz * (step1 * hz + v * step2);
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
        taken: Taken::new(before, after, rates, smooth),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::tests::test_config;
    use crate::geometry::arc::PathShape;
    use crate::units::AxisVec;
    use proptest::prelude::*;

    /// Numbers of either sign over four decades up to `most`.
    fn size(most: f32) -> impl Strategy<Value = f32> {
        (-4.0_f32..0.0, any::<bool>()).prop_map(move |(decade, negative)| {
            let x = most * 10.0_f32.powf(decade);
            if negative {
                -x
            } else {
                x
            }
        })
    }

    fn axes(most: f32) -> impl Strategy<Value = AxisVec> {
        prop::array::uniform5(size(most))
    }

    fn derivatives() -> impl Strategy<Value = PathDerivatives> {
        (axes(1.0), axes(10.0), axes(100.0)).prop_map(|(first, second, third)| PathDerivatives {
            first,
            second,
            third,
        })
    }

    proptest! {
        #[test]
        fn no_verdict_depends_on_bounds_or_on_forgotten_axes(
            (inside, before, after) in (derivatives(), derivatives(), derivatives()),
            fourth in axes(1000.0),
            by in 0.0_f32..0.3,
            length in 0.01_f32..1.0,
            lefts in prop::array::uniform2(-0.1_f32..1.1),
            top in 0.1_f32..100.0,
            shares in prop::array::uniform4(0.0_f32..1.0),
            (a, j) in (-1.5_f32..1.5, -1.5_f32..1.5),
            kinked in 0.0_f32..0.01,
            soft in any::<bool>(),
        ) {
            let config = test_config();
            let rates = Rates::new(&config, soft);
            let size = |x: &AxisVec| x.map(|x| by * x.abs());
            let off = PathDerivatives {
                first: size(&inside.first),
                second: size(&inside.second),
                third: size(&inside.third),
            };
            let shape = PathShape {
                middle: inside,
                fourth,
                off,
                most: off,
                start: inside,
                end: inside,
                rotary_only: false,
                feed_scale: 1.0,
            };
            let bent = PathDerivatives {
                first: core::array::from_fn(|i| before.first[i] + kinked * after.first[i]),
                ..after
            };
            let taken = Taken::new(&before, &bent, &rates, |_| false);
            let over = shares[0] * top;
            let exact = CurveLimits::new(&shape, length, top);
            let joints = [(&taken, over), (&Taken::NONE, top)];
            let quick = exact.without_idle(&rates, length, top, joints);
            let part = Part::between(length, lefts.map(|left| left * length));
            let v = shares[1] * top;
            let most = exact.acceleration(&rates, part, v);
            let a = a * if a > 0.0 { most.up } else { most.down };
            let most = exact.jerk(&rates, part, v, a);
            let j = j * if j > 0.0 { most.up } else { most.down };
            let demand = Demand::new([v, a, j]);
            let share = Share { a: 1.0, j: 1.0 };
            prop_assert_eq!(
                exact.keeps(&rates, || part, &demand, share),
                quick.keeps(&rates, || part, &demand, share)
            );
            for taken in [&taken, &Taken::NONE] {
                let passed = [shares[2] * over, 1.0];
                prop_assert_eq!(
                    exact.keeps_beside(&rates, || part, &demand, share, taken, passed),
                    quick.keeps_beside(&rates, || part, &demand, share, taken, passed)
                );
            }
        }
    }
}
