//! What is refused, where, and that a refused line leaves no trace.

use super::{run, xyzac};
use crate::catalogue::{entries, nc as message};
use crate::nc::Interpreter;
use proptest::prelude::*;

/// Program (its last line is the bad one) and `line:column code text`.
const MALFORMED: &[(&str, &str)] = &[
    ("G1 X1 F100\nQ5", "2:1 105 unknown word 'Q'"),
    ("G1 X1 F100 H3", "1:12 105 unknown word 'H'"),
    (
        "N10 POLAR_STEPTHETA_1_LIN_1",
        "1:5 105 unknown word 'POLAR_STEPTHETA_1_LIN_1'",
    ),
    ("G1 LABEL_1:", "1:4 105 unknown word 'LABEL_1'"),
    ("ASPLINEXY5", "1:8 105 unknown word 'XY5'"),
    ("PLATE_1", "1:1 105 unknown word 'PLATE_1'"),
    (
        "THIS_NAME_IS_LONGER_THAN_THIRTY_TWO_BYTES",
        "1:1 105 unknown word 'THIS_NAME_IS_LONGER_THAN_THIRTY_..'",
    ),
    ("G641 ADIS=-0.1", "1:6 109 value of 'ADIS=-0.1' is out of range"),
    ("ADISPOS=-1 X5", "1:1 109 value of 'ADISPOS=-1' is out of range"),
    ("ADIS=1000.1", "1:1 109 value of 'ADIS=1000.1' is out of range"),
    ("G4 F1 ADIS=-1", "1:7 109 value of 'ADIS=-1' is out of range"),
    ("G641 ADIS", "1:6 106 number expected after 'ADIS'"),
    ("G641 ADISPOS=", "1:6 106 number expected after 'ADISPOS'"),
    ("ADIS=1 ADIS=2", "1:8 112 'ADIS=2' excludes an earlier word of this line"),
    ("G64 G641", "1:5 112 'G641' excludes an earlier word of this line"),
    ("G643", "1:1 114 G function 'G643' is not available"),
    ("G1 X", "1:4 106 number expected after 'X'"),
    ("G1 X= Y5", "1:4 106 number expected after 'X'"),
    ("CSPLINE PW=", "1:9 106 number expected after 'PW'"),
    ("R=5", "1:1 118 word 'R' has no meaning here"),
    ("R100=5", "1:1 109 value of 'R100' is out of range"),
    ("R1=", "1:1 106 number expected after 'R1'"),
    ("X1=5", "1:3 102 unexpected character '='"),
    ("N=5", "1:2 102 unexpected character '='"),
    ("G1 X- Y5", "1:5 107 malformed number '-'"),
    ("G1 X--5", "1:5 107 malformed number '--5'"),
    ("G1 X. F5", "1:5 107 malformed number '.'"),
    ("G1 X1.2.3", "1:8 102 unexpected character '.'"),
    ("G1 X1,5", "1:6 102 unexpected character ','"),
    ("N1/N10 X5", "1:3 102 unexpected character '/'"),
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
        "N10 G34 G90 G01",
        "1:5 114 G function 'G34' is not available",
    ),
    ("G06.2 P4", "1:1 114 G function 'G06.2' is not available"),
    ("G-1 X5", "1:1 114 G function 'G-1' is not available"),
    ("G1E1 X5", "1:1 114 G function 'G1E1' is not available"),
    (
        "N25 X1.8 Y10.2 M50",
        "1:16 115 M function 'M50' is not available",
    ),
    ("G0 X0 Y0 Z0 B0 C0", "1:13 117 axis 'B' is not configured"),
    ("G0 U1", "1:4 117 axis 'U' is not configured"),
    ("G1 X1 F10 P3", "1:11 118 word 'P' has no meaning here"),
    ("G1 X1 I3 F10", "1:7 118 word 'I' has no meaning here"),
    ("K1", "1:1 118 word 'K' has no meaning here"),
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
    ("N90 G4", "1:5 121 no time: G4 needs F or P in seconds, or S in revolutions"),
    ("G4 F2 X1", "1:7 122 coordinates in a line with G4"),
    ("G4 F-2", "1:4 109 value of 'F' is out of range"),
    ("G4 F2 P2", "1:7 118 word 'P' has no meaning here"),
    ("G4 S30", "1:4 139 no spindle speed: S missing"),
    (
        "F9 BSPLINE X1 PW=3.0001",
        "1:15 109 value of 'PW=3.0001' is out of range",
    ),
    (
        "F9 BSPLINE X1 PW=-1",
        "1:15 109 value of 'PW=-1' is out of range",
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
    (
        "F9 G2 X1",
        "1:7 130 G2 and G3 need I, J or K of the plane, or CR",
    ),
    (
        "F9 G2 X1 J1 CR=5",
        "1:10 131 'J' and CR exclude each other",
    ),
    (
        "F9 G2 X1 I1 K5",
        "1:13 132 'K' is not an axis of the working plane",
    ),
    (
        "F9 G18 G2 X1 K1 J5",
        "1:17 132 'J' is not an axis of the working plane",
    ),
    (
        "F9 G3 X0 CR=5",
        "1:10 133 a full circle needs I, J or K instead of CR",
    ),
    ("F9 G3 CR=5", "1:7 133 a full circle needs I, J or K instead of CR"),
    ("F9 G3 X1 CR=0", "1:10 109 value of 'CR' is out of range"),
    (
        "F9 G3 X1 I1 TURN=1000",
        "1:13 109 value of 'TURN=1000' is out of range",
    ),
    ("G1 X1 F9 TURN1", "1:10 118 word 'TURN' has no meaning here"),
    (
        "N100 G42",
        "1:6 134 G41 and G42 need a tool: T and M6 missing",
    ),
    (
        "T0 M6\nG1 X5 G41",
        "2:7 134 G41 and G42 need a tool: T and M6 missing",
    ),
    (
        "G10 L1 P5 R2\nT=\"FR_4\"\nM6",
        "3:1 135 tool 'FR_4' is not in the tool table",
    ),
    (
        "G10 L1 P5 R2\nT12 M6",
        "2:5 135 tool '12' is not in the tool table",
    ),
    (
        "T5 M6\nF9 G42\nCSPLINE X1",
        "3:9 136 compensation begins, ends or changes sides on a straight line only",
    ),
    (
        "T5 M6\nF9 G42 G1 X1\nG40 ASPLINE X1",
        "3:13 136 compensation begins, ends or changes sides on a straight line only",
    ),
    (
        "T5 M6\nF9 G42 G1 X1\nG41 G2 X1 I1",
        "3:8 136 compensation begins, ends or changes sides on a straight line only",
    ),
    (
        "T5 M6\nF9 G42 G1 X1\nG64 G18",
        "3:5 137 'G18' is not possible under G41 and G42",
    ),
    (
        "T5 M6\nF9 G42 G1 X1\nG40\nT6 M6",
        "4:4 137 'M6' is not possible under G41 and G42",
    ),
    (
        "T5 M6\nF9 G42 G1 X1\nD0",
        "3:1 137 'D' is not possible under G41 and G42",
    ),
    (
        "T5 M6\nF9 G42 G1 X1\nG74 X0",
        "3:1 137 'G74' is not possible under G41 and G42",
    ),
    (
        "T5 M6\nF9 G42 G1 X1\nG10 L1 P5 R3",
        "3:1 137 'G10' is not possible under G41 and G42",
    ),
    (
        "G93 F9 X1\nX2",
        "2:1 138 G93 needs F in every block that moves",
    ),
    ("F9\nG93 X2", "2:5 138 G93 needs F in every block that moves"),
    ("F9\nG95 X2", "2:5 119 no feed: F missing"),
    ("G95 F9 X2", "1:8 139 no spindle speed: S missing"),
    (
        "G33 Z5 K2",
        "1:1 140 'G33' needs a spindle that reports its angle",
    ),
    (
        "S9 G961",
        "1:4 140 'G961' needs a spindle that reports its angle",
    ),
    ("N5 GOTOB START", "1:4 141 'GOTOB' is followed by the host only"),
    (
        "IF R1==2 GOTOF A",
        "1:1 141 'IF' is followed by the host only",
    ),
    ("L150", "1:1 141 'L' is followed by the host only"),
    ("GOTOF A\nX1\nM30", "3:1 142 label 'A' not found"),
    (
        "POLY F9\nPOX Q1\nG1 X5",
        "3:1 143 coordinates of the POLY block expected",
    ),
    (
        "POLY F9\nPOX Q1\nM30",
        "3:1 143 coordinates of the POLY block expected",
    ),
    (
        "POLY F9\nPOX Q1\nG4 F1",
        "3:1 143 coordinates of the POLY block expected",
    ),
    (
        "POLY F9\nPOX Q1\nPO[X]=(5,1)",
        "3:1 111 word 'PO[X]' is repeated",
    ),
    ("F9 G1 PO[X]=(5,1)", "1:7 118 word 'PO' has no meaning here"),
    ("F9 POLY PO[B]=(5,1)", "1:9 117 axis 'PO[B]' is not configured"),
    ("F9 POLY POX", "1:9 106 number expected after 'POX'"),
    (
        "F9 POLY POX Q1 Q2 Q3 Q4 Q5",
        "1:9 118 word 'POX' has no meaning here",
    ),
    (
        "F9 POLY PO[X]=(1,2,3,4,5,6)",
        "1:26 118 word '6' has no meaning here",
    ),
    ("F9 POLY PO[]=(0)", "1:9 109 value of 'PO[]' is out of range"),
    ("F9 POLY PO[X]=(1,2", "1:19 340 parenthesis, bracket or comma missing"),
    (
        "F9 BSPLINE X1 XH=1 YH=2",
        "1:15 145 XH YH ZH come together, at all points of the spline or at none",
    ),
    (
        "F9 BSPLINE X1 XH=1 YH=2 ZH=3\nX2",
        "2:1 145 XH YH ZH come together, at all points of the spline or at none",
    ),
    (
        "F9 BSPLINE X1\nX2 XH=1 YH=2 ZH=3",
        "2:4 145 XH YH ZH come together, at all points of the spline or at none",
    ),
    (
        "F9 CSPLINE X1 XH=1 YH=2 ZH=3",
        "1:15 118 word 'XH' has no meaning here",
    ),
    (
        "F9 BSPLINE X1 A5 XH=1 YH=2 ZH=3",
        "1:15 118 word 'A' has no meaning here",
    ),
    (
        "F9 BSPLINE X1 XH=1 XH=2 ZH=3",
        "1:20 111 word 'XH' is repeated",
    ),
    (
        "G10L1P1R1\nG10L1P2R1\nG10L1P3R1\nG10L1P4R1\nG10L1P5R1\nG10L1P6R1\nG10L1P7R1\nG10L1P8R1\n         G10L1P9R1\nG10L1P10R1\nG10L1P11R1\nG10L1P12R1\nG10L1P13R1\nG10L1P14R1\nG10L1P15R1\nG10L1P16R1\n         G10L1P16R2\nG10L1P17R1",
        "18:6 146 the tool table is full",
    ),
    ("G10 L1 P5", "1:1 147 'G10' lacks words it needs"),
    ("G10 P5 R1", "1:1 147 'G10' lacks words it needs"),
    ("G10 L2 P5 R1", "1:5 109 value of 'L' is out of range"),
    ("G10 L1 P0 R1", "1:8 109 value of 'P' is out of range"),
    ("G10 L1 P1 R-1", "1:11 109 value of 'R' is out of range"),
    ("G10 L1 P1 R1 X1", "1:14 118 word 'X' has no meaning here"),
    ("G74", "1:1 147 'G74' lacks words it needs"),
    ("G75 X5", "1:5 109 value of 'X' is out of range"),
    ("GOTOF", "1:1 147 'GOTOF' lacks words it needs"),
    ("G0 X=DC(5)", "1:4 118 word 'X=DC(5)' has no meaning here"),
    ("D2", "1:1 109 value of 'D2' is out of range"),
    ("SPLINEPATH XB", "1:13 117 axis 'B' is not configured"),
    (
        "SPLINEPATH(1,X,Y",
        "1:17 340 parenthesis, bracket or comma missing",
    ),
    ("SPLINEPATH(1,X,", "1:16 340 parenthesis, bracket or comma missing"),
    ("SPLINEPATH(1,X Y)", "1:16 102 unexpected character 'Y'"),
    ("SPLINEPATH(1,X5)", "1:15 102 unexpected character '5'"),
    ("SPLINEPATH(1,5)", "1:14 102 unexpected character '5'"),
    ("SPLINEPATH(7,X)", "1:12 102 unexpected character '7'"),
    ("SPLINEPATH(1,B)", "1:14 117 axis 'B' is not configured"),
    ("X=R[1.5]", "1:3 341 'R[1.5]' is not one of R0 to R99"),
    ("MSG(\"open", "1:5 104 string is not closed"),
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
        // 144 depends on the machine
        code == long.0
            || code == 144
            || MALFORMED
                .iter()
                .any(|(_, expected)| expected.contains(&spelled))
    };
    for entry in entries().filter(|entry| (101..150).contains(&entry.message.code)) {
        let (code, text) = (entry.message.code, entry.message.text);
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
    assert_eq!(interpreter.tools(), twin.tools());
    for probe in [
        "K7 K8 K9",
        "X1.25 C2.5",
        "X2 F60 M3",
        "M4 G1 Y3",
        "BSPLINE X4",
        "X5 PW3",
        "X=R1+R5",
        "G42 G1 X7",
        "M6 M41",
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
        "R5=3 R1=4 POLY PO[X]=(5,1) G18 G41 G55 D0 G93 SPLINEPATH X5 Q",
        "G10 L1 P5 R2 Z5 T5 M6 GOTOF A Q",
    ] {
        assert_acts_like_an_empty_line(&["G1 F5 S3 X1"], bad.as_bytes());
        assert_acts_like_an_empty_line(&["F5 BSPLINE X1"], bad.as_bytes());
        assert_acts_like_an_empty_line(&["F5 G6 X1 Y2 I1", "K1 K2 K3"], bad.as_bytes());
    }
}

#[test]
fn codes_are_unique_and_ascending_and_each_has_a_reason_and_a_mend() {
    let rows: Vec<_> = entries()
        .filter(|entry| (101..150).contains(&entry.message.code))
        .collect();
    assert!(rows
        .windows(2)
        .all(|pair| pair[0].message.code < pair[1].message.code));
    assert!(rows
        .iter()
        .all(|entry| !entry.reason.is_empty() && !entry.mend.is_empty()));
    assert_eq!(message::LINE_TOO_LONG.code, 101);
    assert_eq!(message::TOOL_NAME.code, 129);
}

/// Pieces from which random lines are glued: near enough to the language to get far into it.
fn piece() -> impl Strategy<Value = Vec<u8>> {
    prop_oneof![
        "[A-Za-z]",
        "[GMNXYZACFSTIJKPRDLQ][+-]?[0-9]{0,3}[.]?[0-9]{0,3}",
        "(PW|SD|PL|CR|TURN|XH|POX|PO\\[Y\\]|POLY|SPLINEPATH|MSG|GOTOF|AC|R1|G2|G41|G40|G10|G74|ASPLINE|BSPLINE|CSPLINE|BTAN|ENAT|SOFT|G1|G6|M30|G4|G91|G70)=?",
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
