//! The programs of the thesis, in its own form (Tables 2.3.1.1, 2.3.2.2, 2.3.3.2 and 2.3.3.3).
//!
//! In: a method and a knot set. Out: named texts. Touches only [`super::knots`].

use std::fmt::Write as _;

use super::knots::{roughing, Distribution, Knot, KnotSet};

/// Name of the tool in all programs, and its radius in mm (section 3.3).
pub const TOOL: &str = "FR_4";
/// See [`TOOL`].
pub const TOOL_RADIUS_MM: f64 = 2.0;

/// How the knots are joined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// `ASPLINE`.
    A,
    /// `BSPLINE`, every knot with `PW=3`.
    B,
    /// `CSPLINE`.
    C,
    /// `G1`.
    Linear,
}

/// In the order of Tables 3.14.1 and 3.14.2.
pub const METHODS: [Method; 4] = [Method::A, Method::B, Method::C, Method::Linear];

impl Method {
    /// The word of the JSON file.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::A => "A",
            Self::B => "B",
            Self::C => "C",
            Self::Linear => "linear",
        }
    }

    /// The name of the tables.
    #[must_use]
    pub fn title(self) -> &'static str {
        match self {
            Self::A => "A-spline",
            Self::B => "B-spline",
            Self::C => "C-spline",
            Self::Linear => "Linear",
        }
    }

    /// What the names of the main programs say.
    fn tag(self) -> &'static str {
        match self {
            Self::Linear => "LIN",
            other => other.name(),
        }
    }

    /// What the names of the sub-programs say: A- and C-splines share theirs.
    fn infix(self) -> &'static str {
        match self {
            Self::A | Self::C => "_",
            Self::B => "_B_",
            Self::Linear => "_LIN_",
        }
    }

    /// What stands before and behind the coordinates of a knot, blanks as in Table 2.3.2.2: they count in the size
    /// of a file.
    fn affixes(self) -> (&'static str, &'static str) {
        match self {
            Self::A | Self::C => (" ", "   "),
            Self::B => (" ", "  PW=3  "),
            Self::Linear => ("G1", "   "),
        }
    }
}

/// A program file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct File {
    /// Name with extension.
    pub name: String,
    /// ASCII text with `\n` line ends.
    pub text: String,
}

/// A main program with the sub-programs it calls.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Job {
    /// What is run.
    pub main: File,
    /// What it calls.
    pub subs: Vec<File>,
}

/// Puts block numbers in steps of ten before `blocks`.
fn numbered<S: AsRef<str>>(blocks: &[S]) -> String {
    let mut text = String::new();
    for (index, block) in blocks.iter().enumerate() {
        // Writing to a string does not fail.
        let _ = writeln!(text, "N{} {}", 10 * (index + 1), block.as_ref());
    }
    text
}

/// `X.. Y.. Z..` of a knot with three decimals, as the listings print it.
fn coordinates(knot: &Knot) -> String {
    let mm = knot.map(|v| v as f64 / 1000.0);
    format!("X{:.3}  Y{:.3}  Z{:.3}", mm[0], mm[1], mm[2])
}

/// Sub-program with one block per knot.
fn knot_file(stem: &str, method: Method, knots: &[Knot]) -> File {
    let (before, behind) = method.affixes();
    let mut blocks: Vec<String> = knots
        .iter()
        .map(|knot| format!("{before} {}{behind}", coordinates(knot)))
        .collect();
    blocks.push("M17".to_owned());
    File {
        name: format!("{stem}.SPF"),
        text: numbered(&blocks),
    }
}

/// Blocks all main programs begin with.
const HEAD: [&str; 6] = ["G54", "T=\"FR_4\"", "M6", "G64", "SOFT", "M3 S17000 M8"];

