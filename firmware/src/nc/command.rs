//! What the interpreter hands to the geometry stage. All coordinates are absolute machine
//! coordinates; all modal state has been resolved; nothing here refers back to the text but `block`.

use super::error::Excerpt;
use crate::units::{Nano, AXES};

/// Working plane (G-group 6): the two axes of circles and of cutter compensation, in right-handed order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Plane {
    /// `G17`: X then Y, normal Z.
    #[default]
    Xy,
    /// `G18`: Z then X, normal Y.
    Zx,
    /// `G19`: Y then Z, normal X.
    Yz,
}

impl Plane {
    /// Address letters: first axis, second axis, normal.
    #[must_use]
    pub const fn letters(self) -> [u8; 3] {
        match self {
            Self::Xy => *b"XYZ",
            Self::Zx => *b"ZXY",
            Self::Yz => *b"YZX",
        }
    }
}

/// Spline family of G-group 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SplineKind {
    /// `ASPLINE`: Akima, passes through the points, tangent continuous.
    Akima,
    /// `BSPLINE`: the programmed points are control points.
    BSpline,
    /// `CSPLINE`: cubic spline through the points, curvature continuous.
    Cubic,
}

/// End condition of an A- or C-spline (B-splines ignore it).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BoundaryCondition {
    /// `BAUTO` / `EAUTO`: not-a-knot (C), Akima's quadratic extrapolation (A).
    NotAKnot,
    /// `BNAT` / `ENAT`: zero curvature.
    Natural,
    /// `BTAN` / `ETAN`: tangent to the neighbouring block.
    Tangent,
}

/// The modal spline state in force for one block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SplineSpec {
    /// Which spline.
    pub kind: SplineKind,
    /// Start condition in force (counts at the first block of a spline).
    pub begin: BoundaryCondition,
    /// End condition in force (counts at the last block of a spline).
    pub end: BoundaryCondition,
    /// `SD`: polynomial degree of a B-spline, 2 or 3.
    pub degree: u8,
    /// `PL`: knot interval of this block, `None` for the default (uniform). Zero (Fanuc: equal knots) lowers the
    /// continuity at the knot.
    pub interval: Option<f32>,
    /// `PW` or Fanuc `R`: weight of this point, 0 or more; 1 unless given.
    pub weight: f32,
    /// Group 1 was selected anew with this block: a spline under way ends before it, whatever its kind.
    pub first: bool,
    /// `SPLINEPATH`: one bit per axis that belongs to the spline; the others go along linearly from point to point.
    pub axes: u8,
    /// `XH YH ZH`: point of the second curve, absolute machine coordinates; the tool points from the first to it.
    pub tool_point: Option<[Nano; 3]>,
}

/// How the centre of a circle is programmed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Centre {
    /// `I J K`: absolute machine coordinates of the centre, in the order of [`Plane::letters`].
    Point([Nano; 2]),
    /// `CR`: signed radius; negative asks for the arc of more than half a turn.
    Radius(Nano),
}

/// `G2`, `G3`: an arc in a plane; axes outside the plane go along linearly with the angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arc {
    /// Working plane.
    pub plane: Plane,
    /// `G2`: clockwise, seen against the normal of the plane.
    pub clockwise: bool,
    /// Where the centre is.
    pub centre: Centre,
    /// `TURN`: full turns added.
    pub turns: u16,
}

/// `POLY`: a polynomial per axis over p in 0..=`length` (shared facts 6), numerators over one denominator:
/// `P(p) = (a0 + a1 p + a2 p^2 + .. + a5 p^5) / (1 + b1 p + .. + b5 p^5)`.
///
/// a0 is the start position, a1 follows from the end position. Coordinates and coefficients in mm or degree, counted from
/// the machine origin. An axis without a numerator goes along linearly in p.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Polynomial {
    /// `PL`: parameter length, greater than zero; 1 unless given.
    pub length: f64,
    /// One bit per axis that has a numerator (`PO[X]`, be it without coefficients); the others do not see the denominator.
    pub numerators: u8,
    /// `[a2, a3, a4, a5]` per axis; zero for an axis without a numerator.
    pub coefficients: [[f64; 4]; AXES],
    /// Value of the denominator at p = `length`, and its `[b2, b3, b4, b5]`; `[1, 0, 0, 0, 0]` without one. b1 follows.
    pub denominator: [f64; 5],
}

/// Side of the contour the tool is on (G-group 7).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Side {
    /// `G40`: on the contour.
    #[default]
    On,
    /// `G41`.
    Left,
    /// `G42`.
    Right,
}

/// How an outer corner is rounded (G-group 18).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Corner {
    /// `G450`: arc about the corner.
    #[default]
    Arc,
    /// `G451`: intersection of the offset contours.
    Intersection,
}

