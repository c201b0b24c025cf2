//! One Newton solve: its iterations and the state carried between them.

use super::evaluation::weights;
use super::linear::{Direction, LinearRequest};
use super::prescribed::rest_of_way;
use super::search::{Accepted, Slope};
use super::state::{Convergence, Forcing, KnownValue, LaggedUpdates, MatrixPolicy};
use super::watchdog::Watchdog;
use super::{CONTRACTION, NEAR, Newton, RUNAWAY, ULPS};
use crate::material::Psd;
use crate::solver::conjugate_gradients::dot;
use crate::solver::iterative::CG_TOLERANCE;
use crate::solver::options::LinearSolver;
use crate::solver::{ForceLeft, Iterate, Objective, SolveError, SolveFailure, StepFault};
use crate::system::System;

/// Iterations without a smaller correction after which steps must not end uphill.
const STAGNANT: u32 = 30;
/// Residual forces in statics that count as rounding, relative to the largest force, constrained
/// coordinates included: positions have a rounding of 1e-16, and contact is stiff.
const BALANCED: f64 = 1e-11;

/// State of one solve.
pub(super) struct NewtonSolve<'a> {
    pub(super) system: &'a mut System,
    pub(super) objective: &'a Objective<'a>,
    pub(super) at: &'a mut Iterate,
    /// Current iteration.
    iteration: u32,
    pub(super) convergence: Convergence,
    pub(super) matrix: MatrixPolicy,
    forcing: Forcing,
    pub(super) lagged: LaggedUpdates,
    known: KnownValue,
    /// Size of corrections [m] that are rounding.
    floor: f64,
    /// Newton tolerance [m].
    negligible: f64,
    /// Consecutive iterations with limited steps.
    limited: u64,
    /// Watchdog for steps that raise the objective.
    pub(super) watchdog: Watchdog,
}

/// Start of a solve.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Begin {
    Anywhere,
    /// Near enough that the first correction may be the last: it is computed accurately.
    NearMinimum,
}

/// Direction of one iteration, in `direction`.
#[derive(Clone, Copy)]
struct Correction {
    /// Slope of the objective along it, below zero.
    slope: f64,
    /// True if its length says nothing about the distance to a minimum.
    truncated: bool,
    /// True if the matrix was reused.
    old_matrix: bool,
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum SolveProgress {
    Continues,
    Converged,
}

use SolveProgress::{Continues, Converged};

impl<'a> NewtonSolve<'a> {
    /// Begins a solve that updates lagged quantities at most `renewals` times.
    fn new(system: &'a mut System, objective: &'a Objective<'a>, at: &'a mut Iterate, renewals: u32) -> Self {
        let reach = at.x.iter().chain(objective.target).fold(0.0, |m: f64, x| m.max(x.abs()));
        NewtonSolve {
            iteration: 0,
            convergence: Convergence::NEW,
            // The textbook's single iteration uses the Hessian at its start.
            matrix: MatrixPolicy::new(!objective.single_iteration),
            forcing: Forcing::new(system.has_guards()),
            lagged: LaggedUpdates::new(renewals),
            known: KnownValue { value: None, conservative: None, changes: false },
            floor: ULPS * f64::EPSILON * reach,
            negligible: 0.0,
            limited: 0,
            watchdog: Watchdog::new(),
            system,
            objective,
            at,
        }
    }

    /// Resets the convergence history for another iterate, with this objective value if known.
    pub(super) fn start_anew(&mut self, value: Option<f64>) {
        self.convergence = Convergence::NEW;
        self.matrix = MatrixPolicy::new(false);
        self.known = KnownValue { value, conservative: None, ..self.known };
    }

