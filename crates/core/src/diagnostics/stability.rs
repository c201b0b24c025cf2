//! How large a time step may be: the modes of the assembled system, and what a scheme does to them.

mod lanczos;
mod limit;
mod modes;

pub use limit::{StabilityLimit, stability_limit};
pub use modes::{DampedMode, HighestFrequency, ModeRange, largest_frequency, mode_range};
