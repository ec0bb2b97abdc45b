//! Contours, runs and the brute-force oracle.

use std::cell::Cell;

use crate::compensation::{CompensationError, Compensator, Meanwhile, Output};
use crate::config::Config;
use crate::geometry::{HermiteSegment, PathSegment};
use crate::nc::command::{Command, Corner, Cutter, FeedReference, Plane, Side};
use crate::units::{Position, Steps, AXES};

pub type P = [f64; 2];

thread_local! {
    /// Evaluations of a curve since the last look at it.
    static EVALUATIONS: Cell<u32> = const { Cell::new(0) };
}

/// Most evaluations of a curve in one go. Each takes one to two thousand instructions on the board, where the planner is at
/// least 60 servo ticks of 25000 ahead: a quarter of that.
const IN_ONE_GO: u32 = 200;

/// A curve has been evaluated.
pub fn evaluated() {
    EVALUATIONS.set(EVALUATIONS.get() + 1);
}

/// Does `work`, and watches that what goes on meanwhile is not kept waiting.
pub fn paced<T>(work: impl FnOnce(Meanwhile) -> T) -> T {
    let mut look = || {
        let count = EVALUATIONS.take();
        assert!(count <= IN_ONE_GO, "{count} evaluations in one go");
    };
    EVALUATIONS.take();
    let out = work(&mut look);
    look();
    out
}

pub fn config() -> Config {
    crate::config::tests::test_config()
}

pub fn cutter(side: Side, radius: f64) -> Cutter {
    Cutter {
        side,
        corner: Corner::Arc,
        feed: FeedReference::Contour,
        plane: Plane::Xy,
        radius: (radius * 1e6).round() as i64,
    }
}

pub fn steps(point: &[f64; AXES]) -> Position {
    point.map(|v| Steps::from_bits((v * 1000.0 * 4_294_967_296.0).round() as i64))
}

pub fn at(p: P) -> Position {
    steps(&[p[0], p[1], 0.0, 0.0, 0.0])
}

/// A five-axis cubic of block `block`.
pub fn hermite(
    block: u32,
    from: [f64; AXES],
    to: [f64; AXES],
    m0: [f64; AXES],
    m1: [f64; AXES],
    cutter: Cutter,
) -> PathSegment {
    PathSegment {
        segment: HermiteSegment {
            start: steps(&from),
            end: steps(&to),
            slope_start: m0.map(|v| v as f32),
            slope_end: m1.map(|v| v as f32),
        },
        block,
        feed: 10.0,
        exact_stop: false,
        soft: true,
        rounding: Default::default(),
        spline: false,
        cutter,
    }
}

pub fn line5(block: u32, from: [f64; AXES], to: [f64; AXES], cutter: Cutter) -> PathSegment {
    let by = core::array::from_fn(|k| to[k] - from[k]);
    hermite(block, from, to, by, by, cutter)
}

fn five(p: P) -> [f64; AXES] {
    [p[0], p[1], 0.0, 0.0, 0.0]
}

pub fn line(block: u32, from: P, to: P, cutter: Cutter) -> PathSegment {
    line5(block, five(from), five(to), cutter)
}

pub fn curve(block: u32, from: P, to: P, m0: P, m1: P, cutter: Cutter) -> PathSegment {
    hermite(block, five(from), five(to), five(m0), five(m1), cutter)
}

/// Polyline through `points`, blocks 1, 2, ..
pub fn polyline(points: &[P], cutter: Cutter) -> Vec<PathSegment> {
    points
        .windows(2)
        .enumerate()
        .map(|(k, pair)| line(k as u32 + 1, pair[0], pair[1], cutter))
        .collect()
}

pub fn drain(
    config: &Config,
    c: &mut Compensator,
    out: &mut Vec<Output>,
) -> Result<(), CompensationError> {
    while let Some(output) = paced(|meanwhile| c.next(config, meanwhile))? {
        out.push(output);
    }
    Ok(())
}

pub enum Input {
    Segment(PathSegment),
    Command(Command),
}

/// Runs everything from `start`; what came out before an error, too.
pub fn run_all(
    config: &Config,
    start: Position,
    inputs: &[Input],
) -> (Vec<Output>, Option<CompensationError>) {
    let mut c = Compensator::new();
    c.reset(start);
    let mut out = Vec::new();
    let mut feed = || -> Result<(), CompensationError> {
        for input in inputs {
            assert!(!c.is_full());
            match input {
                Input::Segment(segment) => {
                    paced(|meanwhile| c.push_segment(config, segment, meanwhile))?;
                }
                Input::Command(command) => c.push_command(config, *command)?,
            }
            drain(config, &mut c, &mut out)?;
        }
        paced(|meanwhile| c.finish(config, meanwhile))?;
        drain(config, &mut c, &mut out)?;
        assert!(!c.has_pending());
        Ok(())
    };
    let error = feed().err();
    (out, error)
}

pub fn segments(outputs: &[Output]) -> Vec<PathSegment> {
    outputs
        .iter()
        .filter_map(|out| match out {
            Output::Segment(segment) => Some(*segment),
            Output::Command(_) => None,
        })
        .collect()
}

