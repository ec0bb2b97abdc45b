//! What senders do to program text, and how they pace it: a program in its wire spelling makes the same steps behind each.
//!
//! A sender is modelled here as a change of the text and a flow. Programs are [`PROGRAMS`].

use std::collections::VecDeque;
use std::fmt::Write;

use whole_product_tests::campaign::ran;
use whole_product_tests::drive::{with_rig, Run, Script};
use whole_product_tests::oracle::read::Language;
use whole_product_tests::wire_programs::{WireProgram, PROGRAMS};

/// Longest line of the wire spelling.
const LINE_MAX: usize = 96;

/// Ticks a program may take.
const LIMIT: u64 = 2_000_000;

/// How a sender paces lines.
#[derive(Clone, Copy, Debug)]
enum Flow {
    /// As many lines as the bytes in flight allow.
    Counting(usize),
    /// A line, then its answer.
    Request,
}

/// Streams `text` with status requests among it, and gives back the run.
fn stream(program: &WireProgram, text: &str, flow: Flow) -> Run {
    let mut lines: VecDeque<&str> = text.split_inclusive('\n').collect();
    let name = program.name;
    with_rig(&program.machine(), |rig| {
        rig.controller.set_program_stops(false);
        rig.settle();
        rig.said();
        let mut flight: VecDeque<usize> = VecDeque::new();
        while !lines.is_empty() || !flight.is_empty() {
            assert!(rig.now < LIMIT, "{name}: no end\n{text}");
            while let Some(line) = lines.front() {
                let room = match flow {
                    Flow::Counting(window) => flight.iter().sum::<usize>() + line.len() <= window,
                    Flow::Request => flight.is_empty(),
                };
                if !room {
                    break;
                }
                rig.send(line.as_bytes());
                flight.push_back(line.len());
                lines.pop_front();
            }
            if rig.now % 1000 == 0 {
                rig.send(b"?");
            }
            rig.advance(1);
            for answer in rig.said().lines().map(str::trim) {
                if answer == "ok" {
                    assert!(flight.pop_front().is_some(), "{name}: one answer too many");
                }
                assert!(!answer.contains("error"), "{name}: {answer}\n{text}");
            }
        }
        assert!(rig.until_idle(LIMIT), "{name}: no end\n{text}");
        rig.run.finished = true;
    })
}

/// Takes `;` and parentheses out, with blanks at the end.
fn without_comments(line: &str) -> String {
    let mut depth = 0;
    let mut out = String::new();
    for c in line.chars() {
        match c {
            ';' => break,
            '(' => depth += 1,
            ')' => depth -= 1,
            _ if depth == 0 => out.push(c),
            _ => {}
        }
    }
    out.trim_end().to_owned()
}

fn without_blanks(line: &str) -> String {
    line.split_whitespace().collect()
}

/// X Y I J K P anew with at most four decimals; zero loses its digits and gains a sign.
fn rounded(line: &str) -> String {
    let mut out = String::new();
    let mut rest = line;
    while let Some(letter) = rest.chars().next() {
        rest = &rest[1..];
        out.push(letter);
        let digits = rest
            .find(|c: char| !(c.is_ascii_digit() || "+-.".contains(c)))
            .unwrap_or(rest.len());
        let (number, behind) = rest.split_at(digits);
        if let ('X' | 'Y' | 'I' | 'J' | 'K' | 'P', Ok(value)) = (letter, number.parse::<f64>()) {
            let text = format!("{value:.4}");
            let text = text.trim_end_matches('0').trim_end_matches('.');
            let _ = write!(out, "{}", if value == 0.0 { "-0" } else { text });
            rest = behind;
        }
    }
    out
}

/// G words of GRBL 1.1.
const GRBL: [f64; 36] = [
    0.0, 1.0, 2.0, 3.0, 4.0, 10.0, 17.0, 18.0, 19.0, 20.0, 21.0, 28.0, 28.1, 30.0, 30.1, 38.2,
    38.3, 38.4, 38.5, 40.0, 43.1, 49.0, 53.0, 54.0, 55.0, 56.0, 57.0, 58.0, 59.0, 61.0, 80.0, 90.0,
    91.0, 92.0, 93.0, 94.0,
];

