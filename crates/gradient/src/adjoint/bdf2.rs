//! Adjoint of the second-order backward differentiation formula (BDF2).
//!
//! `X = (4 x_n - x_(n-1))/3 + g V`, `V = (4 v_n - v_(n-1))/3 + g (a(X) - c V)`, `g = 2/3 h`: one
//! diagonally implicit stage whose old state combines two steps.

use pliant::integrator::Method;

use super::{
    Adjoint, AdjointForces, AdjointPlace, Bars, Singular, Step, add_scaled, free_only,
    step_back as step_back_by,
};
use crate::linear::Coefficients;

/// Propagates `adjoint` back over one step, the first one of the method `start`.
///
/// # Errors
/// [`Singular`].
pub(super) fn step_back<'a>(
    start: Method,
    forces: &mut AdjointForces<'a, '_>,
    step: &Step<'a>,
    adjoint: &mut Adjoint,
) -> Result<(), Singular> {
    // A step of another size restarts the method.
    if !step.is_first && step.growth == 1.0 {
        return advance_back(forces, step, adjoint);
    }
    step_back_by(&start, forces, step, adjoint)?;
    let Adjoint { x, v, older, .. } = adjoint;
    for (now, older) in [x, v].into_iter().zip(older) {
        add_scaled(now, 1.0, older);
        older.fill(0.0);
    }
    Ok(())
}

fn advance_back(
    forces: &mut AdjointForces<'_, '_>,
    step: &Step<'_>,
    adjoint: &mut Adjoint,
) -> Result<(), Singular> {
    let (g, drag) = (2.0 / 3.0 * step.h, forces.system.ether_drag());
    let Adjoint { x, v, older, .. } = adjoint;
    let mut right = vec![0.0; x.len()];
    add_scaled(&mut right, g, v);
    add_scaled(&mut right, g * g, x);
    let coefficients = Coefficients { inertia: 1.0 + g * drag, damping: g, stiffness: g * g };
    let at = AdjointPlace { time: step.from.time + step.h, x: step.x, v: step.v };
    forces.solve(at, coefficients, &mut right, Bars { x, v })?;
    add_scaled(v, g, x);
    add_scaled(v, -drag, &right);
    free_only(forces.system, v);
    // The derivative left by the step before last belongs to the state at the beginning of this one.
    for (now, older) in [x, v].into_iter().zip(older) {
        for (now, older) in now.iter_mut().zip(older) {
            (*now, *older) = (4.0 / 3.0 * *now + *older, -*now / 3.0);
        }
    }
    Ok(())
}
