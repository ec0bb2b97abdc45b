//! Every error a program can meet: stable number, message, reason and mend, one file per stage of the road.
//!
//! The stages name their messages from here ([`Message`]: what goes over the wire). Reason and mend are for people; they
//! exist on the host only, where `docs/errors.md` is made from [`entries`]. Numbers never change their meaning.
//! They begin well above those of GRBL and its descendants, so that no client shows a GRBL explanation for them.
//!
//! | numbers | stage |
//! |---|---|
//! | 3, 9 | protocol |
//! | 101 to 149 | NC language |
//! | 150 to 169 | geometry |
//! | 170 to 189 | cutter compensation |
//! | 201 to 219 | machine |
//! | 301 to 349 | dialects |

use core::fmt;

pub mod compensation;
pub mod dialect;
pub mod geometry;
pub mod machine;
pub mod nc;

/// Number and text of an error. `{}` in the text stands for what the stage fills in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Message {
    /// Stable number, `error:N` on the wire.
    pub code: u16,
    /// What is wrong, in a few words.
    pub text: &'static str,
}

impl Message {
    /// Writes the text with each `{}` replaced by the next of `values`.
    pub fn write(&self, f: &mut dyn fmt::Write, values: &[&dyn fmt::Display]) -> fmt::Result {
        let mut values = values.iter();
        let mut rest = self.text;
        while let Some((before, after)) = rest.split_once("{}") {
            f.write_str(before)?;
            if let Some(value) = values.next() {
                write!(f, "{value}")?;
            }
            rest = after;
        }
        f.write_str(rest)
    }
}

/// An error with what a person needs to know about it.
#[cfg(not(target_os = "none"))]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Entry {
    /// Number and text.
    pub message: Message,
    /// Why the machine refuses this.
    pub reason: &'static str,
    /// What to do about it.
    pub mend: &'static str,
}

/// All errors in the order of their numbers within each stage.
#[cfg(not(target_os = "none"))]
pub fn entries() -> impl Iterator<Item = &'static Entry> {
    machine::ENTRIES
        .iter()
        .chain(nc::ENTRIES)
        .chain(geometry::ENTRIES)
        .chain(compensation::ENTRIES)
        .chain(dialect::ENTRIES)
}

/// Declares the errors of one stage: `NAME = number, "text", "reason", "mend";`.
macro_rules! messages {
    ($($name:ident = $code:literal, $text:literal, $reason:literal, $mend:literal;)*) => {
        $(
            #[doc = concat!("`", stringify!($code), "`: ", $text)]
            pub const $name: super::Message = super::Message { code: $code, text: $text };
        )*
        #[cfg(not(target_os = "none"))]
        pub(super) static ENTRIES: &[super::Entry] = &[
            $(super::Entry { message: $name, reason: $reason, mend: $mend },)*
        ];
    };
}
use messages;
