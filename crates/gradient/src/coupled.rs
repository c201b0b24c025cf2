//! Linear equations of fully implicit steps: all stages at once, with exact Hessians.

use pliant::material::Psd;
use pliant::solver::hessian::{At, Weights};
use pliant::solver::stages::StageMatrix;
use pliant::system::System;

use crate::adjoint::add_scaled;
use crate::krylov::{CorrectedEquations, keep_free, solve};
use crate::linear::Products;

/// Evaluation point of a stage: time [s], positions and velocities, flat.
pub(crate) struct StagePlace {
    pub(crate) time: f64,
    pub(crate) x: Vec<f64>,
    pub(crate) v: Vec<f64>,
}

/// Equations of the stages `i` of a step, with second derivatives `H` and `C` and mass-proportional drag
/// `c`:
///
/// ```text
/// M p_i + sum_k [d_ik (C_k + c M) + k_ik (H_k + (d2R/dx dv)_k^T)] p_k = b_i           of an adjoint
/// M p_i + (C_i + c M) sum_k d_ik p_k + (H_i + (d2R/dx dv)_i) sum_k k_ik p_k = b_i     of a tangent
/// ```
pub(crate) struct CoupledEquations<'a> {
    pub(crate) stages: &'a [StagePlace],
    /// True for tangents, false for adjoints.
    pub(crate) is_forth: bool,
    /// `d_ik` [s].
    pub(crate) damping: &'a [Vec<f64>],
    /// `k_ik` [s^2].
    pub(crate) stiffness: &'a [Vec<f64>],
}

impl CoupledEquations<'_> {
    /// Solves the equations; components are zero where fixed. `None` if they are singular.
    pub(crate) fn solve(&self, system: &mut System, b: &[Vec<f64>]) -> Option<Vec<Vec<f64>>> {
        let factors = match system.dimension() {
            2 => self.factorise::<2>(system)?,
            _ => self.factorise::<3>(system)?,
        };
        let n = b[0].len();
        let of_stage = if self.is_forth { Products::forth } else { Products::back };
        let products = self.stages.iter().map(|_| of_stage(n)).collect();
        let (mut p, mut residual) = (vec![0.0; n * b.len()], b.concat());
        let size = keep_free(system, &mut residual);
        let zero = vec![vec![0.0; n]; b.len()];
        let mut equations = FactorisedEquations { equations: self, system, b, zero, products, factors };
        let is_solved = solve(&mut equations, size, &mut residual, &mut p);
        is_solved.then(|| p.chunks_exact(n).map(<[f64]>::to_vec).collect())
    }

    /// Factorises the matrix without the nonsymmetric part of each stage. Returns the solution with its
    /// factors, in place.
    fn factorise<const D: usize>(&self, system: &mut System) -> Option<SolveStages> {
        let places: Vec<Vec<f64>> = self.stages.iter().map(|stage| stage.x.clone()).collect();
        let x = &places[0];
        let matrix = StageMatrix::<D>::new(system, places.len(), true, x)?;
        let mut matrix = matrix.including(system, &places, x)?;
        // A stage has its matrices in the columns of an adjoint, and in the rows of a tangent.
        let is_of = |k: usize, i: usize, j: usize| k == if self.is_forth { i } else { j };
        for (k, stage) in self.stages.iter().enumerate() {
            system.set_time(stage.time);
            system.find_stencils(&stage.x);
            let at = At { x: &stage.x, v: &stage.v, psd: Psd::Exact, predicted_from: None };
            let stiffness = Weights { inertia: 0.0, stiffness: 1.0, damping: 0.0 };
            matrix.add(system, at, stiffness, |i, j| is_of(k, i, j).then(|| self.stiffness[i][j]));
            if system.is_damped() {
                let damping = Weights { inertia: 0.0, stiffness: 0.0, damping: 1.0 };
                matrix.add(system, at, damping, |i, j| is_of(k, i, j).then(|| self.damping[i][j]));
            }
        }
        let drag = system.ether_drag();
        matrix.add_masses(system, |i, j| f64::from(u8::from(i == j)) + self.damping[i][j] * drag);
        let n = system.inverse_mass().len();
        matrix.factorize().then(|| -> SolveStages {
            Box::new(move |b| matrix.solve(&mut b.chunks_exact_mut(n).collect::<Vec<_>>()))
        })
    }
}

