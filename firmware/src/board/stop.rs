//! Last resort: outputs off by register, from any context, and what happens on a panic or a hard fault.
#![allow(unsafe_code)]

use core::panic::PanicInfo;

/// Stops the step port and switches all drives off. Leaves everything else as it is.
#[cfg(not(feature = "qemu"))]
pub fn outputs_off() {
    use stm32f4xx_hal::pac::{GPIOB, TIM8};
    // SAFETY: one store each. The set/reset register changes only the bits written to it; the step timer is
    // touched by nobody after its start.
    unsafe {
        (*GPIOB::ptr())
            .bsrr()
            .write(|w| w.bits(u32::from(super::pins::ENABLE_MASK) << 16));
        (*TIM8::ptr()).cr1().write(|w| w.cen().clear_bit());
    }
}

/// The emulated board has no outputs.
#[cfg(feature = "qemu")]
pub fn outputs_off() {}

/// Outputs off, then stand still until power is switched off: position and program are unknown.
fn halt() -> ! {
    loop {
        cortex_m::asm::wfi();
    }
}

/// Panics stop the machine. The core has none by design; this is the net under it.
#[panic_handler]
fn panicked(info: &PanicInfo<'_>) -> ! {
    cortex_m::interrupt::disable();
    outputs_off();
    report(info);
    halt()
}

/// The panic goes to the trace port, where the emulator's host prints it.
#[cfg(feature = "qemu")]
fn report(info: &PanicInfo<'_>) {
    use super::trace;
    use core::fmt::Write as _;
    let mut text = heapless::String::<{ trace::TEXT_MAX }>::new();
    if let Some(at) = info.location() {
        // A text too long is cut: the place comes first.
        let _ = write!(text, "{}:{} ", at.file(), at.line());
    }
    let _ = write!(text, "{}", info.message());
    send(text.as_bytes());
}

/// Sends a panic packet.
#[cfg(feature = "qemu")]
fn send(text: &[u8]) {
    use super::trace;
    // SAFETY: interrupts are off and never come on again; nobody else writes to the port.
    let port = unsafe { &*stm32f4xx_hal::pac::USART2::ptr() };
    for &byte in trace::encode_panic_head(text.len()).iter().chain(text) {
        port.dr().write(|w| w.dr().set(byte.into()));
    }
}

#[cfg(not(feature = "qemu"))]
fn report(info: &PanicInfo<'_>) {
    let line = info.location().map_or(0, core::panic::Location::line);
    crate::log_warn!("panic in line {}", line);
}

/// A hard fault stops the machine like a panic.
#[cortex_m_rt::exception]
unsafe fn HardFault(_frame: &cortex_m_rt::ExceptionFrame) -> ! {
    cortex_m::interrupt::disable();
    outputs_off();
    #[cfg(feature = "qemu")]
    send(b"hard fault");
    halt()
}
