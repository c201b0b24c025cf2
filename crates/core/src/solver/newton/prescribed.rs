//! Prescribed motion under terms that limit steps: constrained coordinates move together with the free
//! ones.
//!
//! Set to their final positions at once, they could interpenetrate what they push. Instead their
//! remaining displacement `d_p` is part of the Newton direction, and free coordinates follow to first
//! order, `A_ff d_f = -r_f - A_fp d_p`. The step is truncated at the first impact. After the displacement
//! is complete, the minimisation proceeds as usual.

use super::Newton;
use super::linear::{Direction, LinearRequest};
use super::solve::{NewtonSolve, SolveProgress};
use crate::material::Psd;
use crate::solver::iterative::CG_TOLERANCE;
use crate::solver::{Iterate, Objective, SolveFailure};
use crate::system::System;

/// A step fraction below this counts as stuck.
const STUCK_PART: f64 = 1e-3;
/// Consecutive stuck steps that end the solve.
const STUCK_MOST: u32 = 20;
/// Most iterations of the free coordinates alone after a truncated step.
const YIELDING: u32 = 3;
/// Most halvings until the energy is finite.
const MAX_HALVINGS: u32 = 30;

impl<const D: usize> Newton<D> {
    /// Moves constrained coordinates to the goal of the objective.
    ///
    /// # Errors
    /// [`SolveFailure::Obstructed`] if the motion is blocked; failures of the linear solver.
    pub(super) fn go_to_goal(&mut self, solve: &mut NewtonSolve<'_>) -> Result<(), SolveFailure> {
        let Some(goal) = solve.objective.goal else { return Ok(()) };
        let (mut stuck, mut iterations, mut has_yielded) = (0, 0, false);
        loop {
            let way = rest_of_way(solve.system, goal, &solve.at.x);
            if way.iter().all(|way| *way == 0.0) {
                return Ok(());
            }
            if iterations == self.options.max_iterations {
                return Err(SolveFailure::IterationCap);
            }
            iterations += 1;
            if solve.system.is_stopped() {
                return Err(SolveFailure::Stopped);
            }
            // Near their minimum, free coordinates only follow. Their remaining forces would dominate the
            // direction, and whatever stops it would also stop a displacement of rounding size.
            if has_yielded {
                self.residual.fill(0.0);
            }
            self.direction_along(solve, &way)?;
            self.work.newton_iterations += 1;
            let part = self.move_with_held(solve.system, solve.objective, solve.at)?;
            self.note_limited(solve, part < 1.0);
            // A step that ends with a closed gap is truncated to the last bit, each time by most of it.
            let is_rounding = way.iter().all(|way| way.abs() <= f64::EPSILON * self.size);
            let leads_nowhere = part < STUCK_PART || part < 1.0 && is_rounding;
            stuck = if leads_nowhere { stuck + 1 } else { 0 };
            std::mem::swap(solve.at, &mut self.trial);
            if !self.residual(solve.system, solve.objective, solve.at) {
                return Err(SolveFailure::Infeasible);
            }
            if stuck == STUCK_MOST {
                return Err(SolveFailure::Obstructed);
            }
            has_yielded = part < 1.0;
            if has_yielded {
                self.yield_to_held(solve)?;
            }
        }
    }

    /// Moves free coordinates towards their minimum while constrained ones wait. A step that ends at a
    /// contact has used up most of its gap: continuing at once would make barriers so stiff that only
    /// rounding is left.
    fn yield_to_held(&mut self, solve: &mut NewtonSolve<'_>) -> Result<(), SolveFailure> {
        // Lagged quantities are updated, and loose solves counted, only on the way to the final minimum.
        let (renewals, loose) = (std::mem::take(&mut solve.lagged.left), self.work.loose);
        solve.start_anew(None);
        for _ in 0..YIELDING {
            if self.iteration(solve)? == SolveProgress::Converged {
                break;
            }
        }
        (solve.lagged.left, self.work.loose) = (renewals, loose);
        solve.start_anew(None);
        Ok(())
    }

    /// Solves for the direction of the free coordinates; constrained ones get `way`.
    fn direction_along(&mut self, solve: &mut NewtonSolve<'_>, way: &[f64]) -> Result<(), SolveFailure> {
        let (system, objective) = (&mut *solve.system, solve.objective);
        let held: Vec<bool> = system.inverse_mass().iter().map(|w| *w == 0.0).collect();
        for psd in [Psd::Exact, Psd::Projected] {
            let tolerance = CG_TOLERANCE.into();
            let request = LinearRequest { psd, old_matrix: false, tolerance, way: Some(way) };
            let found = self.solve_linear(system, objective, solve.at, request);
            match found {
                Direction::Descent | Direction::Truncated => {
                    for i in (0..way.len()).filter(|i| held[*i]) {
                        self.direction[i] = way[i];
                    }
                    return Ok(());
                }
                Direction::Indefinite => {}
                Direction::Failed if system.is_stopped() => return Err(SolveFailure::Stopped),
                Direction::Failed => return Err(SolveFailure::LinearSolver),
            }
        }
        Err(SolveFailure::Indefinite)
    }

    /// Sets `trial` to the configuration along the direction, constrained coordinates included, up to the
    /// first impact and with a finite energy. Returns the step fraction.
    fn move_with_held(
        &mut self,
        system: &mut System,
        objective: &Objective<'_>,
        at: &Iterate,
    ) -> Result<f64, SolveFailure> {
        let mut part = system.max_step(&at.x, &self.direction);
        for _ in 0..MAX_HALVINGS {
            self.move_along(system, objective, at, part);
            for i in (0..at.x.len()).filter(|i| system.inverse_mass()[*i] == 0.0) {
                // A full step ends at the goal exactly.
                let all = objective.goal.filter(|_| part == 1.0).map(|goal| goal[i]);
                self.trial.x[i] = all.unwrap_or(at.x[i] + part * self.direction[i]);
            }
            let trial = std::mem::take(&mut self.trial);
            let there = self.value(system, objective, at, &trial);
            self.trial = trial;
            if there.is_finite() {
                return Ok(part);
            }
            part *= 0.5;
        }
        Err(SolveFailure::Infeasible)
    }
}

/// Returns the displacement from `x` to the goal; zero at free coordinates.
pub(super) fn rest_of_way(system: &System, goal: &[f64], x: &[f64]) -> Vec<f64> {
    let held = system.inverse_mass().iter().map(|w| *w == 0.0);
    goal.iter().zip(x).zip(held).map(|((goal, x), held)| if held { goal - x } else { 0.0 }).collect()
}
