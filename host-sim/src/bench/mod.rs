//! `host-sim bench`: what the core costs, in numbers that anybody can repeat.
//!
//! In: the images of `.ci/firmware`. Out: a [`Report`], rows of key, value, unit and meaning. Instruction counts come
//! from the emulator ([`meter`]), sizes from the image ([`image`]), speed and edge placement from this PC ([`host`]).
//! An emulator knows no pipeline and no flash wait states: a count is never printed as a time.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use pentaspline::board::MACHINE;
use pentaspline::stepgen::SLOTS;

use crate::diagnostics::Failure;
use crate::emulate::{self, EmulateError};
use crate::machine_file::Machine;
use crate::program::Program;

pub mod budget;
pub mod host;
pub mod image;
pub mod markdown;
pub mod meter;
pub mod readme;
pub mod report;
pub mod scale;
pub mod vectors;

use image::ImageSize;
use meter::{count, ratio, Counts};
use report::{Group, Report};

/// Environment variable that names another meter image.
pub const IMAGE_VARIABLE: &str = "PENTASPLINE_BENCH_IMAGE";

/// Command that builds the images, named in errors.
const BUILD_IMAGES: &str = "bash .ci/firmware stm32f4 qemu bench";

/// Clock of the board, Hz.
const CORE_HZ: f64 = 168e6;
/// Cycles per instruction assumed where a count is set against the clock: Klipper's published cycles per step on a
/// Cortex-M over its counted instructions. An assumption, not a measurement.
const CYCLES_PER_INSTRUCTION: f64 = 1.35;

/// Why there is no report.
#[derive(Debug)]
pub enum BenchError {
    /// The emulator or an image failed.
    Emulate(EmulateError),
    /// The image does not report a count: it is of another version.
    Missing(String),
    /// The core refuses a program, or does not come to its end.
    Refused {
        /// Errors it answered.
        errors: u64,
        /// First line of the program.
        first_line: String,
    },
    /// The image's own functions that copy and clear memory do so wrongly, so many times.
    Memory(u64),
    /// The image is no ELF file for the board.
    NoElf(PathBuf),
    /// The images come from two compilers: of the meter, of the board.
    Mixed(String, String),
    /// Something could not be read.
    Io(io::Error),
    /// The built-in machine does not parse.
    Machine(String),
}

impl BenchError {
    /// What to do about it, or nothing.
    #[must_use]
    pub fn help(&self) -> String {
        match self {
            Self::Emulate(EmulateError::NoImage(_))
            | Self::Missing(_)
            | Self::NoElf(_)
            | Self::Mixed(..) => {
                format!("build the images: {BUILD_IMAGES}")
            }
            Self::Emulate(error) => error.help(),
            _ => String::new(),
        }
    }
}

impl fmt::Display for BenchError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Emulate(error) => write!(f, "{error}"),
            Self::Missing(name) => write!(f, "the meter image does not count {name}"),
            Self::Refused { errors, first_line } => write!(
                f,
                "the program that begins `{first_line}` gave {errors} errors and was not measured"
            ),
            Self::Memory(faults) => write!(
                f,
                "the image copies or clears memory wrongly, {faults} times of what it tried"
            ),
            Self::NoElf(path) => write!(f, "{} is no image of a board", path.display()),
            Self::Mixed(meter, board) => write!(
                f,
                "the meter image comes from `{meter}`, the board's from `{board}`"
            ),
            Self::Io(error) => write!(f, "{error}"),
            Self::Machine(text) => write!(f, "{text}"),
        }
    }
}

impl std::error::Error for BenchError {}

impl From<EmulateError> for BenchError {
    fn from(error: EmulateError) -> Self {
        Self::Emulate(error)
    }
}

impl From<io::Error> for BenchError {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

impl From<Failure> for BenchError {
    fn from(failure: Failure) -> Self {
        Self::Machine(failure.to_string())
    }
}

/// The images measured.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Images {
    /// The instruction meter.
    pub meter: PathBuf,
    /// The product, for its size.
    pub board: PathBuf,
    /// The product for the emulator, for its stack.
    pub emulated: PathBuf,
}

impl Images {
    /// Those `.ci/firmware` has built; environment variables name others.
    #[must_use]
    pub fn find() -> Self {
        let emulated = emulate::default_image();
        let beside = |name: &str| emulated.with_file_name(name);
        Self {
            meter: std::env::var_os(IMAGE_VARIABLE).map_or_else(|| beside("bench.elf"), Into::into),
            board: beside("stm32f4.elf"),
            emulated,
        }
    }
}

