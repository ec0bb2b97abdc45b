//! NC text to commands: comes in a physical line of bytes, goes out a sequence of [`Command`]s.
//!
//! Touches [`crate::config`] (axis letters, zero offsets, tools, defaults) and nothing further down the road. A line
//! passes `lexer` and `phrase` (words and their places), `block` and `action` (what the line says, by the rows of `table`)
//! and [`Interpreter`] (what it means where the program stands), with `motion`, `frames`, `tools`, `values`, `special`,
//! `g6` and `jump` for its parts; a line of plain coordinates takes a short way, `plain`. A line is read to its end before anything of it acts: an [`NcError`] leaves the state as it was before
//! the line and emits nothing of it.
//!
//! [`Interpreter::set_dialect`] chooses between this language (Sinumerik), the same with `G06.2` (Fanuc, see `fanuc`), and
//! conversational lines (see `heidenhain`).
//!
//! # The language
//! | words | meaning |
//! |---|---|
//! | `/`, `N`, `NAME:` | mark of an optional block (the host leaves such lines out if asked to), block number, label; in this order at the start of a line, without effect here |
//! | `G0 G1 G2 G3 ASPLINE BSPLINE CSPLINE POLY G6` | interpolation, modal; `G1` at power-up |
//! | `I J K` | centre of `G2 G3` from the start, or `AC`; `K` and `I` under `G18`, `J` and `K` under `G19` |
//! | `CR`, `TURN` | radius instead of the centre, negative for more than half a turn; full turns added, 0 to 999 |
//! | `BAUTO BNAT BTAN`, `EAUTO ENAT ETAN` | start and end of A- and C-splines, modal; at power-up as the machine file says |
//! | `PW SD PL` | weight (0 to 3, step 1e-4), degree, knot interval of a B-spline; checked but without effect under `ASPLINE` and `CSPLINE`, refused elsewhere. A new word of group 1 begins a new spline |
//! | `XH YH ZH` | point of the second curve of a B-spline, absolute, shifted like X Y Z; all three, at all points or none, without rotary axes |
//! | `SPLINEPATH(1,X,Y)`, `SPLINEPATH XY` | axes that belong to splines, modal, last in its line; without letters and at power-up all |
//! | `PO[X]=(xe,a2,a3,a4,a5)`, `PO[]=(e,b2,..)`, `PL` | polynomial of an axis, denominator, parameter length (1) of a `POLY` block; up to five numbers each, counted from the programmed zero. A coordinate without `PO` is linear, also beside a denominator |
//! | `POX Q<a2> Q<a3> ..`, `POD Q<e> Q<b2> ..` | the same coefficients without brackets, on lines before the one with the coordinates and `PL`, or on it; `POX Q0` for none |
//! | `I`, `K` | length and coefficients of a `G6` block; the K words stand on lines of their own, three for each axis |
//! | `G4` | dwell: `F` or `P` in seconds, `S` in revolutions; no coordinates in the same line |
//! | `G9`, `G60 G64` | exact stop of the block, modal exact stop, continuous path (power-up) |
//! | `G10 L1 P R Z` | tool table: number, radius, length; what is not named stays |
//! | `G17 G18 G19` | plane XY, ZX, YZ of circles, compensation and tool length; at power-up as the machine file says |
//! | `G40 G41 G42` | cutter compensation off (power-up), left, right; begins, ends and changes with `G0` or `G1` |
//! | `G450 G451`, `CFC CFTCP CFIN` | outer corners: arc (power-up), intersection; feed of contour (power-up), centre, contour in inner curves |
//! | `G53`, `G54` to `G57`, `G500` | no zero offset in this line; zero offsets, `G54` at power-up; none |
//! | `G74 X0 ..`, `G75 X0 ..` | the named axes go to the reference point or fixed point in rapid; values 0 or none |
//! | `G90 G91`, `G70 G71` (`G700 G710`) | absolute (power-up) or incremental, inch or metric (power-up); inch counts for linear axes and for `F` over them |
//! | `X=AC(5) X=IC(5) A=DC(5)`, `XAC5 XIC5 ADC5` | this word absolute or incremental; `DC`: absolute, rotary axes |
//! | `G94 G95 G93` | `F` in mm/min (power-up), mm/rev at the programmed `S`, or blocks per minute, then in every block; a change asks for a new `F` |
//! | axis letters | coordinates, mm or degrees; absolute ones are shifted by the zero offset and, along the normal of the plane, by the tool length |
//! | `F` | mm/min (`G70`: inch/min); degrees/min where no linear axis moves |
//! | `S`, `T5`, `T="NAME"`, `D0 D1` | speed in rpm for the next `M3`/`M4`; tool for the next `M6`, which must be in the tool table unless that is empty; radius and length off, on (power-up) |
//! | `M0 M1 M2 M3 M4 M5 M6 M7 M8 M9 M30 M41..M45` | `M6 M41..M45 M3 M4 M7 M8` act before the motion of their line, `M5 M9 M0 M1 M2 M30` behind it, in that order |
//! | `MSG("text")`, `MSG()` | shown, cleared, before the motion |
//! | `R1=2.5`, `X=R1*2`, .. | parameters `R0` to `R99`, 0 at the start of a program, set in the order of the text before the line acts; any number behind `=` may be an expression ([`expression`]) |
//! | `GOTOF NAME` | the lines up to the one that begins with `NAME:` are passed over unread |
//! | `GOTOB IF L` | refused: the host follows them |
//! | `G33 G331 G332 G96 G961` | refused: the angle of the spindle is not known |
//! | `M17 RET M40 G97 G971 G601 G602 G603 NORM FNORM` | understood, and in force anyway |
//! | `SOFT BRISK` | jerk-limited or acceleration-limited, modal |
//! | `;` and `( )` | comments, any bytes |
//! | `%` | a line that begins with it is a program header and means nothing |
//!
//! `=` is optional behind an address or keyword with a plain number. Coordinates are exact: they are read as decimals and
//! rounded once to [`crate::units::Nano`] (half away from zero, if there are more than six decimals); values of
//! expressions are rounded to nine decimals first.

mod action;
mod block;
pub mod command;
mod error;
pub mod expression;
mod fanuc;
mod frames;
mod g6;
mod heidenhain;
mod interpreter;
mod jump;
mod lexer;
mod modal;
mod motion;
mod number;
pub mod parameters;
mod phrase;
mod plain;
mod special;
mod table;
#[cfg(test)]
mod tests;
mod tools;
mod values;
#[cfg(not(target_os = "none"))]
mod vocabulary;

pub use command::{
    Auxiliary, BoundaryCondition, Command, CubicBlock, Motion, Move, SplineKind, SplineSpec,
};
pub use error::{Excerpt, NcError, NcErrorKind, EXCERPT};
pub use interpreter::Interpreter;
pub use lexer::LINE_MAX;
pub use modal::Tool;
pub use tools::Tools;
#[cfg(not(target_os = "none"))]
pub use vocabulary::{vocabulary, VocabularyWord};
