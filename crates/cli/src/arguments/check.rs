//! `pliant check`.

use std::path::PathBuf;

use clap::Args;

/// `pliant check`.
#[derive(Args, Clone, Debug)]
pub(crate) struct CheckArguments {
    /// Scene file (TOML)
    pub(crate) scene: PathBuf,
    /// Change a value of the scene, for example time.step=1e-3; repeatable
    #[arg(long, value_name = "PATH=VALUE")]
    pub(crate) set: Vec<String>,
}
