//! One law per function of the language.

use super::{commands, micro, moves, run, xyzac, xyzbc};
use crate::nc::command::Rounding;
use crate::nc::table::{G_FUNCTIONS, KEYWORDS, M_FUNCTIONS};
use crate::nc::{
    Auxiliary, BoundaryCondition, Command, Excerpt, Interpreter, Motion, SplineKind, SplineSpec,
    Tool,
};
use proptest::prelude::*;

#[test]
fn motion_is_modal_and_positions_are_absolute() {
    let path = moves(
        &xyzac(),
        "N10 G1 X1.5 F600\nn20 y-2\n\nG0 Z.5 A90\nx-0 C-1.234567",
    );
    let ends: Vec<_> = path.iter().map(|motion| motion.target).collect();
    assert_eq!(
        ends,
        [
            micro([1500, 0, 0, 0, 0]),
            micro([1500, -2000, 0, 0, 0]),
            micro([1500, -2000, 500, 90_000, 0]),
            [0, -2_000_000, 500_000, 90_000_000, -1_234_567],
        ]
    );
    let kinds: Vec<_> = path.iter().map(|motion| motion.motion).collect();
    assert_eq!(
        kinds,
        [Motion::Linear, Motion::Linear, Motion::Rapid, Motion::Rapid]
    );
    assert_eq!(
        path.iter().map(|motion| motion.block).collect::<Vec<_>>(),
        [1, 2, 4, 5]
    );
    assert_eq!(path[1].feed, 10.0);
}

#[test]
fn incremental_dimensions_add_to_the_position() {
    let path = moves(&xyzac(), "F60 X10\nG91 X1 Y1\nX1\nG90 X1");
    let xs: Vec<_> = path.iter().map(|motion| motion.target[0]).collect();
    assert_eq!(xs, [10_000_000, 11_000_000, 12_000_000, 1_000_000]);
    assert_eq!(path[3].target[1], 1_000_000);
}

#[test]
fn the_zero_offset_shifts_absolute_coordinates_only() {
    let mut config = xyzac();
    config.zero_offsets[0] = [100, -200, 300, 7, 0];
    let path = moves(&config, "G54 G0 X0 Y0\nG91 X0.000001 Y0 A0");
    assert_eq!(path[0].target, [100, -200, 0, 0, 0]);
    assert_eq!(path[1].target, [101, -200, 0, 0, 0]);
}

#[test]
fn inch_counts_for_linear_axes_and_their_feed_wherever_it_stands_in_the_line() {
    let path = moves(&xyzac(), "X1 A1 F60 G70\nA2\nG71 X1");
    assert_eq!(path[0].target, [25_400_000, 0, 0, 1_000_000, 0]);
    assert_eq!(path[0].feed, 25.4);
    assert_eq!(path[1].feed, 1.0);
    assert_eq!(path[2].feed, 25.4);
    assert_eq!(path[2].target[0], 1_000_000);
}

#[test]
fn the_default_feed_serves_until_f_is_programmed() {
    let mut config = xyzac();
    config.default_feed = 2.5;
    let path = moves(&config, "X1\nX2 F60\nM30\nX3");
    assert_eq!(
        path.iter().map(|motion| motion.feed).collect::<Vec<_>>(),
        [2.5, 1.0, 2.5]
    );
}

#[test]
fn exact_stop_is_modal_with_g60_and_of_one_block_with_g9() {
    let path = moves(
        &xyzac(),
        "F60 X1\nG9 X2\nX3\nG60 X4\nX5\nG64 X6\nG64 G9 X7\nX8",
    );
    let stops: Vec<_> = path.iter().map(|motion| motion.exact_stop).collect();
    assert_eq!(stops, [false, true, false, true, true, false, true, false]);
}

