//! The virtual controller: a motion core on a pseudo-terminal, paced by the clock of the PC.
//!
//! Comes in: bytes of a client through [`PseudoTerminal`]. Goes out: the controller's answers. Time exists
//! only here: the core is told how many servo ticks have passed, never what time it is.

use std::collections::VecDeque;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use pentaspline::machine::{Controller, Servo};
use pentaspline::units::Tick;

use crate::pty::PseudoTerminal;

/// Longest sleep between two rounds; 5 servo ticks at 5 kHz, far less than the queue holds.
const ROUND: Duration = Duration::from_millis(1);
/// Ticks made up for at a stretch before the wire is looked at again.
const CATCH_UP_TICKS: Tick = 64;
/// Background work between two ticks; more waits for the next tick, as on a board.
const POLLS_PER_TICK: u32 = 64;
/// A delay beyond this (a suspended process) is forgotten rather than made up for in a burst.
const LAG_FORGIVEN: Duration = Duration::from_millis(500);
/// Answers kept for a client that does not read; older ones are lost, as on a line nobody listens to.
const UNREAD_MAX: usize = 16 * 1024;
/// How often exclusive use is lifted from the terminal.
const RELEASE: Duration = Duration::from_secs(1);

/// What stands behind the wire: the core, or something simpler in a test.
pub trait Device {
    /// One byte from the client.
    fn receive(&mut self, byte: u8);
    /// Next byte for the client.
    fn transmit(&mut self) -> Option<u8>;
    /// A bounded piece of background work at tick `now`; `true` if there is more to do.
    fn poll(&mut self, now: Tick) -> bool;
    /// One servo tick.
    fn tick(&mut self);
}

/// Both halves of the core in one thread.
pub struct CoreDevice<'a> {
    /// Background half.
    pub controller: Controller<'a>,
    /// Interrupt half.
    pub servo: Servo<'a>,
}

impl Device for CoreDevice<'_> {
    fn receive(&mut self, byte: u8) {
        self.controller.receive(byte);
    }

    fn transmit(&mut self) -> Option<u8> {
        self.controller.transmit()
    }

    fn poll(&mut self, now: Tick) -> bool {
        self.controller.poll(now)
    }

    fn tick(&mut self) {
        // Nothing is wired to the step port of a virtual controller.
        self.servo.tick();
    }
}

/// What a session did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Served {
    /// Servo ticks run.
    pub ticks: Tick,
    /// Ticks left out because the process was stopped for too long.
    pub ticks_forgiven: Tick,
    /// Bytes from the client.
    pub bytes_in: u64,
    /// Answer bytes lost because nobody read them.
    pub bytes_lost: u64,
}

/// Runs `device` at `servo_hz` ticks per second of real time on `terminal` until `stop` is set.
///
/// # Errors
/// What the operating system reports for the terminal.
pub fn serve(
    device: &mut impl Device,
    terminal: &PseudoTerminal,
    servo_hz: u32,
    stop: &AtomicBool,
) -> io::Result<Served> {
    let mut served = Served::default();
    let mut unread = VecDeque::new();
    let mut clock = Clock::new(Instant::now(), servo_hz);
    let mut released = Instant::now();
    let mut buffer = [0_u8; 256];
    while !stop.load(Ordering::Relaxed) {
        let count = terminal.read(&mut buffer)?;
        served.bytes_in += count as u64;
        for &byte in &buffer[..count] {
            device.receive(byte);
            // The wire is slower than the background work of a board: it keeps up with every byte.
            background(device, served.ticks);
        }
        let now = Instant::now();
        let (due, forgiven) = clock.due(now, served.ticks);
        served.ticks_forgiven += forgiven;
        for _ in 0..due.min(CATCH_UP_TICKS) {
            background(device, served.ticks);
            device.tick();
            served.ticks += 1;
        }
        background(device, served.ticks);
        while let Some(byte) = device.transmit() {
            unread.push_back(byte);
        }
        hand_over(&mut unread, terminal, &mut served)?;
        if now.duration_since(released) > RELEASE {
            released = now;
            terminal.release_exclusive();
        }
        if due <= CATCH_UP_TICKS && count == 0 {
            terminal.wait(ROUND)?;
        }
    }
    Ok(served)
}

fn background(device: &mut impl Device, now: Tick) {
    for _ in 0..POLLS_PER_TICK {
        if !device.poll(now) {
            break;
        }
    }
}

