//! Slowing down where each segment allows something else: an acceleration of its own for each stretch of the way.
//!
//! In: a motion without a limit of jerk. Out: [`Stretch`]es, each with nearly the least acceleration that the segments under it
//! allow, until a leg to rest keeps every limit. Where curvature takes so much that an axis has to be sped up or slowed down
//! along with it, that acceleration is of one sign: a descent may have to gain speed before it loses any.

use super::brake::Phases;
use super::course::{Breach, Course, Motion};
use super::profile::{View, UNIT};
use super::refuge::largest;
use crate::units::{larger, smaller};

/// Stretches of a way to rest.
pub(super) const STRETCHES: usize = 36;

/// Where in the range of accelerations a stretch lies: 1 is its lower end, 0 its middle.
const SHARES: [f32; 5] = [0.97, 0.87, 0.77, 0.57, 0.37];

/// Shortest and longest stretch, ticks. One that could only be shorter goes on beyond the joint.
const TICKS: [f32; 2] = [3.0, 20.0];

/// How long before a joint a stretch ends, ticks: the next acceleration is built up by then.
const BEFORE: f32 = 1.0;

/// An acceleration that is built up and held.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stretch {
    /// Path units/s^2.
    a: f32,
    /// Ticks of building it up, one at least, and of holding it.
    ticks: [u8; 2],
}

impl Stretch {
    /// Its course from `at`.
    pub(super) fn course(&self, at: &Motion, h: f32) -> Course {
        let [build, hold] = self.ticks.map(u32::from);
        Course {
            h,
            jerk: [(self.a - at.a) / (h * build as f32), 0.0, 0.0],
            ticks: [build, hold, 0],
        }
    }
}

impl View<'_> {
    /// A stretch from `at` on, at `share` of the range of accelerations, and the motion at its end, or what it breaks.
    fn stretch(&self, at: &Motion, share: f32) -> Result<(Stretch, Motion), Breach> {
        let per_tick = at.v / self.hz;
        let here = self.ahead(at);
        let [mut low, mut high] = self.accelerations(at.node, here, at.v);
        let (mut index, mut left) = (at.node, at.left);
        let mut ticks = left / per_tick - BEFORE;
        while ticks < TICKS[0] - BEFORE && !self.nodes.get(index).stop && index + 1 < self.end {
            index += 1;
            let next = self.accelerations(index, self.whole(index), at.v);
            (low, high) = (larger(low, next[0]), smaller(high, next[1]));
            left += self.nodes.get(index).length;
            ticks = left / per_tick - BEFORE;
        }
        if !(low <= high) {
            return Err(Breach::Change);
        }
        let middle = 0.5 * (low + high);
        let a = middle + share * (low - middle);
        let jerks = self.jerk(at.node, here, at.v, at.a);
        let jerk = if a < at.a { jerks.down } else { jerks.up };
        let build = larger(1.0, libm::ceilf((a - at.a).abs() / (0.98 * jerk) * self.hz));
        if !(build <= TICKS[1]) {
            return Err(Breach::Change);
        }
        let hold = smaller(larger(ticks, TICKS[0]), TICKS[1]) - build;
        let stretch = Stretch {
            a,
            ticks: [build as u8, larger(hold, 0.0) as u8],
        };
        let end = self.run_on(at, &stretch.course(at, 1.0 / self.hz))?;
        Ok((stretch, end))
    }

    /// The stretch from `at` on that slows down most, and the motion at its end.
    pub(super) fn steepest(&self, at: &Motion) -> Option<(Stretch, Motion)> {
        if !self.nodes.get(at.node).brisk {
            return self.guided_stretch(at);
        }
        largest(&SHARES, |share| self.stretch(at, share))
    }

    /// The piece from `at` on that follows the guide: jerk and ticks.
    pub(super) fn guided(&self, at: &Motion) -> Option<(f32, u32)> {
        if self.nodes.get(at.node).brisk || !(at.v > 0.0) {
            return None;
        }
        let most = crate::knob(16, 12.0);
        let whole = at.left / at.v * self.hz;
        let parts = libm::ceilf(whole / most);
        let ticks = libm::roundf(whole / larger(parts, 1.0));
        let ticks = larger(4.0, smaller(ticks, most));
        let time = ticks / self.hz;
        let n = ticks as u32;
        let there = self.along(at, 0.0, n);
        let [v, a] = self.guide.at(self, &there)?;
        let top = self.nodes.get(there.node).limits.v;
        if v > crate::knob(17, 0.93) * top {
            return None;
        }
        let first = (a - at.a) / time;
        let reached = at.v + 0.5 * (at.a + a) * time;
        let tau = crate::knob(18, 50.0) / self.hz;
        Some((first + (v - reached) / (tau * time), n))
    }

    fn guided_stretch(&self, at: &Motion) -> Option<(Stretch, Motion)> {
        let (jerk, ticks) = self.guided(at)?;
        let stretch = Stretch {
            a: at.a + jerk * ticks as f32 / self.hz,
            ticks: [ticks as u8, 0],
        };
        let end = self.run_on(at, &stretch.course(at, 1.0 / self.hz)).ok()?;
        Some((stretch, end))
    }

    /// The phases of `stretch` from the planned state in whole units of jerk.
    pub(super) fn exactly_stretched(&self, stretch: &Stretch) -> Option<Phases> {
        let [build, hold] = stretch.ticks.map(u32::from);
        let a = (stretch.a / (self.hz * self.hz) * UNIT) as i128;
        let jerk = (a - self.state.a) / i128::from(build);
        Some([(i64::try_from(jerk).ok()?, build), (0, hold), (0, 0)])
    }
}

