//! Experiments with `pliant`: error against run time, stability limits, the robustness suite, benchmarks.
//!
//! Everything here is built on whole runs of scenes; a simulation needs none of it.

// Inside a function the symbols of the paper are clearer than words.
#![allow(non_snake_case)]
// Loops over small fixed ranges index several arrays at once.
#![allow(clippy::needless_range_loop)]

pub mod accuracy;
pub mod benchmark;
pub mod budget;
pub mod convergence;
pub mod fit;
pub mod quantity;
pub mod refinement;
pub mod stability;
pub mod statistics;
pub mod stress;
pub mod study;
