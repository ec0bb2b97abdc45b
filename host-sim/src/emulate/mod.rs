//! Runs a program on the firmware image under QEMU, fed over its serial port.
//!
//! In: a [`Program`] and the image. Out: every step frame of the motion, in order, and an [`Emulated`] with
//! the digest and the steps that follow from them, checked against what the board itself computed.
//!
//! The emulated time counts instructions, so neither the frames nor their number depend on the speed of the
//! host. The one thing that could bring it in, the time-out after which the controller commits a window
//! that is not full, stands still until the host has sent the whole program ([`trace::RELEASE`]).

use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

use pentaspline::board::trace::{self, Packet, Rest};
use pentaspline::board::MACHINE;
use pentaspline::machine::timetable::{Row, ROWS_MAX};
use pentaspline::protocol::RECEIVE_SIZE;
use pentaspline::stepgen::record::FrameDigest;
use pentaspline::stepgen::StepFrame;
use pentaspline::units::AXES;

use crate::feeder::{Feeder, Reply};
use crate::program::Program;
use crate::runner::End;

pub mod board;
pub mod error;

use board::{Board, Line};
pub use error::EmulateError;

/// Environment variable that names another image.
pub const IMAGE_VARIABLE: &str = "PENTASPLINE_QEMU_IMAGE";
/// Where `.ci/firmware` puts the image, seen from the top of the workspace.
const IMAGE: &str = "target/firmware/qemu.elf";

/// Time for the image to answer its first `?`.
const GREETING: Duration = Duration::from_secs(30);
/// Interval of `?`.
const ASK: Duration = Duration::from_millis(20);
/// Pause when nothing has arrived.
const PAUSE: Duration = Duration::from_micros(200);
/// Status reports at rest, in a row, after which an error or a wait is taken for final.
const SETTLED: u32 = 25;

/// As fast as the board: 25 000 instructions per tick, which is 168 MHz at 1.35 cycles per instruction.
pub const SHIFT_BOARD: u8 = 6;
/// Four times as fast: 100 000 instructions per tick. What is compared with the simulator, whose background has all
/// the time it wants, is what the board computes and not whether it is in time.
pub const SHIFT_AHEAD: u8 = 4;

/// How to run.
#[derive(Clone, Debug)]
pub struct Options {
    /// Image; `None` for [`default_image`].
    pub image: Option<PathBuf>,
    /// Give cycle start at `M0` and `M1`.
    pub auto_start: bool,
    /// What happens when, in order of the clock of [`pentaspline::machine::timetable`].
    pub events: Vec<Row>,
    /// A `$` line, without its line end, that goes before the program.
    pub preamble: Option<&'static str>,
    /// 2^`shift` ns per instruction, and 1.6 ms per tick of 5 kHz ([`SHIFT_BOARD`], [`SHIFT_AHEAD`]).
    pub shift: u8,
    /// Give up if the board neither moves nor takes a line for this long (wall clock).
    pub stall: Duration,
    /// Give up after this long (wall clock).
    pub deadline: Duration,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            image: None,
            auto_start: false,
            events: Vec::new(),
            preamble: None,
            shift: SHIFT_AHEAD,
            stall: Duration::from_secs(120),
            deadline: Duration::from_secs(3600),
        }
    }
}

/// What came of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Emulated {
    /// How it ended.
    pub end: End,
    /// First line the firmware said.
    pub banner: String,
    /// Digest of the frames received; the board computed the same.
    pub digest: u64,
    /// Servo ticks in motion.
    pub ticks: u64,
    /// Steps emitted since power-up per axis: the sum over the frames.
    pub final_steps: [i32; AXES],
    /// What the controller said in `[MSG:..]`.
    pub messages: Vec<String>,
    /// Bytes of stack used at the deepest, and bytes there are.
    pub stack: (u32, u32),
}

/// What a run tells while it lasts.
pub trait Observer {
    /// A servo tick in motion.
    fn frame(&mut self, frame: &StepFrame) {
        let _ = frame;
    }

    /// `lines` lines answered, `ticks` servo ticks in motion.
    fn progress(&mut self, lines: usize, ticks: u64) {
        let _ = (lines, ticks);
    }
}

/// Looks at nothing.
impl Observer for () {}

