//! Cutter compensation: the centre of the tool stays at its radius from the programmed contour, on the side asked for,
//! and never nearer.

use pentaspline::config::{Config, ToolData};
use proptest::prelude::*;
use whole_product_tests::campaign::{cases, machine, ran};
use whole_product_tests::drive::{Run, Script};
use whole_product_tests::laws;
use whole_product_tests::oracle::cutter::{Clearance, Contour};
use whole_product_tests::oracle::path::path_on;
use whole_product_tests::oracle::read::Setup;

/// Allowed on either side of the radius, mm: the tolerance of offset curves is a tenth of it.
const MICROMETRE: f64 = 1e-3;

/// The built-in machine with tool 1 of `radius` mm.
fn tooled(radius: f64) -> Config {
    let mut config = machine(&Setup::default());
    config.tools[0] = ToolData {
        number: 1,
        name: [0; 16],
        radius: (radius * 1e6).round() as i64,
        length: 0,
    };
    config
}

/// A contour and where the tool comes from and goes to.
#[derive(Clone, Debug)]
struct Part {
    approach: [f64; 2],
    /// Lines of the contour; the first coordinate line is the end of the approach.
    lines: Vec<String>,
    retract: [f64; 2],
}

impl Part {
    fn text(&self, words: &str) -> String {
        let [x, y] = self.approach;
        let [u, v] = self.retract;
        format!(
            "T1 M6\nG0 X{x:.4} Y{y:.4}\n{words} G1 F2000 {}\n{}\nG40 G1 X{u:.4} Y{v:.4}\nM30\n",
            self.lines[0],
            self.lines[1..].join("\n")
        )
    }
}

/// Centres of the tool while the contour runs, and the contour as the oracle reads it without compensation.
fn measure(
    config: &Config,
    part: &Part,
    words: &str,
    radius: f64,
) -> Result<(Clearance, Run), String> {
    let text = part.text(words);
    let run = ran(config, &Script::new(&text))?;
    let lines = 4..4 + part.lines.len() as u32 - 1;
    let mut dense = Vec::new();
    let curves = path_on(&Setup::default(), &text);
    for curve in curves.iter().filter(|curve| lines.contains(&curve.line)) {
        curve.shape.dense(1e-5, &mut dense);
        dense.push(curve.shape.at(1.0));
    }
    let contour = Contour::new(dense.iter().map(|p| [p[0], p[1]]), 3.0 * radius + 1.0);
    let centres = run
        .ticks
        .iter()
        .filter(|tick| tick.moving && lines.contains(&tick.block));
    let clearance = contour
        .clearance(centres.map(|tick| {
            let p = laws::place(config, tick);
            [p[0], p[1]]
        }))
        .map_err(|broken| format!("{broken}\n{text}"))?;
    Ok((clearance, run))
}

/// At the radius everywhere, on the side asked for.
fn holds(part: &Part, left: bool, radius: f64) -> Result<(), String> {
    let words = if left { "G450 G41" } else { "G450 G42" };
    let (seen, run) = measure(&tooled(radius), part, words, radius)?;
    let text = part.text(words);
    if seen.least < radius - MICROMETRE || seen.most > radius + MICROMETRE {
        return Err(format!("{seen:?} at radius {radius}\n{text}"));
    }
    let share = if left { seen.left } else { 1.0 - seen.left };
    if share < 0.999 {
        return Err(format!(
            "{share} of the centres on the side asked for\n{text}"
        ));
    }
    laws::stays_within_limits(&tooled(radius), &run, &Default::default(), 0.005)
        .map_err(|broken| format!("{broken}\n{text}"))
}

