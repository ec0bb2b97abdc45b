//! How errors reach a person: program name, line, column, the line itself, a caret, what was expected.
//!
//! Comes in: what went wrong and where. Goes out: a [`Failure`] that `main` prints with miette on stderr
//! and turns into the process exit code.

use std::fmt;
use std::path::Path;
use std::process;
use std::sync::Arc;

use miette::{Diagnostic, LabeledSpan, NamedSource, SourceCode};

/// Exit codes of `host-sim`. Scripts depend on the numbers; they never change meaning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Exit {
    /// 0: done.
    Success = 0,
    /// 2: wrong command line, machine file or event file (clap uses the same number).
    Usage = 2,
    /// 3: the program is wrong; file, line and column were printed.
    Program = 3,
    /// 4: the program is valid but leaves the travel of the machine.
    Limit = 4,
    /// 5: a file or a serial port could not be read or written.
    Io = 5,
    /// 6: the emulator is missing or did not behave.
    Emulator = 6,
    /// 7: the program waits for cycle start (`M0`, `M1` or a hold) and nothing will give it.
    Waiting = 7,
    /// 8: the simulated time reached its bound before the program ended.
    TimeBound = 8,
    /// 9: a count or a size is over its budget (`bench --check`).
    Budget = 9,
}

/// The exit codes as `--help` shows them.
pub const EXIT_CODE_HELP: &str =
    "Exit codes: 0 done, 2 wrong command line, machine file or event file, \
3 error in the program, 4 travel limit violated, 5 file or port I/O, 6 emulator, \
7 waiting for cycle start (M0, M1 or hold), 8 bound on simulated time reached, \
9 a count of `bench --check` is over its budget";

impl From<std::io::Error> for Failure {
    fn from(error: std::io::Error) -> Self {
        Self::new(Exit::Io, Located::new(error.to_string()))
    }
}

impl From<Exit> for process::ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}

/// An error with, where there is one, a place in a text file.
#[derive(Debug)]
pub struct Located {
    /// What is wrong.
    pub message: String,
    /// What to do or what was expected; may be empty.
    pub help: String,
    place: Option<Place>,
}

#[derive(Debug)]
struct Place {
    source: NamedSource<Arc<str>>,
    label: String,
    offset: usize,
    len: usize,
}

impl Located {
    /// Error without a place.
    #[must_use]
    pub fn new(message: impl Into<String>) -> Self {
        Self {
            message: message.into(),
            help: String::new(),
            place: None,
        }
    }

    /// Adds advice.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = help.into();
        self
    }

    /// Adds a line of advice to what there is; an empty one adds nothing.
    #[must_use]
    pub fn more_help(mut self, help: &str) -> Self {
        if !help.is_empty() {
            if !self.help.is_empty() {
                self.help.push('\n');
            }
            self.help.push_str(help);
        }
        self
    }

    /// Points at bytes `offset..offset + len` of `text`, shown as file `name`, with `label` at the caret.
    ///
    /// The span is clipped to the text, so that any position is safe to show.
    #[must_use]
    pub fn at(
        mut self,
        name: &str,
        text: &Arc<str>,
        offset: usize,
        len: usize,
        label: &str,
    ) -> Self {
        let offset = offset.min(text.len());
        let len = len.min(text.len() - offset);
        let source = NamedSource::new(name, Arc::clone(text));
        self.place = Some(Place {
            source,
            label: label.to_owned(),
            offset,
            len,
        });
        self
    }
}

impl fmt::Display for Located {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Located {}

impl Diagnostic for Located {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        (!self.help.is_empty()).then(|| Box::new(&self.help) as Box<dyn fmt::Display>)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.place
            .as_ref()
            .map(|place| &place.source as &dyn SourceCode)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let place = self.place.as_ref()?;
        let span = LabeledSpan::new(Some(place.label.clone()), place.offset, place.len);
        Some(Box::new(std::iter::once(span)))
    }
}

/// What ends a command: the exit code and what to print.
#[derive(Debug)]
pub struct Failure {
    /// Exit code of the process.
    pub exit: Exit,
    /// What is printed on stderr.
    pub report: Box<Located>,
}

impl Failure {
    /// Failure with exit code `exit`.
    #[must_use]
    pub fn new(exit: Exit, report: Located) -> Self {
        Self {
            exit,
            report: Box::new(report),
        }
    }

    /// `path` could not be read or written; exit code 5.
    #[must_use]
    pub fn io(action: &str, path: &Path, error: &std::io::Error) -> Self {
        Self::new(
            Exit::Io,
            Located::new(format!("cannot {action} {}: {error}", path.display())),
        )
    }

    /// The report as plain text with the source line and an ASCII caret, without colours.
    #[must_use]
    pub fn render(&self) -> String {
        let theme = miette::GraphicalTheme {
            characters: miette::ThemeCharacters::ascii(),
            styles: miette::ThemeStyles::none(),
        };
        let handler = miette::GraphicalReportHandler::new_themed(theme)
            .with_wrap_lines(false)
            .with_context_lines(1);
        let mut out = String::new();
        match handler.render_report(&mut out, self.report.as_ref()) {
            Ok(()) => out,
            Err(_) => self.report.message.clone(),
        }
    }

    /// Prints the report on stderr, with colours and box characters where the terminal has them.
    pub fn print(self) {
        // A hook set by an embedding program wins; the report is printed either way.
        let _ = miette::set_hook(Box::new(|_| {
            Box::new(
                miette::MietteHandlerOpts::new()
                    .wrap_lines(false)
                    .context_lines(1)
                    .build(),
            )
        }));
        eprintln!("{:?}", miette::Report::new(*self.report));
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.report.fmt(f)
    }
}

impl std::error::Error for Failure {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_located_error_shows_file_line_text_and_caret() {
        let text: Arc<str> = Arc::from("G1 X1\nG1 Y2 Q3\nM30\n");
        let located = Located::new("unknown address Q")
            .at("part.mpf", &text, 12, 2, "expected an axis")
            .help("see the manual");
        let shown = Failure::new(Exit::Program, located).render();
        for part in [
            "unknown address Q",
            "part.mpf:2:7",
            "G1 Y2 Q3",
            "^",
            "expected an axis",
            "see the manual",
        ] {
            assert!(shown.contains(part), "{part:?} not in\n{shown}");
        }
    }

    #[test]
    fn a_place_outside_the_text_is_clipped() {
        let text: Arc<str> = Arc::from("G1\n");
        let located = Located::new("x").at("p", &text, 99, 99, "here");
        assert!(Failure::new(Exit::Program, located).render().contains('x'));
    }
}
