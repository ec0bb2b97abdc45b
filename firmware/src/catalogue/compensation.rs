//! Errors of the cutter compensation.

use super::messages;

messages! {
    CURVATURE = 170, "radius of curvature {} mm at {} is smaller than the tool radius",
        "The tool does not fit into the curve: more material than the machine's contour tolerance would be left.",
        "Use a tool with a smaller radius, or widen the curve. contour_tolerance in the machine file is the most that may be left.";
    BOTTLENECK = 171, "the tool does not pass the contour at {}",
        "The contour is narrower than the tool here, or a block between inner corners is too short for it: the offset path finds no way on without cutting into the contour.",
        "Use a tool with a smaller radius, or leave out what it cannot reach.";
    MATERIAL = 172, "the tool leaves {} mm at {}",
        "A part of the contour cannot be reached by the tool; more than the machine's contour tolerance would be left.",
        "Use a tool with a smaller radius, or leave out what it cannot reach. contour_tolerance in the machine file is the most that may be left.";
    INTERRUPTED = 173, "the contour was interrupted before the inner corner at {}",
        "The program paused long enough for the tool to be run to the end of the contour; it already stands in the material the next block would leave.",
        "Send the blocks of a compensated contour without a pause.";
    NOT_STRAIGHT = 176, "G40, G41 and G42 take effect on a straight block",
        "The tool moves to or from its offset along a line.",
        "Program G40, G41 or G42 in a G0 or G1 block that moves in the working plane.";
    LOOK_AHEAD = 177, "too many blocks without motion in the working plane while G41 or G42 is on",
        "The corner behind them must be known before the block in front of them can be run; the look-ahead holds 12 blocks.",
        "Program fewer blocks between two motions in the plane, or G40 before them.";
    PLANE_AXES = 178, "the machine lacks an axis of the working plane",
        "Cutter compensation needs both axes of the plane.",
        "Select another plane with G17, G18 or G19.";
}
