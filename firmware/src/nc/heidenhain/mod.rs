//! Heidenhain conversational programs: a physical line comes in with the state it shares with the rest of the
//! interpreter ([`Shared`]), [`Command`]s in absolute machine coordinates go out.
//!
//! `words` reads the line; [`Heidenhain`] holds the modal state and says what the words mean where the program stands.
//! Touches [`crate::config`] (axes, defaults) and the tool table; changes itself, the position and the tool in the spindle.
//!
//! # The language
//! | words | meaning |
//! |---|---|
//! | `12` | block number at the start of the line, ignored |
//! | `BEGIN PGM name MM`, `INCH` | unit of linear coordinates and coefficients; `F` is in mm/min, in `INCH` programs in 0.1 inch/min |
//! | `END PGM name MM` | end of the program, unless `M2` or `M30` was |
//! | `L X+10 IY-5 .. R0 F500 M3` | straight; `FMAX`: rapid, this block only; `I` before the axis: incremental |
//! | `CC X+0 Y+0` | circle centre, its letters name the plane; alone: the current position |
//! | `C X.. Y.. DR+` | arc about the centre, `DR-` clockwise; without coordinates a full circle |
//! | `CR X.. Y.. R+5 DR-` | arc with radius in the plane of the tool; negative: more than half a turn |
//! | `SPL X.. Y.. K3X.. K2X.. K1X.. ..` | cubic over t from 1 to 0, `X(t) = K3X t^3 + K2X t^2 + K1X t + X` (shared facts 6); the coefficients may stand on the lines behind it |
//! | `R0 RL RR` | cutter compensation off, left, right; modal. The feed is that of the centre of the tool |
//! | `TOOL CALL 5 Z S5000 F800 DL+0.1 DR-0.02` | change to the tool at once; its axis is the normal of the plane; without a tool number only what is given changes |
//! | `M0 M1 M2 M3 M4 M5 M6 M8 M9 M13 M14 M30`, `STOP` | `M3 M4 M6 M8` before the motion, the others behind it; `M13` is `M3 M8`, `M14` is `M4 M8`, `STOP` is `M0` |
//! | `;`, `*` first in the line, `BLK FORM` | comments |
//! | `~` | end of a line that is continued: means nothing |
//!
//! Coordinates are shifted by the zero offset and, along the tool axis, by the length of the tool.

mod spline;
mod words;

use super::command::{
    Arc, Auxiliary, Centre, Command, Corner, Cutter, FeedReference, FeedType, Motion, Move, Plane,
    Rounding, Side,
};
use super::error::{Excerpt, Fault};
use super::modal::Tool;
use super::number::Decimal;
use super::tools::{self, Tools};
use crate::catalogue::{dialect, nc};
use crate::config::{AxisKind, Config};
use crate::units::{Nano, AXES, NANO_PER_UNIT};
use spline::Spline;
use words::{misc, Feed, Line, Placed, Statement, ToolName};

/// Largest programmed and machine coordinate, mm or degree; also of a coefficient.
const COORDINATE_MAX: i64 = 100_000;
/// Largest `F`, per minute, and `S`, rpm.
const RATE_MAX: f32 = 1.0e6;
/// What the reader shares with the rest of the interpreter for one line.
pub(super) struct Shared<'a> {
    /// The machine.
    pub config: &'a Config,
    /// Tool table and the tool in the spindle; `TOOL CALL` changes the latter.
    pub tools: &'a mut Tools,
    /// Zero offset in force.
    pub zero_offset: &'a [Nano; AXES],
    /// Running number of this line.
    pub line: u32,
    /// Where the program stands, absolute machine coordinates; moved on.
    pub position: &'a mut [Nano; AXES],
}

/// Modal state of a conversational program.
#[derive(Clone, Copy, Debug)]
pub(super) struct Heidenhain {
    inch: bool,
    /// Something of a program has come and its end has not.
    running: bool,
    /// mm/s and degree/s; 0 until programmed.
    feed_linear: f32,
    feed_rotary: f32,
    /// rpm.
    speed: f32,
    /// The spindle command in force, one bit of [`misc`]; 0 for none.
    spindle: u16,
    side: Side,
    /// Its normal is the tool axis.
    plane: Plane,
    centre: Option<(Plane, [Nano; 2])>,
    /// `DR`, `DL`: added to radius and length of the tool in the spindle.
    larger: Nano,
    longer: Nano,
    spline: Option<Spline>,
}

impl Heidenhain {
    /// Power-up state.
    #[must_use]
    pub(super) fn new(config: &Config) -> Self {
        Self {
            inch: false,
            running: false,
            feed_linear: config.default_feed,
            feed_rotary: config.default_feed,
            speed: 0.0,
            spindle: 0,
            side: Side::On,
            plane: config.plane,
            centre: None,
            larger: 0,
            longer: 0,
            spline: None,
        }
    }

