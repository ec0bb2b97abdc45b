//! Rotary axes led by a second B-spline.
//!
//! The oracle is the vector itself: what the angles of the path make of the head must point along H - P, computed
//! from the Cox-de Boor recursion.

use super::rational::{closest, drive, Nurbs};
use super::support::*;
use crate::config::{Config, Head};
use crate::geometry::{GeometryErrorKind, PathSegment};
use crate::nc::command::Motion;
use crate::nc::{Command, Interpreter};
use crate::units::{Nano, Position, AXES};
use proptest::prelude::*;

type Vector = [f64; 3];

/// Tool vector of the head at these angles, degrees.
fn pointing(head: Head, tilt: f64, turn: f64) -> Vector {
    let (a, c) = (tilt.to_radians(), turn.to_radians());
    match head {
        Head::CA => [a.sin() * c.sin(), -a.sin() * c.cos(), a.cos()],
        _ => [a.sin() * c.cos(), a.sin() * c.sin(), a.cos()],
    }
}

fn with(head: Head) -> Config {
    let mut config = config();
    config.head = head;
    if head == Head::CB {
        config.axes[3].letter = b'B';
    }
    config
}

/// A spline whose tool stands `length` long at these angles over each point.
fn leaning(degree: u8, head: Head, points: &[Vector], angles: &[[f64; 2]], length: f64) -> Nurbs {
    let programmed: Vec<Point> = points
        .iter()
        .zip(angles)
        .map(|(p, _)| [p[0], p[1], p[2], angles[0][0], angles[0][1]])
        .collect();
    let mut nurbs = Nurbs::new(degree, &programmed);
    nurbs.tools = Some(
        points
            .iter()
            .zip(angles)
            .map(|(p, [tilt, turn])| {
                let v = pointing(head, *tilt, *turn);
                core::array::from_fn(|k| p[k] + length * v[k])
            })
            .collect(),
    );
    nurbs
}

fn row(count: usize) -> Vec<Vector> {
    (0..count)
        .map(|k| [10.0 * k as f64, 4.0 * (k % 3) as f64, 1.0])
        .collect()
}

/// Angles of the path at many places, in order.
fn angles(path: &[PathSegment]) -> Vec<[f64; 2]> {
    path.iter()
        .flat_map(|segment| (0..=8).map(|k| evaluate(&segment.segment, f64::from(k) / 8.0)[0]))
        .map(|at| [at[3], at[4]])
        .collect()
}

/// Law: the tool points along H - P everywhere, X Y Z are the first curve, and no angle jumps.
fn leads(nurbs: &Nurbs, head: Head, path: &[PathSegment], tolerance: f64) {
    let vectors: Vec<Point> = nurbs
        .points
        .iter()
        .zip(nurbs.tools.as_ref().unwrap())
        .map(|(p, h)| [h[0] - p[0], h[1] - p[1], h[2] - p[2], 0.0, 0.0])
        .collect();
    let curve = |t: f64| {
        let at = nurbs.at(t);
        [at[0], at[1], at[2], 0.0, 0.0]
    };
    let mut t = 0.0;
    for segment in path {
        for u in [0.0, 0.3, 0.6, 1.0] {
            let at = evaluate(&segment.segment, u)[0];
            let (next, miss) = closest(curve, nurbs.length(), t, &[at[0], at[1], at[2], 0.0, 0.0]);
            assert!(miss < tolerance, "line {}: {miss}", segment.block);
            t = next;
            let v = nurbs.combine(&vectors, t);
            let size = norm(&v);
            let p = pointing(head, at[3], at[4]);
            let off = (0..3)
                .map(|k| (v[k] / size - p[k]).powi(2))
                .sum::<f64>()
                .sqrt();
            // The parameter is known from X Y Z only as well as these are kept.
            assert!(
                off.to_degrees() < 30.0 * tolerance,
                "line {}: {} degrees",
                segment.block,
                off.to_degrees()
            );
        }
    }
    for pair in angles(path).windows(2) {
        for k in 0..2 {
            assert!((pair[1][k] - pair[0][k]).abs() < 45.0, "{pair:?}");
        }
    }
}

fn run(nurbs: &Nurbs, head: Head) -> Result<Vec<PathSegment>, GeometryErrorKind> {
    let mut blocks = nurbs.blocks();
    // What the blocks say about the rotary axes is ignored.
    for block in &mut blocks[1..] {
        block.target[3] = 77_000_000;
        block.target[4] = -5;
    }
    drive(&with(head), &nurbs.points[0], &blocks)
        .map(|(path, position)| {
            if let Some(last) = path.last() {
                assert_eq!(position, last.segment.end);
            }
            path
        })
        .map_err(|error| error.kind)
}

