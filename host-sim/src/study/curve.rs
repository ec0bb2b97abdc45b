//! The programmed curve itself: the cubics the core makes of a program, without compensation, measured exactly.
//!
//! In: a machine and a program. Out: the cubics in the plane, where they cross the control lines, and how far they
//! are from the contour. Uses the interpreter and the segment builder of the core and nothing behind them.

use std::f64::consts::TAU;

use pentaspline::config::Config;
use pentaspline::geometry::{GeometryErrorKind, PathSegment, SegmentBuilder};
use pentaspline::nc::{Command, Interpreter};
use pentaspline::units::{Steps, AXES};

use super::contour::{normal_error, Control};
use super::turns::{Winding, MIDDLE};
use crate::diagnostics::{Exit, Failure};
use crate::program::Program;

/// Pieces of one cubic that are looked at for crossings.
const PIECES: u32 = 16;
/// Halvings of such a piece: below the resolution of `f64`.
const HALVINGS: u32 = 60;

/// A cubic in Hermite form in the plane, parameter 0 to 1, mm.
#[derive(Clone, Copy, Debug)]
struct Cubic {
    start: [f64; 2],
    end: [f64; 2],
    slope_start: [f64; 2],
    slope_end: [f64; 2],
    /// Angle about the centre where it starts and ends, radians, counted over full turns.
    angles: [f64; 2],
}

impl Cubic {
    fn at(&self, axis: usize, u: f64) -> f64 {
        let v = 1.0 - u;
        let (p0, p1) = (self.start[axis], self.end[axis]);
        let (m0, m1) = (self.slope_start[axis], self.slope_end[axis]);
        v * v * ((1.0 + 2.0 * u) * p0 + u * m0) + u * u * ((1.0 + 2.0 * v) * p1 - v * m1)
    }

    fn point(&self, u: f64) -> [f64; 2] {
        [self.at(0, u), self.at(1, u)]
    }

    fn overlaps(&self, from: f64, to: f64) -> bool {
        let [a, b] = self.angles;
        a.min(b) <= to && a.max(b) >= from
    }
}

/// The whole curve of a program.
#[derive(Clone, Debug)]
pub struct Programmed {
    cubics: Vec<Cubic>,
}

impl Programmed {
    /// Interprets `program` on `config`; `plane` holds the indices of the axes X and Y.
    ///
    /// # Errors
    /// Exit code 3 with the place in the program where the core refuses it.
    pub fn of(config: &Config, plane: [usize; 2], program: &Program) -> Result<Self, Failure> {
        let mut interpreter = Interpreter::new(config);
        let mut builder = SegmentBuilder::new(config, [Steps::ZERO; AXES]);
        let mut curve = Collector {
            plane,
            per_step: config
                .axes
                .map(|axis| 1.0 / axis.steps_per_unit.to_num::<f64>()),
            winding: Winding::default(),
            cubics: Vec::new(),
        };
        let refused = |line: u32, column: u16, text: String| {
            let line = (line as usize).clamp(1, program.len().max(1));
            let located = program.error_at(line, usize::from(column), &text, "refused");
            Failure::new(Exit::Program, located)
        };
        let mut commands = Vec::new();
        for line in program.lines() {
            interpreter
                .line(config, line, &mut |command| commands.push(command))
                .map_err(|e| refused(e.line, e.column, e.kind.to_string()))?;
            for command in commands.drain(..) {
                // A block that ends a spline is taken once that is drained.
                for attempt in 0..2 {
                    let taken = match &command {
                        Command::Move(block) => builder.push(config, block),
                        // Everything else but a message happens at standstill: a spline ends before it.
                        Command::Message(_) => Ok(()),
                        _ => builder.finish(config),
                    };
                    while let Some(next) = builder.next(config) {
                        curve.push(&next);
                    }
                    match taken {
                        Ok(()) => break,
                        Err(e) if attempt == 0 && e.kind == GeometryErrorKind::NotDrained => {}
                        Err(e) => return Err(refused(e.block, 1, e.kind.to_string())),
                    }
                }
            }
        }
        Ok(Self {
            cubics: curve.cubics,
        })
    }

    /// Where the middle turn crosses the line through `control`: the measured coordinate, mm. The crossing next to
    /// the control point if there are several; `None` without one nearby.
    #[must_use]
    pub fn crossing(&self, control: &Control) -> Option<f64> {
        let (measured, fixed) = (control.measured, 1 - control.measured);
        let line = control.at[fixed];
        let [from, to] = control.window.map(|angle| MIDDLE + angle);
        let mut best: Option<f64> = None;
        for cubic in &self.cubics {
            if !cubic.overlaps(from, to) {
                continue;
            }
            for piece in 0..PIECES {
                let mut low = f64::from(piece) / f64::from(PIECES);
                let mut high = f64::from(piece + 1) / f64::from(PIECES);
                let below = cubic.at(fixed, low) < line;
                if below == (cubic.at(fixed, high) < line) {
                    continue;
                }
                for _ in 0..HALVINGS {
                    let middle = 0.5 * (low + high);
                    if (cubic.at(fixed, middle) < line) == below {
                        low = middle;
                    } else {
                        high = middle;
                    }
                }
                let found = cubic.at(measured, 0.5 * (low + high));
                let miss = |value: f64| (value - control.at[measured]).abs();
                if best.is_none_or(|known| miss(found) < miss(known)) {
                    best = Some(found);
                }
            }
        }
        best
    }

    /// Normal error of the middle turn by angle: the largest one in magnitude per degree, mm, positive outside.
    #[must_use]
    pub fn error_by_degree(&self) -> [f64; 360] {
        let mut errors = [0.0_f64; 360];
        for cubic in &self.cubics {
            if !cubic.overlaps(MIDDLE, MIDDLE + TAU) {
                continue;
            }
            // A chord of the widest set spans some 15 degrees.
            let steps = 4 * PIECES;
            for step in 0..=steps {
                let at = cubic.point(f64::from(step) / f64::from(steps));
                let [a, b] = cubic.angles;
                let along = a + (b - a) * f64::from(step) / f64::from(steps);
                if !(MIDDLE..MIDDLE + TAU).contains(&along) {
                    continue;
                }
                let degree = at[1].atan2(at[0]).to_degrees().rem_euclid(360.0) as usize % 360;
                let error = normal_error(at);
                if error.abs() > errors[degree].abs() {
                    errors[degree] = error;
                }
            }
        }
        errors
    }
}

/// Takes the segments of the core apart.
struct Collector {
    plane: [usize; 2],
    per_step: [f64; AXES],
    winding: Winding,
    cubics: Vec<Cubic>,
}

impl Collector {
    fn push(&mut self, next: &PathSegment) {
        let place = |position: &[Steps; AXES]| {
            self.plane
                .map(|a| position[a].to_num::<f64>() * self.per_step[a])
        };
        let (start, end) = (place(&next.segment.start), place(&next.segment.end));
        let slope = |slopes: &[f32; AXES]| self.plane.map(|a| f64::from(slopes[a]));
        let from = self.winding.push(start);
        let to = self.winding.push(end);
        self.cubics.push(Cubic {
            start,
            end,
            slope_start: slope(&next.segment.slope_start),
            slope_end: slope(&next.segment.slope_end),
            angles: [from, to],
        });
    }
}
