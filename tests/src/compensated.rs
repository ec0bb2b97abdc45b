//! Programs with cutter compensation, judged without repeating the compensation.
//!
//! In: a program and its run. Out: the program without `G41`, `G42` and `G40`, whose path is the contour, and how the
//! centres of the tool lay beside it.

use std::ops::RangeInclusive;

use pentaspline::config::Config;

use crate::drive::Run;
use crate::laws;
use crate::oracle::cutter::{Clearance, Contour};
use crate::oracle::path::path;

/// `text` without its compensation: what it programs is what the centre follows. Lines keep their numbers.
#[must_use]
pub fn bare(text: &str) -> String {
    let word = |word: &str| matches!(word, "G40" | "G41" | "G42");
    text.lines()
        .map(|line| {
            let kept: Vec<&str> = line.split_whitespace().filter(|w| !word(w)).collect();
            kept.join(" ") + "\n"
        })
        .collect()
}

/// How the centres of `run` lay beside the contour of `text` while the tool was on `lines`, and only beside the contour
/// of those lines: a contour may pass the same place more than once.
///
/// # Errors
/// A centre farther than `reach` mm away.
pub fn clearance(
    config: &Config,
    run: &Run,
    text: &str,
    lines: &RangeInclusive<u32>,
    reach: f64,
) -> Result<Clearance, String> {
    let mut dense = Vec::new();
    for curve in path(&bare(text)) {
        if lines.contains(&curve.line) {
            curve.shape.dense(1e-5, &mut dense);
            dense.push(curve.shape.at(1.0));
        }
    }
    let contour = Contour::new(dense.iter().map(|p| [p[0], p[1]]), reach);
    let on_lines = |tick: &&crate::drive::Tick| tick.moving && lines.contains(&tick.block);
    let centres = run.ticks.iter().filter(on_lines).map(|tick| {
        let p = laws::place(config, tick);
        [p[0], p[1]]
    });
    contour.clearance(centres)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_is_the_program_line_by_line() {
        let text = "N10 G42\nN20 G1 X5\nN30 G40 G1 X7\n";
        assert_eq!(bare(text), "N10\nN20 G1 X5\nN30 G1 X7\n");
    }
}
