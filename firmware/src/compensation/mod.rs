//! Cutter radius compensation: from the contour of the workpiece to the path of the tool centre.
//!
//! In: [`PathSegment`]s of the contour and standstill functions in path order; out: the same for the tool centre, lazily and
//! in path order. Segments without compensation pass unchanged, bit for bit. Bounded memory; background only; `f64`
//! where micrometres at metre scale are at stake.
//!
//! | file | does |
//! |---|---|
//! | `offset` | centre path of one piece, and where the tool fits |
//! | `piece` | what the window stores; steps to mm and back |
//! | `corner` | joints between pieces, bridges around outer corners |
//! | `intersect` | where two pieces cross |
//! | `window` | look-ahead, cuts, what must be refused |
//! | `emit` | pieces to cubic segments |

mod corner;
mod emit;
mod error;
mod intersect;
mod offset;
mod piece;
#[cfg(test)]
mod tests;
mod window;

pub use error::{CompensationError, CompensationErrorKind, Place};

use crate::config::Config;
use crate::geometry::{HermiteSegment, PathSegment};
use crate::nc::command::{Command, Cutter, Side};
use crate::units::{Position, Steps, AXES};
use emit::Emission;
use offset::{cross, dot, norm, Point};
use piece::{difference, steps, Kind, Piece, State};
use window::{Item, Standstill, Window, RESERVE, WINDOW};

/// What has to go on while a contour is worked out: called every few dozen points of a curve. Joining one piece may look at tens of
/// thousands of them, which is longer than the planner is ahead.
pub type Meanwhile<'a> = &'a mut dyn FnMut();

/// One unit of the compensated path.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(clippy::large_enum_variant)]
pub enum Output {
    /// Motion of the tool centre.
    Segment(PathSegment),
    /// A standstill function at its place of the path.
    Command(Command),
}

/// Where the path is with respect to a contour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    /// Not compensated.
    Off,
    /// On the way to a contour whose start is not known yet.
    Approach,
    /// On a contour.
    On,
    /// `G40` is in force; the tool still stands at the offset.
    Leaving,
}

/// A segment of the contour on its way into the window.
struct Incoming {
    path: PathSegment,
    /// Share already taken.
    done: f32,
}

/// The compensation stage. Static, no heap.
pub struct Compensator {
    /// End of what has been handed out.
    at: Position,
    mode: Mode,
    /// Compensation of the contour under way.
    cutter: Cutter,
    window: Window,
    /// Items at the front of the window that nothing can change any more.
    sealed: usize,
    incoming: Option<Incoming>,
    emission: Option<Emission>,
    /// A segment on its way through while nothing is compensated and the window is empty.
    passing: Option<PathSegment>,
}

impl Default for Compensator {
    fn default() -> Self {
        Self::new()
    }
}