#[test]
fn g641_rounds_by_adis_or_adispos_and_g642_by_tolerance_until_another_of_their_group_comes() {
    let none = Rounding::None;
    let by = Rounding::Distance;
    for (program, roundings) in [
        // power-up, and a distance alone rounds nothing
        ("F60 X1\nADIS=0.5 X2", vec![none, none]),
        ("F60 G641 ADIS=0.5 ADISPOS=2.5 X1\nG0 X2\nG1 X3", vec![by(0.5), by(2.5), by(0.5)]),
        // without a distance as G64
        ("F60 G641 X1\nADISPOS4 X2\nG0 X3", vec![none, none, by(4.0)]),
        ("F60 G641 ADIS0.25\nX1\nG64 X2\nG641 X3\nG642 X4\nADIS=0 X5\nG641 X6", 
            vec![by(0.25), none, by(0.25), Rounding::Tolerance, Rounding::Tolerance, none]),
        // inch counts for both
        ("F60 G641 G70 ADIS=1 ADISPOS=2 X1\nG0 X2", vec![by(25.4), by(50.8)]),
        // splines, circles, polynomials and G6 alike
        ("F60 G641 ADIS=1\nASPLINE X1 Y1\nG2 X2 I0.5\nPOLY PO[X]=(3)\nG6 X4 I1\nK0 K0 K-268435456", 
            vec![by(1.0); 4]),
        // of one program only
        ("F60 G641 ADIS=1 X1\nM30\nF60 G641 X2", vec![by(1.0), none]),
    ] {
        let path = moves(&xyzac(), program);
        let found: Vec<_> = path.iter().map(|motion| motion.rounding).collect();
        assert_eq!(found, roundings, "{program}");
    }
    let path = moves(&xyzac(), "F60 G641 ADIS=1 X1\nG9 X2\nG60 X3\nG642 X4");
    let stops: Vec<_> = path.iter().map(|motion| motion.exact_stop).collect();
    assert_eq!(stops, [false, true, true, false]);
}

#[test]
fn soft_and_brisk_select_the_acceleration_profile() {
    let path = moves(&xyzac(), "F60 X1\nBRISK X2\nX3\nSOFTX4");
    assert_eq!(
        path.iter().map(|motion| motion.soft).collect::<Vec<_>>(),
        [true, false, false, true]
    );
}

#[test]
fn m_functions_act_before_or_behind_the_motion_of_their_line() {
    let order = |line: &str| {
        let name = |command: &Command| match command {
            Command::Move(_) => "move",
            Command::Dwell { .. } => "dwell",
            Command::ProgramEnd => "end",
            Command::Message(_) => "MSG",
            Command::Auxiliary(auxiliary) => match auxiliary {
                Auxiliary::Stop => "M0",
                Auxiliary::OptionalStop => "M1",
                Auxiliary::SpindleClockwise(_) => "M3",
                Auxiliary::SpindleCounterClockwise(_) => "M4",
                Auxiliary::SpindleStop => "M5",
                Auxiliary::ToolChange => "M6",
                Auxiliary::CoolantOn => "M8",
                Auxiliary::CoolantOff => "M9",
                Auxiliary::GearStage(_) => "M41",
            },
        };
        commands(&xyzac(), line)
            .iter()
            .map(name)
            .collect::<Vec<_>>()
    };
    assert_eq!(order("G0 M8 X1 M3 M6 M0"), ["M6", "M3", "M8", "move", "M0"]);
    assert_eq!(order("G0 M30 M9 M5 X1"), ["move", "M5", "M9", "end"]);
    assert_eq!(order("M1 G0 X1 M4"), ["M4", "move", "M1"]);
    assert_eq!(order("M2"), ["end"]);
    assert_eq!(order("M17 G0 X1"), ["move"]);
    assert_eq!(order("M9 G4 F1 M3"), ["M3", "dwell", "M9"]);
}

#[test]
fn the_spindle_starts_at_the_speed_in_force() {
    let spindle = commands(&xyzac(), "S500\nM3\nM4 S17000\nM3");
    assert_eq!(
        spindle,
        [
            Command::Auxiliary(Auxiliary::SpindleClockwise(500.0)),
            Command::Auxiliary(Auxiliary::SpindleCounterClockwise(17_000.0)),
            Command::Auxiliary(Auxiliary::SpindleClockwise(17_000.0)),
        ]
    );
}