/// The image of `PENTASPLINE_QEMU_IMAGE`, else that of `.ci/firmware` below the current folder or the
/// workspace this program was built in.
#[must_use]
pub fn default_image() -> PathBuf {
    if let Some(path) = std::env::var_os(IMAGE_VARIABLE) {
        return path.into();
    }
    let here = PathBuf::from(IMAGE);
    if here.is_file() {
        return here;
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent();
    match root.map(|root| root.join(IMAGE)) {
        Some(path) if path.is_file() => path,
        _ => here,
    }
}

/// Runs `program` on the emulated board.
///
/// # Errors
/// [`EmulateError`]; a program the controller refuses is a result, in [`Emulated::end`].
pub fn emulate(
    program: &Program,
    options: &Options,
    observer: &mut dyn Observer,
) -> Result<Emulated, EmulateError> {
    let image = options.image.clone().unwrap_or_else(default_image);
    let mut session = Session {
        board: Board::start(&image, options.shift)?,
        feeder: Feeder::new(program, RECEIVE_SIZE),
        observer,
        options,
        started: Instant::now(),
        progressed: Instant::now(),
        asked: None,
        unanswered: 0,
        state: String::new(),
        reports: 0,
        frames: Frames::default(),
        banner: String::new(),
        messages: Vec::new(),
        ended_by: None,
        prepared: options.preamble.is_none(),
        program_stops: 0,
        program_bytes: Vec::new(),
        trace_bytes: Vec::new(),
    };
    session.greet()?;
    session.load()?;
    session.prepare()?;
    let end = session.stream()?;
    session.conclude(end)
}

/// The motion so far.
#[derive(Default)]
struct Frames {
    digest: FrameDigest,
    ticks: u64,
    steps: [i32; AXES],
    /// A frame has come since the last [`Rest`].
    moving: bool,
    hello: bool,
    rest: Option<Rest>,
    stack: Option<(u32, u32)>,
    /// Rows of the timetable that have not acted.
    rows: usize,
    /// Rows it has taken; the first may act before the last has come.
    loaded: usize,
}

struct Session<'a> {
    board: Board,
    feeder: Feeder<'a>,
    observer: &'a mut dyn Observer,
    options: &'a Options,
    started: Instant,
    progressed: Instant,
    asked: Option<Instant>,
    /// `?` without an answer yet.
    unanswered: u32,
    /// State as the last status report names it.
    state: String,
    /// Status reports since the last change of `state`, the last progress, or `mark`.
    reports: u32,
    frames: Frames,
    banner: String,
    messages: Vec<String>,
    ended_by: Option<End>,
    /// The preamble has been answered.
    prepared: bool,
    /// Program stops that have not been passed.
    program_stops: u32,
    program_bytes: Vec<u8>,
    trace_bytes: Vec<u8>,
}

