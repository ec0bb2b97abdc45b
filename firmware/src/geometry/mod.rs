//! Blocks to cubic segments, and their arc length.
//!
//! In: [`crate::nc::command::Move`]s, absolute and modal-free. Out: [`PathSegment`]s, each a five-axis cubic.
//! [`SegmentBuilder`] does this for lines, A-, B- and C-splines and `G6`, in bounded memory, with `f32` relative to
//! integer positions; the arc-length stage then turns the cubics into constant-speed segments. Background only: never
//! called from an interrupt.

mod akima;
pub mod arc;
mod boundary;
mod bspline;
mod builder;
mod chord;
mod cubic;
mod error;
#[allow(dead_code)]
pub(crate) mod fit;
mod g6;
mod line;
mod queue;
pub mod segment;
mod singular;
#[cfg(test)]
mod tests;
pub mod travel;

pub use builder::SegmentBuilder;
pub use error::{GeometryError, GeometryErrorKind};
pub use segment::{HermiteSegment, PathSegment};
