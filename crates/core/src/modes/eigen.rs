//! Eigenproblem `K phi = omega^2 M phi` of a simulation at its current state.

use super::inertia::Inertia;
use super::lanczos::Lanczos;
use super::{ModesError, dense, lanczos};
use crate::material::Psd;
use crate::simulation::Simulation;
use crate::solver::block_matrix::BlockMatrix;
use crate::solver::cholesky::Cholesky;
use crate::solver::hessian::{Assembler, At, Weights};
use crate::system::System;

/// First shift, as a fraction of the mean of `K_ii / M_ii`: below any frequency that rounding leaves,
/// because a shift far above the lowest frequencies cannot separate them. The second shift is the first
/// positive `omega^2` found: with one far below, rounding in the large eigenvalues of rigid motion would
/// dominate the others.
const FIRST_SHIFT: f64 = 1e-11;
/// Growth factor of the first shift, and its limit, if rounding makes the factorisation fail.
const RAISE: f64 = 100.0;
const LAST_SHIFT: f64 = 1e-3;
/// Relative residuals with the first shift, which locates the frequencies, and with the second.
const TOLERANCES: [f64; 2] = [1e-3, 1e-10];
/// Eigenvalues closer than this relative distance, or than this many residual bounds, count as one when
/// modes are counted.
const APART: f64 = 1e-6;
const APART_RESIDUALS: f64 = 16.0;
/// Allowed residual of an eigenvalue `theta` of `(K + s M)^-1 M`, in roundings of
/// `theta max K_ii / M_ii`.
const RESIDUAL_ULPS: f64 = 16.0;
/// Largest `omega^2` of rigid motion, in roundings of the terms of its sum.
const RIGID_ULPS: f64 = 64.0;
/// Weights of the stiffness alone.
const STIFFNESS: Weights = Weights { inertia: 0.0, stiffness: 1.0, damping: 0.0 };

/// Some or all modes, in simulation numbering.
pub struct Eigen<const D: usize> {
    pub(super) assembler: Assembler<D>,
    /// Positions of the linearisation, flat [m].
    pub(super) x: Vec<f64>,
    /// Lumped mass of each coordinate [kg]; zero if it is constrained.
    pub(super) mass: Vec<f64>,
    /// Mass matrix of the problem.
    pub(super) inertia: Inertia<D>,
    /// Pairs of `omega^2` and shape, ascending; exactly zero for rigid motion.
    pub(super) pairs: Vec<(f64, lanczos::EigenPair)>,
    pub(super) free_coordinates: usize,
    pub(super) solves: usize,
}

impl<const D: usize> Eigen<D> {
    /// Computes the `count` lowest modes, or all, with lumped masses.
    ///
    /// # Errors
    /// [`ModesError`] if the modes do not exist or cannot be found.
    pub fn about(simulation: &mut Simulation, count: Option<usize>) -> Result<Self, ModesError> {
        let inertia = Inertia::lumped(simulation.system());
        Self::with(inertia, simulation, count)
    }

    /// Computes the `count` lowest modes, with consistent masses where possible.
    pub(super) fn lowest_about(simulation: &mut Simulation, count: usize) -> Result<Self, ModesError> {
        let inertia = Inertia::consistent(simulation.system());
        Self::with(inertia, simulation, Some(count))
    }

    fn with(
        inertia: Inertia<D>,
        simulation: &mut Simulation,
        count: Option<usize>,
    ) -> Result<Self, ModesError> {
        let x = simulation.state().x().to_vec();
        let system = simulation.system_mut();
        if system.terms().iter().any(|term| term.properties().couples_all) {
            return Err(ModesError::Attraction);
        }
        let free: Vec<bool> = system.inverse_mass().iter().map(|w| *w > 0.0).collect();
        let free_coordinates = free.iter().filter(|free| **free).count();
        let asked = count.unwrap_or(free_coordinates);
        if asked > free_coordinates || free_coordinates == 0 {
            return Err(ModesError::TooMany { asked, free: free_coordinates });
        }
        // Assemble the stiffness; its scale per mass sets the shifts.
        let mass = inertia.diagonal().to_vec();
        system.find_stencils(&x);
        let assembler = Assembler::<D>::new(system);
        let mut eigen = Eigen { assembler, x, mass, inertia, pairs: vec![], free_coordinates, solves: 0 };
        eigen.assemble(system, STIFFNESS);
        let matrix = eigen.assembler.matrix();
        let diagonal = |n: usize| matrix.value[matrix.diagonal[n / D] as usize][n % D][n % D];
        let ratios = || (0..free.len()).filter(|n| free[*n]).map(|n| diagonal(n) / eigen.mass[n]);
        let (mean, largest) = (ratios().sum::<f64>() / free_coordinates as f64, ratios().fold(0.0, f64::max));
        if !mean.is_finite() {
            return Err(ModesError::NotFinite);
        }
        if mean <= 0.0 {
            return Err(ModesError::NoStiffness);
        }
        if system.is_stopped() {
            return Err(ModesError::Stopped);
        }
        // A few modes by Lanczos, all by the dense solver.
        if count.is_some() {
            eigen.lowest(system, asked, mean, largest)?;
        } else if free_coordinates > dense::MOST {
            return Err(ModesError::TooManyForAll { free: free_coordinates, most: dense::MOST });
        } else {
            let found = dense::all(matrix, &eigen.mass);
            eigen.pairs = found.ok_or(ModesError::NotConverged { found: 0, asked, solves: 0 })?;
            eigen.pairs.truncate(asked);
        }
        if eigen.pairs.iter().any(|(square, _)| *square < 0.0) {
            return Err(ModesError::NotStable);
        }
        Ok(eigen)
    }

