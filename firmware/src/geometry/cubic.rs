//! C-splines: the interpolating cubic spline with continuous curvature, streamed through a bounded window.
//!
//! In: knots no two neighbours of which coincide. Out: one cubic per chord.
//!
//! With knots P_k, chord lengths h_k from k to k+1, chord slopes d_k and knot slopes m_k per unit of chord
//! length, continuity of the second derivative at knot k reads (C. de Boor, "A Practical Guide to Splines", IV)
//!
//! ```text
//! lambda m_(k-1) + 2 m_k + mu m_(k+1) = 3 (lambda d_(k-1) + mu d_k),  lambda = h_k / (h_(k-1) + h_k),  mu = 1 - lambda
//! ```
//!
//! Forward elimination leaves `m_k = r_k - c_k m_(k+1)` and never has to be revised; with c <= 1/2 an error in a
//! slope halves with every knot of back substitution. Starting [`WINDOW`] knots ahead with any sound guess
//! therefore gives m_k within 2^-32 of the guess's error, which is below the rounding of `f32`.

use heapless::Deque;

use super::boundary::Boundary;
use super::chord::{delta, zip, Chord};
use super::error::GeometryError;
use super::line::in_spline;
use super::queue::{Knot, SegmentQueue};
use super::singular::straighten;
use crate::config::Config;
use crate::units::{AxisVec, Position, AXES};

/// Knots beyond the end of a segment that must be known before it is emitted.
pub(super) const WINDOW: usize = 32;

/// One knot and its eliminated equation `m = r - c m_next`.
#[derive(Clone, Copy)]
struct Row {
    knot: Knot,
    /// Chord length to the next knot.
    h: f32,
    c: f32,
    r: AxisVec,
}

/// An open C-spline.
pub(super) struct CubicSpline {
    rows: Deque<Row, { WINDOW + 2 }>,
    begin: Boundary,
    /// One bit per axis that belongs to the spline; the others go linearly from knot to knot.
    axes: u8,
    /// Chords so far, up to 3.
    chords: u8,
    /// The newest chord and the one before it.
    last: Option<Chord>,
    before: Option<Chord>,
    /// Slope already used at the front knot, once a segment has ended there.
    front: Option<AxisVec>,
}

impl CubicSpline {
    pub const fn new() -> Self {
        Self {
            rows: Deque::new(),
            begin: Boundary::Natural,
            axes: u8::MAX,
            chords: 0,
            last: None,
            before: None,
            front: None,
        }
    }

    /// Begins a spline at `origin`; `axes` has one bit per axis that belongs to it.
    pub fn start(&mut self, origin: Knot, begin: Boundary, axes: u8) {
        self.rows.clear();
        self.begin = begin;
        self.axes = axes;
        self.chords = 0;
        self.last = None;
        self.before = None;
        self.front = None;
        self.append(origin);
    }

    /// The newest knot.
    pub fn last_mut(&mut self) -> Option<&mut Knot> {
        self.rows.back_mut().map(|row| &mut row.knot)
    }

