//! `docs/benchmarks.md` from a [`Report`].

use std::fmt::Write;

use super::report::{shown, Group, Report};

const HEAD: &str = "\
# Benchmarks

This page is written by a program; edit `host-sim/src/bench/markdown.rs`, not this file.

    bash .ci/firmware stm32f4 qemu bench
    cargo run --release -p host-sim -- bench --json bench.json --markdown docs/benchmarks.md

The first command builds the images, the second measures and writes this page. `bench.json` holds the same numbers under
the keys printed here. A goal, where there is one, is the most a value may be (for the speeds of the simulator, the least).

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
pub fn page(report: &Report) -> String {
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
    ] {
        let _ = write!(
            text,
            "\n## {title}\n\n| key | value ({unit}) | goal | what |\n|---|---:|---:|---|\n"
        );
        for row in report.rows.iter().filter(|row| row.group == group) {
            let goal = row.goal().map(shown).unwrap_or_default();
            let _ = writeln!(
                text,
                "| `{}` | {} | {goal} | {} |",
                row.key,
                row.shown(),
                row.text
            );
        }
    }
    text.push_str(
        "\nA slot is 357 ns (5 kHz x 560). An edge is put into the slot in which the motion crosses the border of a step.\n",
    );
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
        let page = page(&report);
        assert_eq!(
            page.matches("| `tick_mean` | 2254 | 150 | tick |").count(),
            1
        );
        assert_eq!(
            page.matches("| `flash_bytes` | 1 | 262144 | flash |")
                .count(),
            1
        );
    }
}