    /// Shift-and-invert with two shifts; `mean` and `largest` are those of `K_ii / M_ii`.
    fn lowest(&mut self, system: &System, count: usize, mean: f64, largest: f64) -> Result<(), ModesError> {
        // First shift: locate the lowest positive frequency.
        let mut shift = FIRST_SHIFT * mean;
        let cholesky = loop {
            match self.shifted(system, shift) {
                Err(ModesError::NotStable) if shift < LAST_SHIFT * mean => shift *= RAISE,
                factor => break factor?,
            }
        };
        let bound = |tolerance| Bound { tolerance, rounding: RESIDUAL_ULPS * f64::EPSILON * largest };
        let mut by = Transformation { shift, cholesky, bound: bound(TOLERANCES[0]), largest };
        let mut search = Lanczos::new(&self.inertia, count, system.stop());
        self.pairs = self.converged(&mut search, &mut by)?;
        self.solves += search.solves();
        let Some((first, _)) = self.pairs.iter().find(|(square, _)| *square > 0.0) else {
            // Only rigid motion was requested.
            return Ok(());
        };
        // Second shift: accurate modes, until none is missing.
        let shift = *first;
        by = Transformation {
            shift,
            cholesky: self.shifted(system, shift)?,
            bound: bound(TOLERANCES[1]),
            largest,
        };
        let mut search = Lanczos::new(&self.inertia, count, system.stop());
        loop {
            self.pairs = self.converged(&mut search, &mut by)?;
            let missing = self.missing(&by)?;
            if missing == 0 {
                break;
            }
            if search.is_exhausted() {
                let (found, solves) = (count.saturating_sub(missing), self.solves + search.solves());
                return Err(ModesError::NotConverged { found, asked: count, solves });
            }
        }
        self.solves += search.solves();
        Ok(())
    }

    /// Returns the modes to which the iteration converges, ascending. The assembled matrix must be the
    /// stiffness.
    fn converged(
        &self,
        search: &mut Lanczos<'_, D>,
        by: &mut Transformation,
    ) -> Result<Vec<(f64, lanczos::EigenPair)>, ModesError> {
        let bound = by.bound;
        let found = search.run(|theta| bound.at(theta), |b| by.cholesky.solve(b));
        let found = found.ok_or(ModesError::Stopped)?;
        if found.len() < search.count() {
            let (found, solves) = (found.len(), self.solves + search.solves());
            return Err(ModesError::NotConverged { found, asked: search.count(), solves });
        }
        let matrix = self.assembler.matrix();
        let with_square = |pair: lanczos::EigenPair| (square(matrix, &pair.vector, by.largest), pair);
        let mut pairs: Vec<_> = found.into_iter().map(with_square).collect();
        pairs.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        Ok(pairs)
    }

    /// Counts the modes below the highest one found, or below its cluster, that were not found.
    ///
    /// By Sylvester's law of inertia, `K - sigma M` has as many negative eigenvalues as there are modes
    /// below `sigma`. Grimes, Lewis, Simon 1994, "A shifted block Lanczos algorithm for solving sparse
    /// symmetric generalized eigenproblems", section 4. The assembled matrix must be the stiffness.
    fn missing(&self, by: &Transformation) -> Result<usize, ModesError> {
        let squares: Vec<f64> = self.pairs.iter().map(|(square, _)| *square).collect();
        let is_apart = |n: usize| squares[n] - squares[n - 1] > 2.0 * by.apart(squares[n]);
        let found = (1..squares.len()).rev().find(|n| is_apart(*n)).unwrap_or(0);
        if squares[found] <= 0.0 {
            // No mode is lower than rigid motion.
            return Ok(0);
        }
        let matrix = self.shifted_matrix(by.apart(squares[found]) - squares[found]);
        let below = by.cholesky.negative_eigenvalues(&matrix).ok_or(ModesError::NotFinite)?;
        Ok(below.saturating_sub(found))
    }

    /// Returns `omega^2` [1/s^2] of the modes, ascending; exactly zero for rigid motion.
    pub fn squares(&self) -> impl Iterator<Item = f64> {
        self.pairs.iter().map(|(square, _)| *square)
    }

    /// Returns the positions of the linearisation, flat [m].
    pub fn positions(&self) -> &[f64] {
        &self.x
    }

