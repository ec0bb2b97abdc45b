//! The tool table: a copy of the machine file's in RAM, which `G10 L1` changes, and which tool is in the spindle.
//!
//! Comes in: the selection of `T`, numbers of `G10`. Goes out: radius and length. Touches nothing else.

use super::modal::Tool;
use crate::config::{Config, ToolData, TOOLS};
use crate::units::Nano;

/// Place of the tool in the spindle: a row of the table, or one of the two below.
pub(super) type Mounted = u8;
/// No tool is in the spindle.
pub(super) const NONE: Mounted = u8::MAX;
/// A tool is in the spindle, and the table knows nothing of it.
const NAME_ONLY: Mounted = u8::MAX - 1;

/// Tools and the one in the spindle.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tools {
    rows: [ToolData; TOOLS],
    mounted: Mounted,
}

impl Tools {
    /// The table of the machine file, nothing in the spindle.
    #[must_use]
    pub fn new(config: &Config) -> Self {
        Self {
            rows: config.tools,
            mounted: NONE,
        }
    }

    /// Tools of the table, in the order of its rows.
    pub fn rows(&self) -> impl Iterator<Item = &ToolData> {
        self.rows.iter().filter(|row| row.number != 0)
    }

    /// Row of the tool in the spindle; `None` without a tool, or with one that the table does not have.
    #[must_use]
    pub fn mounted(&self) -> Option<&ToolData> {
        self.row(self.mounted)
    }

    /// What `M6` puts into the spindle: `None` if the table has tools, but not this one. `T0` empties the spindle.
    pub(super) fn find(&self, tool: Tool) -> Option<Mounted> {
        if tool == Tool::Number(0) {
            return Some(NONE);
        }
        let is_it = |row: &ToolData| match tool {
            Tool::Number(number) => row.number == number,
            Tool::Name(name) => {
                let end = row.name.iter().position(|byte| *byte == 0);
                row.name.get(..end.unwrap_or(row.name.len())) == Some(name.as_bytes())
            }
        };
        let index = self
            .rows
            .iter()
            .position(|row| row.number != 0 && is_it(row));
        match index.and_then(|index| Mounted::try_from(index).ok()) {
            Some(index) => Some(index),
            None if self.rows().next().is_some() => None,
            None => Some(NAME_ONLY),
        }
    }

    /// What is in the spindle.
    pub(super) fn in_spindle(&self) -> Mounted {
        self.mounted
    }

    /// Changes the tool.
    pub(super) fn mount(&mut self, mounted: Mounted) {
        self.mounted = mounted;
    }

    #[inline]
    fn row(&self, mounted: Mounted) -> Option<&ToolData> {
        self.rows.get(usize::from(mounted))
    }

    /// Radius of `mounted`, 0 for a tool the table does not have.
    #[inline]
    pub(super) fn radius(&self, mounted: Mounted) -> Nano {
        self.row(mounted).map_or(0, |row| row.radius)
    }

    /// Length of `mounted`, 0 for a tool the table does not have.
    #[inline]
    pub(super) fn length(&self, mounted: Mounted) -> Nano {
        self.row(mounted).map_or(0, |row| row.length)
    }

    /// Row for tool `number` (not 0): its own, or a free one. `None` if the table is full.
    pub(super) fn room(&self, number: u32) -> Option<usize> {
        let own = self.rows.iter().position(|row| row.number == number);
        own.or_else(|| self.rows.iter().position(|row| row.number == 0))
    }

    /// Enters what is stated of tool `number` into `row`; what is not stated stays, and is 0 in a new row.
    pub(super) fn set(
        &mut self,
        row: usize,
        number: u32,
        radius: Option<Nano>,
        length: Option<Nano>,
    ) {
        if let Some(row) = self.rows.get_mut(row) {
            row.number = number;
            row.radius = radius.unwrap_or(row.radius);
            row.length = length.unwrap_or(row.length);
        }
    }
}
