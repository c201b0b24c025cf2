//! Linear equations of fully implicit steps, all stages at once, with the exact Hessians.

use pliant::material::Psd;
use pliant::solver::hessian::{Assembler, At, Weights};
use pliant::system::System;
use pliant_sparse::{Lu, SymbolicLu};

use crate::krylov::{CorrectedEquations, keep_free, solve};
use crate::linear::Products;

/// A stage: its time [s], positions and velocities, flat.
pub(crate) struct StagePlace {
    pub(crate) time: f64,
    pub(crate) x: Vec<f64>,
    pub(crate) v: Vec<f64>,
}

/// The equations `M p_i + sum_k [d_ik (C_k + c M) + k_ik (H_k + (d2R/dx dv)_k^T)] p_k = b_i` of stages `i`,
/// `H_k` and `C_k` second derivatives at stage `k`, `c` the ether drag.
pub(crate) struct CoupledEquations<'a> {
    pub(crate) stages: &'a [StagePlace],
    /// True for those of tangents, with `H_k` as they are; false for those of adjoints, with the transposed.
    pub(crate) is_forth: bool,
    /// `d_ik` [s].
    pub(crate) damping: &'a [Vec<f64>],
    /// `k_ik` [s^2].
    pub(crate) stiffness: &'a [Vec<f64>],
}

impl CoupledEquations<'_> {
    /// The solution; zero where held. `None` where there is none.
    pub(crate) fn solve(&self, system: &mut System, b: &[Vec<f64>]) -> Option<Vec<Vec<f64>>> {
        let lu = match system.dimension() {
            2 => self.factorise::<2>(system)?,
            _ => self.factorise::<3>(system)?,
        };
        let n = b[0].len();
        let of_stage = if self.is_forth { Products::forth } else { Products::back };
        let products = self.stages.iter().map(|_| of_stage(n)).collect();
        let (mut p, mut residual) = (vec![0.0; n * b.len()], b.concat());
        let size = keep_free(system, &mut residual);
        let zero = vec![vec![0.0; n]; b.len()];
        let mut equations = FactorisedEquations { equations: self, system, b, zero, products, lu };
        let is_solved = solve(&mut equations, size, &mut residual, &mut p);
        is_solved.then(|| p.chunks_exact(n).map(<[f64]>::to_vec).collect())
    }

    /// Factors of the matrix without its part that is not symmetric at each stage; held coordinates have
    /// rows and columns of the identity.
    fn factorise<const D: usize>(&self, system: &mut System) -> Option<Lu> {
        let (count, drag) = (self.stages.len(), system.ether_drag());
        let mut assembler = Assembler::<D>::new(system);
        let n = system.inverse_mass().len();
        let (mut column_start, mut row, mut entries) = (vec![0], vec![], vec![]);
        for (k, stage) in self.stages.iter().enumerate() {
            let at = At { x: &stage.x, v: &stage.v, psd: Psd::Exact, predicted_from: None };
            system.set_time(stage.time);
            system.find_stencils(&stage.x);
            let mut part = |stiffness, damping| {
                assembler.assemble(system, at, Weights { inertia: 0.0, stiffness, damping });
                assembler.matrix().clone()
            };
            let (hessian, damping) = (part(1.0, 0.0), part(0.0, 1.0));
            for column in 0..n {
                let (vertex, axis) = (column / D, column % D);
                let held = assembler.held()[column];
                for i in 0..count {
                    let blocks = hessian.row(vertex).zip(damping.row(vertex));
                    for ((other, hessian), (_, damping)) in blocks {
                        for l in 0..D {
                            let (at, diagonal) = (other * D + l, other * D + l == column);
                            let mass = if diagonal { system.mass()[vertex] } else { 0.0 };
                            let own = f64::from(u8::from(i == k));
                            row.push(i * n + at);
                            entries.push(if held || assembler.held()[at] {
                                if diagonal { own } else { 0.0 }
                            } else {
                                own * mass
                                    + self.damping[i][k] * (damping[axis][l] + drag * mass)
                                    + self.stiffness[i][k] * hessian[axis][l]
                            });
                        }
                    }
                }
                column_start.push(row.len());
            }
        }
        SymbolicLu::new(column_start, row)?.factorize(&entries)
    }
}

/// The equations with factors of a part of their matrix.
struct FactorisedEquations<'a> {
    equations: &'a CoupledEquations<'a>,
    system: &'a mut System,
    b: &'a [Vec<f64>],
    zero: Vec<Vec<f64>>,
    products: Vec<Products>,
    lu: Lu,
}

impl FactorisedEquations<'_> {
    /// Writes `b - A p`, or `-A p`; gives its largest free component.
    fn less_product(&mut self, has_right: bool, p: &[f64], residual: &mut [f64]) -> f64 {
        let FactorisedEquations { equations, system, b, zero, products, .. } = self;
        let (b, n, d) = (if has_right { *b } else { &zero[..] }, zero[0].len(), system.dimension());
        let drag = system.ether_drag();
        for ((stage, p), products) in equations.stages.iter().zip(p.chunks_exact(n)).zip(products.iter_mut())
        {
            system.set_time(stage.time);
            products.evaluate(system, (&stage.x, &stage.v), p);
        }
        for (i, residual) in residual.chunks_exact_mut(n).enumerate() {
            for (row, residual) in residual.iter_mut().enumerate() {
                let mass = system.mass()[row / d];
                let mut sum = b[i][row] - mass * p[i * n + row];
                for (k, products) in products.iter().enumerate() {
                    let damping = products.by_velocities[row] + drag * mass * p[k * n + row];
                    let stiffness = equations.stiffness[i][k] * products.by_positions[row];
                    sum -= equations.damping[i][k] * damping + stiffness;
                }
                *residual = sum;
            }
        }
        keep_free(system, residual)
    }
}

impl CorrectedEquations for FactorisedEquations<'_> {
    fn approximate(&mut self, b: &mut [f64]) {
        self.lu.solve(b);
    }

    fn product(&mut self, p: &[f64], y: &mut [f64]) {
        self.less_product(false, p, y);
        y.iter_mut().for_each(|y| *y = -*y);
    }

    fn residual(&mut self, p: &[f64], residual: &mut [f64]) -> f64 {
        self.less_product(true, p, residual)
    }
}
