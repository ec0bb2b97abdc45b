//! Instruction meter: the core on an emulated Cortex-M4, every call of it counted.
//!
//! In, over USART2: a header line (`core LOW HIGH` or `parts`), the lines of a program, a line of one 0x04.
//! Out, over the same port: `name value` lines, the first one `ready 1`, the last one `end 1`. `host-sim bench` is the other end.
//!
//! TIM2 must count nanoseconds and the emulator must give every instruction one: then the difference of two
//! readings is the number of instructions between them. Nothing here reads a clock for any other purpose, no
//! interrupt is on, and the program's time is the number of ticks asked for: the counts repeat exactly.
//!
//! Counted with `core`: each [`Servo::tick`] and the [`PortExpander::expand`] behind it, sorted by what the tick
//! did, and each background call that did something, between them. With `parts`: interpreter, geometry, cutter
//! compensation, travel check and arc length on their own; what `core` counts beyond them is the planner and the wiring.
#![no_std]
#![no_main]

use core::fmt::Write;
use core::hint::black_box;

use cortex_m_rt::entry;
use heapless::Vec;
use pentaspline::board::copy;
use pentaspline::board::usart::PolledPort;
use pentaspline::board::MACHINE;
use pentaspline::compensation::{Compensator, Output};
use pentaspline::config::Config;
use pentaspline::geometry::arc::ArcSplitter;
use pentaspline::geometry::travel::TravelBounds;
use pentaspline::geometry::{GeometryErrorKind, PathSegment, SegmentBuilder};
use pentaspline::machine::{Controller, Core, Servo};
use pentaspline::nc::{Command, Interpreter};
use pentaspline::protocol::LINE_MAX;
use pentaspline::stepgen::port::{PinMap, PortBuffer, PortExpander};
use pentaspline::units::{Steps, Tick, AXES, NANO_PER_UNIT};
use stm32f4xx_hal::pac::{Peripherals, TIM2, USART2};

/// Ends the program.
const END: u8 = 0x04;

/// Ticks at rest after which a program that has been worked off is over.
const REST_TICKS: u32 = 50;

/// A count, its sum and its largest value.
#[derive(Clone, Copy, Default)]
struct Stat {
    n: u32,
    sum: u64,
    max: u32,
}

impl Stat {
    fn add(&mut self, value: u32) {
        self.n += 1;
        self.sum += u64::from(value);
        self.max = self.max.max(value);
    }
}

/// The instruction counter.
struct Meter {
    timer: TIM2,
    /// Instructions between two readings with nothing in between.
    empty: u32,
}

impl Meter {
    fn new(timer: TIM2) -> Self {
        let mut meter = Self { timer, empty: 0 };
        // The first reading of a block may take another road through the emulator; the count is the same, but look.
        let empty = (0..4).map(|_| {
            let start = meter.now();
            meter.now().wrapping_sub(start)
        });
        meter.empty = empty.min().unwrap_or(0);
        meter
    }

    fn now(&self) -> u32 {
        self.timer.cnt().read().bits()
    }

    /// Runs `work` and counts it.
    #[inline(always)]
    fn count<R>(&self, work: impl FnOnce() -> R) -> (R, u32) {
        let start = self.now();
        let result = work();
        let end = self.now();
        (result, end.wrapping_sub(start).saturating_sub(self.empty))
    }
}

/// The host.
struct Port(PolledPort<USART2>);

impl Port {
    /// The next line, without its end; cut at [`LINE_MAX`], which the interpreter refuses.
    fn line(&mut self) -> Vec<u8, LINE_MAX> {
        let mut line = Vec::new();
        loop {
            match self.0.receive() {
                Some(b'\n') => return line,
                Some(byte) => drop(line.push(byte)),
                None => {}
            }
        }
    }

    fn put(&mut self, name: &str, value: u64) {
        // Writing to the port cannot fail.
        let _ = writeln!(self, "{name} {value}");
    }

    fn stat(&mut self, name: &str, stat: &Stat) {
        let _ = writeln!(self, "{name}.n {}", stat.n);
        let _ = writeln!(self, "{name}.sum {}", stat.sum);
        let _ = writeln!(self, "{name}.max {}", stat.max);
    }
}

impl Write for Port {
    fn write_str(&mut self, text: &str) -> core::fmt::Result {
        text.bytes().for_each(|byte| self.0.send(byte));
        Ok(())
    }
}

/// The machine of the image, with five axes as fast as its X axis: rotary ones take the same numbers in degrees.
fn machine() -> Config {
    let mut config = MACHINE;
    let x = config.axes[0];
    for axis in &mut config.axes {
        axis.v_max = x.v_max;
        axis.a_max = x.a_max;
        axis.j_max = x.j_max;
        axis.steps_per_unit = x.steps_per_unit;
        axis.travel_min = -600 * NANO_PER_UNIT;
        axis.travel_max = 600 * NANO_PER_UNIT;
    }
    config
}

#[inline(never)]
fn tick(servo: &mut Servo<'_>) {
    servo.tick();
}

#[inline(never)]
fn expand(expander: &mut PortExpander, servo: &Servo<'_>, out: &mut PortBuffer) {
    expander.expand(servo.frame(), out);
}

