//! The printed `G6` blocks of program 150: no jump between blocks, end points met, constant feed, although the
//! parameter of the printed polynomials runs 0.86 to 1.15 times as fast as the arc length.

use pentaspline::config::Config;
use whole_product_tests::drive::{drive, Run, Script};
use whole_product_tests::oracle::path::{path, Curve};
use whole_product_tests::oracle::spline::{distance, norm, Point};
use whole_product_tests::{examples, laws};

/// Program 150 at `feed` mm/min.
fn program(feed: u32) -> (String, Vec<Curve>) {
    let text = examples::text("golden/spln150.nc");
    assert_eq!(text.matches("F5000").count(), 1);
    let text = text.replace("F5000", &format!("F{feed}"));
    // The curves of G6 blocks are those that are not straight.
    let bent = |curve: &Curve| !curve.shape.is_straight();
    let curves: Vec<Curve> = path(&text).into_iter().filter(bent).collect();
    assert_eq!(curves.len(), 10);
    (text, curves)
}

/// A machine none of whose limits bind at a few mm/s.
fn permissive() -> Config {
    let mut config = examples::machine().config;
    for axis in &mut config.axes {
        axis.v_max *= 100.0;
        axis.a_max *= 1000.0;
        axis.j_max *= 10_000.0;
    }
    config
}

/// Places and speeds of the ticks on the curves.
fn speeds(config: &Config, run: &Run, curves: &[Curve]) -> Vec<f64> {
    let lines: Vec<u32> = curves.iter().map(|curve| curve.line).collect();
    let places: Vec<Point> = run.ticks.iter().map(|t| laws::place(config, t)).collect();
    (1..places.len())
        .filter(|i| lines.contains(&run.ticks[*i].block) && lines.contains(&run.ticks[i - 1].block))
        .map(|i| distance(&places[i], &places[i - 1]) * f64::from(config.servo_hz))
        .collect()
}

/// Share of the way between the two ramps on which the speed is within 0.5 % of `feed` mm/s, and the share of the whole way
/// that is; fails if the feed is exceeded anywhere.
fn steadiness(config: &Config, feed_mm_min: u32) -> (f64, f64) {
    let (text, curves) = program(feed_mm_min);
    let run = drive(config, &Script::new(&text));
    assert!(run.finished, "{}", run.output);
    let feed = f64::from(feed_mm_min) / 60.0;
    let speeds = speeds(config, &run, &curves);
    let highest = speeds.iter().fold(0.0_f64, |a, b| a.max(*b));
    assert!(highest <= 1.005 * feed, "{highest} mm/s at F = {feed} mm/s");
    let steady = |v: &f64| (v / feed - 1.0).abs() <= 0.005;
    let first = speeds.iter().position(steady).expect("reaches its feed");
    let last = speeds.iter().rposition(steady).expect("reaches its feed");
    let between = &speeds[first..=last];
    let way = |v: &[f64]| v.iter().sum::<f64>();
    let held: f64 = between.iter().filter(|v| steady(v)).sum();
    (held / way(between), held / way(&speeds))
}

#[test]
fn the_feed_is_constant_where_no_limit_binds() {
    let (between, whole) = steadiness(&permissive(), 300);
    assert_eq!(between, 1.0, "no dip at any joint");
    assert!(whole > 0.99, "{whole} of the way at the feed");
}

#[test]
fn the_feed_is_constant_on_the_real_machine_where_its_limits_do_not_bind() {
    let (between, whole) = steadiness(&examples::machine().config, 60);
    assert_eq!(between, 1.0, "no dip at any joint");
    assert!(whole > 0.98, "{whole} of the way at the feed");
}

#[test]
fn the_feed_is_never_exceeded_at_full_speed() {
    let config = examples::machine().config;
    let (text, curves) = program(5000);
    let run = drive(&config, &Script::new(&text));
    let highest = speeds(&config, &run, &curves)
        .into_iter()
        .fold(0.0_f64, f64::max);
    assert!(
        highest > 20.0 && highest <= 1.005 * 5000.0 / 60.0,
        "{highest} mm/s"
    );
    laws::stays_within_limits(&config, &run, &Default::default(), 0.005).expect("limits");
}

#[test]
fn blocks_join_without_a_jump_at_the_printed_points() {
    let config = permissive();
    let (text, curves) = program(300);
    let run = drive(&config, &Script::new(&text));
    let reach = 1.005 * 300.0 / 60.0 / f64::from(config.servo_hz);
    for curve in &curves {
        let last = run.ticks.iter().rposition(|t| t.block == curve.line);
        let last = last.unwrap_or_else(|| panic!("line {} does not run", curve.line));
        let knot = curve
            .end
            .expect("G6 ends on its point")
            .map(|nano| nano as f64 * 1e-6);
        let (a, b) = (
            &run.ticks[last],
            &run.ticks[(last + 1).min(run.ticks.len() - 1)],
        );
        let (a, b) = (laws::place(&config, a), laws::place(&config, b));
        let jump = distance(&a, &b);
        assert!(jump <= reach, "line {}: jumps {jump} mm", curve.line);
        // The point lies on the way between the two ticks: the way over it is hardly longer (arc against chord: 1e-6).
        let over = distance(&a, &knot) + distance(&knot, &b);
        assert!(
            over - jump < 1e-6,
            "line {}: misses its end by {}",
            curve.line,
            over - jump
        );
    }
}

#[test]
fn the_printed_parameter_is_not_the_arc_length() {
    // Without this the tests above would prove nothing.
    let (_, curves) = program(300);
    let mut spread = (f64::MAX, 0.0_f64);
    for curve in &curves {
        let speed = |k: i32| norm(&curve.shape.slope(f64::from(k) / 50.0));
        let mean = (0..=50).map(speed).sum::<f64>() / 51.0;
        for k in 0..=50 {
            spread = (spread.0.min(speed(k) / mean), spread.1.max(speed(k) / mean));
        }
    }
    assert!(spread.0 < 0.92 && spread.1 > 1.08, "{spread:?}");
}
