//! Newton's method for the equations of an implicit step, as a minimisation.

use super::cholesky::{Cholesky, NotPositiveDefinite};
use super::conjugate_gradients::{CgEnd, ConjugateGradients, Preconditioner, dot};
use super::hessian::{Assembler, At, Weights};
use super::iterative::{CG_TOLERANCE, Iterative};
use super::options::{LinearSolver, SolverOptions};
use super::{Iterate, Objective, SolveError, SolverWork, Verdict, scene_size};
use crate::integrator::StepFault;
use crate::material::Psd;
use crate::system::System;

/// Sufficient decrease of the line search: a fraction of what the slope promises. Nocedal, Wright 2006, *Numerical
/// optimization*, eq. 3.4.
const ARMIJO: f64 = 1e-4;
/// What the objective may change by, relative to itself, where it says less about a step than its slope does; Hager, Zhang 2005, "A
/// new conjugate gradient method with guaranteed descent and an efficient line search", eq. 4.1.
const ROUNDING: f64 = 1e-10;
/// So does a step that moves nothing by more than this part of the size of the scene: its decrease is of second order in that, and an
/// energy that is a difference of large terms, as at rest, is only known to rounding of those.
const DROWNED: f64 = 1e-5;
/// The slope at the end of such a step may be uphill by this part of that at its beginning; ibid., with delta = 0.1.
const FLATTER: f64 = 0.8;
/// Corrections of so many units in the last place of the positions may be rounding: they are where they no longer shrink.
const ULPS: f64 = 64.0;
/// Halvings of a step before the line search gives up: the direction is then useless to rounding.
const MAX_HALVINGS: u32 = 50;
/// A factor at hand is kept while each correction is at most this part of the one before.
const CONTRACTION: f64 = 0.25;
/// The relative residual that is asked of the first solve by conjugate gradients, and the largest afterwards.
const FORCING: [f64; 2] = [1e-2, 1e-1];
/// A solve need not be more accurate than this part of what the matrix at hand lets corrections shrink by.
const FORCING_PART: f64 = 0.3;
/// A full step so short, as a part of the size of the scene, may be near a minimum.
const NEAR: f64 = 1e-3;
/// What is added to the diagonal of projected Hessians in statics, as a part of the largest entry.
const STATIC_SHIFT: f64 = 1e-9;
/// In statics, a body so many sizes of the scene away from its last equilibrium is one that nothing holds.
const RUNAWAY: f64 = 1e3;

/// Minimises objectives of one system, keeping structure and factorisations between them.
pub(crate) struct Newton<const D: usize> {
    options: SolverOptions,
    assembler: Option<Assembler<D>>,
    cholesky: Option<Cholesky>,
    /// The weights of the matrix that `cholesky` last factorised, or that is at hand for conjugate gradients; none if it is projected.
    at_hand: Option<Weights>,
    iterative: Option<Iterative<D>>,
    /// Solves that are left to the factorisation because conjugate gradients stalled, and how many were at the last time:
    /// they are tried again after twice as many.
    direct: (u64, u64),
    /// Memory of the matrix-free solver.
    cg: ConjugateGradients,
    /// Size of the scene when the first objective was met [m].
    size: f64,
    residual: Vec<f64>,
    direction: Vec<f64>,
    trial: Iterate,
    /// Solutions of conjugate gradients.
    solution: Vec<f64>,
    /// Velocities, where something dissipates.
    velocity: Vec<f64>,
    /// Gradient of the terms that have no energy, at the last iterate; empty where there are none.
    follower: Vec<f64>,
    work: SolverWork,
}

/// What came of one linear solve.
enum Direction {
    /// A direction of descent, which solves the linear system.
    Descent,
    /// A direction of descent, and no more: the matrix is not positive definite.
    Truncated,
    /// The matrix is not positive definite.
    Indefinite,
    /// The solver failed otherwise.
    Failed,
}

impl<const D: usize> Newton<D> {
    pub(crate) fn new(options: SolverOptions) -> Self {
        Newton {
            options,
            assembler: None,
            cholesky: None,
            at_hand: None,
            iterative: None,
            direct: (0, 0),
            cg: ConjugateGradients::default(),
            size: 0.0,
            residual: vec![],
            direction: vec![],
            trial: Iterate::default(),
            solution: vec![],
            velocity: vec![],
            follower: vec![],
            work: SolverWork::default(),
        }
    }

