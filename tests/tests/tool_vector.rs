//! `XH YH ZH` and the length of the tool: the axes a program text leads, against an oracle of its own.
//!
//! The oracle evaluates both B-splines by de Boor's recursion (C. de Boor, "A Practical Guide to Splines", ch. X, in
//! homogeneous coordinates), takes their difference for the direction of the tool, and inverts the head in closed form:
//! tilt by `acos`, turn by `atan2`, followed from where the axes stand. It shares nothing with the core.

use std::collections::BTreeSet;
use std::fmt::Write;

use pentaspline::config::{Config, Head, ToolData};
use pentaspline::units::{AXES, NANO_PER_UNIT};
use proptest::prelude::*;
use whole_product_tests::campaign::{cases, machine, ran};
use whole_product_tests::drive::{drive, Run, Script, Tick};
use whole_product_tests::laws;
use whole_product_tests::oracle::read::Setup;
use whole_product_tests::oracle::spline::Point;

type Vector = [f64; 3];

/// Beside the tolerance of the curve, mm and degrees: rounding of slopes to 24 bits, and control vectors in single
/// precision: half a unit in the last place of 50 to 120 mm turns them by 5e-6 degrees, and the turn by as much over the
/// sine of the tilt, 0.17 or more here.
const ROUNDING: f64 = 2e-5 + 3e-5;

/// Polyline points per knot span. Chords miss the curve by 1/8 of its second derivative over the square of this; that
/// is below 1000 mm or degrees for the splines here: 1e-5.
const DENSE: usize = 3500;

/// Zero offset `G55`, length of tool 1.
const ZERO: [i64; AXES] = [1_500_000, -2_250_000, 125_000, 0, 0];
const LENGTH: i64 = 37_250_000;

/// The built-in machine with `head`, rotary axes fast enough for short runs and free to turn, and tool 1.
fn headed(head: Head) -> Config {
    let mut config = machine(&Setup::default());
    config.head = head;
    config.zero_offsets[1] = ZERO;
    config.tools[0] = ToolData {
        number: 1,
        name: [0; 16],
        radius: 0,
        length: LENGTH,
    };
    if head == Head::CB {
        config.axes[3].letter = b'B';
    }
    for axis in &mut config.axes[3..] {
        (axis.v_max, axis.a_max, axis.j_max) = (100.0, 2000.0, 40_000.0);
        (axis.travel_min, axis.travel_max) = (-2000 * NANO_PER_UNIT, 2000 * NANO_PER_UNIT);
    }
    config
}

/// Unit vector of the tool, angles in degrees; the formulas of docs/language.md and of the machine files.
fn pointing(head: Head, [tilt, turn]: [f64; 2]) -> Vector {
    let ((s, up), (sin, cos)) = (tilt.to_radians().sin_cos(), turn.to_radians().sin_cos());
    match head {
        Head::CA => [s * sin, -s * cos, up],
        _ => [s * cos, s * sin, up],
    }
}

fn norm(v: &Vector) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Angle between two directions, degrees.
fn between(a: &Vector, b: &Vector) -> f64 {
    let d: Vector = core::array::from_fn(|k| a[k] / norm(a) - b[k] / norm(b));
    2.0 * (norm(&d) / 2.0).asin().to_degrees()
}

/// Angles that point along `v`, of both ways to do so that nearest to `near`.
fn angles(head: Head, v: &Vector, near: [f64; 2]) -> [f64; 2] {
    let tilt = (v[2] / norm(v)).acos().to_degrees();
    let turn = match head {
        Head::CA => v[0].atan2(-v[1]),
        _ => v[1].atan2(v[0]),
    }
    .to_degrees();
    let close = |angle: f64, to: f64| angle - 360.0 * ((angle - to) / 360.0).round();
    let ways = [[tilt, turn], [-tilt, turn + 180.0]]
        .map(|[tilt, turn]| [close(tilt, near[0]), close(turn, near[1])]);
    let miss = |way: &[f64; 2]| (way[0] - near[0]).hypot(way[1] - near[1]);
    if miss(&ways[0]) <= miss(&ways[1]) {
        ways[0]
    } else {
        ways[1]
    }
}

/// A block: point and point of the second curve (mm, programmed), `PL`, `PW`.
#[derive(Clone, Debug)]
struct Row {
    at: Vector,
    to: Vector,
    span: f64,
    weight: f64,
}

impl Row {
    fn vector(&self) -> Vector {
        core::array::from_fn(|k| self.to[k] - self.at[k])
    }
}

/// A spline with a second curve, and how the machine stands before it.
#[derive(Clone, Debug)]
struct Led {
    head: Head,
    degree: usize,
    start: Vector,
    angles: [f64; 2],
    rows: Vec<Row>,
    /// `G55`, and tool 1 in the spindle.
    moved: bool,
}

