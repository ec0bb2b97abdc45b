//! Laws of the machine file: printed values, refusals at their place, and one reading for simulator and image.

use super::*;

fn refusal(from: &str, to: &str) -> String {
    assert!(BUILT_IN.contains(from), "{from}");
    let text = BUILT_IN.replacen(from, to, 1);
    match Machine::parse("test.toml", &text) {
        Ok(_) => panic!("accepted {to}"),
        Err(failure) => {
            assert_eq!(failure.exit, Exit::Usage);
            failure.render()
        }
    }
}

#[test]
fn the_built_in_machine_has_the_printed_values() {
    let machine = Machine::built_in().unwrap();
    let config = &machine.config;
    assert_eq!(config.name, "MCV 1210");
    let letters: Vec<u8> = config.axes.iter().map(|a| a.letter).collect();
    assert_eq!(letters, b"XYZAC");
    // 1000 x 800 x 600 mm, +-115, +-200 degrees (thesis, Table 3.1.1).
    let travel: Vec<i64> = config
        .axes
        .iter()
        .map(|a| a.travel_max - a.travel_min)
        .collect();
    assert_eq!(
        travel,
        [
            1_000_000_000,
            800_000_000,
            600_000_000,
            230_000_000,
            400_000_000
        ]
    );
    assert_eq!(config.axes[0].steps_per_unit, 1000);
    assert_eq!(config.axes[3].v_max, 1.0);
    assert!((config.axes[0].v_max - 40_000.0 / 60.0).abs() < 1e-3);
    assert_eq!(config.starve_ticks, 1500);
    // One slot is 1 / (5000 * 560) s = 357 ns: 700 ns need two, 1400 ns four.
    assert_eq!((config.pulse_slots, config.dir_setup_slots), (2, 4));
    assert!(config.default_soft);
    assert_eq!(machine.plant.axes[2].kv_per_s, 100.0);
    assert_eq!(machine.plant.axes[4].kv_per_s, 60.0);
}

#[test]
fn slots_cover_the_whole_time_asked_for() {
    for ns in [0_u32, 1, 357, 358, 700, 714, 715, 1400, 10_000] {
        let text = BUILT_IN.replacen("dir_setup_ns = 1400", &format!("dir_setup_ns = {ns}"), 1);
        let slots = u64::from(Machine::parse("t", &text).unwrap().config.dir_setup_slots);
        let slot_ns = 1e9 / (5000.0 * 560.0);
        assert!(slots as f64 * slot_ns >= f64::from(ns) - 1e-9);
        assert!(slots == 0 || (slots - 1) as f64 * slot_ns < f64::from(ns));
    }
}

#[test]
fn a_wrong_value_is_refused_at_its_place() {
    let shown = refusal("v_max = 1.0", "v_max = -1.0");
    assert!(
        shown.contains("v_max out of range") && shown.contains("v_max = -1.0"),
        "{shown}"
    );
    assert!(refusal("name = \"A\"", "name = \"N\"").contains("not an axis letter"));
    assert!(refusal("name = \"C\"", "name = \"A\"").contains("axis letter used twice"));
    assert!(refusal("kind = \"rotary\"", "kind = \"round\"").contains("unknown kind"));
    assert!(refusal("\"soft\"", "\"hard\"").contains("unknown dynamics"));
    assert!(refusal("[-115.0, 115.0]", "[115.0, -115.0]").contains("travel is empty"));
    assert!(refusal("[-115.0, 115.0]", "[-115.0, nan]").contains("travel is empty"));
    assert!(refusal("[-115.0, 115.0]", "[-115.0, 3e9]").contains("position out of range"));
    assert!(refusal("v_max = 666.6667", "v_max = 6666.6667")
        .contains("more steps than the port can give"));
    // What the integers of a tick hold: 0.8 mm, 1/40 mm per tick.
    assert!(refusal(
        "steps_per_unit = 1000.0     # 1 um per step\nv_max = 666.6667",
        "steps_per_unit = 10.0\nv_max = 4001.0"
    )
    .contains("this servo rate reaches 4000.000"));
    assert!(refusal("a_max = 5000.0", "a_max = 625001.0")
        .contains("this servo rate reaches 625000.000"));
    assert!(refusal("servo_hz = 5000", "servo_hz = 0").contains("servo_hz out of range"));
    assert!(refusal("servo_hz = 5000", "servo_hz = 5000\nspeed = 1").contains("unknown field"));
    assert!(refusal("pulse_width_ns = 700", "pulse_width_ns = 700000").contains("time too long"));
    assert!(
        refusal("feed_forward = 0.98", "feed_forward = 1.98").contains("feed_forward out of range")
    );
    assert!(refusal("[plant.rotary]", "[plant.rotary2]").contains("unknown field"));
}

