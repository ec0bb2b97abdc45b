//! Errors of the Fanuc and Heidenhain dialects, and of arithmetic in the text of a program.

use super::messages;

messages! {
    NURBS_ORDER = 301, "P of G06.2 must be 2, 3 or 4",
        "P is the order of the curve, its degree plus one. The control drives curves of degree 1, 2 and 3.",
        "Write P2, P3 or P4 in the block with G06.2, or leave P out for P4; no P in the blocks behind it.";
    NURBS_KNOT_MISSING = 302, "block of a G06.2 curve without knot K",
        "Every block of a NURBS curve carries one knot: the blocks with control points, and as many blocks without as the order says.",
        "Write K in this block. If the curve is to end here, give the remaining knots and then G00, G01, G02 or G03.";
    NURBS_KNOT_ORDER = 303, "knot K is smaller than the knot before it",
        "The knots are the values the curve parameter runs through; they may repeat but never go back.",
        "Check the K words: each must be equal to or greater than the one before.";
    NURBS_KNOT_START = 304, "the first P knots are not equal",
        "The curve begins in its first control point only if as many knots as the order says are equal at its start.",
        "Repeat the first K in the first two (P2), three (P3) or four (P4) blocks, and in no more.";
    NURBS_KNOT_END = 305, "the last P knots are not equal",
        "The curve ends in its last control point only if the knots of all blocks without a control point are equal and greater than the knots before them.",
        "Give the same K, greater than that of the last control point, in all blocks behind it.";
    NURBS_KNOT_MULTIPLE = 306, "knot K is repeated too often",
        "Between its ends a curve of order P falls apart where P or more knots are equal.",
        "Repeat a knot inside the curve at most P-1 times.";
    NURBS_POINTS = 307, "fewer control points than the order P",
        "A curve of order P has at least P control points.",
        "Give more control points or a lower order.";
    NURBS_START = 308, "the first control point is not the current position",
        "The curve begins in its first control point. A machine that stands more than 0.001 mm (or degree) away would have to jump.",
        "Move to the first control point with G01 before G06.2.";
    NURBS_WEIGHT = 309, "weight R must be greater than 0",
        "A control point with weight 0 or less has no place on the curve.",
        "Write R greater than 0, or leave it out for 1.";
    NURBS_AXIS = 310, "axis is not part of the G06.2 curve",
        "The axes of a NURBS curve are those of its first control point.",
        "Name all axes of the curve, and at least one, in the block with G06.2.";
    NURBS_OPEN = 311, "the G06.2 curve is not complete",
        "Behind the last control point come as many blocks with nothing but a knot as the order P says. Before that the curve has no end.",
        "Give the remaining K blocks.";
    NURBS_COMPLETE = 312, "the G06.2 curve is complete",
        "All its knots have come. Until the next G function of the first group the control does not know how to move.",
        "Begin the next motion with G00, G01, G02, G03 or a new G06.2.";
    NURBS_COMPENSATION = 313, "G06.2 with G41 or G42 in force",
        "Fanuc controls do not compensate the cutter radius on a NURBS curve.",
        "Cancel the compensation with G40 before G06.2.";

    H_STATEMENT = 320, "statement '{}' is not available",
        "The reader knows BEGIN PGM, END PGM, BLK FORM, L, CC, C, CR, SPL, TOOL CALL, M and STOP.",
        "Let the post-processor write out cycles, labels, polar coordinates and Q parameters as these.";
    H_PROGRAM = 321, "BEGIN PGM and END PGM need MM or INCH at the end of the line",
        "The unit of all coordinates stands there.",
        "Write BEGIN PGM name MM or BEGIN PGM name INCH.";
    H_CENTRE = 322, "CC needs the two coordinates of one plane, or none",
        "The circle centre lies in the plane XY, ZX or YZ that its two letters name.",
        "Write CC X.. Y.., CC Z.. X.., CC Y.. Z.., or CC alone for the current position.";
    H_NO_CENTRE = 323, "C without a circle centre",
        "The arc turns about the last CC of the program.",
        "Write CC before C.";
    H_DIRECTION = 324, "C and CR need DR+ or DR-",
        "Without a direction there are two arcs between the same points.",
        "Write DR+ for counter-clockwise or DR- for clockwise.";
    H_RADIUS = 325, "CR needs a radius R that is not 0",
        "The arc is given by its end point and its radius.",
        "Write R with the radius; negative for the arc of more than half a turn.";
    H_SPLINE_AXES = 326, "SPL needs the end point of at least one axis",
        "The coefficients belong to the axes whose end points stand in the SPL block.",
        "Write the end point of each axis behind SPL.";
    H_SPLINE_WORDS = 327, "SPL block waits for K3, K2 and K1 of each of its axes",
        "Another statement, or the end of the program, came before all coefficients of the spline block.",
        "Give three coefficients for each axis named in the SPL block, on its line or on the lines behind it.";
    H_COEFFICIENT = 328, "'{}' belongs to no axis of the SPL block",
        "A coefficient needs its axis in the SPL block, or is beyond 100000.",
        "Name the axis with its end point in the SPL block, before the coefficient.";
    H_SPLINE_GAP = 329, "SPL starts more than 0.001 from the current position in this axis",
        "At t = 1 the polynomial of a block is where the block before it ended; up to 0.001 mm or degree is rounding.",
        "Check the end point and the coefficients of this block and the end point of the block before.";
    H_NO_TOOL = 331, "RL or RR without a tool",
        "Radius compensation needs the radius of the tool in the spindle.",
        "Call the tool with TOOL CALL first.";
    H_TOOL_CALL = 332, "TOOL CALL: '{}' is not understood",
        "Behind TOOL CALL come the number or the name of the tool, the tool axis, S, F, DL and DR.",
        "Write for example TOOL CALL 5 Z S5000 F800 DL+0.1 DR-0.02.";

    VALUE_EXPECTED = 336, "value expected",
        "Here an expression needs a number, an R parameter, a function or a parenthesis.",
        "Complete the expression or remove the operator before it.";
    EXPRESSION_NUMBER = 337, "malformed number '{}'",
        "Numbers have digits with at most one point, at most 19 significant ones, and a whole exponent behind E or EX.",
        "Correct the number.";
    UNKNOWN_FUNCTION = 338, "unknown function '{}'",
        "There are SIN COS TAN ASIN ACOS ATAN ATAN2 SQRT ABS POT ROUND TRUNC LN EXP.",
        "Use one of these, or assign the value to an R parameter.";
    SYSTEM_VARIABLE = 339, "system variable '{}' is not available",
        "Names that begin with $ belong to the control the program was written for.",
        "Replace the variable by a number or an R parameter.";
    PUNCTUATION = 340, "parenthesis, bracket or comma missing",
        "A function needs its arguments in parentheses, ATAN2 two of them with a comma, and what is opened must be closed.",
        "Add the missing character at the place shown.";
    PARAMETER = 341, "'{}' is not one of R0 to R99",
        "There are one hundred R parameters, and the index in R[..] has to be whole.",
        "Use a whole index from 0 to 99.";
    DIVISION_BY_ZERO = 342, "division by zero",
        "The divisor, or the cosine in TAN, is zero.",
        "Check the R parameters that go into it.";
    DOMAIN = 343, "function '{}' has no value here",
        "ASIN and ACOS take -1 to 1, SQRT 0 and more, LN more than 0, ATAN2 not (0,0), angles up to 1E12 degrees.",
        "Check the R parameters that go into it.";
    TOO_LARGE = 344, "result is too large",
        "The result of the operation is beyond 1.8E308.",
        "Check the R parameters that go into it.";
    NESTING = 345, "expression is nested too deeply",
        "More than ten parentheses, brackets and functions are open at one time.",
        "Compute part of the expression into an R parameter first.";
    COMPARISON_EXPECTED = 346, "comparison expected",
        "A condition compares two values with == <> < > <= or >=.",
        "Complete the condition.";
    BARE_COMPARISON = 347, "comparison beside NOT, AND, XOR or OR needs parentheses",
        "On the 840D these bind more tightly than comparisons, so the condition would mean something else.",
        "Put each comparison in parentheses: IF (R1>0) AND (R2<5) GOTOF END.";
}
