//! What can be wrong with a line: kinds, stable code numbers, texts.
//!
//! Goes out to the protocol (`error:N`) and, through the host, to a person. Building an error copies
//! at most [`EXCERPT`] bytes of the offending text and formats nothing; formatting is `Display`'s.

use core::fmt;

/// Bytes of source text an error (or a tool name) can hold.
pub const EXCERPT: usize = 32;

/// Owned copy of a short piece of a line, so that an error outlives the receive buffer.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Excerpt {
    bytes: [u8; EXCERPT],
    length: u8,
    cut: bool,
}

impl Excerpt {
    /// Copies `text`, cutting it after [`EXCERPT`] bytes.
    #[must_use]
    pub fn new(text: &[u8]) -> Self {
        let mut bytes = [0; EXCERPT];
        let mut length = 0;
        for (to, from) in bytes.iter_mut().zip(text) {
            *to = *from;
            length += 1;
        }
        Self {
            bytes,
            length,
            cut: text.len() > EXCERPT,
        }
    }

    /// The bytes copied.
    #[must_use]
    pub fn as_bytes(&self) -> &[u8] {
        self.bytes.get(..usize::from(self.length)).unwrap_or(&[])
    }
}

impl fmt::Display for Excerpt {
    /// The text, `..` behind it if it was cut, `\x9C` for what cannot be shown.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{}{}",
            self.as_bytes().escape_ascii(),
            if self.cut { ".." } else { "" }
        )
    }
}

impl fmt::Debug for Excerpt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "\"{self}\"")
    }
}

/// Why a line was refused. Numbers and texts stand in [`ERRORS`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum NcErrorKind {
    /// More than [`super::LINE_MAX`] bytes.
    LineTooLong,
    /// A byte that begins no word.
    UnexpectedByte(u8),
    /// `(` without `)` on the same line.
    UnclosedComment,
    /// `"` without `"` on the same line.
    UnclosedString,
    /// Neither an address nor a keyword of the language.
    UnknownWord(Excerpt),
    /// An address or keyword without its number.
    MissingNumber(Excerpt),
    /// Signs and points without digits.
    MalformedNumber(Excerpt),
    /// More than 19 significant digits.
    TooManyDigits(Excerpt),
    /// The value is outside what the word accepts.
    OutOfRange(Excerpt),
    /// The word takes whole numbers only.
    NotWhole(Excerpt),
    /// An address other than G, M, K stands twice in the line.
    RepeatedWord(Excerpt),
    /// A second function of the same group in one line.
    SameGroup(Excerpt),
    /// `N` behind another word.
    BlockNumberNotFirst,
    /// A G function that the language does not have.
    GNotAvailable(Excerpt),
    /// An M function that the language does not have.
    MNotAvailable(Excerpt),
    /// `G41` or `G42`.
    CompensationNotAvailable,
    /// An axis address this machine does not have.
    AxisNotConfigured(Excerpt),
    /// A word of the language at a place where it means nothing.
    UnexpectedWord(Excerpt),
    /// Motion at feed, and no `F` yet.
    MissingFeed,
    /// `F0` or less.
    FeedNotPositive,
    /// `G4` without time.
    MissingDwellTime,
    /// `G4` together with coordinates.
    DwellNotAlone,
    /// The weight of a B-spline point differs from the weight of the first point.
    UnequalWeights,
    /// `SD` changes the degree of a B-spline that has begun.
    DegreeChange,
    /// A `G6` block without `I`.
    MissingLength,
    /// `G6` under `G91` or `G70`.
    CubicDimension,
    /// Another word, or the end of the program, where a `G6` block still needs K lines.
    MissingCoefficients,
    /// A number of `K` words that is no multiple of three.
    CoefficientTriple,
    /// `T=""` or a name longer than [`EXCERPT`] bytes.
    ToolName,
}

/// The one table of errors: stable code, text. `{}` stands for the offending text.
///
/// Codes begin well above those of GRBL and its descendants, so that no client shows a GRBL explanation for them.
pub static ERRORS: [(u16, &str); 29] = [
    (101, "line is longer than 96 bytes"),
    (102, "unexpected character '{}'"),
    (103, "comment is not closed"),
    (104, "string is not closed"),
    (105, "unknown word '{}'"),
    (106, "number expected after '{}'"),
    (107, "malformed number '{}'"),
    (108, "number '{}' has more than 19 digits"),
    (109, "value of '{}' is out of range"),
    (110, "'{}' must be a whole number"),
    (111, "word '{}' is repeated"),
    (112, "'{}' excludes an earlier word of this line"),
    (113, "block number is not at the start of the line"),
    (114, "G function '{}' is not available"),
    (115, "M function '{}' is not available"),
    (116, "tool radius compensation not available"),
    (117, "axis '{}' is not configured"),
    (118, "word '{}' has no meaning here"),
    (119, "no feed: F missing"),
    (120, "feed must be greater than 0"),
    (121, "no time: G4 needs F or P in seconds"),
    (122, "coordinates in a line with G4"),
    (123, "weights of a B-spline must be equal"),
    (124, "degree cannot change within a B-spline"),
    (125, "G6 block without I"),
    (126, "G6 needs G90 and G71"),
    (127, "K line of a G6 block expected"),
    (128, "K words come in threes: K3 K2 K1 of one axis"),
    (129, "tool name must have 1 to 32 characters"),
];

