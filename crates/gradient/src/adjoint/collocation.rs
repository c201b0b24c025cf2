//! The adjoint of fully implicit Runge-Kutta methods: the stages of a step are taken back together.
//!
//! As of [diagonally implicit ones](super::runge_kutta), where each stage looks at all:
//!
//! ```text
//! M p_i = A_bar_i + h sum_j a_ji V_bar_j      X_bar_k = -H_k p_k
//! V_bar_j = h b_j x_bar + h sum_k a_kj X_bar_k - C_j p_j - c M p_j
//! ```
//!
//! Eliminated: `M p_i + sum_k [h a_ki (C_k + c M) + h^2 (A^2)_ki H_k] p_k = h b_i v_bar + h^2 sum_j a_ji
//! b_j x_bar`.

use pliant::integrator::collocation::CollocationTableau;
use pliant::system::System;

use super::{Adjoint, AdjointForces, AdjointPlace, Bars, Singular, Step, add_scaled, free_only};
use crate::coupled::{CoupledEquations, StagePlace};

/// Takes `adjoint` back by one step of this method.
///
/// # Errors
/// [`Singular`].
pub(super) fn step_back(
    tableau: &CollocationTableau,
    forces: &mut AdjointForces<'_, '_>,
    step: &Step<'_>,
    adjoint: &mut Adjoint,
) -> Result<(), Singular> {
    let CollocationTableau { a, b } = *tableau;
    let (h, s) = (step.h, 0..b.len());
    let stages: Vec<StagePlace> =
        a.iter().enumerate().map(|(i, row)| place(forces.system, step, i, row)).collect();
    let table = |entry: &dyn Fn(usize, usize) -> f64| -> Vec<Vec<f64>> {
        s.clone().map(|i| s.clone().map(|k| entry(i, k)).collect()).collect()
    };
    let damping = table(&|i, k| h * a[k][i]);
    let stiffness = table(&|i, k| h * h * s.clone().map(|j| a[k][j] * a[j][i]).sum::<f64>());
    let right = |i: usize| {
        let by_positions: f64 = h * h * s.clone().map(|j| a[j][i] * b[j]).sum::<f64>();
        let rows = adjoint.x.iter().zip(&adjoint.v);
        rows.map(|(x, v)| h * b[i] * v + by_positions * x).collect::<Vec<f64>>()
    };
    let rights: Vec<Vec<f64>> = s.clone().map(right).collect();
    let equations =
        CoupledEquations { stages: &stages, is_forth: false, damping: &damping, stiffness: &stiffness };
    let p = equations.solve(forces.system, &rights).ok_or(Singular)?;
    pass_on(tableau, forces, step, (&stages, &p), adjoint);
    Ok(())
}

/// Takes what the directions `p` of the stages make of derivatives to the state before the step.
fn pass_on(
    tableau: &CollocationTableau,
    forces: &mut AdjointForces<'_, '_>,
    step: &Step<'_>,
    (stages, p): (&[StagePlace], &[Vec<f64>]),
    adjoint: &mut Adjoint,
) {
    let CollocationTableau { a, b } = *tableau;
    let (d, drag) = (forces.system.dimension(), forces.system.ether_drag());
    let Adjoint { x, v, .. } = adjoint;
    let x_new = x.clone();
    for (k, (stage, p)) in stages.iter().zip(p).enumerate() {
        let (mut x_bar, mut v_bar) = (vec![0.0; p.len()], vec![0.0; p.len()]);
        let at = AdjointPlace { time: stage.time, x: &stage.x, v: &stage.v };
        forces.direction(at, p, Bars { x: &mut x_bar, v: &mut v_bar });
        for (i, v_bar) in v_bar.iter_mut().enumerate() {
            *v_bar += step.h * b[k] * x_new[i] - drag * forces.system.mass()[i / d] * p[i];
        }
        // Velocities of all stages look at this one: their derivatives go to the old velocity.
        add_scaled(&mut v_bar, step.h * a[k].iter().sum::<f64>(), &x_bar);
        add_scaled(x, 1.0, &x_bar);
        add_scaled(v, 1.0, &v_bar);
    }
    free_only(forces.system, v);
}

/// Where stage `i` of this row was.
pub(crate) fn place(system: &mut System, step: &Step<'_>, i: usize, row: &[f64]) -> StagePlace {
    let (mut x, mut v) = (step.from.x.to_vec(), step.stage_velocities[i].clone());
    for (a, velocity) in row.iter().zip(step.stage_velocities) {
        add_scaled(&mut x, step.h * a, velocity);
    }
    let time = step.from.time + row.iter().sum::<f64>() * step.h;
    system.prescribe(time, &mut x, &mut v);
    StagePlace { time, x, v }
}
