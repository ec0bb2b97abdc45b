//! `G06.2` against the curve its own knots, points and weights define (recursion of Cox and de Boor).

use crate::catalogue::{dialect, nc, Message};
use crate::nc::command::{Command, Cutter, FeedType, Motion, Move, Side, SplineKind, SplineSpec};
use crate::nc::fanuc::{Nurbs, NurbsWords};
use crate::units::{Nano, AXES};

fn template(line: u32, feed: f32) -> Move {
    Move {
        block: line,
        motion: Motion::Linear,
        target: [7; AXES],
        feed,
        feed_type: FeedType::PerTime,
        exact_stop: line == 3,
        soft: true,
        rounding: Default::default(),
        cutter: Cutter::OFF,
    }
}

/// Words of a line over X and Y; axes without a word stay.
fn words(line: &str, position: &[Nano; AXES]) -> NurbsWords {
    let mut words = NurbsWords {
        begins: false,
        order: None,
        knot: None,
        weight: None,
        axes: 0,
        target: *position,
    };
    for word in line.split_whitespace() {
        if word == "G06.2" {
            words.begins = true;
            continue;
        }
        let value: f64 = word[1..].parse().unwrap();
        match &word[..1] {
            "P" => words.order = Some(value),
            "K" => words.knot = Some(value),
            "R" => words.weight = Some(value),
            axis => {
                let axis = "XY".find(axis).unwrap();
                words.axes |= 1 << axis;
                words.target[axis] = (value * 1e6).round() as Nano;
            }
        }
    }
    words
}

/// Line, number, letter.
type Refused = (u32, u16, char);

/// Moves of a program that begins where its first point is, and the first refusal.
fn drive(program: &str) -> (Vec<Move>, Result<Nurbs, Refused>) {
    let mut nurbs = Nurbs::new();
    let mut moves = Vec::new();
    let mut position = [0; AXES];
    for (number, line) in (1..).zip(program.lines()) {
        let refused = |refusal: crate::nc::fanuc::Refusal| {
            (number, refusal.message.code, char::from(refusal.letter))
        };
        if line == "G01" {
            if let Err(refusal) = nurbs.end() {
                return (moves, Err(refused(refusal)));
            }
            continue;
        }
        let words = words(line, &position);
        if number == 1 {
            position = words.target;
        }
        let before = nurbs;
        let mut got = Vec::new();
        let result = nurbs.block(
            &words,
            &position,
            &template(number, number as f32),
            &mut |command| got.push(command),
        );
        if let Err(refusal) = result {
            assert_eq!(
                (nurbs, got.len()),
                (before, 0),
                "a refused line did something"
            );
            return (moves, Err(refused(refusal)));
        }
        if words.begins {
            // The start: where the program stands, with the weight all others are divided by.
            let [Command::Move(start)] = got[..] else {
                panic!("{got:?}");
            };
            let Motion::Spline(spec) = start.motion else {
                panic!("{start:?}");
            };
            assert_eq!((start.target, start.block), (position, number));
            assert_eq!(
                (spec.interval, spec.weight, spec.first),
                (Some(0.0), 1.0, true)
            );
            got.clear();
        }
        position = words.target;
        moves.extend(got.into_iter().map(|command| match command {
            Command::Move(step) => step,
            other => panic!("{other:?}"),
        }));
    }
    (moves, Ok(nurbs))
}

/// Rational B-spline at `u` by the recursive definition of the basis functions, last span closed.
fn curve(order: usize, knots: &[f64], points: &[[f64; 2]], weights: &[f64], u: f64) -> [f64; 2] {
    fn basis(knots: &[f64], i: usize, order: usize, u: f64) -> f64 {
        if order == 1 {
            let last = knots[i + 1] == knots[knots.len() - 1] && u == knots[i + 1];
            let inside = knots[i] <= u && (u < knots[i + 1] || last) && knots[i] < knots[i + 1];
            return f64::from(inside);
        }
        let part = |numerator: f64, span: f64, index: usize| {
            if span == 0.0 {
                0.0
            } else {
                numerator / span * basis(knots, index, order - 1, u)
            }
        };
        part(u - knots[i], knots[i + order - 1] - knots[i], i)
            + part(knots[i + order] - u, knots[i + order] - knots[i + 1], i + 1)
    }
    let mut sum = [0.0; 2];
    let mut bottom = 0.0;
    for (i, (point, weight)) in points.iter().zip(weights).enumerate() {
        let n = weight * basis(knots, i, order, u);
        bottom += n;
        sum[0] += n * point[0];
        sum[1] += n * point[1];
    }
    [sum[0] / bottom, sum[1] / bottom]
}

