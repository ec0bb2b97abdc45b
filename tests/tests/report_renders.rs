//! The report as a reader gets it: written, opened in a real browser, every chart drawn, nothing on the error console.
//!
//! The motion is synthetic, so that the test stands on its own: the contour r = 18 + 4 cos 2t cos 6t mm of the
//! thesis, three turns, through the plant model. `PENTASPLINE_KEEP_REPORT=DIR` leaves the file in DIR.

use std::path::{Path, PathBuf};
use std::process::Command;

use host_sim::plant::{AxisPlant, Plant};
use host_sim::report::{self, AxisInfo, ReportData, TickRecord};
use pentaspline::units::AXES;

const HZ: f64 = 5000.0;
const STEPS_PER_UNIT: f64 = 1000.0;
const STEP_BITS: f64 = 4_294_967_296.0;

/// MCV 1210 as in its machine file.
fn axes() -> [AxisInfo; AXES] {
    core::array::from_fn(|a| {
        let linear = a < 3;
        let pick = |l, r| if linear { l } else { r };
        AxisInfo {
            name: ["X", "Y", "Z", "A", "C"][a].into(),
            linear,
            steps_per_unit: STEPS_PER_UNIT,
            v_limit: pick(2000.0 / 3.0, 1.0),
            a_limit: pick(5000.0, 5.0),
            j_limit: pick(50_000.0, 50.0),
        }
    })
}

fn plant() -> Plant {
    let linear = AxisPlant {
        kv_per_s: 100.0,
        feed_forward: 0.98,
        velocity_lag_s: 0.002,
        a_saturation: 7500.0,
        backlash: 0.002,
        encoder_resolution: 0.0001,
    };
    let rotary = AxisPlant {
        kv_per_s: 60.0,
        velocity_lag_s: 0.004,
        a_saturation: 10.0,
        backlash: 0.001,
        ..linear
    };
    let axes = [linear, linear, linear, rotary, rotary];
    let start = position(0.0, false);
    Plant::new(&axes, [true, true, true, false, false], 1.0 / HZ, start).expect("a stable plant")
}

/// Point of the contour at angle `theta`, mm and degrees.
fn position(theta: f64, rotary: bool) -> [f64; AXES] {
    let turn = core::f64::consts::TAU;
    let r = 18.0 + 4.0 * (2.0 * theta).cos() * (6.0 * theta).cos();
    let depth = |t: f64| -6.0 * (1.0 - (0.5 * turn * t.clamp(0.0, 1.0)).cos()) / 2.0;
    let z = depth(theta / turn).max(depth(3.0 - theta / turn));
    let (a, c) = if rotary {
        (3.0 * (theta / 6.0).sin(), 2.0 * (theta / 6.0).cos() - 2.0)
    } else {
        (0.0, 0.0)
    };
    [r * theta.cos(), r * theta.sin(), z, a, c]
}

/// Runs the contour at `feed` mm/s and returns the report.
fn thesis_contour(feed: f64, rotary: bool) -> ReportData {
    let mut data = ReportData::new("contour-57.mpf", "MCV 1210", HZ, axes());
    data.digest = format!("{:016x}", 0x5eed_c0de_1234_abcd_u64);
    data.warnings = vec!["Line 7: S0 leaves the spindle at rest.".into()];
    data.facts = vec![("Path deviation".into(), "0.61 µm".into())];
    data.lines = (0..200)
        .map(|i| format!("N{} X{i}.125 Y-{i}.5 ; </script> & co", 10 * i))
        .collect();
    let mut plant = plant();
    let end = 3.0 * core::f64::consts::TAU;
    let (mut theta, mut tick) = (0.0, 0u64);
    let metric = |theta: f64| {
        let (p, q) = (
            position(theta - 1e-4, rotary),
            position(theta + 1e-4, rotary),
        );
        let moved = (0..3).map(|a| (q[a] - p[a]).powi(2)).sum::<f64>().sqrt();
        moved / 2e-4
    };
    // Length by the midpoint rule; a smooth start and stop of 0.2 s each cost one more ramp in all.
    let pieces = 100_000;
    let piece = end / f64::from(pieces);
    let length: f64 = (0..pieces)
        .map(|i| metric((f64::from(i) + 0.5) * piece) * piece)
        .sum();
    let ramp_s = 0.2;
    let (stop, settled) = (length / feed + ramp_s, length / feed + ramp_s + 0.12);
    let speed_at = |t: f64| {
        let x = (t.min(stop - t) / ramp_s).clamp(0.0, 1.0);
        // Quintic blend: continuous up to acceleration at both ends.
        feed * x * x * x * (10.0 + x * (6.0 * x - 15.0))
    };
    while (tick as f64) < settled * HZ {
        let t = tick as f64 / HZ;
        let command = position(theta, rotary);
        let sample = plant.step(command);
        data.push(&TickRecord {
            tick,
            t_s: t,
            block: if t < stop {
                3 + ((theta / end).min(0.9999) * 168.0) as u32
            } else {
                0
            },
            feed_mm_s: speed_at(t),
            commanded: command.map(|x| (x * STEPS_PER_UNIT * STEP_BITS).round() as i64),
            actual: sample.actual,
            following: sample.following,
            contour_mm: sample.contour,
        });
        let way = speed_at(t + 0.5 / HZ) / HZ;
        let half = theta + 0.5 * way / metric(theta);
        theta += way / metric(half);
        tick += 1;
    }
    plant
        .finish()
        .into_iter()
        .for_each(|e| data.push_contour(e));
    data
}

