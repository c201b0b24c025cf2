//! `pliant recover`.

use std::path::PathBuf;

use clap::Args;

/// `pliant recover`.
#[derive(Args, Clone, Debug)]
pub(crate) struct RecoverArguments {
    /// What the killed run left behind (.mcap.part)
    pub(crate) file: PathBuf,
    /// Where to write; by default the name without .part
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Replace the output if it exists
    #[arg(long)]
    pub(crate) force: bool,
}