/// A curve as the geometry stage counts it: start, moves; its knots are the spans added up.
fn rebuilt(start: [f64; 2], moves: &[Move]) -> (usize, Vec<f64>, Vec<[f64; 2]>, Vec<f64>) {
    let mut points = vec![start];
    let mut weights = vec![1.0];
    let mut order = 0;
    let mut knots = Vec::new();
    for (index, step) in moves.iter().enumerate() {
        let Motion::Spline(spec) = step.motion else {
            panic!("{step:?}");
        };
        assert_eq!(spec.kind, SplineKind::BSpline);
        order = usize::from(spec.degree) + 1;
        if index == 0 {
            knots = vec![0.0; order];
        }
        points.push([0, 1].map(|axis| step.target[axis] as f64 / 1e6));
        weights.push(f64::from(spec.weight));
        // move 0 brings point 1; spans begin with the point of index degree
        assert_eq!(spec.interval.is_some(), index + 1 >= order - 1);
        if let Some(interval) = spec.interval {
            knots.push(knots[knots.len() - 1] + f64::from(interval));
        }
    }
    let end = knots[knots.len() - 1];
    knots.extend(vec![end; order - 1]);
    (order, knots, points, weights)
}

/// The moves of `program` draw the curve its words define.
fn same_curve(program: &str) -> Vec<Move> {
    let (moves, end) = drive(program);
    let nurbs = end.unwrap_or_else(|error| panic!("{error:?}"));
    assert!(nurbs.active());
    let (mut order, mut knots, mut points, mut weights) = (4, vec![], vec![], vec![]);
    let mut position = [0; AXES];
    for line in program.lines() {
        let words = words(line, &position);
        position = words.target;
        order = words.order.map_or(order, |order| order as usize);
        knots.push(words.knot.unwrap());
        if words.axes != 0 {
            points.push([0, 1].map(|axis| words.target[axis] as f64 / 1e6));
            weights.push(words.weight.unwrap_or(1.0));
        }
    }
    let (order_out, knots_out, points_out, weights_out) = rebuilt(points[0], &moves);
    assert_eq!((order_out, &points_out), (order, &points));
    let (from, to) = (knots[0], knots[knots.len() - 1]);
    for step in 0..=200 {
        let part = f64::from(step) / 200.0;
        let expected = curve(order, &knots, &points, &weights, from + part * (to - from));
        let end = knots_out[knots_out.len() - 1];
        let got = curve(order, &knots_out, &points_out, &weights_out, part * end);
        for axis in 0..2 {
            let error = (got[axis] - expected[axis]).abs();
            assert!(error < 1e-4, "{program}\n{part}: {got:?} {expected:?}");
        }
    }
    moves
}

/// Six control points and ten knots, as in the manuals of the control.
const CUBIC: &str =
    "G06.2 K0 X0 Y0\nK0 X300 Y100\nK0 X700\nK0 X1300 Y-100\nK0.5 X1700\nK0.5 X2300 Y0
K1\nK1\nK1\nK1";

#[test]
fn a_fanuc_curve_keeps_its_shape() {
    for program in [
        CUBIC,
        "G06.2 P2 K-1 X1 Y1\nK-1 X2 Y5\nK0 X9\nK2.5\nK2.5",
        "G06.2 P3 K0 X0 Y0 R2\nK0 X1 Y3 R1\nK0 X5 Y2 R3\nK0.25 X6 Y-1\nK0.75 X8 R0.5\nK3\nK3\nK3",
        "G06.2 P4 K0 X0 Y0\nK0 X1 Y3\nK0 X5\nK0 X6 R0.3\nK1 Y9\nK1 X2\nK1 Y0\nK4\nK4\nK4\nK4",
        "G06.2 P4 K5 X0 Y0\nK5 X1 Y3\nK5 X5\nK5 X6\nK9\nK9\nK9\nK9",
    ] {
        same_curve(program);
    }
}

