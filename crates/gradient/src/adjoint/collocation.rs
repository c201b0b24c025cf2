//! Adjoint of fully implicit (collocation) methods: the coupled stages of a step are solved together.
//!
//! With [tables](StageTables) `a`, `t` of the stages and `b`, `e` of the end of the step,
//!
//! ```text
//! M p_j = h^2 e_j x_bar + h b_j v_bar + sum_i [h^2 t_ij X_bar_i + h a_ij V_bar_i]
//! X_bar_i = -H_i p_i      V_bar_i = -C_i p_i - c M p_i
//! ```
//!
//! After elimination: `M p_i + sum_k [h a_ki (C_k + c M) + h^2 t_ki H_k] p_k = h b_i v_bar + h^2 e_i
//! x_bar`. The Gauss-Radau method iterates until its stages solve their equations, which are
//! differentiated like those of the other methods.

use super::{Adjoint, AdjointForces, AdjointPlace, Bars, Singular, StageTables, Step, add_scaled, free_only};
use crate::coupled::{CoupledEquations, StagePlace};

/// Propagates `adjoint` back over one step of this method.
///
/// # Errors
/// [`Singular`].
pub(super) fn step_back(
    tables: &StageTables,
    forces: &mut AdjointForces<'_, '_>,
    step: &Step<'_>,
    adjoint: &mut Adjoint,
) -> Result<(), Singular> {
    let StageTables { once, twice, end_once, end_twice, .. } = tables;
    let (h, s) = (step.h, 0..tables.count());
    let stages = tables.places(forces.system, step);
    let transposed = |factor: f64, table: &[Vec<f64>]| -> Vec<Vec<f64>> {
        s.clone().map(|i| s.clone().map(|k| factor * table[k][i]).collect()).collect()
    };
    let (damping, stiffness) = (transposed(h, once), transposed(h * h, twice));
    let right = |i: usize| {
        let (by_v, by_x) = (h * end_once[i], h * h * end_twice[i]);
        adjoint.x.iter().zip(&adjoint.v).map(|(x, v)| by_v * v + by_x * x).collect::<Vec<f64>>()
    };
    let rights: Vec<Vec<f64>> = s.clone().map(right).collect();
    let equations =
        CoupledEquations { stages: &stages, is_forth: false, damping: &damping, stiffness: &stiffness };
    let p = equations.solve(forces.system, &rights).ok_or(Singular)?;
    pass_on(tables, forces, step.h, (&stages, &p), adjoint);
    Ok(())
}

/// Propagates the stage directions `p` to the derivatives by the state before the step of `h` [s].
fn pass_on(
    tables: &StageTables,
    forces: &mut AdjointForces<'_, '_>,
    h: f64,
    (stages, p): (&[StagePlace], &[Vec<f64>]),
    adjoint: &mut Adjoint,
) {
    let (d, drag) = (forces.system.dimension(), forces.system.ether_drag());
    let Adjoint { x, v, .. } = adjoint;
    let whole: f64 = tables.end_once.iter().sum();
    add_scaled(v, h * whole, x);
    for ((stage, p), node) in stages.iter().zip(p).zip(&tables.nodes) {
        let (mut x_bar, mut v_bar) = (vec![0.0; p.len()], vec![0.0; p.len()]);
        let at = AdjointPlace { time: stage.time, x: &stage.x, v: &stage.v };
        forces.direction(at, p, Bars { x: &mut x_bar, v: &mut v_bar });
        for (i, v_bar) in v_bar.iter_mut().enumerate() {
            *v_bar -= drag * forces.system.mass()[i / d] * p[i];
        }
        add_scaled(&mut v_bar, h * node, &x_bar);
        add_scaled(x, 1.0, &x_bar);
        add_scaled(v, 1.0, &v_bar);
    }
    free_only(forces.system, v);
}
