//! What a block means where the program stands: modal state and position come in with each line,
//! [`Command`]s in absolute machine coordinates go out.

use super::block::{Before, Block};
use super::command::{Auxiliary, Command, Cutter, FeedType, Motion, Move, Side, SplineKind};
use super::error::{Excerpt, Fault, NcError, NcErrorKind};
use super::fanuc::Nurbs;
use super::frames::{target, Frame};
use super::g6::Pending;
use super::heidenhain::Heidenhain;
use super::modal::{Lists, Modal, Tool};
use super::motion::{arc, check_words, moves, polynomial, spline};
use super::parameters::Parameters;
use super::special::{other_feed, tool_text};
use super::table::{FeedUnit, Misc, Mode};
use super::tools::{Mounted, Tools, NONE};
use super::values::{settle_distances, settle_feed, settle_speed};
use crate::catalogue::{dialect, nc as message};
use crate::config::{AxisKind, Config, Dialect};
use crate::units::{Nano, AXES};

/// Modal interpreter of one program after another.
#[derive(Clone, Debug)]
pub struct Interpreter {
    pub(super) modal: Modal,
    pub(super) position: [Nano; AXES],
    pub(super) axis_of: [u8; 26],
    pub(super) linear: u8,
    pub(super) tool: Option<Tool>,
    pub(super) tools: Tools,
    /// Side of the last block that moved.
    pub(super) applied: Side,
    pub(super) line: u32,
    pub(super) ended: bool,
    dialect: Dialect,
    pub(super) pending: Option<Pending>,
    pub(super) lists: Lists,
    pub(super) k_count: usize,
    pub(super) polynomial: u8,
    pub(super) parameters: Parameters,
    pub(super) nurbs: Nurbs,
    search: Option<Excerpt>,
    pub(super) heidenhain: Heidenhain,
}

impl Interpreter {
    /// Power-up state at machine position zero; the axis letters are those of `config`.
    #[must_use]
    pub fn new(config: &Config) -> Self {
        let mut axis_of = [u8::MAX; 26];
        let mut linear = 0;
        for (index, axis) in (0..).zip(&config.axes) {
            if let Some(entry) = axis_of.get_mut(usize::from(axis.letter.wrapping_sub(b'A'))) {
                *entry = index;
            }
            linear |= u8::from(axis.kind == AxisKind::Linear) << index;
        }
        Self {
            modal: Modal::power_up(config),
            position: [0; AXES],
            axis_of,
            linear,
            tool: None,
            tools: Tools::new(config),
            applied: Side::On,
            line: 0,
            ended: false,
            dialect: config.dialect,
            pending: None,
            lists: Lists::EMPTY,
            k_count: 0,
            polynomial: 0,
            parameters: Parameters::new(),
            nurbs: Nurbs::new(),
            search: None,
            heidenhain: Heidenhain::new(config),
        }
    }

    /// Power-up state again, line count 0. The position stays, and so do the tool in the spindle and the table that `G10`
    /// wrote: they are as real as the position.
    pub fn reset(&mut self, config: &Config) {
        self.heidenhain.reset(config);
        *self = Self {
            position: self.position,
            tools: self.tools.clone(),
            heidenhain: self.heidenhain,
            ..Self::new(config)
        };
    }

