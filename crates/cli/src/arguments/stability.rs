//! `pliant stability`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::values::time_span;

/// `pliant stability`.
#[derive(Args, Clone, Debug)]
pub(crate) struct StabilityArguments {
    /// Scene file (TOML)
    pub(crate) scene: PathBuf,
    /// Change a value of the scene, for example time.step=1e-3; repeatable
    #[arg(long, value_name = "PATH=VALUE")]
    pub(crate) set: Vec<String>,
    /// The integrators to look at, the scene's own first [default: all]
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    pub(crate) integrators: Vec<String>,
    /// What the map has beside the step [default: young, gravity where nothing is elastic, else density]
    #[arg(long, value_name = "WHAT")]
    pub(crate) against: Option<AgainstArgument>,
    /// A coarse map
    #[arg(long)]
    pub(crate) quick: bool,
    /// Print a row for each integrator and the map on a terminal, too; without it a terminal shows the
    /// answer in at most 24 lines
    #[arg(long)]
    pub(crate) all: bool,
    /// Wall time for everything, for example 20s or "5 min"; the report names what it did not reach
    #[arg(long, value_name = "TIME", value_parser = time_span, default_value = "60s")]
    pub(crate) budget: f64,
    /// Also write stability.csv, map.csv, stability.json, stability.html and its charts into this folder
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,
}

/// Quantities that a map can vary.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum AgainstArgument {
    /// Young's modulus, or the constant of springs, of all bodies
    Young,
    /// Poisson's ratio of all bodies
    Poisson,
    /// The density, or other mass, of the first body
    Density,
    /// The constant of mutual gravity
    Gravity,
}
