//! Streams a program to a controller with character counting.
//!
//! Comes in: the lines of a program and a port (anything that reads and writes). Goes out: the lines, never
//! more of them in flight than the controller's receive buffer holds; each `ok` or `error:N` stands for the
//! oldest line in flight and frees its bytes, line end included.

use std::collections::VecDeque;
use std::fmt;
use std::io::{self, ErrorKind, Read, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use reply::Reply;

pub mod reply;

/// Receive buffer assumed of a controller that does not report one: the size of GRBL's.
pub const DEFAULT_WINDOW: usize = 128;
/// Time a controller gets to answer the first `?`; boards that reset when the port opens need two seconds.
const GREETING: Duration = Duration::from_secs(5);
/// Interval of `?` while waiting for the first answer.
const ASK_AGAIN: Duration = Duration::from_millis(500);
/// Interval of `?` while streaming.
const HEARTBEAT: Duration = Duration::from_millis(250);
/// A controller that has answered `?` once and then is silent for this long is gone.
const SILENCE: Duration = Duration::from_secs(5);
/// Time for leftovers of an earlier client to arrive, and for the message that goes with an error.
const SETTLE: Duration = Duration::from_millis(100);
/// Reports of `Alarm` in a row that count as an alarm without `ALARM:N` or `error:N`.
const ALARM_REPORTS: u32 = 3;
/// Reports of `Idle` in a row that mean the last motion is over; one may be older than the last `ok`.
const IDLE_REPORTS: u32 = 2;
/// Longest answer line kept.
const REPLY_MAX: usize = 4096;

/// How to stream.
#[derive(Clone, Copy, Debug, Default)]
pub struct Options<'a> {
    /// Answer a hold (`M0`) with `~` instead of waiting for a person.
    pub auto_start: bool,
    /// Set from outside to stop: the controller gets a feed hold and streaming ends.
    pub stop: Option<&'a AtomicBool>,
    /// A `$` line, without its line end, that goes before the program and is answered before it.
    pub preamble: Option<&'a str>,
}

/// What happens while streaming, for a progress bar.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Notice<'a> {
    /// The controller is there; bytes of its receive buffer.
    Ready(usize),
    /// Lines acknowledged so far.
    Acknowledged(usize),
    /// State of the controller, as it names it.
    State(&'a str),
    /// `[MSG:...]`.
    Message(&'a str),
}

/// What was sent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sent {
    /// Lines acknowledged.
    pub lines: usize,
    /// Bytes of program text, line ends included.
    pub bytes: u64,
    /// Most bytes in flight at any time.
    pub in_flight_max: usize,
    /// Bytes of the controller's receive buffer.
    pub window: usize,
}

/// Why streaming ended early. Lines count from 1.
#[derive(Debug)]
pub enum SendError {
    /// The port failed.
    Port(io::Error),
    /// Nothing came back.
    NoAnswer,
    /// The controller is there but does something else.
    NotReady {
        /// Its state.
        state: String,
    },
    /// A line is longer than the receive buffer.
    LineTooLong {
        /// Line of the stream.
        line: usize,
        /// Its bytes, line end included.
        bytes: usize,
        /// The receive buffer.
        window: usize,
    },
    /// The controller refused a line. Lines after it may be in its buffer; none of them is sent again.
    Refused {
        /// Line of the stream.
        line: usize,
        /// What stood behind `error:`.
        code: String,
        /// The last `[MSG:...]` beside the error.
        message: Option<String>,
    },
    /// The machine raised an alarm.
    Alarm {
        /// What stood behind `ALARM:`, empty if only the state told.
        code: String,
        /// Oldest line in flight, 0 if none.
        line: usize,
    },
    /// The controller started anew in the middle of the program.
    Restarted {
        /// Oldest line in flight, 0 if none.
        line: usize,
    },
    /// The controller stopped answering.
    Silent {
        /// Oldest line in flight, 0 if none.
        line: usize,
    },
    /// Stopped from outside; the controller got a feed hold.
    Interrupted {
        /// Oldest line in flight, 0 if none.
        line: usize,
    },
}

impl fmt::Display for SendError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Port(error) => write!(f, "port failed: {error}"),
            Self::NoAnswer => write!(
                f,
                "no answer from the controller within {} s",
                GREETING.as_secs()
            ),
            Self::NotReady { state } => write!(f, "controller is not ready: its state is {state}"),
            Self::LineTooLong {
                line,
                bytes,
                window,
            } => {
                write!(
                    f,
                    "line {line} takes {bytes} bytes, the receive buffer holds {window}"
                )
            }
            Self::Refused {
                line,
                code,
                message,
            } => {
                write!(f, "line {line} refused with error:{code}")?;
                message
                    .as_ref()
                    .map_or(Ok(()), |text| write!(f, " ({text})"))
            }
            Self::Alarm { code, line } if code.is_empty() => {
                write!(f, "alarm at or before line {line}")
            }
            Self::Alarm { code, line } => write!(f, "ALARM:{code} at or before line {line}"),
            Self::Restarted { line } => write!(f, "controller restarted at or before line {line}"),
            Self::Silent { line } => write!(
                f,
                "controller silent for {} s at line {line}",
                SILENCE.as_secs()
            ),
            Self::Interrupted { line } => write!(
                f,
                "interrupted at line {line}; the controller holds: ~ resumes, 0x18 resets"
            ),
        }
    }
}

