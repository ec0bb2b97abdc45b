//! Laws of inlining and of the way back from a streamed line to its file.

use super::*;
use crate::diagnostics::Exit;
use proptest::prelude::*;

/// A folder of its own that goes away with the test.
pub(super) struct Folder(pub(super) PathBuf);

impl Folder {
    pub(super) fn new(name: &str, files: &[(&str, &str)]) -> Self {
        let path = std::env::temp_dir().join(format!("host-sim-{name}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir_all(&path).unwrap();
        for (file, text) in files {
            std::fs::write(path.join(file), text).unwrap();
        }
        Self(path)
    }

    pub(super) fn load(&self) -> Result<Program, Failure> {
        Program::load(&self.0.join("MAIN.MPF"))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

pub(super) fn sent(program: &Program) -> Vec<String> {
    program
        .lines()
        .map(|line| String::from_utf8(line.to_vec()).unwrap())
        .collect()
}

#[test]
fn a_call_is_replaced_by_the_lines_of_its_file() {
    let folder = Folder::new(
        "inline",
        &[
            (
                "MAIN.MPF",
                "%_N_MAIN_MPF\r\nN10 G54\r\nN120 KONTUR_57 ; the contour\r\nN130 M30\r\n",
            ),
            (
                "kontur_57.spf",
                "%_N_KONTUR_57_SPF\r\nN10 X22.000  Y0.000\r\nN20 M17\r\nG0 X999\r\n",
            ),
        ],
    );
    let program = folder.load().unwrap();
    assert_eq!(
        sent(&program),
        [
            "%_N_MAIN_MPF",
            "N10 G54",
            "",
            "N10 X22.000  Y0.000",
            "N20 M17",
            "N130 M30"
        ]
    );
    let place = program.locate(4, 5).unwrap();
    assert!(place.file.ends_with("kontur_57.spf"));
    assert_eq!(
        (place.line, place.column, place.text.as_str()),
        (2, 5, "N10 X22.000  Y0.000")
    );
    assert!(program.called_from(4)[0].ends_with("MAIN.MPF:3"));
    assert_eq!(program.locate(6, 1).unwrap().line, 4);
    assert!(program.locate(0, 1).is_none() && program.locate(7, 1).is_none());
}

#[test]
fn a_program_end_in_a_sub_program_returns() {
    let folder = Folder::new(
        "end",
        &[
            ("MAIN.MPF", "SUB\nSUB\nM30\n"),
            ("SUB.MPF", "G1 X1\nG0 X2 M30\nX3\n"),
        ],
    );
    let program = folder.load().unwrap();
    assert_eq!(
        sent(&program),
        ["G1 X1", "G0 X2 M17", "G1 X1", "G0 X2 M17", "M30"]
    );
}

#[test]
fn text_behind_the_program_end_is_not_sent() {
    let program = Program::from_text("p", "G1 X1\nM30 ; M17 (M2)\n\nG0 X900\n").unwrap();
    assert_eq!((sent(&program).len(), program.unused_from()), (2, Some(4)));
    let program = Program::from_text("p", "X1 ; M30\nT=\"M30\"\nM3\nM300\nG1\nM02\n\n").unwrap();
    assert_eq!((program.len(), program.unused_from()), (6, None));
}

#[test]
fn a_missing_sub_program_is_shown_at_its_call() {
    let failure = Program::from_text("p.mpf", "G54\nN20 NOWHERE_1\n").unwrap_err();
    assert_eq!(failure.exit, Exit::Program);
    let shown = failure.render();
    assert!(
        shown.contains("no sub-program NOWHERE_1") && shown.contains("p.mpf:2:5"),
        "{shown}"
    );
}

#[test]
fn recursion_is_refused_by_name() {
    let folder = Folder::new(
        "rec",
        &[
            ("MAIN.MPF", "ABC\n"),
            ("ABC.SPF", "DEF\n"),
            ("DEF.SPF", "G1\nabc\n"),
        ],
    );
    let shown = folder.load().unwrap_err().render();
    assert!(
        shown.contains("sub-program abc calls itself") && shown.contains("DEF.SPF:2:1"),
        "{shown}"
    );
    let folder = Folder::new("rec2", &[("MAIN.MPF", "main\n")]);
    assert!(folder.load().unwrap_err().render().contains("calls itself"));
}

#[test]
fn nesting_stops_at_eleven() {
    for (depth, accepted) in [(11, true), (12, false)] {
        let mut files = vec![("MAIN.MPF".to_owned(), "SUB_1\n".to_owned())];
        for level in 1..=depth {
            let next = if level == depth {
                "X1".to_owned()
            } else {
                format!("SUB_{}", level + 1)
            };
            files.push((format!("SUB_{level}.SPF"), format!("{next}\n")));
        }
        let files: Vec<(&str, &str)> = files
            .iter()
            .map(|(a, b)| (a.as_str(), b.as_str()))
            .collect();
        let result = Folder::new(&format!("nest{depth}"), &files).load();
        assert_eq!(result.is_ok(), accepted, "{depth}");
    }
}

#[test]
fn nc_text_is_never_taken_for_a_call() {
    for text in [
        "CSPLINE",
        "csplinex1y2",
        "G1X10Y20",
        "X10",
        "N10",
        "",
        "M30",
        "SOFT",
        "BTAN ETAN",
        "T=\"FR_4\"",
        "(KONTUR)",
        "; KONTUR",
        "K1 K2 K3",
        "N10 G54",
        "KONTUR X1",
        "\"KONTUR\"",
        "Y-0",
        "R1",
        "POLY",
    ] {
        let program = Program::from_text("p", &format!("{text}\n")).unwrap();
        assert_eq!(sent(&program), [text]);
    }
}

#[test]
fn bytes_that_act_on_the_wire_stay_in_comments_only() {
    let program =
        Program::from_text("p", "G1 X1 ; is it? ja! \u{159}ez\nG1 (~ \u{7f}) Y2\n").unwrap();
    assert_eq!(sent(&program), ["G1 X1 ; is it_ ja_ _ez", "G1 (_ _) Y2"]);
    let program = Program::from_text("p", "MSG(\"done! (\u{e9}; ?)\") X1\n").unwrap();
    assert_eq!(sent(&program), ["MSG(\"done_ (_; _)\") X1"]);
    for bad in [
        "G1 ! X1",
        "G1 X1 ~",
        "T=\"a!\"",
        "X=(1) ~ (2)",
        "?",
        "G1 \u{84}",
        "G1 (a) \u{18}",
        "G1 PO[X]=(1,?)",
    ] {
        let failure = Program::from_text("p", bad).unwrap_err();
        assert!(failure.render().contains("cannot be sent"), "{bad}");
    }
}

#[test]
fn a_file_that_is_not_utf8_is_read_all_the_same() {
    let folder = Folder::new("latin", &[]);
    std::fs::write(
        folder.0.join("MAIN.MPF"),
        b"\xef\xbb\xbfG1 X1 ; \xe9\xff\nM30",
    )
    .unwrap();
    assert_eq!(sent(&folder.load().unwrap()), ["G1 X1 ; __", "M30"]);
}

#[test]
fn an_error_underlines_the_word_at_its_column() {
    for (text, column, len) in [
        ("G1 X1.5 Q3", 4, 4),
        ("G1X1.5Y-2.25", 3, 4),
        ("G1X1.5Y-2.25", 7, 6),
        ("A=1", 2, 1),
        ("ASPLINE", 1, 7),
        ("", 9, 1),
    ] {
        assert_eq!(words::word_len(text, column - 1), len, "{text} {column}");
    }
}

proptest! {
    #[test]
    fn any_text_is_refused_or_sent_with_its_columns_and_without_realtime_bytes(text in "(?s).{0,200}") {
        if let Ok(program) = Program::from_text("p", &text) {
            if program.unused_from().is_none() {
                prop_assert!(program.len() <= text.lines().count());
            }
            for (index, line) in program.lines().enumerate() {
                prop_assert!(line.iter().all(|&b| b == 9 || (32..127).contains(&b) && b != b'?' && b != b'!' && b != b'~'));
                let place = program.locate(index + 1, 1).unwrap();
                prop_assert_eq!(place.text.chars().count(), line.len());
                prop_assert_eq!(place.line, index + 1);
            }
        }
        let _ = Program::from_text("p", &text).map(|p| p.error_at(1, 7, "m", "l"));
    }
}
