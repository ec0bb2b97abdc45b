//! Deepest stack: the free RAM is painted at start, and what is still painted was never used.
//!
//! The stack grows from the end of RAM down to the end of the static variables; an image without heap has
//! nothing in between.
#![allow(unsafe_code)]

use core::ptr::addr_of_mut;

/// No code address, no float anybody computes, no small integer.
const PAINT: u32 = 0xc5c5_5a3c;

/// Bytes below the stack pointer that [`paint`] leaves alone: its own frame and what an interrupt pushes.
const MARGIN: u32 = 256;

extern "C" {
    static mut __sheap: u32;
    static mut _stack_start: u32;
}

/// First word above the static variables, and the end of RAM.
fn bounds() -> (*mut u32, *mut u32) {
    // The symbols are addresses that the linker script of cortex-m-rt defines; nothing is read.
    (addr_of_mut!(__sheap), addr_of_mut!(_stack_start))
}

/// Paints the RAM that the stack has not reached yet. Call once, early, with interrupts off.
pub fn paint() {
    let (low, _) = bounds();
    let end = cortex_m::register::msp::read().saturating_sub(MARGIN);
    let mut at = low;
    while (at as u32) < end {
        // SAFETY: `at` is aligned and lies between the last static variable and the stack pointer, where
        // nothing lives; interrupts are off, so nothing can begin to live there.
        unsafe { at.write_volatile(PAINT) };
        at = at.wrapping_add(1);
    }
}

/// Bytes of stack used at the deepest since [`paint`], and bytes there are.
pub fn deepest() -> (u32, u32) {
    let (low, top) = bounds();
    let mut at = low;
    // SAFETY: `at` stays inside RAM; words that the stack uses may change under the read, and any value will do.
    while at < top && unsafe { at.read_volatile() } == PAINT {
        at = at.wrapping_add(1);
    }
    (top as u32 - at as u32, top as u32 - low as u32)
}
