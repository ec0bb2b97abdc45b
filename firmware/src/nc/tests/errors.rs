//! What is refused, where, and that a refused line leaves no trace.

use super::{run, xyzac};
use crate::nc::{Interpreter, NcErrorKind, ERRORS};
use proptest::prelude::*;

/// Program (its last line is the bad one) and `line:column code text`.
const MALFORMED: &[(&str, &str)] = &[
    ("G1 X1 F100\nQ5", "2:1 105 unknown word 'Q'"),
    ("G1 X1 F100 H3", "1:12 105 unknown word 'H'"),
    (
        "N10 POLAR_STEPTHETA_1_LIN_1",
        "1:5 105 unknown word 'POLAR_STEPTHETA_1_LIN_1'",
    ),
    ("N185 LABEL_1:", "1:6 105 unknown word 'LABEL_1'"),
    ("ASPLINEXY5", "1:8 105 unknown word 'XY5'"),
    ("PLATE_1", "1:1 105 unknown word 'PLATE_1'"),
    (
        "THIS_NAME_IS_LONGER_THAN_THIRTY_TWO_BYTES",
        "1:1 105 unknown word 'THIS_NAME_IS_LONGER_THAN_THIRTY_..'",
    ),
    ("G1 X", "1:4 106 number expected after 'X'"),
    ("G1 X= Y5", "1:4 106 number expected after 'X'"),
    ("CSPLINE PW=", "1:9 106 number expected after 'PW'"),
    ("R1=5", "1:1 105 unknown word 'R'"),
    ("X1=5", "1:3 102 unexpected character '='"),
    ("N=5", "1:2 102 unexpected character '='"),
    ("G1 X- Y5", "1:5 107 malformed number '-'"),
    ("G1 X--5", "1:5 107 malformed number '--5'"),
    ("G1 X. F5", "1:5 107 malformed number '.'"),
    ("G1 X1.2.3", "1:8 102 unexpected character '.'"),
    ("G1 X1,5", "1:6 102 unexpected character ','"),
    ("/N10 X5", "1:1 102 unexpected character '/'"),
    ("N10 %MPF 1", "1:5 102 unexpected character '%'"),
    ("%MPF-150", "1:5 102 unexpected character '-'"),
    ("X1 (open", "1:4 103 comment is not closed"),
    ("T=\"FR_4", "1:3 104 string is not closed"),
    ("T=\"\"", "1:3 129 tool name must have 1 to 32 characters"),
    (
        "T=\"123456789012345678901234567890123\"",
        "1:3 129 tool name must have 1 to 32 characters",
    ),
    ("T5.5", "1:1 110 'T5.5' must be a whole number"),
    ("N1.5 X1", "1:1 110 'N1.5' must be a whole number"),
    (
        "N999999999",
        "1:1 109 value of 'N999999999' is out of range",
    ),
    (
        "G0 X12345678901234567890",
        "1:5 108 number '12345678901234567890' has more than 19 digits",
    ),
    ("G0 X100000.000001", "1:4 109 value of 'X' is out of range"),
    ("G0 X1E12", "1:4 109 value of 'X' is out of range"),
    (
        "G0 X60000\nG91 X60000",
        "2:5 109 value of 'X' is out of range",
    ),
    ("G0 X1 Y2 X3", "1:10 111 word 'X' is repeated"),
    ("N1 N2 X1", "1:4 111 word 'N' is repeated"),
    (
        "G0 G1 X1 F5",
        "1:4 112 'G1' excludes an earlier word of this line",
    ),
    (
        "G6 CSPLINE",
        "1:4 112 'CSPLINE' excludes an earlier word of this line",
    ),
    (
        "BTAN BNAT",
        "1:6 112 'BNAT' excludes an earlier word of this line",
    ),
    (
        "M3 M4",
        "1:4 112 'M4' excludes an earlier word of this line",
    ),
    (
        "SD=2 SD=3",
        "1:6 112 'SD=3' excludes an earlier word of this line",
    ),
    (
        "X1 N10",
        "1:4 113 block number is not at the start of the line",
    ),
    (
        "G64 N10",
        "1:5 113 block number is not at the start of the line",
    ),
    (
        "N10 G10 G90 G01",
        "1:5 114 G function 'G10' is not available",
    ),
    ("G2 X1 I5", "1:1 114 G function 'G2' is not available"),
    ("G06.2 P4", "1:1 114 G function 'G06.2' is not available"),
    ("G-1 X5", "1:1 114 G function 'G-1' is not available"),
    ("G1E1 X5", "1:1 114 G function 'G1E1' is not available"),
    (
        "N25 X1.8 Y10.2 M50",
        "1:16 115 M function 'M50' is not available",
    ),
    ("M7", "1:1 115 M function 'M7' is not available"),
    ("N100 G42", "1:6 116 tool radius compensation not available"),
    (
        "G1 X5 G41",
        "1:7 116 tool radius compensation not available",
    ),
    ("G0 X0 Y0 Z0 B0 C0", "1:13 117 axis 'B' is not configured"),
    ("G0 U1", "1:4 117 axis 'U' is not configured"),
    ("G1 X1 F10 P3", "1:11 118 word 'P' has no meaning here"),
    ("G1 X1 I3 F10", "1:7 118 word 'I' has no meaning here"),
    ("K1 K2 K3", "1:1 118 word 'K' has no meaning here"),
    ("G1 X1 F10 PW=3", "1:11 118 word 'PW' has no meaning here"),
    ("BSPLINE PL=2", "1:9 118 word 'PL' has no meaning here"),
    ("G1 SD=2", "1:4 118 word 'SD' has no meaning here"),
    ("G0 X5\nN20 G1 Z2 Y5", "2:8 119 no feed: F missing"),
    ("CSPLINE X5", "1:9 119 no feed: F missing"),
    ("G1 X5 F0", "1:7 120 feed must be greater than 0"),
    ("F-3", "1:1 120 feed must be greater than 0"),
    ("F1E7", "1:1 109 value of 'F' is out of range"),
    ("F1E99", "1:1 109 value of 'F' is out of range"),
    ("S-1", "1:1 109 value of 'S' is out of range"),
    ("N90 G4", "1:5 121 no time: G4 needs F or P in seconds"),
    ("G4 F2 X1", "1:7 122 coordinates in a line with G4"),
    ("G4 F-2", "1:4 109 value of 'F' is out of range"),
    ("G4 F2 P2", "1:7 118 word 'P' has no meaning here"),
    ("G4 S30", "1:4 118 word 'S' has no meaning here"),
    (
        "F9 BSPLINE X1 PW=3\nX2 PW=3\nX3 Y1 PW=2.9",
        "3:7 123 weights of a B-spline must be equal",
    ),
    (
        "F9 BSPLINE X1 PW=3\nN5 X2",
        "2:4 123 weights of a B-spline must be equal",
    ),
    (
        "F9 BSPLINE X1 PW=3.0001",
        "1:15 109 value of 'PW=3.0001' is out of range",
    ),
    (
        "F9 BSPLINE X1 PW=0",
        "1:15 109 value of 'PW=0' is out of range",
    ),
    (
        "F9 BSPLINE SD=4 X1",
        "1:12 109 value of 'SD=4' is out of range",
    ),
    (
        "F9 BSPLINE PL0 X1",
        "1:12 109 value of 'PL0' is out of range",
    ),
    (
        "F9 BSPLINE X1\nX2 SD2",
        "2:4 124 degree cannot change within a B-spline",
    ),
    ("F9 G6 X1 Y1", "1:7 125 G6 block without I"),
    ("F9 G6 X1 I0", "1:10 109 value of 'I' is out of range"),
    ("F9 G91 G6 X1 I1", "1:11 126 G6 needs G90 and G71"),
    ("F9 G70 G6 X1 I1", "1:11 126 G6 needs G90 and G71"),
    (
        "F9 G6 X1 Y1 I1\nK1 K2 K3\nN30 G1 X5",
        "3:5 127 K line of a G6 block expected",
    ),
    ("F9 G6 X1 I1\nBTAN", "2:1 127 K line of a G6 block expected"),
    ("F9 G6 X1 I1\n%", "2:1 127 K line of a G6 block expected"),
    ("F9 G6 X1 I1\n", "2:1 127 K line of a G6 block expected"),
    (
        "F9 G6 X1 I1\n K1 K2",
        "2:2 128 K words come in threes: K3 K2 K1 of one axis",
    ),
    (
        "F9 G6 X1 I1\nK1 K2 K3 K4",
        "2:1 118 word 'K' has no meaning here",
    ),
    (
        "F9 G6 X1 I1\nK1 K2 K3\nK1 K2 K3",
        "3:1 118 word 'K' has no meaning here",
    ),
    (
        "F9 G6 X1 I1\nK1.5 K2 K3",
        "2:1 110 'K1.5' must be a whole number",
    ),
    (
        "F9 G6 X1 I1\nK1 K2 K9223372036854775808",
        "2:7 109 value of 'K9223372036854775808' is out of range",
    ),
];

