//! Adjoint of the generalised-alpha family, including the Newmark methods.
//!
//! The acceleration `a_n` is part of the state. With `X = (1 - alpha_f) x_(n+1) + alpha_f x_n`, `V`
//! likewise, and bars for derivatives of the loss, `p = M^-1` times the derivative by the right-hand side
//! of `(1 - alpha_m) a_(n+1) + alpha_m a_n = a(X, V) - c V` solves
//!
//! ```text
//! ((1 - alpha_m + (1 - alpha_f) gamma h c) M + (1 - alpha_f) (gamma h C + beta h^2 H)) p
//!     = a_bar + h^2 beta x_bar + h gamma v_bar
//! ```
//!
//! The bars on the right are those of the new state; `H` and `C` are defined in [forces](super::forces).
//! If a step has `r` times the size of the one before, `a_n` is replaced by `a_n + s (a_n - a_(n-1))`, `s
//! = (alpha_m - alpha_f) (r - 1)`.

use pliant::integrator::alpha::AlphaCoefficients;

use super::{Adjoint, AdjointForces, AdjointPlace, Bars, Singular, Step, add_scaled, free_only};
use crate::linear::Coefficients;

/// Propagates `adjoint` back over one step.
///
/// # Errors
/// [`Singular`].
pub(super) fn step_back(
    coefficients: &AlphaCoefficients,
    forces: &mut AdjointForces<'_, '_>,
    step: &Step<'_>,
    adjoint: &mut Adjoint,
) -> Result<(), Singular> {
    advance_back(coefficients, forces, step, adjoint)?;
    let Adjoint { a, older_a, .. } = &mut *adjoint;
    a.iter_mut().zip(&mut *older_a).for_each(|(a, older)| *a += std::mem::take(older));
    if step.is_first {
        start_back(forces, step, adjoint);
        return Ok(());
    }
    let moved = moved(coefficients, step.growth);
    if moved != 0.0 {
        a.iter_mut().zip(older_a).for_each(|(a, older)| (*a, *older) = ((1.0 + moved) * *a, -moved * *a));
    }
    Ok(())
}

/// Coefficient `s` of a step of `growth` times the size of the one before.
pub(crate) fn moved(coefficients: &AlphaCoefficients, growth: f64) -> f64 {
    (coefficients.alpha_m - coefficients.alpha_f) * (growth - 1.0)
}

fn advance_back(
    coefficients: &AlphaCoefficients,
    forces: &mut AdjointForces<'_, '_>,
    step: &Step<'_>,
    adjoint: &mut Adjoint,
) -> Result<(), Singular> {
    let AlphaCoefficients { alpha_m, alpha_f, beta, gamma } = *coefficients;
    let (h, drag) = (step.h, forces.system.ether_drag());
    let (new_m, new_f) = (1.0 - alpha_m, 1.0 - alpha_f);
    let Adjoint { x, v, a, .. } = adjoint;
    // Solve at the intermediate state.
    let mut right = a.clone();
    add_scaled(&mut right, h * h * beta, x);
    add_scaled(&mut right, h * gamma, v);
    let between = |(new, old): (&f64, &f64)| new_f * new + alpha_f * old;
    let mut at_x: Vec<f64> = step.x.iter().zip(step.from.x).map(between).collect();
    let mut at_v: Vec<f64> = step.v.iter().zip(step.from.v).map(between).collect();
    let (mut x_bar, mut v_bar) = (vec![0.0; x.len()], vec![0.0; x.len()]);
    let time = step.from.time + new_f * h;
    forces.system.prescribe(time, &mut at_x, &mut at_v);
    let matrix = Coefficients {
        inertia: new_m + new_f * gamma * h * drag,
        damping: new_f * gamma * h,
        stiffness: new_f * beta * h * h,
    };
    let at = AdjointPlace { time, x: &at_x, v: &at_v };
    forces.solve(at, matrix, &mut right, Bars { x: &mut x_bar, v: &mut v_bar })?;
    add_scaled(&mut v_bar, -drag, &right);
    // Distribute to the old state.
    add_scaled(x, new_f, &x_bar);
    add_scaled(v, new_f, &v_bar);
    free_only(forces.system, v);
    for i in 0..x.len() {
        let held = forces.system.inverse_mass()[i] == 0.0;
        let (x_new, v_new) = (x[i], v[i]);
        x[i] += alpha_f * x_bar[i];
        if held {
            (v[i], a[i]) = (0.0, 0.0);
            continue;
        }
        v[i] += h * x_new + alpha_f * v_bar[i];
        a[i] = h * h * (0.5 - beta) * x_new + h * (1.0 - gamma) * v_new - alpha_m * right[i];
    }
    Ok(())
}

/// Adjoint of the initial acceleration, which follows from the initial force.
fn start_back(forces: &mut AdjointForces<'_, '_>, step: &Step<'_>, adjoint: &mut Adjoint) {
    let drag = forces.system.ether_drag();
    let Adjoint { x, v, a, .. } = adjoint;
    forces.acceleration(step.from, a, Bars { x, v });
    add_scaled(v, -drag, a);
    free_only(forces.system, v);
    a.fill(0.0);
}
