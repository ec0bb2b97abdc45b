//! At the corners of the envelope nothing wraps: every result is that of wider integers within the stated rounding, ends
//! are exact; what is beyond the envelope is refused or split.

use pentaspline::config::Config;
use pentaspline::envelope::{
    A_MAX, CURVE_MAX, FINE_MAX, LENGTH_MAX, LENGTH_MIN, POSITION_MAX, SCALE_MAX, STEPS_MAX,
    TRAVEL_MAX, V_MAX,
};
use pentaspline::geometry::arc::{ArcError, ArcSplitter, Driven};
use pentaspline::geometry::HermiteSegment;
use pentaspline::interpolator::braking::{BrakeLimits, Braking};
use pentaspline::interpolator::motion::{Motion, Wide};
use pentaspline::interpolator::segment::{fine_scale, AxisCurve, Place, ServoSegment};
use pentaspline::interpolator::{widen, PathState, S_FRAC};
use pentaspline::stepgen::generator::{emitted, StepGenerator};
use pentaspline::stepgen::SLOTS;
use pentaspline::units::{phase, Steps, AXES, PHASE_FRAC};
use proptest::prelude::*;
use whole_product_tests::drive::{drive, Script};
use whole_product_tests::{examples, laws};

const STEP: f64 = 4_294_967_296.0;

/// A bound with either sign, numbers next to it, next to zero, and any in between.
fn corners(most: i128) -> impl Strategy<Value = i128> {
    let near = (0_i128..3, any::<bool>()).prop_map(move |(k, negative)| {
        let x = most - k;
        if negative {
            -x
        } else {
            x
        }
    });
    let spread = (0_u32..126, any::<i128>())
        .prop_map(move |(shift, x)| (x >> 1 >> shift).clamp(-most, most));
    prop_oneof![near, -1_i128..2, spread]
}

/// A machine with `steps` per unit on every axis.
fn machine(steps: f64) -> Config {
    let mut config = examples::machine().config;
    for axis in &mut config.axes {
        axis.steps_per_unit = Steps::from_num(steps);
    }
    config
}

fn scales() -> impl Strategy<Value = i32> {
    prop_oneof![Just(SCALE_MAX), (17_u32..31).prop_map(|bits| 1 << bits)]
}

/// Lengths from the shortest to the longest.
fn lengths() -> impl Strategy<Value = i64> {
    let any =
        (20_u32..62, any::<i64>()).prop_map(|(bits, x)| (1 << bits) | (x & ((1 << bits) - 1)));
    prop_oneof![
        Just(LENGTH_MIN),
        Just(LENGTH_MIN + 1),
        Just(LENGTH_MAX),
        Just(LENGTH_MAX - 1),
        any
    ]
}