/// What is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Scope {
    /// Rows that depend on the PC.
    pub pc: bool,
    /// Rows by program length, up to 10^6 blocks.
    pub scale: bool,
}

/// Measures; says what it does next to `progress`.
///
/// # Errors
/// [`BenchError`].
pub fn measure(
    images: &Images,
    scope: Scope,
    progress: &mut dyn FnMut(&str),
) -> Result<Report, BenchError> {
    let machine = vectors::machine()?;
    let mut report = Report::default();
    let (meter, board) = (size(&images.meter)?, size(&images.board)?);
    if meter.compiler != board.compiler {
        return Err(BenchError::Mixed(meter.compiler, board.compiler));
    }
    report.compiler.clone_from(&board.compiler);
    servo(&images.meter, &machine, progress, &mut report)?;
    background(&images.meter, &machine, progress, &mut report)?;
    progress("sizes and stack of the image");
    memory(images, &board, &mut report)?;
    if scope.pc {
        progress("speed of the simulator");
        simulator(&machine, &mut report)?;
    }
    progress("placement of step edges");
    placement(&machine, &mut report)?;
    if scope.scale {
        scale::measure(progress, &mut report)?;
    }
    Ok(report)
}

fn size(path: &Path) -> Result<ImageSize, BenchError> {
    let elf = std::fs::read(path)
        .map_err(|_| BenchError::Emulate(EmulateError::NoImage(path.to_owned())))?;
    image::size(&elf).ok_or_else(|| BenchError::NoElf(path.to_owned()))
}

/// Header for ticks in which every axis makes `rate` steps per second, up to rounding.
fn band(machine: &Machine, rate: f64) -> String {
    let per_tick = rate / f64::from(machine.config.servo_hz);
    format!(
        "core {} {}",
        (per_tick - 0.5).floor(),
        (per_tick + 0.5).ceil()
    )
}

/// Share of the board's time that `instructions` per servo tick take.
fn load(machine: &Machine, instructions: f64) -> f64 {
    instructions * f64::from(machine.config.servo_hz) * CYCLES_PER_INSTRUCTION / CORE_HZ
}

fn servo(
    image: &Path,
    machine: &Machine,
    progress: &mut dyn FnMut(&str),
    report: &mut Report,
) -> Result<(), BenchError> {
    let config = &machine.config;
    report.group(Group::Servo);
    progress("servo tick at rest");
    let rest = count(image, "core 0 0", &vectors::rest())?.stat("rest.both")?;
    report.add(
        "rest_mean",
        rest.mean(),
        "instructions",
        "tick at rest, mean",
    );
    report.add(
        "rest_max",
        rest.max as f64,
        "instructions",
        "tick at rest, max",
    );

    progress("servo tick between steps");
    let slow = count(
        image,
        "core 0 0",
        &vectors::line(config, 100.0, 0.0, 0.02, 10),
    )?;
    let still = slow.stat("still.both")?;
    let text = "tick with five axes moving and no step due";
    report.add(
        "tick_mean",
        still.mean(),
        "instructions",
        &format!("{text}, mean"),
    );
    report.add(
        "tick_max",
        still.max as f64,
        "instructions",
        &format!("{text}, max"),
    );
    let share = |counts: &Counts, name: &str| counts.stat(name).map(|stat| stat.mean());
    report.add(
        "tick_servo",
        share(&slow, "still.servo")?,
        "instructions",
        "of `tick_mean`: interpolation and edges (`Servo::tick`)",
    );
    report.add(
        "tick_expand",
        share(&slow, "still.expand")?,
        "instructions",
        "of `tick_mean`: port words (`PortExpander::expand`)",
    );

    for (name, rate, from, pitch, blocks) in [
        ("100k", 100_000.0, -100.0, 5.0, 40),
        ("667k", 666_666.7, -500.0, 10.0, 100),
    ] {
        progress(&format!("servo tick at 5 x {name} steps/s"));
        let text = vectors::line(config, rate, from, pitch, blocks);
        let counts = count(image, &band(machine, rate), &text)?;
        let both = counts.stat("band.both")?;
        let per_step = ratio(both.sum, counts.get("band.steps")?);
        let at = format!("at 5 x {name} steps/s");
        report.add(
            &format!("step_{name}"),
            per_step,
            "instructions",
            &format!("all-in per step {at}"),
        );
        report.add(
            &format!("tick_{name}_mean"),
            both.mean(),
            "instructions",
            &format!("tick {at}, mean"),
        );
        report.add(
            &format!("tick_{name}_max"),
            both.max as f64,
            "instructions",
            &format!("tick {at}, max"),
        );
        report.add(
            &format!("tick_{name}_servo"),
            share(&counts, "band.servo")?,
            "instructions",
            &format!("of `tick_{name}_mean`: interpolation and edges"),
        );
        report.add(
            &format!("tick_{name}_expand"),
            share(&counts, "band.expand")?,
            "instructions",
            &format!("of `tick_{name}_mean`: port words"),
        );
        if name == "667k" {
            report.add(
                "load_667k",
                load(machine, both.mean()),
                "fraction",
                "share of 168 MHz at 1.35 cycles per instruction (assumed) taken by ticks at 5 x 667 k steps/s",
            );
        }
    }
    Ok(())
}

