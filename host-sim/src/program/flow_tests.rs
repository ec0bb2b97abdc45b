//! Laws of the flow: what runs, in which order, and what is said of a flow that leads nowhere.

use super::tests::{sent, Folder};
use super::*;
use crate::diagnostics::Exit;

fn follow(text: &str) -> Vec<String> {
    sent(&Program::from_text("p.mpf", text).unwrap())
}

fn refusal(text: &str) -> String {
    match Program::from_text("p.mpf", text) {
        Ok(program) => panic!("accepted: {:?}", sent(&program)),
        Err(failure) => {
            assert_eq!(failure.exit, Exit::Program);
            failure.render()
        }
    }
}

fn reading(dialect: Dialect, block_skip: bool) -> Reading {
    Reading {
        dialect,
        block_skip,
        ..Reading::default()
    }
}

#[test]
fn a_loop_over_r_parameters_is_unrolled() {
    let text = "R1=0 R2=R1+3\nLOOP1: G1 X=R1 F100\nN30 R1=R1+1\nIF R1 < R2 GOTOB LOOP1\nM30\n";
    assert_eq!(
        follow(text),
        [
            "R1=0 R2=R1+3",
            "LOOP1: G1 X=R1 F100",
            "N30 R1=R1+1",
            "LOOP1: G1 X=R1 F100",
            "N30 R1=R1+1",
            "LOOP1: G1 X=R1 F100",
            "N30 R1=R1+1",
            "M30"
        ]
    );
}

#[test]
fn what_stands_before_a_jump_is_sent_and_counts_for_it() {
    let text = "X1\nAGAIN:\n/N20 R7 = R7 + 1 Y2 IF (R7 >= 2) GOTOF DONE ; (GOTOF X)\nGOTOB AGAIN\nDONE: M30\n";
    assert_eq!(
        follow(text),
        [
            "X1",
            "AGAIN:",
            "/N20 R7 = R7 + 1 Y2",
            "AGAIN:",
            "/N20 R7 = R7 + 1 Y2",
            "DONE: M30"
        ]
    );
}

#[test]
fn every_streamed_line_of_a_loop_leads_back_to_its_file() {
    let program = Program::from_text(
        "p",
        "R1=R1+1\nAA: IF R1==3 GOTOF BB\nR1=R1+1 Q\nGOTOB AA\nBB: X1\n",
    )
    .unwrap();
    let places: Vec<usize> = (1..=program.len())
        .map(|line| program.locate(line, 1).unwrap().line)
        .collect();
    assert_eq!(places, [1, 3, 3, 5]);
    assert_eq!(program.locate(3, 9).unwrap().text, "R1=R1+1 Q");
}

#[test]
fn jumps_lead_to_labels_and_block_numbers_in_their_direction() {
    assert_eq!(follow("GOTOF N30\nN20 X2\nN30 X3\n"), ["N30 X3"]);
    assert_eq!(follow("goto end_1\nX2\nEnd_1:X3\n"), ["End_1:X3"]);
    // Block numbers may repeat: the nearest one in the direction of the jump counts.
    assert_eq!(
        follow("N10 X1\nGOTOF N10\nX2\nN10 X3\nX4\nN10 X5\n"),
        ["N10 X1", "N10 X3", "X4", "N10 X5"]
    );
    assert_eq!(
        follow("N10 X1\nN10 R1=R1+1\nIF R1<2 GOTOB N10\nM30\n"),
        ["N10 X1", "N10 R1=R1+1", "N10 R1=R1+1", "M30"]
    );
    // Two branches in one line, and a condition that does not hold.
    let text = "R1=2\nIF R1==1 GOTOF ONE IF R1==2 GOTOF TWO\nX0\nONE: X1\nTWO: X2\n";
    assert_eq!(follow(text), ["R1=2", "TWO: X2"]);
    assert_eq!(
        follow("IF R1<>0 GOTOF ONE\nX0\nONE: X1\n"),
        ["X0", "ONE: X1"]
    );
}

#[test]
fn labels_and_jumps_in_comments_and_strings_do_not_count() {
    let text =
        "GOTOF AB ; GOTOF CD\n(AB: X1)\n; AB:\nMSG(\"AB: GOTOF CD\")\nAB: X2 (IF)\nMSG(\"IF\")\n";
    assert_eq!(follow(text), ["AB: X2 (IF)", "MSG(\"IF\")"]);
}

