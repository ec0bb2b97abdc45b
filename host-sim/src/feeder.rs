//! The sending side of the line protocol: character counting, as a well-behaved sender does it.
//!
//! In: lines, one after the other, and the bytes the controller transmits. Out: lines to send, and what the controller said
//! as [`Reply`]. A line is on its way until its `ok` or `error:N` comes back; the bytes of all lines on their
//! way never exceed the receive buffer. Of the text, only the next line and the lengths of those on their way are kept.

use std::borrow::Cow;
use std::collections::VecDeque;
use std::fmt;

use crate::program::Program;

/// Longest line of the controller that is kept; the rest of a longer one is dropped.
const REPLY_MAX: usize = 1024;

/// A place the controller complains about, counted in the streamed text, from 1.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Complaint {
    /// `N` of `error:N`.
    pub code: u32,
    /// Line.
    pub line: usize,
    /// Column.
    pub column: usize,
    /// What the controller says about it.
    pub text: String,
}

/// One line of the controller.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Reply {
    /// A line was taken.
    Ok,
    /// A line was refused.
    Error(Complaint),
    /// `ALARM:N`.
    Alarm(u32),
    /// `[MSG:text]` other than the one that goes before an error.
    Message(String),
    /// Banner, status report or anything else.
    Other(String),
}

/// A line to send, without its line end.
pub type Line<'p> = Cow<'p, [u8]>;

/// Streams one program.
pub struct Feeder<'p> {
    /// Lines behind `next`.
    lines: Box<dyn Iterator<Item = Line<'p>> + 'p>,
    /// Next line to send, and how much of it has been sent.
    next: Option<Line<'p>>,
    sent_of_next: usize,
    capacity: usize,
    /// Lengths of the lines on their way.
    in_flight: VecDeque<usize>,
    bytes_in_flight: usize,
    answered: usize,
    stopped: bool,
    /// What was offered last.
    piece: Vec<u8>,
    reply: Vec<u8>,
    place: Option<(usize, usize, String)>,
}

impl fmt::Debug for Feeder<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Feeder")
            .field("next", &self.next)
            .field("in_flight", &self.in_flight)
            .field("answered", &self.answered)
            .finish_non_exhaustive()
    }
}

impl<'p> Feeder<'p> {
    /// Sender of `program` to a controller whose empty receive buffer takes `capacity` bytes.
    #[must_use]
    pub fn new(program: &'p Program, capacity: usize) -> Self {
        Self::of_lines(program.lines().map(Cow::Borrowed), capacity)
    }

    /// As [`Feeder::new`], of `lines` that need not exist before they are sent.
    #[must_use]
    pub fn of_lines(mut lines: impl Iterator<Item = Line<'p>> + 'p, capacity: usize) -> Self {
        Self {
            next: lines.next(),
            lines: Box::new(lines),
            sent_of_next: 0,
            capacity: capacity.max(1),
            in_flight: VecDeque::new(),
            bytes_in_flight: 0,
            answered: 0,
            stopped: false,
            piece: Vec::new(),
            reply: Vec::new(),
            place: None,
        }
    }

    /// Bytes to send now, at most `free`: the next whole line if it fits, else nothing.
    ///
    /// A line longer than the whole buffer goes in pieces, alone, so that the controller can refuse it.
    #[inline]
    pub fn offer(&mut self, free: usize) -> Option<&[u8]> {
        let whole = match &self.next {
            Some(line) if !self.stopped => line.len() + 1,
            _ => return None,
        };
        // Asked after every call of the background, and nearly always this is all that is done.
        let len = if self.sent_of_next == 0 && whole <= self.capacity {
            if whole > free || self.bytes_in_flight + whole > self.capacity {
                return None;
            }
            whole
        } else {
            if !self.in_flight.is_empty() || free == 0 {
                return None;
            }
            free.min(whole - self.sent_of_next)
        };
        self.send(len)
    }

    /// Sends `len` bytes of the next line, its line end counted.
    #[inline(never)]
    fn send(&mut self, len: usize) -> Option<&[u8]> {
        let line = self.next.as_ref()?;
        let whole = line.len() + 1;
        let from = self.sent_of_next;
        let end = from + len;
        self.piece.clear();
        self.piece
            .extend_from_slice(&line[from..end.min(line.len())]);
        if end == whole {
            self.piece.push(b'\n');
        }
        self.sent_of_next = end;
        if self.sent_of_next == whole {
            self.in_flight.push_back(whole);
            self.bytes_in_flight += whole;
            self.next = self.lines.next();
            self.sent_of_next = 0;
        }
        Some(&self.piece)
    }

    /// Takes one transmitted byte in; returns a reply when its line is complete.
    pub fn take(&mut self, byte: u8) -> Option<Reply> {
        match byte {
            b'\n' => {
                let line = String::from_utf8_lossy(&self.reply).trim().to_owned();
                self.reply.clear();
                (!line.is_empty()).then(|| self.classify(line)).flatten()
            }
            _ => {
                if self.reply.len() < REPLY_MAX {
                    self.reply.push(byte);
                }
                None
            }
        }
    }

    fn classify(&mut self, line: String) -> Option<Reply> {
        if line == "ok" {
            self.answer();
            return Some(Reply::Ok);
        }
        if let Some(code) = line.strip_prefix("error:") {
            self.answer();
            let code = code.trim().parse().unwrap_or(0);
            let (line, column, text) =
                self.place
                    .take()
                    .unwrap_or((self.answered, 1, format!("error {code}")));
            return Some(Reply::Error(Complaint {
                code,
                line,
                column,
                text,
            }));
        }
        if let Some(code) = line.strip_prefix("ALARM:") {
            return Some(Reply::Alarm(code.trim().parse().unwrap_or(0)));
        }
        if let Some(text) = line
            .strip_prefix("[MSG:")
            .and_then(|rest| rest.strip_suffix(']'))
        {
            if let Some(place) = parse_place(text) {
                self.place = Some(place);
                return None;
            }
            return Some(Reply::Message(text.to_owned()));
        }
        Some(Reply::Other(line))
    }