/// Tilt and turn of each vector: the turn goes on from `turn` by the second of each pair of `lean`.
fn turning(mut turn: f64, lean: &[(f64, f64)]) -> Vec<[f64; 2]> {
    lean.iter()
        .map(|(tilt, by)| {
            turn += by;
            [*tilt, turn]
        })
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn the_tool_points_along_the_vector(
        degree in 1_u8..=3,
        ca: bool,
        first in 0.0_f64..360.0,
        lean in prop::collection::vec((15.0_f64..70.0, -40.0_f64..40.0), 7),
        weights in prop::collection::vec(0.5_f32..2.0, 7),
    ) {
        let head = if ca { Head::CA } else { Head::CB };
        let angles = turning(first - 180.0, &lean);
        let nurbs = leaning(degree, head, &row(7), &angles, 100.0).weights(&weights);
        let path = run(&nurbs, head).unwrap();
        leads(&nurbs, head, &path, 1.5e-4);
        let last = path[path.len() - 1].segment;
        let end = evaluate(&last, 1.0)[0];
        prop_assert!((end[3] - angles[6][0]).abs() < 1e-3, "{end:?}");
        prop_assert!((end[4] - angles[6][1]).abs() < 1e-3, "{end:?}");
    }
}

#[test]
fn the_turn_goes_on_beyond_half_a_circle() {
    let angles: Vec<[f64; 2]> = (0..16).map(|k| [30.0, 60.0 * f64::from(k)]).collect();
    let nurbs = leaning(3, Head::CA, &row(16), &angles, 50.0);
    let path = run(&nurbs, Head::CA).unwrap();
    leads(&nurbs, Head::CA, &path, 1.5e-4);
    let end = evaluate(&path[path.len() - 1].segment, 1.0)[0];
    assert!((end[4] - 900.0).abs() < 1e-3, "{end:?}");
    assert!((end[3] - 30.0).abs() < 1e-3, "{end:?}");
}

#[test]
fn across_the_pole_the_turn_stays_and_the_tilt_changes_sign() {
    for head in [Head::CA, Head::CB] {
        let tilts = [25.0, 15.0, 5.0, -5.0, -15.0, -25.0];
        let angles = tilts.map(|tilt| [tilt, 30.0]);
        let nurbs = leaning(3, head, &row(6), &angles, 100.0);
        let path = run(&nurbs, head).unwrap();
        leads(&nurbs, head, &path, 1.5e-4);
        let end = evaluate(&path[path.len() - 1].segment, 1.0)[0];
        assert!((end[3] + 25.0).abs() < 1e-2, "{end:?}");
        for segment in &path {
            for u in [0.0, 0.5, 1.0] {
                let at = evaluate(&segment.segment, u)[0];
                // H is programmed to a nanometre: the vector misses the pole by that much and the turn gives.
                assert!((at[4] - 30.0).abs() < 0.05, "{at:?}");
            }
        }
    }
}

#[test]
fn the_tilt_keeps_the_sign_it_has() {
    let angles = [[-20.0, 10.0], [-25.0, 20.0], [-30.0, 30.0], [-20.0, 40.0]];
    let nurbs = leaning(3, Head::CA, &row(4), &angles, 100.0);
    let path = run(&nurbs, Head::CA).unwrap();
    leads(&nurbs, Head::CA, &path, 1.5e-4);
    let end = evaluate(&path[path.len() - 1].segment, 1.0)[0];
    assert!(
        (end[3] + 20.0).abs() < 1e-3 && (end[4] - 40.0).abs() < 1e-3,
        "{end:?}"
    );
}

#[test]
fn a_vertical_tool_leaves_the_pole_where_its_turn_points() {
    let leave = |start: f64, turn: f64| {
        let angles = [[0.0, start], [8.0, turn], [16.0, turn], [24.0, turn]];
        run(&leaning(3, Head::CA, &row(4), &angles, 100.0), Head::CA)
    };
    let end = |path: Vec<PathSegment>| {
        let at = evaluate(&path[path.len() - 1].segment, 1.0)[0];
        [at[3], at[4]]
    };
    let near = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).abs() < 1e-3 && (a[1] - b[1]).abs() < 1e-3;
    assert!(near(end(leave(40.0, 40.0).unwrap()), [24.0, 40.0]));
    // Half a turn away, the tilt goes the other way.
    assert!(near(end(leave(40.0, 220.0).unwrap()), [-24.0, 40.0]));
    assert_eq!(leave(40.0, 50.0), Err(GeometryErrorKind::ToolJump));
}

