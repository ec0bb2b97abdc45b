//! The result: rows in the order they were measured.

use std::collections::BTreeMap;

use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};

/// What a row belongs to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Group {
    /// Servo interrupt.
    #[default]
    Servo,
    /// Background.
    Background,
    /// Flash, RAM, stack.
    Memory,
    /// The simulator on this PC.
    Simulator,
    /// Where edges stand.
    Placement,
    /// Cost by program length, on this PC.
    Length,
}

impl Group {
    /// True if every run on every PC gives the same values, up to the stack (see [`Row::is_repeatable`]).
    #[must_use]
    pub fn is_repeatable(self) -> bool {
        !matches!(self, Self::Simulator | Self::Length)
    }
}

/// Depends on where interrupts fall, and those follow the speed of the serial line: a few words between runs.
const STACK_KEY: &str = "stack_bytes";

/// One number.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Where it stands in the tables.
    pub group: Group,
    /// Name in the JSON file; stable.
    pub key: String,
    /// Value.
    pub value: f64,
    /// Unit of the value.
    pub unit: &'static str,
    /// What was measured.
    pub text: String,
}

impl Row {
    /// True if the value is the same on every PC, so that it has a budget.
    #[must_use]
    pub fn is_repeatable(&self) -> bool {
        self.group.is_repeatable() && self.key != STACK_KEY
    }

    /// The value as it is printed: whole numbers from 100 on, four digits below.
    #[must_use]
    pub fn shown(&self) -> String {
        shown(self.value)
    }
}

/// A number as the tables print it.
#[must_use]
pub fn shown(value: f64) -> String {
    match value.abs() {
        x if x >= 100.0 || value.fract() == 0.0 => format!("{value:.0}"),
        x if x >= 10.0 => format!("{value:.1}"),
        _ => format!("{value:.3}"),
    }
}

/// All rows. As JSON an object: each key with its number, and `compiler`, `host_build`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Report {
    /// Rows, in order.
    pub rows: Vec<Row>,
    /// Compiler of the image.
    pub compiler: String,
    group: Group,
}

impl Report {
    /// Rows added from here on belong to `group`.
    pub fn group(&mut self, group: Group) {
        self.group = group;
    }

    /// Adds a row.
    pub fn add(&mut self, key: &str, value: f64, unit: &'static str, text: &str) {
        self.rows.push(Row {
            group: self.group,
            key: key.to_owned(),
            value,
            unit,
            text: text.to_owned(),
        });
    }

    /// Values by key.
    #[must_use]
    pub fn values(&self) -> BTreeMap<String, f64> {
        let pair = |row: &Row| (row.key.clone(), row.value);
        self.rows.iter().map(pair).collect()
    }

    /// The rows as lines of text.
    #[must_use]
    pub fn table(&self) -> String {
        let line = |row: &Row| {
            format!(
                "{:20} {:>12} {:12} {}\n",
                row.key,
                row.shown(),
                row.unit,
                row.text
            )
        };
        self.rows.iter().map(line).collect()
    }
}

/// How this program was built: the rows of the simulator mean something in a release build only.
#[must_use]
pub fn host_build() -> &'static str {
    if cfg!(debug_assertions) {
        "debug"
    } else {
        "release"
    }
}

impl Serialize for Report {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.rows.len() + 2))?;
        map.serialize_entry("compiler", &self.compiler)?;
        map.serialize_entry("host_build", host_build())?;
        for row in &self.rows {
            map.serialize_entry(&row.key, &row.value)?;
        }
        map.end()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_json_object_has_a_number_for_every_key() {
        let mut report = Report::default();
        report.add("tick_mean", 149.25, "instructions", "x");
        report.add("flash_bytes", 1000.0, "bytes", "y");
        let json = serde_json::to_value(&report).unwrap();
        assert_eq!(json["tick_mean"], 149.25);
        assert_eq!(json["flash_bytes"], 1000.0);
    }

    #[test]
    fn numbers_are_shown_with_the_digits_they_deserve() {
        for (value, text) in [
            (2254.3, "2254"),
            (23.55, "23.6"),
            (0.6312, "0.631"),
            (7.0, "7"),
        ] {
            assert_eq!(shown(value), text);
        }
    }
}
