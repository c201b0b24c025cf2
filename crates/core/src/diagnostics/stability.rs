//! How large a time step may be: the modes of the assembled system, and what a scheme does to them.

mod lanczos;
mod limit;
mod modes;

pub use limit::{StabilityLimit, stability_limit};
pub use modes::{Mode, ModeRange, Spectrum, largest_frequency, mode_range};
