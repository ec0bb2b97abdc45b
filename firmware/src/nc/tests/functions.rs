//! Laws of the functions around the path: circles, tools, compensation, frames, feeds, parameters, jumps.

use super::{commands, equipped, micro, moves, refusal, run, specs, targets, xyzac, xyzbc};
use crate::config::{Config, Dialect, ToolData};
use crate::nc::command::{Arc, Centre, Corner, Cutter, FeedReference, FeedType, Plane, Side};
use crate::nc::{Auxiliary, Command, Interpreter, Motion, Move};
use crate::units::{Nano, NANO_PER_UNIT};

fn arcs(config: &Config, program: &str) -> Vec<Arc> {
    let arc = |motion: &Move| match motion.motion {
        Motion::Arc(arc) => Some(arc),
        _ => None,
    };
    moves(config, program).iter().filter_map(arc).collect()
}

fn centres(program: &str) -> Vec<[Nano; 2]> {
    let point = |arc: &Arc| match arc.centre {
        Centre::Point(point) => point,
        Centre::Radius(_) => panic!("{arc:?}"),
    };
    arcs(&equipped(), program).iter().map(point).collect()
}

#[test]
fn the_centre_of_an_arc_counts_from_its_start_and_is_handed_on_in_machine_coordinates() {
    let mm = |x: i64, y: i64| [x * NANO_PER_UNIT, y * NANO_PER_UNIT];
    // start at machine (11, 2)
    let start = "G55 G0 X10 Y0 Z0\nF60 ";
    for (line, centre) in [
        ("G2 X0 Y10 I-10 J0", mm(1, 2)),
        ("G2 X0 Y10 I-10", mm(1, 2)),
        ("G3 X5 J5", mm(11, 7)),
        ("G3 X5 J=AC(5)", mm(11, 7)),
        ("G3 X5 I=AC(5) JAC5", mm(6, 7)),
        ("G91 G2 X-10 Y10 I-10", mm(1, 2)),
        ("G2 I-3", mm(8, 2)),
    ] {
        assert_eq!(centres(&format!("{start}{line}")), [centre], "{line}");
    }
    // the centre words of the three planes: I J, K I, J K
    assert_eq!(
        centres("F60 G18 G2 Z5 K1 I2\nG17 G3 X1 I3\nG19 G2 Z9 J1 K2"),
        [mm(1, 2), mm(3, 0), [1_000_000, 7_000_000]]
    );
    let planes: Vec<_> = arcs(
        &xyzac(),
        "F60 G18 G2 Z5 K1\nG3 X5 K2\nG19 G2 Y5 J1 TURN=2\nG2 Z5 K3 TURN1",
    )
    .iter()
    .map(|arc| (arc.plane, arc.clockwise, arc.turns))
    .collect();
    assert_eq!(
        planes,
        [
            (Plane::Zx, true, 0),
            (Plane::Zx, false, 0),
            (Plane::Yz, true, 2),
            (Plane::Yz, true, 1)
        ]
    );
}

#[test]
fn the_radius_of_an_arc_keeps_its_sign_and_its_unit() {
    let radii: Vec<_> = arcs(&xyzac(), "F60 G2 X5 CR=5\nG3 X0 CR-5\nG70 G3 X1 CR=2")
        .iter()
        .map(|arc| arc.centre)
        .collect();
    assert_eq!(
        radii,
        [5_000_000, -5_000_000, 50_800_000].map(Centre::Radius)
    );
    assert_eq!(
        centres("F60 G70 G2 X1 I0.5"),
        [[12_700_000, 0]],
        "inch counts for the centre"
    );
}

#[test]
fn a_word_of_group_1_begins_a_new_spline_and_nothing_else_does() {
    let config = xyzac();
    let first = |program: &str| -> Vec<bool> {
        specs(&config, program)
            .iter()
            .map(|spec| spec.first)
            .collect()
    };
    assert_eq!(
        first("F60 CSPLINE X1\nX2\nBTAN X3\nCSPLINE X4\nX5\nCSPLINE\nG1\nCSPLINE\nX6\nX7\nG1 X8\nASPLINE X9"),
        [true, false, false, true, false, true, false, true]
    );
}

