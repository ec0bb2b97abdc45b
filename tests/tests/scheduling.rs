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

#[test]
fn the_motion_does_not_depend_on_when_the_background_runs() {
    for name in [
        "golden/spln150.nc",
        "bspline_demo.nc",
        "five_axis_sweep.nc",
        "mixed_modes.nc",
        "pocket_brisk.nc",
        "tiny_moves.nc",
    ] {
        let text = examples::text(name);
        let calm = scheduled(&text, || u64::MAX);
        assert!(calm.finished, "{name}");
        for (seed, most) in [(1, 200), (2, 60), (3, 20)] {
            let mut rng = Rng::new(seed);
            let run = scheduled(&text, || rng.within(0, most));
            assert!(run.finished, "{name}: up to {most} calls in a tick, no end");
            assert_eq!(
                format!("{:016x}", run.digest),
                format!("{:016x}", calm.digest),
                "{name}: up to {most} calls in a tick, as many as there is work for"
            );
        }
    }
}
