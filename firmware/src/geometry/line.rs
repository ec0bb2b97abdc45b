//! Straight motion: the cubic whose slopes are its chord.

use super::error::GeometryError;
use super::queue::{Knot, SegmentQueue};
use crate::config::Config;
use crate::units::{AxisVec, Position};

/// Emits the line from `start` to `end`; `by` is their difference, mm or degree.
pub(super) fn emit(
    config: &Config,
    queue: &mut SegmentQueue,
    start: &Position,
    end: &Knot,
    by: &AxisVec,
) -> Result<(), GeometryError> {
    queue.emit_by(config, start, end, by, *by, *by)
}

/// `slope` on the axes whose bit is set in `axes`, the chord `by` on those that go linearly beside a spline.
pub(super) fn in_spline(axes: u8, slope: AxisVec, by: &AxisVec) -> AxisVec {
    core::array::from_fn(|axis| {
        if axes & (1 << axis) != 0 {
            slope[axis]
        } else {
            by[axis]
        }
    })
}
