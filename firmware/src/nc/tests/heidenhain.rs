//! Conversational programs: lines in, commands and errors out.

use crate::catalogue::{dialect, nc, Message};
use crate::config::tests::test_config;
use crate::config::{Config, ToolData, TOOL_NAME};
use crate::nc::command::{
    Arc, Auxiliary, Centre, Command, Cutter, FeedReference, Motion, Move, Plane, Polynomial, Side,
};
use crate::nc::heidenhain::{Heidenhain, Shared};
use crate::nc::tools::Tools;
use crate::units::{Nano, AXES};
use proptest::prelude::*;

/// Zero offset X 10 mm; tool 5 "FR_4", radius 2 mm, length 100 mm.
const OFFSET: [Nano; AXES] = [10_000_000, 0, 0, 0, 0];

fn config() -> Config {
    let mut config = test_config();
    let mut name = [0; TOOL_NAME];
    name[..4].copy_from_slice(b"FR_4");
    config.tools[3] = ToolData {
        number: 5,
        name,
        radius: 2_000_000,
        length: 100_000_000,
    };
    config
}

struct Run {
    config: Config,
    reader: Heidenhain,
    tools: Tools,
    position: [Nano; AXES],
    offset: [Nano; AXES],
    line: u32,
    commands: Vec<Command>,
}

impl Run {
    fn new() -> Self {
        let config = config();
        Self {
            tools: Tools::new(&config),
            reader: Heidenhain::new(&config),
            config,
            position: [0; AXES],
            offset: [0; AXES],
            line: 0,
            commands: Vec::new(),
        }
    }

    /// Takes a line; number, column and text of what was refused.
    fn line(&mut self, text: &[u8]) -> Result<bool, (u16, u16, String)> {
        self.line += 1;
        let (before, place) = (self.state(), self.position);
        let count = self.commands.len();
        let commands = &mut self.commands;
        let mut shared = Shared {
            config: &self.config,
            tools: &mut self.tools,
            zero_offset: &self.offset,
            line: self.line,
            position: &mut self.position,
        };
        let done = self
            .reader
            .line(&mut shared, text, &mut |command| commands.push(command));
        done.map_err(|fault| {
            assert_eq!(self.commands.len(), count, "a refused line emitted");
            assert_eq!(self.state(), before);
            assert_eq!(self.position, place);
            let kind = fault.kind(text);
            (kind.code(), fault.column(), kind.to_string())
        })
    }

    fn state(&self) -> String {
        format!("{:?} {:?}", self.reader, self.tools)
    }

    /// Number of the tool in the spindle.
    fn tool(&self) -> Option<u32> {
        self.tools.mounted().map(|tool| tool.number)
    }

    fn moves(&self) -> Vec<Move> {
        let only = |command: &Command| match command {
            Command::Move(step) => Some(*step),
            _ => None,
        };
        self.commands.iter().filter_map(only).collect()
    }
}

fn run(program: &str) -> Run {
    let mut run = Run::new();
    for line in program.lines() {
        if let Err(error) = run.line(line.as_bytes()) {
            panic!("{error:?} in {line}");
        }
    }
    run
}

/// Micrometres and millidegrees.
fn micro(values: [Nano; AXES]) -> [Nano; AXES] {
    values.map(|value| value * 1000)
}

const PROGRAM: &str = r#"0 BEGIN PGM PART_1 MM
1 BLK FORM 0.1 Z X+0 Y+0 Z-20
2 TOOL CALL 5 Z S5000 DL+0.5 DR-0.25 ; finishing
3 L Z+2 R0 FMAX M13
* - Outline
4 L X+10 Y-5.5 RL F600 M8
5 L IX+5 IY-1 A+12.5
6 CC X+0 Y+1
7 C X+20 Y+1 DR-
8 CR X+30 Y+1 R-5 DR+ F1200 R0
9 L C+90
10 STOP M9
11 L Z+100 FMAX M30
12 END PGM PART_1 MM"#;

