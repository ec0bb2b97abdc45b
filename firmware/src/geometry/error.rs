//! What can be wrong with a block once its text was right.

use core::fmt;

use crate::catalogue::{geometry as text, machine, Message};
use crate::config::Config;
use crate::units::{Nano, NANO_PER_UNIT};

/// A block the geometry stage refuses. No segment of anything after it has been handed on.
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
    /// A curve of several segments leaves the travel of the machine; none of them has been handed on. (Of a block that is
    /// one segment, the machine finds out.)
    Travel {
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
    /// The weight of a control point is negative, not a number, or zero on all points of a span.
    Weight,
    /// A knot interval is negative or not a number, or more knots coincide than the degree.
    KnotInterval,
    /// The caller pushed a block before it had drained the segments of the last one. The block has not been taken: drain
    /// and push it again.
    NotDrained,
    /// Start and end of an arc do not lie on one circle about its centre.
    ArcRadii {
        /// Distance of the start from the centre, 1e-6 mm.
        start: Nano,
        /// Distance of the end from the centre, 1e-6 mm.
        end: Nano,
    },
    /// No circle of radius `CR` reaches from start to end.
    ArcReach {
        /// `CR` without its sign, 1e-6 mm.
        radius: Nano,
        /// Half the distance from start to end, 1e-6 mm.
        half: Nano,
    },
    /// The centre of an arc lies on its start or end, or `CR` is zero.
    ArcNoRadius,
    /// `CR` where the arc ends where it starts: any centre would do.
    ArcNoChord,
    /// The machine lacks an axis of the working plane.
    ArcPlane {
        /// Letter of the axis that is missing.
        letter: u8,
    },
    /// The denominator of a `POLY` block, or the weights of a span, vanish somewhere on the way.
    Denominator,
    /// A curve changes too fast for cubic segments to follow within `Config::curve_tolerance`.
    Steep,
    /// A spline ended before it had the points it needs.
    TooFewPoints {
        /// Points it needs, the start among them.
        least: u8,
        /// Points it has.
        got: u8,
    },
    /// `XH YH ZH` on a machine whose axes cannot turn the tool, or where the tool has no direction.
    ToolVector,
    /// The rotary axes are not where the tool vector begins, or it leaves the pole in another direction.
    ToolJump,
    /// `SPLINEPATH` changes, or `XH YH ZH` come or go, inside a B-spline.
    SplineAxes,
}

impl GeometryErrorKind {
    /// Row of the catalogue: number and text.
    #[must_use]
    pub const fn message(&self) -> &'static Message {
        match self {
            Self::OutOfRange { .. } => &text::OUT_OF_RANGE,
            Self::Travel { .. } => &machine::TRAVEL,
            Self::NotFinite => &text::NOT_FINITE,
            Self::Feed => &machine::INTERNAL,
            Self::G6Gap { .. } => &text::G6_GAP,
            Self::G6Length => &machine::INTERNAL,
            Self::Degree => &machine::INTERNAL,
            Self::Weight => &text::WEIGHT,
            Self::KnotInterval => &machine::INTERNAL,
            Self::NotDrained => &machine::INTERNAL,
            Self::ArcRadii { .. } => &text::ARC_RADII,
            Self::ArcReach { .. } => &text::ARC_REACH,
            Self::ArcNoRadius => &text::ARC_NO_RADIUS,
            Self::ArcNoChord => &machine::INTERNAL,
            Self::ArcPlane { .. } => &text::ARC_PLANE,
            Self::Denominator => &text::DENOMINATOR,
            Self::Steep => &text::STEEP,
            Self::TooFewPoints { .. } => &text::TOO_FEW_POINTS,
            Self::ToolVector => &text::TOOL_VECTOR,
            Self::ToolJump => &text::TOOL_JUMP,
            Self::SplineAxes => &machine::INTERNAL,
        }
    }

    /// The message with axes by letter, as the operator knows them.
    #[must_use]
    pub const fn with_letters<'a>(&'a self, config: &'a Config) -> WithLetters<'a> {
        WithLetters { kind: self, config }
    }

    /// The text of the catalogue, its `{}` filled in.
    fn write(&self, f: &mut fmt::Formatter<'_>, config: Option<&Config>) -> fmt::Result {
        for (index, part) in self.message().text.split("{}").enumerate() {
            if index > 0 {
                self.fill(f, index, config)?;
            }
            f.write_str(part)?;
        }
        Ok(())
    }

    /// What stands for the `index`-th `{}`, from 1.
    fn fill(
        &self,
        f: &mut fmt::Formatter<'_>,
        index: usize,
        config: Option<&Config>,
    ) -> fmt::Result {
        match (*self, index) {
            (Self::OutOfRange { axis } | Self::Travel { axis }, 1)
            | (Self::G6Gap { axis, .. }, 2) => {
                match config.and_then(|config| config.axes.get(axis)) {
                    Some(axis) => write!(f, "{}", char::from(axis.letter)),
                    None => write!(f, "{}", axis.wrapping_add(1)),
                }
            }
            (Self::G6Gap { gap, .. }, _) => write!(f, "{gap}"),
            (Self::ArcRadii { start: length, .. }, 1)
            | (Self::ArcRadii { end: length, .. }, _)
            | (Self::ArcReach { radius: length, .. }, 1)
            | (Self::ArcReach { half: length, .. }, _) => decimal(f, length),
            (Self::ArcPlane { letter }, _) => write!(f, "{}", char::from(letter)),
            (Self::TooFewPoints { least: count, .. }, 1)
            | (Self::TooFewPoints { got: count, .. }, _) => write!(f, "{count}"),
            _ => Ok(()),
        }
    }
}

/// Millimetres with four decimals.
fn decimal(f: &mut fmt::Formatter<'_>, nano: Nano) -> fmt::Result {
    let unit = NANO_PER_UNIT.unsigned_abs();
    // Half of the last place; lengths are far from the end of the range.
    let size = nano.unsigned_abs().saturating_add(50);
    let sign = if nano < 0 { "-" } else { "" };
    write!(f, "{sign}{}.{:04}", size / unit, size % unit / 100)
}

/// Shows a [`GeometryErrorKind`] with the axis letters of a machine.
pub struct WithLetters<'a> {
    kind: &'a GeometryErrorKind,
    config: &'a Config,
}

impl fmt::Display for WithLetters<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.kind.write(f, Some(self.config))
    }
}

impl GeometryError {
    /// Number of this error on the wire (`error:N`); the geometry stage owns 150..=169, and has 201 in
    /// common with the machine.
    #[must_use]
    pub const fn code(&self) -> u16 {
        self.kind.message().code
    }
}

impl fmt::Display for GeometryError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}: {}", self.block, self.kind)
    }
}

impl fmt::Display for GeometryErrorKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.write(f, None)
    }
}

impl core::error::Error for GeometryError {}
