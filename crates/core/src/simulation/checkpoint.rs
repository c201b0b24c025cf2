//! Checkpoints: moments at which solvers forget.
//!
//! A simulation goes on from its checkpoint through the code by which another one goes on from it. What
//! later steps depend on is then either in the checkpoint, or has been forgotten by both: kept
//! factorisations, levels of multigrid, forces at hand. So both take the same steps, to the last bit, by
//! every scheme and solver.

use super::{ContactExtremes, MotionJumps, RetriedSteps, Simulation, Snapshot, SnapshotError};
use crate::solver::SolverWork;
use crate::system::{PinState, WallImpulses};

/// Everything that the steps after a moment depend on, beside the scene and what was added to it: materials,
/// forces and pins.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Checkpoint {
    snapshot: Snapshot,
    pins: Vec<PinState>,
    /// True if the next step opens a balance of energy.
    opens_ledger: bool,
    /// True if that counts what is lost.
    counts_losses: bool,
    /// Length that default tolerances are measured by [m].
    size: Option<f64>,
    force_evaluations: u64,
    solver: SolverWork,
    retried: RetriedSteps,
    motion_jumps: Option<MotionJumps>,
    /// The worst contacts so far.
    #[serde(default)]
    contact_extremes: ContactExtremes,
    /// Impulses of walls in the last step.
    #[serde(default)]
    wall_impulses: Option<WallImpulses>,
    /// Velocities that what dissipates saw in the last increment of statics [m/s].
    #[serde(default)]
    increment_velocities: Option<Vec<f64>>,
    /// Time up to which jumps have been looked for [s].
    jumps_seen_until: f64,
}

impl Checkpoint {
    /// State at that moment.
    pub fn snapshot(&self) -> &Snapshot {
        &self.snapshot
    }
}

impl Simulation {
    /// Takes a checkpoint, and goes on from it as [`resume`](Self::resume) does.
    pub fn checkpoint(&mut self) -> Checkpoint {
        let checkpoint = Checkpoint {
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
        };
        let resumed = self.go_on_from(&checkpoint);
        debug_assert!(resumed, "its own pins");
        checkpoint
    }

    /// Goes on from a checkpoint of this simulation, or of another one of the same scene with the same
    /// additions: the steps that follow have the bits of those that followed there.
    ///
    /// # Errors
    /// [`SnapshotError`]; nothing has changed then.
    pub fn resume(&mut self, checkpoint: &Checkpoint) -> Result<(), SnapshotError> {
        self.ensure_fits(&checkpoint.snapshot)?;
        if self.go_on_from(checkpoint) { Ok(()) } else { Err(SnapshotError::Pins) }
    }

    /// Goes on from a checkpoint of as many coordinates; false, and nothing has changed, where its pins are
    /// others.
    fn go_on_from(&mut self, checkpoint: &Checkpoint) -> bool {
        if !self.system.change_pins(|pins| pins.set_states(&checkpoint.pins)) {
            return false;
        }
        self.solver.size = checkpoint.size;
        self.counts_losses = checkpoint.counts_losses;
        self.place(&checkpoint.snapshot);
        self.begin_from(&checkpoint.snapshot);
        self.opens_ledger = checkpoint.opens_ledger;
        self.system.books_mut().set_to_be_measured(false);
        self.system.set_time(self.state.time);
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
