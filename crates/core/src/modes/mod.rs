//! Vibration: natural frequencies and mode shapes of a scene about its current state (lecture 2).
//!
//! The eigenproblem is `K phi = omega^2 M phi` with the energy Hessian `K` and the mass matrix `M`, in
//! the free coordinates. `M` is consistent, `rho integral of N_a N_b`, for second-order elements of
//! uniform density: frequencies then have fourth-order errors in the element size, instead of
//! second-order ones with the lumped masses that steps use. It is lumped elsewhere: linear elements are
//! second-order either way, and lumped masses compensate part of their excessive stiffness.
//!
//! The lowest modes are computed by a block Lanczos method on `(K + s M)^-1 M`, as its largest
//! eigenvalues; each product is one solve with a sparse Cholesky factor. Ericsson, Ruhe 1980, "The
//! spectral transformation Lanczos method for the numerical solution of large sparse generalized
//! symmetric eigenvalue problems"; the whole basis is kept orthogonal. Blocks find modes of equal
//! frequency, such as rigid motions. Counting the negative pivots of `K - sigma M` proves that no mode is
//! missing; if one is, the iteration continues from further start vectors.

mod dense;
pub mod eigen;
mod inertia;
mod lanczos;
mod oscillator;
mod sound;
mod superposition;

pub use oscillator::Oscillator;
pub use sound::{Partial, Silent, Sound, SoundError, Strike};
pub use superposition::{Residual, Superposition};

use crate::quantity::Rounded;
use crate::simulation::Simulation;
use eigen::Eigen;

/// A natural mode.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Mode {
    /// Angular frequency [rad/s]; 0 for rigid motion.
    pub omega: f64,
    /// Frequency [Hz].
    pub frequency: f64,
    /// Relative error bound of `omega^2 + s` from the residual, `s` the shift.
    pub residual: f64,
    /// Effective modal mass along each axis, `(phi^T M e)^2`, as a fraction of the free mass.
    pub effective_mass: Vec<f64>,
    /// Mode shape with `phi^T M phi = 1`, flat `(n, dimension)`, vertices in scene order [kg^-1/2].
    #[serde(skip)]
    pub shape: Vec<f64>,
}

/// Mass matrix of the modes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum MassMatrix {
    /// Lumped at all vertices, as in time steps.
    Lumped,
    /// Consistent with the shape functions for second-order elements of uniform density, lumped
    /// elsewhere.
    Consistent,
}

/// Lowest modes of a scene.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Modes {
    /// Modes, by frequency.
    pub modes: Vec<Mode>,
    /// Free mass along each axis [kg].
    pub free_mass: Vec<f64>,
    /// Number of free coordinates.
    pub free_coordinates: usize,
    /// The mass matrix.
    pub mass_matrix: MassMatrix,
    /// Number of linear solves.
    pub solves: usize,
}

/// Error of a modal analysis.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ModesError {
    /// The current state is not a stable equilibrium.
    #[error(
        "the stiffness at the initial state is not positive definite: some motions grow instead of \
         oscillating; start in a stable equilibrium"
    )]
    NotStable,
    /// Nothing in the scene has stiffness.
    #[error("nothing in the scene has a stiffness, so nothing can vibrate")]
    NoStiffness,
    /// An element is outside the domain of its material, or a factor does not fit memory.
    #[error("the energy is not finite at the initial state")]
    NotFinite,
    /// Particles under mutual gravity have no equilibrium.
    #[error(
        "the particles of the scene attract each other: they have no stable equilibrium at rest about which \
         they could vibrate"
    )]
    Attraction,
    /// The current state cannot be linearised, or a nonlinear or changing force acts.
    #[error("modes cannot be superposed: {what}")]
    NotLinear {
        /// Description of that part.
        what: String,
    },
    /// Damping couples the modes, which then have no separate solutions.
    #[error(
        "damping couples the modes ({coupling} of what it does to each alone): superposition needs damping \
         that is proportional to mass and stiffness in all bodies alike",
        coupling = Rounded::<2>(*.coupling)
    )]
    Coupled {
        /// Largest `|C_ij| / sqrt(C_ii C_jj)`.
        coupling: f64,
    },
    /// A dense eigenproblem would not fit memory.
    #[error(
        "there are {free} unknowns, too many to find all modes (at most {most}): ask for the lowest ones"
    )]
    TooManyForAll {
        /// Number of free coordinates.
        free: usize,
        /// Largest allowed number.
        most: usize,
    },
    /// More modes are requested than coordinates are free.
    #[error("{asked} modes were asked for, but there are only {free} unknowns")]
    TooMany {
        /// Modes requested.
        asked: usize,
        /// Number of free coordinates.
        free: usize,
    },
    /// The search was asked to stop.
    #[error("stopped before the modes were found")]
    Stopped,
    /// The iteration ended before all modes converged.
    #[error("only {found} of {asked} modes converged in {solves} solves")]
    NotConverged {
        /// Converged modes.
        found: usize,
        /// Modes requested.
        asked: usize,
        /// Solves.
        solves: usize,
    },
}

