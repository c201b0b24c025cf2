//! Benchmarks: workloads of known size that measure the speed of whole steps on this machine.
//!
//! A [`BenchmarkRow`] is one line of the table that `pliant bench` prints: work of one kind, in one or more
//! [`BenchmarkCase`]s. A case has one [`BenchmarkPart`] that is timed, or two that are timed alternately and
//! compared. Nearly all of them are scenes, assembled like a user's scene.
//!
//! # How to add a row
//! 1. Write a file in this folder with its `ROW`, which lists its cases, and add a line to `rows`. A case is
//!    a scene, assembled as a user's is, and says what it counts.
//! 2. Two parts of a case that are timed in turn make a ratio.
//! 3. If the cost depends on the state, a test shows that timing does not change it:
//!    `deformation_stays_what_it_is_while_it_is_timed` in `tests.rs`.
//! 4. Criterion has the row from that line too: `cargo bench -p pliant-lab --bench rows -- NAME`.

mod autodiff;
mod beam;
mod cloth_implicit;
mod contact;
mod contact_kernels;
mod contact_share;
mod expression;
mod gradient;
mod hessian_stable_neo_hookean;
mod implicit_euler;
mod measure;
mod nbody_direct;
mod processor;
mod recording;
mod scatter;
mod solve;
mod solve_growth;
mod springs;
mod stepping;
mod stream;
mod svd;
#[cfg(test)]
mod tests;
mod tet_corotated;
mod tet_stable_neo_hookean;
mod threads;
mod tri_corotated;

use std::time::Duration;

use pliant::simulation::StepError;
use pliant_scene::SceneError;

pub use measure::{Budget, Measurement, TimedPart, measure};
pub use processor::processor;
pub use stream::triad;

/// Rows of the table, in order.
pub fn rows() -> Vec<BenchmarkRow> {
    vec![
        tet_stable_neo_hookean::ROW,
        tet_corotated::ROW,
        tri_corotated::ROW,
        springs::ROW,
        nbody_direct::ROW,
        svd::ROW,
        autodiff::ROW,
        expression::ROW,
        solve::ROW,
        solve_growth::ROW,
        threads::ROW,
        hessian_stable_neo_hookean::ROW,
        implicit_euler::ROW,
        cloth_implicit::ROW,
        contact_kernels::ROW,
        contact::CLOTH,
        contact::BARS,
        contact::STACK,
        contact::BUNNY,
        contact::APART,
        gradient::EXPLICIT,
        gradient::IMPLICIT,
        recording::ROW,
    ]
}

/// Machine of the reference figures.
pub const REFERENCE_MACHINE: &str = "2 cores of Zen 5 with AVX-512";

/// A row: work of one kind.
#[derive(Clone, Copy, Debug)]
pub struct BenchmarkRow {
    /// Name in the table.
    pub name: &'static str,
    /// Description of the measurement in one line.
    pub summary: &'static str,
    /// Cases, those of a quick look first and all of one size. `threads` replaces the usual number of
    /// threads.
    pub cases: fn(threads: Option<usize>) -> Vec<BenchmarkCase>,
}

/// A case: one number of the table.
#[derive(Debug)]
pub struct BenchmarkCase {
    /// Number of `items` in one repetition.
    pub size: u64,
    /// Items counted: `tets`, `bodies`.
    pub items: &'static str,
    /// Difference from the other cases of the row.
    pub case: String,
    /// Kind of the figure.
    pub figure: Metric,
    /// Timed parts: one for a rate or a time, two for a comparison.
    pub parts: Vec<BenchmarkPart>,
    /// Reference value, in the unit of the figure.
    pub reference: Option<PublishedValue>,
}

/// A value for comparison.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PublishedValue {
    /// Value in the unit of the case.
    pub value: f64,
    /// Origin of the value.
    pub source: &'static str,
}

/// A target value: on [`REFERENCE_MACHINE`] unless it is a ratio.
pub(crate) const fn goal(value: f64) -> Option<PublishedValue> {
    Some(PublishedValue { value, source: "figure to reach" })
}