    fn answer(&mut self) {
        if let Some(len) = self.in_flight.pop_front() {
            self.bytes_in_flight -= len;
            self.answered += 1;
        }
    }

    /// Sends nothing from now on and forgets what is on its way.
    pub fn stop(&mut self) {
        self.stopped = true;
        self.in_flight.clear();
        self.bytes_in_flight = 0;
    }

    /// True if there is nothing left to send and nothing on its way.
    #[must_use]
    pub fn is_done(&self) -> bool {
        self.in_flight.is_empty() && self.is_sent()
    }

    /// True if every line is on its way or answered.
    #[must_use]
    pub fn is_sent(&self) -> bool {
        self.stopped || self.next.is_none()
    }

    /// Lines answered so far.
    #[must_use]
    pub fn answered(&self) -> usize {
        self.answered
    }

    /// What the controller last complained about without an `error:N` behind it.
    #[must_use]
    pub fn pending_place(&self) -> Option<&(usize, usize, String)> {
        self.place.as_ref()
    }
}

/// Reads `error line L column C: text`.
fn parse_place(text: &str) -> Option<(usize, usize, String)> {
    let rest = text.strip_prefix("error line ")?;
    let (line, rest) = rest.split_once(" column ")?;
    let (column, message) = rest.split_once(':')?;
    Some((
        line.trim().parse().ok()?,
        column.trim().parse().ok()?,
        message.trim().to_owned(),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn say(feeder: &mut Feeder, text: &str) -> Vec<Reply> {
        text.bytes().filter_map(|byte| feeder.take(byte)).collect()
    }

    #[test]
    fn an_error_carries_the_place_that_went_before_it() {
        let program = Program::from_text("p", "G1\nG1 Q\n").unwrap();
        let mut feeder = Feeder::new(&program, 100);
        while feeder.offer(100).is_some() {}
        let replies = say(&mut feeder, "\r\nGrbl 1.1h ['$' for help]\r\nok\r\n[MSG:error line 2 column 4: unknown address: Q]\r\nerror:20\r\n[MSG:pause]\nALARM:3\n");
        let text = "unknown address: Q".to_owned();
        assert_eq!(
            replies,
            [
                Reply::Other("Grbl 1.1h ['$' for help]".into()),
                Reply::Ok,
                Reply::Error(Complaint {
                    code: 20,
                    line: 2,
                    column: 4,
                    text
                }),
                Reply::Message("pause".into()),
                Reply::Alarm(3),
            ]
        );
        assert!(feeder.is_done());
    }

    #[test]
    fn an_error_without_a_place_counts_the_answers() {
        let program = Program::from_text("p", "G1\nG2\nG3\n").unwrap();
        let mut feeder = Feeder::new(&program, 100);
        while feeder.offer(100).is_some() {}
        match say(&mut feeder, "ok\nerror:9\n").as_slice() {
            [Reply::Ok, Reply::Error(complaint)] => {
                assert_eq!((complaint.code, complaint.line), (9, 2))
            }
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_line_longer_than_the_buffer_goes_alone_and_in_pieces() {
        let long = "X".repeat(25);
        let program = Program::from_text("p", &format!("G1\n;{long}\nG2\n")).unwrap();
        let mut feeder = Feeder::new(&program, 10);
        assert_eq!(feeder.offer(10).unwrap(), b"G1\n");
        assert_eq!(feeder.offer(7), None);
        say(&mut feeder, "ok\n");
        let mut got = Vec::new();
        while let Some(piece) = feeder.offer(10) {
            assert!(piece.len() <= 10);
            got.extend_from_slice(piece);
        }
        assert_eq!(got, format!(";{long}\n").into_bytes());
        say(&mut feeder, "error:11\n");
        assert_eq!(feeder.offer(10).unwrap(), b"G2\n");
    }

    proptest! {
        #[test]
        fn the_buffer_never_overflows_and_every_line_arrives_once(
            // No `M`: text behind a program end is not sent. No `L`: it calls a sub-program.
            lines in proptest::collection::vec("[A-KN-Z]?[0-9. ]{0,30}", 0..40),
            capacity in 4_usize..64,
            schedule in proptest::collection::vec((0_usize..64, any::<bool>()), 0..400),
        ) {
            let text: String = lines.iter().map(|line| format!("{line}\n")).collect();
            let program = Program::from_text("p", &text).unwrap();
            let mut feeder = Feeder::new(&program, capacity);
            let mut received = Vec::new();
            let mut waiting = Vec::new();
            let mut turns = schedule.into_iter().chain(std::iter::repeat_n((64, true), 2000));
            while !feeder.is_done() {
                let (free, take) = turns.next().expect("no progress");
                // A controller that answers a line when it takes it out of its buffer.
                if let Some(piece) = feeder.offer(free.min(capacity - waiting.len())) {
                    waiting.extend_from_slice(piece);
                    prop_assert!(waiting.len() <= capacity);
                }
                if take && !waiting.is_empty() {
                    let end = waiting.iter().position(|&b| b == b'\n');
                    received.extend(waiting.drain(..end.map_or(waiting.len(), |n| n + 1)));
                    if end.is_some() {
                        say(&mut feeder, "ok\r\n");
                    }
                }
            }
            prop_assert_eq!(String::from_utf8(received).unwrap(), text);
        }
    }
}
