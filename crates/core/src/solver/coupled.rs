//! Newton's method for the stages of fully implicit Runge-Kutta methods, solved together with sparse LU.

#[cfg(test)]
mod tests;

use super::StepFault;
use super::hessian::{At, Weights};
use super::stages::StageMatrix;
use super::{SolveError, SolveFailure, SolverOptions, SolverWork, scene_size};
use crate::energy::Fault;
use crate::material::Psd;
use crate::system::System;

/// Halvings of a step before the solve fails.
const MAX_HALVINGS: u32 = 10;
/// Corrections below this fraction of the scene size are rounding if they no longer shrink.
const ROUNDING: f64 = 2e-14;
/// The same limit with a factor of the current iterate.
const STAGNATION: f64 = 1e-10;
/// A reused factor is kept while each correction is at most this fraction of the last.
const CONTRACTION: f64 = 0.25;

/// Equations of all stages with `B = A^-1`: `M sum_j ((B^2)_ij + h c B_ij) Z_j - h (B 1)_i M v_n + h^2
/// (dE/dx + dR/dv)(X_i, V_i, t_i) = 0`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StageSystem<'a> {
    /// `A^-1`, by rows.
    pub(crate) inverse: &'a [Vec<f64>],
    /// Times of the stages [s].
    pub(crate) times: &'a [f64],
    /// Step size [s].
    pub(crate) h: f64,
    /// Positions at the start of the step, flat [m].
    pub(crate) x: &'a [f64],
    /// Velocities at the start of the step, flat [m/s].
    pub(crate) v: &'a [f64],
}

impl StageSystem<'_> {
    fn count(&self) -> usize {
        self.times.len()
    }

    /// `(B^2)_ij`.
    fn square(&self, i: usize, j: usize) -> f64 {
        (0..self.count()).map(|k| self.inverse[i][k] * self.inverse[k][j]).sum()
    }

    /// `(B 1)_i`.
    fn row_sum(&self, i: usize) -> f64 {
        self.inverse[i].iter().sum()
    }
}

/// Solves [`StageSystem`]s of one system; keeps structures and factorisations between them.
pub(crate) trait CoupledNewton: Send + Sync {
    /// Solves for `z = X - x_n` from the given start, and writes the stage velocities to `v`. Constrained
    /// coordinates of both are unchanged. The unknowns are increments, so that velocities are not
    /// quotients of rounded positions.
    fn solve(
        &mut self,
        system: &mut System,
        stages: &StageSystem<'_>,
        z: &mut [Vec<f64>],
        v: &mut [Vec<f64>],
    ) -> Result<(), StepFault>;

    /// Returns the work so far.
    fn work(&self) -> SolverWork;

    /// Predicts the bytes of memory, with the factors, after solving `stages` stages of `system` near `x`,
    /// flat [m].
    fn predicted_bytes(&self, system: &mut System, stages: usize, x: &[f64]) -> usize;
}

/// Creates a solver for systems of `dimension` coordinates per vertex.
pub(crate) fn coupled_newton(dimension: usize, options: SolverOptions) -> Box<dyn CoupledNewton> {
    match dimension {
        1 => Box::new(Coupled::<1>::new(options)),
        2 => Box::new(Coupled::<2>::new(options)),
        _ => Box::new(Coupled::<3>::new(options)),
    }
}

struct Coupled<const D: usize> {
    options: SolverOptions,
    size: f64,
    matrix: Option<StageMatrix<D>>,
    /// Step size of its factors [s]; `None` without factors.
    factorized: Option<f64>,
    residual: Vec<Vec<f64>>,
    force: Vec<f64>,
    positions: Vec<f64>,
    trial: Vec<Vec<f64>>,
    trial_v: Vec<Vec<f64>>,
    work: SolverWork,
}

impl<const D: usize> Coupled<D> {
    fn new(options: SolverOptions) -> Self {
        Coupled {
            options,
            size: 0.0,
            matrix: None,
            factorized: None,
            residual: vec![],
            force: vec![],
            positions: vec![],
            trial: vec![],
            trial_v: vec![],
            work: SolverWork::none(&options),
        }
    }

