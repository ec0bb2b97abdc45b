//! The language as data: one row per G function, M function and keyword.
//!
//! The lexer looks keywords up here, the block reader groups and actions. A new modal function is a row
//! (and, if it does something new, an [`Action`]).

use super::command::{BoundaryCondition, Corner, FeedReference, Plane, Side, SplineKind};

/// What group 1 has selected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mode {
    /// `G0`.
    Rapid,
    /// `G1`.
    Linear,
    /// `ASPLINE`, `BSPLINE`, `CSPLINE`.
    Spline(SplineKind),
    /// `G6`.
    Cubic,
    /// `G2` (true), `G3`.
    Arc(bool),
    /// `POLY`.
    Polynomial,
    /// Fanuc `G06.2`.
    Nurbs,
}

/// What `F` counts (group 15).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FeedUnit {
    /// `G94`: per minute.
    Minute,
    /// `G95`: per revolution of the spindle.
    Revolution,
    /// `G93`: blocks per minute.
    Inverse,
}

/// Kinds of continuous path (group 10).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Smoothing {
    /// `G64`, and `G60` where it matters.
    None,
    /// `G641`: corners are rounded over `ADIS`, `ADISPOS`.
    Distance,
    /// `G642`: within the tolerances of the axes.
    Tolerance,
}

/// Functions that read the words of their line in their own way (group 2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Special {
    /// `G4`.
    Dwell,
    /// `G10`: tool table.
    Tool,
    /// `G74`.
    ReferencePoint,
    /// `G75`.
    FixedPoint,
}

/// Functions of one group exclude each other within a line. Sinumerik numbers of the G groups in brackets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Group {
    /// Interpolation (1).
    Motion,
    /// Acts in its line only, with its own reading of the other words (2).
    Special,
    /// Working plane (6).
    Plane,
    /// Tool radius compensation (7).
    Compensation,
    /// Settable zero offset (8).
    ZeroOffset,
    /// Zero offset suppressed in its line (9).
    Suppress,
    /// Exact stop or continuous path (10).
    PathMode,
    /// Exact stop of one block (11).
    ExactStop,
    /// How exact an exact stop is (12).
    Window,
    /// Inch or metric (13).
    Unit,
    /// Absolute or incremental (14).
    Dimension,
    /// Meaning of `F` (15).
    FeedType,
    /// What `F` refers to under compensation (16).
    FeedReference,
    /// Approach to the contour (17).
    Approach,
    /// Outer corners under compensation (18).
    Corner,
    /// Start of a spline (19).
    SplineBegin,
    /// End of a spline (20).
    SplineEnd,
    /// Acceleration profile (21).
    Acceleration,
    /// Course of the feed (37).
    FeedCourse,
    /// `PW`.
    Weight,
    /// `SD`.
    Degree,
    /// `PL`.
    Interval,
    /// `CR`.
    Radius,
    /// `TURN`.
    Turns,
    /// `XH YH ZH`; they do not exclude each other.
    ToolPoint,
    /// M functions that stop or end the program.
    Flow,
    /// M functions of the spindle.
    Spindle,
    /// M functions of the coolant.
    Coolant,
    /// `M6`.
    ToolChange,
    /// M functions of the gear.
    Gear,
    /// `ADIS`.
    Distance,
    /// `ADISPOS`.
    RapidDistance,
}

impl Group {
    /// One bit per group.
    pub const fn bit(self) -> u32 {
        1 << self as u32
    }
}

/// M functions that do something, in the order in which those of one line act.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Misc {
    /// `M6`
    ToolChange,
    /// `M41` to `M45`
    GearStage,
    /// `M3`
    SpindleClockwise,
    /// `M4`
    SpindleCounterClockwise,
    /// `M7`, `M8`
    CoolantOn,
    /// `M5`; from here on behind the motion of the line.
    SpindleStop,
    /// `M9`
    CoolantOff,
    /// `M0`
    Stop,
    /// `M1`
    OptionalStop,
    /// `M2`, `M30`
    ProgramEnd,
}

impl Misc {
    /// Every function in acting order.
    pub const ORDER: [Self; 10] = [
        Self::ToolChange,
        Self::GearStage,
        Self::SpindleClockwise,
        Self::SpindleCounterClockwise,
        Self::CoolantOn,
        Self::SpindleStop,
        Self::CoolantOff,
        Self::Stop,
        Self::OptionalStop,
        Self::ProgramEnd,
    ];
    /// Bits of the functions that act before the motion of their line.
    pub const BEFORE: u16 = Self::SpindleStop.bit() - 1;

    /// One bit per function.
    pub const fn bit(self) -> u16 {
        1 << self as u8
    }
}

