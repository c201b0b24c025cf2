//! The eigenproblem `K phi = omega^2 M phi` of a simulation where it is.

use super::{ModesError, dense, lanczos};
use crate::material::Psd;
use crate::simulation::Simulation;
use crate::solver::cholesky::Cholesky;
use crate::solver::hessian::{Assembler, At, Weights};
use crate::system::System;

/// The first shift, as a part of the mean of `K_ii / M_ii`; the second is the first `omega^2` that it finds above zero. With a shift
/// far below, rounding in the large eigenvalues of rigid motion drowns the others; far above, it drowns the low frequencies.
const FIRST_SHIFT: f64 = 1e-3;
/// Bounds of the relative residual, with the first and the second shift.
const TOLERANCES: [f64; 2] = [1e-8, 1e-10];
/// Rigid motion has an `omega^2` below this part of the shift.
const RIGID: f64 = 1e-6;
/// The stiffness alone.
const STIFFNESS: Weights = Weights { inertia: 0.0, stiffness: 1.0, damping: 0.0 };

/// Some or all modes, in the numbering of the simulation.
pub(super) struct Eigen<const D: usize> {
    pub(super) assembler: Assembler<D>,
    /// Where, flat [m].
    pub(super) x: Vec<f64>,
    /// Of every coordinate [kg]; zero where it is held.
    pub(super) mass: Vec<f64>,
    /// `omega^2` and its shape, ascending; exactly zero for rigid motion.
    pub(super) pairs: Vec<(f64, lanczos::Pair)>,
    pub(super) free_coordinates: usize,
    pub(super) solves: usize,
}

impl<const D: usize> Eigen<D> {
    /// The `count` lowest modes, or all.
    pub(super) fn about(simulation: &mut Simulation, count: Option<usize>) -> Result<Self, ModesError> {
        let x = simulation.state().x().to_vec();
        let system = simulation.system_mut();
        if system.terms().iter().any(|term| term.couples_all()) {
            return Err(ModesError::Attraction);
        }
        let free: Vec<bool> = system.inverse_mass().iter().map(|w| *w > 0.0).collect();
        let free_coordinates = free.iter().filter(|free| **free).count();
        let asked = count.unwrap_or(free_coordinates);
        if asked > free_coordinates || free_coordinates == 0 {
            return Err(ModesError::TooMany { asked, free: free_coordinates });
        }
        let mass: Vec<f64> = (0..x.len()).map(|n| if free[n] { system.mass()[n / D] } else { 0.0 }).collect();
        let assembler = Assembler::<D>::new(system);
        let mut eigen = Eigen { assembler, x, mass, pairs: vec![], free_coordinates, solves: 0 };
        eigen.assemble(system, STIFFNESS);
        let matrix = eigen.assembler.matrix();
        let diagonal = |n: usize| matrix.value[matrix.diagonal[n / D] as usize][n % D][n % D];
        let sum: f64 = (0..free.len()).filter(|n| free[*n]).map(|n| diagonal(n) / eigen.mass[n]).sum();
        let mean = sum / free_coordinates as f64;
        if !mean.is_finite() {
            return Err(ModesError::NotFinite);
        }
        if mean <= 0.0 {
            return Err(ModesError::NoStiffness);
        }
        if count.is_some() {
            eigen.lowest(system, asked, FIRST_SHIFT * mean)?;
        } else if free_coordinates > dense::MOST {
            return Err(ModesError::TooManyForAll { free: free_coordinates, most: dense::MOST });
        } else {
            let found = dense::all(matrix, &eigen.mass);
            eigen.pairs = found.ok_or(ModesError::NotConverged { found: 0, asked, solves: 0 })?;
        }
        if eigen.pairs.iter().any(|(square, _)| *square < 0.0) {
            return Err(ModesError::NotStable);
        }
        Ok(eigen)
    }

    /// Shift and invert, twice.
    fn lowest(&mut self, system: &System, count: usize, mut shift: f64) -> Result<(), ModesError> {
        for tolerance in TOLERANCES {
            let mut cholesky = self.shifted(system, shift)?;
            let found = lanczos::largest(&self.mass, count, tolerance, |b| cholesky.solve(b));
            self.solves += found.solves;
            if found.pairs.len() < count {
                let (found, solves) = (found.pairs.len(), self.solves);
                return Err(ModesError::NotConverged { found, asked: count, solves });
            }
            // theta = 1 / (omega^2 + shift)
            let square = |pair: &lanczos::Pair| {
                let square = 1.0 / pair.value - shift;
                if square.abs() <= RIGID * shift { 0.0 } else { square }
            };
            self.pairs = found.pairs.into_iter().map(|pair| (square(&pair), pair)).collect();
            match self.pairs.iter().find(|(square, _)| *square > 0.0) {
                Some((square, _)) if tolerance == TOLERANCES[0] => shift = *square,
                // Rigid motion alone was asked for.
                _ => break,
            }
        }
        Ok(())
    }

    /// A factor of `K + shift M`.
    pub(super) fn shifted(&mut self, system: &System, shift: f64) -> Result<Cholesky, ModesError> {
        self.assemble(system, Weights { inertia: shift, ..STIFFNESS });
        let mut cholesky = Cholesky::new(self.assembler.matrix(), &self.x).ok_or(ModesError::NotFinite)?;
        cholesky.factorize(self.assembler.matrix()).map_err(|_| ModesError::NotStable)?;
        Ok(cholesky)
    }

    /// Assembles these parts; of damping, that at rest.
    pub(super) fn assemble(&mut self, system: &System, weights: Weights) {
        let at = At { x: &self.x, v: &self.x, psd: Psd::Exact };
        self.assembler.assemble(system, at, weights);
    }

    /// The damping of each mode, `phi_j . C phi_j` plus the drag [1/s], and how strongly it couples them, the largest
    /// `|phi_i . C phi_j|` as a part of what it does to both alone.
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
        let alone = |j: usize| matrix[j * modes + j];
        // What is rounding beside the strongest is none.
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

pub(super) fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
