//! `pliant study`.

use std::num::NonZeroU16;
use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::values::time_span;

/// `pliant study`.
#[derive(Args, Clone, Debug)]
pub(crate) struct StudyArguments {
    /// Scene files (TOML); what they say in [study] is what is compared, unless told otherwise here
    #[arg(required = true, value_name = "SCENE")]
    pub(crate) scenes: Vec<PathBuf>,
    /// Change a value of the scene, for example time.duration=1; repeatable
    #[arg(long, value_name = "PATH=VALUE")]
    pub(crate) set: Vec<String>,
    /// The schemes, separated by commas [default: a dozen, and the scene's own]
    #[arg(long, value_name = "A,B,..")]
    pub(crate) integrators: Option<String>,
    /// The steps [s], separated by commas [default: chosen by factors of 2]
    #[arg(long, value_name = "A,B,..")]
    pub(crate) steps: Option<String>,
    /// Tolerances of schemes whose steps follow the error, separated by commas [default: by factors of 10]
    #[arg(long, value_name = "A,B,..")]
    pub(crate) tolerances: Option<String>,
    /// Vary a value of the scene beside; repeatable, every combination is studied
    #[arg(long, value_name = "PATH=A,B,..")]
    pub(crate) vary: Vec<String>,
    /// Study the total error of quantities, mesh and step together: on N meshes, each with twice the cells of
    /// the one before [default: 3, from the scene's own cells]
    #[arg(long, value_name = "N", num_args = 0..=1, default_missing_value = "0", conflicts_with_all = [
        "vary", "steps", "tolerances", "times", "reference", "error", "brief", "markdown"])]
    pub(crate) refine: Option<u16>,
    /// A quantity to study with --refine, for example "tip.y max"; repeatable [default: all probes]
    #[arg(long, value_name = "NAME", requires = "refine")]
    pub(crate) of: Vec<String>,
    /// The elements to compare with --refine, separated by commas, for example linear,quadratic [default: all
    /// that the mesh has]
    #[arg(long, value_name = "A,B,..", requires = "refine")]
    pub(crate) elements: Option<String>,
    /// At how many times states are compared, at least 20
    #[arg(long, value_name = "N")]
    pub(crate) times: Option<NonZeroU16>,
    /// Timed runs of each row [default: 7, or as many as take a second]
    #[arg(long, value_name = "N")]
    pub(crate) repeats: Option<NonZeroU16>,
    /// Threads that steps run on, as many for every row; the system places them [default: 1]
    #[arg(long, value_name = "N")]
    pub(crate) threads: Option<NonZeroU16>,
    /// Wall time for everything, for example 60s or "5 min" [default: 60s for each scene where steps are
    /// chosen]
    #[arg(long, value_name = "TIME", value_parser = time_span)]
    pub(crate) budget: Option<f64>,
    /// Where the reference comes from: auto, exact or computed
    #[arg(long, value_name = "FROM", default_value = "auto", hide_possible_values = true)]
    pub(crate) reference: ReferenceFrom,
    /// The largest error that the recommendation may have [default: 0.01]
    #[arg(long, value_name = "ERROR")]
    pub(crate) error: Option<f64>,
    /// Folder for reports, charts, tables, and what a next study can use [default: the name of the scene
    /// with -study]
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,
    /// Where the Markdown goes [default: report.md in the folder]
    #[arg(long, value_name = "FILE")]
    pub(crate) markdown: Option<PathBuf>,
    /// Title of the report
    #[arg(long, value_name = "TEXT")]
    pub(crate) title: Option<String>,
    /// Two charts for each scene rather than five
    #[arg(long)]
    pub(crate) brief: bool,
    /// Forget the rows and references that an earlier study left in the folder
    #[arg(long)]
    pub(crate) fresh: bool,
}

/// Where the reference of a study comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ReferenceFrom {
    /// Exact where it is known, else computed
    Auto,
    /// Exact, or the study is refused
    Exact,
    /// Computed by two independent schemes
    Computed,
}
