//! Serial ports by register: program port (USART1) and, in the emulator, trace port (USART2).
//!
//! By register because the emulated machine has no clock control to ask for rates, and because the two
//! ends of the port live at different priorities.

use core::ops::Deref;

use heapless::spsc::{Consumer, Producer};
use stm32f4xx_hal::pac::usart1::RegisterBlock;
use stm32f4xx_hal::pac::USART1;

/// Rate of the program port. The receiver holds one byte while the servo interrupt runs, so a byte (87 us
/// here) must last longer than that interrupt.
pub const BAUD: u32 = 115_200;

/// Clock of USART1 (APB2).
const CLOCK_HZ: u32 = 84_000_000;

/// Bytes waiting to be sent.
pub const TX_BYTES: usize = 512;

/// Switches a port on: 8N1 at [`BAUD`] if clocked with 84 MHz, receive interrupt if `listen`.
fn start(port: &RegisterBlock, listen: bool) {
    // Oversampling by 16: the register is the clock divided by the rate (RM0090 30.3.4).
    port.brr().write(|w| {
        w.div_mantissa()
            .set((CLOCK_HZ / BAUD >> 4) as u16)
            .div_fraction()
            .set((CLOCK_HZ / BAUD & 15) as u8)
    });
    port.cr1().write(|w| {
        w.ue()
            .set_bit()
            .te()
            .set_bit()
            .re()
            .set_bit()
            .rxneie()
            .bit(listen)
    });
}

/// What a look at the receiver found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Received {
    /// A byte.
    Byte(u8),
    /// A byte, and before it at least one was lost.
    AfterLoss(u8),
}

/// The interrupt's side of the program port.
pub struct ProgramPort {
    port: USART1,
    tx: Consumer<'static, u8>,
}

impl ProgramPort {
    /// Switches USART1 on; its pins and clock are the caller's.
    pub fn start(port: USART1, tx: Consumer<'static, u8>) -> Self {
        start(&port, true);
        Self { port, tx }
    }

    /// Next byte received.
    pub fn receive(&mut self) -> Option<Received> {
        let status = self.port.sr().read();
        if status.rxne().bit_is_clear() && status.ore().bit_is_clear() {
            return None;
        }
        // Reading the data after the status clears both flags.
        let byte = self.port.dr().read().dr().bits() as u8;
        Some(if status.ore().bit_is_set() {
            Received::AfterLoss(byte)
        } else {
            Received::Byte(byte)
        })
    }

    /// Sends what the transmitter takes, and asks for an interrupt if more waits.
    pub fn send(&mut self) {
        while self.port.sr().read().txe().bit_is_set() {
            let Some(byte) = self.tx.dequeue() else { break };
            self.port.dr().write(|w| w.dr().set(byte.into()));
        }
        let more = self.tx.ready();
        self.port.cr1().modify(|_, w| w.txeie().bit(more));
    }
}

/// The background's side of the program port.
pub struct ProgramOut(Producer<'static, u8>);

impl ProgramOut {
    /// Sends through `tx`.
    pub fn new(tx: Producer<'static, u8>) -> Self {
        Self(tx)
    }

    /// Queues bytes from `next` while there is room, then wakes the interrupt.
    pub fn send_from(&mut self, mut next: impl FnMut() -> Option<u8>) {
        let mut any = false;
        while self.0.ready() {
            let Some(byte) = next() else { break };
            any |= self.0.enqueue(byte).is_ok();
        }
        if any {
            cortex_m::peripheral::NVIC::pend(stm32f4xx_hal::pac::Interrupt::USART1);
        }
    }
}

/// A port without interrupts, for the trace: the emulator takes a byte as fast as it is written.
pub struct PolledPort<U>(U);

impl<U: Deref<Target = RegisterBlock>> PolledPort<U> {
    /// Switches the port on.
    pub fn start(port: U) -> Self {
        start(&port, false);
        Self(port)
    }

    /// Next byte received.
    pub fn receive(&mut self) -> Option<u8> {
        let full = self.0.sr().read().rxne().bit_is_set();
        full.then(|| self.0.dr().read().dr().bits() as u8)
    }

    /// Sends one byte, waiting for the transmitter.
    pub fn send(&mut self, byte: u8) {
        while self.0.sr().read().txe().bit_is_clear() {}
        self.0.dr().write(|w| w.dr().set(byte.into()));
    }
}
