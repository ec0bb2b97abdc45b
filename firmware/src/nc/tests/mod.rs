//! Programs in, commands and errors out; oracles are written out by hand or computed another way.

mod curves;
mod errors;
mod expression;
mod fanuc;
mod functions;
mod heidenhain;
mod language;
mod numbers;
mod plain;
mod programs;

use super::{Command, Interpreter, Motion, Move, NcError, SplineSpec};
use crate::config::tests::test_config;
use crate::config::{Config, ToolData};
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

/// A machine with tool 4, `FR_4`: radius 2 mm, length 80 mm; zero offsets 1, 2, 3 mm (`G55`) in X, Y, Z.
fn equipped() -> Config {
    let mut config = xyzac();
    let mut name = [0; 16];
    name[..4].copy_from_slice(b"FR_4");
    config.tools[3] = ToolData {
        number: 4,
        name,
        radius: 2_000_000,
        length: 80_000_000,
    };
    config.zero_offsets[1] = micro([1000, 2000, 3000, 0, 0]);
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

fn specs(config: &Config, program: &str) -> Vec<SplineSpec> {
    let spec = |motion: &Move| match motion.motion {
        Motion::Spline(spec) => Some(spec),
        _ => None,
    };
    moves(config, program).iter().filter_map(spec).collect()
}

fn targets(config: &Config, program: &str) -> Vec<[Nano; 5]> {
    let end = |motion: &Move| motion.target;
    moves(config, program).iter().map(end).collect()
}

/// `line:column code text` of the last line.
fn refusal(config: &Config, program: &str) -> String {
    run(config, program).1.expect_err(program).to_string()
}
