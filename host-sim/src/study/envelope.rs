//! The contour a cutter leaves: the inner edge of what its circle sweeps over.
//!
//! In: the path of the cutter's centre, one point per servo tick, and the cutter's radius. Out: where the edge crosses
//! a control line. Touches nothing.
//!
//! At 25 mm/s and 5 kHz two centres are 5 um apart; between them the circles bulge by less than
//! (2.5 um)^2 / 2R = 2e-6 mm, so the circles alone are the swept area to far better than the 1e-4 mm asked for.

use std::f64::consts::FRAC_PI_2;

use super::contour::Control;
use super::turns::{Winding, MIDDLE};

/// Path of the cutter's centre over the middle turn, with the angle of each point.
#[derive(Clone, Debug, Default)]
pub struct CentrePath {
    points: Vec<([f64; 2], f64)>,
    winding: Winding,
}

impl CentrePath {
    /// Takes the next centre in, mm; true if it lies on the middle turn. Others are used only for counting turns,
    /// but for the quarter turns before and behind.
    pub fn push(&mut self, at: [f64; 2]) -> bool {
        let angle = self.winding.push(at);
        if (MIDDLE - FRAC_PI_2..=2.0 * MIDDLE + FRAC_PI_2).contains(&angle) {
            self.points.push((at, angle));
        }
        (MIDDLE..2.0 * MIDDLE).contains(&angle)
    }

    /// Where the edge crosses the line through `control`: the measured coordinate, mm. The cutter is taken to be
    /// outside, so the edge is the swept point nearest to the centre of the contour. `None` if nothing crosses the
    /// line near the control point.
    ///
    /// With `radius` 0 the path itself is the edge.
    #[must_use]
    pub fn crossing(&self, radius: f64, control: &Control) -> Option<f64> {
        let (measured, fixed) = (control.measured, 1 - control.measured);
        let [from, to] = control.window.map(|angle| MIDDLE + angle);
        let near: Vec<[f64; 2]> = self
            .points
            .iter()
            .filter(|(_, angle)| (from..=to).contains(angle))
            .map(|(at, _)| *at)
            .collect();
        let line = control.at[fixed];
        // Towards the centre of the contour.
        let inwards = -control.at[measured].signum();
        let candidates: Vec<f64> = if radius > 0.0 {
            let reach = |at: &[f64; 2]| {
                let off = at[fixed] - line;
                let half = radius * radius - off * off;
                (half >= 0.0).then(|| at[measured] + inwards * half.sqrt())
            };
            near.iter().filter_map(reach).collect()
        } else {
            let cut = |pair: &[[f64; 2]]| {
                let (a, b) = (pair[0][fixed] - line, pair[1][fixed] - line);
                let t = a / (a - b);
                ((a < 0.0) != (b < 0.0))
                    .then(|| pair[0][measured] + t * (pair[1][measured] - pair[0][measured]))
            };
            near.windows(2).filter_map(cut).collect()
        };
        candidates
            .into_iter()
            .max_by(|a, b| (a * inwards).total_cmp(&(b * inwards)))
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::super::contour;
    use super::*;

    /// Centre path over three turns of `curve`, offset outwards by `radius`, `steps` points per turn.
    fn offset(curve: &dyn Fn(f64) -> [f64; 2], radius: f64, steps: u32) -> CentrePath {
        let mut path = CentrePath::default();
        path.push([0.0, 0.0]);
        for i in 0..3 * steps {
            let theta = TAU * f64::from(i) / f64::from(steps);
            let h = 1e-5;
            let (a, b, at) = (curve(theta - h), curve(theta + h), curve(theta));
            let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
            let along = dx.hypot(dy);
            path.push([at[0] + radius * dy / along, at[1] - radius * dx / along]);
        }
        path
    }

    #[test]
    fn the_edge_under_a_circle_of_centres_is_a_circle() {
        let curve = |theta: f64| [20.0 * theta.cos(), 20.0 * theta.sin()];
        let path = offset(&curve, 2.0, 25_000);
        for degrees in [90.0_f64, 100.5, 115.0, 127.5, 135.0, 155.0, 172.0, 180.0] {
            let theta = degrees.to_radians();
            let control = Control {
                number: 1,
                theta,
                at: curve(theta),
                measured: usize::from(degrees == 90.0),
                window: [theta - 0.3, theta + 0.3],
            };
            let edge = path.crossing(2.0, &control).unwrap();
            let error = edge - control.at[control.measured];
            assert!(error.abs() < 2e-6, "{degrees}: {error}");
        }
    }

    #[test]
    fn the_edge_under_the_exact_offset_is_the_contour() {
        let path = offset(&contour::point, contour_tool(), 25_000);
        for control in contour::controls() {
            let edge = path.crossing(contour_tool(), &control).unwrap();
            let error = edge - control.at[control.measured];
            assert!(error.abs() < 1e-5, "{control:?}: {error}");
        }
    }

    #[test]
    fn a_path_shifted_outwards_is_measured_as_shifted() {
        let curve = |theta: f64| contour::point(theta).map(|v| 1.001 * v);
        let path = offset(&curve, contour_tool(), 25_000);
        let bare = offset(&curve, 0.0, 25_000);
        for control in contour::controls() {
            let ends = control.number == 1 || control.number == 11;
            let [edge, cut] = [
                path.crossing(contour_tool(), &control),
                bare.crossing(0.0, &control),
            ]
            .map(|edge| edge.unwrap() - control.at[control.measured]);
            assert!((edge - cut).abs() < 2e-5, "{control:?}: {edge} {cut}");
            assert!(!ends || (edge.abs() - 0.022).abs() < 1e-5, "{edge}");
        }
    }

    fn contour_tool() -> f64 {
        super::super::programs::TOOL_RADIUS_MM
    }
}
