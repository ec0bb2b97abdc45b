//! The rows as JSON and as text.
//!
//! In: [`Row`]s. Out: a JSON array with one object per row, and a table for a terminal.

use std::fmt::Write as _;

use serde::Serialize;

use super::thesis::Feed;
use super::{mae, Row};

/// One object of the JSON file. The first eleven keys are fixed, in this order; more may follow behind them.
#[derive(Serialize)]
struct Record<'a> {
    method: &'a str,
    distribution: &'a str,
    knots: u32,
    mae_geometry_mm: f64,
    mae_machined_mm: f64,
    mae_thesis_mm: f64,
    verdict: &'a str,
    verdict_thesis: &'a str,
    time_s: f64,
    time_thesis_s: f64,
    min_feed_mm_min: f64,
    mae_commanded_mm: f64,
    min_feed_thesis: Printed,
    file_bytes: usize,
}

/// A number, the word "oscillations", or nothing.
#[derive(Serialize)]
#[serde(untagged)]
enum Printed {
    Nothing,
    Word(&'static str),
    Number(f64),
}

/// `value` to `digits` decimals, without a minus zero.
fn rounded(value: f64, digits: i32) -> f64 {
    let scale = 10_f64.powi(digits);
    (value * scale).round() / scale + 0.0
}

fn record(row: &Row) -> Record<'_> {
    Record {
        method: row.method.name(),
        distribution: row.set.distribution.name(),
        knots: row.set.printed_count(),
        mae_geometry_mm: rounded(mae(&row.geometry), 6),
        mae_machined_mm: rounded(mae(&row.machined), 6),
        mae_thesis_mm: row.printed.mae_mm,
        verdict: row.verdict().name(),
        verdict_thesis: row.printed.verdict.name(),
        time_s: rounded(row.time_s, 4),
        time_thesis_s: row.printed.time_s,
        min_feed_mm_min: rounded(row.min_feed_mm_min, 1),
        mae_commanded_mm: rounded(mae(&row.commanded), 6),
        min_feed_thesis: match row.printed.feed {
            Feed::Blank => Printed::Nothing,
            Feed::Oscillates => Printed::Word("oscillations"),
            Feed::Value(value) => Printed::Number(value),
        },
        file_bytes: row.file_bytes,
    }
}

/// The rows as a JSON array; keys as in the documentation of the command.
///
/// # Errors
/// Those of the serialiser, which these types do not cause.
pub fn json(rows: &[Row]) -> serde_json::Result<String> {
    let records: Vec<Record> = rows.iter().map(record).collect();
    let mut text = serde_json::to_string_pretty(&records)?;
    text.push('\n');
    Ok(text)
}

/// Printed feed as a word.
#[must_use]
pub fn feed_text(feed: Feed) -> String {
    match feed {
        Feed::Blank => "-".to_owned(),
        Feed::Oscillates => "oscillations".to_owned(),
        Feed::Value(value) => format!("{value:.0}"),
    }
}

/// The rows as a table for a terminal.
#[must_use]
pub fn text(rows: &[Row]) -> String {
    let mut out = String::from(
        "                               mean absolute error, mm                          time, s         min. feed, mm/min\n\
         method    knots               geometry commanded  machined    thesis  verdicts    ours  thesis      ours  thesis\n",
    );
    for row in rows {
        // Writing to a string does not fail.
        let _ = writeln!(
            out,
            "{:<9} {:<12} {:>3}    {:>9.4} {:>9.4} {:>9.4} {:>9.3}  {:<3} {:<4} {:>7.2} {:>7.2}  {:>8.0}  {}",
            row.method.title(),
            row.set.distribution.name(),
            row.set.printed_count(),
            mae(&row.geometry),
            mae(&row.commanded),
            mae(&row.machined),
            row.printed.mae_mm,
            row.verdict().name(),
            row.printed.verdict.name(),
            row.time_s,
            row.printed.time_s,
            row.min_feed_mm_min,
            feed_text(row.printed.feed),
        );
    }
    let agree = agreeing(rows);
    let _ = writeln!(out, "verdicts agree in {agree} of {} rows", rows.len());
    out
}

/// Rows whose verdict is the printed one.
#[must_use]
pub fn agreeing(rows: &[Row]) -> usize {
    let same = |row: &&Row| row.verdict() == row.printed.verdict;
    rows.iter().filter(same).count()
}
