//! Any bytes, as lines, to the interpreter of each dialect: no panic, commands within the range of coordinates, and a
//! refused line gives no command.
#![no_main]

use libfuzzer_sys::fuzz_target;
use pentaspline::nc::{Command, Interpreter};
use pentaspline_fuzz::{config, dialect};

fuzz_target!(|data: &[u8]| {
    for which in 0..3 {
        let config = config(dialect(which));
        let mut interpreter = Interpreter::new(&config);
        for line in data.split(|&b| b == b'\n') {
            let mut commands = 0;
            let mut emit = |command: Command| {
                commands += 1;
                if let Command::Move(block) = command {
                    assert!(block.feed.is_finite());
                }
            };
            let refused = interpreter.line(&config, line, &mut emit).is_err();
            assert!(!(refused && commands > 0), "a refused line acts");
        }
    }
});
