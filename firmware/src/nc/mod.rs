//! NC text to commands: comes in a physical line of bytes, goes out a sequence of [`Command`]s.
//!
//! Touches [`crate::config`] (axis letters, zero offsets) and nothing further down the road. A line passes
//! `lexer` (words and their places), `block` (what the line says, by the rows of `table`) and
//! [`Interpreter`] (what it means where the program stands). A line is read to its end before anything of it
//! acts: an [`NcError`] leaves the modal state as it was before the line and emits nothing of it.
//!
//! # The language
//! | words | meaning |
//! |---|---|
//! | `N` | block number, first in the line |
//! | `G0 G1 ASPLINE BSPLINE CSPLINE G6` | interpolation, modal; `G1` at power-up |
//! | `BAUTO BNAT BTAN`, `EAUTO ENAT ETAN` | start and end of A- and C-splines, modal; `BNAT ENAT` at power-up |
//! | `PW SD PL` | weight, degree, knot interval of a B-spline, with or without `=`; checked but without effect under `ASPLINE` and `CSPLINE`, refused elsewhere |
//! | `I`, `K` | length and coefficients of a `G6` block; the K words stand on lines of their own, three for each axis |
//! | `G4` | dwell: `F` or `P` in seconds, no coordinates in the same line |
//! | `G9`, `G60 G64` | exact stop of the block, modal exact stop, continuous path (power-up) |
//! | `G90 G91`, `G70 G71` | absolute (power-up) or incremental, inch or metric (power-up); inch counts for linear axes and for `F` over them |
//! | `G17 G40 G54 G94` | in force anyway |
//! | axis letters | coordinates, mm or degrees; absolute ones are shifted by the zero offset `G54`, which is in force from power-up |
//! | `F` | mm/min (`G70`: inch/min); degrees/min where no linear axis moves |
//! | `S`, `T` | speed in rpm for the next `M3`/`M4`, tool for the next `M6` |
//! | `M0 M1 M2 M3 M4 M5 M6 M8 M9 M30` | `M6 M3 M4 M8` act before the motion of their line, `M5 M9 M0 M1 M2 M30` behind it, in that order |
//! | `M17` | end of a sub-program the host has put in place of its call: no effect |
//! | `SOFT BRISK` | jerk-limited or acceleration-limited, modal |
//! | `;` and `( )` | comments, any bytes |
//! | `%` | a line that begins with it is a program header and means nothing |
//!
//! Coordinates are exact: they are read as decimals and rounded once to [`crate::units::Nano`]
//! (half away from zero, if there are more than six decimals).

mod block;
pub mod command;
mod error;
mod interpreter;
mod lexer;
mod number;
mod table;
#[cfg(test)]
mod tests;
mod values;

pub use block::Tool;
pub use command::{
    Auxiliary, BoundaryCondition, Command, CubicBlock, Motion, Move, SplineKind, SplineSpec,
};
pub use error::{Excerpt, NcError, NcErrorKind, ERRORS, EXCERPT};
pub use interpreter::Interpreter;
pub use lexer::LINE_MAX;
