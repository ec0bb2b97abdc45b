//! What a block means where the program stands: modal state and position come in with each line,
//! [`Command`]s in absolute machine coordinates go out.

use super::block::{Before, Block, Coefficients, Modal, Tool};
use super::command::{
    Auxiliary, BoundaryCondition, Command, CubicBlock, Cutter, FeedType, Motion, Move, SplineKind,
};
use super::error::{Fault, NcError, NcErrorKind};
use super::table::{Misc, Mode};
use super::values::{
    coordinate, cubic_length, dwell_time, refuse, refuse_point_words, settle_feed, settle_speed,
    spline_spec, triples_up_to, COORDINATE_MAX, DEGREE,
};
use crate::config::{AxisKind, Config};
use crate::units::{Nano, AXES};

/// A `G6` block whose K words have not all come.
#[derive(Clone, Copy, Debug)]
struct Pending {
    target: [Nano; AXES],
    length: Nano,
    feed: f32,
    exact_stop: bool,
    soft: bool,
    order: [u8; AXES],
    axes: usize,
    misc: u16,
}

/// Modal interpreter of one program after another.
#[derive(Clone, Debug)]
pub struct Interpreter {
    modal: Modal,
    position: [Nano; AXES],
    axis_of: [u8; 26],
    tool: Option<Tool>,
    line: u32,
    ended: bool,
    pending: Option<Pending>,
    k: Coefficients,
    k_count: usize,
}

impl Modal {
    fn power_up(config: &Config) -> Self {
        Self {
            mode: Mode::Linear,
            begin: BoundaryCondition::Natural,
            end: BoundaryCondition::Natural,
            degree: DEGREE,
            absolute: true,
            inch: false,
            exact_stop: false,
            soft: config.default_soft,
            feed_linear: config.default_feed,
            feed_rotary: config.default_feed,
            speed: 0.0,
            first_weight: 0,
        }
    }
}

impl Interpreter {
    /// Power-up state at machine position zero; the axis letters are those of `config`.
    #[must_use]
    pub fn new(config: &Config) -> Self {
        let mut axis_of = [u8::MAX; 26];
        for (index, axis) in (0..).zip(&config.axes) {
            if let Some(entry) = axis_of.get_mut(usize::from(axis.letter.wrapping_sub(b'A'))) {
                *entry = index;
            }
        }
        Self {
            modal: Modal::power_up(config),
            position: [0; AXES],
            axis_of,
            tool: None,
            line: 0,
            ended: false,
            pending: None,
            k: [0; 3 * AXES],
            k_count: 0,
        }
    }

    /// Power-up state again, line count 0; the position stays.
    pub fn reset(&mut self, config: &Config) {
        *self = Self {
            position: self.position,
            ..Self::new(config)
        };
    }

    /// Takes one physical line, without its line end, and hands its commands to `emit` in acting order.
    ///
    /// A `G6` line hands out what acts before its motion; the motion and what acts behind it follow
    /// with the last of its K lines. After the end of a program the next line is line 1 again.
    ///
    /// # Errors
    /// The first thing wrong with the line. Modal state and position are then as before the line, nothing of the
    /// line has been emitted, and a `G6` block that waits for K lines goes on waiting.
    pub fn line(
        &mut self,
        config: &Config,
        text: &[u8],
        emit: &mut dyn FnMut(Command),
    ) -> Result<(), NcError> {
        self.line = if self.ended {
            1
        } else {
            self.line.saturating_add(1)
        };
        self.ended = false;
        let before = Before {
            axis_of: &self.axis_of,
            modal: &self.modal,
            only_k: self.pending.is_some(),
            k_count: self.k_count,
        };
        let mut block = Block::new(&before);
        let read = block.read(text, &before, &mut self.k);
        read.and_then(|()| match self.pending {
            Some(_) => self.continue_cubic(config, &block, emit),
            None => self.act(config, &mut block, emit),
        })
        .map_err(|fault| self.error(&fault, text))
    }

    /// Says that the program goes no further.
    ///
    /// Lines are acted on as they come, so nothing is ever held back but a `G6` block without all its K lines.
    /// A pause of the sender is no reason to call this.
    ///
    /// # Errors
    /// [`NcErrorKind::MissingCoefficients`] at the line behind the last if such a block was waiting; it is forgotten.
    pub fn flush(
        &mut self,
        _config: &Config,
        _emit: &mut dyn FnMut(Command),
    ) -> Result<(), NcError> {
        self.k_count = 0;
        match self.pending.take() {
            None => Ok(()),
            Some(_) => Err(NcError {
                line: self.line.saturating_add(1),
                column: 1,
                kind: NcErrorKind::MissingCoefficients,
            }),
        }
    }

