//! Part programs: a file in, the text lines that go over the wire out, with sub-programs inlined.
//!
//! The core never sees a file. A line whose only word names a sub-program is replaced here by the lines of
//! that file, and a map leads from every streamed line back to file and line, so that an error of the core
//! (`line L column C` of the stream) is shown where its author can mend it.

use std::collections::HashMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::diagnostics::{Exit, Failure, Located};
use crate::program::words::Line;

pub mod words;

/// Depth of nested sub-programs, as on the Sinumerik 840D.
pub const NESTING_MAX: usize = 11;
/// Lines a program may have after inlining; calls multiply, memory does not.
pub const LINES_MAX: usize = 20_000_000;
/// What a sub-program file may be called behind its name.
const EXTENSIONS: [&str; 5] = ["SPF", "MPF", "spf", "mpf", "nc"];

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
    /// Reads `path` and, beside it, every sub-program it calls.
    ///
    /// # Errors
    /// Exit code 5 if `path` cannot be read; 3 with the place in the program for a missing or recursive
    /// sub-program, nesting deeper than [`NESTING_MAX`], more than [`LINES_MAX`] lines, or a character that
    /// cannot go over the wire outside of a comment.
    pub fn load(path: &Path) -> Result<Self, Failure> {
        let bytes = std::fs::read(path).map_err(|e| Failure::io("read program", path, &e))?;
        let folder = match path.parent() {
            Some(folder) if folder != Path::new("") => folder.to_owned(),
            _ => PathBuf::from("."),
        };
        let stem = path
            .file_stem()
            .map(|s| s.to_string_lossy().to_uppercase())
            .unwrap_or_default();
        Self::build(
            Source::new(path.display().to_string(), &bytes),
            stem,
            Some(folder),
        )
    }

    /// Takes `text` as a program called `name` that has no files beside it.
    ///
    /// # Errors
    /// As [`Program::load`]; every sub-program is missing.
    pub fn from_text(name: &str, text: &str) -> Result<Self, Failure> {
        Self::build(
            Source::new(name.to_owned(), text.as_bytes()),
            String::new(),
            None,
        )
    }

    fn build(main: Source, stem: String, folder: Option<PathBuf>) -> Result<Self, Failure> {
        let program = Self {
            sources: vec![main],
            origins: Vec::new(),
            calls: Vec::new(),
            wire: Vec::new(),
            ends: Vec::new(),
            unused_from: None,
        };
        let mut inliner = Inliner {
            program,
            folder,
            known: HashMap::new(),
            active: vec![stem],
        };
        inliner.inline(0, None)?;
        Ok(inliner.program)
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
    pub fn lines(&self) -> impl Iterator<Item = &[u8]> {
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
            column: column.max(1),
            text: source.line(origin.line).to_owned(),
        })
    }

    /// The calls that lead to streamed line `line` (from 1), innermost first, as `file:line`.
    #[must_use]
    pub fn called_from(&self, line: usize) -> Vec<String> {
        let mut chain = Vec::new();
        let mut next = line
            .checked_sub(1)
            .and_then(|i| self.origins.get(i))
            .and_then(|origin| origin.call);
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
        let column = column.saturating_sub(1);
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

/// Work in progress of [`Program::build`].
struct Inliner {
    program: Program,
    folder: Option<PathBuf>,
    /// Sub-programs found so far, by upper-case name.
    known: HashMap<String, Option<u32>>,
    /// Upper-case names of the programs being inlined, outermost first.
    active: Vec<String>,
}

impl Inliner {
    fn inline(&mut self, source: u32, call: Option<u32>) -> Result<(), Failure> {
        let count = self.program.sources[source as usize].lines.len();
        for line in 0..u32::try_from(count).unwrap_or(u32::MAX) {
            let origin = Origin { source, line, call };
            let text = self.program.source(origin).line(line).to_owned();
            let parsed = Line::new(&text);
            if let Some(bad) = parsed.unsendable {
                return Err(self.refuse(
                    origin,
                    bad,
                    1,
                    "character cannot be sent",
                    "means something to the wire; expected only in comments",
                ));
            }
            if let Some(name) = &parsed.call {
                if let Some(callee) = self.find(&name.text) {
                    self.enter(callee, origin, name)?;
                    continue;
                }
                if !name.may_be_nc {
                    let message = format!("no sub-program {}", name.text);
                    let label = "neither an NC word nor a file with this name and .SPF, .MPF or .nc beside the program";
                    return Err(self.refuse(
                        origin,
                        name.column,
                        name.text.chars().count(),
                        &message,
                        label,
                    ));
                }
            }
            if self.program.ends.len() >= LINES_MAX {
                return Err(self.refuse(
                    origin,
                    0,
                    1,
                    "program too long",
                    "more lines than the host inlines",
                ));
            }
            let (ends_program, returns) = (parsed.ends_program, parsed.returns);
            self.program.origins.push(origin);
            // A header would start another program in the middle of this one.
            if !(call.is_some() && parsed.header) {
                let returned = ends_program && call.is_some();
                self.program.wire.extend(if returned {
                    parsed.wire_as_return()
                } else {
                    parsed.wire
                });
            }
            self.program.ends.push(self.program.wire.len());
            // M17, M2 and M30 return from a sub-program, M2 and M30 end the main program: what follows does not run.
            if ends_program && call.is_none() {
                let rest = line + 1..u32::try_from(count).unwrap_or(u32::MAX);
                let source = self.program.source(origin);
                let left = rest
                    .into_iter()
                    .find(|&after| !source.line(after).trim().is_empty());
                self.program.unused_from = left.map(|after| after as usize + 1);
                break;
            }
            if call.is_some() && (ends_program || returns) {
                break;
            }
        }
        Ok(())
    }

    fn enter(&mut self, callee: u32, origin: Origin, name: &words::Call) -> Result<(), Failure> {
        let upper = name.text.to_uppercase();
        let width = name.text.chars().count();
        if self.active.contains(&upper) {
            let message = format!("sub-program {} calls itself", name.text);
            return Err(self.refuse(
                origin,
                name.column,
                width,
                &message,
                "expected a program that is not running already",
            ));
        }
        if self.active.len() > NESTING_MAX {
            let message = format!("sub-programs nested deeper than {NESTING_MAX}");
            return Err(self.refuse(
                origin,
                name.column,
                width,
                &message,
                "this call is one too deep",
            ));
        }
        let call = u32::try_from(self.program.calls.len()).ok();
        self.program.calls.push(origin);
        self.active.push(upper);
        self.inline(callee, call)?;
        self.active.pop();
        Ok(())
    }

    /// Index of the source of sub-program `name`, read on first use.
    fn find(&mut self, name: &str) -> Option<u32> {
        let upper = name.to_uppercase();
        if let Some(found) = self.known.get(&upper) {
            return *found;
        }
        let found = self.read(name).and_then(|source| {
            self.program.sources.push(source);
            u32::try_from(self.program.sources.len() - 1).ok()
        });
        self.known.insert(upper, found);
        found
    }

    fn read(&self, name: &str) -> Option<Source> {
        let folder = self.folder.as_ref()?;
        for stem in [name.to_owned(), name.to_uppercase(), name.to_lowercase()] {
            for extension in EXTENSIONS {
                let path = folder.join(format!("{stem}.{extension}"));
                if let Ok(bytes) = std::fs::read(&path) {
                    return Some(Source::new(path.display().to_string(), &bytes));
                }
            }
        }
        None
    }

    fn refuse(
        &self,
        origin: Origin,
        column: usize,
        chars: usize,
        message: &str,
        label: &str,
    ) -> Failure {
        let source = self.program.source(origin);
        let (offset, len) = source.span(origin.line, column, chars);
        Failure::new(
            Exit::Program,
            Located::new(message).at(&source.name, &source.text, offset, len, label),
        )
    }
}

#[cfg(test)]
mod tests;
