//! Machine limits along one segment.
//!
//! With path velocity v, acceleration a and jerk j, an axis at q(s) sees
//! `q' v`, `q' a + q'' v^2` and `q' j + 3 q'' v a + q''' v^3` (chain rule). What the curve terms leave of the axis
//! limits is free for changing speed, and it is the more the slower the motion is: limits are functions of v.

use super::span::{halves, of_halves, Span};
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
/// Limits of the axes that path motion has to keep: acceleration and jerk, axis units, s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rates {
    /// Acceleration.
    pub a: AxisVec,
    /// Jerk.
    pub j: AxisVec,
    /// Largest jerk along the path that a piece can hold, path units/s^3.
    pub most: f32,
    /// Largest ratio of acceleration to jerk, s.
    pub(super) a_per_j: f32,
    /// Ticks per second.
    pub(super) hz: f32,
    /// The same where jerk is limited, otherwise 0: jerk per step of acceleration.
    pub(super) jerk_hz: f32,
}

impl Rates {
    /// None yet.
    pub const NONE: Self = Self {
        a: [0.0; AXES],
        j: [0.0; AXES],
        most: 0.0,
        a_per_j: 0.0,
        hz: 0.0,
        jerk_hz: 0.0,
    };

    /// Those of the machine; jerk-limited if `soft`.
    #[must_use]
    pub fn new(config: &Config, soft: bool) -> Self {
        let hz = config.servo_hz as f32;
        let a: AxisVec = core::array::from_fn(|i| config.axes[i].a_max);
        let j: AxisVec = core::array::from_fn(|i| axis_jerk(config, i, soft));
        Self {
            a,
            j,
            a_per_j: share_of(&a, &j),
            most: PIECE_JERK * hz * hz * hz,
            hz,
            jerk_hz: if soft { hz } else { 0.0 },
        }
    }
}

/// The largest share that one of `values`, none negative, takes of its limit.
pub(super) fn share_of(values: &AxisVec, limits: &AxisVec) -> f32 {
    let shares = values.iter().zip(limits);
    shares.map(|(value, limit)| value / limit).fold(0.0, larger)
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

/// A part of a segment.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// Distance of its middle from that of the segment, path units.
    middle: f32,
    /// Half of its length, path units.
    half: f32,
}

impl Part {
    /// All of a segment of `length`.
    #[must_use]
    pub fn whole(length: f32) -> Self {
        Self {
            middle: 0.0,
            half: 0.5 * length,
        }
    }

    /// From where there is so much of a segment of `length` left to where there is no more than that.
    #[must_use]
    pub fn between(length: f32, [from, to]: [f32; 2]) -> Self {
        let [from, to] = [from, to].map(|left| larger(0.0, smaller(left, length)));
        Self {
            middle: 0.5 * (length - from - to),
            half: 0.5 * (from - to).abs(),
        }
    }
}

/// Limits on path motion within one segment: mm (or degree), s.
///
/// Derivatives of the axes have their signs: which way an axis is bent decides whether braking or speeding
/// up is limited. Each goes along a line whose slope is the next one, and lies within a range about it. Ranges are a little wider than
/// the segment's own ([`Span`]): there are many of these.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurveLimits {
    /// Largest velocity.
    pub v: f32,
    /// q', q'' and q''' of the axes in the middle.
    lines: [[Span; AXES]; 3],
    /// q'''' of the axes, two in a word.
    fourth: [u32; AXES.div_ceil(2)],
    /// What they take at most.
    pub(super) bound: Bound,
}

/// What motion along the path asks of the axes, in each by its own derivatives.
#[derive(Clone, Copy, Debug)]
pub struct Demand {
    pub(super) a: f32,
    pub(super) j: f32,
    /// v^2.
    pub(super) square: f32,
    /// 3 v a.
    pub(super) cross: f32,
    /// v^3.
    pub(super) cube: f32,
}

impl Demand {
    /// Velocity, acceleration and jerk of the path.
    #[inline]
    #[must_use]
    pub fn new([v, a, j]: [f32; 3]) -> Self {
        Self::seen([v, a], [v, a], j)
    }

    /// Jerk of the path, with the velocity and acceleration that second differences see, and those that third ones do.
    #[inline]
    #[must_use]
    pub fn seen(second: [f32; 2], third: [f32; 2], j: f32) -> Self {
        let ([v, a], [w, b]) = (second, third);
        Self {
            a,
            j,
            square: v * v,
            cross: 3.0 * w * b,
            cube: w * w * w,
        }
    }

    /// Acceleration and jerk that this takes of an axis with these q', q'' and q''', each as its middle and half width: with the
    /// middles, and how far off that it may be.
    #[inline(always)]
    pub(super) fn of_axis(&self, derivatives: [[f32; 2]; 3]) -> [[f32; 2]; 2] {
        let Self {
            a,
            j,
            square,
            cross,
            cube,
        } = *self;
        let wide = self.sizes();
        let [[q1, r1], [q2, r2], [q3, r3]] = derivatives;
        [
            [q1 * a + q2 * square, q1 * j + q2 * cross + q3 * cube],
            [
                r1 * wide[0] + r2 * square,
                r1 * wide[1] + r2 * wide[2] + r3 * cube,
            ],
        ]
    }

