//! Bounds against values of the same polynomials, taken densely in f64.

use proptest::prelude::*;

use super::*;

/// Places along the segment.
const DENSE: usize = 4000;

/// Least and largest value of the first three derivatives, and the sum of the sizes of their terms.
fn dense(curve: &Quintic) -> [[f64; 3]; 3] {
    let mut out = [[f64::INFINITY, f64::NEG_INFINITY, 0.0]; 3];
    for (order, out) in (1_i32..).zip(&mut out) {
        // The n-th derivative of x^k has the factor k (k - 1) .. (k - n + 1).
        let terms: Vec<(f64, i32)> = (1_i32..)
            .zip(curve)
            .filter(|(k, _)| *k >= order)
            .map(|(k, a)| {
                let factor: i32 = (k - order + 1..=k).product();
                (f64::from(*a) * f64::from(factor), k - order)
            })
            .collect();
        for i in 0..=DENSE {
            let x = i as f64 / DENSE as f64 - 0.5;
            let value: f64 = terms.iter().map(|(c, power)| c * x.powi(*power)).sum();
            out[0] = out[0].min(value);
            out[1] = out[1].max(value);
        }
        out[2] = terms
            .iter()
            .map(|(c, power)| c.abs() * 0.5_f64.powi(*power))
            .sum();
    }
    out
}

/// Coefficients of very different size, some of them zero.
fn quintic() -> impl Strategy<Value = Quintic> {
    let coefficient = prop_oneof![
        1 => Just(0.0_f32),
        6 => (-1.0_f32..1.0, -6_i32..3).prop_map(|(x, e)| x * 10.0_f32.powi(e)),
        6 => -1.0_f32..1.0,
    ];
    prop::array::uniform5(coefficient)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4000))]

    /// No value of a derivative is beyond its bounds.
    #[test]
    fn no_peak_of_a_derivative_is_beyond_its_bound(curve in quintic()) {
        let ranges = Ranges::of(&curve);
        for (range, [least, most, _]) in ranges.of.iter().zip(dense(&curve)) {
            prop_assert!(f64::from(range.low) <= least, "{:?}: least is {}", range, least);
            prop_assert!(f64::from(range.high) >= most, "{:?}: largest is {}", range, most);
        }
    }

    /// Beside rounding and what dense values miss themselves, the second and third derivative reach their bounds; the first
    /// comes within a thousandth of its largest size.
    #[test]
    fn bounds_of_derivatives_are_nearly_reached(curve in quintic()) {
        let ranges = Ranges::of(&curve);
        for (order, (range, [least, most, terms])) in ranges.of.iter().zip(dense(&curve)).enumerate() {
            let loose = [1e-3, 0.0, 0.0][order] * least.abs().max(most.abs());
            let slack = loose + 3e-6 * terms;
            prop_assert!(f64::from(range.low) >= least - slack, "{:?}: least is {}", range, least);
            prop_assert!(f64::from(range.high) <= most + slack, "{:?}: largest is {}", range, most);
        }
    }
}
