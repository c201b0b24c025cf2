//! Energy check along the stages of a step, which detects spurious solutions of the stage equations.
//!
//! The nonlinear stage equations have several solutions if the step is long compared with the motion, and
//! Newton's method may end at any of them. With the energy `E` of the forces that have a potential,
//!
//! ```text
//! r = E(x_(n+1)) - E(x_n) - h sum_i b_i V_i . dE/dx(X_i)
//! ```
//!
//! is zero up to the quadrature error along the polynomial of the step. For quadratic `E` it is
//! `-h^2/2 sum_ij m_ij V_i . K V_j` with `m_ij = b_i a_ij + b_j a_ji - b_i b_j`: zero for Gauss methods,
//! a loss for algebraically stable ones; Hairer, Wanner 1996, *Solving Ordinary Differential Equations
//! II*, section IV.12. If `r` is as large as the energy scale of the step, the stages do not approximate
//! a motion.

use super::super::implicit::NextState;
use super::CollocationTableau;
use crate::energy::EnergyTerm;
use crate::solver::{SolveError, SolveFailure, StepFault, scene_size};
use crate::state::State;
use crate::system::System;

/// Largest `r` of an accepted solution, as a fraction of the energy scale of the step.
const LARGEST: f64 = 0.25;
/// Displacements in a step below this fraction of the scene size are not checked.
const STILL: f64 = 1e-6;
/// Prescribed motion has jumped if it ends farther from where its velocities lead than this fraction of
/// its path.
const JUMP: f64 = 0.25;
/// Stored energy changes below this fraction are rounding.
const ROUNDING: f64 = 1e-9;

/// Energy sums of one step.
pub(super) struct StageEnergy {
    /// True if the method conserves quadratic energies, so that a loss is an error, too.
    conserves: bool,
    /// `E(x_n)` [J].
    start: f64,
    /// `h sum_i b_i V_i . dE/dx(X_i)` [J].
    stored: f64,
    /// Largest kinetic energy so far [J].
    kinetic: f64,
    gradient: Vec<f64>,
    /// `h sum_i b_i V_i` [m]; empty without prescribed motion.
    way: Vec<f64>,
}

impl StageEnergy {
    pub(super) fn new(tableau: &CollocationTableau) -> Self {
        let CollocationTableau { a, b } = *tableau;
        let defect = |i: usize, j: usize| b[i] * a[i][j] + b[j] * a[j][i] - b[i] * b[j];
        let conserves = (0..b.len()).all(|i| (0..b.len()).all(|j| defect(i, j).abs() < 1e-14));
        StageEnergy { conserves, start: 0.0, stored: 0.0, kinetic: 0.0, gradient: vec![], way: vec![] }
    }

    /// Starts the sums for a step from `state`.
    pub(super) fn begin(&mut self, system: &mut System, state: &State) {
        self.start = system.potential_of(has_potential, state.x());
        self.stored = 0.0;
        self.kinetic = system.kinetic(state.v());
        self.way.clear();
        self.way.resize(if system.has_prescribed_motion() { state.v().len() } else { 0 }, 0.0);
    }

    /// Adds a stage of weight `h b_i` [s] with the velocities `v`; `system` must hold the force at its
    /// positions.
    pub(super) fn stage(&mut self, system: &System, weight: f64, v: &[f64]) {
        self.gradient.clear();
        self.gradient.resize(v.len(), 0.0);
        let terms = system.terms().iter().filter(|term| has_potential(term.as_ref()));
        terms.for_each(|term| term.add_rows(0, &mut self.gradient));
        self.stored += weight * self.gradient.iter().zip(v).map(|(g, v)| g * v).sum::<f64>();
        self.kinetic = self.kinetic.max(system.kinetic(v));
        self.way.iter_mut().zip(v).for_each(|(way, v)| *way += weight * v);
    }

    /// True if prescribed motion jumped on the path to `end` by more than `least` [m]. The stages do not
    /// see the work of a jump.
    fn has_jumped(&self, system: &System, state: &State, end: &NextState, least: f64) -> bool {
        let moved = (0..self.way.len()).filter(|n| system.inverse_mass()[*n] == 0.0);
        moved.map(|n| (end.x[n] - state.x()[n], self.way[n])).any(|(moved, way)| {
            let beside = (moved - way).abs();
            beside > JUMP * (moved.abs() + way.abs()) + least
        })
    }

    /// Checks the step of `h` [s] from `state` to `end` in a scene of this `size` [m].
    ///
    /// # Errors
    /// [`SolveFailure::Spurious`] if the stages are no approximation of a motion.
    pub(super) fn end(
        &mut self,
        system: &mut System,
        state: &State,
        h: f64,
        end: &NextState,
        size: Option<f64>,
    ) -> Result<(), StepFault> {
        let now = system.potential_of(has_potential, &end.x);
        let change = now - self.start;
        let made = change - self.stored;
        let short = STILL * size.unwrap_or_else(|| scene_size(state.x(), system.dimension()));
        if self.has_jumped(system, state, end, short) {
            return Ok(());
        }
        // Compare the unexplained energy with the energy scale of the step.
        let still = short / h;
        let floor = 0.5 * system.mass().iter().sum::<f64>() * still * still
            + ROUNDING * (now.abs() + self.start.abs());
        let moving = self.kinetic.max(system.kinetic(&end.v)).max(change.abs()) + floor;
        let wrong = if self.conserves { made.abs() } else { made };
        if wrong <= LARGEST * moving || !wrong.is_finite() {
            return Ok(());
        }
        let solve =
            SolveError { verdict: SolveFailure::Spurious, iterations: 0, correction: 0.0, left: None };
        Err(StepFault { fault: None, vertex: None, solve: Some(solve) })
    }
}

/// True if the term has a potential: it supplies no energy from outside.
fn has_potential(term: &dyn EnergyTerm) -> bool {
    !term.properties().supplies()
}
