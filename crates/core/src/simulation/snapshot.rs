//! Snapshots: states of a simulation that can be restored.

use super::path::PathState;
use super::{Simulation, StepError};
use crate::control::StepHistory;
use crate::diagnostics::EnergyLedger;
use crate::solver::SolverWork;
use crate::solver::structure::LentStructure;
use crate::system::{ForceId, Pins};

/// Relative rounding of a time that a step ends at.
const ROUNDING: f64 = 1e-14;

/// State of a simulation at one moment, sufficient to continue from there.
///
/// Explicit integrators continue bit for bit. Implicit ones find the same solutions to the solver
/// tolerance, which is always that of the simulation's start; their solvers restart without what they
/// kept from earlier steps. A [`Checkpoint`](super::Checkpoint) is bit-identical for all. Parameters
/// (materials, forces, added pins) are not included.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Snapshot {
    /// Steps taken.
    pub step: u64,
    /// Simulated time [s].
    pub time: f64,
    /// Positions, flat `(n, dimension)`, vertices in scene order [m].
    pub x: Vec<f64>,
    /// Velocities, in the same order [m/s].
    pub v: Vec<f64>,
    /// History of a multistep method.
    memory: Vec<f64>,
    /// State of the step size controller.
    pace: Option<StepHistory>,
    /// History of terms; empty without such terms.
    #[serde(default)]
    history: Vec<f64>,
    /// Path of equilibria so far.
    #[serde(default)]
    path: Option<PathState>,
    ledger: Option<EnergyLedger>,
}

/// Error if a simulation cannot continue from a snapshot.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SnapshotError {
    /// The snapshot is of another scene.
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
    /// Its terms have a history of another length.
    #[error(
        "the state remembers {found} numbers of earlier steps, the simulation {expected}: take a state of it"
    )]
    History {
        /// Values of the snapshot.
        found: usize,
        /// Values of the simulation.
        expected: usize,
    },
    /// Its pins differ.
    #[error("the checkpoint has other pins than the simulation: it is one of another scene")]
    Pins,
    /// A value is not finite.
    #[error("the state is not finite at vertex {vertex}")]
    NotFinite {
        /// First such vertex, in scene order.
        vertex: usize,
    },
}

impl Snapshot {
    /// Creates a snapshot of positions `x` [m] and velocities `v` [m/s], flat, after `step` steps at
    /// `time` [s], without integrator history and energy balance.
    pub fn new(step: u64, time: f64, x: Vec<f64>, v: Vec<f64>) -> Self {
        Snapshot { step, time, x, v, memory: vec![], pace: None, history: vec![], path: None, ledger: None }
    }

    /// Adds the [history](crate::system::System::history) of terms.
    #[must_use]
    pub fn with_history(self, history: Vec<f64>) -> Self {
        Snapshot { history, ..self }
    }

    /// True if a multistep method continues from here with its history; false if it restarts, for example
    /// after a wall has moved a vertex.
    pub fn remembers(&self) -> bool {
        !self.memory.is_empty()
    }
}

