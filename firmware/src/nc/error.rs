//! What is wrong with a line: a message of the [`crate::catalogue`] and the text it is about.
//!
//! Goes out to the protocol (`error:N`) and, through the host, to a person. Building an error copies
//! at most [`EXCERPT`] bytes of the offending text and formats nothing; formatting is `Display`'s.

use core::fmt;

use crate::catalogue::Message;

/// Bytes of source text an error (or a tool name) can hold.
pub const EXCERPT: usize = 32;

/// Owned copy of a short piece of a line, so that an error outlives the receive buffer.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Excerpt {
    bytes: [u8; EXCERPT],
    length: u8,
    cut: bool,
}

impl Excerpt {
    /// Copies `text`, cutting it after [`EXCERPT`] bytes.
    #[must_use]
    pub fn new(text: &[u8]) -> Self {
        let mut bytes = [0; EXCERPT];
        let mut length = 0;
        for (to, from) in bytes.iter_mut().zip(text) {
            *to = *from;
            length += 1;
        }
        Self {
            bytes,
            length,
            cut: text.len() > EXCERPT,
        }
    }

    /// The bytes copied.
    #[must_use]
    pub fn as_bytes(&self) -> &[u8] {
        self.bytes.get(..usize::from(self.length)).unwrap_or(&[])
    }
}

impl fmt::Display for Excerpt {
    /// The text, `..` behind it if it was cut, `\x9C` for what cannot be shown.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{}{}",
            self.as_bytes().escape_ascii(),
            if self.cut { ".." } else { "" }
        )
    }
}

impl fmt::Debug for Excerpt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "\"{self}\"")
    }
}

/// Why a line was refused: `Display` prints the message with the offending text in place of its `{}`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NcErrorKind {
    /// Number and text.
    pub message: &'static Message,
    /// The text it is about, as it stands in the line; empty if the message has no place for it.
    pub excerpt: Excerpt,
}

impl NcErrorKind {
    /// A message without text of the line.
    #[must_use]
    pub fn new(message: &'static Message) -> Self {
        Self {
            message,
            excerpt: Excerpt::new(&[]),
        }
    }

    /// Stable number of the error, for `error:N`.
    #[must_use]
    pub fn code(&self) -> u16 {
        self.message.code
    }
}

impl fmt::Display for NcErrorKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.message.text.split_once("{}") {
            Some((before, after)) => write!(f, "{before}{}{after}", self.excerpt),
            None => f.write_str(self.message.text),
        }
    }
}

impl core::error::Error for NcErrorKind {}

/// A refused line: where and why. `Display` prints `line:column code text`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NcError {
    /// Physical line, 1-based, counted since the program began.
    pub line: u32,
    /// Byte within the line, 1-based.
    pub column: u16,
    /// What is wrong.
    pub kind: NcErrorKind,
}

impl fmt::Display for NcError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{}:{} {} {}",
            self.line,
            self.column,
            self.kind.code(),
            self.kind
        )
    }
}

impl core::error::Error for NcError {}

/// An error while the text is at hand. Eight bytes, because every step of the good path returns the
/// possibility of one; [`Fault::kind`] makes the real thing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fault {
    at: u8,
    length: u8,
    message: &'static Message,
}

impl Fault {
    /// Error about the `length` bytes at byte index `at` (a line has at most 96).
    #[cold]
    pub fn new(at: usize, length: usize, message: &'static Message) -> Self {
        let limited = |value: usize| u8::try_from(value).unwrap_or(u8::MAX);
        Self {
            at: limited(at),
            length: limited(length),
            message,
        }
    }

    /// 1-based byte of the line.
    #[cold]
    pub fn column(&self) -> u16 {
        u16::from(self.at) + 1
    }

    /// The error, with its text taken out of the line.
    #[cold]
    pub fn kind(&self, line: &[u8]) -> NcErrorKind {
        let text = line.get(usize::from(self.at)..).unwrap_or(&[]);
        NcErrorKind {
            message: self.message,
            excerpt: Excerpt::new(text.get(..usize::from(self.length)).unwrap_or(text)),
        }
    }
}
