//! States of a simulation that are kept and gone back to.

use super::path::PathState;
use super::{Simulation, StepError};
use crate::control::StepHistory;
use crate::diagnostics::EnergyLedger;
use crate::solver::SolverWork;
use crate::solver::structure::LentStructure;
use crate::system::{ForceId, Pins};

/// Relative; a time that a step landed on is within it.
const ROUNDING: f64 = 1e-14;

/// A moment of a simulation: enough to go on from there as if nothing had happened in between.
///
/// Explicit schemes go on with the same bits. Implicit ones find the same solutions to the tolerance of
/// their solver, which is that of the simulation's start wherever it goes on from, and begins without what
/// it has learnt from earlier steps: a [`Checkpoint`](super::Checkpoint) has the same bits for all.
/// Parameters (materials, forces, pins that were added) are no part of it.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Snapshot {
    /// Steps taken.
    pub step: u64,
    /// Simulated time [s].
    pub time: f64,
    /// Positions, flat `(n, dimension)`, vertices in the order of the scene [m].
    pub x: Vec<f64>,
    /// Velocities, likewise [m/s].
    pub v: Vec<f64>,
    /// Memory of a scheme of several steps.
    memory: Vec<f64>,
    /// Memory of step sizes that follow the error.
    pace: Option<StepHistory>,
    /// What terms remember of earlier steps; empty where none does.
    #[serde(default)]
    history: Vec<f64>,
    /// Path of equilibria so far.
    #[serde(default)]
    path: Option<PathState>,
    ledger: Option<EnergyLedger>,
}

/// A simulation cannot go on from this snapshot.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SnapshotError {
    /// It is of another scene.
    #[error(
        "the state is one of {found} coordinates, the simulation has {expected}: it is a state of another \
         scene"
    )]
    Size {
        /// Coordinates of the snapshot.
        found: usize,
        /// Coordinates of the simulation.
        expected: usize,
    },
    /// Its terms remember more or fewer numbers.
    #[error(
        "the state remembers {found} numbers of earlier steps, the simulation {expected}: take a state of it"
    )]
    History {
        /// Numbers of the snapshot.
        found: usize,
        /// Numbers of the simulation.
        expected: usize,
    },
    /// Its pins are others.
    #[error("the checkpoint has other pins than the simulation: it is one of another scene")]
    Pins,
    /// A number in it is not finite.
    #[error("the state is not finite at vertex {vertex}")]
    NotFinite {
        /// The first such vertex, in the order of the scene.
        vertex: usize,
    },
}

impl Snapshot {
    /// Positions `x` [m] and velocities `v` [m/s], flat, after `step` steps, at `time` [s], without what
    /// schemes and the balance of energy remember.
    pub fn new(step: u64, time: f64, x: Vec<f64>, v: Vec<f64>) -> Self {
        Snapshot { step, time, x, v, memory: vec![], pace: None, history: vec![], path: None, ledger: None }
    }

    /// The same where terms [remember](crate::system::System::history) these numbers.
    #[must_use]
    pub fn with_history(self, history: Vec<f64>) -> Self {
        Snapshot { history, ..self }
    }

    /// True if a scheme of several steps goes on from here by what it remembers of those before; false where
    /// it begins anew, as after a wall has put a vertex back.
    pub fn remembers(&self) -> bool {
        !self.memory.is_empty()
    }
}

