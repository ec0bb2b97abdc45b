//! `G93`: a block takes the time it was given.
//!
//! From the commanded positions: a block begins and ends where the way has the length the oracle's curves give it, between
//! two ticks as a rule. Where blocks are driven at one feed and no limit binds, that is the programmed time. Where the feed
//! has to change from block to block, it takes longer, and never less.

use std::f64::consts::TAU;
use std::fmt::Write;

use proptest::prelude::*;
use whole_product_tests::campaign::cases;
use whole_product_tests::examples;
use whole_product_tests::feed::ideal::{ramp, Ideal};
use whole_product_tests::feed::programs::{held, sinumerik, Held, Template};
use whole_product_tests::feed::times;
use whole_product_tests::oracle::path::path;
use whole_product_tests::oracle::read::Setup;

/// Ticks by which the time of a block may be off: a tick in 6 s, of which the planner, which ends speeding up within 1e-5 of
/// the feed, takes the most, and a tenth of a tick where blocks are short.
fn allowed(programmed: f64) -> f64 {
    0.1 + 3e-5 * programmed
}

/// Largest number `F` may have.
const RATE_MAX: f64 = 999_999.0;

/// Ends of blocks of very different lengths, as shares of the whole.
const SHARES: [f64; 9] = [0.03, 0.2, 0.21, 0.35, 0.6, 0.605, 0.7, 0.95, 1.0];

/// One line, circle, polynomial or spline in blocks of different lengths, and the feed, mm/min or degree/min.
fn divided() -> Vec<(Template, f64)> {
    let along = |name, front: &str, axes: &[(&str, f64)]| {
        let mut text = String::from(front);
        for share in SHARES {
            for (axis, way) in axes {
                let _ = write!(text, " {axis}{:.6}", share * way);
            }
            text += "@\n";
        }
        Template::new(name, text)
    };
    let mut round = String::from("G3");
    let mut small = String::from("BNAT ENAT CSPLINE");
    for share in SHARES {
        let (sin, cos) = (share * TAU).sin_cos();
        let _ = writeln!(
            round,
            " X{:.6} Y{:.6} Z{:.6} I=AC(-20) J=AC(0)@",
            20.0 * cos - 20.0,
            20.0 * sin,
            3.0 * share
        );
    }
    for k in 1..30 {
        let turned = 0.1 * f64::from(k);
        let (sin, cos) = turned.sin_cos();
        let (x, y, a) = (0.05 - 0.05 * cos, 0.05 * sin, 2.5 * turned);
        let _ = writeln!(small, " X{x:.6} Y{y:.6} A{a:.6}@");
    }
    vec![
        (along("a line", "G1", &[("X", 100.0), ("Y", -40.0)]), 1500.0),
        (
            along(
                "a line in five axes",
                "G1",
                &[("X", 60.0), ("Z", 30.0), ("A", 1.5), ("C", -2.0)],
            ),
            600.0,
        ),
        (along("rotary axes", "G1", &[("A", 2.0), ("C", -1.0)]), 30.0),
        (
            along(
                "rotary axes and hardly a line",
                "G1",
                &[("X", 0.02), ("Y", 0.02), ("A", 2.0)],
            ),
            0.3,
        ),
        (Template::new("a helix", round), 600.0),
        (Template::new("rotary axes and a tiny circle", small), 0.6),
    ]
}

/// `template` under `G93` with each block at `feed(k)`, mm/min or degree/min.
fn timed(template: &Template, mode: &str, feed: impl Fn(usize) -> f64) -> String {
    let curves = path(&template.at_rates(mode, |_| 60.0));
    let ideal = Ideal::new(&examples::machine().config, &curves, 1.0);
    template.at_rates(mode, |line| {
        let at = ideal.ends.iter().position(|end| end.line == line);
        at.map_or(60.0, |k| (feed(k) / ideal.ends[k].length).min(RATE_MAX))
    })
}

/// Holds the time of the blocks that no limit keeps from it. Returns the largest error in ticks, and how many blocks it is of.
fn take_their_time(name: &str, held: &Held) -> (f64, usize) {
    let times = times(&held.config, &held.run, &held.ideal);
    let (mut most, mut count) = (0.0_f64, 0);
    for taken in times.iter().filter(|taken| taken.free) {
        let off = (taken.ticks - taken.programmed).abs();
        assert!(off <= allowed(taken.programmed), "{name}: {taken:?}");
        (most, count) = (most.max(off), count + 1);
    }
    println!("{name}: {most:.3} ticks, {count} of {} blocks", times.len());
    (most, count)
}

