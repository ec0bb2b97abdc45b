//! Machine files: TOML in (`machines/mcv1210.toml` documents the keys), core [`Config`] and [`PlantConfig`] out.
//!
//! Every number is checked here, once, with the place in the file at the caret; behind this door the core
//! may rely on its configuration.

use std::cmp::Ordering;
use std::path::Path;
use std::sync::Arc;

use pentaspline::config::{AxisConfig, AxisKind, Config, ROUNDING_TOLERANCE, ZERO_OFFSETS};
use pentaspline::envelope::{axis_acceleration, axis_velocity};
use pentaspline::stepgen::SLOTS;
use pentaspline::units::{Nano, Steps, AXES, NANO_PER_UNIT};
use serde::Deserialize;
use toml::Spanned;

use crate::diagnostics::{Exit, Failure, Located};
use crate::plant::AxisPlant;

mod language;

/// The TAJMAC-ZPS MCV 1210, in force unless `--machine` names another file.
pub const BUILT_IN: &str = include_str!("../../machines/mcv1210.toml");

/// Name under which errors in the built-in file are shown.
const BUILT_IN_NAME: &str = "machines/mcv1210.toml (built in)";

/// A machine: what the core is told and what stands behind its steps.
#[derive(Clone, Debug)]
pub struct Machine {
    /// Configuration of the core.
    pub config: Config,
    /// Model of drives and mechanics.
    pub plant: PlantConfig,
}

