//! The interrupt's arithmetic against exact integers and against the curve.

use proptest::prelude::*;

use super::motion::{Motion, Wide};
use super::segment::{fine_bits, fine_scale, Place, ServoSegment};
use super::*;
use crate::config::tests::test_config;
use crate::envelope::TRAVEL_MAX;
use crate::geometry::arc::{ArcSplitter, Driven};
use crate::geometry::HermiteSegment;
use crate::units::{phase, Steps, AXES, PHASE_FRAC};

/// Segments of a curve to `end` (steps) whose end slopes are the chord times a factor per axis, and the cubic itself.
fn driven(end: [i32; AXES], factors: [[f32; AXES]; 2]) -> (HermiteSegment, Vec<Driven>) {
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
    while let Some(driven) = splitter.next(&config).unwrap() {
        out.push(driven);
    }
    (segment, out)
}

/// Phases at the way `left` (Q10.54).
fn phases(segment: &ServoSegment, left: i64) -> [i64; AXES] {
    let scale = fine_scale(&test_config());
    let place = segment.place(Wide::new(widen(left)));
    core::array::from_fn(|a| segment.axes[a].at(&place, scale[a]))
}

/// Position of the formula in the widest floats there are, steps from the base.
fn formula(segment: &ServoSegment, axis: usize, left: i64) -> f64 {
    let curve = &segment.axes[axis];
    let t = left as f64 / segment.length as f64 - 0.5;
    let fine = 0.5_f64.powi(fine_bits(&test_config(), axis) as i32);
    // The low word of a place lacks half a unit, which is in the base.
    let mut sum = f64::from(curve.slope) * 0.5_f64.powi(19) * (t - 0.5_f64.powi(32));
    for (k, &c) in (1..).zip(&curve.fine) {
        sum += f64::from(c) * fine * t.powi(k);
    }
    sum
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    /// The interrupt's 96 bits and the background's 128 are the same numbers, and the way left is the rest of the length.
    #[test]
    fn both_sides_run_the_same_motion(
        jerks in prop::collection::vec((-(1_i64 << 52)..1 << 52, 1_u32..300), 1..6),
        v in 0_i128..1 << 70,
        length in 1_i64 << 20..1 << 62,
    ) {
        let mut state = PathState { s: 0, v, a: 0 };
        let mut motion = Motion {
            left: Wide::new(widen(length)),
            v: Wide::new(v),
            a: Wide::default(),
        };
        for (jerk, ticks) in jerks {
            state = state.after(jerk, ticks).unwrap();
            (0..ticks).for_each(|_| motion.step(jerk));
            // Beyond 96 bits both are out of the machine's reach, and the same modulo 2^96.
            prop_assert_eq!(motion.left, Wide::new(widen(length) - state.s));
            prop_assert_eq!(motion.v, Wide::new(state.v));
            prop_assert_eq!(motion.a, Wide::new(state.a));
        }
    }

    /// The place on a segment of any length is the exact share of the way left, rounded down by less than 2^-60; never
    /// as far as the start of the segment before.
    #[test]
    fn the_place_is_the_share_of_the_way_left(
        length in (any::<u64>(), 2_u32..44).prop_map(|(x, shift)| ((x | 1 << 63) >> shift) as i64),
        share in 0.0_f64..1.0,
        low in 0_i128..1 << 18,
    ) {
        let segment = ServoSegment::new(1, length, Default::default());
        let inside = (share * length as f64) as i64;
        for left in [0, 1, inside, length - 1, length] {
            let left = widen(left.clamp(0, length)) + if left == length { 0 } else { low };
            let Place { high, low, fine } = segment.place(Wide::new(left));
            let found = (i128::from(high) << 32) + i128::from(low) + (1 << 31) + (1 << 62);
            let exact = (left << 45) / i128::from(length);
            prop_assert!((exact - 8..=exact).contains(&found), "{} for {}", found, exact);
            prop_assert!(found < 1 << 63);
            prop_assert_eq!(fine, high.wrapping_mul(2));
            prop_assert!(i64::from(high) * 2 == i64::from(fine));
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// On both ends of a segment and anywhere in between the position is that of the formula, but for what 32 bits
    /// truncate: a few units of the fine coefficients. The end is the exact one, and the start the end before.
    #[test]
    fn the_position_is_that_of_the_formula(
        end in prop::array::uniform5(-100_000_i32..100_000),
        factors in prop::array::uniform2(prop::array::uniform5(0.2_f32..2.5)),
        share in prop::collection::vec(0.0_f64..1.0, 8),
    ) {
        let config = test_config();
        let (hermite, pieces) = driven(end, factors);
        let mut before = hermite.start.map(|x| phase(x.to_bits()));
        for Driven { segment, end, .. } in &pieces {
            prop_assert_eq!(phases(segment, 0), end.map(|x| phase(x.to_bits())));
            let inside = share.iter().map(|x| (x * segment.length as f64) as i64);
            for left in inside.chain([1, segment.length - 1, segment.length]) {
                for (a, found) in phases(segment, left).into_iter().enumerate() {
                    let curve = &segment.axes[a];
                    if curve.is_straight() {
                        let place = segment.place(Wide::new(widen(left)));
                        prop_assert_eq!(curve.at_straight(&place, fine_scale(&config)[a]), found);
                    }
                    let unit = 0.5_f64.powi(fine_bits(&config, a) as i32);
                    let moved = found.wrapping_sub(segment.axes[a].base) as f64 * 0.5_f64.powi(PHASE_FRAC as i32);
                    let exact = formula(segment, a, left);
                    let off = exact - moved;
                    // The bits of t that 32 do not hold move it by two units either way, f64 by 4000 steps times 2^-52.
                    let most = 2.0 * unit + 1e-11;
                    prop_assert!((-most..unit + 2.0 * most).contains(&off), "{} units", off / unit);
                }
            }
            for (a, start) in phases(segment, segment.length).into_iter().enumerate() {
                let unit = 1_i64 << (PHASE_FRAC - fine_bits(&config, a));
                prop_assert!(start.wrapping_sub(before[a]).abs() <= 3 * unit, "axis {}", a);
                before[a] = end[a].to_bits();
                before[a] = phase(before[a]);
            }
        }
        prop_assert_eq!(pieces.last().unwrap().end, hermite.end);
    }
}

/// A long line is cut into parts that meet, of one length, and none of more steps than a slope holds.
#[test]
fn a_long_line_comes_in_equal_parts() {
    let (hermite, pieces) = driven([100_001, -33_333, 7, 0, 1], [[1.0; AXES]; 2]);
    assert!(pieces.len() as i32 >= 100_001 / TRAVEL_MAX);
    let mut at = hermite.start;
    for Driven { segment, end, .. } in &pieces {
        assert_eq!(segment.length, pieces[0].segment.length);
        assert!(segment.is_straight());
        assert_eq!(phases(segment, 0), end.map(|x| phase(x.to_bits())));
        for a in 0..AXES {
            let way = (end[a] - at[a]).to_num::<f64>();
            let even = (hermite.end[a] - hermite.start[a]).to_num::<f64>() / pieces.len() as f64;
            assert!((way - even).abs() < 1e-8 && way.abs() <= f64::from(TRAVEL_MAX));
        }
        at = *end;
    }
    assert_eq!(at, hermite.end);
}
