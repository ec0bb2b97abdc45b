//! Errors of the NC language (`nc`). The numbers 116 and 123 belonged to refusals that are gone; they stay free.

use super::messages;

messages! {
    LINE_TOO_LONG = 101, "line is longer than 96 bytes",
        "The machine keeps one line in a buffer of 96 bytes.",
        "Shorten the line: move words that can stand alone to a line before it, or drop the comment.";
    UNEXPECTED_BYTE = 102, "unexpected character '{}'",
        "No word begins with this character, or it stands inside a word where it cannot.",
        "Remove it. Decimals have a point, comments a semicolon or parentheses.";
    UNCLOSED_COMMENT = 103, "comment is not closed",
        "A comment that begins with ( must end with ) in the same line.",
        "Close it, or begin it with a semicolon.";
    UNCLOSED_STRING = 104, "string is not closed",
        "A text that begins with a quotation mark must end with one in the same line.",
        "Close it.";
    UNKNOWN_WORD = 105, "unknown word '{}'",
        "The word is neither an address letter with a number nor a keyword of the dialect in force.",
        "Check the spelling and the dialect. The names of sub-programs are followed by the host only.";
    MISSING_NUMBER = 106, "number expected after '{}'",
        "The word means something only with a number.",
        "Write the number behind it, with or without an equals sign.";
    MALFORMED_NUMBER = 107, "malformed number '{}'",
        "Signs and points without digits are no number.",
        "Write digits, at most one sign before them and at most one point.";
    TOO_MANY_DIGITS = 108, "number '{}' has more than 19 digits",
        "Numbers are read exactly, and 19 digits are what fits.",
        "Round the number.";
    OUT_OF_RANGE = 109, "value of '{}' is out of range",
        "The value lies outside what this word accepts.",
        "Look up the range of the word in the language reference.";
    NOT_WHOLE = 110, "'{}' must be a whole number",
        "The word counts or names something.",
        "Write it without decimals.";
    REPEATED_WORD = 111, "word '{}' is repeated",
        "Each address but G and M stands in a line once, or it would be unclear which one counts.",
        "Remove one of them, or use two lines.";
    SAME_GROUP = 112, "'{}' excludes an earlier word of this line",
        "Functions of one group replace each other, so one line can have only one of them.",
        "Remove one of them, or use two lines.";
    BLOCK_NUMBER_NOT_FIRST = 113, "block number is not at the start of the line",
        "A block number behind other words is most often two lines that lost the line end between them.",
        "Put N first, or break the line before it.";
    G_NOT_AVAILABLE = 114, "G function '{}' is not available",
        "The dialect in force does not have this G function.",
        "Check the number and the dialect.";
    M_NOT_AVAILABLE = 115, "M function '{}' is not available",
        "The machine does not have this M function.",
        "Remove it, or use one of M0 to M9, M17, M30, M40 to M45.";
    AXIS_NOT_CONFIGURED = 117, "axis '{}' is not configured",
        "The machine file names the letters of the five axes, and this is none of them.",
        "Use the machine the program was written for, or rename the axis.";
    UNEXPECTED_WORD = 118, "word '{}' has no meaning here",
        "The word belongs to another kind of block than the one in force.",
        "Remove it, or select the interpolation it belongs to.";
    MISSING_FEED = 119, "no feed: F missing",
        "The block moves at feed, and no F has been programmed since the program began or the feed type changed.",
        "Write F in this block or before it.";
    FEED_NOT_POSITIVE = 120, "feed must be greater than 0",
        "With a feed of nothing the block would never end.",
        "Write a positive F.";
    MISSING_DWELL_TIME = 121, "no time: G4 needs F or P in seconds, or S in revolutions",
        "A dwell without its length has no meaning.",
        "Write one of the three behind G4.";
    DWELL_NOT_ALONE = 122, "coordinates in a line with G4",
        "G4 rests, so its line cannot move.",
        "Use two lines.";
    DEGREE_CHANGE = 124, "degree cannot change within a B-spline",
        "All points of a B-spline share one degree.",
        "Write SD with BSPLINE or at its first point.";
    MISSING_LENGTH = 125, "G6 block without I",
        "I is the length of the curve parameter, without which the coefficients mean nothing.",
        "Write I behind the coordinates.";
    CUBIC_DIMENSION = 126, "G6 needs G90 and G71",
        "The coefficients of G6 count in thousandths of a millimetre along an absolute path.",
        "Select G90 and G71 before it.";
    MISSING_COEFFICIENTS = 127, "K line of a G6 block expected",
        "A G6 block has three K words for each of its axes, and not all of them have come.",
        "Let the K lines follow the coordinates at once.";
    COEFFICIENT_TRIPLE = 128, "K words come in threes: K3 K2 K1 of one axis",
        "A line with one or two coefficients of an axis is most often a line with one missing.",
        "Write all three.";
    TOOL_NAME = 129, "tool name must have 1 to 32 characters",
        "The name has to fit the tool table.",
        "Shorten the name.";
    MISSING_CENTRE = 130, "G2 and G3 need I, J or K of the plane, or CR",
        "End points alone do not make a circle.",
        "Write the centre relative to the start, or the radius.";
    CENTRE_AND_RADIUS = 131, "'{}' and CR exclude each other",
        "Centre and radius both fix the circle, and they might contradict each other.",
        "Remove one of them.";
    CENTRE_OUTSIDE_PLANE = 132, "'{}' is not an axis of the working plane",
        "The centre has two coordinates: I and J under G17, K and I under G18, J and K under G19.",
        "Select the plane before the circle, or correct the letter.";
    FULL_CIRCLE_RADIUS = 133, "a full circle needs I, J or K instead of CR",
        "Every circle of this radius through the point would do.",
        "Write the centre relative to the start.";
    NO_TOOL = 134, "G41 and G42 need a tool: T and M6 missing",
        "The offset is the radius of the tool in the spindle, and there is none.",
        "Select a tool with T and change it in with M6.";
    UNKNOWN_TOOL = 135, "tool '{}' is not in the tool table",
        "M6 changes to a tool whose radius and length nobody has stated.",
        "Add it to the machine file or with G10 L1, or correct T.";
    SIDE_CHANGE = 136, "compensation begins, ends or changes sides on a straight line only",
        "The tool moves away from the contour or to it within one block, which has to be G0 or G1.",
        "Put a G0 or G1 block between G40, G41 or G42 and the curve.";
    COMPENSATION_ON = 137, "'{}' is not possible under G41 and G42",
        "It changes the tool, the plane or the road that the offset is computed from.",
        "Write G40 and a straight line before it.";
    MISSING_INVERSE_FEED = 138, "G93 needs F in every block that moves",
        "Under G93 the feed is the reciprocal of the time of one block.",
        "Write F in this block, or select G94.";
    MISSING_SPEED = 139, "no spindle speed: S missing",
        "Revolutions become time only with a speed.",
        "Write S before it.";
    SPINDLE_FEEDBACK = 140, "'{}' needs a spindle that reports its angle",
        "Threads and constant cutting speed follow the true spindle, and this machine does not see it.",
        "Use G1 with G94 or G95.";
    HOST_ONLY = 141, "'{}' is followed by the host only",
        "The machine keeps no program, so it cannot go back or choose.",
        "Run or send the whole file with the host; it follows jumps and conditions.";
    LABEL_NOT_FOUND = 142, "label '{}' not found",
        "The program ended before the label that GOTOF looks for.",
        "Correct the name, or put the label behind the jump.";
    MISSING_END_POINT = 143, "coordinates of the POLY block expected",
        "The coefficients before this line wait for the end point they lead to.",
        "Let the line with coordinates follow the coefficients at once.";
    NO_HEAD = 144, "XH YH ZH need rotary axes that turn the tool",
        "The machine file does not say how the rotary axes turn the tool.",
        "State the head in the machine file, or program the rotary axes themselves.";
    TOOL_POINT = 145, "XH YH ZH come together, at all points of the spline or at none",
        "The second curve has as many points as the first.",
        "Write all three at each point.";
    TOOL_TABLE_FULL = 146, "the tool table is full",
        "It has 16 rows.",
        "Use the number of a tool that is not needed.";
    MISSING_WORDS = 147, "'{}' lacks words it needs",
        "G10 L1 needs P and R or Z, G74 and G75 need the axes to move, GOTOF needs a label.",
        "Write them in the same line.";
}
