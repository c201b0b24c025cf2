//! Diagonally implicit Runge-Kutta methods on `(x, v)' = (v, a(x, t) - c v)`, solved one stage at a time.

use super::equations::acceleration_at;
use super::estimate::{ErrorNorm, Judgement, Tolerances};
use super::implicit::{NextState, StageEquations, StageSolver, guess_acceleration};
use super::tableau::{Stages, Tableau};
use super::{Integrator, node};
use crate::lanes::Numbers;
use crate::solver::StepFault;
use crate::solver::structure::LentStructure;
use crate::solver::{SolverOptions, SolverWork};
use crate::state::State;
use crate::system::{ForceId, System};

/// Integrator for a tableau with zeros above the diagonal.
pub struct Dirk {
    tableau: Tableau,
    solver: StageSolver,
    /// True to take one full Newton step from the old positions instead of solving each stage.
    linearised: bool,
    stages: Stages,
    z: Vec<f64>,
    w: Numbers,
    next: NextState,
    norm: ErrorNorm,
}

impl Dirk {
    /// Creates the integrator for `tableau` on `unknowns` coordinates; `linearised` takes one Newton step
    /// instead of each solve.
    pub fn new(tableau: Tableau, linearised: bool, unknowns: usize, options: SolverOptions) -> Self {
        Dirk {
            tableau,
            solver: StageSolver::new(options),
            linearised,
            stages: Stages::new(&tableau, unknowns),
            z: vec![0.0; unknowns],
            w: Numbers::zeros(unknowns),
            next: NextState::new(unknowns),
            norm: ErrorNorm::default(),
        }
    }

    /// `z = h sum_j c_j V_j`, `w = v_n + h sum_j c_j A_j`.
    fn combine(&mut self, state: &State, h: f64, coefficients: &[f64]) {
        self.z.fill(0.0);
        self.w.copy_from_slice(state.v());
        for (j, c) in coefficients.iter().enumerate().filter(|(_, c)| **c != 0.0) {
            let stage = self.stages.velocity[j].iter().zip(&self.stages.acceleration[j]);
            for ((z, w), (v, a)) in self.z.iter_mut().zip(self.w.iter_mut()).zip(stage) {
                *z += h * c * v;
                *w += h * c * a;
            }
        }
    }
}

impl Integrator for Dirk {
    fn step(&mut self, system: &mut System, state: &mut State, h: f64) -> Result<(), StepFault> {
        let Tableau { a, b, .. } = self.tableau;
        let mut force = ForceId::NONE;
        self.next.x.copy_from_slice(state.x());
        for (i, row) in a.iter().enumerate() {
            let time = state.time + node(row) * h;
            if row[i] == 0.0 {
                // Explicit stages come first; the force there may be known.
                self.combine(state, h, &row[..i]);
                let x = &mut self.next.x;
                x.iter_mut().zip(state.x()).zip(&self.z).for_each(|((x, old), z)| *x = old + z);
                let known = if i == 0 { state.force } else { ForceId::NONE };
                let Stages { velocity, acceleration } = &mut self.stages;
                acceleration_at(system, time, (x, &mut self.w), known, &mut acceleration[i])?;
                velocity[i].copy_from_slice(&self.w);
                continue;
            }
            self.combine(state, h, &row[..i]);
            // Implicit stage: solve for its position, velocity and acceleration.
            let (g, mean_of_held) = (h * row[i], self.tableau.is_backward_euler() && system.rubs_by_way());
            let stage = StageEquations { x: state.x(), z: &self.z, w: &self.w, g, time, mean_of_held };
            let Stages { velocity, acceleration } = &mut self.stages;
            let v = &mut velocity[i];
            if i > 0 {
                // The last stage's acceleration is the better guess.
                let (before, own) = acceleration.split_at_mut(i);
                own[0].copy_from_slice(&before[i - 1]);
                self.solver.solve(system, &stage, &mut self.next.x, v, &mut own[0], self.linearised)?;
            } else {
                let own = &mut acceleration[i];
                guess_acceleration(system, state, own);
                self.solver.solve(system, &stage, &mut self.next.x, v, own, self.linearised)?;
            }
            force = system.force();
        }
        // New state: the last stage, or the weighted sum of all.
        if self.tableau.is_stiffly_accurate() {
            self.next.v.copy_from_slice(&self.stages.velocity[b.len() - 1]);
            if self.linearised {
                force = ForceId::NONE;
            }
        } else {
            self.combine(state, h, b);
            let positions = self.next.x.iter_mut().zip(state.x()).zip(&self.z);
            positions.for_each(|((x, old), z)| *x = old + z);
            std::mem::swap(&mut self.next.v, &mut self.w);
            force = ForceId::NONE;
        }
        self.next.commit(system, state, h, force)
    }

