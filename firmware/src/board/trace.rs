//! The trace port: what the emulated board tells about its motion, and what it may be asked.
//!
//! From the board, little-endian, packets told apart by their first byte:
//!
//! | first byte | packet | then |
//! |---|---|---|
//! | 0x00..0x20 | frame of one servo tick in motion | a record of [`crate::stepgen::record`] (the byte is its mask) |
//! | 0x80 | hello, once after reset | version u8, servo rate u32, Hz |
//! | 0x81 | rest: motion has just ended | digest u64, ticks in motion u64, steps emitted 5 x i32 |
//! | 0x82 | stack | deepest use u32, size u32, bytes |
//! | 0x83 | panic: nothing follows | length u8, that many bytes of text |
//! | 0x84 | rows of the timetable left, after one has come or acted | count u8 |
//!
//! To the board single bytes, [`RELEASE`] and [`STACK`], and rows of a timetable, each [`ROW`] and nine bytes more
//! ([`encode_row`]).

use crate::machine::timetable::{Row, ROWS_MAX};
use crate::machine::Event;
use crate::stepgen::record::{self, RECORD_MAX};
use crate::stepgen::StepFrame;
use crate::units::AXES;

/// Version of this format.
pub const VERSION: u8 = 2;

/// Host to board: the whole program is on its way. Until this byte comes, the clock of the time-out that
/// commits a window which is not full stands still while the board has no text to work on, so that a slow
/// host cannot change the plan.
pub const RELEASE: u8 = b'E';

/// Host to board: report the deepest stack.
pub const STACK: u8 = b'S';

/// Host to board: a row of the timetable follows, before the program.
pub const ROW: u8 = b'T';

/// Most a servo tick sends: all rows that act in it, a record and the rest that follows it.
pub const TICK_MAX: usize = RECORD_MAX + REST_LEN + ROWS_MAX * ROWS_LEN;

/// Longest text of a panic packet.
pub const TEXT_MAX: usize = 200;

const HELLO_TAG: u8 = 0x80;
const REST_TAG: u8 = 0x81;
const STACK_TAG: u8 = 0x82;
const PANIC_TAG: u8 = 0x83;
const ROWS_TAG: u8 = 0x84;

const HELLO_LEN: usize = 6;
const REST_LEN: usize = 17 + 4 * AXES;
const STACK_LEN: usize = 9;
const ROWS_LEN: usize = 2;

/// Bytes of a row behind [`ROW`]: tick u32, event u8, its value u32.
pub const ROW_LEN: usize = 9;

/// State at the end of a motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Rest {
    /// Digest of all frames since power-up, as the board computed it.
    pub digest: u64,
    /// Records sent since power-up.
    pub ticks: u64,
    /// Steps emitted since power-up, per axis.
    pub emitted: [i32; AXES],
}

impl Rest {
    /// The packet, tag byte first.
    #[must_use]
    pub fn encode(&self) -> [u8; REST_LEN] {
        let mut out = [0; REST_LEN];
        out[0] = REST_TAG;
        out[1..9].copy_from_slice(&self.digest.to_le_bytes());
        out[9..17].copy_from_slice(&self.ticks.to_le_bytes());
        for (field, steps) in out[17..].chunks_exact_mut(4).zip(self.emitted) {
            field.copy_from_slice(&steps.to_le_bytes());
        }
        out
    }
}

/// The packet that opens a trace.
#[must_use]
pub fn encode_hello(servo_hz: u32) -> [u8; HELLO_LEN] {
    let hz = servo_hz.to_le_bytes();
    [HELLO_TAG, VERSION, hz[0], hz[1], hz[2], hz[3]]
}

/// The answer to [`STACK`]: bytes used at the deepest, bytes there are.
#[must_use]
pub fn encode_stack(deepest: u32, size: u32) -> [u8; STACK_LEN] {
    let mut out = [0; STACK_LEN];
    out[0] = STACK_TAG;
    out[1..5].copy_from_slice(&deepest.to_le_bytes());
    out[5..].copy_from_slice(&size.to_le_bytes());
    out
}

