//! Derivatives of natural frequencies about an unloaded reference configuration.
//!
//! With `K phi = omega^2 M phi` and `phi^T M phi = 1`, the derivative by a parameter `theta` of the scene
//! is
//!
//! ```text
//! d(omega^2) = phi^T (dK - omega^2 dM) phi
//! ```
//!
//! where `K` is taken at the equilibrium, which does not depend on the parameter because no force acts
//! there. For reference shapes the state moves along: `K` is taken at the reference configuration, as in
//! `pliant modes`, even if attachments to other bodies then pull.
//!
//! Single modes of a repeated frequency have no derivative, because they rotate among each other. Their
//! mean has one, which is returned for all of them.

use pliant::modes::MassMatrix;
use pliant::simulation::Simulation;
use pliant::system::System;

use crate::GradientError;
use crate::parameter::{ModeUse, Parameter};
use pliant::algebra::dot;

/// Relative difference below which frequencies count as equal.
const EQUAL: f64 = 1e-6;
/// Forces below this fraction of what a body of that stiffness and size could have are rounding.
const NO_FORCE: f64 = 1e-10;

/// Lowest natural frequencies with their derivatives.
#[derive(Clone, Debug, PartialEq)]
pub struct FrequencyGradient {
    /// Angular frequencies [rad/s], ascending; 0 for rigid motion.
    pub omega: Vec<f64>,
    /// Multiplicity of each frequency, equal to within 1e-6. For repeated frequencies the derivatives are
    /// those of the mean of their squares.
    pub alike: Vec<usize>,
    /// Derivatives of `omega^2` [rad^2/s^2]: `squares[i][j][k]` is that of mode `i` by number `k` of
    /// parameter `j`. Those of `omega` are `1/(2 omega)` times these.
    pub squares: Vec<Vec<Vec<f64>>>,
}

/// Computes the `count` lowest natural frequencies of `simulation` about its present state, an unloaded
/// reference configuration, and their derivatives by `parameters`. The state moves along with reference
/// shapes.
///
/// ```
/// use pliant_gradient::{ParameterSelection, frequency_gradient};
/// use pliant_scene::{Scene, assembly::UnstableStep};
///
/// let scene = Scene::from_toml(
///     "dimension = 2
///      [time]
///      integrator = 'velocity-verlet'
///      step = 1e-3
///      duration = 1.0
///      [[body]]
///      name = 'beam'
///      mesh = { grid = { cells = [4, 1], size = [1.0, 0.1] } }
///      elastic = { neo-hookean = { young = 1e6, poisson = 0.3 } }
///      mass = { density = 1000.0 }
///      pin = [{ half_space = { normal = [1, 0], offset = 0 } }]",
/// )?;
/// let mut assembly = scene.assemble(UnstableStep::Accept).map_err(|problems| format!("{problems:?}"))?;
/// let (topology, numbering) = (&assembly.topology, assembly.simulation.numbering());
/// let mut chosen = ParameterSelection::new(&scene, topology, numbering, &["body.beam.elastic.young"])?;
/// let found = frequency_gradient(&mut assembly.simulation, 2, chosen.parameters())?;
/// // omega^2 is in proportion to Young's modulus.
/// assert!((found.squares[0][0][0] * 1e6 / found.omega[0].powi(2) - 1.0).abs() < 1e-9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`GradientError::Modes`]: the modes cannot be computed, or there are fewer.
/// [`GradientError::Unsupported`]: a force acts. [`GradientError::FrequencyParameter`]: a parameter
/// without derivatives of stiffness and lumped masses; moduli, densities, masses, reference shapes and
/// spring stiffnesses have them.
pub fn frequency_gradient(
    simulation: &mut Simulation,
    count: usize,
    parameters: &mut [Box<dyn Parameter>],
) -> Result<FrequencyGradient, GradientError> {
    refuse_forces(simulation)?;
    // All modes equal to the last one are needed, too.
    let mut asked = count + 1;
    let modes = loop {
        let free = simulation.system().inverse_mass().iter().filter(|weight| **weight > 0.0).count();
        let found = simulation.modes(asked.min(free).max(count))?;
        let omega: Vec<f64> = found.modes.iter().map(|mode| mode.omega).collect();
        if asked >= free || !are_alike(&omega, count.saturating_sub(1), asked - 1) {
            break found;
        }
        asked *= 2;
    };
    // Derivatives of each mode by itself.
    let omega: Vec<f64> = modes.modes.iter().map(|mode| mode.omega).collect();
    let (numbering, d) = (simulation.numbering(), simulation.system().dimension());
    let mut single = vec![];
    for mode in &modes.modes {
        let shape = numbering.to_internal(&mode.shape, d);
        let of = ModeUse {
            system: simulation.system(),
            x: simulation.state().x(),
            shape: &shape,
            square: mode.omega * mode.omega,
            is_lumped: modes.mass_matrix == MassMatrix::Lumped,
        };
        let mut by = vec![];
        for (number, parameter) in parameters.iter_mut().enumerate() {
            let mut derivative = vec![0.0; parameter.len()];
            if !parameter.add_mode(&of, &mut derivative) {
                return Err(GradientError::FrequencyParameter { number });
            }
            by.push(derivative);
        }
        single.push(by);
    }
    // Means over equal frequencies.
    let groups: Vec<Vec<usize>> =
        (0..count).map(|i| (0..omega.len()).filter(|j| are_alike(&omega, i, *j)).collect()).collect();
    let mean = |group: &Vec<usize>| -> Vec<Vec<f64>> {
        let number = |parameter: usize, k: usize| {
            group.iter().map(|mode| single[*mode][parameter][k]).sum::<f64>() / group.len() as f64
        };
        let counts = parameters.iter().map(|parameter| parameter.len()).enumerate();
        counts.map(|(i, count)| (0..count).map(|k| number(i, k)).collect()).collect()
    };
    Ok(FrequencyGradient {
        squares: groups.iter().map(mean).collect(),
        alike: groups.iter().map(Vec::len).collect(),
        omega: omega[..count].to_vec(),
    })
}

