//! The emulated board as the image sees it: the twin of `hardware.rs` for QEMU's `netduinoplus2`.
//!
//! That machine has USARTs and TIM2 but no clock control, pins or DMA. Clocks are what the emulator's
//! command line says, there are no safety inputs, and each servo tick in motion goes as a record through a
//! ring to USART2, which the background writes ([`super::trace`] has the format).

use core::convert::Infallible;
use core::sync::atomic::{AtomicBool, AtomicU8, Ordering};

use heapless::spsc::{Consumer, Producer, Queue};
use stm32f4xx_hal::pac::{Peripherals, USART2};

use super::guard::Cause;
use super::servo_timer::{self, ServoTimer};
use super::usart::{PolledPort, ProgramOut, ProgramPort, TX_BYTES};
use super::{stack, trace};
use crate::machine::timetable::{Clock, Row, Standing, ROWS_MAX};
use crate::machine::{Controller, Event, Servo};
use crate::protocol::LINE_MAX;
use crate::stepgen::record::{self, FrameDigest, RECORD_MAX};
use crate::stepgen::StepFrame;

/// Bytes of records waiting for the background: forty ticks of five moving axes.
const TRACE_BYTES: usize = 2048;

/// Why the machine stands, as the background sees it ([`Standing`]).
static STANDING: AtomicU8 = AtomicU8::new(0);
/// A row has reset the machine: the host does not know yet, and goes on sending a program that has ended.
static DEAF: AtomicBool = AtomicBool::new(false);

/// Memory the ports work on; static.
pub struct Storage {
    tx: Queue<u8, TX_BYTES>,
    trace: Queue<u8, TRACE_BYTES>,
    // One place of a queue stays empty.
    rows: Queue<Row, { ROWS_MAX + 1 }>,
}

impl Storage {
    /// Empty.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            tx: Queue::new(),
            trace: Queue::new(),
            rows: Queue::new(),
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
    /// For the step DMA's interrupt, which never comes.
    pub watch: Watch,
    /// For the serial interrupt.
    pub program: ProgramPort,
    /// For the background.
    pub program_out: ProgramOut,
    /// For the background.
    pub side: SidePort,
}

/// Starts ports and timer. Touches no clock control: it reads as zero here, and waiting for it would not end.
pub fn start(dp: Peripherals, storage: &'static mut Storage) -> Parts {
    let (tx_in, tx_out) = storage.tx.split();
    let (trace_in, trace_out) = storage.trace.split();
    let (rows_in, rows_out) = storage.rows.split();
    let mut port = PolledPort::start(dp.USART2);
    for byte in trace::encode_hello(super::MACHINE.servo_hz) {
        port.send(byte);
    }
    Parts {
        program: ProgramPort::start(dp.USART1, tx_out),
        program_out: ProgramOut::new(tx_in),
        motion: MotionPort {
            trace: trace_in,
            digest: FrameDigest::default(),
            moving: false,
            ticks: 0,
            rows: rows_out,
            clock: Clock::new(),
        },
        watch: Watch,
        side: SidePort {
            trace: trace_out,
            port,
            released: false,
            looked: 0,
            rows: rows_in,
            row: [0; trace::ROW_LEN],
            row_left: 0,
        },
        timer: ServoTimer::start(dp.TIM2),
    }
}

/// Frames out.
pub struct MotionPort {
    trace: Producer<'static, u8>,
    digest: FrameDigest,
    moving: bool,
    ticks: u64,
    rows: Consumer<'static, Row>,
    clock: Clock,
}

impl MotionPort {
    /// There are no safety inputs.
    pub fn guard(&mut self) -> Option<Cause> {
        None
    }

    /// There are no drives.
    pub fn enable(&mut self, _on: bool) {}

    /// True if whatever this tick makes finds room. If not, the tick has to be put off.
    #[must_use]
    pub fn has_room(&self) -> bool {
        self.trace.capacity() - self.trace.len() >= trace::TICK_MAX
    }

    /// Lets the rows of the timetable act that are due before this tick.
    pub fn act(&mut self, servo: &mut Servo<'_>) {
        while let Some(&row) = self.rows.peek() {
            if !self.clock.is_due(&row) || !servo.request(row.event) {
                return;
            }
            self.clock.acted(row.event);
            if row.event == Event::Reset {
                DEAF.store(true, Ordering::Relaxed);
            }
            // It was there.
            self.rows.dequeue();
            self.put(&trace::encode_rows(self.rows.len()));
        }
    }

