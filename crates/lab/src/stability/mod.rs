//! Largest stable step of a scene: predicted, measured, and mapped against its parameters.

mod amplification;
mod limit;
mod map;
mod survey;
#[cfg(test)]
mod tests;

pub use amplification::{AmplificationCurve, amplification_curve};
pub use limit::{Drift, MeasuredLimit, energy_drift, measure_limit};
pub(crate) use map::stiffness_changes;
pub use map::{Against, Map, map};
pub use survey::{StabilitySurvey, SurveyError, SurveyOptions};

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use pliant::integrator::IntegratorSpec;
use pliant::run::{energy_growth, energy_scale};
use pliant::simulation::{Simulation, StepError};
use pliant_scene::assembly::UnstableStep;
use pliant_scene::{Scene, SceneError};

/// How a run of some steps ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(rename = "Status")]
pub enum AttemptStatus {
    /// All steps were taken, and the energy stayed where it belongs.
    Ok,
    /// The energy grew beyond any physical cause, or a state was not finite.
    Diverged,
    /// The equations of an implicit step were not solved.
    Unsolved,
}

impl AttemptStatus {
    /// All outcomes, in the order of their values.
    pub const ALL: [AttemptStatus; 3] = [AttemptStatus::Ok, AttemptStatus::Diverged, AttemptStatus::Unsolved];

    /// Name in reports.
    pub fn name(self) -> &'static str {
        match self {
            AttemptStatus::Ok => "ok",
            AttemptStatus::Diverged => "diverged",
            AttemptStatus::Unsolved => "Newton failed",
        }
    }
}

/// Energy growth that counts as divergence, as a multiple of the initial energy scale.
const GROWTH: f64 = 10.0;
/// Number of steps between checks of the energy.
const LOOK: u64 = 16;

/// Step of a scene [s]; with adaptive step sizes the first step if specified, otherwise the frame
/// interval.
pub fn nominal_step(scene: &Scene) -> f64 {
    let first = scene.time.adaptive.as_ref().and_then(|adaptive| adaptive.first);
    scene.time.step.or(first).unwrap_or(1.0 / scene.output.rate)
}

/// Assembles the scene with another integrator and step, stable or not.
///
/// # Errors
/// The mistakes in the scene.
fn with_step(
    scene: &Scene,
    integrator: IntegratorSpec,
    step: f64,
    stop: &Arc<AtomicBool>,
) -> Result<Simulation, SceneError> {
    let mut scene = scene.clone();
    // Explicit contact stiffness and friction depend on the scene's own step in all trials.
    let own = nominal_step(&scene);
    if let Some(contact) = &mut scene.contact {
        contact.designed_step = contact.designed_step.or(Some(own));
    }
    scene.time.integrator = integrator;
    (scene.time.step, scene.time.adaptive, scene.time.arc_length) = (Some(step), None, None);
    scene.time.allow_unstable = true;
    // The stability limit is not needed.
    let mut simulation = scene.assemble(UnstableStep::Refuse).map_err(SceneError::new)?.simulation;
    simulation.set_stop(Some(Arc::clone(stop)));
    Ok(simulation)
}

/// Takes up to `steps` steps. If the simulation is stopped earlier, the outcome is meaningless.
fn attempt(simulation: &mut Simulation, steps: u64) -> AttemptStatus {
    let start = simulation.diagnostics();
    simulation.count_losses(false);
    let scale = energy_scale(simulation, &start);
    for step in 1..=steps {
        match simulation.step() {
            Ok(()) => {}
            Err(StepError::Unsolved { .. }) => return AttemptStatus::Unsolved,
            Err(_) => return AttemptStatus::Diverged,
        }
        if simulation.system().is_stopped() {
            return AttemptStatus::Unsolved;
        }
        if step % LOOK == 0 || step == steps {
            let now = simulation.diagnostics();
            let growth = energy_growth(simulation, &start, &now, scale);
            if growth.is_nan() || growth > GROWTH {
                return AttemptStatus::Diverged;
            }
        }
    }
    AttemptStatus::Ok
}
