//! `host-sim serve`: the virtual controller on a pseudo-terminal, in real time.

use std::io::Write;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use clap::Args;
use pentaspline::machine::Core;

use super::stop_on_signal;
use crate::diagnostics::{Exit, Failure, Located};
use crate::machine_file::Machine;
use crate::pty::{Link, PseudoTerminal};
use crate::serve::{serve as run, CoreDevice};

/// Arguments of `serve`.
#[derive(Args, Clone, Debug)]
pub struct ServeArgs {
    /// Symbolic link to the pseudo-terminal, removed at the end.
    #[arg(long, value_name = "PATH")]
    pub link: Option<PathBuf>,
    /// Machine file instead of the built-in MCV 1210.
    #[arg(long, value_name = "FILE")]
    pub machine: Option<PathBuf>,
}

/// Serves until Ctrl-C or a termination signal; the device a client opens is the one line on stdout.
///
/// # Errors
/// Exit code 2 for the machine file, 5 for the terminal or the link.
pub fn serve(args: &ServeArgs) -> Result<Exit, Failure> {
    static STOP: AtomicBool = AtomicBool::new(false);
    let machine = Machine::load(args.machine.as_deref())?;
    let terminal = PseudoTerminal::open().map_err(|e| io("open a pseudo-terminal", &e))?;
    // Before the link exists: from then on a signal must find its way past the destructor.
    stop_on_signal(&STOP)?;
    let link = match &args.link {
        Some(path) => {
            Some(Link::new(path, terminal.path()).map_err(|e| Failure::io("make link", path, &e))?)
        }
        None => None,
    };
    let shown = args.link.as_deref().unwrap_or(terminal.path());
    eprintln!(
        "{} in real time at {} Hz; Ctrl-C ends",
        machine.config.name, machine.config.servo_hz
    );
    println!("{}", shown.display());
    // A closed stdout is no reason to stop serving.
    let _ = std::io::stdout().flush();

    let mut core = Box::new(Core::new());
    let (controller, servo) = core.split(&machine.config);
    let mut device = CoreDevice { controller, servo };
    let served =
        run(&mut device, &terminal, machine.config.servo_hz, &STOP).map_err(|e| io("serve", &e))?;
    drop(link);
    eprintln!(
        "{} servo ticks, {} bytes received",
        served.ticks, served.bytes_in
    );
    if served.ticks_forgiven > 0 {
        eprintln!(
            "{} ticks left out: this computer did not keep up",
            served.ticks_forgiven
        );
    }
    if served.bytes_lost > 0 {
        eprintln!(
            "{} bytes of answers lost: no client read them",
            served.bytes_lost
        );
    }
    Ok(Exit::Success)
}

fn io(action: &str, error: &std::io::Error) -> Failure {
    Failure::new(Exit::Io, Located::new(format!("cannot {action}: {error}")))
}
