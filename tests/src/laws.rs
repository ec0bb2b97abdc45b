//! Laws of motion, checked on a recorded run without any of the planner's code.
//!
//! In: a [`Run`], the [`Config`] it ran on and, where the path matters, the curves the program asks for
//! ([`crate::oracle`]). Out: `Err` with the tick and the text line where a law is broken first or worst.

use std::collections::{BTreeSet, HashMap};

use pentaspline::config::Config;
use pentaspline::units::AXES;

use crate::drive::{Run, Tick};
use crate::oracle::path::{nearest, Curve};
use crate::oracle::read::Target;
use crate::oracle::spline::{distance, Point};

/// Units of Q32.32 per step.
const STEP: f64 = 4_294_967_296.0;

/// Path velocity below this is rounding of a stop, mm/s.
const STILL: f32 = 1e-6;

/// Largest observed derivative of each axis over its limit.
#[derive(Clone, Copy, Debug, Default)]
pub struct Peaks {
    /// Velocity share of the limit, per axis.
    pub v: [f64; AXES],
    /// Acceleration share.
    pub a: [f64; AXES],
    /// Jerk share.
    pub j: [f64; AXES],
    /// Tick of the largest share of all.
    pub worst_tick: usize,
}

/// Position of a tick in mm and degrees.
#[must_use]
pub fn place(config: &Config, tick: &Tick) -> Point {
    core::array::from_fn(|a| {
        tick.commanded[a] as f64 / STEP / config.axes[a].steps_per_unit.to_num::<f64>()
    })
}

/// Q32.32 steps of a programmed point: the nearest to `target * steps / unit`, in exact integers.
#[must_use]
pub fn bits(config: &Config, target: &Target) -> [i64; AXES] {
    core::array::from_fn(|a| {
        let scaled = i128::from(target[a]) * i128::from(config.axes[a].steps_per_unit.to_bits());
        // Twice the value, rounded half away from zero.
        let doubled = 2 * scaled.abs() + 1_000_000;
        (scaled.signum() * (doubled / 2_000_000)) as i64
    })
}

/// Differentiates the commanded positions: exact integer differences of the Q32.32 steps, then `f64`.
///
/// The machine stands still before the first tick and after the last. Jerk is not taken where one of the four ticks
/// it is made of executes a line of `brisk` (motion that is not jerk-limited).
#[must_use]
pub fn peaks(config: &Config, run: &Run, brisk: &BTreeSet<u32>) -> Peaks {
    let hz = f64::from(config.servo_hz);
    let mut peaks = Peaks::default();
    let mut worst = 0.0;
    let Some(last) = run.ticks.len().checked_sub(1) else {
        return peaks;
    };
    let tick = |i: usize| i.checked_sub(3).map(|i| &run.ticks[i.min(last)]);
    let free: Vec<bool> = (0..run.ticks.len() + 6)
        .map(|i| tick(i).is_some_and(|t| brisk.contains(&t.block)))
        .collect();
    for axis in 0..AXES {
        let c = &config.axes[axis];
        let scale = 1.0 / (c.steps_per_unit.to_num::<f64>() * STEP);
        let at = |i: usize| i128::from(tick(i).map_or(0, |t| t.commanded[axis]));
        for i in 3..run.ticks.len() + 6 {
            let d1 = (at(i) - at(i - 1)) as f64 * scale * hz;
            let d2 = (at(i) - 2 * at(i - 1) + at(i - 2)) as f64 * scale * hz * hz;
            let d3 =
                (at(i) - 3 * at(i - 1) + 3 * at(i - 2) - at(i - 3)) as f64 * scale * hz * hz * hz;
            let mut note = |peak: &mut f64, share: f64| {
                *peak = peak.max(share);
                if share > worst {
                    worst = share;
                    peaks.worst_tick = (i - 3).min(last);
                }
            };
            note(&mut peaks.v[axis], d1.abs() / f64::from(c.v_max));
            note(&mut peaks.a[axis], d2.abs() / f64::from(c.a_max));
            if !free[i - 3..=i].contains(&true) {
                note(&mut peaks.j[axis], d3.abs() / f64::from(c.j_max));
            }
        }
    }
    peaks
}

/// Lines of `curves` without jerk limit.
#[must_use]
pub fn brisk_lines(curves: &[Curve]) -> BTreeSet<u32> {
    let brisk = curves.iter().filter(|curve| !curve.soft);
    brisk.map(|curve| curve.line).collect()
}