    /// Power-up state again; the tool axis, `DL` and `DR` stay. Also what the end of a program does.
    pub(super) fn reset(&mut self, config: &Config) {
        *self = Self {
            plane: self.plane,
            larger: self.larger,
            longer: self.longer,
            ..Self::new(config)
        };
    }

    /// True while an `SPL` block waits for coefficients.
    pub(super) fn is_open(&self) -> bool {
        self.spline.is_some()
    }

    /// Forgets an `SPL` block that waits for coefficients: the program goes no further, or the machine was moved
    /// by something else. True if there was one: that is [`dialect::H_SPLINE_WORDS`] at the line behind the last.
    pub(super) fn forget(&mut self) -> bool {
        self.spline.take().is_some()
    }

    /// Takes one physical line, without its line end, and hands its commands to `emit` in acting order. True if the
    /// program ended with it (`Command::ProgramEnd` has been emitted).
    ///
    /// An `SPL` block hands out everything with the line that completes it.
    ///
    /// # Errors
    /// The first thing wrong with the line: rows `H_*` of the catalogue, and those of the language. State and position are
    /// then as before the line and nothing of it has been emitted.
    pub(super) fn line(
        &mut self,
        shared: &mut Shared,
        text: &[u8],
        emit: &mut dyn FnMut(Command),
    ) -> Result<bool, Fault> {
        let line = words::read(shared.config, text)?;
        let before = *self;
        // every function below that can fail does so before it emits or moves the position
        let done = self.act(shared, &line, emit);
        if done.is_err() {
            *self = before;
        }
        done
    }

    fn act(
        &mut self,
        shared: &mut Shared,
        line: &Line,
        emit: &mut dyn FnMut(Command),
    ) -> Result<bool, Fault> {
        if line.statement == Statement::Nothing {
            return Ok(false);
        }
        if self.spline.is_some() && line.statement != Statement::Words {
            return Err(Fault::new(line.at, 0, &dialect::H_SPLINE_WORDS));
        }
        if line.statement == Statement::End {
            let was_running = self.running;
            if was_running {
                emit(Command::ProgramEnd);
            }
            self.reset(shared.config);
            return Ok(was_running);
        }
        self.running = true;
        self.settle_feed(line)?;
        self.settle_side(shared, line)?;
        match line.statement {
            Statement::Begin(inch) => {
                self.inch = inch;
                Ok(false)
            }
            Statement::Centre => self.settle_centre(shared, line).map(|()| false),
            Statement::ToolCall => self.call_tool(shared, line, emit).map(|()| false),
            Statement::Spline => self.begin_spline(shared, line, emit),
            Statement::Words if self.spline.is_some() => self.more_spline(shared, line, emit),
            Statement::Words if line.given != 0 => {
                let at = line.coefficient_at;
                Err(Fault::new(at, 3, &dialect::H_COEFFICIENT))
            }
            Statement::Stop => self.finish(shared, line.misc | misc::STOP, None, emit),
            Statement::Line if line.axes != 0 => {
                let rapid = matches!(line.feed, Some(feed) if feed.value == Feed::Max);
                let motion = if rapid { Motion::Rapid } else { Motion::Linear };
                let target = self.target(shared, line)?;
                let step = self.step(shared, line, motion, target)?;
                self.finish(shared, line.misc, Some(step), emit)
            }
            Statement::Arc | Statement::Radius => {
                let target = self.target(shared, line)?;
                let motion = Motion::Arc(self.arc(line)?);
                let step = self.step(shared, line, motion, target)?;
                self.finish(shared, line.misc, Some(step), emit)
            }
            _ => self.finish(shared, line.misc, None, emit),
        }
    }

    /// `F`; `FMAX` only with `L`.
    fn settle_feed(&mut self, line: &Line) -> Result<(), Fault> {
        match line.feed {
            None => {}
            Some(Placed { at, value }) => match value {
                Feed::Max if line.statement == Statement::Line => {}
                Feed::Max => return Err(Fault::new(at, 4, &nc::UNEXPECTED_WORD)),
                Feed::Value(number) => {
                    let programmed = number.to_f32();
                    if programmed <= 0.0 {
                        return Err(Fault::new(at, 0, &nc::FEED_NOT_POSITIVE));
                    }
                    if programmed > RATE_MAX {
                        return Err(Fault::new(at, 1, &nc::OUT_OF_RANGE));
                    }
                    self.feed_rotary = programmed / 60.0;
                    self.feed_linear = if self.inch {
                        self.feed_rotary * 2.54
                    } else {
                        self.feed_rotary
                    };
                }
            },
        }
        Ok(())
    }

