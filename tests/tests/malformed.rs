//! Bad programs never panic, never move the machine past the end of the last good line, and say where and why.
//!
//! `tests/malformed/expected.txt` holds one row per program: file, `line:column`, code, text.

use std::path::PathBuf;

use whole_product_tests::drive::{drive, Script};
use whole_product_tests::oracle::path::path;
use whole_product_tests::{examples, laws};

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("malformed")
}

/// What the controller said about its first error, as `line:column code text`.
fn complaint(remarks: &[&str]) -> Option<String> {
    let at = remarks
        .iter()
        .position(|line| line.starts_with("[MSG:error line "))?;
    let text = remarks[at]
        .strip_prefix("[MSG:error line ")?
        .strip_suffix(']')?;
    let (place, text) = text.split_once(": ")?;
    let code = remarks.get(at + 1)?.strip_prefix("error:")?;
    Some(format!("{} {code} {text}", place.replace(" column ", ":")))
}

#[test]
fn every_bad_program_is_refused_where_and_why_the_table_says() {
    let config = examples::machine().config;
    let table = std::fs::read_to_string(folder().join("expected.txt")).expect("the table");
    let rows: Vec<(&str, &str)> = table
        .lines()
        .filter(|line| !line.is_empty() && !line.starts_with('#'))
        .map(|line| line.split_once(' ').expect("file and complaint"))
        .map(|(file, rest)| (file, rest.trim()))
        .collect();
    assert!(rows.len() >= 10);
    let files = std::fs::read_dir(folder()).expect("the folder").count() - 1;
    assert_eq!(files, rows.len(), "a row for every program");
    let mut wrong = Vec::new();
    for (file, expected) in rows {
        let text = std::fs::read(folder().join(file)).unwrap_or_else(|e| panic!("{file}: {e}"));
        // Bytes as they are: a character of the wire per byte of the file.
        let text: String = text.into_iter().map(char::from).collect();
        let run = drive(&config, &Script::new(&text));
        let remarks: Vec<&str> = run.remarks().collect();
        let said = complaint(&remarks).unwrap_or_else(|| format!("nothing: {remarks:?}"));
        if said != expected {
            wrong.push(format!("{file}: {said}\n   expected {expected}"));
            continue;
        }
        let code: u32 = expected
            .split(' ')
            .nth(1)
            .and_then(|n| n.parse().ok())
            .expect("code");
        let bad: usize = expected
            .split(':')
            .next()
            .and_then(|n| n.parse().ok())
            .expect("line");
        // An error of geometry stands in text that reads well, and the points behind it shape the curve before it.
        let geometry = !matches!(code, 101..=129);
        let good: String = text.split_inclusive('\n').take(bad - 1).collect();
        let mut curves = path(if geometry { &text } else { &good });
        curves.retain(|curve| (curve.line as usize) < bad);
        let reached = run
            .ticks
            .last()
            .map(|tick| tick.commanded)
            .unwrap_or_default();
        let mut ends: Vec<_> = curves.iter().rev().filter_map(|curve| curve.end).collect();
        ends.push([0; 5]);
        // A spline whose text breaks off is not begun: only then may the machine stop before the last good point.
        let unfinished = good.lines().any(|line| line.starts_with("BSPLINE"));
        if !unfinished {
            ends.truncate(1);
        }
        if !ends.iter().any(|end| laws::bits(&config, end) == reached) {
            wrong.push(format!(
                "{file}: ends on {reached:?}, not on the last good point {:?}",
                ends[0]
            ));
        }
        for law in [
            laws::follows(&config, &run, &curves, 0.001).map(|_| ()),
            laws::stays_within_limits(&config, &run, &laws::brisk_lines(&curves), 0.005),
            laws::emits_exactly_the_commanded_steps(&run),
        ] {
            if let Err(broken) = law {
                wrong.push(format!("{file}: {broken}"));
            }
        }
        if run
            .ticks
            .last()
            .is_some_and(|tick| tick.moving && tick.feed != 0.0)
        {
            wrong.push(format!("{file}: not at rest"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
