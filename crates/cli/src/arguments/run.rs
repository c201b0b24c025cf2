//! `pliant run`, and its options that `pliant resume` shares.

use std::num::NonZeroU16;
use std::path::PathBuf;

use clap::Args;

use super::values::{positive_seconds, time_span};

/// `pliant run`.
#[derive(Args, Clone, Debug)]
// A group with a flattened struct in it is empty unless its members are named, and `pliant SCENE` is known
// by it.
#[group(args = ["scene", "set", "probes"])]
pub(crate) struct RunArguments {
    /// Scene file (TOML)
    pub(crate) scene: PathBuf,
    /// Change a value of the scene, for example time.step=1e-3; repeatable
    #[arg(long, value_name = "PATH=VALUE")]
    pub(crate) set: Vec<String>,
    /// Also write the readings of the scene's probes as a table of comma-separated values
    #[arg(long, value_name = "FILE")]
    pub(crate) probes: Option<PathBuf>,
    /// Also estimate the errors by mesh, step and solver of these quantities, separated by commas: tip.y,
    /// "tip.y max", left.force.x, energy.elastic [default: all probes]. This takes a few coarser and finer
    /// runs; the mesh's numbers of cells must be divisible by 4
    #[arg(
        long,
        value_name = "QUANTITIES",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "",
        value_delimiter = ','
    )]
    pub(crate) errors: Option<Vec<String>>,
    /// Open the recording in the browser when the run has ended, as `pliant view` does
    #[arg(long, conflicts_with = "no_record")]
    pub(crate) view: bool,
    #[command(flatten)]
    pub(crate) options: RunOptions,
}

/// Options of a run, begun or resumed.
#[derive(Args, Clone, Debug)]
pub(crate) struct RunOptions {
    /// Recording [default: the name of the scene with .mcap, in the working directory]
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Replace the output if it exists
    #[arg(long)]
    pub(crate) force: bool,
    /// Simulate this long instead of the scene's duration [s]
    #[arg(long, value_name = "SECONDS", value_parser = positive_seconds, allow_negative_numbers = true)]
    pub(crate) until: Option<f64>,
    /// Number of threads [default: all cores]; the result does not depend on it
    #[arg(long, value_name = "N")]
    pub(crate) threads: Option<NonZeroU16>,
    /// Simulate without recording
    #[arg(long, conflicts_with = "output")]
    pub(crate) no_record: bool,
    /// Write a checkpoint at most this often (60s, "5 min"), at the end and on Ctrl-C: `pliant resume`
    /// continues from it, bit-identically. It is next to the recording, with .checkpoint in place of .mcap
    #[arg(long, value_name = "TIME", value_parser = time_span)]
    pub(crate) checkpoint: Option<f64>,
}
