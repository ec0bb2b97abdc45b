//! Laws of the plant, against closed forms of the continuous loop.

use super::*;

const IDEAL: AxisPlant = AxisPlant {
    kv_per_s: 100.0,
    feed_forward: 0.0,
    velocity_lag_s: 0.002,
    a_saturation: 1e9,
    backlash: 0.0,
    encoder_resolution: 0.0,
};

const LINEAR: [bool; AXES] = [true, true, true, false, false];

fn plant(axis: AxisPlant, dt_s: f64) -> Plant {
    Plant::new(&[axis; AXES], LINEAR, dt_s, [0.0; AXES]).unwrap()
}

#[test]
fn following_error_on_a_ramp_is_v_over_kv_less_the_feed_forward() {
    for feed_forward in [0.0, 0.5, 0.98, 1.0] {
        let mut machine = plant(
            AxisPlant {
                feed_forward,
                ..IDEAL
            },
            2e-4,
        );
        let v = 25.0;
        let mut last = PlantSample::default();
        for k in 0..5000 {
            last = machine.step([v * f64::from(k) * 2e-4; AXES]);
        }
        let expected = v * (1.0 - feed_forward) / 100.0;
        for e in last.following {
            assert!((e - expected).abs() < 1e-9, "ff {feed_forward}: {e}");
        }
    }
}

#[test]
fn step_response_follows_the_second_order_closed_form() {
    // lag x'' + x' + Kv x = Kv: roots r = (-1 +- sqrt(1 - 4 Kv lag)) / (2 lag).
    for lag in [0.002, 0.010] {
        let mut machine = plant(
            AxisPlant {
                velocity_lag_s: lag,
                ..IDEAL
            },
            1e-6,
        );
        let kv = 100.0;
        let disc: f64 = 1.0 - 4.0 * kv * lag;
        for k in 0..100_000 {
            let t = f64::from(k) * 1e-6;
            let x = if disc > 0.0 {
                let (r1, r2) = (
                    (-1.0 + disc.sqrt()) / (2.0 * lag),
                    (-1.0 - disc.sqrt()) / (2.0 * lag),
                );
                1.0 + (r2 * (r1 * t).exp() - r1 * (r2 * t).exp()) / (r1 - r2)
            } else {
                let (sigma, w) = (0.5 / lag, (-disc).sqrt() / (2.0 * lag));
                1.0 - (-sigma * t).exp() * ((w * t).cos() + sigma / w * (w * t).sin())
            };
            let got = machine.step([1.0; AXES]).motor[0];
            assert!(
                (got - x).abs() < 1e-4,
                "lag {lag}, t {t}: {got} against {x}"
            );
        }
    }
}

#[test]
fn a_reversal_loses_exactly_the_backlash() {
    let mut machine = plant(
        AxisPlant {
            backlash: 0.05,
            ..IDEAL
        },
        2e-4,
    );
    let mut settle = |command: f64| {
        let mut last = PlantSample::default();
        for _ in 0..2000 {
            last = machine.step([command; AXES]);
        }
        last
    };
    let there = settle(1.0);
    assert!((there.actual[0] - 0.975).abs() < 1e-9);
    let within = settle(0.96);
    assert!(
        (within.actual[0] - there.actual[0]).abs() < 1e-9,
        "inside the play"
    );
    let back = settle(0.5);
    assert!((back.actual[0] - 0.525).abs() < 1e-9);
}

#[test]
fn the_drive_never_accelerates_harder_than_its_saturation() {
    let a_saturation = 7500.0;
    let mut machine = plant(
        AxisPlant {
            a_saturation,
            ..IDEAL
        },
        2e-4,
    );
    let mut x = [0.0; 3];
    let mut hardest: f64 = 0.0;
    for k in 0..4000 {
        let command = if k < 2000 { 50.0 } else { -50.0 };
        x = [x[1], x[2], machine.step([command; AXES]).motor[0]];
        if k >= 2 {
            hardest = hardest.max(((x[2] - 2.0 * x[1] + x[0]) / (2e-4 * 2e-4)).abs());
        }
    }
    assert!(hardest <= a_saturation * (1.0 + 1e-6), "{hardest}");
    assert!(
        hardest > a_saturation * 0.999,
        "a step of 50 mm must saturate"
    );
}

#[test]
fn saturated_start_is_free_fall_under_the_limit() {
    // Far from the target the drive pulls with a constant acceleration: x = a t^2 / 2.
    let mut machine = plant(
        AxisPlant {
            a_saturation: 1000.0,
            ..IDEAL
        },
        2e-4,
    );
    for k in 0..500 {
        let t = f64::from(k) * 2e-4;
        let x = machine.step([1e4; AXES]).motor[0];
        assert!((x - 500.0 * t * t).abs() < 1e-9);
    }
}

