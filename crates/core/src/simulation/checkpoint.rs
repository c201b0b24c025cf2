//! Checkpoints: moments from which another process continues bit for bit.
//!
//! A checkpoint holds everything that later steps depend on. It excludes what implicit solvers keep from
//! earlier steps: factorisations, multigrid levels, the fastest solver. Solvers are therefore reset at
//! fixed counts of steps or iterations, whether or not a checkpoint is taken, and the checkpoints of a run
//! are taken right after a reset. Explicit integrators need no reset; their checkpoints are taken after any
//! step.
//!
//! A reset uses the same code by which another simulation continues from a checkpoint.

use super::records::StepRecords;
use super::{RetriedSteps, Simulation, Snapshot, SnapshotError};
use crate::solver::SolverWork;
use crate::system::PinState;

/// Most steps until solvers are reset, including rejected steps and substeps.
const STEPS_UNTIL_FORGOTTEN: u64 = 64;
/// Most Newton iterations until solvers are reset: with expensive steps, checkpoints are only a few steps
/// apart.
const ITERATIONS_UNTIL_FORGOTTEN: u64 = 256;

/// Everything that later steps depend on, except the scene and additions to it: materials, forces and
/// pins.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Checkpoint {
    snapshot: Snapshot,
    pins: Vec<PinState>,
    /// Records of steps, without the ledger, which the snapshot has.
    #[serde(flatten)]
    records: StepRecords,
    /// Length scale of default tolerances [m].
    size: Option<f64>,
    force_evaluations: u64,
    solver: SolverWork,
    retried: RetriedSteps,
    /// Time at which the force of this state was evaluated, if known [s].
    #[serde(default)]
    force_time: Option<f64>,
    /// True if the energies computed with the force were known.
    #[serde(default)]
    knows_energies: bool,
}

impl Checkpoint {
    /// Returns the state at that moment.
    pub fn snapshot(&self) -> &Snapshot {
        &self.snapshot
    }
}

impl Simulation {
    /// Takes a checkpoint. Resets implicit solvers, unless they have [just been
    /// reset](Self::has_forgotten).
    pub fn checkpoint(&mut self) -> Checkpoint {
        if !self.has_forgotten() {
            self.forget();
        }
        self.present_checkpoint()
    }

    /// True if later steps only depend on what a checkpoint holds: always with explicit integrators,
    /// right after a solver reset with implicit ones.
    pub fn has_forgotten(&self) -> bool {
        self.attempts == 0 || self.method.documentation.solves == 0
    }

    /// Resets solvers if it is time. The next step would do so in any case; measurements before it then
    /// agree with those of a simulation that continues from a checkpoint here.
    pub(crate) fn forget_in_time(&mut self) {
        let iterations = || self.present_solver_work().newton_iterations;
        let is_time = || self.attempts >= STEPS_UNTIL_FORGOTTEN || iterations() >= ITERATIONS_UNTIL_FORGOTTEN;
        if !self.has_forgotten() && is_time() {
            self.forget();
        }
    }

    fn forget(&mut self) {
        let resumed = self.go_on_from(&self.present_checkpoint());
        debug_assert!(resumed, "its own pins");
    }

    fn present_checkpoint(&self) -> Checkpoint {
        let force_time = self.system.time_of(self.state.force);
        Checkpoint {
            snapshot: self.snapshot(),
            pins: self.system.pins().states(),
            records: StepRecords { ledger: None, ..self.records.clone() },
            size: self.solver.size,
            force_evaluations: self.system.force_evaluations(),
            solver: self.solver_work(),
            retried: self.retried,
            force_time,
            knows_energies: force_time.is_some() && self.system.books().knows_energies(),
        }
    }

    /// Continues from a checkpoint of this simulation, or of another one of the same scene with the same
    /// additions; later steps are bit-identical.
    ///
    /// # Errors
    /// [`SnapshotError`]; nothing is changed then.
    pub fn resume(&mut self, checkpoint: &Checkpoint) -> Result<(), SnapshotError> {
        self.ensure_fits(&checkpoint.snapshot)?;
        if self.go_on_from(checkpoint) { Ok(()) } else { Err(SnapshotError::Pins) }
    }

    /// Continues from a checkpoint of matching size. Returns false without changes if its pins differ.
    fn go_on_from(&mut self, checkpoint: &Checkpoint) -> bool {
        if !self.system.change_pins(|pins| pins.set_states(&checkpoint.pins)) {
            return false;
        }
        self.solver.size = checkpoint.size;
        self.records.counts_losses = checkpoint.records.counts_losses;
        self.place(&checkpoint.snapshot);
        self.begin_from(&checkpoint.snapshot);
        let ledger = self.records.ledger.take();
        self.records = StepRecords { ledger, ..checkpoint.records.clone() };
        if let Some(time) = checkpoint.force_time {
            // Evaluates the force so that measurements are bit-identical; not counted, as it was counted
            // there.
            self.system.books_mut().set_to_be_measured(checkpoint.knows_energies);
            self.state.ensure_force(&mut self.system, time);
        }
        self.system.set_time(self.state.time);
        self.system.books_mut().set_to_be_measured(false);
        self.system.books_mut().set_force_evaluations(checkpoint.force_evaluations);
        self.earlier_solver_work = checkpoint.solver;
        self.retried = checkpoint.retried;
        true
    }
}
