//! The simulator: the same motion core that runs on the board, on a PC, against a model of the machine.
//!
//! Comes in: a part program and a machine file. Goes out: a trace of every servo tick, a summary, a report.
//! Only the public API of [`pentaspline`] is used; `docs/architecture.md` has the whole road.

#[cfg(unix)]
pub mod bench;
pub mod cli;
pub mod commands;
pub mod diagnostics;
#[cfg(unix)]
pub mod emulate;
pub mod events;
pub mod feeder;
pub mod machine_file;
pub mod plant;
pub mod precheck;
pub mod program;
#[cfg(unix)]
pub mod pty;
pub mod report;
pub mod runner;
pub mod send;
#[cfg(unix)]
pub mod serve;
pub mod study;
pub mod summary;
pub mod trace;
pub mod travel;
pub mod watch;