    /// Number of the last line taken, 1-based; 0 before the first.
    #[must_use]
    pub fn line_number(&self) -> u32 {
        self.line
    }

    /// Machine position the program stands at: the end of the last block emitted.
    #[must_use]
    pub fn position(&self) -> [Nano; AXES] {
        self.position
    }

    /// Sets the machine position, for a machine that was moved by something other than the program.
    /// A `G6` block that waits for K lines is forgotten.
    pub fn set_position(&mut self, position: [Nano; AXES]) {
        self.position = position;
        self.pending = None;
        self.k_count = 0;
    }

    /// Tool selected by `T`, if any was.
    #[must_use]
    pub fn tool(&self) -> Option<Tool> {
        self.tool
    }

    #[cold]
    fn error(&self, fault: &Fault, text: &[u8]) -> NcError {
        NcError {
            line: self.line,
            column: fault.column(),
            kind: fault.kind(text),
        }
    }

    /// Acts on a complete line.
    #[inline]
    fn act(
        &mut self,
        config: &Config,
        block: &mut Block,
        emit: &mut dyn FnMut(Command),
    ) -> Result<(), Fault> {
        self.settle_spline(block)?;
        settle_speed(block)?;
        if let Some(at) = block.dwell {
            let milliseconds = dwell_time(block, at)?;
            self.commit(block, emit);
            emit(Command::Dwell { milliseconds });
            return self.finish(config, block.misc, emit);
        }
        settle_feed(block)?;
        refuse(block, b'P')?;
        self.check_words(block)?;
        if block.axes == 0 {
            self.commit(block, emit);
            return self.finish(config, block.misc, emit);
        }
        let mode = block.modal.mode;
        let target = self.target(config, block)?;
        let feed = self.feed(config, block, &target)?;
        let exact_stop = block.exact_stop || block.modal.exact_stop;
        let soft = block.modal.soft;
        let motion = match mode {
            Mode::Rapid => Motion::Rapid,
            Mode::Linear => Motion::Linear,
            Mode::Spline(kind) => Motion::Spline(spline_spec(kind, block)?),
            Mode::Cubic => {
                let length = cubic_length(block)?;
                triples_up_to(block, block.axes)?;
                let (order, axes, misc) = (block.order, block.axes, block.misc);
                self.commit(block, emit);
                self.pending = Some(Pending {
                    target,
                    length,
                    feed,
                    exact_stop,
                    soft,
                    order,
                    axes,
                    misc,
                });
                return self.continue_cubic(config, block, emit);
            }
        };
        self.commit(block, emit);
        self.position = target;
        let block_number = self.line;
        emit(Command::Move(Move {
            block: block_number,
            motion,
            target,
            feed,
            feed_type: FeedType::PerTime,
            exact_stop,
            soft,
            cutter: Cutter::OFF,
        }));
        self.finish(config, block.misc, emit)
    }

    /// The point of no return of a line: modal state, tool, and what acts before the motion.
    fn commit(&mut self, block: &Block, emit: &mut dyn FnMut(Command)) {
        self.modal = block.modal;
        if block.tool.is_some() {
            self.tool = block.tool;
        }
        if block.misc & Misc::BEFORE != 0 {
            self.auxiliaries(block.misc & Misc::BEFORE, emit);
        }
    }

    /// What acts behind the motion.
    #[inline]
    fn finish(
        &mut self,
        config: &Config,
        misc: u16,
        emit: &mut dyn FnMut(Command),
    ) -> Result<(), Fault> {
        let misc = misc & !Misc::BEFORE;
        if misc != 0 {
            self.auxiliaries(misc, emit);
            if misc & Misc::ProgramEnd.bit() != 0 {
                self.modal = Modal::power_up(config);
                self.ended = true;
            }
        }
        Ok(())
    }

    #[cold]
    fn auxiliaries(&self, misc: u16, emit: &mut dyn FnMut(Command)) {
        for function in Misc::ORDER {
            if misc & function.bit() == 0 {
                continue;
            }
            emit(match function {
                Misc::ToolChange => Command::Auxiliary(Auxiliary::ToolChange),
                Misc::SpindleClockwise => {
                    Command::Auxiliary(Auxiliary::SpindleClockwise(self.modal.speed))
                }
                Misc::SpindleCounterClockwise => {
                    Command::Auxiliary(Auxiliary::SpindleCounterClockwise(self.modal.speed))
                }
                Misc::CoolantOn => Command::Auxiliary(Auxiliary::CoolantOn),
                Misc::SpindleStop => Command::Auxiliary(Auxiliary::SpindleStop),
                Misc::CoolantOff => Command::Auxiliary(Auxiliary::CoolantOff),
                Misc::Stop => Command::Auxiliary(Auxiliary::Stop),
                Misc::OptionalStop => Command::Auxiliary(Auxiliary::OptionalStop),
                Misc::ProgramEnd => Command::ProgramEnd,
            });
        }
    }

