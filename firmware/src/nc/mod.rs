//! NC text to commands: comes in a physical line of bytes, goes out a sequence of [`Command`]s.
//!
//! Touches [`crate::config`] (axis letters, zero offsets) and nothing further down the road.

pub mod command;

pub use command::{Auxiliary, BoundaryCondition, Command, CubicBlock, Motion, Move, SplineKind, SplineSpec};
