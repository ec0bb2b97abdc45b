//! Wires the stages: background [`Controller`], interrupt [`Servo`], and the [`Core`] both live in.

mod controller;
mod servo;
pub(crate) mod shared;
pub mod timetable;

use core::cell::Cell;

use heapless::spsc::Queue;

use crate::config::Config;
use crate::geometry::arc::ServoSegment;
use crate::interpolator::Piece;
use crate::planner::nodes::{Nodes, NODES};
use crate::planner::tempo::Request;
use crate::planner::Planner;
use crate::units::{Position, AXES};

pub use controller::Controller;
use controller::Stages;
pub use servo::Servo;
use shared::Shared;

/// Profile pieces between background and interrupt.
const PIECES: usize = 48;

/// Requests on their way from the interrupt to the planner; one place of a queue stays empty.
const REQUESTS: usize = 16;

/// Requests that take effect at once, whatever is queued.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// `!`: feed hold; stop on the path.
    Hold,
    /// `~`: cycle start; resume after hold, `M0`, or an error.
    Resume,
    /// `0x18`: soft reset; stop on the path, forget the program.
    Reset,
    /// A limit switch or the emergency stop opened: no step from now on.
    Fault,
    /// Feed override in percent, 0 to 200. 0 stops on the path until it is raised.
    Feed(u8),
    /// Rapid override in percent, 0 to 100. 0 stops on the path until it is raised.
    Rapid(u8),
    /// For so many ticks of motion no further segments come.
    Starve(u32),
}

/// State as the status report names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// Nothing to do.
    Idle,
    /// Following a path, dwelling, or waiting for more text of one.
    Run,
    /// Stopped or stopping on the path after `!`, or waiting at `M0`.
    Hold,
    /// An error latched; waits for `~` or reset.
    Alarm,
}

/// What the interrupt half did last.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    /// Commanded position after this tick, Q32.32 steps.
    pub commanded: Position,
    /// Steps emitted since power-up per axis: `commanded` rounded half up.
    pub emitted: [i32; AXES],
    /// Path velocity, mm/s (degree/s in a block that moves rotary axes only).
    pub feed: f32,
    /// Text line of the block being executed, 0 at rest.
    pub block: u32,
    /// A path is being followed: the frame of this tick counts for the digest.
    pub moving: bool,
}

/// A place in static storage, filled once at start.
///
/// `Cell` hides the spare bit patterns of `T`, so an empty place is all zeros whatever `T` is and takes no flash; filled
/// where it lies, a stage does not travel over the stack.
pub(crate) struct Place<T>(Option<Cell<T>>);

impl<T> Place<T> {
    /// Nothing in it.
    pub const fn empty() -> Self {
        Self(None)
    }

    /// Puts what `make` gives into the place. Never inlined: the frames of several would add up.
    #[inline(never)]
    pub fn fill(&mut self, make: impl FnOnce() -> T) -> &mut T {
        self.0.insert(Cell::new(make())).get_mut()
    }
}

/// Storage of the two halves. Make it static on a board.
pub struct Core {
    stages: Stages,
    nodes: Nodes,
    segments: Queue<ServoSegment, NODES>,
    pieces: Queue<Piece, PIECES>,
    requests: Queue<Request, REQUESTS>,
    shared: Shared,
}

impl Core {
    /// Empty core.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            stages: Stages::empty(),
            nodes: Nodes::new(),
            segments: Queue::new(),
            pieces: Queue::new(),
            requests: Queue::new(),
            shared: Shared::new(),
        }
    }

    /// Splits into the background half and the interrupt half.
    pub fn split<'a>(&'a mut self, config: &'a Config) -> (Controller<'a>, Servo<'a>) {
        let (segments_in, segments_out) = self.segments.split();
        let (pieces_in, pieces_out) = self.pieces.split();
        let (requests_in, requests_out) = self.requests.split();
        let planner = Planner::new(
            segments_in,
            pieces_in,
            requests_out,
            &self.shared,
            &mut self.nodes,
        );
        (
            Controller::new(config, planner, &self.shared, &mut self.stages),
            Servo::new(segments_out, pieces_out, requests_in, &self.shared, config),
        )
    }
}

impl Default for Core {
    fn default() -> Self {
        Self::new()
    }
}
