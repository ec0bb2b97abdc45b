//! What the pages say of performance is what was measured, and every number that repeats has a budget.
//!
//! Nothing is measured here: `docs/benchmarks.json` holds the numbers, `docs/budgets.toml` goals and budgets. What fails here is
//! mended by `bash docs/refresh benchmarks`.

use std::collections::BTreeMap;
use std::path::PathBuf;

use host_sim::bench::budget::{Budgets, SLACK};
use host_sim::bench::markdown;
use host_sim::bench::readme;
use host_sim::bench::report::shown;

fn file(name: &str) -> String {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("..")
        .join(name);
    std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{name}: {e}"))
}

fn budgets() -> Budgets {
    Budgets::parse(&file("docs/budgets.toml")).expect("budgets")
}

/// Numbers of `docs/benchmarks.json`.
fn values() -> BTreeMap<String, f64> {
    let json: serde_json::Value =
        serde_json::from_str(&file("docs/benchmarks.json")).expect("JSON");
    let pairs = json.as_object().expect("an object").iter();
    pairs
        .filter_map(|(key, value)| Some((key.clone(), value.as_f64()?)))
        .collect()
}

/// Columns of the rows of `docs/benchmarks.md` whose first column is a key and that have six columns, by key.
fn rows() -> BTreeMap<String, Vec<String>> {
    let mut rows = BTreeMap::new();
    for line in file("docs/benchmarks.md").lines() {
        let columns: Vec<String> = line
            .trim_matches('|')
            .split('|')
            .map(|column| column.trim().to_owned())
            .collect();
        let key = columns[0].trim_matches('`');
        if columns.len() == 6 && columns[0].starts_with('`') {
            let before = rows.insert(key.to_owned(), columns.clone());
            assert_eq!(before, None, "{key} stands in docs/benchmarks.md twice");
        }
    }
    rows
}

#[test]
fn the_readme_says_what_was_measured() {
    let page = file("README.md");
    let block = readme::block(&values(), &budgets());
    let now = readme::replace(&page, &block).expect("marks in README.md");
    for (was, is) in page.lines().zip(now.lines()) {
        assert_eq!(was, is, "README.md is stale");
    }
    assert_eq!(page, now, "README.md is stale");
}

#[test]
fn the_page_says_what_was_measured() {
    let page = file("docs/benchmarks.md");
    assert!(
        page.starts_with(markdown::HEAD),
        "docs/benchmarks.md is stale"
    );
    let (values, rows, budgets) = (values(), rows(), budgets());
    let keys = |map: Vec<&String>| map.into_iter().cloned().collect::<Vec<_>>();
    assert_eq!(
        keys(rows.keys().collect()),
        keys(values.keys().collect()),
        "keys of docs/benchmarks.md and docs/benchmarks.json"
    );
    for (key, value) in values {
        let entry = budgets.entry(&key);
        let goal = entry.aim().map(shown).unwrap_or_default();
        let budget = entry.budget.map(shown).unwrap_or_default();
        let row = &rows[&key];
        assert_eq!(row[1], shown(value), "{key}: value");
        assert_eq!(row[2], goal, "{key}: goal");
        assert_eq!(row[4], budget, "{key}: budget");
    }
}

#[test]
fn a_goal_that_is_met_is_the_budget_and_one_that_is_missed_has_a_reason() {
    let (values, budgets) = (values(), budgets());
    for (key, entry) in &budgets.entries {
        let value = *values
            .get(key)
            .unwrap_or_else(|| panic!("{key} is not measured"));
        if let (Some(goal), Some(budget)) = (entry.goal, entry.budget) {
            assert!(budget >= goal, "{key}: budget below the goal");
            assert!(
                !entry.is_met(value) || budget == goal,
                "{key}: met, so the goal is the budget"
            );
        }
        let explained = !entry.reason.is_empty() && !entry.next.is_empty();
        assert!(
            entry.is_met(value) || explained,
            "{key}: missed without reason and next idea"
        );
        if let Some(budget) = entry.budget {
            assert!(value <= budget * (1.0 + SLACK), "{key}: over its budget");
        }
    }
}
