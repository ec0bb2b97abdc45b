//! What every run is watched for: its summary and its travel.
//!
//! In: ticks, as an [`Observer`]. Out: the [`Summary`] with all excursions beyond the travel.

use std::io;

use pentaspline::machine::Sample;
use pentaspline::stepgen::StepFrame;
use pentaspline::units::Tick;

use crate::machine_file::Machine;
use crate::runner::Observer;
use crate::summary::{Summary, SummaryBuilder};
use crate::travel::TravelWatch;

/// Collects summary and excursions; records nothing per tick.
#[derive(Clone, Debug)]
pub struct Watch {
    summary: SummaryBuilder,
    travel: TravelWatch,
}

impl Watch {
    /// Watch over a run that starts at rest at the origin.
    #[must_use]
    pub fn new(machine: &Machine) -> Self {
        Self {
            summary: SummaryBuilder::new(machine, &Sample::default()),
            travel: TravelWatch::new(machine),
        }
    }

    /// Closes the books on `program`, whose frames have `digest`; the machine rests from here on.
    #[must_use]
    pub fn finish(self, machine: &Machine, program: &str, digest: u64) -> Summary {
        let mut summary = self.summary.finish(machine, program, digest);
        summary.take_violations(self.travel);
        summary
    }
}

impl Observer for Watch {
    fn tick(&mut self, tick: Tick, sample: &Sample, _: &StepFrame) -> io::Result<()> {
        self.summary.tick(sample);
        self.travel.tick(tick, sample.block, &sample.commanded);
        Ok(())
    }
}
