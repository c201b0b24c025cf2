//! `pliant completions` and `pliant man`.

use std::path::PathBuf;

use clap::Args;
use clap_complete::Shell;

/// `pliant completions`.
#[derive(Args, Clone, Debug)]
pub(crate) struct CompletionsArguments {
    /// Shell: bash, zsh, fish, powershell or elvish
    #[arg(value_name = "SHELL", hide_possible_values = true)]
    pub(crate) shell: Shell,
}

/// `pliant man`.
#[derive(Args, Clone, Debug)]
pub(crate) struct ManArguments {
    /// Folder for a page of each command [default: print the main page]
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) output: Option<PathBuf>,
    /// Replace pages that exist
    #[arg(long)]
    pub(crate) force: bool,
}