    fn fault(&self, verdict: SolveFailure, residual: &[f64]) -> StepFault {
        let (iterations, correction) = (self.iteration, self.convergence.correction);
        let left = if self.objective.inertia == 0.0 { force_left(self.system, residual) } else { None };
        let solve = Some(SolveError { verdict, iterations, correction, left });
        if let (SolveFailure::Obstructed, Some(goal)) = (verdict, self.objective.goal) {
            let way = rest_of_way(self.system, goal, &self.at.x);
            return StepFault { fault: self.system.obstruction(&self.at.x, &way), vertex: None, solve };
        }
        let at = StepFault::at(self.system, &self.at.x, &self.at.x);
        let near = || self.system.near_fault(&self.at.x).filter(|_| verdict == SolveFailure::Indefinite);
        StepFault { solve, fault: at.fault.clone().or_else(near), ..at }
    }

    /// Checks that no body runs away in statics.
    ///
    /// # Errors
    /// [`SolveFailure::Indefinite`] if an unsupported body runs away.
    fn check_distance(&self, size: f64) -> Result<(), SolveFailure> {
        if self.objective.inertia != 0.0 {
            return Ok(());
        }
        let away = self.at.u.iter().zip(self.system.inverse_mass());
        let away = away.fold(0.0, |m: f64, (u, w)| if *w == 0.0 { m } else { m.max(u.abs()) });
        if away > RUNAWAY * size { Err(SolveFailure::Indefinite) } else { Ok(()) }
    }
}

/// Returns the largest component of a static residual; `None` if it is not finite.
fn force_left(system: &System, residual: &[f64]) -> Option<ForceLeft> {
    let largest = residual.iter().enumerate().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
    let (at, force) = largest.map(|(i, r)| (i / system.dimension(), r.abs()))?;
    force.is_finite().then_some(ForceLeft { force, vertex: at })
}

impl<const D: usize> Newton<D> {
    /// Moves the free coordinates of `at` to a minimum of the objective, updating lagged quantities at
    /// most `renewals` times. Returns true if they are those of the minimum itself, to the tolerance.
    ///
    /// The line search sees them constant, so that each iteration has its own minimum. Near the end both
    /// converge together; a minimum for the initial lagged values would be left again.
    pub(super) fn solve(
        &mut self,
        system: &mut System,
        objective: &Objective<'_>,
        at: &mut Iterate,
        (begin, renewals): (Begin, u32),
    ) -> Result<bool, StepFault> {
        let mut solve = NewtonSolve::new(system, objective, at, renewals);
        let end = self.iterate(&mut solve, begin);
        solve.system.forget_steps();
        end.map_err(|verdict| solve.fault(verdict, &self.residual))?;
        Ok(solve.lagged.settled)
    }

    fn iterate(&mut self, solve: &mut NewtonSolve<'_>, begin: Begin) -> Result<(), SolveFailure> {
        self.stepped_from = false;
        if !self.residual(solve.system, solve.objective, solve.at) {
            return Err(SolveFailure::Infeasible);
        }
        self.go_to_goal(solve)?;
        solve.known.changes = solve.system.is_damped() || !self.follower.is_empty();
        // A matrix is cheap compared with a conjugate-gradient solve: it is only reused within one
        // minimisation.
        let linear = self.options.linear;
        let first = linear.first_iterations(solve.system, solve.objective.inertia, solve.at.x.len() / D);
        let by_iterations = first.is_some() || linear.choose(solve.system).is_iterative();
        if !solve.objective.single_iteration && by_iterations {
            self.at_hand = None;
            solve.forcing.follow(begin == Begin::NearMinimum);
        }
        for iteration in 0..self.options.max_iterations {
            solve.iteration = iteration;
            if self.iteration(solve)? == Converged {
                return Ok(());
            }
        }
        solve.iteration = self.options.max_iterations;
        Err(SolveFailure::IterationCap)
    }

