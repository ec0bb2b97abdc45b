//! Answers as senders of GRBL 1.1 read them.

use core::fmt::{self, Write};

use crate::config::{Config, Dialect, ToolData};
use crate::machine::State;
use crate::units::{Thousandths, AXES, NANO_PER_UNIT};

/// Banner at power-up and after a reset. Senders look for its first word.
pub const BANNER: &str = "\r\nGrbl 1.1h ['$' for help]\r\n";

/// What a status report says.
#[derive(Clone, Copy, Debug)]
pub struct Status {
    /// Machine state.
    pub state: State,
    /// Steps emitted per axis.
    pub emitted: [i32; AXES],
    /// Segments the planner can still take.
    pub planner_free: usize,
    /// Bytes the receive buffer can still take.
    pub receive_free: usize,
    /// Path feed, mm/min.
    pub feed: u32,
    /// Text line being executed.
    pub block: u32,
    /// Feed and rapid override, percent.
    pub overrides: [u8; 2],
}

/// Writes `<State|MPos:..|Bf:..|FS:..|Ov:..|Ln:..|WCO:..>`; positions in mm or degrees.
///
/// # Errors
/// If `out` is full.
pub fn status(out: &mut impl Write, config: &Config, status: &Status) -> fmt::Result {
    let name = match status.state {
        State::Idle => "Idle",
        State::Run => "Run",
        State::Hold => "Hold:0",
        State::Alarm => "Alarm",
    };
    write!(out, "<{name}|MPos:")?;
    for (a, &steps) in status.emitted.iter().enumerate() {
        let unit = i128::from(config.axes[a].steps_per_unit.to_bits());
        let thousandths = if unit == 0 {
            0
        } else {
            (i128::from(steps) << 32) * 1000 / unit
        };
        let comma = if a > 0 { "," } else { "" };
        write!(out, "{comma}{}", Thousandths(thousandths as i64))?;
    }
    write!(
        out,
        "|Bf:{},{}|FS:{},0|Ov:{},{},100|Ln:{}|WCO:",
        status.planner_free,
        status.receive_free,
        status.feed,
        status.overrides[0],
        status.overrides[1],
        status.block
    )?;
    for (a, &offset) in config.zero_offsets[0].iter().enumerate() {
        let comma = if a > 0 { "," } else { "" };
        write!(
            out,
            "{comma}{}",
            Thousandths(offset / (NANO_PER_UNIT / 1000))
        )?;
    }
    out.write_str(">\r\n")
}

/// Writes the answer to `$I`.
///
/// # Errors
/// If `out` is full.
pub fn identity(
    out: &mut impl Write,
    config: &Config,
    planner: usize,
    receive: usize,
) -> fmt::Result {
    write!(
        out,
        "[VER:1.1h.{}:Pentaspline {}]\r\n",
        env!("CARGO_PKG_VERSION"),
        config.name
    )?;
    write!(out, "[OPT:V,{planner},{receive}]\r\n[AXS:{AXES}:")?;
    for axis in &config.axes {
        out.write_char(char::from(axis.letter))?;
    }
    out.write_str("]\r\n")
}
/// One row of the tool table: `[T:number|name|R:radius|L:length]`, mm with three decimals.
pub fn tool(out: &mut impl Write, tool: &ToolData) -> fmt::Result {
    write!(out, "[T:{}|", tool.number)?;
    for &byte in tool.name.iter().take_while(|byte| **byte != 0) {
        out.write_char(char::from(byte))?;
    }
    let (radius, length) = (
        Thousandths(tool.radius / 1000),
        Thousandths(tool.length / 1000),
    );
    write!(out, "|R:{radius}|L:{length}]\r\n")
}

/// Names of the dialects on the wire, upper case.
const DIALECTS: [(Dialect, &str); 3] = [
    (Dialect::Sinumerik, "SINUMERIK"),
    (Dialect::Fanuc, "FANUC"),
    (Dialect::Heidenhain, "HEIDENHAIN"),
];

/// Name of a dialect.
#[must_use]
pub fn dialect_name(dialect: Dialect) -> &'static str {
    DIALECTS
        .iter()
        .find(|row| row.0 == dialect)
        .map_or("", |row| row.1)
}

/// Dialect of a name.
#[must_use]
pub fn dialect(name: &[u8]) -> Option<Dialect> {
    DIALECTS
        .iter()
        .find(|row| row.1.as_bytes() == name)
        .map(|row| row.0)
}
