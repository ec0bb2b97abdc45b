//! Programs in, commands and errors out; oracles are written out by hand or computed another way.

mod errors;
mod expression;
mod fanuc;
mod functions;
mod heidenhain;
mod language;
mod numbers;
mod programs;

use super::{Command, Interpreter, Motion, Move, NcError};
use crate::config::tests::test_config;
use crate::config::Config;
use crate::units::{Nano, AXES};

/// X Y Z A C without default feed.
fn xyzac() -> Config {
    test_config()
}

/// X Y Z B C.
fn xyzbc() -> Config {
    let mut config = test_config();
    config.axes[3].letter = b'B';
    config
}

/// Runs `program` line by line up to the first error.
fn run(config: &Config, program: &str) -> (Vec<Command>, Result<(), NcError>) {
    let mut interpreter = Interpreter::new(config);
    let mut commands = Vec::new();
    for line in program.lines() {
        if let Err(error) = interpreter.line(config, line.as_bytes(), &mut |command| {
            commands.push(command)
        }) {
            return (commands, Err(error));
        }
    }
    let end = interpreter.flush(config, &mut |command| commands.push(command));
    (commands, end)
}

/// Commands of a program that must be good.
fn commands(config: &Config, program: &str) -> Vec<Command> {
    let (commands, end) = run(config, program);
    if let Err(error) = end {
        panic!("{error} in\n{program}");
    }
    commands
}

/// Only the moves.
fn moves(config: &Config, program: &str) -> Vec<Move> {
    let only_moves = |command| match command {
        Command::Move(motion) => Some(motion),
        _ => None,
    };
    commands(config, program)
        .into_iter()
        .filter_map(only_moves)
        .collect()
}

/// Micrometres and millidegrees to [`Nano`].
fn micro(values: [i64; AXES]) -> [Nano; AXES] {
    values.map(|value| value * 1000)
}

fn is_spline(motion: &Move) -> bool {
    matches!(motion.motion, Motion::Spline(_))
}