    pub(super) fn iteration(&mut self, solve: &mut NewtonSolve<'_>) -> Result<SolveProgress, SolveFailure> {
        if self.residual.iter().all(|r| *r == 0.0) {
            return Ok(Converged);
        }
        if solve.system.is_stopped() {
            return Err(SolveFailure::Stopped);
        }
        solve.convergence.before = solve.convergence.correction;
        solve.negligible = self.tolerance(solve.system, solve.objective, solve.at).max(solve.floor);
        // Direction, and the convergence history of its length.
        let Some(found) = self.correction(solve)? else { return Ok(Converged) };
        self.work.newton_iterations += 1;
        solve.convergence.count();
        solve.check_distance(self.size)?;
        if solve.objective.single_iteration {
            self.move_along(solve.system, solve.objective, solve.at, 1.0);
            std::mem::swap(solve.at, &mut self.trial);
            return Ok(Converged);
        }
        // Under a watch, take full steps; otherwise search along the direction.
        if solve.watchdog.is_watching() {
            let Some(accepted) = self.step_watched(solve).filter(|_| !found.truncated) else {
                return self.go_back(solve);
            };
            return self.advance(solve, found, &accepted);
        }
        // Line search.
        let slope = self.slope(solve, found);
        match self.search(solve.system, solve.objective, solve.at, &slope) {
            Some(accepted) => {
                if accepted.watched {
                    solve.watchdog.begin(solve.at, &slope, found.old_matrix);
                }
                self.advance(solve, found, &accepted)
            }
            None => self.retreat(solve, found, slope.whole),
        }
    }

    /// Finds a direction, with another matrix if the current one fails; `None` at a minimum.
    fn correction(&mut self, solve: &mut NewtonSolve<'_>) -> Result<Option<Correction>, SolveFailure> {
        // A factorisation costs some twenty solves: a factor is kept as long as corrections shrink fast.
        let mut old_matrix = solve.matrix.keep && self.at_hand == Some(weights(solve.objective));
        loop {
            let (slope, truncated) = self.direction(solve, old_matrix)?;
            solve.convergence.correction = self.direction.iter().fold(0.0, |m: f64, d| m.max(d.abs()));
            if old_matrix
                && !(slope < 0.0 && solve.convergence.correction <= CONTRACTION * solve.convergence.before)
            {
                old_matrix = false;
                continue;
            }
            // Only rounding holds an unsupported body: the shift of a projected matrix is better.
            let runs_away = solve.objective.inertia == 0.0
                && solve.convergence.correction > RUNAWAY * self.size
                && self.options.linear != LinearSolver::MatrixFree;
            if slope < 0.0 && !(runs_away && solve.matrix.psd == Psd::Exact) {
                return Ok(Some(Correction { slope, truncated, old_matrix }));
            }
            if slope == 0.0 && solve.convergence.correction <= solve.negligible && !truncated {
                // Near enough that the product underflows.
                return Ok(None);
            }
            if solve.matrix.psd == Psd::Projected || self.options.linear == LinearSolver::MatrixFree {
                return Err(SolveFailure::Indefinite);
            }
            if solve.watchdog.is_watching() {
                self.go_back(solve)?;
                old_matrix = false;
                continue;
            }
            // After an indefinite Hessian, exact ones are skipped until corrections are well below this
            // one.
            solve.matrix.project(solve.system.has_guards(), solve.convergence.before);
        }
    }

    /// Solves for the direction. Returns its slope, NaN without a direction, and whether it is truncated.
    fn direction(
        &mut self,
        solve: &mut NewtonSolve<'_>,
        old_matrix: bool,
    ) -> Result<(f64, bool), SolveFailure> {
        let tolerance = solve.forcing.tolerance();
        let NewtonSolve { system, objective, at, matrix, .. } = solve;
        let request = LinearRequest { psd: matrix.psd, old_matrix, tolerance, way: None };
        let found = self.solve_linear(system, objective, at, request);
        let truncated = matches!(found, Direction::Truncated);
        match found {
            Direction::Truncated if objective.single_iteration => Ok((f64::NAN, truncated)),
            Direction::Descent | Direction::Truncated => {
                Ok((dot(&self.direction, &self.residual), truncated))
            }
            Direction::Indefinite => Ok((f64::NAN, truncated)),
            Direction::Failed if system.is_stopped() => Err(SolveFailure::Stopped),
            Direction::Failed => Err(SolveFailure::LinearSolver),
        }
    }