#[test]
fn a_malformed_line_is_refused_at_its_place_with_its_text() {
    for (program, expected) in MALFORMED {
        let (_, end) = run(&xyzac(), program);
        let error = end.expect_err(program);
        assert_eq!(error.to_string(), *expected, "in {program:?}");
    }
}

#[test]
fn every_kind_of_error_appears_among_the_malformed_lines() {
    let long = (101, "1:97 101 line is longer than 96 bytes");
    let seen = |code: u16| {
        let spelled = format!(" {code} ");
        code == long.0
            || MALFORMED
                .iter()
                .any(|(_, expected)| expected.contains(&spelled))
    };
    for (code, text) in ERRORS {
        assert!(seen(code), "{code} {text}");
    }
}

#[test]
fn a_line_of_97_bytes_is_refused_and_one_of_96_is_not() {
    let config = xyzac();
    let mut interpreter = Interpreter::new(&config);
    let error = interpreter
        .line(&config, &[b' '; 97], &mut |_| ())
        .unwrap_err();
    assert_eq!(error.to_string(), "1:97 101 line is longer than 96 bytes");
    assert_eq!(interpreter.line(&config, &[b' '; 96], &mut |_| ()), Ok(()));
    let mut with_return = [b' '; 97];
    with_return[96] = b'\r';
    assert_eq!(interpreter.line(&config, &with_return, &mut |_| ()), Ok(()));
}