    /// Computes the stage velocities of free coordinates.
    fn velocities(system: &System, stages: &StageSystem<'_>, z: &[Vec<f64>], v: &mut [Vec<f64>]) {
        let weight = system.inverse_mass();
        for (i, v) in v.iter_mut().enumerate() {
            for (n, v) in v.iter_mut().enumerate().filter(|(n, _)| weight[*n] > 0.0) {
                let sum: f64 = (0..stages.count()).map(|j| stages.inverse[i][j] * z[j][n]).sum();
                *v = sum / stages.h;
            }
        }
    }

    /// Shortens starts to the collision-free part of the straight path from the old positions, as seen by
    /// terms that limit steps.
    ///
    /// # Errors
    /// If prescribed motion alone leads to interpenetration.
    fn shorten(system: &System, stages: &StageSystem<'_>, z: &mut [Vec<f64>]) -> Result<(), StepFault> {
        let is_held: Vec<bool> = system.inverse_mass().iter().map(|w| *w == 0.0).collect();
        for z in z {
            let held: Vec<f64> =
                z.iter().zip(&is_held).map(|(z, held)| if *held { *z } else { 0.0 }).collect();
            if let Some((_, term)) = system.shortened_way(stages.x, &held) {
                let fault = Some(Fault::Way { term });
                return Err(StepFault { fault, vertex: None, solve: None });
            }
            let Some((part, _)) = system.shortened_way(stages.x, z) else { continue };
            z.iter_mut().zip(&is_held).filter(|(_, held)| !**held).for_each(|(z, _)| *z *= part);
        }
        Ok(())
    }

    /// Returns the fraction of a direction that terms which limit steps admit in all stages.
    fn admitted(
        &mut self,
        system: &System,
        stages: &StageSystem<'_>,
        z: &[Vec<f64>],
        direction: &[Vec<f64>],
    ) -> f64 {
        let mut admitted = 1.0_f64;
        for i in (0..stages.count()).filter(|_| system.has_guards()) {
            self.positions(stages, z, i);
            let part = system.shortened_way(&self.positions, &direction[i]);
            admitted = admitted.min(part.map_or(1.0, |(part, _)| part));
        }
        admitted
    }

    /// Computes the positions of stage `i`.
    fn positions(&mut self, stages: &StageSystem<'_>, z: &[Vec<f64>], i: usize) {
        self.positions.clear();
        self.positions.extend(stages.x.iter().zip(&z[i]).map(|(x, z)| x + z));
    }

    /// Computes the residual of all stages, divided by the masses, and returns its norm; infinite if a
    /// force is not finite.
    fn residual(
        &mut self,
        system: &mut System,
        stages: &StageSystem<'_>,
        z: &[Vec<f64>],
        v: &[Vec<f64>],
    ) -> f64 {
        let (s, h, drag) = (stages.count(), stages.h, system.ether_drag());
        let mut square = 0.0;
        for i in 0..s {
            self.positions(stages, z, i);
            system.set_time(stages.times[i]);
            if system.evaluate(&self.positions).is_none() {
                return f64::INFINITY;
            }
            system.evaluate_dissipation(&self.positions, &v[i]);
            system.accelerations(&mut self.force);
            let weight = system.inverse_mass();
            for n in 0..self.force.len() {
                let mut r = -h * stages.row_sum(i) * stages.v[n] - h * h * self.force[n];
                for j in 0..s {
                    r += (stages.square(i, j) + h * drag * stages.inverse[i][j]) * z[j][n];
                }
                let r = if weight[n] == 0.0 { 0.0 } else { r };
                self.residual[i][n] = r;
                square += r * r * system.mass()[n / D];
            }
        }
        if square.is_finite() { square.sqrt() } else { f64::INFINITY }
    }

