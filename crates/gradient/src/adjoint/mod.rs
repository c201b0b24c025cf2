//! Adjoints of single steps, one for each family of integrators.
//!
//! A step is a map `(x_n, v_n) -> (x_(n+1), v_(n+1))`. Its adjoint maps the derivatives of the loss by
//! the new state to those by the old one, and adds the contributions to the derivatives by parameters.
//! Implicit stages need one linear solve each, with the exact Hessian at their solution. It is symmetric,
//! so the solve is its own transpose.

pub(crate) mod alpha;
mod bdf2;
mod collocation;
mod forces;
pub(crate) mod linearised;
pub(crate) mod runge_kutta;
pub(crate) mod splitting;
mod stages;
pub(crate) mod statics;

use pliant::integrator::{Method, Scheme, bdf2::Bdf2Start, implicit_euler, tr_bdf2};
use pliant::system::System;

use forces::Bars;
pub(crate) use forces::{AdjointForces, HeldStart, Sums};
pub(crate) use stages::StageTables;

/// One step of the run, vertices in the order of the simulation.
pub(crate) struct Step<'a> {
    /// State before the step.
    pub(crate) from: AdjointPlace<'a>,
    /// Positions and velocities after the step, flat.
    pub(crate) x: &'a [f64],
    pub(crate) v: &'a [f64],
    /// Velocities of the stages, flat [m/s]; empty for methods without stages.
    pub(crate) stage_velocities: &'a [Vec<f64>],
    /// Accelerations of the stages of the Gauss-Radau method, flat [m/s^2]; empty for others.
    pub(crate) stage_accelerations: &'a [Vec<f64>],
    /// Step size [s].
    pub(crate) h: f64,
    /// Ratio of the step size to that of the step before; 1 for the first step.
    pub(crate) growth: f64,
    /// True for the first step.
    pub(crate) is_first: bool,
}

/// Time, positions and velocities.
#[derive(Clone, Copy)]
pub(crate) struct AdjointPlace<'a> {
    pub(crate) time: f64,
    pub(crate) x: &'a [f64],
    pub(crate) v: &'a [f64],
}

/// Derivatives of the loss by the state of a step, flat.
pub(crate) struct Adjoint {
    /// Derivatives by positions.
    pub(crate) x: Vec<f64>,
    /// Derivatives by velocities; zero where fixed.
    pub(crate) v: Vec<f64>,
    /// Derivatives by the acceleration that methods with memory carry along.
    a: Vec<f64>,
    /// Derivatives by the acceleration before it.
    older_a: Vec<f64>,
    /// Derivatives by positions and velocities of the state before, for two-step methods.
    older: [Vec<f64>; 2],
}

impl Adjoint {
    /// Zero derivatives.
    pub(crate) fn zero(unknowns: usize) -> Self {
        let zero = || vec![0.0; unknowns];
        Adjoint { x: zero(), v: zero(), a: zero(), older_a: zero(), older: [zero(), zero()] }
    }

    /// True if the derivatives by the state are finite.
    pub(crate) fn is_finite(&self) -> bool {
        // No early exit: without branches, the loop is vectorised.
        let finite = |rows: &[f64]| rows.iter().fold(true, |finite, row| finite & row.is_finite());
        finite(&self.x) && finite(&self.v)
    }

    /// Largest component of the derivatives by the state; infinite if one is NaN.
    pub(crate) fn norm(&self) -> f64 {
        let all = self.x.iter().chain(&self.v);
        all.fold(0.0, |norm: f64, a| if a.is_nan() { f64::INFINITY } else { norm.max(a.abs()) })
    }
}

/// Error: the equations of a step have no unique solution.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Singular;

/// Propagates `adjoint` from the end of a step by `method` to its beginning. Derivatives by lagged
/// quantities at its start stay in `forces`.
pub(crate) fn step_back<'a>(
    method: &Method,
    forces: &mut AdjointForces<'a, '_>,
    step: &Step<'a>,
    adjoint: &mut Adjoint,
) -> Result<(), Singular> {
    match method.scheme {
        Scheme::Splitting(stages) => {
            splitting::step_back((stages, method.documentation.order), forces, step, adjoint);
            Ok(())
        }
        Scheme::RungeKutta(tableau) | Scheme::Dirk(tableau) => {
            runge_kutta::step_back(&tableau, forces, step, adjoint)
        }
        Scheme::Alpha(coefficients) => alpha::step_back(&coefficients, forces, step, adjoint),
        Scheme::Bdf2(start) => bdf2::step_back(first_step(start), forces, step, adjoint),
        Scheme::QuasiStatic => statics::step_back(forces, step, adjoint),
        Scheme::Collocation(tableau) => {
            collocation::step_back(&StageTables::of_tableau(&tableau), forces, step, adjoint)
        }
        Scheme::GaussRadau(_) => collocation::step_back(StageTables::gauss_radau(), forces, step, adjoint),
        Scheme::Linearised(_) => linearised::step_back(forces, step, adjoint),
    }
}

/// Method of the first step of BDF2.
pub(crate) fn first_step(start: Bdf2Start) -> Method {
    match start {
        Bdf2Start::TrBdf2 => tr_bdf2::METHOD,
        Bdf2Start::ImplicitEuler => implicit_euler::METHOD,
    }
}

/// True if a step by `scheme` depends on states before the one it begins with.
pub(crate) fn has_memory(scheme: Scheme) -> bool {
    matches!(scheme, Scheme::Alpha(_) | Scheme::Bdf2(_))
}

/// `y += c x`.
pub(crate) fn add_scaled(y: &mut [f64], c: f64, x: &[f64]) {
    y.iter_mut().zip(x).for_each(|(y, x)| *y += c * x);
}

/// Sets fixed components to zero.
pub(crate) fn free_only(system: &System, rows: &mut [f64]) {
    // No early exit: without branches, the loop is vectorised.
    let each = rows.iter_mut().zip(system.inverse_mass());
    each.for_each(|(row, weight)| *row = if *weight == 0.0 { 0.0 } else { *row });
}
