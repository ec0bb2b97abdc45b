//! A-splines: Akima's interpolation, streamed with two knots of look-ahead.
//!
//! In: knots no two neighbours of which coincide. Out: one cubic per chord.
//! Source: H. Akima, "A new method of interpolation and smooth curve fitting based on local procedures",
//! J. ACM 17 (1970) 589-602, on the chord-length parameter (shared facts 6), each axis on its own.

use super::boundary::Boundary;
use super::chord::{delta, zip, Chord};
use super::error::{GeometryError, GeometryErrorKind};
use super::line::in_spline;
use super::queue::{Knot, SegmentQueue};
use super::singular;
use crate::config::Config;
use crate::units::{AxisVec, Steps, AXES};

/// Below this fraction of the slopes, differences of slopes are rounding of `f32` and weigh nothing.
///
/// A slope carries about 3e-7 of relative error; coordinates of 0.001 mm differ by more than 1e-5 in slope
/// on chords up to 100 mm.
const WEIGHT_FLOOR: f32 = 1e-6;

/// An open A-spline.
pub(super) struct AkimaSpline {
    /// The last four knots, newest last.
    knots: [Knot; 4],
    /// Lengths of the last three chords.
    lengths: [f32; 3],
    /// Slopes of the last four chords, real or extrapolated.
    slopes: [AxisVec; 4],
    /// Chords so far, up to 3.
    chords: u8,
    begin: Boundary,
    /// One bit per axis that belongs to the spline; the others go linearly from knot to knot.
    axes: u8,
    /// Slope at the start of the next segment to be emitted.
    m: AxisVec,
}

impl AkimaSpline {
    pub const fn new() -> Self {
        const NOWHERE: Knot = Knot::origin([Steps::ZERO; AXES]);
        Self {
            knots: [NOWHERE; 4],
            lengths: [0.0; 3],
            slopes: [[0.0; AXES]; 4],
            chords: 0,
            begin: Boundary::Auto,
            axes: u8::MAX,
            m: [0.0; AXES],
        }
    }

    /// Begins a spline at `origin`; `axes` has one bit per axis that belongs to it.
    pub fn start(&mut self, origin: Knot, begin: Boundary, axes: u8) {
        self.knots[3] = origin;
        self.begin = begin;
        self.axes = axes;
        self.chords = 0;
    }

    /// The newest knot.
    pub fn last_mut(&mut self) -> &mut Knot {
        &mut self.knots[3]
    }

    /// Takes the next knot; `chord` leads to it from the one before.
    pub fn push(
        &mut self,
        config: &Config,
        queue: &mut SegmentQueue,
        knot: Knot,
        chord: &Chord,
    ) -> Result<(), GeometryError> {
        self.knots.rotate_left(1);
        self.knots[3] = knot;
        self.lengths.rotate_left(1);
        self.lengths[2] = chord.length;
        self.shift(chord.slope);
        match self.chords {
            0 => self.chords = 1,
            1 => {
                let [_, _, first, second] = self.slopes;
                self.slopes[1] = zip(&first, &second, |a, b| 2.0 * a - b);
                self.slopes[0] = zip(&first, &second, |a, b| 3.0 * a - 2.0 * b);
                self.m = knot_slope(&self.slopes);
                self.chords = 2;
            }
            _ => {
                let m = knot_slope(&self.slopes);
                if self.chords == 2 {
                    self.apply_begin(&m);
                    self.chords = 3;
                }
                self.segment(config, queue, 0, &m)?;
            }
        }
        Ok(())
    }

    /// The spline ends at the newest knot.
    pub fn finish(
        &mut self,
        config: &Config,
        queue: &mut SegmentQueue,
        end: Boundary,
    ) -> Result<(), GeometryError> {
        let [.., before, last] = self.slopes;
        if self.chords == 1 {
            self.m = last;
            return self.segment(config, queue, 2, &last);
        }
        self.shift(zip(&before, &last, |a, b| 2.0 * b - a));
        let inner = knot_slope(&self.slopes);
        if self.chords == 2 {
            self.apply_begin(&inner);
        }
        self.segment(config, queue, 1, &inner)?;
        self.shift(zip(&before, &last, |a, b| 3.0 * b - 2.0 * a));
        let outer = match end {
            Boundary::Auto => knot_slope(&self.slopes),
            Boundary::Natural => natural(&last, &inner),
            Boundary::Slope(slope) => slope,
        };
        self.segment(config, queue, 2, &outer)
    }

    /// Replaces Akima's slope at the first knot; `inner` is the slope at the second.
    fn apply_begin(&mut self, inner: &AxisVec) {
        match self.begin {
            Boundary::Auto => {}
            // The slopes now end at the third chord (or its extrapolation): the first is two before.
            Boundary::Natural => self.m = natural(&self.slopes[1], inner),
            Boundary::Slope(slope) => self.m = slope,
        }
    }

    fn shift(&mut self, slope: AxisVec) {
        self.slopes.rotate_left(1);
        self.slopes[3] = slope;
    }

    /// Emits the cubic from knot `at` of the window to the next, ending with slope `m`.
    fn segment(
        &mut self,
        config: &Config,
        queue: &mut SegmentQueue,
        at: usize,
        m: &AxisVec,
    ) -> Result<(), GeometryError> {
        let (Some(start), Some(end), Some(h)) = (
            self.knots.get(at),
            self.knots.get(at + 1),
            self.lengths.get(at),
        ) else {
            return Err(self.knots[3].error(GeometryErrorKind::NotFinite));
        };
        let by = delta(config, &start.at, &end.at).map_err(|kind| end.error(kind))?;
        let slope_start = in_spline(self.axes, self.m.map(|value| value * h), &by);
        let slope_end = in_spline(self.axes, m.map(|value| value * h), &by);
        singular::emit(config, queue, &start.at, end, slope_start, slope_end)?;
        self.m = *m;
        Ok(())
    }
}

/// Slope at the end of a natural cubic over a chord of slope `d` whose other end has slope `m`.
fn natural(d: &AxisVec, m: &AxisVec) -> AxisVec {
    zip(d, m, |d, m| 1.5 * d - 0.5 * m)
}

/// Akima's slope at the knot between the second and the third of four chords.
fn knot_slope(slopes: &[AxisVec; 4]) -> AxisVec {
    core::array::from_fn(|axis| {
        let [a, b, c, d] = [
            slopes[0][axis],
            slopes[1][axis],
            slopes[2][axis],
            slopes[3][axis],
        ];
        let left = (d - c).abs();
        let right = (b - a).abs();
        let floor = WEIGHT_FLOOR * (a.abs() + b.abs() + c.abs() + d.abs());
        if left + right <= floor {
            0.5 * (b + c)
        } else {
            (left * b + right * c) / (left + right)
        }
    })
}
