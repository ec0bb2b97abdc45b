//! Positions to step edges. Integer only.

pub mod frame;

pub use frame::{AxisSteps, StepFrame, SLOTS};