#[test]
fn the_points_of_a_b_spline_may_have_any_weight_from_0_to_3() {
    let weights: Vec<_> = specs(&xyzac(), "F60 BSPLINE X1 PW=3\nX2 PW=0\nX3 PW0.0001\nX4")
        .iter()
        .map(|spec| spec.weight)
        .collect();
    assert_eq!(weights, [3.0, 0.0, 0.0001, 1.0]);
}

#[test]
fn values_may_be_expressions_of_parameters() {
    let program = "R1=2.5 R2=R1*2 R3=-R2 G0\nX=R1\nX=R2+3*SIN(30) Y=R3\nX=(1+2)*3 (comment) Y=-(R1)\nX=5-1 Y=7/2\nX=10 ;";
    let ends: Vec<_> = targets(&xyzac(), program)
        .iter()
        .map(|end| [end[0], end[1]])
        .collect();
    assert_eq!(
        ends,
        [
            [2_500_000, 0],
            [6_500_000, -5_000_000],
            [9_000_000, -2_500_000],
            [4_000_000, 3_500_000],
            [10_000_000, 3_500_000]
        ]
    );
    let path = moves(
        &xyzac(),
        "R9=120 R7=0.5 R8=3\nBSPLINE SD=R8 F=R9*2 X1 PW=R7 PL=R7*2 S=R9",
    );
    assert_eq!(path[0].feed, 4.0);
    let spec = specs(&xyzac(), "R7=0.5\nF9 BSPLINE X1 PW=R7 PL=R7*2")[0];
    assert_eq!((spec.weight, spec.interval), (0.5, Some(1.0)));
    assert_eq!(refusal(&xyzac(), "X=R100").split(' ').next(), Some("1:3"));
}

#[test]
fn a_refused_line_sets_no_parameter() {
    let config = xyzac();
    let mut interpreter = Interpreter::new(&config);
    let mut end = 0;
    for (line, good) in [
        ("G0 R1=1 R2=2", true),
        ("R1=5 R2=6 R1=7 Q", false),
        ("X=R1*10+R2", true),
    ] {
        let answer = interpreter.line(&config, line.as_bytes(), &mut |command| {
            if let Command::Move(motion) = command {
                end = motion.target[0];
            }
        });
        assert_eq!(answer.is_ok(), good, "{line}");
    }
    assert_eq!(end, 12 * NANO_PER_UNIT);
}

#[test]
fn parameters_are_zero_at_the_start_of_every_program() {
    for end in ["M2", "M30", "X1 M30"] {
        let program = format!("G0 R1=5 R99=7\nX=R1\n{end}\nG0 X=R1+R99+3");
        let ends = targets(&xyzac(), &program);
        assert_eq!(ends.first().map(|end| end[0]), Some(5 * NANO_PER_UNIT));
        assert_eq!(ends.last().map(|end| end[0]), Some(3 * NANO_PER_UNIT));
    }
}

#[test]
fn single_words_may_count_from_the_origin_or_from_the_position() {
    let config = equipped();
    let ends = |program: &str| -> Vec<_> {
        let mm = |end: &[Nano; 5]| end.map(|value| value / NANO_PER_UNIT);
        targets(&config, program).iter().map(mm).collect()
    };
    let expected = ends("G0 X10 Y10 A10\nG90 X15 Y10\nG91 Y5\nG90 X3 Y18\nA20");
    assert_eq!(expected[3], [3, 18, 0, 10, 0]);
    for program in [
        "G0 X10 Y10 A10\nX=IC(5)\nG91 Y5\nX=AC(3) Y3\nG90 A=DC(20)",
        "G0X10Y10A10\nXIC5\nYIC+5\nG91XAC3Y3\nADC20",
        "G0 X10 Y10 A10\nXIC(2+3)\nY=IC(5)\nX3 Y=IC(3.)\nAIC10",
    ] {
        assert_eq!(ends(program), expected, "{program}");
    }
    // absolute words are shifted by the offset in force
    assert_eq!(ends("G55 G91 G0 X=AC(5) Y5"), [[6, 5, 0, 0, 0]]);
}

