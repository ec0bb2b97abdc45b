//! Whole-product tests: a driver for the core, and the laws every run must obey as reusable functions.

pub mod drive;
pub mod laws;
