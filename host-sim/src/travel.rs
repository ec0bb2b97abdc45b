//! Watches the travel at every servo tick, along the whole excursion and not only at end points.
//!
//! In: commanded positions. Out: one [`Violation`] per stay outside the travel of an axis.

use std::fmt;

use pentaspline::units::{Position, Steps, Tick, AXES};
use serde::Serialize;

use crate::machine_file::Machine;

/// One stay outside the travel.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Violation {
    /// Axis letter.
    pub axis: String,
    /// First tick outside.
    pub tick: Tick,
    /// Streamed line in execution at that tick.
    pub streamed_line: u32,
    /// File of that line.
    pub file: String,
    /// Line in it, from 1.
    pub line: usize,
    /// Farthest position reached, mm or degrees, machine coordinates.
    pub reached: f64,
    /// The limit.
    pub limit: f64,
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            axis,
            reached,
            limit,
            file,
            line,
            ..
        } = self;
        write!(
            f,
            "travel: axis {axis} reaches {reached:.4}, its limit is {limit}, at {file}:{line}"
        )
    }
}

/// Watches the travel at every tick.
#[derive(Clone, Debug)]
pub struct TravelWatch {
    /// Limits in bits of Q32.32, and the same in mm or degrees.
    limits: [[(i64, f64); 2]; AXES],
    units_per_bit: [f64; AXES],
    names: [String; AXES],
    /// Index of the violation an axis is in.
    open: [Option<usize>; AXES],
    any_open: bool,
    found: Vec<Violation>,
    left_out: usize,
}

/// Violations kept; more are only counted.
const VIOLATIONS_MAX: usize = 1000;

impl TravelWatch {
    /// Watch over the travel in the machine file.
    #[must_use]
    pub fn new(machine: &Machine) -> Self {
        let limit = |a: usize, nano: i64, outermost: i64| {
            (
                machine
                    .config
                    .steps_from_nano(a, nano)
                    .map_or(outermost, |s| s.to_bits()),
                nano as f64 / 1e6,
            )
        };
        Self {
            limits: std::array::from_fn(|a| {
                let axis = &machine.config.axes[a];
                [
                    limit(a, axis.travel_min, i64::MIN),
                    limit(a, axis.travel_max, i64::MAX),
                ]
            }),
            units_per_bit: std::array::from_fn(|a| {
                1.0 / (4_294_967_296.0 * machine.steps_per_unit(a))
            }),
            names: std::array::from_fn(|a| machine.axis_name(a).to_string()),
            open: [None; AXES],
            any_open: false,
            found: Vec::new(),
            left_out: 0,
        }
    }

    /// Takes the next tick in.
    #[inline]
    pub fn tick(&mut self, tick: Tick, block: u32, commanded: &Position) {
        let outside = |(position, &[(low, _), (high, _)]): (&Steps, &[(i64, f64); 2])| {
            let bits = position.to_bits();
            (bits < low) | (bits > high)
        };
        // Nearly always there is nothing to look at closely; no branch per axis then.
        let axes = commanded.iter().zip(&self.limits);
        if axes.fold(self.any_open, |any, axis| any | outside(axis)) {
            self.look(tick, block, commanded);
        }
    }

    /// Takes in a tick with an axis outside, or with one that has just come back.
    #[cold]
    #[inline(never)]
    fn look(&mut self, tick: Tick, block: u32, commanded: &Position) {
        self.any_open = false;
        for (a, position) in commanded.iter().enumerate() {
            let bits = position.to_bits();
            let [(low, low_units), (high, high_units)] = self.limits[a];
            let limit = if bits < low {
                low_units
            } else if bits > high {
                high_units
            } else {
                self.open[a] = None;
                continue;
            };
            self.any_open = true;
            let reached = bits as f64 * self.units_per_bit[a];
            match self.open[a] {
                Some(index) => {
                    if let Some(violation) = self.found.get_mut(index) {
                        if (reached - limit).abs() > (violation.reached - violation.limit).abs() {
                            violation.reached = reached;
                        }
                    }
                }
                None if self.found.len() < VIOLATIONS_MAX => {
                    self.open[a] = Some(self.found.len());
                    let (axis, file) = (self.names[a].clone(), String::new());
                    self.found.push(Violation {
                        axis,
                        tick,
                        streamed_line: block,
                        file,
                        line: 0,
                        reached,
                        limit,
                    });
                }
                None => {
                    self.open[a] = Some(usize::MAX);
                    self.left_out += 1;
                }
            }
        }
    }

    /// All stays outside the travel, in order, and how many more there were.
    #[must_use]
    pub fn finish(self) -> (Vec<Violation>, usize) {
        (self.found, self.left_out)
    }
}

#[cfg(test)]
mod tests {
    use pentaspline::units::Steps;

    use super::*;

    #[test]
    fn an_excursion_between_end_points_is_found_with_its_block_and_extreme() {
        let machine = Machine::built_in().unwrap();
        let mut watch = TravelWatch::new(&machine);
        // X out to 503.5 and back within block 8, then exactly on the limit.
        for (tick, x) in [
            499.0,
            500.0,
            500.000_001,
            503.5,
            501.0,
            499.0,
            500.0,
            -500.5,
        ]
        .into_iter()
        .enumerate()
        {
            let mut commanded = [Steps::ZERO; AXES];
            commanded[0] = Steps::from_num(x * 1000.0);
            watch.tick(tick as u64, if tick < 7 { 8 } else { 9 }, &commanded);
        }
        let (found, left_out) = watch.finish();
        assert_eq!((found.len(), left_out), (2, 0));
        assert_eq!(
            (
                found[0].axis.as_str(),
                found[0].tick,
                found[0].streamed_line,
                found[0].limit
            ),
            ("X", 2, 8, 500.0)
        );
        assert!((found[0].reached - 503.5).abs() < 1e-6);
        assert_eq!(
            (found[1].tick, found[1].streamed_line, found[1].limit),
            (7, 9, -500.0)
        );
    }
}
