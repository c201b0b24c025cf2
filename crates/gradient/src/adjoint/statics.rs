//! The adjoint of static equilibria: `dE/dx = 0` at the free coordinates, whatever was before.

use super::{Adjoint, AdjointForces, AdjointPlace, Bars, Singular, Step};
use crate::linear::Coefficients;

/// Takes `adjoint` back by one equilibrium: only the places of held coordinates are left of it.
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
    let at = AdjointPlace { time: step.from.time + step.h, x: step.x, v: step.v };
    let stiffness = Coefficients { inertia: 0.0, damping: 0.0, stiffness: 1.0 };
    forces.solve(at, stiffness, &mut right, Bars { x, v })?;
    v.fill(0.0);
    let free = x.iter_mut().zip(forces.system.inverse_mass()).filter(|(_, weight)| **weight > 0.0);
    free.for_each(|(x, _)| *x = 0.0);
    Ok(())
}
