//! Wherever the stream of bytes is cut, and however long the pauses below the starve time, the steps are the same: for
//! every kind of motion.

use whole_product_tests::campaign::ran;
use whole_product_tests::drive::{Run, Script, Sender};
use whole_product_tests::wire_programs::{WireProgram, PROGRAMS};

fn run(program: &WireProgram, sender: Sender, poll_every: u64) -> Run {
    let script = Script {
        sender,
        poll_every,
        ..Script::new(program.text)
    };
    ran(&program.machine(), &script).unwrap_or_else(|broken| panic!("{}: {broken}", program.name))
}

/// Every program under bursts of up to `bytes`, up to `gap` ticks apart, makes the steps it makes in one piece.
fn same(bytes: u64, gap: u64, poll_every: u64) {
    for program in &PROGRAMS {
        let whole = run(program, Sender::Full, 1);
        for seed in 1..=4 {
            let sender = Sender::Bursts { seed, bytes, gap };
            let parted = run(program, sender, poll_every);
            let name = program.name;
            assert_eq!(parted.end(), whole.end(), "{name}, seed {seed}");
            assert_eq!(parted.digest, whole.digest, "{name}, seed {seed}");
        }
    }
}

#[test]
fn byte_by_byte() {
    same(1, 0, 1);
}

#[test]
fn in_pieces_of_lines() {
    same(60, 10, 1);
}

#[test]
fn in_pieces_of_many_lines_to_a_slow_background() {
    same(600, 10, 20);
}

#[test]
fn with_long_pauses() {
    same(400, 400, 1);
}

#[test]
fn with_pauses_in_every_line() {
    same(12, 200, 1);
}
