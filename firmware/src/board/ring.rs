//! From the receive interrupt to the background: text in order, real-time bytes ahead of it.
//!
//! In: bytes in the order of the wire, from the interrupt ([`RingIn`]). Out: bytes for
//! [`crate::machine::Controller::receive`] ([`RingOut`]). A real-time byte overtakes the text that waits in
//! the ring, because text can wait for seconds and a feed hold cannot; a reset also discards the text that
//! came before it, and only that.

use heapless::spsc::{Consumer, Producer, Queue};

use crate::protocol::{Incoming, Sorter};

/// Text bytes the ring holds. A sender that counts characters never has more on the way.
pub const RING_BYTES: usize = 1024;

/// Real-time bytes on the way to the background.
pub const URGENT_BYTES: usize = 32;

/// Soft reset.
const RESET: u8 = 0x18;

/// Storage of the ring; make it static on a board.
pub struct Ring {
    // One place of a queue stays empty.
    text: Queue<u8, { RING_BYTES + 1 }>,
    urgent: Queue<u8, { URGENT_BYTES + 1 }>,
}

/// The interrupt's end.
pub struct RingIn<'a> {
    text: Producer<'a, u8>,
    urgent: Producer<'a, u8>,
    sorter: Sorter,
}

/// The background's end.
pub struct RingOut<'a> {
    text: Consumer<'a, u8>,
    urgent: Consumer<'a, u8>,
}

/// The sender did not count: a byte found no room and is lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Overflow;

impl Ring {
    /// Empty.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            text: Queue::new(),
            urgent: Queue::new(),
        }
    }

    /// The two ends.
    pub fn split(&mut self) -> (RingIn<'_>, RingOut<'_>) {
        let (text_in, text_out) = self.text.split();
        let (urgent_in, urgent_out) = self.urgent.split();
        (
            RingIn {
                text: text_in,
                urgent: urgent_in,
                sorter: Sorter::new(),
            },
            RingOut {
                text: text_out,
                urgent: urgent_out,
            },
        )
    }
}

impl Default for Ring {
    fn default() -> Self {
        Self::new()
    }
}

impl RingIn<'_> {
    /// Takes one byte from the wire.
    ///
    /// # Errors
    ///
    /// [`Overflow`] if a text byte found no room. A real-time byte that finds none is dropped in silence: a
    /// hundred `?` ask no more than one.
    pub fn put(&mut self, byte: u8) -> Result<(), Overflow> {
        match self.sorter.sort(byte) {
            Incoming::Text => return self.text.enqueue(byte).map_err(|_| Overflow),
            // What is left out here cannot be mistaken for anything behind the ring.
            Incoming::Nothing => return Ok(()),
            Incoming::Event(_) | Incoming::FeedBy(_) | Incoming::Status => {}
        }
        if byte == RESET {
            // The same byte among the text marks how far it reaches. Without room for it all text goes.
            self.text.enqueue(RESET).ok();
        }
        self.urgent.enqueue(byte).ok();
        Ok(())
    }
}

impl RingOut<'_> {
    /// Next real-time byte.
    pub fn urgent(&mut self) -> Option<u8> {
        let byte = self.urgent.dequeue()?;
        if byte == RESET {
            while self.text.dequeue().is_some_and(|text| text != RESET) {}
        }
        Some(byte)
    }

    /// Next text byte. Ask for it only while the controller has room.
    pub fn text(&mut self) -> Option<u8> {
        loop {
            match self.text.dequeue()? {
                // Its reset was lost among too many real-time bytes; as text it means nothing.
                RESET => {}
                byte => return Some(byte),
            }
        }
    }

    /// True if nothing waits.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.text.is_empty() && self.urgent.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drain(out: &mut RingOut<'_>) -> Vec<u8> {
        std::iter::from_fn(|| out.text()).collect()
    }

    #[test]
    fn text_keeps_its_order_and_a_full_ring_says_so() {
        let mut ring = Ring::new();
        let (mut input, mut output) = ring.split();
        let text: Vec<u8> = (0..RING_BYTES).map(|i| b'A' + (i % 26) as u8).collect();
        for &byte in &text {
            assert_eq!(input.put(byte), Ok(()));
        }
        assert_eq!(input.put(b'X'), Err(Overflow));
        assert_eq!(drain(&mut output), text);
    }

    #[test]
    fn real_time_bytes_overtake_text() {
        let mut ring = Ring::new();
        let (mut input, mut output) = ring.split();
        for &byte in b"G1 X1\n!X2\n?~" {
            input.put(byte).unwrap();
        }
        let urgent: Vec<u8> = std::iter::from_fn(|| output.urgent()).collect();
        assert_eq!(urgent, b"!?~");
        assert_eq!(drain(&mut output), b"G1 X1\nX2\n");
    }

    #[test]
    fn a_reset_discards_the_text_before_it_and_none_after_it() {
        let mut ring = Ring::new();
        let (mut input, mut output) = ring.split();
        for &byte in b"before\n\x18after\n" {
            input.put(byte).unwrap();
        }
        assert_eq!(output.urgent(), Some(RESET));
        assert_eq!(drain(&mut output), b"after\n");
    }

    #[test]
    fn a_reset_gets_through_a_full_ring() {
        let mut ring = Ring::new();
        let (mut input, mut output) = ring.split();
        while input.put(b'G').is_ok() {}
        input.put(RESET).unwrap();
        assert_eq!(output.urgent(), Some(RESET));
        assert_eq!(drain(&mut output), b"");
    }
}