    fn settle_side(&mut self, shared: &Shared, line: &Line) -> Result<(), Fault> {
        if let Some(Placed { at, value }) = line.side {
            if value != Side::On && shared.tools.in_spindle() == tools::NONE {
                return Err(Fault::new(at, 2, &dialect::H_NO_TOOL));
            }
            self.side = value;
        }
        Ok(())
    }

    fn settle_centre(&mut self, shared: &Shared, line: &Line) -> Result<(), Fault> {
        let wrong = || Fault::new(line.at, 2, &dialect::H_CENTRE);
        let (plane, point) = if line.axes == 0 {
            (self.plane, *shared.position)
        } else {
            let plane = [Plane::Xy, Plane::Zx, Plane::Yz]
                .into_iter()
                .find(|plane| match shared.config.plane_axes(*plane) {
                    [Some(first), Some(second), _] => {
                        usize::from(line.axes) == 1 << first | 1 << second
                    }
                    _ => false,
                })
                .ok_or_else(wrong)?;
            (plane, self.target(shared, line)?)
        };
        let [Some(first), Some(second), _] = shared.config.plane_axes(plane) else {
            return Err(wrong());
        };
        match (point.get(first), point.get(second)) {
            (Some(first), Some(second)) => self.centre = Some((plane, [*first, *second])),
            _ => return Err(wrong()),
        }
        Ok(())
    }

    fn arc(&self, line: &Line) -> Result<Arc, Fault> {
        let clockwise = line
            .clockwise
            .ok_or_else(|| Fault::new(line.at, 0, &dialect::H_DIRECTION))?;
        let (plane, centre) = if line.statement == Statement::Arc {
            let (plane, point) = self
                .centre
                .ok_or_else(|| Fault::new(line.at, 1, &dialect::H_NO_CENTRE))?;
            (plane, Centre::Point(point))
        } else {
            let missing = |at| Fault::new(at, 0, &dialect::H_RADIUS);
            let radius = line.radius.ok_or_else(|| missing(line.at))?;
            let value = self.nano(radius.value, true);
            let value = value.ok_or_else(|| Fault::new(radius.at, 1, &nc::OUT_OF_RANGE))?;
            if value == 0 {
                return Err(missing(radius.at));
            }
            (self.plane, Centre::Radius(value))
        };
        Ok(Arc {
            plane,
            clockwise,
            centre,
            turns: 0,
        })
    }

    fn call_tool(
        &mut self,
        shared: &mut Shared,
        line: &Line,
        emit: &mut dyn FnMut(Command),
    ) -> Result<(), Fault> {
        if let Some(plane) = line.plane {
            self.plane = plane;
        }
        if let Some(Placed { at, value }) = line.speed {
            let speed = value.to_f32();
            if !(0.0..=RATE_MAX).contains(&speed) {
                return Err(Fault::new(at, 1, &nc::OUT_OF_RANGE));
            }
            self.speed = speed;
        }
        let mut mounted = shared.tools.in_spindle();
        if let Some(Placed { at, value }) = line.tool {
            let (tool, length) = match value {
                ToolName::Number(number) => (Tool::Number(number), digits(number)),
                ToolName::Text(name) => (Tool::Name(Excerpt::new(name)), name.len() + 2),
            };
            mounted = shared
                .tools
                .find(tool)
                .ok_or_else(|| Fault::new(at, length, &nc::UNKNOWN_TOOL))?;
            (self.larger, self.longer, self.spindle) = (0, 0, 0);
        }
        for (delta, value) in [
            (line.longer, &mut self.longer),
            (line.larger, &mut self.larger),
        ] {
            if let Some(Placed { at, value: number }) = delta {
                let delta = nano(number, self.inch);
                *value = delta.ok_or_else(|| Fault::new(at, 2, &nc::OUT_OF_RANGE))?;
            }
        }
        let radius = shared.tools.radius(mounted).saturating_add(self.larger);
        if !in_range(radius) || radius < 0 {
            let at = line.larger.map_or(line.at, |delta| delta.at);
            return Err(Fault::new(at, 2, &nc::OUT_OF_RANGE));
        }
        shared.tools.mount(mounted);
        if line.tool.is_some() {
            emit(Command::Auxiliary(Auxiliary::ToolChange));
        } else if line.speed.is_some() {
            // a turning spindle takes the new speed at once
            self.auxiliaries(self.spindle, emit);
        }
        Ok(())
    }

    /// A programmed length in 1e-6 mm or degree; `None` out of range.
    fn nano(&self, number: Decimal, linear: bool) -> Option<Nano> {
        nano(number, self.inch && linear)
    }