    /// Evaluates the objective and its slope along a correction.
    fn slope(&mut self, solve: &mut NewtonSolve<'_>, found: Correction) -> Slope {
        let (correction, negligible) = (solve.convergence.correction, solve.negligible);
        let start = match (solve.known.value, solve.known.conservative) {
            (Some(value), _) if !solve.known.changes => value,
            (_, Some(same)) => same + self.changing_part(solve.system, solve.objective, solve.at, solve.at),
            _ => self.value(solve.system, solve.objective, solve.at, solve.at),
        };
        // In dynamics a shortened step with a reused matrix is worth less than a new matrix; in statics
        // it still leads on from the last equilibrium.
        let whole = found.old_matrix && solve.objective.inertia > 0.0 && correction > negligible;
        let projected = solve.matrix.psd == Psd::Projected;
        let may_rise = solve.watchdog.may_begin()
            && !whole
            && (solve.iteration == 0 || !found.old_matrix)
            && !(projected || found.truncated || solve.system.has_guards())
            && self.follower.is_empty();
        let stagnates = solve.convergence.stagnant > STAGNANT;
        Slope { start, slope: found.slope, correction, negligible, whole, projected, may_rise, stagnates }
    }

    /// Handles a correction that lowers the objective nowhere: tries a better one from the same iterate.
    fn retreat(
        &mut self,
        solve: &mut NewtonSolve<'_>,
        found: Correction,
        whole: bool,
    ) -> Result<SolveProgress, SolveFailure> {
        if whole {
            solve.matrix.keep = false;
        } else if solve.forcing.residual > CG_TOLERANCE {
            // An inaccurate solution may not point downhill: first solve accurately with the same matrix.
            (solve.forcing.residual, solve.convergence.correction) = (CG_TOLERANCE, f64::INFINITY);
        } else if solve.convergence.correction <= solve.negligible && !found.truncated {
            self.note_loose(solve.system, solve.at, solve.convergence.correction);
            return Ok(Converged);
        } else if found.old_matrix {
            solve.matrix.keep = false;
        } else if solve.matrix.psd == Psd::Exact {
            solve.matrix.psd = Psd::Projected;
        } else {
            return Err(SolveFailure::Stalled);
        }
        Ok(Continues)
    }

    /// Moves to the accepted step and checks convergence.
    fn advance(
        &mut self,
        solve: &mut NewtonSolve<'_>,
        found: Correction,
        accepted: &Accepted,
    ) -> Result<SolveProgress, SolveFailure> {
        self.work.halvings += u64::from(accepted.halvings);
        self.note_limited(solve, accepted.shortened);
        // Decide which matrix the next iteration uses.
        let steady = solve.matrix.keep && accepted.halvings == 0 && solve.matrix.psd == Psd::Exact;
        solve.matrix.after_step(accepted.halvings == 0, solve.convergence.correction, NEAR * self.size);
        (solve.known.value, solve.known.conservative) = (Some(accepted.value), Some(accepted.conservative));
        // Update lagged quantities and move to the trial.
        self.tell_of_direction(solve);
        let fresh = solve.lagged.fresh;
        let renewed = self.renew(solve, accepted);
        let known = accepted.finite.filter(|_| !renewed);
        let finite = known.unwrap_or_else(|| self.residual_at_trial(solve.system, solve.objective));
        std::mem::swap(solve.at, &mut self.trial);
        // Short steps change stresses little: exact ones are better than predicted ones.
        self.stepped_from = solve.convergence.correction > NEAR * self.size;
        if !finite && solve.watchdog.is_watching() {
            return self.go_back(solve);
        }
        if !finite {
            return Err(SolveFailure::Infeasible);
        }
        // A limited or lengthened step says nothing about the distance to the solution.
        let whole = !accepted.shortened && accepted.part <= 1.0;
        if whole && self.has_converged(solve, found, steady) {
            if solve.watchdog.is_watching() {
                // Stationary, but higher than the start of the watch.
                return self.go_back(solve);
            }
            // One correction measures the distance to the minimum; two measure how fast corrections
            // shrink as it moves.
            solve.lagged.settled =
                fresh > 1 || fresh == 1 && solve.convergence.correction <= solve.negligible;
            self.note_loose(solve.system, solve.at, solve.convergence.correction);
            return Ok(Converged);
        }
        let NewtonSolve { forcing, convergence, matrix, negligible, .. } = solve;
        if forcing.follows {
            forcing.set(convergence, matrix, found.truncated, *negligible);
        }
        Ok(Continues)
    }

