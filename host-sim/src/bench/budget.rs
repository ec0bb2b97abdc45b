//! Budgets: what a measured value may be, and the goal behind it.
//!
//! In: `docs/budgets.toml` and a [`Report`]. Out: the rows that are over, or the file with lower budgets. A budget is the
//! goal where that is met, else what was last measured: it falls by itself and rises only by hand.

use std::collections::BTreeMap;
use std::fmt::{self, Write};
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::report::{shown, Report, Row};

/// The committed file, from the top of the repository.
pub const FILE: &str = "docs/budgets.toml";
/// A value may be over its budget by this share, with the compiler the budgets were measured with.
pub const SLACK: f64 = 0.02;
/// The same with another compiler: of two releases, the one the budgets were not measured with took up to 3.3 % more
/// (`flash_bytes`), and what a change of ours spoils is usually more than this.
pub const OTHER_COMPILER_SLACK: f64 = 0.1;

/// The head of the file.
const HEAD: &str = "\
# What the values of `host-sim bench` may be: `host-sim bench --check` fails if one is over its `budget` by more than 2 %.
#
# goal    most the project wants to spend (`least`: least it wants to reach; depends on the PC, only printed)
# budget  the goal where it is met, else the last measured value
# reason  why the goal is missed
# next    what to try next
#
# `bash docs/refresh benchmarks` measures and lowers budgets. Nothing raises one: to do so, delete its line, run that
# command, and say why in the commit. How this works with other compilers stands in docs/benchmarks.md.
";

/// One key.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    /// Most the value should be.
    pub goal: Option<f64>,
    /// Least the value should be.
    pub least: Option<f64>,
    /// Most the value may be.
    pub budget: Option<f64>,
    /// Why the goal is missed.
    #[serde(default)]
    pub reason: String,
    /// What to try next.
    #[serde(default)]
    pub next: String,
}

impl Entry {
    /// The goal, whichever way it points.
    #[must_use]
    pub fn aim(&self) -> Option<f64> {
        self.goal.or(self.least)
    }

    /// True if `value` reaches the goal, or there is none.
    #[must_use]
    pub fn is_met(&self, value: f64) -> bool {
        self.goal.is_none_or(|goal| value <= goal) && self.least.is_none_or(|goal| value >= goal)
    }
}

/// The file.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub struct Budgets {
    /// Compiler the budgets were measured with; empty before the first measurement.
    #[serde(default)]
    pub compiler: String,
    /// Entries by key of the report.
    #[serde(flatten)]
    pub entries: BTreeMap<String, Entry>,
}

/// A row that breaks its budget.
#[derive(Clone, Debug, PartialEq)]
pub enum Breach {
    /// More than the budget and the slack.
    Over {
        /// Key.
        key: String,
        /// Measured.
        value: f64,
        /// Unit of both.
        unit: &'static str,
        /// Allowed without slack.
        budget: f64,
        /// Share that it may be more.
        slack: f64,
    },
    /// Measured, but nobody has said what it may be.
    NoBudget(String),
    /// There is a budget, but the value is not measured.
    NotMeasured(String),
}

impl fmt::Display for Breach {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Over {
                key,
                value,
                unit,
                budget,
                slack,
            } => write!(
                f,
                "{key}: {} {unit}, budget {} (+{:.1} %, {:.0} % allowed)",
                shown(*value),
                shown(*budget),
                (value / budget - 1.0) * 100.0,
                slack * 100.0
            ),
            Self::NoBudget(key) => write!(f, "{key}: measured, but has no budget"),
            Self::NotMeasured(key) => write!(f, "{key}: has a budget, but is not measured"),
        }
    }
}

/// Why budgets are not lowered.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OtherCompiler {
    /// Of the budgets.
    pub budgets: String,
    /// Of the images.
    pub images: String,
}

impl fmt::Display for OtherCompiler {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "the budgets are those of `{}`, the images come from `{}`",
            self.budgets, self.images
        )
    }
}

impl Budgets {
    /// Where the file is: at [`FILE`], or there in the folder this program was built from.
    #[must_use]
    pub fn default_file() -> PathBuf {
        let here = PathBuf::from(FILE);
        match Path::new(env!("CARGO_MANIFEST_DIR")).parent() {
            Some(root) if !here.is_file() => root.join(FILE),
            _ => here,
        }
    }