#[test]
fn zero_offsets_are_modal_and_g53_suppresses_them_for_one_line() {
    let xs: Vec<_> = targets(
        &equipped(),
        "G0 X5\nG55 X5\nX6\nG53 X5\nX5\nG500 X5\nG54 X5\nG55\nM30\nG0 X5",
    )
    .iter()
    .map(|end| end[0] / NANO_PER_UNIT)
    .collect();
    assert_eq!(xs, [5, 6, 7, 5, 6, 5, 5, 5]);
}

#[test]
fn the_length_of_the_tool_lies_along_the_normal_of_the_plane_from_the_change_on() {
    let ends: Vec<_> = targets(
        &equipped(),
        "G0 Z5\nT=\"FR_4\"\nZ6\nM6 Z7\nG91 Z1\nG90 D0 Z5\nD1 Z5\nG19 X5 Z5\nT0 M6 X5",
    )
    .iter()
    .map(|end| [end[0] / NANO_PER_UNIT, end[2] / NANO_PER_UNIT])
    .collect();
    assert_eq!(
        ends,
        [
            [0, 5],
            [0, 6],
            [0, 87],
            [0, 88],
            [0, 5],
            [0, 85],
            [85, 5],
            [5, 5]
        ]
    );
}

#[test]
fn g10_writes_the_tool_table_and_reset_keeps_it_and_the_tool_in_the_spindle() {
    let config = equipped();
    let mut interpreter = Interpreter::new(&config);
    for line in [
        "G10 L1 P7 R3 Z50",
        "G10 L1 P4 R2.5",
        "G70 G10L1P8Z1",
        "T7 M6",
    ] {
        interpreter
            .line(&config, line.as_bytes(), &mut |command| {
                assert_eq!(command, Command::Auxiliary(Auxiliary::ToolChange));
            })
            .unwrap();
    }
    let row = |tool: &ToolData| (tool.number, tool.radius, tool.length);
    let rows = [
        (7, 3_000_000, 50_000_000),
        (8, 0, 25_400_000),
        (4, 2_500_000, 80_000_000),
    ];
    assert_eq!(
        interpreter.tools().rows().map(row).collect::<Vec<_>>(),
        rows
    );
    assert_eq!(interpreter.tools().mounted().map(row), Some(rows[0]));
    interpreter.reset(&config);
    assert_eq!(
        interpreter.tools().rows().map(row).collect::<Vec<_>>(),
        rows
    );
    assert_eq!(interpreter.tools().mounted().map(row), Some(rows[0]));
}

fn sides(config: &Config, program: &str) -> Vec<(Side, Nano)> {
    let side = |motion: &Move| (motion.cutter.side, motion.cutter.radius);
    moves(config, program).iter().map(side).collect()
}

#[test]
fn compensation_is_carried_by_the_moves_behind_its_word() {
    let program = "T4\nM6\nG1 F60 X40\nG42\nG1 X37\nCSPLINE X20 Y5\nG42\nX10\nG40\nG1 X40\nX50";
    let with = (Side::Right, 2_000_000);
    let without = (Side::On, 0);
    assert_eq!(
        sides(&equipped(), program),
        [without, with, with, with, without, without]
    );
    // names without a table are tools of radius 0
    assert_eq!(
        sides(&xyzac(), "T=\"ANY\" M6\nG41 G0 X1"),
        [(Side::Left, 0)]
    );
    assert_eq!(sides(&equipped(), "T4 M6 D0\nG41 G0 X1"), [(Side::Left, 0)]);
    let last = moves(
        &equipped(),
        "T4 M6 F60 G41 D1 G1 X1\nG451 CFTCP X2\nG450 CFIN X3\nCFC NORM X4",
    );
    let cutters: Vec<_> = last.iter().map(|motion| motion.cutter).collect();
    let cutter = |corner, feed| Cutter {
        side: Side::Left,
        corner,
        feed,
        plane: Plane::Xy,
        radius: 2_000_000,
    };
    assert_eq!(
        cutters,
        [
            cutter(Corner::Arc, FeedReference::Contour),
            cutter(Corner::Intersection, FeedReference::Centre),
            cutter(Corner::Arc, FeedReference::Inside),
            cutter(Corner::Arc, FeedReference::Contour),
        ]
    );
}

