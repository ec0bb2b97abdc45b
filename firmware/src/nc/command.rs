//! What the interpreter hands to the geometry stage. All coordinates are absolute machine
//! coordinates; all modal state has been resolved; nothing here refers back to the text but `block`.

use crate::units::{Nano, AXES};

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
    /// `PL`: knot interval of this block, `None` for the default (uniform).
    pub interval: Option<f32>,
    /// `PW`: weight of this point in units of 1e-4, 0..=30000; 10000 unless given.
    pub weight: u16,
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
    /// One point of a spline.
    Spline(SplineSpec),
    /// One `G6` block.
    Cubic(CubicBlock),
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
    /// `G9` / `G60`: come to rest at the end point.
    pub exact_stop: bool,
    /// `SOFT` (jerk-limited) rather than `BRISK` (acceleration-limited).
    pub soft: bool,
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
}

/// One unit of work for the stages behind the interpreter.
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
    /// `M2` / `M30`: the program is over; modal state is back at power-up values.
    ProgramEnd,
}
