//! Bad programs never panic, never move the machine past the line before the bad one, and say where and why.
//!
//! `tests/malformed/expected.txt` holds one row per program: file, `line:column`, code, text. `PENTASPLINE_BLESS=1`
//! rewrites it; read the difference before you commit it.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::PathBuf;

use pentaspline::catalogue;
use whole_product_tests::drive::{drive, Run, Script};
use whole_product_tests::{examples, laws};

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("malformed")
}

/// What the controller said about its first error, as `line:column code text`.
fn complaint(run: &Run) -> Option<String> {
    let remarks: Vec<&str> = run.remarks().collect();
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

/// The programs, by name, as they go over the wire.
fn programs() -> Vec<(String, String)> {
    let mut programs: Vec<_> = std::fs::read_dir(folder())
        .expect("the folder")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|e| e == "nc"))
        .map(|path| {
            let bytes = std::fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            // Bytes as they are: a character of the wire per byte of the file.
            (
                name.into_owned(),
                bytes.into_iter().map(char::from).collect(),
            )
        })
        .collect();
    programs.sort();
    programs
}

/// What a run past a bad line breaks.
fn broken_law(run: &Run, bad: u32) -> Option<String> {
    let past = run.ticks.iter().find(|t| t.moving && t.block >= bad);
    if let Some(tick) = past {
        return Some(format!("line {} moves", tick.block));
    }
    let last = run.ticks.last()?;
    if last.moving && last.feed != 0.0 {
        return Some("not at rest".to_owned());
    }
    let config = examples::machine().config;
    laws::stays_within_limits(&config, run, &BTreeSet::new(), 0.005)
        .and_then(|()| laws::emits_exactly_the_commanded_steps(run))
        .and_then(|()| laws::never_runs_backwards(run))
        .err()
}

#[test]
fn every_bad_program_is_refused_where_and_why_the_table_says() {
    let config = examples::machine().config;
    let path = folder().join("expected.txt");
    let table = std::fs::read_to_string(&path).expect("the table");
    let head: String = table
        .split_inclusive('\n')
        .filter(|line| line.starts_with('#'))
        .collect();
    let mut now = head;
    let mut wrong = Vec::new();
    let programs = programs();
    assert!(programs.len() >= 300, "{} programs", programs.len());
    for (file, text) in &programs {
        let run = drive(&config, &Script::new(text));
        let Some(said) = complaint(&run) else {
            wrong.push(format!("{file}: not refused, {}", run.output.trim()));
            continue;
        };
        let _ = writeln!(now, "{file} {said}");
        let bad = said.split(':').next().and_then(|n| n.parse().ok());
        if let Some(broken) = broken_law(&run, bad.expect("a line")) {
            wrong.push(format!("{file}: {broken}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    if std::env::var_os("PENTASPLINE_BLESS").is_some() {
        std::fs::write(&path, &now).expect("the table is written");
        return;
    }
    let differences: Vec<_> = now
        .lines()
        .filter(|line| !table.lines().any(|row| row == *line))
        .collect();
    assert!(
        now == table,
        "differs from {}: {}",
        path.display(),
        differences.join("\n")
    );
}

#[test]
fn every_error_of_the_catalogue_is_met_by_a_bad_program() {
    let table = std::fs::read_to_string(folder().join("expected.txt")).expect("the table");
    let met: BTreeSet<u16> = table
        .lines()
        .filter(|line| !line.starts_with('#'))
        .filter_map(|line| line.split(' ').nth(2)?.parse().ok())
        .collect();
    let missing: Vec<_> = catalogue::entries()
        .map(|entry| entry.message.code)
        .filter(|code| !met.contains(code))
        .collect();
    assert!(missing.is_empty(), "no program for {missing:?}");
}
