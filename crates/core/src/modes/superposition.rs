//! Modal superposition: the exact motion of a linear system as a sum of its modes.

use super::eigen::{Eigen, product};
use super::{ModesError, Oscillator};
use crate::simulation::Simulation;
use crate::system::System;

/// Relative coupling of modes by damping above which it is not rounding.
const COUPLING: f64 = 1e-8;
/// Relative tolerance of the static solution for omitted modes.
const STATICS: f64 = 1e-12;

/// Modal superposition: solves `M u'' + C u' + K u = f`, `x = x_0 + u`, exactly from the state
/// `(x_0, v_0)` of a simulation. `K`, `C` and `f = -dE/dx` are those at that state, and
/// `u = sum_j q_j(t) phi_j`, each `q_j` in closed form (lecture 2).
///
/// Exact in time for linear materials, gravity and dead loads, undamped or with mass-proportional damping
/// or ether drag: a reference for errors of time integrators. Otherwise it solves the linearised system,
/// see [`nonlinearity`](Self::nonlinearity): stiffness-proportional damping of a simulation follows the
/// current shape, not the initial one, and differs by as much as the strain. Assembled once, evaluated at
/// any number of times. Clough, Penzien 1993, *Dynamics of Structures*, chapter 12.
///
/// ```
/// use pliant::energy::{gravity::UniformGravity, spring::Springs};
/// use pliant::integrator::IntegratorSpec;
/// use pliant::{simulation::Simulation, state::State, system::System};
///
/// // A mass of 1 kg below one that is held, on a spring of 100 N/m.
/// let start = vec![0.0, 0.0, 0.0, -1.0];
/// let mut system = System::new(2, vec![1.0; 2]);
/// system.add_term(Box::new(Springs::<2>::new("spring", &[[0, 1]], &[100.0], &[1.0], 2)));
/// system.add_term(Box::new(UniformGravity::new(&[0.0, -9.81], &[1.0; 2])));
/// system.pin(&[0]);
/// let state = State::new(start, vec![0.0; 4]);
/// let mut simulation = Simulation::new(system, state, IntegratorSpec::Rk4.method(), 1e-3);
/// let exact = simulation.superposition(None)?;
/// let (mut x, mut v) = (vec![0.0; 4], vec![0.0; 4]);
/// exact.state_at(0.1, &mut x, &mut v);
/// (0..100).for_each(|_| simulation.step().unwrap());
/// assert!(simulation.positions().iter().zip(&x).all(|(a, b)| (a - b).abs() < 1e-8));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Superposition {
    dimension: usize,
    /// Positions `x_0`, in scene order.
    origin: Vec<f64>,
    /// Mode shapes one after another, in scene order.
    shapes: Vec<f64>,
    oscillators: Vec<Oscillator>,
    residual: Residual,
    nonlinearity: f64,
}

/// Contribution of omitted modes.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Residual {
    /// Initial kinetic energy outside the modes [J].
    pub kinetic: f64,
    /// Total initial kinetic energy [J].
    pub kinetic_total: f64,
    /// Elastic energy of the static response to the force outside the modes, `1/2 r . K^-1 r` [J].
    pub elastic: f64,
    /// Elastic energy of the static response to the whole force, without rigid motions [J].
    pub elastic_total: f64,
}

impl Simulation {
    /// Computes the exact solution of the system linearised at the current state, starting there, by all
    /// modes or by the `count` lowest.
    ///
    /// # Errors
    /// [`ModesError`]; [`NotLinear`](ModesError::NotLinear) with walls, time-dependent or follower loads,
    /// or moving or ending pins; [`Coupled`](ModesError::Coupled) if damping couples modes.
    pub fn superposition(&mut self, count: Option<usize>) -> Result<Superposition, ModesError> {
        ensure_steady(self.system())?;
        match self.system().dimension() {
            2 => superposition::<2>(self, count),
            _ => superposition::<3>(self, count),
        }
    }
}

/// Checks that forces are constant or linear.
fn ensure_steady(system: &System) -> Result<(), ModesError> {
    let fail = |what: String| Err(ModesError::NotLinear { what });
    if !system.walls().is_empty() {
        return fail("walls push where they are met".into());
    }
    if let Some(term) = system.terms().iter().find(|term| term.properties().changes_with_time) {
        return fail(format!("{} changes with time", term.name()));
    }
    if let Some(term) = system.terms().iter().find(|term| !term.properties().is_conservative) {
        return fail(format!("{} follows the body", term.name()));
    }
    if let Some(hold) = system.constraints().iter().find(|hold| hold.moves()) {
        return fail(format!("pin `{}` moves", hold.name()));
    }
    if let Some(hold) = system.constraints().iter().find(|hold| hold.end() < f64::INFINITY) {
        return fail(format!("pin `{}` is released at {} s", hold.name(), hold.end()));
    }
    Ok(())
}

