//! Step sizes that follow the error.

use crate::Scene;
use pliant::control::StepControl;
use pliant::integrator::estimate::Tolerances;
use pliant::simulation::Simulation;

/// Lets the step sizes of `simulation` follow the error if `scene` says so.
pub(super) fn add(scene: &Scene, simulation: &mut Simulation) {
    let Some(adaptive) = &scene.time.adaptive else { return };
    // Nothing can be said of more than a frame at a time.
    let between_frames = match scene.time.duration {
        0.0 => 1.0 / scene.output.rate,
        duration => duration.min(1.0 / scene.output.rate),
    };
    let largest = adaptive.largest.unwrap_or(between_frames);
    let relative = adaptive.tolerance_or_default();
    let tolerances = Tolerances {
        position: adaptive.position.unwrap_or_else(|| relative * simulation.length_scale()),
        velocity: adaptive.velocity.unwrap_or_else(|| relative * simulation.speed_scale()),
        relative,
    };
    let smallest = adaptive.smallest.unwrap_or(0.0);
    simulation.set_step_control(StepControl { tolerances, first: adaptive.first, smallest, largest });
}