#[test]
fn blocks_of_any_length_take_their_time() {
    for (template, feed) in &divided() {
        for mode in ["SOFT", "BRISK"] {
            let name = format!("{mode} {}", template.name);
            let held = held(&Setup::default(), &timed(template, mode, |_| *feed), 100);
            let (_, count) = take_their_time(&name, &held);
            assert!(count >= 5, "{name}: {count} blocks");
        }
    }
}

/// Between lines that lead in and out, without a bend at their ends or with a slight one.
#[test]
fn polynomials_and_arcs_between_lines_take_their_time() {
    let joined = [
        (
            "a polynomial, speeds 1:49",
            "G1 X20@\nPOLY PO[X]=(105,-480,320) PO[Y]=(1,0,10,-15,6)@\nG1 X125@\n",
        ),
        (
            "a straight polynomial, speeds 1:241",
            "G1 X20 Y10@\nPOLY PO[X]=(101,-480,320) PO[Y]=(50.5,-240,160)@\nG1 X121 Y60.5@\n",
        ),
        ("half a circle", "G1 X20@\nG3 X20 Y40 I0 J20@\nG1 X0@\n"),
    ];
    for (name, text) in joined {
        let template = Template::new(name, text.into());
        let held = held(
            &Setup::default(),
            &timed(&template, "BRISK", |_| 600.0),
            100,
        );
        let (_, count) = take_their_time(name, &held);
        assert_eq!(count, 1, "{name}");
    }
}

#[test]
fn blocks_of_any_parametrisation_take_their_time() {
    let mut counts = 0;
    for template in &sinumerik() {
        let rotary = template.name.contains("rotary");
        for mode in ["SOFT", "BRISK"] {
            let name = format!("{mode} {}", template.name);
            let text = timed(template, mode, |_| if rotary { 6.0 } else { 600.0 });
            counts += take_their_time(&name, &held(&Setup::default(), &text, 100)).1;
        }
    }
    assert!(counts >= 200, "{counts} blocks");
}

#[test]
fn a_contour_takes_the_sum_of_its_times_and_the_ramps_at_its_ends() {
    for (template, feed) in &divided() {
        if !["a line", "a helix"].contains(&template.name) {
            continue;
        }
        let held = held(&Setup::default(), &timed(template, "SOFT", |_| *feed), 100);
        let hz = f64::from(held.config.servo_hz);
        let moving = held.run.ticks.iter().filter(|tick| tick.moving).count() as f64;
        let times = held.ideal.ends.iter().map(|end| end.length / end.feed);
        let more = moving / hz - times.sum::<f64>();
        // Half of the time of each ramp is what a constant feed would have taken. The line is slanted.
        let axis = &held.config.axes[0];
        let [a, j] = [axis.a_max, axis.j_max].map(f64::from);
        let least = ramp(feed / 60.0, 1.08 * a, 1.08 * j).1;
        println!("{}: {more:.4} s more, at least {least:.4}", template.name);
        assert!(more >= least - 1.0 / hz, "{}: {more}", template.name);
        assert!(more <= 1.25 * least + 0.002, "{}: {more}", template.name);
    }
}

proptest! {
    #![proptest_config(cases(24))]

    #[test]
    fn no_block_is_faster_than_programmed(
        which in any::<prop::sample::Index>(),
        brisk in any::<bool>(),
        feeds in prop::collection::vec(2.3_f64..3.3, 7),
    ) {
        let mut all = sinumerik();
        all.extend(divided().into_iter().map(|(template, _)| template));
        let template = which.get(&all);
        // Degrees, and millimetres beside many degrees, are slower.
        let slow = if template.name.contains("rotary") { 0.01 } else { 1.0 };
        let mode = if brisk { "BRISK" } else { "SOFT" };
        let feed = |k: usize| slow * 10_f64.powf(feeds[k % feeds.len()]);
        let held = held(&Setup::default(), &timed(template, mode, feed), 100);
        for taken in times(&held.config, &held.run, &held.ideal) {
            let early = taken.programmed - taken.ticks;
            prop_assert!(early <= allowed(taken.programmed), "{} {}: {:?}", mode, template.name, taken);
        }
    }
}
