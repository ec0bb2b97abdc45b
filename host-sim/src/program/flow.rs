//! What a line says about the flow of the program: labels, jumps, calls, and words the host answers for.
//!
//! In: one [`Line`]. Out: a [`Statement`]. Nothing is evaluated and no file is looked for here.

use pentaspline::config::Dialect;

use super::words::{is_nc, skip_blanks, Line};

/// Longest identifier of an 840D.
const IDENTIFIER_MAX: usize = 31;
/// Largest `P` of a repeated call.
pub const REPEAT_MAX: u32 = 9999;
/// Words of structured programs, which are left to the jumps.
const STRUCTURED: &[&str] = &[
    "ELSE", "ENDIF", "WHILE", "ENDWHILE", "FOR", "ENDFOR", "LOOP", "ENDLOOP", "REPEAT", "REPEATB",
    "UNTIL", "CASE", "GOTOC", "GOTOS",
];

/// A name in a line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Name {
    /// As written.
    pub text: String,
    /// Its first character, from 0.
    pub column: usize,
}

/// What the host does with a line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Action {
    /// Nothing: the core reads it.
    Plain,
    /// Puts a sub-program in its place.
    Call {
        /// Which.
        name: Name,
        /// `P`: how often.
        repeat: u32,
    },
    /// Follows what stands from this column on: `GOTOF`, `GOTOB`, `GOTO` or `IF`.
    Jump(usize),
    /// Returns from a sub-program without a word for the core: `RET`.
    Return,
    /// Says something about the program itself; the core does not see it.
    Declaration,
    /// Cannot do it.
    Refused {
        /// The word.
        name: Name,
        /// What is wrong.
        message: String,
        /// What to do.
        label: &'static str,
    },
}

/// A line as part of the program's flow.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Statement {
    /// `/`: left out while block skip is on.
    pub skippable: bool,
    /// `N`, as far as it fits.
    pub number: Option<u32>,
    /// `NAME:`
    pub label: Option<Name>,
    /// Column where the words behind block number and label begin.
    pub begin: usize,
    /// What to do.
    pub action: Action,
    /// `BEGIN PGM` or `END PGM` of a Heidenhain program.
    pub frame: Option<Frame>,
}

/// First and last line of a Heidenhain program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Frame {
    /// `BEGIN PGM`.
    Begin,
    /// `END PGM`.
    End,
}

impl Statement {
    /// Reads `line` as `dialect` has it.
    #[must_use]
    pub fn new(line: &Line, dialect: Dialect) -> Self {
        let code = line.code.as_slice();
        let mut statement = Self {
            skippable: false,
            number: None,
            label: None,
            begin: 0,
            action: Action::Plain,
            frame: None,
        };
        if line.header {
            return statement;
        }
        let mut at = skip_blanks(code, 0);
        if code.get(at) == Some(&b'/') {
            statement.skippable = true;
            at += 1;
            // A skip level.
            if dialect != Dialect::Heidenhain && code.get(at).is_some_and(u8::is_ascii_digit) {
                at += 1;
            }
            at = skip_blanks(code, at);
        }
        if dialect == Dialect::Heidenhain {
            at = skip_blanks(code, at + digits(code, at));
            statement.conversational(line, at);
            return statement;
        }
        if code.get(at) == Some(&b'N') && code.get(at + 1).is_some_and(u8::is_ascii_digit) {
            let len = digits(code, at + 1);
            statement.number = number(code, at + 1, len);
            at = skip_blanks(code, at + 1 + len);
        }
        let len = identifier(code, at);
        let colon = skip_blanks(code, at + len);
        if len > 0 && code.get(colon) == Some(&b':') {
            statement.label = Some(name(line, at, len));
            at = skip_blanks(code, colon + 1);
        }
        statement.begin = at;
        statement.action = action(line, at);
        statement
    }

    fn conversational(&mut self, line: &Line, at: usize) {
        let code = line.code.as_slice();
        let [first, second, third] = words(code, at);
        let word = |(from, len): (usize, usize)| code.get(from..from + len).unwrap_or_default();
        match (word(first), word(second)) {
            (b"BEGIN", b"PGM") => self.frame = Some(Frame::Begin),
            (b"END", b"PGM") => self.frame = Some(Frame::End),
            (b"CALL", b"PGM") => {
                let (from, mut len) = third;
                if let Some(dot) = word(third).iter().position(|&b| b == b'.') {
                    len = dot;
                }
                self.action = Action::Call {
                    name: name(line, from, len),
                    repeat: 1,
                };
            }
            _ => {}
        }
    }
}

