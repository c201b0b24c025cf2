//! Files of `pliant`: regular ones only, whole or not at all; base 64; a hash that no version changes.

pub mod base64;
pub mod durable_file;
pub mod fnv;
pub mod regular_file;
