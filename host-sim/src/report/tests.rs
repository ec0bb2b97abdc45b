//! Laws of the report's numbers.

use super::*;

const HZ: f64 = 5000.0;

/// A machine of three linear and two rotary axes with 1000 steps per unit.
fn axes() -> [AxisInfo; AXES] {
    core::array::from_fn(|a| AxisInfo {
        name: ["X", "Y", "Z", "A", "C"][a].into(),
        linear: a < 3,
        steps_per_unit: 1000.0,
        v_limit: if a < 3 { 666.7 } else { 1.0 },
        a_limit: if a < 3 { 5000.0 } else { 5.0 },
        j_limit: if a < 3 { 50_000.0 } else { 50.0 },
    })
}

fn bits(units: f64) -> i64 {
    (units * 1000.0 * 4_294_967_296.0).round() as i64
}

#[test]
fn derivatives_of_a_cubic_are_its_polynomials() {
    // x = j t^3 / 6: x' = j t^2 / 2, x'' = j t, x''' = j; backward differences lag half a tick per order.
    let mut data = ReportData::new("p", "m", HZ, axes());
    let jerk = 12_000.0;
    for tick in 0..1500u32 {
        let t = f64::from(tick) / HZ;
        let mut commanded = [0; AXES];
        commanded[1] = bits(jerk * t * t * t / 6.0);
        data.push(&TickRecord {
            tick: u64::from(tick),
            t_s: t,
            block: 1,
            commanded,
            ..TickRecord::default()
        });
    }
    let (v, a, j) = (
        data.velocity[1].points(),
        data.acceleration[1].points(),
        data.jerk[1].points(),
    );
    for tick in 10..1500 {
        let t = tick as f64 / HZ;
        let velocity = jerk * (t * t / 2.0 - t / (2.0 * HZ) + 1.0 / (6.0 * HZ * HZ));
        assert!((v[tick] - velocity).abs() < 1e-6);
        assert!((a[tick] - jerk * (t - 1.0 / HZ)).abs() < 1e-3);
        // Four roundings of half a bit: 8 * 2^-33 step * HZ^3.
        assert!((j[tick] - jerk).abs() < 0.12, "{}", j[tick]);
    }
    assert_eq!(data.velocity[0].peak(), 0.0);
}

#[test]
fn motion_in_the_first_tick_shows_no_more_jerk_than_there_is() {
    // Constant jerk as the interpolator adds it up: after tick n the axis is at n (n + 1) (n + 2) / 6 units.
    let unit = 1_i64 << 20;
    let mut data = ReportData::new("p", "m", HZ, axes());
    data.starts_from([0; AXES]);
    for tick in 0..20_i64 {
        let n = tick + 1;
        data.push(&TickRecord {
            tick: tick as u64,
            commanded: [n * (n + 1) * (n + 2) / 6 * unit, 0, 0, 0, 0],
            ..TickRecord::default()
        });
    }
    let jerk = unit as f64 / (1000.0 * 4_294_967_296.0) * HZ * HZ * HZ;
    assert!((data.jerk[0].peak() / jerk - 1.0).abs() < 1e-9);
}

#[test]
fn ticks_left_out_are_rest_and_no_jump() {
    let mut data = ReportData::new("p", "m", HZ, axes());
    let record = |tick, x: f64| TickRecord {
        tick,
        t_s: tick as f64 / HZ,
        block: 3,
        commanded: [bits(x), 0, 0, 0, 0],
        ..TickRecord::default()
    };
    // The first record is no jump from zero either.
    data.push(&record(100, 7.0));
    data.push(&record(101, 7.001));
    data.push(&record(9000, 7.001));
    data.push(&record(9001, 7.002));
    let v = data.velocity[0].points();
    assert_eq!(
        v.iter().map(|v| v.round()).collect::<Vec<_>>(),
        [0.0, 5.0, 0.0, 5.0]
    );
    let a = data.acceleration[0].points();
    assert_eq!(a[2].round(), 0.0);
    assert!((data.length_mm - 0.002).abs() < 1e-9);
}

#[test]
fn text_of_the_program_cannot_leave_its_element() {
    let mut data = ReportData::new("</script><b>", "m<!--", HZ, axes());
    data.lines = vec!["G1 X1 ;</script><!--@data-->".into()];
    data.push(&TickRecord {
        block: 1,
        ..TickRecord::default()
    });
    let html = page::html(&data);
    let ours = html.split("id=\"data\">").nth(1).unwrap();
    let payload = ours.split("</script>").next().unwrap();
    let value: serde_json::Value = serde_json::from_str(payload).unwrap();
    assert_eq!(value["program"], "</script><b>");
    assert_eq!(value["blocks"][0][1], "G1 X1 ;</script><!--@data-->");
}

#[test]
fn extremes_of_any_input_do_not_panic() {
    let mut data = ReportData::new("p", "m", f64::NAN, axes());
    for (tick, far) in [
        (0, i64::MIN),
        (1, i64::MAX),
        (u64::MAX, i64::MIN),
        (0, i64::MAX),
    ] {
        data.push(&TickRecord {
            tick,
            t_s: f64::NAN,
            block: u32::MAX,
            feed_mm_s: f64::INFINITY,
            commanded: [far; AXES],
            actual: [f64::NAN; AXES],
            following: [f64::NEG_INFINITY; AXES],
            contour_mm: Some(f64::NAN),
        });
        data.push_contour(1.0);
    }
    assert!(!page::html(&data).is_empty());
}
