//! Vibration: natural frequencies and mode shapes of a scene about where it is (lecture 2).
//!
//! `K phi = omega^2 M phi` with `K` the Hessian of the energy and the masses `M`, in the coordinates that are
//! free. `M` is consistent, `rho integral of N_a N_b`, where elements are of second order and of one density:
//! frequencies then have errors of fourth order in the size of the elements; with lumped masses, which steps
//! have, of second. It is lumped elsewhere: linear elements are of second order either way, and a lumped mass
//! takes back a part of what they are too stiff by.
//!
//! The lowest modes come first: a block Lanczos method on `(K + s M)^-1 M`, whose largest eigenvalues they
//! are, each product one solve with a sparse Cholesky factor. Ericsson, Ruhe 1980, "The spectral
//! transformation Lanczos method for the numerical solution of large sparse generalized symmetric
//! eigenvalue problems"; the whole basis is kept orthogonal. Blocks find modes of equal frequency, such as
//! those of rigid motion; that none is missing is proved by counting the negative pivots of `K - sigma M`,
//! and where one is the iteration goes on from further start vectors.

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
    /// Bound of the relative error of `omega^2 + s`, from the residual, `s` the shift.
    pub residual: f64,
    /// The mass that takes part along each axis, `(phi^T M e)^2`, as a share of the mass that is free to
    /// move.
    pub effective_mass: Vec<f64>,
    /// The shape, `phi^T M phi = 1`, flat `(n, dimension)`, vertices in the order of the scene [kg^-1/2].
    #[serde(skip)]
    pub shape: Vec<f64>,
}

/// Which mass matrix modes have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum MassMatrix {
    /// Lumped at all vertices, as steps have it.
    Lumped,
    /// Consistent with the shape functions where elements are of second order and of one density, lumped
    /// elsewhere.
    Consistent,
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
    /// The mass matrix.
    pub mass_matrix: MassMatrix,
    /// Linear solves that it took.
    pub solves: usize,
}

/// The modes cannot be found.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ModesError {
    /// Modes oscillate about an equilibrium that is stable.
    #[error(
        "the scene starts where its stiffness is not positive: there are motions that grow instead of \
         oscillating; start it in a stable equilibrium"
    )]
    NotStable,
    /// Nothing holds anything together.
    #[error("nothing in the scene has a stiffness: there is nothing that vibrates")]
    NoStiffness,
    /// An element outside the domain of its material, or a factor that does not fit memory.
    #[error("the energy is not finite where the scene starts")]
    NotFinite,
    /// Particles under mutual gravity have no equilibrium.
    #[error(
        "the particles of the scene attract each other: they have no stable equilibrium at rest about which \
         they could vibrate"
    )]
    Attraction,
    /// The present state is no place to linearise, or something else than a linear force acts.
    #[error("modes cannot be superposed: {what}")]
    NotLinear {
        /// The part that is not linear, or changes.
        what: String,
    },
    /// Modes that damping couples have no solutions of their own.
    #[error(
        "damping couples the modes ({coupling} of what it does to each alone): superposition needs damping \
         that is proportional to mass and stiffness in all bodies alike",
        coupling = Rounded::<2>(*.coupling)
    )]
    Coupled {
        /// Largest `|C_ij| / sqrt(C_ii C_jj)`.
        coupling: f64,
    },
    /// A dense eigenproblem would not fit.
    #[error(
        "{free} coordinates are free to move, too many to find all modes (at most {most}): ask for the \
         lowest ones"
    )]
    TooManyForAll {
        /// Coordinates that can move.
        free: usize,
        /// How many there may be.
        most: usize,
    },
    /// All is held.
    #[error("{asked} modes were asked for, and {free} coordinates are free to move")]
    TooMany {
        /// Modes asked for.
        asked: usize,
        /// Coordinates that can move.
        free: usize,
    },
    /// The search was asked to end.
    #[error("stopped before the modes were found")]
    Stopped,
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

impl Simulation {
    /// The `count` lowest modes about the present state, with the mass matrix that [`Modes::mass_matrix`]
    /// names.
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
    /// [`ModesError`].
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
