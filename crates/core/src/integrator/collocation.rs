//! Fully implicit Runge-Kutta methods of collocation type, all stages solved together.
//!
//! The stages of `(x, v)' = (v, a(x, v, t) - c v)` are `Z_i = X_i - x_n`. With `B = A^-1` they have
//! `V = (B/h) Z` and `V' = (B^2/h^2) Z - (B 1) v_n / h`, so that positions are the only unknowns:
//!
//! ```text
//! M sum_j ((B^2)_ij + h c B_ij) Z_j - h (B 1)_i M v_n + h^2 (dE/dx + dR/dv)(X_i, V_i, t_i) = 0
//! ```
//!
//! Newton's method solves these equations with a sparse LU factorisation, as the matrix is not symmetric.
//! Hairer, Wanner 1996, *Solving Ordinary Differential Equations II*, section IV.8.

mod energy;

use super::Integrator;
use super::equations::acceleration;
use super::implicit::NextState;
use crate::solver::StepFault;
use crate::solver::coupled::{CoupledNewton, StageSystem, coupled_newton};
use crate::solver::{SolverOptions, SolverWork};
use crate::state::State;
use crate::system::{ForceId, System};
use energy::StageEnergy;

/// Butcher tableau of a fully implicit method; the nodes are the sums of the rows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CollocationTableau {
    /// Row `i` holds `a_ij`.
    pub a: &'static [&'static [f64]],
    /// Weights; equal to the last row of `a` if the last stage is the new state.
    pub b: &'static [f64],
}

/// Integrator for a collocation tableau.
pub struct Collocation {
    tableau: CollocationTableau,
    /// `A^-1`, by rows.
    inverse: Vec<Vec<f64>>,
    options: SolverOptions,
    newton: Option<Box<dyn CoupledNewton>>,
    /// Displacements of the stages from the old positions, and their velocities.
    z: Vec<Vec<f64>>,
    v: Vec<Vec<f64>>,
    /// Positions and accelerations of one stage.
    at: Vec<f64>,
    acceleration: Vec<f64>,
    energy: StageEnergy,
    next: NextState,
}

impl Collocation {
    /// Creates the integrator for `tableau` on `unknowns` coordinates.
    ///
    /// # Panics
    /// If the tableau is singular.
    pub fn new(tableau: CollocationTableau, unknowns: usize, options: SolverOptions) -> Self {
        let stages = vec![vec![0.0; unknowns]; tableau.b.len()];
        Collocation {
            inverse: inverse(tableau.a),
            energy: StageEnergy::new(&tableau),
            tableau,
            options,
            newton: None,
            z: stages.clone(),
            v: stages,
            at: vec![0.0; unknowns],
            acceleration: vec![0.0; unknowns],
            next: NextState::new(unknowns),
        }
    }
}

/// Inverts a small matrix by Gauss-Jordan elimination with row exchanges.
fn inverse(a: &[&[f64]]) -> Vec<Vec<f64>> {
    let n = a.len();
    let mut left: Vec<Vec<f64>> = a.iter().map(|row| row.to_vec()).collect();
    let mut right: Vec<Vec<f64>> =
        (0..n).map(|i| (0..n).map(|j| if i == j { 1.0 } else { 0.0 }).collect()).collect();
    for k in 0..n {
        let pivot = (k..n).fold(k, |p, i| if left[i][k].abs() > left[p][k].abs() { i } else { p });
        assert!(left[pivot][k] != 0.0, "the tableau is not singular");
        left.swap(k, pivot);
        right.swap(k, pivot);
        let scale = 1.0 / left[k][k];
        for j in 0..n {
            left[k][j] *= scale;
            right[k][j] *= scale;
        }
        for i in (0..n).filter(|i| *i != k) {
            let factor = left[i][k];
            for j in 0..n {
                left[i][j] -= factor * left[k][j];
                right[i][j] -= factor * right[k][j];
            }
        }
    }
    right
}

impl Integrator for Collocation {
    fn step(&mut self, system: &mut System, state: &mut State, h: f64) -> Result<(), StepFault> {
        let CollocationTableau { a, b } = self.tableau;
        let last = b.len() - 1;
        let is_last_the_end = a[last] == b;
        let nodes: Vec<f64> = a.iter().map(|row| row.iter().sum()).collect();
        let times: Vec<f64> = nodes.iter().map(|c| state.time + c * h).collect();
        // Initial guess: constant velocity for free coordinates, prescribed motion for the others.
        for (i, time) in times.iter().enumerate() {
            self.next.x.copy_from_slice(state.x());
            self.v[i].fill(0.0);
            if !system.prescribe(*time, &mut self.next.x, &mut self.v[i]) {
                return Err(StepFault::at(system, &self.next.x, &self.v[i]));
            }
            let held = system.inverse_mass();
            for n in 0..held.len() {
                let moved =
                    if held[n] == 0.0 { self.next.x[n] - state.x()[n] } else { nodes[i] * h * state.v()[n] };
                self.z[i][n] = moved;
            }
        }
        // Solve all stages together.
        let newton = self.newton.get_or_insert_with(|| coupled_newton(system.dimension(), self.options));
        let stages = StageSystem { inverse: &self.inverse, times: &times, h, x: state.x(), v: state.v() };
        newton.solve(system, &stages, &mut self.z, &mut self.v)?;
        self.energy.begin(system, state);
        // Uses the forces at the stages, not difference quotients of their displacements: velocity
        // increments are small compared with the velocity.
        self.next.x.copy_from_slice(state.x());
        self.next.v.copy_from_slice(state.v());
        for (i, b) in b.iter().enumerate() {
            self.at.clear();
            self.at.extend(state.x().iter().zip(&self.z[i]).map(|(x, z)| x + z));
            system.set_time(times[i]);
            if system.evaluate(&self.at).is_none() {
                return Err(StepFault::at(system, &self.at, &self.v[i]));
            }
            self.energy.stage(system, h * b, &self.v[i]);
            if is_last_the_end {
                continue;
            }
            acceleration(system, &self.at, &self.v[i], &mut self.acceleration);
            let weight = system.inverse_mass();
            for n in (0..weight.len()).filter(|n| weight[*n] > 0.0) {
                self.next.x[n] += h * b * self.v[i][n];
                self.next.v[n] += h * b * self.acceleration[n];
            }
        }
        // If the last stage is the end of the step, it is the new state, with its force.
        let mut force = ForceId::NONE;
        if is_last_the_end {
            self.next.x.copy_from_slice(&self.at);
            self.next.v.copy_from_slice(&self.v[last]);
            force = system.force();
        }
        // Prescribed coordinates end at their prescribed positions.
        system.prescribe(state.time + h, &mut self.next.x, &mut self.next.v);
        self.energy.end(system, state, h, &self.next, self.options.size)?;
        self.next.commit(system, state, h, force)
    }

    fn stage_velocities(&self) -> &[Vec<f64>] {
        &self.v
    }

    fn undo(&mut self, state: &mut State) {
        state.swap(&mut self.next.x, &mut self.next.v, ForceId::NONE);
    }

    fn work(&self) -> SolverWork {
        self.newton.as_ref().map_or(SolverWork::default(), |newton| newton.work())
    }

    fn solver_bytes(&self, system: &mut System, x: &[f64]) -> usize {
        coupled_newton(system.dimension(), self.options).predicted_bytes(system, self.z.len(), x)
    }
}
