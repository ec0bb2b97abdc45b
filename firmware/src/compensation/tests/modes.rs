//! Approach and retract, what passes unchanged, blocks without motion in the plane, feeds, stops, streaming.

use super::support::*;
use crate::compensation::{CompensationErrorKind, Compensator, Output};
use crate::geometry::PathSegment;
use crate::nc::command::{Auxiliary, Command, Cutter, FeedReference, Plane, Side};

fn inputs(path: &[PathSegment]) -> Vec<Input> {
    path.iter().copied().map(Input::Segment).collect()
}

fn run(start: [f64; 2], path: &[PathSegment]) -> Vec<PathSegment> {
    let (out, error) = run_all(&config(), at(start), &inputs(path));
    assert_eq!(error, None);
    let out = segments(&out);
    joins_exactly(&at(start), &out);
    out
}

fn end(path: &PathSegment) -> [f64; 5] {
    mm(&path.segment.end)
}

#[test]
fn without_compensation_everything_passes_bit_for_bit() {
    let mut path = circle(7.3, 5, Cutter::OFF);
    path[2].exact_stop = true;
    path[3].feed = f32::INFINITY;
    assert_eq!(run([7.3, 0.0], &path), path);
}

#[test]
fn approach_and_retract_are_straight_and_normal() {
    let g41 = cutter(Side::Left, 2.0);
    let path = run(
        [-10.0, 3.0],
        &[
            line(1, [-10.0, 3.0], [0.0, 0.0], g41),
            line(2, [0.0, 0.0], [10.0, 0.0], g41),
            line(3, [10.0, 0.0], [15.0, 7.0], Cutter::OFF),
            line(4, [15.0, 7.0], [20.0, 7.0], Cutter::OFF),
        ],
    );
    let got: Vec<P> = path.iter().map(|s| xy(end(s))).collect();
    assert_eq!(got, [[0.0, 2.0], [10.0, 2.0], [15.0, 7.0], [20.0, 7.0]]);
}

/// Looking for that place takes more evaluations than any joint; [`paced`] watches that they come in small portions.
#[test]
fn before_a_bend_into_the_retract_the_path_ends_where_the_tool_touches_the_end_of_the_contour() {
    let g41 = cutter(Side::Left, 2.0);
    // A quarter of a circle of 0.5 mm.
    let slope = 1.5 * 0.552_284_75;
    let path = run(
        [-5.0, 2.0],
        &[
            line(1, [-5.0, 2.0], [0.0, 0.0], g41),
            line(2, [0.0, 0.0], [20.0, 0.0], g41),
            curve(3, [20.0, 0.0], [20.5, 0.5], [slope, 0.0], [0.0, slope], g41),
            line(4, [20.5, 0.5], [20.5, 9.0], Cutter::OFF),
        ],
    );
    let got: Vec<P> = path.iter().map(|s| xy(end(s))).collect();
    let [first, last, home] = got[..] else {
        panic!("{got:?}");
    };
    assert_eq!((first, home), ([0.0, 2.0], [20.5, 9.0]));
    // 2 mm from (20.5, 0.5), at y = 2; the tool may come half a micrometre closer.
    let x = 20.5 - f64::sqrt(2.0 * 2.0 - 1.5 * 1.5);
    assert!(
        last[1] == 2.0 && (0.0..1.0e-3).contains(&(last[0] - x)),
        "{last:?}"
    );
}

#[test]
fn the_side_changes_on_a_straight_block() {
    let (g41, g42) = (cutter(Side::Left, 2.0), cutter(Side::Right, 2.0));
    let path = run(
        [0.0, 0.0],
        &[
            line(1, [0.0, 0.0], [5.0, 0.0], g41),
            line(2, [5.0, 0.0], [10.0, 0.0], g41),
            line(3, [10.0, 0.0], [20.0, 0.0], g42),
            line(4, [20.0, 0.0], [30.0, 0.0], g42),
        ],
    );
    let got: Vec<P> = path.iter().map(|s| xy(end(s))).collect();
    assert_eq!(got, [[5.0, 2.0], [10.0, 2.0], [20.0, -2.0], [30.0, -2.0]]);
}