impl std::error::Error for SendError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Port(error) => Some(error),
            _ => None,
        }
    }
}

impl From<io::Error> for SendError {
    fn from(error: io::Error) -> Self {
        Self::Port(error)
    }
}

/// Streams `lines` (without line ends) over `port` and waits until the last motion is over.
///
/// A read of `port` must return within some 10 ms, with `TimedOut` or `WouldBlock` if nothing is there.
///
/// # Errors
/// The first thing that goes wrong; see [`SendError`].
pub fn stream<P: Read + Write>(
    port: P,
    lines: &[&[u8]],
    options: Options<'_>,
    notify: &mut dyn FnMut(Notice<'_>),
) -> Result<Sent, SendError> {
    let mut session = Session::new(port, options, notify);
    session.greet()?;
    if let Some(line) = options.preamble {
        let refused = |error| match error {
            // It is no line of the program.
            SendError::Refused { code, message, .. } => SendError::Refused {
                line: 0,
                code,
                message: message.or_else(|| Some(format!("the controller refused {line}"))),
            },
            other => other,
        };
        session.send_all(&[line.as_bytes()]).map_err(refused)?;
        // The lines of the program count from here.
        session.sent.lines = 0;
        session.sent.bytes = 0;
    }
    let window = session.sent.window;
    if let Some((index, line)) = lines
        .iter()
        .enumerate()
        .find(|(_, line)| line.len() + 1 > window)
    {
        return Err(SendError::LineTooLong {
            line: index + 1,
            bytes: line.len() + 1,
            window,
        });
    }
    session.send_all(lines)?;
    session.finish()?;
    Ok(session.sent)
}

struct Session<'a, P> {
    port: P,
    options: Options<'a>,
    notify: &'a mut dyn FnMut(Notice<'_>),
    /// Bytes of an answer whose end has not come yet.
    partial: Vec<u8>,
    /// Complete answers not yet looked at.
    arrived: VecDeque<String>,
    /// Length of each line in flight, line end included, oldest first.
    in_flight: VecDeque<usize>,
    bytes_in_flight: usize,
    /// The controller answers `?`.
    reports: bool,
    asked: Instant,
    heard: Instant,
    alarms: u32,
    idles: u32,
    /// The last `[MSG:...]` since a line was taken.
    message: Option<String>,
    sent: Sent,
}

