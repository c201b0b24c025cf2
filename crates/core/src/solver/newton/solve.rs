//! One Newton solve: its iterations and the state carried between them.

use super::evaluation::weights;
use super::linear::{Direction, LinearRequest};
use super::prescribed::rest_of_way;
use super::search::{Accepted, Slope};
use super::watchdog::Watchdog;
use super::{
    CONTRACTION, FORCING, FORCING_PART, GUARDED_ENERGY, GUARDED_FORCING, NEAR, Newton, RUNAWAY, ULPS,
};
use crate::material::Psd;
use crate::solver::conjugate_gradients::{CgTolerance, dot};
use crate::solver::iterative::CG_TOLERANCE;
use crate::solver::options::LinearSolver;
use crate::solver::{ForceLeft, Iterate, Objective, SolveError, SolveFailure, StepFault};
use crate::system::System;

/// Corrections below this many tolerances update lagged quantities; larger ones do so only after two full
/// steps in a row.
const NEAR_END: f64 = 100.0;
/// After an indefinite exact Hessian under terms that limit steps, the exact one is tried again below
/// this fraction of the last correction.
///
/// Cloth that buckles against a body has indefinite Hessians until shortly before the minimum, and each
/// vain try costs as much as the projected one after it.
const EXACT_AGAIN: f64 = 0.2;
/// Iterations without a smaller correction after which steps must not end uphill.
const STAGNANT: u32 = 30;
/// Residual forces in statics that count as rounding, relative to the largest force, constrained
/// coordinates included: positions have a rounding of 1e-16, and contact is stiff.
const BALANCED: f64 = 1e-11;
/// Full steps with projected Hessians after which an exact one is tried in any case, doubled after each
/// indefinite one: projected ones may converge ever more slowly.
const FIRST_WAIT: u32 = 4;

