//! Pins and clocks of the board: STM32F405RG, STM32F407VG, or any package with ports A, B and C.
//!
//! | pin | use | level |
//! |---|---|---|
//! | PC0 PC1 PC2 PC3 PC4 | step of axes 1 to 5 (X Y Z A C) | pulse high |
//! | PC5 PC6 PC7 PC8 PC9 | direction of axes 1 to 5 | high counts down |
//! | PB12 PB13 PB14 PB15 PB10 | enable output of axes 1 to 5 | high: drive on |
//! | PA0 PA1 PA2 PA3 PA4 | limit of axes 1 to 5, both ends in series | closed to ground: clear |
//! | PA5 | emergency stop | closed to ground: released |
//! | PA6 | enable input: drives ready | closed to ground: ready |
//! | PA9 PA10 | USART1 TX and RX, 115200 8N1: the program | |
//! | PA13 PA14 | SWD: flashing, log | |
//!
//! An input that opens stops the machine and switches the enables off ([`super::guard`]). Inputs have the
//! pull-ups on; put an opto-coupler or an RC filter in front of a long wire. One port carries the ten step
//! and direction pins because one DMA stream writes one register.

use embedded_hal::digital::OutputPin;
use stm32f4xx_hal::gpio::{ErasedPin, Input, Output, Speed};
use stm32f4xx_hal::pac::{GPIOA, GPIOB, GPIOC, RCC};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::{Config, Rcc};

use super::guard::{Guard, INPUTS};
use crate::units::AXES;

/// Crystal of the board, MHz (8 on ST's boards and most others).
pub const CRYSTAL_MHZ: u32 = 8;

/// Bits of the enable outputs in port B, for [`super::stop::outputs_off`].
pub const ENABLE_MASK: u16 = 1 << 12 | 1 << 13 | 1 << 14 | 1 << 15 | 1 << 10;

/// Brings the clocks up: 168 MHz core, 42 and 84 MHz buses, timers at 84 and 168 MHz.
pub fn clocks(rcc: RCC) -> Rcc {
    rcc.freeze(
        Config::hse(CRYSTAL_MHZ.MHz())
            .sysclk(168.MHz())
            .pclk1(42.MHz())
            .pclk2(84.MHz()),
    )
}

/// Enable outputs of all drives.
pub struct Enables([ErasedPin<Output>; AXES]);

impl Enables {
    /// Switches all drives on or off.
    pub fn set(&mut self, on: bool) {
        for pin in &mut self.0 {
            // These pins cannot fail: their error type has no values.
            let Ok(()) = OutputPin::set_state(pin, on.into());
        }
    }
}

/// Sets every pin up. Drives are off, step and direction pins low.
pub fn configure(
    a: GPIOA,
    b: GPIOB,
    c: GPIOC,
    rcc: &mut Rcc,
) -> (Guard<ErasedPin<Input>>, Enables) {
    let a = a.split(rcc);
    let b = b.split(rcc);
    let c = c.split(rcc);
    let inputs: [ErasedPin<Input>; INPUTS] = [
        a.pa0.into_pull_up_input().erase(),
        a.pa1.into_pull_up_input().erase(),
        a.pa2.into_pull_up_input().erase(),
        a.pa3.into_pull_up_input().erase(),
        a.pa4.into_pull_up_input().erase(),
        a.pa5.into_pull_up_input().erase(),
        a.pa6.into_pull_up_input().erase(),
    ];
    a.pa9.into_alternate::<7>();
    a.pa10.into_alternate::<7>();
    let enables = [
        b.pb12.into_push_pull_output().erase(),
        b.pb13.into_push_pull_output().erase(),
        b.pb14.into_push_pull_output().erase(),
        b.pb15.into_push_pull_output().erase(),
        b.pb10.into_push_pull_output().erase(),
    ];
    // The DMA drives these from here on; low is their level after reset.
    c.pc0.into_push_pull_output().speed(Speed::High);
    c.pc1.into_push_pull_output().speed(Speed::High);
    c.pc2.into_push_pull_output().speed(Speed::High);
    c.pc3.into_push_pull_output().speed(Speed::High);
    c.pc4.into_push_pull_output().speed(Speed::High);
    c.pc5.into_push_pull_output().speed(Speed::High);
    c.pc6.into_push_pull_output().speed(Speed::High);
    c.pc7.into_push_pull_output().speed(Speed::High);
    c.pc8.into_push_pull_output().speed(Speed::High);
    c.pc9.into_push_pull_output().speed(Speed::High);
    (Guard::new(inputs), Enables(enables))
}