/// The browser, or how to get one.
fn browser() -> PathBuf {
    let named = std::env::var_os("CHROMIUM").map(PathBuf::from);
    let usual = ["chromium", "chromium-browser", "google-chrome"].map(PathBuf::from);
    let works = |name: &PathBuf| {
        let version = Command::new(name).arg("--version").output();
        version.is_ok_and(|out| out.status.success())
    };
    named.into_iter().chain(usual).find(works).expect(
        "no Chromium found: install it with `sudo apt-get install chromium` (Debian) or name one in \
         the environment variable CHROMIUM; this test is never skipped",
    )
}

/// Opens `file`; returns the document after all scripts have run, and what was logged.
fn open(file: &Path, profile: &Path) -> (String, String) {
    let out = Command::new(browser())
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--no-first-run",
        ])
        // WebGL for the view in space without a graphics card, and no traffic of the browser's own.
        .args([
            "--enable-unsafe-swiftshader",
            "--disable-background-networking",
        ])
        .args([
            "--enable-logging=stderr",
            "--virtual-time-budget=20000",
            "--window-size=1280,5200",
        ])
        .arg(format!("--user-data-dir={}", profile.display()))
        .arg("--dump-dom")
        .arg(format!("file://{}", file.display()))
        .output()
        .expect("the browser starts");
    let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
    (text(out.stdout), text(out.stderr))
}

fn renders(name: &str, data: &ReportData, charts: &[&str]) -> String {
    let scratch = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(&scratch).expect("a scratch directory");
    let kept = std::env::var_os("PENTASPLINE_KEEP_REPORT").map(PathBuf::from);
    let file = kept
        .unwrap_or_else(|| scratch.clone())
        .join(format!("{name}.html"));
    report::write(&file, data).expect("the report is written");

    let size = std::fs::metadata(&file).expect("the report exists").len();
    assert!(size < 6_000_000, "{size} bytes are too much to mail");

    let (dom, log) = open(&file, &scratch.join("profile"));
    // Hints on speed come from the browser's graphics in software, not from the page.
    let hint =
        |line: &str| line.contains("GL Driver Message") || line.contains("willReadFrequently");
    let spoken = log.lines().filter(|line| line.contains("CONSOLE"));
    let complaints: Vec<_> = spoken.filter(|line| !hint(line)).collect();
    assert!(
        complaints.is_empty(),
        "the page complains:\n{}",
        complaints.join("\n")
    );
    let body = dom.find("<body").map_or("", |at| &dom[at..]);
    let body = body.split("</main>").next().unwrap_or_default();
    let tag = body.split('>').next().unwrap_or_default();
    assert!(
        tag.contains("data-ready=\"true\""),
        "not drawn to the end: {tag}\n{log}"
    );
    for chart in charts {
        let id = format!("id=\"{chart}\" class=\"chart");
        let node = body
            .split(&id)
            .nth(1)
            .unwrap_or_else(|| panic!("{chart} is missing"));
        let node = node.split("</section>").next().unwrap_or_default();
        // A drawn chart has curves in it; the view in space has a canvas.
        let drawn = node.contains("class=\"lines\"")
            || node.contains("js-line")
            || node.contains("<canvas");
        assert!(drawn, "{chart} is empty");
    }
    assert!(
        !body.contains("WebGL is not supported"),
        "the view in space needs WebGL"
    );
    dom
}

const ALWAYS: [&str; 8] = [
    "chart-plan",
    "chart-space",
    "chart-feed",
    "chart-velocity-linear",
    "chart-acceleration-linear",
    "chart-jerk-linear",
    "chart-following-linear",
    "chart-contour",
];

#[test]
fn a_three_axis_run_renders_without_errors() {
    let dom = renders("three-axis", &thesis_contour(25.5, false), &ALWAYS);
    assert!(dom.contains("A, C stay at rest"));
    assert!(!dom.contains("id=\"chart-velocity-rotary\""));
    let table = dom.split("id=\"blocks\"").nth(1).expect("a block table");
    let table = table.split("</table>").next().unwrap_or_default();
    assert_eq!(
        table.matches("<tr").count(),
        1 + 168,
        "a head and one row per block"
    );
}

#[test]
fn a_five_axis_run_renders_without_errors() {
    let mut charts = ALWAYS.to_vec();
    charts.extend([
        "chart-velocity-rotary",
        "chart-acceleration-rotary",
        "chart-jerk-rotary",
        "chart-following-rotary",
    ]);
    let dom = renders("five-axis", &thesis_contour(25.5, true), &charts);
    assert!(!dom.contains("id=\"still\""));
}

#[test]
fn a_run_without_motion_renders_without_errors() {
    let data = ReportData::new("empty.mpf", "MCV 1210", HZ, axes());
    let dom = renders("empty", &data, &[]);
    assert!(dom.contains("stay at rest"));
}
