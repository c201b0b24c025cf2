//! Linear equations of fully implicit steps, all stages at once, with the exact Hessians.

use pliant::material::Psd;
use pliant::solver::hessian::{Assembler, At, Weights};
use pliant::system::System;
use pliant_sparse::{Lu, SymbolicLu};

use crate::krylov::correction;
use crate::linear::{NO_SOLUTION, Products, ROUNDING, SLOW};

/// Corrections of a solution.
const CORRECTIONS: u32 = 40;

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
        let mut products: Vec<Products> = self.stages.iter().map(|_| Products::new(n)).collect();
        let mut p = vec![vec![0.0; n]; b.len()];
        let mut residual: Vec<f64> = b.concat();
        let size = keep_free(system, &mut residual);
        let (mut last, mut is_slow) = (f64::INFINITY, false);
        let zero = vec![vec![0.0; n]; b.len()];
        for _ in 0..CORRECTIONS {
            if is_slow {
                residual = correction(&residual, &mut |b| lu.solve(b), &mut |p, y| {
                    let rows: Vec<Vec<f64>> = p.chunks_exact(n).map(<[f64]>::to_vec).collect();
                    self.residual(system, &zero, &rows, &mut products, y);
                    y.iter_mut().for_each(|y| *y = -*y);
                });
            } else {
                lu.solve(&mut residual);
            }
            for (p, correction) in p.iter_mut().zip(residual.chunks_exact(n)) {
                p.iter_mut().zip(correction).for_each(|(p, correction)| *p += correction);
            }
            let left = self.residual(system, b, &p, &mut products, &mut residual);
            if left <= ROUNDING * size || (left <= NO_SOLUTION * size && left >= SLOW * last) {
                return Some(p);
            }
            if is_slow && left >= SLOW * last {
                break;
            }
            is_slow |= left >= SLOW * last;
            last = left;
        }
        None
    }

    /// Writes `b - A p`; gives its largest free component.
    fn residual(
        &self,
        system: &mut System,
        b: &[Vec<f64>],
        p: &[Vec<f64>],
        products: &mut [Products],
        residual: &mut [f64],
    ) -> f64 {
        let (n, d, drag) = (b[0].len(), system.dimension(), system.ether_drag());
        for ((stage, p), products) in self.stages.iter().zip(p).zip(products.iter_mut()) {
            system.set_time(stage.time);
            products.evaluate(system, (&stage.x, &stage.v), p);
        }
        for (i, residual) in residual.chunks_exact_mut(n).enumerate() {
            for (row, residual) in residual.iter_mut().enumerate() {
                let mass = system.mass()[row / d];
                let mut sum = b[i][row] - mass * p[i][row];
                for (k, products) in products.iter().enumerate() {
                    let damping = products.by_velocities[row] + drag * mass * p[k][row];
                    sum -= self.damping[i][k] * damping + self.stiffness[i][k] * products.by_positions[row];
                }
                *residual = sum;
            }
        }
        keep_free(system, residual)
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

/// Makes held components of all stages zero; gives the largest of the others, infinite where one is no
/// number.
fn keep_free(system: &System, rows: &mut [f64]) -> f64 {
    let weights = system.inverse_mass();
    rows.iter_mut().enumerate().fold(0.0, |largest: f64, (i, row)| {
        *row = if weights[i % weights.len()] == 0.0 { 0.0 } else { *row };
        if row.is_nan() { f64::INFINITY } else { largest.max(row.abs()) }
    })
}
