//! Just enough NC lexing for the host: is this line a sub-program call, and can it go over the wire?
//!
//! Everything that is not a call is left to the core, which alone knows the language and its errors.

/// Words of the NC language made of letters. A line that holds one is never a sub-program call; whether the
/// core of this version understands the word is the core's to say. (840D programming manuals, lists of
/// statements.)
const KEYWORDS: &[&str] = &[
    "ACN",
    "ACP",
    "AC",
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

/// Longest identifier of an 840D.
const IDENTIFIER_MAX: usize = 31;

/// A candidate for a sub-program call.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Call {
    /// The identifier as written.
    pub text: String,
    /// Its first character, from 0.
    pub column: usize,
    /// It could also be glued NC words (`L150`): a call only if the file exists.
    pub may_be_nc: bool,
}

/// What the host knows of one line.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Line {
    /// The line as it is sent: one ASCII byte per character; what may not be sent is `_` (comments only).
    pub wire: Vec<u8>,
    /// First character (from 0) that cannot be sent.
    pub unsendable: Option<usize>,
    /// Sub-program call.
    pub call: Option<Call>,
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

impl Line {
    /// Looks at `text`, one line without its line end.
    #[must_use]
    pub fn new(text: &str) -> Self {
        let mut line = Self::default();
        // Code with comments and strings blanked, same columns.
        let mut code = Vec::with_capacity(text.len());
        let header = text.trim_start().starts_with('%');
        let (mut comment, mut string, mut after_equals) = (header, false, false);
        let mut closes = header;
        for (column, c) in text.chars().enumerate() {
            if !comment && !string {
                match c {
                    ';' => (comment, closes) = (true, false),
                    // `PO[X]=(..)` is not a comment.
                    '(' if !after_equals => (comment, closes) = (true, true),
                    _ => {}
                }
            }
            let byte = u8::try_from(c).unwrap_or(0xff);
            if sendable(byte) {
                line.wire.push(byte);
            } else {
                line.wire.push(b'_');
                if !comment && line.unsendable.is_none() {
                    line.unsendable = Some(column);
                }
            }
            let hidden = comment || string || c == '"';
            code.push(if hidden {
                b' '
            } else {
                byte.to_ascii_uppercase()
            });
            if c == ')' && closes && !header {
                comment = false;
            }
            if c == '"' && !comment {
                string = !string;
                // A string is a word of its own: it must not look like an empty line.
                if let Some(last) = code.last_mut() {
                    *last = b'"';
                }
            }
            if !c.is_whitespace() && !comment {
                after_equals = c == '=';
            }
        }
        line.header = header;
        line.classify(&code, text);
        line
    }

    fn classify(&mut self, code: &[u8], text: &str) {
        for (at, number, end) in m_words(code) {
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
        let mut start = skip_blanks(code, 0);
        // A block number, possibly hidden by `/`.
        if code.get(start) == Some(&b'/') {
            start = skip_blanks(code, start + 1);
        }
        if code.get(start) == Some(&b'N') && code.get(start + 1).is_some_and(u8::is_ascii_digit) {
            start += 1;
            while code.get(start).is_some_and(u8::is_ascii_digit) {
                start += 1;
            }
            start = skip_blanks(code, start);
        }
        let rest = &code[start..];
        let len = rest
            .iter()
            .position(|&b| !(b.is_ascii_alphanumeric() || b == b'_'))
            .unwrap_or(rest.len());
        let word = &rest[..len];
        let alone = rest[len..].iter().all(u8::is_ascii_whitespace);
        if !alone || word.is_empty() || word.len() > IDENTIFIER_MAX || word[0].is_ascii_digit() {
            return;
        }
        let letters = word.iter().take(2).filter(|b| !b.is_ascii_digit()).count();
        if letters < 2 && word[0] != b'L' || is_nc(word, word[0] != b'L') {
            return;
        }
        self.call = Some(Call {
            text: text.chars().skip(start).take(len).collect(),
            column: start,
            may_be_nc: letters < 2,
        });
    }

    /// The line with its `M2` or `M30` turned into `M17`, as an 840D reads them in a sub-program.
    #[must_use]
    pub fn wire_as_return(self) -> Vec<u8> {
        let mut wire = self.wire;
        wire.splice(self.end_word.0..self.end_word.1, *b"M17");
        wire
    }
}

/// Column, from 0, of an `M0` or `M1` in `text`.
#[must_use]
pub fn program_stop(text: &str) -> Option<usize> {
    Line::new(text).stop
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

fn skip_blanks(code: &[u8], from: usize) -> usize {
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
        while at < code.len() {
            let start = at;
            at += 1;
            let inside =
                start > 0 && (code[start - 1].is_ascii_alphabetic() || code[start - 1] == b'_');
            if code[start] != b'M' || inside {
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
fn is_nc(word: &[u8], addresses: bool) -> bool {
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