#[cfg(test)]
mod tests {
    use super::super::limits::{CurveLimits, Part, Rates};
    use crate::config::tests::test_config;
    use crate::geometry::arc::{PathDerivatives, PathShape};
    use crate::units::AXES;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn accelerations_are_those_that_every_corner_of_the_ranges_allows(
            first in prop::array::uniform5((-1.0_f32..1.0, 0.0_f32..0.5)),
            second in prop::array::uniform5((-30.0_f32..30.0, 0.0_f32..5.0)),
            v in 0.0_f32..50.0,
            share in 0.0_f64..1.0,
        ) {
            let side = |of: fn(&(f32, f32)) -> f32| PathDerivatives {
                first: first.each_ref().map(of),
                second: second.each_ref().map(of),
                third: [0.0; AXES],
            };
            let (middle, off) = (side(|x| x.0), side(|x| x.1));
            let shape = PathShape {
                middle,
                fourth: [0.0; AXES],
                off,
                most: off,
                start: middle,
                end: middle,
                rotary_only: false,
                feed_scale: 1.0,
            };
            let config = test_config();
            // Of no length, so that the first derivative does not change with the second.
            let limits = CurveLimits::new(&shape, 0.0, f32::MAX);
            let rates = Rates::new(&config, false);
            let everywhere = Part::whole(0.0);
            let [low, high] = limits.accelerations(&rates, everywhere, v).map(f64::from);
            // The worst that acceleration `a` asks of any axis, as a share of what it has, over corners of the ranges.
            let worst = |a: f64| {
                let mut most = 0.0_f64;
                for i in 0..AXES {
                    let Some([q1, q2, _]) = limits.of_axis(i, everywhere) else {
                        continue;
                    };
                    let [q1, q2] = [q1, q2].map(|[middle, half]| {
                        let [middle, half] = [middle, half].map(f64::from);
                        [middle - half, middle + half]
                    });
                    for (x, y) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                        let asked = q1[x] * a + q2[y] * f64::from(v) * f64::from(v);
                        most = most.max(asked.abs() / f64::from(config.axes[i].a_max));
                    }
                }
                most
            };
            if low <= high {
                prop_assert!(worst(low + share * (high - low)) <= 1.0 + 1e-4);
                let beyond = 0.01 * (high - low) + 1e-3 * low.abs().max(high.abs());
                prop_assert!(worst(low - beyond) > 1.0 - 1e-4);
                prop_assert!(worst(high + beyond) > 1.0 - 1e-4);
            } else if low < f64::from(f32::MAX) && high > f64::from(f32::MIN) {
                for a in [low, 0.5 * (low + high), high] {
                    prop_assert!(worst(a) > 1.0 - 1e-4, "{a} between {low} and {high}");
                }
            }
        }
    }
}