fn round(x: f64) -> f64 {
    (x * 1e4).round() / 1e4
}

impl Led {
    fn text(&self) -> String {
        let letter = if self.head == Head::CB { 'B' } else { 'A' };
        let ([x, y, z], [tilt, turn]) = (self.start, self.angles);
        let mut out = String::from(if self.moved { "T1 M6 G55\n" } else { "G54\n" });
        let _ = writeln!(
            out,
            "G0 X{x:.4} Y{y:.4} Z{z:.4} {letter}{tilt:.4} C{turn:.4}"
        );
        let _ = writeln!(out, "F3000 BSPLINE SD={}", self.degree);
        for (k, row) in (1..).zip(&self.rows) {
            let ([x, y, z], [u, v, w]) = (row.at, row.to);
            let _ = write!(out, "X{x:.4} Y{y:.4} Z{z:.4} XH={u:.4} YH={v:.4} ZH={w:.4}");
            let _ = write!(out, " PW={:.4}", row.weight);
            if k >= self.degree {
                let _ = write!(out, " PL={:.4}", row.span);
            }
            out.push('\n');
        }
        let end = &self.rows[self.rows.len() - 1];
        let _ = writeln!(out, "G1 X{:.4}\nM30", end.at[0] + 5.0);
        out
    }

    /// Machine coordinates of the programmed zero, mm.
    fn origin(&self) -> Vector {
        if !self.moved {
            return [0.0; 3];
        }
        core::array::from_fn(|k| (ZERO[k] + if k == 2 { LENGTH } else { 0 }) as f64 * 1e-6)
    }

    /// Control points `[weight, weight * point, weight * vector]`. The start has the weight of the blocks of the first
    /// span if they agree, else 1, and the vector its axes show, as long as that of the first block.
    fn net(&self) -> Vec<[f64; 7]> {
        let first = &self.rows[..self.degree];
        let weight = if first.iter().all(|row| row.weight == first[0].weight) {
            first[0].weight
        } else {
            1.0
        };
        let shown = pointing(self.head, self.angles);
        let length = norm(&first[0].vector());
        let origin = self.origin();
        let point = |weight: f64, at: &Vector, v: &Vector| {
            let mut row = [weight; 7];
            for k in 0..3 {
                row[1 + k] *= at[k] + origin[k];
                row[4 + k] *= v[k];
            }
            row
        };
        let mut net = vec![point(weight, &self.start, &shown.map(|x| x * length))];
        net.extend(
            self.rows
                .iter()
                .map(|r| point(r.weight, &r.at, &r.vector())),
        );
        net
    }

    /// Where the axes are to be along the spline, `DENSE` places per span, machine coordinates.
    fn axes(&self) -> Vec<Point> {
        let (d, net) = (self.degree, self.net());
        let mut knots = vec![0.0; d + 1];
        for row in &self.rows[d - 1..] {
            knots.push(knots[knots.len() - 1] + row.span);
        }
        knots.extend(vec![knots[knots.len() - 1]; d]);
        let (mut out, mut now) = (Vec::new(), self.angles);
        for j in d..net.len() {
            for i in 0..=DENSE {
                let t = knots[j] + (knots[j + 1] - knots[j]) * i as f64 / DENSE as f64;
                let mut p: Vec<[f64; 7]> = net[j - d..=j].to_vec();
                for level in 1..=d {
                    for k in (level..=d).rev() {
                        let (low, high) = (knots[j - d + k], knots[j + 1 + k - level]);
                        let part = (t - low) / (high - low);
                        p[k] =
                            core::array::from_fn(|c| (1.0 - part) * p[k - 1][c] + part * p[k][c]);
                    }
                }
                let [w, x, y, z, u, v, up] = p[d];
                now = angles(self.head, &[u, v, up], now);
                out.push([x / w, y / w, z / w, now[0], now[1]]);
            }
        }
        out
    }

