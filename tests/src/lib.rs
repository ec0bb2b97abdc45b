//! Whole-product tests: a driver for the core, the laws every run must obey as reusable functions, an oracle
//! that reads programs and computes their curves another way, a generator of random programs, and a program of each
//! kind in its wire spelling.

pub mod campaign;
pub mod compensated;
pub mod drive;
pub mod examples;
pub mod feed;
pub mod generate;
pub mod laws;
pub mod oracle;
pub mod rng;
pub mod wire_programs;
