//! End conditions of A- and C-splines, with the neighbouring block's direction looked up.

use super::chord::{Chord, Measure};
use crate::config::Config;
use crate::nc::command::BoundaryCondition;
use crate::units::AxisVec;

/// What holds at one end of a spline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Boundary {
    /// The spline's own choice (not-a-knot; Akima's extrapolation).
    Auto,
    /// Zero second derivative.
    Natural,
    /// This slope per unit of chord length.
    Slope(AxisVec),
}

impl Boundary {
    /// Resolves the condition in force.
    ///
    /// `neighbour` is the direction (any length) of the block beyond this end, if there is one. A tangent
    /// is scaled to unit chord slope; it falls back to natural without a neighbour, and where the
    /// neighbour's length is measured over other axes (`own`) than the spline's, because mm and degrees of
    /// arc length have no common slope.
    pub fn resolve(
        config: &Config,
        condition: BoundaryCondition,
        neighbour: Option<AxisVec>,
        own: Measure,
    ) -> Self {
        match condition {
            BoundaryCondition::NotAKnot => Self::Auto,
            BoundaryCondition::Natural => Self::Natural,
            BoundaryCondition::Tangent => neighbour
                .and_then(|direction| Chord::new(config, &direction))
                .filter(|chord| chord.measure == own)
                .map_or(Self::Natural, |chord| Self::Slope(chord.slope)),
        }
    }
}
