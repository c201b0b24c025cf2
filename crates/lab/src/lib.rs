//! The laboratory of `pliant`: error against run time, limits of stability, the torture suite, benchmarks.
//!
//! All of it is built on whole runs of scenes, and none of it is needed to simulate.

// Inside a function the symbols of the paper are clearer than words.
#![allow(non_snake_case)]
// Loops over small fixed ranges index several arrays at once.
#![allow(clippy::needless_range_loop)]

pub mod benchmark;
pub mod fit;
pub mod stability;
pub mod statistics;
pub mod stress;
pub mod study;
