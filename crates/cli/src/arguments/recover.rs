//! `pliant recover`.

use std::path::PathBuf;

use clap::Args;

/// `pliant recover`.
#[derive(Args, Clone, Debug)]
pub(crate) struct RecoverArguments {
    /// Partial recording of the killed run (.mcap.part)
    pub(crate) file: PathBuf,
    /// Output file; by default the name without .part
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Replace the output if it exists
    #[arg(long)]
    pub(crate) force: bool,
}