/// Coefficients: slopes to the end of their word, though the splitter makes them of [`TRAVEL_MAX`] steps at most.
fn curves() -> impl Strategy<Value = AxisCurve> {
    let fine = || corners(i128::from(FINE_MAX) - 1).prop_map(|x| x as i32);
    let slope = prop_oneof![
        Just(i32::MIN),
        Just(i32::MAX),
        corners(i128::from(TRAVEL_MAX) << 19).prop_map(|x| x as i32)
    ];
    let base = prop_oneof![Just(i64::MIN), Just(i64::MAX), any::<i64>()];
    (base, slope, [fine(), fine(), fine(), fine(), fine()])
        .prop_map(|(base, slope, fine)| AxisCurve { base, slope, fine })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4000))]

    /// Quintics with the largest coefficients on segments of every length: the polynomial of wider integers, but for four
    /// units of the fine coefficients and six of a phase. Products rounded down lose 1 + 1/2 + 1/4 + 1/8 + 1/16 units; t, rounded
    /// down to 2^-31, moves the sum by 1 + 2/2 + 3/4 + 4/8 + 5/16 times 2^30 units of it at most, 1.8 units; in all below 3.8. On the
    /// end exactly what the constant place of the end gives.
    #[test]
    fn quintics_at_the_corners_do_not_wrap(
        curve in curves(),
        scale in scales(),
        length in lengths(),
        share in 0.0_f64..1.0,
        low in 0_i128..1 << 18,
    ) {
        let segment = ServoSegment::new(1, length, [curve; AXES]);
        prop_assert_eq!(segment.length, length);
        let whole = widen(length);
        for left in [0, 1, low, widen((share * length as f64) as i64), whole - 1, whole] {
            let left = left.clamp(0, whole);
            let found = segment.axes[0].at(&segment.place(Wide::new(left)), scale);
            // t with 63 fractional bits; what slopes see of it is half a unit of the upper word less.
            let t = (left << 45) / i128::from(length) - (1 << 62);
            let straight = (i128::from(curve.slope) * (t - (1 << 31))) >> 32;
            let (mut sum, t) = (0_i128, t >> 23);
            for c in curve.fine.into_iter().rev() {
                sum = ((sum + (i128::from(c) << 40)) * t) >> 40;
            }
            let exact = straight + ((sum * i128::from(scale)) >> 40);
            let off = i128::from(found.wrapping_sub(curve.base)) - exact;
            prop_assert!(off.abs() <= 4 * i128::from(scale) + 6, "{} at {}, scale {}", off, left, scale);
        }
        prop_assert_eq!(segment.place(Wide::new(0)), Place::END);
    }

    /// Ticks at the largest velocity, acceleration and jerk in the longest segment: the sums of wider integers, written in
    /// closed form.
    #[test]
    fn motion_at_the_corners_does_not_wrap(
        v in corners(V_MAX),
        a in corners(A_MAX),
        jerk in corners(i128::from(i64::MAX)),
        length in lengths(),
        ticks in 0_i128..2000,
    ) {
        let jerk = jerk as i64;
        let mut motion = Motion { left: Wide::new(widen(length)), v: Wide::new(v), a: Wide::new(a) };
        for _ in 0..ticks {
            motion.step(jerk);
        }
        let (j, n) = (i128::from(jerk), ticks);
        let velocity = v + n * a + n * (n + 1) / 2 * j;
        let way = n * v + n * (n + 1) / 2 * a + n * (n + 1) * (n + 2) / 6 * j;
        let state = PathState { s: 0, v, a }.after(jerk, ticks as u32);
        prop_assert_eq!(state, Some(PathState { s: way, v: velocity, a: a + n * j }));
        // As long as the numbers are those of a path at all: within the envelope they always are.
        if [velocity, widen(length) - way].iter().all(|x| x.unsigned_abs() < 1 << 95) {
            prop_assert_eq!(motion.a.get(), a + n * j);
            prop_assert_eq!(motion.v.get(), velocity);
            prop_assert_eq!(motion.left.get(), widen(length) - way);
        }
        // One tick from within it never leaves 96 bits.
        let mut once = Motion { left: Wide::new(widen(length)), v: Wide::new(v), a: Wide::new(a) };
        once.step(jerk);
        prop_assert_eq!(once.left.get(), widen(length) - (v + a + j));
    }

    /// Braking from whatever 96 bits hold, with limits from nothing to the largest words: the jerk is kept, the motion never
    /// turns round, and no intermediate result overflows (the tests check additions and products).
    #[test]
    fn braking_at_the_corners_does_not_overflow(
        v in corners((1 << 95) - 1),
        d in corners((1 << 95) - 1),
        a in prop_oneof![Just(0_u32), Just(1), Just(u32::MAX), any::<u32>()],
        j in prop_oneof![Just(0_u32), Just(1), Just(u32::MAX), any::<u32>()],
    ) {
        let (mut v, mut d) = (v.abs(), d);
        let braking = Braking::new(&BrakeLimits { a, j, ..Default::default() }, v, d);
        for _ in 0..300 {
            if v == 0 {
                break;
            }
            let next = braking.next(v, d);
            prop_assert!(next <= v, "{} of {}", next, v);
            v -= next;
            d = next;
            if v >= 1 << 95 {
                // A motion that gathers speed out of 96 bits is none.
                break;
            }
        }
    }

    /// Steps from the fastest moves a step port carries, and from any below the limit of a phase, at either end of the range
    /// of positions: counts are the rounded positions, edges lie inside the tick in order.
    #[test]
    fn steps_at_the_corners_do_not_wrap(
        start in corners(i128::from(POSITION_MAX)),
        moves in prop::collection::vec(prop_oneof![
            corners(i128::from(STEPS_MAX) << 32),
            corners((1 << 45) - (1 << 32)),
        ], 1..40),
    ) {
        let mut at = start as i64;
        let mut generator = StepGenerator::new([at; AXES], 2, 4);
        for by in moves {
            let next = (i128::from(at) + by).clamp(-i128::from(POSITION_MAX), i128::from(POSITION_MAX));
            let before = i128::from(emitted(at));
            at = next as i64;
            generator.begin();
            (0..AXES).for_each(|a| generator.lead(a, phase(at)));
            let rounded = (next + (1 << 31)) >> 32;
            prop_assert_eq!(i128::from(generator.emitted()[2]), rounded);
            prop_assert_eq!(generator.position()[2], at);
            let edges = generator.frame().copied().unwrap_or_default().axes[2];
            prop_assert_eq!(i128::from(edges.signed_count()), rounded - before);
            let mut slot = 0;
            for k in 0..u64::from(edges.count) {
                let place = u64::from(edges.first) + k * u64::from(edges.pitch);
                prop_assert!(place >= slot && place < u64::from(SLOTS) << 16, "edge {} at {}", k, place);
                slot = place;
            }
        }
    }
}

