//! Laws of the whole language: any mixture of its curves runs on the curves the oracle reads, and another way of saying
//! the same makes the same steps.

use proptest::prelude::*;
use whole_product_tests::campaign::{cases, hold, machine, ran, ran_on, stays_on};
use whole_product_tests::drive::{Run, Script, Sender};
use whole_product_tests::generate::curves::{any_curve, program, OFFSETS};
use whole_product_tests::laws;
use whole_product_tests::oracle::path::path_on;
use whole_product_tests::oracle::read::{Language, Setup};

fn setup() -> Setup {
    Setup {
        offsets: OFFSETS,
        ..Setup::default()
    }
}

fn speaking(language: Language) -> Setup {
    Setup {
        language,
        ..Setup::default()
    }
}

fn good(setup: &Setup, text: &str) -> Run {
    ran_on(setup, text).unwrap_or_else(|broken| panic!("{broken}"))
}

/// The steps of `a` on `one` are those of `b` on `other`.
fn same(one: &Setup, a: &str, other: &Setup, b: &str) {
    assert_eq!(good(one, a).digest, good(other, b).digest, "\n{a}\n{b}");
}

proptest! {
    #![proptest_config(cases(60))]

    #[test]
    fn a_mixture_runs_on_the_curves_it_asks_for(text in program(any_curve(), 8)) {
        hold(&setup(), &text, |config, run, curves| {
            let tolerance = f64::from(config.curve_tolerance) + 2e-5;
            laws::follows(config, run, curves, tolerance)?;
            laws::meets_the_points(config, run, curves)
        }).map_err(TestCaseError::fail)?;
    }

    #[test]
    fn a_mixture_keeps_the_limits_and_ends_exactly(text in program(any_curve(), 8)) {
        hold(&setup(), &text, |config, run, curves| {
            laws::stays_within_limits(config, run, &laws::brisk_lines(curves), 0.005)?;
            laws::emits_exactly_the_commanded_steps(run)?;
            laws::never_runs_backwards(run)?;
            let end = curves.last().and_then(|curve| curve.end).unwrap_or_default();
            laws::ends_exactly_on(run, &laws::bits(config, &end))
        }).map_err(TestCaseError::fail)?;
    }

    #[test]
    fn the_arrival_of_bytes_does_not_change_the_steps(
        text in program(any_curve(), 5),
        seed in any::<u64>(),
        poll_every in 1_u64..=20,
    ) {
        let config = machine(&setup());
        let whole = ran(&config, &Script::new(&text)).map_err(TestCaseError::fail)?;
        let parted = Script {
            sender: Sender::Bursts { seed, bytes: 600, gap: 10 },
            poll_every,
            ..Script::new(&text)
        };
        let parted = ran(&config, &parted).map_err(TestCaseError::fail)?;
        prop_assert_eq!(parted.digest, whole.digest, "poll_every {} seed {}\n{}", poll_every, seed, text);
    }

    #[test]
    fn a_program_in_small_letters_without_blanks_makes_the_same_steps(text in program(any_curve(), 5)) {
        let plain: String = text
            .lines()
            .map(|line| if line.contains('"') { format!("{line}\n") } else { format!("{}\n", line.replace(' ', "").to_lowercase()) })
            .collect();
        let (a, b) = (ran_on(&setup(), &text), ran_on(&setup(), &plain));
        let (a, b) = (a.map_err(TestCaseError::fail)?, b.map_err(TestCaseError::fail)?);
        prop_assert_eq!(a.digest, b.digest, "{}", text);
    }

    #[test]
    fn parameters_say_what_numbers_say(x in -90_000_i64..90_000, y in 1_i64..90_000, r in 100_i64..400) {
        let mm = |n: i64| n as f64 / 1000.0;
        let numbers = format!("G1 F3000 X{} Y{}\nG3 X{} CR={}\nM30\n", mm(x), mm(y), mm(x + 2 * r), mm(r));
        let parameters = format!(
            "R1={} R2={}\nR3={}\nR4=R1+2*R3\nG1 F=1000*3 X=R1 Y=R2/2+R2*SIN(30)\nG3 X=R4 CR=R3\nM30\n",
            mm(x), mm(y), mm(r),
        );
        let (a, b) = (ran_on(&Setup::default(), &numbers), ran_on(&Setup::default(), &parameters));
        let (a, b) = (a.map_err(TestCaseError::fail)?, b.map_err(TestCaseError::fail)?);
        prop_assert_eq!(a.end(), b.end(), "\n{}{}", numbers, parameters);
    }
}

#[test]
fn dimensions_say_the_same_in_every_spelling() {
    let plain = Setup::default();
    let absolute = "G1 F3000 X10 Y5\nX30 Y-5 C0.2\nG3 X40 Y5 I0 J10\nM30\n";
    for other in [
        "G91 G1 F3000 X10 Y5\nX20 Y-10 C0.2\nG3 X10 Y10 I0 J10\nM30\n",
        "G1 F3000 X=IC(10) Y=IC(5)\nX=IC(20) Y=AC(-5) C=DC(0.2)\nG3 X=IC(10) Y5 J=AC(5)\nM30\n",
        "G91 G1 F3000 XAC10 YAC5\nXIC20 YAC-5 CAC0.2\nG3 XAC40 YIC10 IAC30 JAC5\nM30\n",
        "g1f3000xac10yac5\nxac30yic-10c.2\ng3xic10y5iac30jac5\nm30\n",
    ] {
        same(&plain, absolute, &plain, other);
    }
}