/// State of one solve.
pub(super) struct NewtonSolve<'a> {
    pub(super) system: &'a mut System,
    pub(super) objective: &'a Objective<'a>,
    pub(super) at: &'a mut Iterate,
    /// Current iteration.
    iteration: u32,
    /// Largest component of the last correction [m], and of the one before.
    pub(super) correction: f64,
    before: f64,
    /// Smallest correction so far, and iterations since then.
    least: f64,
    stagnant: u32,
    /// Objective at the iterate, if the line search computed it.
    value: Option<f64>,
    /// Part of it that does not depend on the last iterate.
    conservative: Option<f64>,
    /// Treatment of element Hessians.
    pub(super) psd: Psd,
    /// Corrections up to which exact element Hessians may be tried again [m].
    exact_below: f64,
    /// Full steps with projected Hessians until exact ones are tried in any case.
    wait: u32,
    /// Number of such steps so far.
    waited: u32,
    /// True if the current matrix may be reused.
    keep: bool,
    /// Relative residual required of conjugate gradients.
    forcing: f64,
    /// True if `forcing` follows the convergence.
    inexact: bool,
    /// True if a Hessian was indefinite or a step was shortened.
    curved: bool,
    /// True if the objective changes in each iteration: with dissipation or non-conservative forces.
    changes: bool,
    /// Size of corrections [m] that are rounding.
    floor: f64,
    /// Newton tolerance [m].
    negligible: f64,
    /// How often lagged quantities may still be updated along the way.
    pub(super) renewals: u32,
    /// Consecutive iterations that started with updated lagged quantities.
    fresh: u32,
    /// True if the last step was full.
    went_whole: bool,
    /// Consecutive iterations with limited steps.
    limited: u64,
    /// True if the lagged quantities are converged to the tolerance.
    settled: bool,
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
    fn new(system: &'a mut System, objective: &'a Objective<'a>, at: &'a mut Iterate) -> Self {
        let reach = at.x.iter().chain(objective.target).fold(0.0, |m: f64, x| m.max(x.abs()));
        NewtonSolve {
            iteration: 0,
            correction: f64::INFINITY,
            before: f64::INFINITY,
            least: f64::INFINITY,
            stagnant: 0,
            value: None,
            conservative: None,
            psd: Psd::Exact,
            exact_below: f64::INFINITY,
            wait: 0,
            waited: 0,
            // The textbook's single iteration uses the Hessian at its start.
            keep: !objective.single_iteration,
            forcing: CG_TOLERANCE,
            inexact: false,
            curved: false,
            changes: false,
            floor: ULPS * f64::EPSILON * reach,
            negligible: 0.0,
            renewals: 0,
            fresh: 0,
            went_whole: false,
            limited: 0,
            settled: false,
            watchdog: Watchdog::new(),
            system,
            objective,
            at,
        }
    }

    /// Resets the convergence history for another iterate, with this objective value if known.
    pub(super) fn start_anew(&mut self, value: Option<f64>) {
        (self.correction, self.before) = (f64::INFINITY, f64::INFINITY);
        (self.least, self.stagnant) = (f64::INFINITY, 0);
        (self.keep, self.psd, self.value, self.conservative) = (false, Psd::Exact, value, None);
        (self.exact_below, self.wait, self.waited) = (f64::INFINITY, 0, 0);
    }

    fn fault(&self, verdict: SolveFailure, residual: &[f64]) -> StepFault {
        let (iterations, correction) = (self.iteration, self.correction);
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

    /// Sets the relative residual of the next linear solve. Corrections shrink by the linear residual or
    /// by the change of the matrix: the former need not be much smaller. Negative curvature, though, only
    /// shows in accurate solves.
    ///
    /// Under terms that limit steps, shortened steps and projected elements far from the minimum come
    /// from contact and say nothing about curvature.
    fn set_forcing(&mut self, truncated: bool) {
        let (guarded, least) = (self.system.has_guards(), self.least_forcing());
        self.curved |= !guarded && (self.psd == Psd::Projected || truncated || !self.keep);
        let evenly = self.before.is_finite() && (self.keep || !guarded);
        let shrink = if evenly { self.correction / self.before } else { FORCING[0] };
        let last = self.correction * shrink.min(1.0) <= self.negligible && (self.keep || !guarded);
        self.forcing = if self.curved || last || guarded && truncated {
            least
        } else {
            (FORCING_PART * shrink).clamp(least, FORCING[1])
        };
    }

    /// Returns the tolerance of the next linear solve. A solve repeated because its direction failed
    /// stops on the residual alone.
    fn linear_tolerance(&self) -> CgTolerance {
        let last = self.system.has_guards() && self.forcing == GUARDED_FORCING;
        CgTolerance { residual: self.forcing, energy: if last { GUARDED_ENERGY } else { 0.0 } }
    }

    /// Returns the smallest relative residual required of conjugate gradients.
    fn least_forcing(&self) -> f64 {
        if self.system.has_guards() { GUARDED_FORCING } else { CG_TOLERANCE }
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
        let mut solve = NewtonSolve { renewals, ..NewtonSolve::new(system, objective, at) };
        let end = self.iterate(&mut solve, begin);
        solve.system.forget_steps();
        end.map_err(|verdict| solve.fault(verdict, &self.residual))?;
        Ok(solve.settled)
    }

    fn iterate(&mut self, solve: &mut NewtonSolve<'_>, begin: Begin) -> Result<(), SolveFailure> {
        self.stepped_from = false;
        if !self.residual(solve.system, solve.objective, solve.at) {
            return Err(SolveFailure::Infeasible);
        }
        self.go_to_goal(solve)?;
        solve.changes = solve.system.is_damped() || !self.follower.is_empty();
        // A matrix is cheap compared with a conjugate-gradient solve: it is only reused within one
        // minimisation.
        let linear = self.options.linear;
        let first = linear.first_iterations(solve.system, solve.objective.inertia, solve.at.x.len() / D);
        let by_iterations = first.is_some() || linear.choose(solve.system).is_iterative();
        solve.inexact = !solve.objective.single_iteration && by_iterations;
        if solve.inexact {
            self.at_hand = None;
            solve.forcing = solve.least_forcing();
            if begin == Begin::Anywhere {
                solve.forcing = FORCING[0];
            }
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
        solve.before = solve.correction;
        solve.negligible = self.tolerance(solve.system, solve.objective, solve.at).max(solve.floor);
        // Direction, and the convergence history of its length.
        let Some(found) = self.correction(solve)? else { return Ok(Converged) };
        self.work.newton_iterations += 1;
        solve.stagnant = if solve.correction < solve.least { 0 } else { solve.stagnant + 1 };
        solve.least = solve.least.min(solve.correction);
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
        let mut old_matrix = solve.keep && self.at_hand == Some(weights(solve.objective));
        loop {
            let (slope, truncated) = self.direction(solve, old_matrix)?;
            solve.correction = self.direction.iter().fold(0.0, |m: f64, d| m.max(d.abs()));
            if old_matrix && !(slope < 0.0 && solve.correction <= CONTRACTION * solve.before) {
                old_matrix = false;
                continue;
            }
            // Only rounding holds an unsupported body: the shift of a projected matrix is better.
            let runs_away = solve.objective.inertia == 0.0
                && solve.correction > RUNAWAY * self.size
                && self.options.linear != LinearSolver::MatrixFree;
            if slope < 0.0 && !(runs_away && solve.psd == Psd::Exact) {
                return Ok(Some(Correction { slope, truncated, old_matrix }));
            }
            if slope == 0.0 && solve.correction <= solve.negligible && !truncated {
                // Near enough that the product underflows.
                return Ok(None);
            }
            if solve.psd == Psd::Projected || self.options.linear == LinearSolver::MatrixFree {
                return Err(SolveFailure::Indefinite);
            }
            if solve.watchdog.is_watching() {
                self.go_back(solve)?;
                old_matrix = false;
                continue;
            }
            // After an indefinite Hessian, exact ones are skipped until corrections are well below this
            // one.
            solve.psd = Psd::Projected;
            if solve.system.has_guards() {
                solve.exact_below = EXACT_AGAIN * solve.before;
                (solve.wait, solve.waited) = (FIRST_WAIT.max(2 * solve.wait), 0);
            }
        }
    }

    /// Solves for the direction. Returns its slope, NaN without a direction, and whether it is truncated.
    fn direction(
        &mut self,
        solve: &mut NewtonSolve<'_>,
        old_matrix: bool,
    ) -> Result<(f64, bool), SolveFailure> {
        let tolerance = solve.linear_tolerance();
        let NewtonSolve { system, objective, at, psd, .. } = solve;
        let request = LinearRequest { psd: *psd, old_matrix, tolerance, way: None };
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
        let NewtonSolve { correction, negligible, .. } = *solve;
        let start = match (solve.value, solve.conservative) {
            (Some(value), _) if !solve.changes => value,
            (_, Some(same)) => same + self.changing_part(solve.system, solve.objective, solve.at, solve.at),
            _ => self.value(solve.system, solve.objective, solve.at, solve.at),
        };
        // In dynamics a shortened step with a reused matrix is worth less than a new matrix; in statics
        // it still leads on from the last equilibrium.
        let whole = found.old_matrix && solve.objective.inertia > 0.0 && correction > negligible;
        let projected = solve.psd == Psd::Projected;
        let may_rise = solve.watchdog.may_begin()
            && !whole
            && (solve.iteration == 0 || !found.old_matrix)
            && !(projected || found.truncated || solve.system.has_guards())
            && self.follower.is_empty();
        let stagnates = solve.stagnant > STAGNANT;
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
            solve.keep = false;
        } else if solve.forcing > CG_TOLERANCE {
            // An inaccurate solution may not point downhill: first solve accurately with the same matrix.
            (solve.forcing, solve.correction) = (CG_TOLERANCE, f64::INFINITY);
        } else if solve.correction <= solve.negligible && !found.truncated {
            self.note_loose(solve.system, solve.at, solve.correction);
            return Ok(Converged);
        } else if found.old_matrix {
            solve.keep = false;
        } else if solve.psd == Psd::Exact {
            solve.psd = Psd::Projected;
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
        let steady = solve.keep && accepted.halvings == 0 && solve.psd == Psd::Exact;
        solve.keep = accepted.halvings == 0;
        solve.waited += u32::from(solve.keep);
        let may_be_exact = solve.correction <= solve.exact_below || solve.waited >= solve.wait;
        if solve.keep && solve.correction <= NEAR * self.size && may_be_exact {
            // Near a minimum the exact Hessian is positive definite and converges quadratically.
            solve.psd = Psd::Exact;
        }
        (solve.value, solve.conservative) = (Some(accepted.value), Some(accepted.conservative));
        // Update lagged quantities and move to the trial.
        self.tell_of_direction(solve);
        let fresh = solve.fresh;
        let renewed = self.renew(solve, accepted);
        let known = accepted.finite.filter(|_| !renewed);
        let finite = known.unwrap_or_else(|| self.residual_at_trial(solve.system, solve.objective));
        std::mem::swap(solve.at, &mut self.trial);
        // Short steps change stresses little: exact ones are better than predicted ones.
        self.stepped_from = solve.correction > NEAR * self.size;
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
            solve.settled = fresh > 1 || fresh == 1 && solve.correction <= solve.negligible;
            self.note_loose(solve.system, solve.at, solve.correction);
            return Ok(Converged);
        }
        if solve.inexact {
            solve.set_forcing(found.truncated);
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
        if !solve.changes {
            return;
        }
        self.velocity_at(solve.system, solve.objective, solve.at);
        let rate = solve.objective.velocity.rate;
        let change: Vec<f64> = self.direction.iter().map(|d| rate * d).collect();
        solve.system.follow(&self.velocity, &change);
    }

    /// Updates lagged quantities at the trial; returns whether it did.
    ///
    /// Far from the minimum an update is wasted, as each moves the minimum and the solve starts over.
    /// Shortened steps are far from it, and so are full steps with large corrections.
    fn renew(&mut self, solve: &mut NewtonSolve<'_>, accepted: &Accepted) -> bool {
        let whole = accepted.halvings == 0 && !accepted.shortened;
        let soon = solve.correction <= NEAR_END * solve.negligible || solve.went_whole;
        let renewed = solve.renewals > 0 && whole && soon;
        solve.went_whole = whole;
        if renewed {
            solve.renewals -= 1;
            solve.system.freeze(&self.trial.x, 1.0);
        }
        solve.fresh = if renewed { solve.fresh + 1 } else { 0 };
        renewed
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
        let (before, correction) = (solve.before, solve.correction);
        // The first correction with a factor of an earlier solve says little about the next.
        let known = (solve.iteration > 0 || !found.old_matrix) && !found.truncated;
        let tolerance = self.tolerance(solve.system, solve.objective, solve.at);
        let rounding = correction >= 0.5 * before && (correction <= solve.floor || self.is_balanced(solve));
        // An inaccurate solve may give a small correction if the matrix is ill conditioned: the last one
        // is accurate.
        let left = if steady { self.left(solve.objective, before, correction) } else { correction };
        (left <= tolerance || rounding) && known && solve.forcing <= solve.least_forcing()
    }
}
