//! Lines that are not read by the words of the language: what `GOTOF` passes over, and conversational ones.

use super::command::Command;
use super::error::{Excerpt, Fault, NcError, NcErrorKind};
use super::heidenhain::Shared;
use super::interpreter::Interpreter;
use super::lexer::{Lexer, WordKind};
use crate::catalogue::nc as message;
use crate::config::Config;

impl Interpreter {
    /// One line of a Heidenhain program.
    #[cold]
    pub(super) fn conversational(
        &mut self,
        config: &Config,
        text: &[u8],
        emit: &mut dyn FnMut(Command),
    ) -> Result<(), NcError> {
        let mut shared = Shared {
            config,
            tools: &mut self.tools,
            zero_offset: &config.zero_offsets[0],
            line: self.line,
            position: &mut self.position,
        };
        match self.heidenhain.line(&mut shared, text, emit) {
            Ok(ended) => {
                self.ended = ended;
                Ok(())
            }
            Err(fault) => Err(self.error(&fault, text)),
        }
    }

    /// Looks for the label of `GOTOF`: true if the line does not have it, and is to be passed over.
    #[cold]
    pub(super) fn pass_over(&self, text: &[u8], label: Excerpt) -> Result<bool, NcError> {
        let Ok(mut lexer) = Lexer::new(text) else {
            return Ok(true);
        };
        if let Ok(Some(_)) = lexer.header() {
            return Ok(true);
        }
        // what cannot be read is passed over like the rest
        while let Ok(Some(word)) = lexer.next_word(&self.parameters) {
            match word.kind {
                WordKind::Label(name) => {
                    let name = Excerpt::new(name);
                    if name.as_bytes().eq_ignore_ascii_case(label.as_bytes()) {
                        return Ok(false);
                    }
                }
                WordKind::Address(b'M', number) if matches!(number.index(30), Some(2 | 30)) => {
                    return Err(NcError {
                        line: self.line,
                        column: Fault::new(word.at, 0, &message::LABEL_NOT_FOUND).column(),
                        kind: NcErrorKind {
                            message: &message::LABEL_NOT_FOUND,
                            excerpt: label,
                        },
                    });
                }
                _ => {}
            }
        }
        Ok(true)
    }
}
