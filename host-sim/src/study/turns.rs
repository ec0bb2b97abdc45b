//! Where a path stands on its three turns about the centre of the contour.
//!
//! In: the points of a path in order. Out: the angle about the centre, counted on over full turns. Touches nothing.

use std::f64::consts::{PI, TAU};

/// Closer to the centre than this (mm) no angle is taken: the programs begin there.
const BLIND_MM: f64 = 1.0;

/// Angle of the middle turn's beginning, radians: one full turn behind X22 Y0.
pub const MIDDLE: f64 = TAU;

/// Angle about the centre, counted on over full turns.
#[derive(Clone, Copy, Debug, Default)]
pub struct Winding {
    angle: Option<f64>,
}

impl Winding {
    /// Takes the next point in; the angle so far, radians. The first one lies in -pi..=pi, the next ones within half a
    /// turn of the one before. 0 until the path leaves the centre.
    pub fn push(&mut self, at: [f64; 2]) -> f64 {
        let before = self.angle.unwrap_or(0.0);
        if at[0].hypot(at[1]) < BLIND_MM {
            return before;
        }
        let raw = at[1].atan2(at[0]);
        let angle = match self.angle {
            None => raw,
            Some(_) => before + (raw - before + PI).rem_euclid(TAU) - PI,
        };
        self.angle = Some(angle);
        angle
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_turns_count_to_six_pi() {
        let mut winding = Winding::default();
        assert_eq!(winding.push([0.0, 0.0]), 0.0);
        winding.push([37.0, 0.0]);
        let mut angle = winding.push([13.856, -8.0]);
        assert!((angle + 30.0_f64.to_radians()).abs() < 1e-4);
        for degree in -29..=1090 {
            let theta = f64::from(degree).to_radians();
            angle = winding.push([20.0 * theta.cos(), 20.0 * theta.sin()]);
            assert!((angle - theta).abs() < 1e-9);
        }
        assert!(angle > 3.0 * MIDDLE);
    }
}