#[test]
fn nine_points_with_double_knots_are_a_circle() {
    let moves = same_curve(
        "G06.2 P3 K0 X1 Y0 R1\nK0 X1 Y1 R0.70710678\nK0 X0 R1\nK1 X-1 R0.70710678\nK1 Y0 R1
K2 Y-1 R0.70710678\nK2 X0 R1\nK3 X1 R0.70710678\nK3 Y0 R1\nK4\nK4\nK4",
    );
    let (order, knots, points, weights) = rebuilt([1.0, 0.0], &moves);
    for step in 0..400 {
        let [x, y] = curve(order, &knots, &points, &weights, f64::from(step) / 100.0);
        assert!((x.hypot(y) - 1.0).abs() < 1e-7, "{x} {y}");
    }
}

#[test]
fn a_point_goes_out_with_the_knot_behind_it_and_keeps_its_own_line() {
    let (moves, _) = drive(CUBIC);
    let blocks: Vec<_> = moves.iter().map(|step| step.block).collect();
    assert_eq!(blocks, [2, 3, 4, 5, 6]);
    for step in &moves {
        assert_eq!(step.feed, step.block as f32);
        assert_eq!((step.exact_stop, step.soft), (step.block == 3, true));
        let Motion::Spline(SplineSpec {
            first, interval, ..
        }) = step.motion
        else {
            panic!("{step:?}");
        };
        assert!(!first);
        let expected = [None, None, Some(0.5), Some(0.0), Some(0.5)];
        assert_eq!(interval, expected[step.block as usize - 2]);
    }
    // five lines and the sixth that shows how far the fifth goes
    let head: Vec<_> = CUBIC.lines().take(6).collect();
    assert_eq!(drive(&head.join("\n")).0, moves[..4]);
}

#[test]
fn weights_count_relative_to_the_first() {
    let (moves, _) = drive("G06.2 P2 K0 X0 R4\nK0 X1 R2\nK1 X2\nK2\nK2");
    let weights: Vec<_> = moves
        .iter()
        .map(|step| match step.motion {
            Motion::Spline(spec) => spec.weight,
            _ => 0.0,
        })
        .collect();
    assert_eq!(weights, [0.5, 0.25]);
}

