//! `pliant view`.

use std::path::PathBuf;

use clap::Args;

/// `pliant view`.
#[derive(Args, Clone, Debug)]
pub(crate) struct ViewArguments {
    /// Recording (.mcap)
    pub(crate) file: PathBuf,
    /// Page [default: next to the recording, with .html in place of .mcap]
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Replace the page if it exists
    #[arg(long)]
    pub(crate) force: bool,
    /// Write the page without opening it
    #[arg(long)]
    pub(crate) no_open: bool,
}