#[test]
fn a_program_becomes_its_commands() {
    let run = run(PROGRAM);
    let targets: Vec<_> = run.moves().iter().map(|step| step.target).collect();
    assert_eq!(
        targets,
        [
            micro([0, 0, 102_500, 0, 0]),
            micro([10_000, -5_500, 102_500, 0, 0]),
            micro([15_000, -6_500, 102_500, 12_500, 0]),
            micro([20_000, 1_000, 102_500, 12_500, 0]),
            micro([30_000, 1_000, 102_500, 12_500, 0]),
            micro([30_000, 1_000, 102_500, 12_500, 90_000]),
            micro([30_000, 1_000, 200_500, 12_500, 90_000]),
        ]
    );
    let feeds: Vec<_> = run.moves()[1..6].iter().map(|step| step.feed).collect();
    assert_eq!(feeds, [10.0, 10.0, 10.0, 20.0, 20.0]);
    let arc = |clockwise, centre| {
        Motion::Arc(Arc {
            plane: Plane::Xy,
            clockwise,
            centre,
            turns: 0,
        })
    };
    let motions: Vec<_> = run.moves().iter().map(|step| step.motion).collect();
    assert_eq!(
        motions,
        [
            Motion::Rapid,
            Motion::Linear,
            Motion::Linear,
            arc(true, Centre::Point([0, 1_000_000])),
            arc(false, Centre::Radius(-5_000_000)),
            Motion::Linear,
            Motion::Rapid,
        ]
    );
    let sides: Vec<_> = run.moves().iter().map(|step| step.cutter.side).collect();
    use Side::{Left, On};
    assert_eq!(sides, [On, Left, Left, Left, On, On, On]);
    let cutter = Cutter {
        side: Left,
        feed: FeedReference::Centre,
        radius: 1_750_000,
        ..Cutter::OFF
    };
    assert_eq!(run.moves()[1].cutter, cutter);
    let blocks: Vec<_> = run.moves().iter().map(|step| step.block).collect();
    assert_eq!(blocks, [4, 6, 7, 9, 10, 11, 13]);
    let others: Vec<_> = run
        .commands
        .iter()
        .filter(|command| !matches!(command, Command::Move(_)))
        .copied()
        .collect();
    assert_eq!(
        others,
        [
            Command::Auxiliary(Auxiliary::ToolChange),
            Command::Auxiliary(Auxiliary::SpindleClockwise(5000.0)),
            Command::Auxiliary(Auxiliary::CoolantOn),
            Command::Auxiliary(Auxiliary::CoolantOn),
            Command::Auxiliary(Auxiliary::CoolantOff),
            Command::Auxiliary(Auxiliary::Stop),
            Command::ProgramEnd,
        ]
    );
    assert_eq!(run.tool(), Some(5));
}

#[test]
fn blanks_and_case_mean_nothing() {
    let stripped: String = PROGRAM
        .lines()
        .map(|line| {
            line.split(';')
                .next()
                .unwrap()
                .replace(' ', "")
                .to_lowercase()
                + "\n"
        })
        .collect();
    assert_eq!(run(&stripped).commands, run(PROGRAM).commands);
}

#[test]
fn inch_programs_count_in_inches_and_tenths_of_an_inch_per_minute() {
    let run = run(
        "BEGIN PGM A INCH\nL X+1 C+1 F600\nCC X-1 Y0.5\nC DR+\nCR X2 R.5 DR+
SPL Y+0 X+0 K3X0 K2X0 K1X2 K3Y0 K2Y0 K1Y0",
    );
    let moves = run.moves();
    assert_eq!(moves[0].target, [25_400_000, 0, 0, 0, 1_000_000]);
    assert_eq!(moves[0].feed, 25.4);
    let centre = |step: &Move| match step.motion {
        Motion::Arc(arc) => Some(arc.centre),
        _ => None,
    };
    let point = Centre::Point([-25_400_000, 12_700_000]);
    assert_eq!(centre(&moves[1]), Some(point));
    assert_eq!(centre(&moves[2]), Some(Centre::Radius(12_700_000)));
    assert_eq!(run.position, [0, 0, 0, 0, 1_000_000]);
}

