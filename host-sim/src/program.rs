//! Part programs: a file in, the text lines that go over the wire out, in the order in which they run.
//!
//! The core never sees a file. Sub-programs are put in the place of their calls and jumps are followed here
//! (`inliner`), and a map leads from every streamed line back to file and line, so that an error of the core
//! (`line L column C` of the stream) is shown where its author can mend it.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use pentaspline::config::Dialect;

use crate::diagnostics::{Failure, Located};

mod flow;
mod inliner;
mod wire;
pub mod words;

/// Depth of nested sub-programs, as on the Sinumerik 840D.
pub const NESTING_MAX: usize = 11;
/// Lines a program may have after inlining; calls multiply, memory does not.
pub const LINES_MAX: usize = 20_000_000;

/// How a program is read.
#[derive(Clone, Copy, Debug)]
pub struct Reading {
    /// Its language.
    pub dialect: Dialect,
    /// Lines that begin with `/` are left out.
    pub block_skip: bool,
    /// Lines it may have, and run through, at most.
    pub lines_max: usize,
}

impl Default for Reading {
    fn default() -> Self {
        Self {
            dialect: Dialect::default(),
            block_skip: false,
            lines_max: LINES_MAX,
        }
    }
}

/// One file.
#[derive(Clone, Debug)]
pub struct Source {
    /// Name shown in errors.
    pub name: String,
    /// Text, always valid UTF-8: other files are read as Latin-1.
    pub text: Arc<str>,
    lines: Vec<Range<usize>>,
}

/// Where a streamed line comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Origin {
    /// Index of the file.
    source: u32,
    /// Line in it, from 0.
    line: u32,
    /// Index of the call this line is inlined for, if any.
    call: Option<u32>,
    /// Character of it, from 0, that the whole streamed line stands for; `None` if the columns are the same.
    rewritten: Option<u32>,
}

impl Origin {
    /// Character of the line in the file, from 0, for `column` of the streamed line, from 1.
    fn column(&self, column: usize) -> usize {
        self.rewritten
            .map_or(column.saturating_sub(1), |at| at as usize)
    }
}

/// A place in a program file, for people.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Location {
    /// File as it was named.
    pub file: String,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// The line itself.
    pub text: String,
}

/// A program ready to be streamed.
#[derive(Clone, Debug)]
pub struct Program {
    sources: Vec<Source>,
    origins: Vec<Origin>,
    calls: Vec<Origin>,
    wire: Vec<u8>,
    ends: Vec<usize>,
    unused_from: Option<usize>,
}

impl Source {
    fn new(name: String, bytes: &[u8]) -> Self {
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let text: Arc<str> = match std::str::from_utf8(bytes) {
            Ok(text) => Arc::from(text),
            Err(_) => bytes
                .iter()
                .map(|&b| char::from(b))
                .collect::<String>()
                .into(),
        };
        let mut lines = Vec::new();
        let mut start = 0;
        while start < text.len() {
            let end = text[start..].find('\n').map_or(text.len(), |n| start + n);
            let visible = text[start..end].trim_end_matches('\r').len();
            lines.push(start..start + visible);
            start = end + 1;
        }
        Self { name, text, lines }
    }

    fn line(&self, index: u32) -> &str {
        self.lines
            .get(index as usize)
            .map_or("", |range| &self.text[range.clone()])
    }

    /// Bytes of the text that `chars` characters from `column` (from 0) of `line` take.
    fn span(&self, line: u32, column: usize, chars: usize) -> (usize, usize) {
        let Some(range) = self.lines.get(line as usize) else {
            return (self.text.len(), 0);
        };
        let text = &self.text[range.clone()];
        let at = |n: usize| {
            text.char_indices()
                .nth(n)
                .map_or(text.len(), |(byte, _)| byte)
        };
        let (from, to) = (at(column), at(column.saturating_add(chars)));
        (range.start + from, to - from)
    }
}

impl Program {
    /// Reads `path` and, beside it, every sub-program it calls, as [`Reading::default`] has it.
    ///
    /// # Errors
    /// As [`Program::load_as`].
    pub fn load(path: &Path) -> Result<Self, Failure> {
        Self::load_as(path, &Reading::default())
    }