/// True if two of these frequencies are equal; all rigid motions are.
fn are_alike(omega: &[f64], i: usize, j: usize) -> bool {
    let largest = omega.iter().fold(0.0, |largest: f64, omega| largest.max(*omega));
    (omega[i] - omega[j]).abs() <= EQUAL * omega[i].max(omega[j]).max(EQUAL * largest)
}

/// Refuses a state in which a term exerts a force on a free coordinate.
fn refuse_forces(simulation: &mut Simulation) -> Result<(), GradientError> {
    let (x, d) = (simulation.state().x().to_vec(), simulation.system().dimension());
    let time = simulation.state().time;
    let system = simulation.system_mut();
    system.set_time(time);
    let scale = NO_FORCE * stiffness(system, &x) * extent(&x, d);
    let free: Vec<bool> = system.inverse_mass().iter().map(|weight| *weight > 0.0).collect();
    let mut gradient = vec![0.0; x.len()];
    for term in system.terms_mut() {
        gradient.fill(0.0);
        term.add_gradient(&x, &mut gradient);
        let pulls = gradient.iter().zip(&free).any(|(force, free)| *free && force.abs() > scale);
        if pulls {
            return Err(GradientError::Unsupported {
                what: format!("natural frequencies under a force, that of {}", term.name()),
                remedy: "they are differentiated about the reference configuration: remove gravity, loads \
                         and changes of the start",
            });
        }
    }
    Ok(())
}

/// Estimate of the largest entry of the stiffness matrix [N/m].
fn stiffness(system: &mut System, x: &[f64]) -> f64 {
    let signs: Vec<f64> = (0..x.len()).map(|i| if i * i % 7 < 3 { 1.0 } else { -1.0 }).collect();
    let mut product = vec![0.0; x.len()];
    system.hessian_product(x, &signs, &mut product);
    dot(&product, &product).sqrt() / (x.len() as f64).sqrt()
}

/// Longest side of the bounding box of all points [m].
fn extent(x: &[f64], d: usize) -> f64 {
    let side = |axis: usize| {
        let coordinates = x.iter().skip(axis).step_by(d);
        let (low, high) =
            coordinates.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (x.min(low), x.max(high)));
        high - low
    };
    (0..d).map(side).fold(0.0, f64::max)
}
