//! Wires the stages: background [`Controller`], interrupt [`Servo`], and the [`Core`] both live in.

use crate::config::Config;
use crate::stepgen::StepFrame;
use crate::units::{Position, Tick};

/// Requests that take effect at once, whatever is queued.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// `!`: feed hold; stop on the path.
    Hold,
    /// `~`: cycle start; resume after hold, `M0`, or an error.
    Resume,
    /// `0x18`: soft reset; stop, forget the program.
    Reset,
    /// A limit switch or the emergency stop opened.
    Fault,
}

/// Storage shared by the two halves. Make it static on a board.
pub struct Core {
    _private: (),
}

impl Core {
    /// Empty core.
    #[must_use]
    pub const fn new() -> Self {
        Self { _private: () }
    }

    /// Splits into the background half and the interrupt half.
    pub fn split<'a>(&'a mut self, config: &'a Config) -> (Controller<'a>, Servo<'a>) {
        (Controller { _config: config }, Servo { _config: config })
    }
}

impl Default for Core {
    fn default() -> Self {
        Self::new()
    }
}

/// What the interrupt half did last.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    /// Commanded position after this tick, Q32.32 steps.
    pub commanded: Position,
    /// Steps emitted since power-up per axis: `commanded` rounded half up.
    pub emitted: [i32; crate::units::AXES],
    /// Path velocity, mm/s (degree/s in a block that moves rotary axes only).
    pub feed: f32,
    /// Text line of the block being executed, 0 at rest.
    pub block: u32,
    /// A path is being followed.
    pub moving: bool,
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

/// Background half: text in, segments out.
pub struct Controller<'a> {
    _config: &'a Config,
}

impl Controller<'_> {
    /// One byte from the wire. Real-time bytes act at once and never take buffer space.
    pub fn receive(&mut self, _byte: u8) {
        unimplemented!()
    }
    /// Bytes the receive buffer can still take.
    #[must_use]
    pub fn receive_free(&self) -> usize {
        unimplemented!()
    }
    /// Next byte for the wire.
    pub fn transmit(&mut self) -> Option<u8> {
        unimplemented!()
    }
    /// Does one bounded piece of background work; `true` if there is more to do now.
    pub fn poll(&mut self, _now: Tick) -> bool {
        unimplemented!()
    }
    /// Real-time request, the same as its byte on the wire.
    pub fn event(&mut self, _event: Event) {
        unimplemented!()
    }
    /// Current state.
    #[must_use]
    pub fn state(&self) -> State {
        unimplemented!()
    }
    /// True when every byte received has been worked off and the machine is at rest.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        unimplemented!()
    }
    /// With `false` (power-up value `true`), `M0` and `M1` do not wait.
    pub fn set_program_stops(&mut self, _wait: bool) {
        unimplemented!()
    }
}

/// Interrupt half: one call per servo tick.
pub struct Servo<'a> {
    _config: &'a Config,
}

impl Servo<'_> {
    /// Advances one servo tick.
    pub fn tick(&mut self) -> StepFrame {
        unimplemented!()
    }
    /// What the last tick commanded.
    #[must_use]
    pub fn sample(&self) -> Sample {
        unimplemented!()
    }
    /// Digest of every frame of every tick in motion since power-up (64-bit FNV-1a; idle ticks do not count,
    /// so it does not depend on when bytes arrive).
    #[must_use]
    pub fn digest(&self) -> u64 {
        unimplemented!()
    }
}