#[test]
fn four_axes_are_refused() {
    let end = BUILT_IN.rfind("[[axis]]").unwrap();
    let plant = BUILT_IN.find("[plant.linear]").unwrap();
    let text = format!("{}{}", &BUILT_IN[..end], &BUILT_IN[plant..]);
    assert!(Machine::parse("t", &text)
        .unwrap_err()
        .render()
        .contains("4 axes given"));
}

#[test]
fn integers_are_accepted_where_numbers_are_meant() {
    let text = BUILT_IN.replacen("steps_per_unit = 1000.0", "steps_per_unit = 1000", 1);
    assert_eq!(
        Machine::parse("t", &text).unwrap().config.axes[0].steps_per_unit,
        1000
    );
}

/// The generator of the image's configuration, which reads the same file with other means.
#[allow(dead_code)]
#[path = "../../../firmware/build.rs"]
mod build;

/// What the generator is to write for `config`: the fields in their order, floats as their bits.
fn image_code(config: &Config) -> String {
    let bits = |x: f32| format!("f32::from_bits({:#010x})", x.to_bits());
    let axes: String = config
        .axes
        .iter()
        .map(|axis| {
            format!(
                "AxisConfig {{ letter: {}, kind: AxisKind::{:?}, steps_per_unit: Steps::from_bits({}), v_max: {}, \
                 a_max: {}, j_max: {}, corner_step: {}, rounding_tolerance: {}, travel_min: {}, travel_max: {}, }},",
                axis.letter,
                axis.kind,
                axis.steps_per_unit.to_bits(),
                bits(axis.v_max),
                bits(axis.a_max),
                bits(axis.j_max),
                bits(axis.corner_step),
                bits(axis.rounding_tolerance),
                axis.travel_min,
                axis.travel_max
            )
        })
        .collect();
    let tools: String = config
        .tools
        .iter()
        .map(|tool| {
            if tool.number == 0 {
                return "ToolData::FREE,".to_owned();
            }
            format!("{tool:?},")
        })
        .collect();
    format!(
        "Config {{ name: {:?}, axes: [ {axes} ], servo_hz: {}, pulse_slots: {}, dir_setup_slots: {}, \
         zero_offsets: {:?}, reference_point: {:?}, fixed_point: {:?}, tools: [ {tools} ], head: Head::{:?}, \
         dialect: Dialect::{:?}, plane: Plane::{:?}, spline_begin: BoundaryCondition::{:?}, \
         spline_end: BoundaryCondition::{:?}, arc_tolerance: {}, curve_tolerance: {}, contour_tolerance: {}, \
         default_feed: {}, default_soft: {}, starve_ticks: {}, }} }}",
        config.name,
        config.servo_hz,
        config.pulse_slots,
        config.dir_setup_slots,
        config.zero_offsets,
        config.reference_point,
        config.fixed_point,
        config.head,
        config.dialect,
        config.plane,
        config.spline_begin,
        config.spline_end,
        bits(config.arc_tolerance),
        bits(config.curve_tolerance),
        bits(config.contour_tolerance),
        bits(config.default_feed),
        config.default_soft,
        config.starve_ticks
    )
}

