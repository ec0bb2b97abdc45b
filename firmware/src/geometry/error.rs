//! What can be wrong with a block once its text was right.

use core::fmt;

use crate::units::Nano;

/// A block the geometry stage refuses. No segment of it, or of anything after it, has been handed on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GeometryError {
    /// Text line ([`crate::nc::command::Move::block`]).
    pub block: u32,
    /// What is wrong.
    pub kind: GeometryErrorKind,
}

/// Reasons. `axis` is an index into [`crate::config::Config::axes`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GeometryErrorKind {
    /// A point or the curve between two points leaves the range of positions (2^31 steps either way).
    OutOfRange {
        /// Axis that leaves it.
        axis: usize,
    },
    /// The numbers of the block lead to an infinite or undefined slope.
    NotFinite,
    /// The feed of a block that is not rapid is zero, negative or not a number.
    Feed,
    /// A `G6` block does not start where the block before it ends.
    G6Gap {
        /// First axis that misses by more than the tolerance.
        axis: usize,
        /// By how much, 1e-6 mm or degree (saturated).
        gap: Nano,
    },
    /// `I` of a `G6` block is zero or negative.
    G6Length,
    /// `SD` is neither 2 nor 3, or changes inside a B-spline.
    Degree,
    /// `PW` differs between the control points of one B-spline, or is zero.
    Weight,
    /// `PL` is zero, negative or not a number.
    KnotInterval,
    /// The caller pushed a block before it had drained the segments of the last one.
    NotDrained,
}

impl GeometryError {
    /// Number of this error on the wire (`error:N`); the geometry stage owns 150..=169.
    #[must_use]
    pub fn code(&self) -> u16 {
        match self.kind {
            GeometryErrorKind::OutOfRange { .. } => 150,
            GeometryErrorKind::NotFinite => 151,
            GeometryErrorKind::Feed => 152,
            GeometryErrorKind::G6Gap { .. } => 153,
            GeometryErrorKind::G6Length => 154,
            GeometryErrorKind::Degree => 155,
            GeometryErrorKind::Weight => 156,
            GeometryErrorKind::KnotInterval => 157,
            GeometryErrorKind::NotDrained => 158,
        }
    }
}

impl fmt::Display for GeometryError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}: {}", self.block, self.kind)
    }
}

impl fmt::Display for GeometryErrorKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::OutOfRange { axis } => {
                write!(f, "axis {} leaves the range of positions", axis + 1)
            }
            Self::NotFinite => f.write_str("the curve has no finite slope"),
            Self::Feed => f.write_str("the feed must be greater than zero"),
            Self::G6Gap { axis, gap } => write!(
                f,
                "G6 starts {} nm (or 1e-6 degree) from the end of the block before it in axis {}; \
                 2000 are allowed",
                gap,
                axis + 1
            ),
            Self::G6Length => f.write_str("I of a G6 block must be greater than zero"),
            Self::Degree => f.write_str("SD must be 2 or 3 and may not change inside a spline"),
            Self::Weight => f.write_str("PW must be the same, and not 0, on all control points"),
            Self::KnotInterval => f.write_str("PL must be greater than zero"),
            Self::NotDrained => f.write_str("segments of the block before are still waiting"),
        }
    }
}

impl core::error::Error for GeometryError {}
