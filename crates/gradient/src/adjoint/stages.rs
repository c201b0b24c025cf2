//! Stages of fully implicit Runge-Kutta methods and of the Gauss-Radau method, in which all stages are
//! coupled.

use std::sync::LazyLock;

use pliant::integrator::collocation::CollocationTableau;
use pliant::integrator::gauss_radau::NODES;
use pliant::system::System;

use super::{Step, add_scaled};
use crate::coupled::StagePlace;

/// Tables that give positions and velocities of the stages, and the end of a step, from the stage
/// accelerations `A_j`:
///
/// ```text
/// X_i = x + c_i h v + h^2 sum_j t_ij A_j      x' = x + h v + h^2 sum_j e_j A_j
/// V_i = v + h sum_j a_ij A_j                  v' = v + h sum_j b_j A_j
/// ```
pub(crate) struct StageTables {
    /// `c_i`.
    pub(crate) nodes: Vec<f64>,
    /// `a_ij`.
    pub(crate) once: Vec<Vec<f64>>,
    /// `t_ij`.
    pub(crate) twice: Vec<Vec<f64>>,
    /// `b_j`.
    pub(crate) end_once: Vec<f64>,
    /// `e_j`.
    pub(crate) end_twice: Vec<f64>,
}

/// Nodes and weights of the Gauss-Legendre rule on [0, 1], exact to degree 9.
const GAUSS: [(f64, f64); 5] = [
    (0.046_910_077_030_668_004, 0.118_463_442_528_094_54),
    (0.230_765_344_947_158_45, 0.239_314_335_249_683_24),
    (0.5, 0.284_444_444_444_444_44),
    (0.769_234_655_052_841_6, 0.239_314_335_249_683_24),
    (0.953_089_922_969_332, 0.118_463_442_528_094_54),
];

impl StageTables {
    /// Tables of a fully implicit method, `t = A^2`, `e = b^T A`.
    pub(crate) fn of_tableau(tableau: &CollocationTableau) -> Self {
        let CollocationTableau { a, b } = *tableau;
        let count = b.len();
        let after = |row: &[f64]| -> Vec<f64> {
            (0..count).map(|l| (0..count).map(|j| row[j] * a[j][l]).sum()).collect()
        };
        StageTables {
            nodes: a.iter().map(|row| row.iter().sum()).collect(),
            once: a.iter().map(|row| row.to_vec()).collect(),
            twice: a.iter().map(|row| after(row)).collect(),
            end_once: b.to_vec(),
            end_twice: after(b),
        }
    }

    /// Tables of the Gauss-Radau method: integrals of the polynomial through the accelerations at its
    /// nodes. `a_ij` is the integral of Lagrange's `L_j` up to `c_i`, `t_ij` that of `(c_i - s) L_j`.
    pub(crate) fn gauss_radau() -> &'static Self {
        static TABLES: LazyLock<StageTables> = LazyLock::new(StageTables::integrated);
        &TABLES
    }

    fn integrated() -> Self {
        let lagrange = |j: usize, s: f64| -> f64 {
            let others = NODES.iter().enumerate().filter(|(k, _)| *k != j);
            others.map(|(_, node)| (s - node) / (NODES[j] - node)).product()
        };
        let integral = |to: f64, j: usize, factor: &dyn Fn(f64) -> f64| -> f64 {
            let part = |(node, weight): &(f64, f64)| to * weight * factor(to * node) * lagrange(j, to * node);
            GAUSS.iter().map(part).sum()
        };
        let once = |to: f64| (0..NODES.len()).map(|j| integral(to, j, &|_| 1.0)).collect();
        let twice = |to: f64| (0..NODES.len()).map(|j| integral(to, j, &|s| to - s)).collect();
        StageTables {
            nodes: NODES.to_vec(),
            once: NODES.iter().map(|node| once(*node)).collect(),
            twice: NODES.iter().map(|node| twice(*node)).collect(),
            end_once: once(1.0),
            end_twice: twice(1.0),
        }
    }

    /// Number of stages.
    pub(crate) fn count(&self) -> usize {
        self.nodes.len()
    }

    /// Evaluation points of the stages of a step.
    pub(crate) fn places(&self, system: &mut System, step: &Step<'_>) -> Vec<StagePlace> {
        let place = |i: usize| {
            let mut x = step.from.x.to_vec();
            let v = match step.stage_accelerations {
                [] => {
                    let velocities = self.once[i].iter().zip(step.stage_velocities);
                    velocities.for_each(|(a, velocity)| add_scaled(&mut x, step.h * a, velocity));
                    step.stage_velocities[i].clone()
                }
                accelerations => {
                    let mut v = step.from.v.to_vec();
                    add_scaled(&mut x, step.h * self.nodes[i], step.from.v);
                    for ((once, twice), a) in self.once[i].iter().zip(&self.twice[i]).zip(accelerations) {
                        add_scaled(&mut x, step.h * step.h * twice, a);
                        add_scaled(&mut v, step.h * once, a);
                    }
                    v
                }
            };
            (step.from.time + self.nodes[i] * step.h, x, v)
        };
        let places = (0..self.count()).map(place).map(|(time, mut x, mut v)| {
            system.prescribe(time, &mut x, &mut v);
            StagePlace { time, x, v }
        });
        places.collect()
    }
}
