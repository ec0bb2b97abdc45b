//! Blocks to cubic segments, and their arc length.
//!
//! [`builder::SegmentBuilder`] takes [`crate::nc::Move`]s and yields [`HermiteSegment`]s;
//! [`arc`] turns those into constant-speed [`arc::ServoSegment`]s.

pub mod segment;

pub use segment::{HermiteSegment, PathSegment};
