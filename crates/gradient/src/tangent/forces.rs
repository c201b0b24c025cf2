//! Changes of forces with places.

use pliant::system::System;

use crate::adjoint::{AdjointPlace, Singular};
use crate::linear::{Coefficients, Products, TransposedSolver};

/// Memory of solves and of products.
pub(super) struct TangentForces {
    solver: TransposedSolver,
    products: Products,
    by_positions: Vec<f64>,
    by_velocities: Vec<f64>,
}

impl TangentForces {
    /// For `unknowns` coordinates, `dimension` of each vertex.
    pub(super) fn new(dimension: usize, unknowns: usize) -> Self {
        TangentForces {
            solver: TransposedSolver::new(dimension),
            products: Products::new(unknowns),
            by_positions: vec![0.0; unknowns],
            by_velocities: vec![0.0; unknowns],
        }
    }

    /// Change of `-dE/dx - dR/dv - c M v` [N] at a place that changes by `(x, v)`, `c` the ether drag; zero
    /// where held.
    pub(super) fn force(
        &mut self,
        system: &mut System,
        at: AdjointPlace<'_>,
        (x, v): (&[f64], &[f64]),
    ) -> Vec<f64> {
        system.set_time(at.time);
        system.hessian_product(at.x, x, &mut self.by_positions);
        self.by_velocities.fill(0.0);
        if system.is_damped() {
            system.damping_product(at.x, at.v, v, &mut self.by_velocities);
        }
        let (d, drag) = (system.dimension(), system.ether_drag());
        let change =
            |i: usize| -self.by_positions[i] - self.by_velocities[i] - drag * system.mass()[i / d] * v[i];
        let mut force: Vec<f64> = (0..x.len()).map(change).collect();
        self.keep_free(system, &mut force);
        force
    }

    /// The same of the acceleration [m/s^2].
    pub(super) fn acceleration(
        &mut self,
        system: &mut System,
        at: AdjointPlace<'_>,
        by: (&[f64], &[f64]),
    ) -> Vec<f64> {
        let mut force = self.force(system, at, by);
        force.iter_mut().zip(system.inverse_mass()).for_each(|(force, weight)| *force *= weight);
        force
    }

    /// The solution of `A p = right` at a place, with `A` of these `coefficients`; zero where held.
    pub(super) fn solve(
        &mut self,
        system: &mut System,
        at: AdjointPlace<'_>,
        coefficients: Coefficients,
        right: &[f64],
    ) -> Result<Vec<f64>, Singular> {
        let mut p = vec![0.0; right.len()];
        system.set_time(at.time);
        match self.solver.solve(system, (at.x, at.v), coefficients, right, &mut p, &mut self.products) {
            true => Ok(p),
            false => Err(Singular),
        }
    }

    /// Makes held components zero.
    pub(super) fn keep_free(&self, system: &System, rows: &mut [f64]) {
        let held = rows.iter_mut().zip(system.inverse_mass()).filter(|(_, weight)| **weight == 0.0);
        held.for_each(|(row, _)| *row = 0.0);
    }
}
