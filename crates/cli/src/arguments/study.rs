//! `pliant study`.

use std::num::NonZeroU16;
use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::values::time_span;

/// `pliant study`.
#[derive(Args, Clone, Debug)]
pub(crate) struct StudyArguments {
    /// Scene files (TOML); their [study] sets what is compared, unless options do
    #[arg(required = true, value_name = "SCENE")]
    pub(crate) scenes: Vec<PathBuf>,
    /// Change a value of the scene, for example time.duration=1; repeatable
    #[arg(long, value_name = "PATH=VALUE")]
    pub(crate) set: Vec<String>,
    /// Integrators, separated by commas [default: a dozen, and the scene's own]
    #[arg(long, value_name = "A,B,..")]
    pub(crate) integrators: Option<String>,
    /// Steps [s], separated by commas [default: chosen by factors of 2]
    #[arg(long, value_name = "A,B,..")]
    pub(crate) steps: Option<String>,
    /// Tolerances of adaptive integrators, separated by commas [default: by factors of 10]
    #[arg(long, value_name = "A,B,..")]
    pub(crate) tolerances: Option<String>,
    /// Also vary a value of the scene; repeatable: every combination is studied
    #[arg(long, value_name = "PATH=A,B,..")]
    pub(crate) vary: Vec<String>,
    /// Study the total error of quantities, mesh and step together, on N meshes, each with twice the cells of
    /// the one before [default: 3, from the scene's own cells]
    #[arg(long, value_name = "N", num_args = 0..=1, default_missing_value = "0", conflicts_with_all = [
        "vary", "steps", "tolerances", "times", "reference", "error", "brief", "markdown"])]
    pub(crate) refine: Option<u16>,
    /// Quantity to study with --refine, for example "tip.y max"; repeatable [default: all probes]
    #[arg(long, value_name = "NAME", requires = "refine")]
    pub(crate) of: Vec<String>,
    /// Elements to compare with --refine, separated by commas, for example linear,quadratic [default: all
    /// that the mesh supports]
    #[arg(long, value_name = "A,B,..", requires = "refine")]
    pub(crate) elements: Option<String>,
    /// Number of times at which states are compared, at least 20
    #[arg(long, value_name = "N")]
    pub(crate) times: Option<NonZeroU16>,
    /// Timed runs per row [default: 7, or as many as take a second]
    #[arg(long, value_name = "N")]
    pub(crate) repeats: Option<NonZeroU16>,
    /// Number of threads, the same for each row [default: 1]
    #[arg(long, value_name = "N")]
    pub(crate) threads: Option<NonZeroU16>,
    /// Wall time of all runs, for example 60s or "5 min" [default: 60s per scene, if steps are not given]
    #[arg(long, value_name = "TIME", value_parser = time_span)]
    pub(crate) budget: Option<f64>,
    /// Reference solution: auto, exact or computed
    #[arg(long, value_name = "FROM", default_value = "auto", hide_possible_values = true)]
    pub(crate) reference: ReferenceFrom,
    /// Largest allowed error of the recommendation [default: 0.01]
    #[arg(long, value_name = "ERROR")]
    pub(crate) error: Option<f64>,
    /// Folder for reports, charts, tables, and results that the next study reuses [default: the name of the
    /// scene with -study]
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,
    /// Markdown report [default: report.md in the folder]
    #[arg(long, value_name = "FILE")]
    pub(crate) markdown: Option<PathBuf>,
    /// Title of the report
    #[arg(long, value_name = "TEXT")]
    pub(crate) title: Option<String>,
    /// Draw two charts per scene rather than five
    #[arg(long)]
    pub(crate) brief: bool,
    /// Ignore the results of an earlier study in the folder
    #[arg(long)]
    pub(crate) fresh: bool,
}

/// Where the reference of a study comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ReferenceFrom {
    /// Exact if known, else computed
    Auto,
    /// Exact; an error if there is none
    Exact,
    /// Computed by two independent integrators
    Computed,
}
