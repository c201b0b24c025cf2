//! Diagonally implicit Runge-Kutta methods on `(x, v)' = (v, a(x, t) - c v)`, one stage after another.

use super::implicit::{Next, Stage, StageSolver, guess_acceleration};
use super::{Integrator, StepFault, node};
use crate::solver::{SolverOptions, SolverWork};
use crate::state::State;
use crate::system::{ForceId, System};

/// A Butcher tableau with zeros above the diagonal; Hairer, Wanner 1996, *Solving Ordinary Differential Equations II*, section
/// IV.6. The nodes are the sums of the rows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DirkTableau {
    /// Row `i` holds `a_ij`, `j <= i`. A stage with `a_ii = 0` is explicit.
    pub a: &'static [&'static [f64]],
    /// Weights.
    pub b: &'static [f64],
}

impl DirkTableau {
    /// Whether the last stage is the new state.
    pub fn is_stiffly_accurate(&self) -> bool {
        self.a[self.a.len() - 1] == self.b
    }
}

/// Runs any such tableau.
pub struct Dirk {
    tableau: DirkTableau,
    solver: StageSolver,
    /// One full Newton step from the old positions in place of a solution.
    linearised: bool,
    velocity: Vec<Vec<f64>>,
    acceleration: Vec<Vec<f64>>,
    z: Vec<f64>,
    w: Vec<f64>,
    next: Next,
}

impl Dirk {
    /// A runner for `tableau` on `unknowns` coordinates; `linearised` takes one Newton step in place of each solution.
    pub fn new(tableau: DirkTableau, linearised: bool, unknowns: usize, options: SolverOptions) -> Self {
        let stages = vec![vec![0.0; unknowns]; tableau.b.len()];
        Dirk {
            tableau,
            solver: StageSolver::new(options),
            linearised,
            velocity: stages.clone(),
            acceleration: stages,
            z: vec![0.0; unknowns],
            w: vec![0.0; unknowns],
            next: Next::new(unknowns),
        }
    }

    /// `z = h sum_j c_j V_j`, `w = v_n + h sum_j c_j A_j`.
    fn combine(&mut self, state: &State, h: f64, coefficients: &[f64]) {
        self.z.fill(0.0);
        self.w.copy_from_slice(state.v());
        for (j, c) in coefficients.iter().enumerate().filter(|(_, c)| **c != 0.0) {
            let stage = self.velocity[j].iter().zip(&self.acceleration[j]);
            for ((z, w), (v, a)) in self.z.iter_mut().zip(&mut self.w).zip(stage) {
                *z += h * c * v;
                *w += h * c * a;
            }
        }
    }
}

impl Integrator for Dirk {
    fn step(&mut self, system: &mut System, state: &mut State, h: f64) -> Result<(), StepFault> {
        let DirkTableau { a, b } = self.tableau;
        let mut force = ForceId::NONE;
        self.next.x.copy_from_slice(state.x());
        for (i, row) in a.iter().enumerate() {
            let time = state.time + node(row) * h;
            if row[i] == 0.0 {
                // Explicit stages come first, where the force may be known.
                self.combine(state, h, &row[..i]);
                system.set_time(time);
                let x = &mut self.next.x;
                x.iter_mut().zip(state.x()).zip(&self.z).for_each(|((x, old), z)| *x = old + z);
                let prescribed = system.prescribe(time, x, &mut self.w);
                let known = i == 0 && system.holds(state.force);
                if !prescribed || !known && system.evaluate(x).is_none() {
                    return Err(StepFault::at(system, x, &self.w));
                }
                system.evaluate_dissipation(x, &self.w);
                system.accelerations(&mut self.acceleration[i]);
                let drag = system.ether_drag();
                self.velocity[i].copy_from_slice(&self.w);
                if drag != 0.0 {
                    self.acceleration[i].iter_mut().zip(&self.w).for_each(|(a, v)| *a -= drag * v);
                }
                continue;
            }
            self.combine(state, h, &row[..i]);
            let stage = Stage { x: state.x(), z: &self.z, w: &self.w, g: h * row[i], time };
            let (v, acceleration) = (&mut self.velocity[i], &mut self.acceleration[i]);
            if i > 0 {
                // The last stage's acceleration is the better guess.
                let (before, own) = self.acceleration.split_at_mut(i);
                own[0].copy_from_slice(&before[i - 1]);
                self.solver.solve(system, &stage, &mut self.next.x, v, &mut own[0], self.linearised)?;
            } else {
                guess_acceleration(system, state, acceleration);
                self.solver.solve(system, &stage, &mut self.next.x, v, acceleration, self.linearised)?;
            }
            force = system.force();
        }
        if self.tableau.is_stiffly_accurate() {
            self.next.v.copy_from_slice(&self.velocity[b.len() - 1]);
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

    fn undo(&mut self, state: &mut State) {
        state.swap(&mut self.next.x, &mut self.next.v, ForceId::NONE);
    }

    fn work(&self) -> SolverWork {
        self.solver.work()
    }

    fn bytes(&self) -> usize {
        16 * self.z.len() * (1 + self.velocity.len()) + self.next.bytes() + self.solver.bytes()
    }
}
