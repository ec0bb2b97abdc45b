//! The firmware image under QEMU, fed over its serial port, emits the very frames of the simulator.
//!
//! A missing emulator or image is a failure, never a skipped test: `.ci/setup` installs the one, `.ci/firmware` builds
//! the other.

use std::io;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use host_sim::emulate::{emulate, Emulated, Options};
use host_sim::events;
use host_sim::program::Program;
use host_sim::runner::{self, Observer};
use host_sim::study;
use pentaspline::machine::timetable::Row;
use pentaspline::machine::{Event, Sample};
use pentaspline::stepgen::StepFrame;
use pentaspline::units::{Tick, AXES};
use whole_product_tests::examples;

/// Where the simulator ends, and for how many ticks it moved.
#[derive(Default)]
struct Totals {
    steps: [i32; AXES],
    moving: u64,
}

impl Observer for Totals {
    fn tick(&mut self, _tick: Tick, sample: &Sample, _frame: &StepFrame) -> io::Result<()> {
        self.steps = sample.emitted;
        self.moving += u64::from(sample.moving);
        Ok(())
    }
}

fn same_frames(name: &str) {
    let board = same_frames_of(name, &examples::load(name), "");
    println!("{name}: digest {:016x}", board.digest);
}

/// Runs `program` with `events` in the simulator.
fn simulated(name: &str, program: &Program, events: &[Row]) -> (runner::Outcome, Totals) {
    let resets = events.iter().any(|row| row.event == Event::Reset);
    let options = runner::Options {
        auto_start: true,
        events: events.to_vec(),
        max_ticks: 10_000_000,
    };
    let mut totals = Totals::default();
    let host = runner::run(program, &examples::machine(), &options, &mut totals)
        .expect("the observer does not fail");
    let end = if resets {
        runner::End::Reset
    } else {
        runner::End::Finished
    };
    assert_eq!(host.end, end, "{name} in the simulator");
    assert_eq!(host.unused_events, 0, "{name}: rows behind the end");
    (host, totals)
}

/// Runs `program` with the event file `events` in the simulator and on the board; what the board did.
fn same_frames_of(name: &str, program: &Program, events: &str) -> Emulated {
    let events = events::parse("events.csv", events).expect("an event file");
    let (host, totals) = simulated(name, program, &events);

    let options = Options {
        auto_start: true,
        events,
        ..Options::default()
    };
    let board = emulate(program, &options, &mut ()).unwrap_or_else(|error| {
        panic!(
            "{name}: {error}. {} (`bash .ci/setup` installs the emulator, `bash .ci/firmware` builds the image)",
            error.help()
        )
    });
    assert_eq!(board.end, host.end, "{name} on the board");
    // The simulator passes program stops by itself.
    let said = board.messages.iter();
    let said: Vec<_> = said
        .filter(|text| !text.starts_with("program stop"))
        .collect();
    let host_said: Vec<_> = host.messages.iter().collect();
    assert_eq!(said, host_said, "{name}: what the two say");
    assert_eq!(board.final_steps, totals.steps, "{name}: steps");
    assert_eq!(board.ticks, totals.moving, "{name}: ticks in motion");
    assert_eq!(
        format!("{:016x}", board.digest),
        format!("{:016x}", host.digest),
        "{name}: digest of the board, digest of the simulator"
    );
    board
}

macro_rules! same_frames {
    ($($test:ident: $name:literal)*) => {$(
        #[test]
        fn $test() {
            same_frames($name);
        }
    )*};
}

same_frames! {
    a_spline: "akima_demo.nc"
    b_spline: "bspline_demo.nc"
    b_spline_with_intervals: "bspline_pl_sd2.nc"
    c_spline_ends: "cspline_ends.nc"
    five_axes: "five_axis_sweep.nc"
    printed_blocks: "golden/spln150.nc"
    long_rapids: "long_rapid.nc"
    mixed_modes: "mixed_modes.nc"
    brisk_motion: "pocket_brisk.nc"
    exact_stops: "square_corners.nc"
    tiny_moves: "tiny_moves.nc"
    wire_spellings: "wire_forms.nc"
}