#[test]
fn blocks_beside_the_plane_and_commands_keep_their_place_in_corners() {
    let coolant = Command::Auxiliary(Auxiliary::CoolantOn);
    let wait = Command::Dwell { milliseconds: 7 };
    for side in [Side::Left, Side::Right] {
        let g = cutter(side, 2.0);
        let contour = [
            Input::Segment(line(1, [-10.0, 0.0], [0.0, 0.0], g)),
            Input::Segment(line5(2, [0.0; 5], [0.0, 0.0, -5.0, 0.0, 0.0], g)),
            Input::Command(coolant),
            Input::Segment(line5(
                3,
                [0.0, 0.0, -5.0, 0.0, 0.0],
                [20.0, 0.0, -5.0, 0.0, 0.0],
                g,
            )),
            Input::Segment(line5(
                4,
                [20.0, 0.0, -5.0, 0.0, 0.0],
                [20.0, 0.0, -6.0, 0.0, 30.0],
                g,
            )),
            Input::Command(wait),
            Input::Segment(line5(
                5,
                [20.0, 0.0, -6.0, 0.0, 30.0],
                [20.0, 20.0, -6.0, 0.0, 30.0],
                g,
            )),
        ];
        let (out, error) = run_all(&config(), at([-10.0, 0.0]), &contour);
        assert_eq!(error, None);
        let place = |wanted: Command| {
            out.iter()
                .position(|o| *o == Output::Command(wanted))
                .unwrap()
        };
        let block = |k: usize| match out[k] {
            Output::Segment(s) => s,
            Output::Command(_) => panic!("a command"),
        };
        // At the start of the contour.
        let y = if side == Side::Left { 2.0 } else { -2.0 };
        assert_eq!(end(&block(place(coolant) - 1)), [0.0, y, -5.0, 0.0, 0.0]);
        // In the corner: at the crossing inside, before the arc outside.
        let x = if side == Side::Left { 18.0 } else { 20.0 };
        let before = block(place(wait) - 1);
        assert_eq!(before.block, 4);
        assert_eq!(end(&before), [x, y, -6.0, 0.0, 30.0]);
        assert_eq!(before.segment.slope_start[..2], [0.0, 0.0]);
        assert_eq!(block(place(wait) + 1).block, 5);
    }
}

#[test]
fn the_other_axes_arrive_although_the_block_is_shortened() {
    let g41 = cutter(Side::Left, 2.0);
    let path = run(
        [-5.0, 0.0],
        &[
            line(1, [-5.0, 0.0], [0.0, 0.0], g41),
            line5(2, [0.0; 5], [20.0, 0.0, -3.0, 12.0, 0.0], g41),
            line5(
                3,
                [20.0, 0.0, -3.0, 12.0, 0.0],
                [20.0, 20.0, 0.0, 12.0, 9.0],
                g41,
            ),
        ],
    );
    assert_eq!(end(&path[1]), [18.0, 2.0, -3.0, 12.0, 0.0]);
    assert_eq!(end(&path[2]), [18.0, 20.0, 0.0, 12.0, 9.0]);
}

#[test]
fn feeds_refer_to_contour_centre_or_the_smaller() {
    // Circle of 10 mm, tool of 2 mm: 8/10 inside, 12/10 outside.
    for (side, contour_feed, inside_feed) in [(Side::Left, 8.0, 8.0), (Side::Right, 12.0, 10.0)] {
        for (feed, want) in [
            (FeedReference::Contour, contour_feed),
            (FeedReference::Centre, 10.0),
            (FeedReference::Inside, inside_feed),
        ] {
            let mut g = cutter(side, 2.0);
            g.feed = feed;
            for s in contour(&circle(10.0, 8, g)) {
                assert!(
                    (s.feed - want).abs() < 5e-3,
                    "{side:?} {feed:?}: {}",
                    s.feed
                );
            }
        }
    }
    let mut rapid = circle(10.0, 8, cutter(Side::Left, 2.0));
    rapid.iter_mut().for_each(|s| s.feed = f32::INFINITY);
    assert!(contour(&rapid).iter().all(|s| s.feed == f32::INFINITY));
}

#[test]
fn an_exact_stop_is_at_the_last_piece_of_its_block() {
    let mut round = circle(10.0, 4, cutter(Side::Right, 2.0));
    round[1].exact_stop = true;
    let path = contour(&round);
    let stops: Vec<usize> = (0..path.len()).filter(|k| path[*k].exact_stop).collect();
    let last = path.iter().rposition(|s| s.block == 2).unwrap();
    assert_eq!(stops, [last]);
    // Before the arc of an outer corner, which belongs to the next block.
    let mut corner = polyline(
        &[[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]],
        cutter(Side::Right, 2.0),
    );
    corner[0].exact_stop = true;
    let path = contour(&corner);
    let stop = path.iter().position(|s| s.exact_stop).unwrap();
    assert_eq!(xy(end(&path[stop])), [10.0, -2.0]);
    assert!(path[stop + 1..]
        .iter()
        .all(|s| s.block == 2 && !s.exact_stop));
}

