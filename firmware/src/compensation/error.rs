//! What can be wrong with a compensated contour.

use core::fmt;

use crate::catalogue::compensation as catalogue;
use crate::catalogue::machine::INTERNAL;
use crate::catalogue::Message;
use crate::nc::command::Plane;
use crate::units::Thousandths;

/// A place in the working plane, mm, machine coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Plane the coordinates lie in.
    pub plane: Plane,
    /// First and second axis of the plane.
    pub at: [f32; 2],
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [first, second, _] = self.plane.letters().map(char::from);
        let [x, y] = self.at.map(Thousandths::nearest);
        write!(f, "{first}{x} {second}{y}")
    }
}

/// A contour the compensation refuses. Nothing of the offending contour within the look-ahead has been handed out; call
/// [`super::Compensator::reset`] before the stage is used again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CompensationError {
    /// Text line ([`crate::nc::Move::block`]).
    pub block: u32,
    /// What is wrong.
    pub kind: CompensationErrorKind,
}

/// Reasons.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CompensationErrorKind {
    /// The contour is tighter than the tool, and more than [`crate::config::Config::contour_tolerance`] would be left.
    Curvature {
        /// Radius of curvature, mm.
        radius: f32,
        /// Where.
        place: Place,
    },
    /// The offset path finds no way on, or crosses itself.
    Bottleneck {
        /// Where.
        place: Place,
    },
    /// Blocks shorter than the tool can follow: more than [`crate::config::Config::contour_tolerance`] would be left.
    Material {
        /// What would be left, mm.
        left: f32,
        /// Where.
        place: Place,
    },
    /// The contour goes on with an inner corner after the last block was run to its end.
    Interrupted {
        /// Where.
        place: Place,
    },
    /// The radius changes while compensation is on.
    RadiusChange,
    /// The plane changes while compensation is on.
    PlaneChange,
    /// Approach, retract or change of side on a block that is not straight in the plane.
    NotStraight,
    /// More blocks without motion in the plane in a row than the window holds.
    LookAhead,
    /// The machine lacks an axis of the plane.
    PlaneAxes,
    /// The centre of the tool leaves the range of positions.
    OutOfRange,
    /// The caller pushed a block before it had drained the output, or pushed a motion as a command.
    NotDrained,
}

impl CompensationErrorKind {
    /// Row of the error catalogue.
    #[must_use]
    pub const fn message(&self) -> Message {
        match self {
            Self::Curvature { .. } => catalogue::CURVATURE,
            Self::Bottleneck { .. } => catalogue::BOTTLENECK,
            Self::Material { .. } => catalogue::MATERIAL,
            Self::Interrupted { .. } => catalogue::INTERRUPTED,
            Self::RadiusChange => INTERNAL,
            Self::PlaneChange => INTERNAL,
            Self::NotStraight => catalogue::NOT_STRAIGHT,
            Self::LookAhead => catalogue::LOOK_AHEAD,
            Self::PlaneAxes => catalogue::PLANE_AXES,
            Self::OutOfRange => INTERNAL,
            Self::NotDrained => INTERNAL,
        }
    }
}

impl CompensationError {
    /// Number of this error on the wire (`error:N`); the compensation owns 170..=189.
    #[must_use]
    pub const fn code(&self) -> u16 {
        self.kind.message().code
    }
}

impl fmt::Display for CompensationError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}: {}", self.block, self.kind)
    }
}

impl fmt::Display for CompensationErrorKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (number, place) = match *self {
            Self::Curvature { radius, place } => (Some(radius), Some(place)),
            Self::Material { left, place } => (Some(left), Some(place)),
            Self::Bottleneck { place } | Self::Interrupted { place } => (None, Some(place)),
            _ => (None, None),
        };
        let (mut number, mut place) = (number, place);
        // The holes of the message, in order: the number first where there is one.
        for (index, text) in self.message().text.split("{}").enumerate() {
            if index > 0 {
                if let Some(number) = number.take() {
                    write!(f, "{}", Thousandths::nearest(number))?;
                } else if let Some(place) = place.take() {
                    write!(f, "{place}")?;
                }
            }
            f.write_str(text)?;
        }
        Ok(())
    }
}

impl core::error::Error for CompensationError {}
