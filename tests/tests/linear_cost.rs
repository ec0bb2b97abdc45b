//! Cost grows linearly with the program, and not at all with its length in memory.
//!
//! The lines are made when they are sent, so whatever grows is kept by the core, the feeder or the runner. Counted are heap
//! bytes of the thread that runs, servo ticks and background calls: nothing here reads a clock.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use host_sim::bench::vectors::long;
use host_sim::feeder::Line;
use host_sim::machine_file::Machine;
use host_sim::runner::{run_lines, End, Options};
use pentaspline::units::Tick;

thread_local! {
    /// Bytes this thread holds, and the most it has held.
    static HEAP: Cell<(isize, isize)> = const { Cell::new((0, 0)) };
}

struct Counting;

fn count(bytes: isize) {
    // While a thread ends there is nothing to count any more.
    let _ = HEAP.try_with(|heap| {
        let (held, peak) = heap.get();
        let held = held + bytes;
        heap.set((held, peak.max(held)));
    });
}

// SAFETY: every call goes on to the system's allocator as it is. Counting allocates nothing: the thread's cell is a constant
// and has no destructor.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size() as isize);
        // SAFETY: the caller's promises are those of the system's allocator.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        count(-(layout.size() as isize));
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// What a program of so many blocks takes.
#[derive(Debug)]
struct Cost {
    blocks: f64,
    heap: isize,
    ticks: f64,
    calls: f64,
}

fn cost(machine: &Machine, blocks: u32) -> Cost {
    let options = Options {
        auto_start: true,
        events: Vec::new(),
        max_ticks: Tick::MAX,
    };
    let held = HEAP.with(|heap| {
        let (held, _) = heap.get();
        heap.set((held, held));
        held
    });
    let lines = long(blocks).map(|line| Line::Owned(line.into_bytes()));
    let outcome = run_lines(lines, machine, &options, &mut ()).expect("nothing is written");
    assert_eq!(outcome.end, End::Finished);
    Cost {
        blocks: f64::from(blocks),
        heap: HEAP.with(|heap| heap.get().1) - held,
        ticks: outcome.ticks as f64,
        calls: outcome.background_calls as f64,
    }
}

#[test]
fn neither_heap_nor_work_per_block_depends_on_how_many_blocks_there_are() {
    let machine = Machine::built_in().expect("the built-in machine");
    let costs = [1_000, 10_000, 100_000].map(|blocks| cost(&machine, blocks));
    let [short, middle, long] = &costs;
    assert_eq!(short.heap, long.heap, "peak heap in bytes: {costs:?}");
    // Differences, because beginning and end cost the same once, however long the program is.
    for (what, of) in [
        ("ticks", (|cost| cost.ticks) as fn(&Cost) -> f64),
        ("background calls", |cost| cost.calls),
    ] {
        let per_block = |a: &Cost, b: &Cost| (of(b) - of(a)) / (b.blocks - a.blocks);
        let ratio = per_block(middle, long) / per_block(short, middle);
        assert!(
            (ratio - 1.0).abs() < 0.01,
            "{what} per block change by a factor of {ratio}: {costs:?}"
        );
    }
}
