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
    /// Integrators, the scene's own first [default: all]
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    pub(crate) integrators: Vec<String>,
    /// Parameter of the map [default: young; gravity or density if no body is elastic]
    #[arg(long, value_name = "WHAT")]
    pub(crate) against: Option<AgainstArgument>,
    /// Draw a coarse map
    #[arg(long)]
    pub(crate) quick: bool,
    /// Print all rows and the map on a terminal, too, instead of at most 24 lines
    #[arg(long)]
    pub(crate) all: bool,
    /// Wall time of the search, for example 20s or "5 min"; the report lists what it did not reach
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
