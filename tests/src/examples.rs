//! The example programs of the repository, as they go over the wire.

use std::path::PathBuf;

use host_sim::machine_file::Machine;
use host_sim::program::Program;

/// Path of `examples/NAME`.
#[must_use]
pub fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../examples")
        .join(name)
}

/// `examples/NAME` with its sub-programs inlined.
///
/// # Panics
/// If it cannot be read.
#[must_use]
pub fn load(name: &str) -> Program {
    Program::load(&path(name)).unwrap_or_else(|failure| panic!("{name}: {failure:?}"))
}

/// Its lines, each ended by `\n`.
#[must_use]
pub fn text(name: &str) -> String {
    load(name)
        .lines()
        .map(|line| format!("{}\n", String::from_utf8_lossy(line)))
        .collect()
}

/// The built-in MCV 1210.
///
/// # Panics
/// If the file that is compiled in does not parse.
#[must_use]
pub fn machine() -> Machine {
    Machine::built_in().unwrap_or_else(|failure| panic!("{failure:?}"))
}
