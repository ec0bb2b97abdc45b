//! Rational B-splines: on the Cox-de Boor curve, inside the hull of its control points, blind to equal weights, the same
//! curve from either end and in any place, and the values scipy and exact fractions give.

use std::fmt::Write;

use pentaspline::units::AXES;
use proptest::prelude::*;
use whole_product_tests::campaign::{cases, hold, machine, ran_on, stays_on};
use whole_product_tests::drive::Run;
use whole_product_tests::generate::curves::{program, spline, OFFSETS};
use whole_product_tests::laws;
use whole_product_tests::oracle::path::path_on;
use whole_product_tests::oracle::read::{Language, Setup};
use whole_product_tests::oracle::spline::{distance, Point};

/// Beside the tolerance of the curve: rounding of slopes to 24 bits.
const ROUNDING: f64 = 2e-5;

fn setup() -> Setup {
    Setup {
        offsets: OFFSETS,
        ..Setup::default()
    }
}

fn fanuc() -> Setup {
    Setup {
        language: Language::Fanuc,
        ..Setup::default()
    }
}

/// Control polygon: points (mm), knot intervals, weights, degree.
#[derive(Clone, Debug)]
struct Net {
    degree: usize,
    points: Vec<[f64; 2]>,
    spans: Vec<f64>,
    weights: Vec<f64>,
}

fn net() -> impl Strategy<Value = Net> {
    (2_usize..4, 4_usize..9).prop_flat_map(|(degree, count)| {
        (
            Just(degree),
            prop::collection::vec((-1.4_f64..1.4, 2.0_f64..9.0), count - 1),
            prop::collection::vec((2_i32..20).prop_map(|k| f64::from(k) / 8.0), count - degree),
            prop::collection::vec((4_i32..40).prop_map(|k| f64::from(k) / 16.0), count),
        )
            .prop_map(|(degree, steps, spans, weights)| {
                let (mut points, mut heading) = (vec![[0.0, 0.0]], 0.0_f64);
                for (turn, length) in steps {
                    heading += turn;
                    let [x, y] = points[points.len() - 1];
                    let round = |v: f64| (v * 1000.0).round() / 1000.0;
                    points.push([
                        round(x + length * heading.cos()),
                        round(y + length * heading.sin()),
                    ]);
                }
                Net {
                    degree,
                    points,
                    spans,
                    weights,
                }
            })
    })
}

impl Net {
    /// What a `BSPLINE` takes for the weight of its start: that of the blocks of the first span if they agree, else 1.
    fn start_weight(&self) -> f64 {
        let first = &self.weights[1..=self.degree];
        if first.iter().all(|w| *w == first[0]) {
            first[0]
        } else {
            1.0
        }
    }

    /// `BSPLINE` lines; the weight of the start is not in them.
    fn sinumerik(&self) -> String {
        let mut text = format!("G1 F3000\nBSPLINE SD={}\n", self.degree);
        for (k, p) in self.points.iter().enumerate().skip(1) {
            let _ = write!(text, "X{:.3} Y{:.3}", p[0], p[1]);
            if k >= self.degree {
                let _ = write!(text, " PL={:.3}", self.spans[k - self.degree]);
            }
            let _ = writeln!(text, " PW={:.4}", self.weights[k]);
        }
        text + "M30\n"
    }

    /// `G06.2` lines from the first point on.
    fn fanuc(&self) -> String {
        let mut knots = vec![0.0; self.degree + 1];
        let mut at = 0.0;
        for span in &self.spans {
            at += span;
            knots.push(at);
        }
        knots.extend(vec![at; self.degree]);
        let [x, y] = self.points[0];
        let mut text = format!("G90 G1 F3000 X{x:.3} Y{y:.3}\n");
        for (k, p) in self.points.iter().enumerate() {
            let front = if k == 0 {
                format!("G06.2 P{} ", self.degree + 1)
            } else {
                String::new()
            };
            let weight = self.weights[k];
            let _ = writeln!(
                text,
                "{front}K{:.3} X{:.3} Y{:.3} R{weight:.4}",
                knots[k], p[0], p[1]
            );
        }
        for knot in &knots[self.points.len()..] {
            let _ = writeln!(text, "K{knot:.3}");
        }
        text + "G01\nM30\n"
    }
}

fn places(setup: &Setup, run: &Run) -> Vec<Point> {
    let config = machine(setup);
    run.ticks
        .iter()
        .filter(|t| t.moving)
        .map(|t| laws::place(&config, t))
        .collect()
}

