//! The thesis contour, r(theta) = 18 + 4 cos 2 theta cos 6 theta, in `f64`.
//!
//! In: an angle or an arc length. Out: points, slopes, arc length, the eleven control points. Touches nothing.
//!
//! Equations (30) and (31) of the thesis print cos 6 theta cos 4 theta; the arc-length integral (33), the length
//! 136.1895 mm, the control points (Table 3.10.1) and every listing agree with cos 2 theta cos 6 theta only.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

/// Arc length of the whole contour as the thesis prints it (section 2.1.3), mm.
pub const PRINTED_LENGTH_MM: f64 = 136.1895;

/// Radius of curvature where the contour is hollow and tightest, 25.5 degrees off each half axis, mm.
pub const HOLLOW_MM: f64 = 2.3314;

/// Angles of the control points 1 to 11 (Table 3.10.1), degrees.
pub const CONTROL_DEGREES: [f64; 11] = [
    90.0, 100.5, 107.5, 115.0, 127.5, 135.0, 147.5, 155.0, 167.5, 172.0, 180.0,
];

/// Distance of the contour from the centre at angle `theta` (radians), mm.
#[must_use]
pub fn radius(theta: f64) -> f64 {
    18.0 + 4.0 * (2.0 * theta).cos() * (6.0 * theta).cos()
}

/// dr/dtheta, mm per radian.
#[must_use]
pub fn radius_slope(theta: f64) -> f64 {
    -8.0 * (2.0 * theta).sin() * (6.0 * theta).cos()
        - 24.0 * (2.0 * theta).cos() * (6.0 * theta).sin()
}

/// Point of the contour at angle `theta` (radians), `[x, y]` in mm.
#[must_use]
pub fn point(theta: f64) -> [f64; 2] {
    let r = radius(theta);
    [r * theta.cos(), r * theta.sin()]
}

/// Distance of `at` from the contour along its normal, to first order; positive outside. mm.
#[must_use]
pub fn normal_error(at: [f64; 2]) -> f64 {
    let theta = at[1].atan2(at[0]);
    let (r, slope) = (radius(theta), radius_slope(theta));
    (at[0].hypot(at[1]) - r) * r / r.hypot(slope)
}

/// Arc length from angle `from` to angle `to` (radians), mm: equation (33), five-point Gauss-Legendre on
/// pieces of one degree at most.
#[must_use]
pub fn arc_length(from: f64, to: f64) -> f64 {
    // Abscissae and weights of Abramowitz and Stegun, table 25.4, n = 5.
    const NODES: [(f64, f64); 3] = [
        (0.0, 0.568_888_888_888_888_9),
        (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
        (0.906_179_845_938_664, 0.236_926_885_056_189_1),
    ];
    let pieces = ((to - from).abs().to_degrees().ceil()).max(1.0);
    let half = 0.5 * (to - from) / pieces;
    let speed = |theta: f64| radius(theta).hypot(radius_slope(theta));
    let mut sum = 0.0;
    for piece in 0..pieces as u32 {
        let middle = from + (2.0 * f64::from(piece) + 1.0) * half;
        sum += NODES[0].1 * speed(middle);
        for (node, weight) in &NODES[1..] {
            sum += weight * (speed(middle - node * half) + speed(middle + node * half));
        }
    }
    sum * half
}

/// Angles (radians) of the ends of `arcs` equal arcs of the first quadrant, both ends included.
#[must_use]
pub fn equal_arcs(arcs: u32) -> Vec<f64> {
    let step = arc_length(0.0, FRAC_PI_2) / f64::from(arcs);
    let mut angles = vec![0.0];
    let mut theta = 0.0;
    for _ in 1..arcs {
        // Newton from the angle a circle would give; the integrand is smooth and far from zero.
        let from = theta;
        theta += step / radius(theta).hypot(radius_slope(theta));
        for _ in 0..50 {
            let miss = arc_length(from, theta) - step;
            theta -= miss / radius(theta).hypot(radius_slope(theta));
            if miss.abs() < 1e-13 {
                break;
            }
        }
        angles.push(theta);
    }
    angles.push(FRAC_PI_2);
    angles
}

/// What is measured at a control point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Control {
    /// Number on the charts, 1 to 11.
    pub number: usize,
    /// Angle, radians.
    pub theta: f64,
    /// The point of the contour, mm.
    pub at: [f64; 2],
    /// Axis whose error counts: 0 for |dx| at the point's y, 1 for |dy| at its x.
    pub measured: usize,
    /// Angles between which its line is looked at, radians: the second quadrant, in which every line crosses the
    /// contour once; an eighth of a turn to both sides of the points on the axes.
    pub window: [f64; 2],
}

