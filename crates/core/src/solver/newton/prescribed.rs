//! Prescribed motion that terms guard the way of: held coordinates go to their places together with the
//! others.
//!
//! Put there at once, they could pass through what they push. The rest of their way `d_p` is part of the
//! direction instead, and free coordinates follow it to first order, `A_ff d_f = -r_f - A_fp d_p`; both go as
//! far as the way is free. Once the way is used up, the search for the minimum goes on as everywhere.

use super::Newton;
use super::linear::{Direction, LinearRequest};
use super::solve::{NewtonSolve, SolveProgress};
use crate::material::Psd;
use crate::solver::iterative::CG_TOLERANCE;
use crate::solver::{Iterate, Objective, SolveFailure};
use crate::system::System;

/// Directions in which so small a part of the way was free lead nowhere.
const STUCK_PART: f64 = 1e-3;
/// So many of them in a row end the solve.
const STUCK_MOST: u32 = 20;
/// Iterations of free coordinates alone after a direction whose way was not free, at most.
const YIELDING: u32 = 3;
/// Halvings of a direction until its end has a finite energy.
const MAX_HALVINGS: u32 = 30;

impl<const D: usize> Newton<D> {
    /// Takes held coordinates to the goal of the objective.
    ///
    /// # Errors
    /// [`SolveFailure::Obstructed`] where the way is blocked, and failures of the linear solver.
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
            // Near their minimum free coordinates follow, and no more: what is left of their forces would be
            // the longer part of the direction, and what stops it would stop a way of rounding alone.
            if has_yielded {
                self.residual.fill(0.0);
            }
            self.direction_along(solve, &way)?;
            self.work.newton_iterations += 1;
            let part = self.move_with_held(solve.system, solve.objective, solve.at)?;
            self.note_limited(solve, part < 1.0);
            // A way that ends where a gap is closed is cut short to the last bit, each time by most of it.
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

    /// Lets free coordinates go towards their minimum while held ones wait. A way that ends at a contact has
    /// used up most of its gap: pushed on at once, barriers become so stiff that nothing is left but
    /// rounding.
    fn yield_to_held(&mut self, solve: &mut NewtonSolve<'_>) -> Result<(), SolveFailure> {
        // What dissipative terms hold is renewed, and what is loose is told, on the way to the end alone.
        let (renewals, loose) = (std::mem::take(&mut solve.renewals), self.work.loose);
        solve.start_anew(None);
        for _ in 0..YIELDING {
            if self.iteration(solve)? == SolveProgress::Converged {
                break;
            }
        }
        (solve.renewals, self.work.loose) = (renewals, loose);
        solve.start_anew(None);
        Ok(())
    }

    /// Solves for the direction of the free coordinates, and makes `way` that of the held ones.
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

    /// Makes `trial` the place along the direction, held coordinates included, up to which the way is free
    /// and the energy finite; the part of the direction.
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
                // To the last bit: the goal is where the way ends.
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

/// Rest of the way from `x` to the goal, zero where nothing is held.
pub(super) fn rest_of_way(system: &System, goal: &[f64], x: &[f64]) -> Vec<f64> {
    let held = system.inverse_mass().iter().map(|w| *w == 0.0);
    goal.iter().zip(x).zip(held).map(|((goal, x), held)| if held { goal - x } else { 0.0 }).collect()
}
