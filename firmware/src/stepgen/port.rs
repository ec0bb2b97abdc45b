//! Step frames to port words: what the DMA of a board writes to the set/reset register of its step port.
//!
//! In: the [`StepFrame`] of a servo tick. Out: one 32-bit word per slot; bit `p` (0..16) sets pin `p`, bit
//! `p + 16` resets it, a zero word changes nothing (`GPIOx_BSRR`, RM0090 8.4.7). Integer only, no branch on
//! anything but the frame, no hardware: the host tests what the board sends.
//!
//! Timing within a tick, in slots. A step pin rises in the slot the frame names and falls `pulse_slots`
//! later. A direction pin changes `dir_setup_slots` before the first edge that needs it. The frame
//! generator leaves the room: pulses of an axis are at least `pulse_slots + 1` apart, and after a change
//! of direction no edge falls into the first `2 * pulse_slots + dir_setup_slots` slots, so that a pulse
//! still standing from the tick before has ended, and has stood still for its width, before its direction
//! pin moves.

use core::cell::Cell;

use super::{AxisSteps, StepFrame, SLOTS};
use crate::config::Config;
use crate::units::AXES;

/// Words of one tick.
pub type PortWords = [u32; SLOTS as usize];

/// Words of one tick, and whether any of them is not zero.
pub struct PortBuffer {
    words: PortWords,
    used: bool,
}

impl PortBuffer {
    /// Nothing changes.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            words: [0; SLOTS as usize],
            used: false,
        }
    }

    /// What goes out, one word per slot.
    #[must_use]
    pub fn words(&self) -> &PortWords {
        &self.words
    }

    /// Makes all words zero, if they are not.
    #[inline(always)]
    fn clear(&mut self) {
        if self.used {
            self.used = false;
            self.words.fill(0);
        }
    }
}

impl Default for PortBuffer {
    fn default() -> Self {
        Self::new()
    }
}

/// Which pins of the step port carry what, and how wide pulses are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PinMap {
    /// Step pin of each axis, 0..16.
    pub step: [u8; AXES],
    /// Direction pin of each axis, 0..16.
    pub dir: [u8; AXES],
    /// Bit `a` set: the direction pin of axis `a` is high while it counts up (else while it counts down).
    pub dir_high_is_positive: u8,
    /// Width of a step pulse, slots.
    pub pulse_slots: u16,
    /// Slots a direction stands before a step edge.
    pub dir_setup_slots: u16,
}

impl PinMap {
    /// Steps on pins 0..5, directions on pins 5..10 (high counts down), timing from `config`.
    #[must_use]
    pub const fn new(config: &Config) -> Self {
        Self {
            step: [0, 1, 2, 3, 4],
            dir: [5, 6, 7, 8, 9],
            dir_high_is_positive: 0,
            pulse_slots: config.pulse_slots,
            dir_setup_slots: config.dir_setup_slots,
        }
    }

    /// Word that brings all step and direction pins to low.
    #[must_use]
    pub fn all_low(&self) -> u32 {
        (0..AXES).fold(0, |word, a| word | reset(self.step[a]) | reset(self.dir[a]))
    }
}

const fn set(pin: u8) -> u32 {
    1 << (pin & 15)
}

const fn reset(pin: u8) -> u32 {
    1 << ((pin & 15) + 16)
}

/// No pulse stands over.
const NONE: u16 = u16::MAX;
/// No direction yet.
const UNKNOWN: u8 = 2;

/// Expands frames, and remembers what reaches over the end of a tick.
#[derive(Clone, Copy, Debug)]
pub struct PortExpander {
    pins: PinMap,
    /// Slot of the next tick in which the step pin of an axis falls, or [`NONE`]; the pulses of an axis do not overlap,
    /// so there is one at most.
    falling: [u16; AXES],
    /// One of them is not [`NONE`].
    standing: bool,
    /// What sets the step pin of an axis; 16 bits higher, it resets it.
    rise: [u32; AXES],
    /// Direction the pin shows, 1 where it counts down; [`UNKNOWN`] before the first step.
    direction: [u8; AXES],
}

impl PortExpander {
    /// No pulse standing, directions unknown.
    #[must_use]
    pub const fn new(pins: &PinMap) -> Self {
        let mut rise = [0; AXES];
        let mut a = 0;
        while a < AXES {
            rise[a] = set(pins.step[a]);
            a += 1;
        }
        Self {
            pins: *pins,
            falling: [NONE; AXES],
            standing: false,
            rise,
            direction: [UNKNOWN; AXES],
        }
    }

    /// Writes all words of the tick that `frame` describes, `None` if no axis steps in it.
    ///
    /// An edge beyond the last slot (no correct frame has one) is put into the last slot.
    #[inline]
    pub fn expand(&mut self, frame: Option<&StepFrame>, out: &mut PortBuffer) {
        if frame.is_some() || self.standing || out.used {
            self.fill(frame, out);
        }
    }

