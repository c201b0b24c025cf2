//! Vibration: natural frequencies and mode shapes of a scene about where it is (lecture 2).
//!
//! `K phi = omega^2 M phi` with `K` the Hessian of the energy and lumped masses `M`, in the coordinates that are free. The lowest
//! modes come first: a block Lanczos method on `(K + s M)^-1 M`, whose largest eigenvalues they are, each product one solve
//! with a sparse Cholesky factor. Ericsson, Ruhe 1980, "The spectral transformation Lanczos method for the numerical solution of large
//! sparse generalized symmetric eigenvalue problems"; the whole basis is kept orthogonal, and blocks find modes of equal frequency,
//! such as those of rigid motion.

mod lanczos;
#[cfg(test)]
mod tests;

use crate::material::Psd;
use crate::simulation::Simulation;
use crate::solver::cholesky::Cholesky;
use crate::solver::hessian::{Assembler, At, Weights};

/// A natural mode.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Mode {
    /// Angular frequency [rad/s]; 0 for rigid motion, up to rounding.
    pub omega: f64,
    /// Frequency [Hz].
    pub frequency: f64,
    /// Bound of the relative error of `omega^2 + s`, from the residual, `s` the shift.
    pub residual: f64,
    /// The mass that takes part along each axis, `(phi^T M e)^2`, as a share of the mass that is free to move.
    pub effective_mass: Vec<f64>,
    /// The shape, `phi^T M phi = 1`, flat `(n, dimension)`, vertices in the order of the scene [kg^-1/2].
    #[serde(skip)]
    pub shape: Vec<f64>,
}

/// The lowest modes.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Modes {
    /// By frequency.
    pub modes: Vec<Mode>,
    /// Mass that is free to move along each axis [kg].
    pub free_mass: Vec<f64>,
    /// Coordinates that are free to move.
    pub free_coordinates: usize,
    /// Linear solves that it took.
    pub solves: usize,
}

/// The modes cannot be found.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ModesError {
    /// Modes oscillate about an equilibrium that is stable.
    #[error(
        "the scene starts where its stiffness is not positive: there are motions that grow instead of oscillating; \
         start it in a stable equilibrium"
    )]
    NotStable,
    /// Nothing holds anything together.
    #[error("nothing in the scene has a stiffness: there is nothing that vibrates")]
    NoStiffness,
    /// Mutual gravity of many particles, say.
    #[error("the energy is not finite where the scene starts")]
    NotFinite,
    /// All is held.
    #[error("{asked} modes were asked for, and {free} coordinates are free to move")]
    TooMany {
        /// Modes asked for.
        asked: usize,
        /// Coordinates that can move.
        free: usize,
    },
    /// The iteration ended early.
    #[error("only {found} of {asked} modes converged in {solves} solves")]
    NotConverged {
        /// Modes that did.
        found: usize,
        /// Modes asked for.
        asked: usize,
        /// Solves.
        solves: usize,
    },
}

/// The first shift, as a part of the mean of `K_ii / M_ii`; the second is the first `omega^2` that it finds above zero. With a shift
/// far below, rounding in the large eigenvalues of rigid motion drowns the others; far above, it drowns the low frequencies.
const FIRST_SHIFT: f64 = 1e-3;
/// Bounds of the relative residual, with the first and the second shift.
const TOLERANCES: [f64; 2] = [1e-8, 1e-10];
/// Rigid motion has an `omega^2` below this part of the shift.
const RIGID: f64 = 1e-6;

impl Simulation {
    /// The `count` lowest modes about the present state.
    ///
    /// # Errors
    /// [`ModesError`].
    pub fn modes(&mut self, count: usize) -> Result<Modes, ModesError> {
        match self.system().dimension() {
            2 => modes::<2>(self, count),
            _ => modes::<3>(self, count),
        }
    }
}

fn modes<const D: usize>(simulation: &mut Simulation, count: usize) -> Result<Modes, ModesError> {
    let x = simulation.state().x().to_vec();
    let system = simulation.system_mut();
    let free: Vec<bool> = system.inverse_mass().iter().map(|w| *w > 0.0).collect();
    let free_coordinates = free.iter().filter(|free| **free).count();
    if count > free_coordinates {
        return Err(ModesError::TooMany { asked: count, free: free_coordinates });
    }
    let mut assembler = Assembler::<D>::new(system);
    let at = At { x: &x, v: &x, psd: Psd::Exact };
    let stiffness = Weights { inertia: 0.0, stiffness: 1.0, damping: 0.0 };
    assembler.assemble(system, at, stiffness);
    let matrix = assembler.matrix();
    let diagonal = |n: usize| matrix.value[matrix.diagonal[n / D] as usize][n % D][n % D];
    let mass: Vec<f64> = (0..x.len()).map(|n| if free[n] { system.mass()[n / D] } else { 0.0 }).collect();
    let sum: f64 = (0..x.len()).filter(|n| free[*n]).map(|n| diagonal(n) / mass[n]).sum();
    let mean = sum / free_coordinates as f64;
    if !mean.is_finite() {
        return Err(ModesError::NotFinite);
    }
    if mean <= 0.0 {
        return Err(ModesError::NoStiffness);
    }
    let mut shift = FIRST_SHIFT * mean;
    let (mut pairs, mut solves) = (vec![], 0);
    for tolerance in TOLERANCES {
        assembler.assemble(system, at, Weights { inertia: shift, ..stiffness });
        let mut cholesky = Cholesky::new(assembler.matrix(), &x).ok_or(ModesError::NotFinite)?;
        cholesky.factorize(assembler.matrix()).map_err(|_| ModesError::NotStable)?;
        let found = lanczos::largest(&mass, count, tolerance, |b| cholesky.solve(b));
        solves += found.solves;
        if found.pairs.len() < count {
            return Err(ModesError::NotConverged { found: found.pairs.len(), asked: count, solves });
        }
        // theta = 1 / (omega^2 + shift)
        pairs = found.pairs.into_iter().map(|pair| (1.0 / pair.value - shift, pair)).collect();
        let first = pairs.iter().find(|(square, _)| *square > RIGID * shift);
        match first {
            Some((square, _)) if tolerance == TOLERANCES[0] => shift = *square,
            // Rigid motion alone was asked for.
            _ => break,
        }
    }
    let axis_mass: Vec<f64> = (0..D).map(|c| mass.iter().skip(c).step_by(D).sum()).collect();
    let numbering = simulation.numbering();
    let mode = |(square, pair): (f64, lanczos::Pair)| {
        if square < -RIGID * shift {
            return Err(ModesError::NotStable);
        }
        let omega = square.max(0.0).sqrt();
        let effective = |c: usize| {
            let part: f64 = (c..x.len()).step_by(D).map(|n| mass[n] * pair.vector[n]).sum();
            if axis_mass[c] > 0.0 { part * part / axis_mass[c] } else { 0.0 }
        };
        Ok(Mode {
            omega,
            frequency: omega / std::f64::consts::TAU,
            residual: pair.residual,
            effective_mass: (0..D).map(effective).collect(),
            shape: numbering.to_original(&pair.vector, D).into_owned(),
        })
    };
    Ok(Modes {
        modes: pairs.into_iter().map(mode).collect::<Result<_, _>>()?,
        free_mass: axis_mass.clone(),
        free_coordinates,
        solves,
    })
}