impl NcErrorKind {
    /// Row of [`ERRORS`].
    fn row(&self) -> usize {
        match self {
            Self::LineTooLong => 0,
            Self::UnexpectedByte(_) => 1,
            Self::UnclosedComment => 2,
            Self::UnclosedString => 3,
            Self::UnknownWord(_) => 4,
            Self::MissingNumber(_) => 5,
            Self::MalformedNumber(_) => 6,
            Self::TooManyDigits(_) => 7,
            Self::OutOfRange(_) => 8,
            Self::NotWhole(_) => 9,
            Self::RepeatedWord(_) => 10,
            Self::SameGroup(_) => 11,
            Self::BlockNumberNotFirst => 12,
            Self::GNotAvailable(_) => 13,
            Self::MNotAvailable(_) => 14,
            Self::CompensationNotAvailable => 15,
            Self::AxisNotConfigured(_) => 16,
            Self::UnexpectedWord(_) => 17,
            Self::MissingFeed => 18,
            Self::FeedNotPositive => 19,
            Self::MissingDwellTime => 20,
            Self::DwellNotAlone => 21,
            Self::UnequalWeights => 22,
            Self::DegreeChange => 23,
            Self::MissingLength => 24,
            Self::CubicDimension => 25,
            Self::MissingCoefficients => 26,
            Self::CoefficientTriple => 27,
            Self::ToolName => 28,
        }
    }

    /// Stable number of the error, for `error:N`.
    #[must_use]
    pub fn code(&self) -> u16 {
        ERRORS[self.row()].0
    }

    fn excerpt(&self) -> Option<Excerpt> {
        match self {
            Self::UnexpectedByte(byte) => Some(Excerpt::new(&[*byte])),
            Self::UnknownWord(text)
            | Self::MissingNumber(text)
            | Self::MalformedNumber(text)
            | Self::TooManyDigits(text)
            | Self::OutOfRange(text)
            | Self::NotWhole(text)
            | Self::RepeatedWord(text)
            | Self::SameGroup(text)
            | Self::GNotAvailable(text)
            | Self::MNotAvailable(text)
            | Self::AxisNotConfigured(text)
            | Self::UnexpectedWord(text) => Some(*text),
            _ => None,
        }
    }
}

impl fmt::Display for NcErrorKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = ERRORS[self.row()].1;
        match (text.split_once("{}"), self.excerpt()) {
            (Some((before, after)), Some(excerpt)) => write!(f, "{before}{excerpt}{after}"),
            _ => f.write_str(text),
        }
    }
}

impl core::error::Error for NcErrorKind {}

/// A refused line: where and why. `Display` prints `line:column code text`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NcError {
    /// Physical line, 1-based, counted since the program began.
    pub line: u32,
    /// Byte within the line, 1-based.
    pub column: u16,
    /// What is wrong.
    pub kind: NcErrorKind,
}

impl fmt::Display for NcError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{}:{} {} {}",
            self.line,
            self.column,
            self.kind.code(),
            self.kind
        )
    }
}

impl core::error::Error for NcError {}

/// An error while the text is at hand. Eight bytes, because every step of the good path returns the
/// possibility of one; [`Fault::kind`] makes the real thing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fault {
    at: u8,
    length: u8,
    make: fn(Excerpt) -> NcErrorKind,
}

impl Fault {
    /// Error about the `length` bytes at byte index `at` (a line has at most 96).
    #[cold]
    pub fn new(at: usize, length: usize, make: fn(Excerpt) -> NcErrorKind) -> Self {
        let limited = |value: usize| u8::try_from(value).unwrap_or(u8::MAX);
        Self {
            at: limited(at),
            length: limited(length),
            make,
        }
    }

    /// 1-based byte of the line.
    #[cold]
    pub fn column(&self) -> u16 {
        u16::from(self.at) + 1
    }

    /// The error, with its text taken out of the line.
    #[cold]
    pub fn kind(&self, line: &[u8]) -> NcErrorKind {
        let text = line.get(usize::from(self.at)..).unwrap_or(&[]);
        (self.make)(Excerpt::new(
            text.get(..usize::from(self.length)).unwrap_or(text),
        ))
    }
}
