//! Errors that arise behind the interpreter and the geometry (`machine`), and on the wire.

use super::messages;

messages! {
    DOLLAR = 3, "$ command not known",
        "",
        "";
    LOCKED = 9, "an error is latched",
        "",
        "";
    TRAVEL = 201, "axis {} leaves its travel on the way to this point",
        "",
        "";
    CURVE = 202, "{}",
        "",
        "";
    COMMANDS = 203, "too many functions in one line",
        "",
        "";
}
