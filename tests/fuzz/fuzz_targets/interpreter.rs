//! Whole programs: the first byte chooses the dialect, the rest is text. What the interpreter gives goes on to the
//! geometry: no panic, an error never moves the program's position, every segment is finite and within travel where
//! the travel check says so.
#![no_main]

use libfuzzer_sys::fuzz_target;
use pentaspline::geometry::SegmentBuilder;
use pentaspline::nc::{Command, Interpreter};
use pentaspline::units::{Steps, AXES};
use pentaspline_fuzz::{check, config, dialect, SEGMENTS_MAX};

fuzz_target!(|data: &[u8]| {
    let Some((&which, text)) = data.split_first() else {
        return;
    };
    let config = config(dialect(which));
    let origin = [Steps::ZERO; AXES];
    let mut interpreter = Interpreter::new(&config);
    let mut builder = SegmentBuilder::new(&config, origin);
    let drain = |builder: &mut SegmentBuilder| {
        for _ in 0..SEGMENTS_MAX {
            match builder.next(&config) {
                Some(path) => check(&config, &path.segment),
                None => return,
            }
        }
        panic!("a block without end");
    };
    for line in text.split(|&b| b == b'\n') {
        let before = interpreter.position();
        let mut commands = Vec::new();
        let result = interpreter.line(&config, line, &mut |command| commands.push(command));
        if result.is_err() {
            assert!(commands.is_empty(), "a refused line acts");
            assert_eq!(interpreter.position(), before, "a refused line moves");
        }
        for command in commands {
            if let Command::Move(block) = command {
                if builder.push(&config, &block).is_err() {
                    builder.reset(origin);
                    interpreter.set_position([0; AXES]);
                }
                drain(&mut builder);
            }
        }
    }
    let _ = interpreter.flush(&config, &mut |_| {});
    if builder.finish(&config).is_err() {
        builder.reset(origin);
    }
    drain(&mut builder);
});
