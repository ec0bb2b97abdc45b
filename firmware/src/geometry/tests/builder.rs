//! Mixtures: where splines begin and end, blocks without motion, bad input.

use super::support::*;
use crate::geometry::{GeometryErrorKind, SegmentBuilder};
use crate::nc::command::{
    Arc, BoundaryCondition, Centre, CubicBlock, FeedType, Motion, Move, Plane, Polynomial,
    SplineKind, SplineSpec,
};
use crate::units::{Steps, AXES};
use proptest::prelude::*;

const AUTO: BoundaryCondition = BoundaryCondition::NotAKnot;
const TANGENT: BoundaryCondition = BoundaryCondition::Tangent;

fn xy(x: f64, y: f64) -> Point {
    [x, y, 0.0, 0.0, 0.0]
}

fn of(kind: SplineKind, end: BoundaryCondition) -> Motion {
    Motion::Spline(spec(kind, AUTO, end))
}

#[test]
fn a_line_is_its_chord_and_rapid_has_no_feed() {
    let blocks = [
        block(1, Motion::Linear, &[1.0, -2.0, 3.0, 4.0, 0.0]),
        block(2, Motion::Rapid, &[2.0, -2.0, 3.0, 4.0, 0.0]),
    ];
    let path = run(&[0.0; AXES], &blocks).unwrap();
    assert_eq!(path[0].segment.slope_start, [1.0, -2.0, 3.0, 4.0, 0.0]);
    assert_eq!(path[0].segment.slope_end, path[0].segment.slope_start);
    assert_eq!(path[0].feed, 10.0);
    assert_eq!(path[1].feed, f32::INFINITY);
}

#[test]
fn one_chord_without_a_condition_that_needs_more_is_a_line() {
    for kind in [SplineKind::Akima, SplineKind::Cubic] {
        let path = run(
            &[0.0; AXES],
            &[
                block(1, Motion::Linear, &xy(1.0, 0.0)),
                block(
                    2,
                    Motion::Spline(spec(kind, TANGENT, TANGENT)),
                    &xy(4.0, 4.0),
                ),
                block(3, Motion::Linear, &xy(9.0, 4.0)),
            ],
        )
        .unwrap();
        assert_eq!(path[1].segment.slope_start, [3.0, 4.0, 0.0, 0.0, 0.0]);
        assert_eq!(path[1].segment.slope_end, [3.0, 4.0, 0.0, 0.0, 0.0]);
    }
}

#[test]
fn a_spline_needs_its_points_when_it_ends_and_not_before() {
    let natural = BoundaryCondition::Natural;
    let of_degree = |degree| SplineSpec {
        degree,
        ..spec(SplineKind::BSpline, AUTO, AUTO)
    };
    let cases = [
        (spec(SplineKind::Akima, AUTO, natural), 3),
        (spec(SplineKind::Akima, natural, AUTO), 3),
        (spec(SplineKind::Akima, natural, TANGENT), 2),
        (spec(SplineKind::Cubic, AUTO, natural), 3),
        (spec(SplineKind::Cubic, natural, AUTO), 3),
        (spec(SplineKind::Cubic, TANGENT, natural), 2),
        (of_degree(2), 3),
        (of_degree(3), 4),
    ];
    for (spec, least) in cases {
        for ended_by_block in [true, false] {
            let config = config();
            let mut builder = SegmentBuilder::new(&config, [Steps::ZERO; AXES]);
            assert!(builder.can_finish());
            // The start is one point.
            for got in 2..=least + 1 {
                let at = xy(f64::from(got), f64::from(got % 3));
                builder
                    .push(&config, &block(got.into(), Motion::Spline(spec), &at))
                    .unwrap();
                while builder.next(&config).is_some() {}
                assert_eq!(builder.can_finish(), got >= least, "{spec:?}");
            }
            let short = least - 1;
            builder.reset([Steps::ZERO; AXES]);
            for got in 2..=short {
                let at = xy(f64::from(got), f64::from(got % 3));
                builder
                    .push(&config, &block(got.into(), Motion::Spline(spec), &at))
                    .unwrap();
            }
            if short < 2 {
                continue;
            }
            let error = if ended_by_block {
                builder.push(&config, &block(99, Motion::Linear, &xy(90.0, 0.0)))
            } else {
                builder.finish(&config)
            }
            .unwrap_err();
            assert_eq!(
                error.kind,
                GeometryErrorKind::TooFewPoints { least, got: short }
            );
            assert_eq!(error.block, u32::from(short));
        }
    }
}

