//! `pliant new`.

use std::path::PathBuf;

use clap::Args;

/// `pliant new`.
#[derive(Args, Clone, Debug)]
pub(crate) struct NewArguments {
    /// Scene to write; `.toml` is added
    #[arg(required_unless_present = "list")]
    pub(crate) name: Option<PathBuf>,
    /// Kind of scene: a name that `--list` prints
    #[arg(long, value_name = "KIND", default_value = "jelly")]
    pub(crate) kind: String,
    /// Print the kinds of scenes
    #[arg(long)]
    pub(crate) list: bool,
    /// Replace the scene if it exists
    #[arg(long)]
    pub(crate) force: bool,
}