#[test]
fn feed_counts_time_revolutions_or_blocks() {
    let path = moves(
        &xyzac(),
        "G94 F600 X1\nG95 S600 F0.2 X2\nS1200 X3\nG93 F30 X4\nG70 F60 X5\nG0 X6\nG71 G94 G1 F60 X7",
    );
    let feeds: Vec<_> = path
        .iter()
        .filter(|motion| motion.motion != Motion::Rapid)
        .map(|motion| (motion.feed, motion.feed_type))
        .collect();
    assert_eq!(
        feeds,
        [
            (10.0, FeedType::PerTime),
            (2.0, FeedType::PerTime),
            (4.0, FeedType::PerTime),
            (0.5, FeedType::Inverse),
            (1.0, FeedType::Inverse),
            (1.0, FeedType::PerTime),
        ]
    );
}

#[test]
fn named_axes_go_to_the_reference_point_or_the_fixed_point_in_rapid() {
    let mut config = equipped();
    config.reference_point = micro([1000, 2000, 3000, 4000, 5000]);
    config.fixed_point = micro([-1000, -2000, -3000, -4000, -5000]);
    let path = moves(
        &config,
        "G55 T4 M6 G1 F60 X50\nG74 X0 Z=0\nG75 X Y\nG74XYZAC\nX0",
    );
    assert!(path[1..4]
        .iter()
        .all(|motion| motion.motion == Motion::Rapid));
    let ends: Vec<_> = path.iter().map(|motion| motion.target).collect();
    assert_eq!(
        ends[1..],
        [
            micro([1000, 0, 3000, 0, 0]),
            micro([-1000, -2000, 3000, 0, 0]),
            micro([1000, 2000, 3000, 4000, 5000]),
            micro([1000, 2000, 3000, 4000, 5000]),
        ]
    );
    assert_eq!(path[4].motion, Motion::Linear);
}

#[test]
fn a_dwell_may_count_revolutions_of_the_spindle() {
    assert_eq!(
        commands(&xyzac(), "S600\nG4 S30\nM3"),
        [
            Command::Dwell { milliseconds: 3000 },
            Command::Auxiliary(Auxiliary::SpindleClockwise(600.0)),
        ]
    );
}

#[test]
fn gear_stages_coolant_and_messages_are_handed_on() {
    let list = commands(
        &xyzac(),
        "M41 S9 M3\nM45\nM40\nM7\nMSG(\"a (b; c\") M8\nMSG()\nMSG \"d\"\nMSG",
    );
    let text = |command: &Command| match command {
        Command::Message(text) => text.to_string(),
        Command::Auxiliary(auxiliary) => format!("{auxiliary:?}"),
        other => panic!("{other:?}"),
    };
    assert_eq!(
        list.iter().map(text).collect::<Vec<_>>(),
        [
            "GearStage(1)",
            "SpindleClockwise(9.0)",
            "GearStage(5)",
            "CoolantOn",
            "a (b; c",
            "CoolantOn",
            "",
            "d",
            ""
        ]
    );
}

#[test]
fn functions_that_are_in_force_anyway_do_nothing() {
    assert_eq!(
        commands(
            &xyzac(),
            "G97 G601 NORM FNORM CFC G450\nG602\nG603 G500 G17 D1\nG971\nRET\nM17\n/N5 G710\n/3 G64"
        ),
        []
    );
    assert_eq!(
        moves(&xyzac(), "/N5 G0 X1\n/G700 X1")[1].target[0],
        25_400_000
    );
}

#[test]
fn a_forward_jump_passes_over_lines_unread_up_to_its_label() {
    let xs: Vec<_> = targets(
        &xyzac(),
        "G0 X1\nN5 GOTOF LABEL_1\nX2 Q ' (\nT=\"\nOTHER: X3\nN10 label_1: X4\nLABEL_1: X5\nX6 GOTOFEND\nX7\n/N9 END:",
    )
    .iter()
    .map(|end| end[0] / NANO_PER_UNIT)
    .collect();
    assert_eq!(xs, [1, 4, 5, 6]);
}

