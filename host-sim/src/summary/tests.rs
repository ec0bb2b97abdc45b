//! Laws of the summary, against closed forms.

use pentaspline::units::Steps;

use super::*;

const HZ: f64 = 5000.0;

/// Sample at `units` of axis 0 (1000 steps per unit), with steps as the core emits them.
fn at(units: f64, feed: f32, block: u32) -> Sample {
    let mut sample = Sample {
        feed,
        block,
        moving: block != 0,
        ..Sample::default()
    };
    sample.commanded[0] = Steps::from_num(units * 1000.0);
    sample.emitted[0] = (units * 1000.0 + 0.5).floor() as i32;
    sample
}

fn run(samples: &[Sample]) -> Summary {
    let machine = Machine::built_in().unwrap();
    let mut builder = SummaryBuilder::new(&machine, &Sample::default());
    samples.iter().for_each(|sample| builder.tick(sample));
    builder.finish(&machine, "p", 0xab)
}

#[test]
fn maxima_of_a_jerk_limited_start_are_those_of_its_polynomials() {
    // x = j t^3/6 for 1 s: v = j/2, a = j at the end, jerk j; then an abrupt stop.
    let j = 60.0;
    let samples: Vec<Sample> = (1..=5000)
        .map(|n| at(j * (f64::from(n) / HZ).powi(3) / 6.0, 0.0, 1))
        .collect();
    let machine = Machine::built_in().unwrap();
    let mut builder = SummaryBuilder::new(&machine, &Sample::default());
    samples.iter().for_each(|sample| builder.tick(sample));
    let [v, a, jerk] = builder.axes[0]
        .peaks
        .map(|peak| peak as f64 * builder.unit[0]);
    // Backward differences stand for the derivative half a tick earlier per order.
    assert!((v * HZ - 30.0).abs() < 30.0 * 2.0 / HZ);
    assert!((a * HZ * HZ - 60.0).abs() < 60.0 * 2.0 / HZ);
    assert!(
        (jerk * HZ * HZ * HZ - 60.0).abs() < 0.2,
        "{}",
        jerk * HZ * HZ * HZ
    );
    let summary = builder.finish(&machine, "p", 1);
    assert!((summary.path.length_mm - 10.0).abs() < 1e-6);
    assert_eq!(summary.axes[0].final_steps, 10_000);
    assert_eq!(summary.duration_s, 1.0);
    assert!(
        summary.axes[0].a_max > 1e5,
        "the abrupt stop after the last tick is not seen"
    );
}

#[test]
fn a_step_of_the_whole_range_does_not_overflow() {
    let machine = Machine::built_in().unwrap();
    let mut builder = SummaryBuilder::new(&machine, &Sample::default());
    let mut watch = TravelWatch::new(&machine);
    for n in 0..10 {
        let bits = if n % 2 == 0 { i64::MIN } else { i64::MAX };
        let commanded = [Steps::from_bits(bits); AXES];
        let emitted = [if n % 2 == 0 { i32::MAX } else { i32::MIN }; AXES];
        builder.tick(&Sample {
            commanded,
            emitted,
            feed: f32::NAN,
            block: n,
            moving: true,
        });
        watch.tick(u64::from(n), n, &commanded);
    }
    assert!(builder.finish(&machine, "p", 1).axes[0].v_max > 1e9);
}

#[test]
fn rounding_to_steps_is_at_most_half_a_step() {
    let samples: Vec<Sample> = (0..1000)
        .map(|n| at(f64::from(n) * 0.000_123, 0.0, 1))
        .collect();
    let deviation = run(&samples).path.max_deviation_mm;
    assert!(deviation > 0.000_49 && deviation <= 0.000_5, "{deviation}");
}

#[test]
fn feed_fluctuation_is_the_ripple_at_constant_feed_and_ignores_ramps() {
    // Acceleration to 10 mm/s, then 10 mm/s with one tick 0.3 % too long.
    let (mut x, mut samples) = (0.0, Vec::new());
    for n in 0..2000 {
        let feed = (f64::from(n) * 0.01).min(10.0);
        x += feed / HZ
            * if n == 1500 {
                1.003
            } else if n < 1000 {
                0.5
            } else {
                1.0
            };
        samples.push(at(x, feed as f32, 1));
    }
    let fluctuation = run(&samples).path.feed_fluctuation;
    assert!((fluctuation - 0.003).abs() < 1e-6, "{fluctuation}");
}

#[test]
fn blocks_are_counted_when_they_begin() {
    let samples = [1, 1, 2, 2, 0, 0, 5, 7].map(|block| at(0.0, 0.0, block));
    assert_eq!(run(&samples).blocks, 4);
}

#[test]
fn the_json_has_the_fixed_keys() {
    let value = serde_json::to_value(run(&[])).unwrap();
    for key in [
        "program",
        "machine",
        "servo_hz",
        "duration_s",
        "ticks",
        "blocks",
        "digest",
        "axes",
        "path",
        "plant",
        "warnings",
    ] {
        assert!(value.get(key).is_some(), "{key}");
    }
    for key in [
        "name",
        "unit",
        "steps_per_unit",
        "v_limit",
        "a_limit",
        "j_limit",
        "v_max",
        "a_max",
        "j_max",
        "final_steps",
    ] {
        assert!(value["axes"][4].get(key).is_some(), "{key}");
    }
    for key in ["length_mm", "max_deviation_mm", "feed_fluctuation"] {
        assert!(value["path"].get(key).is_some(), "{key}");
    }
    assert_eq!(value["digest"], "00000000000000ab");
    assert_eq!(value["axes"][0]["v_limit"], 666.6667);
    let plant = serde_json::to_value(PlantSummary::default()).unwrap();
    assert!(
        plant.get("max_following_error_mm").is_some()
            && plant.get("max_contour_error_mm").is_some()
    );
}

#[test]
fn an_exceeded_limit_is_said() {
    let mut summary = run(&[]);
    summary.axes[1].a_max = 5026.0;
    summary.axes[2].j_max = 60_000.0;
    assert_eq!(
        summary.limit_warnings(false),
        ["acceleration of axis Y reaches 5026.000, its limit is 5000"]
    );
    assert_eq!(summary.limit_warnings(true).len(), 2);
}
