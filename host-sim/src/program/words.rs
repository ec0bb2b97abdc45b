//! Just enough NC lexing for the host: which bytes of a line are code, and can it go over the wire?
//!
//! Everything but the flow of the program is left to the core, which alone knows the language and its errors.

use pentaspline::config::Dialect;

/// Words of the NC language made of letters. A line that holds one is never a sub-program call; whether the
/// core of this version understands the word is the core's to say. (840D programming manuals, lists of
/// statements.)
const KEYWORDS: &[&str] = &[
    "ACN",
    "ACP",
    "AC",
    "ADISPOS",
    "ADIS",
    "AKIMA",
    "ASPLINE",
    "ATRANS",
    "AROT",
    "ASCALE",
    "AMIRROR",
    "BAUTO",
    "BNAT",
    "BRISK",
    "BRISKA",
    "BSPLINE",
    "BTAN",
    "CFC",
    "CFIN",
    "CFTCP",
    "COMPCAD",
    "COMPCURV",
    "COMPOF",
    "COMPON",
    "CSPLINE",
    "CUT2D",
    "CUT3DC",
    "DC",
    "DISABLE",
    "DRIVE",
    "EAUTO",
    "ENABLE",
    "ENAT",
    "ETAN",
    "FFWOF",
    "FFWON",
    "FGROUP",
    "FGREF",
    "FIFOCTRL",
    "FNORM",
    "FLIN",
    "FCUB",
    "FPO",
    "IC",
    "KONT",
    "KONTC",
    "KONTT",
    "LIMS",
    "LOOKAHEAD",
    "MIRROR",
    "MSG",
    "NORM",
    "OFFN",
    "ORIAXES",
    "ORICURVE",
    "ORIEULER",
    "ORIMKS",
    "ORIPATH",
    "ORIRPY",
    "ORIVECT",
    "ORIWKS",
    "ORICONCW",
    "PL",
    "PO",
    "POLY",
    "PW",
    "REPOS",
    "RET",
    "RND",
    "RNDM",
    "ROT",
    "SCALE",
    "SD",
    "SOFT",
    "SOFTA",
    "SPCOF",
    "SPCON",
    "SPL",
    "STARTFIFO",
    "STOPFIFO",
    "STOPRE",
    "SUPA",
    "TRAFOOF",
    "TRANS",
    "TRAORI",
    "TURN",
    "UPATH",
    "SPATH",
    "WALIMOF",
    "WALIMON",
    "XH",
    "YH",
    "ZH",
];

/// Words behind which a parenthesis holds arguments or the rest of an expression, not a comment.
const FUNCTIONS: &[&str] = &[
    "AC",
    "IC",
    "DC",
    "ACP",
    "ACN",
    "MSG",
    "SPLINEPATH",
    "SIN",
    "COS",
    "TAN",
    "ASIN",
    "ACOS",
    "ATAN",
    "ATAN2",
    "SQRT",
    "ABS",
    "POT",
    "ROUND",
    "TRUNC",
    "LN",
    "EXP",
    "DIV",
    "MOD",
    "IF",
    "AND",
    "OR",
    "XOR",
    "NOT",
];

/// One line of a program file, read as far as the host needs it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Line {
    /// The line as it is sent: one ASCII byte per character; what may not be sent is `_` (comments and messages only).
    pub wire: Vec<u8>,
    /// The same columns in upper case, comments blank and strings a row of `"`.
    pub code: Vec<u8>,
    /// First character (from 0) that cannot be sent.
    pub unsendable: Option<usize>,
    /// `M2` or `M30` stands in the line.
    pub ends_program: bool,
    /// `M17` stands in the line.
    pub returns: bool,
    /// A `%` line: names the program.
    pub header: bool,
    /// Column, from 0, of an `M0` or `M1`.
    pub stop: Option<usize>,
    /// Byte range of the `M2`/`M30`.
    end_word: (usize, usize),
}

