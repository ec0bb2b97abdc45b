//! Positions to step edges. Integer only.

pub mod frame;
pub mod record;

pub use frame::{AxisSteps, StepFrame, SLOTS};
