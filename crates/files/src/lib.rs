//! File access of `pliant`: regular files only, atomic replacement, base 64, and a stable hash; files and a
//! clock where there is no system (in a browser).

pub mod base64;
pub mod clock;
pub mod disk;
pub mod durable_file;
pub mod fnv;
pub mod memory;
pub mod regular_file;
