//! Errors of the Fanuc and Heidenhain dialects.

use super::messages;

messages! {}