    /// Reads `path` and, beside it, every sub-program it calls.
    ///
    /// # Errors
    /// Exit code 5 if `path` cannot be read; 3 with the place in the program for a missing or recursive
    /// sub-program, nesting deeper than [`NESTING_MAX`], a jump without its target or without end, an expression
    /// that cannot be evaluated, more lines than [`Reading::lines_max`], a word the host does not follow, or a
    /// character that cannot go over the wire outside of a comment.
    pub fn load_as(path: &Path, reading: &Reading) -> Result<Self, Failure> {
        let bytes = std::fs::read(path).map_err(|e| Failure::io("read program", path, &e))?;
        let folder = match path.parent() {
            Some(folder) if folder != Path::new("") => folder.to_owned(),
            _ => PathBuf::from("."),
        };
        let stem = path
            .file_stem()
            .map(|s| s.to_string_lossy().to_uppercase())
            .unwrap_or_default();
        let main = Source::new(path.display().to_string(), &bytes);
        inliner::inline(main, stem, Some(folder), reading)
    }

    /// Takes `text` as a program called `name` that has no files beside it, as [`Reading::default`] has it.
    ///
    /// # Errors
    /// As [`Program::load_as`]; every sub-program is missing.
    pub fn from_text(name: &str, text: &str) -> Result<Self, Failure> {
        Self::from_text_as(name, text, &Reading::default())
    }

    /// Takes `text` as a program called `name` that has no files beside it.
    ///
    /// # Errors
    /// As [`Program::load_as`]; every sub-program is missing.
    pub fn from_text_as(name: &str, text: &str, reading: &Reading) -> Result<Self, Failure> {
        let main = Source::new(name.to_owned(), text.as_bytes());
        inliner::inline(main, String::new(), None, reading)
    }

    /// Number of lines to stream.
    #[must_use]
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// True for a program without lines.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// Streamed line `index` (from 0) without its line end. ASCII only; one byte per character of the file.
    #[must_use]
    pub fn line(&self, index: usize) -> Option<&[u8]> {
        let end = *self.ends.get(index)?;
        let start = if index == 0 { 0 } else { self.ends[index - 1] };
        Some(&self.wire[start..end])
    }

    /// All streamed lines in order.
    pub fn lines(&self) -> impl Iterator<Item = &[u8]> + '_ {
        (0..self.len()).filter_map(|index| self.line(index))
    }

    /// First line (from 1) of text behind the end of the main program; a control does not run it, and it is not sent.
    #[must_use]
    pub fn unused_from(&self) -> Option<usize> {
        self.unused_from
    }

    /// Name of the main program as it was given.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.sources[0].name
    }

    /// Where streamed line `line` (from 1), column `column` (from 1) comes from.
    ///
    /// `None` if the stream has no such line.
    #[must_use]
    pub fn locate(&self, line: usize, column: usize) -> Option<Location> {
        let origin = self.origins.get(line.checked_sub(1)?)?;
        let source = self.source(*origin);
        Some(Location {
            file: source.name.clone(),
            line: origin.line as usize + 1,
            column: origin.column(column).saturating_add(1),
            text: source.line(origin.line).to_owned(),
        })
    }

    /// The calls that lead to streamed line `line` (from 1), innermost first, as `file:line`.
    #[must_use]
    pub fn called_from(&self, line: usize) -> Vec<String> {
        let origin = line.checked_sub(1).and_then(|i| self.origins.get(i));
        origin.map_or(Vec::new(), |origin| self.calls_of(*origin))
    }

    /// The calls that lead to `origin`, innermost first.
    fn calls_of(&self, origin: Origin) -> Vec<String> {
        let mut chain = Vec::new();
        let mut next = origin.call;
        while let Some(call) = next.and_then(|index| self.calls.get(index as usize)) {
            chain.push(format!("{}:{}", self.source(*call).name, call.line + 1));
            next = call.call;
        }
        chain
    }

    /// Error `message` at streamed line `line`, column `column` (both from 1), with `label` at the caret.
    ///
    /// The word at the column is underlined. A line that does not exist gives the message alone.
    #[must_use]
    pub fn error_at(&self, line: usize, column: usize, message: &str, label: &str) -> Located {
        let located = Located::new(message);
        let Some(origin) = line.checked_sub(1).and_then(|i| self.origins.get(i)) else {
            return located;
        };
        let source = self.source(*origin);
        let column = origin.column(column);
        let word = words::word_len(source.line(origin.line), column);
        let (offset, len) = source.span(origin.line, column, word);
        let located = located.at(&source.name, &source.text, offset, len, label);
        match self.called_from(line).as_slice() {
            [] => located,
            chain => located.help(format!("called from {}", chain.join(", from "))),
        }
    }

    fn source(&self, origin: Origin) -> &Source {
        &self.sources[origin.source as usize]
    }
}

#[cfg(test)]
mod flow_tests;
#[cfg(test)]
mod tests;