#[test]
fn a_pause_is_survived_by_tangents_and_outer_corners_only() {
    let config = config();
    for (side, bend, survives) in [
        (Side::Left, 0.0, true),
        (Side::Left, -5.0, true),
        (Side::Right, -5.0, false),
    ] {
        let g = cutter(side, 2.0);
        let mut c = Compensator::new();
        c.reset(at([-5.0, 0.0]));
        let mut out = Vec::new();
        for s in [
            line(1, [-5.0, 0.0], [0.0, 0.0], g),
            line(2, [0.0, 0.0], [10.0, 0.0], g),
        ] {
            c.push_segment(&config, &s, &mut || {}).unwrap();
            drain(&config, &mut c, &mut out).unwrap();
        }
        c.finish(&config, &mut || {}).unwrap();
        drain(&config, &mut c, &mut out).unwrap();
        assert!(!c.has_pending());
        assert_eq!(segments(&out).len(), 2);
        c.push_segment(&config, &line(3, [10.0, 0.0], [20.0, bend], g), &mut || {})
            .unwrap();
        let result = drain(&config, &mut c, &mut out).and_then(|()| c.finish(&config, &mut || {}));
        if survives {
            result.unwrap();
            drain(&config, &mut c, &mut out).unwrap();
            joins_exactly(&at([-5.0, 0.0]), &segments(&out));
        } else {
            let error = result.unwrap_err();
            assert_eq!(error.block, 3);
            assert!(matches!(
                error.kind,
                CompensationErrorKind::Interrupted { .. }
            ));
        }
    }
}

#[test]
fn a_tool_without_radius_follows_the_contour() {
    let square = polyline(
        &[[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [3.0, 4.0]],
        cutter(Side::Left, 0.0),
    );
    let path = contour(&square);
    let ends: Vec<_> = path.iter().map(|s| s.segment.end).collect();
    let want: Vec<_> = square.iter().map(|s| s.segment.end).collect();
    assert_eq!(ends, want);
}

#[test]
fn the_offset_lies_in_the_plane_of_the_cutter() {
    // G18: Z then X. Along +Z, left of it is +X.
    let mut g = cutter(Side::Left, 2.0);
    g.plane = Plane::Zx;
    let path = run(
        [0.0, 0.0],
        &[
            line5(1, [0.0; 5], [0.0, 0.0, 5.0, 0.0, 0.0], g),
            line5(2, [0.0, 0.0, 5.0, 0.0, 0.0], [0.0, 0.0, 9.0, 0.0, 0.0], g),
        ],
    );
    assert_eq!(end(&path[1]), [2.0, 0.0, 9.0, 0.0, 0.0]);
}

#[test]
fn a_long_contour_streams_and_does_not_depend_on_when_output_is_taken() {
    let points: Vec<P> = (0..200)
        .map(|k| [f64::from(k), f64::from(k % 7) * 0.1])
        .collect();
    let long = polyline(&points, cutter(Side::Left, 0.3));
    let whole = contour(&long);
    touches(&long, &whole, 0.3, 1);
    // As segments are asked for one at a time.
    let config = config();
    let mut c = Compensator::new();
    let mut start = long[0].segment.start;
    start[0] -= crate::units::Steps::from_num(5000);
    start[1] -= crate::units::Steps::from_num(5000);
    c.reset(start);
    let mut out = Vec::new();
    let mut approach = long[0];
    approach.segment.start = start;
    approach.segment.end = long[0].segment.start;
    approach.segment.slope_start = [5.0, 5.0, 0.0, 0.0, 0.0];
    approach.segment.slope_end = [5.0, 5.0, 0.0, 0.0, 0.0];
    let mut waiting = std::iter::once(&approach).chain(&long).peekable();
    let mut early = 0;
    while waiting.peek().is_some() {
        if c.is_full() {
            out.extend(c.next(&config, &mut || {}).unwrap());
        } else {
            c.push_segment(&config, waiting.next().unwrap(), &mut || {})
                .unwrap();
            early = early.max(out.len());
        }
    }
    assert!(early > 100, "it streams");
    c.finish(&config, &mut || {}).unwrap_or_default();
    drain(&config, &mut c, &mut out).unwrap();
    c.finish(&config, &mut || {}).unwrap();
    drain(&config, &mut c, &mut out).unwrap();
    assert_eq!(segments(&out)[1..], whole);
}

#[test]
fn it_fits_into_six_kilobytes() {
    assert!(
        core::mem::size_of::<Compensator>() <= 6144,
        "{}",
        core::mem::size_of::<Compensator>()
    );
}
