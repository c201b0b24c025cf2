//! The equations of motion as engines ask for them: one call gives the acceleration with everything in it,
//! one ends a step. What acts on a system, prescribed motion, forces, dissipation, drag, walls, is known here
//! and to no engine.
//!
//! Implicit solves have the same equations as the gradient of their objective (`solver`), and splittings,
//! which advance vertices block by block while they are in the cache, as passes (`pass`).

use crate::algebra::all_finite;
use crate::lanes::Numbers;
use crate::solver::StepFault;
use crate::state::State;
use crate::system::{ForceId, System};

/// Writes the acceleration `x'' = -M^-1 (dE/dx + dR/dv) - c v` [m/s^2] at `time` [s] and at positions `x` and
/// velocities `v` over `a`; coordinates on prescribed motion are put to their places first. The force is not
/// evaluated again where the system still holds the one that is `known` there.
///
/// # Errors
/// A position, or the force, is not finite.
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

/// The same where the system holds the force.
pub(super) fn acceleration(system: &mut System, x: &[f64], v: &[f64], a: &mut [f64]) {
    system.evaluate_dissipation(x, v);
    system.accelerations(a);
    let drag = system.ether_drag();
    if drag != 0.0 {
        a.iter_mut().zip(v).for_each(|(a, v)| *a -= drag * v);
    }
}

/// `(1 - exp(-z))/z`: the share that drag at the rate `z` per step leaves of the velocity that a constant
/// force makes in one.
pub(super) fn exact_response(z: f64) -> f64 {
    -(-z).exp_m1() / z
}

/// Ends a step of `h` [s] at positions `x` and velocities `v`, where the force is `force`: moves what is
/// prescribed to its place, lets walls act, and makes them the state, whose old rows they become. A force
/// that acts throughout the step under drag at the rate `c` has made `response(c h)` of the velocity that
/// it makes without drag.
///
/// # Errors
/// A position or velocity is not finite; the state is what it was.
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
