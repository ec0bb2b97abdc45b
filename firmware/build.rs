//! Turns a machine file into the configuration an image carries, and tells the linker where memory is.
//!
//! In: `machines/mcv1210.toml`, or the file that `PENTASPLINE_MACHINE` names. Out: `machine.rs`, one Rust
//! expression of type `pentaspline::config::Config`, floats and fixed-point numbers as bit patterns so that
//! nothing is rounded a second time. Every conversion is the one the simulator does when it reads the same
//! file: f64 arithmetic, one rounding at the end.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::{env, fs};

use toml::{Table, Value};

/// Slots of a step frame; the same number as `stepgen::SLOTS`, which the generated code checks.
const SLOTS: u64 = 560;
/// Rows of the tool table; the same number as `config::TOOLS`, which the generated code checks.
const TOOLS: usize = 16;

fn main() {
    let manifest = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("cargo sets it"));
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets it"));
    let root = manifest
        .parent()
        .expect("the package lies in the workspace");

    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-env-changed=PENTASPLINE_MACHINE");
    let machine = match env::var_os("PENTASPLINE_MACHINE") {
        Some(path) => root.join(path),
        None => root.join("machines/mcv1210.toml"),
    };
    println!("cargo:rerun-if-changed={}", machine.display());
    let code = match generate(&machine) {
        Ok(code) => code,
        Err(why) => {
            println!("cargo:warning={}: {why}", machine.display());
            std::process::exit(1);
        }
    };
    fs::write(out.join("machine.rs"), code).expect("OUT_DIR is writable");

    if env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
        let memory = root.join("memory.x");
        println!("cargo:rerun-if-changed={}", memory.display());
        fs::copy(&memory, out.join("memory.x"))
            .expect("memory.x stands at the top of the workspace");
        println!("cargo:rustc-link-search={}", out.display());
        println!("cargo:rustc-link-arg-bins=--nmagic");
        println!("cargo:rustc-link-arg-bins=-Tlink.x");
        if env::var_os("CARGO_FEATURE_DEFMT").is_some() {
            println!("cargo:rustc-link-arg-bins=-Tdefmt.x");
        }
    }
}

/// Reads the machine file; the error names the key that is missing or wrong.
pub(crate) fn generate(path: &Path) -> Result<String, String> {
    let text = fs::read_to_string(path).map_err(|e| e.to_string())?;
    let file: Table = text.parse().map_err(|e: toml::de::Error| e.to_string())?;
    let servo_hz = file
        .get("servo_hz")
        .and_then(Value::as_integer)
        .and_then(|hz| u32::try_from(hz).ok())
        .filter(|&hz| hz > 0)
        .ok_or("servo_hz: a positive integer")?;
    let slots = |key| -> Result<u64, String> {
        // Rounded up: a pulse may be longer than asked for, never shorter.
        let slots = (integer(&file, key)? * u64::from(servo_hz) * SLOTS).div_ceil(1_000_000_000);
        if slots < SLOTS / 2 {
            Ok(slots)
        } else {
            Err(format!("{key}: {slots} slots of {SLOTS} per tick"))
        }
    };
    let axes = file
        .get("axis")
        .and_then(Value::as_array)
        .filter(|axes| axes.len() == 5)
        .ok_or("axis: five tables")?;

    let mut code = String::new();
    let w = &mut code;
    put(w, "{\n");
    put(
        w,
        "use crate::config::{AxisConfig, AxisKind, Config, Dialect, Head, ToolData, TOOLS};\n",
    );
    put(w, "use crate::nc::command::{BoundaryCondition, Plane};\n");
    put(w, "use crate::units::Steps;\n");
    put(
        w,
        &format!("const _: () = assert!(crate::stepgen::SLOTS == {SLOTS});\n"),
    );
    put(w, &format!("const _: () = assert!(TOOLS == {TOOLS});\n"));
    put(w, "Config {\n");
    put(w, &format!("name: {:?},\n", string(&file, "name")?));
    put(w, "axes: [\n");
    for axis in axes {
        let axis = axis.as_table().ok_or("axis: a table")?;
        put(w, &axis_code(axis)?);
    }
    put(w, "],\n");
    put(w, &format!("servo_hz: {servo_hz},\n"));
    put(
        w,
        &format!("pulse_slots: {},\n", slots("pulse_width_ns")?.max(1)),
    );
    put(
        w,
        &format!("dir_setup_slots: {},\n", slots("dir_setup_ns")?),
    );
    put(w, &language_code(&file, axes)?);
    put(
        w,
        &format!(
            "default_feed: {},\n",
            single(number(&file, "default_feed")? / 60.0)
        ),
    );
    let soft = match string(&file, "dynamics")?.as_str() {
        "soft" => true,
        "brisk" => false,
        other => return Err(format!("dynamics: \"soft\" or \"brisk\", not {other:?}")),
    };
    put(w, &format!("default_soft: {soft},\n"));
    let starve = (integer(&file, "starve_ms")? * u64::from(servo_hz)).div_ceil(1000);
    put(w, &format!("starve_ticks: {starve},\n"));
    put(w, "}\n}\n");
    Ok(code)
}