fn superposition<const D: usize>(
    simulation: &mut Simulation,
    count: Option<usize>,
) -> Result<Superposition, ModesError> {
    let mut eigen = Eigen::<D>::about(simulation, count)?;
    let velocity = simulation.state().v().to_vec();
    let system = simulation.system_mut();
    let mut gradient = vec![0.0; eigen.x.len()];
    system.gradient(&eigen.x, &mut gradient);
    // Force on free coordinates.
    let force: Vec<f64> =
        gradient.iter().zip(&eigen.mass).map(|(g, m)| if *m > 0.0 { -g } else { 0.0 }).collect();
    let momentum: Vec<f64> = velocity.iter().zip(&eigen.mass).map(|(v, m)| v * m).collect();
    // Damping must not couple the modes.
    let (rates, coupling) = eigen.damping(system);
    if coupling > COUPLING {
        return Err(ModesError::Coupled { coupling });
    }
    // One oscillator per mode, from the modal force and velocity.
    let oscillators: Vec<Oscillator> = eigen
        .pairs
        .iter()
        .zip(rates)
        .map(|((square, pair), rate)| Oscillator {
            square: *square,
            rate,
            force: product(&pair.vector, &force),
            velocity: product(&pair.vector, &momentum),
        })
        .collect();
    // Contribution of omitted modes; then everything in scene order.
    let residual = residual(&mut eigen, system, &oscillators, &force, &velocity)?;
    let numbering = simulation.numbering();
    let in_order = |flat: &[f64]| numbering.to_original(flat, D).into_owned();
    let mut superposition = Superposition {
        dimension: D,
        origin: in_order(&eigen.x),
        shapes: eigen.pairs.iter().flat_map(|(_, pair)| in_order(&pair.vector)).collect(),
        oscillators,
        residual,
        nonlinearity: 0.0,
    };
    superposition.nonlinearity = nonlinearity(&superposition, &eigen, simulation, &gradient);
    Ok(superposition)
}

fn residual<const D: usize>(
    eigen: &mut Eigen<D>,
    system: &System,
    oscillators: &[Oscillator],
    force: &[f64],
    velocity: &[f64],
) -> Result<Residual, ModesError> {
    // Force and velocity that the modes do not represent.
    let (mut rest, mut still) = (force.to_vec(), velocity.to_vec());
    for (o, (_, pair)) in oscillators.iter().zip(&eigen.pairs) {
        for (n, phi) in pair.vector.iter().enumerate() {
            rest[n] -= o.force * eigen.mass[n] * phi;
            still[n] -= o.velocity * phi;
        }
    }
    let kinetic = |v: &[f64]| 0.5 * v.iter().zip(&eigen.mass).map(|(v, m)| m * v * v).sum::<f64>();
    let elastic = oscillators.iter().filter(|o| o.square > 0.0);
    let found: f64 = elastic.map(|o| 0.5 * o.force * o.force / o.square).sum();
    let (kinetic, kinetic_total) = (kinetic(&still), kinetic(velocity));
    if oscillators.len() == eigen.free_coordinates {
        return Ok(Residual { kinetic: 0.0, kinetic_total, elastic: 0.0, elastic_total: found });
    }
    // Iterates y <- (K + s M)^-1 (r + s M y) for K y = r: omitted modes lie above s, so that each
    // iteration at least halves the error. Without rigid motion K itself is invertible.
    let last = eigen.pairs.last().map_or(0.0, |(square, _)| *square);
    let is_held = eigen.pairs.first().is_some_and(|(square, _)| *square > 0.0);
    let shift = match (is_held, last > 0.0) {
        (true, _) => 0.0,
        (false, true) => last,
        // Only rigid motion was requested: the modes above it are unknown.
        (false, false) => {
            return Ok(Residual { kinetic, kinetic_total, elastic: f64::NAN, elastic_total: f64::NAN });
        }
    };
    let mut cholesky = eigen.shifted(system, shift)?;
    let mut y = vec![0.0; rest.len()];
    let mut energy = 0.0;
    for _ in 0..100 {
        y.iter_mut().enumerate().for_each(|(n, y)| *y = rest[n] + shift * eigen.mass[n] * *y);
        cholesky.solve(&mut y);
        for (_, pair) in &eigen.pairs {
            let part: f64 = (0..y.len()).map(|n| y[n] * eigen.mass[n] * pair.vector[n]).sum();
            y.iter_mut().zip(&pair.vector).for_each(|(y, phi)| *y -= part * phi);
        }
        let before = energy;
        energy = 0.5 * product(&rest, &y);
        if shift == 0.0 || (energy - before).abs() <= STATICS * energy.abs() {
            break;
        }
    }
    Ok(Residual { kinetic, kinetic_total, elastic: energy, elastic_total: found + energy })
}