/// What a row does to the block being read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Action {
    /// Selects what is in force anyway.
    Nothing,
    /// Group 1.
    Motion(Mode),
    /// `G4`, `G10`, `G74`, `G75`.
    Special(Special),
    /// `G17` to `G19`.
    Plane(Plane),
    /// `G40` to `G42`.
    Side(Side),
    /// `G54` to `G57` (0 to 3), `G500` (4).
    ZeroOffset(u8),
    /// `G53`.
    SuppressOffset,
    /// `G93` to `G95`.
    FeedUnit(FeedUnit),
    /// `CFC`, `CFTCP`, `CFIN`.
    FeedReference(FeedReference),
    /// `G450`, `G451`.
    Corner(Corner),
    /// `G9`.
    ExactStopOnce,
    /// `G60`.
    ExactStop,
    /// `G64`, `G641`, `G642`.
    Continuous(Smoothing),
    /// `G70` (true), `G71`.
    Inch(bool),
    /// `G90` (true), `G91`.
    Absolute(bool),
    /// Start condition.
    Begin(BoundaryCondition),
    /// End condition.
    End(BoundaryCondition),
    /// `SOFT` (true), `BRISK`.
    Soft(bool),
    /// `PW` number.
    Weight,
    /// `SD` number.
    Degree,
    /// `PL` number.
    Interval,
    /// `CR` number.
    Radius,
    /// `TURN` number.
    Turns,
    /// `XH`, `YH`, `ZH` number: 0 to 2.
    ToolPoint(u8),
    /// `ADIS` number.
    Distance,
    /// `ADISPOS` number.
    RapidDistance,
    /// An M function.
    Misc(Misc),
    /// `M41` to `M45`: 1 to 5.
    Gear(u8),
    /// Understood, and refused: the angle of the spindle is not known.
    SpindleFeedback,
    /// Understood, and refused: the host does it.
    HostOnly,
}

/// A G or M function.
pub(super) type Row = (u32, Group, Action);

use Action as A;
use BoundaryCondition::{Natural, NotAKnot, Tangent};
use Group as G;

/// G functions, the frequent ones first.
pub(super) static G_FUNCTIONS: [Row; 47] = [
    (1, G::Motion, A::Motion(Mode::Linear)),
    (0, G::Motion, A::Motion(Mode::Rapid)),
    (6, G::Motion, A::Motion(Mode::Cubic)),
    (2, G::Motion, A::Motion(Mode::Arc(true))),
    (3, G::Motion, A::Motion(Mode::Arc(false))),
    (4, G::Special, A::Special(Special::Dwell)),
    (9, G::ExactStop, A::ExactStopOnce),
    (10, G::Special, A::Special(Special::Tool)),
    (17, G::Plane, A::Plane(Plane::Xy)),
    (18, G::Plane, A::Plane(Plane::Zx)),
    (19, G::Plane, A::Plane(Plane::Yz)),
    (33, G::Motion, A::SpindleFeedback),
    (40, G::Compensation, A::Side(Side::On)),
    (41, G::Compensation, A::Side(Side::Left)),
    (42, G::Compensation, A::Side(Side::Right)),
    (53, G::Suppress, A::SuppressOffset),
    (54, G::ZeroOffset, A::ZeroOffset(0)),
    (55, G::ZeroOffset, A::ZeroOffset(1)),
    (56, G::ZeroOffset, A::ZeroOffset(2)),
    (57, G::ZeroOffset, A::ZeroOffset(3)),
    (60, G::PathMode, A::ExactStop),
    (64, G::PathMode, A::Continuous(Smoothing::None)),
    (70, G::Unit, A::Inch(true)),
    (71, G::Unit, A::Inch(false)),
    (74, G::Special, A::Special(Special::ReferencePoint)),
    (75, G::Special, A::Special(Special::FixedPoint)),
    (90, G::Dimension, A::Absolute(true)),
    (91, G::Dimension, A::Absolute(false)),
    (93, G::FeedType, A::FeedUnit(FeedUnit::Inverse)),
    (94, G::FeedType, A::FeedUnit(FeedUnit::Minute)),
    (95, G::FeedType, A::FeedUnit(FeedUnit::Revolution)),
    (96, G::FeedType, A::SpindleFeedback),
    // ends G96, which is not to be had
    (97, G::FeedType, A::Nothing),
    (331, G::Motion, A::SpindleFeedback),
    (332, G::Motion, A::SpindleFeedback),
    (450, G::Corner, A::Corner(Corner::Arc)),
    (451, G::Corner, A::Corner(Corner::Intersection)),
    (500, G::ZeroOffset, A::ZeroOffset(NO_OFFSET)),
    // every exact stop comes to rest at the very point
    (601, G::Window, A::Nothing),
    (602, G::Window, A::Nothing),
    (603, G::Window, A::Nothing),
    (641, G::PathMode, A::Continuous(Smoothing::Distance)),
    (642, G::PathMode, A::Continuous(Smoothing::Tolerance)),
    (700, G::Unit, A::Inch(true)),
    (710, G::Unit, A::Inch(false)),
    (961, G::FeedType, A::SpindleFeedback),
    (971, G::FeedType, A::Nothing),
];