/// Everything that says how programs are read; what the file leaves out has the value `docs/machine-file.md` names.
fn language_code(file: &Table, axes: &[Value]) -> Result<String, String> {
    let mut offsets = [[0; 5]; 4];
    let mut points = [[0; 5]; 2];
    for (index, axis) in axes.iter().enumerate() {
        let values = match axis.get("zero_offset") {
            None => Vec::new(),
            Some(value) => float(value)
                .map(|one| vec![one])
                .or_else(|| floats(value))
                .filter(|values| values.len() <= offsets.len())
                .ok_or("zero_offset: a number, or up to four")?,
        };
        for (row, value) in offsets.iter_mut().zip(values) {
            row[index] = nano(value);
        }
        for (row, key) in points.iter_mut().zip(["reference_point", "fixed_point"]) {
            if let Some(value) = axis.get(key) {
                row[index] = nano(float(value).ok_or(format!("{key}: a number"))?);
            }
        }
    }
    let mut code = String::new();
    let w = &mut code;
    put(w, &format!("zero_offsets: {offsets:?},\n"));
    put(w, &format!("reference_point: {:?},\n", points[0]));
    put(w, &format!("fixed_point: {:?},\n", points[1]));
    put(w, &tools_code(file)?);
    let has_rotary = |letter: &str| {
        axes.iter().any(|axis| {
            let text = |key| axis.get(key).and_then(Value::as_str);
            text("name") == Some(letter) && text("kind") == Some("rotary")
        })
    };
    let ca = has_rotary("C") && has_rotary("A");
    let heads = [("none", "None"), ("CA", "CA"), ("CB", "CB")];
    let head = choice(file, "head", &heads, if ca { "CA" } else { "None" })?;
    put(w, &format!("head: Head::{head},\n"));
    let dialects = [
        ("sinumerik", "Sinumerik"),
        ("fanuc", "Fanuc"),
        ("heidenhain", "Heidenhain"),
    ];
    let dialect = choice(file, "dialect", &dialects, "Sinumerik")?;
    put(w, &format!("dialect: Dialect::{dialect},\n"));
    let planes = [("G17", "Xy"), ("G18", "Zx"), ("G19", "Yz")];
    let plane = choice(file, "plane", &planes, "Xy")?;
    put(w, &format!("plane: Plane::{plane},\n"));
    for (key, end) in [("spline_begin", 'B'), ("spline_end", 'E')] {
        let words = ["AUTO", "NAT", "TAN"].map(|word| format!("{end}{word}"));
        let conditions = [
            (words[0].as_str(), "NotAKnot"),
            (words[1].as_str(), "Natural"),
            (words[2].as_str(), "Tangent"),
        ];
        let condition = choice(file, key, &conditions, "Natural")?;
        put(w, &format!("{key}: BoundaryCondition::{condition},\n"));
    }
    for (key, default) in [
        ("arc_tolerance", 0.01_f64),
        ("curve_tolerance", 1.0e-4),
        ("contour_tolerance", 0.05),
    ] {
        let value = match file.get(key) {
            None => default,
            Some(value) => float(value).ok_or(format!("{key}: a number"))?,
        };
        put(w, &format!("{key}: {},\n", single(value)));
    }
    Ok(code)
}

