//! One solve: its iterations, and what one leaves for the next.

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

/// Corrections over the tolerance below which what dissipative terms hold is renewed; above, after two whole
/// steps in a row.
const NEAR_END: f64 = 100.0;
/// Part of the last correction before an exact Hessian that was indefinite, below which the next one is tried
/// where terms guard ways.
///
/// Hessians of cloth that buckles against a body are indefinite until shortly before the minimum: each that
/// is tried in vain costs as much as the projected one after it.
const EXACT_AGAIN: f64 = 0.2;
/// Iterations without a smaller correction than before after which steps must not end uphill.
const STAGNANT: u32 = 30;
/// Forces left in statics, over the largest of all, held coordinates included, that are rounding: positions
/// have 1e-16 of their own, and contact is stiff.
const BALANCED: f64 = 1e-11;
/// Whole steps with projected Hessians after which an exact one is tried there in any case, twice as many
/// after each that was indefinite: projected ones may lead to a minimum ever more slowly.
const FIRST_WAIT: u32 = 4;

/// State of one solve.
pub(super) struct NewtonSolve<'a> {
    pub(super) system: &'a mut System,
    pub(super) objective: &'a Objective<'a>,
    pub(super) at: &'a mut Iterate,
    /// The iteration at hand.
    iteration: u32,
    /// Largest component of the last correction [m], and of the one before.
    pub(super) correction: f64,
    before: f64,
    /// The least so far, and iterations since then.
    least: f64,
    stagnant: u32,
    /// The objective at the iterate, where the line search left it.
    value: Option<f64>,
    /// Its part there that is the same from every iterate.
    conservative: Option<f64>,
    /// Treatment of element Hessians.
    pub(super) psd: Psd,
    /// Corrections up to which exact element Hessians may be tried again [m].
    exact_below: f64,
    /// Whole steps with projected Hessians until then in any case.
    wait: u32,
    /// Such steps so far.
    waited: u32,
    /// True if a matrix at hand may serve again.
    keep: bool,
    /// Relative residual that is asked of conjugate gradients.
    forcing: f64,
    /// True if `forcing` follows the convergence.
    inexact: bool,
    /// True if Hessians were indefinite, or a step was shortened.
    curved: bool,
    /// True if the objective is another one in every iteration: with dissipation, or forces without energy.
    changes: bool,
    /// Corrections of so much [m] are rounding.
    floor: f64,
    /// Corrections of so much [m] are none.
    negligible: f64,
    /// How often what dissipative terms hold may still be renewed on the way.
    pub(super) renewals: u32,
    /// Iterations in a row that began with it renewed.
    fresh: u32,
    /// True if the step before was whole.
    went_whole: bool,
    /// Iterations in a row whose ways were cut short.
    limited: u64,
    /// True if it is that of the end, as far as the tolerance goes.
    settled: bool,
    /// Watch over steps that raise the objective at first.
    pub(super) watchdog: Watchdog,
}

/// Place where a solve begins.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Begin {
    Anywhere,
    /// So near that the first correction may be the last: it is worth an accurate one.
    NearMinimum,
}

/// Solution of the linear system of one iteration, in `direction`.
#[derive(Clone, Copy)]
struct Correction {
    /// Slope of the objective along it, below zero.
    slope: f64,
    /// True if it says nothing of how far a minimum is.
    truncated: bool,
    /// True if the matrix is one of before.
    old_matrix: bool,
}

/// Whether a solve goes on.
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
            // The textbook's single iteration is one with the Hessian where it starts.
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

    /// Forgets what corrections were like: the iterate is another one, of this value where that is known.
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

    /// # Errors
    /// In statics, a body that nothing holds runs away.
    fn check_distance(&self, size: f64) -> Result<(), SolveFailure> {
        if self.objective.inertia != 0.0 {
            return Ok(());
        }
        let away = self.at.u.iter().zip(self.system.inverse_mass());
        let away = away.fold(0.0, |m: f64, (u, w)| if *w == 0.0 { m } else { m.max(u.abs()) });
        if away > RUNAWAY * size { Err(SolveFailure::Indefinite) } else { Ok(()) }
    }

    /// Sets the accuracy of the next linear solve. Corrections shrink by what solves leave, or by how much
    /// the matrix has changed: the former need not be much less. Negative curvature, though, shows only in
    /// solves that are accurate.
    ///
    /// Where terms guard ways, steps are shortened and elements are projected far from the minimum, by what
    /// bodies meet there: that says nothing of curvature.
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

    /// Tolerance of the next linear solve. A solve that is repeated because its direction led nowhere goes
    /// by the residual alone.
    fn linear_tolerance(&self) -> CgTolerance {
        let last = self.system.has_guards() && self.forcing == GUARDED_FORCING;
        CgTolerance { residual: self.forcing, energy: if last { GUARDED_ENERGY } else { 0.0 } }
    }

    /// The smallest relative residual that is asked of conjugate gradients.
    fn least_forcing(&self) -> f64 {
        if self.system.has_guards() { GUARDED_FORCING } else { CG_TOLERANCE }
    }
}

