//! Memory copied and cleared, eight words at a time: the run-time functions to which the compiler turns assignments of
//! large values. Comes in what the Run-time ABI for the Arm Architecture (IHI 0043, 4.3.4) says; goes out nothing else.
//!
//! The language's own ones move one word per turn of a loop. Most of what is copied here is a segment or a
//! command of some hundred bytes between aligned places: `LDM` and `STM` need about a fourth of the instructions for it.

#![allow(unsafe_code)]

core::arch::global_asm!(
    ".syntax unified",
    ".section .text.__aeabi_memcpy8,\"ax\",%progbits",
    ".global __aeabi_memcpy8",
    ".global __aeabi_memcpy4",
    ".global __aeabi_memcpy",
    ".type __aeabi_memcpy8,%function",
    ".type __aeabi_memcpy4,%function",
    ".type __aeabi_memcpy,%function",
    ".thumb_func",
    // r0 to, r1 from, r2 bytes; r3 and r12 may be used
    "__aeabi_memcpy:",
    "orr r3, r0, r1",
    "lsls r3, r3, #30",
    "bne 4f",
    ".thumb_func",
    "__aeabi_memcpy8:",
    ".thumb_func",
    "__aeabi_memcpy4:",
    "subs r2, r2, #32",
    "blo 2f",
    "push {{r4-r9, lr}}",
    "1:",
    "ldmia r1!, {{r3-r9, lr}}",
    "subs r2, r2, #32",
    "stmia r0!, {{r3-r9, lr}}",
    "bhs 1b",
    "pop {{r4-r9, lr}}",
    // less than 32 bytes are left: bits 4 to 0 of r2, which is their number less 32
    "2:",
    "lsls r3, r2, #28",
    "itttt cs",
    "ldmiacs r1!, {{r3, r12}}",
    "stmiacs r0!, {{r3, r12}}",
    "ldmiacs r1!, {{r3, r12}}",
    "stmiacs r0!, {{r3, r12}}",
    "itt mi",
    "ldmiami r1!, {{r3, r12}}",
    "stmiami r0!, {{r3, r12}}",
    // bits 2 to 0, also of what has no alignment: single loads need none
    "3:",
    "lsls r2, r2, #30",
    "itt cs",
    "ldrcs r3, [r1], #4",
    "strcs r3, [r0], #4",
    "itt mi",
    "ldrhmi r3, [r1], #2",
    "strhmi r3, [r0], #2",
    "lsls r2, r2, #2",
    "itt cs",
    "ldrbcs r3, [r1]",
    "strbcs r3, [r0]",
    "bx lr",
    "4:",
    "subs r2, r2, #8",
    "blo 3b",
    "5:",
    "ldr r3, [r1], #4",
    "ldr r12, [r1], #4",
    "subs r2, r2, #8",
    "str r3, [r0], #4",
    "str r12, [r0], #4",
    "bhs 5b",
    "b 3b",
    ".size __aeabi_memcpy8, . - __aeabi_memcpy8",
    ".size __aeabi_memcpy4, . - __aeabi_memcpy4",
    ".size __aeabi_memcpy, . - __aeabi_memcpy",
    // the same, but the place it went to comes back
    ".section .text.memcpy,\"ax\",%progbits",
    ".global memcpy",
    ".type memcpy,%function",
    ".thumb_func",
    "memcpy:",
    "push {{r0, lr}}",
    "bl __aeabi_memcpy",
    "pop {{r0, pc}}",
    ".size memcpy, . - memcpy",
    // r0 where, r1 bytes
    ".section .text.__aeabi_memclr8,\"ax\",%progbits",
    ".global __aeabi_memclr8",
    ".global __aeabi_memclr4",
    ".type __aeabi_memclr8,%function",
    ".type __aeabi_memclr4,%function",
    ".thumb_func",
    "__aeabi_memclr8:",
    ".thumb_func",
    "__aeabi_memclr4:",
    "push {{r4-r8, lr}}",
    "movs r2, #0",
    "movs r3, #0",
    "movs r4, #0",
    "movs r5, #0",
    "movs r6, #0",
    "mov r7, r2",
    "mov r8, r2",
    "mov r12, r2",
    // five times eight words per turn: fourteen turns for the slots of a tick
    "subs r1, r1, #160",
    "blo 2f",
    "1:",
    "stmia r0!, {{r2-r8, r12}}",
    "stmia r0!, {{r2-r8, r12}}",
    "stmia r0!, {{r2-r8, r12}}",
    "stmia r0!, {{r2-r8, r12}}",
    "stmia r0!, {{r2-r8, r12}}",
    "subs r1, r1, #160",
    "bhs 1b",
    "2:",
    "adds r1, r1, #160",
    "beq 5f",
    "subs r1, r1, #16",
    "blo 4f",
    "3:",
    "stmia r0!, {{r2-r5}}",
    "subs r1, r1, #16",
    "bhs 3b",
    // less than 16 bytes are left: bits 3 to 0 of r1, which is their number less 16
    "4:",
    "lsls r1, r1, #29",
    "it cs",
    "stmiacs r0!, {{r2, r3}}",
    "it mi",
    "strmi r2, [r0], #4",
    "lsls r1, r1, #2",
    "it cs",
    "strhcs r2, [r0], #2",
    "it mi",
    "strbmi r2, [r0]",
    "5:",
    "pop {{r4-r8, pc}}",
    ".size __aeabi_memclr8, . - __aeabi_memclr8",
    ".size __aeabi_memclr4, . - __aeabi_memclr4",
);

