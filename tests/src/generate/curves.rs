//! Random programs of arcs, helices, polynomials, rational splines, frames and dimensions: what [`super::program`] lacks.
//!
//! Every curve is written with six decimals and has no cusp: arcs are computed from their centre, polynomials go forward
//! in their first axis, control polygons never turn back on themselves.

use std::f64::consts::TAU;
use std::fmt::Write;

use proptest::prelude::*;

/// `G54` to `G57` of the machine these programs are for, 1e-6 mm or degree.
pub const OFFSETS: [[i64; 5]; 4] = [
    [0; 5],
    [1_500_000, -2_250_000, 125_000, 0, 500_000],
    [-10_000_000, 3_333_333, 0, 250_000, 0],
    [7, -7, 1, 0, 0],
];

/// Bytes of a physical line.
const LINE_MAX: usize = 96;

/// One piece of a program.
#[derive(Clone, Debug)]
pub enum Curve {
    /// Straight, `G0` or `G1`: fractions of 30 mm.
    Line(bool, [f64; 3]),
    /// Arc by its centre.
    Centre {
        /// 0 to 2: `G17` to `G19`.
        plane: usize,
        /// `G2`
        clockwise: bool,
        /// mm
        radius: f64,
        /// Angle of the start seen from the centre, and angle to the end, rad.
        angles: [f64; 2],
        /// `TURN`
        turns: u32,
        /// Way along the normal, mm, and of axis C, degrees.
        along: [f64; 2],
        /// Centre in absolute coordinates.
        absolute: bool,
    },
    /// Arc by its radius: plane, clockwise, way to the end, radius as a multiple of half the chord (sign: the long way).
    Radius(usize, bool, [f64; 2], f64),
    /// `POLY`: size in mm, `PL`, coefficients as fractions, denominator, few terms.
    Polynomial(f64, f64, [[f64; 4]; 3], Option<[f64; 3]>, bool),
    /// Rational B-spline: degree, points as (turn, length, interval, weight).
    Spline(usize, Vec<(f64, f64, f64, f64)>),
    /// `G54` to `G57`, `G500`.
    Frame(usize),
    /// Spelling of the next coordinates: `G90`, `G91`, `AC IC`.
    Dimension(u8),
    /// A word that changes no curve.
    Word(&'static str),
}

fn signed(low: f64, high: f64) -> impl Strategy<Value = f64> + Clone {
    (low..high, any::<bool>()).prop_map(|(x, minus)| if minus { -x } else { x })
}

/// Log-uniform between 10^a and 10^b.
fn magnitude(a: f64, b: f64) -> impl Strategy<Value = f64> + Clone {
    (a..b).prop_map(|x| 10_f64.powf(x))
}

/// Arcs and helices.
pub fn arc() -> impl Strategy<Value = Curve> {
    prop_oneof![
        3 => (
            0_usize..3,
            any::<bool>(),
            magnitude(-1.5, 1.6),
            [0.0..TAU, 0.05..6.2],
            prop_oneof![4 => Just(0_u32), 1 => 1_u32..4],
            [prop_oneof![2 => Just(0.0), 1 => -3.0..3.0], prop_oneof![4 => Just(0.0), 1 => -0.2..0.2]],
            any::<bool>(),
        )
            .prop_map(|(plane, clockwise, radius, angles, turns, along, absolute)| Curve::Centre {
                plane, clockwise, radius, angles, turns, along, absolute,
            }),
        1 => (0_usize..3, any::<bool>(), [signed(0.05, 15.0), signed(0.05, 15.0)], signed(1.02, 4.0))
            .prop_map(|(plane, clockwise, by, radius)| Curve::Radius(plane, clockwise, by, radius)),
    ]
}

/// `POLY` blocks.
pub fn polynomial() -> impl Strategy<Value = Curve> {
    let part = || [-1.0..1.0, -1.0..1.0, -1.0..1.0, -1.0..1.0];
    let under = prop_oneof![
        2 => Just(None),
        1 => [0.7..1.5, -0.2..0.2, -0.1..0.1].prop_map(Some),
    ];
    let sized = (magnitude(-0.5, 1.5), prop_oneof![Just(1.0), 0.2..8.0]);
    (sized, [part(), part(), part()], under, any::<bool>()).prop_map(
        |((size, length), parts, under, short)| {
            Curve::Polynomial(size, length, parts, under, short)
        },
    )
}

/// Rational B-splines on uneven knot intervals.
pub fn spline() -> impl Strategy<Value = Curve> {
    let weight = prop_oneof![2 => Just(1.0), 3 => 0.2..3.0];
    let interval = prop_oneof![Just(1.0), 0.3..3.0];
    (2_usize..4, 1.0..15.0).prop_flat_map(move |(degree, size)| {
        let point = (
            -1.6..1.6,
            0.5 * size..1.5 * size,
            interval.clone(),
            weight.clone(),
        );
        (Just(degree), prop::collection::vec(point, degree..12))
            .prop_map(|(degree, points)| Curve::Spline(degree, points))
    })
}

/// Anything.
pub fn any_curve() -> impl Strategy<Value = Curve> {
    prop_oneof![
        2 => (any::<bool>(), [signed(0.01, 1.0), signed(0.01, 1.0), signed(0.01, 1.0)])
            .prop_map(|(rapid, by)| Curve::Line(rapid, by)),
        4 => arc(),
        3 => polynomial(),
        3 => spline(),
        1 => (0_usize..5).prop_map(Curve::Frame),
        2 => (0_u8..3).prop_map(Curve::Dimension),
        1 => prop_oneof![
            Just("M8"), Just("G60"), Just("G64"), Just("SOFT"), Just("BRISK"), Just("S1000 M3"), Just("F2500"),
            Just("F600"), Just("G601"), Just("MSG(\"here\")"), Just("G4 F0.02"),
        ].prop_map(Curve::Word),
    ]
}

/// A program of up to `most` of `curve`.
pub fn program(curve: impl Strategy<Value = Curve>, most: usize) -> impl Strategy<Value = String> {
    prop::collection::vec(curve, 1..=most).prop_map(|curves| write(&curves))
}

/// Prints 1e-6 exactly.
fn decimal(nano: i64) -> String {
    let sign = if nano < 0 { "-" } else { "" };
    let text = format!(
        "{sign}{}.{:06}",
        nano.abs() / 1_000_000,
        nano.abs() % 1_000_000
    );
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

fn nano(mm: f64) -> i64 {
    (mm * 1e6).round() as i64
}

/// Where the program stands.
struct Writer {
    text: String,
    /// Machine coordinates.
    at: [i64; 5],
    frame: Option<usize>,
    dimension: u8,
    heading: f64,
}

impl Writer {
    fn offset(&self, axis: usize) -> i64 {
        self.frame.map_or(0, |frame| OFFSETS[frame][axis])
    }

    /// One coordinate, spelled as the dimension in force has it.
    fn word(&self, axis: usize, target: i64) -> String {
        let letter = ["X", "Y", "Z", "A", "C"][axis];
        let (absolute, by) = (target - self.offset(axis), target - self.at[axis]);
        match (self.dimension, (absolute + by) % 3) {
            (0, 0) => format!(" {letter}=AC({})", decimal(absolute)),
            (0, _) => format!(" {letter}{}", decimal(absolute)),
            (1, _) => format!(" {letter}{}", decimal(by)),
            (_, 0) => format!(" {letter}=IC({})", decimal(by)),
            (_, _) => format!(" {letter}AC{}", decimal(absolute)),
        }
    }

    fn words(&self, target: &[i64; 5]) -> String {
        (0..5)
            .filter(|axis| target[*axis] != self.at[*axis])
            .map(|axis| self.word(axis, target[axis]))
            .collect()
    }

    /// A line that ends on `target`.
    fn line(&mut self, front: &str, target: [i64; 5], behind: &str) {
        let words = self.words(&target);
        let mut line = format!("{front}{words}{behind}");
        if line.len() > LINE_MAX {
            // The spelling of the wire, glued.
            for (long, short) in [("=AC(", "AC"), ("=IC(", "IC"), (")", ""), (" ", "")] {
                line = line.replace(long, short);
            }
        }
        let _ = writeln!(self.text, "{line}");
        self.at = target;
    }

    /// Turns towards the middle of the travel where the program has gone far.
    fn direction(&self, sign: f64, axis: usize) -> f64 {
        if self.at[axis].abs() > 120_000_000 {
            -(self.at[axis].signum() as f64)
        } else {
            sign
        }
    }

    fn go_home(&mut self) {
        if self.at.iter().take(3).any(|x| x.abs() > 120_000_000) {
            let mut target = self.at;
            target[..3].fill(0);
            self.line("G0", target, "");
        }
    }
}

fn write(curves: &[Curve]) -> String {
    let mut w = Writer {
        text: String::from("G90 G64 SOFT\nG1 F3000\n"),
        at: [0; 5],
        frame: Some(0),
        dimension: 0,
        heading: 0.3,
    };
    for curve in curves {
        w.go_home();
        match curve {
            Curve::Line(rapid, by) => {
                let mut target = w.at;
                for axis in 0..3 {
                    let way = 30.0 * by[axis].abs() * w.direction(by[axis].signum(), axis);
                    target[axis] += nano(way);
                }
                w.line(if *rapid { "G0" } else { "G1" }, target, "");
            }
            Curve::Centre {
                plane,
                clockwise,
                radius,
                angles,
                turns,
                along,
                absolute,
            } => {
                let [a, b, n] = [[0, 1, 2], [2, 0, 1], [1, 2, 0]][*plane];
                let (sin, cos) = angles[0].sin_cos();
                let centre = [w.at[a] - nano(radius * cos), w.at[b] - nano(radius * sin)];
                // From the rounded centre, so that the radii agree to the last digit.
                let d = [(w.at[a] - centre[0]) as f64, (w.at[b] - centre[1]) as f64];
                let sweep = if *clockwise { -angles[1] } else { angles[1] };
                let (sin, cos) = sweep.sin_cos();
                let mut target = w.at;
                target[a] = centre[0] + (d[0] * cos - d[1] * sin).round() as i64;
                target[b] = centre[1] + (d[0] * sin + d[1] * cos).round() as i64;
                target[n] += nano(along[0]);
                target[4] += nano(along[1]);
                let letters = ["I", "J", "K"];
                let mut behind = String::new();
                for (k, axis) in [a, b].into_iter().enumerate() {
                    let letter = letters[axis];
                    let _ = if *absolute {
                        write!(
                            behind,
                            " {letter}=AC({})",
                            decimal(centre[k] - w.offset(axis))
                        )
                    } else {
                        write!(behind, " {letter}{}", decimal(centre[k] - w.at[axis]))
                    };
                }
                if *turns > 0 {
                    let _ = write!(behind, " TURN={turns}");
                }
                let g = if *clockwise { 2 } else { 3 };
                w.line(&format!("G{} G{g}", 17 + plane), target, &behind);
            }
            Curve::Radius(plane, clockwise, by, radius) => {
                let [a, b, _] = [[0, 1, 2], [2, 0, 1], [1, 2, 0]][*plane];
                let mut target = w.at;
                target[a] += nano(by[0]);
                target[b] += nano(by[1]);
                let half = by[0].hypot(by[1]) / 2.0;
                let g = if *clockwise { 2 } else { 3 };
                let behind = format!(" CR={}", decimal(nano(radius * half)));
                w.line(&format!("G{} G{g}", 17 + plane), target, &behind);
            }
            Curve::Polynomial(size, length, parts, under, short) => {
                w.polynomial(*size, *length, parts, under.as_ref(), *short);
            }
            Curve::Spline(degree, points) => {
                for (k, (turn, length, interval, weight)) in points.iter().enumerate() {
                    w.heading += turn;
                    let mut target = w.at;
                    target[0] += nano(length * w.heading.cos());
                    target[1] += nano(length * w.heading.sin());
                    target[2] += nano(0.1 * length * turn);
                    let front = if k == 0 {
                        format!("BSPLINE SD={degree}")
                    } else {
                        String::new()
                    };
                    let mut behind = String::new();
                    if *interval != 1.0 {
                        let _ = write!(behind, " PL={interval:.4}");
                    }
                    if *weight != 1.0 {
                        let _ = write!(behind, " PW={weight:.4}");
                    }
                    w.line(&front, target, &behind);
                }
            }
            Curve::Frame(number) => {
                w.frame = (*number < 4).then_some(*number);
                let g = if *number < 4 { 54 + number } else { 500 };
                let _ = writeln!(w.text, "G{g}");
            }
            Curve::Dimension(dimension) => {
                w.dimension = *dimension;
                let g = if *dimension == 1 { 91 } else { 90 };
                let _ = writeln!(w.text, "G{g}");
            }
            Curve::Word(word) => {
                let _ = writeln!(w.text, "{word}");
            }
        }
    }
    w.text.push_str("M30\n");
    w.text
}

impl Writer {
    /// X goes forward all the time: its higher coefficients stay below a tenth of its way.
    fn polynomial(
        &mut self,
        size: f64,
        length: f64,
        parts: &[[f64; 4]; 3],
        under: Option<&[f64; 3]>,
        short: bool,
    ) {
        // Terms up to a2 in X and a3 in Y fit one line.
        let kept = if short { [1, 2, 0] } else { [4; 3] };
        let forward = self.direction(1.0, 0);
        let mut target = self.at;
        let mut coefficients = [[0.0; 4]; 3];
        for axis in 0..3 {
            let share = if axis == 0 { 0.08 } else { 0.8 };
            let way = if axis == 0 {
                forward * size
            } else {
                size * parts[axis][0]
            };
            target[axis] += nano(way);
            for (k, part) in (2..).zip(parts[axis]).take(kept[axis]) {
                coefficients[axis][k - 2] =
                    share * size * part / (k as f64 - 1.0) / length.powi(k as i32);
            }
        }
        let under = under.map(|u| [u[0], u[1] / length.powi(2), u[2] / length.powi(3)]);
        if let Some(under) = under {
            // The curve is that of the printed coefficients about the place it starts from: P = start + N / D needs
            // the start times the denominator in the numerators.
            for axis in 0..3 {
                let start = (self.at[axis] - self.offset(axis)) as f64 * 1e-6;
                coefficients[axis][0] += start * under[1];
                coefficients[axis][1] += start * under[2];
            }
        }
        let letters = ["X", "Y", "Z"];
        let list = |numbers: &[f64]| -> Vec<String> {
            let used = numbers.iter().rposition(|n| *n != 0.0).map_or(0, |k| k + 1);
            numbers[..used].iter().map(|n| format!("{n:.9}")).collect()
        };
        let closing = format!(" PL={}", decimal(nano(length)));
        let mut brackets = String::from("POLY");
        for (axis, letter) in letters.iter().enumerate() {
            let end = match self.dimension {
                1 => target[axis] - self.at[axis],
                _ => target[axis] - self.offset(axis),
            };
            let row = [vec![decimal(end)], list(&coefficients[axis])].concat();
            let _ = write!(brackets, " PO[{letter}]=({})", row.join(","));
        }
        if let Some(under) = under {
            let _ = write!(brackets, " PO[]=({})", list(&under).join(","));
        }
        brackets += &closing;
        if brackets.len() <= LINE_MAX {
            let _ = writeln!(self.text, "{brackets}");
        } else {
            self.text += "POLY\n";
            for (letter, row) in letters.iter().zip(&coefficients) {
                let row = list(row);
                if !row.is_empty() {
                    let _ = writeln!(self.text, "PO{letter} Q{}", row.join(" Q"));
                }
            }
            if let Some(under) = under {
                let _ = writeln!(self.text, "POD Q{}", list(&under).join(" Q"));
            }
            // All three axes are named, moved or not.
            let words: String = (0..3).map(|axis| self.word(axis, target[axis])).collect();
            let _ = writeln!(self.text, "{words}{closing}");
        }
        self.at = target;
    }
}
