//! The part of a machine file that says how programs are read: tools, zero offsets, tolerances, power-up state.
//!
//! In: raw tables with their places. Out: the fields of the core's configuration; a key that is not there has the
//! value `docs/machine-file.md` names.

use std::ops::RangeInclusive;

use pentaspline::config::{
    AxisConfig, AxisKind, Dialect, Head, ToolData, TOOLS, TOOL_NAME, ZERO_OFFSETS,
};
use pentaspline::nc::command::{BoundaryCondition, Plane};
use pentaspline::units::{Nano, AXES, NANO_PER_UNIT};
use serde::Deserialize;
use toml::Spanned;

use super::{AxisToml, MachineToml, Reader};
use crate::diagnostics::Failure;

/// Largest tool number: what eight digits write.
const TOOL_NUMBER_MAX: u32 = 99_999_999;
/// Largest cutter radius, mm.
const RADIUS_MAX: f64 = 1000.0;
/// Largest tool length, mm.
const LENGTH_MAX: f64 = 10_000.0;

/// `zero_offset = 12.5` (`G54`) or `zero_offset = [0.0, 12.5]` (`G54`, `G55`, ..).
#[derive(Deserialize)]
#[serde(untagged)]
pub(super) enum ZeroOffsets {
    One(f64),
    Several(Vec<f64>),
}

/// `[[tool]]`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ToolToml {
    number: Spanned<u32>,
    #[serde(default)]
    name: Option<Spanned<String>>,
    radius: Spanned<f64>,
    #[serde(default)]
    length: Option<Spanned<f64>>,
}

/// Power-up state of the language and its tolerances.
pub(super) struct Language {
    pub dialect: Dialect,
    pub plane: Plane,
    pub spline_begin: BoundaryCondition,
    pub spline_end: BoundaryCondition,
    pub arc_tolerance: f32,
    pub curve_tolerance: f32,
    pub contour_tolerance: f32,
}

const DIALECTS: &[(&str, Dialect)] = &[
    ("sinumerik", Dialect::Sinumerik),
    ("fanuc", Dialect::Fanuc),
    ("heidenhain", Dialect::Heidenhain),
];
const PLANES: &[(&str, Plane)] = &[("G17", Plane::Xy), ("G18", Plane::Zx), ("G19", Plane::Yz)];
const BEGINS: &[(&str, BoundaryCondition)] = &[
    ("BAUTO", BoundaryCondition::NotAKnot),
    ("BNAT", BoundaryCondition::Natural),
    ("BTAN", BoundaryCondition::Tangent),
];
const ENDS: &[(&str, BoundaryCondition)] = &[
    ("EAUTO", BoundaryCondition::NotAKnot),
    ("ENAT", BoundaryCondition::Natural),
    ("ETAN", BoundaryCondition::Tangent),
];
const HEADS: &[(&str, Head)] = &[("none", Head::None), ("CA", Head::CA), ("CB", Head::CB)];