/// Pulls at most `most` segments and holds each to the envelope; the end of the last, if all came.
fn pieces(
    config: &Config,
    segment: &HermiteSegment,
    most: usize,
) -> Result<Option<[Steps; AXES]>, String> {
    let mut splitter = ArcSplitter::new();
    splitter
        .push(config, segment, 1)
        .map_err(|e| e.to_string())?;
    let scale = fine_scale(config);
    // Where a line turns back, each of its three parts may be too short to be driven.
    let dropped = config.axes.map(|axis| {
        let shortest = LENGTH_MIN as f64 / (1_i64 << S_FRAC) as f64;
        (3.0 * shortest * axis.steps_per_unit.to_num::<f64>() * (PHASE_FRAC as f64).exp2()).ceil()
            as i64
    });
    let mut before = segment.start.map(|x| phase(x.to_bits()));
    let mut last = None;
    for _ in 0..most {
        let driven = match splitter.next(config) {
            Ok(Some(driven)) => driven,
            Ok(None) => return Ok(last.or(Some(segment.start))),
            // A curve may have a cusp; that is a refusal, too.
            Err(ArcError::Cusp) => return Ok(None),
            Err(other) => return Err(format!("while splitting: {other}")),
        };
        let Driven { segment, end, .. } = driven;
        if !(LENGTH_MIN..=LENGTH_MAX).contains(&segment.length) {
            return Err(format!("length {}", segment.length));
        }
        let (start, stop) = (segment.start(&scale), segment.end(&scale));
        for a in 0..AXES {
            let curve = &segment.axes[a];
            let bits = end[a].to_bits();
            if bits.unsigned_abs() > POSITION_MAX as u64 {
                return Err(format!("axis {a} at {bits}"));
            }
            if curve
                .fine
                .iter()
                .any(|c| c.unsigned_abs() >= FINE_MAX as u32)
            {
                return Err(format!("axis {a}: {:?}", curve.fine));
            }
            if stop[a] != phase(bits) {
                return Err(format!(
                    "axis {a} ends {} off",
                    stop[a].wrapping_sub(phase(bits))
                ));
            }
            let gap = start[a].wrapping_sub(before[a]);
            if gap.abs() > 3 * i64::from(scale[a]) + 6 + dropped[a] {
                return Err(format!("axis {a} starts {gap} off, scale {}", scale[a]));
            }
        }
        (before, last) = (stop, Some(end));
    }
    Ok(None)
}

fn inside() -> impl Strategy<Value = i64> {
    corners(i128::from(POSITION_MAX)).prop_map(|x| x as i64)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// Lines and curves anywhere in the range of positions, up to the longest, on machines from the coarsest to the finest:
    /// refused as out of range, or made into segments that stay in the envelope, meet, and end exactly.
    #[test]
    fn curves_at_the_corners_are_split_or_refused(
        start in prop::array::uniform5(inside()),
        delta in prop::array::uniform5(corners(i128::from(CURVE_MAX) << 32)),
        factors in prop::array::uniform2(prop::array::uniform5(prop_oneof![Just(1.0_f32), -3.0_f32..3.0])),
        straight in any::<bool>(),
        small in 0_u32..50,
        steps in prop_oneof![Just(1000.0), (-32.0_f64..24.0).prop_map(f64::exp2)],
    ) {
        let config = machine(steps);
        let end: [i64; AXES] = core::array::from_fn(|a| start[a].saturating_add((delta[a] >> small) as i64));
        let slope = |k: usize| core::array::from_fn(|a| {
            let chord = (i128::from(end[a]) - i128::from(start[a])) as f64 / STEP / steps;
            chord as f32 * if straight { 1.0 } else { factors[k][a] }
        });
        let segment = HermiteSegment {
            start: start.map(Steps::from_bits),
            end: end.map(Steps::from_bits),
            slope_start: slope(0),
            slope_end: slope(1),
        };
        match pieces(&config, &segment, 300) {
            Ok(None) => {}
            Ok(Some(last)) => {
                for a in 0..AXES {
                    // Lines of no length are dropped, less than 2^-34 units each.
                    let off = (i128::from(last[a].to_bits()) - i128::from(end[a])).unsigned_abs();
                    prop_assert!(off as f64 / STEP / steps < 1e-9, "axis {} ends {} off", a, off);
                }
            }
            Err(refused) => prop_assert_eq!(refused, ArcError::Range.to_string()),
        }
    }

    /// What is beyond the envelope in one axis is refused: too far, too steep, not a number, or bulging out of the range.
    #[test]
    fn curves_beyond_the_envelope_are_refused(axis in 0..AXES, way in 0..7, down in any::<bool>()) {
        let config = machine(1000.0);
        let mut segment = HermiteSegment {
            start: [Steps::ZERO; AXES],
            end: [Steps::from_num(1000); AXES],
            slope_start: [1.0; AXES],
            slope_end: [1.0; AXES],
        };
        let sign = if down { -1 } else { 1 };
        match way {
            0 => segment.end[axis] = Steps::from_bits(sign * (CURVE_MAX << 32)),
            1 => segment.slope_start[axis] = sign as f32 * 268_436.0,
            2 => segment.slope_end[axis] = f32::NAN,
            3 => segment.slope_end[axis] = sign as f32 * f32::INFINITY,
            4 => {
                segment.start[axis] = Steps::from_bits(sign * (POSITION_MAX - (1 << 40)));
                segment.end[axis] = segment.start[axis];
                // A third of 1000 mm is 333,333 steps, the end of the range 256 away.
                segment.slope_start[axis] = sign as f32 * 1000.0;
            }
            5 => {
                segment.start[axis] = Steps::from_bits(sign * POSITION_MAX);
                segment.end[axis] = Steps::from_bits(sign * (POSITION_MAX + 1));
            }
            _ => {
                segment.start[axis] = Steps::MIN;
                segment.end[axis] = Steps::MAX;
            }
        }
        prop_assert_eq!(ArcSplitter::new().push(&config, &segment, 1), Err(ArcError::Range));
    }
}

