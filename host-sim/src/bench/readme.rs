//! The paragraph on performance in `README.md`, from the numbers of a JSON file.
//!
//! In: values by key and the [`Budgets`]. Out: the text between two marks. Nothing is measured here, so a test can tell
//! whether the page says what the committed numbers say.

use std::collections::BTreeMap;
use std::fmt::Write;

use super::budget::Budgets;
use super::report::shown;

/// Line before the paragraph.
pub const BEGIN: &str = "<!-- performance: begin; written by `bash docs/refresh benchmarks` -->\n";
/// Line behind it.
pub const END: &str = "<!-- performance: end -->\n";

/// Keys shown, with what a reader calls them.
const ROWS: &[(&str, &str)] = &[
    (
        "tick_mean",
        "instructions per servo tick, five axes moving, no step due",
    ),
    ("tick_max", "the same, longest"),
    (
        "step_100k",
        "instructions per step, all-in, 5 x 100 k steps/s",
    ),
    (
        "load_667k",
        "share of 168 MHz at 5 x 667 k steps/s, 1.35 cycles per instruction assumed",
    ),
    ("parse_line", "instructions per text line of five axes"),
    (
        "spline_block",
        "instructions in the background per spline knot",
    ),
    (
        "lookahead_block",
        "instructions per block, planning far ahead over dense blocks",
    ),
    ("ram_bytes", "bytes of RAM, stack included"),
    ("flash_bytes", "bytes of flash"),
    ("step_jitter_ns", "ns a step edge is off its place, at most"),
    (
        "sim_realtime_factor",
        "simulator: seconds of motion per second of one core",
    ),
    (
        "sim_blocks_per_s",
        "simulator: blocks per second in `check`",
    ),
];

/// The paragraph, with its marks.
#[must_use]
pub fn block(values: &BTreeMap<String, f64>, budgets: &Budgets) -> String {
    let mut text = BEGIN.to_owned();
    text.push_str("| what | key | value | goal | value / goal |\n|---|---|---:|---:|---:|\n");
    let (mut met, mut aims) = (0, 0);
    for &(key, what) in ROWS {
        let Some(&value) = values.get(key) else {
            continue;
        };
        let entry = budgets.entry(key);
        let at_least = if entry.least.is_some() { "≥ " } else { "" };
        let (goal, margin) = entry.aim().map_or_else(Default::default, |aim| {
            aims += 1;
            met += u32::from(entry.is_met(value));
            (format!("{at_least}{}", shown(aim)), ratio(value / aim))
        });
        // Writing to a String cannot fail.
        let _ = writeln!(
            text,
            "| {what} | `{key}` | {} | {goal} | {margin} |",
            shown(value)
        );
    }
    let _ = write!(
        text,
        "\n{met} of {aims} goals are met. Made by\n\n    \
         bash .ci/firmware stm32f4 qemu bench\n    \
         cargo run --release -p host-sim -- bench --json bench.json\n\n\
         An instruction count is not a time: the emulator that counts knows no pipeline, no flash wait states and no bus. The rows of\n\
         the simulator depend on the PC. All numbers, what each of them counts, why goals are missed and what comes next:\n\
         [docs/benchmarks.md](docs/benchmarks.md).\n"
    );
    if let [Some(short), Some(long), Some(kib_short), Some(kib_long)] = [
        "block_us_1e3",
        "block_us_1e6",
        "stream_kib_1e3",
        "stream_kib_1e6",
    ]
    .map(|key| values.get(key).copied().map(shown))
    {
        let _ = write!(
            text,
            "\nTime grows linearly with the program, and memory does not grow with it: `check` takes {short} us per block of a program of\n\
             10^3 blocks and {long} us per block of one of 10^6; core and feeder take {kib_short} KiB and {kib_long} KiB of memory for them\n\
             (the simulator keeps the text as well).\n"
        );
    }
    text.push_str(END);
    text
}

/// `page` with its paragraph replaced by `block`; `None` if the marks are not there once each, in order.
#[must_use]
pub fn replace(page: &str, block: &str) -> Option<String> {
    let (before, rest) = page.split_once(BEGIN)?;
    let (inside, after) = rest.split_once(END)?;
    let again = [before, inside, after]
        .iter()
        .any(|part| part.contains(BEGIN) || part.contains(END));
    (!again).then(|| format!("{before}{block}{after}"))
}

/// A value over its goal.
#[must_use]
pub fn ratio(value: f64) -> String {
    if value >= 10.0 {
        shown(value)
    } else {
        format!("{value:.2}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_paragraph_says_value_goal_and_margin() {
        let budgets = Budgets::parse("[tick_mean]\ngoal = 150\n[sim_blocks_per_s]\nleast = 400\n");
        let values = [("tick_mean", 165.0), ("sim_blocks_per_s", 800.0)]
            .map(|(key, value)| (key.to_owned(), value));
        let text = block(&values.into(), &budgets.unwrap());
        assert!(text.contains("| `tick_mean` | 165 | 150 | 1.10 |\n"));
        assert!(text.contains("| `sim_blocks_per_s` | 800 | ≥ 400 | 2.00 |\n"));
        assert!(text.contains("\n1 of 2 goals are met."));
    }

    #[test]
    fn only_what_stands_between_the_marks_is_replaced() {
        let page = format!("a\n{BEGIN}old\n{END}b\n");
        let block = format!("{BEGIN}new\n{END}");
        let new = replace(&page, &block).unwrap();
        assert_eq!(new, format!("a\n{BEGIN}new\n{END}b\n"));
        assert_eq!(replace("no marks\n", &block), None);
        assert_eq!(replace(&format!("{page}{page}"), &block), None);
    }
}
