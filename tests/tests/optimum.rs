//! The corpus of `tests/corpus/` against the shortest times any planner could need.
//!
//! The optimum of each program stands in `tests/oracle/data/optimum.json` and comes from `tests/oracle/optimum.py`, which shares
//! nothing with the planner. Always held: every limit (0.5 %, jerk 2 %), nobody is faster than the optimum, nobody is slower than
//! recorded in `tests/golden/corpus_ticks.json`, which
//! `PENTASPLINE_BLESS=1 cargo test -p whole-product-tests --test optimum` writes anew. With `PENTASPLINE_OPTIMUM=1` the aim is held
//! too: 1.03 (BRISK) and 1.08 (SOFT) times the optimum in total, 1.15 for any one program.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use serde_json::Value;
use whole_product_tests::drive::{drive, Run, Script};
use whole_product_tests::{examples, laws};

/// A time below this share of the optimum is a broken limit, not a good plan.
const FASTEST: f64 = 0.995;
const LARGEST_SINGLE: f64 = 1.15;

/// How a program is run.
struct Mode {
    word: &'static str,
    key: &'static str,
    total: f64,
}

const BRISK: Mode = Mode {
    word: "BRISK",
    key: "brisk",
    total: 1.03,
};
const SOFT: Mode = Mode {
    word: "SOFT",
    key: "soft",
    total: 1.08,
};

fn file(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(name)
}

fn json(name: &str) -> Value {
    let text = std::fs::read_to_string(file(name)).unwrap_or_else(|_| "{}".to_owned());
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// Names of the programs, without `.nc`.
fn programs() -> Vec<String> {
    let folder = std::fs::read_dir(file("corpus")).expect("the corpus");
    let mut names: Vec<String> = folder
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|e| e == "nc"))
        .map(|path| path.file_stem().expect("a name").to_string_lossy().into())
        .collect();
    names.sort();
    assert!(names.len() >= 24, "{} programs", names.len());
    names
}

/// Ticks from the first in motion to the last.
fn span(run: &Run) -> usize {
    let moving = |tick: &whole_product_tests::drive::Tick| tick.moving;
    let first = run.ticks.iter().position(moving);
    let last = run.ticks.iter().rposition(moving);
    first.zip(last).map_or(0, |(first, last)| last - first + 1)
}

/// Runs `name`, holds the limits, and returns its ticks.
fn timed(name: &str, mode: &Mode) -> usize {
    let config = examples::machine().config;
    let text = std::fs::read_to_string(file(&format!("corpus/{name}.nc"))).expect("a program");
    assert_eq!(text.matches("SOFT").count(), 1, "{name}: says SOFT once");
    let text = text.replace("SOFT", mode.word);
    let run = drive(&config, &Script::new(&text));
    assert!(run.finished, "{name}: {}", run.output);
    let mistake = run.remarks().find(|line| line.contains("error"));
    assert_eq!(mistake, None, "{name}");
    let brisk: BTreeSet<u32> = match mode.word {
        "BRISK" => (0..=text.lines().count() as u32).collect(),
        _ => BTreeSet::new(),
    };
    let peaks = laws::peaks(&config, &run, &brisk);
    let largest = |shares: &[f64]| shares.iter().copied().fold(0.0, f64::max);
    for (what, shares, most) in [
        ("velocity", &peaks.v, 1.005),
        ("acceleration", &peaks.a, 1.005),
        ("jerk", &peaks.j, 1.02),
    ] {
        let share = largest(shares);
        assert!(share <= most, "{name} {}: {what} {share:.4}", mode.word);
    }
    span(&run)
}

fn corpus_against_optimum(mode: &Mode) {
    let hz = f64::from(examples::machine().config.servo_hz);
    let optimum = json("oracle/data/optimum.json");
    let recorded = json("golden/corpus_ticks.json");
    let (mut ours, mut best, mut worst, mut faults) = (0.0, 0.0, 0.0_f64, Vec::new());
    let mut now = BTreeMap::new();
    println!(
        "{:22} {:>10} {:>10} {:>7}",
        mode.word, "s", "optimum", "ratio"
    );
    for name in programs() {
        let entry = &optimum["programs"][&name];
        let shortest = entry[format!("{}_s", mode.key)].as_f64();
        let shortest = shortest.unwrap_or_else(|| panic!("{name}: no optimum"));
        let ticks = timed(&name, mode);
        let time = ticks as f64 / hz;
        println!(
            "{name:22} {time:10.4} {shortest:10.4} {:7.3}",
            time / shortest
        );
        if time < FASTEST * shortest {
            faults.push(format!("{name}: {time} s, the optimum is {shortest} s"));
        }
        if let Some(was) = recorded[mode.key][&name].as_u64() {
            if ticks as u64 > was {
                faults.push(format!("{name}: {ticks} ticks, {was} were recorded"));
            }
        }
        ours += time;
        best += shortest;
        worst = worst.max(time / shortest);
        now.insert(name, ticks);
    }
    println!("{:22} {ours:10.4} {best:10.4} {:7.3}", "total", ours / best);
    println!("{:22} {:21} {worst:7.3}", "largest", "");
    if std::env::var_os("PENTASPLINE_BLESS").is_some() {
        // Read again: the test of the other mode writes the same file.
        let mut all = json("golden/corpus_ticks.json");
        all[mode.key] = serde_json::to_value(&now).expect("a table");
        let text = serde_json::to_string_pretty(&all).expect("text") + "\n";
        std::fs::write(file("golden/corpus_ticks.json"), text).expect("the table is written");
        faults.retain(|fault| !fault.contains("recorded"));
    } else {
        let rows = recorded[mode.key].as_object().map_or(0, |rows| rows.len());
        assert_eq!(rows, now.len(), "every program is recorded");
    }
    assert!(faults.is_empty(), "{faults:#?}");
    assert!(ours <= mode.total * best, "total {:.4}", ours / best);
    if std::env::var_os("PENTASPLINE_OPTIMUM").is_some() {
        assert!(worst <= LARGEST_SINGLE, "largest {worst:.3}");
    }
}

#[test]
fn corpus_is_neither_faster_than_possible_nor_slower_than_recorded() {
    corpus_against_optimum(&BRISK);
    corpus_against_optimum(&SOFT);
}