/// Solution of all stages with the factors of their matrix, in place, stage after stage.
type SolveStages = Box<dyn FnMut(&mut [f64])>;

/// Equations with factors of a part of their matrix.
struct FactorisedEquations<'a> {
    equations: &'a CoupledEquations<'a>,
    system: &'a mut System,
    b: &'a [Vec<f64>],
    zero: Vec<Vec<f64>>,
    products: Vec<Products>,
    factors: SolveStages,
}

impl FactorisedEquations<'_> {
    /// Writes `b - A p`, or `-A p`, and returns its largest free component.
    fn less_product(&mut self, has_right: bool, p: &[f64], residual: &mut [f64]) -> f64 {
        let FactorisedEquations { equations, system, b, zero, .. } = self;
        let (b, n, d) = (if has_right { *b } else { &zero[..] }, zero[0].len(), system.dimension());
        for (i, residual) in residual.chunks_exact_mut(n).enumerate() {
            for (row, residual) in residual.iter_mut().enumerate() {
                *residual = b[i][row] - system.mass()[row / d] * p[i * n + row];
            }
        }
        match equations.is_forth {
            true => self.subtract_forth(p, residual),
            false => self.subtract_back(p, residual),
        }
        keep_free(self.system, residual)
    }

    /// Subtracts the force products of an adjoint.
    fn subtract_back(&mut self, p: &[f64], residual: &mut [f64]) {
        let FactorisedEquations { equations, system, zero, products, .. } = self;
        let (n, d, drag) = (zero[0].len(), system.dimension(), system.ether_drag());
        for ((stage, p), products) in equations.stages.iter().zip(p.chunks_exact(n)).zip(products.iter_mut())
        {
            system.set_time(stage.time);
            products.evaluate(system, (&stage.x, &stage.v), p);
        }
        for (i, residual) in residual.chunks_exact_mut(n).enumerate() {
            for (row, residual) in residual.iter_mut().enumerate() {
                let mass = system.mass()[row / d];
                for (k, products) in products.iter().enumerate() {
                    let damping = products.by_velocities[row] + drag * mass * p[k * n + row];
                    let stiffness = equations.stiffness[i][k] * products.by_positions[row];
                    *residual -= equations.damping[i][k] * damping + stiffness;
                }
            }
        }
    }

    /// Subtracts the force products of a tangent.
    fn subtract_forth(&mut self, p: &[f64], residual: &mut [f64]) {
        let FactorisedEquations { equations, system, zero, products, .. } = self;
        let (n, d, drag) = (zero[0].len(), system.dimension(), system.ether_drag());
        let is_damped = system.is_damped() || drag != 0.0;
        for (i, (stage, residual)) in equations.stages.iter().zip(residual.chunks_exact_mut(n)).enumerate() {
            let sum = |row: &[f64]| {
                let mut sum = vec![0.0; n];
                row.iter().zip(p.chunks_exact(n)).for_each(|(factor, p)| add_scaled(&mut sum, *factor, p));
                sum
            };
            let (moved, at) = (sum(&equations.stiffness[i]), (&stage.x[..], &stage.v[..]));
            system.set_time(stage.time);
            products[i].evaluate(system, at, &moved);
            add_scaled(residual, -1.0, &products[i].by_positions);
            if is_damped {
                let faster = sum(&equations.damping[i]);
                products[i].evaluate(system, at, &faster);
                add_scaled(residual, -1.0, &products[i].by_velocities);
                let of_drag = residual.iter_mut().zip(&faster).enumerate();
                of_drag.for_each(|(row, (residual, v))| *residual -= drag * system.mass()[row / d] * v);
            }
        }
    }
}

impl CorrectedEquations for FactorisedEquations<'_> {
    fn approximate(&mut self, b: &mut [f64], _: f64) {
        (self.factors)(b);
    }

    fn product(&mut self, p: &[f64], y: &mut [f64]) {
        self.less_product(false, p, y);
        y.iter_mut().for_each(|y| *y = -*y);
    }

    fn residual(&mut self, p: &[f64], residual: &mut [f64]) -> f64 {
        self.less_product(true, p, residual)
    }
}
