//! Warnings of numbers below round-off: steps that move nothing, tolerances that cannot be met.

use crate::Scene;
use pliant::quantity::Rounded;
use pliant::simulation::Simulation;

/// Fraction of the moving coordinates that a step may leave unchanged.
const STUCK: f64 = 0.5;

/// One warning for each such number.
pub(super) fn warnings(scene: &Scene, simulation: &Simulation) -> Vec<String> {
    still(simulation).into_iter().chain(tolerance(scene, simulation)).collect()
}

/// Warns of a step in which velocities change coordinates by less than their rounding.
fn still(simulation: &Simulation) -> Option<String> {
    if simulation.method().is_static() || simulation.step_control().is_some() {
        return None;
    }
    let (system, state, h) = (simulation.system(), simulation.state(), simulation.step_size());
    let rows = state.x().iter().zip(state.v()).zip(system.inverse_mass());
    let moving: Vec<(f64, f64)> =
        rows.filter(|((_, v), w)| **v != 0.0 && **w > 0.0).map(|((x, v), _)| (*x, *v)).collect();
    let stuck = moving.iter().filter(|(x, v)| x + h * v == *x).count();
    let (x, v) = moving.iter().copied().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
    (stuck as f64 > STUCK * moving.len() as f64).then(|| {
        format!(
            "a step of {} s moves nothing: at {} m/s that is {} m, and positions of {} m are rounded to {} \
             m; take larger steps, or put the scene near the origin",
            Rounded::<3>(h),
            Rounded::<3>(v.abs()),
            Rounded::<3>(h * v.abs()),
            Rounded::<3>(x.abs()),
            Rounded::<2>(f64::EPSILON * x.abs()),
        )
    })
}

/// Warns of a Newton tolerance below the rounding of positions.
fn tolerance(scene: &Scene, simulation: &Simulation) -> Option<String> {
    if simulation.method().documentation.solves == 0 {
        return None;
    }
    let tolerance = scene.time.solver.as_ref()?.tolerance?;
    let reach = simulation.state().x().iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    let rounding = f64::EPSILON * reach.max(simulation.length_scale());
    (tolerance < rounding).then(|| {
        format!(
            "[time] solver `tolerance = {}` m is below the round-off of positions, {} m, so it cannot be \
             met; {} m can",
            Rounded::<3>(tolerance),
            Rounded::<2>(rounding),
            Rounded::<1>(1e3 * rounding),
        )
    })
}
