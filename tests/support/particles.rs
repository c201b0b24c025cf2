//! Particles and springs: the problems of the integrators' tests.

use pliant::energy::gravity::UniformGravity;
use pliant::energy::nbody::NBody;
use pliant::energy::spring::Springs;
use pliant::integrator::Method;
use pliant::simulation::Simulation;
use pliant::state::State;
use pliant::system::System;

use super::solve_to_rounding;

/// A body around a sun of mass 1 held at the origin, `G = 1`, semi-major axis 1, from perihelion. Vertex 0
/// is the sun.
pub(crate) fn kepler(method: Method, eccentricity: f64, h: f64) -> Simulation {
    let speed = ((1.0 + eccentricity) / (1.0 - eccentricity)).sqrt();
    let mut system = System::new(2, vec![1.0, 1.0]);
    system.add_term(Box::new(NBody::<2>::new(vec![0, 1], vec![1.0, 1.0], 1.0, 0.0)));
    system.pin(&[0]);
    let state = State::new(vec![0.0, 0.0, 1.0 - eccentricity, 0.0], vec![0.0, 0.0, 0.0, speed]);
    let mut simulation = Simulation::new(system, state, method, h);
    solve_to_rounding(&mut simulation);
    simulation
}

/// Three gravitating bodies in the plane, `G = 1`.
pub(crate) fn three_bodies(method: Method, mass: [f64; 3], x: [f64; 6], v: [f64; 6], h: f64) -> Simulation {
    let mut system = System::new(2, mass.to_vec());
    system.add_term(Box::new(NBody::<2>::new(vec![0, 1, 2], mass.to_vec(), 1.0, 0.0)));
    Simulation::new(system, State::new(x.to_vec(), v.to_vec()), method, h)
}

/// Period of the figure-eight.
pub(crate) const FIGURE_EIGHT_PERIOD: f64 = 6.325_913_982_926_211_7;

/// The figure-eight of three equal masses.
pub(crate) fn figure_eight(method: Method, h: f64) -> Simulation {
    let (p, q) = (0.347_116_888_118_926_94, 0.532_724_945_388_030_23);
    let v = [p, q, p, q, -2.0 * p, -2.0 * q];
    three_bodies(method, [1.0; 3], [-1.0, 0.0, 1.0, 0.0, 0.0, 0.0], v, h)
}

/// The Pythagorean problem: masses 3, 4, 5 at rest at the corners of a right triangle of sides 3, 4, 5.
pub(crate) fn pythagorean(method: Method, h: f64) -> Simulation {
    three_bodies(method, [3.0, 4.0, 5.0], [1.0, 3.0, -2.0, -1.0, 1.0, -1.0], [0.0; 6], h)
}

/// Masses on the x axis at `spacing * (1, 2, ...)`, each joined to the one before by a spring of rest length
/// `spacing`, the first to a wall at the origin (vertex 0), and, if there is one stiffness more than masses,
/// the last to a wall behind it. Displaced by `u`, at rest.
pub(crate) fn chain(
    method: Method,
    mass: &[f64],
    stiffness: &[f64],
    spacing: f64,
    u: &[f64],
    h: f64,
) -> Simulation {
    let n = stiffness.len() + 1;
    let edges: Vec<[u32; 2]> = (1..n as u32).map(|i| [i - 1, i]).collect();
    let mut masses = vec![1.0; n];
    masses[1..=mass.len()].copy_from_slice(mass);
    let mut x: Vec<f64> = (0..n).flat_map(|i| [spacing * i as f64, 0.0]).collect();
    for (i, u) in u.iter().enumerate() {
        x[2 * (i + 1)] += u;
    }
    let mut system = System::new(2, masses);
    let rest = vec![spacing; n - 1];
    system.add_term(Box::new(Springs::<2>::new("chain", &edges, stiffness, &rest, n)));
    system.pin(&[0]);
    if n > mass.len() + 1 {
        system.pin(&[n as u32 - 1]);
    }
    Simulation::new(system, State::new(x, vec![0.0; 2 * n]), method, h)
}

/// Displacements of the masses of a [`chain`] of this spacing, its wall at the origin left out.
pub(crate) fn chain_displacements(simulation: &Simulation, spacing: f64) -> Vec<f64> {
    let x = simulation.state().x();
    (1..x.len() / 2).map(|i| x[2 * i] - spacing * i as f64).collect()
}

/// A mass 1 on a spring of rest length 1 hung from the origin (vertex 0), at 60 degrees from the vertical,
/// at rest; `g = 9.81`.
pub(crate) fn spring_pendulum(method: Method, stiffness: f64, h: f64) -> Simulation {
    let mass = vec![1.0, 1.0];
    let mut system = System::new(2, mass.clone());
    system.add_term(Box::new(Springs::<2>::new("pendulum", &[[0, 1]], &[stiffness], &[1.0], 2)));
    system.add_term(Box::new(UniformGravity::new(&[0.0, -9.81], &mass)));
    system.pin(&[0]);
    let (s, c) = std::f64::consts::FRAC_PI_3.sin_cos();
    let mut simulation = Simulation::new(system, State::new(vec![0.0, 0.0, s, -c], vec![0.0; 4]), method, h);
    solve_to_rounding(&mut simulation);
    simulation
}

/// Two masses on soft springs below a pin, all terms nonlinear, no motion stiff: where orders show at once.
/// The time is 1 at the end.
pub(crate) fn soft_double_pendulum(method: Method, h: f64) -> Simulation {
    let mass = vec![1.0, 1.0, 2.0];
    let mut system = System::new(2, mass.clone());
    let springs = Springs::<2>::new("pendulum", &[[0, 1], [1, 2]], &[10.0, 10.0], &[1.0, 0.8], 3);
    system.add_term(Box::new(springs));
    system.add_term(Box::new(UniformGravity::new(&[0.0, -9.81], &mass)));
    system.pin(&[0]);
    let state = State::new(vec![0.0, 0.0, 1.1, -0.2, 1.7, 0.4], vec![0.0, 0.0, 0.0, 0.5, -1.0, 0.0]);
    let mut simulation = Simulation::new(system, state, method, h);
    solve_to_rounding(&mut simulation);
    simulation
}

/// Positions of the two masses of [`soft_double_pendulum`] at `t = 1`: Taylor series of degree 20 and 24 in
/// 30 digits (mpmath), which agree in all digits given.
pub(crate) const SOFT_DOUBLE_PENDULUM_X: [f64; 4] =
    [-0.193_846_589_726_792_75, -3.448_708_169_134_840_9, 0.914_904_466_106_178_69, -4.253_970_357_222_576_5];
/// The velocities there.
pub(crate) const SOFT_DOUBLE_PENDULUM_V: [f64; 4] =
    [-2.184_940_385_385_463_8, -2.582_580_567_958_174_5, -0.755_741_896_848_766_16, -9.292_660_739_444_263_5];
