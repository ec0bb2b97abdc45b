//! The short way through the interpreter: a line of coordinates and nothing else, in the state nearly all of them find.
//!
//! In: the bytes of a line such as `N120 X13.856 Y-8.000 Z.5`. Out: the same [`Command::Move`] and the same state as the
//! general way (`block`, `act`) makes of it, in one pass, with nothing copied and in 32-bit arithmetic. Every other line,
//! each that has something wrong with it among them, is left alone for the general way.

use super::command::{Command, Cutter, FeedType, Motion, Move, Side};
use super::frames::{Frame, COORDINATE_MAX};
use super::interpreter::Interpreter;
use super::lexer::{AXIS_LETTERS, LINE_MAX};
use super::motion::spec;
use super::table::{FeedUnit, Mode};
use crate::config::Config;
use crate::units::{Nano, AXES};

/// Stands behind the last byte of a line.
const END: u32 = 0x100;
const BLANK: u32 = b' ' as u32;
const TAB: u32 = b'\t' as u32;
const POINT: u32 = b'.' as u32;
/// Most digits of a number: more need not fit 32 bits.
const DIGITS: usize = 9;
/// Most digits of a block number.
const BLOCK_DIGITS: usize = 8;
/// From digits behind the point to 1e-6 mm or degree.
const SCALES: [u32; 7] = [1_000_000, 100_000, 10_000, 1_000, 100, 10, 1];
/// Coordinates whose upper half is smaller are in range. The last 1.2 m are left to the general way.
const NEAR: i32 = high(COORDINATE_MAX);

const fn high(nano: Nano) -> i32 {
    (nano >> 32) as i32
}

/// A place in a line, and the byte there.
struct Reader<'a> {
    text: &'a [u8],
    at: usize,
    byte: u32,
}

impl Reader<'_> {
    #[inline(always)]
    fn go_to(&mut self, at: usize) {
        self.at = at;
        self.byte = self.text.get(at).map_or(END, |byte| u32::from(*byte));
    }

    #[inline(always)]
    fn step(&mut self) {
        self.go_to(self.at + 1);
    }

    #[inline(always)]
    fn skip_blanks(&mut self) {
        while self.byte == BLANK || self.byte == TAB {
            self.step();
        }
    }

    /// Appends the digits that begin here to `value`, and says how many they are. Only [`DIGITS`] of them fit.
    #[inline(always)]
    fn digits(&mut self, value: &mut u32) -> usize {
        let begin = self.at;
        let mut at = begin;
        let mut number = *value;
        let byte = loop {
            let Some(byte) = self.text.get(at) else {
                break END;
            };
            let digit = u32::from(*byte).wrapping_sub(u32::from(b'0'));
            if digit > 9 {
                break u32::from(*byte);
            }
            number = number.wrapping_mul(10).wrapping_add(digit);
            at += 1;
        };
        *value = number;
        self.at = at;
        self.byte = byte;
        at - begin
    }

    /// The number that begins here, in 1e-6.
    #[inline(always)]
    fn nano(&mut self) -> Option<Nano> {
        let negative = self.byte == u32::from(b'-');
        if negative {
            self.step();
        }
        let mut value = 0;
        let whole = self.digits(&mut value);
        let mut decimals = 0;
        if self.byte == POINT {
            self.step();
            decimals = self.digits(&mut value);
        }
        let digits = whole + decimals;
        let scale = *SCALES.get(decimals)?;
        if digits == 0 || digits > DIGITS {
            return None;
        }
        // below 2^30 * 2^20
        let nano = (u64::from(value) * u64::from(scale)).cast_signed();
        if high(nano) >= NEAR {
            return None;
        }
        Some(if negative { -nano } else { nano })
    }
}

impl Interpreter {
    /// Takes a line of an optional block number and coordinates; `None` if it is something else, and nothing has
    /// happened then.
    #[inline(always)]
    pub(super) fn plain(
        &mut self,
        config: &Config,
        text: &[u8],
        emit: &mut dyn FnMut(Command),
    ) -> Option<()> {
        let modal = &self.modal;
        let straight = match modal.mode {
            Mode::Linear | Mode::Rapid => true,
            Mode::Spline(_) => !modal.tool_points,
            _ => false,
        };
        let ready = straight
            && text.len() <= LINE_MAX
            && modal.side == Side::On
            && self.applied == Side::On
            && modal.feed_unit == FeedUnit::Minute
            && !modal.inch
            && self.polynomial == 0
            && self.pending.is_none()
            && !self.nurbs.active();
        if !ready {
            return None;
        }
        let length = if modal.offsets {
            self.tools.length(self.tools.in_spindle())
        } else {
            0
        };
        let frame = Frame::new(config, modal, false, length);
        let mut reader = Reader {
            text,
            at: 0,
            byte: END,
        };
        reader.go_to(0);
        reader.skip_blanks();
        if reader.byte | 0x20 == u32::from(b'n') {
            reader.step();
            if !(1..=BLOCK_DIGITS).contains(&reader.digits(&mut 0)) {
                return None;
            }
            reader.skip_blanks();
        }
        let lifted;
        let origins = if !modal.absolute {
            &self.position
        } else if length == 0 {
            frame.zero
        } else {
            lifted = core::array::from_fn(|axis| frame.origin(axis));
            &lifted
        };
        let mut target = self.position;
        // one bit per letter that may not come (again), and per axis that moves
        let (mut barred, mut moved) = (!AXIS_LETTERS, 0);
        while reader.byte != END {
            let letter = (reader.byte | 0x20).wrapping_sub(u32::from(b'a'));
            let axis = usize::from(*self.axis_of.get(letter as usize)?);
            let bit = 1 << letter;
            if barred & bit != 0 || axis >= AXES {
                return None;
            }
            barred |= bit;
            reader.step();
            let value = reader.nano()?;
            // no sum that wraps around comes near zero
            let end = value.wrapping_add(origins[axis]);
            if !(-NEAR..NEAR).contains(&high(end)) {
                return None;
            }
            moved |= u32::from(target[axis] != end) << axis;
            target[axis] = end;
            reader.skip_blanks();
        }
        let feed = if moved & u32::from(self.linear) == 0 && moved != 0 {
            modal.feed_rotary
        } else {
            modal.feed_linear
        };
        if barred == !AXIS_LETTERS || !(feed > 0.0 || modal.mode == Mode::Rapid) {
            return None;
        }
        emit(Command::Move(Move {
            block: self.line,
            motion: match modal.mode {
                Mode::Rapid => Motion::Rapid,
                Mode::Spline(kind) => Motion::Spline(spec(modal, kind)),
                _ => Motion::Linear,
            },
            target,
            feed,
            feed_type: FeedType::PerTime,
            exact_stop: modal.exact_stop,
            soft: modal.soft,
            rounding: modal.rounding(),
            cutter: Cutter::OFF,
        }));
        self.position = target;
        self.modal.first = false;
        Some(())
    }
}