/// Velocity, acceleration and jerk of every axis stay within 1 + `tolerance` of the limits at every tick;
/// jerk not on the lines `brisk`.
///
/// # Errors
/// Says which axis breaks which limit, and by how much.
pub fn stays_within_limits(
    config: &Config,
    run: &Run,
    brisk: &BTreeSet<u32>,
    tolerance: f64,
) -> Result<(), String> {
    let peaks = peaks(config, run, brisk);
    for axis in 0..AXES {
        for (name, share) in [
            ("velocity", peaks.v),
            ("acceleration", peaks.a),
            ("jerk", peaks.j),
        ] {
            if share[axis] > 1.0 + tolerance {
                let near = peaks.worst_tick;
                return Err(format!(
                    "axis {} {name} reaches {:.4} of its limit (worst near tick {near}, line {})",
                    char::from(config.axes[axis].letter),
                    share[axis],
                    run.ticks.get(near).map_or(0, |t| t.block),
                ));
            }
        }
    }
    Ok(())
}

/// The frames of the run add up to the commanded position rounded half up, at every tick.
///
/// # Errors
/// Says at which tick they do not.
pub fn emits_exactly_the_commanded_steps(run: &Run) -> Result<(), String> {
    for (i, tick) in run.ticks.iter().enumerate() {
        for axis in 0..AXES {
            let rounded = (i128::from(tick.commanded[axis]) + (1 << 31)).div_euclid(1 << 32);
            if i128::from(tick.summed[axis]) != rounded || i128::from(tick.emitted[axis]) != rounded
            {
                return Err(format!(
                    "tick {i} axis {axis}: commanded rounds to {rounded}, frames add up to {}, emitted says {}",
                    tick.summed[axis], tick.emitted[axis]
                ));
            }
        }
    }
    Ok(())
}

/// The run ends at rest exactly on `target` (Q32.32 steps).
///
/// # Errors
/// Says which axis ends where.
pub fn ends_exactly_on(run: &Run, target: &[i64; AXES]) -> Result<(), String> {
    let last = run.ticks.last().ok_or("nothing ran")?;
    if last.commanded == *target {
        Ok(())
    } else {
        Err(format!(
            "ends on {:?}, programmed {target:?}",
            last.commanded
        ))
    }
}

/// The tool never runs backwards: the stated path velocity is not negative.
///
/// # Errors
/// Says at which tick it is.
pub fn never_runs_backwards(run: &Run) -> Result<(), String> {
    let back = run.ticks.iter().position(|tick| !(tick.feed >= -STILL));
    back.map_or(Ok(()), |i| {
        let Tick { feed, block, .. } = run.ticks[i];
        Err(format!("tick {i}, line {block}: path velocity {feed}"))
    })
}

/// What [`follows`] found.
#[derive(Clone, Copy, Debug, Default)]
pub struct Followed {
    /// Largest distance of a commanded position from its curve, mm (degree).
    pub deviation: f64,
    /// Curves the run has been on.
    pub curves: usize,
}

/// Every commanded position lies within `tolerance` of the curve of the line in execution; curves come in order, and
/// along each the tool only goes forward.
///
/// # Errors
/// Says where the path is left, run out of order, or run backwards.
pub fn follows(
    config: &Config,
    run: &Run,
    curves: &[Curve],
    tolerance: f64,
) -> Result<Followed, String> {
    let by_line: HashMap<u32, usize> = curves.iter().zip(0..).map(|(c, k)| (c.line, k)).collect();
    let (mut at, mut u, mut furthest) = (usize::MAX, 0.0, [0.0; AXES]);
    let mut found = Followed::default();
    for (i, tick) in run.ticks.iter().enumerate().filter(|(_, t)| t.moving) {
        let block = tick.block;
        let here = |what: String| format!("tick {i}, line {block}: {what}");
        let index = *by_line
            .get(&block)
            .ok_or_else(|| here("no curve belongs to this line".into()))?;
        let curve = &curves[index];
        if index != at {
            if at != usize::MAX && index < at {
                return Err(here(format!("runs after line {}", curves[at].line)));
            }
            (at, u) = (index, 0.0);
            furthest = curve.shape.at(0.0);
            found.curves += 1;
        }
        let place = place(config, tick);
        let (next, off) = nearest(&curve.shape, &place, u, tolerance);
        if !(off <= tolerance) {
            return Err(here(format!("{off:.6} from its curve at {place:?}")));
        }
        found.deviation = found.deviation.max(off);
        if next > u {
            (u, furthest) = (next, curve.shape.at(next));
        } else if distance(&furthest, &curve.shape.at(next)) > tolerance {
            return Err(here(format!("back from u = {u} to {next}")));
        }
    }
    Ok(found)
}

