//! When the background gets to run is chance: on a board other tasks, the wire and the length of its own steps decide it.
//! As long as it keeps up, the motion must not depend on it.

use std::collections::VecDeque;

use whole_product_tests::drive::{with_rig, Run};
use whole_product_tests::examples;
use whole_product_tests::rng::Rng;

/// Ticks a program may take.
const LIMIT: u64 = 2_000_000;

/// Runs `text`; `polls` says how often the background is called in each tick.
fn scheduled(text: &str, mut polls: impl FnMut() -> u64) -> Run {
    let config = examples::machine().config;
    let mut text: VecDeque<u8> = text.bytes().collect();
    with_rig(&config, |rig| {
        rig.controller.set_program_stops(false);
        while rig.now < LIMIT && !rig.run.finished {
            for _ in 0..polls() {
                while !text.is_empty() && rig.controller.receive_free() > 2 {
                    rig.controller.receive(text.pop_front().expect("not empty"));
                }
                let more = rig.controller.poll(rig.now);
                while let Some(byte) = rig.controller.transmit() {
                    rig.run.output.push(char::from(byte));
                }
                if !more && (text.is_empty() || rig.controller.receive_free() <= 2) {
                    break;
                }
            }
            rig.tick();
            rig.run.finished = text.is_empty() && rig.controller.is_idle();
        }
    })
}

/// Lines of 0.02 mm at a feed that cannot be braked from within what is looked ahead over: how far that is decides the
/// velocity.
fn dashes() -> String {
    let mut text = String::from("G64 SOFT G1 F12000\n");
    for i in 1..=1500 {
        let x = 0.016 * f64::from(i);
        text += &format!("X{x:.4} Y{:.4}\n", 0.75 * x);
    }
    text + "M30\n"
}

fn same(case: &str, run: &Run, calm: &Run) {
    assert!(run.finished, "{case}: no end");
    assert_eq!(
        format!("{:016x}", run.digest),
        format!("{:016x}", calm.digest),
        "{case}; the other digest is that of a background that always has its way"
    );
}

#[test]
fn the_motion_does_not_depend_on_when_the_background_runs() {
    let names = [
        "golden/spln150.nc",
        "bspline_demo.nc",
        "five_axis_sweep.nc",
        "mixed_modes.nc",
        "pocket_brisk.nc",
        "tiny_moves.nc",
    ];
    let programs = names.map(|name| (name, examples::text(name)));
    for (name, text) in programs.into_iter().chain([("dashes", dashes())]) {
        let calm = scheduled(&text, || u64::MAX);
        assert!(calm.finished, "{name}: no end");
        for (seed, most) in [(1, 200), (2, 60), (3, 20)] {
            let mut rng = Rng::new(seed);
            same(
                &format!("{name}: up to {most} calls in a tick"),
                &scheduled(&text, || rng.within(0, most)),
                &calm,
            );
        }
        for (seed, longest) in [(4, 20), (5, 28)] {
            let mut rng = Rng::new(seed);
            let mut away = 0;
            let calls = || {
                if away > 0 {
                    away -= 1;
                    return 0;
                }
                away = rng.within(0, longest);
                u64::MAX
            };
            same(
                &format!("{name}: up to {longest} ticks without a call"),
                &scheduled(&text, calls),
                &calm,
            );
        }
    }
}
