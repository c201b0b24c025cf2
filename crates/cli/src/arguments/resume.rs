//! `pliant resume`.

use std::path::PathBuf;

use clap::Args;

use super::run::RunOptions;

/// `pliant resume`.
#[derive(Args, Clone, Debug)]
#[command(
    mut_arg("output", |output| output.help(OUTPUT)),
    mut_arg("until", |until| until.help(UNTIL)),
    mut_arg("no_record", |no_record| no_record.help("Continue without recording")),
    mut_arg("checkpoint", |checkpoint| checkpoint.help(CHECKPOINT)),
)]
pub(crate) struct ResumeArguments {
    /// Checkpoint (.checkpoint)
    pub(crate) file: PathBuf,
    /// Table of probes that the run has written so far, if it is not next to the checkpoint
    #[arg(long, value_name = "FILE")]
    pub(crate) probes: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) options: RunOptions,
}

const OUTPUT: &str = "Recording, earlier frames included [default: that of the run]";
const UNTIL: &str = "Simulate until this time [s] [default: the end of the run]";
const CHECKPOINT: &str = "Shortest time between checkpoints [default: that of the run]";