impl Session<'_> {
    /// Waits until the board answers. Bytes that come before its port is on are lost, so `?` is repeated.
    fn greet(&mut self) -> Result<(), EmulateError> {
        while self.state.is_empty() || !self.frames.hello {
            if self.started.elapsed() > GREETING {
                return Err(EmulateError::NoAnswer(GREETING));
            }
            self.ask()?;
            self.listen()?;
        }
        // Only answers count from here on; those that were lost never come.
        self.unanswered = 0;
        Ok(())
    }

    /// Sends the timetable, and waits until the board has all of it.
    fn load(&mut self) -> Result<(), EmulateError> {
        let rows = &self.options.events;
        let sendable = rows.iter().map(trace::encode_row);
        let sendable: Option<Vec<_>> = sendable.collect();
        let Some(bytes) = sendable.filter(|_| rows.len() <= ROWS_MAX) else {
            return Err(EmulateError::Timetable);
        };
        self.board.send(Line::Trace, &bytes.concat())?;
        let asked = Instant::now();
        while self.frames.loaded < rows.len() {
            if asked.elapsed() > GREETING {
                return Err(EmulateError::NoAnswer(GREETING));
            }
            self.listen()?;
        }
        Ok(())
    }

    /// Sends the preamble and waits for its answer; nothing else may be on its way then, so the count stays right.
    fn prepare(&mut self) -> Result<(), EmulateError> {
        let Some(line) = self.options.preamble else {
            return Ok(());
        };
        self.board.send(Line::Program, line.as_bytes())?;
        self.board.send(Line::Program, b"\n")?;
        let asked = Instant::now();
        while !self.prepared {
            if asked.elapsed() > GREETING {
                return Err(EmulateError::NoAnswer(GREETING));
            }
            self.listen()?;
        }
        Ok(())
    }

    /// Sends the program and waits for the end of the motion.
    fn stream(&mut self) -> Result<End, EmulateError> {
        let mut released = false;
        loop {
            while let Some(bytes) = self.feeder.offer(usize::MAX) {
                self.board.send(Line::Program, bytes)?;
            }
            if !released && self.feeder.is_sent() {
                released = true;
                self.board.send(Line::Trace, &[trace::RELEASE])?;
                // Reports asked for before this say nothing about what comes after.
                self.reports = 0;
                self.progressed = Instant::now();
            }
            self.ask()?;
            self.listen()?;
            if let Some(end) = self.end()? {
                return Ok(end);
            }
            self.observer
                .progress(self.feeder.answered(), self.frames.ticks);
            if self.started.elapsed() > self.options.deadline {
                return Err(EmulateError::Deadline(self.options.deadline));
            }
            if self.progressed.elapsed() > self.options.stall {
                return Err(EmulateError::Stalled {
                    after: self.options.stall,
                    state: self.state.clone(),
                    answered: self.feeder.answered(),
                });
            }
        }
    }

    /// The end, if this is it.
    fn end(&mut self) -> Result<Option<End>, EmulateError> {
        // Answers to questions asked before the last change may still be on their way.
        let fresh = self.reports > self.unanswered + 1;
        if self.frames.moving || !fresh {
            return Ok(None);
        }
        let settled = self.reports >= SETTLED + self.unanswered;
        match self.state.as_str() {
            "Idle" if self.feeder.is_done() && self.ended_by.is_none() => Ok(Some(End::Finished)),
            "Idle" | "Alarm" if settled => Ok(self.ended_by.take()),
            "Hold" if self.ended_by.is_some() && settled => Ok(self.ended_by.take()),
            // A hold of the timetable is for the timetable to end.
            "Hold" if self.options.auto_start && self.program_stops > 0 => {
                self.program_stops = 0;
                self.board.send(Line::Program, b"~")?;
                self.reports = 0;
                Ok(None)
            }
            "Hold" if settled && self.frames.rows == 0 => Ok(Some(End::Waiting {
                held: self.program_stops == 0,
                after_block: 0,
            })),
            _ => Ok(None),
        }
    }

    /// Asks for the stack, and checks the books.
    fn conclude(mut self, end: End) -> Result<Emulated, EmulateError> {
        self.board.send(Line::Trace, &[trace::STACK])?;
        let asked = Instant::now();
        let stack = loop {
            self.listen()?;
            if let Some(stack) = self.frames.stack {
                break stack;
            }
            if asked.elapsed() > GREETING {
                return Err(EmulateError::NoAnswer(GREETING));
            }
        };
        let frames = &self.frames;
        let digest = frames.digest.value();
        let rest = frames.rest.unwrap_or(Rest {
            digest: FrameDigest::default().value(),
            ..Rest::default()
        });
        if (rest.digest, rest.ticks, rest.emitted) != (digest, frames.ticks, frames.steps) {
            return Err(EmulateError::Mismatch {
                board: (rest.digest, rest.ticks),
                received: (digest, frames.ticks),
            });
        }
        Ok(Emulated {
            end,
            banner: self.banner,
            digest,
            ticks: frames.ticks,
            final_steps: frames.steps,
            messages: self.messages,
            stack,
        })
    }

    fn ask(&mut self) -> Result<(), EmulateError> {
        if self.asked.is_none_or(|at| at.elapsed() >= ASK) {
            self.asked = Some(Instant::now());
            self.unanswered += 1;
            self.board.send(Line::Program, b"?")?;
        }
        Ok(())
    }

    /// Takes in whatever has arrived, the program port first: the board sends the records of a motion before
    /// it reports its end, so all of them are there when the report is.
    fn listen(&mut self) -> Result<(), EmulateError> {
        let mut bytes = std::mem::take(&mut self.program_bytes);
        let mut arrived = self.board.receive(Line::Program, &mut bytes)?;
        arrived += self.board.receive(Line::Trace, &mut self.trace_bytes)?;
        self.take_trace()?;
        for byte in bytes.drain(..) {
            if let Some(reply) = self.feeder.take(byte) {
                self.take_reply(reply);
            }
        }
        self.program_bytes = bytes;
        if arrived == 0 {
            // Gives bytes that did not fit into a socket another try.
            self.board.send(Line::Program, &[])?;
            thread::sleep(PAUSE);
        }
        Ok(())
    }

    fn take_reply(&mut self, reply: Reply) {
        match reply {
            Reply::Other(line) => match state(&line) {
                Some(state) => {
                    self.unanswered = self.unanswered.saturating_sub(1);
                    if state != self.state {
                        self.state = state.to_owned();
                        self.reports = 0;
                    }
                    self.reports += 1;
                }
                None if self.banner.is_empty() => self.banner = line,
                // Said again after a reset only.
                None if line == self.banner => {
                    self.feeder.stop();
                    self.ended_by.get_or_insert(End::Reset);
                    self.progress();
                }
                None => {}
            },
            Reply::Ok => {
                self.prepared = true;
                self.progress();
            }
            Reply::Error(complaint) => {
                self.prepared = true;
                self.feeder.stop();
                self.ended_by.get_or_insert(End::Refused(complaint));
                self.progress();
            }
            Reply::Alarm(code) => {
                self.feeder.stop();
                self.ended_by.get_or_insert(End::Alarm(code));
                self.progress();
            }
            Reply::Message(text) => {
                self.program_stops += u32::from(text.starts_with("program stop"));
                self.messages.push(text);
            }
        }
    }

    fn progress(&mut self) {
        self.progressed = Instant::now();
        self.reports = 0;
    }

    fn take_trace(&mut self) -> Result<(), EmulateError> {
        let mut at = 0;
        while let Some((packet, len)) = trace::decode(&self.trace_bytes[at..])? {
            at += len;
            let frames = &mut self.frames;
            match packet {
                Packet::Frame(frame) => {
                    frames.digest.update(&frame);
                    frames.ticks += 1;
                    frames.moving = true;
                    for (steps, axis) in frames.steps.iter_mut().zip(frame.axes) {
                        // The board counts in the same width.
                        *steps = steps.wrapping_add(axis.signed_count());
                    }
                    self.observer.frame(&frame);
                }
                Packet::Rest(rest) => {
                    frames.rest = Some(rest);
                    frames.moving = false;
                }
                Packet::Hello { version, servo_hz } => {
                    if version != trace::VERSION || servo_hz != MACHINE.servo_hz {
                        return Err(EmulateError::WrongImage { version, servo_hz });
                    }
                    frames.hello = true;
                }
                Packet::Rows(left) => {
                    let left = usize::from(left);
                    frames.loaded += left.saturating_sub(frames.rows);
                    frames.rows = left;
                }
                Packet::Stack { deepest, size } => frames.stack = Some((deepest, size)),
                Packet::Panic(text) => {
                    return Err(EmulateError::Panicked(
                        String::from_utf8_lossy(text).into_owned(),
                    ));
                }
            }
        }
        if at > 0 {
            self.trace_bytes.drain(..at);
            self.progress();
        }
        Ok(())
    }
}

