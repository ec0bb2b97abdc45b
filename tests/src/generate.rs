//! Random programs: mixtures of everything that moves, in text as a post-processor would write it.
//!
//! Coordinates are written with three decimals. Splines never repeat a point and never turn back on themselves
//! in a line (a cusp is an error of the program, not of the path), lengths run from 0.001 to 30 mm, feeds from
//! 500 to 20000 mm/min; rotary axes move by degrees, because theirs run at one degree per second.

pub mod curves;

use std::fmt::Write;

use proptest::prelude::*;

/// One piece of a program.
#[derive(Clone, Debug)]
pub enum Piece {
    /// Straight moves: rapid or not, exact stop, moves.
    Lines(bool, bool, Vec<Step>),
    /// Spline: keyword, begin and end condition, `SD`, steps with `PL`.
    Spline(
        &'static str,
        &'static str,
        &'static str,
        u8,
        Vec<(Step, u8)>,
    ),
    /// A line that moves nothing.
    Word(&'static str),
    /// `F`, mm/min.
    Feed(u32),
}

/// A step: length in um, direction as fractions of it per linear axis, rotary parts in 0.001 degree.
#[derive(Clone, Debug)]
pub struct Step {
    length: f64,
    turn: f64,
    climb: f64,
    rotary: [i64; 2],
}

/// Log-uniform between 10^a and 10^b.
fn magnitude(a: f64, b: f64) -> impl Strategy<Value = f64> + Clone {
    (a..b).prop_map(|x| 10_f64.powf(x))
}

fn rotary() -> impl Strategy<Value = [i64; 2]> + Clone {
    prop_oneof![
        3 => Just([0, 0]),
        1 => [-900_i64..900, -900_i64..900],
        1 => [-20_i64..20, 0_i64..1],
    ]
}

fn step(low: f64, high: f64, bend: f64) -> impl Strategy<Value = Step> + Clone {
    (magnitude(low, high), -bend..bend, -0.5..0.5, rotary()).prop_map(
        |(length, turn, climb, rotary)| Step {
            length,
            turn,
            climb,
            rotary,
        },
    )
}

/// Points of one spline: lengths of one order of magnitude, turns below 115 degrees.
fn spline_steps() -> impl Strategy<Value = Vec<(Step, u8)>> {
    let sized = |low: f64, high: f64| prop::collection::vec((step(low, high, 2.0), 0_u8..4), 3..14);
    prop_oneof![
        sized(0.5, 1.5),
        sized(2.0, 3.0),
        sized(3.3, 4.2),
        sized(4.0, 4.6)
    ]
}

fn piece() -> impl Strategy<Value = Piece> {
    let condition = |auto, nat, tan| prop_oneof![Just(auto), Just(nat), Just(tan)];
    prop_oneof![
        3 => (any::<bool>(), prop::bool::weighted(0.2), prop::collection::vec(step(0.0, 4.5, 3.1), 1..5))
            .prop_map(|(rapid, stop, steps)| Piece::Lines(rapid, stop, steps)),
        1 => (Just(false), Just(false), prop::collection::vec(step(0.0, 2.0, 0.3), 5..40))
            .prop_map(|(rapid, stop, steps)| Piece::Lines(rapid, stop, steps)),
        5 => (
            prop_oneof![Just("ASPLINE"), Just("BSPLINE"), Just("CSPLINE")],
            condition("BAUTO", "BNAT", "BTAN"),
            condition("EAUTO", "ENAT", "ETAN"),
            2_u8..4,
            spline_steps(),
        )
            .prop_map(|(kind, begin, end, degree, steps)| Piece::Spline(kind, begin, end, degree, steps)),
        3 => prop_oneof![
            Just("G60"), Just("G64"), Just("SOFT"), Just("BRISK"), Just("M8"), Just("M9"), Just("G4 F0.05"),
            Just("S1000 M3"), Just("M0"), Just("T1 M6"), Just(""), Just("; nothing"),
        ].prop_map(Piece::Word),
        2 => magnitude(2.7, 4.3).prop_map(|f| Piece::Feed(f as u32)),
    ]
}

/// A whole program of up to `pieces` pieces.
pub fn program(pieces: usize) -> impl Strategy<Value = String> {
    prop::collection::vec(piece(), 1..=pieces).prop_map(|pieces| write(&pieces))
}

/// At most 5 degrees per mm: a tangent taken over from a steeper step (`BTAN`) would swing a spline out of the travel.
fn turned(rotary: i64, length: f64) -> i64 {
    let most = (5.0 * length) as i64 + 1;
    rotary.clamp(-most, most)
}

/// Writes the pieces out.
fn write(pieces: &[Piece]) -> String {
    let mut text = String::from("N10 G54 G90 G64 SOFT\nG1 F1500\n");
    let mut at = [0_i64; 5];
    let mut heading = 0.0_f64;
    let mut coordinates = |step: &Step| {
        heading += step.turn;
        // Coarse steps may end anywhere in the travel; the way home is always inside it.
        let mut length = step.length;
        if at[..3].iter().any(|x| x.abs() > 150_000) {
            let home = (-at[1] as f64).atan2(-at[0] as f64);
            heading = home;
            length = length.max(1.0);
        }
        let climb = if at[2].abs() > 100_000 {
            -0.5 * at[2].signum() as f64
        } else {
            step.climb
        };
        let by = [
            (length * heading.cos()).round() as i64,
            (length * heading.sin()).round() as i64,
            (length * climb).round() as i64,
            turned(step.rotary[0], length),
            turned(step.rotary[1], length),
        ];
        if by[..3] == [0, 0, 0] {
            at[0] += 1;
        }
        for (x, d) in at.iter_mut().zip(by) {
            *x += d;
        }
        let mut words = String::new();
        for (letter, x) in ["X", "Y", "Z", "A", "C"].iter().zip(at) {
            let sign = if x < 0 { "-" } else { "" };
            let _ = write!(
                words,
                " {letter}{sign}{}.{:03}",
                x.abs() / 1000,
                x.abs() % 1000
            );
        }
        words
    };
    for piece in pieces {
        match piece {
            Piece::Lines(rapid, stop, steps) => {
                for step in steps {
                    let g = if *rapid { "G0" } else { "G1" };
                    let once = if *stop { " G9" } else { "" };
                    let _ = writeln!(text, "{g}{once}{}", coordinates(step));
                }
            }
            Piece::Spline(kind, begin, end, degree, steps) => {
                let _ = writeln!(text, "{begin} {end}");
                for (k, (step, interval)) in steps.iter().enumerate() {
                    let mut line = String::new();
                    if k == 0 {
                        line = (*kind).into();
                        if *kind == "BSPLINE" {
                            let _ = write!(line, " SD={degree}");
                        }
                    }
                    line += &coordinates(step);
                    if *kind == "BSPLINE" && *interval > 1 {
                        let _ = write!(line, " PL={}", 0.5 * f64::from(*interval));
                    }
                    let _ = writeln!(text, "{line}");
                }
            }
            Piece::Word(word) => {
                let _ = writeln!(text, "{word}");
            }
            Piece::Feed(feed) => {
                let _ = writeln!(text, "F{feed}");
            }
        }
    }
    text.push_str("M30\n");
    text
}