#[test]
fn a_vertical_tool_that_stays_vertical_leaves_the_turn() {
    let angles = [[0.0, 33.0]; 5];
    let nurbs = leaning(2, Head::CA, &row(5), &angles, 10.0);
    let path = run(&nurbs, Head::CA).unwrap();
    let end = evaluate(&path[path.len() - 1].segment, 1.0)[0];
    assert_eq!(end[3..], [0.0, 33.0]);
}

#[test]
fn axes_that_are_elsewhere_are_refused() {
    let angles = [[20.0, 10.0], [25.0, 20.0], [30.0, 30.0], [20.0, 40.0]];
    let with = |tilt: f64, turn: f64| {
        let mut nurbs = leaning(3, Head::CA, &row(4), &angles, 100.0);
        nurbs.points[0][3] = tilt;
        nurbs.points[0][4] = turn;
        run(&nurbs, Head::CA)
    };
    assert!(with(20.0, 10.0).is_ok());
    assert!(with(20.009, 9.991).is_ok());
    assert!(
        with(20.0, 370.0).is_ok(),
        "the turn nearest to where the axis is"
    );
    assert!(
        with(-20.0, 190.0).is_ok(),
        "the other way to reach the same vector"
    );
    for (tilt, turn) in [(20.02, 10.0), (20.0, 10.02), (0.0, 0.0), (-20.0, 10.0)] {
        assert_eq!(
            with(tilt, turn),
            Err(GeometryErrorKind::ToolJump),
            "{tilt} {turn}"
        );
    }
}

#[test]
fn a_vector_without_direction_is_refused() {
    let angles = [[20.0, 10.0], [25.0, 20.0], [30.0, 30.0], [20.0, 40.0]];
    let mut nurbs = leaning(3, Head::CA, &row(4), &angles, 100.0);
    assert_eq!(run(&nurbs, Head::None), Err(GeometryErrorKind::ToolVector));
    let p = nurbs.points[2];
    nurbs.tools.as_mut().unwrap()[2] = [p[0], p[1], p[2]];
    assert_eq!(run(&nurbs, Head::CA), Err(GeometryErrorKind::ToolVector));
    // From up to down straight through nothing.
    let mut nurbs = Nurbs::new(1, &[[0.0; AXES], [10.0, 0.0, 0.0, 0.0, 0.0]]);
    nurbs.tools = Some(vec![[0.0, 0.0, 50.0], [10.0, 0.0, -50.0]]);
    assert_eq!(run(&nurbs, Head::CA), Err(GeometryErrorKind::ToolVector));
}

#[test]
fn the_second_curve_is_on_all_points_or_on_none() {
    let angles = [[20.0, 10.0]; 5];
    let nurbs = leaning(3, Head::CA, &row(5), &angles, 100.0);
    let mut blocks = nurbs.blocks();
    if let Motion::Spline(spec) = &mut blocks[3].motion {
        spec.tool_point = None;
    }
    let error = drive(&config(), &nurbs.points[0], &blocks).unwrap_err();
    assert_eq!(
        (error.block, error.kind),
        (3, GeometryErrorKind::SplineAxes)
    );
}

#[test]
fn the_start_without_a_block_has_the_vector_its_axes_show() {
    let angles = [[20.0, 10.0], [25.0, 20.0], [30.0, 30.0], [20.0, 40.0]];
    let nurbs = leaning(3, Head::CA, &row(4), &angles, 100.0);
    let (path, _) = drive(&config(), &nurbs.points[0], &nurbs.blocks()[1..]).unwrap();
    leads(&nurbs, Head::CA, &path, 1.5e-4);
}

/// Runs a program of both stages: segments, and where interpreter and path then stand.
fn both_stages(
    config: &Config,
    program: &str,
) -> Result<(Vec<PathSegment>, [Nano; AXES], Position), GeometryErrorKind> {
    let mut interpreter = Interpreter::new(config);
    let mut blocks = Vec::new();
    for line in program.lines() {
        let mut take = |command| {
            if let Command::Move(motion) = command {
                blocks.push(motion);
            }
        };
        let result = interpreter.line(config, line.as_bytes(), &mut take);
        result.unwrap_or_else(|error| panic!("{error} in\n{program}"));
    }
    let (path, at) = drive(config, &[0.0; AXES], &blocks).map_err(|error| error.kind)?;
    Ok((path, interpreter.position(), at))
}

