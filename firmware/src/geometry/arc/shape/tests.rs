//! Lines against values of the same polynomials, taken densely in f64.

use proptest::prelude::*;

use super::*;

/// Places along the segment.
const DENSE: usize = 2000;

/// The furthest that each of the first three derivatives is from its line.
fn furthest(curve: &Quintic, middle: &[f32; 4]) -> [f64; 3] {
    core::array::from_fn(|n| {
        // The n-th derivative of x^k has the factor k (k - 1) .. (k - n + 1).
        let order = n as i32 + 1;
        let terms: Vec<(f64, i32)> = (1_i32..)
            .zip(curve)
            .filter(|(k, _)| *k >= order)
            .map(|(k, a)| {
                let factor: i32 = (k - order + 1..=k).product();
                (f64::from(*a) * f64::from(factor), k - order)
            })
            .collect();
        let places = (0..=DENSE).map(|i| i as f64 / DENSE as f64 - 0.5);
        let far = places.map(|x| {
            let value: f64 = terms.iter().map(|(c, power)| c * x.powi(*power)).sum();
            (value - f64::from(middle[n]) - f64::from(middle[n + 1]) * x).abs()
        });
        far.fold(0.0, f64::max)
    })
}

/// Coefficients of very different size, some of them zero.
fn coefficient() -> impl Strategy<Value = f32> {
    prop_oneof![
        1 => Just(0.0_f32),
        6 => (-1.0_f32..1.0, -6_i32..3).prop_map(|(x, e)| x * 10.0_f32.powi(e)),
        6 => -1.0_f32..1.0,
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// No derivative is further from its line than it says, and the lines of a curve of one term are as close as they can be.
    #[test]
    fn derivatives_are_as_far_from_their_lines_as_they_say(
        curve in prop::array::uniform5(coefficient()),
        term in 0..5_usize,
    ) {
        let lines = Lines::of(&curve);
        for (off, far) in lines.off.iter().zip(furthest(&curve, &lines.middle)) {
            prop_assert!(far <= f64::from(*off), "{far} from the line, {off} said");
        }
        let mut single = Quintic::default();
        single[term] = curve[term];
        let lines = Lines::of(&single);
        for (off, far) in lines.off.iter().zip(furthest(&single, &lines.middle)) {
            let rounding = 2.0e-4 * f64::from(curve[term].abs());
            prop_assert!(f64::from(*off) <= 1.001 * far + rounding, "{far} from the line, {off} said");
        }
    }

    /// Over a part of the segment no derivative is beyond what the planner keeps of its line.
    #[test]
    fn what_the_planner_keeps_contains_the_derivatives(
        curve in prop::array::uniform5(coefficient()),
        length in 0.001_f32..100.0,
        lefts in prop::array::uniform2(0.0_f32..=1.0),
        within in 0.0_f64..=1.0,
    ) {
        use crate::planner::limits::{CurveLimits, Part};
        let mut curves = [Quintic::default(); AXES];
        curves[3] = curve;
        let (shape, _) = PathShape::of(&curves, length, &[true; AXES], &[[[0.0; AXES]; 2]; 2]);
        let limits = CurveLimits::new(&shape, length, 1.0);
        let Some(kept) = limits.of_axis(3, Part::between(length, lefts.map(|left| left * length))) else {
            prop_assert_eq!(curve, Quintic::default());
            return Ok(());
        };
        let [from, to] = lefts.map(f64::from);
        let x = 0.5 - (from + within * (to - from));
        for (order, [middle, half]) in (1_i32..).zip(kept) {
            let mut value = 0.0;
            let mut size = 0.0;
            for (k, a) in (1_i32..).zip(curve).filter(|(k, _)| *k >= order) {
                let factor: i32 = (k - order + 1..=k).product();
                let term = f64::from(a) * f64::from(factor) * x.powi(k - order);
                value += term;
                size += f64::from(a).abs() * f64::from(factor);
            }
            let per = f64::from(length).powi(-order);
            let far = (value * per - f64::from(middle)).abs();
            prop_assert!(far <= f64::from(half) + 2e-6 * size * per, "{far} off, {half} said");
        }
    }
}