/// The packet that says how many rows are left.
#[must_use]
pub fn encode_rows(left: usize) -> [u8; ROWS_LEN] {
    [ROWS_TAG, left.min(0xff) as u8]
}

/// A row for the board, [`ROW`] first; `None` if its tick takes more than 32 bits or its event is no row.
#[must_use]
pub fn encode_row(row: &Row) -> Option<[u8; 1 + ROW_LEN]> {
    let (event, value) = match row.event {
        Event::Hold => (0, 0),
        Event::Resume => (1, 0),
        Event::Reset => (2, 0),
        Event::Feed(percent) => (3, percent.into()),
        Event::Rapid(percent) => (4, percent.into()),
        Event::Starve(ticks) => (5, ticks),
        Event::Fault => return None,
    };
    let mut out = [0; 1 + ROW_LEN];
    out[0] = ROW;
    out[1..5].copy_from_slice(&u32::try_from(row.tick).ok()?.to_le_bytes());
    out[5] = event;
    out[6..].copy_from_slice(&value.to_le_bytes());
    Some(out)
}

/// Reads what follows [`ROW`].
#[must_use]
pub fn decode_row(bytes: &[u8; ROW_LEN]) -> Option<Row> {
    let value = u32_at(bytes, 5);
    let event = match bytes[4] {
        0 => Event::Hold,
        1 => Event::Resume,
        2 => Event::Reset,
        3 => Event::Feed(value as u8),
        4 => Event::Rapid(value as u8),
        5 => Event::Starve(value),
        _ => return None,
    };
    let tick = u32_at(bytes, 0).into();
    Some(Row { tick, event })
}

/// The two bytes that open a panic packet of `len` bytes of text ([`TEXT_MAX`] at most).
#[must_use]
pub fn encode_panic_head(len: usize) -> [u8; 2] {
    [PANIC_TAG, len.min(TEXT_MAX) as u8]
}

/// One packet, read back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Packet<'a> {
    /// A servo tick in motion.
    Frame(StepFrame),
    /// The trace begins.
    Hello {
        /// [`VERSION`] of the sender.
        version: u8,
        /// Servo ticks per second.
        servo_hz: u32,
    },
    /// A motion ended.
    Rest(Rest),
    /// Stack use.
    Stack {
        /// Bytes used at the deepest since power-up.
        deepest: u32,
        /// Bytes there are.
        size: u32,
    },
    /// So many rows of the timetable have not acted yet.
    Rows(u8),
    /// The board has panicked; the text (usually UTF-8) says where.
    Panic(&'a [u8]),
}

/// A byte that opens no packet: bytes were lost, or the other side speaks another version.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnknownTag(pub u8);

impl core::fmt::Display for UnknownTag {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "trace byte {:#04x} opens no packet", self.0)
    }
}

impl core::error::Error for UnknownTag {}

/// Reads one packet from the front of `bytes`: the packet and its length, or `None` if more bytes are needed.
///
/// # Errors
///
/// [`UnknownTag`] if the first byte opens no packet.
pub fn decode(bytes: &[u8]) -> Result<Option<(Packet<'_>, usize)>, UnknownTag> {
    let Some(&tag) = bytes.first() else {
        return Ok(None);
    };
    let packet = match tag {
        0..=0x1f => {
            return Ok(record::decode(bytes).map(|(frame, len)| (Packet::Frame(frame), len)))
        }
        HELLO_TAG => field(bytes, HELLO_LEN).map(|b| Packet::Hello {
            version: b[1],
            servo_hz: u32_at(b, 2),
        }),
        REST_TAG => field(bytes, REST_LEN).map(|b| {
            Packet::Rest(Rest {
                digest: u64_at(b, 1),
                ticks: u64_at(b, 9),
                emitted: core::array::from_fn(|a| u32_at(b, 17 + 4 * a) as i32),
            })
        }),
        STACK_TAG => field(bytes, STACK_LEN).map(|b| Packet::Stack {
            deepest: u32_at(b, 1),
            size: u32_at(b, 5),
        }),
        ROWS_TAG => field(bytes, ROWS_LEN).map(|b| Packet::Rows(b[1])),
        PANIC_TAG => bytes
            .get(1)
            .and_then(|&len| field(bytes, 2 + usize::from(len)))
            .map(|b| Packet::Panic(&b[2..])),
        other => return Err(UnknownTag(other)),
    };
    Ok(packet.map(|packet| {
        let len = match packet {
            Packet::Hello { .. } => HELLO_LEN,
            Packet::Rest(_) => REST_LEN,
            Packet::Stack { .. } => STACK_LEN,
            Packet::Rows(_) => ROWS_LEN,
            Packet::Panic(text) => 2 + text.len(),
            Packet::Frame(_) => 0,
        };
        (packet, len)
    }))
}