/// Twice 40 m/min at 1 um per step: 266.7 steps per tick, over every part of the travel; the steps are those of the
/// commanded positions, and the machine stands on the programmed point.
#[test]
fn twice_the_fastest_feed_makes_every_step() {
    let mut config = machine(1000.0);
    for axis in &mut config.axes {
        axis.v_max = 1_333.333;
        (axis.a_max, axis.j_max) = (20_000.0, 2.0e6);
    }
    let text = "G64 SOFT G1 F80000 X490\nX-490 Y390 Z-290\nG0 X490 Y-390 Z290\nX0 Y0 Z0\nM30\n";
    let run = drive(&config, &Script::new(text));
    assert!(run.finished, "{}", run.output);
    laws::emits_exactly_the_commanded_steps(&run).unwrap();
    laws::ends_exactly_on(&run, &[0; AXES]).unwrap();
    let fastest = run
        .ticks
        .windows(2)
        .map(|t| (t[1].summed[0] - t[0].summed[0]).abs());
    assert!(fastest.max() >= Some(266), "the feed was not reached");
}

/// Hostile programs: numbers at and beyond every limit are refused with an error; the machine stays where it was, or within
/// its travel.
#[test]
fn programs_beyond_the_envelope_are_refused() {
    let mut config = machine(1000.0);
    for axis in &mut config.axes {
        (axis.travel_min, axis.travel_max) = (-2_147_483_000_000, 2_147_483_000_000);
    }
    let far = [
        "G0 X2147484",
        "G0 X-2147484",
        "G0 X99999999",
        "G0 X9223372036",
        "G0 X1E30",
        "G0 X268436",
        "G91 G0 X2147483\nX2147483",
        "G1 F1000 X2147483.647 Y-2147483.647",
        "G2 F1000 X10 I1000000 J99999999",
        "G2 F1000 X2000000 CR=1000000.5",
        "POLY PO[X]=(10,99999999,-99999999) PO[Y]=(1)",
        "POLY PO[X]=(2147483,1E9,1E9)",
        "CSPLINE X1000000 Y1\nX-1000000 Y2\nX2000000 Y3\nX0",
        "ASPLINE X2147483\nX-2147483\nX2147483\nX0",
        "BSPLINE X2147483 PW=3\nX-2147483 PW=0.001\nX2147483\nX0\nX1",
        "G1 F1E30 X1",
        "G93 F1E-30 X1",
        "G1 F0.0000001 X100000000",
    ];
    for text in far {
        let program = format!("SOFT F1000\n{text}\nM30\n");
        let run = drive(
            &config,
            &Script {
                limit: 30_000,
                ..Script::new(&program)
            },
        );
        laws::emits_exactly_the_commanded_steps(&run)
            .unwrap_or_else(|broken| panic!("{text}: {broken}"));
        for pair in run.ticks.windows(2) {
            for a in 0..AXES {
                let moved = i128::from(pair[1].commanded[a]) - i128::from(pair[0].commanded[a]);
                assert!(
                    moved.unsigned_abs() < u128::from(STEPS_MAX) << 32,
                    "{text}: axis {a} moves {moved} in a tick"
                );
            }
        }
        let refused = run.remarks().any(|line| line.starts_with("error:"));
        assert!(
            refused || !run.finished || run.moving() > 0,
            "{text}: neither refused nor run"
        );
    }
}
