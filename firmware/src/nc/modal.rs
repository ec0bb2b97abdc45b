//! What stays from line to line: the modal functions in force, the tool selected, and the numbers that lines collect
//! for a block to come. Plain data; [`super::block`] fills it in, [`super::Interpreter`] acts on it.

use super::command::{BoundaryCondition, Corner, FeedReference, Plane, Rounding, Side};
use super::error::Excerpt;
use super::lexer::Word;
use super::phrase::COEFFICIENTS;
use super::table::{FeedUnit, Mode, Smoothing};
use crate::config::Config;
use crate::units::AXES;

/// Degree of a B-spline without `SD`.
pub(super) const DEGREE: u8 = 3;
/// Bit of the denominator beside the bits of the axes.
pub(super) const DENOMINATOR: u8 = 1 << AXES;

/// Numbers that lines collect for a block to come. What counts of them is said elsewhere, so a line that fails may
/// leave numbers here that nobody reads.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lists {
    /// `G6`: K3, K2, K1 of up to all axes, in the order of the text.
    pub k: [i64; 3 * AXES],
    /// `POLY`: a2 to a5 per axis.
    pub numerators: [[f64; COEFFICIENTS - 1]; AXES],
    /// `POLY`: value at the end, b2 to b5.
    pub denominator: [f64; COEFFICIENTS],
}

impl Lists {
    /// Nothing collected.
    pub const EMPTY: Self = Self {
        k: [0; 3 * AXES],
        numerators: [[0.0; COEFFICIENTS - 1]; AXES],
        denominator: [0.0; COEFFICIENTS],
    };
}

/// State that stays from line to line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Modal {
    /// Group 1.
    pub mode: Mode,
    /// Group 19.
    pub begin: BoundaryCondition,
    /// Group 20.
    pub end: BoundaryCondition,
    /// `SD`.
    pub degree: u8,
    /// `G90`.
    pub absolute: bool,
    /// `G70`.
    pub inch: bool,
    /// `G60`.
    pub exact_stop: bool,
    /// `G64`, `G641`, `G642`.
    pub smoothing: Smoothing,
    /// `ADIS`, mm.
    pub distance: f32,
    /// `ADISPOS`, mm: the same in rapid motion.
    pub rapid_distance: f32,
    /// `SOFT`.
    pub soft: bool,
    /// Group 6.
    pub plane: Plane,
    /// Group 7, as programmed.
    pub side: Side,
    /// Group 18.
    pub corner: Corner,
    /// Group 16.
    pub feed_reference: FeedReference,
    /// Group 15.
    pub feed_unit: FeedUnit,
    /// Index of the zero offset in force, or [`super::table::NO_OFFSET`].
    pub zero_offset: u8,
    /// `D1`: radius and length of the tool count.
    pub offsets: bool,
    /// `SPLINEPATH`, one bit per axis.
    pub path: u8,
    /// Group 1 was programmed, and no block has moved since.
    pub first: bool,
    /// The spline under way has a second curve.
    pub tool_points: bool,
    /// `F` in mm per second (`G95`: per 1/60 revolution) for moves with linear axes; 0 until programmed.
    pub feed_linear: f32,
    /// The same in degrees for moves of rotary axes alone, and in blocks for `G93`; 0 until programmed.
    pub feed_rotary: f32,
    /// `S`, rpm.
    pub speed: f32,
}

/// `T`: the tool that `M6` changes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tool {
    /// `T5`.
    Number(u32),
    /// `T="FR_4"`.
    Name(Excerpt),
}

/// A number and the index of its word.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placed<T> {
    pub at: usize,
    pub value: T,
}

impl<T> Placed<T> {
    /// `value` at the place of `word`.
    pub fn new(word: &Word, value: T) -> Self {
        Self { at: word.at, value }
    }
}

impl Modal {
    /// State at power-up and behind the end of a program.
    pub fn power_up(config: &Config) -> Self {
        Self {
            mode: Mode::Linear,
            begin: config.spline_begin,
            end: config.spline_end,
            degree: DEGREE,
            absolute: true,
            inch: false,
            exact_stop: false,
            smoothing: Smoothing::None,
            distance: 0.0,
            rapid_distance: 0.0,
            soft: config.default_soft,
            plane: config.plane,
            side: Side::On,
            corner: Corner::Arc,
            feed_reference: FeedReference::Contour,
            feed_unit: FeedUnit::Minute,
            zero_offset: 0,
            offsets: true,
            path: u8::MAX,
            first: true,
            tool_points: false,
            feed_linear: config.default_feed,
            feed_rotary: config.default_feed,
            speed: 0.0,
        }
    }

    /// What becomes of the corner behind a block that moves now.
    #[inline]
    pub fn rounding(&self) -> Rounding {
        let distance = match self.smoothing {
            Smoothing::None => return Rounding::None,
            Smoothing::Tolerance => return Rounding::Tolerance,
            Smoothing::Distance if self.mode == Mode::Rapid => self.rapid_distance,
            Smoothing::Distance => self.distance,
        };
        if distance > 0.0 {
            Rounding::Distance(distance)
        } else {
            Rounding::None
        }
    }
}
