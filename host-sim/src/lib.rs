//! The simulator (library).
