//! The step port: DMA2 stream 1, paced by TIM8, copies a word per slot to the set/reset register of port C.
//!
//! Two buffers of a tick each. While the hardware plays one, the servo interrupt fills the other; the stream
//! changes over by itself, so a step costs no interrupt. TIM8 and the servo timer run from the same PLL at an
//! exact ratio and are started together, hence the servo interrupt always falls at the beginning of a buffer.
//! The DMA interrupt, above the servo, only proves that every buffer was filled before it was played.
#![allow(unsafe_code)]

use core::sync::atomic::{compiler_fence, AtomicBool, Ordering};

use stm32f4xx_hal::pac::{DMA2, GPIOC, TIM8};

use crate::stepgen::port::{PinMap, PortBuffer, PortExpander};
use crate::stepgen::{StepFrame, SLOTS};

/// Stream and channel on which TIM8's update requests arrive (RM0090, table 43).
const STREAM: usize = 1;
const CHANNEL: u8 = 7;

/// Clock of TIM8: twice APB2.
const TIMER_HZ: u32 = 168_000_000;
const SLOT_HZ: u32 = super::MACHINE.servo_hz * SLOTS as u32;
// Both timers must give the same tick to the last clock, or buffers would slip against the servo.
const _: () = assert!(
    TIMER_HZ % SLOT_HZ == 0,
    "servo_hz * slots must divide 168 MHz"
);

/// The servo has filled the buffer that plays next.
static FILLED: AtomicBool = AtomicBool::new(true);

/// The servo interrupt's side: frames in, words in the buffer that is not playing.
pub struct StepPort {
    buffers: &'static mut [PortBuffer; 2],
    expander: PortExpander,
}

/// The DMA interrupt's side.
pub struct StepWatch {
    dma: DMA2,
}

/// A buffer was played twice or not to its end: steps are lost, the position no longer holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StepFault {
    /// The servo did not fill the next buffer in time.
    Underrun,
    /// The DMA could not write.
    Transfer,
}

/// Starts the stream on two empty buffers. DMA2 and TIM8 have their clocks, port C is set up.
pub fn start(
    dma: DMA2,
    timer: TIM8,
    buffers: &'static mut [PortBuffer; 2],
) -> (StepPort, StepWatch) {
    *buffers = [const { PortBuffer::new() }; 2];
    let stream = dma.st(STREAM);
    stream.cr().modify(|_, w| w.en().clear_bit());
    while stream.cr().read().en().bit_is_set() {}
    dma.lifcr().write(|w| {
        w.ctcif1()
            .set_bit()
            .chtif1()
            .set_bit()
            .cteif1()
            .set_bit()
            .cdmeif1()
            .set_bit()
            .cfeif1()
            .set_bit()
    });
    // SAFETY (of the address writes): the buffers are static, are SLOTS words long each, and lie in RAM
    // that DMA2 reaches; the register takes words of any value.
    unsafe {
        stream
            .par()
            .write(|w| w.bits((*GPIOC::ptr()).bsrr().as_ptr() as u32));
        stream
            .m0ar()
            .write(|w| w.bits(buffers[0].words().as_ptr() as u32));
        stream
            .m1ar()
            .write(|w| w.bits(buffers[1].words().as_ptr() as u32));
    }
    stream.ndtr().write(|w| w.ndt().set(SLOTS));
    stream.fcr().write(|w| w.dmdis().enabled());
    stream.cr().write(|w| {
        w.chsel().set(CHANNEL);
        w.pl().very_high().msize().bits32().psize().bits32();
        w.minc()
            .incremented()
            .pinc()
            .fixed()
            .dir()
            .memory_to_peripheral();
        w.dbm().enabled().ct().memory0();
        w.tcie().enabled().teie().enabled().dmeie().enabled()
    });
    compiler_fence(Ordering::SeqCst);
    stream.cr().modify(|_, w| w.en().enabled());
    timer.psc().write(|w| w.psc().set(0));
    timer
        .arr()
        .write(|w| w.arr().set((TIMER_HZ / SLOT_HZ - 1) as u16));
    timer.dier().write(|w| w.ude().set_bit());
    timer.cr1().write(|w| w.cen().set_bit());
    let port = StepPort {
        buffers,
        expander: PortExpander::new(&PinMap::new(&super::MACHINE)),
    };
    (port, StepWatch { dma })
}

impl StepPort {
    /// Fills the buffer that is not playing with `frame`, or with nothing; it plays in the next tick.
    pub fn play(&mut self, frame: Option<&StepFrame>) {
        // SAFETY: reads a register; the stream is configured by nobody but `start`.
        let second_plays = unsafe { (*DMA2::ptr()).st(STREAM).cr().read().ct().bit_is_set() };
        let buffer = &mut self.buffers[usize::from(!second_plays)];
        self.expander.expand(frame, buffer);
        // The DMA reads what the compiler cannot know it reads.
        compiler_fence(Ordering::SeqCst);
        FILLED.store(true, Ordering::Release);
    }
}

impl StepWatch {
    /// Takes the interrupt at the change of buffers.
    ///
    /// # Errors
    ///
    /// [`StepFault`] if steps are lost.
    pub fn changed_over(&mut self) -> Result<(), StepFault> {
        let flags = self.dma.lisr().read();
        self.dma.lifcr().write(|w| {
            w.ctcif1()
                .set_bit()
                .chtif1()
                .set_bit()
                .cteif1()
                .set_bit()
                .cdmeif1()
                .set_bit()
        });
        if flags.teif1().bit_is_set() || flags.dmeif1().bit_is_set() {
            return Err(StepFault::Transfer);
        }
        if flags.tcif1().bit_is_set() && !FILLED.swap(false, Ordering::Acquire) {
            return Err(StepFault::Underrun);
        }
        Ok(())
    }
}