    /// End point of the line in machine coordinates.
    fn target(&self, shared: &Shared, line: &Line) -> Result<[Nano; AXES], Fault> {
        let normal = shared.config.plane_axes(self.plane)[2];
        let tools = &shared.tools;
        let length = tools.length(tools.in_spindle()).saturating_add(self.longer);
        let mut target = *shared.position;
        for axis in 0..AXES {
            if line.axes & 1 << axis == 0 {
                continue;
            }
            let linear = shared.config.axes[axis].kind == AxisKind::Linear;
            let origin = if line.incremental & 1 << axis != 0 {
                target[axis]
            } else if normal == Some(axis) {
                shared.zero_offset[axis].saturating_add(length)
            } else {
                shared.zero_offset[axis]
            };
            let value = self.nano(line.values[axis], linear);
            target[axis] = value
                .and_then(|value| value.checked_add(origin))
                .filter(|end| in_range(*end))
                .ok_or_else(|| Fault::new(line.places[axis], 1, &nc::OUT_OF_RANGE))?;
        }
        Ok(target)
    }

    /// The move to `target`.
    fn step(
        &self,
        shared: &Shared,
        line: &Line,
        motion: Motion,
        target: [Nano; AXES],
    ) -> Result<Move, Fault> {
        let tools = &shared.tools;
        let (mut linear, mut rotary) = (false, false);
        for (axis, (from, to)) in shared
            .config
            .axes
            .iter()
            .zip(shared.position.iter().zip(&target))
        {
            match axis.kind {
                AxisKind::Linear => linear |= from != to,
                AxisKind::Rotary => rotary |= from != to,
            }
        }
        let feed = if rotary && !linear {
            self.feed_rotary
        } else {
            self.feed_linear
        };
        if feed <= 0.0 && motion != Motion::Rapid {
            return Err(Fault::new(line.at, 0, &nc::MISSING_FEED));
        }
        Ok(Move {
            block: shared.line,
            motion,
            target,
            feed,
            feed_type: FeedType::PerTime,
            exact_stop: false,
            soft: shared.config.default_soft,
            rounding: Rounding::None,
            cutter: match self.side {
                Side::On => Cutter::OFF,
                side => Cutter {
                    side,
                    corner: Corner::Arc,
                    feed: FeedReference::Centre,
                    plane: self.plane,
                    radius: tools
                        .radius(tools.in_spindle())
                        .saturating_add(self.larger)
                        .max(0),
                },
            },
        })
    }

    /// Emits what acts before the motion, the motion, and what acts behind it. Cannot fail. True at the end of a program.
    fn finish(
        &mut self,
        shared: &mut Shared,
        functions: u16,
        step: Option<Move>,
        emit: &mut dyn FnMut(Command),
    ) -> Result<bool, Fault> {
        let turning = misc::CLOCKWISE | misc::COUNTER_CLOCKWISE;
        if functions & (turning | misc::SPINDLE_STOP) != 0 {
            self.spindle = functions & turning;
        }
        self.auxiliaries(functions & misc::BEFORE, emit);
        if let Some(step) = step {
            *shared.position = step.target;
            emit(Command::Move(step));
        }
        self.auxiliaries(functions & !misc::BEFORE, emit);
        let ended = functions & misc::PROGRAM_END != 0;
        if ended {
            emit(Command::ProgramEnd);
            self.reset(shared.config);
        }
        Ok(ended)
    }

    fn auxiliaries(&self, functions: u16, emit: &mut dyn FnMut(Command)) {
        for (bit, auxiliary) in [
            (misc::TOOL_CHANGE, Auxiliary::ToolChange),
            (misc::CLOCKWISE, Auxiliary::SpindleClockwise(self.speed)),
            (
                misc::COUNTER_CLOCKWISE,
                Auxiliary::SpindleCounterClockwise(self.speed),
            ),
            (misc::COOLANT_ON, Auxiliary::CoolantOn),
            (misc::SPINDLE_STOP, Auxiliary::SpindleStop),
            (misc::COOLANT_OFF, Auxiliary::CoolantOff),
            (misc::STOP, Auxiliary::Stop),
            (misc::OPTIONAL_STOP, Auxiliary::OptionalStop),
        ] {
            if functions & bit != 0 {
                emit(Command::Auxiliary(auxiliary));
            }
        }
    }
}

/// Digits of a number.
fn digits(number: u32) -> usize {
    1 + number.checked_ilog10().map_or(0, |log| log as usize)
}

fn in_range(nano: Nano) -> bool {
    nano.unsigned_abs() <= (COORDINATE_MAX * NANO_PER_UNIT).unsigned_abs()
}

/// A programmed length or angle in 1e-6 mm or degree; `None` out of range.
fn nano(number: Decimal, inch: bool) -> Option<Nano> {
    let nano = if inch {
        number.scaled(254, 5)
    } else {
        number.scaled(1, 6)
    };
    nano.filter(|nano| in_range(*nano))
}
