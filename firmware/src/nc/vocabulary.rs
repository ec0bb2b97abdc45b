//! The words of the language, from the tables that read them: nothing comes in, spellings go out. Host only: what the
//! guide of the language shows is checked against it.

use core::fmt;

use super::expression;
use super::table::{G_FUNCTIONS, KEYWORDS, M_FUNCTIONS};

/// One word: `Display` gives its spelling in a program, without what follows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VocabularyWord {
    /// `G1`: letter and number.
    Function(char, u32),
    /// `ASPLINE`, `SIN`, `DIV`, `F`.
    Name(&'static str),
}

impl fmt::Display for VocabularyWord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Function(letter, number) => write!(f, "{letter}{number}"),
            Self::Name(name) => f.write_str(name),
        }
    }
}

/// Words that no table holds: addresses that are no axes, phrases, operators, and the statements of the other dialects.
const OTHERS: [&str; 51] = [
    "N",
    "F",
    "S",
    "T",
    "D",
    "P",
    "R",
    "L",
    "I",
    "J",
    "K",
    "AC",
    "IC",
    "DC",
    "GOTOF",
    "MSG",
    "SPLINEPATH",
    "PO",
    "POX",
    "POD",
    "DIV",
    "MOD",  // Fanuc
    "G6.2", // Heidenhain
    "BEGIN",
    "END",
    "PGM",
    "MM",
    "CC",
    "C",
    "CR",
    "DR",
    "SPL",
    "TOOL",
    "CALL",
    "STOP",
    "FMAX",
    "R0",
    "RL",
    "RR",
    "IX",
    "K3",
    "K2",
    "K1",
    "INCH",
    "DL",
    "NOT",
    "AND",
    "OR",
    "XOR",
    "EX",
    "Q",
];

/// Every word the control understands, be it only to refuse it by name.
pub fn vocabulary() -> impl Iterator<Item = VocabularyWord> {
    let functions = |letter, rows: &'static [super::table::Row]| {
        rows.iter()
            .map(move |row| VocabularyWord::Function(letter, row.0))
    };
    let names = KEYWORDS.iter().map(|keyword| keyword.name);
    functions('G', &G_FUNCTIONS)
        .chain(functions('M', &M_FUNCTIONS))
        .chain(
            names
                .chain(expression::function_names())
                .chain(OTHERS)
                .map(VocabularyWord::Name),
        )
}
