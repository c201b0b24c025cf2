//! Benchmarks: workloads of known size that measure the speed of whole steps on this machine.
//!
//! A [`BenchmarkRow`] is one line of the table that `pliant bench` prints: work of one kind, in one or more
//! [`BenchmarkCase`]s. A case has one [`BenchmarkPart`] that is timed, or two that are timed alternately and
//! compared. Nearly all of them are scenes, assembled like a user's scene. To add a row, write one file with
//! its `ROW` and one line in [`rows`]. The same rows are criterion benchmarks (`cargo bench -p pliant-lab
//! --bench rows`).

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

/// The table, in its order.
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

/// Origin of the references: measurements on another machine, to compare with.
pub const REFERENCE_MACHINE: &str = "2 cores of Zen 5 with AVX-512";

/// Work of one kind.
#[derive(Clone, Copy, Debug)]
pub struct BenchmarkRow {
    /// The name, as in the table.
    pub name: &'static str,
    /// One line that says what is measured.
    pub summary: &'static str,
    /// Its cases, those for a first look first, all of one size; on this many threads in place of the usual
    /// number, if there is one.
    pub cases: fn(threads: Option<usize>) -> Vec<BenchmarkCase>,
}

/// One number of the table.
#[derive(Debug)]
pub struct BenchmarkCase {
    /// How many `items` one repetition works on.
    pub size: u64,
    /// Things counted: `tets`, `bodies`.
    pub items: &'static str,
    /// Difference of this case from others of the row.
    pub case: String,
    /// Kind of the number.
    pub figure: Metric,
    /// Parts that are timed: one for a rate or a time, two for a comparison.
    pub parts: Vec<BenchmarkPart>,
    /// Reference of the number, in the unit of the figure.
    pub reference: Option<PublishedValue>,
}

/// A number to compare with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PublishedValue {
    /// Value in the unit of the case.
    pub value: f64,
    /// Its description.
    pub source: &'static str,
}

/// A figure to reach: on [`REFERENCE_MACHINE`] unless it is a ratio.
pub(crate) const fn goal(value: f64) -> Option<PublishedValue> {
    Some(PublishedValue { value, source: "figure to reach" })
}

/// Conversion of times to the number of a case.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Metric {
    /// `per_repetition` units of work in each repetition, per second, times `scale`.
    Rate {
        /// Units of work in one repetition.
        per_repetition: f64,
        /// 1e-6 for millions.
        scale: f64,
        /// For example `M tet-steps/s`.
        unit: &'static str,
    },
    /// Microseconds a repetition takes.
    StepTime,
    /// Microseconds that each of the `items` of a repetition takes.
    ItemTime {
        /// Number in a repetition.
        items: f64,
        /// For example `us/stencil`.
        unit: &'static str,
    },
    /// Milliseconds a repetition takes, where it is no step.
    Time,
    /// Ratio of the first part's time to the second's, if a large one is good.
    Speedup,
    /// Ratio of the first part's time to the second's, if a small one is good.
    Slowdown,
    /// Fraction of the first part's time that the second saves [%].
    Share,
}

impl Metric {
    /// The unit of the number.
    pub fn unit(self) -> &'static str {
        match self {
            Metric::Rate { unit, .. } | Metric::ItemTime { unit, .. } => unit,
            Metric::StepTime => "us/step",
            Metric::Time => "ms",
            Metric::Speedup | Metric::Slowdown => "times",
            Metric::Share => "%",
        }
    }

    /// The number, from the seconds that a repetition of each part takes.
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

    /// True if more is better.
    pub fn more_is_better(self) -> bool {
        matches!(self, Metric::Rate { .. } | Metric::Speedup)
    }
}

/// Something to be timed.
pub struct BenchmarkPart {
    /// Difference from the other part of a comparison; empty where there is one part.
    pub name: &'static str,
    /// Threads of the pool that it is built and run in.
    pub threads: usize,
    /// Makes it.
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
    /// Threads of the part that has most.
    pub fn threads(&self) -> usize {
        self.parts.iter().map(|part| part.threads).max().unwrap_or(1)
    }
}

/// Work that can be repeated.
pub trait Workload: Send {
    /// Measures the time of `repetitions`. Each call begins with the same state, restored before the clock
    /// starts.
    ///
    /// # Errors
    /// Obstacle to the work.
    fn time(&mut self, repetitions: u64) -> Result<Duration, BenchmarkError>;

    /// Number that goes into the figure: the seconds of a repetition, unless it counts something else.
    fn quantity(&self, seconds: f64) -> f64 {
        seconds
    }

    /// Bytes, about, that a repetition passes through at least once; 0 where they are not counted.
    fn bytes(&self) -> usize {
        0
    }

    /// Part of the time last taken that went into contact; `None` where there is none, or it is not known.
    fn share_of_contact(&self) -> Option<f64> {
        None
    }
}

/// A workload could not be measured.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BenchmarkError {
    /// The scene of the case is invalid.
    #[error("the scene of a benchmark cannot be assembled: {0}")]
    Scene(#[from] SceneError),
    /// A step could not be taken.
    #[error("a benchmark stopped: {0}")]
    Step(#[from] StepError),
    /// A gradient could not be had.
    #[error("a benchmark has no gradient: {0}")]
    Gradient(#[from] pliant_gradient::GradientError),
    /// A run ended otherwise than it should.
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
        /// Why.
        source: rayon::ThreadPoolBuildError,
    },
}