#[test]
fn equal_gains_keep_a_straight_line_straight() {
    let mut machine = plant(IDEAL, 2e-4);
    for k in 0..5000 {
        let s = f64::from(k.min(3000)) * 0.005;
        machine.step([s, 0.5 * s, -0.25 * s, 0.0, 0.0]);
    }
    machine.finish();
    assert!(machine.max_following()[0] > 0.2);
    assert!(machine.max_contour() < 1e-9, "{}", machine.max_contour());
}

#[test]
fn a_circle_shrinks_by_the_amplitude_response() {
    // |G(jw)| of Kv / (lag s^2 + s + Kv) at w = v/R; the tool runs on a circle of R |G|.
    let (radius, w, dt) = (10.0, 15.0, 1e-5);
    let mut machine = plant(IDEAL, dt);
    let (kv, lag) = (IDEAL.kv_per_s, IDEAL.velocity_lag_s);
    let gain = kv / (kv - lag * w * w).hypot(w);
    let mut errors = Vec::new();
    for k in 0..30_000 {
        let phase = w * f64::from(k) * dt;
        let command = [
            radius * (phase.cos() - 1.0),
            radius * phase.sin(),
            0.0,
            0.0,
            0.0,
        ];
        errors.extend(machine.step(command).contour);
    }
    let steady = errors[errors.len() - 1];
    let expected = radius * (1.0 - gain).abs();
    assert!(
        (steady - expected).abs() < 2e-3 * expected,
        "{steady} against {expected}"
    );
}

#[test]
fn unequal_gains_bend_nothing_but_shift_a_line() {
    // Steady state on a diagonal: the lags v/Kv differ, so the tool runs beside the line by
    // |vx vy / Kx - vy vx / Ky| / |v|.
    let slow = AxisPlant {
        kv_per_s: 50.0,
        ..IDEAL
    };
    let mut machine = Plant::new(
        &[IDEAL, slow, IDEAL, IDEAL, IDEAL],
        LINEAR,
        2e-4,
        [0.0; AXES],
    )
    .unwrap();
    let (vx, vy) = (20.0, 10.0);
    let mut errors = Vec::new();
    for k in 0..5000 {
        let t = f64::from(k) * 2e-4;
        errors.extend(machine.step([vx * t, vy * t, 0.0, 0.0, 0.0]).contour);
    }
    let expected = (vx * vy / 50.0 - vy * vx / 100.0) / f64::hypot(vx, vy);
    assert!((errors[errors.len() - 1] - expected).abs() < 1e-9);
}

#[test]
fn at_rest_the_motor_stays_within_one_encoder_increment() {
    let resolution = 0.01;
    let mut machine = plant(
        AxisPlant {
            encoder_resolution: resolution,
            ..IDEAL
        },
        2e-4,
    );
    for k in 0..20_000 {
        let sample = machine.step([1.2345; AXES]);
        if k > 5000 {
            assert!(sample.following[0].abs() <= resolution);
        }
    }
}

#[test]
fn values_that_make_no_machine_are_refused() {
    let build = |axis: AxisPlant| {
        let mut axes = [IDEAL; AXES];
        axes[3] = axis;
        Plant::new(&axes, LINEAR, 2e-4, [0.0; AXES])
    };
    for (field, axis) in [
        (
            "kv_per_s",
            AxisPlant {
                kv_per_s: 0.0,
                ..IDEAL
            },
        ),
        (
            "backlash",
            AxisPlant {
                backlash: -1.0,
                ..IDEAL
            },
        ),
        (
            "a_saturation",
            AxisPlant {
                a_saturation: f64::NAN,
                ..IDEAL
            },
        ),
    ] {
        assert!(matches!(
            build(axis),
            Err(PlantError::Value { axis: 3, field: f, .. }) if f == field
        ));
    }
    // Without lag the sampled loop is x -> (1 - Kv T) x: stable up to Kv T = 2.
    let gain = |kv_per_s| AxisPlant {
        kv_per_s,
        velocity_lag_s: 0.0,
        ..IDEAL
    };
    assert!(build(gain(9_900.0)).is_ok());
    assert!(matches!(
        build(gain(10_100.0)),
        Err(PlantError::Unstable { axis: 3, .. })
    ));
    assert!(matches!(
        Plant::new(&[IDEAL; AXES], LINEAR, 0.0, [0.0; AXES]),
        Err(PlantError::Period(_))
    ));
}