    /// Makes the structure of the matrix, unless the one there is fits.
    fn prepare(&mut self, system: &mut System, x: &[f64]) {
        if self.size == 0.0 {
            self.size = scene_size(x, system.dimension());
        }
        let trial = &mut self.trial;
        for v in [&mut self.residual, &mut self.direction, &mut self.solution, &mut trial.x, &mut trial.u] {
            v.resize(x.len(), 0.0);
        }
        let matrix_free = self.options.linear == LinearSolver::MatrixFree;
        if !matrix_free && !self.assembler.as_ref().is_some_and(|a| a.fits(system)) {
            self.assembler = Some(Assembler::new(system));
            (self.cholesky, self.at_hand) = (None, None);
            self.iterative = None;
        }
        self.direct.0 = self.direct.0.saturating_sub(1);
    }

    /// Solves `A d = -residual` for the direction; by conjugate gradients to a relative residual of `forcing`.
    fn solve_linear(
        &mut self,
        system: &mut System,
        objective: &Objective<'_>,
        at: &Iterate,
        psd: Psd,
        (old_matrix, forcing): (bool, f64),
    ) -> Direction {
        let weights = weights(objective);
        let x = &at.x;
        let linear = self.options.linear.choose(system);
        if system.is_damped() {
            self.velocity_at(system, objective, at);
        }
        self.direction.iter_mut().zip(&self.residual).for_each(|(d, r)| *d = -r);
        if linear == LinearSolver::MatrixFree {
            return self.matrix_free(system, weights, x);
        }
        let by_iterations = linear != LinearSolver::Cholesky && self.direct.0 == 0;
        if let Some(cholesky) = self.cholesky.as_mut().filter(|_| old_matrix && !by_iterations) {
            cholesky.solve(&mut self.direction);
            return Direction::Descent;
        }
        let assembler = self.assembler.as_mut().expect("prepared");
        if !old_matrix {
            assembler.assemble(system, At { x, v: &self.velocity, psd }, weights);
            if objective.inertia == 0.0 && psd == Psd::Projected {
                // Projected Hessians may be singular, and nothing has inertia.
                assembler.shift(STATIC_SHIFT);
            }
            self.work.hessians += 1;
        }
        let matrix = assembler.matrix();
        self.at_hand = None;
        if by_iterations {
            if self.iterative.is_none() {
                self.iterative = match linear {
                    LinearSolver::Multigrid => {
                        // Where vertices are at the start may be anything; the lattices are for where they belong.
                        let rest = system.rest_positions().unwrap_or(x);
                        Iterative::multigrid(matrix, rest, assembler.held())
                    }
                    _ => Some(Iterative::jacobi()),
                };
            }
            let Some(iterative) = &mut self.iterative else { return Direction::Failed };
            let made_for = (weights, psd);
            let report = iterative.solve(matrix, made_for, &self.direction, &mut self.solution, forcing);
            self.work.cg_iterations += report.iterations;
            if report.end == CgEnd::Converged {
                self.at_hand = (psd == Psd::Exact).then_some(weights);
                std::mem::swap(&mut self.direction, &mut self.solution);
                return Direction::Descent;
            }
            // Before anything else the negative eigenvalues of elements are removed.
            if report.end == CgEnd::Indefinite && psd == Psd::Exact {
                return Direction::Indefinite;
            }
            // The rest of this solve, and the next ones.
            let pause = 2 * self.direct.1.max(1);
            self.direct = (pause, pause);
            self.work.fallbacks += 1;
        }
        if self.cholesky.is_none() {
            self.cholesky = Cholesky::new(matrix, x);
        }
        let Some(cholesky) = &mut self.cholesky else { return Direction::Failed };
        self.work.factorizations += 1;
        if cholesky.factorize(matrix).is_err() {
            return Direction::Indefinite;
        }
        // A projected matrix is too stiff somewhere: corrections by it that are small need not be near a minimum.
        self.at_hand = (psd == Psd::Exact).then_some(weights);
        cholesky.solve(&mut self.direction);
        Direction::Descent
    }