/// What the programmed feed refers to under compensation (G-group 16).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FeedReference {
    /// `CFC`: the contour.
    #[default]
    Contour,
    /// `CFTCP`: the centre of the tool.
    Centre,
    /// `CFIN`: the contour where the tool is inside a curve, the centre elsewhere.
    Inside,
}

/// Cutter radius compensation in force for one block.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cutter {
    /// Side.
    pub side: Side,
    /// Outer corners.
    pub corner: Corner,
    /// Feed.
    pub feed: FeedReference,
    /// Plane the offset lies in.
    pub plane: Plane,
    /// Radius of the tool, 1e-6 mm.
    pub radius: Nano,
}

impl Cutter {
    /// No compensation.
    pub const OFF: Self = Self {
        side: Side::On,
        corner: Corner::Arc,
        feed: FeedReference::Contour,
        plane: Plane::Xy,
        radius: 0,
    };
}

/// What the number in [`Move::feed`] is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FeedType {
    /// `G94`, `G95`: mm/s, or degree/s where no linear axis moves.
    #[default]
    PerTime,
    /// `G93`: blocks per second, the reciprocal of the time the block takes.
    Inverse,
}

/// How the corner behind a block is rounded (G-group 10).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Rounding {
    /// Not at all: `G60`, `G64`, or `G641` without a distance.
    #[default]
    None,
    /// `G641`: the path leaves the block at most this far before its end, and joins the next at most this far behind it; mm
    /// of path, or degree where no linear axis moves. Greater than zero.
    Distance(f32),
    /// `G642`: no axis leaves the programmed path by more than its [`crate::config::AxisConfig::rounding_tolerance`].
    Tolerance,
}

/// System 800 `G6` block: a cubic per axis, printed with the parameter running from `length` down to 0
/// (shared facts 1: `P(i) = end + K1/2^28 i + K2*1e3/2^41 i^2 + K3*1e6/2^53 i^3` in mm).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CubicBlock {
    /// `I`: curve parameter length.
    pub length: Nano,
    /// `[K3, K2, K1]` per axis as printed; zero for an axis without a K line.
    pub k: [[i64; 3]; AXES],
}

/// How a block moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Motion {
    /// `G0`: straight, as fast as the axes allow.
    Rapid,
    /// `G1`: straight at the programmed feed.
    Linear,
    /// `G2`, `G3`.
    Arc(Arc),
    /// One point of a spline.
    Spline(SplineSpec),
    /// One `G6` block.
    Cubic(CubicBlock),
    /// One `POLY` block.
    Polynomial(Polynomial),
}

/// One motion block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Move {
    /// Running number of the text line since the program began, 1-based (of the last line the block took).
    pub block: u32,
    /// How to get there.
    pub motion: Motion,
    /// End point, absolute machine coordinates.
    pub target: [Nano; AXES],
    /// Programmed feed: mm/s over the linear axes, or degrees/s where no linear axis moves.
    /// Not used by [`Motion::Rapid`].
    pub feed: f32,
    /// What `feed` counts.
    pub feed_type: FeedType,
    /// `G9` / `G60`: come to rest at the end point.
    pub exact_stop: bool,
    /// `SOFT` (jerk-limited) rather than `BRISK` (acceleration-limited).
    pub soft: bool,
    /// `G641`, `G642`: what may become of the corner at the end point. Means nothing beside `exact_stop`.
    pub rounding: Rounding,
    /// Cutter radius compensation; the geometry stage hands it on.
    pub cutter: Cutter,
}

/// Functions that act at standstill.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Auxiliary {
    /// `M0`: wait for cycle start.
    Stop,
    /// `M1`: wait for cycle start if optional stops are on.
    OptionalStop,
    /// `M3`: spindle clockwise at the speed in force, rpm.
    SpindleClockwise(f32),
    /// `M4`: spindle counter-clockwise, rpm.
    SpindleCounterClockwise(f32),
    /// `M5`.
    SpindleStop,
    /// `M6`: change to the tool selected by `T`.
    ToolChange,
    /// `M8` or similar: coolant on.
    CoolantOn,
    /// `M9`.
    CoolantOff,
    /// `M41` to `M45`: gear stage 1 to 5.
    GearStage(u8),
}

/// One unit of work for the stages behind the interpreter.
///
/// Nearly every command is a move: making the others as large costs nothing, and there is no heap to put a move on.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Command {
    /// Motion.
    Move(Move),
    /// `G4`: rest for this many milliseconds.
    Dwell {
        /// Time at rest.
        milliseconds: u32,
    },
    /// Something that happens at standstill.
    Auxiliary(Auxiliary),
    /// `MSG("text")`: shown when the line is interpreted, without a stop. Long texts are cut.
    Message(Excerpt),
    /// `M2` / `M30`: the program is over; modal state is back at power-up values.
    ProgramEnd,
}