/// Every G in `line` is one of GRBL's; a G inside of a name has no number.
fn is_known_to_grbl(line: &str) -> bool {
    line.split('G').skip(1).all(|rest| {
        let digits = rest
            .find(|c: char| !(c.is_ascii_digit() || c == '.'))
            .unwrap_or(rest.len());
        rest[..digits].parse().map_or(true, |g| GRBL.contains(&g))
    })
}

/// Every line of `text` through `change`.
fn each(text: &str, end: &str, change: impl Fn(&str) -> String) -> String {
    text.lines()
        .map(|line| format!("{}{end}", change(line)))
        .collect()
}

/// The program behind `change` and `flow` makes the steps it makes untouched.
fn same(program: &WireProgram, text: &str, flow: Flow) {
    let whole = ran(&program.machine(), &Script::new(program.text))
        .unwrap_or_else(|broken| panic!("{}: {broken}", program.name));
    assert!(whole.moving() > 0, "{}", program.name);
    let run = stream(program, text, flow);
    assert_eq!(run.end(), whole.end(), "{}\n{text}", program.name);
    assert_eq!(
        run.digest, whole.digest,
        "{}, {flow:?}\n{text}",
        program.name
    );
}

fn survives(flow: Flow, change: impl Fn(&str) -> String) {
    for program in &PROGRAMS {
        same(program, &change(program.text), flow);
    }
}

#[test]
fn the_programs_are_in_the_spelling_of_the_wire() {
    for WireProgram { name, text, .. } in &PROGRAMS {
        for line in text.lines() {
            assert!(line.len() <= LINE_MAX, "{name}: {line}");
            assert!(
                !without_comments(line).contains(['=', '[', ']', '"']),
                "{name}: {line}"
            );
            let long = line
                .split('.')
                .skip(1)
                .any(|tail| tail.chars().take_while(char::is_ascii_digit).count() > 4);
            assert!(!long, "{name}: {line}");
        }
    }
}

#[test]
fn bcnc_removes_blanks_rounds_and_drops_lines_with_an_equals_sign() {
    survives(Flow::Counting(128), |text| {
        let lines = each(text, "\n", |line| {
            rounded(&without_blanks(&without_comments(line)))
        });
        let kept: String = lines
            .split_inclusive('\n')
            .filter(|line| !line.contains('='))
            .collect();
        format!("\n\n{kept}")
    });
}

#[test]
fn grbl_streamer_removes_blanks_and_empties_lines_with_an_unknown_g() {
    let mut through = Vec::new();
    for program in &PROGRAMS {
        // What it does not know it does not send: such programs are not for this sender.
        if program.text.lines().all(is_known_to_grbl) {
            let text = each(program.text, "\n", |line| {
                without_blanks(&without_comments(line))
            });
            same(program, &text, Flow::Counting(151));
            through.push(program.name);
        }
    }
    for kind in [
        "Akima",
        "cubic",
        "rational",
        "spline path",
        "tool vector",
        "circles",
        "polynomials",
        "words of GRBL",
        "Heidenhain",
        "Heidenhain splines",
    ] {
        assert!(through.contains(&kind), "{kind} does not get through");
    }
}

#[test]
fn cncjs_eats_parentheses_and_ends_with_a_dwell() {
    for program in &PROGRAMS {
        let mut text = each(program.text, "\n", without_comments);
        // Conversational programs know no G4; the refusal comes when all is done.
        if program.language != Language::Heidenhain {
            text += "G4 P0.5\n";
        }
        same(program, &text, Flow::Counting(1015));
    }
}

#[test]
fn grblhud_and_pygrbl_send_comments_as_they_are() {
    survives(Flow::Counting(128), |text| format!("\r\n\r\n{text}"));
}

#[test]
fn a_program_sent_line_by_line_makes_the_same_steps() {
    survives(Flow::Request, str::to_owned);
}

#[test]
fn case_does_not_matter() {
    survives(Flow::Counting(128), str::to_lowercase);
    survives(Flow::Counting(128), |text| {
        let turned = |(k, c): (usize, char)| {
            if k % 2 == 0 {
                c.to_ascii_lowercase()
            } else {
                c.to_ascii_uppercase()
            }
        };
        text.chars().enumerate().map(turned).collect()
    });
}

#[test]
fn line_ends_of_any_kind_and_empty_lines_between_do_not_matter() {
    survives(Flow::Counting(128), |text| {
        each(text, "\r\n", str::to_owned)
    });
    survives(Flow::Request, |text| each(text, "\n\n  \n", str::to_owned));
}
