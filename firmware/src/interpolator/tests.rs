//! The interpolator's arithmetic against wide integers and against the plain formula.

use proptest::prelude::*;

use super::*;
use crate::config::tests::test_config;
use crate::geometry::arc::ArcSplitter;
use crate::geometry::HermiteSegment;
use crate::units::Steps;

/// Numbers of every size, and the ends of the range.
fn any_size() -> impl Strategy<Value = i64> {
    prop_oneof![
        (any::<i64>(), 0_u32..64).prop_map(|(x, shift)| x >> shift),
        prop::sample::select(vec![i64::MIN, i64::MIN + 1, -1, 0, 1, i64::MAX]),
        // Halves at their limits, where a carry would be lost.
        (0_usize..4, 0_usize..4).prop_map(|(high, low)| {
            let half = [0_u64, 1, 0x8000_0000, 0xffff_ffff];
            (half[high] << 32 | half[low]) as i64
        }),
    ]
}

/// Segments of a curve to `end` (steps) whose end slopes are the chord times a factor per axis.
fn segments(end: [i32; AXES], factors: [[f32; AXES]; 2]) -> Vec<ServoSegment> {
    let config = test_config();
    let [slope_start, slope_end] = factors.map(|factor| {
        core::array::from_fn(|a| end[a] as f32 * config.units_per_step(a) * factor[a])
    });
    let segment = HermiteSegment {
        start: [Steps::ZERO; AXES],
        end: end.map(Steps::from_num),
        slope_start,
        slope_end,
    };
    let mut splitter = ArcSplitter::new();
    let mut out = Vec::new();
    splitter.push(&config, &segment, 1).unwrap();
    while let Some((segment, _)) = splitter.next(&config).unwrap() {
        out.push(segment);
    }
    out
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn a_product_is_the_floor_of_the_exact_one(a in any_size(), b in any_size()) {
        let b = b as u64;
        let exact = (i128::from(a) * i128::from(b)) >> 64;
        prop_assert_eq!(i128::from(mul_q(a, b)), exact);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// On both ends of a segment and anywhere in between, u stays in [0, 1) and the position is that of the formula in
    /// the widest integers there are, evaluated with products of Q2.62 numbers.
    #[test]
    fn u_stays_inside_and_the_position_is_that_of_the_formula(
        end in prop::array::uniform5(-300_000_i32..300_000),
        factors in prop::array::uniform2(prop::array::uniform5(0.2_f32..2.5)),
        share in prop::collection::vec(0.0_f64..1.0, 8),
    ) {
        let product = |a: i64, b: i64| ((i128::from(a) * i128::from(b)) >> Q) as i64;
        for segment in segments(end, factors) {
            let inside = share.iter().map(|x| (x * segment.length as f64) as i64);
            let ends = [0, 1, 2, segment.length - 2, segment.length - 1, segment.length];
            for s in inside.chain(ends) {
                let u = parameter(&segment, s);
                prop_assert!((0..1 << Q).contains(&u), "u = {} at {} of {}", u, s, segment.length);
                let (u2, at) = (product(u, u), position(&segment, s));
                let u3 = product(u2, u);
                for (a, found) in at.into_iter().enumerate() {
                    let [a1, a2, a3] = segment.cubic[a];
                    let formula = segment.start[a] + product(a1, u) + product(a2, u2) + product(a3, u3);
                    prop_assert_eq!(found, formula);
                }
            }
        }
    }
}