/// A spline over `angles`, from the first of them, and a straight block behind it.
fn program(head: Head, spline: &str, angles: &[[f64; 2]]) -> String {
    let letter = if head == Head::CB { 'B' } else { 'A' };
    let [tilt, turn] = angles[0];
    let mut out = format!("G0 {letter}{tilt:.6} C{turn:.6}\nF600 {spline}\n");
    for (k, [tilt, turn]) in (1..).zip(&angles[1..]) {
        let at = [10.0 * f64::from(k), 4.0 * f64::from(k % 3), 1.0];
        let [x, y, z] = at;
        let v = pointing(head, *tilt, *turn);
        let [xh, yh, zh]: Vector = core::array::from_fn(|k| at[k] + 100.0 * v[k]);
        out += &format!("X{x} Y{y} Z{z} XH={xh:.6} YH={yh:.6} ZH={zh:.6}\n");
    }
    out + "G1 X200\n"
}

/// Law: path and program agree on the angles at the end of the spline, and the block behind it leaves them alone.
fn leaves_the_axes(head: Head, spline: &str, angles: &[[f64; 2]]) {
    let config = with(head);
    let (path, nano, at) = both_stages(&config, &program(head, spline, angles)).unwrap();
    let last = path.last().unwrap().segment;
    assert_eq!(steps(&config, &nano.map(|x| x as f64 / 1e6)), at);
    assert_eq!(last.end, at);
    assert_eq!(last.start[3..], last.end[3..]);
    assert_eq!(last.slope_start[3..], [0.0; 2]);
    let end = angles[angles.len() - 1];
    for k in 0..2 {
        let is = nano[3 + k] as f64 / 1e6;
        assert!((is - end[k]).abs() < 1e-3, "{is} for {end:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn behind_a_spline_the_axes_stay_where_it_has_left_them(
        degree in 2_u8..=3,
        ca: bool,
        first in 0.0_f64..360.0,
        lean in prop::collection::vec((15.0_f64..70.0, -40.0_f64..40.0), 4..9),
    ) {
        let head = if ca { Head::CA } else { Head::CB };
        let angles = turning(first - 180.0, &lean);
        leaves_the_axes(head, &format!("BSPLINE SD={degree}"), &angles);
    }
}

#[test]
fn the_program_follows_the_axes_over_the_pole_and_around_it() {
    for head in [Head::CA, Head::CB] {
        let across = [25.0, 15.0, 5.0, -5.0, -15.0, -25.0].map(|tilt| [tilt, 30.0]);
        leaves_the_axes(head, "BSPLINE", &across);
        let around: Vec<_> = (0..16).map(|k| [30.0, 60.0 * f64::from(k)]).collect();
        leaves_the_axes(head, "BSPLINE", &around);
        let to_the_pole = [20.0, 10.0, 5.0, 0.0].map(|tilt| [tilt, -70.0]);
        leaves_the_axes(head, "BSPLINE SD=2", &to_the_pole);
        leaves_the_axes(head, "BSPLINE", &[[0.0, 33.0]; 5]);
        let negative = [[-20.0, 10.0], [-25.0, 20.0], [-30.0, 30.0], [-20.0, 40.0]];
        leaves_the_axes(head, "BSPLINE", &negative);
    }
}

#[test]
fn a_curve_that_passes_the_pole_on_the_other_side_than_its_points_is_refused() {
    // straight over the pole, and then aside: the polygon changes the sign of the tilt, the curve goes around
    let angles = [[10.0, 0.0], [-10.0, 0.0], [14.0, 135.0]];
    let program = program(Head::CA, "BSPLINE SD=2", &angles);
    assert_eq!(
        both_stages(&with(Head::CA), &program).map(|_| ()),
        Err(GeometryErrorKind::ToolJump)
    );
}

#[test]
fn a_turn_of_the_tool_alone_is_fed_in_degrees() {
    let config = with(Head::CA);
    let program =
        "G0 A10 C0\nF600 BSPLINE X0 XH=0 YH=-30 ZH=100\nX0 XH=0 YH=-40 ZH=100\nX0 XH0 YH-50 ZH100";
    let (path, ..) = both_stages(&config, program).unwrap();
    assert!(
        path.iter().skip(1).all(|path| path.feed == 10.0),
        "{path:?}"
    );
}
