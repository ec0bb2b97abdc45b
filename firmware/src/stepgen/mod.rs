//! Positions to step edges. Integer only.

pub mod frame;
pub mod generator;
pub mod port;
pub mod record;

pub use frame::{AxisSteps, StepFrame, SLOTS};
pub use generator::StepGenerator;