    /// The same where there is something to write, or to clear.
    #[inline(never)]
    fn fill(&mut self, frame: Option<&StepFrame>, out: &mut PortBuffer) {
        out.clear();
        if self.standing {
            self.finish_pulses(out);
        }
        let Some(frame) = frame else { return };
        out.used = true;
        let words = Cell::from_mut(&mut out.words[..]).as_slice_of_cells();
        // A pulse that lasts longer than a tick has no place.
        let pulse = usize::from(self.pins.pulse_slots).min(words.len());
        let falls = &words[pulse..];
        for (a, axis) in frame.axes.iter().enumerate() {
            if axis.count == 0 {
                continue;
            }
            if self.direction[a] != u8::from(axis.negative) {
                self.turn(a, axis, words);
            }
            let edge = Edge {
                rise: self.rise[a],
                pulse,
            };
            if let Some(slot) = edge.train(words, falls, axis) {
                self.falling[a] = slot;
                self.standing = true;
            }
        }
    }

    /// Pulses that began in the tick before.
    #[inline(never)]
    fn finish_pulses(&mut self, out: &mut PortBuffer) {
        for (a, slot) in self.falling.iter_mut().enumerate() {
            if *slot != NONE {
                out.words[usize::from((*slot).min(SLOTS - 1))] |= reset(self.pins.step[a]);
                *slot = NONE;
            }
        }
        self.standing = false;
        out.used = true;
    }

    /// The direction pin of axis `a` moves.
    #[cold]
    #[inline(never)]
    fn turn(&mut self, a: usize, axis: &AxisSteps, words: &[Cell<u32>]) {
        let pins = &self.pins;
        self.direction[a] = u8::from(axis.negative);
        let positive_is_high = pins.dir_high_is_positive >> a & 1 != 0;
        let word = if axis.negative != positive_is_high {
            set(pins.dir[a])
        } else {
            reset(pins.dir[a])
        };
        let first = ((axis.first >> 16) as u16).min(SLOTS - 1);
        let slot = &words[usize::from(first.saturating_sub(pins.dir_setup_slots))];
        slot.set(slot.get() | word);
    }
}

/// How a step pin goes up and down.
#[derive(Clone, Copy)]
struct Edge {
    /// Sets the pin; 16 bits higher, resets it.
    rise: u32,
    /// Slots from one to the other, at most [`SLOTS`].
    pulse: usize,
}

impl Edge {
    /// Writes the pulses of one axis; the slot of the next tick in which the last of them ends, if not in this one. `falls` is
    /// `words` from a pulse on.
    ///
    /// This is where most of the time goes at high step rates. One comparison per step ends the loop and bounds both
    /// words: the views of rising and falling edges are the same words a pulse apart, cut where the last edge is.
    #[inline(always)]
    fn train(self, words: &[Cell<u32>], falls: &[Cell<u32>], axis: &AxisSteps) -> Option<u16> {
        const TICK: u32 = (SLOTS as u32) << 16;
        let more = u32::from(axis.count) - 1;
        let pitch = axis.pitch;
        let last = u64::from(axis.first) + u64::from(more) * u64::from(pitch);
        // Slots move on, and not out of what a word counts; one edge needs no pitch.
        if last >= u64::from(TICK) || !(1 << 16..=TICK).contains(&pitch) {
            return self.crooked(words, axis);
        }
        let last = last as u32;
        let edges = (last >> 16) as usize + 1;
        let inside = falls.len().min(edges);
        let (rises, falls) = (&words[..inside], &falls[..inside]);
        let (up, down) = (self.rise, self.rise << 16);
        let mut at = axis.first;
        loop {
            let slot = (at >> 16) as usize;
            let (Some(rise), Some(fall)) = (rises.get(slot), falls.get(slot)) else {
                break;
            };
            rise.set(rise.get() | up);
            fall.set(fall.get() | down);
            at += pitch;
        }
        if at > last {
            return None;
        }
        self.rest(words, at, last, pitch)
    }

    /// What is left of a train, one in a correct frame: pulses that reach over the end of the tick.
    #[inline(never)]
    fn rest(self, words: &[Cell<u32>], mut at: u32, last: u32, pitch: u32) -> Option<u16> {
        let mut over = None;
        while at <= last {
            over = self.pulse(words, (at >> 16) as usize).or(over);
            at += pitch;
        }
        over
    }

    /// One pulse from `slot` on, or from the last one if `slot` is beyond it.
    fn pulse(self, words: &[Cell<u32>], slot: usize) -> Option<u16> {
        let slot = slot.min(words.len() - 1);
        let end = slot + self.pulse;
        words[slot].set(words[slot].get() | self.rise);
        match words.get(end) {
            Some(word) => word.set(word.get() | self.rise << 16),
            None => return Some((end - words.len()) as u16),
        }
        None
    }