    /// Of acceleration, jerk and 3 v a.
    #[inline]
    pub(super) fn sizes(&self) -> [f32; 3] {
        [self.a, self.j, self.cross].map(f32::abs)
    }
}

/// What a path takes at most of the limits of any axis: q' and q'' as shares of an acceleration, q''' of a jerk. It is enough to see
/// that most motions keep them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Bound([u32; 2]);

impl Bound {
    /// Nothing.
    const NONE: Self = Self([0; 2]);
    /// It may be anything.
    const UNKNOWN: Self = Self([f32::INFINITY.to_bits(); 2]);

    /// Of axes with these largest sizes of q', q'' and q'''.
    pub(super) fn new([first, second, third]: [AxisVec; 3], rates: &Rates) -> Self {
        Self([
            halves(share_of(&first, &rates.a), share_of(&second, &rates.a)),
            share_of(&third, &rates.j).to_bits(),
        ])
    }

    /// The largest shares of acceleration and of jerk that `demand` may take.
    #[inline]
    pub(super) fn shares(self, rates: &Rates, demand: &Demand) -> [f32; 2] {
        let [first, second] = of_halves(self.0[0]);
        let third = f32::from_bits(self.0[1]);
        let [a, j, cross] = demand.sizes();
        [
            first * a + second * demand.square,
            rates.a_per_j * (first * j + second * cross) + third * demand.cube,
        ]
    }
}

impl CurveLimits {
    /// Nothing may move.
    pub const NONE: Self = Self {
        v: 0.0,
        lines: [[Span::ZERO; AXES]; 3],
        fourth: [0; AXES.div_ceil(2)],
        bound: Bound::NONE,
    };

    /// q', q'' and q''' of axis `i` over `part`, each as its middle and half width; `None` where they are nothing.
    #[inline(always)]
    pub(crate) fn of_axis(&self, i: usize, part: Part) -> Option<[[f32; 2]; 3]> {
        let [first, second, third] = &self.lines;
        let lines = [first[i], second[i], third[i]];
        if Span::are_zero(lines) {
            return None;
        }
        let [[q1, r1], [q2, r2], [q3, r3]] = lines.map(Span::parts);
        let q4 = of_halves(self.fourth[i / 2])[i % 2];
        let Part { middle: y, half } = part;
        Some([
            [q1 + q2 * y, r1 + q2.abs() * half],
            [q2 + q3 * y, r2 + q3.abs() * half],
            [q3 + q4 * y, r3 + q4.abs() * half],
        ])
    }