fn background(
    image: &Path,
    machine: &Machine,
    progress: &mut dyn FnMut(&str),
    report: &mut Report,
) -> Result<(), BenchError> {
    report.group(Group::Background);
    progress("background on a C-spline, 2 mm between knots");
    let text = vectors::spline(&machine.config, 200, 2.0, 6000.0);
    let parts = count(image, "parts", &text)?;
    let core = count(image, "core 0 0", &text)?;
    let knots = parts.get("knots")?;
    let cubics = parts.get("segments")?;
    let parse = parts.stat("parse")?;
    report.add(
        "parse_line",
        parse.mean(),
        "instructions",
        "text line of five axes to a command, mean",
    );
    report.add(
        "parse_line_max",
        parse.max as f64,
        "instructions",
        "the same, max",
    );
    for (key, name, text) in [
        (
            "spline_knot",
            "geometry",
            "knot to cubic: C-spline with its window (`SegmentBuilder`)",
        ),
        (
            "pass_cubic",
            "offset",
            "cubic through the compensation stage with no compensation in force (`Compensator`)",
        ),
        (
            "travel_cubic",
            "travel",
            "cubic against the travel limits (`TravelBounds::outside`)",
        ),
        (
            "arc_cubic",
            "arc",
            "cubic to constant speed: u(s) and limits of its shape (`ArcSplitter`)",
        ),
    ] {
        report.add(
            key,
            ratio(parts.stat(name)?.sum, knots),
            "instructions",
            &format!("per knot, {text}"),
        );
    }
    curves(image, progress, report)?;
    let receive = core.stat("receive")?;
    let poll = core.stat("poll")?;
    let total = receive.sum + poll.sum;
    report.add(
        "spline_block",
        ratio(total, knots),
        "instructions",
        "all background work per knot of a five-axis C-spline, 2 mm apart at 100 mm/s: bytes received to pieces queued",
    );
    report.add(
        "cubic_block",
        ratio(total, cubics),
        "instructions",
        "the same per planned cubic block",
    );
    report.add(
        "receive_line",
        receive.mean(),
        "instructions",
        "of `spline_block`: bytes of a line into the buffer",
    );
    report.add(
        "plan_block",
        ratio(planning(&core, &parts)?, cubics),
        "instructions",
        "of `spline_block`: planner and wiring (what the stages above leave)",
    );
    let ticks = core.stat("other.both")?.n + core.stat("still.both")?.n;
    report.add(
        "background_tick",
        ratio(total + core.stat("idle")?.sum, ticks),
        "instructions",
        "background work of that program per servo tick in motion, calls that find nothing to do included",
    );
    report.add(
        "poll_max",
        poll.max as f64,
        "instructions",
        "longest background call of that program",
    );
    report.add(
        "poll_idle",
        core.stat("idle")?.mean(),
        "instructions",
        "background call that finds nothing to do, mean",
    );

    progress("look-ahead over dense blocks");
    let text = vectors::spline(&machine.config, 1000, 0.05, 40_000.0);
    let parts = count(image, "parts", &text)?;
    let core = count(image, "core 0 0", &text)?;
    let blocks = parts.get("segments")?;
    report.add(
        "lookahead_block",
        ratio(planning(&core, &parts)?, blocks),
        "instructions",
        "planner and wiring per block, blocks of 0.05 mm at a feed that reaches over the whole look-ahead",
    );
    let total = core.stat("receive")?.sum + core.stat("poll")?.sum;
    report.add(
        "dense_block",
        ratio(total, blocks),
        "instructions",
        "all background work per block of that program",
    );
    Ok(())
}