/// Measures the deviation of the force from the linear one, `|f - (f_0 - K u - C v)|` relative to
/// `|K u|`, `|f_0|` and `|C v|` in the maximum norm, after a quarter of the longest period.
fn nonlinearity<const D: usize>(
    superposition: &Superposition,
    eigen: &Eigen<D>,
    simulation: &mut Simulation,
    gradient: &[f64],
) -> f64 {
    let Some(slowest) = superposition.oscillators.iter().map(|o| o.square).find(|s| *s > 0.0) else {
        return 0.0;
    };
    let n = eigen.x.len();
    let (mut x, mut v) = (vec![0.0; n], vec![0.0; n]);
    superposition.state_at(0.5 * std::f64::consts::PI / slowest.sqrt(), &mut x, &mut v);
    let internal = |flat: &[f64]| simulation.numbering().to_internal(flat, D).into_owned();
    let (x, v) = (internal(&x), internal(&v));
    // Compare exact and linearised forces at that state.
    let u: Vec<f64> = x.iter().zip(&eigen.x).map(|(x, origin)| x - origin).collect();
    let system = simulation.system_mut();
    let [mut there, mut linear, mut damped, mut viscous] = [0; 4].map(|_| vec![0.0; n]);
    system.gradient(&x, &mut there);
    system.hessian_product(&eigen.x, &u, &mut linear);
    if system.is_damped() {
        system.dissipative_force(&x, &v, &mut damped);
        system.damping_product(&eigen.x, &v, &v, &mut viscous);
    }
    let (mut defect, mut scale) = (0.0f64, 0.0f64);
    for i in (0..n).filter(|i| eigen.mass[*i] > 0.0) {
        let difference = (there[i] - gradient[i] - linear[i] + damped[i] - viscous[i]).abs();
        // A barrier counts as infinitely nonlinear.
        defect = if difference.is_nan() { f64::INFINITY } else { defect.max(difference) };
        scale = scale.max(linear[i].abs()).max(gradient[i].abs()).max(viscous[i].abs());
    }
    if defect == 0.0 { 0.0 } else { defect / scale }
}

impl Superposition {
    /// Writes positions [m] and velocities [m/s] at `t >= 0` [s] after the start to `x` and `v`, flat
    /// `(n, dimension)`, vertices in scene order. Does not allocate.
    ///
    /// # Panics
    /// If `x` or `v` has another length.
    pub fn state_at(&self, t: f64, x: &mut [f64], v: &mut [f64]) {
        x.copy_from_slice(&self.origin);
        assert_eq!(v.len(), x.len(), "positions and velocities of all vertices");
        v.fill(0.0);
        for (oscillator, shape) in self.oscillators.iter().zip(self.shapes.chunks_exact(x.len())) {
            let (q, rate) = oscillator.at(t);
            for ((x, v), phi) in x.iter_mut().zip(v.iter_mut()).zip(shape) {
                *x += q * phi;
                *v += rate * phi;
            }
        }
    }

    /// Returns the dimension, 2 or 3.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// Returns the modal oscillators, by frequency.
    pub fn oscillators(&self) -> &[Oscillator] {
        &self.oscillators
    }

    /// Returns the shape of mode `j`, `phi^T M phi = 1`, flat, in scene order [kg^-1/2].
    pub fn shape(&self, j: usize) -> &[f64] {
        &self.shapes[j * self.origin.len()..][..self.origin.len()]
    }

    /// Returns the contribution of omitted modes; zero with all modes.
    pub fn residual(&self) -> Residual {
        self.residual
    }

    /// Returns the relative deviation of forces from linearity, compared at a quarter of the longest
    /// period. About 1e-10 (rounding) for linear systems; if it is larger, this is the solution of the
    /// linearised system.
    pub fn nonlinearity(&self) -> f64 {
        self.nonlinearity
    }
}