/// M functions.
pub(super) static M_FUNCTIONS: [Row; 18] = [
    (0, G::Flow, A::Misc(Misc::Stop)),
    (1, G::Flow, A::Misc(Misc::OptionalStop)),
    (2, G::Flow, A::Misc(Misc::ProgramEnd)),
    (3, G::Spindle, A::Misc(Misc::SpindleClockwise)),
    (4, G::Spindle, A::Misc(Misc::SpindleCounterClockwise)),
    (5, G::Spindle, A::Misc(Misc::SpindleStop)),
    (6, G::ToolChange, A::Misc(Misc::ToolChange)),
    (7, G::Coolant, A::Misc(Misc::CoolantOn)),
    (8, G::Coolant, A::Misc(Misc::CoolantOn)),
    (9, G::Coolant, A::Misc(Misc::CoolantOff)),
    // the end of a sub-program the host has put in place of its call
    (17, G::Flow, A::Nothing),
    (30, G::Flow, A::Misc(Misc::ProgramEnd)),
    // the gear follows the speed by itself
    (40, G::Gear, A::Nothing),
    (41, G::Gear, A::Gear(1)),
    (42, G::Gear, A::Gear(2)),
    (43, G::Gear, A::Gear(3)),
    (44, G::Gear, A::Gear(4)),
    (45, G::Gear, A::Gear(5)),
];

/// `Action::ZeroOffset` of `G500`: none.
pub(super) const NO_OFFSET: u8 = 4;

/// A word spelled out.
#[derive(Debug)]
pub(super) struct Keyword {
    /// Spelling, upper case. One that begins another takes a number and stands behind it, so glued words part in one way only.
    pub name: &'static str,
    /// A number follows, with or without `=`.
    pub takes_number: bool,
    /// Group.
    pub group: Group,
    /// Action.
    pub action: Action,
}

const fn keyword(name: &'static str, group: Group, action: Action) -> Keyword {
    let takes_number = matches!(
        action,
        A::Weight
            | A::Degree
            | A::Interval
            | A::Radius
            | A::Turns
            | A::ToolPoint(_)
            | A::Distance
            | A::RapidDistance
    );
    Keyword {
        name,
        takes_number,
        group,
        action,
    }
}

/// Keywords.
pub(super) static KEYWORDS: [Keyword; 30] = [
    keyword("PW", G::Weight, A::Weight),
    keyword("PL", G::Interval, A::Interval),
    keyword("SD", G::Degree, A::Degree),
    keyword(
        "ASPLINE",
        G::Motion,
        A::Motion(Mode::Spline(SplineKind::Akima)),
    ),
    keyword(
        "BSPLINE",
        G::Motion,
        A::Motion(Mode::Spline(SplineKind::BSpline)),
    ),
    keyword(
        "CSPLINE",
        G::Motion,
        A::Motion(Mode::Spline(SplineKind::Cubic)),
    ),
    keyword("BAUTO", G::SplineBegin, A::Begin(NotAKnot)),
    keyword("BNAT", G::SplineBegin, A::Begin(Natural)),
    keyword("BTAN", G::SplineBegin, A::Begin(Tangent)),
    keyword("EAUTO", G::SplineEnd, A::End(NotAKnot)),
    keyword("ENAT", G::SplineEnd, A::End(Natural)),
    keyword("ETAN", G::SplineEnd, A::End(Tangent)),
    keyword("POLY", G::Motion, A::Motion(Mode::Polynomial)),
    keyword("CR", G::Radius, A::Radius),
    keyword("TURN", G::Turns, A::Turns),
    keyword("XH", G::ToolPoint, A::ToolPoint(0)),
    keyword("YH", G::ToolPoint, A::ToolPoint(1)),
    keyword("ZH", G::ToolPoint, A::ToolPoint(2)),
    keyword(
        "CFC",
        G::FeedReference,
        A::FeedReference(FeedReference::Contour),
    ),
    keyword(
        "CFTCP",
        G::FeedReference,
        A::FeedReference(FeedReference::Centre),
    ),
    keyword(
        "CFIN",
        G::FeedReference,
        A::FeedReference(FeedReference::Inside),
    ),
    // the approach is straight to the offset point in any case
    keyword("NORM", G::Approach, A::Nothing),
    keyword("FNORM", G::FeedCourse, A::Nothing),
    // the end of a sub-program the host has put in place of its call
    keyword("RET", G::Flow, A::Nothing),
    keyword("GOTOB", G::Flow, A::HostOnly),
    keyword("IF", G::Flow, A::HostOnly),
    keyword("SOFT", G::Acceleration, A::Soft(true)),
    keyword("BRISK", G::Acceleration, A::Soft(false)),
    keyword("ADISPOS", G::RapidDistance, A::RapidDistance),
    keyword("ADIS", G::Distance, A::Distance),
];

/// Row of G or M function `number`.
#[inline]
pub(super) fn find(rows: &'static [Row], number: u32) -> Option<&'static Row> {
    rows.iter().find(|row| row.0 == number)
}