#[test]
fn a_dwell_takes_seconds_and_leaves_the_feed() {
    let program = "F60\nG4 F2\nG4 P0.5\nG4P0.0006\nG4 F0\nX1";
    let list = commands(&xyzac(), program);
    let dwells: Vec<_> = list[..4].to_vec();
    let expected = [2000, 500, 1, 0].map(|milliseconds| Command::Dwell { milliseconds });
    assert_eq!(dwells, expected);
    assert!(matches!(list[4], Command::Move(motion) if motion.feed == 1.0));
}

#[test]
fn tools_have_numbers_or_names() {
    let config = xyzac();
    let mut interpreter = Interpreter::new(&config);
    assert_eq!(interpreter.tool(), None);
    for (line, tool) in [
        ("T=\"FR_4\"", Tool::Name(Excerpt::new(b"FR_4"))),
        ("T5 M6", Tool::Number(5)),
        ("T\"a b;(\" M6", Tool::Name(Excerpt::new(b"a b;("))),
        ("T=0", Tool::Number(0)),
    ] {
        interpreter
            .line(&config, line.as_bytes(), &mut |_| ())
            .unwrap();
        assert_eq!(interpreter.tool(), Some(tool), "{line}");
    }
}

#[test]
fn glued_and_spaced_and_lower_case_spellings_mean_the_same() {
    let spellings = [
        "N10 ASPLINE BTAN ETAN X1.5 Y2.5 F600 M3 S100",
        "n10asplinebtanetanx1.5y2.5f600m3s100",
        "N10 ASPLINEX1.5Y2.5BTANETANF600M3S100",
        "N10X1.5ETANY2.5BTANASPLINEF600S100M03",
        "\tX = 1.5  Y=+2.50 ( a ) ETAN BTAN ASPLINE F6E2 S1E2 M3 ; b",
        "X1500E-3ETANBTANY.25e1 ASPLINE F600. S100 M 3\r",
        "M3S100 F600 X1.5(X9)Y2.5ETANASPLINEBTAN;",
    ];
    let expected = commands(&xyzac(), spellings[0]);
    assert_eq!(expected.len(), 2);
    for spelling in spellings {
        assert_eq!(commands(&xyzac(), spelling), expected, "{spelling}");
    }
}

#[test]
fn end_conditions_are_modal() {
    let specs: Vec<_> = moves(&xyzac(), "F60 CSPLINE X1\nBAUTO EAUTO X2\nBTANENAT X3\nX4")
        .iter()
        .map(|motion| match motion.motion {
            Motion::Spline(SplineSpec {
                kind, begin, end, ..
            }) => (kind, begin, end),
            _ => panic!("{motion:?}"),
        })
        .collect();
    use BoundaryCondition::{Natural, NotAKnot, Tangent};
    assert_eq!(
        specs,
        [
            (Natural, Natural),
            (NotAKnot, NotAKnot),
            (Tangent, Natural),
            (Tangent, Natural)
        ]
        .map(|(begin, end)| (SplineKind::Cubic, begin, end))
    );
}

/// Degree, interval and weight of each B-spline point of `program`.
fn points(program: &str) -> Vec<(u8, Option<f32>, f32)> {
    let spec = |motion: &crate::nc::Move| match motion.motion {
        Motion::Spline(spec) => Some((spec.degree, spec.interval, spec.weight)),
        _ => None,
    };
    moves(&xyzac(), program).iter().filter_map(spec).collect()
}

#[test]
fn b_spline_words_have_a_spelling_without_equals_sign() {
    let with = points("F60 BSPLINE SD=2\nX1 PW=1.5 PL=0.25\nX2 PW=1.5");
    assert_eq!(with, [(2, Some(0.25), 1.5), (2, None, 1.5)]);
    assert_eq!(points("F60BSPLINESD2\nX1PW1.5PL.25\nx2pw1.5"), with);
}

#[test]
fn degree_and_weight_begin_anew_with_each_spline() {
    assert_eq!(
        points("F60 SD=2 BSPLINE X1 PW=2\nG1 X2\nBSPLINE X3 PW=0.5\nG0\nBSPLINE\nSD2\nX4\nASPLINE X5 PW=3 SD=2 PL=1"),
        [(2, None, 2.0), (3, None, 0.5), (2, None, 1.0), (3, None, 1.0)]
    );
}

