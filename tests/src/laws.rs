//! Laws of motion, checked on a recorded run without any of the planner's code.

use pentaspline::config::Config;
use pentaspline::units::AXES;

use crate::drive::Run;

/// Largest observed derivative of each axis over its limit.
#[derive(Clone, Copy, Debug, Default)]
pub struct Peaks {
    /// Velocity share of the limit, per axis.
    pub v: [f64; AXES],
    /// Acceleration share.
    pub a: [f64; AXES],
    /// Jerk share.
    pub j: [f64; AXES],
    /// Tick of the largest jerk share.
    pub worst_tick: usize,
}

/// Differentiates the commanded positions: exact integer differences of the Q32.32 steps, then `f64`.
#[must_use]
pub fn peaks(config: &Config, run: &Run) -> Peaks {
    let hz = f64::from(config.servo_hz);
    let mut peaks = Peaks::default();
    let mut worst = 0.0;
    for axis in 0..AXES {
        let c = &config.axes[axis];
        let scale = 1.0 / (c.steps_per_unit.to_num::<f64>() * 4_294_967_296.0);
        // The machine stands still before the first tick.
        let start = run.ticks.first().map_or(0, |_| 0);
        let at = |i: isize| -> i128 {
            if i < 0 {
                start
            } else {
                i128::from(run.ticks[i as usize].commanded[axis])
            }
        };
        for i in 0..run.ticks.len() as isize {
            let d1 = (at(i) - at(i - 1)) as f64 * scale * hz;
            let d2 = (at(i) - 2 * at(i - 1) + at(i - 2)) as f64 * scale * hz * hz;
            let d3 =
                (at(i) - 3 * at(i - 1) + 3 * at(i - 2) - at(i - 3)) as f64 * scale * hz * hz * hz;
            peaks.v[axis] = peaks.v[axis].max(d1.abs() / f64::from(c.v_max));
            peaks.a[axis] = peaks.a[axis].max(d2.abs() / f64::from(c.a_max));
            let share = d3.abs() / f64::from(c.j_max);
            peaks.j[axis] = peaks.j[axis].max(share);
            if share > worst {
                worst = share;
                peaks.worst_tick = i as usize;
            }
        }
    }
    peaks
}

/// Velocity, acceleration and jerk of every axis stay within 1 + `tolerance` of the limits at every tick.
///
/// # Errors
/// Says which axis breaks which limit, and by how much.
pub fn stays_within_limits(config: &Config, run: &Run, tolerance: f64) -> Result<(), String> {
    let peaks = peaks(config, run);
    for axis in 0..AXES {
        for (name, share) in [
            ("velocity", peaks.v),
            ("acceleration", peaks.a),
            ("jerk", peaks.j),
        ] {
            if share[axis] > 1.0 + tolerance {
                let near = peaks.worst_tick;
                return Err(format!(
                    "axis {} {name} reaches {:.4} of its limit (worst jerk near tick {near}, line {})",
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
