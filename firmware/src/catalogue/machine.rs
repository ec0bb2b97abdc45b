//! Errors that arise behind the interpreter and the geometry (`machine`), and on the wire.

use super::messages;

messages! {
    DOLLAR = 3, "$ command not known",
        "Lines that begin with $ are for the control itself, and this one is not among its commands.",
        "Send $ alone for the list of commands.";
    LOCKED = 9, "an error is latched",
        "A line before this one was refused. What a sender had already queued behind it must not move the machine.",
        "Mend the program, then send ~ or $X to go on from where the machine stands, or reset with ctrl-x.";
    TRAVEL = 201, "axis {} leaves its travel on the way to this point",
        "The curve, not only its end point, has to stay within the travel of every axis.",
        "Move the work or the zero offset; for a spline look for overshoot between the points.";
    INTERNAL = 202, "the stages of the control disagree about this block",
        "A check behind other checks has failed. No program is known that leads here.",
        "Please report the program. It is safe to go on with another one after a reset.";
    RANGE = 204, "the curve leaves the range of numbers",
        "The curve is longer, or bends more sharply, than the fixed-point format of the path can hold.",
        "Split the block.";
    NOT_AT_REST = 205, "this can only be changed between programs",
        "The dialect decides how lines are read; a program under way has been read in the old one.",
        "Wait for the end of the program, or reset, and send the command again.";
}
