//! The command-line program of pliant, as a library: the binary of this crate and the command of the Python
//! package are both it.

mod arguments;
mod commands;
mod failure;
mod input;
mod interrupt;
mod output;
mod printable;
mod progress;
mod recording;
mod statistics;
mod terminal;
mod text;

use std::ffi::OsString;

pub use commands::{closing, export, listed, provenance, stress_case, study_document};

/// Does what a command line asks for, the program's name first, and returns the exit code: 0 done, 1 failed,
/// 2 bad usage or a bad scene, 130 interrupted. From the first command that simulates on, Ctrl-C is the
/// program's: at the second the process ends.
pub fn execute(arguments: impl Iterator<Item = OsString>) -> u8 {
    commands::execute(arguments).code()
}
