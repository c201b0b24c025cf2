//! The machine that the numbers were measured on.

use std::collections::BTreeMap;

use pliant::lanes::level;
use pliant_lab::benchmark::{processor, triad};

use crate::failure::Failure;

/// This machine, and what it runs.
#[derive(Debug, serde::Serialize)]
pub(super) struct Machine {
    /// Model of the processor.
    pub(super) processor: String,
    /// Cores that this program may use.
    pub(super) cores: usize,
    /// `x86_64` and the like.
    pub(super) architecture: &'static str,
    /// `linux` and the like.
    pub(super) system: &'static str,
    /// Instruction set of the kernels.
    pub(super) instruction_set: &'static str,
    /// Of pliant.
    pub(super) version: &'static str,
    /// Bandwidth of memory by the triad [bytes/s], by number of threads.
    pub(super) stream_triad: BTreeMap<usize, f64>,
}

impl Machine {
    pub(super) fn measured() -> Machine {
        Machine {
            processor: processor(),
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            architecture: std::env::consts::ARCH,
            system: std::env::consts::OS,
            instruction_set: level().name(),
            version: env!("CARGO_PKG_VERSION"),
            stream_triad: BTreeMap::new(),
        }
    }

    /// Bandwidth of memory with this many threads [bytes/s]; measured once.
    pub(super) fn bandwidth(&mut self, threads: usize) -> Result<f64, Failure> {
        if let Some(&bandwidth) = self.stream_triad.get(&threads) {
            return Ok(bandwidth);
        }
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.map_err(|error| {
            Failure::failed("threads", format!("cannot start {threads} threads: {error}"))
        })?;
        let bandwidth = pool.install(triad);
        self.stream_triad.insert(threads, bandwidth);
        Ok(bandwidth)
    }
}
