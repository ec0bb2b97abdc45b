//! The look-ahead window: limits and length of every segment that has not been driven yet, and how it may be driven.

use super::joint::Taken;
use super::limits::CurveLimits;

/// Segments the window can hold, those included that are planned but not driven yet.
pub const NODES: usize = 157;

/// One segment as the planner sees it. Words are enough for the alignment of what lies in the window.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(Rust, packed(4))]
pub struct Node {
    /// Length, Q10.54.
    pub length_q: i64,
    /// Length, path units.
    pub length: f32,
    /// Limits inside.
    pub limits: CurveLimits,
    /// Velocity allowed over the joint at its end.
    pub exit_v: f32,
    /// What passing that joint takes.
    pub exit_taken: Taken,
    /// The path comes to rest at its end.
    pub stop: bool,
    /// Limited in acceleration, not in jerk.
    pub brisk: bool,
    /// Velocity the curve itself allows.
    pub curve_v: f32,
    /// Velocity the program asks for: the feed, in rapid motion that of the fastest axis.
    pub programmed_v: f32,
    /// Rapid motion: the rapid override counts.
    pub rapid: bool,
    /// `exit_v` is that of a feed override above 100 %.
    pub raised: bool,
    /// The same for the other range of overrides.
    pub other_v: f32,
}

/// Where there is no node.
const EMPTY: Node = Node {
    stop: true,
    ..UNUSED
};

/// A place in the ring that holds none: all zeros, so that a static ring needs neither flash nor a copy on the stack.
const UNUSED: Node = Node {
    length_q: 0,
    length: 0.0,
    limits: CurveLimits::NONE,
    exit_v: 0.0,
    exit_taken: Taken::NONE,
    stop: false,
    brisk: false,
    curve_v: 0.0,
    programmed_v: 0.0,
    rapid: false,
    raised: false,
    other_v: 0.0,
};

/// Ring of nodes, oldest first.
pub struct Nodes {
    ring: [Node; NODES],
    head: usize,
    len: usize,
}

impl Nodes {
    /// Empty window.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            ring: [UNUSED; NODES],
            head: 0,
            len: 0,
        }
    }

    /// Number of nodes.
    #[must_use]
    pub fn len(&self) -> usize {
        self.len
    }

    /// True if there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// True if nothing more fits.
    #[must_use]
    pub fn is_full(&self) -> bool {
        self.len == NODES
    }

    /// Appends; the caller has checked [`Self::is_full`].
    pub fn push(&mut self, node: Node) {
        debug_assert!(!self.is_full());
        self.ring[self.place(self.len)] = node;
        self.len += 1;
    }

    /// Place in the ring of the node `index` places behind the oldest, up to one behind the newest.
    #[inline]
    fn place(&self, index: usize) -> usize {
        let place = self.head + index;
        if place < NODES {
            place
        } else {
            place - NODES
        }
    }

    /// Drops the oldest.
    pub fn pop(&mut self) {
        if self.len > 0 {
            self.head = self.place(1);
            self.len -= 1;
        }
    }

    /// Drops all.
    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// The node `index` places behind the oldest, to be written; `None` where there is none.
    pub fn get_mut(&mut self, index: usize) -> Option<&mut Node> {
        if index < self.len {
            Some(&mut self.ring[self.place(index)])
        } else {
            None
        }
    }

    /// The node `index` places behind the oldest; a stop of zero length where there is none.
    #[must_use]
    pub fn get(&self, index: usize) -> &Node {
        if index < self.len {
            &self.ring[self.place(index)]
        } else {
            &EMPTY
        }
    }
}

impl Default for Nodes {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn node_takes_no_more_than_a_hundred_and_forty_bytes() {
        assert!(size_of::<Node>() <= 140, "{}", size_of::<Node>());
    }
}