/// What the words from `at` on ask of the host.
fn action(line: &Line, at: usize) -> Action {
    let code = line.code.as_slice();
    let len = identifier(code, at);
    let word = &code[at.min(code.len())..][..len];
    let next = skip_blanks(code, at + len);
    let alone = next == code.len();
    let is = |words: &[&str]| words.iter().any(|w| w.as_bytes() == word);
    if let Some(jump) = jump(code, at) {
        return Action::Jump(jump);
    }
    if word == b"RET" && alone {
        return Action::Return;
    }
    if is(&["PROC", "EXTERN"]) && !alone {
        let named = identifier(code, next);
        if line.wire.get(skip_blanks(&line.wire, next + named)) == Some(&b'(') {
            return Action::Refused {
                name: name(line, next, named),
                message: "a sub-program with parameters".to_owned(),
                label: "values go to sub-programs through R parameters",
            };
        }
        return Action::Declaration;
    }
    if word == b"DEF" && !alone {
        return Action::Refused {
            name: name(line, at, len),
            message: "DEF: variables of the user are not known here".to_owned(),
            label: "use R parameters, R0 to R99",
        };
    }
    if is(STRUCTURED) && !alone {
        let name = name(line, at, len);
        return Action::Refused {
            message: structured_message(&name),
            name,
            label: STRUCTURED_LABEL,
        };
    }
    if len == 0 || len > IDENTIFIER_MAX || word[0].is_ascii_digit() {
        return Action::Plain;
    }
    let letters = word.iter().take(2).filter(|b| !b.is_ascii_digit()).count();
    let by_number = word[0] == b'L' && len > 1 && word[1..].iter().all(u8::is_ascii_digit);
    if !by_number && (letters < 2 || is_nc(word, word[0] != b'L')) {
        return Action::Plain;
    }
    let call = |repeat| Action::Call {
        name: name(line, at, len),
        repeat,
    };
    if alone {
        return call(1);
    }
    if code[next] != b'P' {
        return Action::Plain;
    }
    let mut value = skip_blanks(code, next + 1);
    if code.get(value) == Some(&b'=') {
        value = skip_blanks(code, value + 1);
    }
    let figures = digits(code, value);
    let end = value + figures;
    if figures == 0 || skip_blanks(code, end) != code.len() {
        return Action::Plain;
    }
    match number(code, value, figures) {
        Some(repeat @ 1..=REPEAT_MAX) => call(repeat),
        _ => Action::Refused {
            name: name(line, next, end - next),
            message: "number of repetitions out of range".to_owned(),
            label: "expected P1 to P9999",
        },
    }
}

/// What to write in place of a structured program.
pub const STRUCTURED_LABEL: &str = "use IF with GOTOF or GOTOB";

/// Refusal of a word of structured programming.
#[must_use]
pub fn structured_message(name: &Name) -> String {
    format!("{}: structured programs are not followed", name.text)
}

/// True for a word of structured programming.
#[must_use]
pub fn is_structured(word: &str) -> bool {
    STRUCTURED.iter().any(|w| w.eq_ignore_ascii_case(word))
}

/// Column of the first `IF` or `GOTO..` from `at` on that is a word of its own.
fn jump(code: &[u8], mut at: usize) -> Option<usize> {
    // Few lines have either letter; folded and not searched, so it takes many bytes at a time.
    let rest = code.get(at..).unwrap_or_default();
    if !rest
        .iter()
        .fold(false, |any, &b| any | (b == b'I') | (b == b'O'))
    {
        return None;
    }
    while at < code.len() {
        let len = identifier(code, at);
        if matches!(&code[at..at + len], b"IF" | b"GOTOF" | b"GOTOB" | b"GOTO") {
            return Some(at);
        }
        at += len.max(1);
    }
    None
}

/// Direction of a jump.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// `GOTOF`: towards the end.
    Forward,
    /// `GOTOB`: towards the beginning.
    Backward,
    /// `GOTO`: first forward, then backward.
    Either,
}

/// The jump word at `at` and where it ends.
#[must_use]
pub fn jump_word(code: &[u8], at: usize) -> Option<(Direction, usize)> {
    let len = identifier(code, at);
    let direction = match code.get(at..at + len)? {
        b"GOTOF" => Direction::Forward,
        b"GOTOB" => Direction::Backward,
        b"GOTO" => Direction::Either,
        _ => return None,
    };
    Some((direction, at + len))
}

/// Where a jump leads.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Target {
    /// `NAME:`, upper case.
    Label(String),
    /// `N100`.
    Number(u32),
}

/// The target at `at` of `line`, with its place.
#[must_use]
pub fn target(line: &Line, at: usize) -> Option<(Target, Name)> {
    let len = identifier(&line.code, at);
    if len == 0 {
        return None;
    }
    let name = name(line, at, len);
    let upper = name.text.to_uppercase();
    let block = upper
        .strip_prefix('N')
        .filter(|rest| !rest.is_empty() && rest.bytes().all(|b| b.is_ascii_digit()))
        .map(str::parse);
    match block {
        Some(Ok(number)) => Some((Target::Number(number), name)),
        Some(Err(_)) => None,
        None => Some((Target::Label(upper), name)),
    }
}

/// Length of the identifier at `at`: letters, digits and `_`.
#[must_use]
pub fn identifier(code: &[u8], at: usize) -> usize {
    let rest = code.get(at..).unwrap_or_default();
    rest.iter()
        .take_while(|b| b.is_ascii_alphanumeric() || **b == b'_')
        .count()
}

fn digits(code: &[u8], at: usize) -> usize {
    let rest = code.get(at..).unwrap_or_default();
    rest.iter().take_while(|b| b.is_ascii_digit()).count()
}

fn number(code: &[u8], at: usize, len: usize) -> Option<u32> {
    let figures = code.get(at..at + len)?;
    std::str::from_utf8(figures).ok()?.parse().ok()
}

fn name(line: &Line, at: usize, len: usize) -> Name {
    let bytes = line.wire.get(at..at + len).unwrap_or_default();
    Name {
        text: String::from_utf8_lossy(bytes).into_owned(),
        column: at,
    }
}

/// Begin and length of the first three words from `at` on, parted by blanks.
fn words(code: &[u8], mut at: usize) -> [(usize, usize); 3] {
    std::array::from_fn(|_| {
        at = skip_blanks(code, at);
        let rest = code.get(at..).unwrap_or_default();
        let len = rest.iter().take_while(|b| !b.is_ascii_whitespace()).count();
        let word = (at, len);
        at += len;
        word
    })
}