#[test]
fn what_is_no_curve_is_refused_by_name_line_and_word() {
    let row = |line, message: &Message, letter| Err((line, message.code, letter));
    for (program, expected) in [
        ("G06.2 P5 K0 X0", row(1, &dialect::NURBS_ORDER, 'P')),
        ("G06.2 P2.5 K0 X0", row(1, &dialect::NURBS_ORDER, 'P')),
        ("G06.2 K0 X0\nP4 K0 X1", row(2, &dialect::NURBS_ORDER, 'P')),
        ("G06.2 X0", row(1, &dialect::NURBS_KNOT_MISSING, 'G')),
        ("G06.2 K0 X0\nX1", row(2, &dialect::NURBS_KNOT_MISSING, 'G')),
        ("G06.2 K0 X0\nKNaN X1", row(2, &nc::OUT_OF_RANGE, 'K')),
        (
            "G06.2 K1 X0\nK0.9 X1",
            row(2, &dialect::NURBS_KNOT_ORDER, 'K'),
        ),
        (
            "G06.2 P3 K0 X0\nK0 X1\nK0.1 X2",
            row(3, &dialect::NURBS_KNOT_START, 'K'),
        ),
        (
            "G06.2 P2 K0 X0\nK0 X1\nK0 X2",
            row(3, &dialect::NURBS_KNOT_START, 'K'),
        ),
        (
            "G06.2 P3 K0 X0\nK0 X1\nK0 X2\nK1 X3\nK1 X4\nK1 X5",
            row(6, &dialect::NURBS_KNOT_MULTIPLE, 'K'),
        ),
        (
            "G06.2 P2 K0 X0\nK0 X1\nK0",
            row(3, &dialect::NURBS_KNOT_END, 'K'),
        ),
        (
            "G06.2 P2 K0 X0\nK0 X1\nK1\nK1.5",
            row(4, &dialect::NURBS_KNOT_END, 'K'),
        ),
        (
            "G06.2 P3 K0 X0\nK0 X1\nK1",
            row(3, &dialect::NURBS_POINTS, 'K'),
        ),
        ("G06.2 K0 X0 R0", row(1, &dialect::NURBS_WEIGHT, 'R')),
        (
            "G06.2 K0 X0\nK0 X1 R-1",
            row(2, &dialect::NURBS_WEIGHT, 'R'),
        ),
        ("G06.2 K0 X0\nK0 X1 R1e9", row(2, &nc::OUT_OF_RANGE, 'R')),
        (
            "G06.2 P2 K0 X0\nK0 X1\nK1 R1",
            row(3, &dialect::NURBS_WEIGHT, 'R'),
        ),
        ("G06.2 K0", row(1, &dialect::NURBS_AXIS, 'G')),
        ("G06.2 K0 X0\nK0 X1 Y1", row(2, &dialect::NURBS_AXIS, 'G')),
        (
            "G06.2 P2 K0 X0\nK0 X1\nK1\nK1 X5",
            row(4, &dialect::NURBS_OPEN, 'G'),
        ),
        (
            "G06.2 P2 K0 X0\nK0 X1\nK1\nG01",
            row(4, &dialect::NURBS_OPEN, 'G'),
        ),
        (
            "G06.2 P2 K0 X0\nG06.2 K0 X0",
            row(2, &dialect::NURBS_OPEN, 'G'),
        ),
        (
            "G06.2 P2 K0 X0\nK0 X1\nK1\nK1\nK1",
            row(5, &dialect::NURBS_COMPLETE, 'G'),
        ),
        (
            "G06.2 P2 K0 X0\nK0 X1\nK1\nK1\nK2 X5",
            row(5, &dialect::NURBS_COMPLETE, 'G'),
        ),
    ] {
        assert_eq!(drive(program).1.map(|_| ()), expected, "{program}");
    }
}

#[test]
fn a_complete_curve_gives_way_to_the_next_motion() {
    let complete = "G06.2 P2 K0 X0\nK0 X1\nK1\nK1\n";
    let (_, end) = drive(&format!("{complete}G01"));
    assert!(!end.unwrap().active());
    let (moves, end) = drive(&format!("{complete}G06.2 P2 K0 X1\nK0 X2\nK1"));
    assert!(end.unwrap().active());
    assert_eq!(moves.len(), 2);
    assert_eq!(Nurbs::new().end(), Ok(()));
}

#[test]
fn the_first_point_may_be_a_micrometre_off_and_no_more() {
    for (off, good) in [(1000, true), (-1000, true), (1001, false)] {
        let mut nurbs = Nurbs::new();
        let mut position = [0; AXES];
        let words = words("G06.2 K0 X5", &position);
        position[0] = 5_000_000 + off;
        let result = nurbs.block(&words, &position, &template(1, 1.0), &mut |_| {});
        let expected = if good {
            None
        } else {
            Some(dialect::NURBS_START.code)
        };
        assert_eq!(result.err().map(|refusal| refusal.message.code), expected);
    }
}

#[test]
fn cutter_compensation_excludes_a_nurbs_curve() {
    let mut compensated = template(1, 1.0);
    compensated.cutter.side = Side::Left;
    let words = words("G06.2 K0 X0", &[0; AXES]);
    let result = Nurbs::new().block(&words, &[0; AXES], &compensated, &mut |_| {});
    assert_eq!(
        result.map_err(|refusal| refusal.message.code),
        Err(dialect::NURBS_COMPENSATION.code)
    );
}
