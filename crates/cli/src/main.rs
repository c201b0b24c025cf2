//! The command-line program of pliant.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(pliant_cli::execute(std::env::args_os()))
}
