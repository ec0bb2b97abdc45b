//! What a program asks for, item by item, whatever words it was written in: the readers' answer.

/// Axes by letter, in the order of the machine.
pub const LETTERS: [char; 5] = ['X', 'Y', 'Z', 'A', 'C'];

/// Coordinates in 1e-6 mm or degree.
pub type Target = [i64; 5];

/// Which spline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Akima.
    A,
    /// Control points.
    B,
    /// Cubic.
    C,
}

/// Condition at an end of a spline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// `BAUTO`, `EAUTO`
    Auto,
    /// `BNAT`, `ENAT`
    Natural,
    /// `BTAN`, `ETAN`
    Tangent,
}

/// Which words a program is written in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Language {
    /// Sinumerik.
    #[default]
    Sinumerik,
    /// Fanuc.
    Fanuc,
    /// Heidenhain conversational.
    Heidenhain,
}

/// What of the machine a program depends on.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Setup {
    /// Words.
    pub language: Language,
    /// `G54` to `G57`.
    pub offsets: [Target; 4],
}

/// How a block moves.
#[derive(Clone, Debug, PartialEq)]
pub enum Motion {
    /// `G0`
    Rapid,
    /// `G1`
    Linear,
    /// A point of a spline.
    Spline {
        /// Which.
        kind: Kind,
        /// Conditions in force.
        ends: [End; 2],
        /// `SD`
        degree: usize,
        /// `PL`, 1 unless given.
        interval: f64,
        /// `PW`, 1 unless given.
        weight: f64,
        /// Axes of the spline.
        axes: [bool; 5],
    },
    /// `G6`, `SPL`: P = end + b3 v^3 + b2 v^2 + b1 v with v from 1 to 0; `[b3, b2, b1]` per axis.
    Cubic([[f64; 3]; 5]),
    /// `G2`, `G3`.
    Arc {
        /// First and second axis of the plane.
        plane: [usize; 2],
        /// `G2`
        clockwise: bool,
        /// Absolute centre, 1e-6 mm.
        centre: Result<[i64; 2], f64>,
        /// `TURN`
        turns: u32,
    },
    /// `POLY`
    Polynomial {
        /// `PL`
        length: f64,
        /// a2..a5 per axis that has a polynomial.
        axes: [Option<[f64; 4]>; 5],
        /// Value at the end, b2..b5.
        under: [f64; 5],
        /// Where the coefficients count from.
        origin: Target,
    },
    /// `G06.2`, whole: order, points, weights, knots.
    Nurbs {
        /// `P`
        order: usize,
        /// Control points.
        points: Vec<Target>,
        /// `R`
        weights: Vec<f64>,
        /// `K`
        knots: Vec<f64>,
    },
}

/// One thing a program does.
// Programs of tests are short: no box for the larger kind.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug, PartialEq)]
pub enum Item {
    /// Motion.
    Block {
        /// Physical line, from 1.
        line: u32,
        /// How.
        motion: Motion,
        /// Where to.
        target: Target,
        /// Programmed feed, mm/s; under `G93` blocks per second.
        feed: f64,
        /// `G93`
        inverse: bool,
        /// `G9`, `G60`
        stop: bool,
        /// `SOFT`
        soft: bool,
        /// A word of G-group 1 stood in this line or since the last motion.
        anew: bool,
    },
    /// A function that acts at standstill.
    Standstill,
}