#[test]
fn a_jump_that_leads_nowhere_is_shown_at_its_target() {
    let shown = refusal("X1\nN20 IF R1==0 GOTOF NOWHERE\n");
    for part in [
        "no label NOWHERE to jump to",
        "p.mpf:2:20",
        "IF R1==0 GOTOF NOWHERE",
    ] {
        assert!(shown.contains(part), "{part:?} not in\n{shown}");
    }
    assert!(refusal("AB: X1\nGOTOF AB\n").contains("it stands in line 1; expected GOTOB"));
    assert!(refusal("GOTOB AB\nAB: X1\n").contains("it stands in line 2; expected GOTOF"));
    assert!(refusal("GOTOF N7\n").contains("no block N7 to jump to"));
    assert!(refusal("GOTOF\n").contains("jump without a target"));
    assert!(refusal("GOTOF N99999999999\n").contains("jump without a target"));
    assert!(refusal("IF R1==0 X5\n").contains("expected GOTOF or GOTOB here"));
    // Where the condition does not hold, the target must be there all the same.
    assert!(refusal("IF R1==1 GOTOF NOWHERE\n").contains("no label NOWHERE"));
    let shown = refusal("GOTOF AB\nAB: X1\nN5 AB: X2\n");
    assert!(
        shown.contains("label AB stands in the file twice") && shown.contains("p.mpf:3:4"),
        "{shown}"
    );
}

#[test]
fn a_jump_stays_in_its_file() {
    let folder = Folder::new(
        "across",
        &[
            ("MAIN.MPF", "SUB\nGOTOF INSIDE\n"),
            ("SUB.SPF", "INSIDE: X1\nM17\n"),
        ],
    );
    let shown = folder.load().unwrap_err().render();
    assert!(
        shown.contains("a jump stays in its file") && shown.contains("SUB.SPF"),
        "{shown}"
    );
}

#[test]
fn a_loop_without_end_names_its_jump() {
    let shown = refusal("AGAIN: X2\nGOTOB AGAIN\n");
    assert!(
        shown.contains("endless loop: the jump to AGAIN") && shown.contains("p.mpf:2:7"),
        "{shown}"
    );
    // A parameter that changes without the condition ever failing is caught by the number of lines.
    let bounded = Reading {
        lines_max: 1000,
        ..Reading::default()
    };
    let text = "AGAIN: X2\nR1=R1+1\nIF R1>0 GOTOB AGAIN\n";
    let shown = Program::from_text_as("p.mpf", text, &bounded)
        .unwrap_err()
        .render();
    assert!(
        shown.contains("this jump to AGAIN has no end") && shown.contains("p.mpf:3:15"),
        "{shown}"
    );
    let shown = Program::from_text_as("p.mpf", &"X1\n".repeat(1001), &bounded)
        .unwrap_err()
        .render();
    assert!(
        shown.contains("program too long") && shown.contains("p.mpf:1001:1"),
        "{shown}"
    );
}

#[test]
fn an_expression_that_fails_is_shown_where_it_fails() {
    let shown = refusal("R1=4\nR2=3/(R1-4)\n");
    assert!(shown.contains("p.mpf:2:5"), "{shown}");
    assert!(refusal("IF R1 GOTOF AB\nAB:\n").contains("p.mpf:1:7"));
    // The right side of an address is for the core to judge.
    assert_eq!(follow("X=R1/0\n"), ["X=R1/0"]);
}

#[test]
fn a_call_can_be_repeated() {
    let files = [
        ("MAIN.MPF", "N10 L150 P2\nSUB P=3\nBACK: sub ; once\nM30\n"),
        (
            "L150.SPF",
            "PROC L150\nR1=R1+1\nIF R1==2 GOTOF OUT\nX1\nOUT: RET\nX9\n",
        ),
        ("SUB.SPF", "EXTERN L150\nY1\nM17\n"),
    ];
    let program = Folder::new("repeat", &files).load().unwrap();
    let expected = [
        "R1=R1+1", "X1", "R1=R1+1", "Y1", "M17", "Y1", "M17", "Y1", "M17", "Y1", "M17", "M30",
    ];
    assert_eq!(sent(&program), expected);
    assert!(program.called_from(2)[0].ends_with("MAIN.MPF:1"));
    for bad in ["SUB P0", "SUB P10000"] {
        let shown = Folder::new("repeat2", &[("MAIN.MPF", bad), ("SUB.SPF", "X1\n")])
            .load()
            .unwrap_err();
        assert!(shown.render().contains("expected P1 to P9999"), "{bad}");
    }
    let shown = refusal("L150\n");
    assert!(shown.contains("no sub-program L150"), "{shown}");
}

#[test]
fn a_repeated_sub_program_with_a_jump_is_no_endless_loop() {
    let files = [
        ("MAIN.MPF", "SUB P3\nM30\n"),
        ("SUB.SPF", "GOTOF CD\nAB: RET\nCD: X1\nGOTOB AB\n"),
    ];
    let program = Folder::new("repeat3", &files).load().unwrap();
    assert_eq!(sent(&program), ["CD: X1", "CD: X1", "CD: X1", "M30"]);
}

