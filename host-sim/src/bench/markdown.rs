//! `docs/benchmarks.md` from a [`Report`] and the [`Budgets`].

use std::fmt::Write;

use super::budget::Budgets;
use super::readme::ratio;
use super::report::{shown, Group, Report};

/// What stands before the numbers.
pub const HEAD: &str = "\
# Benchmarks

This page is written by a program; edit `host-sim/src/bench/markdown.rs`, not this file.

    bash docs/refresh benchmarks

builds the images, measures, lowers budgets, and writes this page, [benchmarks.json](benchmarks.json) with the same numbers under the
keys printed here, and the paragraph on performance of the README. To measure only:

    bash .ci/firmware stm32f4 qemu bench
    cargo run --release -p host-sim -- bench --json bench.json

## Goals and budgets

A goal is the most a value should be; for the speeds of the simulator, the least. The margin is value over goal.

A budget is the most a value may be. `host-sim bench --check` compares and ends with exit code 9 if a value is over its budget by more than
2 %, and `.ci/test` does so with freshly built images (`--counts` leaves out what depends on the PC). Budgets stand in
[budgets.toml](budgets.toml): the goal where it is met, else the last measured value, with the reason and the next idea. The
command above lowers them. Nothing raises one: delete its line, run the command, and say why in the commit.

Compilers differ. The file names the one its budgets were measured with. With another one, 10 % are allowed instead of 2 %, and
`--check` warns and names both: two releases (1.95 from rustup, 1.96 from Debian) differed by -7.3 % to +1.2 % in counts and by 3.3 % in flash, so what is compared
still says something, and a machine that cannot have the compiler named is no reason to look away. Budgets are lowered with the compiler
they were measured with; to change it, delete the line `compiler` and all budgets, and run the command.

Cost by program length is measured with `--scale`, which takes a minute. Instructions cannot be counted there in reasonable time, so
`tests/tests/linear_cost.rs` holds what does not depend on the PC: heap, ticks and background calls.

`stack_bytes` has no budget of its own: how deep interrupts nest depends on when bytes arrive. It is part of `ram_bytes`, where that is
less than the 2 %.

## What a count is

**Instruction counts are counts, not times.** The image `bench.elf` holds the core as the product has it: same sources, same
profile `board` (`opt-level = 2`, link-time optimisation, one code generation unit). It runs on the Cortex-M4 of
`qemu-system-arm -M netduinoplus2` with `-icount shift=0`: every instruction takes one nanosecond of virtual time, and a timer
of 1 GHz, read before and after a call, counts the instructions between. The count of an empty measurement is subtracted. The
program goes through the serial port and time is the number of ticks, so the counts are the same on every PC, in
every run; they change with the sources and with the compiler.

An emulator knows no pipeline, no flash wait states, no bus contention. Microseconds need a board. Where a
count is set against the clock (`load_667k`) the assumption stands beside it.

Counted: everything from the call to its return, the call itself included. The servo rows are `Servo::tick` (s(t), u(s), P(u),
step edges, status words, queues) and `PortExpander::expand` (560 port words per tick for the DMA). Not counted: exception entry and
exit, the acknowledge of the timer and the safety inputs around those two calls, the DMA interrupt, and the serial interrupt.

The programs are formulas in `host-sim/src/bench/vectors.rs`, for the built-in machine with all five axes as fast as its X axis.
";

/// The page.
#[must_use]
pub fn page(report: &Report, budgets: &Budgets) -> String {
    let mut text = HEAD.to_owned();
    // Writing to a String cannot fail.
    let _ = write!(text, "\nThese numbers: {}.\n", report.compiler);
    for (group, title, unit) in [
        (Group::Servo, "Servo interrupt", "instructions"),
        (Group::Background, "Background", "instructions"),
        (Group::Memory, "Memory", "bytes"),
        (
            Group::Simulator,
            "Simulator on this PC",
            "depends on the PC",
        ),
        (Group::Placement, "Placement of step edges", "nanoseconds"),
        (
            Group::Length,
            "Cost by program length",
            "us or KiB, depends on the PC",
        ),
    ] {
        if report.rows.iter().all(|row| row.group != group) {
            continue;
        }
        let _ = write!(
            text,
            "\n## {title}\n\n| key | value ({unit}) | goal | margin | budget | what |\n|---|---:|---:|---:|---:|---|\n"
        );
        for row in report.rows.iter().filter(|row| row.group == group) {
            let entry = budgets.entry(&row.key);
            let column = |value: Option<f64>| value.map(shown).unwrap_or_default();
            let margin = entry.aim().map(|aim| ratio(row.value / aim));
            let _ = writeln!(
                text,
                "| `{}` | {} | {} | {} | {} | {} |",
                row.key,
                row.shown(),
                column(entry.aim()),
                margin.unwrap_or_default(),
                column(entry.budget),
                row.text
            );
        }
    }
    text.push_str(
        "\nA slot is 357 ns (5 kHz x 560). An edge is put into the slot in which the motion crosses the border of a step.\n",
    );
    text.push_str("\n## Goals that are missed\n\n");
    text.push_str("| key | margin | reason | next idea |\n|---|---:|---|---|\n");
    for row in &report.rows {
        let entry = budgets.entry(&row.key);
        if let (false, Some(aim)) = (entry.is_met(row.value), entry.aim()) {
            let margin = ratio(row.value / aim);
            let (key, reason, next) = (&row.key, entry.reason, entry.next);
            let _ = writeln!(text, "| `{key}` | {margin} | {reason} | {next} |");
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_stands_on_the_page_once() {
        let mut report = Report::default();
        report.group(Group::Servo);
        report.add("tick_mean", 2254.3, "instructions", "tick");
        report.group(Group::Memory);
        report.add("flash_bytes", 1.0, "bytes", "flash");
        let budgets =
            "[tick_mean]\ngoal = 150\nbudget = 2255\nreason = \"long\"\nnext = \"short\"\n\
                       [flash_bytes]\ngoal = 262144\nbudget = 262144\n";
        let page = page(&report, &Budgets::parse(budgets).unwrap());
        for line in [
            "| `tick_mean` | 2254 | 150 | 15.0 | 2255 | tick |",
            "| `flash_bytes` | 1 | 262144 | 0.00 | 262144 | flash |",
            // A goal that is missed says why, one that is met does not.
            "| `tick_mean` | 15.0 | long | short |",
        ] {
            assert_eq!(page.matches(line).count(), 1, "{line}\n{page}");
        }
        assert_eq!(page.matches("| `flash_bytes` |").count(), 1);
    }
}
