//! Travel limits along a curve, not only at its ends.

use super::chord::per_unit;
use super::HermiteSegment;
use crate::config::Config;
use crate::units::{sqrt, Position, Steps, AXES, NANO_PER_UNIT};

/// Travel of all axes in steps: made once, because the way there from programmed units is a 128-bit division.
///
/// Wider by half the resolution of programs at each end: a curve that touches the end of travel is inside, whichever way
/// its numbers were rounded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TravelBounds {
    low: Position,
    high: Position,
}

impl TravelBounds {
    /// Bounds of a machine. An axis whose travel is beyond the range of positions has none: all of it is outside.
    #[must_use]
    pub fn new(config: &Config) -> Self {
        let mut bounds = Self {
            low: [Steps::MAX; AXES],
            high: [Steps::MIN; AXES],
        };
        for (a, axis) in config.axes.iter().enumerate() {
            let bound = |nano| config.steps_from_nano(a, nano);
            if let (Some(low), Some(high)) = (bound(axis.travel_min), bound(axis.travel_max)) {
                let half = Steps::from_bits(axis.steps_per_unit.to_bits() / (2 * NANO_PER_UNIT));
                bounds.low[a] = low.saturating_sub(half);
                bounds.high[a] = high.saturating_add(half);
            }
        }
        bounds
    }

    /// First axis whose coordinate of `at` is outside its travel, or `None`.
    #[must_use]
    pub fn outside_at(&self, at: &Position) -> Option<usize> {
        (0..AXES).find(|&a| at[a] < self.low[a] || at[a] > self.high[a])
    }

    /// How far the axes can go from `at`, mm or degree: downwards (not positive inside), upwards.
    #[must_use]
    pub fn room(&self, config: &Config, at: &Position) -> [[f64; AXES]; 2] {
        [&self.low, &self.high].map(|bound| {
            core::array::from_fn(|a| {
                (bound[a].to_num::<f64>() - at[a].to_num::<f64>())
                    / config.axes[a].steps_per_unit.to_num::<f64>()
            })
        })
    }

    /// First axis whose coordinate leaves its travel anywhere on `segment`, or `None`.
    ///
    /// The extremes of a cubic lie at its ends or where its derivative, a quadratic, vanishes.
    #[must_use]
    pub fn outside(&self, config: &Config, segment: &HermiteSegment) -> Option<usize> {
        (0..AXES).find(|&a| {
            let (low, high) = (self.low[a], self.high[a]);
            let (start, end) = (segment.start[a], segment.end[a]);
            if start < low || start > high || end < low || end > high {
                return true;
            }
            if is_far_inside(config, a, [low, high], segment) {
                return false;
            }
            let unit = config.units_per_step(a);
            let Some(delta) = end.checked_sub(start) else {
                return true;
            };
            let delta = delta.to_num::<f32>() * unit;
            let (t0, t1) = (segment.slope_start[a], segment.slope_end[a]);
            // P'(u) = t0 + 2 b u + 3 c u^2
            let (b, c) = (3.0 * delta - 2.0 * t0 - t1, t0 + t1 - 2.0 * delta);
            let room = |u: f32| {
                let moved = u * (t0 + u * (b + u * c));
                let up = high.saturating_sub(start).to_num::<f32>() * unit;
                let down = low.saturating_sub(start).to_num::<f32>() * unit;
                // One tenth of a micrometre of f32 rounding.
                moved <= up + 1e-4 && moved >= down - 1e-4
            };
            let inside = |u: f32| !(u > 0.0 && u < 1.0) || room(u);
            let root = b * b - 3.0 * c * t0;
            if root <= 0.0 {
                return false;
            }
            // Stable pair of roots of 3 c u^2 + 2 b u + t0.
            let q = -(b + sqrt(root).copysign(b));
            !(inside(q / (3.0 * c)) && inside(t0 / q))
        })
    }
}

/// True if the inner points of the Bezier hull of `axis` are inside `bounds` by more than the rounding of `f32`; then all
/// of a curve is whose ends are. Nearly every curve is, and this asks for no root and no division of 64 bits.
#[inline]
fn is_far_inside(
    config: &Config,
    axis: usize,
    bounds: [Steps; 2],
    segment: &HermiteSegment,
) -> bool {
    let whole = |at: Steps| (at.to_bits() >> 32) as i32 as f32;
    let third = per_unit(config, axis) * (1.0 / 3.0);
    let first = whole(segment.start[axis]) + segment.slope_start[axis] * third;
    let last = whole(segment.end[axis]) - segment.slope_end[axis] * third;
    let slack = 2.0 + 1.0e-6 * (first.abs() + last.abs());
    let (low, high) = (whole(bounds[0]) + slack, whole(bounds[1]) - slack);
    first >= low && last >= low && first <= high && last <= high
}

/// [`TravelBounds::outside`] for a caller that asks once.
#[must_use]
pub fn outside_travel(config: &Config, segment: &HermiteSegment) -> Option<usize> {
    TravelBounds::new(config).outside(config, segment)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::tests::test_config;

    fn segment(end: f32, t0: f32, t1: f32) -> HermiteSegment {
        let mut s = HermiteSegment {
            start: [Steps::ZERO; AXES],
            end: [Steps::ZERO; AXES],
            slope_start: [0.0; AXES],
            slope_end: [0.0; AXES],
        };
        s.end[0] = Steps::from_num(end * 1000.0);
        s.slope_start[0] = t0;
        s.slope_end[0] = t1;
        s
    }

    #[test]
    fn a_bulge_between_good_end_points_is_seen() {
        let config = test_config();
        // u (1 - u) slopes: the curve 4 h u (1 - u) peaks at h.
        for (h, bad) in [
            (499.0, false),
            (501.0, true),
            (-499.0, false),
            (-501.0, true),
        ] {
            assert_eq!(
                outside_travel(&config, &segment(0.0, 4.0 * h, -4.0 * h)).is_some(),
                bad,
                "{h}"
            );
        }
        assert_eq!(outside_travel(&config, &segment(500.5, 0.0, 0.0)), Some(0));
        assert_eq!(outside_travel(&config, &segment(499.5, 499.5, 499.5)), None);
    }
}