#[test]
fn the_zero_offset_shifts_what_is_absolute() {
    let mut run = Run::new();
    run.offset = OFFSET;
    for line in [
        "L X+5 F100",
        "L IX+5",
        "CC X+1 Y+2",
        "C X+20 DR+",
        "CC",
        "C DR+",
    ] {
        run.line(line.as_bytes()).unwrap();
    }
    let xs: Vec<_> = run.moves().iter().map(|step| step.target[0]).collect();
    assert_eq!(xs, [15_000_000, 20_000_000, 30_000_000, 30_000_000]);
    let centres: Vec<_> = run.moves()[2..]
        .iter()
        .map(|step| match step.motion {
            Motion::Arc(arc) => arc.centre,
            _ => panic!("{step:?}"),
        })
        .collect();
    let (first, second) = ([11_000_000, 2_000_000], [30_000_000, 0]);
    assert_eq!(centres, [Centre::Point(first), Centre::Point(second)]);
}

#[test]
fn the_letters_of_the_centre_and_the_tool_axis_name_the_plane() {
    for (program, plane, centre) in [
        ("CC Z1 X2\nC X4 DR+", Plane::Zx, [1, 2]),
        ("CC X2 Z1\nC X4 DR+", Plane::Zx, [1, 2]),
        ("CC Y1 Z2\nC Y4 DR+", Plane::Yz, [1, 2]),
        ("CC X1 Y2\nC Y4 DR+", Plane::Xy, [1, 2]),
        ("TOOL CALL Y\nCC\nC X4 DR+", Plane::Zx, [0, 0]),
        // the length of the tool shifts Z, because Z is its axis
        ("TOOL CALL 5 Z\nCC Z1 X2\nC X4 DR+", Plane::Zx, [101, 2]),
    ] {
        let run = run(&format!("L X0 F100\n{program}"));
        let Motion::Arc(arc) = run.moves()[1].motion else {
            panic!("{program}");
        };
        let centre = Centre::Point(centre.map(|value: Nano| value * 1_000_000));
        assert_eq!((arc.plane, arc.centre), (plane, centre), "{program}");
    }
}

#[test]
fn tools_go_by_number_or_name_and_a_call_without_one_changes_what_it_says() {
    let run = run("TOOL CALL \"FR_4\" Z S300 F60\nM4\nTOOL CALL S400\nTOOL CALL DL+1\nL Z0\nTOOL CALL 0\nL Z0");
    assert_eq!(
        run.commands[..3],
        [
            Command::Auxiliary(Auxiliary::ToolChange),
            Command::Auxiliary(Auxiliary::SpindleCounterClockwise(300.0)),
            Command::Auxiliary(Auxiliary::SpindleCounterClockwise(400.0)),
        ]
    );
    let z: Vec<_> = run.moves().iter().map(|step| step.target[2]).collect();
    assert_eq!((z, run.tool()), (vec![101_000_000, 0], None));
}

/// Program 150 (shared `golden/spln150.dat`, misprint of N35 mended): end X Y, I, K3 K2 K1 of X and of Y, as printed.
const G6: [([f64; 2], f64, [[i64; 3]; 2]); 4] = [
    (
        [1.8, 10.2],
        2.663,
        [
            [276_923_492, 49_414_954, -225_794_784],
            [38_297_302, -191_418_244, -167_662_809],
        ],
    ),
    (
        [12.4, 10.3],
        10.6,
        [
            [11_225_893, -25_162_046, -273_457_996],
            [-48_599_505, 123_939_431, -156_045],
        ],
    ),
    (
        [18.9, 12.0],
        6.719,
        [
            [-8_685_768, 11_719_673, -257_627_379],
            [74_242_660, -160_932_804, -35_810_248],
        ],
    ),
    (
        [25.3, 10.8],
        6.512,
        [
            [48_726_705, -147_111_344, -208_476_154],
            [20_702_915, -173_112_563, 160_909_975],
        ],
    ),
];