#[test]
fn blocks_behind_a_slash_are_left_out_on_demand() {
    let text = "X1\n/X2\n /3 N30 X3\n/GOTOF END1\nX4\nEND1: X5\n";
    let skipped = Program::from_text_as("p", text, &reading(Dialect::Sinumerik, true)).unwrap();
    assert_eq!(sent(&skipped), ["X1", "X4", "END1: X5"]);
    assert_eq!(skipped.locate(2, 1).unwrap().line, 5);
    assert_eq!(follow(text), ["X1", "/X2", " /3 N30 X3", "END1: X5"]);
}

#[test]
fn text_is_unused_only_where_the_flow_never_comes() {
    let text = "GOTOF AA\nX1\nBB: M30\nAA: X2\nGOTOB BB\n\nX3\n";
    let program = Program::from_text("p", text).unwrap();
    assert_eq!(
        (sent(&program), program.unused_from()),
        (vec!["AA: X2".to_owned(), "BB: M30".to_owned()], Some(7))
    );
}

#[test]
fn words_the_host_does_not_follow_are_refused_by_name() {
    for (text, part) in [
        ("WHILE R1<5\n", "WHILE: structured programs"),
        ("X1\nENDIF\n", "ENDIF: structured programs"),
        ("DEF REAL LENGTH=5\n", "use R parameters"),
        ("PROC PART(REAL X)\n", "a sub-program with parameters"),
        ("EXTERN PART(INT)\n", "a sub-program with parameters"),
    ] {
        let shown = refusal(text);
        assert!(shown.contains(part), "{shown}");
    }
}

#[test]
fn heidenhain_words_are_no_calls() {
    let text =
        "0 BEGIN PGM PART MM\n1 TOOL CALL 1 Z S5000\n2 L X+10 Y+5 R0 FMAX M3\n3 CC X+0 Y+0\nSTOP\n\
                4 SPL X1 K3X1 K2X2 K1X3\nCONTOUR\n9 END PGM PART MM\nL X+900\n";
    let program = Program::from_text_as("p.h", text, &reading(Dialect::Heidenhain, false)).unwrap();
    assert_eq!(
        sent(&program).join("\n"),
        text.lines().take(8).collect::<Vec<_>>().join("\n")
    );
    assert_eq!(program.unused_from(), Some(9));
}

#[test]
fn call_pgm_puts_a_heidenhain_program_in_its_place() {
    let folder = Folder::new(
        "pgm",
        &[
            (
                "MAIN.MPF",
                "BEGIN PGM MAIN MM\n5 CALL PGM PART.H\nEND PGM MAIN MM\n",
            ),
            (
                "PART.H",
                "0 BEGIN PGM PART MM\n1 L X+1 M2\n2 L X+2\n3 END PGM PART MM\n",
            ),
        ],
    );
    let path = folder.0.join("MAIN.MPF");
    let program = Program::load_as(&path, &reading(Dialect::Heidenhain, false)).unwrap();
    assert_eq!(
        sent(&program),
        ["BEGIN PGM MAIN MM", "1 L X+1 ", "END PGM MAIN MM"]
    );
    let lost = Program::from_text_as(
        "p.h",
        "CALL PGM LOST\n",
        &reading(Dialect::Heidenhain, false),
    );
    assert!(lost.unwrap_err().render().contains("no sub-program LOST"));
}

#[test]
fn a_polynomial_too_long_for_a_line_goes_out_in_the_spelling_of_the_wire() {
    let short = "POLY PO[X]=(1,2.5,3) PO[]=(1,0.1) PL=2";
    assert_eq!(follow(short), [short]);
    let long = "N10 POLY PO[X]=(10.123456, 2.345678,-3.456789) Y5 po[Z]=(1.234567,0.000001) PO[A]=(7) PO[]=(1.5,0.25) PL=2 F1000 ; end";
    let program = Program::from_text("p", &format!("X1\n{long}\nX2\n")).unwrap();
    assert_eq!(
        sent(&program),
        [
            "X1",
            "POX Q2.345678 Q-3.456789",
            "POZ Q0.000001",
            "POA Q0",
            "POD Q1.5 Q0.25",
            "N10 POLY X10.123456 Y5 Z1.234567 A7  PL=2 F1000",
            "X2"
        ]
    );
    // The caret stands at the term the streamed line is made of.
    assert_eq!(
        (
            program.locate(3, 7).unwrap().line,
            program.locate(3, 7).unwrap().column
        ),
        (2, 51)
    );
    assert_eq!(program.locate(7, 1).unwrap().line, 3);
    // What is not a plain number stays where it is.
    let long = long.replace("(7)", "(R7)");
    assert_eq!(follow(&long), [long]);
}