    /// Takes the next knot; `chord` leads to it from the one before.
    pub fn push(
        &mut self,
        config: &Config,
        queue: &mut SegmentQueue,
        knot: Knot,
        chord: &Chord,
    ) -> Result<(), GeometryError> {
        if let Some(last) = self.last {
            if self.chords == 1 {
                self.open_row(&last, chord);
            }
            self.eliminate(&last, chord);
        }
        if let Some(row) = self.rows.back_mut() {
            row.h = chord.length;
        }
        self.before = self.last;
        self.last = Some(*chord);
        self.chords = (self.chords + 1).min(3);
        self.append(knot);
        if self.rows.is_full() {
            let guess = self.end_slope(Boundary::Natural);
            self.release(config, queue, &guess)?;
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
        let Some(chord) = self.last else {
            return Ok(());
        };
        if self.chords == 1 {
            // One chord and nothing to bend it: straight, whatever the conditions say.
            self.front = Some(chord.slope);
            return self.drain(config, queue, &chord.slope);
        }
        let slope = self.end_slope(end);
        self.drain(config, queue, &slope)
    }

    fn append(&mut self, knot: Knot) {
        // Never full here: `push` releases the front as soon as the window is full.
        let _ = self.rows.push_back(Row {
            knot,
            h: 0.0,
            c: 0.0,
            r: [0.0; AXES],
        });
    }

    /// Equation of the very first knot, once its first two chords are known.
    fn open_row(&mut self, first: &Chord, second: &Chord) {
        let (c, r) = match self.begin {
            Boundary::Slope(slope) => (0.0, slope),
            Boundary::Auto => {
                // Not-a-knot: the third derivative is continuous at the second knot.
                let (h0, h1) = (first.length, second.length);
                let sum = h0 + h1;
                let (near, far) = ((h0 + 2.0 * sum) / sum, (h0 / h1) * (h0 / sum));
                let r = zip(&first.slope, &second.slope, |a, b| near * a + far * b);
                (sum / h1, r)
            }
            Boundary::Natural => (0.5, first.slope.map(|d| 1.5 * d)),
        };
        // Two knots at this time; the first is the front.
        if let Some(front) = self.rows.front_mut() {
            front.c = c;
            front.r = r;
        }
    }

    /// Equation of the newest knot, between chords `last` and `next`.
    fn eliminate(&mut self, last: &Chord, next: &Chord) {
        let sum = last.length + next.length;
        let (lambda, mu) = (next.length / sum, last.length / sum);
        let mut rows = self.rows.iter_mut().rev();
        let (Some(row), Some(previous)) = (rows.next(), rows.next()) else {
            return;
        };
        let scale = 1.0 / (2.0 - lambda * previous.c);
        row.c = mu * scale;
        row.r = core::array::from_fn(|axis| {
            let right = 3.0 * (lambda * last.slope[axis] + mu * next.slope[axis]);
            (right - lambda * previous.r[axis]) * scale
        });
    }

    /// Slope at the newest knot under an end condition; at least two chords.
    fn end_slope(&self, end: Boundary) -> AxisVec {
        let mut rows = self.rows.iter().rev().skip(1);
        let (Some(last), Some(before), Some(row)) = (self.last, self.before, rows.next()) else {
            return [f32::NAN; AXES];
        };
        let (h0, h1) = (before.length, last.length);
        let sum = h0 + h1;
        match end {
            Boundary::Slope(slope) => slope,
            Boundary::Natural => {
                let scale = 1.0 / (2.0 - row.c);
                zip(&last.slope, &row.r, |d, r| (3.0 * d - r) * scale)
            }
            Boundary::Auto if self.chords == 2 && self.begin == Boundary::Auto => {
                // Three knots and not-a-knot at both ends: both conditions are one, the curve is the parabola.
                zip(&before.slope, &last.slope, |a, b| {
                    2.0 * b - (h1 * a + h0 * b) / sum
                })
            }
            Boundary::Auto => {
                let scale = 1.0 / (1.0 - sum / h0 * row.c);
                core::array::from_fn(|axis| {
                    let far = (h1 / h0) * (h1 / sum) * before.slope[axis];
                    let near = (h1 + 2.0 * sum) / sum * last.slope[axis];
                    (far + near - sum / h0 * row.r[axis]) * scale
                })
            }
        }
    }

    /// Emits the front segment, back-substituting from slope `guess` at the newest knot.
    fn release(
        &mut self,
        config: &Config,
        queue: &mut SegmentQueue,
        guess: &AxisVec,
    ) -> Result<(), GeometryError> {
        let mut m = *guess;
        let inner = self.rows.len().saturating_sub(2);
        for row in self.rows.iter().rev().skip(1).take(inner) {
            m = zip(&row.r, &m, |r, next| r - row.c * next);
        }
        let (Some(start), Some(end)) = (self.rows.pop_front(), self.rows.front()) else {
            return Ok(());
        };
        let at_start = self
            .front
            .unwrap_or_else(|| zip(&start.r, &m, |r, next| r - start.c * next));
        self.front = Some(m);
        let slope_start = at_start.map(|value| value * start.h);
        let slope_end = m.map(|value| value * start.h);
        emit(
            config,
            queue,
            self.axes,
            &start.knot.at,
            &end.knot,
            slope_start,
            slope_end,
        )
    }

    /// Emits everything, the newest knot having slope `m`.
    fn drain(
        &mut self,
        config: &Config,
        queue: &mut SegmentQueue,
        m: &AxisVec,
    ) -> Result<(), GeometryError> {
        // Solve in place: `r` becomes the slope of its knot.
        let mut next = *m;
        let mut rows = self.rows.iter_mut().rev();
        if let Some(newest) = rows.next() {
            newest.r = next;
        }
        for row in rows {
            row.r = zip(&row.r, &next, |r, m| r - row.c * m);
            next = row.r;
        }
        if let (Some(front), Some(slope)) = (self.rows.front_mut(), self.front) {
            front.r = slope;
        }
        while let Some(start) = self.rows.pop_front() {
            let Some(end) = self.rows.front() else {
                break;
            };
            let slope_start = start.r.map(|value| value * start.h);
            let slope_end = end.r.map(|value| value * start.h);
            emit(
                config,
                queue,
                self.axes,
                &start.knot.at,
                &end.knot,
                slope_start,
                slope_end,
            )?;
        }
        Ok(())
    }
}

/// Emits one cubic over the axes of the spline; a straight one that starts or ends at rest (a path that turns back on itself) as a line.
fn emit(
    config: &Config,
    queue: &mut SegmentQueue,
    axes: u8,
    start: &Position,
    end: &Knot,
    slope_start: AxisVec,
    slope_end: AxisVec,
) -> Result<(), GeometryError> {
    let by = delta(config, start, &end.at).map_err(|kind| end.error(kind))?;
    let slope_start = in_spline(axes, slope_start, &by);
    let slope_end = in_spline(axes, slope_end, &by);
    let (slope_start, slope_end) = straighten(&by, slope_start, slope_end);
    queue.emit(config, start, end, slope_start, slope_end)
}