/// What the characters of a line are in.
#[derive(Clone, Copy, PartialEq)]
enum Inside {
    Code,
    /// Up to the end of the line.
    Remark,
    /// Up to the next `)`.
    Parentheses,
    String,
}

impl Line {
    /// Looks at `text`, one line without its line end, as `dialect` has it.
    #[must_use]
    pub fn new(text: &str, dialect: Dialect) -> Self {
        let mut line = Self {
            header: text.trim_start().starts_with('%'),
            ..Self::default()
        };
        let mut inside = if line.header {
            Inside::Remark
        } else {
            Inside::Code
        };
        if !line.header && is_plain(text) {
            line.wire = text.into();
            line.code = text.to_ascii_uppercase().into();
            line.take_m_words();
            return line;
        }
        // Parentheses of expressions that are open, and the string is one that is only shown.
        let (mut open, mut shown) = (0_usize, false);
        for (column, c) in text.chars().enumerate() {
            let byte = u8::try_from(c).unwrap_or(0xff);
            let before = inside;
            match (inside, c) {
                (Inside::Code, ';') => inside = Inside::Remark,
                (Inside::Code, '(') if dialect != Dialect::Heidenhain => {
                    if open > 0 || opens_expression(&line.code) {
                        open += 1;
                    } else {
                        inside = Inside::Parentheses;
                    }
                }
                (Inside::Code, ')') => open = open.saturating_sub(1),
                (Inside::Code, '"') => {
                    inside = Inside::String;
                    shown = line.code.trim_ascii_end().ends_with(b"MSG(");
                }
                (Inside::String, '"') => inside = Inside::Code,
                (Inside::Parentheses, ')') => inside = Inside::Code,
                _ => {}
            }
            let text_only = |inside| matches!(inside, Inside::Remark | Inside::Parentheses);
            if sendable(byte) {
                line.wire.push(byte);
            } else {
                line.wire.push(b'_');
                let harmless = text_only(inside) || (inside == Inside::String && shown);
                if !harmless && line.unsendable.is_none() {
                    line.unsendable = Some(column);
                }
            }
            line.code.push(if text_only(inside) || text_only(before) {
                b' '
            } else if inside == Inside::String || before == Inside::String {
                // A string is a word of its own: it must not look like an empty line.
                b'"'
            } else {
                byte.to_ascii_uppercase()
            });
        }
        line.take_m_words();
        line
    }

    fn take_m_words(&mut self) {
        for (at, number, end) in m_words(&self.code) {
            match number {
                0 | 1 => self.stop = self.stop.or(Some(at)),
                17 => self.returns = true,
                2 | 30 => {
                    self.ends_program = true;
                    self.end_word = (at, end);
                }
                _ => {}
            }
        }
    }

    /// Turns the `M2` or `M30` of the line into `M17`, as an 840D reads them in a sub-program; a Heidenhain control
    /// has no word for it.
    pub fn end_is_return(&mut self, dialect: Dialect) {
        let (from, to) = self.end_word;
        let word: &[u8] = match dialect {
            Dialect::Sinumerik | Dialect::Fanuc => b"M17",
            Dialect::Heidenhain => b"",
        };
        if from < to {
            self.wire.splice(from..to, word.iter().copied());
        }
    }
}

/// True if a parenthesis behind `code` belongs to an expression or a list of arguments.
fn opens_expression(code: &[u8]) -> bool {
    let trimmed = code.trim_ascii_end();
    let named = |b: &&u8| b.is_ascii_alphanumeric() || **b == b'_';
    let len = trimmed.iter().rev().take_while(named).count();
    let (before, word) = trimmed.split_at(trimmed.len() - len);
    let function = |word: &[u8]| FUNCTIONS.iter().any(|f| f.as_bytes() == word);
    if len > 0 {
        // Straight behind it, the word may be glued to what stands before: `XAC(`, `R1DIV(`.
        let glued = trimmed.len() == code.len();
        return function(word) || (glued && (1..len).any(|from| function(&word[from..])));
    }
    match before.last() {
        // At the beginning of a line it marks a block that can be skipped.
        Some(b'/') => before.contains(&b'='),
        Some(last) => b"=+-*,<>[".contains(last),
        None => false,
    }
}

