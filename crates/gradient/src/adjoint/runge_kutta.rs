//! Adjoint of Runge-Kutta methods, explicit and diagonally implicit: stages in reverse order.
//!
//! With `X_i = x_n + h sum_j a_ij V_j`, `V_i = v_n + h sum_j a_ij A_j`, `A_i = a(X_i, V_i) - c V_i` and
//! bars for derivatives of the loss, stage `i` solves for `p = M^-1` times the derivative by `A_i`, `g =
//! h a_ii`:
//!
//! ```text
//! ((1 + g c) M + g C + g^2 H) p = A_bar + g V_bar
//! X_bar = -H p      V_bar += g X_bar - C p - c M p
//! ```
//!
//! where `H = d2E/dx2 + (d2R/dx dv)^T` and `C = d2R/dv2` are taken at the stage; the bars on the right
//! are those of later stages and of the new state. Then `X_bar` and `V_bar` are added to the old state
//! and, times `h a_ij`, to the velocities and accelerations of earlier stages. Hager 2000, "Runge-Kutta
//! methods in optimal control and the transformed adjoint system", Numerische Mathematik 87, 247, derives
//! this for explicit methods.

use pliant::integrator::tableau::Tableau;
use pliant::system::System;

use super::{Adjoint, AdjointForces, AdjointPlace, Bars, Singular, Step, add_scaled, free_only};
use crate::linear::Coefficients;

/// Propagates `adjoint` back over one step of this method.
///
/// # Errors
/// [`Singular`].
pub(super) fn step_back<'a>(
    tableau: &Tableau,
    forces: &mut AdjointForces<'a, '_>,
    step: &Step<'a>,
    adjoint: &mut Adjoint,
) -> Result<(), Singular> {
    let Tableau { a, b, .. } = *tableau;
    let (h, drag) = (step.h, forces.system.ether_drag());
    let scaled = |rows: &[f64], c: f64| rows.iter().map(|row| c * row).collect::<Vec<f64>>();
    let mut v_bar: Vec<_> = b.iter().map(|b| scaled(&adjoint.x, h * b)).collect();
    let mut a_bar: Vec<_> = b.iter().map(|b| scaled(&adjoint.v, h * b)).collect();
    for (i, row) in a.iter().enumerate().rev() {
        let (mut v, mut right) = (std::mem::take(&mut v_bar[i]), std::mem::take(&mut a_bar[i]));
        let g = h * row.get(i).copied().unwrap_or(0.0);
        free_only(forces.system, &mut v);
        free_only(forces.system, &mut right);
        // Evaluation point of the stage.
        let time = step.from.time + node(row) * h;
        let (mut at_x, mut at_v) = (position(step, row), step.stage_velocities[i].clone());
        forces.system.prescribe(time, &mut at_x, &mut at_v);
        forces.means_from = set_means_of_held(tableau, forces.system, step, (&at_x, &mut at_v));
        let at = AdjointPlace { time, x: &at_x, v: &at_v };
        // Adjoint of the stage.
        let mut x = vec![0.0; at.x.len()];
        if g == 0.0 {
            forces.acceleration(at, &right, Bars { x: &mut x, v: &mut v });
        } else {
            add_scaled(&mut right, g, &v);
            let coefficients = Coefficients { inertia: 1.0 + g * drag, damping: g, stiffness: g * g };
            forces.solve(at, coefficients, &mut right, Bars { x: &mut x, v: &mut v })?;
        }
        // Distribute to earlier stages and to the old state.
        add_scaled(&mut v, g, &x);
        add_scaled(&mut v, -drag, &right);
        free_only(forces.system, &mut v);
        for (j, a) in row.iter().enumerate().take(i).filter(|(_, a)| **a != 0.0) {
            add_scaled(&mut v_bar[j], h * a, &x);
            add_scaled(&mut a_bar[j], h * a, &v);
        }
        add_scaled(&mut adjoint.x, 1.0, &x);
        add_scaled(&mut adjoint.v, 1.0, &v);
    }
    free_only(forces.system, &mut adjoint.v);
    Ok(())
}

/// Sets the velocities `v` of fixed coordinates at `x` to their means over the step, if dissipative terms
/// use these. Returns the beginning of the step and its size [s], or `None` if they use the prescribed
/// velocities.
pub(crate) fn set_means_of_held<'a>(
    tableau: &Tableau,
    system: &System,
    step: &Step<'a>,
    (x, v): (&[f64], &mut [f64]),
) -> Option<(AdjointPlace<'a>, f64)> {
    if !(tableau.is_backward_euler() && system.rubs_by_way()) {
        return None;
    }
    for i in (0..x.len()).filter(|i| system.inverse_mass()[*i] == 0.0) {
        v[i] = (x[i] - step.from.x[i]) / step.h;
    }
    Some((step.from, step.h))
}

/// Positions of the stage with this row of the tableau.
pub(crate) fn position(step: &Step<'_>, row: &[f64]) -> Vec<f64> {
    let mut x = step.from.x.to_vec();
    for (a, velocity) in row.iter().zip(step.stage_velocities).filter(|(a, _)| **a != 0.0) {
        add_scaled(&mut x, step.h * a, velocity);
    }
    x
}

/// Node of a stage, in steps; exactly 1 at the end of the step, as in the forward run.
pub(crate) fn node(row: &[f64]) -> f64 {
    let sum = row.iter().sum::<f64>();
    if (sum - 1.0).abs() < 1e-14 { 1.0 } else { sum }
}