#[test]
fn selecting_a_spline_again_begins_another_one() {
    for kind in [SplineKind::Akima, SplineKind::Cubic] {
        let natural = BoundaryCondition::Natural;
        let blocks = |again: u32| -> Vec<Move> {
            (1..9)
                .map(|k| {
                    let spec = SplineSpec {
                        first: k == 1 || k == again,
                        ..spec(kind, natural, natural)
                    };
                    block(k, Motion::Spline(spec), &xy(f64::from(k), f64::from(k % 3)))
                })
                .collect()
        };
        let whole = run(&[0.0; AXES], &blocks(5)).unwrap();
        let first = run(&[0.0; AXES], &blocks(5)[..4]).unwrap();
        let second = run(&xy(4.0, 1.0), &blocks(5)[4..]).unwrap();
        let apart: Vec<_> = first.into_iter().chain(second).collect();
        assert_eq!(whole, apart);
        assert_ne!(whole, run(&[0.0; AXES], &blocks(1)).unwrap());
    }
}

#[test]
fn axes_outside_the_spline_path_go_linearly_between_points() {
    for kind in [SplineKind::Akima, SplineKind::Cubic] {
        let points: Vec<Point> = (0..40)
            .map(|k| {
                let x = f64::from(k);
                [x, (x * 0.9).sin(), (x * 1.3).cos(), x * x / 100.0, -x]
            })
            .collect();
        let all = spline(&points, spec(kind, AUTO, AUTO));
        let some = spline(
            &points,
            SplineSpec {
                axes: 0b01011,
                ..spec(kind, AUTO, AUTO)
            },
        );
        hits_knots(&points, &some);
        for (k, (with, without)) in some.iter().zip(&all).enumerate() {
            for u in [0.2, 0.5, 0.9] {
                let [at, ..] = evaluate(&with.segment, u);
                let [whole, ..] = evaluate(&without.segment, u);
                for axis in 0..AXES {
                    let want = if [2, 4].contains(&axis) {
                        points[k][axis] + u * (points[k + 1][axis] - points[k][axis])
                    } else {
                        whole[axis]
                    };
                    assert!((at[axis] - want).abs() < 1e-6, "axis {axis} of {k}");
                }
            }
        }
    }
}

#[test]
fn splines_and_arcs_meet_in_one_tangent() {
    // Half a circle about (5, 0) with splines before and behind it.
    let arc = Motion::Arc(Arc {
        plane: Plane::Xy,
        clockwise: true,
        centre: Centre::Point([5_000_000, 0]),
        turns: 0,
    });
    for kind in [SplineKind::Akima, SplineKind::Cubic] {
        let motion = Motion::Spline(spec(kind, TANGENT, TANGENT));
        let blocks = [
            block(1, motion, &xy(-3.0, -5.0)),
            block(2, motion, &xy(0.0, 0.0)),
            block(3, arc, &xy(10.0, 0.0)),
            block(4, motion, &xy(13.0, -5.0)),
            block(5, motion, &xy(20.0, -4.0)),
        ];
        let path = run(&xy(-7.0, -5.0), &blocks).unwrap();
        assert!(path.len() > 6);
        is_tangent_continuous(&path, 1e-6);
    }
}

#[test]
fn a_stop_without_motion_is_told_to_whoever_has_the_segment() {
    let config = config();
    let mut builder = SegmentBuilder::new(&config, [Steps::ZERO; AXES]);
    let push = |builder: &mut SegmentBuilder, exact_stop, at| {
        let mut block = block(1, Motion::Linear, &at);
        block.exact_stop = exact_stop;
        builder.push(&config, &block).unwrap();
        core::iter::from_fn(|| builder.next(&config)).count()
    };
    assert_eq!(push(&mut builder, true, xy(1.0, 0.0)), 1);
    assert!(!builder.take_stop());
    assert_eq!(push(&mut builder, false, xy(1.0, 0.0)), 0);
    assert!(!builder.take_stop());
    assert_eq!(push(&mut builder, true, xy(1.0, 0.0)), 0);
    assert!(builder.take_stop());
    assert!(!builder.take_stop());
}

