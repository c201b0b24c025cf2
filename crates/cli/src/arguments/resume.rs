//! `pliant resume`.

use std::path::PathBuf;

use clap::Args;

use super::run::RunOptions;

/// `pliant resume`.
#[derive(Args, Clone, Debug)]
#[command(
    mut_arg("output", |output| output.help(OUTPUT)),
    mut_arg("until", |until| until.help(UNTIL)),
    mut_arg("no_record", |no_record| no_record.help("Go on without recording")),
    mut_arg("checkpoint", |checkpoint| checkpoint.help(CHECKPOINT)),
)]
pub(crate) struct ResumeArguments {
    /// Checkpoint (.checkpoint)
    pub(crate) file: PathBuf,
    /// Table of probes that the run has written so far, where it is not beside the checkpoint
    #[arg(long, value_name = "FILE")]
    pub(crate) probes: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) options: RunOptions,
}

const OUTPUT: &str = "Where to record, with the frames before; by default where the run has recorded so far";
const UNTIL: &str = "Simulate until this time instead of the duration so far [s]";
const CHECKPOINT: &str = "Keep a checkpoint at most so often [default: as the run did]";
