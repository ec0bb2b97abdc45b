//! `docs/language.md` says what the control does: every example in it runs, and no word of the control is left out.

use std::collections::BTreeSet;
use std::path::PathBuf;

use host_sim::program::Program;
use pentaspline::config::Dialect;
use pentaspline::nc;
use whole_product_tests::drive::{drive, Script};
use whole_product_tests::{examples, laws};

/// A fenced block `nc` of the guide.
struct Example {
    /// Line of its fence.
    line: usize,
    /// What stands behind `nc` on the fence.
    kind: String,
    text: String,
}

fn examples_of_the_guide() -> Vec<Example> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../docs/language.md");
    let guide = std::fs::read_to_string(path).expect("the guide");
    let mut examples = Vec::new();
    let mut open: Option<Example> = None;
    for (index, line) in guide.lines().enumerate() {
        match (&mut open, line.strip_prefix("```")) {
            (None, Some(fence)) if fence == "nc" || fence.starts_with("nc ") => {
                let kind = fence.trim_start_matches("nc").trim().to_owned();
                open = Some(Example {
                    line: index + 1,
                    kind,
                    text: String::new(),
                });
            }
            (Some(_), Some(_)) => examples.extend(open.take()),
            (Some(example), None) => {
                example.text.push_str(line);
                example.text.push('\n');
            }
            _ => {}
        }
    }
    assert!(open.is_none(), "a fence is not closed");
    examples
}

#[test]
fn every_example_runs_to_its_end_within_the_limits() {
    let examples = examples_of_the_guide();
    assert!(examples.len() >= 12, "{} examples", examples.len());
    let mut wrong = Vec::new();
    for example in &examples {
        let mut config = examples::machine().config;
        let mut text = example.text.clone();
        match example.kind.as_str() {
            "" => {}
            "fanuc" => config.dialect = Dialect::Fanuc,
            "heidenhain" => config.dialect = Dialect::Heidenhain,
            "host" => {
                let program = Program::from_text("guide", &text).expect("a program");
                text = program
                    .lines()
                    .map(|line| format!("{}\n", String::from_utf8_lossy(line)))
                    .collect();
            }
            other => panic!("line {}: what is `nc {other}`?", example.line),
        }
        let run = drive(&config, &Script::new(&text));
        let errors: Vec<_> = run
            .remarks()
            .filter(|line| line.contains("error"))
            .collect();
        let mut complain = |what: String| wrong.push(format!("line {}: {what}", example.line));
        if !errors.is_empty() || !run.finished {
            complain(format!("finished {}, {errors:?}", run.finished));
            continue;
        }
        if run.moving() == 0 {
            complain("nothing moves".to_owned());
        }
        if let Err(broken) = laws::emits_exactly_the_commanded_steps(&run) {
            complain(broken);
        }
    }
    assert!(wrong.is_empty(), "docs/language.md\n{}", wrong.join("\n"));
}

/// Words of a program text: letters with the number behind them, or letters alone.
fn words(text: &str) -> BTreeSet<String> {
    let mut words = BTreeSet::new();
    for line in text.lines() {
        let line = line.split(';').next().unwrap_or_default().to_uppercase();
        let bytes = line.as_bytes();
        let mut at = 0;
        while at < bytes.len() {
            if !bytes[at].is_ascii_alphabetic() {
                at += 1;
                continue;
            }
            let begin = at;
            while at < bytes.len() && bytes[at].is_ascii_alphabetic() {
                at += 1;
            }
            words.insert(line[begin..at].to_owned());
            let number = at;
            while at < bytes.len() && (bytes[at].is_ascii_digit() || bytes[at] == b'.') {
                at += 1;
            }
            // `G01` is `G1`.
            let digits = line[number..at].trim_start_matches('0');
            let digits = if digits.is_empty() { "0" } else { digits };
            if at > number {
                words.insert(format!("{}{digits}", &line[begin..number]));
                // Keywords with a digit in their name: `ATAN2`.
                words.insert(line[begin..at].to_owned());
            }
        }
    }
    words
}

#[test]
fn every_word_of_the_control_stands_in_an_example() {
    let shown: BTreeSet<String> = examples_of_the_guide()
        .iter()
        .flat_map(|example| words(&example.text))
        .collect();
    let all: Vec<String> = nc::vocabulary().map(|word| word.to_string()).collect();
    assert!(all.len() > 100, "{} words", all.len());
    // Understood so that they can be refused by name; the guide says so in its text.
    let refused = ["G33", "G331", "G332", "G96", "G961", "IF", "GOTOB"];
    let guide = std::fs::read_to_string(
        PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../docs/language.md"),
    )
    .expect("the guide");
    for word in refused {
        assert!(guide.contains(word), "{word}");
    }
    let missing: Vec<_> = all
        .iter()
        .filter(|word| !shown.contains(*word) && !refused.contains(&word.as_str()))
        .collect();
    assert!(
        missing.is_empty(),
        "no example in docs/language.md: {missing:?}"
    );
}
