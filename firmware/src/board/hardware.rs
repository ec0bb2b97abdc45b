//! The board's hardware as the image sees it: one set-up, three handles. `emulated.rs` is its twin.

use heapless::spsc::Queue;
use stm32f4xx_hal::gpio::{ErasedPin, Input};
use stm32f4xx_hal::pac::Peripherals;
use stm32f4xx_hal::rcc::Enable;

use super::guard::{Cause, Guard};
use super::pins::{self, Enables};
use super::servo_timer::ServoTimer;
use super::step_dma::{self, StepFault, StepPort, StepWatch};
use super::usart::{ProgramOut, ProgramPort, TX_BYTES};
use crate::machine::{Controller, Servo};
use crate::stepgen::port::PortBuffer;
use crate::stepgen::StepFrame;

/// Memory the hardware works on; static.
pub struct Storage {
    tx: Queue<u8, TX_BYTES>,
    buffers: [PortBuffer; 2],
}

impl Storage {
    /// Empty.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            tx: Queue::new(),
            buffers: [const { PortBuffer::new() }; 2],
        }
    }
}

impl Default for Storage {
    fn default() -> Self {
        Self::new()
    }
}

/// Everything, running.
pub struct Parts {
    /// For the servo interrupt.
    pub timer: ServoTimer,
    /// For the servo interrupt.
    pub motion: MotionPort,
    /// For the step DMA's interrupt.
    pub watch: Watch,
    /// For the serial interrupt.
    pub program: ProgramPort,
    /// For the background.
    pub program_out: ProgramOut,
    /// For the background.
    pub side: SidePort,
}

/// Sets clocks, pins, ports and timers up and starts them, the servo last.
pub fn start(dp: Peripherals, storage: &'static mut Storage) -> Parts {
    let mut rcc = pins::clocks(dp.RCC);
    stm32f4xx_hal::pac::USART1::enable(&mut rcc);
    stm32f4xx_hal::pac::DMA2::enable(&mut rcc);
    stm32f4xx_hal::pac::TIM8::enable(&mut rcc);
    stm32f4xx_hal::pac::TIM2::enable(&mut rcc);
    let (guard, mut enables) = pins::configure(dp.GPIOA, dp.GPIOB, dp.GPIOC, &mut rcc);
    enables.set(false);
    let (tx_in, tx_out) = storage.tx.split();
    let program = ProgramPort::start(dp.USART1, tx_out);
    let (steps, watch) = step_dma::start(dp.DMA2, dp.TIM8, &mut storage.buffers);
    Parts {
        timer: ServoTimer::start(dp.TIM2),
        motion: MotionPort {
            guard,
            enables,
            steps,
        },
        watch: Watch(watch),
        program,
        program_out: ProgramOut::new(tx_in),
        side: SidePort,
    }
}

/// Safety inputs in; enables and step port out.
pub struct MotionPort {
    guard: Guard<ErasedPin<Input>>,
    enables: Enables,
    steps: StepPort,
}

impl MotionPort {
    /// Looks at the safety inputs.
    pub fn guard(&mut self) -> Option<Cause> {
        self.guard.sample()
    }

    /// Switches the drives.
    pub fn enable(&mut self, on: bool) {
        self.enables.set(on);
    }

    /// The port always takes a frame.
    #[must_use]
    pub fn has_room(&self) -> bool {
        true
    }

    /// There is no timetable.
    pub fn act(&mut self, _servo: &mut Servo<'_>) {}

    /// Plays `frame`, or nothing, in the next tick.
    pub fn play(&mut self, frame: Option<&StepFrame>, _servo: &Servo<'_>) {
        self.steps.play(frame);
    }
}

/// Proof that the servo keeps up.
pub struct Watch(StepWatch);

impl Watch {
    /// Takes the interrupt at the change of buffers.
    ///
    /// # Errors
    ///
    /// [`StepFault`] if steps are lost.
    pub fn changed_over(&mut self) -> Result<(), StepFault> {
        self.0.changed_over()
    }
}

/// Nothing on a real board; the trace port on the emulated one.
pub struct SidePort;

impl SidePort {
    /// Nothing to do.
    pub fn service(&mut self) {}

    /// Nothing here asks for it.
    pub fn watch(&self, _controller: &Controller<'_>) {}

    /// Text is always taken.
    #[must_use]
    pub fn is_deaf(&self) -> bool {
        false
    }

    /// Waits for the next interrupt.
    pub fn sleep(&mut self) {
        cortex_m::asm::wfi();
    }

    /// The clock of time-outs always runs.
    #[must_use]
    pub fn clock_runs(&self, _waiting: usize) -> bool {
        true
    }
}