/// Finishing program of `method` on `set` (Table 2.3.3.3). A spline begins at `X37`, turns by 150 degrees at the first lead
/// knot with the cutter on the inside, and ends tangent to the way home.
///
/// The printed names are those of the equidistant sub-programs (`EKVI_POSTUPNE_45`); the polar ones follow them.
#[must_use]
pub fn finishing(method: Method, set: &KnotSet) -> Job {
    let family = match set.distribution {
        Distribution::Polar => "POLAR",
        Distribution::Equidistant => "EKVI",
    };
    let stem = format!("{family}_POSTUPNE{}{}", method.infix(), set.parameter);
    let mut blocks: Vec<&str> = HEAD.to_vec();
    blocks.extend(["G1 Z10 F1530", "M0", "G4 F2", "G42"]);
    blocks.extend(match method {
        Method::Linear => &["G1 X37 Y-15", "G1 X13.856  Y-8.000  Z0.500"][..],
        Method::A => &["G1 X37", "BTAN ETAN", "ASPLINE", "X13.856  Y-8.000  Z0.500"],
        Method::B => &["G1 X37", "BSPLINE", "X13.856  Y-8.000  Z0.500  PW=3"],
        Method::C => &[
            "G1 X40",
            "G1 X37",
            "BTAN ETAN",
            "CSPLINE",
            "X13.856  Y-8.000  Z0.500",
        ],
    });
    blocks.extend([
        &stem,
        "G40",
        "G1 X30 Y30 F700",
        "G1 Z10 F5000",
        "Y100",
        "M5",
        "M30",
    ]);
    Job {
        main: File {
            name: format!("FINISH_{family}_{}_{}.MPF", set.parameter, method.tag()),
            text: numbered(&blocks),
        },
        subs: vec![knot_file(&stem, method, &set.finishing())],
    }
}

/// Degrees between the knots of the roughing programs: 360, 180 and 72 knots (Table 2.3.3.1).
pub const ROUGHING_DEGREES: [u32; 3] = [1, 2, 5];

/// Enlargements of the four roughing contours. The thesis calls them augmented curves of gradually smaller size and
/// prints no number: assumed so that neighbours lie closer than the cutter is wide, and the last one keeps clear
/// of the finished contour by at least 0.16 mm along its normal.
pub const ROUGHING_SCALES: [f64; 4] = [1.32, 1.22, 1.12, 1.02];

/// Roughing program of `method` with a knot every `degrees` (Table 2.3.3.2).
///
/// The table prints `HRUB_1_LIN_1` under a title that says 5 degrees; here the first number is the angle.
/// Every program approaches at `Y0`: the `Y40` of the printed A-spline program stands in none of the others.
#[must_use]
pub fn roughing_job(method: Method, degrees: u32) -> Job {
    let subs: Vec<File> = (1..)
        .zip(ROUGHING_SCALES)
        .map(|(number, scale)| {
            let stem = format!("HRUB_{degrees}{}{number}", method.infix());
            knot_file(&stem, method, &roughing(degrees, scale))
        })
        .collect();
    let mut blocks: Vec<&str> = HEAD.to_vec();
    blocks.extend(["G1 Z10 F5000", "G1 X40 Y0 F1530", "G42", "G1 X37"]);
    blocks.extend(match method {
        Method::Linear => &[][..],
        Method::A => &["BTAN ETAN", "ASPLINE"],
        Method::B => &["BSPLINE"],
        Method::C => &["BTAN ETAN", "CSPLINE"],
    });
    blocks.extend(subs.iter().map(|file| file.name.trim_end_matches(".SPF")));
    blocks.extend(["G40", "G1 X40 Y0 F700", "G1 Z10 F5000", "M5", "M30"]);
    Job {
        main: File {
            name: format!("ROUGH_POLAR_{degrees}_{}.MPF", method.tag()),
            text: numbered(&blocks),
        },
        subs,
    }
}

/// Every program of the study: 24 finishing programs, then the roughing ones.
#[must_use]
pub fn all() -> Vec<Job> {
    let finishing = super::knots::FINISHING
        .iter()
        .flat_map(|set| METHODS.map(|method| finishing(method, set)));
    let roughing = ROUGHING_DEGREES
        .iter()
        .flat_map(|&degrees| METHODS.map(|method| roughing_job(method, degrees)));
    finishing.chain(roughing).collect()
}

#[cfg(test)]
mod tests {
    use super::super::contour;
    use super::super::knots::FINISHING;
    use super::*;

    /// Lines of `text` with runs of blanks taken as one.
    fn tidy(text: &str) -> Vec<String> {
        let line = |line: &str| line.split_whitespace().collect::<Vec<_>>().join(" ");
        text.lines().map(line).collect()
    }