/// State of a status report (`<Hold:0|...>` is `Hold`), or `None` if `line` is none.
fn state(line: &str) -> Option<&str> {
    let inner = line.strip_prefix('<')?.strip_suffix('>')?;
    let name = inner.split('|').next()?;
    name.split(':').next()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine_file::Machine;

    #[test]
    fn the_image_carries_the_machine_the_simulator_has_built_in() {
        assert_eq!(Machine::built_in().unwrap().config, MACHINE);
    }

    #[test]
    fn a_status_report_names_its_state() {
        assert_eq!(state("<Idle|MPos:0,0>"), Some("Idle"));
        assert_eq!(state("<Hold:0|MPos:0,0>"), Some("Hold"));
        assert_eq!(state("<Run>"), Some("Run"));
        assert_eq!(state("ok"), None);
        assert_eq!(state("[MSG:<Idle|>]"), None);
    }

    #[test]
    fn a_missing_image_is_named_with_the_command_that_makes_it() {
        let program = Program::from_text("p", "G1\n").unwrap();
        let options = Options {
            image: Some(PathBuf::from("/nowhere/qemu.elf")),
            ..Options::default()
        };
        let error = emulate(&program, &options, &mut ()).unwrap_err();
        assert_eq!(error.to_string(), "no firmware image at /nowhere/qemu.elf");
        assert!(error.help().contains(error::BUILD_IMAGE));
    }
}