/// Drives and mechanics of all axes, in the order of [`Config::axes`].
#[derive(Clone, Debug, PartialEq)]
pub struct PlantConfig {
    /// One model per axis.
    pub axes: [AxisPlant; AXES],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MachineToml {
    name: String,
    servo_hz: Spanned<u32>,
    pulse_width_ns: Spanned<u32>,
    dir_setup_ns: Spanned<u32>,
    default_feed: Spanned<f64>,
    dynamics: Spanned<String>,
    starve_ms: Spanned<u32>,
    #[serde(default)]
    arc_tolerance: Option<Spanned<f64>>,
    #[serde(default)]
    curve_tolerance: Option<Spanned<f64>>,
    #[serde(default)]
    contour_tolerance: Option<Spanned<f64>>,
    #[serde(default)]
    dialect: Option<Spanned<String>>,
    #[serde(default)]
    plane: Option<Spanned<String>>,
    #[serde(default)]
    spline_begin: Option<Spanned<String>>,
    #[serde(default)]
    spline_end: Option<Spanned<String>>,
    #[serde(default)]
    head: Option<Spanned<String>>,
    #[serde(default)]
    tool: Vec<language::ToolToml>,
    axis: Spanned<Vec<AxisToml>>,
    plant: Spanned<PlantToml>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AxisToml {
    name: Spanned<String>,
    kind: Spanned<String>,
    steps_per_unit: Spanned<f64>,
    v_max: Spanned<f64>,
    a_max: Spanned<f64>,
    j_max: Spanned<f64>,
    corner_step: Spanned<f64>,
    #[serde(default)]
    rounding_tolerance: Option<Spanned<f64>>,
    travel: Spanned<[f64; 2]>,
    #[serde(default)]
    zero_offset: Option<Spanned<language::ZeroOffsets>>,
    #[serde(default)]
    reference_point: Option<Spanned<f64>>,
    #[serde(default)]
    fixed_point: Option<Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PlantToml {
    linear: Option<Spanned<AxisPlantToml>>,
    rotary: Option<Spanned<AxisPlantToml>>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct AxisPlantToml {
    kv_per_s: f64,
    feed_forward: f64,
    velocity_lag_s: f64,
    a_saturation: f64,
    backlash: f64,
    encoder_resolution: f64,
}

impl Machine {
    /// The built-in MCV 1210.
    ///
    /// # Errors
    /// Never with the file this crate ships; the result keeps callers free of panics.
    pub fn built_in() -> Result<Self, Failure> {
        Self::parse(BUILT_IN_NAME, BUILT_IN)
    }

    /// Reads `path`, or the built-in machine without one.
    ///
    /// # Errors
    /// Exit code 5 if the file cannot be read, 2 if it is not a valid machine.
    pub fn load(path: Option<&Path>) -> Result<Self, Failure> {
        let Some(path) = path else {
            return Self::built_in();
        };
        let text = std::fs::read_to_string(path)
            .map_err(|e| Failure::io("read machine file", path, &e))?;
        Self::parse(&path.display().to_string(), &text)
    }

    /// Takes the text of a machine file; `file` is its name in errors.
    ///
    /// # Errors
    /// Exit code 2 with the offending value at the caret.
    pub fn parse(file: &str, text: &str) -> Result<Self, Failure> {
        let reader = Reader {
            file,
            text: Arc::from(text),
        };
        let raw: MachineToml = toml::from_str(text).map_err(|e| {
            let span = e.span().unwrap_or(0..0);
            reader.refuse(span, "machine file does not parse", e.message())
        })?;
        reader.machine(raw)
    }

    /// Letter of axis `index` as text.
    #[must_use]
    pub fn axis_name(&self, index: usize) -> char {
        char::from(self.config.axes[index].letter)
    }

    /// Steps per mm or degree of axis `index`, exactly as the core has it.
    #[must_use]
    pub fn steps_per_unit(&self, index: usize) -> f64 {
        self.config.axes[index].steps_per_unit.to_num::<f64>()
    }
}

/// Text under validation.
struct Reader<'a> {
    file: &'a str,
    text: Arc<str>,
}

impl Reader<'_> {
    fn refuse(&self, span: std::ops::Range<usize>, message: &str, expected: &str) -> Failure {
        let len = span.end.saturating_sub(span.start);
        Failure::new(
            Exit::Usage,
            Located::new(message).at(self.file, &self.text, span.start, len, expected),
        )
    }

    fn machine(&self, mut raw: MachineToml) -> Result<Machine, Failure> {
        let language = self.language(&raw)?;
        let tools = self.tools(&std::mem::take(&mut raw.tool))?;
        let servo_hz = *raw.servo_hz.get_ref();
        if !(500..=50_000).contains(&servo_hz) {
            return Err(self.refuse(
                raw.servo_hz.span(),
                "servo_hz out of range",
                "expected 500 to 50000",
            ));
        }
        let pulse_slots = self.slots(&raw.pulse_width_ns, servo_hz)?.max(1);
        let dir_setup_slots = self.slots(&raw.dir_setup_ns, servo_hz)?;
        let default_feed = *raw.default_feed.get_ref();
        if !(default_feed >= 0.0 && default_feed.is_finite()) {
            return Err(self.refuse(
                raw.default_feed.span(),
                "default_feed out of range",
                "expected 0 or more, mm/min",
            ));
        }
        let default_soft = match raw.dynamics.get_ref().as_str() {
            "soft" => true,
            "brisk" => false,
            _ => {
                return Err(self.refuse(
                    raw.dynamics.span(),
                    "unknown dynamics",
                    "expected \"soft\" or \"brisk\"",
                ))
            }
        };
        let starve_ticks = u64::from(*raw.starve_ms.get_ref()) * u64::from(servo_hz);
        let Ok(starve_ticks) = u32::try_from(starve_ticks.div_ceil(1000)) else {
            return Err(self.refuse(
                raw.starve_ms.span(),
                "starve_ms too long",
                "expected less than 2^32 servo ticks",
            ));
        };

        let raw_head = raw.head.take();
        let span = raw.axis.span();
        let raw_axes: [AxisToml; AXES] =
            raw.axis
                .into_inner()
                .try_into()
                .map_err(|axes: Vec<AxisToml>| {
                    let message = format!("{} axes given", axes.len());
                    self.refuse(
                        span,
                        &message,
                        &format!("expected exactly {AXES} [[axis]] tables"),
                    )
                })?;
        let slots_per_step = f64::from(pulse_slots) + 1.0;
        let mut axes = Vec::with_capacity(AXES);
        let mut plants = Vec::with_capacity(AXES);
        let mut zero_offsets = [[0; AXES]; ZERO_OFFSETS];
        let mut reference_point = [0; AXES];
        let mut fixed_point = [0; AXES];
        for (index, axis) in raw_axes.iter().enumerate() {
            let config = self.axis(axis, &axes)?;
            let steps_per_tick =
                axis.v_max.get_ref() * axis.steps_per_unit.get_ref() / f64::from(servo_hz);
            if steps_per_tick * slots_per_step > f64::from(SLOTS) {
                let limit = f64::from(SLOTS) / slots_per_step * f64::from(servo_hz)
                    / axis.steps_per_unit.get_ref();
                let expected =
                    format!("the step port reaches {limit:.3} at this servo rate and pulse width");
                return Err(self.refuse(
                    axis.v_max.span(),
                    "v_max needs more steps than the port can give",
                    &expected,
                ));
            }
            let hz = f64::from(servo_hz);
            for (name, value, limit) in [
                ("v_max", &axis.v_max, axis_velocity() * hz),
                ("a_max", &axis.a_max, axis_acceleration() * hz * hz),
            ] {
                if *value.get_ref() > limit {
                    return Err(self.refuse(
                        value.span(),
                        &format!("{name} out of range"),
                        &format!("this servo rate reaches {limit:.3}"),
                    ));
                }
            }
            self.zero_offsets(axis, index, &mut zero_offsets)?;
            reference_point[index] = self.point(axis, &config, axis.reference_point.as_ref())?;
            fixed_point[index] = self.point(axis, &config, axis.fixed_point.as_ref())?;
            plants.push(self.plant(index, config.kind, servo_hz, &raw.plant)?);
            axes.push(config);
        }
        let head = self.head(raw_head.as_ref(), &axes)?;
        let full = || Failure::new(Exit::Usage, Located::new("axis count"));
        Ok(Machine {
            config: Config {
                // The core keeps the name for the life of the program; a process reads few machine files.
                name: Box::leak(raw.name.into_boxed_str()),
                axes: axes.try_into().map_err(|_| full())?,
                servo_hz,
                pulse_slots,
                dir_setup_slots,
                zero_offsets,
                reference_point,
                fixed_point,
                tools,
                head,
                dialect: language.dialect,
                plane: language.plane,
                spline_begin: language.spline_begin,
                spline_end: language.spline_end,
                arc_tolerance: language.arc_tolerance,
                curve_tolerance: language.curve_tolerance,
                contour_tolerance: language.contour_tolerance,
                default_feed: (default_feed / 60.0) as f32,
                default_soft,
                starve_ticks,
            },
            plant: PlantConfig {
                axes: plants.try_into().map_err(|_| full())?,
            },
        })
    }

    fn axis(&self, raw: &AxisToml, before: &[AxisConfig]) -> Result<AxisConfig, Failure> {
        let name = raw.name.get_ref();
        let letter = match name.as_bytes() {
            [letter @ (b'A' | b'B' | b'C' | b'U' | b'V' | b'W' | b'X' | b'Y' | b'Z')] => *letter,
            _ => {
                return Err(self.refuse(
                    raw.name.span(),
                    "not an axis letter",
                    "expected one of A B C U V W X Y Z",
                ))
            }
        };
        if before.iter().any(|axis| axis.letter == letter) {
            return Err(self.refuse(
                raw.name.span(),
                "axis letter used twice",
                "expected a letter of its own",
            ));
        }
        let kind = match raw.kind.get_ref().as_str() {
            "linear" => AxisKind::Linear,
            "rotary" => AxisKind::Rotary,
            _ => {
                return Err(self.refuse(
                    raw.kind.span(),
                    "unknown kind of axis",
                    "expected \"linear\" or \"rotary\"",
                ))
            }
        };
        let steps_per_unit = self.positive(&raw.steps_per_unit, "steps_per_unit")?;
        let Some(steps) =
            Steps::checked_from_num(steps_per_unit).filter(|steps| steps.to_bits() > 0)
        else {
            return Err(self.refuse(
                raw.steps_per_unit.span(),
                "steps_per_unit out of range",
                "expected less than 2^31",
            ));
        };
        let corner_step = *raw.corner_step.get_ref();
        if !(corner_step >= 0.0 && (corner_step as f32).is_finite()) {
            return Err(self.refuse(
                raw.corner_step.span(),
                "corner_step out of range",
                "expected 0 or more",
            ));
        }
        let rounding_tolerance = raw.rounding_tolerance.as_ref();
        let tolerance =
            rounding_tolerance.map_or(f64::from(ROUNDING_TOLERANCE), |value| *value.get_ref());
        if !(0.0..=10.0).contains(&tolerance) {
            return Err(self.refuse(
                rounding_tolerance.map_or_else(|| raw.travel.span(), Spanned::span),
                "rounding_tolerance out of range",
                "expected 0 to 10",
            ));
        }
        let [low, high] = *raw.travel.get_ref();
        // A NaN is no travel either.
        if low.partial_cmp(&high) != Some(Ordering::Less) {
            return Err(self.refuse(
                raw.travel.span(),
                "travel is empty",
                "expected [lower, upper]",
            ));
        }
        Ok(AxisConfig {
            letter,
            kind,
            steps_per_unit: steps,
            v_max: self.positive(&raw.v_max, "v_max")? as f32,
            a_max: self.positive(&raw.a_max, "a_max")? as f32,
            j_max: self.positive(&raw.j_max, "j_max")? as f32,
            corner_step: corner_step as f32,
            rounding_tolerance: tolerance as f32,
            travel_min: self.nano(raw.travel.span(), low, steps_per_unit)?,
            travel_max: self.nano(raw.travel.span(), high, steps_per_unit)?,
        })
    }

    fn plant(
        &self,
        index: usize,
        kind: AxisKind,
        servo_hz: u32,
        raw: &Spanned<PlantToml>,
    ) -> Result<AxisPlant, Failure> {
        let (table, name) = match kind {
            AxisKind::Linear => (&raw.get_ref().linear, "linear"),
            AxisKind::Rotary => (&raw.get_ref().rotary, "rotary"),
        };
        let Some(table) = table else {
            return Err(self.refuse(
                raw.span(),
                "plant model missing",
                &format!("expected a table [plant.{name}]"),
            ));
        };
        let raw = *table.get_ref();
        if !(0.0..=1.0).contains(&raw.feed_forward) {
            return Err(self.refuse(table.span(), "feed_forward out of range", "expected 0 to 1"));
        }
        let plant = AxisPlant {
            kv_per_s: raw.kv_per_s,
            feed_forward: raw.feed_forward,
            velocity_lag_s: raw.velocity_lag_s,
            a_saturation: raw.a_saturation,
            backlash: raw.backlash,
            encoder_resolution: raw.encoder_resolution,
        };
        match plant.validate(index, 1.0 / f64::from(servo_hz)) {
            Ok(()) => Ok(plant),
            Err(error) => Err(self.refuse(table.span(), "plant model refused", &error.to_string())),
        }
    }

    /// A finite number above zero that `f32` can hold.
    fn positive(&self, value: &Spanned<f64>, name: &str) -> Result<f64, Failure> {
        let number = *value.get_ref();
        let narrow = number as f32;
        if narrow > 0.0 && narrow.is_finite() {
            Ok(number)
        } else {
            Err(self.refuse(
                value.span(),
                &format!("{name} out of range"),
                "expected a number above 0",
            ))
        }
    }

    /// `value` mm or degrees in [`Nano`], rounded to nearest; refused where it would leave 2^31 steps.
    fn nano(
        &self,
        span: std::ops::Range<usize>,
        value: f64,
        steps_per_unit: f64,
    ) -> Result<Nano, Failure> {
        if (value * steps_per_unit).abs() < 2_147_483_648.0 && value.abs() < 9.0e12 {
            Ok((value * NANO_PER_UNIT as f64).round() as Nano)
        } else {
            Err(self.refuse(
                span,
                "position out of range",
                "expected less than 2^31 steps from zero",
            ))
        }
    }

    /// Slots of the step frame that cover `value` nanoseconds.
    fn slots(&self, value: &Spanned<u32>, servo_hz: u32) -> Result<u16, Failure> {
        let scaled = u64::from(*value.get_ref()) * u64::from(servo_hz) * u64::from(SLOTS);
        match u16::try_from(scaled.div_ceil(1_000_000_000)) {
            Ok(slots) if slots < SLOTS / 2 => Ok(slots),
            _ => Err(self.refuse(
                value.span(),
                "time too long",
                "expected less than half a servo tick",
            )),
        }
    }
}

#[cfg(test)]
mod tests;