    /// Records the tick that made `frame`, and the end of a motion.
    pub fn play(&mut self, frame: Option<&StepFrame>, servo: &Servo<'_>) {
        let sample = servo.sample();
        if sample.moving {
            let frame = &frame.copied().unwrap_or_default();
            let mut bytes = [0; RECORD_MAX];
            let len = record::encode(frame, &mut bytes);
            self.put(&bytes[..len]);
            self.digest.update(frame);
            self.ticks += 1;
        } else if self.moving {
            let rest = trace::Rest {
                digest: self.digest.value(),
                ticks: self.ticks,
                emitted: sample.emitted,
            };
            self.put(&rest.encode());
        }
        self.moving = sample.moving;
        let standing = match STANDING.load(Ordering::Relaxed) {
            1 => Standing::Barred,
            2 => Standing::ProgramStop,
            _ => Standing::No,
        };
        self.clock.tick(sample.moving, standing, self.rows.peek());
    }

    fn put(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            // `has_room` came first.
            self.trace.enqueue(byte).ok();
        }
    }
}

/// There is no step DMA to watch.
pub struct Watch;

impl Watch {
    /// Never called: the interrupt never comes.
    ///
    /// # Errors
    ///
    /// Never.
    pub fn changed_over(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

/// The trace port, in the background.
pub struct SidePort {
    trace: Consumer<'static, u8>,
    port: PolledPort<USART2>,
    released: bool,
    looked: u32,
    rows: Producer<'static, Row>,
    /// A row on its way, and how many bytes of it are still to come.
    row: [u8; trace::ROW_LEN],
    row_left: usize,
}

impl SidePort {
    /// Sends all records that wait, then answers the host. Called before the program port sends, so that a
    /// host that reads `Idle` there has every record of the motion on its way here.
    pub fn service(&mut self) {
        while let Some(byte) = self.trace.dequeue() {
            self.port.send(byte);
        }
        // Looked at once per tick: every access to a register stops the emulator's translated code.
        let tick = servo_timer::ticks();
        if tick == self.looked {
            return;
        }
        self.looked = tick;
        let received = self.port.receive();
        if let (Some(byte), true) = (received, self.row_left > 0) {
            self.take_row(byte);
            return;
        }
        match received {
            Some(trace::ROW) => self.row_left = trace::ROW_LEN,
            Some(trace::RELEASE) => self.released = true,
            Some(trace::STACK) => {
                let (deepest, size) = stack::deepest();
                // A tick may have queued a record meanwhile, but only the background writes to the port.
                for byte in trace::encode_stack(deepest, size) {
                    self.port.send(byte);
                }
            }
            _ => {}
        }
    }

    fn take_row(&mut self, byte: u8) {
        self.row[trace::ROW_LEN - self.row_left] = byte;
        self.row_left -= 1;
        if self.row_left == 0 {
            if let Some(row) = trace::decode_row(&self.row) {
                // What finds no room is missing in the count that goes back.
                self.rows.enqueue(row).ok();
            }
            for byte in trace::encode_rows(self.rows.len()) {
                self.port.send(byte);
            }
        }
    }

    /// Tells the interrupt why the machine stands.
    pub fn watch(&self, controller: &Controller<'_>) {
        let standing = match controller.standing() {
            Standing::No => 0,
            Standing::Barred => 1,
            Standing::ProgramStop => 2,
        };
        STANDING.store(standing, Ordering::Relaxed);
    }

    /// True if text is to be dropped: the program it belongs to has been reset.
    #[must_use]
    pub fn is_deaf(&self) -> bool {
        DEAF.load(Ordering::Relaxed)
    }

    /// Spins until the next servo tick: the emulator counts instructions as time, and a sleeping core makes it
    /// wait for its other threads.
    pub fn sleep(&mut self) {
        let now = servo_timer::ticks();
        while servo_timer::ticks() == now && self.trace.is_empty() {}
    }

    /// False while the time-out of the planner must not run: the host has not sent the whole program, and
    /// less than a line (`waiting` bytes) is here to work on, so it is the host that everybody waits for.
    #[must_use]
    pub fn clock_runs(&self, waiting: usize) -> bool {
        self.released || waiting >= LINE_MAX
    }
}