/// The tool table: the `[[tool]]` tables in their order, then free rows.
fn tools_code(file: &Table) -> Result<String, String> {
    let empty = Vec::new();
    let tools = match file.get("tool") {
        None => &empty,
        Some(value) => value.as_array().ok_or("tool: tables [[tool]]")?,
    };
    if tools.len() > TOOLS {
        return Err(format!("tool: {TOOLS} tables at most"));
    }
    let mut code = "tools: [\n".to_owned();
    let w = &mut code;
    for tool in tools {
        let tool = tool.as_table().ok_or("tool: a table")?;
        let mut name = [0; 16];
        if tool.contains_key("name") {
            let text = string(tool, "name")?;
            if text.is_empty() || text.len() > name.len() {
                return Err(format!("tool name {text:?}: 1 to {} bytes", name.len()));
            }
            name[..text.len()].copy_from_slice(text.as_bytes());
        }
        let number_of = integer(tool, "number")?;
        let radius = nano(number(tool, "radius")?);
        let length = match tool.contains_key("length") {
            true => nano(number(tool, "length")?),
            false => 0,
        };
        put(
            w,
            &format!(
                "ToolData {{ number: {number_of}, name: {name:?}, radius: {radius}, length: {length} }},\n"
            ),
        );
    }
    for _ in tools.len()..TOOLS {
        put(w, "ToolData::FREE,\n");
    }
    put(w, "],\n");
    Ok(code)
}

/// Rust name of what the file says under `key`, or `default` if it says nothing.
fn choice<'a>(
    file: &Table,
    key: &str,
    choices: &[(&str, &'a str)],
    default: &'a str,
) -> Result<&'a str, String> {
    let Some(value) = file.get(key) else {
        return Ok(default);
    };
    let found = choices
        .iter()
        .find(|(text, _)| value.as_str() == Some(*text));
    found.map(|(_, name)| *name).ok_or_else(|| {
        let names: Vec<&str> = choices.iter().map(|(text, _)| *text).collect();
        format!("{key}: one of {}", names.join(", "))
    })
}

fn axis_code(axis: &Table) -> Result<String, String> {
    let name = string(axis, "name")?;
    let [letter] = name.as_bytes() else {
        return Err(format!("axis name {name:?}: one letter"));
    };
    let kind = match string(axis, "kind")?.as_str() {
        "linear" => "Linear",
        "rotary" => "Rotary",
        other => return Err(format!("kind: \"linear\" or \"rotary\", not {other:?}")),
    };
    let travel = axis
        .get("travel")
        .and_then(floats)
        .filter(|t| t.len() == 2)
        .ok_or("travel: two numbers")?;
    let steps = (number(axis, "steps_per_unit")? * 4_294_967_296.0).round_ties_even() as i64;
    let mut code = String::new();
    let w = &mut code;
    put(w, "AxisConfig {\n");
    put(w, &format!("letter: {},\n", letter.to_ascii_uppercase()));
    put(w, &format!("kind: AxisKind::{kind},\n"));
    put(w, &format!("steps_per_unit: Steps::from_bits({steps}),\n"));
    for key in ["v_max", "a_max", "j_max", "corner_step"] {
        put(w, &format!("{key}: {},\n", single(number(axis, key)?)));
    }
    let tolerance = match axis.get("rounding_tolerance") {
        Some(value) => single(float(value).ok_or("rounding_tolerance: a number")?),
        None => "crate::config::ROUNDING_TOLERANCE".to_owned(),
    };
    put(w, &format!("rounding_tolerance: {tolerance},\n"));
    put(w, &format!("travel_min: {},\n", nano(travel[0])));
    put(w, &format!("travel_max: {},\n", nano(travel[1])));
    put(w, "},\n");
    Ok(code)
}

fn put(out: &mut String, text: &str) {
    out.write_str(text).expect("writing to a String");
}

/// A float as its bits: `f64` to `f32` is the one rounding.
fn single(value: f64) -> String {
    format!("f32::from_bits({:#010x})", (value as f32).to_bits())
}

/// mm or degree to 1e-6 of it.
fn nano(value: f64) -> i64 {
    (value * 1e6).round() as i64
}

fn number(table: &Table, key: &str) -> Result<f64, String> {
    table
        .get(key)
        .and_then(float)
        .ok_or(format!("{key}: a number"))
}

fn integer(table: &Table, key: &str) -> Result<u64, String> {
    let value = table.get(key).and_then(Value::as_integer);
    let value = value.and_then(|n| u32::try_from(n).ok());
    value
        .map(u64::from)
        .ok_or(format!("{key}: an integer, not negative"))
}

fn string(table: &Table, key: &str) -> Result<String, String> {
    let text = table.get(key).and_then(Value::as_str);
    text.map(str::to_owned).ok_or(format!("{key}: a string"))
}

fn floats(value: &Value) -> Option<Vec<f64>> {
    value.as_array()?.iter().map(float).collect()
}

fn float(value: &Value) -> Option<f64> {
    match value {
        Value::Float(x) => Some(*x),
        Value::Integer(n) => Some(*n as f64),
        _ => None,
    }
}