#[test]
fn the_end_of_the_text_says_what_is_missing() {
    let config = xyzac();
    for (program, expected) in [
        ("GOTOF AWAY\nX1", "3:1 142 label 'AWAY' not found"),
        ("F9 G6 X1 I1", "2:1 127 K line of a G6 block expected"),
        (
            "POLY\nPOX Q1",
            "3:1 143 coordinates of the POLY block expected",
        ),
    ] {
        assert_eq!(refusal(&config, program), expected);
    }
}

#[test]
fn splines_and_plane_begin_as_the_machine_file_says() {
    use crate::nc::BoundaryCondition::{NotAKnot, Tangent};
    let mut config = xyzac();
    config.spline_begin = NotAKnot;
    config.spline_end = Tangent;
    config.plane = Plane::Zx;
    let spec = specs(&config, "F60 BNAT ENAT G17\nM30\nF60 CSPLINE X1")[0];
    assert_eq!((spec.begin, spec.end), (NotAKnot, Tangent));
    assert_eq!(
        arcs(&config, "F60 G17\nM2\nF60 G2 Z5 K1")[0].plane,
        Plane::Zx
    );
}

#[test]
fn measured_words_take_the_axis_letters_of_the_machine() {
    assert_eq!(
        targets(&xyzbc(), "G0 BIC5 C=AC(6)"),
        [micro([0, 0, 0, 5000, 6000])]
    );
}

#[test]
fn a_nurbs_curve_goes_from_g06_2_to_the_next_function_of_group_1() {
    let mut config = xyzac();
    config.dialect = Dialect::Fanuc;
    let program = "G01 X0 Y0 F600\nG06.2 P3 K0. X0. Y0. R1. F300\nK0. X5. Y10. R2.\nK0. X10. Y0.\nK1.\nK1.\nK1.\nG01 X20.";
    let path = moves(&config, program);
    assert_eq!(path.len(), 5, "{path:?}");
    let spline: Vec<_> = specs(&config, program)
        .iter()
        .map(|spec| (spec.degree, spec.weight, spec.first))
        .collect();
    assert_eq!(spline, [(2, 1.0, true), (2, 2.0, false), (2, 1.0, false)]);
    assert_eq!(path[4].target[0], 20_000_000);
    assert_eq!(path[3].feed, 5.0);
    let open = "G01 X0 Y0 F600\nG06.2 P3 K0. X0. Y0.\nK0. X5. Y10.\nG01 X9";
    assert!(run(&config, open).1.is_err());
    assert!(run(&xyzac(), "G06.2 P3").1.is_err());
}

#[test]
fn the_dialect_stays_until_it_is_set_again_or_reset() {
    let config = xyzac();
    let mut interpreter = Interpreter::new(&config);
    assert_eq!(interpreter.dialect(), Dialect::Sinumerik);
    interpreter.set_dialect(Dialect::Fanuc);
    interpreter.line(&config, b"M30", &mut |_| ()).unwrap();
    assert_eq!(interpreter.dialect(), Dialect::Fanuc);
    interpreter.reset(&config);
    assert_eq!(interpreter.dialect(), Dialect::Sinumerik);
}

#[test]
fn conversational_lines_are_read_under_their_dialect_only() {
    let mut config = xyzac();
    let program = "BEGIN PGM A MM\n1 L X+5 Y-2 F600 M3\n2 L IX+1 FMAX\nEND PGM A MM";
    assert!(run(&config, program).1.is_err());
    config.dialect = Dialect::Heidenhain;
    assert_eq!(
        targets(&config, program),
        [micro([5000, -2000, 0, 0, 0]), micro([6000, -2000, 0, 0, 0])]
    );
    assert_eq!(
        commands(&config, program).last(),
        Some(&Command::ProgramEnd)
    );
    let open = "L X0 F60\nSPL X1 K3X0";
    assert_eq!(refusal(&config, open).split(' ').next(), Some("3:1"));
}
