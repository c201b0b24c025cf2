//! The command-line program of pliant.

mod arguments;
mod commands;
mod failure;
mod input;
mod interrupt;
mod output;
mod progress;
mod recording;
mod statistics;
mod terminal;
mod text;

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(commands::execute(std::env::args_os()).code())
}
