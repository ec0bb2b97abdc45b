//! Rounds corners (`G641`, `G642`): the stage between the compensated path and its arc length.
//!
//! In: [`PathSegment`]s in path order. Out: the same, with the ends of the two segments at a corner replaced by cubics that
//! leave the first and join the second with its tangent, and with its curvature where the corner stands alone. Segments
//! of a program that rounds nothing pass unchanged, bit for bit. At most one segment is held back, so what comes out
//! depends on the segments alone and not on when they come.
//!
//! | word | the path leaves the first segment and joins the second |
//! |---|---|
//! | `G641` | at most `ADIS` (`ADISPOS` between blocks in rapid motion) before and behind the corner |
//! | `G642` | where no axis gets further off than its `rounding_tolerance` |
//!
//! Never more than half a segment goes, so the corners at its two ends do not meet. What stays as programmed: exact
//! stops, changes between feed and rapid motion, joints without a turn, turns of more than 169 degrees, corners between
//! motion of linear axes and of rotary axes alone, and the ends of the path.
//!
//! | file | does |
//! |---|---|
//! | `branch` | the path on either side of a corner |
//! | `corner` | whether and how far back |
//! | `blend` | the curves |

mod blend;
mod branch;
mod corner;
#[cfg(test)]
mod tests;

use heapless::Deque;

use super::segment::{HermiteSegment, PathSegment};
use crate::config::Config;
use crate::nc::command::{Cutter, Rounding};
use crate::units::Position;
use corner::Corner;

/// Most that one segment lets go: the rest of the one before it, a corner, and itself.
const CAPACITY: usize = blend::CUBICS + 2;

/// The segment held back.
#[derive(Clone, Copy, Debug)]
pub(super) struct Held {
    pub path: PathSegment,
    /// Share of it that the corner at its end may take.
    pub share: f32,
}

/// The rounding stage. Static, no heap.
#[derive(Default)]
pub struct Rounder {
    held: Option<Held>,
    out: Deque<PathSegment, CAPACITY>,
}

impl Rounder {
    /// A stage that holds nothing.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            held: None,
            out: Deque::new(),
        }
    }

    /// Forgets everything.
    pub fn reset(&mut self) {
        self.held = None;
        self.out.clear();
    }

    /// True while a segment that was taken has not been handed out.
    #[must_use]
    pub fn has_pending(&self) -> bool {
        self.held.is_some() || !self.out.is_empty()
    }

    /// True if `next` would come out as it is and at once: there is no need to ask this stage.
    #[inline]
    #[must_use]
    pub fn passes(&self, next: &PathSegment) -> bool {
        next.rounding == Rounding::None && !self.has_pending()
    }

    /// Takes the next segment of the path. [`Rounder::pop`] must have been called until it gave `None`.
    #[inline(never)]
    pub fn push(&mut self, config: &Config, next: &PathSegment) {
        let mut path = *next;
        // All of it before its corner takes any.
        let mut share = 0.5;
        if let Some(held) = self.held.take() {
            match Corner::new(config, &held, next) {
                Some(corner) => {
                    if let Some(segment) = corner.before {
                        self.emit(&PathSegment {
                            segment,
                            ..held.path
                        });
                    }
                    for (index, segment) in corner.cubics.iter().enumerate() {
                        // The longer part of what was the first block's runs under its number.
                        let is_last = index > 0 && index + 1 == corner.cubics.len();
                        self.emit(&rounded(&held.path, next, segment, is_last));
                    }
                    share = corner.share;
                    match corner.behind {
                        Some(segment) => path.segment = segment,
                        // Half of a segment is always left.
                        None => return,
                    }
                }
                None => self.emit(&held.path),
            }
        }
        if path.rounding == Rounding::None || path.exact_stop {
            self.emit(&path);
        } else {
            self.held = Some(Held { path, share });
        }
    }

    /// Next segment in path order; `None` if it takes another one, or the end of the path, to know it.
    pub fn pop(&mut self) -> Option<PathSegment> {
        self.out.pop_front()
    }

    /// The path ends here for now (standstill, program end, time-out): what was held back goes to its programmed end.
    ///
    /// With `stop`, the path rests there. Says where that is if anything was held back; all else has been handed out or
    /// waits for [`Rounder::pop`].
    pub fn finish(&mut self, stop: bool) -> Option<Position> {
        let mut held = self.held.take()?;
        held.path.exact_stop |= stop;
        self.emit(&held.path);
        Some(held.path.segment.end)
    }

    fn emit(&mut self, path: &PathSegment) {
        // There is room: a segment lets CAPACITY go at most, and all of it has been handed out before the next.
        let _ = self.out.push_back(*path);
    }
}

/// A part of the corner between `before` and `behind`.
fn rounded(
    before: &PathSegment,
    behind: &PathSegment,
    segment: &HermiteSegment,
    is_last: bool,
) -> PathSegment {
    PathSegment {
        segment: *segment,
        block: if is_last { behind.block } else { before.block },
        feed: before.feed.min(behind.feed),
        exact_stop: false,
        soft: before.soft || behind.soft,
        rounding: Rounding::None,
        spline: false,
        cutter: Cutter::OFF,
    }
}
