//! Errors of the NC language (`nc`).

use super::messages;

messages! {
    LINE_TOO_LONG = 101, "line is longer than 96 bytes",
        "",
        "";
    UNEXPECTED_BYTE = 102, "unexpected character '{}'",
        "",
        "";
    UNCLOSED_COMMENT = 103, "comment is not closed",
        "",
        "";
    UNCLOSED_STRING = 104, "string is not closed",
        "",
        "";
    UNKNOWN_WORD = 105, "unknown word '{}'",
        "",
        "";
    MISSING_NUMBER = 106, "number expected after '{}'",
        "",
        "";
    MALFORMED_NUMBER = 107, "malformed number '{}'",
        "",
        "";
    TOO_MANY_DIGITS = 108, "number '{}' has more than 19 digits",
        "",
        "";
    OUT_OF_RANGE = 109, "value of '{}' is out of range",
        "",
        "";
    NOT_WHOLE = 110, "'{}' must be a whole number",
        "",
        "";
    REPEATED_WORD = 111, "word '{}' is repeated",
        "",
        "";
    SAME_GROUP = 112, "'{}' excludes an earlier word of this line",
        "",
        "";
    BLOCK_NUMBER_NOT_FIRST = 113, "block number is not at the start of the line",
        "",
        "";
    G_NOT_AVAILABLE = 114, "G function '{}' is not available",
        "",
        "";
    M_NOT_AVAILABLE = 115, "M function '{}' is not available",
        "",
        "";
    COMPENSATION_NOT_AVAILABLE = 116, "tool radius compensation not available",
        "",
        "";
    AXIS_NOT_CONFIGURED = 117, "axis '{}' is not configured",
        "",
        "";
    UNEXPECTED_WORD = 118, "word '{}' has no meaning here",
        "",
        "";
    MISSING_FEED = 119, "no feed: F missing",
        "",
        "";
    FEED_NOT_POSITIVE = 120, "feed must be greater than 0",
        "",
        "";
    MISSING_DWELL_TIME = 121, "no time: G4 needs F or P in seconds",
        "",
        "";
    DWELL_NOT_ALONE = 122, "coordinates in a line with G4",
        "",
        "";
    UNEQUAL_WEIGHTS = 123, "weights of a B-spline must be equal",
        "",
        "";
    DEGREE_CHANGE = 124, "degree cannot change within a B-spline",
        "",
        "";
    MISSING_LENGTH = 125, "G6 block without I",
        "",
        "";
    CUBIC_DIMENSION = 126, "G6 needs G90 and G71",
        "",
        "";
    MISSING_COEFFICIENTS = 127, "K line of a G6 block expected",
        "",
        "";
    COEFFICIENT_TRIPLE = 128, "K words come in threes: K3 K2 K1 of one axis",
        "",
        "";
    TOOL_NAME = 129, "tool name must have 1 to 32 characters",
        "",
        "";
}