impl Compensator {
    /// A stage whose tool stands at zero; call [`Compensator::reset`] with the true position.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            at: [Steps::ZERO; AXES],
            mode: Mode::Off,
            cutter: Cutter::OFF,
            window: Window::new(),
            sealed: 0,
            incoming: None,
            emission: None,
            passing: None,
        }
    }

    /// Forgets everything, compensation included; the tool centre stands at `position`.
    pub fn reset(&mut self, position: Position) {
        self.at = position;
        self.mode = Mode::Off;
        self.window.clear();
        self.sealed = 0;
        self.incoming = None;
        self.emission = None;
        self.passing = None;
    }

    /// True while output waits that [`Compensator::next`] gives without further input; nothing may be pushed then.
    #[must_use]
    pub fn is_full(&self) -> bool {
        self.passing.is_some()
            || self.incoming.is_some()
            || self.emission.is_some()
            || self.sealed > 0
            || self.window.items.len() > WINDOW - RESERVE
    }

    /// True while anything taken has not been handed out.
    #[must_use]
    pub fn has_pending(&self) -> bool {
        self.passing.is_some()
            || self.incoming.is_some()
            || self.emission.is_some()
            || !self.window.items.is_empty()
    }

    /// Takes the next segment of the path. [`Compensator::next`] must have been called until it gave `None`.
    ///
    /// # Errors
    /// Approach, retract or side change on a curve, a change of radius or plane on the way, an end of the contour that the
    /// tool cannot reach; `NotDrained`. Call [`Compensator::reset`] after any of them.
    pub fn push_segment(
        &mut self,
        config: &Config,
        segment: &PathSegment,
        meanwhile: Meanwhile,
    ) -> Result<(), CompensationError> {
        if segment.cutter.side == Side::On && self.mode == Mode::Off && !self.has_pending() {
            self.passing = Some(*segment);
            return Ok(());
        }
        self.take(config, segment, meanwhile)
    }

    /// [`Compensator::push_segment`] of what has to go through the window.
    #[inline(never)]
    fn take(
        &mut self,
        config: &Config,
        segment: &PathSegment,
        meanwhile: Meanwhile,
    ) -> Result<(), CompensationError> {
        let fail = |kind| CompensationError {
            block: segment.block,
            kind,
        };
        if self.is_full() {
            return Err(fail(CompensationErrorKind::NotDrained));
        }
        let cutter = &segment.cutter;
        if cutter.side == Side::On && self.mode == Mode::Off {
            self.window.push(segment.block, Item::Pass(*segment))?;
            self.sealed = self.window.items.len();
            return Ok(());
        }
        let continues = matches!(self.mode, Mode::On | Mode::Approach);
        if cutter.side == Side::On {
            let axes = self.window.axes;
            if continues {
                if self.window.open {
                    let by = difference(config, &segment.segment.start, &segment.segment.end);
                    // If not, `end` says why.
                    self.window
                        .leave(config, axes.map(|axis| by[axis]), meanwhile);
                }
                self.end(config, meanwhile)?;
                self.mode = Mode::Leaving;
                self.window.tail = None;
            }
            let item = match in_plane(config, axes, segment) {
                InPlane::None => Item::Still(*segment),
                InPlane::Straight => {
                    self.mode = Mode::Off;
                    Item::Retract(*segment)
                }
                InPlane::Curved => return Err(fail(CompensationErrorKind::NotStraight)),
            };
            self.window.push(segment.block, item)?;
            self.sealed = self.window.items.len();
            return Ok(());
        }
        if continues && cutter.plane != self.cutter.plane {
            return Err(fail(CompensationErrorKind::PlaneChange));
        }
        if continues && cutter.radius != self.cutter.radius {
            return Err(fail(CompensationErrorKind::RadiusChange));
        }
        let [Some(first), Some(second), _] = config.plane_axes(cutter.plane) else {
            return Err(fail(CompensationErrorKind::PlaneAxes));
        };
        let axes = [first, second];
        match in_plane(config, axes, segment) {
            InPlane::None => {
                // The side counts from the next block on that moves in the plane.
                let item = if self.mode == Mode::Off {
                    Item::Pass(*segment)
                } else {
                    Item::Still(*segment)
                };
                self.window.push(segment.block, item)?;
                if !continues {
                    self.sealed = self.window.items.len();
                }
            }
            _ if continues && cutter.side == self.cutter.side => {
                self.incoming = Some(Incoming {
                    path: *segment,
                    done: 0.0,
                });
            }
            InPlane::Straight => {
                if continues {
                    self.end(config, meanwhile)?;
                }
                self.cutter = *cutter;
                self.window.axes = axes;
                self.window.tail = None;
                self.window
                    .push(segment.block, Item::Approach(*segment, None))?;
                self.mode = Mode::Approach;
            }
            InPlane::Curved => return Err(fail(CompensationErrorKind::NotStraight)),
        }
        Ok(())
    }

    /// Takes a standstill function; it comes out at this place of the path. The output must be drained as for a segment.
    ///
    /// # Errors
    /// `NotDrained`, also for [`Command::Move`], which is no standstill function.
    pub fn push_command(
        &mut self,
        _config: &Config,
        command: Command,
    ) -> Result<(), CompensationError> {
        let fail = CompensationError {
            block: 0,
            kind: CompensationErrorKind::NotDrained,
        };
        if self.is_full() {
            return Err(fail);
        }
        self.window
            .push(0, Item::Command(Standstill::new(command).ok_or(fail)?))?;
        if matches!(self.mode, Mode::Off | Mode::Leaving) {
            self.sealed = self.window.items.len();
        }
        Ok(())
    }

    /// The path ends here (program end, time-out): the last piece ends at its normal offset. Drain afterwards.
    ///
    /// If the contour goes on all the same, it may do so with a tangent or an outer corner.
    ///
    /// # Errors
    /// The end of the contour cannot be reached by the tool; `NotDrained`.
    pub fn finish(
        &mut self,
        config: &Config,
        meanwhile: Meanwhile,
    ) -> Result<(), CompensationError> {
        if let Some(incoming) = &self.incoming {
            return Err(CompensationError {
                block: incoming.path.block,
                kind: CompensationErrorKind::NotDrained,
            });
        }
        self.end(config, meanwhile)?;
        if let Some(tail) = &mut self.window.tail {
            tail.ended = true;
        }
        Ok(())
    }

    /// Next output in path order; `None` if more input is needed.
    ///
    /// # Errors
    /// The contour is refused; call [`Compensator::reset`].
    pub fn next(
        &mut self,
        config: &Config,
        meanwhile: Meanwhile,
    ) -> Result<Option<Output>, CompensationError> {
        if let Some(path) = &self.passing {
            self.at = path.segment.end;
            let output = Output::Segment(*path);
            self.passing = None;
            return Ok(Some(output));
        }
        if !self.is_full() {
            return Ok(None);
        }
        self.advance_window(config, meanwhile)
    }

    /// Next output of the window.
    #[inline(never)]
    fn advance_window(
        &mut self,
        config: &Config,
        meanwhile: Meanwhile,
    ) -> Result<Option<Output>, CompensationError> {
        loop {
            meanwhile();
            if let Some(emission) = &mut self.emission {
                match emission.next(config, &mut self.at) {
                    Ok(Some(segment)) => return Ok(Some(Output::Segment(segment))),
                    Ok(None) => self.emission = None,
                    Err(emit::OutOfRange) => {
                        return Err(CompensationError {
                            block: emission.block(),
                            kind: CompensationErrorKind::OutOfRange,
                        })
                    }
                }
            } else if self.sealed > 0 {
                self.sealed -= 1;
                if !self.window.items.is_empty() {
                    let item = self.window.items.remove(0);
                    if let Some(out) = self.release(config, item)? {
                        return Ok(Some(out));
                    }
                }
            } else if self.window.items.len() > WINDOW - RESERVE {
                self.make_room(config, meanwhile)?;
            } else if let Some(incoming) = self.incoming.take() {
                self.advance(config, incoming, meanwhile)?;
            } else {
                return Ok(None);
            }
        }
    }

    /// Takes one piece of the incoming segment into the window.
    fn advance(
        &mut self,
        config: &Config,
        incoming: Incoming,
        meanwhile: Meanwhile,
    ) -> Result<(), CompensationError> {
        let Incoming { path, done } = incoming;
        let axes = self.window.axes;
        let whole = Piece::new(config, axes, &path, Kind::Contour, [done, 1.0]);
        let (to, regular) = whole.shape(config, axes).piece(f64::from(done));
        let to = to as f32;
        let piece = if to < 1.0 {
            Piece::new(config, axes, &path, Kind::Contour, [done, to])
        } else {
            whole
        };
        self.window.admit(config, piece, regular, meanwhile)?;
        self.mode = Mode::On;
        if to < 1.0 {
            self.incoming = Some(Incoming { path, done: to });
        }
        Ok(())
    }

    /// The window has no room for the next piece: its front is final, or the contour cannot be followed.
    fn make_room(
        &mut self,
        config: &Config,
        meanwhile: Meanwhile,
    ) -> Result<(), CompensationError> {
        if self.window.open && self.window.enter(config, meanwhile)? {
            return Ok(());
        }
        let last = self.window.last_live();
        match self.window.items.first() {
            Some(Item::Approach(_, None)) => {
                self.window.resolve_alone(config, &self.at);
                self.mode = Mode::On;
            }
            Some(Item::Piece(piece)) if piece.state != State::Live => {
                return Err(self.window.blocked(config));
            }
            Some(Item::Piece(piece)) if last == Some(0) => {
                return Err(if self.window.open {
                    self.window.blocked(config)
                } else {
                    CompensationError {
                        block: piece.source.block,
                        kind: CompensationErrorKind::LookAhead,
                    }
                });
            }
            _ => self.sealed = 1,
        }
        Ok(())
    }

    /// The contour ends here: everything in the window is final.
    fn end(&mut self, config: &Config, meanwhile: Meanwhile) -> Result<(), CompensationError> {
        if self.mode == Mode::Approach {
            self.window.resolve_alone(config, &self.at);
            self.mode = Mode::On;
        }
        if self.window.open {
            self.window.enter(config, meanwhile)?;
        }
        if self.window.open {
            return Err(self.window.blocked(config));
        }
        self.sealed = self.window.items.len();
        Ok(())
    }

    /// Hands out an item whose place is final.
    fn release(
        &mut self,
        config: &Config,
        item: Item,
    ) -> Result<Option<Output>, CompensationError> {
        let axes = self.window.axes;
        let path = match item {
            Item::Piece(piece) => {
                if piece.state == State::Live {
                    self.emission = Some(Emission::new(config, axes, piece, &self.at));
                }
                return Ok(None);
            }
            Item::Command(command) => return Ok(Some(Output::Command(command.command()))),
            Item::Pass(path) => {
                self.at = path.segment.end;
                return Ok(Some(Output::Segment(path)));
            }
            Item::Still(path) => self.still(config, path),
            Item::Approach(path, to) => {
                let mut end = path.segment.end;
                if let Some(to) = to {
                    for k in 0..2 {
                        end[axes[k]] = steps(config, axes[k], to[k]).ok_or(CompensationError {
                            block: path.block,
                            kind: CompensationErrorKind::OutOfRange,
                        })?;
                    }
                }
                self.straight(config, path, end)
            }
            Item::Retract(path) => self.straight(config, path, path.segment.end),
        };
        let moves = path.segment.start != path.segment.end || path.exact_stop || {
            let slopes = [&path.segment.slope_start, &path.segment.slope_end];
            slopes.iter().any(|slope| slope.iter().any(|v| *v != 0.0))
        };
        self.at = path.segment.end;
        Ok(moves.then_some(Output::Segment(path)))
    }

    /// `path` without its motion in the plane, from where the tool stands.
    fn still(&self, config: &Config, path: PathSegment) -> PathSegment {
        let axes = self.window.axes;
        let mut segment = path.segment;
        for axis in axes {
            segment.start[axis] = self.at[axis];
            segment.end[axis] = self.at[axis];
            segment.slope_start[axis] = 0.0;
            segment.slope_end[axis] = 0.0;
        }
        if segment.start != self.at {
            // The axes stand elsewhere because a curve between was not run: straight there.
            return self.straight(config, path, segment.end);
        }
        PathSegment { segment, ..path }
    }

    /// `path` as a straight line from where the tool stands to `end`.
    fn straight(&self, config: &Config, path: PathSegment, end: Position) -> PathSegment {
        let by = difference(config, &self.at, &end).map(|v| v as f32);
        PathSegment {
            segment: HermiteSegment {
                start: self.at,
                end,
                slope_start: by,
                slope_end: by,
            },
            ..path
        }
    }
}

/// Motion of a segment in the plane.
enum InPlane {
    None,
    Straight,
    Curved,
}

fn in_plane(config: &Config, axes: [usize; 2], path: &PathSegment) -> InPlane {
    let by = difference(config, &path.segment.start, &path.segment.end);
    let by: Point = axes.map(|axis| by[axis]);
    let slopes = [&path.segment.slope_start, &path.segment.slope_end]
        .map(|slope| axes.map(|axis| f64::from(slope[axis])));
    if norm(by) == 0.0 && slopes.iter().all(|slope| norm(*slope) == 0.0) {
        return InPlane::None;
    }
    // Slopes along the chord, to the rounding of single precision.
    let along = |slope: &Point| {
        cross(by, *slope).abs() <= 1.0e-5 * norm(by) * norm(*slope) && dot(by, *slope) >= 0.0
    };
    if norm(by) > 0.0 && slopes.iter().all(along) {
        InPlane::Straight
    } else {
        InPlane::Curved
    }
}
