//! The `host-sim` command: wiring only, see the library.

use std::process::ExitCode;

use clap::Parser;
use host_sim::cli::Cli;
use host_sim::commands::dispatch;

fn main() -> ExitCode {
    match dispatch(Cli::parse()) {
        Ok(exit) => exit.into(),
        Err(failure) => {
            let exit = failure.exit;
            failure.print();
            exit.into()
        }
    }
}