/// Coefficients of i^3, i^2, i in mm (shared facts 1).
fn scaled([k3, k2, k1]: [i64; 3]) -> [f64; 3] {
    [
        k3 as f64 * 1e6 / 53f64.exp2(),
        k2 as f64 * 1e3 / 41f64.exp2(),
        k1 as f64 / 28f64.exp2(),
    ]
}

#[test]
fn spl_blocks_made_of_g6_blocks_are_the_same_curves() {
    let mut run = run("BEGIN PGM 150 MM\nL X0.3 Y8 F1000");
    let mut start = [0.3, 8.0];
    for (end, length, k) in G6 {
        run.line(format!("SPL X{} Y{}", end[0], end[1]).as_bytes())
            .unwrap();
        for (axis, k) in "XY".chars().zip(k) {
            let [k3, k2, k1] = scaled(k);
            let line = format!(
                "K3{axis}{:e} K2{axis}{:e} K1{axis}{:e} ~",
                k3 * length.powi(3),
                k2 * length.powi(2),
                k1 * length
            );
            run.line(line.as_bytes()).unwrap();
        }
        let step = *run.moves().last().unwrap();
        assert_eq!(step.block, run.line);
        let Motion::Polynomial(Polynomial {
            length: parameter,
            coefficients,
            denominator,
            ..
        }) = step.motion
        else {
            panic!("{step:?}");
        };
        assert_eq!((parameter, denominator), (1.0, [1.0, 0.0, 0.0, 0.0, 0.0]));
        for axis in 0..2 {
            let g6 = |i: f64| {
                let [k3, k2, k1] = scaled(k[axis]);
                end[axis] + i * (k1 + i * (k2 + i * k3))
            };
            let gap = start[axis] - g6(length);
            assert!(gap.abs() < 5e-4);
            let [a2, a3, a4, a5] = coefficients[axis];
            assert_eq!((a4, a5), (0.0, 0.0));
            let a1 = end[axis] - start[axis] - a2 - a3;
            for percent in 0..=100 {
                let p = f64::from(percent) / 100.0;
                let got = start[axis] + p * (a1 + p * (a2 + p * a3));
                let expected = g6(length * (1.0 - p)) + gap * (1.0 - p);
                assert!((got - expected).abs() < 1e-9, "{got} {expected}");
            }
        }
        assert_eq!(coefficients[2..], [[0.0; 4]; 3]);
        start = end;
    }
    assert!(!run.reader.forget());
}