fn field(bytes: &[u8], len: usize) -> Option<&[u8]> {
    bytes.get(..len)
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(core::array::from_fn(|i| bytes[at + i]))
}

fn u64_at(bytes: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(core::array::from_fn(|i| bytes[at + i]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stepgen::AxisSteps;
    use proptest::prelude::*;

    fn sample_stream() -> (Vec<u8>, Vec<Packet<'static>>) {
        let mut frame = StepFrame::default();
        frame.axes[4] = AxisSteps {
            count: 7,
            negative: true,
            first: 3 << 16,
            pitch: 9 << 16,
        };
        let rest = Rest {
            digest: 0x0123_4567_89ab_cdef,
            ticks: 1 << 40,
            emitted: [1, -1, i32::MAX, i32::MIN, 0],
        };
        let mut bytes = Vec::new();
        bytes.extend_from_slice(&encode_hello(5000));
        for f in [StepFrame::default(), frame] {
            let mut record = [0; RECORD_MAX];
            let len = record::encode(&f, &mut record);
            bytes.extend_from_slice(&record[..len]);
        }
        bytes.extend_from_slice(&rest.encode());
        bytes.extend_from_slice(&encode_stack(1234, 65536));
        bytes.extend_from_slice(&encode_rows(3));
        bytes.extend_from_slice(&encode_panic_head(4));
        bytes.extend_from_slice(b"oops");
        let packets = vec![
            Packet::Hello {
                version: VERSION,
                servo_hz: 5000,
            },
            Packet::Frame(StepFrame::default()),
            Packet::Frame(frame),
            Packet::Rest(rest),
            Packet::Stack {
                deepest: 1234,
                size: 65536,
            },
            Packet::Rows(3),
            Packet::Panic(b"oops"),
        ];
        (bytes, packets)
    }

    #[test]
    fn what_the_board_encodes_the_host_decodes() {
        let (bytes, packets) = sample_stream();
        let mut at = 0;
        for want in packets {
            let (got, len) = decode(&bytes[at..]).unwrap().unwrap();
            assert_eq!(got, want);
            at += len;
        }
        assert_eq!(at, bytes.len());
    }

    #[test]
    fn a_row_arrives_as_it_was_sent() {
        for (tick, event) in [
            (0, Event::Hold),
            (1, Event::Resume),
            (0xfedc_ba98, Event::Reset),
            (7, Event::Feed(200)),
            (8, Event::Rapid(0)),
            (9, Event::Starve(70_000)),
        ] {
            let row = Row { tick, event };
            let sent = encode_row(&row).unwrap();
            assert_eq!(sent[0], ROW);
            assert_eq!(decode_row(sent[1..].try_into().unwrap()), Some(row));
        }
        let late = Row {
            tick: 1 << 32,
            event: Event::Hold,
        };
        assert_eq!(encode_row(&late), None);
        assert_eq!(decode_row(&[0xff; ROW_LEN]), None);
    }

    #[test]
    fn a_cut_packet_asks_for_more_bytes() {
        let (bytes, packets) = sample_stream();
        let mut at = 0;
        for _ in packets {
            let (_, len) = decode(&bytes[at..]).unwrap().unwrap();
            for cut in 0..len {
                assert_eq!(decode(&bytes[at..at + cut]), Ok(None));
            }
            at += len;
        }
    }

    proptest! {
        #[test]
        fn no_bytes_panic_and_every_packet_takes_some(bytes in prop::collection::vec(any::<u8>(), 0..80)) {
            if let Ok(Some((_, len))) = decode(&bytes) {
                prop_assert!(len > 0 && len <= bytes.len());
            }
        }
    }
}