impl Reader<'_> {
    pub(super) fn language(&self, raw: &MachineToml) -> Result<Language, Failure> {
        Ok(Language {
            dialect: self.choice(
                raw.dialect.as_ref(),
                "dialect",
                DIALECTS,
                Dialect::Sinumerik,
            )?,
            plane: self.choice(raw.plane.as_ref(), "plane", PLANES, Plane::Xy)?,
            spline_begin: self.choice(
                raw.spline_begin.as_ref(),
                "spline_begin",
                BEGINS,
                BoundaryCondition::Natural,
            )?,
            spline_end: self.choice(
                raw.spline_end.as_ref(),
                "spline_end",
                ENDS,
                BoundaryCondition::Natural,
            )?,
            arc_tolerance: self.tolerance(
                raw.arc_tolerance.as_ref(),
                "arc_tolerance",
                0.01,
                0.0..=10.0,
            )?,
            // Below a nanometre the 32 bits of a background number end on a metre of travel.
            curve_tolerance: self.tolerance(
                raw.curve_tolerance.as_ref(),
                "curve_tolerance",
                1.0e-4,
                1.0e-6..=1.0,
            )?,
            contour_tolerance: self.tolerance(
                raw.contour_tolerance.as_ref(),
                "contour_tolerance",
                0.05,
                0.0..=10.0,
            )?,
        })
    }

    /// The head, which needs the rotary axes it is made of; `CA` is taken for granted where they are there.
    pub(super) fn head(
        &self,
        raw: Option<&Spanned<String>>,
        axes: &[AxisConfig],
    ) -> Result<Head, Failure> {
        let rotary = |letters: &str| {
            letters.bytes().all(|letter| {
                axes.iter()
                    .any(|axis| axis.letter == letter && axis.kind == AxisKind::Rotary)
            })
        };
        let default = if rotary("CA") { Head::CA } else { Head::None };
        let head = self.choice(raw, "head", HEADS, default)?;
        match raw {
            Some(raw) if head != Head::None && !rotary(raw.get_ref()) => Err(self.refuse(
                raw.span(),
                "the head needs axes the machine does not have",
                "expected a rotary axis for each of its letters",
            )),
            _ => Ok(head),
        }
    }

    /// Column `index` of the zero offsets.
    pub(super) fn zero_offsets(
        &self,
        axis: &AxisToml,
        index: usize,
        offsets: &mut [[Nano; AXES]; ZERO_OFFSETS],
    ) -> Result<(), Failure> {
        let Some(raw) = &axis.zero_offset else {
            return Ok(());
        };
        let values = match raw.get_ref() {
            ZeroOffsets::One(value) => std::slice::from_ref(value),
            ZeroOffsets::Several(values) => values,
        };
        if values.len() > ZERO_OFFSETS {
            return Err(self.refuse(
                raw.span(),
                "too many zero offsets",
                "expected one for each of G54 to G57 at most",
            ));
        }
        for (row, value) in offsets.iter_mut().zip(values) {
            row[index] = self.nano(raw.span(), *value, *axis.steps_per_unit.get_ref())?;
        }
        Ok(())
    }

    /// A machine position within the travel of its axis; 0 unless given.
    pub(super) fn point(
        &self,
        axis: &AxisToml,
        config: &AxisConfig,
        raw: Option<&Spanned<f64>>,
    ) -> Result<Nano, Failure> {
        let Some(raw) = raw else { return Ok(0) };
        let at = self.nano(raw.span(), *raw.get_ref(), *axis.steps_per_unit.get_ref())?;
        if (config.travel_min..=config.travel_max).contains(&at) {
            Ok(at)
        } else {
            Err(self.refuse(
                raw.span(),
                "point outside the travel of its axis",
                "expected a machine position within `travel`",
            ))
        }
    }

    /// The tool table.
    pub(super) fn tools(&self, raw: &[ToolToml]) -> Result<[ToolData; TOOLS], Failure> {
        let mut table = [ToolData::FREE; TOOLS];
        if let Some(extra) = raw.get(TOOLS) {
            return Err(self.refuse(
                extra.number.span(),
                "too many tools",
                &format!("expected {TOOLS} [[tool]] tables at most"),
            ));
        }
        for (row, raw) in raw.iter().enumerate() {
            let tool = self.tool(raw)?;
            let before = &table[..row];
            if before.iter().any(|other| other.number == tool.number) {
                return Err(self.refuse(
                    raw.number.span(),
                    "tool number used twice",
                    "expected a number of its own",
                ));
            }
            if let Some(name) = &raw.name {
                if before
                    .iter()
                    .any(|other| other.name.eq_ignore_ascii_case(&tool.name))
                {
                    return Err(self.refuse(
                        name.span(),
                        "tool name used twice",
                        "expected a name of its own; case does not count",
                    ));
                }
            }
            table[row] = tool;
        }
        Ok(table)
    }

    fn tool(&self, raw: &ToolToml) -> Result<ToolData, Failure> {
        let number = *raw.number.get_ref();
        if !(1..=TOOL_NUMBER_MAX).contains(&number) {
            return Err(self.refuse(
                raw.number.span(),
                "tool number out of range",
                &format!("expected 1 to {TOOL_NUMBER_MAX}"),
            ));
        }
        let mut name = [0; TOOL_NAME];
        if let Some(raw) = &raw.name {
            let text = raw.get_ref().as_bytes();
            let writable = |byte: &u8| (b' '..=b'}').contains(byte) && !b"\"?!".contains(byte);
            if text.is_empty() || text.len() > TOOL_NAME || !text.iter().all(writable) {
                return Err(self.refuse(
                    raw.span(),
                    "not a tool name",
                    &format!("expected 1 to {TOOL_NAME} characters that a line can carry"),
                ));
            }
            for (to, from) in name.iter_mut().zip(text) {
                *to = *from;
            }
        }
        let length = raw.length.as_ref();
        Ok(ToolData {
            number,
            name,
            radius: self.millimetres(Some(&raw.radius), "radius", 0.0..=RADIUS_MAX)?,
            length: self.millimetres(length, "length", -LENGTH_MAX..=LENGTH_MAX)?,
        })
    }

    fn millimetres(
        &self,
        raw: Option<&Spanned<f64>>,
        name: &str,
        range: RangeInclusive<f64>,
    ) -> Result<Nano, Failure> {
        let Some(raw) = raw else { return Ok(0) };
        let value = self.within(raw, name, &range, "mm")?;
        Ok((value * NANO_PER_UNIT as f64).round() as Nano)
    }

    fn tolerance(
        &self,
        raw: Option<&Spanned<f64>>,
        name: &str,
        default: f32,
        range: RangeInclusive<f64>,
    ) -> Result<f32, Failure> {
        match raw {
            None => Ok(default),
            Some(raw) => Ok(self.within(raw, name, &range, "mm")? as f32),
        }
    }

    fn within(
        &self,
        raw: &Spanned<f64>,
        name: &str,
        range: &RangeInclusive<f64>,
        unit: &str,
    ) -> Result<f64, Failure> {
        let value = *raw.get_ref();
        if range.contains(&value) {
            return Ok(value);
        }
        let expected = format!("expected {} to {} {unit}", range.start(), range.end());
        Err(self.refuse(raw.span(), &format!("{name} out of range"), &expected))
    }

    fn choice<T: Copy>(
        &self,
        raw: Option<&Spanned<String>>,
        name: &str,
        choices: &[(&str, T)],
        default: T,
    ) -> Result<T, Failure> {
        let Some(raw) = raw else { return Ok(default) };
        if let Some((_, value)) = choices.iter().find(|(text, _)| text == raw.get_ref()) {
            return Ok(*value);
        }
        let names: Vec<String> = choices
            .iter()
            .map(|(text, _)| format!("{text:?}"))
            .collect();
        Err(self.refuse(
            raw.span(),
            &format!("unknown {name}"),
            &format!("expected one of {}", names.join(", ")),
        ))
    }
}
