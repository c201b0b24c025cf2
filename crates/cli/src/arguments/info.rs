//! `pliant info`.

use std::path::PathBuf;

use clap::Args;

/// `pliant info`.
#[derive(Args, Clone, Debug)]
pub(crate) struct InfoArguments {
    /// Recording (.mcap)
    pub(crate) file: PathBuf,
}
