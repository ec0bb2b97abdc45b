//! The line protocol: bytes to lines, and answers back.
//!
//! In: bytes as they come from the wire. Out: complete lines for the interpreter, real-time requests, and a
//! transmit buffer. The surface is that of GRBL 1.1 senders: every line is answered by `ok` or `error:N`; `?`, `!`,
//! `~`, 0x18 and the override bytes 0x90 to 0x97 act at once and take no buffer space.

pub mod report;

use heapless::Deque;

use crate::machine::Event;

/// Receive buffer, bytes. Reported as the second number of `Bf:`.
pub const RECEIVE_SIZE: usize = 1024;

/// Transmit buffer, bytes: an error message and a status report fit at the same time.
const TRANSMIT_SIZE: usize = 768;

/// Longest line kept; the interpreter refuses anything over 96 bytes, so more need not be stored.
pub const LINE_MAX: usize = 128;

/// What a byte from the wire is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Incoming {
    /// Acts at once.
    Event(Event),
    /// `?`: asks for a status report.
    Status,
    /// Changes the feed override by so many percent.
    FeedBy(i8),
    /// Part of a line.
    Text,
    /// Dropped in silence: a byte from 0x80 up that is not assigned.
    Nothing,
}

/// Sorts bytes in the order of the wire.
///
/// An override byte can be a part of a letter: UTF-8 writes the Hungarian letter with the double acute as 0xC5 0x91, and
/// it stands in comments. So what continues a character counts as text nobody reads. Only behind 0xC2 the byte counts by
/// itself, because some senders write the override bytes themselves as characters.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sorter {
    /// Bytes that the character begun still has.
    inside: u8,
}

impl Sorter {
    /// Between characters.
    #[must_use]
    pub const fn new() -> Self {
        Self { inside: 0 }
    }

    /// Sorts one byte.
    #[inline]
    pub fn sort(&mut self, byte: u8) -> Incoming {
        // Most of a program does not concern a character under way; the line end behind it does.
        if is_plain(byte) {
            return Incoming::Text;
        }
        self.sort_rest(byte)
    }

    #[inline(never)]
    fn sort_rest(&mut self, byte: u8) -> Incoming {
        if self.inside > 0 && (0x80..0xc0).contains(&byte) {
            self.inside -= 1;
            return Incoming::Nothing;
        }
        self.inside = match byte {
            0xc3..=0xdf => 1,
            0xe0..=0xef => 2,
            0xf0..=0xf4 => 3,
            _ => 0,
        };
        classify(byte)
    }
}

/// The most of a program: `"` to `>`, that is signs and digits, and `@` to `}`.
#[inline]
fn is_plain(byte: u8) -> bool {
    let code = u32::from(byte);
    code.wrapping_sub(0x22) < 29 || code.wrapping_sub(0x40) < 62
}

/// Sorts one byte that is not inside a character of several.
#[must_use]
#[inline]
pub fn classify(byte: u8) -> Incoming {
    if is_plain(byte) {
        return Incoming::Text;
    }
    match byte {
        b'!' => Incoming::Event(Event::Hold),
        b'~' => Incoming::Event(Event::Resume),
        0x18 => Incoming::Event(Event::Reset),
        b'?' => Incoming::Status,
        0x90 => Incoming::Event(Event::Feed(100)),
        0x91 => Incoming::FeedBy(10),
        0x92 => Incoming::FeedBy(-10),
        0x93 => Incoming::FeedBy(1),
        0x94 => Incoming::FeedBy(-1),
        0x95 => Incoming::Event(Event::Rapid(100)),
        0x96 => Incoming::Event(Event::Rapid(50)),
        0x97 => Incoming::Event(Event::Rapid(25)),
        0x80.. => Incoming::Nothing,
        _ => Incoming::Text,
    }
}

impl Incoming {
    /// True for what acts at once and must not wait in a buffer.
    #[must_use]
    pub fn is_realtime(self) -> bool {
        matches!(self, Self::Event(_) | Self::FeedBy(_) | Self::Status)
    }
}

/// Receive and transmit buffers.
#[derive(Debug, Default)]
pub struct Wire {
    receive: Deque<u8, RECEIVE_SIZE>,
    lines: usize,
    /// The byte before was `\r`.
    returned: bool,
    transmit: Deque<u8, TRANSMIT_SIZE>,
}