#[inline(never)]
fn poll(controller: &mut Controller<'_>, now: Tick) -> bool {
    controller.poll(now)
}

#[inline(never)]
fn receive(controller: &mut Controller<'_>, line: &[u8]) {
    line.iter().for_each(|&byte| controller.receive(byte));
    controller.receive(b'\n');
}

/// Ticks of one kind.
#[derive(Default)]
struct Ticks {
    servo: Stat,
    expand: Stat,
    both: Stat,
    steps: u64,
}

impl Ticks {
    fn report(&self, port: &mut Port, name: &str) {
        // The names are short and the buffer is not.
        let mut text = heapless::String::<32>::new();
        for (part, stat) in [
            ("servo", &self.servo),
            ("expand", &self.expand),
            ("both", &self.both),
        ] {
            text.clear();
            let _ = write!(text, "{name}.{part}");
            port.stat(&text, stat);
        }
        text.clear();
        let _ = write!(text, "{name}.steps");
        port.put(&text, self.steps);
    }
}

/// The whole road, tick by tick. A tick counts as `band` if every axis makes `band` steps in it.
///
/// Never inlined, like [`run_parts`]: the stages of the latter lie on the stack, and one frame for both leaves too little.
#[inline(never)]
fn run_core(
    meter: &Meter,
    port: &mut Port,
    core: &mut Core,
    words: &mut [PortBuffer; 2],
    band: (u16, u16),
) {
    let config = machine();
    let (mut controller, mut servo) = core.split(&config);
    let mut expander = PortExpander::new(&PinMap::new(&config));
    // At rest, moving without a step, in the band, the rest of them.
    let mut kinds: [Ticks; 4] = Default::default();
    let (mut received, mut worked, mut idle) = (Stat::default(), Stat::default(), Stat::default());
    let (mut lines, mut errors, mut resting) = (0_u64, 0_u64, 0);
    let mut next = Some(port.line());
    for now in 0.. {
        loop {
            if let Some(line) = &next {
                if line.first() == Some(&END) {
                    next = None;
                } else if controller.receive_free() > line.len() + 1 {
                    let ((), count) = meter.count(|| receive(&mut controller, line));
                    received.add(count);
                    lines += 1;
                    next = Some(port.line());
                }
            }
            let (more, count) = meter.count(|| poll(&mut controller, now));
            let stat = if more { &mut worked } else { &mut idle };
            stat.add(count);
            let mut first = true;
            while let Some(byte) = controller.transmit() {
                // Answers are `ok` or `error:N`.
                errors += u64::from(first && byte == b'e');
                first = byte == b'\n';
            }
            if !more {
                break;
            }
        }
        let ((), in_servo) = meter.count(|| tick(&mut servo));
        // Two buffers in turn, as the board has them.
        let buffer = &mut words[(now & 1) as usize];
        let ((), in_expand) = meter.count(|| expand(&mut expander, &servo, buffer));
        black_box(&mut *words);
        let frame = servo.frame().copied().unwrap_or_default();
        let counts = frame.axes.map(|axis| axis.count);
        let moving = servo.sample().moving;
        let kind = match counts {
            _ if !moving => 0,
            [0, 0, 0, 0, 0] => 1,
            _ if counts.iter().all(|n| (band.0..=band.1).contains(n)) => 2,
            _ => 3,
        };
        resting = if moving { 0 } else { resting + 1 };
        let ticks = &mut kinds[kind];
        ticks.servo.add(in_servo);
        ticks.expand.add(in_expand);
        ticks.both.add(in_servo + in_expand);
        ticks.steps += counts.iter().map(|&n| u64::from(n)).sum::<u64>();
        if next.is_none() && resting > REST_TICKS && controller.is_idle() {
            break;
        }
    }
    for (ticks, name) in kinds.iter().zip(["rest", "still", "band", "other"]) {
        ticks.report(port, name);
    }
    port.stat("receive", &received);
    port.stat("poll", &worked);
    port.stat("idle", &idle);
    port.put("lines", lines);
    port.put("errors", errors);
}

/// Stages of the background on their own, and what each of them took.
struct Parts<'a> {
    meter: &'a Meter,
    config: &'a Config,
    builder: SegmentBuilder,
    compensator: Compensator,
    bounds: TravelBounds,
    splitter: ArcSplitter,
    geometry: Stat,
    offset: Stat,
    travel: Stat,
    arc: Stat,
    cubics: u64,
    segments: u64,
    errors: u64,
}