/// The largest component of a residual of statics; `None` where one is not finite.
fn force_left(system: &System, residual: &[f64]) -> Option<ForceLeft> {
    let largest = residual.iter().enumerate().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
    let (at, force) = largest.map(|(i, r)| (i / system.dimension(), r.abs()))?;
    force.is_finite().then_some(ForceLeft { force, vertex: at })
}

impl<const D: usize> Newton<D> {
    /// Moves the free coordinates of `at` to a minimum of the objective. What dissipative terms hold may be
    /// renewed so many times on the way; true if it is that of the minimum itself, to the tolerance.
    ///
    /// A line search sees it held, and each iteration has a minimum of its own. Near the end both shrink
    /// together, and a minimum found with what was held at its beginning would be left again.
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
        // What a matrix costs beside a solve by conjugate gradients does not pay for an old one, but within
        // one minimisation.
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
        if solve.watchdog.is_watching() {
            let Some(accepted) = self.step_watched(solve).filter(|_| !found.truncated) else {
                return self.go_back(solve);
            };
            return self.advance(solve, found, &accepted);
        }
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

    /// Finds the direction, by another matrix where the one at hand leads nowhere; `None` at a minimum.
    fn correction(&mut self, solve: &mut NewtonSolve<'_>) -> Result<Option<Correction>, SolveFailure> {
        // A factor at hand costs a solve, a new one twenty times that: it is kept as long as corrections
        // shrink fast.
        let mut old_matrix = solve.keep && self.at_hand == Some(weights(solve.objective));
        loop {
            let (slope, truncated) = self.direction(solve, old_matrix)?;
            solve.correction = self.direction.iter().fold(0.0, |m: f64, d| m.max(d.abs()));
            if old_matrix && !(slope < 0.0 && solve.correction <= CONTRACTION * solve.before) {
                old_matrix = false;
                continue;
            }
            // Rounding alone holds a body that nothing touches yet: the shift of a projected matrix is
            // better.
            let runs_away = solve.objective.inertia == 0.0
                && solve.correction > RUNAWAY * self.size
                && self.options.linear != LinearSolver::MatrixFree;
            if slope < 0.0 && !(runs_away && solve.psd == Psd::Exact) {
                return Ok(Some(Correction { slope, truncated, old_matrix }));
            }
            if slope == 0.0 && solve.correction <= solve.negligible && !truncated {
                // So near that the product underflows.
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
            // A Hessian that was indefinite once will be again, until corrections are well below this one.
            solve.psd = Psd::Projected;
            if solve.system.has_guards() {
                solve.exact_below = EXACT_AGAIN * solve.before;
                (solve.wait, solve.waited) = (FIRST_WAIT.max(2 * solve.wait), 0);
            }
        }
    }

    /// Solves for the direction: the slope along it, NaN where there is none, and whether it is truncated.
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

    /// The objective along a correction.
    fn slope(&mut self, solve: &mut NewtonSolve<'_>, found: Correction) -> Slope {
        let NewtonSolve { correction, negligible, .. } = *solve;
        let start = match (solve.value, solve.conservative) {
            (Some(value), _) if !solve.changes => value,
            (_, Some(same)) => same + self.changing_part(solve.system, solve.objective, solve.at, solve.at),
            _ => self.value(solve.system, solve.objective, solve.at, solve.at),
        };
        // In a step of time a part of the direction of an earlier matrix is worth less than a new
        // matrix; in statics it leads on from the last equilibrium.
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

    /// After a correction that lowers the objective nowhere: a better one from the same place, if there is
    /// any.
    fn retreat(
        &mut self,
        solve: &mut NewtonSolve<'_>,
        found: Correction,
        whole: bool,
    ) -> Result<SolveProgress, SolveFailure> {
        if whole {
            solve.keep = false;
        } else if solve.forcing > CG_TOLERANCE {
            // A loose solution may point nowhere: an accurate one with the same matrix comes before another
            // matrix.
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

    /// Goes to the place that the line search accepted.
    fn advance(
        &mut self,
        solve: &mut NewtonSolve<'_>,
        found: Correction,
        accepted: &Accepted,
    ) -> Result<SolveProgress, SolveFailure> {
        self.work.halvings += u64::from(accepted.halvings);
        self.note_limited(solve, accepted.shortened);
        let steady = solve.keep && accepted.halvings == 0 && solve.psd == Psd::Exact;
        solve.keep = accepted.halvings == 0;
        solve.waited += u32::from(solve.keep);
        let may_be_exact = solve.correction <= solve.exact_below || solve.waited >= solve.wait;
        if solve.keep && solve.correction <= NEAR * self.size && may_be_exact {
            // Near a minimum the exact Hessian is positive definite, and converges quadratically.
            solve.psd = Psd::Exact;
        }
        (solve.value, solve.conservative) = (Some(accepted.value), Some(accepted.conservative));
        self.tell_of_direction(solve);
        let fresh = solve.fresh;
        let renewed = self.renew(solve, accepted);
        let known = accepted.finite.filter(|_| !renewed);
        let finite = known.unwrap_or_else(|| self.residual_at_trial(solve.system, solve.objective));
        std::mem::swap(solve.at, &mut self.trial);
        // Short steps change stresses by so little that the exact ones are better.
        self.stepped_from = solve.correction > NEAR * self.size;
        if !finite && solve.watchdog.is_watching() {
            return self.go_back(solve);
        }
        if !finite {
            return Err(SolveFailure::Infeasible);
        }
        // A step that a term cut short, or that went on beyond its end, says nothing of how far the solution
        // is.
        let whole = !accepted.shortened && accepted.part <= 1.0;
        if whole && self.has_converged(solve, found, steady) {
            if solve.watchdog.is_watching() {
                // A place where nothing pushes, but higher.
                return self.go_back(solve);
            }
            // One correction tells how far the minimum was, two how fast they shrink as it moves.
            solve.settled = fresh > 1 || fresh == 1 && solve.correction <= solve.negligible;
            self.note_loose(solve.system, solve.at, solve.correction);
            return Ok(Converged);
        }
        if solve.inexact {
            solve.set_forcing(found.truncated);
        }
        Ok(Continues)
    }

    /// Counts iterations in a row whose ways were cut short.
    pub(super) fn note_limited(&mut self, solve: &mut NewtonSolve<'_>, shortened: bool) {
        solve.limited = if shortened { solve.limited + 1 } else { 0 };
        self.work.longest_limited = self.work.longest_limited.max(solve.limited);
    }

    /// Tells terms that guard ways where the direction leads, and dissipative ones that hold what they take
    /// from positions where velocities were headed.
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

    /// Renews what dissipative terms hold, at the trial; whether it did.
    ///
    /// Far from the minimum it would be worth nothing: each renewal moves the minimum, and the way begins
    /// anew. Steps that had to be cut are far, and so are whole ones with large corrections.
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

    /// True in statics where forces are in balance to rounding: what nothing holds in some direction has
    /// corrections of any size there.
    fn is_balanced(&self, solve: &NewtonSolve<'_>) -> bool {
        if solve.objective.inertia != 0.0 {
            return false;
        }
        let mut forces = vec![0.0; self.residual.len()];
        solve.system.terms().iter().for_each(|term| term.add_rows(0, &mut forces));
        let largest = |forces: &[f64]| forces.iter().fold(0.0, |m: f64, force| m.max(force.abs()));
        largest(&self.residual) <= BALANCED * largest(&forces)
    }

    /// True if the iterate is the solution to the tolerance, or to rounding; `steady` where matrices were
    /// exact and steps whole.
    fn has_converged(&self, solve: &NewtonSolve<'_>, found: Correction, steady: bool) -> bool {
        let (before, correction) = (solve.before, solve.correction);
        // The first correction by a factor of an earlier solve says little about the next.
        let known = (solve.iteration > 0 || !found.old_matrix) && !found.truncated;
        let tolerance = self.tolerance(solve.system, solve.objective, solve.at);
        let rounding = correction >= 0.5 * before && (correction <= solve.floor || self.is_balanced(solve));
        // A solve with a large residual may leave a small correction where the matrix is ill conditioned: the
        // last one is accurate.
        let left = if steady { self.left(solve.objective, before, correction) } else { correction };
        (left <= tolerance || rounding) && known && solve.forcing <= solve.least_forcing()
    }
}