/// Every key that is not obligatory, with a value that is not its default.
fn file_with_every_key() -> String {
    let top = "arc_tolerance = 0.02\ncurve_tolerance = 0.0003\ncontour_tolerance = 0.07\ndialect = \"fanuc\"\n\
               plane = \"G18\"\nspline_begin = \"BTAN\"\nspline_end = \"EAUTO\"\nhead = \"none\"\n\n[[axis]]\nname = \"X\"";
    let tools =
        "[[tool]]\nnumber = 12\nradius = 0.1\n\n[[tool]]\nnumber = 7\nname = \"Ball 3 (long)\"\n\
                 radius = 1.5\nlength = 0.1234567\n\n[plant.linear]";
    let mut text = BUILT_IN
        .replacen("head = \"CA\"", "# head", 1)
        .replacen("[[axis]]\nname = \"X\"", top, 1)
        .replacen("[plant.linear]", tools, 1);
    for (from, to) in [
        ("[-500.0, 500.0]", "zero_offset = 1.1"),
        (
            "[-400.0, 400.0]",
            "zero_offset = [0, -2.2]\nreference_point = 400",
        ),
        (
            "[-300.0, 300.0]",
            "zero_offset = [0.1, 0.2, 0.3, 0.7]\nfixed_point = -12.3456789",
        ),
        ("[-115.0, 115.0]", "reference_point = -0.1\nfixed_point = 7"),
    ] {
        assert!(text.contains(from));
        text = text.replacen(
            &format!("travel = {from}"),
            &format!("{to}\ntravel = {from}"),
            1,
        );
    }
    text
}

