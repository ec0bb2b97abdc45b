//! Whole-product tests: a driver for the core, the laws every run must obey as reusable functions, an oracle
//! that reads programs and computes their curves another way, and a generator of random programs.

pub mod campaign;
pub mod drive;
pub mod examples;
pub mod generate;
pub mod laws;
pub mod oracle;
pub mod rng;