#[test]
fn another_spline_kind_ends_a_spline() {
    let kinds = [
        SplineKind::Akima,
        SplineKind::Cubic,
        SplineKind::BSpline,
        SplineKind::Akima,
    ];
    let mut blocks = Vec::new();
    let mut points = vec![[0.0; AXES]];
    for k in 0..24_u32 {
        let at = xy(f64::from(k) + 1.0, f64::from(k * k % 7));
        points.push(at);
        blocks.push(block(k + 1, of(kinds[k as usize / 6], AUTO), &at));
    }
    let path = run(&[0.0; AXES], &blocks).unwrap();
    joins_exactly(&steps(&config(), &[0.0; AXES]), &path);
    for end in [6, 12, 18, 24] {
        let last = path.iter().rfind(|segment| segment.block <= end).unwrap();
        assert_eq!(last.segment.end, steps(&config(), &points[end as usize]));
    }
}

#[test]
fn exact_stop_counts_at_its_knot() {
    for kind in [SplineKind::Akima, SplineKind::Cubic] {
        let mut blocks: Vec<Move> = (1..50)
            .map(|k| block(k, of(kind, AUTO), &xy(f64::from(k), f64::from(k % 3))))
            .collect();
        blocks[20].exact_stop = true;
        for path in run(&[0.0; AXES], &blocks).unwrap() {
            assert_eq!(path.exact_stop, path.block == 21);
        }
    }
}

#[test]
fn a_coincident_knot_makes_no_segment_and_leaves_its_stop() {
    for kind in [SplineKind::Akima, SplineKind::Cubic] {
        let mut blocks: Vec<Move> = (1..10)
            .map(|k| block(k, of(kind, AUTO), &xy(f64::from(k), f64::from(k % 3))))
            .collect();
        let plain = run(&[0.0; AXES], &blocks).unwrap();
        let mut again = blocks[4];
        again.exact_stop = true;
        blocks.insert(5, again);
        let path = run(&[0.0; AXES], &blocks).unwrap();
        assert_eq!(path.len(), plain.len());
        for (with, without) in path.iter().zip(&plain) {
            assert_eq!(with.segment, without.segment);
            assert_eq!(with.exact_stop, with.block == 5);
        }
    }
}

#[test]
fn end_tangent_waits_for_the_next_block_that_moves() {
    for kind in [SplineKind::Akima, SplineKind::Cubic] {
        let mut blocks: Vec<Move> = (1..6)
            .map(|k| block(k, of(kind, TANGENT), &xy(f64::from(k), f64::from(k % 2))))
            .collect();
        blocks.push(block(6, Motion::Linear, &xy(5.0, 1.0)));
        blocks.push(block(7, Motion::Linear, &xy(5.0, 3.0)));
        let path = run(&[0.0; AXES], &blocks).unwrap();
        assert_eq!(path.len(), 6);
        is_tangent_continuous(&path[4..], 1e-6);
    }
}

#[test]
fn begin_tangent_follows_whatever_came_before() {
    let mut blocks: Vec<Move> = (1..8)
        .map(|k| {
            block(
                k,
                of(SplineKind::BSpline, AUTO),
                &xy(f64::from(k), f64::from(k % 3)),
            )
        })
        .collect();
    for k in 8..16 {
        let motion = Motion::Spline(spec(SplineKind::Cubic, TANGENT, AUTO));
        blocks.push(block(k, motion, &xy(f64::from(k), f64::from(k % 3))));
    }
    is_tangent_continuous(&run(&[0.0; AXES], &blocks).unwrap(), 1e-5);
}