    /// Returns `K + shift M` [N/m] for the stiffness last assembled.
    pub fn shifted_matrix(&self, shift: f64) -> BlockMatrix<D> {
        let mut matrix = self.assembler.matrix().clone();
        self.inertia.add_to(shift, &mut matrix);
        matrix
    }

    /// Factorises `K + shift M`.
    pub(super) fn shifted(&mut self, system: &System, shift: f64) -> Result<Cholesky, ModesError> {
        if system.is_stopped() {
            return Err(ModesError::Stopped);
        }
        self.assemble(system, STIFFNESS);
        let matrix = self.shifted_matrix(shift);
        let mut cholesky = Cholesky::new(&matrix, &self.x).ok_or(ModesError::NotFinite)?;
        cholesky.factorize(&matrix).map_err(|_| ModesError::NotStable)?;
        Ok(cholesky)
    }

    /// Assembles with these weights; damping at rest.
    pub(super) fn assemble(&mut self, system: &System, weights: Weights) {
        let at = At { x: &self.x, v: &self.x, psd: Psd::Exact, predicted_from: None };
        self.assembler.assemble(system, at, weights);
    }

    /// Returns the damping of each mode, `phi_j . C phi_j` plus drag [1/s], and the coupling of modes:
    /// the largest `|phi_i . C phi_j|` relative to the damping of both alone.
    pub(super) fn damping(&mut self, system: &System) -> (Vec<f64>, f64) {
        let modes = self.pairs.len();
        let drag = system.ether_drag();
        if !system.is_damped() {
            return (vec![drag; modes], 0.0);
        }
        self.assemble(system, Weights { inertia: 0.0, stiffness: 0.0, damping: 1.0 });
        let mut image = vec![0.0; self.x.len()];
        let mut matrix = vec![0.0; modes * modes];
        for (j, (_, pair)) in self.pairs.iter().enumerate() {
            self.assembler.matrix().multiply(&pair.vector, &mut image);
            for (i, (_, other)) in self.pairs.iter().enumerate() {
                matrix[i * modes + j] = product(&other.vector, &image);
            }
        }
        // Coupling relative to the damping of both modes.
        let alone = |j: usize| matrix[j * modes + j];
        // Damping that is rounding compared with the strongest is ignored.
        let floor = (0..modes).fold(0.0, |m: f64, j| m.max(alone(j))) * 1e-6;
        let mut coupling = 0.0f64;
        for i in 0..modes {
            for j in 0..i {
                let both = (alone(i).max(floor) * alone(j).max(floor)).sqrt();
                if both > 0.0 {
                    coupling = coupling.max(matrix[i * modes + j].abs() / both);
                }
            }
        }
        ((0..modes).map(|j| alone(j).max(0.0) + drag).collect(), coupling)
    }
}

/// Shift-and-invert transformation: `K phi = omega^2 M phi` as `theta phi = (K + shift M)^-1 M phi`,
/// `theta = 1 / (omega^2 + shift)`.
struct Transformation {
    shift: f64,
    /// Factor of `K + shift M`.
    cholesky: Cholesky,
    /// Residual bound.
    bound: Bound,
    /// Largest `K_ii / M_ii`.
    largest: f64,
}

impl Transformation {
    /// Distance from `omega^2` within which eigenvalues count as equal.
    fn apart(&self, square: f64) -> f64 {
        let theta = 1.0 / (square + self.shift);
        APART.max(APART_RESIDUALS * self.bound.at(theta)).min(0.25) / theta
    }
}

/// Relative residual bound of an eigenvalue `theta`.
#[derive(Clone, Copy)]
struct Bound {
    tolerance: f64,
    /// Rounding at `theta = 1`.
    rounding: f64,
}

impl Bound {
    fn at(self, theta: f64) -> f64 {
        self.tolerance.max(self.rounding * theta)
    }
}

/// Rayleigh quotient `phi^T K phi` of a shape with `phi^T M phi = 1`. Exactly zero if it is rounding of
/// motion without stiffness: of the terms of the sum, or, since the shape itself is accurate to rounding,
/// of its square times the `largest` eigenvalue.
pub(super) fn square<const D: usize>(matrix: &BlockMatrix<D>, shape: &[f64], largest: f64) -> f64 {
    let (mut square, mut scale) = (0.0, 0.0);
    for row in 0..matrix.rows() {
        for k in 0..D {
            let parts = matrix
                .row(row)
                .flat_map(|(column, block)| (0..D).map(move |l| (block[k][l], column * D + l)));
            let (mut sum, mut sizes) = (0.0, 0.0);
            for (entry, at) in parts {
                sum += entry * shape[at];
                sizes += (entry * shape[at]).abs();
            }
            square += shape[row * D + k] * sum;
            scale += shape[row * D + k].abs() * sizes;
        }
    }
    let rounding = RIGID_ULPS * f64::EPSILON;
    if square.abs() <= rounding * scale + rounding * rounding * largest { 0.0 } else { square }
}

pub(super) fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