/// All kinds of rows but a reset: holds that come while the machine speeds up, slows down and rests, overrides that
/// follow each other within the time of a ramp, and a supply that fails.
const DISTURBANCES: &str = "tick,event
0,override=120
500,hold
1500,resume
2600,override=40
2650,override=180
3000,rapid=30
3900,override=0
5000,override=90
5600,starve=3000
9000,hold
10500,override=150
10600,resume
11200,rapid=100
";

#[test]
fn disturbed_runs_are_the_same_on_both() {
    for name in [
        "long_rapid.nc",
        "five_axis_sweep.nc",
        "mixed_modes.nc",
        "bspline_demo.nc",
    ] {
        let program = examples::load(name);
        let (calm, totals) = simulated(name, &program, &[]);
        let board = same_frames_of(name, &program, DISTURBANCES);
        println!(
            "{name}: digest {:016x} undisturbed, {:016x} with events; {:?}",
            calm.digest, board.digest, board.messages
        );
        assert_ne!(calm.digest, board.digest);
        assert_eq!(totals.steps, board.final_steps);
    }
}

#[test]
fn a_supply_that_fails_ends_in_the_same_rest_on_both() {
    let mut text = String::from("G64 SOFT G1 F3000\n");
    for i in 1..=600 {
        let x = 0.16 * f64::from(i);
        text += &format!("X{x:.4} Y{:.4}\n", 0.75 * x);
    }
    let program = Program::from_text("dashes.mpf", &(text + "M30\n")).expect("a program");
    let events = "2000,starve=20000\n4000,override=60\n6000,hold\n7000,resume\n";
    let board = same_frames_of("dashes", &program, events);
    let said = board.messages.iter().filter(|m| m.contains("UNDERRUN"));
    assert_eq!(said.count(), 1, "{:?}", board.messages);
}

#[test]
fn a_reset_leaves_both_at_the_same_place() {
    let name = "five_axis_sweep.nc";
    let events = "900,override=70\n4000,reset\n";
    let board = same_frames_of(name, &examples::load(name), events);
    println!(
        "{name}: {:?} after {} ticks",
        board.final_steps, board.ticks
    );
}

/// Runs every program of the study if it is set.
const CAMPAIGN: &str = "PENTASPLINE_CAMPAIGN";

/// One program of each method, that of the C-spline a roughing one: what a minute or two has room for.
const BOUNDED: [&str; 4] = [
    "FINISH_EKVI_15_A.MPF",
    "FINISH_EKVI_15_LIN.MPF",
    // Its contour ends in a bend that the compensation looks back from for 100 ticks: longer than is planned ahead.
    "ROUGH_POLAR_5_C.MPF",
    "FINISH_EKVI_15_B.MPF",
];

#[test]
fn thesis_programs_with_their_compensation_four_of_them_or_all_36_in_a_campaign() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("thesis-board");
    study::write_programs(&folder).unwrap_or_else(|failure| panic!("{failure:?}"));
    let names: Vec<String> = if std::env::var_os(CAMPAIGN).is_some() {
        let jobs = study::programs::all().into_iter();
        jobs.map(|job| job.main.name).collect()
    } else {
        BOUNDED.map(str::to_owned).to_vec()
    };
    let next = AtomicUsize::new(0);
    let work = || {
        while let Some(name) = names.get(next.fetch_add(1, Ordering::Relaxed)) {
            let program =
                Program::load(&folder.join(name)).unwrap_or_else(|failure| panic!("{failure:?}"));
            let began = std::time::Instant::now();
            let board = same_frames_of(name, &program, "");
            println!(
                "{name}: digest {:016x}, {} ticks, stack {} bytes, {:.1} s",
                board.digest,
                board.ticks,
                board.stack.0,
                began.elapsed().as_secs_f64()
            );
        }
    };
    // Each emulator takes a core for itself.
    std::thread::scope(|scope| {
        scope.spawn(work);
        work();
    });
    assert!(next.into_inner() >= names.len() && names.len() >= BOUNDED.len());
}
