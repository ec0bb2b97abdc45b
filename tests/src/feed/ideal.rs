//! What a program asks of the axes if every tick of it is run at the programmed feed, and where limits may bind then.
//!
//! In: the curves of the oracle, and the machine. Out: an [`Ideal`] run over the arc length.

use pentaspline::config::Config;
use pentaspline::units::AXES;

use super::way::{Counts, Way};
use crate::oracle::path::Curve;
use crate::oracle::spline::Point;

/// Share of the acceleration and jerk of an axis up to which its limit is not taken to bind. A step of the curvature is
/// spread over a few ticks by sampling; the step itself may be twice what the differences show.
pub const SHARE: f64 = 0.1;

/// The same for velocity.
const SHARE_VELOCITY: f64 = 0.95;

/// Without `SOFT`: share of an acceleration by which it may change from tick to tick.
const SHARE_STEP: f64 = 0.03;

/// Ticks by which a change of the feed may take longer than jerk and acceleration demand, since jerk changes with ticks.
const TICKS: f64 = 12.0;

/// One tick.
#[derive(Clone, Debug)]
pub struct Sample {
    /// Way so far, at the end of the tick, mm (degrees).
    pub s: f64,
    place: Point,
    /// Axes that make up the way.
    pub counts: Counts,
    /// Programmed feed in the tick, mm/s or degree/s.
    pub feed: f64,
    soft: bool,
}

/// Where a text line ends.
#[derive(Clone, Copy, Debug)]
pub struct End {
    /// Text line.
    pub line: u32,
    /// Way so far.
    pub s: f64,
    /// Length of the line.
    pub length: f64,
    /// Programmed feed, mm/s or degree/s.
    pub feed: f64,
}

/// The path as it would be run if every tick went at the programmed feed.
#[derive(Clone, Debug, Default)]
pub struct Ideal {
    samples: Vec<Sample>,
    /// Stretches of the way where a limit may bind, in order, apart from each other.
    bound: Vec<[f64; 2]>,
    /// Ends of the text lines in feed.
    pub ends: Vec<End>,
}

/// Way in which jerk `j` and acceleration `a` change the feed from 0 to `v`, or back, and the time of it.
#[must_use]
pub fn ramp(v: f64, a: f64, j: f64) -> (f64, f64) {
    let time = if v < a * a / j {
        2.0 * (v / j).sqrt()
    } else {
        v / a + a / j
    };
    (0.5 * v * time, time)
}

impl Ideal {
    /// Runs `curves` at `share` times the programmed feed.
    #[must_use]
    pub fn new(config: &Config, curves: &[Curve], share: f64) -> Self {
        let mut ideal = Self::default();
        let (mut s, mut left, mut rest) = (0.0, 1.0, true);
        let mut end: Option<Point> = None;
        for of_line in curves.chunk_by(|a, b| a.line == b.line) {
            let ways: Vec<Way> = of_line.iter().map(|c| Way::new(config, &c.shape)).collect();
            let length: f64 = ways.iter().map(Way::length).sum();
            let Some(curve) = of_line.first() else {
                continue;
            };
            let feed = match curve.inverse {
                true => curve.feed * share * length,
                false => curve.feed * share,
            };
            for (curve, way) in of_line.iter().zip(&ways) {
                let run = Run {
                    way,
                    gap: gap(end, &curve.shape.at(0.0)),
                    feed,
                    soft: curve.soft,
                };
                if rest || !feed.is_finite() {
                    ideal.stand(&run, s, 0.0);
                    left = 1.0;
                }
                if feed.is_finite() {
                    left = ideal.advance(&run, s, left, f64::from(config.servo_hz));
                } else {
                    ideal.bound.push([s, s + way.length()]);
                }
                s += way.length();
                rest = curve.stop || !feed.is_finite();
                if rest {
                    ideal.stand(&run, s, way.length());
                }
                end = Some(curve.shape.at(1.0));
            }
            if feed.is_finite() {
                let line = curve.line;
                ideal.ends.push(End {
                    line,
                    s,
                    length,
                    feed,
                });
            }
        }
        ideal.find_bounds(config);
        ideal
    }

    /// Stands still on a curve whose start is at `s`.
    fn stand(&mut self, run: &Run, s: f64, along: f64) {
        // Enough for a third difference of nothing.
        for _ in 0..4 {
            self.samples.push(run.sample(s, along));
        }
    }

    /// Runs a curve whose start is at `s`, the first tick ending after `left` of a tick; what is left of the tick at its end.
    fn advance(&mut self, run: &Run, s: f64, left: f64, hz: f64) -> f64 {
        let step = run.feed / hz;
        let mut along = left * step;
        while along < run.way.length() {
            let mut sample = run.sample(0.0, along);
            sample.s = s + along;
            self.samples.push(sample);
            along += step;
        }
        (along - run.way.length()) / step
    }