impl Parts<'_> {
    /// Works off one command; everything it finishes goes through the stages behind.
    fn command(&mut self, command: &Command) {
        if let Command::Move(block) = command {
            loop {
                let config = self.config;
                let (result, work) = self.meter.count(|| self.builder.push(config, block));
                self.geometry.add(work);
                self.drain();
                match result {
                    // The end of a spline goes out before the block behind it is taken.
                    Err(error) if error.kind == GeometryErrorKind::NotDrained => {}
                    _ => {
                        self.errors += u64::from(result.is_err());
                        return;
                    }
                }
            }
        }
        while self.builder.is_open() {
            let (result, work) = self.meter.count(|| self.builder.finish(self.config));
            self.geometry.add(work);
            self.errors += u64::from(result.is_err());
            self.drain();
        }
        let (result, work) = self.meter.count(|| {
            if *command == Command::ProgramEnd {
                self.compensator.finish(self.config, &mut || {})?;
            }
            self.compensator.push_command(self.config, *command)
        });
        self.offset.add(work);
        self.errors += u64::from(result.is_err());
        self.compensated();
    }

    /// Takes what the builder has finished.
    fn drain(&mut self) {
        loop {
            let (next, work) = self.meter.count(|| self.builder.next(self.config));
            self.geometry.sum += u64::from(work);
            let Some(next) = next else { break };
            let config = self.config;
            let (result, work) = self
                .meter
                .count(|| self.compensator.push_segment(config, &next, &mut || {}));
            self.offset.add(work);
            self.errors += u64::from(result.is_err());
            self.compensated();
        }
        self.errors += u64::from(self.builder.take_failure().is_some());
    }

    /// Takes what the compensation lets go.
    fn compensated(&mut self) {
        loop {
            let (next, work) = self
                .meter
                .count(|| self.compensator.next(self.config, &mut || {}));
            self.offset.sum += u64::from(work);
            match next {
                Ok(Some(Output::Segment(next))) => self.segment(&next),
                Ok(Some(Output::Command(_))) => {}
                Ok(None) => return,
                Err(_) => {
                    self.errors += 1;
                    return;
                }
            }
        }
    }

    /// One cubic of the tool centre.
    fn segment(&mut self, next: &PathSegment) {
        self.cubics += 1;
        let config = self.config;
        let (outside, work) = self
            .meter
            .count(|| self.bounds.outside(config, &next.segment));
        self.errors += u64::from(outside.is_some());
        self.travel.add(work);
        let (result, mut work) = self
            .meter
            .count(|| self.splitter.push(config, &next.segment, next.block));
        self.errors += u64::from(result.is_err());
        while !self.splitter.is_empty() {
            let (piece, more) = self.meter.count(|| self.splitter.next(config));
            work += more;
            self.errors += u64::from(piece.is_err());
            self.segments += u64::from(matches!(piece, Ok(Some(_))));
        }
        self.arc.add(work);
    }
}

/// Counts the stages of the background one by one.
#[inline(never)]
fn run_parts(meter: &Meter, port: &mut Port) {
    let config = machine();
    let mut interpreter = Interpreter::new(&config);
    let mut parts = Parts {
        meter,
        config: &config,
        builder: SegmentBuilder::new(&config, [Steps::ZERO; AXES]),
        compensator: Compensator::new(),
        bounds: TravelBounds::new(&config),
        splitter: ArcSplitter::new(),
        geometry: Stat::default(),
        offset: Stat::default(),
        travel: Stat::default(),
        arc: Stat::default(),
        cubics: 0,
        segments: 0,
        errors: 0,
    };
    let mut parse = Stat::default();
    let mut knots = 0_u64;
    loop {
        let line = port.line();
        if line.first() == Some(&END) {
            break;
        }
        let mut commands = Vec::<Command, 8>::new();
        let mut overflow = false;
        let (result, count) = meter.count(|| {
            interpreter.line(&config, &line, &mut |command| {
                // A line that gives more is an error of the program.
                overflow |= commands.push(command).is_err();
            })
        });
        parts.errors += u64::from(overflow || result.is_err());
        for command in &commands {
            if let Command::Move(_) = command {
                parse.add(count);
                knots += 1;
            }
            parts.command(command);
        }
    }
    port.stat("parse", &parse);
    port.stat("geometry", &parts.geometry);
    port.stat("offset", &parts.offset);
    port.stat("travel", &parts.travel);
    port.stat("arc", &parts.arc);
    port.put("knots", knots);
    port.put("cubics", parts.cubics);
    port.put("segments", parts.segments);
    port.put("errors", parts.errors);
}

#[entry]
fn main() -> ! {
    static mut CORE: Core = Core::new();
    static mut WORDS: [PortBuffer; 2] = [const { PortBuffer::new() }; 2];
    if let Some(dp) = Peripherals::take() {
        let meter = Meter::new(dp.TIM2);
        let mut port = Port(PolledPort::start(dp.USART2));
        // What comes before the port is on is lost: the host waits for this.
        port.put("ready", 1);
        let header = port.line();
        let text = core::str::from_utf8(&header).unwrap_or_default();
        let mut words = text.split_ascii_whitespace();
        port.put("empty", meter.empty.into());
        port.put("memory", copy::faults().into());
        let mode = words.next();
        let mut number = || words.next().and_then(|word| word.parse().ok()).unwrap_or(0);
        let band = (number(), number());
        match mode {
            Some("core") => run_core(&meter, &mut port, CORE, WORDS, band),
            _ => run_parts(&meter, &mut port),
        }
        port.put("end", 1);
    }
    loop {
        // A sleeping core makes the emulator warn that nothing will wake it.
        cortex_m::asm::nop();
    }
}
