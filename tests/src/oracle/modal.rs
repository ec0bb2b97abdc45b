//! What [`super::read`] keeps between lines: modal state, and blocks that several lines make.

use super::item::{End, Kind, Target};

/// Modal interpolation.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Mode {
    Rapid,
    Linear,
    Arc(bool),
    Spline(Kind),
    Cubic,
    Polynomial,
    Nurbs,
}

/// Modal state.
pub(super) struct Modal {
    pub mode: Mode,
    pub anew: bool,
    pub ends: [End; 2],
    pub degree: usize,
    pub axes: [bool; 5],
    pub plane: [usize; 3],
    pub frame: Option<usize>,
    pub absolute: bool,
    pub inch: bool,
    pub inverse: bool,
    pub per_turn: bool,
    pub speed: f64,
    pub stop: bool,
    pub soft: bool,
    pub feed: f64,
}

impl Modal {
    /// A plain machine at power-up, jerk-limited.
    pub(super) fn power_up() -> Self {
        Self {
            mode: Mode::Linear,
            anew: true,
            ends: [End::Natural; 2],
            degree: 3,
            axes: [true; 5],
            plane: [0, 1, 2],
            frame: Some(0),
            absolute: true,
            inch: false,
            inverse: false,
            per_turn: false,
            speed: 0.0,
            stop: false,
            soft: true,
            feed: 0.0,
        }
    }
}

/// Nearest 1e-6 of a printed number.
pub(super) fn micro(value: f64) -> i64 {
    (value * 1e6).round() as i64
}

/// A `G6` block in progress.
pub(super) struct Printed {
    pub target: Target,
    pub length: f64,
    pub axes: Vec<usize>,
    pub k: Vec<f64>,
    pub after: bool,
}

impl Printed {
    /// facts: i runs from I down to 0; K1 is Q28, K2 Q41, K3 Q53 in thousandths.
    pub(super) fn coefficients(&self) -> [[f64; 3]; 5] {
        let mut out = [[0.0; 3]; 5];
        for (axis, k) in self.axes.iter().zip(self.k.chunks(3)) {
            let i = self.length;
            out[*axis] = [
                k[0] * 1e6 / 53_f64.exp2() * i.powi(3),
                k[1] * 1e3 / 41_f64.exp2() * i.powi(2),
                k[2] / 28_f64.exp2() * i,
            ];
        }
        out
    }
}

/// A `G06.2` curve in progress.
pub(super) struct Nurbs {
    pub line: u32,
    pub order: usize,
    pub points: Vec<Target>,
    pub weights: Vec<f64>,
    pub knots: Vec<f64>,
}