#[test]
fn a_refused_block_leaves_the_spline_to_be_finished() {
    let config = config();
    let mut builder = SegmentBuilder::new(&config, [Steps::ZERO; AXES]);
    for k in 1..6_u32 {
        let at = xy(f64::from(k), f64::from(k % 3));
        builder
            .push(&config, &block(k, of(SplineKind::Cubic, AUTO), &at))
            .unwrap();
    }
    let mut bad = block(6, Motion::Linear, &xy(6.0, 0.0));
    bad.feed = 0.0;
    assert_eq!(
        builder.push(&config, &bad).unwrap_err().kind,
        GeometryErrorKind::Feed
    );
    assert!(builder.is_open());
    builder.finish(&config).unwrap();
    let count = core::iter::from_fn(|| builder.next(&config)).count();
    assert_eq!(count, 5);
    assert_eq!(builder.position(), steps(&config, &xy(5.0, 2.0)));
}

#[test]
fn segments_must_be_drained_first() {
    let config = config();
    let mut builder = SegmentBuilder::new(&config, [Steps::ZERO; AXES]);
    builder
        .push(&config, &block(1, Motion::Linear, &xy(1.0, 0.0)))
        .unwrap();
    let error = builder
        .push(&config, &block(2, Motion::Linear, &xy(2.0, 0.0)))
        .unwrap_err();
    assert_eq!(
        (error.block, error.kind),
        (2, GeometryErrorKind::NotDrained)
    );
    assert_eq!(
        error.to_string(),
        "line 2: the stages of the control disagree about this block"
    );
}

#[test]
fn errors_a_program_can_meet_have_numbers_of_their_own() {
    use GeometryErrorKind as K;
    let code = |kind| crate::geometry::GeometryError { block: 1, kind }.code();
    let mut codes = [
        K::OutOfRange { axis: 0 },
        K::NotFinite,
        K::G6Gap { axis: 0, gap: 0 },
        K::Weight,
        K::ArcRadii { start: 0, end: 0 },
        K::ArcReach { radius: 0, half: 0 },
        K::ArcNoRadius,
        K::ArcPlane { letter: b'Y' },
        K::Denominator,
        K::Steep,
        K::TooFewPoints { least: 0, got: 0 },
        K::ToolVector,
        K::ToolJump,
    ]
    .map(code);
    codes.sort_unstable();
    assert!(codes.windows(2).all(|pair| pair[0] < pair[1]), "{codes:?}");
    assert!(codes.iter().all(|code| (150..170).contains(code)));
    assert_eq!(code(K::Travel { axis: 0 }), 201);
    // The interpreter, or the caller, is to blame.
    for kind in [
        K::Feed,
        K::G6Length,
        K::Degree,
        K::KnotInterval,
        K::NotDrained,
        K::ArcNoChord,
        K::SplineAxes,
    ] {
        assert_eq!(code(kind), 202, "{kind:?}");
    }
}

#[test]
fn messages_name_their_numbers_and_the_letters_of_axes() {
    use GeometryErrorKind as K;
    let radii = K::ArcRadii {
        start: 10_000_000,
        end: 10_012_360,
    };
    assert_eq!(
        radii.to_string(),
        "radius is 10.0000 mm at the start of the arc and 10.0124 mm at its end"
    );
    let gap = K::G6Gap { axis: 4, gap: 2345 };
    assert!(gap.to_string().contains("2345 nm"));
    assert!(gap.to_string().contains("axis 5"));
    assert!(gap.with_letters(&config()).to_string().contains("axis C"));
    let points = K::TooFewPoints { least: 4, got: 2 };
    assert_eq!(
        points.to_string(),
        "the spline needs 4 points, its start among them, and has 2"
    );
}

fn any_arc() -> impl Strategy<Value = Motion> {
    let near = -100_000_000_i64..100_000_000;
    let number = prop_oneof![4 => near, 1 => -3_i64..4, 1 => any::<i64>()];
    let centre = prop_oneof![
        [number.clone(), number.clone()].prop_map(Centre::Point),
        number.prop_map(Centre::Radius),
    ];
    let plane = prop_oneof![Just(Plane::Xy), Just(Plane::Zx), Just(Plane::Yz)];
    (
        plane,
        any::<bool>(),
        centre,
        prop_oneof![3 => Just(0_u16), 1 => 0_u16..4],
    )
        .prop_map(|(plane, clockwise, centre, turns)| {
            Motion::Arc(Arc {
                plane,
                clockwise,
                centre,
                turns,
            })
        })
}