    /// Conjugate gradients by products of the exact Hessian, without a preconditioner.
    fn matrix_free(&mut self, system: &mut System, weights: Weights, x: &[f64]) -> Direction {
        let right = std::mem::take(&mut self.direction);
        let mut solution = std::mem::take(&mut self.solution);
        let held: Vec<bool> = system.inverse_mass().iter().map(|w| *w == 0.0).collect();
        let (velocity, mut damped) = (&self.velocity, vec![0.0; x.len()]);
        let product = |p: &[f64], q: &mut [f64]| {
            system.hessian_product(x, p, q);
            if system.is_damped() {
                system.damping_product(x, velocity, p, &mut damped);
                let factor = weights.damping / weights.stiffness;
                q.iter_mut().zip(&damped).for_each(|(q, c)| *q += factor * c);
            }
            let d = system.dimension();
            for i in 0..q.len() {
                q[i] = if held[i] {
                    p[i]
                } else {
                    weights.stiffness * q[i] + weights.inertia * system.mass()[i / d] * p[i]
                };
            }
        };
        let iterations = 10 * right.len() as u64 + 1000;
        let report =
            self.cg.solve::<D>(product, &mut Nothing, &right, &mut solution, CG_TOLERANCE, iterations);
        (self.direction, self.solution) = (solution, right);
        self.work.cg_iterations += report.iterations;
        match report.end {
            CgEnd::Converged => Direction::Descent,
            // There are no elements whose negative eigenvalues could be removed.
            CgEnd::Indefinite => Direction::Truncated,
            CgEnd::Stalled => Direction::Failed,
        }
    }

    /// Writes the gradient of the objective at `at`, zero at held coordinates; false where it is not finite. The system holds the
    /// force there afterwards.
    fn residual(&mut self, system: &mut System, objective: &Objective<'_>, at: &Iterate) -> bool {
        let finite = system.evaluate(&at.x).is_some();
        if system.is_damped() {
            self.velocity_at(system, objective, at);
            system.evaluate_dissipation(&at.x, &self.velocity);
        }
        self.follower.clear();
        for term in system.terms().iter().filter(|term| !term.is_conservative()) {
            self.follower.resize(at.x.len(), 0.0);
            term.add_rows(0, &mut self.follower);
        }
        system.accelerations(&mut self.residual);
        let (mass, weight, d) = (system.mass(), system.inverse_mass(), system.dimension());
        for (i, r) in self.residual.iter_mut().enumerate() {
            let inertia = objective.inertia * (at.u[i] - objective.target[i]);
            *r = if weight[i] == 0.0 { 0.0 } else { mass[i / d] * (inertia - objective.stiffness * *r) };
        }
        finite
    }

    /// Computes the velocities that belong to `at`; those of held coordinates are prescribed, and stay.
    fn velocity_at(&mut self, system: &System, objective: &Objective<'_>, at: &Iterate) {
        self.velocity.resize(at.u.len(), 0.0);
        let (held, super::Velocity { rate, drift, .. }) = (system.inverse_mass(), objective.velocity);
        for i in 0..at.u.len() {
            self.velocity[i] =
                if held[i] == 0.0 { objective.held_velocity[i] } else { rate * (at.u[i] - drift[i]) };
        }
    }

    /// The objective at `at`, seen from the iterate `last`: what dissipates does so there, and forces without energy are those there.
    fn value(&mut self, system: &mut System, objective: &Objective<'_>, last: &Iterate, at: &Iterate) -> f64 {
        let (mass, weight, d) = (system.mass(), system.inverse_mass(), system.dimension());
        let square = |i: usize| {
            let away = at.u[i] - objective.target[i];
            if weight[i] == 0.0 { 0.0 } else { mass[i / d] * away * away }
        };
        let inertia: f64 = if objective.inertia == 0.0 { 0.0 } else { (0..at.u.len()).map(square).sum() };
        let work = |(i, g): (usize, &f64)| if weight[i] == 0.0 { 0.0 } else { g * (at.u[i] - last.u[i]) };
        let work: f64 = self.follower.iter().enumerate().map(work).sum();
        self.work.energies += 1;
        let mut potential = system.potential_energy(&at.x) + work;
        if system.is_damped() {
            self.velocity_at(system, objective, at);
            // Dissipation functions are quadratic in the velocities: R is half the power.
            potential += 0.5 / objective.velocity.rate * system.dissipated_power(&last.x, &self.velocity);
        }
        0.5 * objective.inertia * inertia + objective.stiffness * potential
    }

    /// Makes `trial` the iterate a part of the direction away from `at`.
    fn go(&mut self, system: &System, objective: &Objective<'_>, at: &Iterate, step: f64) {
        let held = system.inverse_mass();
        for i in 0..at.u.len() {
            let u = at.u[i] + step * self.direction[i];
            self.trial.u[i] = u;
            self.trial.x[i] = if held[i] == 0.0 { at.x[i] } else { objective.velocity.origin[i] + u };
        }
    }

    /// Makes the residual that at the trial; whether it is finite.
    fn residual_at_trial(&mut self, system: &mut System, objective: &Objective<'_>) -> bool {
        let trial = std::mem::take(&mut self.trial);
        let finite = self.residual(system, objective, &trial);
        self.trial = trial;
        finite
    }
}