    /// Accelerations allowed at velocity `v`: `|q' a + q'' v^2|` within the acceleration of every axis, and
    /// `|3 q'' v a + q''' v^3|` within what jerk leaves, so that it can be changed again.
    #[must_use]
    pub fn acceleration(&self, rates: &Rates, part: Part, v: f32) -> Range {
        let v = smaller(v, self.v);
        let (square, thrice) = (v * v, 3.0 * v);
        let cube = square * v;
        let mut range = Range::within(f32::MAX);
        for i in 0..AXES {
            let Some(axis) = self.of_axis(i, part) else {
                continue;
            };
            let [first, second, third] = axis.map(ends);
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

    /// Least and largest acceleration with which `|q' a + q'' v^2|` stays within the acceleration of every axis at velocity `v`.
    /// Both may be of one sign; there is none where the first is the larger.
    #[must_use]
    pub fn accelerations(&self, rates: &Rates, part: Part, v: f32) -> [f32; 2] {
        let square = v * v;
        let mut range = [f32::MIN, f32::MAX];
        for i in 0..AXES {
            let Some(axis) = self.of_axis(i, part) else {
                continue;
            };
            let [first, second, _] = axis.map(ends);
            // What q' a may be.
            let least = -rates.a[i] - square * second[0];
            let most = rates.a[i] - square * second[1];
            for q in first {
                let [low, high] = if q > 0.0 {
                    [least / q, most / q]
                } else if q < 0.0 {
                    [most / q, least / q]
                } else if least <= 0.0 && most >= 0.0 {
                    continue;
                } else {
                    [f32::MAX, f32::MIN]
                };
                range = [larger(range[0], low), smaller(range[1], high)];
            }
        }
        range
    }

    /// Jerks allowed at velocity `v` and acceleration `a`: `|q' j + 3 q'' v a + q''' v^3|` within the jerk of every
    /// axis.
    #[must_use]
    pub fn jerk(&self, rates: &Rates, part: Part, v: f32, a: f32) -> Range {
        let v = smaller(v, self.v);
        let (cross, cube) = (3.0 * v * a, v * v * v);
        let mut range = Range::within(rates.most);
        for i in 0..AXES {
            let Some(axis) = self.of_axis(i, part) else {
                continue;
            };
            let [first, second, third] = axis.map(ends);
            let (x, y) = (cross * second[0], cross * second[1]);
            let rate = rates.j[i];
            let floor = LEAST_JERK * rates.j[i];
            let below = larger(floor, rate + smaller(x, y) + cube * third[0]);
            let above = larger(floor, rate - larger(x, y) - cube * third[1]);
            range.keep(first, below, above);
        }
        range
    }

    /// Whether every axis stays within `share` of its acceleration and jerk where the path asks for `demand` (formulae above).
    #[inline]
    #[must_use]
    pub fn keeps(
        &self,
        rates: &Rates,
        part: impl FnOnce() -> Part,
        demand: &Demand,
        share: Share,
    ) -> bool {
        let [a, j] = self.bound.shares(rates, demand);
        (a <= share.a && j <= share.j) || self.keeps_exactly(rates, part(), demand, share)
    }

    #[inline(never)]
    fn keeps_exactly(&self, rates: &Rates, part: Part, demand: &Demand, share: Share) -> bool {
        for i in 0..AXES {
            let Some(axis) = self.of_axis(i, part) else {
                continue;
            };
            let [middle, off] = demand.of_axis(axis);
            let [acceleration, jerk] = [middle[0].abs() + off[0], middle[1].abs() + off[1]];
            if !(acceleration <= share.a * rates.a[i] && jerk <= share.j * rates.j[i]) {
                return false;
            }
        }
        true
    }

    /// Limits that hold at `v`, whichever way the motion is changed.
    #[must_use]
    pub fn at(&self, rates: &Rates, part: Part, v: f32) -> PathLimits {
        let Range { down, up } = self.acceleration(rates, part, v);
        let a = smaller(down, up);
        let [x, y] = [a, -a].map(|a| self.jerk(rates, part, v, a));
        PathLimits {
            a,
            j: smaller(smaller(x.down, x.up), smaller(y.down, y.up)),
        }
    }

    /// Jerk allowed at standstill, either sign.
    #[must_use]
    pub fn still_jerk(&self, rates: &Rates, part: Part) -> f32 {
        let mut range = Range::within(rates.most);
        for (i, &j) in rates.j.iter().enumerate() {
            if let Some([first, ..]) = self.of_axis(i, part) {
                range.keep(ends(first), j, j);
            }
        }
        range.up
    }

    /// Inside a segment of `length` whose largest velocity is `v`.
    #[must_use]
    pub fn new(shape: &PathShape, length: f32, v: f32) -> Self {
        let PathShape {
            middle,
            fourth,
            off,
            ..
        } = shape;
        let half = 0.5 * length;
        let fourths = core::array::from_fn(|k| {
            let of = |i: usize| fourth.get(i).copied().unwrap_or(0.0);
            halves(of(2 * k), of(2 * k + 1))
        });
        let mut lines = [[Span::ZERO; AXES]; 3];
        for i in 0..AXES {
            // What rounding the slope of a line puts its ends off by.
            let kept = of_halves(fourths[i / 2])[i % 2];
            let mut cut = (fourth[i] - kept).abs();
            let derivatives = [
                (middle.first[i], off.first[i]),
                (middle.second[i], off.second[i]),
                (middle.third[i], off.third[i]),
            ];
            for (line, (middle, off)) in lines.iter_mut().zip(derivatives).rev() {
                line[i] = Span::about(middle, off + cut * half);
                cut = (middle - line[i].parts()[0]).abs();
            }
        }
        Self {
            v,
            lines,
            fourth: fourths,
            bound: Bound::UNKNOWN,
        }
    }

    /// The same with bounds, and without the axes for which `idle` says so.
    pub(super) fn without(
        mut self,
        rates: &Rates,
        whole: Part,
        idle: impl Fn(usize) -> bool,
    ) -> Self {
        let mut most = [[0.0; AXES]; 3];
        for i in 0..AXES {
            if idle(i) {
                for lines in &mut self.lines {
                    lines[i] = Span::ZERO;
                }
            } else if let Some(axis) = self.of_axis(i, whole) {
                for (most, [middle, half]) in most.iter_mut().zip(axis) {
                    most[i] = middle.abs() + half;
                }
            }
        }
        self.bound = Bound::new(most, rates);
        self
    }
}

/// Least and largest value.
fn ends([middle, half]: [f32; 2]) -> [f32; 2] {
    [middle - half, middle + half]
}

/// What rounding of commanded positions may add to a third difference of them, units of 2^-32 step: each is off by half a
/// unit, and the first of a segment by three more.
const ROUNDED: f32 = 12.0;

/// Units of a step.
const STEP: f32 = (1_u64 << 32) as f32;

/// Jerk limit of an axis, less what rounding adds to it in the sampled motion. Without `SOFT` the acceleration builds up within two ticks.
pub(super) fn axis_jerk(config: &Config, axis: usize, soft: bool) -> f32 {
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
    let PathDerivatives {
        first,
        second,
        third,
    } = shape.most;
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