/// How many calls of the functions above do not do what a loop would: sizes up to two turns of the longest loop and all that
/// can be left of a third, the shorter ones at each byte of a word. The instruction meter asks before it measures.
#[cfg(feature = "bench")]
#[must_use]
pub fn faults() -> u32 {
    extern "C" {
        fn __aeabi_memcpy(to: *mut u8, from: *const u8, bytes: usize);
        fn __aeabi_memcpy8(to: *mut u8, from: *const u8, bytes: usize);
        fn __aeabi_memclr8(to: *mut u8, bytes: usize);
        fn memcpy(to: *mut u8, from: *const u8, bytes: usize) -> *mut u8;
    }

    const MOST: usize = 3 * 160;
    const SHORT: usize = 3 * 32;
    const MARGIN: usize = 8;
    const OLD: u8 = 0xa5;

    #[repr(align(8))]
    struct Memory([u8; MOST + 2 * MARGIN]);

    let from = Memory(core::array::from_fn(|k| k as u8 ^ (k >> 8) as u8 ^ 0x55));
    let mut faults = 0;
    // Calls `work` on fresh memory: of it, `bytes` from `first` on may change, to what `new` gives.
    let mut check =
        |first: usize, bytes: usize, new: &dyn Fn(usize) -> u8, work: &dyn Fn(*mut u8)| {
            let mut to = Memory([OLD; MOST + 2 * MARGIN]);
            work(to.0[first..].as_mut_ptr());
            let right = to.0.iter().enumerate().all(|(at, &byte)| {
                let inside = at.checked_sub(first).filter(|&k| k < bytes);
                byte == inside.map_or(OLD, new)
            });
            faults += u32::from(!right);
        };
    for bytes in 0..=MOST {
        let source = from.0[MARGIN..].as_ptr();
        let same = |k: usize| from.0[MARGIN + k];
        // SAFETY: `MOST` bytes from either place are inside the memory, and 8 divides the places.
        check(MARGIN, bytes, &|_| 0, &|to| unsafe {
            __aeabi_memclr8(to, bytes)
        });
        // SAFETY: the same.
        check(MARGIN, bytes, &same, &|to| unsafe {
            __aeabi_memcpy8(to, source, bytes)
        });
        let shifts = if bytes < SHORT { 16 } else { 0 };
        for shift in 0..shifts {
            let (there, here) = (MARGIN + shift / 4, MARGIN + shift % 4);
            let source = from.0[here..].as_ptr();
            let same = |k: usize| from.0[here + k];
            // SAFETY: the same, at any byte.
            check(there, bytes, &same, &|to| unsafe {
                __aeabi_memcpy(to, source, bytes)
            });
            check(there, bytes, &same, &|to| {
                // SAFETY: the same.
                let back = unsafe { memcpy(to, source, bytes) };
                if back != to {
                    // SAFETY: the margin before the place is memory.
                    unsafe { to.sub(1).write(!OLD) };
                }
            });
        }
    }
    faults
}
