//! Positions to step edges. Integer only.

pub mod frame;
pub mod generator;
pub mod port;
pub mod record;

pub use generator::StepGenerator;
pub use frame::{AxisSteps, StepFrame, SLOTS};