/// Runs motion only; the first block is an approach from 5 mm beside and 5 mm before the start of the contour.
pub fn try_contour(contour: &[PathSegment]) -> (Vec<PathSegment>, Option<CompensationError>) {
    let config = config();
    let first = &contour[0];
    let start = first.segment.start;
    let mut away = start;
    away[0] += Steps::from_num(-5000);
    away[1] += Steps::from_num(-5000);
    let mut approach = *first;
    approach.segment = HermiteSegment {
        start: away,
        end: start,
        slope_start: [5.0, 5.0, 0.0, 0.0, 0.0],
        slope_end: [5.0, 5.0, 0.0, 0.0, 0.0],
    };
    approach.block = 0;
    let inputs: Vec<Input> = std::iter::once(approach)
        .chain(contour.iter().copied())
        .map(Input::Segment)
        .collect();
    let (out, error) = run_all(&config, away, &inputs);
    let out = segments(&out);
    joins_exactly(&away, &out);
    (out.into_iter().skip(1).collect(), error)
}

/// As [`try_contour`], without the approach, and it must run.
pub fn contour(contour: &[PathSegment]) -> Vec<PathSegment> {
    let (out, error) = try_contour(contour);
    assert_eq!(
        error,
        None,
        "{}",
        error.map(|e| e.to_string()).unwrap_or_default()
    );
    out
}

/// Law: every segment starts on the bits on which the last one ended.
pub fn joins_exactly(start: &Position, path: &[PathSegment]) {
    let mut at = *start;
    for segment in path {
        assert_eq!(segment.segment.start, at, "block {}", segment.block);
        at = segment.segment.end;
    }
}

pub fn mm(p: &Position) -> [f64; AXES] {
    p.map(|v| v.to_num::<f64>() / 1000.0)
}

/// Bernstein form, so that the oracle shares no formula with the code. Point and derivative.
pub fn evaluate(path: &PathSegment, u: f64) -> [[f64; AXES]; 2] {
    let s = &path.segment;
    let (p0, p3) = (mm(&s.start), mm(&s.end));
    let mut out = [[0.0; AXES]; 2];
    for k in 0..AXES {
        let p1 = p0[k] + f64::from(s.slope_start[k]) / 3.0;
        let p2 = p3[k] - f64::from(s.slope_end[k]) / 3.0;
        let v = 1.0 - u;
        out[0][k] =
            v * v * v * p0[k] + 3.0 * v * v * u * p1 + 3.0 * v * u * u * p2 + u * u * u * p3[k];
        out[1][k] = 3.0 * (v * v * (p1 - p0[k]) + 2.0 * v * u * (p2 - p1) + u * u * (p3[k] - p2));
    }
    out
}

pub fn xy(p: [f64; AXES]) -> P {
    [p[0], p[1]]
}

pub fn distance(a: P, b: P) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// `count` points on every segment.
pub fn sample(path: &[PathSegment], count: usize) -> Vec<P> {
    path.iter()
        .flat_map(|s| (0..=count).map(|k| xy(evaluate(s, k as f64 / count as f64)[0])))
        .collect()
}

/// Distance from `p` to the polyline.
pub fn distance_to(p: P, polyline: &[P]) -> f64 {
    polyline
        .windows(2)
        .map(|w| {
            let by = [w[1][0] - w[0][0], w[1][1] - w[0][1]];
            let square = by[0] * by[0] + by[1] * by[1];
            let t = if square > 0.0 {
                (((p[0] - w[0][0]) * by[0] + (p[1] - w[0][1]) * by[1]) / square).clamp(0.0, 1.0)
            } else {
                0.0
            };
            distance(p, [w[0][0] + t * by[0], w[0][1] + t * by[1]])
        })
        .fold(f64::INFINITY, f64::min)
}

/// Law: the tool never comes closer to the contour than its radius, and touches it all the time.
pub fn touches(contour: &[PathSegment], path: &[PathSegment], radius: f64, count: usize) {
    let dense = sample(contour, count);
    for segment in path {
        for k in 0..=40 {
            let p = xy(evaluate(segment, f64::from(k) / 40.0)[0]);
            let off = distance_to(p, &dense) - radius;
            assert!(off.abs() < 5e-4, "block {}: {off} at {p:?}", segment.block);
        }
    }
}

/// Law: directions agree at every joint.
pub fn is_smooth(path: &[PathSegment], angle: f64) {
    for pair in path.windows(2) {
        let (a, b) = (
            xy(evaluate(&pair[0], 1.0)[1]),
            xy(evaluate(&pair[1], 0.0)[1]),
        );
        let turn = (a[0] * b[1] - a[1] * b[0]).atan2(a[0] * b[0] + a[1] * b[1]);
        assert!(turn.abs() < angle, "block {}: {turn}", pair[1].block);
    }
}

/// Cubics through the full circle, counter-clockwise from angle 0.
pub fn circle(radius: f64, pieces: usize, cutter: Cutter) -> Vec<PathSegment> {
    let step = std::f64::consts::TAU / pieces as f64;
    let k = 4.0 * (step / 4.0).tan();
    (0..pieces)
        .map(|i| {
            let on = |i: usize| {
                let (s, c) = (step * i as f64).sin_cos();
                ([radius * c, radius * s], [-radius * k * s, radius * k * c])
            };
            let ((p0, m0), (p1, m1)) = (on(i), on(i + 1));
            curve(i as u32 + 1, p0, p1, m0, m1, cutter)
        })
        .collect()
}