/// Programmed points are met: exactly where the path has to rest there, else passed at a distance the tool covers
/// within one tick. A point has to be rested on if the program says so, or if no axis allows a corner velocity step and
/// the path turns by more than 0.1 (jerk-limited), or by more than 0.25 and so fast that some axis has to change its
/// velocity in one tick by more than its acceleration allows.
///
/// # Errors
/// Says which point is missed and by how much.
pub fn meets_the_points(config: &Config, run: &Run, curves: &[Curve]) -> Result<(), String> {
    let order: HashMap<u32, usize> = curves.iter().zip(0..).map(|(c, k)| (c.line, k)).collect();
    let corners_rest = config.axes.iter().all(|axis| axis.corner_step == 0.0);
    let moving: Vec<&Tick> = run.ticks.iter().filter(|tick| tick.moving).collect();
    let mut next = 0;
    for (k, curve) in curves.iter().enumerate() {
        let Some(target) = &curve.end else { continue };
        while next < moving.len() && order.get(&moving[next].block).is_some_and(|at| *at <= k) {
            next += 1;
        }
        if next == 0 {
            return Err(format!("line {} is never reached", curve.line));
        }
        let before = moving[next - 1];
        let turns = curves.get(k + 1).is_some_and(|after| {
            let unit = |v: Point| {
                let length = distance(&v, &[0.0; AXES]);
                v.map(|x| x / length)
            };
            let (a, b) = (unit(curve.shape.slope(1.0)), unit(after.shape.slope(0.0)));
            if curve.soft {
                return distance(&a, &b) > 0.1;
            }
            let around = &moving[next.saturating_sub(2)..moving.len().min(next + 2)];
            let covered = around
                .windows(2)
                .map(|pair| distance(&place(config, pair[0]), &place(config, pair[1])))
                .fold(0.0, f64::max);
            (0..AXES).any(|i| {
                let turn = (b[i] - a[i]).abs();
                let most = f64::from(config.axes[i].a_max) / f64::from(config.servo_hz).powi(2);
                turn > 0.25 && covered * turn > most
            })
        });
        if curve.stop || (corners_rest && turns) {
            let exact = bits(config, target);
            // s(t) is within 2^-54 of the point two ticks before it is declared reached, and those ticks may
            // already count for the line behind.
            let landing = &moving[next - 1..moving.len().min(next + 3)];
            if !landing.iter().any(|tick| tick.commanded == exact) {
                return Err(format!(
                    "line {}: rests on {:?}, programmed {exact:?}",
                    curve.line, before.commanded
                ));
            }
        } else if let Some(after) = moving.get(next) {
            let (a, b) = (place(config, before), place(config, after));
            let knot = target.map(|nano| nano as f64 * 1e-6);
            let reach = distance(&a, &b) + 1e-6;
            let miss = distance(&a, &knot).max(distance(&b, &knot));
            if miss > reach {
                return Err(format!(
                    "line {}: passed at {miss:.6}, one tick covers {reach:.6}",
                    curve.line
                ));
            }
        }
    }
    Ok(())
}

/// Every commanded position of `run` lies within `tolerance` of the path of `dense` (positions joined by straight
/// lines), and the path is run forward only.
///
/// # Errors
/// Says at which tick it does not.
pub fn stays_on_the_path_of(
    config: &Config,
    run: &Run,
    dense: &Run,
    tolerance: f64,
) -> Result<(), String> {
    let mut path = vec![[0.0; AXES]];
    for tick in &dense.ticks {
        let place = place(config, tick);
        if path.last() != Some(&place) {
            path.push(place);
        }
    }
    let off = |k: usize, q: &Point| {
        let (a, b) = (&path[k], path.get(k + 1).unwrap_or(&path[k]));
        let d: Point = core::array::from_fn(|i| b[i] - a[i]);
        let square: f64 = d.iter().map(|x| x * x).sum();
        let dot: f64 = (0..AXES).map(|i| d[i] * (q[i] - a[i])).sum();
        let t = if square > 0.0 {
            (dot / square).clamp(0.0, 1.0)
        } else {
            0.0
        };
        distance(&core::array::from_fn(|i| a[i] + t * d[i]), q)
    };
    let mut at = 0;
    let mut last = [0.0; AXES];
    for (i, tick) in run.ticks.iter().enumerate() {
        let q = place(config, tick);
        // Looks ahead as far as this tick can have come, twice over.
        let mut left = 2.0 * distance(&last, &q) + 0.01;
        let (mut best, mut nearest) = (at, off(at, &q));
        let mut k = at;
        while nearest > 0.1 * tolerance && left > 0.0 && k + 1 < path.len() {
            left -= distance(&path[k], &path[k + 1]);
            k += 1;
            let next = off(k, &q);
            if next < nearest {
                (best, nearest) = (k, next);
            }
        }
        if nearest > tolerance {
            return Err(format!(
                "tick {i}, line {}: {nearest:.6} off the path at {q:?}",
                tick.block
            ));
        }
        (at, last) = (best, q);
    }
    Ok(())
}