    /// Reads the file.
    ///
    /// # Errors
    /// What is wrong with it, with its place.
    pub fn parse(text: &str) -> Result<Self, String> {
        toml::from_str(text).map_err(|e| e.to_string())
    }

    /// The entry of `key`; an empty one if there is none.
    #[must_use]
    pub fn entry(&self, key: &str) -> Entry {
        self.entries.get(key).cloned().unwrap_or_default()
    }

    /// How much a value of images from `compiler` may be over its budget.
    #[must_use]
    pub fn slack(&self, compiler: &str) -> f64 {
        if compiler == self.compiler {
            SLACK
        } else {
            OTHER_COMPILER_SLACK
        }
    }

    /// What of `report` breaks its budget.
    #[must_use]
    pub fn breaches(&self, report: &Report) -> Vec<Breach> {
        let slack = self.slack(&report.compiler);
        let over = |row: &Row| {
            let Some(budget) = self.entry(&row.key).budget else {
                return Some(Breach::NoBudget(row.key.clone()));
            };
            // What is no number is over.
            let within = row.value <= budget * (1.0 + slack);
            (!within).then(|| Breach::Over {
                key: row.key.clone(),
                value: row.value,
                unit: row.unit,
                budget,
                slack,
            })
        };
        let measured = report.values();
        let rows = report.rows.iter().filter(|row| row.is_repeatable());
        let missing = self
            .entries
            .iter()
            .filter(|(key, entry)| entry.budget.is_some() && !measured.contains_key(*key))
            .map(|(key, _)| Breach::NotMeasured(key.clone()));
        rows.filter_map(over).chain(missing).collect()
    }

    /// Lowers budgets to what `report` measured, or to the goal where that is met; a key without one gets one.
    ///
    /// # Errors
    /// [`OtherCompiler`]: its counts say nothing about those of the file. Without a compiler in the file there is no error.
    pub fn lower(&mut self, report: &Report) -> Result<(), OtherCompiler> {
        if !self.compiler.is_empty() && self.compiler != report.compiler {
            return Err(OtherCompiler {
                budgets: self.compiler.clone(),
                images: report.compiler.clone(),
            });
        }
        self.compiler.clone_from(&report.compiler);
        for row in report.rows.iter().filter(|row| row.is_repeatable()) {
            let entry = self.entries.entry(row.key.clone()).or_default();
            let measured = match entry.goal {
                Some(goal) if row.value <= goal => goal,
                _ => round_up(row.value),
            };
            entry.budget = Some(entry.budget.map_or(measured, |old| old.min(measured)));
            if entry.goal.is_some() && entry.is_met(row.value) {
                entry.reason.clear();
                entry.next.clear();
            }
        }
        Ok(())
    }

    /// The file, keys in the order of `report`, then those it does not have.
    #[must_use]
    pub fn text(&self, report: &Report) -> String {
        let mut text = HEAD.to_owned();
        let quoted = |text: &str| toml::Value::from(text).to_string();
        // Writing to a String cannot fail.
        let _ = writeln!(text, "compiler = {}", quoted(&self.compiler));
        let values = report.values();
        let measured = report.rows.iter().map(|row| &row.key);
        let others = self.entries.keys().filter(|key| !values.contains_key(*key));
        for key in measured.chain(others) {
            let Some(entry) = self.entries.get(key) else {
                continue;
            };
            let _ = writeln!(text, "\n[{key}]");
            for (name, value) in [
                ("goal", entry.goal),
                ("least", entry.least),
                ("budget", entry.budget),
            ] {
                if let Some(value) = value {
                    let _ = writeln!(text, "{name} = {value}");
                }
            }
            for (name, value) in [("reason", &entry.reason), ("next", &entry.next)] {
                if !value.is_empty() {
                    let _ = writeln!(text, "{name} = {}", quoted(value));
                }
            }
        }
        text
    }
}

/// A budget that `value` keeps: whole from 100 on, three decimals below.
fn round_up(value: f64) -> f64 {
    if value >= 100.0 {
        value.ceil()
    } else {
        (value * 1000.0).ceil() / 1000.0
    }
}

