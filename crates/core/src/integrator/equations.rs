//! The equations of motion for the integrators: one function computes the full acceleration, another ends
//! a step. Prescribed motion, forces, dissipation, drag and walls are handled here and in no integrator.
//!
//! Implicit solves see the same equations as the gradient of their objective (`solver`). Splittings
//! advance vertices block by block while they are in the cache, and use passes (`pass`).

use crate::algebra::all_finite;
use crate::lanes::Numbers;
use crate::solver::StepFault;
use crate::state::State;
use crate::system::{ForceId, System};

/// Writes the acceleration `x'' = -M^-1 (dE/dx + dR/dv) - c v` [m/s^2] at `time` [s], positions `x` and
/// velocities `v` to `a`. Sets prescribed coordinates first. Does not evaluate the force again if the
/// system still holds the one `known` here.
///
/// # Errors
/// If a position or the force is not finite.
pub(crate) fn acceleration_at(
    system: &mut System,
    time: f64,
    (x, v): (&mut [f64], &mut [f64]),
    known: ForceId,
    a: &mut [f64],
) -> Result<(), StepFault> {
    system.set_time(time);
    let prescribed = system.prescribe(time, x, v);
    if !prescribed || !system.holds(known) && system.evaluate(x).is_none() {
        return Err(StepFault::at(system, x, v));
    }
    acceleration(system, x, v, a);
    Ok(())
}

/// Computes the acceleration if the system already holds the force.
pub(super) fn acceleration(system: &mut System, x: &[f64], v: &[f64], a: &mut [f64]) {
    system.evaluate_dissipation(x, v);
    system.accelerations(a);
    let drag = system.ether_drag();
    if drag != 0.0 {
        a.iter_mut().zip(v).for_each(|(a, v)| *a -= drag * v);
    }
}

/// `(1 - exp(-z))/z`: velocity that a constant force produces in one step under drag at the rate `z` per
/// step, as a fraction of that without drag.
pub(super) fn exact_response(z: f64) -> f64 {
    -libm::expm1(-z) / z
}

/// Ends a step of `h` [s] at positions `x` and velocities `v`, where the force is `force`. Sets
/// prescribed coordinates, applies walls, and swaps `x` and `v` with the state. Under drag at the rate
/// `c`, a constant force has produced the fraction `response(c h)` of the velocity that it produces
/// without drag.
///
/// # Errors
/// If a position or velocity is not finite; the state is then unchanged.
pub(super) fn end_step(
    system: &mut System,
    state: &mut State,
    h: f64,
    (x, v): (&mut Numbers, &mut Numbers),
    force: ForceId,
    response: &dyn Fn(f64) -> f64,
) -> Result<(), StepFault> {
    system.prescribe(state.time + h, x, v);
    if !(all_finite(x) && all_finite(v)) {
        return Err(StepFault::at(system, x, v));
    }
    let put_back = system.apply_walls(state, h, (x, v), response);
    state.swap(x, v, if put_back { ForceId::NONE } else { force });
    Ok(())
}