impl Wire {
    /// Empty buffers.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            receive: Deque::new(),
            lines: 0,
            returned: false,
            transmit: Deque::new(),
        }
    }

    /// Bytes the receive buffer can still take.
    #[must_use]
    pub fn free(&self) -> usize {
        RECEIVE_SIZE - self.receive.len()
    }

    /// True if no text waits.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.receive.is_empty()
    }

    /// Stores one byte of text. A byte that does not fit is lost, as on any serial line; a sender that counts
    /// characters never gets there.
    ///
    /// `\r\n` is one end: the `\n` is dropped here, so that no empty line is answered or counted.
    #[inline]
    pub fn receive(&mut self, byte: u8) {
        if byte > b'\r' {
            self.returned = false;
            // the last place is kept for a line end
            if self.receive.len() < RECEIVE_SIZE - 1 {
                // there is room
                let _ = self.receive.push_back(byte);
            }
            return;
        }
        self.receive_control(byte);
    }

    /// Stores a byte that may be a line end.
    #[inline(never)]
    fn receive_control(&mut self, byte: u8) {
        if core::mem::replace(&mut self.returned, byte == b'\r') && byte == b'\n' {
            return;
        }
        // Without room for its end a line would block the buffer for good: the last place is kept for one.
        let end = byte == b'\n' || byte == b'\r';
        if self.free() > 1 || (end && self.free() == 1) {
            // there is room
            let _ = self.receive.push_back(if end { b'\n' } else { byte });
            self.lines += usize::from(end);
        }
    }

    /// True if a whole line waits.
    #[must_use]
    pub fn has_line(&self) -> bool {
        self.lines > 0
    }

    /// Takes the next whole line, without its end. A line over [`LINE_MAX`] keeps its front only.
    pub fn take_line(&mut self) -> Option<heapless::Vec<u8, LINE_MAX>> {
        if self.lines == 0 {
            return None;
        }
        self.lines -= 1;
        let mut line = heapless::Vec::new();
        while let Some(byte) = self.receive.pop_front() {
            if byte == b'\n' {
                break;
            }
            // Beyond LINE_MAX the rest of the line says nothing the refusal needs.
            let _ = line.push(byte);
        }
        Some(line)
    }

    /// Forgets all text.
    pub fn clear(&mut self) {
        self.receive.clear();
        self.lines = 0;
        self.returned = false;
    }

    /// Next byte to send.
    pub fn transmit(&mut self) -> Option<u8> {
        self.transmit.pop_front()
    }

    /// True if an answer fits.
    #[must_use]
    pub fn can_answer(&self) -> bool {
        TRANSMIT_SIZE - self.transmit.len() >= TRANSMIT_SIZE / 3
    }
}

impl core::fmt::Write for Wire {
    fn write_str(&mut self, text: &str) -> core::fmt::Result {
        for &byte in text.as_bytes() {
            self.transmit
                .push_back(byte)
                .map_err(|_| core::fmt::Error)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_and_requests_are_told_apart() {
        assert_eq!(classify(b'!'), Incoming::Event(Event::Hold));
        assert_eq!(classify(0x18), Incoming::Event(Event::Reset));
        assert_eq!(classify(0xc2), Incoming::Nothing);
        assert_eq!(classify(b'G'), Incoming::Text);
        assert!(classify(b'?').is_realtime() && !classify(b'\n').is_realtime());
    }

    #[test]
    fn override_bytes_are_those_of_grbl_and_letters_are_not() {
        let sorted = |bytes: &[u8]| -> Vec<Incoming> {
            let mut sorter = Sorter::new();
            let all = bytes.iter().map(|&byte| sorter.sort(byte));
            all.filter(|&what| what.is_realtime()).collect()
        };
        let by = Incoming::FeedBy;
        let to = |event| Incoming::Event(event);
        let all = [
            to(Event::Feed(100)),
            by(10),
            by(-10),
            by(1),
            by(-1),
            to(Event::Rapid(100)),
            to(Event::Rapid(50)),
            to(Event::Rapid(25)),
        ];
        assert_eq!(sorted(b"\x90\x91\x92\x93\x94\x95\x96\x97"), all);
        // The same as characters.
        assert_eq!(
            sorted("\u{90}\u{91}\u{92}\u{93}\u{94}\u{95}\u{96}\u{97}".as_bytes()),
            all
        );
        // Letters whose last bytes are override bytes, and a bare byte behind one of Latin-1 and a line end.
        assert_eq!(sorted("(\u{151} \u{2014}\u{1f411})".as_bytes()), []);
        assert_eq!(sorted(b"(\xe9)\n\x91"), [by(10)]);
    }

    #[test]
    fn a_full_buffer_still_takes_a_line_end() {
        let mut wire = Wire::new();
        for _ in 0..2000 {
            wire.receive(b'x');
        }
        assert!(!wire.has_line());
        wire.receive(b'\n');
        assert_eq!(wire.take_line().map(|l| l.len()), Some(LINE_MAX));
        assert_eq!(wire.free(), RECEIVE_SIZE);
        assert_eq!(wire.take_line(), None);
    }

    #[test]
    fn a_line_ends_once_whatever_ends_it() {
        for (text, lines) in [
            ("a\nb\n", 2),
            ("a\r\nb\r\n", 2),
            ("a\rb\r", 2),
            ("\r\n\r\n", 2),
            ("\n\n", 2),
            ("\r\r", 2),
            ("a\n\rb\n", 3),
        ] {
            let mut wire = Wire::new();
            text.bytes().for_each(|byte| wire.receive(byte));
            let taken = core::iter::from_fn(|| wire.take_line()).count();
            assert_eq!(taken, lines, "{text:?}");
            assert_eq!(wire.free(), RECEIVE_SIZE);
        }
    }
}