#[cfg(test)]
mod tests {
    use super::super::report::Group;
    use super::*;

    fn report(rows: &[(&str, f64)]) -> Report {
        let mut report = Report::default();
        "one".clone_into(&mut report.compiler);
        for &(key, value) in rows {
            report.add(key, value, "instructions", "");
        }
        report
    }

    fn budgets(text: &str) -> Budgets {
        Budgets::parse(&format!("compiler = \"one\"\n{text}")).unwrap()
    }

    #[test]
    fn a_value_may_be_two_percent_over_its_budget_and_no_more() {
        let budgets = budgets("[tick]\nbudget = 200\n");
        assert_eq!(budgets.breaches(&report(&[("tick", 204.0)])), []);
        let breaches = budgets.breaches(&report(&[("tick", 204.1)]));
        assert_eq!(breaches.len(), 1);
        assert_eq!(
            breaches[0].to_string(),
            "tick: 204 instructions, budget 200 (+2.0 %, 2 % allowed)"
        );
        assert_eq!(budgets.breaches(&report(&[("tick", f64::NAN)])).len(), 1);
    }

    #[test]
    fn images_of_another_compiler_are_held_too_but_not_as_tightly() {
        let budgets = budgets("[tick]\nbudget = 200\n");
        let mut other = report(&[("tick", 220.0)]);
        other.compiler = "two".to_owned();
        assert_eq!(budgets.breaches(&other), []);
        other.rows[0].value = 220.1;
        assert_eq!(budgets.breaches(&other).len(), 1);
    }

    #[test]
    fn neither_a_value_without_a_budget_nor_a_budget_without_a_value_passes() {
        let budgets = budgets("[old]\nbudget = 1\n[sim_speed]\nleast = 5\n");
        assert_eq!(
            budgets.breaches(&report(&[("new", 1.0)])),
            [
                Breach::NoBudget("new".to_owned()),
                Breach::NotMeasured("old".to_owned())
            ]
        );
    }

    #[test]
    fn what_depends_on_the_pc_has_no_budget() {
        let mut speeds = report(&[]);
        speeds.group(Group::Simulator);
        speeds.add("sim_speed", 1.0, "1/s", "");
        speeds.group(Group::Memory);
        speeds.add("stack_bytes", 1.0, "bytes", "");
        let mut budgets = budgets("");
        assert_eq!(budgets.breaches(&speeds), []);
        budgets.lower(&speeds).unwrap();
        assert_eq!(budgets.entries, BTreeMap::new());
    }

    #[test]
    fn a_budget_falls_to_what_is_measured_and_not_below_the_goal_and_never_rises() {
        let mut budgets = budgets(
            "[missed]\ngoal = 100\nbudget = 200\nreason = \"r\"\nnext = \"n\"\n\
             [met]\ngoal = 100\nbudget = 120\nreason = \"r\"\nnext = \"n\"\n\
             [worse]\nbudget = 50\n",
        );
        let measured = report(&[
            ("missed", 150.2),
            ("met", 90.0),
            ("worse", 60.0),
            ("new", 2.00001),
        ]);
        budgets.lower(&measured).unwrap();
        let budget = |key| budgets.entry(key).budget;
        assert_eq!(budget("missed"), Some(151.0));
        assert_eq!(budget("met"), Some(100.0));
        assert_eq!(budget("worse"), Some(50.0));
        assert_eq!(budget("new"), Some(2.001));
        assert_eq!(budgets.entry("missed").reason, "r");
        assert_eq!(budgets.entry("met").reason, "");
        // What has been written reads the same.
        assert_eq!(Budgets::parse(&budgets.text(&measured)), Ok(budgets));
    }

    #[test]
    fn budgets_of_one_compiler_are_not_lowered_with_images_of_another() {
        let mut budgets = budgets("[tick]\nbudget = 200\n");
        let before = budgets.clone();
        let mut other = report(&[("tick", 100.0)]);
        other.compiler = "two".to_owned();
        assert!(budgets.lower(&other).is_err());
        assert_eq!(budgets, before);
    }
}
