//! Stability limit of the time step: the modes of the assembled system, and their amplification by an
//! integrator.

mod lanczos;
mod limit;
mod modes;

pub use limit::{StabilityLimit, stability_limit};
pub use modes::{DampedMode, HighestFrequency, ModeRange, largest_frequency, mode_range};