    /// The same for a single edge, and for a frame that no correct generator makes; a wrong one may not stop the machine.
    #[inline(never)]
    fn crooked(self, words: &[Cell<u32>], axis: &AxisSteps) -> Option<u16> {
        let mut over = None;
        let mut at = axis.first;
        for _ in 0..axis.count {
            over = self.pulse(words, (at >> 16) as usize).or(over);
            at = at.wrapping_add(axis.pitch);
        }
        over
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stepgen::AxisSteps;
    use proptest::prelude::*;

    const PULSE: u16 = 2;
    const SETUP: u16 = 4;

    fn pins(dir_high_is_positive: u8) -> PinMap {
        PinMap {
            step: [3, 0, 12, 7, 15],
            dir: [1, 2, 9, 14, 6],
            dir_high_is_positive,
            pulse_slots: PULSE,
            dir_setup_slots: SETUP,
        }
    }

    /// A port that knows nothing of frames: 16 output latches and the reference manual's rule for a word.
    #[derive(Default)]
    struct Port {
        level: [bool; 16],
    }

    impl Port {
        fn write(&mut self, word: u32) {
            for p in 0..16 {
                // "If both BSx and BRx are set, BSx has priority" (RM0090 8.4.7).
                if word >> p & 1 == 1 {
                    self.level[p] = true;
                } else if word >> (p + 16) & 1 == 1 {
                    self.level[p] = false;
                }
            }
        }
    }

    /// What a drive sees on the two wires of an axis.
    #[derive(Default)]
    struct Drive {
        counted: i64,
        edges: Vec<u64>,
        falls: Vec<u64>,
        dir_changes: Vec<u64>,
    }

    fn replay(words: &[u32], pins: &PinMap) -> [Drive; AXES] {
        let mut port = Port::default();
        let mut drives: [Drive; AXES] = Default::default();
        for (t, &word) in words.iter().enumerate() {
            let before = port.level;
            port.write(word);
            for (a, drive) in drives.iter_mut().enumerate() {
                let (s, d) = (usize::from(pins.step[a]), usize::from(pins.dir[a]));
                if before[d] != port.level[d] {
                    drive.dir_changes.push(t as u64);
                }
                if !before[s] && port.level[s] {
                    drive.edges.push(t as u64);
                    let up = port.level[d] == (pins.dir_high_is_positive >> a & 1 == 1);
                    drive.counted += if up { 1 } else { -1 };
                }
                if before[s] && !port.level[s] {
                    drive.falls.push(t as u64);
                }
            }
        }
        drives
    }

    /// One axis of one tick, before the generator's promise about changes of direction is applied:
    /// count, direction, where in its free room the train starts.
    fn wish() -> impl Strategy<Value = (u16, bool, u32, u32)> {
        (
            prop_oneof![Just(0u16), 1u16..4, 4u16..135],
            any::<bool>(),
            0u32..0x1_0000,
            0u32..0x1_0000,
        )
    }

    /// Frames a correct generator could have made: the promises in the module header hold.
    fn lawful(wishes: &[[(u16, bool, u32, u32); AXES]]) -> Vec<StepFrame> {
        let mut direction = [None; AXES];
        // Slots after the end of the tick before which the next edge must not come.
        let mut next_free = [0u32; AXES];
        wishes
            .iter()
            .map(|axes| {
                let mut frame = StepFrame::default();
                for (a, &(count, negative, start, stretch)) in axes.iter().enumerate() {
                    let low = if direction[a] == Some(negative) {
                        next_free[a]
                    } else {
                        next_free[a].max(u32::from(2 * PULSE + SETUP))
                    } << 16;
                    next_free[a] = 0;
                    let room = (u32::from(SLOTS) << 16) - 1 - low;
                    let pitch_min = u32::from(2 * PULSE) << 16;
                    let count = count.min((room / pitch_min) as u16);
                    if count == 0 {
                        continue;
                    }
                    let gaps = u32::from(count - 1);
                    let slack = room - gaps * pitch_min;
                    let first_at = ((u64::from(slack) * u64::from(start)) >> 16) as u32;
                    let pitch_more = (slack - first_at).checked_div(gaps).map_or(0, |each| {
                        ((u64::from(each) * u64::from(stretch)) >> 16) as u32
                    });
                    let pitch = pitch_min + pitch_more;
                    frame.axes[a] = AxisSteps {
                        count,
                        negative,
                        first: low + first_at,
                        pitch,
                    };
                    direction[a] = Some(negative);
                    let last_edge = (low + first_at + gaps * pitch) >> 16;
                    next_free[a] =
                        (last_edge + u32::from(2 * PULSE)).saturating_sub(u32::from(SLOTS));
                }
                frame
            })
            .collect()
    }

    fn expand_all(frames: &[StepFrame], pins: &PinMap) -> Vec<u32> {
        let mut expander = PortExpander::new(pins);
        let mut words = vec![pins.all_low()];
        // The buffers of a board in turn.
        let mut buffers = [const { PortBuffer::new() }; 2];
        for (k, frame) in frames.iter().enumerate() {
            let steps = frame.axes.iter().any(|axis| axis.count > 0);
            expander.expand(steps.then_some(frame), &mut buffers[k % 2]);
            words.extend_from_slice(buffers[k % 2].words());
        }
        for buffer in &mut buffers {
            expander.expand(None, buffer);
            words.extend_from_slice(buffer.words());
        }
        words
    }

    /// Whatever the fields of a train hold, with those more often that look right.
    fn any_train() -> impl Strategy<Value = (u16, bool, u32, u32)> {
        let slots = || 0..u32::from(SLOTS) << 16;
        (
            prop_oneof![0_u16..3, any::<u16>()],
            any::<bool>(),
            prop_oneof![slots(), any::<u32>()],
            prop_oneof![slots(), u32::MAX - 9..=u32::MAX, any::<u32>()],
        )
    }

    proptest! {
        #[test]
        fn a_drive_counts_exactly_the_steps_of_the_frames(
            wishes in prop::collection::vec(prop::array::uniform5(wish()), 1..12),
            polarity in 0u8..32,
        ) {
            let frames = lawful(&wishes);
            let pins = pins(polarity);
            let drives = replay(&expand_all(&frames, &pins), &pins);
            for (a, drive) in drives.iter().enumerate() {
                let want: i64 = frames.iter().map(|f| i64::from(f.axes[a].signed_count())).sum();
                prop_assert_eq!(drive.counted, want);
                let edges: u64 = frames.iter().map(|f| u64::from(f.axes[a].count)).sum();
                prop_assert_eq!(drive.edges.len() as u64, edges);
            }
        }

        #[test]
        fn every_pulse_has_its_width_and_ends(
            wishes in prop::collection::vec(prop::array::uniform5(wish()), 1..12),
        ) {
            let frames = lawful(&wishes);
            let pins = pins(0);
            for drive in replay(&expand_all(&frames, &pins), &pins) {
                prop_assert_eq!(drive.edges.len(), drive.falls.len());
                for (rise, fall) in drive.edges.iter().zip(&drive.falls) {
                    prop_assert_eq!(fall - rise, u64::from(PULSE));
                }
            }
        }

        #[test]
        fn a_direction_stands_before_and_after_every_edge(
            wishes in prop::collection::vec(prop::array::uniform5(wish()), 1..12),
            polarity in 0u8..32,
        ) {
            let frames = lawful(&wishes);
            let pins = pins(polarity);
            for drive in replay(&expand_all(&frames, &pins), &pins) {
                for &change in &drive.dir_changes {
                    for &edge in &drive.edges {
                        if edge >= change {
                            prop_assert!(edge - change >= u64::from(SETUP), "set-up {change} {edge}");
                        } else {
                            prop_assert!(change - edge >= u64::from(2 * PULSE), "hold {edge} {change}");
                        }
                    }
                }
            }
        }

        #[test]
        fn no_frame_however_wrong_panics(raw in prop::array::uniform5(any_train()), pulse: u16, setup: u16) {
            let mut frame = StepFrame::default();
            for (axis, (count, negative, first, pitch)) in frame.axes.iter_mut().zip(raw) {
                *axis = AxisSteps { count, negative, first, pitch };
            }
            let pins = PinMap { pulse_slots: pulse, dir_setup_slots: setup, ..pins(0) };
            let mut out = PortBuffer::new();
            let mut expander = PortExpander::new(&pins);
            expander.expand(Some(&frame), &mut out);
            expander.expand(Some(&frame), &mut out);
        }
    }

    #[test]
    fn edges_fall_in_the_slots_the_frame_names() {
        let mut frame = StepFrame::default();
        frame.axes[2] = AxisSteps {
            count: 3,
            negative: true,
            first: 10 << 16 | 0x8000,
            pitch: 7 << 16 | 0xc000,
        };
        let pins = pins(0);
        let named: Vec<u64> = frame.axes[2].slots().map(u64::from).collect();
        let words = expand_all(&[frame], &pins);
        // The first word is the one that clears the port.
        assert_eq!(replay(&words[1..], &pins)[2].edges, named);
        assert_eq!(named, [10, 18, 26]);
    }

    #[test]
    fn the_default_map_uses_ten_different_pins() {
        let map = PinMap::new(&crate::board::MACHINE);
        assert_eq!(map.all_low(), 0x03ff_0000);
    }
}