/// Closed contours of 4 to 8 corners 22 to 38 mm from the middle, sides straight or bulging. They begin and end in the
/// middle of a straight side: in a corner a tool that stands square to one side would cut the other.
fn island() -> impl Strategy<Value = (Part, bool)> {
    let corner = (0.75_f64..1.25, 0_u8..4);
    (prop::collection::vec(corner, 4..9), any::<bool>()).prop_map(|(corners, outside)| {
        let n = corners.len();
        let at = |k: usize| {
            let angle = std::f64::consts::TAU * k as f64 / n as f64;
            let r = 30.0 * corners[k % n].0;
            [r * angle.cos(), r * angle.sin()]
        };
        let (p, q) = (at(0), at(1));
        let middle = [(p[0] + q[0]) / 2.0, (p[1] + q[1]) / 2.0];
        let mut lines = vec![format!("X{:.4} Y{:.4}", middle[0], middle[1])];
        for k in 1..=n {
            let (p, q) = (at(k - 1), at(k));
            let chord = (q[0] - p[0]).hypot(q[1] - p[1]);
            let end = format!("X{:.4} Y{:.4}", q[0], q[1]);
            lines.push(match corners[k % n].1 {
                0 if k > 1 => format!("G3 {end} CR={:.4}", 0.9 * chord),
                1 if k > 1 => format!("G2 {end} CR={:.4}", 1.6 * chord),
                _ => format!("G1 {end}"),
            });
        }
        lines.push(format!("G1 X{:.4} Y{:.4}", middle[0], middle[1]));
        let chord = (q[0] - p[0]).hypot(q[1] - p[1]);
        let along = [(q[0] - p[0]) / chord, (q[1] - p[1]) / chord];
        // To the right of the way is outside; 6 mm off it, 3 mm before and behind the middle.
        let off = if outside { 6.0 } else { -6.0 };
        let place = |ahead: f64| {
            [
                middle[0] + off * along[1] + ahead * along[0],
                middle[1] - off * along[0] + ahead * along[1],
            ]
        };
        (
            Part {
                approach: place(-3.0),
                lines,
                retract: place(3.0),
            },
            outside,
        )
    })
}

proptest! {
    #![proptest_config(cases(40))]

    #[test]
    fn the_centre_keeps_its_distance_around_random_islands((part, outside) in island(), radius in 0.2_f64..2.0) {
        let radius = (radius * 1000.0).round() / 1000.0;
        // Counter-clockwise: the outside is on the right.
        holds(&part, !outside, radius).map_err(TestCaseError::fail)?;
    }

    #[test]
    fn intersections_never_gouge((part, outside) in island(), radius in 0.2_f64..2.0) {
        let radius = (radius * 1000.0).round() / 1000.0;
        let words = if outside { "G451 G42" } else { "G451 G41" };
        let (seen, _) = measure(&tooled(radius), &part, words, radius).map_err(TestCaseError::fail)?;
        prop_assert!(seen.least >= radius - MICROMETRE, "{:?}\n{}", seen, part.text(words));
    }
}

#[test]
fn splines_and_polynomials_are_offset_as_well() {
    for (lines, radius) in [
        (
            vec!["X0 Y0", "CSPLINE X10 Y4", "X20 Y5", "X32 Y0", "X40 Y-2"],
            2.0,
        ),
        (
            vec![
                "X0 Y0",
                "BSPLINE X10 Y4 PW=2",
                "X20 Y8",
                "X30 Y4 PW=0.5",
                "X40 Y0",
            ],
            3.0,
        ),
        (
            vec!["X0 Y0", "POLY PO[X]=(30,2) PO[Y]=(4,3,-0.4) PL=3"],
            1.5,
        ),
        (vec!["X0 Y0", "G3 X20 Y20 I0 J20", "G2 X30 Y30 I10 J0"], 2.0),
    ] {
        for left in [true, false] {
            let side = if left { 5.0 } else { -5.0 };
            let part = Part {
                approach: [-6.0, side],
                lines: lines.iter().map(|&line| line.to_owned()).collect(),
                retract: [50.0, 40.0 + side],
            };
            holds(&part, left, radius).unwrap_or_else(|broken| panic!("{broken}"));
        }
    }
}

#[test]
fn without_a_radius_the_contour_itself_is_driven() {
    let part = Part {
        approach: [-5.0, 0.0],
        lines: ["X0 Y0", "X10 Y5", "G2 X20 Y5 CR=8", "G1 X20 Y-5"]
            .map(str::to_owned)
            .to_vec(),
        retract: [30.0, -5.0],
    };
    let config = tooled(0.0);
    let steps = |words: &str| {
        ran(&config, &Script::new(&part.text(words)))
            .unwrap_or_else(|broken| panic!("{broken}"))
            .end()
    };
    assert_eq!(steps("G41"), steps("G40"));
}