#[test]
fn the_program_end_restores_the_power_up_state_and_the_line_count() {
    let config = xyzac();
    let mut interpreter = Interpreter::new(&config);
    let mut list = Vec::new();
    for line in ["G91 G0 G60 BRISK X5", "F60 S7 M30", "F60 X1", "X1"] {
        interpreter
            .line(&config, line.as_bytes(), &mut |command| list.push(command))
            .unwrap();
    }
    assert_eq!(interpreter.line_number(), 2);
    let Command::Move(motion) = list[2] else {
        panic!("{list:?}")
    };
    assert_eq!((motion.motion, motion.block), (Motion::Linear, 1));
    assert_eq!(motion.target, micro([1000, 0, 0, 0, 0]));
    assert!(motion.soft && !motion.exact_stop);
}

#[test]
fn reset_forgets_everything_but_the_position() {
    let config = xyzac();
    let mut interpreter = Interpreter::new(&config);
    for line in ["G0 X5", "T3 F5 G91 G6", "G90 X6 I1"] {
        interpreter
            .line(&config, line.as_bytes(), &mut |_| ())
            .unwrap();
    }
    interpreter.reset(&config);
    assert_eq!(interpreter.position(), micro([5000, 0, 0, 0, 0]));
    assert_eq!((interpreter.line_number(), interpreter.tool()), (0, None));
    let error = interpreter.line(&config, b"X7", &mut |_| ()).unwrap_err();
    assert_eq!(error.kind.code(), 119);
    interpreter.set_position([1, 2, 3, 4, 5]);
    assert_eq!(interpreter.position(), [1, 2, 3, 4, 5]);
}

#[test]
fn axis_letters_are_those_of_the_machine() {
    assert_eq!(
        moves(&xyzbc(), "G0 B5 C6")[0].target,
        micro([0, 0, 0, 5000, 6000])
    );
    let (_, end) = run(&xyzbc(), "G0 A0");
    assert_eq!(
        end.unwrap_err().to_string(),
        "1:4 117 axis 'A' is not configured"
    );
}

#[test]
fn headers_and_comments_mean_nothing() {
    assert_eq!(
        commands(
            &xyzac(),
            "%\n%MPF 150\n %_N_EKVI_45_SPF ; x\n;$PATH=/_N_WKS_DIR\n(a)(b)\n( ; ) (%)\nN10\n;N115 GOTOF LABEL_1\n%"
        ),
        []
    );
}

#[test]
fn glued_keywords_part_in_one_way_only_and_no_function_stands_twice() {
    for (i, one) in KEYWORDS.iter().enumerate() {
        for (j, other) in KEYWORDS.iter().enumerate() {
            // what stands behind a number's word is a number, not the rest of a longer word, which is tried first
            let parts = one.takes_number && j < i;
            assert!(
                i == j || parts || !other.name.starts_with(one.name),
                "{} {}",
                one.name,
                other.name
            );
        }
    }
    for rows in [&G_FUNCTIONS[..], &M_FUNCTIONS[..]] {
        let mut numbers: Vec<_> = rows.iter().map(|row| row.0).collect();
        numbers.sort_unstable();
        numbers.dedup();
        assert_eq!(numbers.len(), rows.len());
    }
}

proptest! {
    #[test]
    fn printed_coordinates_arrive_exactly_whatever_the_spacing(
        values in prop::array::uniform5(-1_000_000_000_000i64..=1_000_000_000_000),
        spaces in prop::array::uniform5(0usize..3),
    ) {
        // up to 1e5 mm is in range
        let values = values.map(|value| value / 10);
        let mut line = String::from("G0");
        for ((letter, value), spaces) in ["X", "Y", "Z", "A", "C"].iter().zip(values).zip(spaces) {
            let sign = if value < 0 { "-" } else { "" };
            let size = value.unsigned_abs();
            line += &format!("{}{letter}{sign}{}.{:06}", " ".repeat(spaces), size / 1_000_000, size % 1_000_000);
        }
        prop_assert_eq!(moves(&xyzac(), &line)[0].target, values);
    }
}
