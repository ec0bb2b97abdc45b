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
//!
//! One back substitution serves [`BATCH`] segments, so a knot costs (WINDOW + BATCH) / BATCH = 3 rows. Which segments
//! become final when depends on the number of knots only, never on when they arrive.

use heapless::Deque;

use super::boundary::Boundary;
use super::chord::{delta, zip, Chord};
use super::error::GeometryError;
use super::line::in_spline;
use super::queue::{Knot, SegmentQueue};
use super::singular::straighten;
use crate::config::Config;
use crate::units::{AxisVec, AXES};

/// Knots beyond the end of a segment that must be known before it is final.
const WINDOW: usize = 32;

/// Segments that become final at a time.
const BATCH: usize = 16;

/// One knot and its eliminated equation `m = r - c m_next`; of a final knot c = 0, so that r is its slope.
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
    rows: Deque<Row, { WINDOW + BATCH + 1 }>,
    /// Segments at the front that are final and wait to be drained.
    ready: usize,
    begin: Boundary,
    /// One bit per axis that belongs to the spline; the others go linearly from knot to knot.
    axes: u8,
    /// Chords so far, up to 3.
    chords: u8,
    /// The newest chord and the one before it.
    last: Option<Chord>,
    before: Option<Chord>,
}

impl CubicSpline {
    pub const fn new() -> Self {
        Self {
            rows: Deque::new(),
            ready: 0,
            begin: Boundary::Natural,
            axes: u8::MAX,
            chords: 0,
            last: None,
            before: None,
        }
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.rows.clear();
        self.ready = 0;
    }

    /// Begins a spline at `origin`; `axes` has one bit per axis that belongs to it.
    pub fn start(&mut self, origin: Knot, begin: Boundary, axes: u8) {
        self.clear();
        self.begin = begin;
        self.axes = axes;
        self.chords = 0;
        self.last = None;
        self.before = None;
        self.append(&origin);
    }

    /// The newest knot.
    pub fn last_mut(&mut self) -> Option<&mut Knot> {
        self.rows.back_mut().map(|row| &mut row.knot)
    }

    /// Takes the next knot; `chord` leads to it from the one before. [`CubicSpline::drain`] what is ready first.
    pub fn push(&mut self, knot: &Knot, chord: &Chord) {
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
            self.solve(&guess, BATCH);
        }
    }

    /// The spline ends at the newest knot; all of it is ready then.
    pub fn finish(&mut self, end: Boundary) {
        let Some(chord) = self.last else {
            return;
        };
        let all = self.rows.len().saturating_sub(1);
        if self.chords == 1 {
            // One chord and nothing to bend it: straight, whatever the conditions say.
            for row in &mut self.rows {
                row.c = 0.0;
                row.r = chord.slope;
            }
            self.ready = all;
            return;
        }
        let slope = self.end_slope(end);
        self.solve(&slope, all);
    }

    /// True while final segments wait.
    pub fn is_draining(&self) -> bool {
        self.ready > 0
    }

    /// Emits the next final segment.
    ///
    /// # Errors
    /// As [`SegmentQueue::emit`].
    pub fn drain(
        &mut self,
        config: &Config,
        queue: &mut SegmentQueue,
    ) -> Result<(), GeometryError> {
        self.ready = self.ready.saturating_sub(1);
        let mut rows = self.rows.iter();
        let (Some(start), Some(end)) = (rows.next(), rows.next()) else {
            self.rows.clear();
            return Ok(());
        };
        let (at, to) = (&start.knot.at, &end.knot);
        let by = delta(config, at, &to.at).map_err(|kind| to.error(kind))?;
        let slope_start = in_spline(self.axes, start.r.map(|m| m * start.h), &by);
        let slope_end = in_spline(self.axes, end.r.map(|m| m * start.h), &by);
        // A path that turns back on itself starts or ends at rest there: a line.
        let (slope_start, slope_end) = straighten(&by, slope_start, slope_end);
        let result = queue.emit_by(config, at, to, &by, slope_start, slope_end);
        self.rows.pop_front();
        result
    }

    fn append(&mut self, knot: &Knot) {
        // Never full here: a full window makes the front ready, which is drained before the next knot.
        let _ = self.rows.push_back(Row {
            knot: *knot,
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

    /// Back substitution from slope `m` at the newest knot; the first `ready` segments are final then.
    fn solve(&mut self, m: &AxisVec, ready: usize) {
        let newest = self.rows.len().saturating_sub(1);
        let mut next = *m;
        for (k, row) in self.rows.iter_mut().enumerate().rev() {
            if k < newest {
                next = zip(&row.r, &next, |r, m| r - row.c * m);
            }
            if k <= ready {
                row.c = 0.0;
                row.r = next;
            }
        }
        self.ready = ready;
    }
}