#[test]
fn bytes_outside_ascii_are_refused_but_for_comments() {
    let config = xyzac();
    let refused = |text: &[u8]| Interpreter::new(&config).line(&config, text, &mut |_| ());
    assert_eq!(
        refused(b"X1 \x9c").unwrap_err().to_string(),
        "1:4 102 unexpected character '\\x9c'"
    );
    assert_eq!(
        refused(b"T=\"\xff\"").unwrap_err().to_string(),
        "1:4 102 unexpected character '\\xff'"
    );
    assert_eq!(
        refused(b"X\xc3\xa9").unwrap_err().to_string(),
        "1:1 106 number expected after 'X'"
    );
    assert_eq!(refused(b"G71 ; \xc3\xa9\x00"), Ok(()));
    assert_eq!(refused(b"(\xc3\xa9) G71 ( \xff ) G90"), Ok(()));
}

/// Feeds `good`, then `bad` to one interpreter and an empty line to its twin, then `probe` to both.
fn assert_acts_like_an_empty_line(good: &[&str], bad: &[u8]) {
    let config = xyzac();
    let mut interpreter = Interpreter::new(&config);
    for line in good {
        interpreter
            .line(&config, line.as_bytes(), &mut |_| ())
            .unwrap();
    }
    let mut twin = interpreter.clone();
    let mut emitted = Vec::new();
    if interpreter
        .line(&config, bad, &mut |command| emitted.push(command))
        .is_ok()
    {
        return;
    }
    assert_eq!(emitted, [], "{bad:?}");
    twin.line(&config, b"", &mut |_| ()).unwrap();
    assert_eq!(interpreter.position(), twin.position());
    assert_eq!(interpreter.line_number(), twin.line_number());
    assert_eq!(interpreter.tool(), twin.tool());
    for probe in [
        "K7 K8 K9",
        "X1.25 C2.5",
        "X2 F60 M3",
        "M4 G1 Y3",
        "BSPLINE X4",
        "X5 PW3",
        "G91 X1",
        "M30",
        "X9 F5",
    ] {
        let mut left = Vec::new();
        let mut right = Vec::new();
        let answer = interpreter.line(&config, probe.as_bytes(), &mut |command| left.push(command));
        let twin_answer = twin.line(&config, probe.as_bytes(), &mut |command| {
            right.push(command)
        });
        assert_eq!((answer, left), (twin_answer, right), "{bad:?} then {probe}");
    }
}

