//! Why an emulated run did not come to a result.

use std::fmt;
use std::io;
use std::path::PathBuf;
use std::time::Duration;

use pentaspline::board::trace::UnknownTag;

/// Command that builds the image, named in errors.
pub const BUILD_IMAGE: &str = "bash .ci/firmware";
/// Command that installs the emulator, named in errors.
pub const INSTALL: &str = "apt-get install qemu-system-arm (or: bash .ci/setup)";

/// What went wrong. A program that the controller refuses is not among it: that is a result.
#[derive(Debug)]
pub enum EmulateError {
    /// `qemu-system-arm` is not in `PATH`.
    NoEmulator,
    /// There is no firmware image.
    NoImage(PathBuf),
    /// The emulator could not be started or talked to.
    Io(io::Error),
    /// The emulator ended by itself.
    Exited {
        /// What it printed, usually one line.
        stderr: String,
    },
    /// The image did not come up.
    NoAnswer(Duration),
    /// The board takes no more lines and does not move.
    Stalled {
        /// How long nothing happened.
        after: Duration,
        /// Last state reported.
        state: String,
        /// Lines answered.
        answered: usize,
    },
    /// The bound on wall-clock time was reached.
    Deadline(Duration),
    /// The image speaks another version of the trace format, or was built for another servo rate.
    WrongImage {
        /// Version of the trace.
        version: u8,
        /// Servo ticks per second.
        servo_hz: u32,
    },
    /// The event file has too many rows, or one whose tick is too large.
    Timetable,
    /// The trace is damaged.
    Trace(UnknownTag),
    /// The firmware panicked.
    Panicked(String),
    /// The frames that arrived are not the frames the board computed.
    Mismatch {
        /// Digest and ticks the board sent.
        board: (u64, u64),
        /// Digest and ticks of the frames that arrived.
        received: (u64, u64),
    },
}

impl EmulateError {
    /// What to do about it, or nothing.
    #[must_use]
    pub fn help(&self) -> String {
        match self {
            Self::NoEmulator => format!("install it: {INSTALL}"),
            Self::NoImage(_) => {
                format!("build it: {BUILD_IMAGE}; or name another with PENTASPLINE_QEMU_IMAGE")
            }
            Self::WrongImage { .. } => format!("build the image anew: {BUILD_IMAGE}"),
            _ => String::new(),
        }
    }
}

impl fmt::Display for EmulateError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoEmulator => write!(f, "qemu-system-arm is not installed"),
            Self::NoImage(path) => write!(f, "no firmware image at {}", path.display()),
            Self::Io(error) => write!(f, "emulator: {error}"),
            Self::Exited { stderr } => write!(f, "the emulator ended: {}", stderr.trim()),
            Self::NoAnswer(time) => {
                write!(f, "the emulated board did not answer within {} s", time.as_secs())
            }
            Self::Stalled {
                after,
                state,
                answered,
            } => write!(
                f,
                "the emulated board has done nothing for {} s in state {state}, {answered} lines answered",
                after.as_secs()
            ),
            Self::Deadline(time) => write!(f, "the run took longer than {} s", time.as_secs()),
            Self::WrongImage { version, servo_hz } => write!(
                f,
                "the image does not fit: trace version {version}, servo rate {servo_hz} Hz"
            ),
            Self::Timetable => write!(
                f,
                "the emulated board takes 64 event rows at most, and ticks below 2^32"
            ),
            Self::Trace(error) => write!(f, "{error}"),
            Self::Panicked(text) => write!(f, "the firmware panicked: {text}"),
            Self::Mismatch { board, received } => write!(
                f,
                "the trace is not what the board computed: digest {:016x} over {} ticks, received {:016x} over {}",
                board.0, board.1, received.0, received.1
            ),
        }
    }
}

impl std::error::Error for EmulateError {}

impl From<io::Error> for EmulateError {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

impl From<UnknownTag> for EmulateError {
    fn from(error: UnknownTag) -> Self {
        Self::Trace(error)
    }
}
