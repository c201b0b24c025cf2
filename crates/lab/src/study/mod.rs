//! Studies: work-precision diagrams (error against run time) of any scene for many integrators and steps,
//! relative to a reference of known accuracy; and their charts.
//!
//! Source: verification plan, section E; Hairer, Wanner 1996, *Solving ordinary differential equations II*,
//! section IV.10 compares integrators in this way.
//!
//! ```
//! use std::sync::atomic::AtomicBool;
//! use pliant_scene::Source;
//! use pliant_lab::study::{Provenance, Study, StudyPlan, WallClock};
//!
//! let source = Source::new("swing", "dimension = 2
//!     time = { integrator = 'velocity-verlet', step = 0.01, duration = 1.0 }
//!     world = { gravity = [0.0, -9.81] }
//!     study = { integrators = ['velocity-verlet', 'rk4'], steps = [0.01, 0.005] }
//!     [[body]]
//!     mesh = { strand = { segments = 1, start = [0.0, 0.0], end = [1.0, 0.0] } }
//!     springs = { stiffness = 100.0 }
//!     mass = { per_vertex = 1.0 }
//!     pin = [{ vertices = [0] }]");
//! let plan = StudyPlan::of(&source.scene()?).map_err(pliant_scene::SceneError::new)?;
//! let study = Study {
//!     source: &source,
//!     name: "swing",
//!     plan: &StudyPlan { repeats: Some(1), ..plan },
//!     folder: None,
//!     provenance: &Provenance::here("", "", ""),
//!     clock: &WallClock::default(),
//!     interrupt: &AtomicBool::new(false),
//! };
//! let results = study.run(&mut |_| {})?;
//! assert_eq!(results.rows().count(), 4);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod advice;
mod clock;
mod errors;
mod journal;
mod machine;
mod measure;
mod order;
pub mod page;
mod plan;
pub mod plot;
mod reference;
pub mod report;
mod results;
mod row;
mod sweep;
#[cfg(test)]
mod tests;
mod timing;
mod trajectory;

pub(crate) use advice::pareto;
pub use advice::{cheapest, front, toml, words};
pub use clock::{Clock, WallClock};
pub use errors::{ErrorScales, Errors, TimeError};
pub use machine::Provenance;
pub use order::fit;
pub use plan::{Contender, ReferenceChoice, StudyPlan, TIMES, TimeGrid, TimeStepping};
pub use reference::{Reference, key};
pub use results::{LineResult, Recommendation, Record, Results, StopReason, VariantResult};
pub use row::{COLUMNS, Row, RowStatus, SCHEMA, columns, csv};
pub use sweep::Study;
pub use trajectory::{InvariantSeries, StateSamples};

use pliant_scene::{Problem, RefusedScheme, SceneError};

/// Explanation of a study's errors, for all reports.
pub const ABOUT_ERRORS: &str = "Each error is an error in time, on this mesh. The error of the mesh is not in \
                                it. Errors of variants with references of their own do not compare.";

/// Progress of a study, for its caller.
#[derive(Clone, Copy, Debug)]
pub enum Event<'a> {
    /// A run for the reference begins.
    Reference {
        /// Name of the integrator.
        scheme: &'static str,
        /// Step [s].
        step: f64,
    },
    /// The reference of a variant has been found.
    Found(&'a Reference),
    /// A row begins.
    Begun {
        /// Name of the integrator.
        scheme: &'static str,
        /// `step` with its size [s], or `tolerance` with its value.
        pace: (&'static str, f64),
        /// Changes of the scene.
        variant: &'a str,
        /// Number of finished rows.
        finished: usize,
        /// Estimate of the remaining seconds, if available.
        left: Option<f64>,
    },
    /// A row is finished.
    Finished(&'a Row),
}

/// Error of a study.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StudyError {
    /// The scene, or a variant of it, cannot be simulated.
    #[error("{}", SceneError::new(.0.clone()))]
    Scene(Vec<Problem>),
    /// A variant is not a valid scene.
    #[error(transparent)]
    Variant(#[from] SceneError),
    /// A duration of zero.
    #[error("`duration` is 0: there is no motion to study")]
    NoDuration,
    /// A scene without motion for any duration.
    #[error(
        "a quasi-static scene has no motion to study: study its meshes by --refine, compare increments by \
         `pliant run --set time.step=..`, or use another integrator: --set time.integrator=implicit-euler"
    )]
    Static,
    /// The problem has no closed-form solution.
    #[error(
        "no exact solution of this scene is known: it is neither two bodies under gravity nor a linear \
         system without losses; leave the reference to `auto`"
    )]
    NotExact,
    /// Neither integrator of the reference completed two runs.
    #[error(
        "no reference was found in {seconds:.0} s, with neither an explicit nor an implicit integrator of \
         order 4 ({reached}); increase --budget, shorten the duration by --set time.duration=.., or use a \
         coarser mesh"
    )]
    NoReference {
        /// Duration of the search [s].
        seconds: f64,
        /// Progress of each integrator's last run, or its failure.
        reached: String,
    },
    /// No integrator supports the contact of the scene.
    #[error("{}", .0.iter().map(|refused| refused.reason.as_str()).collect::<Vec<_>>().join("; "))]
    Refused(Vec<RefusedScheme>),
    /// The threads could not be started.
    #[error("cannot start {threads} threads: {source}")]
    Threads {
        /// Number of threads.
        threads: usize,
        /// Error of the thread pool.
        source: rayon::ThreadPoolBuildError,
    },
    /// A file of the study could not be read or written.
    #[error("{what}: {source}")]
    File {
        /// The action.
        what: String,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The study was interrupted before there were results.
    #[error("interrupted")]
    Interrupted,
}