impl<'a, P: Read + Write> Session<'a, P> {
    fn new(port: P, options: Options<'a>, notify: &'a mut dyn FnMut(Notice<'_>)) -> Self {
        let now = Instant::now();
        Self {
            port,
            options,
            notify,
            partial: Vec::new(),
            arrived: VecDeque::new(),
            in_flight: VecDeque::new(),
            bytes_in_flight: 0,
            reports: false,
            asked: now,
            heard: now,
            alarms: 0,
            idles: 0,
            message: None,
            sent: Sent::default(),
        }
    }

    /// Line of the stream that is the oldest in flight, 0 if none is.
    fn oldest(&self) -> usize {
        if self.in_flight.is_empty() {
            0
        } else {
            self.sent.lines + 1
        }
    }

    fn ask(&mut self) -> io::Result<()> {
        self.asked = Instant::now();
        self.port.write_all(b"?")
    }

    /// Finds out who is there and how much it can take.
    fn greet(&mut self) -> Result<(), SendError> {
        let settled = Instant::now() + SETTLE;
        while Instant::now() < settled {
            self.listen()?;
        }
        self.arrived.clear();
        let start = Instant::now();
        let mut anything = false;
        let mut asked = None;
        while start.elapsed() < GREETING {
            self.check_stop()?;
            if asked.is_none_or(|at: Instant| at.elapsed() > ASK_AGAIN) {
                self.ask()?;
                asked = Some(Instant::now());
            }
            self.listen()?;
            while let Some(line) = self.arrived.pop_front() {
                anything = true;
                if let Reply::Status(status) = Reply::parse(&line) {
                    if !matches!(status.state, "Idle" | "Check") {
                        return Err(SendError::NotReady {
                            state: status.state.to_owned(),
                        });
                    }
                    self.reports = true;
                    self.sent.window = status.receive_free.unwrap_or(DEFAULT_WINDOW);
                    self.heard = Instant::now();
                    (self.notify)(Notice::Ready(self.sent.window));
                    return Ok(());
                }
            }
        }
        if !anything {
            return Err(SendError::NoAnswer);
        }
        self.sent.window = DEFAULT_WINDOW;
        (self.notify)(Notice::Ready(self.sent.window));
        Ok(())
    }

    fn send_all(&mut self, lines: &[&[u8]]) -> Result<(), SendError> {
        let mut next = 0;
        while next < lines.len() || !self.in_flight.is_empty() {
            self.check_stop()?;
            let mut burst = Vec::new();
            while let Some(line) = lines
                .get(next)
                .filter(|line| self.bytes_in_flight + line.len() < self.sent.window)
            {
                burst.extend_from_slice(line);
                burst.push(b'\n');
                self.in_flight.push_back(line.len() + 1);
                self.bytes_in_flight += line.len() + 1;
                next += 1;
            }
            if !burst.is_empty() {
                self.port.write_all(&burst)?;
                self.sent.bytes += burst.len() as u64;
                self.sent.in_flight_max = self.sent.in_flight_max.max(self.bytes_in_flight);
            }
            self.exchange(HEARTBEAT)?;
        }
        Ok(())
    }

    /// Waits until the machine is at rest; a controller without status reports is taken at its word.
    fn finish(&mut self) -> Result<(), SendError> {
        self.idles = 0;
        while self.reports && self.idles < IDLE_REPORTS {
            self.check_stop()?;
            self.exchange(HEARTBEAT / 5)?;
        }
        Ok(())
    }

    /// Asks if it is time to, and deals with whatever has arrived.
    fn exchange(&mut self, interval: Duration) -> Result<(), SendError> {
        if self.reports && self.asked.elapsed() > interval {
            self.ask()?;
        }
        self.listen()?;
        while let Some(line) = self.arrived.pop_front() {
            self.heard = Instant::now();
            self.take(&line)?;
        }
        if self.reports && self.heard.elapsed() > SILENCE {
            return Err(SendError::Silent {
                line: self.oldest(),
            });
        }
        Ok(())
    }

    fn take(&mut self, line: &str) -> Result<(), SendError> {
        match Reply::parse(line) {
            Reply::Ok => {
                // An `ok` without a line in flight is a leftover and acknowledges nothing.
                if let Some(bytes) = self.in_flight.pop_front() {
                    self.bytes_in_flight -= bytes;
                    self.sent.lines += 1;
                    self.message = None;
                    (self.notify)(Notice::Acknowledged(self.sent.lines));
                }
            }
            Reply::Error(code) => {
                let code = code.to_owned();
                let line = self.oldest();
                return Err(SendError::Refused {
                    line,
                    code,
                    message: self.parting_message()?,
                });
            }
            Reply::Alarm(code) => {
                return Err(SendError::Alarm {
                    code: code.to_owned(),
                    line: self.oldest(),
                })
            }
            Reply::Banner => {
                return Err(SendError::Restarted {
                    line: self.oldest(),
                })
            }
            Reply::Message(text) => {
                self.message = Some(text.to_owned());
                (self.notify)(Notice::Message(text));
            }
            Reply::Status(status) => self.state(status.state)?,
            Reply::Other(_) => {}
        }
        Ok(())
    }

    fn state(&mut self, state: &str) -> Result<(), SendError> {
        (self.notify)(Notice::State(state));
        self.alarms = if state == "Alarm" { self.alarms + 1 } else { 0 };
        self.idles = if matches!(state, "Idle" | "Check") {
            self.idles + 1
        } else {
            0
        };
        if self.alarms >= ALARM_REPORTS {
            return Err(SendError::Alarm {
                code: String::new(),
                line: self.oldest(),
            });
        }
        if state == "Hold" && self.options.auto_start {
            self.port.write_all(b"~")?;
        }
        Ok(())
    }

    /// The message that explains an error may come before it or just behind it.
    fn parting_message(&mut self) -> Result<Option<String>, SendError> {
        let settled = Instant::now() + SETTLE;
        while self.message.is_none() && Instant::now() < settled {
            self.listen()?;
            while let Some(line) = self.arrived.pop_front() {
                if let Reply::Message(text) = Reply::parse(&line) {
                    self.message.get_or_insert_with(|| text.to_owned());
                }
            }
        }
        Ok(self.message.take())
    }

    fn check_stop(&mut self) -> Result<(), SendError> {
        if self
            .options
            .stop
            .is_some_and(|stop| stop.load(Ordering::Relaxed))
        {
            self.port.write_all(b"!")?;
            return Err(SendError::Interrupted {
                line: self.oldest(),
            });
        }
        Ok(())
    }

    /// Takes in what has arrived; waits as long as one read of the port does.
    fn listen(&mut self) -> io::Result<()> {
        let mut buffer = [0; 512];
        let count = match self.port.read(&mut buffer) {
            Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
            Ok(count) => count,
            Err(error)
                if matches!(
                    error.kind(),
                    ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted
                ) =>
            {
                0
            }
            Err(error) => return Err(error),
        };
        for &byte in &buffer[..count] {
            match byte {
                b'\n' => {
                    self.arrived
                        .push_back(String::from_utf8_lossy(&self.partial).into_owned());
                    self.partial.clear();
                }
                _ if self.partial.len() < REPLY_MAX => self.partial.push(byte),
                _ => {}
            }
        }
        Ok(())
    }
}

#[cfg(all(test, unix))]
mod tests;
