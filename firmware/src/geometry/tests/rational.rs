//! B-splines with unequal weights, coinciding knots, axes outside `SPLINEPATH`: what no single cubic per span can be.
//!
//! The oracle is the Cox-de Boor recursion in homogeneous coordinates, over the whole spline at once; the path is
//! compared with it as a set of points, since the parameter is not kept.

use super::oracle;
use super::support::*;
use crate::config::Config;
use crate::geometry::{GeometryError, GeometryErrorKind, PathSegment, SegmentBuilder};
use crate::nc::command::{BoundaryCondition, Motion, Move, SplineKind, SplineSpec};
use crate::units::{Nano, Position, AXES};
use proptest::prelude::*;

/// A B-spline as somebody programs it; the first point, weight and tool point are those of the start.
#[derive(Clone, Debug)]
pub struct Nurbs {
    pub degree: u8,
    pub points: Vec<Point>,
    pub weights: Vec<f32>,
    /// Between distinct knots of the clamped knot vector, 0 for equal ones: one per point from number `degree` on.
    pub spans: Vec<f32>,
    pub axes: u8,
    pub tools: Option<Vec<[f64; 3]>>,
}

impl Nurbs {
    pub fn new(degree: u8, points: &[Point]) -> Self {
        Self {
            degree,
            points: points.to_vec(),
            weights: vec![1.0; points.len()],
            spans: vec![1.0; points.len().saturating_sub(usize::from(degree))],
            axes: u8::MAX,
            tools: None,
        }
    }

    pub fn weights(mut self, weights: &[f32]) -> Self {
        self.weights = weights.to_vec();
        self
    }

    pub fn spans(mut self, spans: &[f32]) -> Self {
        self.spans = spans.to_vec();
        self
    }

    /// One block per point; the start, too, has one, which gives it its weight.
    pub fn blocks(&self) -> Vec<Move> {
        let degree = usize::from(self.degree);
        let spec = |index: usize| SplineSpec {
            degree: self.degree,
            weight: self.weights[index],
            interval: if index == 0 {
                Some(0.0)
            } else {
                index.checked_sub(degree).map(|span| self.spans[span])
            },
            axes: self.axes,
            tool_point: self
                .tools
                .as_ref()
                .map(|tools| tools[index].map(|value| (value * 1e6).round() as Nano)),
            ..spec(
                SplineKind::BSpline,
                BoundaryCondition::NotAKnot,
                BoundaryCondition::NotAKnot,
            )
        };
        self.points
            .iter()
            .enumerate()
            .map(|(index, point)| block(index as u32, Motion::Spline(spec(index)), point))
            .collect()
    }

    pub fn run(&self) -> Result<Vec<PathSegment>, GeometryError> {
        drive(&config(), &self.points[0], &self.blocks()).map(|(path, _)| path)
    }

    pub fn knots(&self) -> Vec<f64> {
        let spans: Vec<f64> = self.spans.iter().map(|span| f64::from(*span)).collect();
        oracle::clamped(usize::from(self.degree), &spans)
    }

    /// Length of the parameter.
    pub fn length(&self) -> f64 {
        self.spans.iter().map(|span| f64::from(*span)).sum()
    }

    /// Rational combination of one vector per control point.
    pub fn combine(&self, vectors: &[Point], t: f64) -> Point {
        let degree = usize::from(self.degree);
        let weighted: Vec<Point> = vectors
            .iter()
            .zip(&self.weights)
            .map(|(vector, weight)| vector.map(|value| value * f64::from(*weight)))
            .collect();
        let weights: Vec<Point> = self
            .weights
            .iter()
            .map(|weight| [f64::from(*weight); AXES])
            .collect();
        let t = t.clamp(0.0, self.length() * (1.0 - 1e-15));
        let above = oracle::b_spline(degree, &self.knots(), &weighted, t);
        let below = oracle::b_spline(degree, &self.knots(), &weights, t);
        core::array::from_fn(|axis| above[axis] / below[axis])
    }

    /// The curve.
    pub fn at(&self, t: f64) -> Point {
        self.combine(&self.points, t)
    }
}

