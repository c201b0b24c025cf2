//! Checkpoints: moments from which another process takes the same steps, to the last bit.
//!
//! A checkpoint holds what later steps depend on. It does not hold what the solvers of implicit schemes keep
//! from earlier steps: factorisations, levels of multigrid, the solver that was fastest. These solvers
//! forget every so many steps, whether or not a checkpoint is taken, and checkpoints of a run are taken
//! where they have just forgotten. Explicit schemes have nothing to forget; their checkpoints are taken
//! after any step.
//!
//! A simulation forgets through the code by which another one goes on from its checkpoint.

use super::{ContactExtremes, MotionJumps, RetriedSteps, Simulation, Snapshot, SnapshotError};
use crate::solver::SolverWork;
use crate::system::{PinState, WallImpulses};

/// Steps, rejected ones and parts of steps among them, after which solvers forget at the latest.
const STEPS_UNTIL_FORGOTTEN: u64 = 64;
/// Newton iterations after which they forget, too: where steps take long, checkpoints are few steps apart.
const ITERATIONS_UNTIL_FORGOTTEN: u64 = 256;

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
    /// Velocities that what dissipates saw in the last step [m/s], where those of the state are others.
    #[serde(default)]
    increment_velocities: Option<Vec<f64>>,
    /// Time up to which jumps have been looked for [s].
    jumps_seen_until: f64,
    /// Time at which the force here was evaluated, if it was known [s].
    #[serde(default)]
    force_time: Option<f64>,
    /// True if the energies that are computed with it were known.
    #[serde(default)]
    knows_energies: bool,
}

impl Checkpoint {
    /// State at that moment.
    pub fn snapshot(&self) -> &Snapshot {
        &self.snapshot
    }
}

impl Simulation {
    /// Takes a checkpoint. Solvers of implicit schemes forget here, unless they have [just
    /// forgotten](Self::has_forgotten).
    pub fn checkpoint(&mut self) -> Checkpoint {
        if !self.has_forgotten() {
            self.forget();
        }
        self.present_checkpoint()
    }

    /// True if the steps that follow depend on nothing but what a checkpoint holds: always for explicit
    /// schemes, for implicit ones where their solvers have just forgotten.
    pub fn has_forgotten(&self) -> bool {
        self.attempts == 0 || self.method.documentation.solves == 0
    }

    /// Lets solvers forget if it is time. The next step does so in any case; what is measured before it is
    /// then that of a simulation which goes on from a checkpoint here.
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
        if let Some(time) = checkpoint.force_time {
            // What is measured here has the bits of what was measured there. It is not counted: it was
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
