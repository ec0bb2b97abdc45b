//! Errors of the cutter compensation.

use super::messages;

messages! {}
