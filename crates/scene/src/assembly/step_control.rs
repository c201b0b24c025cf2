//! Step size control: fixed, by the error, or by the effort of solves.

use crate::{Adaptive, ArcLengthSpec, Scene};
use pliant::control::StepControl;
use pliant::integrator::estimate::Tolerances;
use pliant::simulation::{ArcLength, Simulation};

/// First increment of statics, as a fraction of the duration.
const FIRST_INCREMENT: f64 = 0.1;
/// Smallest increment of statics, as a fraction of the duration.
const LEAST_INCREMENT: f64 = 1e-6;

/// Time of a step along an arc-length path [s]: time counts steps.
const STEP_OF_PATH: f64 = 1.0;

/// Time step of `scene` [s], if the controller does not determine it.
pub(super) fn step(scene: &Scene) -> f64 {
    let time = &scene.time;
    if time.arc_length.is_some() { STEP_OF_PATH } else { time.step.unwrap_or(time.duration) }
}

/// Sets up adaptive step sizes if `scene` requests them: by the error, in statics by the effort.
pub(super) fn add(scene: &Scene, simulation: &mut Simulation) {
    if let Some(spec) = &scene.time.arc_length {
        return simulation.set_arc_length(path(spec));
    }
    let Some(adaptive) = &scene.time.adaptive else { return };
    // By default a step is at most as long as a frame.
    let between_frames = match scene.time.duration {
        0.0 => 1.0 / scene.output.rate,
        duration => duration.min(1.0 / scene.output.rate),
    };
    let largest = adaptive.largest.unwrap_or(between_frames);
    if simulation.method().is_static() {
        return increments(scene, adaptive, largest, simulation);
    }
    let relative = adaptive.tolerance_or_default();
    let tolerances = Tolerances {
        position: adaptive.position.unwrap_or_else(|| relative * simulation.length_scale()),
        velocity: adaptive.velocity.unwrap_or_else(|| relative * simulation.speed_scale()),
        relative,
    };
    let smallest = adaptive.smallest.unwrap_or(0.0);
    simulation.set_step_control(StepControl { tolerances, first: adaptive.first, smallest, largest });
}

/// Arc-length path requested by a scene.
fn path(spec: &ArcLengthSpec) -> ArcLength {
    let ends = spec.until.as_deref().and_then(|until| {
        let first = *until.first()?;
        Some([first, until.get(1).copied().unwrap_or(first)])
    });
    ArcLength { first: spec.first_or_default(), load: ends, largest: spec.largest }
}

/// Increments of statics: there is no error estimate, and steps end at kinks of formulas.
fn increments(scene: &Scene, adaptive: &Adaptive, largest: f64, simulation: &mut Simulation) {
    let duration = scene.time.duration;
    let whole = if duration > 0.0 { duration } else { largest };
    let first = adaptive.first.unwrap_or(FIRST_INCREMENT * whole).min(largest);
    let smallest = adaptive.smallest.unwrap_or(LEAST_INCREMENT * whole).min(first);
    let tolerances = Tolerances { position: f64::INFINITY, velocity: f64::INFINITY, relative: 0.0 };
    simulation.set_step_control(StepControl { tolerances, first: Some(first), smallest, largest });
    simulation.system_mut().set_breaks(breaks(scene));
}

/// Times [s] at which formulas of loads, muscles, gravity and prescribed motion change their branch,
/// ascending.
fn breaks(scene: &Scene) -> Vec<f64> {
    let formulas = scene.formulas().into_iter().map(|(_, formula)| formula);
    let mut breaks: Vec<f64> =
        formulas.flat_map(|formula| formula.branch_times(0.0, scene.time.duration)).collect();
    breaks.sort_by(f64::total_cmp);
    breaks.dedup();
    breaks
}