fn any_polynomial() -> impl Strategy<Value = Motion> {
    let number = prop_oneof![4 => -30.0..30.0, 2 => Just(0.0), 1 => any::<f64>()];
    let four = prop::array::uniform4(number.clone());
    (
        prop_oneof![3 => 0.1..10.0, 1 => any::<f64>()],
        any::<u8>(),
        prop::array::uniform5(four.clone()),
        prop_oneof![2 => Just([1.0, 0.0, 0.0, 0.0, 0.0]), 1 => prop::array::uniform5(number)],
    )
        .prop_map(|(length, numerators, coefficients, denominator)| {
            Motion::Polynomial(Polynomial {
                length,
                numerators,
                coefficients,
                denominator,
            })
        })
}

fn any_motion() -> impl Strategy<Value = Motion> {
    let condition = prop_oneof![Just(AUTO), Just(BoundaryCondition::Natural), Just(TANGENT)];
    let kind = prop_oneof![
        Just(SplineKind::Akima),
        Just(SplineKind::BSpline),
        Just(SplineKind::Cubic)
    ];
    let interval = prop_oneof![3 => Just(None), 1 => any::<f32>().prop_map(Some), 2 => (1e-30_f32..1e30).prop_map(Some)];
    prop_oneof![
        1 => Just(Motion::Rapid),
        1 => Just(Motion::Linear),
        8 => (kind, condition.clone(), condition, 2_u8..=3, interval).prop_map(|(kind, begin, end, degree, interval)| {
            Motion::Spline(SplineSpec { degree, interval, ..spec(kind, begin, end) })
        }),
        2 => any_arc(),
        1 => any_polynomial(),
        1 => (any::<i64>(), any::<[i64; 3]>()).prop_map(|(length, k)| Motion::Cubic(CubicBlock { length, k: [k; AXES] })),
    ]
}

fn any_target() -> impl Strategy<Value = [i64; AXES]> {
    prop_oneof![
        4 => prop::array::uniform5(-100_000_000_i64..100_000_000),
        2 => prop::array::uniform5(-2_i64..3),
        1 => prop::array::uniform5(-2_200_000_000_000_i64..2_200_000_000_000),
        1 => prop::array::uniform5(any::<i64>()),
    ]
}

proptest! {
    /// Whatever is sent: no panic, no undefined number, no gap; a refused block moves nothing.
    #[test]
    fn any_program_gives_sound_segments_or_typed_errors(
        program in prop::collection::vec((any_motion(), any_target(), any::<bool>(), any::<bool>()), 1..120),
    ) {
        let config = config();
        let mut at = [Steps::ZERO; AXES];
        let mut builder = SegmentBuilder::new(&config, at);
        for (number, (motion, target, exact_stop, inverse)) in program.into_iter().enumerate() {
            let before = builder.position();
            let block = Move { block: number as u32 + 1, motion, target, feed: 1.0, feed_type: if inverse { FeedType::Inverse } else { FeedType::PerTime }, exact_stop, soft: false, rounding: Default::default(), cutter: Default::default() };
            let result = builder.push(&config, &block);
            if result.is_err() {
                prop_assert_eq!(builder.position(), before);
            }
            while let Some(path) = builder.next(&config) {
                prop_assert_eq!(path.segment.start, at);
                at = path.segment.end;
                let slopes = path.segment.slope_start.iter().chain(&path.segment.slope_end);
                prop_assert!(slopes.copied().all(f32::is_finite));
                prop_assert!(path.block > 0 && path.feed > 0.0);
            }
            if result.is_err() {
                builder.reset(at);
            }
        }
        while builder.is_open() {
            if builder.finish(&config).is_err() {
                return Ok(());
            }
            while let Some(path) = builder.next(&config) {
                prop_assert_eq!(path.segment.start, at);
                at = path.segment.end;
            }
        }
        prop_assert_eq!(at, builder.position());
    }
}
