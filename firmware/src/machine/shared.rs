//! What the servo interrupt tells the background, and the two requests that go the other way.
//!
//! Single words only: each is written by one side and read by the other. Values that take more than a word
//! (position, path coordinate) are written before `moving` is cleared and read only while it is.

use core::sync::atomic::{AtomicBool, AtomicI32, AtomicU32, Ordering};

use crate::units::AXES;

/// A 64-bit value in two words.
#[derive(Debug)]
pub(crate) struct Wide([AtomicU32; 2]);

/// A 128-bit value in four words.
#[derive(Debug)]
pub(crate) struct Wider([Wide; 2]);

impl Wider {
    pub(crate) fn store(&self, value: i128) {
        self.0[0].store(value as i64);
        self.0[1].store((value >> 64) as i64);
    }
    pub(crate) fn load(&self) -> i128 {
        i128::from(self.0[1].load()) << 64 | i128::from(self.0[0].load() as u64)
    }
}

impl Wide {
    const fn new() -> Self {
        Self([AtomicU32::new(0), AtomicU32::new(0)])
    }
    pub(crate) fn store(&self, value: i64) {
        self.0[0].store(value as u32, Ordering::Relaxed);
        self.0[1].store((value >> 32) as u32, Ordering::Relaxed);
    }
    pub(crate) fn load(&self) -> i64 {
        let low = self.0[0].load(Ordering::Relaxed);
        let high = self.0[1].load(Ordering::Relaxed);
        (i64::from(high) << 32) | i64::from(low)
    }
}

/// The mailbox. All zero at power-up, so that a static machine takes no space in flash.
#[derive(Debug)]
pub(crate) struct Shared {
    /// Ticks in motion so far, wrapping.
    pub(crate) executed: AtomicU32,
    /// Running number of the segment being followed, wrapping.
    pub(crate) sequence: AtomicU32,
    /// Counts how often the interrupt gave up the plan: pieces of an older generation are void.
    pub(crate) generation: AtomicU32,
    /// A piece is running.
    pub(crate) moving: AtomicBool,
    /// From rest, motion may begin: the planner is ahead far enough, or has planned all there is.
    pub(crate) ready: AtomicBool,
    /// Path coordinate at rest.
    pub(crate) rest_s: Wider,
    /// Commanded position at rest, Q32.32 steps.
    pub(crate) rest_position: [Wide; AXES],
    /// Steps emitted.
    pub(crate) emitted: [AtomicI32; AXES],
    /// Path velocity, 2^-30 path units per tick.
    pub(crate) feed: AtomicI32,
    /// Text line being executed.
    pub(crate) block: AtomicU32,
    /// Request: throw away everything queued (answered by clearing it, at rest).
    pub(crate) drain: AtomicBool,
    /// Request: no step from now on.
    pub(crate) fault: AtomicBool,
    /// Request: come to rest on the path and stay there. Counts holds and resumes; odd while held, and every odd number
    /// is answered once, by a new generation.
    pub(crate) hold: AtomicU32,
}

impl Shared {
    pub(crate) const fn new() -> Self {
        Self {
            executed: AtomicU32::new(0),
            sequence: AtomicU32::new(0),
            generation: AtomicU32::new(0),
            moving: AtomicBool::new(false),
            ready: AtomicBool::new(false),
            rest_s: Wider([Wide::new(), Wide::new()]),
            rest_position: [const { Wide::new() }; AXES],
            emitted: [const { AtomicI32::new(0) }; AXES],
            feed: AtomicI32::new(0),
            block: AtomicU32::new(0),
            drain: AtomicBool::new(false),
            fault: AtomicBool::new(false),
            hold: AtomicU32::new(0),
        }
    }

    /// Asks for a hold, or takes it back. The interrupt answers one by a new generation, in the next tick or where it lands.
    ///
    /// Background and interrupt may both ask.
    pub(crate) fn request_hold(&self, hold: bool) {
        let next = |count: u32| ((count & 1 != 0) != hold).then(|| count.wrapping_add(1));
        // Refused if that is what is asked for already.
        let _ = self
            .hold
            .fetch_update(Ordering::Release, Ordering::Relaxed, next);
    }

    /// A hold was asked for and not yet taken back.
    pub(crate) fn is_holding(&self) -> bool {
        self.hold.load(Ordering::Relaxed) & 1 != 0
    }
}