/// Column, from 0, of an `M0` or `M1` in `text`.
#[must_use]
pub fn program_stop(text: &str) -> Option<usize> {
    Line::new(text, Dialect::Sinumerik).stop
}

/// Length in characters of the word of `text` that starts at character `column`; at least 1.
#[must_use]
pub fn word_len(text: &str, column: usize) -> usize {
    let mut rest = text.chars().skip(column);
    let Some(first) = rest.next() else { return 1 };
    let part = |c: char| c.is_alphanumeric() || matches!(c, '.' | '_');
    let mut len = 1;
    if part(first) || matches!(first, '-' | '+') {
        // An address and its number are one word; the next letter behind a digit starts another.
        let mut digits = first.is_ascii_digit();
        for c in rest {
            let sign = len == 1 && matches!(c, '-' | '+');
            if !(part(c) || sign) || (digits && c.is_ascii_alphabetic()) {
                break;
            }
            digits |= c.is_ascii_digit();
            len += 1;
        }
    }
    len
}

/// Bytes that mean nothing but text to a controller. `?`, `!`, `~`, control characters and everything from
/// 0x80 up are real-time requests or dropped.
fn sendable(byte: u8) -> bool {
    byte == b'\t' || (matches!(byte, b' '..=b'}') && !matches!(byte, b'?' | b'!'))
}

/// All of it is code that can be sent, as most lines are. Folded and not searched: so it takes many bytes at a time.
fn is_plain(text: &str) -> bool {
    let plain = |byte| sendable(byte) & !matches!(byte, b';' | b'(' | b')' | b'"');
    text.bytes().fold(true, |all, byte| all & plain(byte))
}

pub(super) fn skip_blanks(code: &[u8], from: usize) -> usize {
    let blank = code
        .iter()
        .skip(from)
        .take_while(|b| b.is_ascii_whitespace())
        .count();
    from + blank
}

/// `M` words of a line: start, number, end.
fn m_words(code: &[u8]) -> impl Iterator<Item = (usize, u32, usize)> + '_ {
    let mut at = 0;
    std::iter::from_fn(move || {
        while let Some(ahead) = code.get(at..)?.iter().position(|&b| b == b'M') {
            let start = at + ahead;
            at = start + 1;
            if start > 0 && (code[start - 1].is_ascii_alphabetic() || code[start - 1] == b'_') {
                continue;
            }
            let mut number: Option<u32> = None;
            while let Some(digit) = code.get(at).filter(|b| b.is_ascii_digit()) {
                number = Some(
                    number
                        .unwrap_or(0)
                        .saturating_mul(10)
                        .saturating_add(u32::from(digit - b'0')),
                );
                at += 1;
            }
            let more = code.get(at).is_some_and(|&b| b == b'_' || b == b'=');
            if let (Some(number), false) = (number, more) {
                return Some((start, number, at));
            }
        }
        None
    })
}

/// True if `word` (upper case) is a chain of keywords and addresses with numbers, glued as some senders do.
pub(super) fn is_nc(word: &[u8], addresses: bool) -> bool {
    let mut reach = vec![false; word.len() + 1];
    reach[0] = true;
    for at in 0..word.len() {
        if !reach[at] {
            continue;
        }
        for keyword in KEYWORDS {
            if word[at..].starts_with(keyword.as_bytes()) {
                reach[at + keyword.len()] = true;
            }
        }
        if addresses && word[at].is_ascii_alphabetic() {
            let digits = word[at + 1..]
                .iter()
                .take_while(|b| b.is_ascii_digit())
                .count();
            if digits > 0 {
                reach[at + 1 + digits] = true;
            }
        }
    }
    reach[word.len()]
}