fn weights(objective: &Objective<'_>) -> Weights {
    Weights {
        inertia: objective.inertia,
        stiffness: objective.stiffness,
        damping: objective.stiffness * objective.velocity.rate,
    }
}

/// No preconditioner.
struct Nothing;

impl<const D: usize> Preconditioner<D> for Nothing {
    fn update(&mut self, _: &super::block_matrix::BlockMatrix<D>) -> Result<(), NotPositiveDefinite> {
        Ok(())
    }

    fn apply(&mut self, r: &[f64], z: &mut [f64]) {
        z.copy_from_slice(r);
    }

    fn bytes(&self) -> usize {
        0
    }
}

impl<const D: usize> super::Minimizer for Newton<D> {
    fn minimize(
        &mut self,
        system: &mut System,
        objective: &Objective<'_>,
        at: &mut Iterate,
    ) -> Result<(), StepFault> {
        self.prepare(system, &at.x);
        let reach = at.x.iter().chain(objective.target).fold(0.0, |m: f64, x| m.max(x.abs()));
        let (tolerance, floor) =
            (self.options.tolerance.unwrap_or(1e-9 * self.size), ULPS * f64::EPSILON * reach);
        let negligible = tolerance.max(floor);
        let fail = |system: &System, at: &Iterate, verdict, iterations, correction| {
            let solve = Some(SolveError { verdict, iterations, correction });
            Err(StepFault { solve, ..StepFault::at(system, &at.x, &at.x) })
        };
        if !self.residual(system, objective, at) {
            return fail(system, at, Verdict::Infeasible, 0, f64::INFINITY);
        }
        // With dissipation, or forces without energy, the objective is another one in every iteration.
        let changes = system.is_damped() || !self.follower.is_empty();
        let mut value = None;
        let mut psd = Psd::Exact;
        let mut correction = f64::INFINITY;
        // What a matrix costs beside a solve by conjugate gradients does not pay for an old one, but within one minimisation.
        let inexact = !objective.single_iteration && self.options.linear.choose(system).is_iterative();
        if inexact {
            self.at_hand = None;
        }
        // Whether Hessians were indefinite, or a step was shortened.
        let mut curved = false;
        let mut forcing = if inexact { FORCING[0] } else { CG_TOLERANCE };
        // The textbook's single iteration is one with the Hessian where it starts.
        let mut keep = !objective.single_iteration;
        for iteration in 0..self.options.max_iterations {
            if self.residual.iter().all(|r| *r == 0.0) {
                return Ok(());
            }
            let before = correction;
            // A factor at hand costs a solve, a new one twenty times that: it is kept as long as corrections shrink fast.
            let mut old_matrix = keep && self.at_hand == Some(weights(objective));
            // Whether the correction says nothing of how far a minimum is.
            let mut truncated;
            let slope = loop {
                let found = self.solve_linear(system, objective, at, psd, (old_matrix, forcing));
                truncated = matches!(found, Direction::Truncated);
                let slope = match found {
                    Direction::Truncated if objective.single_iteration => f64::NAN,
                    Direction::Descent | Direction::Truncated => dot(&self.direction, &self.residual),
                    Direction::Indefinite => f64::NAN,
                    Direction::Failed => {
                        return fail(system, at, Verdict::LinearSolver, iteration, correction);
                    }
                };
                correction = self.direction.iter().fold(0.0, |m: f64, d| m.max(d.abs()));
                if old_matrix && !(slope < 0.0 && correction <= CONTRACTION * before) {
                    old_matrix = false;
                    continue;
                }
                if slope < 0.0 {
                    break slope;
                }
                if slope == 0.0 && correction <= negligible && !truncated {
                    // So near that the product underflows.
                    return Ok(());
                }
                if psd == Psd::Projected || self.options.linear == LinearSolver::MatrixFree {
                    return fail(system, at, Verdict::Indefinite, iteration, correction);
                }
                // From here on to the end of this solve: a Hessian that was indefinite once will be again.
                psd = Psd::Projected;
            };
            self.work.newton_iterations += 1;
            if objective.inertia == 0.0 {
                let away = at.u.iter().zip(system.inverse_mass());
                let away = away.fold(0.0, |m: f64, (u, w)| if *w == 0.0 { m } else { m.max(u.abs()) });
                if away > RUNAWAY * self.size {
                    return fail(system, at, Verdict::Indefinite, iteration, correction);
                }
            }
            if objective.single_iteration {
                self.go(system, objective, at, 1.0);
                std::mem::swap(at, &mut self.trial);
                return Ok(());
            }
            let start = match value {
                Some(value) if !changes => value,
                _ => self.value(system, objective, at, at),
            };
            let mut step = system.max_step(&at.x, &self.direction);
            let mut halvings = 0;
            // Whether the residual is that of the trial already, and finite.
            let mut evaluated = None;
            let accepted = loop {
                self.go(system, objective, at, step);
                let trial = std::mem::take(&mut self.trial);
                let there = self.value(system, objective, at, &trial);
                self.trial = trial;
                if there <= start + ARMIJO * step * slope {
                    break Some(there);
                }
                // A decrease that drowns in the rounding of the objective shows in its slope.
                let drowns = (there - start).abs() <= ROUNDING * (start.abs() + there.abs())
                    || there.is_finite() && step * correction <= DROWNED * self.size;
                if drowns {
                    let finite = self.residual_at_trial(system, objective);
                    let end = dot(&self.direction, &self.residual);
                    // Downhill at the end is as good: the way to a saddle gets steeper.
                    if finite && (end <= FLATTER * slope.abs() || correction <= negligible) {
                        evaluated = Some(finite);
                        break Some(there);
                    }
                    // The way on, or back, is from the iterate.
                    self.residual(system, objective, at);
                }
                if halvings == MAX_HALVINGS {
                    break None;
                }
                halvings += 1;
                step *= 0.5;
            };
            let Some(there) = accepted else {
                if correction <= negligible && !truncated {
                    if forcing <= CG_TOLERANCE {
                        return Ok(());
                    }
                    forcing = CG_TOLERANCE;
                }
                if old_matrix {
                    keep = false;
                    continue;
                }
                if psd == Psd::Exact {
                    psd = Psd::Projected;
                    continue;
                }
                return fail(system, at, Verdict::Stalled, iteration, correction);
            };
            self.work.halvings += u64::from(halvings);
            keep = halvings == 0;
            if keep && correction <= NEAR * self.size {
                // Near a minimum the exact Hessian is positive definite, and converges quadratically.
                psd = Psd::Exact;
            }
            value = Some(there);
            let finite = evaluated.unwrap_or_else(|| self.residual_at_trial(system, objective));
            std::mem::swap(at, &mut self.trial);
            if !finite {
                return fail(system, at, Verdict::Infeasible, iteration, correction);
            }
            // The first correction by a factor of an earlier solve says little about the next.
            let known = (iteration > 0 || !old_matrix) && !truncated;
            let rounding = correction <= floor && correction >= 0.5 * before;
            // A solve with a large residual may leave a small correction where the matrix is ill conditioned: the last one is accurate.
            if (correction <= tolerance || rounding) && known && forcing <= CG_TOLERANCE {
                return Ok(());
            }
            if inexact {
                // Corrections shrink by what solves leave, or by how much the matrix has changed: the former need not be much less.
                // Negative curvature, though, shows only in solves that are accurate.
                curved |= psd == Psd::Projected || truncated || !keep;
                let shrink = if before.is_finite() { correction / before } else { FORCING[0] };
                let last = correction * shrink.min(1.0) <= negligible;
                forcing = if curved || last {
                    CG_TOLERANCE
                } else {
                    (FORCING_PART * shrink).clamp(CG_TOLERANCE, FORCING[1])
                };
            }
        }
        fail(system, at, Verdict::IterationCap, self.options.max_iterations, correction)
    }

    fn objective(&mut self, system: &mut System, objective: &Objective<'_>, at: &Iterate) -> f64 {
        self.follower.clear();
        self.value(system, objective, at, at)
    }

    fn solve_last(&mut self, right: &mut [f64]) -> bool {
        // Conjugate gradients keep no factor, and one of a projected matrix is none of the Jacobian.
        if self.at_hand.is_none() || self.iterative.is_some() {
            return false;
        }
        let Some(cholesky) = &mut self.cholesky else { return false };
        cholesky.solve(right);
        true
    }

    fn work(&self) -> SolverWork {
        self.work
    }

    fn bytes(&self) -> usize {
        let vectors = [&self.residual, &self.direction, &self.solution, &self.velocity, &self.follower];
        8 * vectors.iter().map(|v| v.len()).sum::<usize>()
            + self.trial.bytes()
            + self.assembler.as_ref().map_or(0, Assembler::bytes)
            + self.cholesky.as_ref().map_or(0, Cholesky::bytes)
            + self.iterative.as_ref().map_or(0, Iterative::bytes)
            + self.cg.bytes()
    }
}