/// Geometry and cutter compensation per block, other curves than C-splines.
fn curves(
    image: &Path,
    progress: &mut dyn FnMut(&str),
    report: &mut Report,
) -> Result<(), BenchError> {
    for (key, name, text, what) in [
        (
            "arc_block",
            "geometry",
            vectors::quarter_circles(40),
            "per block, quarter circle (`G2`, radius 10 mm) to cubics (`SegmentBuilder`)",
        ),
        (
            "nurbs_span",
            "geometry",
            vectors::nurbs(100),
            "per control point 2 mm apart, span of a rational cubic B-spline in three axes to cubics (`SegmentBuilder`)",
        ),
        (
            "offset_line",
            "offset",
            vectors::offset_lines(40),
            "per block, lines with inner and outer corners in turn, compensated (`Compensator`)",
        ),
        (
            "offset_spline",
            "offset",
            vectors::offset_spline(100),
            "per knot, C-spline compensated (`Compensator`)",
        ),
    ] {
        progress(&format!("background: {key}"));
        let parts = count(image, "parts", &text)?;
        let value = ratio(parts.stat(name)?.sum, parts.get("knots")?);
        report.add(key, value, "instructions", what);
    }
    Ok(())
}

/// Background work of `core` that is none of the stages in `parts`.
fn planning(core: &Counts, parts: &Counts) -> Result<u64, BenchError> {
    let mut rest = core.stat("poll")?.sum;
    for name in ["parse", "geometry", "offset", "travel", "arc"] {
        rest = rest.saturating_sub(parts.stat(name)?.sum);
    }
    Ok(rest)
}

fn memory(images: &Images, size: &ImageSize, report: &mut Report) -> Result<(), BenchError> {
    report.group(Group::Memory);
    let text = vectors::plane_spline(&MACHINE, 60, 2.0, 6000.0);
    let program = Program::from_text("stack", &text)?;
    let options = emulate::Options {
        image: Some(images.emulated.clone()),
        ..emulate::Options::default()
    };
    let (stack, _) = emulate::emulate(&program, &options, &mut ())?.stack;
    report.add(
        "flash_bytes",
        f64::from(size.flash),
        "bytes",
        "code, constants, initial values of `stm32f4.elf`",
    );
    report.add(
        "ram_static_bytes",
        f64::from(size.ram),
        "bytes",
        "static variables of `stm32f4.elf`",
    );
    report.add(
        "stack_bytes",
        f64::from(stack),
        "bytes",
        "deepest stack of `qemu.elf` over a C-spline program, interrupts included",
    );
    report.add(
        "ram_bytes",
        f64::from(size.ram + stack),
        "bytes",
        "static variables and deepest stack",
    );
    Ok(())
}

fn simulator(machine: &Machine, report: &mut Report) -> Result<(), BenchError> {
    report.group(Group::Simulator);
    let text = vectors::spline(&machine.config, 400, 2.0, 1500.0);
    let speed = host::speed(machine, &text)?;
    report.add(
        "sim_realtime_factor",
        speed.realtime_factor,
        "s/s",
        "simulated time over wall-clock time, every tick, without plant, one core; depends on the PC",
    );
    let speed = host::speed(machine, &fine_spline(machine))?;
    report.add(
        "sim_blocks_per_s",
        speed.lines_per_s,
        "1/s",
        "lines of a C-spline, 0.5 mm apart at 200 mm/s, through the core as `check` runs it; depends on the PC",
    );
    Ok(())
}

/// A C-spline through points 0.5 mm apart at 200 mm/s.
fn fine_spline(machine: &Machine) -> String {
    vectors::spline(&machine.config, 4000, 0.5, 12_000.0)
}

fn placement(machine: &Machine, report: &mut Report) -> Result<(), BenchError> {
    report.group(Group::Placement);
    let slot_ns = 1e9 / (f64::from(machine.config.servo_hz) * f64::from(SLOTS));
    let mut jitter = host::jitter(machine, &fine_spline(machine))?;
    for rate in [1_000.0, 100_000.0, 666_666.7] {
        let text = vectors::line(&machine.config, rate, -100.0, 5.0, 40);
        let more = host::jitter(machine, &text)?;
        jitter.steady = jitter.steady.max(more.steady);
        jitter.turning = jitter.turning.max(more.turning);
        jitter.edges += more.edges;
    }
    report.add(
        "step_jitter_ns",
        jitter.steady * slot_ns,
        "ns",
        "largest distance of an edge from where the commanded motion, linear within a tick, crosses the border of a step",
    );
    report.add(
        "step_jitter_turn_ns",
        jitter.turning * slot_ns,
        "ns",
        "the same in ticks that change direction, where edges make room for the direction's set-up time",
    );
    Ok(())
}