/// Largest distance of a point of `path` from the polyline `other`.
fn apart(path: &[Point], other: &[Point]) -> f64 {
    let away = |q: &Point, a: &Point, b: &Point| {
        let d: Point = core::array::from_fn(|i| b[i] - a[i]);
        let square: f64 = d.iter().map(|x| x * x).sum();
        let dot: f64 = (0..AXES).map(|i| d[i] * (q[i] - a[i])).sum();
        let t = if square > 0.0 {
            (dot / square).clamp(0.0, 1.0)
        } else {
            0.0
        };
        distance(q, &core::array::from_fn(|i| a[i] + t * d[i]))
    };
    path.iter()
        .step_by(7)
        .map(|q| {
            other
                .windows(2)
                .map(|pair| away(q, &pair[0], &pair[1]))
                .fold(f64::INFINITY, f64::min)
        })
        .fold(0.0, f64::max)
}

fn fail(broken: String) -> TestCaseError {
    TestCaseError::fail(broken)
}

proptest! {
    #![proptest_config(cases(50))]

    #[test]
    fn the_path_is_the_rational_spline(text in program(spline(), 3)) {
        hold(&setup(), &text, |config, run, curves| {
            let tolerance = f64::from(config.curve_tolerance) + ROUNDING;
            laws::follows(config, run, curves, tolerance).map(|_| ())
        }).map_err(fail)?;
    }

    #[test]
    fn a_rational_spline_keeps_the_limits_and_ends_exactly(text in program(spline(), 3)) {
        hold(&setup(), &text, |config, run, curves| {
            laws::stays_within_limits(config, run, &laws::brisk_lines(curves), 0.005)?;
            laws::meets_the_points(config, run, curves)?;
            let end = curves.last().and_then(|curve| curve.end).unwrap_or_default();
            laws::ends_exactly_on(run, &laws::bits(config, &end))
        }).map_err(fail)?;
    }

    #[test]
    fn a_fanuc_curve_is_the_rational_spline_on_its_knots(net in net()) {
        let text = net.fanuc();
        let config = machine(&fanuc());
        let run = ran_on(&fanuc(), &text).map_err(fail)?;
        let tolerance = f64::from(config.curve_tolerance) + ROUNDING;
        stays_on(&config, &run, &path_on(&fanuc(), &text), tolerance)
            .map_err(|broken| fail(format!("{broken}\n{text}")))?;
    }

    #[test]
    fn equal_knots_inside_a_curve_leave_a_span_out(net in net(), double in 0_usize..8) {
        let mut net = net;
        // Neither the first nor the last span: those equal knots belong to the ends.
        let last = net.spans.len() - 1;
        prop_assume!(last >= 2);
        net.spans[1 + double % (last - 1)] = 0.0;
        let text = net.fanuc();
        let config = machine(&fanuc());
        let run = ran_on(&fanuc(), &text).map_err(fail)?;
        let tolerance = f64::from(config.curve_tolerance) + ROUNDING;
        stays_on(&config, &run, &path_on(&fanuc(), &text), tolerance)
            .map_err(|broken| fail(format!("{broken}\n{text}")))?;
    }

    #[test]
    fn both_dialects_make_the_same_steps_of_a_net(net in net()) {
        let mut net = net;
        net.weights[0] = net.start_weight();
        let sinumerik = ran_on(&Setup::default(), &net.sinumerik()).map_err(fail)?;
        let fanuc_run = ran_on(&fanuc(), &net.fanuc()).map_err(fail)?;
        // Weights relative to the first are rounded once more, so not to the bit.
        let off = apart(&places(&fanuc(), &fanuc_run), &places(&Setup::default(), &sinumerik));
        prop_assert!(off < 3e-4, "{} apart\n{}\n{}", off, net.sinumerik(), net.fanuc());
        prop_assert_eq!(sinumerik.end(), fanuc_run.end());
    }

    #[test]
    fn the_path_stays_in_the_hull_of_the_control_points(net in net()) {
        let run = ran_on(&Setup::default(), &net.sinumerik()).map_err(fail)?;
        // A point is in the hull if no direction separates it from all points.
        for p in places(&Setup::default(), &run).iter().step_by(5) {
            for k in 0..36 {
                let (sin, cos) = (f64::from(k) * 10.0_f64.to_radians()).sin_cos();
                let far = net.points.iter().map(|q| q[0] * cos + q[1] * sin).fold(f64::MIN, f64::max);
                prop_assert!(p[0] * cos + p[1] * sin <= far + 2e-4, "{:?}\n{}", p, net.sinumerik());
            }
        }
    }

    #[test]
    fn equal_weights_change_nothing(net in net()) {
        let mut equal = net;
        let weight = equal.weights[0];
        equal.weights.fill(weight);
        let text = equal.sinumerik();
        let none = text.replace(&format!(" PW={weight:.4}"), "");
        let with = ran_on(&Setup::default(), &text).map_err(fail)?;
        let without = ran_on(&Setup::default(), &none).map_err(fail)?;
        prop_assert_eq!(with.digest, without.digest, "{}", text);
    }

    #[test]
    fn the_curve_from_its_other_end_is_the_same_curve(net in net()) {
        let mut back = net.clone();
        back.points.reverse();
        back.spans.reverse();
        back.weights.reverse();
        let there = ran_on(&fanuc(), &net.fanuc()).map_err(fail)?;
        let here = ran_on(&fanuc(), &back.fanuc()).map_err(fail)?;
        // The straight way to the other end is line 1.
        let config = machine(&fanuc());
        let here: Vec<Point> = here.ticks.iter().filter(|t| t.moving && t.block > 1)
            .map(|t| laws::place(&config, t)).collect();
        // Chords of the ticks leave the curve by v^2 / (8 r) per tick: 50 mm/s, 5 kHz, down to a radius of 0.1 mm.
        let off = apart(&places(&fanuc(), &there), &here);
        prop_assert!(off < 5e-4, "{} apart\n{}\n{}", off, net.fanuc(), back.fanuc());
    }

    #[test]
    fn a_moved_net_makes_the_moved_curve(net in net(), by in [-50_i32..50, -50_i32..50]) {
        let mut moved = net.clone();
        for p in &mut moved.points {
            p[0] += f64::from(by[0]);
            p[1] += f64::from(by[1]);
        }
        let text = moved.sinumerik().replacen("G1 F3000\n", &format!("G1 F3000 X{} Y{}\n", by[0], by[1]), 1);
        let here = ran_on(&Setup::default(), &net.sinumerik()).map_err(fail)?;
        let there = ran_on(&Setup::default(), &text).map_err(fail)?;
        let config = machine(&Setup::default());
        let back: Vec<Point> = there.ticks.iter().filter(|t| t.moving && t.block > 1)
            .map(|t| laws::place(&config, t))
            .map(|p| [p[0] - f64::from(by[0]), p[1] - f64::from(by[1]), p[2], p[3], p[4]])
            .collect();
        let off = apart(&places(&Setup::default(), &here), &back);
        prop_assert!(off < 5e-4, "{} apart\n{}", off, text);
    }
}

