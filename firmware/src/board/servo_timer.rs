//! The servo interrupt's timer (TIM2) and the count of its ticks.

use core::sync::atomic::{AtomicU32, Ordering};

use stm32f4xx_hal::pac::TIM2;

/// Clock of TIM2: twice APB1 on the board, nanoseconds of virtual time in the emulator.
#[cfg(not(feature = "qemu"))]
pub const TIMER_HZ: u32 = 84_000_000;
/// Clock of TIM2: twice APB1 on the board, nanoseconds of virtual time in the emulator.
#[cfg(feature = "qemu")]
pub const TIMER_HZ: u32 = 1_000_000_000;

/// An instruction takes the emulator a nanosecond at least; so that it can be faster than the board, a tick is as many
/// times longer there.
const LONGER: u32 = if cfg!(feature = "qemu") { 8 } else { 1 };

const SERVO_HZ: u32 = super::MACHINE.servo_hz;
// A remainder would let the servo drift against the step port.
const _: () = assert!(
    TIMER_HZ % SERVO_HZ == 0,
    "servo_hz must divide the timer clock"
);

static TICKS: AtomicU32 = AtomicU32::new(0);

/// Servo ticks since power-up, modulo 2^32.
pub fn ticks() -> u32 {
    TICKS.load(Ordering::Relaxed)
}

/// The timer, running.
pub struct ServoTimer(TIM2);

impl ServoTimer {
    /// Starts the timer at the servo rate with its update interrupt on. The caller has switched its clock on.
    pub fn start(timer: TIM2) -> Self {
        timer.psc().write(|w| w.psc().set(0));
        timer
            .arr()
            .write(|w| w.arr().set(TIMER_HZ / SERVO_HZ * LONGER - 1));
        // The emulated timer adds the time of its last update to every period; at power-up that is zero.
        #[cfg(not(feature = "qemu"))]
        timer.egr().write(|w| w.ug().set_bit());
        timer.sr().write(|w| w.uif().clear_bit());
        timer.dier().write(|w| w.uie().set_bit());
        timer.cr1().write(|w| w.cen().set_bit());
        Self(timer)
    }

    /// Takes the interrupt and counts the tick. First thing in the servo interrupt.
    pub fn acknowledge(&mut self) {
        self.0.sr().write(|w| w.uif().clear_bit());
        // Only this interrupt writes, so a load and a store are enough.
        TICKS.store(ticks().wrapping_add(1), Ordering::Relaxed);
    }
}
