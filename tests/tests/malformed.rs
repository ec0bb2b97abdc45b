//! Bad programs never panic, never move the machine past the line before the bad one, and say where and why.
//!
//! `tests/malformed/expected.txt` holds one row per program: file, `line:column`, code, text. `PENTASPLINE_BLESS=1`
//! rewrites it; read the difference before you commit it.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::PathBuf;

use pentaspline::catalogue;
use pentaspline::config::{Config, Head};
use pentaspline::nc::expression::compare;
use pentaspline::nc::parameters::Parameters;
use pentaspline::units::{Steps, NANO_PER_UNIT};
use whole_product_tests::drive::{drive, with_rig, Run, Script};
use whole_product_tests::{examples, laws};

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("malformed")
}

/// What the controller said about its first error, as `line:column code text`; `$:$` for a `$` command.
fn complaint(run: &Run) -> Option<String> {
    let remarks: Vec<&str> = run.remarks().collect();
    let at = remarks.iter().position(|line| line.starts_with("error:"))?;
    let code = remarks[at].strip_prefix("error:")?;
    let text = remarks.get(at.checked_sub(1)?)?;
    let text = text.strip_prefix("[MSG:")?.strip_suffix(']')?;
    let Some(text) = text.strip_prefix("error line ") else {
        return Some(format!("$:$ {code} {text}"));
    };
    let (place, text) = text.split_once(": ")?;
    Some(format!("{} {code} {text}", place.replace(" column ", ":")))
}

/// The built-in machine; for programs named `other_machine_`, one with axes X Y W, without a head that turns the tool
/// and with a Y axis of 200 m.
fn machine(file: &str) -> Config {
    let mut config = examples::machine().config;
    if file.starts_with("other_machine_") {
        config.head = Head::None;
        config.axes[2].letter = b'W';
        config.axes[1].steps_per_unit = Steps::from_num(20_000);
        config.axes[1].travel_min = -100_000 * NANO_PER_UNIT;
        config.axes[1].travel_max = 100_000 * NANO_PER_UNIT;
    }
    config
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
fn broken_law(config: &Config, run: &Run, bad: u32) -> Option<String> {
    let past = run.ticks.iter().find(|t| t.moving && t.block >= bad);
    if let Some(tick) = past {
        return Some(format!("line {} moves", tick.block));
    }
    let last = run.ticks.last()?;
    if last.moving && last.feed != 0.0 {
        return Some("not at rest".to_owned());
    }
    laws::stays_within_limits(config, run, &BTreeSet::new(), 0.005)
        .and_then(|()| laws::emits_exactly_the_commanded_steps(run))
        .and_then(|()| laws::never_runs_backwards(run))
        .err()
}

#[test]
fn every_bad_program_is_refused_where_and_why_the_table_says() {
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
        let config = machine(file);
        let run = drive(&config, &Script::new(text));
        let Some(said) = complaint(&run) else {
            wrong.push(format!("{file}: not refused, {}", run.output.trim()));
            continue;
        };
        let _ = writeln!(now, "{file} {said}");
        let bad = said.split(':').next().and_then(|n| n.parse().ok());
        if let Some(broken) = broken_law(&config, &run, bad.unwrap_or(u32::MAX)) {
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

/// `error:N` of every answer to `text`.
fn answered(run: &Run) -> impl Iterator<Item = u16> + '_ {
    run.remarks()
        .filter_map(|line| line.strip_prefix("error:")?.parse().ok())
}

#[test]
fn every_error_of_the_catalogue_is_met() {
    let mut met: BTreeSet<u16> = programs()
        .iter()
        .flat_map(|(file, text)| {
            let run = drive(&machine(file), &Script::new(text));
            answered(&run).collect::<Vec<_>>()
        })
        .collect();
    // A sender that is silent until the contour has ended, and then goes on with an inner corner.
    let config = examples::machine().config;
    let silent = with_rig(&config, |rig| {
        for text in ["F6000 T1 M6\nG41 X10\nX20\n", "Y20\n"] {
            rig.send(text.as_bytes());
            rig.advance(4 * u64::from(config.starve_ticks));
        }
    });
    met.extend(answered(&silent));
    // Conditions stand in lines that the host follows.
    for condition in ["1", "1 == 1 AND 2 == 2"] {
        let refused = compare(condition.as_bytes(), &mut 0, &Parameters::new());
        met.extend(refused.err().map(|fault| fault.kind.message().code));
    }
    let missing: Vec<_> = catalogue::entries()
        .map(|entry| entry.message.code)
        .filter(|code| !met.contains(code) && *code != catalogue::machine::INTERNAL.code)
        .collect();
    assert!(missing.is_empty(), "nothing gives {missing:?}");
    assert!(!met.contains(&catalogue::machine::INTERNAL.code));
}
