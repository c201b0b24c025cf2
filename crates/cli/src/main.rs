//! The command-line program of pliant.

fn main() {}