/// Runs blocks, pushing those again that come too early; segments and where the builder then stands.
pub fn drive(
    config: &Config,
    start: &Point,
    blocks: &[Move],
) -> Result<(Vec<PathSegment>, Position), GeometryError> {
    let mut builder = SegmentBuilder::new(config, steps(config, start));
    let mut out = Vec::new();
    for block in blocks {
        while let Err(error) = builder.push(config, block) {
            if error.kind != GeometryErrorKind::NotDrained {
                return Err(error);
            }
            out.extend(core::iter::from_fn(|| builder.next(config)));
        }
        out.extend(core::iter::from_fn(|| builder.next(config)));
    }
    while builder.is_open() {
        builder.finish(config)?;
        out.extend(core::iter::from_fn(|| builder.next(config)));
    }
    Ok((out, builder.position()))
}

/// Parameter of the first point of `curve` not before `from` that comes as close to `at` as 1e-4, and its distance; of
/// the closest point if none does.
pub fn closest(curve: impl Fn(f64) -> Point, length: f64, from: f64, at: &Point) -> (f64, f64) {
    const GRID: f64 = 2000.0;
    let on = |t: f64| curve(t.clamp(0.0, length));
    let far = |t: f64| distance(&on(t), at);
    let step = length / GRID;
    let refine = |mut low: f64, mut high: f64| {
        for _ in 0..30 {
            let a = high - 0.618_033_988_749_894_9 * (high - low);
            let b = low + 0.618_033_988_749_894_9 * (high - low);
            if far(a) < far(b) {
                high = b;
            } else {
                low = a;
            }
        }
        let t = (0.5 * (low + high)).clamp(0.0, length);
        (t, far(t))
    };
    let mut best = (from, far(from));
    let mut t = from - 1e-6;
    let mut here = on(t);
    while t < length {
        let end = (t + step).min(length);
        let next = on(end);
        // Nothing in the cell is closer than its ends by more than its extent; kinks may hide in it.
        let extent = 2.0 * distance(&here, &on(0.5 * (t + end)))
            + 2.0 * distance(&next, &on(0.5 * (t + end)));
        if distance(&here, at).min(distance(&next, at)) <= extent {
            for part in 0..4 {
                let quarter = 0.25 * (end - t);
                let low = t + f64::from(part) * quarter;
                let found = refine(low, low + quarter);
                if found.1 < best.1 {
                    best = found;
                }
            }
        }
        if best.1 < 1e-4 {
            return best;
        }
        here = next;
        t = end;
    }
    best
}

/// Law: the path follows the curve from start to end within `tolerance`, mm and degree together.
fn follows(path: &[PathSegment], curve: impl Fn(f64) -> Point, length: f64, tolerance: f64) {
    let mut t = 0.0;
    for segment in path {
        for u in [0.0, 0.35, 0.7, 1.0] {
            let at = evaluate(&segment.segment, u)[0];
            let (next, miss) = closest(&curve, length, t, &at);
            assert!(miss < tolerance, "line {}: {miss} at {next}", segment.block);
            t = next;
        }
    }
    assert!(
        distance(&curve(length), &curve(t)) < tolerance,
        "ends at {t} of {length}"
    );
}

/// The path as a polygon.
fn dense(path: &[PathSegment]) -> Vec<Point> {
    path.iter()
        .flat_map(|segment| (0..=32).map(|k| evaluate(&segment.segment, f64::from(k) / 32.0)[0]))
        .collect()
}

/// Distance of a point from a polygon.
fn to_polygon(at: &Point, polygon: &[Point]) -> f64 {
    polygon
        .windows(2)
        .map(|edge| {
            let by: Point = core::array::from_fn(|axis| edge[1][axis] - edge[0][axis]);
            let along: f64 = (0..AXES)
                .map(|axis| (at[axis] - edge[0][axis]) * by[axis])
                .sum();
            let part = (along / norm(&by).powi(2).max(1e-30)).clamp(0.0, 1.0);
            distance(
                at,
                &core::array::from_fn(|axis| edge[0][axis] + part * by[axis]),
            )
        })
        .fold(f64::INFINITY, f64::min)
}

const TOLERANCE: f64 = 1.0e-4;

/// Any spline: degree, points, weights, and knots as often as they may coincide.
fn any() -> impl Strategy<Value = Nurbs> {
    (1_u8..=3, 3_usize..9).prop_flat_map(|(degree, count)| {
        let count = count.max(usize::from(degree));
        (
            points(count),
            prop::collection::vec(0.1_f32..3.0, count + 1),
            prop::collection::vec((0.2_f32..3.0, 0_u8..3), count + 1 - usize::from(degree)),
        )
            .prop_map(move |(points, weights, mut spans)| {
                let mut equal = degree;
                let last = spans.len() - 1;
                for (index, (span, zero)) in spans.iter_mut().enumerate() {
                    equal += 1;
                    if *zero > 0 || equal >= degree || index == last {
                        equal = 0;
                    } else {
                        *span = 0.0;
                    }
                }
                let spans: Vec<f32> = spans.into_iter().map(|(span, _)| span).collect();
                Nurbs::new(degree, &points).weights(&weights).spans(&spans)
            })
    })
}

