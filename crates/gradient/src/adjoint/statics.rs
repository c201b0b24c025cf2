//! Adjoint of static equilibria: `dE/dx = 0` at the free coordinates, independent of the state before.
//!
//! Dissipation such as friction resists the path from one equilibrium to the next. With velocities `v =
//! (x - x_n)/h` of the free coordinates, and those of the prescribed motion of the others,
//!
//! ```text
//! dE/dx + dR/dv(x, v) = 0      (H + C/h) p = x_bar      x_n_bar = C p / h
//! ```
//!
//! with `H` and `C` defined in [forces](super::forces).

use super::{Adjoint, AdjointForces, AdjointPlace, Bars, Singular, Step};
use crate::linear::Coefficients;

/// Propagates `adjoint` back over one equilibrium. Derivatives remain by the positions of fixed
/// coordinates, and through dissipation by those of the free ones.
///
/// # Errors
/// [`Singular`].
pub(super) fn step_back(
    forces: &mut AdjointForces<'_, '_>,
    step: &Step<'_>,
    adjoint: &mut Adjoint,
) -> Result<(), Singular> {
    let Adjoint { x, v, .. } = adjoint;
    let mut right = x.clone();
    let at = AdjointPlace { time: step.from.time + step.h, x: step.x, v: velocities(step) };
    v.fill(0.0);
    forces.solve(at, coefficients(step.h), &mut right, Bars { x, v: &mut *v })?;
    let free = x.iter_mut().zip(v).zip(forces.system.inverse_mass());
    for ((x, v), weight) in free {
        *x = if *weight > 0.0 { -*v / step.h } else { *x };
        *v = 0.0;
    }
    Ok(())
}

/// Coefficients of the matrix of a load increment of `h` [s].
pub(crate) fn coefficients(h: f64) -> Coefficients {
    Coefficients { inertia: 0.0, damping: 1.0 / h, stiffness: 1.0 }
}

/// Velocities used by dissipation [m/s]; those of the state if there is none.
pub(crate) fn velocities<'a>(step: &Step<'a>) -> &'a [f64] {
    step.stage_velocities.first().map_or(step.v, |seen| seen)
}