    /// Counts consecutive iterations with limited steps.
    pub(super) fn note_limited(&mut self, solve: &mut NewtonSolve<'_>, shortened: bool) {
        solve.limited = if shortened { solve.limited + 1 } else { 0 };
        self.work.longest_limited = self.work.longest_limited.max(solve.limited);
    }

    /// Passes the direction to terms that limit steps, and the velocity change to dissipative terms with
    /// lagged quantities.
    fn tell_of_direction(&mut self, solve: &mut NewtonSolve<'_>) {
        if !solve.system.has_guards() {
            return;
        }
        solve.system.follow_step(&solve.at.x, &self.direction);
        if !solve.known.changes {
            return;
        }
        self.velocity_at(solve.system, solve.objective, solve.at);
        let rate = solve.objective.velocity.rate;
        let change: Vec<f64> = self.direction.iter().map(|d| rate * d).collect();
        solve.system.follow(&self.velocity, &change);
    }

    /// Updates lagged quantities at the trial; returns whether it did.
    fn renew(&mut self, solve: &mut NewtonSolve<'_>, accepted: &Accepted) -> bool {
        let whole = accepted.halvings == 0 && !accepted.shortened;
        let renews = solve.lagged.renews(whole, solve.convergence.correction, solve.negligible);
        if renews {
            solve.system.freeze(&self.trial.x, 1.0);
        }
        renews
    }

    /// True in statics if forces balance to rounding: directions without stiffness have arbitrary
    /// corrections.
    fn is_balanced(&self, solve: &NewtonSolve<'_>) -> bool {
        if solve.objective.inertia != 0.0 {
            return false;
        }
        let mut forces = vec![0.0; self.residual.len()];
        solve.system.terms().iter().for_each(|term| term.add_rows(0, &mut forces));
        let largest = |forces: &[f64]| forces.iter().fold(0.0, |m: f64, force| m.max(force.abs()));
        largest(&self.residual) <= BALANCED * largest(&forces)
    }

    /// True if the iterate is the solution to the tolerance or to rounding; `steady` means exact matrices
    /// and full steps.
    fn has_converged(&self, solve: &NewtonSolve<'_>, found: Correction, steady: bool) -> bool {
        let Convergence { before, correction, .. } = solve.convergence;
        // The first correction with a factor of an earlier solve says little about the next.
        let known = (solve.iteration > 0 || !found.old_matrix) && !found.truncated;
        let tolerance = self.tolerance(solve.system, solve.objective, solve.at);
        let rounding = correction >= 0.5 * before && (correction <= solve.floor || self.is_balanced(solve));
        // An inaccurate solve may give a small correction if the matrix is ill conditioned: the last one
        // is accurate.
        let left = if steady { self.left(solve.objective, before, correction) } else { correction };
        (left <= tolerance || rounding) && known && solve.forcing.residual <= solve.forcing.least()
    }
}