impl Simulation {
    /// Takes a snapshot of the current state.
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
            ledger: self.records.ledger.clone(),
        }
    }

    /// Restores a state of this simulation or of another one of the same scene. Pins released later than
    /// its time are active again; moving pins continue from their position in it. Pins that were
    /// [steered](Self::move_pin) no longer are.
    ///
    /// # Errors
    /// [`SnapshotError`]; nothing is changed then.
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

    /// Returns the matrix structure of the implicit integrator, if it has one, and continues with `lent`;
    /// neither changes a bit of the results.
    pub fn exchange_matrix_structure(&mut self, lent: Option<LentStructure>) -> Option<LentStructure> {
        self.integrator.exchange_structure(&self.system, lent)
    }

    /// Rejects a snapshot with another number of values, or with one that is not finite.
    pub(super) fn ensure_fits(&self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let (expected, d) = (self.state.x().len(), self.system.dimension());
        let (found, remembered) = (snapshot.history.len(), self.system.history_len());
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

    /// Copies step, time, positions, velocities and history from `snapshot`.
    pub(super) fn place(&mut self, snapshot: &Snapshot) {
        let d = self.system.dimension();
        self.state.step = snapshot.step;
        self.state.time = snapshot.time;
        self.state.x_mut().copy_from_slice(&self.numbering.to_internal(&snapshot.x, d));
        self.state.v_mut().copy_from_slice(&self.numbering.to_internal(&snapshot.v, d));
        self.state.force = ForceId::NONE;
        self.system.set_history(&snapshot.history, snapshot.time);
        self.records.forget_last_step();
    }

    /// Restarts the integrator from the state of `snapshot`, with its history, energy balance and step
    /// size.
    pub(super) fn begin_from(&mut self, snapshot: &Snapshot) {
        let structure = self.exchange_matrix_structure(None);
        self.integrator = self.method.build(self.state.x().len(), self.solver);
        self.exchange_matrix_structure(structure);
        self.attempts = 0;
        self.integrator.recall(&snapshot.memory, &self.system, &self.state);
        self.records.set_ledger(snapshot.ledger.clone(), &mut self.system);
        self.set_pace(snapshot.pace);
        if let Some(path) = self.path.take() {
            self.set_arc_length(path.options);
            self.set_path(snapshot.path.clone());
        }
    }

    /// Applies the map `(x_n, v_n) -> (x_{n+1}, v_{n+1})` (lecture 3): takes one step from the given
    /// state at the current time, in place, vertices in scene order. The simulation itself is not
    /// changed. Velocities of constrained coordinates are ignored.
    ///
    /// # Errors
    /// Those of [`step`](Self::step).
    ///
    /// # Panics
    /// If an array does not have the length of the state's.
    pub fn advanced(&mut self, x: &mut [f64], v: &mut [f64]) -> Result<(), StepError> {
        let memory = self.integrator.memory(&self.system, &self.state);
        let (state, records, pace) = (self.state.clone(), self.records.clone(), self.pace());
        let path = self.path().cloned();
        let history = self.system.history();
        self.set_positions(x);
        self.set_velocities(v);
        // The balance of this step is not read.
        self.records.opens_ledger = false;
        let end = self.step();
        if end.is_ok() {
            x.copy_from_slice(&self.positions());
            v.copy_from_slice(&self.velocities());
        }
        self.state = state;
        self.system.set_history(&history, self.state.time);
        self.hold_as_after(self.state.step, self.state.time);
        self.integrator.recall(&memory, &self.system, &self.state);
        let (ledger, opens_ledger) = (records.ledger.clone(), records.opens_ledger);
        self.records = records;
        self.records.set_ledger(ledger, &mut self.system);
        self.records.opens_ledger = opens_ledger;
        self.set_pace(pace);
        self.set_path(path);
        end
    }

    /// Activates the pins that act after `step` steps, at `time` [s], before the next step releases any.
    /// State and integrator are unchanged.
    pub fn hold_as_after(&mut self, step: u64, time: f64) {
        let seen = match self.controller {
            _ if step == 0 => f64::NEG_INFINITY,
            // The last step released pins up to half a step before its end, and so did the step that
            // contains this time.
            None => self.released_until(time).unwrap_or(time - 0.5 * self.step_size),
            // Adaptive steps end at release times; the next step releases the pin.
            Some(_) => time * (1.0 - ROUNDING),
        };
        self.system.change_pins(|pins| pins.act_as_at(seen));
    }

    /// Returns the time up to which pins are released at the start of the fixed-size step that contains
    /// `time` [s]; `None` if `time` is the start of a step.
    pub(super) fn released_until(&self, time: f64) -> Option<f64> {
        let steps = time / self.step_size;
        let is_between = (steps - steps.round()).abs() > ROUNDING * steps.abs();
        is_between.then(|| (steps.floor() + 0.5) * self.step_size)
    }

    pub(super) fn pace(&self) -> Option<StepHistory> {
        self.controller.as_ref().map(|controller| controller.pace())
    }

    /// Restores the step size controller, if both exist.
    pub(super) fn set_pace(&mut self, pace: Option<StepHistory>) {
        if let (Some(controller), Some(pace)) = (&mut self.controller, pace) {
            controller.resume(pace);
            self.step_size = controller.next();
        }
    }
}