proptest! {
    #![proptest_config(ProptestConfig { max_shrink_iters: 4, ..ProptestConfig::with_cases(24) })]

    #[test]
    fn rational_spline_is_cox_de_boors(nurbs in any()) {
        let path = nurbs.run().unwrap();
        joins_exactly(&steps(&config(), &nurbs.points[0]), &path);
        follows(&path, |t| nurbs.at(t), nurbs.length(), 1.02 * TOLERANCE);
        let last = path[path.len() - 1].segment.end;
        prop_assert_eq!(last, steps(&config(), &nurbs.points[nurbs.points.len() - 1]));
        let blocks: Vec<u32> = path.iter().map(|segment| segment.block).collect();
        prop_assert!(blocks.is_sorted());
    }

    #[test]
    fn direction_is_continuous_at_simple_knots(nurbs in any(), degree in 2_u8..=3) {
        prop_assume!(nurbs.points.len() > usize::from(degree));
        let spans: Vec<f32> = (0..nurbs.points.len() - usize::from(degree)).map(|k| 0.5 + k as f32).collect();
        let nurbs = Nurbs { degree, ..nurbs }.spans(&spans);
        is_tangent_continuous(&nurbs.run().unwrap(), 1e-6);
    }

    #[test]
    fn ends_are_tangent_to_the_polygon_whatever_the_weights(nurbs in any()) {
        let path = nurbs.run().unwrap();
        let unit = |v: Point| v.map(|x| x / norm(&v));
        let edge = |a: usize, b: usize| {
            unit(core::array::from_fn(|axis| nurbs.points[b][axis] - nurbs.points[a][axis]))
        };
        let n = nurbs.points.len() - 1;
        let first = unit(path[0].segment.slope_start.map(f64::from));
        let last = unit(path[path.len() - 1].segment.slope_end.map(f64::from));
        prop_assert!(distance(&first, &edge(0, 1)) < 1e-6);
        prop_assert!(distance(&last, &edge(n - 1, n)) < 1e-6);
    }

    #[test]
    fn path_stays_in_the_convex_hull(nurbs in any(), directions in prop::collection::vec(prop::array::uniform5(-1.0_f64..1.0), 20)) {
        let path = dense(&nurbs.run().unwrap());
        for direction in directions {
            let reach = |points: &[Point]| {
                points
                    .iter()
                    .map(|at| (0..AXES).map(|axis| at[axis] * direction[axis]).sum::<f64>())
                    .fold(f64::NEG_INFINITY, f64::max)
            };
            prop_assert!(reach(&path) <= reach(&nurbs.points) + 2.0 * TOLERANCE);
        }
    }

    #[test]
    fn reversed_spline_is_the_same_path(nurbs in any()) {
        let mut back = nurbs.clone();
        back.points.reverse();
        back.weights.reverse();
        back.spans.reverse();
        let there = dense(&nurbs.run().unwrap());
        for at in dense(&back.run().unwrap()).iter().step_by(7) {
            let miss = to_polygon(at, &there);
            // A tolerance for each of the two, and the sag of the chords between samples.
            prop_assert!(miss < 4.0 * TOLERANCE, "{miss}");
        }
    }

    #[test]
    fn moved_and_turned_points_move_and_turn_the_path(nurbs in any()) {
        // A quarter turn about Z, a stretch along Z, a shift: exact in decimals.
        let map = |p: &Point| [7.0 - p[1], p[0] - 3.0, 2.0 * p[2] + 1.0, p[3] - 5.0, p[4]];
        let mut other = nurbs.clone();
        other.points = nurbs.points.iter().map(map).collect();
        let there = dense(&other.run().unwrap());
        for at in dense(&nurbs.run().unwrap()).iter().step_by(7) {
            let miss = to_polygon(&map(at), &there);
            prop_assert!(miss < 4.0 * TOLERANCE, "{miss}");
        }
    }

    #[test]
    fn equal_weights_cancel_bit_by_bit(nurbs in any(), weight in 1_u16..30_000) {
        let weight = f32::from(weight) * 1e-4;
        let with = |weight: f32| {
            let weights = vec![weight; nurbs.points.len()];
            nurbs.clone().weights(&weights)
        };
        let expected = with(1.0).run();
        prop_assert_eq!(with(weight).run(), expected.clone());
        // The same without a block for the start.
        let blocks = with(weight).blocks();
        let path = drive(&config(), &nurbs.points[0], &blocks[1..]).map(|(path, _)| path);
        prop_assert_eq!(path, expected);
    }

    #[test]
    fn what_comes_later_does_not_change_what_has_been_driven(nurbs in any(), keep in 4_usize..9) {
        let whole = nurbs.run().unwrap();
        let keep = keep.min(nurbs.points.len());
        let blocks = nurbs.blocks();
        let config = config();
        let mut builder = SegmentBuilder::new(&config, steps(&config, &nurbs.points[0]));
        let mut early = Vec::new();
        for block in &blocks[..keep] {
            builder.push(&config, block).unwrap();
            early.extend(core::iter::from_fn(|| builder.next(&config)));
        }
        prop_assert_eq!(&early[..], &whole[..early.len()]);
    }

    #[test]
    fn a_point_without_weight_has_no_influence(nurbs in any(), other in -50.0_f64..50.0) {
        // Of points whose neighbours weigh enough, every second one.
        let n = nurbs.points.len();
        prop_assume!(n >= 5 && nurbs.degree > 1);
        let spans = vec![1.0; n - usize::from(nurbs.degree)];
        let mut nurbs = nurbs.spans(&spans);
        nurbs.weights[2] = 0.0;
        let expected = nurbs.run().unwrap();
        follows(&expected, |t| nurbs.at(t), nurbs.length(), 1.02 * TOLERANCE);
        nurbs.points[2][0] += (other * 1000.0).round() / 1000.0;
        nurbs.points[2][4] -= 1.0;
        prop_assert_eq!(nurbs.run().unwrap(), expected);
    }

    #[test]
    fn axes_outside_splinepath_go_linearly(nurbs in any()) {
        let mut nurbs = nurbs;
        nurbs.axes = 0b00111;
        let path = nurbs.run().unwrap();
        joins_exactly(&steps(&config(), &nurbs.points[0]), &path);
        let degree = usize::from(nurbs.degree);
        let curve = |t: f64| {
            let mut at = nurbs.at(t);
            // The span t lies in, from the point before its own.
            let mut begin = 0.0;
            for (index, span) in nurbs.spans.iter().map(|span| f64::from(*span)).enumerate() {
                if t <= begin + span && span > 0.0 {
                    let before = (0..index).rev().find(|k| nurbs.spans[*k] > 0.0);
                    let from = nurbs.points[before.map_or(0, |k| k + degree)];
                    let to = nurbs.points[index + degree];
                    for axis in 3..5 {
                        at[axis] = from[axis] + (t - begin) / span * (to[axis] - from[axis]);
                    }
                    break;
                }
                begin += span;
            }
            at
        };
        follows(&path, curve, nurbs.length(), 1.02 * TOLERANCE);
        // Every span ends where its block says, to the bit.
        for pair in path.windows(2).filter(|pair| pair[0].block != pair[1].block) {
            let point = steps(&config(), &nurbs.points[pair[0].block as usize]);
            prop_assert_eq!(&pair[0].segment.end[3..], &point[3..]);
        }
        let last = path[path.len() - 1].segment.end;
        prop_assert_eq!(last, steps(&config(), &nurbs.points[nurbs.points.len() - 1]));
    }
}

