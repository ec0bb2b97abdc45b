//! The tool-path feed of a recorded run against the programmed one, where no limit binds.
//!
//! In: a [`Run`], the [`Config`] it ran on, and the curves the program asks for ([`crate::oracle`]). Out: [`Fluctuation`], and the
//! time each text line took.
//!
//! What is measured: the way from one commanded position to the next, over the linear axes (over the rotary axes where
//! those rest), times the servo frequency. The way is an arc of which two positions give the chord; the bend that the
//! positions beside them show makes up for it to the second order, `arc = chord (1 + (chord * curvature)^2 / 24)`. At 80 mm/s
//! on a radius of 1 mm that is 1e-5, a tenth of what is held.
//!
//! Where no limit binds: the curves of the oracle are sampled as if the path were run at the programmed feed from the
//! first tick to the last, stops included ([`Ideal`]). Differences of the samples are the velocity, acceleration and jerk
//! that asks of each axis. Where they are over a share of a limit, it may bind; so it may as far from there as it takes to
//! change the feed by all of it. Whatever is left is judged. Nothing of this is taken from the planner.

pub mod ideal;
pub mod programs;
pub mod way;

use pentaspline::config::Config;

use crate::drive::Run;
use crate::laws::place;
use crate::oracle::path::Curve;
use crate::oracle::spline::Point;
use ideal::Ideal;
use way::{size, Counts};

/// Turn from one tick to the next, rad, above which there is a corner and no bend.
const CORNER: f64 = 0.1;

/// How far the feed of a run is off.
#[derive(Clone, Copy, Debug, Default)]
pub struct Fluctuation {
    /// Largest `|v / F - 1|` among the judged ticks.
    pub worst: f64,
    /// Tick of it.
    pub tick: usize,
    /// Text line of it.
    pub line: u32,
    /// Ticks judged.
    pub judged: usize,
    /// Ticks in motion.
    pub moving: usize,
}

/// Time a text line took.
#[derive(Clone, Copy, Debug)]
pub struct Taken {
    /// Text line.
    pub line: u32,
    /// From its start to its end, in ticks, parts of ticks included.
    pub ticks: f64,
    /// The same as programmed.
    pub programmed: f64,
    /// No limit binds from start to end.
    pub free: bool,
}

/// Way of tick `i` of `places` over the axes that count.
fn way(places: &[Point], i: usize, counts: &Counts) -> f64 {
    let by = |i: usize| -> Point { core::array::from_fn(|a| places[i][a] - places[i - 1][a]) };
    let here = by(i);
    let chord = size(&here, counts);
    if chord == 0.0 {
        return 0.0;
    }
    // Half the difference of the ways before and behind, less its part along the way.
    let (before, behind) = (by(i - 1), by(i + 1));
    let bend: Point = core::array::from_fn(|a| 0.5 * (behind[a] - before[a]));
    let counted = (0..here.len()).filter(|a| counts[*a]);
    let along = counted.map(|a| bend[a] * here[a]).sum::<f64>() / (chord * chord);
    let across: Point = core::array::from_fn(|a| bend[a] - along * here[a]);
    let turn = (size(&across, counts) / chord).min(CORNER);
    chord * (1.0 + turn * turn / 24.0)
}

/// Ways of all ticks; `s` behind each.
fn ways(config: &Config, run: &Run, ideal: &Ideal) -> Vec<f64> {
    let mut places: Vec<Point> = run.ticks.iter().map(|tick| place(config, tick)).collect();
    // At rest before and behind.
    if let (Some(first), Some(last)) = (places.first().copied(), places.last().copied()) {
        places.insert(0, first);
        places.push(last);
    }
    let mut s = 0.0;
    let behind = |i: usize| {
        if let (Some(sample), true) = (ideal.sample(s), i > 1) {
            s += way(&places, i, &sample.counts);
        }
        s
    };
    (1..places.len().saturating_sub(1)).map(behind).collect()
}

/// Holds the feed of `run` against `ideal`.
#[must_use]
pub fn fluctuation(config: &Config, run: &Run, ideal: &Ideal) -> Fluctuation {
    let hz = f64::from(config.servo_hz);
    let mut found = Fluctuation::default();
    let mut from = 0.0;
    for (i, to) in ways(config, run, ideal).into_iter().enumerate() {
        let start = std::mem::replace(&mut from, to);
        found.moving += usize::from(run.ticks[i].moving);
        let (Some(sample), Some(next)) = (ideal.sample(start), ideal.sample(to)) else {
            continue;
        };
        if !run.ticks[i].moving || sample.feed != next.feed || !ideal.is_free(start, to) {
            continue;
        }
        found.judged += 1;
        let off = ((to - start) * hz / sample.feed - 1.0).abs();
        if off > found.worst {
            (found.worst, found.tick, found.line) = (off, i, run.ticks[i].block);
        }
    }
    found
}

/// The time each text line of `ideal` took in `run`.
#[must_use]
pub fn times(config: &Config, run: &Run, ideal: &Ideal) -> Vec<Taken> {
    let hz = f64::from(config.servo_hz);
    let ways = ways(config, run, ideal);
    let passed = |s: f64| -> f64 {
        let k = ways.partition_point(|way| *way < s);
        match (k.checked_sub(1).map(|k| ways[k]), ways.get(k)) {
            (Some(before), Some(&behind)) => k as f64 + (s - before) / (behind - before),
            _ => k as f64,
        }
    };
    ideal
        .ends
        .iter()
        .map(|end| {
            let start = end.s - end.length;
            Taken {
                line: end.line,
                ticks: passed(end.s) - passed(start),
                programmed: end.length / end.feed * hz,
                free: ideal.is_free(start, end.s),
            }
        })
        .collect()
}

/// The run of `curves` at `share` of the programmed feed, and how far `run` is off it.
#[must_use]
pub fn against(config: &Config, run: &Run, curves: &[Curve], share: f64) -> Fluctuation {
    fluctuation(config, run, &Ideal::new(config, curves, share))
}
