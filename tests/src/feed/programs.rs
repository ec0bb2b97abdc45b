//! Programs whose curves are run at a constant feed although their parameters are anything but even.
//!
//! In: nothing. Out: [`Template`]s, to be filled with one feed, or with the time of every block.

use std::fmt::Write;

use crate::campaign::{machine, ran};
use crate::drive::{Run, Script};
use crate::oracle::path::{path_on, Curve};
use crate::oracle::read::{Language, Setup};
use pentaspline::config::Config;
use pentaspline::machine::Event;

use super::ideal::Ideal;

/// A program without feeds: `@` stands at the end of each block that moves.
pub struct Template {
    /// What it is.
    pub name: &'static str,
    /// Fanuc words.
    pub fanuc: bool,
    text: String,
}

impl Template {
    /// A program in the words of the Sinumerik.
    #[must_use]
    pub fn new(name: &'static str, text: String) -> Self {
        Self {
            name,
            fanuc: false,
            text,
        }
    }

    /// The program in `mode` (`SOFT`, `BRISK`) at `feed`, mm/min.
    #[must_use]
    pub fn at_feed(&self, mode: &str, feed: f64) -> String {
        let text = self.text.replace('@', "");
        format!("{mode} G94 F{feed}\n{text}M30\n")
    }

    /// The program in `mode` under `G93`, with `rate(line)` blocks per minute.
    #[must_use]
    pub fn at_rates(&self, mode: &str, rate: impl Fn(u32) -> f64) -> String {
        let mut text = format!("{mode} G93\n");
        for (line, block) in (2..).zip(self.text.lines()) {
            match block.strip_suffix('@') {
                Some(block) => {
                    let _ = writeln!(text, "{block} F{:.9}", rate(line));
                }
                None => {
                    let _ = writeln!(text, "{block}");
                }
            }
        }
        text + "M30\n"
    }

    /// What reads it.
    #[must_use]
    pub fn setup(&self) -> Setup {
        Setup {
            language: if self.fanuc {
                Language::Fanuc
            } else {
                Language::Sinumerik
            },
            ..Setup::default()
        }
    }
}

/// A run, and what it is held against.
pub struct Held {
    /// The machine.
    pub config: Config,
    /// What it did.
    pub run: Run,
    /// What the program asks for.
    pub curves: Vec<Curve>,
    /// The same at the programmed feed throughout.
    pub ideal: Ideal,
}

/// Runs `text` on the machine `setup` under a feed override of `percent`.
///
/// # Panics
/// If the core complains.
#[must_use]
pub fn held(setup: &Setup, text: &str, percent: u8) -> Held {
    let config = machine(setup);
    let events = match percent {
        100 => Vec::new(),
        _ => vec![(0, Event::Feed(percent))],
    };
    let run = ran(&config, &Script::with_events(text, events));
    let run = run.unwrap_or_else(|complaint| panic!("{complaint}"));
    let curves = path_on(setup, text);
    let ideal = Ideal::new(&config, &curves, f64::from(percent) / 100.0);
    Held {
        config,
        run,
        curves,
        ideal,
    }
}

/// Points of an ellipse of 40 and 25 mm from its right end, `turn(k)` radians apart; Z falls by `fall` mm a turn.
fn ellipse(count: u32, turn: impl Fn(u32) -> f64, fall: f64) -> Vec<[f64; 3]> {
    let mut angle = 0.0_f64;
    let point = |k| {
        angle += turn(k);
        [
            40.0 * angle.cos() - 40.0,
            25.0 * angle.sin(),
            -fall * angle / std::f64::consts::TAU,
        ]
    };
    (0..count).map(point).collect()
}

/// A spline through (or by) `points`; `words(k)` follow the coordinates.
fn spline(front: &str, points: &[[f64; 3]], words: impl Fn(usize) -> String) -> String {
    let mut text = String::new();
    for (k, [x, y, z]) in points.iter().enumerate() {
        let front = if k == 0 { front } else { "" };
        let _ = writeln!(text, "{front} X{x:.6} Y{y:.6} Z{z:.6}{}@", words(k));
    }
    text
}