/// Conversion of times to the figure of a case.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Metric {
    /// Rate: `per_repetition` units of work in each repetition, per second, times `scale`.
    Rate {
        /// Number of units of work in one repetition.
        per_repetition: f64,
        /// 1e-6 for millions.
        scale: f64,
        /// For example `M tet-steps/s`.
        unit: &'static str,
    },
    /// Time of a repetition [us].
    StepTime,
    /// Time of each of the `items` of a repetition [us].
    ItemTime {
        /// Number of items in a repetition.
        items: f64,
        /// For example `us/stencil`.
        unit: &'static str,
    },
    /// Time of a repetition that is not a step [ms].
    Time,
    /// Ratio of the first part's time to the second's; larger is better.
    Speedup,
    /// Ratio of the first part's time to the second's; smaller is better.
    Slowdown,
    /// Fraction of the first part's time that the second saves [%].
    Share,
}

impl Metric {
    /// Unit of the figure.
    pub fn unit(self) -> &'static str {
        match self {
            Metric::Rate { unit, .. } | Metric::ItemTime { unit, .. } => unit,
            Metric::StepTime => "us/step",
            Metric::Time => "ms",
            Metric::Speedup | Metric::Slowdown => "times",
            Metric::Share => "%",
        }
    }

    /// Figure, from the seconds that a repetition of each part takes.
    pub fn value(self, seconds: &[f64]) -> f64 {
        match self {
            Metric::Rate { per_repetition, scale, .. } => scale * per_repetition / seconds[0],
            Metric::StepTime => 1e6 * seconds[0],
            Metric::ItemTime { items, .. } => 1e6 * seconds[0] / items,
            Metric::Time => 1e3 * seconds[0],
            Metric::Speedup | Metric::Slowdown => seconds[0] / seconds[1],
            Metric::Share => 100.0 * (1.0 - seconds[1] / seconds[0]),
        }
    }

    /// True if larger figures are better.
    pub fn more_is_better(self) -> bool {
        matches!(self, Metric::Rate { .. } | Metric::Speedup)
    }
}

/// A timed part of a case.
pub struct BenchmarkPart {
    /// Difference from the other part of a comparison; empty for a single part.
    pub name: &'static str,
    /// Number of threads of the pool in which the part is built and run.
    pub threads: usize,
    /// Builds the workload.
    pub build: Box<dyn Fn() -> Result<Box<dyn Workload>, BenchmarkError> + Send + Sync>,
}

impl std::fmt::Debug for BenchmarkPart {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Part")
            .field("name", &self.name)
            .field("threads", &self.threads)
            .finish_non_exhaustive()
    }
}

impl BenchmarkPart {
    pub(crate) fn new<W: Workload + 'static>(
        name: &'static str,
        threads: usize,
        build: impl Fn() -> Result<W, BenchmarkError> + Send + Sync + 'static,
    ) -> BenchmarkPart {
        BenchmarkPart { name, threads, build: Box::new(move || Ok(Box::new(build()?) as Box<dyn Workload>)) }
    }
}

impl BenchmarkCase {
    /// Largest number of threads of any part.
    pub fn threads(&self) -> usize {
        self.parts.iter().map(|part| part.threads).max().unwrap_or(1)
    }
}

/// Repeatable work.
pub trait Workload: Send {
    /// Times `repetitions`. Each repetition begins with the same state, restored before the clock starts.
    ///
    /// # Errors
    /// The work fails.
    fn time(&mut self, repetitions: u64) -> Result<Duration, BenchmarkError>;

    /// Quantity of the figure: the seconds of a repetition, unless the workload measures another one.
    fn quantity(&self, seconds: f64) -> f64 {
        seconds
    }

    /// Bytes, about, that a repetition passes through at least once; 0 where they are not counted.
    fn bytes(&self) -> usize {
        0
    }

    /// Share of contact in the last time; `None` without contact, or if unknown.
    fn share_of_contact(&self) -> Option<f64> {
        None
    }
}

/// Error of a workload.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BenchmarkError {
    /// The scene of the case is invalid.
    #[error("the scene of a benchmark cannot be assembled: {0}")]
    Scene(#[from] SceneError),
    /// A step failed.
    #[error("a benchmark stopped: {0}")]
    Step(#[from] StepError),
    /// The gradient failed.
    #[error("a benchmark has no gradient: {0}")]
    Gradient(#[from] pliant_gradient::GradientError),
    /// A run failed.
    #[error("a benchmark's run did not end well: {0}")]
    Run(String),
    /// The recording failed.
    #[error("a benchmark cannot record: {0}")]
    Record(#[from] pliant_record::RecordError),
    /// The threads of the case cannot be started.
    #[error("cannot start {threads} threads: {source}")]
    Threads {
        /// Number of threads.
        threads: usize,
        /// Error of the thread pool.
        source: rayon::ThreadPoolBuildError,
    },
}