    /// Assembles and factorises at these stages; returns false if the matrix is singular, or if its factors
    /// would not fit memory.
    fn factorize(
        &mut self,
        system: &mut System,
        stages: &StageSystem<'_>,
        z: &[Vec<f64>],
        v: &[Vec<f64>],
    ) -> bool {
        let (s, h, drag) = (stages.count(), stages.h, system.ether_drag());
        self.factorized = None;
        let Some(matrix) = self.matrix.take() else { return false };
        // Make room for the stencils of all stages.
        let moved = |z: &Vec<f64>| stages.x.iter().zip(z).map(|(x, z)| x + z).collect();
        let places: Vec<Vec<f64>> = z.iter().map(moved).collect();
        let pattern = matrix.pattern();
        let Some(mut matrix) = matrix.including(system, &places, stages.x) else { return false };
        self.work.analyses += u64::from(matrix.pattern() != pattern);
        // Stiffness of each stage; damping couples the stages.
        matrix.clear();
        for i in 0..s {
            system.set_time(stages.times[i]);
            system.find_stencils(&places[i]);
            let at = At { x: &places[i], v: &v[i], psd: Psd::Exact, predicted_from: None };
            let stiffness = Weights { inertia: 0.0, stiffness: h * h, damping: 0.0 };
            matrix.add(system, at, stiffness, |row, column| (row == i && column == i).then_some(1.0));
            if system.is_damped() {
                let damping = Weights { inertia: 0.0, stiffness: 0.0, damping: h };
                let factor = |row: usize, column: usize| (row == i).then(|| stages.inverse[i][column]);
                matrix.add(system, at, damping, factor);
            }
        }
        matrix.add_masses(system, |i, j| stages.square(i, j) + h * drag * stages.inverse[i][j]);
        self.work.hessians += s as u64;
        self.work.factorizations += 1;
        let is_regular = matrix.factorize();
        self.factorized = is_regular.then_some(h);
        self.matrix = Some(matrix);
        is_regular
    }

    /// Replaces the current residual by its correction; returns the largest component, NaN without factors.
    fn correction(&mut self, system: &System) -> f64 {
        let Some(matrix) = self.matrix.as_mut().filter(|_| self.factorized.is_some()) else {
            return f64::NAN;
        };
        for residual in &mut self.residual {
            residual.iter_mut().enumerate().for_each(|(n, r)| *r *= -system.mass()[n / D]);
        }
        matrix.solve(&mut self.residual);
        let corrections = self.residual.iter().flatten();
        corrections.fold(0.0, |m: f64, d| if d.is_nan() { *d } else { m.max(d.abs()) })
    }

    /// True if the simplified correction, by the current factor for the current residual, is shorter than
    /// the last correction, of which `step` was taken. A step across a stiff spring stretches it to
    /// second order, so that its residual grows while the solution comes nearer. Natural monotonicity
    /// test: Deuflhard 2004, *Newton Methods for Nonlinear Problems*, section 3.3.
    fn falls_naturally(&mut self, system: &System, step: f64, last: f64) -> bool {
        let residual = self.residual.clone();
        let correction = self.correction(system);
        self.residual = residual;
        correction < (1.0 - 0.25 * step) * last
    }
}

