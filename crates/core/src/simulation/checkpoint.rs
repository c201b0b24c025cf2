//! Checkpoints: moments from which another process continues bit for bit.
//!
//! A checkpoint holds everything that later steps depend on. It excludes what implicit solvers keep from
//! earlier steps: factorisations, multigrid levels, the fastest solver. Solvers are therefore reset at
//! fixed counts of steps or iterations, whether or not a checkpoint is taken, and the checkpoints of a run
//! are taken right after a reset. Explicit integrators need no reset; their checkpoints are taken after any
//! step.
//!
//! A reset uses the same code by which another simulation continues from a checkpoint.

use super::{ContactExtremes, MotionJumps, RetriedSteps, Simulation, Snapshot, SnapshotError};
use crate::solver::SolverWork;
use crate::system::{PinState, WallImpulses};

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
    /// True if the next step opens an energy balance.
    opens_ledger: bool,
    /// True if the balance counts losses.
    counts_losses: bool,
    /// Length scale of default tolerances [m].
    size: Option<f64>,
    force_evaluations: u64,
    solver: SolverWork,
    retried: RetriedSteps,
    motion_jumps: Option<MotionJumps>,
    /// Worst contacts so far.
    #[serde(default)]
    contact_extremes: ContactExtremes,
    /// Wall impulses of the last step.
    #[serde(default)]
    wall_impulses: Option<WallImpulses>,
    /// Velocities that dissipative terms saw in the last step [m/s], if they differ from those of the
    /// state.
    #[serde(default)]
    increment_velocities: Option<Vec<f64>>,
    /// Time up to which jumps have been recorded [s].
    jumps_seen_until: f64,
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
            opens_ledger: self.opens_ledger,
            counts_losses: self.counts_losses,
            size: self.solver.size,
            force_evaluations: self.system.force_evaluations(),
            solver: self.solver_work(),
            retried: self.retried,
            motion_jumps: self.motion_jumps.clone(),
            contact_extremes: self.contact_extremes.clone(),
            wall_impulses: self.wall_impulses.clone(),
            increment_velocities: self.increment_velocities.clone(),
            jumps_seen_until: self.jumps_seen_until,
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
        self.counts_losses = checkpoint.counts_losses;
        self.place(&checkpoint.snapshot);
        self.begin_from(&checkpoint.snapshot);
        self.opens_ledger = checkpoint.opens_ledger;
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
        self.motion_jumps = checkpoint.motion_jumps.clone();
        self.contact_extremes = checkpoint.contact_extremes.clone();
        self.wall_impulses.clone_from(&checkpoint.wall_impulses);
        self.increment_velocities.clone_from(&checkpoint.increment_velocities);
        self.jumps_seen_until = checkpoint.jumps_seen_until;
        true
    }
}