#[test]
fn a_spline_may_miss_its_start_by_a_micrometre_and_no_more() {
    for (x, good) in [
        (1.001, true),
        (0.999, true),
        (1.0011, false),
        (0.9989, false),
    ] {
        let mut run = run("L X0 Y0 F100");
        let line = format!("SPL X-{x} K3X.25 K2X.25 K1X.5");
        let result = run
            .line(line.as_bytes())
            .map_err(|error| (error.0, error.1));
        let expected = (dialect::H_SPLINE_GAP.code, 5);
        assert_eq!(result, if good { Ok(false) } else { Err(expected) }, "{x}");
    }
    // the printed example of the manual closes within 0.001
    run("L X+28.338 Y+19.385 Z-0.5 FMAX\nSPL X24.875 Y15.924 Z-0.5 K3X-4.688E-002 K2X2.459E-002 K1X3.486E+000 ~
K3Y-4.563E-002 K2Y2.155E-002 K1Y3.486E+000 ~\nK3Z0 K2Z0 K1Z0 F10000");
}

#[test]
fn an_open_spline_waits_for_nothing_but_its_coefficients() {
    let mut run = run("L X1 Y1 F100\nSPL X0 Y0 K1X1 K2X0 M8");
    let missing = Err(dialect::H_SPLINE_WORDS.code);
    for line in [
        "L X5",
        "END PGM A MM",
        "TOOL CALL 5 Z",
        "SPL X1",
        "CC",
        "STOP",
    ] {
        assert_eq!(run.line(line.as_bytes()).map_err(|error| error.0), missing);
    }
    for (line, message) in [
        ("K1X2", &nc::REPEATED_WORD),
        ("K1Z2", &dialect::H_COEFFICIENT),
        ("K3X1E6", &dialect::H_COEFFICIENT),
        ("FMAX", &nc::UNEXPECTED_WORD),
    ] {
        let result = run.line(line.as_bytes()).map_err(|error| error.0);
        assert_eq!(result, Err(message.code), "{line}");
    }
    for line in ["", "; text", "K3X0", "F300 M5", "K1Y1K2Y0", "K3Y0"] {
        run.line(line.as_bytes()).unwrap();
    }
    use Auxiliary::{CoolantOn, SpindleStop};
    let tail = &run.commands[1..];
    assert_eq!(tail.len(), 3);
    assert_eq!(
        (tail[0], tail[2]),
        (
            Command::Auxiliary(CoolantOn),
            Command::Auxiliary(SpindleStop)
        )
    );
    assert_eq!(run.moves()[1].feed, 5.0);
    run.line(b"SPL X1").unwrap();
    assert!(run.reader.forget() && !run.reader.forget());
}

#[test]
fn the_end_of_a_program_comes_once_and_forgets_the_modal_state() {
    for (program, ends) in [
        ("BEGIN PGM A MM\nL X1 F1\nEND PGM A MM", 1),
        ("BEGIN PGM A MM\nL X1 F1 M30\nEND PGM A MM", 1),
        ("BEGIN PGM A MM\nL X1 F1\nM2\nEND PGM A MM", 1),
        ("END PGM A MM", 0),
    ] {
        let mut run = run(program);
        let count = |command: &&Command| **command == Command::ProgramEnd;
        assert_eq!(run.commands.iter().filter(count).count(), ends, "{program}");
        let result = run.line(b"L X2").map_err(|error| error.0);
        assert_eq!(result, Err(nc::MISSING_FEED.code));
    }
    let mut run = run("L X1 F1");
    assert_eq!(run.line(b"M30"), Ok(true));
    assert_eq!(run.line(b"END PGM A MM"), Ok(false));
}

#[test]
fn what_is_wrong_is_refused_by_name_and_column() {
    let many = format!("L X{}", "1".repeat(100));
    let rows: [(&str, &Message, u16); 48] = [
        (&many, &nc::LINE_TOO_LONG, 97),
        ("L B+5", &nc::AXIS_NOT_CONFIGURED, 3),
        ("L IU+5", &nc::AXIS_NOT_CONFIGURED, 3),
        ("L X", &nc::MISSING_NUMBER, 3),
        ("L X+-1", &nc::MALFORMED_NUMBER, 4),
        ("L X12345678901234567890", &nc::TOO_MANY_DIGITS, 4),
        ("L X1 X2", &nc::REPEATED_WORD, 6),
        ("L X1 IX2", &nc::REPEATED_WORD, 6),
        ("L X100001", &nc::OUT_OF_RANGE, 3),
        ("L X1 Q5", &nc::UNKNOWN_WORD, 6),
        ("L X1 #", &nc::UNEXPECTED_BYTE, 6),
        ("L X1 R5", &nc::UNKNOWN_WORD, 6),
        ("L X1 R0 RL", &nc::REPEATED_WORD, 9),
        ("L X1 RL", &dialect::H_NO_TOOL, 6),
        ("L X1 F0", &nc::FEED_NOT_POSITIVE, 6),
        ("L X1 F1E9", &nc::OUT_OF_RANGE, 6),
        ("L X1 FAUTO", &nc::MISSING_NUMBER, 6),
        ("7 L X1", &nc::MISSING_FEED, 3),
        ("L X1 DR+", &nc::UNEXPECTED_WORD, 6),
        ("L X1 K3X1", &nc::UNEXPECTED_WORD, 6),
        ("L M7", &nc::M_NOT_AVAILABLE, 3),
        ("M99", &nc::M_NOT_AVAILABLE, 1),
        ("M3 M4", &nc::SAME_GROUP, 4),
        ("M3 M3", &nc::REPEATED_WORD, 4),
        ("K3X1", &dialect::H_COEFFICIENT, 1),
        ("LBL 1", &dialect::H_STATEMENT, 1),
        ("12 CYCL DEF 200", &dialect::H_STATEMENT, 4),
        ("LP PR+5", &dialect::H_STATEMENT, 1),
        ("APPR LT", &dialect::H_STATEMENT, 1),
        ("TOOL DEF 5", &dialect::H_STATEMENT, 1),
        ("BEGIN PGM A", &dialect::H_PROGRAM, 1),
        ("CC X1", &dialect::H_CENTRE, 1),
        ("CC X1 Y1 Z1", &dialect::H_CENTRE, 1),
        ("CC X1 A1", &dialect::H_CENTRE, 1),
        ("C X1 DR+ F1", &dialect::H_NO_CENTRE, 1),
        ("CR X1 R5 F1", &dialect::H_DIRECTION, 1),
        ("CR X1 DR+ F1", &dialect::H_RADIUS, 1),
        ("CR X1 R+0.0 DR+ F1", &dialect::H_RADIUS, 7),
        ("CR X1 R5 DR+ FMAX", &nc::UNEXPECTED_WORD, 14),
        ("SPL K3X1", &dialect::H_SPLINE_AXES, 1),
        ("SPL X1 K4X1", &nc::UNKNOWN_WORD, 8),
        ("SPL X1 K3B1", &dialect::H_COEFFICIENT, 8),
        ("TOOL CALL 6 Z", &nc::UNKNOWN_TOOL, 11),
        ("TOOL CALL \"FR_\" Z", &nc::UNKNOWN_TOOL, 11),
        ("TOOL CALL \"FR_4 Z", &nc::UNCLOSED_STRING, 11),
        ("TOOL CALL \"\" Z", &nc::TOOL_NAME, 11),
        ("TOOL CALL 5 Z Q1", &dialect::H_TOOL_CALL, 15),
        ("TOOL CALL 5 Z DR-3", &nc::OUT_OF_RANGE, 15),
    ];
    for (line, message, column) in rows {
        let error = Run::new().line(line.as_bytes()).unwrap_err();
        assert_eq!(
            (error.0, error.1),
            (message.code, column),
            "{line}: {}",
            error.2
        );
        assert!(
            !error.2.contains("''") && !error.2.contains("{}"),
            "{}",
            error.2
        );
    }
}

proptest! {
    #[test]
    fn no_bytes_do_harm(lines in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..110), 0..6)) {
        let mut run = Run::new();
        for line in &lines {
            let _ = run.line(line);
        }
    }

    #[test]
    fn no_soup_of_its_own_words_does_harm(
        lines in prop::collection::vec(
            prop::collection::vec(
                prop::sample::select(vec![
                    "L", "CC", "C", "CR", "SPL", "X+1", "Y-2", "IZ.5", "A9", "C1", "R0", "RL", "R5", "DR+", "DR-", "F100",
                    "FMAX", "M3", "M30", "STOP", "TOOL CALL", "5", "\"FR_4\"", "Z", "S100", "K3X", "K2X0", "K1X1", "K3X0",
                    "END PGM", "BEGIN PGM MM", "~", ";", "-", "E99", "DL", "99999999",
                ]),
                0..9,
            ),
            0..12,
        )
    ) {
        let mut run = Run::new();
        for line in &lines {
            let _ = run.line(line.join(" ").as_bytes());
        }
    }
}