impl Simulation {
    /// Computes the `count` lowest modes about the current state, with the mass matrix named by
    /// [`Modes::mass_matrix`].
    ///
    /// ```
    /// use std::f64::consts::TAU;
    ///
    /// use pliant::integrator::IntegratorSpec;
    /// use pliant::{energy::spring::Springs, simulation::Simulation, state::State, system::System};
    ///
    /// // 1 kg on a spring of 100 N/m, hung up at the origin: 10 rad/s.
    /// let mut system = System::new(2, vec![1.0; 2]);
    /// system.add_term(Box::new(Springs::<2>::new("spring", &[[0, 1]], &[100.0], &[1.0], 2)));
    /// system.pin(&[0]);
    /// let still = State::new(vec![0.0, 0.0, 0.0, -1.0], vec![0.0; 4]);
    ///
    /// let mut simulation = Simulation::new(system, still, IntegratorSpec::VelocityVerlet.method(), 1e-3);
    /// let modes = simulation.modes(2)?;
    /// // Sideways nothing brings it back.
    /// assert!(modes.modes[0].omega < 1e-3 && (modes.modes[1].frequency - 10.0 / TAU).abs() < 1e-6);
    /// # Ok::<(), pliant::modes::ModesError>(())
    /// ```
    ///
    /// # Errors
    /// [`ModesError`] if the modes do not exist or cannot be found.
    pub fn modes(&mut self, count: usize) -> Result<Modes, ModesError> {
        match self.system().dimension() {
            2 => modes::<2>(self, count),
            _ => modes::<3>(self, count),
        }
    }
}

fn modes<const D: usize>(simulation: &mut Simulation, count: usize) -> Result<Modes, ModesError> {
    let Eigen { inertia, pairs, free_coordinates, solves, .. } = Eigen::<D>::lowest_about(simulation, count)?;
    let rigid = |c: usize| -> Vec<f64> {
        let unit = |n: usize| f64::from(u8::from(n % D == c && inertia.is_free(n)));
        inertia.times(&(0..inertia.diagonal().len()).map(unit).collect::<Vec<f64>>())
    };
    // M e along each axis.
    let along: Vec<Vec<f64>> = (0..D).map(rigid).collect();
    let axis_mass: Vec<f64> = along.iter().map(|weights| weights.iter().sum()).collect();
    let numbering = simulation.numbering();
    let mode = |(square, pair): (f64, lanczos::EigenPair)| {
        let omega = square.sqrt();
        let effective = |c: usize| {
            let part: f64 = along[c].iter().zip(&pair.vector).map(|(m, phi)| m * phi).sum();
            if axis_mass[c] > 0.0 { part * part / axis_mass[c] } else { 0.0 }
        };
        Mode {
            omega,
            frequency: omega / std::f64::consts::TAU,
            residual: pair.residual,
            effective_mass: (0..D).map(effective).collect(),
            shape: numbering.to_original(&pair.vector, D).into_owned(),
        }
    };
    Ok(Modes {
        modes: pairs.into_iter().map(mode).collect(),
        free_mass: axis_mass.clone(),
        free_coordinates,
        mass_matrix: if inertia.is_consistent() { MassMatrix::Consistent } else { MassMatrix::Lumped },
        solves,
    })
}
