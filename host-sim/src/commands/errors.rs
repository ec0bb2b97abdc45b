//! `host-sim errors`: the catalogue of errors, on stdout or as the Markdown page `docs/errors.md`.
//!
//! In: [`pentaspline::catalogue::entries`]. Out: text. Nothing is added here but the order and the frame.

use std::fmt::Write;

use pentaspline::catalogue::{entries, Entry};

use crate::cli::ErrorsArgs;
use crate::diagnostics::{Exit, Failure};

/// Stages by the first and last number each owns, in the order of the road.
pub const STAGES: [(&str, u16, u16); 6] = [
    ("Protocol", 1, 99),
    ("NC language", 101, 149),
    ("Geometry", 150, 169),
    ("Cutter compensation", 170, 189),
    ("Machine", 201, 219),
    ("Dialects", 301, 349),
];

/// Prints the catalogue, or writes it as a Markdown page.
///
/// # Errors
/// Exit code 5 if the page cannot be written.
pub fn errors(args: &ErrorsArgs) -> Result<Exit, Failure> {
    match &args.markdown {
        Some(path) => {
            std::fs::write(path, markdown()).map_err(|e| Failure::io("write", path, &e))?;
        }
        None => print!("{}", plain()),
    }
    Ok(Exit::Success)
}

/// Errors of the stage that owns the numbers `first..=last`, by number.
fn stage(first: u16, last: u16) -> Vec<&'static Entry> {
    let mut rows: Vec<&Entry> = entries()
        .filter(|entry| (first..=last).contains(&entry.message.code))
        .collect();
    rows.sort_by_key(|entry| entry.message.code);
    rows
}

/// The catalogue for a terminal: number and message, below them reason and mend.
#[must_use]
pub fn plain() -> String {
    let mut out = String::new();
    for (name, first, last) in STAGES {
        let rows = stage(first, last);
        if rows.is_empty() {
            continue;
        }
        let _ = writeln!(out, "{name}");
        for entry in rows {
            let _ = writeln!(out, "  error:{} {}", entry.message.code, entry.message.text);
            for text in [entry.reason, entry.mend] {
                if !text.is_empty() {
                    let _ = writeln!(out, "      {text}");
                }
            }
        }
        out.push('\n');
    }
    out
}

/// The catalogue as a Markdown page.
#[must_use]
pub fn markdown() -> String {
    let mut out = String::from(
        "# Errors\n\
         \n\
         What a controller means by `error:N`. The number never changes its meaning; `{}` stands for the word, axis or\n\
         value concerned. Above the answer the controller says where: `[MSG:error line L column C: text]`; the simulator\n\
         shows the line itself with a caret. `host-sim errors` prints this list in a terminal, and\n\
         `host-sim errors --markdown docs/errors.md` writes this page.\n",
    );
    for (name, first, last) in STAGES {
        let rows = stage(first, last);
        if rows.is_empty() {
            continue;
        }
        let _ = write!(
            out,
            "\n## {name}\n\n| number | message | reason | what to do |\n|---:|---|---|---|\n"
        );
        for entry in rows {
            let _ = writeln!(
                out,
                "| {} | {} | {} | {} |",
                entry.message.code,
                cell(entry.message.text),
                cell(entry.reason),
                cell(entry.mend)
            );
        }
    }
    out
}

/// Text that stays inside its table cell.
fn cell(text: &str) -> String {
    text.replace('|', "\\|")
        .replace('<', "&lt;")
        .replace('\n', " ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_entry_stands_in_exactly_one_stage() {
        let shown: usize = STAGES.iter().map(|&(_, a, b)| stage(a, b).len()).sum();
        assert_eq!(shown, entries().count());
    }
}