    /// `SD` and the beginning of a spline.
    #[inline]
    fn settle_spline(&self, block: &mut Block) -> Result<(), Fault> {
        let modal = &mut block.modal;
        if modal.mode != self.modal.mode {
            modal.first_weight = 0;
            modal.degree = DEGREE;
        }
        if let Some(degree) = block.degree {
            let Mode::Spline(kind) = modal.mode else {
                return Err(Fault::new(degree.at, 2, NcErrorKind::UnexpectedWord));
            };
            if kind == SplineKind::BSpline {
                if modal.first_weight != 0 && modal.degree != degree.value {
                    return Err(Fault::new(degree.at, 0, |_| NcErrorKind::DegreeChange));
                }
                modal.degree = degree.value;
            }
        }
        Ok(())
    }

    /// Refuses words that mean nothing under the interpolation in force.
    #[inline]
    fn check_words(&self, block: &Block) -> Result<(), Fault> {
        let mode = block.modal.mode;
        if mode != Mode::Cubic || block.axes == 0 {
            refuse(block, b'I')?;
            refuse(block, b'K')?;
        }
        if !matches!(mode, Mode::Spline(_)) || block.axes == 0 {
            refuse_point_words(block)?;
        }
        Ok(())
    }

    /// End point of the line in machine coordinates.
    #[inline]
    fn target(&self, config: &Config, block: &Block) -> Result<[Nano; AXES], Fault> {
        let mut target = self.position;
        for &axis in block.order.iter().take(block.axes) {
            let axis = usize::from(axis) % AXES;
            let linear = config.axes[axis].kind == AxisKind::Linear;
            let value = coordinate(block.values[axis], block.modal.inch && linear);
            let origin = if block.modal.absolute {
                config.zero_offsets[0][axis]
            } else {
                target[axis]
            };
            let end = value.and_then(|value| value.checked_add(origin));
            match end.filter(|end| end.unsigned_abs() <= COORDINATE_MAX.unsigned_abs()) {
                Some(end) => target[axis] = end,
                None => {
                    let letter = config.axes[axis].letter;
                    return Err(Fault::new(block.place(letter), 1, NcErrorKind::OutOfRange));
                }
            }
        }
        Ok(target)
    }

    /// Feed in mm/s, or degree/s if no linear axis moves.
    #[inline]
    fn feed(&self, config: &Config, block: &Block, target: &[Nano; AXES]) -> Result<f32, Fault> {
        let mut linear = false;
        let mut rotary = false;
        for (axis, (from, to)) in config.axes.iter().zip(self.position.iter().zip(target)) {
            let moves = from != to;
            match axis.kind {
                AxisKind::Linear => linear |= moves,
                AxisKind::Rotary => rotary |= moves,
            }
        }
        let modal = &block.modal;
        let feed = if rotary && !linear {
            modal.feed_rotary
        } else {
            modal.feed_linear
        };
        if feed <= 0.0 && modal.mode != Mode::Rapid {
            return Err(Fault::new(block.first_axis, 0, |_| {
                NcErrorKind::MissingFeed
            }));
        }
        Ok(feed)
    }

    /// Hands out the pending `G6` block if its coefficients are complete, else keeps it.
    #[cold]
    fn continue_cubic(
        &mut self,
        config: &Config,
        block: &Block,
        emit: &mut dyn FnMut(Command),
    ) -> Result<(), Fault> {
        let Some(pending) = &self.pending else {
            return Ok(());
        };
        triples_up_to(block, pending.axes)?;
        self.k_count = block.k_count;
        if self.k_count < 3 * pending.axes {
            return Ok(());
        }
        let mut k = [[0; 3]; AXES];
        let triples = pending.order.iter().zip(self.k.chunks_exact(3));
        for (&axis, triple) in triples.take(pending.axes) {
            k[usize::from(axis) % AXES].copy_from_slice(triple);
        }
        emit(Command::Move(Move {
            block: self.line,
            motion: Motion::Cubic(CubicBlock {
                length: pending.length,
                k,
            }),
            target: pending.target,
            feed: pending.feed,
            feed_type: FeedType::PerTime,
            exact_stop: pending.exact_stop,
            soft: pending.soft,
            cutter: Cutter::OFF,
        }));
        let misc = pending.misc;
        self.position = pending.target;
        self.pending = None;
        self.k_count = 0;
        self.finish(config, misc, emit)
    }
}
