//! `SPL` blocks: an end point and coefficients on one line or several come in, one [`Polynomial`] goes out.

use super::super::command::{Command, Motion, Polynomial};
use super::super::error::Fault;
use super::words::Line;
use super::{Heidenhain, Shared, COORDINATE_MAX};
use crate::catalogue::{dialect, nc};
use crate::config::AxisKind;
use crate::units::{Nano, AXES, NANO_PER_UNIT};

/// Largest distance of an `SPL` block at t = 1 from where the block before ended, mm or degree (shared facts 6), and
/// what the sum of its coefficients may be off.
const SPLINE_GAP: f64 = 1.0e-3 + 1.0e-9;

/// An `SPL` block that waits for coefficients.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spline {
    target: [Nano; AXES],
    coefficients: [[f64; 3]; AXES],
    /// Bits of the coefficients that have come, and that are wanted.
    given: u16,
    wanted: u16,
    misc: u16,
}

impl Heidenhain {
    /// The line with `SPL`.
    ///
    /// # Errors
    /// No axis, an end point out of range, and what [`Self::more_spline`] finds.
    pub(super) fn begin_spline(
        &mut self,
        shared: &mut Shared,
        line: &Line,
        emit: &mut dyn FnMut(Command),
    ) -> Result<bool, Fault> {
        if line.axes == 0 {
            return Err(Fault::new(line.at, 3, &dialect::H_SPLINE_AXES));
        }
        let mut wanted = 0;
        for axis in 0..AXES {
            if line.axes & 1 << axis != 0 {
                wanted |= 7 << (3 * axis);
            }
        }
        self.spline = Some(Spline {
            target: self.target(shared, line)?,
            coefficients: [[0.0; 3]; AXES],
            given: 0,
            wanted,
            misc: 0,
        });
        self.more_spline(shared, line, emit)
    }

    /// Takes the coefficients of a line and hands out the block if they are complete.
    ///
    /// # Errors
    /// Coefficients that are repeated, too large or without an axis; a start off the current position.
    pub(super) fn more_spline(
        &mut self,
        shared: &mut Shared,
        line: &Line,
        emit: &mut dyn FnMut(Command),
    ) -> Result<bool, Fault> {
        let Some(mut spline) = self.spline else {
            return Ok(false);
        };
        if line.given & spline.given != 0 {
            return Err(Fault::new(line.coefficient_at, 3, &nc::REPEATED_WORD));
        }
        if line.given & !spline.wanted != 0 {
            return Err(Fault::new(line.coefficient_at, 3, &dialect::H_COEFFICIENT));
        }
        for axis in 0..AXES {
            let linear = shared.config.axes[axis].kind == AxisKind::Linear;
            let unit = if self.inch && linear { 25.4 } else { 1.0 };
            for power in 0..3 {
                if line.given & 1 << (3 * axis + power) == 0 {
                    continue;
                }
                let value = unit * line.coefficients[axis][power];
                if !(value.abs() <= COORDINATE_MAX as f64) {
                    return Err(Fault::new(line.coefficient_at, 3, &dialect::H_COEFFICIENT));
                }
                spline.coefficients[axis][power] = value;
            }
        }
        spline.given |= line.given;
        spline.misc |= line.misc;
        if spline.given != spline.wanted {
            self.spline = Some(spline);
            return Ok(false);
        }
        let motion = Motion::Polynomial(polynomial(shared, line, &spline)?);
        let step = self.step(shared, line, motion, spline.target)?;
        self.spline = None;
        self.finish(shared, spline.misc, Some(step), emit)
    }
}

/// The cubic re-expanded in p = 1 - t, which runs forward: `a2 = K2 + 3 K3`, `a3 = -K3`. a0 and a1 follow from the ends, so
/// what the block misses of its start at t = 1 is spread over its length.
fn polynomial(shared: &Shared, line: &Line, spline: &Spline) -> Result<Polynomial, Fault> {
    let mut coefficients = [[0.0; 4]; AXES];
    for axis in 0..AXES {
        let [k3, k2, k1] = spline.coefficients[axis];
        let back = shared.position[axis].saturating_sub(spline.target[axis]);
        let gap = k3 + k2 + k1 - back as f64 / NANO_PER_UNIT as f64;
        if spline.wanted & 1 << (3 * axis) != 0 && gap.abs() > SPLINE_GAP {
            let at = line.places[axis].min(line.at.max(line.coefficient_at));
            return Err(Fault::new(at, 0, &dialect::H_SPLINE_GAP));
        }
        coefficients[axis] = [k2 + 3.0 * k3, -k3, 0.0, 0.0];
    }
    Ok(Polynomial {
        length: 1.0,
        numerators: u8::MAX,
        coefficients,
        denominator: [1.0, 0.0, 0.0, 0.0, 0.0],
    })
}