#[test]
fn frames_shift_and_machine_coordinates_do_not() {
    let shifted = Setup {
        offsets: [[0; 5], [5_000_000, -1_000_000, 0, 0, 0], [0; 5], [0; 5]],
        ..Setup::default()
    };
    same(
        &shifted,
        "G55 G1 F3000 X1 Y1\nG53 X20\nX30 Y5\nG54 X10\nG500 X3 Y2\nM30\n",
        &Setup::default(),
        "G1 F3000 X6 Y0\nX20\nX35 Y4\nX10\nX3 Y2\nM30\n",
    );
}

#[test]
fn planes_only_turn_the_machine() {
    // The same arc in three planes, axis by axis: as far, as long.
    let run = |text: &str| good(&Setup::default(), text);
    let xy = run("G17 G1 F3000 X10\nG3 X0 Y10 I-10\nM30\n");
    let zx = run("G18 G1 F3000 Z10\nG3 Z0 X10 K-10\nM30\n");
    let yz = run("G19 G1 F3000 Y10\nG3 Y0 Z10 J-10\nM30\n");
    for (tick, (z, y)) in xy.ticks.iter().zip(zx.ticks.iter().zip(&yz.ticks)) {
        let c = tick.commanded;
        assert_eq!([c[0], c[1]], [z.commanded[2], z.commanded[0]]);
        assert_eq!([c[0], c[1]], [y.commanded[1], y.commanded[2]]);
    }
    assert_eq!([xy.ticks.len(); 2], [zx.ticks.len(), yz.ticks.len()]);
}

#[test]
fn inverse_time_is_the_time_the_block_takes() {
    // 0.2 blocks per second would be 12 per minute; one block of 5 s at rest to rest takes a little longer.
    for text in [
        "G93 G1 X50 F12\nM30\n",
        "G93 G3 X20 Y0 I10 F12\nM30\n",
        "G93 BSPLINE X10 Y5 F36\nX20 Y0 F36\nX30 Y10 F12\nM30\n",
    ] {
        let run = good(&Setup::default(), text);
        let seconds = run.moving() as f64 / f64::from(machine(&Setup::default()).servo_hz);
        assert!((4.9..6.0).contains(&seconds), "{seconds} s\n{text}");
    }
}

#[test]
fn feed_per_revolution_is_feed_per_minute_times_the_speed() {
    let plain = Setup::default();
    same(
        &plain,
        "G94 G1 X30 F1200\nM30\n",
        &plain,
        "G95 S1000 G1 X30 F1.2\nM30\n",
    );
}

#[test]
fn conversational_lines_and_circles_make_the_steps_of_their_words() {
    same(
        &speaking(Language::Heidenhain),
        "0 BEGIN PGM A MM\n1 L X+10 Y+5 R0 F3000\n2 L IX+20 IY-2.5 C+0.1\n3 CC X+20 Y+2.5\n4 C X+10 Y+2.5 DR+\n\
         5 CR X+20 Y+12.5 R+10 DR-\n6 L Z+3 FMAX\n7 END PGM A MM\n",
        &Setup::default(),
        "G1 X10 Y5 F3000\nX30 Y2.5 C0.1\nG3 X10 I-10\nG2 X20 Y12.5 CR=10\nG0 Z3\nM30\n",
    );
}

#[test]
fn conversational_splines_run_on_their_cubics() {
    let setup = speaking(Language::Heidenhain);
    // P(1) is the start: K3 + K2 + K1 + end = start.
    let text = "0 BEGIN PGM A MM\n1 L X+1 Y+2 Z+0 F3000\n\
        2 SPL X+11 Y+5 Z+1 K3X+1 K2X-1.5 K1X-9.5\n\
        K3Y+2 K2Y-4 K1Y-1\n\
        K3Z+0 K2Z+0 K1Z-1\n\
        3 SPL X+20 Y+4 Z+1 K3X+0.5 K2X+0 K1X-9.5\n\
        K3Y-1.5 K2Y+1.5 K1Y+1\n\
        K3Z+0 K2Z+0 K1Z+0\n\
        4 END PGM A MM\n";
    let config = machine(&setup);
    let run = good(&setup, text);
    let curves = path_on(&setup, text);
    assert_eq!(curves.len(), 3);
    stays_on(&config, &run, &curves, 1e-4).unwrap_or_else(|broken| panic!("{broken}\n{text}"));
}

#[test]
fn spline_path_leaves_the_other_axes_on_straight_lines() {
    let setup = Setup::default();
    for text in [
        "G1 F3000 X1\nSPLINEPATH(1,X,Y,Z)\nCSPLINE X5 Y4 C0.2\nX9 Y1 C0.1\nX15 Y3 C0.4\nX20 Y0\nM30\n",
        "G1 F3000 X1\nASPLINE SPLINEPATH XYZ\nX5 Y4 C0.2\nX9 Y1 C0.1\nX15 Y3 C0.4\nX20 Y0\nM30\n",
    ] {
        hold(&setup, text, |config, run, curves| {
            laws::follows(config, run, curves, 1e-3).map(|_| ())
        })
        .unwrap_or_else(|broken| panic!("{broken}"));
    }
}

#[test]
fn a_word_of_group_1_ends_a_spline_and_begins_the_next() {
    let setup = Setup::default();
    let text = "G1 F3000 X1\nBNAT ENAT\nCSPLINE X5 Y4\nX9 Y1\nCSPLINE X15 Y3\nX20 Y0\nBSPLINE SD=2 X25 Y4\nX30 Y1\n\
        BSPLINE SD=3 X35 Y3\nX40 Y0\nX45 Y1\nM30\n";
    hold(&setup, text, |config, run, curves| {
        laws::follows(config, run, curves, 1e-3)?;
        laws::meets_the_points(config, run, curves)
    })
    .unwrap_or_else(|broken| panic!("{broken}"));
}
