//! The language as data: one row per G function, M function and keyword.
//!
//! The lexer looks keywords up here, the block reader groups and actions. A new modal function is a row
//! (and, if it does something new, an [`Action`]).

use super::command::{BoundaryCondition, SplineKind};

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
    /// Exact stop or continuous path (10).
    PathMode,
    /// Exact stop of one block (11).
    ExactStop,
    /// Inch or metric (13).
    Unit,
    /// Absolute or incremental (14).
    Dimension,
    /// Meaning of `F` (15).
    FeedType,
    /// Start of a spline (19).
    SplineBegin,
    /// End of a spline (20).
    SplineEnd,
    /// Acceleration profile (21).
    Acceleration,
    /// `PW`.
    Weight,
    /// `SD`.
    Degree,
    /// `PL`.
    Interval,
    /// M functions that stop or end the program.
    Flow,
    /// M functions of the spindle.
    Spindle,
    /// M functions of the coolant.
    Coolant,
    /// `M6`.
    ToolChange,
}

/// M functions that do something, in the order in which those of one line act.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Misc {
    /// `M6`
    ToolChange,
    /// `M3`
    SpindleClockwise,
    /// `M4`
    SpindleCounterClockwise,
    /// `M8`
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
    pub const ORDER: [Self; 9] = [
        Self::ToolChange,
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
    /// `G4`.
    Dwell,
    /// `G9`.
    ExactStopOnce,
    /// `G60` (true), `G64`.
    ExactStop(bool),
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
    /// An M function.
    Misc(Misc),
    /// Understood, and refused with "tool radius compensation not available".
    RefuseCompensation,
}

/// A G or M function.
pub(super) type Row = (u32, Group, Action);

use Action as A;
use BoundaryCondition::{Natural, NotAKnot, Tangent};
use Group as G;

/// G functions, the frequent ones first.
pub(super) static G_FUNCTIONS: [Row; 17] = [
    (1, G::Motion, A::Motion(Mode::Linear)),
    (0, G::Motion, A::Motion(Mode::Rapid)),
    (6, G::Motion, A::Motion(Mode::Cubic)),
    (4, G::Special, A::Dwell),
    (9, G::ExactStop, A::ExactStopOnce),
    (17, G::Plane, A::Nothing),
    (40, G::Compensation, A::Nothing),
    (41, G::Compensation, A::RefuseCompensation),
    (42, G::Compensation, A::RefuseCompensation),
    (54, G::ZeroOffset, A::Nothing),
    (60, G::PathMode, A::ExactStop(true)),
    (64, G::PathMode, A::ExactStop(false)),
    (70, G::Unit, A::Inch(true)),
    (71, G::Unit, A::Inch(false)),
    (90, G::Dimension, A::Absolute(true)),
    (91, G::Dimension, A::Absolute(false)),
    (94, G::FeedType, A::Nothing),
];

/// M functions.
pub(super) static M_FUNCTIONS: [Row; 11] = [
    (0, G::Flow, A::Misc(Misc::Stop)),
    (1, G::Flow, A::Misc(Misc::OptionalStop)),
    (2, G::Flow, A::Misc(Misc::ProgramEnd)),
    (3, G::Spindle, A::Misc(Misc::SpindleClockwise)),
    (4, G::Spindle, A::Misc(Misc::SpindleCounterClockwise)),
    (5, G::Spindle, A::Misc(Misc::SpindleStop)),
    (6, G::ToolChange, A::Misc(Misc::ToolChange)),
    (8, G::Coolant, A::Misc(Misc::CoolantOn)),
    (9, G::Coolant, A::Misc(Misc::CoolantOff)),
    // the end of a sub-program the host has put in place of its call
    (17, G::Flow, A::Nothing),
    (30, G::Flow, A::Misc(Misc::ProgramEnd)),
];

/// A word spelled out.
#[derive(Debug)]
pub(super) struct Keyword {
    /// Spelling, upper case. None is the beginning of another, so glued words part in one way only.
    pub name: &'static str,
    /// A number follows, with or without `=`.
    pub takes_number: bool,
    /// Group.
    pub group: Group,
    /// Action.
    pub action: Action,
}

const fn keyword(name: &'static str, group: Group, action: Action) -> Keyword {
    let takes_number = matches!(action, A::Weight | A::Degree | A::Interval);
    Keyword {
        name,
        takes_number,
        group,
        action,
    }
}

/// Keywords.
pub(super) static KEYWORDS: [Keyword; 14] = [
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
    keyword("SOFT", G::Acceleration, A::Soft(true)),
    keyword("BRISK", G::Acceleration, A::Soft(false)),
];

/// Row of G or M function `number`.
#[inline]
pub(super) fn find(rows: &'static [Row], number: u32) -> Option<&'static Row> {
    rows.iter().find(|row| row.0 == number)
}
