//! File access of `pliant`: regular files only, atomic replacement, base 64, and a stable hash.

pub mod base64;
pub mod durable_file;
pub mod fnv;
pub mod regular_file;
