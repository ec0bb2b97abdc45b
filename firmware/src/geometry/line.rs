//! A straight block: the cubic whose slopes are its chord.

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
    queue.emit(config, start, end, *by, *by)
}
