//! The firmware image under QEMU, fed over its serial port, emits the very frames of the simulator.
//!
//! A missing emulator or image is a failure, never a skipped test: `.ci/setup` installs the one, `.ci/firmware` builds
//! the other.

use std::io;

use host_sim::emulate::{emulate, Options};
use host_sim::runner::{self, Observer};
use pentaspline::machine::Sample;
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
    let program = examples::load(name);
    let options = runner::Options {
        auto_start: true,
        events: Vec::new(),
        max_ticks: 10_000_000,
    };
    let mut totals = Totals::default();
    let host = runner::run(&program, &examples::machine(), &options, &mut totals)
        .expect("the observer does not fail");
    assert_eq!(host.end, runner::End::Finished, "{name} in the simulator");

    let options = Options {
        auto_start: true,
        ..Options::default()
    };
    let board = emulate(&program, &options, &mut ()).unwrap_or_else(|error| {
        panic!(
            "{name}: {error}. {} (`bash .ci/setup` installs the emulator, `bash .ci/firmware` builds the image)",
            error.help()
        )
    });
    assert_eq!(board.end, host.end, "{name} on the board");
    assert_eq!(board.final_steps, totals.steps, "{name}: steps");
    assert_eq!(board.ticks, totals.moving, "{name}: ticks in motion");
    assert_eq!(
        format!("{:016x}", board.digest),
        format!("{:016x}", host.digest),
        "{name}: digest of the board, digest of the simulator"
    );
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
    thesis_spline: "thesis/CSPLINE_57.MPF"
    thesis_lines: "thesis/LINEAR_57.MPF"
    tiny_moves: "tiny_moves.nc"
    wire_spellings: "wire_forms.nc"
}