    /// Filters the estimate by the matrix of the last stage, `(I - g J)^-1` for the Jacobian `J` of
    /// `(x, v)' = (v, a - c v)` and `g` the diagonal coefficient times the step, which damps stiff
    /// components; Hosea, Shampine 1996, section 5. Eliminated, with the matrix `A`: `A e_x = (1 + g c) M
    /// r_x + g C r_x + g M r_v`, `e_v = (e_x - r_x) / g`.
    fn judge(
        &mut self,
        system: &mut System,
        state: &State,
        h: f64,
        tolerances: &Tolerances,
    ) -> Option<Judgement> {
        let difference = self.tableau.companion?.difference;
        let last = self.tableau.a.last()?;
        let g = h * last[last.len() - 1];
        let (d, n) = (system.dimension(), self.z.len());
        // r_x in z, r_v in w.
        self.z.fill(0.0);
        self.w.fill(0.0);
        for (j, c) in difference.iter().enumerate() {
            for i in (0..n).filter(|i| system.inverse_mass()[*i] > 0.0) {
                self.z[i] += h * c * self.stages.velocity[j][i];
                self.w[i] += h * c * self.stages.acceleration[j][i];
            }
        }
        // Right-hand side g C r_x + M ((1 + g c) r_x + g r_v); damping couples coordinates.
        let mut right = vec![0.0; n];
        if system.is_damped() {
            system.damping_product(state.x(), state.v(), &self.z, &mut right);
        }
        let inertia = 1.0 + g * system.ether_drag();
        for i in 0..n {
            right[i] = match system.inverse_mass()[i] {
                0.0 => 0.0,
                _ => g * right[i] + system.mass()[i / d] * (inertia * self.z[i] + g * self.w[i]),
            };
        }
        if !self.solver.solve_last(&mut right) {
            // No matrix was needed: use the unfiltered estimate, which is larger.
            right.copy_from_slice(&self.z);
            for i in 0..n {
                right[i] += g * self.w[i];
            }
        }
        let z = &self.z;
        // The filtered error of positions is now in `right`; that of velocities follows.
        let errors = |range: std::ops::Range<usize>, x: &mut [f64], v: &mut [f64]| {
            for (k, i) in range.enumerate() {
                (x[k], v[k]) = (right[i], (right[i] - z[i]) / g);
            }
        };
        Some(Judgement::Error(self.norm.of(system, tolerances, &self.next.v, state.v(), errors)))
    }

    fn stage_velocities(&self) -> &[Vec<f64>] {
        &self.stages.velocity
    }

    fn undo(&mut self, state: &mut State) {
        state.swap(&mut self.next.x, &mut self.next.v, ForceId::NONE);
    }

    fn exchange_structure(&mut self, system: &System, lent: Option<LentStructure>) -> Option<LentStructure> {
        self.solver.exchange_structure(system, lent)
    }

    fn work(&self) -> SolverWork {
        self.solver.work()
    }

    fn solver_bytes(&self, system: &mut System, x: &[f64]) -> usize {
        self.solver.bytes(system, x)
    }
}