/// The control points: |dx| is taken at the y of each, at the first one |dy| at its x (section 3.10).
#[must_use]
pub fn controls() -> [Control; 11] {
    std::array::from_fn(|i| {
        let theta = CONTROL_DEGREES[i].to_radians();
        Control {
            number: i + 1,
            theta,
            at: point(theta),
            measured: usize::from(i == 0),
            window: match i {
                0 | 10 => [theta - FRAC_PI_4, theta + FRAC_PI_4],
                _ => [FRAC_PI_2, PI],
            },
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn the_tightest_hollow_has_the_stated_radius() {
        // Radius of the circle through three points of the contour, 1e-3 radians apart.
        let radius_at = |theta: f64| {
            let [a, b, c] = [-1e-3, 0.0, 1e-3].map(|off| point(theta + off));
            let side = |p: [f64; 2], q: [f64; 2]| (p[0] - q[0]).hypot(p[1] - q[1]);
            let twice_area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            side(a, b) * side(b, c) * side(c, a) / (2.0 * twice_area)
        };
        let hollows = (0..36_000).map(|i| radius_at((f64::from(i) / 100.0).to_radians()));
        // Clockwise circles are hollows of a contour that runs counter-clockwise.
        let tightest = hollows
            .filter(|&radius| radius < 0.0)
            .fold(f64::NEG_INFINITY, f64::max);
        assert!((tightest + HOLLOW_MM).abs() < 1e-4, "{tightest}");
    }

    #[test]
    fn the_contour_has_the_printed_length_and_control_points() {
        assert!((arc_length(0.0, TAU) - PRINTED_LENGTH_MM).abs() < 5e-5);
        // Table 3.10.1.
        let printed = [
            (0.0, 22.0),
            (-3.589, 19.366),
            (-5.158, 16.358),
            (-6.666, 14.296),
            (-10.512, 13.7),
            (-12.728, 12.728),
            (-13.804, 8.794),
            (-14.296, 6.666),
            (-18.489, 4.099),
            (-20.373, 2.863),
            (-22.0, 0.0),
        ];
        for (control, (x, y)) in controls().iter().zip(printed) {
            assert!((control.at[0] - x).abs() < 6e-4, "{control:?}");
            assert!((control.at[1] - y).abs() < 6e-4, "{control:?}");
        }
    }

    #[test]
    fn arcs_are_equal_and_symmetric_about_the_diagonal() {
        let angles = equal_arcs(14);
        let step = arc_length(0.0, TAU) / 56.0;
        for pair in angles.windows(2) {
            assert!((arc_length(pair[0], pair[1]) - step).abs() < 1e-9);
        }
        for (a, b) in angles.iter().zip(angles.iter().rev()) {
            assert!((a + b - FRAC_PI_2).abs() < 1e-9, "{a} {b}");
        }
    }

    #[test]
    fn the_normal_error_of_a_shifted_point_is_its_shift() {
        for i in 0..360 {
            let theta = f64::from(i).to_radians();
            let (a, b) = (point(theta - 1e-5), point(theta + 1e-5));
            let (tx, ty) = (b[0] - a[0], b[1] - a[1]);
            let along = tx.hypot(ty);
            let at = point(theta);
            let moved = [at[0] + 0.01 * ty / along, at[1] - 0.01 * tx / along];
            assert!((normal_error(moved) - 0.01).abs() < 2e-4);
        }
    }
}