#[test]
fn a_refused_line_acts_like_an_empty_one() {
    for (program, _) in MALFORMED {
        let lines: Vec<_> = program.lines().collect();
        let (bad, good) = lines.split_last().unwrap();
        assert_acts_like_an_empty_line(good, bad.as_bytes());
    }
    for bad in [
        "G0 G90 G70 G60 BRISK F77 S99 T9 X5 Y5 Q",
        "G91 BSPLINE SD2 X5 PW3 F3 M3 M8 M30 J1",
        "M30 T=\"A\" G6 X5 I1 K1 K2",
        "K1 K2 K3 K4 K5 K6 Q",
    ] {
        assert_acts_like_an_empty_line(&["G1 F5 S3 X1"], bad.as_bytes());
        assert_acts_like_an_empty_line(&["F5 BSPLINE X1"], bad.as_bytes());
        assert_acts_like_an_empty_line(&["F5 G6 X1 Y2 I1", "K1 K2 K3"], bad.as_bytes());
    }
}

#[test]
fn codes_are_unique_and_ascending() {
    assert!(ERRORS.windows(2).all(|pair| pair[0].0 < pair[1].0));
    assert_eq!(NcErrorKind::LineTooLong.code(), 101);
    assert_eq!(NcErrorKind::ToolName.code(), 129);
}

/// Pieces from which random lines are glued: near enough to the language to get far into it.
fn piece() -> impl Strategy<Value = Vec<u8>> {
    prop_oneof![
        "[A-Za-z]",
        "[GMNXYZACFSTIKP][+-]?[0-9]{0,3}[.]?[0-9]{0,3}",
        "(PW|SD|PL|ASPLINE|BSPLINE|CSPLINE|BTAN|ENAT|SOFT|G1|G6|M30|G4|G91|G70)=?",
        "[0-9]{1,25}",
        "[-+.=E;()%\"/ ]",
        "K-?[0-9]{1,20}",
    ]
    .prop_map(String::into_bytes)
}

fn wild_line() -> impl Strategy<Value = Vec<u8>> {
    prop_oneof![
        prop::collection::vec(any::<u8>(), 0..120),
        prop::collection::vec(piece(), 0..12).prop_map(|pieces| pieces.concat()),
    ]
}

proptest! {
    #[test]
    fn no_bytes_make_the_interpreter_panic(lines in prop::collection::vec(wild_line(), 1..20)) {
        let config = xyzac();
        let mut interpreter = Interpreter::new(&config);
        for (number, line) in (1..).zip(&lines) {
            let before = interpreter.position();
            let mut emitted = 0;
            let mut ended = false;
            let answer = interpreter.line(&config, line, &mut |command| {
                emitted += 1;
                ended |= command == crate::nc::Command::ProgramEnd;
            });
            if let Err(error) = answer {
                prop_assert_eq!(emitted, 0);
                prop_assert_eq!(interpreter.position(), before);
                prop_assert!(usize::from(error.column) >= 1 && usize::from(error.column) <= line.len().max(97));
                prop_assert!(!error.to_string().contains("{}"), "text without argument");
            }
            prop_assert!(interpreter.line_number() <= number);
            if ended {
                return Ok(());
            }
        }
        let _ = interpreter.flush(&config, &mut |_| ());
    }

    #[test]
    fn any_refused_line_acts_like_an_empty_one(line in wild_line(), open in 0usize..3) {
        let good: [&[&str]; 3] = [&["G1 F5 S3 X1"], &["F5 BSPLINE X1"], &["F5 G6 X1 Y2 I1", "K1 K2 K3"]];
        assert_acts_like_an_empty_line(good[open], &line);
    }
}