    /// Runs the program and holds all laws of a led tool against the run.
    fn holds(&self) -> Result<Run, String> {
        let (config, text) = (headed(self.head), self.text());
        let run = ran(&config, &Script::new(&text))?;
        let broken = |what: String| format!("{what}\n{text}");
        let path = self.axes();
        // The way to the start is straight, so is the block behind the spline.
        let last = path[path.len() - 1];
        let mut behind = last;
        behind[0] = self.rows[self.rows.len() - 1].at[0] + 5.0 + self.origin()[0];
        let asked = Run {
            ticks: path
                .iter()
                .chain([&behind])
                .map(|p| tick(&config, p))
                .collect(),
            ..Run::default()
        };
        let tolerance = f64::from(config.curve_tolerance) + ROUNDING;
        laws::stays_on_the_path_of(&config, &run, &asked, tolerance).map_err(broken)?;
        laws::stays_within_limits(&config, &run, &BTreeSet::new(), 0.005).map_err(broken)?;
        // All the way, exactly in X Y Z, with the direction of the last block, and it stays in the block behind.
        let end = run.ticks.last().ok_or("nothing ran")?;
        let place = laws::place(&config, end);
        let exact = laws::bits(&config, &behind.map(|x| (x * 1e6).round() as i64));
        if end.commanded[..3] != exact[..3] {
            return Err(broken(format!("ends on {place:?} instead of {behind:?}")));
        }
        let off = (place[3] - last[3]).abs().max((place[4] - last[4]).abs());
        let direction = pointing(self.head, [place[3], place[4]]);
        let asked = self.rows[self.rows.len() - 1].vector();
        if off > ROUNDING || between(&direction, &asked) > ROUNDING {
            return Err(broken(format!(
                "angles end on {place:?} instead of {last:?}"
            )));
        }
        Ok(run)
    }
}

/// A place as a commanded position.
fn tick(config: &Config, p: &Point) -> Tick {
    let steps = |axis: usize| p[axis] * config.axes[axis].steps_per_unit.to_num::<f64>();
    Tick {
        commanded: core::array::from_fn(|axis| (steps(axis) * 4_294_967_296.0).round() as i64),
        emitted: [0; AXES],
        summed: [0; AXES],
        feed: 0.0,
        block: 0,
        moving: true,
    }
}

/// Splines whose tool leans 15 to 70 degrees to one side or the other, 50 to 120 mm long, with weights and intervals.
fn led() -> impl Strategy<Value = Led> {
    let row = (
        (-1.2_f64..1.2, 4.0_f64..12.0, -3.0_f64..3.0),
        (15.0_f64..70.0, -40.0_f64..40.0, 50.0_f64..120.0),
        (8_i32..32, 8_i32..32),
    );
    (
        (any::<bool>(), any::<bool>(), any::<bool>(), any::<bool>()),
        2_usize..4,
        -170.0_f64..170.0,
        prop::collection::vec(row, 4..8),
    )
        .prop_map(|((ca, negative, moved, weighted), degree, first, rows)| {
            let head = if ca { Head::CA } else { Head::CB };
            let side = if negative { -1.0 } else { 1.0 };
            let (mut heading, mut turn) = (0.0_f64, first);
            let start = [1.0, -2.0, 3.0];
            let angles = [side * round(rows[0].1 .0), round(turn)];
            let mut at: Vector = start;
            let rows = rows
                .into_iter()
                .map(|((bend, length, rise), (tilt, by, long), (span, weight))| {
                    heading += bend;
                    turn += by;
                    let step = [length * heading.cos(), length * heading.sin(), rise];
                    at = core::array::from_fn(|k| round(at[k] + step[k]));
                    let v = pointing(head, [side * tilt, turn]);
                    Row {
                        at,
                        to: core::array::from_fn(|k| round(at[k] + long * v[k])),
                        span: f64::from(span) / 16.0,
                        weight: if weighted {
                            f64::from(weight) / 16.0
                        } else {
                            1.0
                        },
                    }
                })
                .collect();
            Led {
                head,
                degree,
                start,
                angles,
                rows,
                moved,
            }
        })
}

proptest! {
    #![proptest_config(cases(60))]

    #[test]
    fn all_five_axes_are_on_the_two_curves(led in led()) {
        led.holds().map_err(TestCaseError::fail)?;
    }

    #[test]
    fn a_point_given_as_often_as_the_degree_is_met_with_its_own_direction(led in led()) {
        let mut led = led;
        let row = led.rows[2].clone();
        for _ in 1..led.degree {
            led.rows.insert(2, row.clone());
        }
        let run = led.holds().map_err(TestCaseError::fail)?;
        let (config, origin) = (headed(led.head), led.origin());
        let miss = |tick: &Tick| {
            let p = laws::place(&config, tick);
            let d: Vector = core::array::from_fn(|k| p[k] - row.at[k] - origin[k]);
            norm(&d).max(between(&pointing(led.head, [p[3], p[4]]), &row.vector()))
        };
        let nearest = run.ticks.iter().map(miss).fold(f64::INFINITY, f64::min);
        // As far as one tick at 50 mm/s or 100 degrees/s goes.
        prop_assert!(nearest < 0.02, "{} off {:?}\n{}", nearest, row, led.text());
    }
}