#[test]
fn simulator_and_image_read_the_same_configuration_bit_for_bit() {
    let folder = std::env::temp_dir().join(format!("machine-file-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join("machine.toml");
    let xyzbc = include_str!("../../../machines/xyzbc.toml").to_owned();
    for text in [BUILT_IN.to_owned(), xyzbc, file_with_every_key()] {
        let config = Machine::parse("t", &text).unwrap().config;
        std::fs::write(&file, &text).unwrap();
        let code = build::generate(&file).unwrap();
        let code = &code[code.find("Config {\n").unwrap()..];
        let flat = |text: &str| {
            text.split_whitespace()
                .collect::<String>()
                .replace(",}", "}")
        };
        assert_eq!(flat(code), flat(&image_code(&config)));
    }
    let _ = std::fs::remove_dir_all(&folder);
}

#[test]
fn every_key_of_the_language_reaches_the_configuration() {
    use pentaspline::config::{Dialect, Head, ToolData};
    use pentaspline::nc::command::{BoundaryCondition, Plane};

    let config = Machine::parse("t", &file_with_every_key()).unwrap().config;
    assert_eq!(
        config.zero_offsets,
        [
            [1_100_000, 0, 100_000, 0, 0],
            [0, -2_200_000, 200_000, 0, 0],
            [0, 0, 300_000, 0, 0],
            [0, 0, 700_000, 0, 0]
        ]
    );
    assert_eq!(config.reference_point, [0, 400_000_000, 0, -100_000, 0]);
    assert_eq!(config.fixed_point, [0, 0, -12_345_679, 7_000_000, 0]);
    assert_eq!(
        (config.head, config.dialect, config.plane),
        (Head::None, Dialect::Fanuc, Plane::Zx)
    );
    assert_eq!(config.spline_begin, BoundaryCondition::Tangent);
    assert_eq!(config.spline_end, BoundaryCondition::NotAKnot);
    assert_eq!(
        [
            config.arc_tolerance,
            config.curve_tolerance,
            config.contour_tolerance
        ],
        [0.02, 0.0003, 0.07]
    );
    let [fr4, first, second, free, ..] = config.tools;
    assert_eq!(
        (fr4.number, &fr4.name[..5], fr4.radius, fr4.length),
        (1, b"FR_4\0".as_slice(), 2_000_000, 0)
    );
    assert_eq!(
        (first.number, first.name, first.radius),
        (12, [0; 16], 100_000)
    );
    assert_eq!(
        (&second.name[..13], second.length),
        (b"Ball 3 (long)".as_slice(), 123_457)
    );
    assert_eq!(free, ToolData::FREE);
}

#[test]
fn what_a_file_leaves_out_has_its_documented_default() {
    use pentaspline::config::{Dialect, Head, ToolData, TOOLS, ZERO_OFFSETS};
    use pentaspline::nc::command::{BoundaryCondition, Plane};

    let tool = BUILT_IN.find("[[tool]]").unwrap();
    let plant = BUILT_IN.find("[plant.linear]").unwrap();
    let text = format!("{}{}", &BUILT_IN[..tool], &BUILT_IN[plant..]);
    let text = text.replacen("head = \"CA\"", "# head", 1);
    let config = Machine::parse("t", &text).unwrap().config;
    assert_eq!(config.tools, [ToolData::FREE; TOOLS]);
    assert_eq!(config.zero_offsets, [[0; AXES]; ZERO_OFFSETS]);
    assert_eq!(
        (config.reference_point, config.fixed_point),
        ([0; AXES], [0; AXES])
    );
    assert_eq!(
        (config.head, config.dialect, config.plane),
        (Head::CA, Dialect::Sinumerik, Plane::Xy)
    );
    let natural = BoundaryCondition::Natural;
    assert_eq!((config.spline_begin, config.spline_end), (natural, natural));
    assert_eq!(
        [
            config.arc_tolerance,
            config.curve_tolerance,
            config.contour_tolerance
        ],
        [0.01, 1.0e-4, 0.05]
    );
    // A head that nobody names is taken for granted only where its axes are.
    let text = text.replacen("name = \"A\"", "name = \"B\"", 1);
    assert_eq!(Machine::parse("t", &text).unwrap().config.head, Head::None);
}

#[test]
fn a_wrong_key_of_the_language_is_refused_at_its_place() {
    let tool = |text: &str| {
        refusal(
            "[plant.linear]",
            &format!("[[tool]]\n{text}\n[plant.linear]"),
        )
    };
    let axis = |text: &str| {
        refusal(
            "travel = [-500.0, 500.0]",
            &format!("travel = [-500.0, 500.0]\n{text}"),
        )
    };
    let top = |text: &str| refusal("servo_hz", &format!("{text}\nservo_hz"));
    let shown = tool("number = 2\nname = \"fr_4\"\nradius = 1");
    assert!(
        shown.contains("tool name used twice") && shown.contains("name = \"fr_4\""),
        "{shown}"
    );
    assert!(tool("number = 1\nradius = 1").contains("tool number used twice"));
    assert!(tool("number = 0\nradius = 1").contains("tool number out of range"));
    assert!(tool("number = 2\nradius = -1").contains("radius out of range"));
    assert!(tool("number = 2\nradius = nan").contains("radius out of range"));
    assert!(tool("number = 2\nradius = 1\nlength = 1e5").contains("length out of range"));
    for name in ["", "seventeen letters", "a\\\"b", "\u{e9}"] {
        let shown = tool(&format!("number = 2\nradius = 1\nname = \"{name}\""));
        assert!(shown.contains("not a tool name"), "{shown}");
    }
    let many: String = (2..18)
        .map(|n| format!("[[tool]]\nnumber = {n}\nradius = 1\n"))
        .collect();
    assert!(refusal("[plant.linear]", &format!("{many}[plant.linear]")).contains("too many tools"));
    assert!(axis("zero_offset = [1, 2, 3, 4, 5]").contains("too many zero offsets"));
    assert!(axis("zero_offset = 3e9").contains("position out of range"));
    assert!(axis("zero_offset = \"G55\"").contains("does not parse"));
    assert!(axis("fixed_point = 500.1").contains("outside the travel"));
    assert!(axis("reference_point = nan").contains("position out of range"));
    assert!(refusal("head = \"CA\"", "head = \"CB\"").contains("axes the machine does not have"));
    assert!(refusal("head = \"CA\"", "head = \"BC\"").contains("unknown head"));
    assert!(top("dialect = \"Okuma\"").contains("\"heidenhain\""));
    assert!(top("plane = \"XY\"").contains("unknown plane"));
    assert!(top("spline_begin = \"ENAT\"").contains("unknown spline_begin"));
    assert!(top("spline_end = \"BNAT\"").contains("unknown spline_end"));
    assert!(top("curve_tolerance = 0").contains("curve_tolerance out of range"));
    assert!(top("arc_tolerance = -0.1").contains("arc_tolerance out of range"));
}