fn flat(points: &[[f64; 2]]) -> Vec<Point> {
    points.iter().map(|p| [p[0], p[1], 0.0, 0.0, 0.0]).collect()
}

/// Law: every point of the path is `radius` from the origin.
fn is_round(path: &[PathSegment], radius: f64, tolerance: f64) {
    for at in dense(path) {
        let miss = (at[0].hypot(at[1]) - radius).abs();
        assert!(miss < tolerance, "{miss}");
    }
}

#[test]
fn weights_one_cosine_one_are_a_circle() {
    let radius = 50.0;
    let root = core::f32::consts::FRAC_1_SQRT_2;
    let quarter = flat(&[[radius, 0.0], [radius, radius], [0.0, radius]]);
    let nurbs = Nurbs::new(2, &quarter).weights(&[1.0, root, 1.0]);
    is_round(&nurbs.run().unwrap(), radius, TOLERANCE);
    // The start without a block weighs 1.
    let (path, _) = drive(&config(), &quarter[0], &nurbs.blocks()[1..]).unwrap();
    assert_eq!(path, nurbs.run().unwrap());
}

#[test]
fn nine_points_with_double_knots_are_a_full_circle() {
    // L. Piegl, W. Tiller, "The NURBS Book", example 7.1: knots 0 0 0 1/4 1/4 1/2 1/2 3/4 3/4 1 1 1.
    let r = 12.5;
    let points = flat(&[
        [r, 0.0],
        [r, r],
        [0.0, r],
        [-r, r],
        [-r, 0.0],
        [-r, -r],
        [0.0, -r],
        [r, -r],
        [r, 0.0],
    ]);
    let root = core::f32::consts::FRAC_1_SQRT_2;
    let weights = [1.0, root, 1.0, root, 1.0, root, 1.0, root, 1.0];
    let spans = [0.25, 0.0, 0.25, 0.0, 0.25, 0.0, 0.25];
    let nurbs = Nurbs::new(2, &points).weights(&weights).spans(&spans);
    let path = nurbs.run().unwrap();
    is_round(&path, r, TOLERANCE);
    is_tangent_continuous(&path, 1e-6);
    let turn: f64 = dense(&path)
        .windows(2)
        .map(|p| (p[0][0] * p[1][1] - p[0][1] * p[1][0]) / (r * r))
        .sum();
    assert!((turn - 2.0 * core::f64::consts::PI).abs() < 1e-3, "{turn}");
}

