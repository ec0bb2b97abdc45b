//! From programmed coordinates to machine coordinates: zero offset, tool length, absolute and incremental words.

use super::block::Block;
use super::error::Fault;
use super::modal::Modal;
use super::number::Decimal;
use super::values::coordinate;
use crate::catalogue::nc as message;
use crate::config::{AxisKind, Config};
use crate::units::{Nano, AXES, NANO_PER_UNIT};

/// Largest programmed and machine coordinate: 100 m or 100 000 degrees. Sums of a few stay far inside `i64`.
pub(super) const COORDINATE_MAX: Nano = 100_000 * NANO_PER_UNIT;

const NO_OFFSETS: [Nano; AXES] = [0; AXES];

/// Where absolute coordinates count from, in machine coordinates.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame<'a> {
    /// Where they do without a tool.
    pub zero: &'a [Nano; AXES],
    /// Axis that carries the tool length; [`AXES`] for none.
    normal: usize,
    length: Nano,
}

impl<'a> Frame<'a> {
    /// Frame of a line under a tool of `length`: `G54` to `G57`, `G500`, `G53` (`suppress`), and the normal of the plane.
    #[inline]
    pub fn new(config: &'a Config, modal: &Modal, suppress: bool, length: Nano) -> Self {
        let offset = config.zero_offsets.get(usize::from(modal.zero_offset));
        Self {
            zero: match offset {
                Some(offset) if !suppress => offset,
                _ => &NO_OFFSETS,
            },
            normal: if length == 0 {
                AXES
            } else {
                normal(config, modal)
            },
            length,
        }
    }

    /// Machine coordinate of the programmed zero of `axis`.
    #[inline]
    pub fn origin(&self, axis: usize) -> Nano {
        let zero = self.zero.get(axis).copied().unwrap_or(0);
        if axis == self.normal {
            zero.saturating_add(self.length)
        } else {
            zero
        }
    }
}

#[cold]
fn normal(config: &Config, modal: &Modal) -> usize {
    let [_, _, normal] = config.plane_axes(modal.plane);
    normal.unwrap_or(AXES)
}

/// True if `nano` is a coordinate.
#[inline]
fn in_range(nano: &Nano) -> bool {
    nano.unsigned_abs() <= COORDINATE_MAX.unsigned_abs()
}

/// End point of the line in machine coordinates; axes without a word stay at `position`.
///
/// # Errors
/// A coordinate out of range.
#[inline]
pub(super) fn target(
    config: &Config,
    block: &Block,
    frame: &Frame,
    position: &[Nano; AXES],
) -> Result<[Nano; AXES], Fault> {
    let mut target = *position;
    for &axis in block.order.iter().take(block.axes) {
        let axis = usize::from(axis) % AXES;
        let linear = config.axes[axis].kind == AxisKind::Linear;
        let value = coordinate(block.values[axis], block.modal.inch && linear);
        let bit = 1 << axis;
        let absolute = if (block.absolute | block.incremental) & bit == 0 {
            block.modal.absolute
        } else {
            block.absolute & bit != 0
        };
        let origin = if absolute {
            frame.origin(axis)
        } else {
            target[axis]
        };
        let end = value.and_then(|value| value.checked_add(origin));
        match end.filter(in_range) {
            Some(end) => target[axis] = end,
            None => {
                let letter = config.axes[axis].letter;
                return Err(Fault::new(block.place(letter), 1, &message::OUT_OF_RANGE));
            }
        }
    }
    Ok(target)
}

/// `value` of a linear axis counted from `origin`, `None` out of range.
pub(super) fn shifted(value: Decimal, inch: bool, origin: Nano) -> Option<Nano> {
    coordinate(value, inch)?
        .checked_add(origin)
        .filter(in_range)
}