/// Full turns are counted, and the tool may lean to the other side.
#[test]
fn the_turn_goes_on_beyond_a_full_circle() {
    for (head, side) in [(Head::CA, 1.0), (Head::CB, -1.0)] {
        let start = [0.0; 3];
        let rows = (1..13).map(|k| {
            let at = [4.0 * f64::from(k), f64::from(k % 3), 0.0];
            let v = pointing(head, [side * 30.0, 50.0 * f64::from(k)]);
            Row {
                at,
                to: core::array::from_fn(|i| round(at[i] + 80.0 * v[i])),
                span: 1.0,
                weight: 1.0,
            }
        });
        let led = Led {
            head,
            degree: 3,
            start,
            angles: [side * 30.0, 0.0],
            rows: rows.collect(),
            moved: false,
        };
        let run = led.holds().unwrap_or_else(|broken| panic!("{broken}"));
        let end = laws::place(&headed(head), run.ticks.last().expect("ticks"));
        assert!(
            (end[4] - 600.0).abs() < 1e-3 && (end[3] - side * 30.0).abs() < 1e-3,
            "{end:?}"
        );
    }
}

#[test]
fn what_gives_no_direction_is_refused_by_its_code() {
    let point = "XH=0 YH=-30 ZH=100";
    for (head, text, code) in [
        (Head::None, format!("F600 BSPLINE X1 {point}\n"), 144),
        (Head::CA, "F600 BSPLINE X1 XH=0 ZH=100\n".to_owned(), 145),
        (Head::CB, format!("F600 BSPLINE X1 {point}\nX2\n"), 145),
        (Head::CA, "F600 BSPLINE X1 XH=1 YH=0 ZH=0\n".to_owned(), 167),
        // From the pole to another side than C looks at.
        (
            Head::CA,
            "F600 BSPLINE X1 XH=31 YH=0 ZH=100\nX2 XH=42 YH=0 ZH=100\nX3 XH=53 YH=0 ZH=100\nG1 X9\n".to_owned(),
            168,
        ),
    ] {
        let run = drive(&headed(head), &Script::new(&text));
        let found = run.remarks().find_map(|line| line.strip_prefix("error:"));
        assert_eq!(found, Some(code.to_string().as_str()), "{text}{}", run.output);
    }
}

/// End of each program in nanometres: zero offset, length along the normal of the plane, and the programmed value.
#[test]
fn the_length_of_the_tool_is_added_along_the_normal() {
    let [x, y, z, ..] = ZERO;
    for (text, end) in [
        (
            "T1 M6\nG0 X10 Y5 Z2\n",
            [10_000_000, 5_000_000, 2_000_000 + LENGTH],
        ),
        (
            "T1 M6\nG18 G0 X10 Y5 Z2\n",
            [10_000_000, 5_000_000 + LENGTH, 2_000_000],
        ),
        (
            "T1 M6\nG19 G0 X10 Y5 Z2\n",
            [10_000_000 + LENGTH, 5_000_000, 2_000_000],
        ),
        (
            "T1 M6\nG55 G0 X10 Y5 Z2\n",
            [10_000_000 + x, 5_000_000 + y, 2_000_000 + z + LENGTH],
        ),
        // Axes that are not named stay; increments have no length.
        ("T1 M6\nG0 X10\n", [10_000_000, 0, 0]),
        ("T1 M6\nG91 G0 X10 Z2\n", [10_000_000, 0, 2_000_000]),
        ("T1 M6\nG0 Z2\nG91 Z-1.5\n", [0, 0, 500_000 + LENGTH]),
        // Selected only, switched off, taken out, measured again.
        ("T1\nG0 Z2\n", [0, 0, 2_000_000]),
        ("T1 M6\nD0\nG0 Z2\n", [0, 0, 2_000_000]),
        ("T1 M6\nD0\nD1 G0 Z2\n", [0, 0, 2_000_000 + LENGTH]),
        ("T1 M6\nG0 Z2\nT0 M6\nZ2\n", [0, 0, 2_000_000]),
        (
            "G10 L1 P1 R0 Z-12.3456\nT1 M6\nG0 Z2\n",
            [0, 0, 2_000_000 - 12_345_600],
        ),
        // A circle in the plane and its height; inch.
        (
            "T1 M6\nG1 F2000 Z1\nG3 X0 Y0 Z-1 I5 J0\n",
            [0, 0, LENGTH - 1_000_000],
        ),
        (
            "T1 M6\nG70 G0 X1 Z1\n",
            [25_400_000, 0, 25_400_000 + LENGTH],
        ),
    ] {
        let config = headed(Head::CA);
        let text = format!("{text}M30\n");
        let run = ran(&config, &Script::new(&text)).unwrap_or_else(|broken| panic!("{broken}"));
        let target = core::array::from_fn(|axis| end.get(axis).copied().unwrap_or(0));
        laws::ends_exactly_on(&run, &laws::bits(&config, &target))
            .unwrap_or_else(|broken| panic!("{broken}\n{text}"));
    }
}
