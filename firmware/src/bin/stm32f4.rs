//! Firmware image for STM32F405/407, and with the feature `qemu` for the emulated one.
//!
//! Wiring only. Priorities are the architecture:
//!
//! | priority | task | budget | does |
//! |---|---|---|---|
//! | 4 | `buffers_change` (DMA2 stream 1) | one tick; the stream itself changes over without it | checks that the servo kept up |
//! | 3 | `servo` (TIM2) | one tick, 200 us at 5 kHz | safety inputs, [`Servo::tick`], port words |
//! | 2 | `serial` (USART1) | one byte, 87 us at 115200 | ring in, queue out |
//! | idle | background | none; the queue in front of the servo ends in a stop | [`Controller::poll`] |
//!
//! The emulated board has no DMA and no pins: each tick in motion becomes a record on USART2 instead
//! ([`pentaspline::board::trace`]). If the host reads so slowly that a record finds no room, the tick is put
//! off, which a real board must never do: no frame is lost and no number in a frame depends on it.
#![no_std]
#![no_main]

#[rtic::app(device = stm32f4xx_hal::pac, peripherals = true)]
mod app {
    use core::sync::atomic::{AtomicU8, Ordering};

    use pentaspline::board::hardware::{self, MotionPort, Parts, SidePort, Storage, Watch};
    use pentaspline::board::ring::{Ring, RingIn, RingOut};
    use pentaspline::board::servo_timer::{self, ServoTimer};
    use pentaspline::board::usart::{ProgramOut, ProgramPort, Received};
    use pentaspline::board::{stack, stop, MACHINE};
    use pentaspline::machine::{Controller, Core, Event, Servo, State};
    use pentaspline::protocol::RECEIVE_SIZE;
    use pentaspline::units::Tick;
    use pentaspline::{log_info, log_warn};

    /// What the interrupts and the background agree on about faults.
    static FAULT: AtomicU8 = AtomicU8::new(CLEAR);
    /// Drives on, frames played.
    const CLEAR: u8 = 0;
    /// An interrupt has switched the drives off; the core does not know yet.
    const TRIPPED: u8 = 1;
    /// The core knows; drives stay off until it leaves its alarm.
    const TOLD: u8 = 2;
    /// Steps were lost and the step port is stopped: only a restart helps. The core knows.
    const DEAD: u8 = 4;
    /// The same, before the core knows.
    const DYING: u8 = 3;

    /// Reports a fault from an interrupt, unless one is known already.
    fn trip() {
        let _ = FAULT.compare_exchange(CLEAR, TRIPPED, Ordering::Relaxed, Ordering::Relaxed);
    }

    #[shared]
    struct Shared {}

    #[local]
    struct Local {
        controller: Controller<'static>,
        servo: Servo<'static>,
        timer: ServoTimer,
        motion: MotionPort,
        watch: Watch,
        program: ProgramPort,
        program_out: ProgramOut,
        ring_in: RingIn<'static>,
        ring_out: RingOut<'static>,
        side: SidePort,
    }

    #[init(local = [
        core: Core = Core::new(),
        ring: Ring = Ring::new(),
        storage: Storage = Storage::new(),
    ])]
    fn init(cx: init::Context) -> (Shared, Local) {
        stack::paint();
        log_info!("{=str} on {=str}", MACHINE.name, env!("CARGO_PKG_VERSION"));
        let (controller, servo) = cx.local.core.split(&MACHINE);
        let (ring_in, ring_out) = cx.local.ring.split();
        let Parts {
            timer,
            motion,
            watch,
            program,
            program_out,
            side,
        } = hardware::start(cx.device, cx.local.storage);
        let local = Local {
            controller,
            servo,
            timer,
            motion,
            watch,
            program,
            program_out,
            ring_in,
            ring_out,
            side,
        };
        (Shared {}, local)
    }

    /// Feeds the core from the ring, lets it work, and sends what it says.
    #[idle(local = [controller, ring_out, program_out, side])]
    fn idle(cx: idle::Context) -> ! {
        let idle::LocalResources {
            controller,
            ring_out,
            program_out,
            side,
            ..
        } = cx.local;
        let mut now: Tick = 0;
        let mut seen = servo_timer::ticks();
        let mut alarmed = false;
        loop {
            let ticks = servo_timer::ticks();
            if side.clock_runs(RECEIVE_SIZE - controller.receive_free()) {
                now += Tick::from(ticks.wrapping_sub(seen));
            }
            seen = ticks;

            if FAULT
                .compare_exchange(TRIPPED, TOLD, Ordering::Relaxed, Ordering::Relaxed)
                .is_ok()
            {
                controller.event(Event::Fault);
                alarmed = false;
            }
            if FAULT
                .compare_exchange(DYING, DEAD, Ordering::Relaxed, Ordering::Relaxed)
                .is_ok()
            {
                controller.event(Event::Fault);
            }
            if FAULT.load(Ordering::Relaxed) == TOLD {
                match controller.state() {
                    State::Alarm => alarmed = true,
                    // Left the alarm by `~` or reset: drives on again, unless an input is still open.
                    _ if alarmed => {
                        let _ = FAULT.compare_exchange(
                            TOLD,
                            CLEAR,
                            Ordering::Relaxed,
                            Ordering::Relaxed,
                        );
                    }
                    _ => {}
                }
            }

            while let Some(byte) = ring_out.urgent() {
                controller.receive(byte);
            }
            while controller.receive_free() > 0 {
                let Some(byte) = ring_out.text() else { break };
                if !side.is_deaf() {
                    controller.receive(byte);
                }
            }
            let more = controller.poll(now);
            side.watch(controller);
            side.service();
            program_out.send_from(|| controller.transmit());
            if !more && ring_out.is_empty() {
                // A byte that arrives just before this waits for the next servo tick at the latest.
                side.sleep();
            }
        }
    }

    #[task(binds = DMA2_STREAM1, priority = 4, local = [watch])]
    fn buffers_change(cx: buffers_change::Context) {
        if cx.local.watch.changed_over().is_err() {
            stop::outputs_off();
            FAULT.fetch_max(DYING, Ordering::Relaxed);
            log_warn!("steps lost");
        }
    }

    #[task(binds = TIM2, priority = 3, local = [timer, servo, motion, enabled: bool = false])]
    fn servo(cx: servo::Context) {
        let servo::LocalResources {
            timer,
            servo,
            motion,
            enabled,
            ..
        } = cx.local;
        timer.acknowledge();
        if motion.guard().is_some() {
            trip();
        }
        let clear = FAULT.load(Ordering::Relaxed) == CLEAR;
        if *enabled != clear {
            motion.enable(clear);
            *enabled = clear;
        }
        if !motion.has_room() {
            return;
        }
        motion.act(servo);
        servo.tick();
        let frame = servo.frame().filter(|_| clear);
        motion.play(frame, servo);
    }

    #[task(binds = USART1, priority = 2, local = [program, ring_in])]
    fn serial(cx: serial::Context) {
        let serial::LocalResources {
            program, ring_in, ..
        } = cx.local;
        while let Some(received) = program.receive() {
            let (byte, complete) = match received {
                Received::Byte(byte) => (byte, true),
                Received::AfterLoss(byte) => (byte, false),
            };
            if ring_in.put(byte).is_err() || !complete {
                // A program with a hole may not move anything.
                trip();
                log_warn!("receive overflow");
            }
        }
        program.send();
    }
}