    /// Takes one physical line, without its line end, and hands its commands to `emit` in acting order.
    ///
    /// A `G6` line hands out what acts before its motion; the motion and what acts behind it follow
    /// with the last of its K lines. After the end of a program the next line is line 1 again.
    ///
    /// # Errors
    /// The first thing wrong with the line. Modal state, parameters and position are then as before the line, nothing
    /// of the line has been emitted, and what waits for more lines goes on waiting.
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
        if self.dialect == Dialect::Heidenhain {
            return self.conversational(config, text, emit);
        }
        if let Some(label) = self.search {
            if self.pass_over(text, label)? {
                return Ok(());
            }
        } else if self.plain(config, text, emit).is_some() {
            return Ok(());
        }
        self.general(config, text, emit)
    }

    /// Reads a line that may be anything, and acts on it.
    #[inline(never)]
    fn general(
        &mut self,
        config: &Config,
        text: &[u8],
        emit: &mut dyn FnMut(Command),
    ) -> Result<(), NcError> {
        let before = Before {
            axis_of: &self.axis_of,
            modal: &self.modal,
            only_k: self.pending.is_some(),
            k_count: self.k_count,
            polynomial: self.polynomial,
            dialect: self.dialect,
            linear: self.linear,
        };
        let mut block = Block::new(&before);
        let mut saved = None;
        let read = block.read(
            text,
            &before,
            &mut self.lists,
            &mut self.parameters,
            &mut saved,
        );
        let result = read.and_then(|()| match self.pending {
            Some(_) => self.continue_cubic(config, &block, emit),
            None => self.act(config, &mut block, emit),
        });
        match result {
            Ok(()) => {
                if block.label.is_some() || self.search.is_some() {
                    self.search = block.label.filter(|_| !self.ended);
                }
                Ok(())
            }
            Err(fault) => {
                if let Some(parameters) = saved {
                    self.parameters = parameters;
                }
                let mut error = self.error(&fault, text);
                if error.kind.message == &message::UNKNOWN_TOOL {
                    error.kind.excerpt = tool_text(block.tool.or(self.tool));
                }
                Err(error)
            }
        }
    }

    /// Says that the program goes no further.
    ///
    /// Lines are acted on as they come, so nothing is ever held back but what needs the lines behind it.
    /// A pause of the sender is no reason to call this.
    ///
    /// # Errors
    /// At the line behind the last, if something was left unfinished; it is forgotten: a `G6` block without all its K
    /// lines, the coefficients of a `POLY` block without its coordinates, a NURBS curve without its last knots, the search
    /// for a label.
    pub fn flush(
        &mut self,
        _config: &Config,
        _emit: &mut dyn FnMut(Command),
    ) -> Result<(), NcError> {
        let kind = if let Some(excerpt) = self.search {
            Some(NcErrorKind {
                message: &message::LABEL_NOT_FOUND,
                excerpt,
            })
        } else if self.pending.is_some() {
            Some(NcErrorKind::new(&message::MISSING_COEFFICIENTS))
        } else if self.polynomial != 0 {
            Some(NcErrorKind::new(&message::MISSING_END_POINT))
        } else if self.heidenhain.forget() {
            Some(NcErrorKind::new(&dialect::H_SPLINE_WORDS))
        } else {
            let open = self.nurbs.end().err();
            open.map(|refusal| NcErrorKind::new(refusal.message))
        };
        self.forget();
        kind.map_or(Ok(()), |kind| {
            Err(NcError {
                line: self.line.saturating_add(1),
                column: 1,
                kind,
            })
        })
    }

    /// Forgets what waits for lines to come.
    fn forget(&mut self) {
        self.pending = None;
        self.k_count = 0;
        self.polynomial = 0;
        self.search = None;
        self.nurbs.reset();
        self.heidenhain.forget();
    }

    /// True while something that was read waits for lines to come: what [`Interpreter::flush`] would refuse.
    #[must_use]
    pub fn is_open(&self) -> bool {
        // of a copy: asking ends nothing
        let mut nurbs = self.nurbs;
        self.search.is_some()
            || self.pending.is_some()
            || self.polynomial != 0
            || self.heidenhain.is_open()
            || nurbs.end().is_err()
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
    /// What waits for lines to come is forgotten, a spline begins anew, and compensation has to be approached again.
    pub fn set_position(&mut self, position: [Nano; AXES]) {
        self.position = position;
        self.modal.first = true;
        self.applied = Side::On;
        self.forget();
    }

    /// Tool selected by `T`, if any was.
    #[must_use]
    pub fn tool(&self) -> Option<Tool> {
        self.tool
    }

    /// The tool table, and the tool in the spindle.
    #[must_use]
    pub fn tools(&self) -> &Tools {
        &self.tools
    }

    /// Dialect the lines are read in.
    #[must_use]
    pub fn dialect(&self) -> Dialect {
        self.dialect
    }

    /// Reads the lines to come in `dialect`, until it is set again or [`Interpreter::reset`].
    /// What waits for lines to come is forgotten.
    pub fn set_dialect(&mut self, dialect: Dialect) {
        self.dialect = dialect;
        self.forget();
    }

    #[cold]
    pub(super) fn error(&self, fault: &Fault, text: &[u8]) -> NcError {
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
        self.settle_degree(block)?;
        let mounted = self.settle_tool(block)?;
        settle_distances(block);
        if let Some(special) = block.special {
            return self.special(config, block, special, mounted, emit);
        }
        settle_speed(block)?;
        settle_feed(block)?;
        if self.polynomial != 0 {
            self.check_polynomial(block)?;
        }
        if (self.nurbs.active() || block.modal.mode == Mode::Nurbs)
            && self.nurbs_line(config, block, mounted, emit)?
        {
            return Ok(());
        }
        check_words(block, false)?;
        if !moves(block) {
            self.commit(block, mounted, emit);
            return self.finish(config, block.misc, emit);
        }
        let frame = Frame::new(
            config,
            &block.modal,
            block.suppress,
            self.length(block, mounted),
        );
        let target = target(config, block, &frame, &self.position)?;
        let mut motion = self.template(config, block, &target, mounted)?;
        match block.modal.mode {
            Mode::Linear => {}
            Mode::Rapid => motion.motion = Motion::Rapid,
            Mode::Spline(kind) => {
                let spec = spline(config, block, &frame, kind)?;
                motion.motion = Motion::Spline(spec);
                if let Some(point) = &spec.tool_point {
                    self.lead_tool(config, block, &mut motion, point)?;
                }
            }
            Mode::Arc(clockwise) => {
                let arc = arc(config, block, &frame, &self.position, &target, clockwise)?;
                motion.motion = Motion::Arc(arc);
            }
            Mode::Polynomial => {
                motion.motion = Motion::Polynomial(polynomial(config, block, &frame, &self.lists)?);
                block.polynomial = 0;
            }
            Mode::Cubic | Mode::Nurbs => {
                return self.begin_cubic(config, block, &motion, mounted, emit)
            }
        }
        block.modal.first = false;
        self.commit(block, mounted, emit);
        self.applied = motion.cutter.side;
        self.position = motion.target;
        emit(Command::Move(motion));
        self.finish(config, block.misc, emit)
    }

    /// The move of a line to `target` at feed, straight; what `act` does with it stands there.
    ///
    /// # Errors
    /// No feed, or a change of the compensation on a curve.
    #[inline]
    pub(super) fn template(
        &self,
        config: &Config,
        block: &Block,
        target: &[Nano; AXES],
        mounted: Mounted,
    ) -> Result<Move, Fault> {
        let feed = self.feed(config, block, target)?;
        let modal = &block.modal;
        let inverse = modal.feed_unit == FeedUnit::Inverse && modal.mode != Mode::Rapid;
        let cutter = if modal.side == Side::On && self.applied == Side::On {
            Cutter::OFF
        } else {
            self.cutter(block, mounted)?
        };
        Ok(Move {
            block: self.line,
            motion: Motion::Linear,
            target: *target,
            feed,
            feed_type: if inverse {
                FeedType::Inverse
            } else {
                FeedType::PerTime
            },
            exact_stop: block.exact_stop || modal.exact_stop,
            soft: modal.soft,
            rounding: modal.rounding(),
            cutter,
        })
    }

    /// Compensation of a line that moves.
    #[cold]
    fn cutter(&self, block: &Block, mounted: Mounted) -> Result<Cutter, Fault> {
        let modal = &block.modal;
        if modal.side != self.applied && !matches!(modal.mode, Mode::Rapid | Mode::Linear) {
            return Err(Fault::new(block.first_axis, 0, &message::SIDE_CHANGE));
        }
        if modal.side == Side::On {
            return Ok(Cutter::OFF);
        }
        Ok(Cutter {
            side: modal.side,
            corner: modal.corner,
            feed: modal.feed_reference,
            plane: modal.plane,
            radius: if modal.offsets {
                self.tools.radius(mounted)
            } else {
                0
            },
        })
    }

    /// Tool length in force, 1e-6 mm.
    #[inline]
    pub(super) fn length(&self, block: &Block, mounted: Mounted) -> Nano {
        if block.modal.offsets {
            self.tools.length(mounted)
        } else {
            0
        }
    }

    /// The point of no return of a line: modal state, tool, and what acts before the motion.
    pub(super) fn commit(
        &mut self,
        block: &Block,
        mounted: Mounted,
        emit: &mut dyn FnMut(Command),
    ) {
        self.modal = block.modal;
        self.polynomial = block.polynomial;
        if self.nurbs.active() {
            self.nurbs.reset();
        }
        if block.tool.is_some() {
            self.tool = block.tool;
        }
        if let Some(text) = block.message {
            emit(Command::Message(text));
        }
        if block.misc & Misc::BEFORE != 0 {
            self.tools.mount(mounted);
            self.auxiliaries(block.misc & Misc::BEFORE, block.gear, emit);
        }
    }

    /// What acts behind the motion.
    #[inline]
    pub(super) fn finish(
        &mut self,
        config: &Config,
        misc: u16,
        emit: &mut dyn FnMut(Command),
    ) -> Result<(), Fault> {
        let misc = misc & !Misc::BEFORE;
        if misc != 0 {
            self.auxiliaries(misc, 0, emit);
            if misc & Misc::ProgramEnd.bit() != 0 {
                self.modal = Modal::power_up(config);
                self.applied = Side::On;
                self.nurbs.reset();
                self.parameters = Parameters::new();
                self.ended = true;
            }
        }
        Ok(())
    }

    #[cold]
    fn auxiliaries(&self, misc: u16, gear: u8, emit: &mut dyn FnMut(Command)) {
        let speed = self.modal.speed;
        for function in Misc::ORDER {
            if misc & function.bit() == 0 {
                continue;
            }
            let auxiliary = match function {
                Misc::ToolChange => Auxiliary::ToolChange,
                Misc::GearStage => Auxiliary::GearStage(gear),
                Misc::SpindleClockwise => Auxiliary::SpindleClockwise(speed),
                Misc::SpindleCounterClockwise => Auxiliary::SpindleCounterClockwise(speed),
                Misc::CoolantOn => Auxiliary::CoolantOn,
                Misc::SpindleStop => Auxiliary::SpindleStop,
                Misc::CoolantOff => Auxiliary::CoolantOff,
                Misc::Stop => Auxiliary::Stop,
                Misc::OptionalStop => Auxiliary::OptionalStop,
                Misc::ProgramEnd => {
                    emit(Command::ProgramEnd);
                    continue;
                }
            };
            emit(Command::Auxiliary(auxiliary));
        }
    }

    /// `SD`: before the first point of a B-spline.
    #[inline]
    fn settle_degree(&self, block: &mut Block) -> Result<(), Fault> {
        let Some(degree) = block.degree else {
            return Ok(());
        };
        let modal = &mut block.modal;
        match modal.mode {
            Mode::Spline(SplineKind::BSpline) => {
                if !modal.first && modal.degree != degree.value {
                    return Err(Fault::new(degree.at, 0, &message::DEGREE_CHANGE));
                }
                modal.degree = degree.value;
                Ok(())
            }
            Mode::Spline(_) => Ok(()),
            _ => Err(Fault::new(degree.at, 2, &message::UNEXPECTED_WORD)),
        }
    }

    /// The tool in the spindle once the line has acted, and what may not be under compensation.
    #[inline]
    fn settle_tool(&self, block: &Block) -> Result<Mounted, Fault> {
        let mut mounted = self.tools.in_spindle();
        if block.misc & Misc::ToolChange.bit() != 0 {
            if let Some(tool) = block.tool.or(self.tool) {
                mounted = match self.tools.find(tool) {
                    Some(mounted) => mounted,
                    None => {
                        let at = block.needs_g40.map_or(0, |word| word.at);
                        return Err(Fault::new(at, 0, &message::UNKNOWN_TOOL));
                    }
                };
            }
        }
        if block.modal.side != Side::On || self.applied != Side::On {
            self.check_compensation(block, mounted)?;
        }
        Ok(mounted)
    }

    #[cold]
    fn check_compensation(&self, block: &Block, mounted: Mounted) -> Result<(), Fault> {
        if self.applied != Side::On {
            if let Some(word) = block.needs_g40 {
                return Err(Fault::new(word.at, word.value, &message::COMPENSATION_ON));
            }
            if block.modal.offsets != self.modal.offsets {
                return Err(Fault::new(block.place(b'D'), 1, &message::COMPENSATION_ON));
            }
        }
        if block.modal.side != Side::On && mounted == NONE {
            let at = block.side_at.unwrap_or(block.first_axis);
            return Err(Fault::new(at, 0, &message::NO_TOOL));
        }
        Ok(())
    }

    /// Feed in mm/s, or degree/s if no linear axis moves; blocks per second under `G93`.
    #[inline]
    pub(super) fn feed(
        &self,
        config: &Config,
        block: &Block,
        target: &[Nano; AXES],
    ) -> Result<f32, Fault> {
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
        if modal.mode == Mode::Rapid {
            return Ok(feed);
        }
        if modal.feed_unit != FeedUnit::Minute {
            return other_feed(block, feed);
        }
        if feed <= 0.0 {
            return Err(Fault::new(block.first_axis, 0, &message::MISSING_FEED));
        }
        Ok(feed)
    }
}