fn hand_over(
    unread: &mut VecDeque<u8>,
    terminal: &PseudoTerminal,
    served: &mut Served,
) -> io::Result<()> {
    while !unread.is_empty() {
        let count = terminal.write(unread.as_slices().0)?;
        if count == 0 {
            break;
        }
        unread.drain(..count);
    }
    let excess = unread.len().saturating_sub(UNREAD_MAX);
    unread.drain(..excess);
    served.bytes_lost += excess as u64;
    Ok(())
}

/// Says how many ticks are due.
struct Clock {
    start: Instant,
    hz: u32,
    forgiven: Tick,
}

impl Clock {
    fn new(start: Instant, hz: u32) -> Self {
        Self {
            start,
            hz,
            forgiven: 0,
        }
    }

    /// Ticks due at `now` after `done` ones, and ticks newly forgiven.
    fn due(&mut self, now: Instant, done: Tick) -> (Tick, Tick) {
        let elapsed = now.saturating_duration_since(self.start).as_nanos() * u128::from(self.hz)
            / 1_000_000_000;
        // A u64 of ticks lasts 100 million years at 5 kHz.
        let elapsed = Tick::try_from(elapsed).unwrap_or(Tick::MAX);
        let due = elapsed.saturating_sub(done).saturating_sub(self.forgiven);
        let limit = Tick::from(self.hz) * LAG_FORGIVEN.as_millis() as Tick / 1000;
        if due > limit {
            let forgiven = due - limit;
            self.forgiven += forgiven;
            (limit, forgiven)
        } else {
            (due, 0)
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Read, Write};
    use std::sync::Arc;

    use super::*;

    /// Sends every byte back, one per poll.
    #[derive(Default)]
    struct Echo {
        inside: VecDeque<u8>,
        ready: VecDeque<u8>,
        ticks: Tick,
    }

    impl Device for Echo {
        fn receive(&mut self, byte: u8) {
            self.inside.push_back(byte);
        }
        fn transmit(&mut self) -> Option<u8> {
            self.ready.pop_front()
        }
        fn poll(&mut self, now: Tick) -> bool {
            assert_eq!(now, self.ticks);
            self.ready.extend(self.inside.pop_front());
            !self.inside.is_empty()
        }
        fn tick(&mut self) {
            self.ticks += 1;
        }
    }

    #[test]
    fn ticks_follow_real_time_and_bytes_pass() {
        let terminal = PseudoTerminal::open().unwrap();
        let path = terminal.path().to_owned();
        let stop = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&stop);
        let start = Instant::now();
        let server = std::thread::spawn(move || {
            let mut device = Echo::default();
            let served = serve(&mut device, &terminal, 5000, &flag).unwrap();
            (served, device.ticks)
        });
        let mut client = std::fs::OpenOptions::new()
            .read(true)
            .write(true)
            .open(path)
            .unwrap();
        let text: Vec<u8> = (0..2000_u32).map(|i| (i % 251) as u8).collect();
        client.write_all(&text).unwrap();
        let mut back = vec![0; text.len()];
        client.read_exact(&mut back).unwrap();
        assert_eq!(back, text);
        std::thread::sleep(Duration::from_millis(200));
        stop.store(true, Ordering::Relaxed);
        let (served, ticks) = server.join().unwrap();
        let most = start.elapsed().as_secs_f64() * 5000.0;
        assert_eq!(served.ticks, ticks);
        assert_eq!(served.bytes_in, text.len() as u64);
        // Never ahead of the clock; behind it by scheduling only.
        assert!((ticks + served.ticks_forgiven) as f64 <= most);
        assert!(
            (ticks + served.ticks_forgiven) as f64 >= 900.0,
            "{ticks} ticks in {most} tick times"
        );
    }

    #[test]
    fn answers_nobody_reads_never_block_the_machine() {
        let terminal = PseudoTerminal::open().unwrap();
        let mut served = Served::default();
        let mut unread: VecDeque<u8> = std::iter::repeat_n(b'x', 100_000).collect();
        hand_over(&mut unread, &terminal, &mut served).unwrap();
        assert!(unread.len() <= UNREAD_MAX && served.bytes_lost > 0);
    }

    #[test]
    fn a_long_stop_is_forgiven_not_made_up_for() {
        let start = Instant::now();
        let mut clock = Clock::new(start, 5000);
        assert_eq!(clock.due(start + Duration::from_millis(10), 0), (50, 0));
        assert_eq!(
            clock.due(start + Duration::from_secs(100), 50),
            (2500, 497_450)
        );
        assert_eq!(
            clock.due(start + Duration::from_millis(100_001), 2550),
            (5, 0)
        );
    }
}