/// Values of `tests/oracle/nurbs.py`: program by program, points on the curve in order.
#[test]
fn the_path_passes_the_points_scipy_and_exact_fractions_give() {
    let table = include_str!("../oracle/data/nurbs.csv");
    let config = machine(&Setup::default());
    let mut programs = 0;
    let mut rows = table
        .lines()
        .filter(|line| !line.starts_with('#'))
        .peekable();
    while let Some(head) = rows.next() {
        let (dialect, text) = head.split_once(',').expect("a program");
        let setup = if dialect == "fanuc" {
            fanuc()
        } else {
            Setup::default()
        };
        let text = text.replace("\\n", "\n");
        let run = ran_on(&setup, &text).unwrap_or_else(|broken| panic!("{broken}"));
        let path = places(&setup, &run);
        let (mut at, mut points) = (0, 0);
        while let Some(row) = rows.next_if(|row| row.starts_with("point,")) {
            let numbers: Vec<f64> = row
                .split(',')
                .skip(1)
                .map(|n| n.parse().expect("number"))
                .collect();
            let point = [numbers[0], numbers[1], numbers[2], 0.0, 0.0];
            let near = |k: &usize| distance(&path[*k], &point);
            let k = (at..path.len())
                .min_by(|a, b| near(a).total_cmp(&near(b)))
                .expect("ticks");
            let (low, high) = (k.saturating_sub(1), (k + 1).min(path.len() - 1));
            // Across the chord of the neighbouring ticks, that is, whatever the place along it.
            let off = apart(&[point], &path[low..=high]);
            let tolerance = f64::from(config.curve_tolerance) + 2e-4;
            assert!(off < tolerance, "{off} off {point:?}\n{text}");
            (at, points) = (low, points + 1);
        }
        assert!(points >= 5, "{text}");
        programs += 1;
    }
    assert!(programs >= 6);
}
