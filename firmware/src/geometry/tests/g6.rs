//! `G6` blocks, on the numbers of program 150 (shared `golden/spln150.dat`).

use super::support::*;
use crate::geometry::{GeometryError, GeometryErrorKind, PathSegment};
use crate::nc::command::{CubicBlock, Motion, Move};
use crate::units::AXES;
use proptest::prelude::*;

/// One printed block.
type Printed = (u32, [i64; 3], [i64; 3], [i64; 3]);

/// Block number, X, Y, I in 0.001 mm; K3 K2 K1 of X and of Y. N35 has its lost digit back (printed: Y K7424660).
const PROGRAM_150: [Printed; 10] = [
    (
        25,
        [1_800, 10_200, 2_663],
        [276923492, 49414954, -225794784],
        [38297302, -191418244, -167662809],
    ),
    (
        30,
        [12_400, 10_300, 10_600],
        [11225893, -25162046, -273457996],
        [-48599505, 123939431, -156045],
    ),
    (
        35,
        [18_900, 12_000, 6_719],
        [-8685768, 11719673, -257627379],
        [74242660, -160932804, -35810248],
    ),
    (
        40,
        [25_300, 10_800, 6_512],
        [48726705, -147111344, -208476154],
        [20702915, -173112563, 160909975],
    ),
    (
        45,
        [27_500, 8_000, 3_561],
        [274008336, -574498114, -19668332],
        [-80796360, 25073904, 230708998],
    ),
    (
        50,
        [25_500, 5_000, 3_606],
        [-204549846, -22884017, 238221946],
        [-77085062, 152425968, 186129522],
    ),
    (
        55,
        [18_300, 2_400, 7_655],
        [-3160504, -3442601, 261214535],
        [5298010, 81814280, 5468220],
    ),
    (
        60,
        [10_000, 4_000, 8_453],
        [-607834, 213677, 264656498],
        [20010451, -28047248, -64480693],
    ),
    (
        65,
        [1_900, 5_400, 8_220],
        [-41066769, 164972938, 181672702],
        [-68518720, 256316753, -164935188],
    ),
    (
        70,
        [300, 8_000, 3_053],
        [-424221812, 742351560, -18130880],
        [88108962, 39537514, -267822451],
    ),
];

const START: Point = [0.3, 8.0, 0.0, 0.0, 0.0];

fn program() -> Vec<Move> {
    PROGRAM_150
        .iter()
        .map(|(number, [x, y, length], kx, ky)| {
            let mut k = [[0; 3]; AXES];
            k[0] = *kx;
            k[1] = *ky;
            let cubic = CubicBlock {
                length: length * 1000,
                k,
            };
            let target = [*x as f64 / 1000.0, *y as f64 / 1000.0, 0.0, 0.0, 0.0];
            block(*number, Motion::Cubic(cubic), &target)
        })
        .collect()
}

/// Printed polynomial at i = I (1 - n/16), exact over 2^53 * 16^3, in mm.
fn printed(end: i64, length: i64, [k3, k2, k1]: [i64; 3], n: i64) -> f64 {
    let i = i128::from(length * (16 - n));
    let sum = i128::from(k3) * i * i * i
        + (i128::from(k2) << (12 + 4)) * i * i
        + (i128::from(k1) << (25 + 8)) * i;
    let denominator = 1_i128 << (53 + 12);
    let whole = sum.div_euclid(denominator);
    let part = sum.rem_euclid(denominator) as f64 / denominator as f64;
    ((i128::from(end) + whole) as f64 + part) / 1000.0
}

fn segments() -> Vec<PathSegment> {
    run(&START, &program()).unwrap()
}

#[test]
fn the_path_is_the_printed_polynomial() {
    let segments = segments();
    assert_eq!(segments.len(), PROGRAM_150.len());
    joins_exactly(&steps(&config(), &START), &segments);
    for (path, (number, [x, y, length], kx, ky)) in segments.iter().zip(PROGRAM_150) {
        assert_eq!(path.block, number);
        let end = [x as f64 / 1000.0, y as f64 / 1000.0, 0.0, 0.0, 0.0];
        assert_eq!(path.segment.end, steps(&config(), &end));
        for n in 0..=16 {
            let at = evaluate(&path.segment, f64::from(n) / 16.0)[0];
            let error = (at[0] - printed(x, length, kx, n.into()))
                .hypot(at[1] - printed(y, length, ky, n.into()));
            // 0.5 um per axis of closing error, faded out over the block, and the turned tangent.
            assert!(error < 0.8e-3, "N{number} n {n}: {error}");
        }
    }
}

#[test]
fn joints_are_tangent_though_the_coefficients_are_rounded() {
    is_tangent_continuous(&segments(), 1e-6);
}

#[test]
fn the_misprint_of_n35_is_a_gap() {
    let mut blocks = program();
    let Motion::Cubic(cubic) = &mut blocks[2].motion else {
        unreachable!()
    };
    cubic.k[1][0] = 7_424_660;
    let error = run(&START, &blocks).unwrap_err();
    let GeometryErrorKind::G6Gap { axis, gap } = error.kind else {
        panic!("{error}")
    };
    assert_eq!((error.block, axis), (35, 1));
    assert!((2_240_000..2_260_000).contains(&gap), "{gap}");
}

#[test]
fn a_gap_of_two_micrometres_passes_and_three_do_not() {
    let with = |y: f64| {
        let mut start = START;
        start[1] += y;
        run(&start, &program())
    };
    assert!(with(0.0015).is_ok());
    assert!(with(-0.0015).is_ok());
    let is_gap = |result: Result<_, GeometryError>| {
        matches!(
            result.map(|_: Vec<PathSegment>| ()).unwrap_err().kind,
            GeometryErrorKind::G6Gap { axis: 1, .. }
        )
    };
    assert!(is_gap(with(0.003)) && is_gap(with(-0.003)));
}

#[test]
fn a_real_corner_stays_a_corner() {
    let line = block(20, Motion::Linear, &START);
    let mut blocks = vec![line];
    blocks.extend(program());
    // One degree off the start of the spline.
    let slope = segments()[0].segment.slope_start.map(f64::from);
    let (sin, cos) = 1.0_f64.to_radians().sin_cos();
    let mut start = START;
    start[0] -= cos * slope[0] - sin * slope[1];
    start[1] -= sin * slope[0] + cos * slope[1];
    let path = run(&start, &blocks).unwrap();
    assert_eq!(
        path[1].segment.slope_start,
        segments()[0].segment.slope_start
    );
}

#[test]
fn length_must_be_positive() {
    for length in [0, -1, i64::MIN] {
        let mut blocks = program();
        blocks[0].motion = Motion::Cubic(CubicBlock {
            length,
            k: [[0; 3]; AXES],
        });
        assert_eq!(
            run(&START, &blocks).unwrap_err().kind,
            GeometryErrorKind::G6Length
        );
    }
}

proptest! {
    #[test]
    fn no_numbers_make_it_panic(length in any::<i64>(), k in prop::array::uniform5(prop::array::uniform3(any::<i64>()))) {
        let cubic = block(1, Motion::Cubic(CubicBlock { length, k }), &START);
        let _ = run(&START, &[cubic]);
    }
}
