//! Blocks to cubic segments, and their arc length.
//!
//! In: [`crate::nc::command::Move`]s, absolute and modal-free. Out: [`PathSegment`]s, each a five-axis cubic.
//! [`SegmentBuilder`] does this for lines, arcs, A-, B- and C-splines, `POLY` and `G6`, in bounded memory and with
//! bounded work per segment, relative to integer positions; the arc-length stage then turns the cubics into
//! constant-speed segments. Background only: never called from an interrupt.

mod akima;
pub mod arc;
mod boundary;
mod bspline;
mod builder;
mod chord;
mod circle;
mod cubic;
mod error;
pub(crate) mod fit;
mod g6;
mod lazy;
mod line;
mod polynomial;
mod quadrature;
mod queue;
mod rational;
pub mod rounding;
pub mod segment;
mod singular;
#[cfg(test)]
mod tests;
pub(crate) mod tool_vector;
pub mod travel;

pub use builder::SegmentBuilder;
pub use error::{GeometryError, GeometryErrorKind, WithLetters};
pub use segment::{HermiteSegment, PathSegment};
