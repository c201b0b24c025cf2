//! `pliant bench`.

use std::num::NonZeroU16;

use clap::Args;

/// `pliant bench`.
#[derive(Args, Clone, Debug)]
pub(crate) struct BenchArguments {
    /// Only this row of the table; repeatable
    #[arg(long, value_name = "NAME")]
    pub(crate) row: Vec<String>,
    /// Number of threads [default: one; two as well where threads are compared]
    #[arg(long, value_name = "N")]
    pub(crate) threads: Option<NonZeroU16>,
    /// Measure only the smallest size of each row, briefly
    #[arg(long)]
    pub(crate) quick: bool,
}
