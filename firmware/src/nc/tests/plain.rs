//! Lines of plain coordinates take a short way; a comment behind one makes it take the general way.

use super::{equipped, xyzac};
use crate::config::Config;
use crate::nc::{Command, Interpreter, NcError};
use proptest::prelude::*;

/// Everything an interpreter says about `lines`, each with `tail` behind it, after `prelude`.
fn said(
    config: &Config,
    prelude: &str,
    lines: &[String],
    tail: &str,
) -> (Vec<Result<(), NcError>>, Vec<Command>, [i64; 5]) {
    let mut interpreter = Interpreter::new(config);
    let mut commands = Vec::new();
    for line in prelude.lines() {
        let taken = interpreter.line(config, line.as_bytes(), &mut |command| {
            commands.push(command)
        });
        assert_eq!(taken, Ok(()), "{line}");
    }
    let results = lines.iter().map(|line| {
        let text = format!("{line}{tail}");
        interpreter.line(config, text.as_bytes(), &mut |command| {
            commands.push(command)
        })
    });
    (results.collect(), commands, interpreter.position())
}

/// What may be in force when a line comes.
const PRELUDES: [&str; 20] = [
    "F100 G641 ADIS=0.5",
    "G0 G641 ADISPOS=0.5",
    "CSPLINE F100 G642",
    "G1 F1000",
    "G0",
    "CSPLINE F500",
    "ASPLINE F500\nX1 Y2",
    "BSPLINE SD=2 F500",
    "G1 F100 G91",
    "G1 G70 F10",
    "G1",
    "G95 S1000 F0.1",
    "G93 F2",
    "G2 F100",
    "F100 G55 T4 M6",
    "F100 G500 T4 M6 D0",
    "F100 G18 T4 M6 G60 BRISK",
    "T4 M6 G17 G41 F100",
    "T4 M6 G17 G41 X1 Y1 F100\nX20",
    "POLY F100\nPOX Q1",
];

fn number() -> impl Strategy<Value = String> {
    prop_oneof![
        8 => "-?[0-9]{1,3}\\.[0-9]{0,4}",
        2 => "[+-]?[0-9]{0,6}\\.?[0-9]{0,8}",
        1 => "-?(9[89]|10)[0-9]{3}\\.[0-9]{0,3}",
        1 => "[0-9]{1,3}E-?[0-9]",
        1 => Just(String::new()),
    ]
}

fn line() -> impl Strategy<Value = String> {
    let word = prop_oneof![
        12 => "[XYZACxyzac]",
        1 => "[A-Z]",
        1 => "=|\\.|,| ",
    ];
    let words = prop::collection::vec((word, number(), "[ \t]{0,2}"), 0..6);
    let front = prop_oneof![
        4 => Just(String::new()),
        4 => "[ ]?[Nn][0-9]{1,9}[ ]?",
        1 => "N[.0-9]{0,3}",
        1 => "/",
    ];
    (front, words).prop_map(|(front, words)| {
        let words = words
            .iter()
            .map(|(letter, number, gap)| format!("{letter}{number}{gap}"));
        front + &words.collect::<String>()
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]
    #[test]
    fn the_short_way_says_what_the_general_way_says(
        prelude in 0..PRELUDES.len(),
        lines in prop::collection::vec(line(), 1..4),
    ) {
        let config = equipped();
        let prelude = PRELUDES[prelude];
        prop_assert_eq!(
            said(&config, prelude, &lines, ""),
            said(&config, prelude, &lines, ";")
        );
    }
}

#[test]
fn the_longest_line_and_the_line_behind_the_last_end_are_the_same_both_ways() {
    let config = xyzac();
    for blanks in 90..97 {
        let line = format!("X1.5{}", " ".repeat(blanks - 4));
        let plain = said(&config, "G1 F100", &[line], "");
        assert_eq!(plain.0, [Ok(())]);
        let target = plain.2;
        assert_eq!(target, [1_500_000, 0, 0, 0, 0]);
    }
    let long = format!("X1.5{}", " ".repeat(93));
    assert!(said(&config, "G1 F100", &[long], "").0[0].is_err());
    let ended = [
        "X1".to_owned(),
        "M30".to_owned(),
        "F100 X2".to_owned(),
        "X3".to_owned(),
    ];
    assert_eq!(
        said(&config, "G1 F100", &ended, ""),
        said(&config, "G1 F100", &ended, ";")
    );
}