    /// Marks what is over the shares, and as much around it as a change of the feed takes.
    fn find_bounds(&mut self, config: &Config) {
        let hz = f64::from(config.servo_hz);
        let mut marks = std::mem::take(&mut self.bound);
        // Least acceleration and jerk for changing the feed where no limit binds.
        let (mut a_path, mut j_path) = (f64::INFINITY, f64::INFINITY);
        for ticks in self.samples.windows(4) {
            let [p0, p1, p2, p3] = [0, 1, 2, 3].map(|k| &ticks[k].place);
            let Sample { feed, soft, s, .. } = ticks[3];
            let mut binds = false;
            let (mut a_here, mut j_here) = (f64::INFINITY, f64::INFINITY);
            for a in 0..AXES {
                let axis = &config.axes[a];
                let [v_max, a_max, j_max] = [axis.v_max, axis.a_max, axis.j_max].map(f64::from);
                let d1 = (p3[a] - p2[a]) * hz;
                let d2 = (p3[a] - 2.0 * p2[a] + p1[a]) * hz * hz;
                let d3 = (p3[a] - 3.0 * (p2[a] - p1[a]) - p0[a]) * hz * hz * hz;
                let most = if soft {
                    SHARE * j_max
                } else {
                    SHARE_STEP * a_max * hz
                };
                binds |= d1.abs() > SHARE_VELOCITY * v_max
                    || d2.abs() > SHARE * a_max
                    || d3.abs() > most;
                let rate = d1.abs() / feed;
                if rate > 1e-9 {
                    a_here = a_here.min(SHARE * a_max / rate);
                    j_here = j_here.min(SHARE * j_max / rate);
                }
                // A change of the feed by a where it bends with d2 takes a jerk of 3 a d2 / F (chain rule).
                if soft && d2.abs() > 1e-6 * a_max {
                    a_here = a_here.min(SHARE * j_max * feed / (3.0 * d2.abs()));
                }
            }
            if binds {
                marks.push([ticks[0].s, s]);
            } else {
                (a_path, j_path) = (a_path.min(a_here), j_path.min(j_here));
            }
        }
        let feeds = self.samples.iter().map(|sample| sample.feed);
        let feed = feeds.filter(|feed| feed.is_finite()).fold(0.0, f64::max);
        let margin = ramp(feed, a_path, j_path).0 + TICKS * feed / hz;
        marks.sort_by(|a, b| a[0].total_cmp(&b[0]));
        for [from, to] in marks {
            self.exclude(from - margin, to + margin);
        }
    }

    /// Takes limits to bind between `from`, which is not before what was excluded last, and `to`.
    fn exclude(&mut self, from: f64, to: f64) {
        match self.bound.last_mut() {
            Some(last) if last[1] >= from => last[1] = last[1].max(to),
            _ => self.bound.push([from, to]),
        }
    }

    /// Takes limits to bind over the first `length` of the way.
    pub fn exclude_start(&mut self, length: f64) {
        for range in &mut self.bound {
            if range[0] < length {
                range[1] = range[1].max(length);
            }
        }
    }

    /// The tick in which the way is `s`.
    #[must_use]
    pub fn sample(&self, s: f64) -> Option<&Sample> {
        let k = self.samples.partition_point(|sample| sample.s < s);
        self.samples.get(k).or(self.samples.last())
    }

    /// No limit binds from `from` to `to`.
    #[must_use]
    pub fn is_free(&self, from: f64, to: f64) -> bool {
        let k = self.bound.partition_point(|range| range[1] < from);
        self.bound.get(k).is_none_or(|range| range[0] > to)
    }
}

/// A curve at its feed.
struct Run<'a> {
    way: &'a Way<'a>,
    gap: Point,
    feed: f64,
    soft: bool,
}

impl Run<'_> {
    /// Printed coefficients miss the end of the block before by their rounding; driven is the curve with their slopes
    /// that starts there.
    fn sample(&self, s: f64, along: f64) -> Sample {
        let t = along / self.way.length();
        let share = (1.0 - t) * (1.0 - t) * (1.0 + 2.0 * t);
        let point = self.way.at(along);
        Sample {
            s,
            place: core::array::from_fn(|a| point[a] + share * self.gap[a]),
            counts: self.way.counts,
            feed: self.feed,
            soft: self.soft,
        }
    }
}

fn gap(end: Option<Point>, start: &Point) -> Point {
    core::array::from_fn(|a| end.map_or(0.0, |end| end[a] - start[a]))
}
