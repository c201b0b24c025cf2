//! `pliant solve`.

use std::path::PathBuf;

use clap::Args;

use super::values::time_span;

/// `pliant solve`.
#[derive(Args, Clone, Debug)]
pub(crate) struct SolveArguments {
    /// Scene file (TOML); its [accuracy] sets accuracy and quantity, unless options do
    pub(crate) scene: PathBuf,
    /// Largest error of the quantity: "1 %" of its largest magnitude over time, or with a unit, "0.1 mm"
    #[arg(long, value_name = "ERROR", requires = "of")]
    pub(crate) accuracy: Option<String>,
    /// Quantity, for example tip.y or "left.force.x mean"
    #[arg(long, value_name = "NAME", requires = "accuracy")]
    pub(crate) of: Option<String>,
    /// Change a value of the scene, for example time.duration=1; repeatable
    #[arg(long, value_name = "PATH=VALUE")]
    pub(crate) set: Vec<String>,
    /// Wall time of the search, for example 60s or "5 min" [default: 5 min]
    #[arg(long, value_name = "TIME", value_parser = time_span)]
    pub(crate) budget: Option<f64>,
}
