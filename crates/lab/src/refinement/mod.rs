//! Total error against run time: one scene on finer and finer meshes, of several kinds of elements, by
//! several schemes and steps.
//!
//! A row of the study is a run, and its error is that of a quantity of interest against the continuous
//! problem: mesh and step together. The reference is extrapolated from the finest meshes of the elements that
//! converge best, with an uncertainty ([`convergence`](crate::convergence)); the elements that converge next
//! best are a second opinion, and where the two differ by more than the sum of their uncertainties, the
//! difference is what is known. Errors of the mesh and of the step may cancel: the total of a row counts as
//! no less than the error of its mesh with the smallest step. Expected orders in space are those of exact
//! integration in statics, and 2 in dynamics, where masses are lumped.
//!
//! ```
//! use std::sync::atomic::AtomicBool;
//! use pliant_lab::refinement::{RefinementPlan, RefinementStudy};
//! use pliant_scene::Source;
//!
//! let source = Source::new("bar", "dimension = 2
//!     time = { integrator = 'quasi-static', step = 1.0, duration = 1.0 }
//!     world = { gravity = [1.0, 0.0] }
//!     [[body]]
//!     mesh = { grid = { cells = [2, 1], size = [1.0, 0.5] } }
//!     elastic = { linear = { young = 1e4, poisson = 0.3 } }
//!     mass = { density = 1000.0 }
//!     pin = [{ half_space = { normal = [1.0, 0.0], offset = 0.0 } }]
//!     [[probe]]
//!     name = 'tip'
//!     at = [1.0, 0.25]");
//! let plan = RefinementPlan::of(&source.scene()?)?;
//! let study = RefinementStudy { source: &source, plan: &plan, interrupt: &AtomicBool::new(false) };
//! let results = study.run(&mut |_| {})?;
//! assert_eq!(results.quantities[0].quantity, "tip.x");
//! assert!(results.quantities[0].reference.is_some());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod chart;
mod plan;
mod results;
mod studied;
mod sweep;
#[cfg(test)]
mod tests;

pub use chart::chart;
pub use plan::RefinementPlan;
pub use results::{
    Cheapest, ElementLadder, QuantityReference, QuantityRefinement, RefinedRow, RefinementResults, RowError,
    percent,
};
pub(crate) use studied::StudiedScene;
pub use studied::StudiedSceneError;
pub use sweep::RefinementStudy;

use crate::quantity::NoValues;
use pliant_scene::{Problem, SceneError};

/// Error of a study of meshes and steps.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RefinementError {
    /// The scene cannot be studied.
    #[error(transparent)]
    Scene(#[from] StudiedSceneError),
    /// A value of the plan is wrong.
    #[error("{}", SceneError::new(.0.clone()))]
    Plan(Vec<Problem>),
    /// No elements could be run on any mesh.
    #[error("no run reached its end: {0}; give more time by --budget, or a coarser mesh")]
    NoRun(NoValues),
    /// The threads could not be started.
    #[error("cannot start {threads} threads: {source}")]
    Threads {
        /// Number of threads.
        threads: usize,
        /// Error of the thread pool.
        source: rayon::ThreadPoolBuildError,
    },
    /// The study was interrupted.
    #[error("interrupted")]
    Interrupted,
}