impl<const D: usize> CoupledNewton for Coupled<D> {
    fn solve(
        &mut self,
        system: &mut System,
        stages: &StageSystem<'_>,
        z: &mut [Vec<f64>],
        v: &mut [Vec<f64>],
    ) -> Result<(), StepFault> {
        let (s, unknowns) = (stages.count(), stages.x.len());
        if self.size == 0.0 {
            self.size = self.options.size.unwrap_or_else(|| scene_size(stages.x, D));
        }
        // Resize scratch memory, and rebuild the structure if the system has changed.
        self.force.resize(unknowns, 0.0);
        for rows in [&mut self.residual, &mut self.trial, &mut self.trial_v] {
            rows.resize(s, vec![]);
            rows.iter_mut().for_each(|row| row.resize(unknowns, 0.0));
        }
        if !self.matrix.as_ref().is_some_and(|matrix| matrix.fits(system)) {
            let is_damped = system.is_damped();
            (self.matrix, self.factorized) = (StageMatrix::new(system, s, is_damped, stages.x), None);
        }
        let tolerance = self.options.tolerance.unwrap_or(1e-13 * self.size);
        let fail = |system: &System, x: &[f64], v: &[f64], verdict, iterations, correction| {
            let solve = Some(SolveError { verdict, iterations, correction, left: None });
            Err(StepFault { solve, ..StepFault::at(system, x, v) })
        };
        // Admissible start, its velocities and its residual.
        if system.has_guards() {
            Self::shorten(system, stages, z)?;
        }
        Self::velocities(system, stages, z, v);
        let mut norm = self.residual(system, stages, z, v);
        if norm == f64::INFINITY {
            return fail(system, &self.positions, &v[0], SolveFailure::Infeasible, 0, norm);
        }
        let (mut keep, mut before) = (true, f64::INFINITY);
        'newton: for iteration in 0..self.options.max_iterations {
            if norm == 0.0 {
                return Ok(());
            }
            if system.is_stopped() {
                return fail(system, &self.positions, &v[0], SolveFailure::Stopped, iteration, before);
            }
            let mut old_factor = keep && self.factorized == Some(stages.h);
            let residual = self.residual.clone();
            // Correction, with a reused factor while corrections shrink fast.
            let correction = loop {
                if !old_factor && !self.factorize(system, stages, z, v) {
                    return fail(system, &self.positions, &v[0], SolveFailure::Indefinite, iteration, before);
                }
                let correction = self.correction(system);
                let slow = correction.is_nan()
                    || correction > CONTRACTION * before && correction > ROUNDING * self.size;
                if old_factor && slow {
                    old_factor = false;
                    self.residual.clone_from(&residual);
                    continue;
                }
                break correction;
            };
            if !correction.is_finite() {
                return fail(system, &self.positions, &v[0], SolveFailure::Indefinite, iteration, correction);
            }
            self.work.newton_iterations += 1;
            // Line search: halve the step until the residual or the simplified correction shrinks.
            let direction = self.residual.clone();
            let (mut step, mut halvings) = (self.admitted(system, stages, z, &direction), 0);
            let there = loop {
                let (mut trial, mut trial_v) =
                    (std::mem::take(&mut self.trial), std::mem::take(&mut self.trial_v));
                for i in 0..s {
                    trial_v[i].copy_from_slice(&v[i]);
                    for n in 0..unknowns {
                        trial[i][n] = z[i][n] + step * direction[i][n];
                    }
                }
                Self::velocities(system, stages, &trial, &mut trial_v);
                let there = self.residual(system, stages, &trial, &trial_v);
                (self.trial, self.trial_v) = (trial, trial_v);
                // Near the solution the residual is rounding and need not fall.
                if there < norm || there.is_finite() && correction <= tolerance.max(STAGNATION * self.size) {
                    break there;
                }
                if there.is_finite() && self.falls_naturally(system, step, correction) {
                    break there;
                }
                if halvings == MAX_HALVINGS && old_factor {
                    // A factor of another iterate may point anywhere.
                    self.residual.clone_from(&residual);
                    keep = false;
                    continue 'newton;
                }
                if halvings == MAX_HALVINGS {
                    return fail(
                        system,
                        &self.positions,
                        &v[0],
                        SolveFailure::Stalled,
                        iteration,
                        correction,
                    );
                }
                halvings += 1;
                step *= 0.5;
            };
            // Accept the step and check convergence.
            self.work.halvings += u64::from(halvings);
            let is_whole = step == 1.0;
            for i in 0..s {
                z[i].copy_from_slice(&self.trial[i]);
                v[i].copy_from_slice(&self.trial_v[i]);
            }
            let last = before;
            (norm, keep, before) = (there, halvings == 0, correction);
            // Rounding: with a factor of the current iterate, corrections would shrink fast if any error
            // were left.
            let small = correction <= if old_factor { ROUNDING } else { STAGNATION } * self.size;
            let floor = small && correction >= 0.5 * last;
            if is_whole && (correction <= tolerance && (iteration > 0 || !old_factor) || floor) {
                let free = |n: &usize| system.inverse_mass()[n % stages.x.len()] > 0.0;
                let increments = z.iter().flatten().enumerate().filter(|(n, _)| free(n)).map(|(_, z)| *z);
                self.work.note_loose(correction, increments, self.size);
                return Ok(());
            }
        }
        fail(system, &self.positions, &v[0], SolveFailure::IterationCap, self.options.max_iterations, before)
    }

    fn work(&self) -> SolverWork {
        self.work
    }

    fn predicted_bytes(&self, system: &mut System, stages: usize, x: &[f64]) -> usize {
        let is_damped = system.is_damped();
        let Some(matrix) = StageMatrix::<D>::new(system, stages, is_damped, x) else { return usize::MAX / 2 };
        // Residual, trial and its velocities of all stages, their right-hand side, and force and
        // positions of one stage.
        let vectors = 8 * x.len() * (6 * stages + 2);
        matrix.predicted_bytes() + vectors
    }
}