#[test]
fn weights_one_third_third_one_are_a_semicircle() {
    // The cubic semicircle: (R, 0) (R, 2R) (-R, 2R) (-R, 0) with weights 1 1/3 1/3 1.
    let r = 30.0;
    let points = flat(&[[r, 0.0], [r, 2.0 * r], [-r, 2.0 * r], [-r, 0.0]]);
    let third = 1.0 / 3.0;
    let nurbs = Nurbs::new(3, &points).weights(&[1.0, third, third, 1.0]);
    is_round(&nurbs.run().unwrap(), r, TOLERANCE);
}

#[test]
fn a_denominator_that_may_vanish_is_refused() {
    let points: Vec<Point> = (0..8)
        .map(|k| [f64::from(k), f64::from(k * k % 5), 0.0, 0.0, 0.0])
        .collect();
    let with = |zero: &[usize]| {
        let mut nurbs = Nurbs::new(3, &points);
        for index in zero {
            nurbs.weights[*index] = 0.0;
        }
        nurbs.run().map_err(|error| error.kind)
    };
    let refused = |zero| assert_eq!(with(zero), Err(GeometryErrorKind::Weight));
    refused(&[0]);
    refused(&[7]);
    refused(&[2, 3, 4]);
    refused(&[0, 1, 2, 3, 4, 5, 6, 7]);
    assert!(with(&[3, 4]).is_ok());
    for weight in [-1.0, f32::NAN, f32::INFINITY] {
        let mut nurbs = Nurbs::new(3, &points);
        nurbs.weights[3] = weight;
        let error = nurbs.run().unwrap_err();
        assert_eq!((error.block, error.kind), (3, GeometryErrorKind::Weight));
    }
}

#[test]
fn weights_from_a_ten_thousandth_to_three_hold_the_tolerance() {
    let points = flat(&[
        [0.0, 0.0],
        [10.0, 30.0],
        [25.0, -5.0],
        [40.0, 12.0],
        [55.0, 0.0],
    ]);
    let nurbs = Nurbs::new(3, &points).weights(&[1.0, 3.0, 0.0001, 3.0, 0.5]);
    let path = nurbs.run().unwrap();
    follows(&path, |t| nurbs.at(t), nurbs.length(), 1.02 * TOLERANCE);
}

#[test]
fn a_path_goes_on_behind_a_rational_spline() {
    let points = flat(&[
        [0.0, 0.0],
        [10.0, 30.0],
        [25.0, -5.0],
        [40.0, 12.0],
        [55.0, 0.0],
    ]);
    let nurbs = Nurbs::new(3, &points).weights(&[1.0, 3.0, 0.2, 3.0, 0.5]);
    let mut blocks = nurbs.blocks();
    let end = [60.0, 5.0, 0.0, 0.0, 0.0];
    blocks.push(block(9, Motion::Linear, &end));
    let (path, position) = drive(&config(), &points[0], &blocks).unwrap();
    joins_exactly(&steps(&config(), &points[0]), &path);
    assert_eq!(position, steps(&config(), &end));
    assert_eq!(path[..path.len() - 1], nurbs.run().unwrap());
    assert_eq!(path[path.len() - 1].block, 9);
}