    #[test]
    fn main_programs_are_the_printed_ones() {
        // Table 2.3.3.3, equidistant, parameter 45.
        let printed = [
            (
                Method::Linear,
                "N100 G42\nN110 G1 X37 Y-15\nN120 G1 X13.856 Y-8.000 Z0.500\nN130 EKVI_POSTUPNE_LIN_45\nN140 G40\nN150 G1 X30 Y30 F700\nN160 G1 Z10 F5000\nN170 Y100\nN180 M5\nN190 M30",
            ),
            (
                Method::A,
                "N100 G42\nN110 G1 X37\nN120 BTAN ETAN\nN130 ASPLINE\nN140 X13.856 Y-8.000 Z0.500\nN150 EKVI_POSTUPNE_45\nN160 G40\nN170 G1 X30 Y30 F700\nN180 G1 Z10 F5000\nN190 Y100\nN200 M5\nN210 M30",
            ),
            (
                Method::B,
                "N100 G42\nN110 G1 X37\nN120 BSPLINE\nN130 X13.856 Y-8.000 Z0.500 PW=3\nN140 EKVI_POSTUPNE_B_45\nN150 G40\nN160 G1 X30 Y30 F700\nN170 G1 Z10 F5000\nN180 Y100\nN190 M5\nN200 M30",
            ),
        ];
        let head = "N10 G54\nN20 T=\"FR_4\"\nN30 M6\nN40 G64\nN50 SOFT\nN60 M3 S17000 M8\nN70 G1 Z10 F1530\nN80 M0\nN90 G4 F2\n";
        for (method, tail) in printed {
            let job = finishing(method, &FINISHING[4]);
            assert_eq!(tidy(&job.main.text), tidy(&format!("{head}{tail}")));
        }
        // The printed C-spline program squeezes N115 in between N110 and N120: the blocks agree, not the numbers.
        let blocks = |text: &str| -> Vec<String> {
            let without = |line: &String| line.split_once(' ').unwrap().1.to_owned();
            tidy(text).iter().map(without).collect()
        };
        let tail = "N100 G42\nN110 G1 X40\nN115 G1 X37\nN120 BTAN ETAN\nN130 CSPLINE\nN140 X13.856 Y-8.000 Z0.500\nN150 EKVI_POSTUPNE_45\nN160 G40\nN170 G1 X30 Y30 F700\nN180 G1 Z10 F5000\nN190 Y100\nN200 M5\nN210 M30";
        let job = finishing(Method::C, &FINISHING[4]);
        assert_eq!(blocks(&job.main.text), blocks(&format!("{head}{tail}")));
    }

    #[test]
    fn knot_lines_are_the_printed_ones() {
        // Table 2.3.2.2, where the blocks count from the first knot of the turn; N40 here because of three lead knots.
        let line = |method, n: usize| {
            let job = finishing(method, &FINISHING[1]);
            assert_eq!(job.subs.len(), 1);
            tidy(&job.subs[0].text)[n].clone()
        };
        assert_eq!(line(Method::A, 3), "N40 X22.000 Y0.000 Z0.000");
        assert_eq!(line(Method::C, 76), "N770 X21.330 Y1.866 Z-6.000");
        assert_eq!(line(Method::B, 76), "N770 X21.330 Y1.866 Z-6.000 PW=3");
        assert_eq!(line(Method::Linear, 76), "N770 G1 X21.330 Y1.866 Z-6.000");
    }

    #[test]
    fn every_name_is_used_once_and_every_line_fits_the_wire() {
        let jobs = all();
        assert_eq!(jobs.len(), 24 + 12);
        let mut texts = std::collections::HashMap::new();
        for file in jobs
            .iter()
            .flat_map(|job| job.subs.iter().chain([&job.main]))
        {
            assert!(file.text.lines().all(|line| line.len() <= 96));
            let known = texts.insert(&file.name, &file.text);
            assert!(known.is_none_or(|text| text == &file.text), "{}", file.name);
        }
        for job in &jobs {
            for sub in &job.subs {
                let call = format!(" {}\n", sub.name.trim_end_matches(".SPF"));
                assert_eq!(job.main.text.matches(&call).count(), 1, "{}", job.main.name);
            }
        }
    }

    #[test]
    fn roughing_keeps_clear_of_the_contour_and_leaves_no_ridge() {
        let degrees = || (0..3600).map(|i| (f64::from(i) / 10.0).to_radians());
        let curve: Vec<[f64; 2]> = degrees().map(contour::point).collect();
        let distance = |at: [f64; 2], scale: f64| {
            let to = |p: &[f64; 2]| (scale * p[0] - at[0]).hypot(scale * p[1] - at[1]);
            curve.iter().map(to).fold(f64::INFINITY, f64::min)
        };
        for pair in ROUGHING_SCALES.windows(2) {
            for at in &curve {
                let d = distance(at.map(|v| pair[0] * v), pair[1]);
                assert!(d < 2.0 * TOOL_RADIUS_MM, "{d}");
            }
        }
        let nearest = curve
            .iter()
            .map(|at| distance(at.map(|v| ROUGHING_SCALES[3] * v), 1.0))
            .fold(f64::INFINITY, f64::min);
        assert!(nearest > 0.16, "{nearest}");
    }
}
