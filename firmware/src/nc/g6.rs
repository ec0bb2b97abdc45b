//! `G6` blocks, whose K words may stand on lines of their own: a block waits here until it has all of them.

use super::block::Block;
use super::command::{Command, CubicBlock, Cutter, FeedType, Motion, Move, Rounding};
use super::error::Fault;
use super::interpreter::Interpreter;
use super::tools::Mounted;
use super::values::{cubic_length, triples_up_to};
use crate::config::Config;
use crate::units::{Nano, AXES};

/// A `G6` block whose K words have not all come.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pending {
    target: [Nano; AXES],
    length: Nano,
    feed: f32,
    feed_type: FeedType,
    exact_stop: bool,
    soft: bool,
    rounding: Rounding,
    cutter: Cutter,
    order: [u8; AXES],
    axes: usize,
    misc: u16,
}

impl Interpreter {
    /// A `G6` block: waits for its coefficients, if they do not stand in the same line.
    #[cold]
    pub(super) fn begin_cubic(
        &mut self,
        config: &Config,
        block: &mut Block,
        motion: &Move,
        mounted: Mounted,
        emit: &mut dyn FnMut(Command),
    ) -> Result<(), Fault> {
        let length = cubic_length(block)?;
        triples_up_to(block, block.axes)?;
        block.modal.first = false;
        self.commit(block, mounted, emit);
        self.pending = Some(Pending {
            target: motion.target,
            length,
            feed: motion.feed,
            feed_type: motion.feed_type,
            exact_stop: motion.exact_stop,
            soft: motion.soft,
            rounding: motion.rounding,
            cutter: motion.cutter,
            order: block.order,
            axes: block.axes,
            misc: block.misc,
        });
        self.continue_cubic(config, block, emit)
    }

    /// Hands out the pending `G6` block if its coefficients are complete, else keeps it.
    #[cold]
    pub(super) fn continue_cubic(
        &mut self,
        config: &Config,
        block: &Block,
        emit: &mut dyn FnMut(Command),
    ) -> Result<(), Fault> {
        let Some(pending) = self.pending else {
            return Ok(());
        };
        triples_up_to(block, pending.axes)?;
        self.k_count = block.k_count;
        if self.k_count < 3 * pending.axes {
            return Ok(());
        }
        let mut k = [[0; 3]; AXES];
        let triples = pending.order.iter().zip(self.lists.k.chunks_exact(3));
        for (&axis, triple) in triples.take(pending.axes) {
            k[usize::from(axis) % AXES].copy_from_slice(triple);
        }
        self.position = pending.target;
        self.applied = pending.cutter.side;
        self.pending = None;
        self.k_count = 0;
        emit(Command::Move(Move {
            block: self.line,
            motion: Motion::Cubic(CubicBlock {
                length: pending.length,
                k,
            }),
            target: pending.target,
            feed: pending.feed,
            feed_type: pending.feed_type,
            exact_stop: pending.exact_stop,
            soft: pending.soft,
            rounding: pending.rounding,
            cutter: pending.cutter,
        }));
        self.finish(config, pending.misc, emit)
    }
}