impl Simulation {
    /// The present moment.
    ///
    /// ```
    /// use pliant::integrator::IntegratorSpec;
    /// use pliant::{simulation::Simulation, state::State, system::System};
    ///
    /// let thrown = State::new(vec![0.0; 3], vec![1.0, 2.0, 3.0]);
    /// let mut simulation =
    ///     Simulation::new(System::new(3, vec![1.0]), thrown, IntegratorSpec::Rk4.method(), 1e-2);
    /// let moment = simulation.snapshot();
    /// simulation.step()?;
    /// let there = simulation.positions().into_owned();
    /// simulation.restore(&moment)?;
    /// simulation.step()?;
    /// assert_eq!(simulation.positions(), there);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn snapshot(&self) -> Snapshot {
        Snapshot {
            step: self.state.step,
            time: self.state.time,
            x: self.positions().into_owned(),
            v: self.velocities().into_owned(),
            memory: self.integrator.memory(&self.system, &self.state),
            pace: self.pace(),
            history: self.system.history(),
            path: self.path().cloned(),
            ledger: self.ledger.clone(),
        }
    }

    /// Goes back, or on, to a moment of this simulation or of another one of the same scene. Pins that let
    /// go at their time are back where that time has not come yet; those that move go on from where they are
    /// in it. Pins that were [steered](Self::move_pin) no longer are.
    ///
    /// # Errors
    /// [`SnapshotError`]; nothing has changed then.
    pub fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        self.ensure_fits(snapshot)?;
        self.hold_as_after(snapshot.step, snapshot.time);
        self.system.change_pins(Pins::end_drives);
        self.place(snapshot);
        let time = self.system.load_factor().unwrap_or(snapshot.time);
        self.system.change_pins(|pins| pins.go_on_from(time, self.state.x()));
        self.begin_from(snapshot);
        self.earlier_solver_work = SolverWork::default();
        Ok(())
    }

    /// Gives the structure of the matrices of implicit steps away, where the scheme has made it, and goes on
    /// with the one `lent`; neither changes a bit of what the steps find.
    pub fn exchange_matrix_structure(&mut self, lent: Option<LentStructure>) -> Option<LentStructure> {
        self.integrator.exchange_structure(&self.system, lent)
    }

    /// Refuses a snapshot of another number of coordinates, or with one that is not finite.
    pub(super) fn ensure_fits(&self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let (expected, d) = (self.state.x().len(), self.system.dimension());
        let (found, remembered) = (snapshot.history.len(), self.system.history().len());
        if found != remembered {
            return Err(SnapshotError::History { found, expected: remembered });
        }
        for values in [&snapshot.x, &snapshot.v] {
            if values.len() != expected {
                return Err(SnapshotError::Size { found: values.len(), expected });
            }
            if let Some(i) = values.iter().position(|value| !value.is_finite()) {
                return Err(SnapshotError::NotFinite { vertex: i / d });
            }
        }
        Ok(())
    }

    /// Takes over step, time, positions and velocities of `snapshot`.
    pub(super) fn place(&mut self, snapshot: &Snapshot) {
        let d = self.system.dimension();
        self.state.step = snapshot.step;
        self.state.time = snapshot.time;
        self.state.x_mut().copy_from_slice(&self.numbering.to_internal(&snapshot.x, d));
        self.state.v_mut().copy_from_slice(&self.numbering.to_internal(&snapshot.v, d));
        self.state.force = ForceId::NONE;
        self.system.set_history(&snapshot.history, snapshot.time);
        self.wall_impulses = None;
        self.increment_velocities = None;
    }

    /// Begins the scheme anew from the state of `snapshot`, with its memory, balance of energy and size of
    /// the next step.
    pub(super) fn begin_from(&mut self, snapshot: &Snapshot) {
        let structure = self.exchange_matrix_structure(None);
        self.integrator = self.method.build(self.state.x().len(), self.solver);
        self.exchange_matrix_structure(structure);
        self.attempts = 0;
        self.integrator.recall(&snapshot.memory, &self.system, &self.state);
        self.set_ledger(snapshot.ledger.clone());
        self.set_pace(snapshot.pace);
        if let Some(path) = self.path.take() {
            self.set_arc_length(path.options);
            self.set_path(snapshot.path.clone());
        }
    }

    /// The pure map `(x_n, v_n) -> (x_{n+1}, v_{n+1})` (lecture 3): one step from the given state at the
    /// present time, in place, vertices in the order of the scene. The simulation itself stays where it is.
    /// Velocities of held coordinates count as none.
    ///
    /// # Errors
    /// As [`step`](Self::step).
    ///
    /// # Panics
    /// If the arrays have not the length of the state's.
    pub fn advanced(&mut self, x: &mut [f64], v: &mut [f64]) -> Result<(), StepError> {
        let memory = self.integrator.memory(&self.system, &self.state);
        let (state, ledger, pace) = (self.state.clone(), self.ledger.clone(), self.pace());
        let path = self.path().cloned();
        let wall_impulses = self.wall_impulses.clone();
        let increment_velocities = self.increment_velocities.clone();
        let history = self.system.history();
        self.set_positions(x);
        self.set_velocities(v);
        // Its balance is not read.
        self.opens_ledger = false;
        let end = self.step();
        if end.is_ok() {
            x.copy_from_slice(&self.positions());
            v.copy_from_slice(&self.velocities());
        }
        self.state = state;
        self.system.set_history(&history, self.state.time);
        self.wall_impulses = wall_impulses;
        self.increment_velocities = increment_velocities;
        self.hold_as_after(self.state.step, self.state.time);
        self.integrator.recall(&memory, &self.system, &self.state);
        self.set_ledger(ledger);
        self.set_pace(pace);
        self.set_path(path);
        end
    }

    /// Holds what is held after `step` steps, at `time` [s]: before the next step lets go of anything. State
    /// and schemes stay as they are.
    pub fn hold_as_after(&mut self, step: u64, time: f64) {
        let seen = match self.controller {
            _ if step == 0 => f64::NEG_INFINITY,
            // The last step looked for what ends half a step before its end, and so did that of which this is
            // within.
            None => self.released_until(time).unwrap_or(time - 0.5 * self.step_size),
            // Or landed on it, for the next to find.
            Some(_) => time * (1.0 - ROUNDING),
        };
        self.system.change_pins(|pins| pins.act_as_at(seen));
    }

    /// Time up to which holds let go at the beginning of the step of the fixed size within which `time` [s]
    /// is; `None` where it is at its beginning.
    pub(super) fn released_until(&self, time: f64) -> Option<f64> {
        let steps = time / self.step_size;
        let is_between = (steps - steps.round()).abs() > ROUNDING * steps.abs();
        is_between.then(|| (steps.floor() + 0.5) * self.step_size)
    }

    pub(super) fn pace(&self) -> Option<StepHistory> {
        self.controller.as_ref().map(|controller| controller.pace())
    }

    /// Where step sizes follow the error, goes on with what was learnt, if anything was.
    pub(super) fn set_pace(&mut self, pace: Option<StepHistory>) {
        if let (Some(controller), Some(pace)) = (&mut self.controller, pace) {
            controller.resume(pace);
            self.step_size = controller.next();
        }
    }

    /// Goes on with this ledger; without one, or where it does not hold what is asked for, the next step
    /// opens another.
    pub(super) fn set_ledger(&mut self, ledger: Option<EnergyLedger>) {
        self.ledger = ledger.filter(|ledger| ledger.holds_losses() == self.counts_losses);
        self.opens_ledger = self.ledger.is_none();
        self.system.books_mut().count_walls(self.ledger.as_ref().is_some_and(EnergyLedger::counts_walls));
    }
}