/// Order 4, weights from 0.1 to 10, knot intervals from 0.01 to 3.
#[must_use]
pub fn nurbs() -> Template {
    let intervals = [1.0, 0.01, 3.0, 1.0];
    let weights = [1.0, 10.0, 1.0, 0.1, 2.0];
    let count = 20;
    let mut knots = vec![0.0; 4];
    for k in 0..count - 3 {
        knots.push(knots[knots.len() - 1] + intervals[k % 4]);
    }
    knots.extend([knots[knots.len() - 1]; 3]);
    let mut text = "G01 X0 Y0\nG06.2 P4 K0 X0 Y0 R1\n".to_owned();
    for k in 1..count {
        let (sin, cos) = (0.2 * k as f64).sin_cos();
        let (x, y) = (80.0 * sin, 80.0 - 80.0 * cos);
        let (knot, weight) = (knots[k], weights[k % 5]);
        let _ = writeln!(text, "K{knot:.3} X{x:.4} Y{y:.4} R{weight}");
    }
    for knot in &knots[count..] {
        let _ = writeln!(text, "K{knot:.3}");
    }
    Template {
        name: "NURBS, knots 1:300, weights 1:100",
        fanuc: true,
        text: text + "G01\n",
    }
}

/// Half a circle and a helix of two and a half turns.
#[must_use]
pub fn arcs() -> Template {
    let text =
        "G1 X10@\nG3 X-10 Y0 I-10 J0@\nG3 X10 Y0 I10 J0 TURN=2 Z-20 C0.5@\nG2 X30 Y0 CR=10@\n";
    Template::new("arcs and a helix", text.into())
}

/// An A-spline whose points are 0.2 and 20 mm apart.
#[must_use]
pub fn uneven_akima() -> Template {
    let far = ellipse(22, |k| [0.5, 0.005][k as usize % 2], 4.0);
    Template::new(
        "A-spline, chords 1:100",
        spline("BNAT ENAT ASPLINE", &far, |_| String::new()),
    )
}

/// All of them in the words of the Sinumerik.
#[must_use]
pub fn sinumerik() -> Vec<Template> {
    let far = ellipse(22, |k| [0.5, 0.005][k as usize % 2], 4.0);
    let even = ellipse(36, |_| 0.15, 4.0);
    let intervals = ["1", "0.01", "100", "1", "3"];
    let weights = ["1", "3", "0.3", "1", "0.1"];
    let plain = |_: usize| String::new();
    let interval = |k: usize| format!(" PL={}", intervals[k % 5]);
    let weight = |k: usize| format!(" PW={}", weights[(k + 1) % 5]);
    let turned = |k: usize| {
        let k = k as f64;
        format!(" A{:.4} C{:.4}", 0.06 * (0.5 * k).sin(), 0.05 * k)
    };
    let mut all = vec![
        Template::new("straight", "G1 X120 Y40 Z-20@\nX-80 Y10@\n".into()),
        arcs(),
        uneven_akima(),
        Template::new(
            "C-spline, chords 1:100",
            spline("BNAT ENAT CSPLINE", &far, plain),
        ),
        Template::new(
            "B-spline, knots 1:10000",
            spline("BSPLINE SD=3", &even, interval),
        ),
        Template::new("B-spline of degree 2", spline("BSPLINE SD=2", &even, plain)),
        Template::new(
            "B-spline, weights 1:30",
            spline("BSPLINE SD=3", &even, weight),
        ),
        Template::new(
            "C-spline in five axes",
            spline("BNAT ENAT CSPLINE", &even, turned),
        ),
        Template::new(
            "POLY, speeds 1:12",
            "POLY PO[X]=(100,90,-40,49) PO[Y]=(20,3,15)@\n".into(),
        ),
        Template::new(
            "rotary axes alone",
            "G1 A0.3@\nCSPLINE A0.2 C0.1@\nA0 C0.05@\nA-0.1 C0@\n".into(),
        ),
    ];
    // X = 320 (p - 1/2)^3 + e p: in the middle, the parameter moves X by e alone.
    for (name, e) in [("POLY, speeds 1:24000", 0.01), ("POLY, speeds 1:240", 1.0)] {
        let end = 80.0 + e;
        let text = format!("POLY PO[X]=({end:.6},-480,320) PO[Y]=(30,0,0,20,-5)@\n");
        all.push(Template::new(name, text));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::oracle::path::path;

    #[test]
    fn the_parameter_all_but_stands_still_in_the_middle_of_the_polynomial() {
        let all = sinumerik();
        let named = |t: &&Template| t.name == "POLY, speeds 1:24000";
        let template = all.iter().find(named).expect("a template");
        let curves = path(&template.at_feed("SOFT", 600.0));
        let at = |u: f64| curves[0].shape.slope(u)[0];
        assert!((at(0.5) - 0.01).abs() < 1e-9 && (at(0.0) - 240.01).abs() < 1e-9);
    }
}
