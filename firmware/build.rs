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
fn generate(path: &Path) -> Result<String, String> {
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
    let mut offsets = [0; 5];
    for (offset, axis) in offsets.iter_mut().zip(axes) {
        if let Some(value) = axis.get("zero_offset") {
            *offset = nano(float(value).ok_or("zero_offset: a number")?);
        }
    }
    put(
        w,
        &format!("zero_offsets: [{offsets:?}, [0; 5], [0; 5], [0; 5]],\n"),
    );
    put(
        w,
        "reference_point: [0; 5],\nfixed_point: [0; 5],\ntools: [ToolData::FREE; TOOLS],\nhead: Head::CA,\n\
         dialect: Dialect::Sinumerik,\nplane: Plane::Xy,\nspline_begin: BoundaryCondition::Natural,\n\
         spline_end: BoundaryCondition::Natural,\narc_tolerance: 0.01,\ncurve_tolerance: 1.0e-4,\n\
         contour_tolerance: 0.05,\n",
    );
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
