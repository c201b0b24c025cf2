//! Warning before a run that takes hours, with the part of the scene that causes the cost.

use super::body::BodyAssembly;
use crate::Scene;
use pliant::quantity::Seconds;
use pliant::simulation::Simulation;

/// Duration above which a run is reported as long [s].
const LONG: f64 = 2.0 * 3600.0;
/// Speed of two ordinary cores, per second: elements, springs and pairs of masses whose forces they
/// compute, and coordinates for which they solve a step. Rounded from the rows of `pliant bench`, right
/// to a factor of three.
const ELEMENTS: f64 = 5e7;
const SPRINGS: f64 = 1e8;
const PAIRS: f64 = 1e9;
const COORDINATES: f64 = 5e4;

/// Warns of a scene whose steps take hours.
pub(super) fn warnings(scene: &Scene, simulation: &Simulation, bodies: &[BodyAssembly]) -> Vec<String> {
    // The number of adaptive steps is not known in advance.
    if simulation.step_control().is_some() {
        return vec![];
    }
    let h = simulation.step_size();
    let steps = scene.plan().steps(h) as f64;
    let free = simulation.system().inverse_mass().iter().filter(|w| **w > 0.0).count() as f64;
    let (each, what) = if simulation.method().documentation.solves > 0 {
        (
            free / COORDINATES,
            format!("each solves for {free} unknowns; a larger step or a coarser mesh takes less"),
        )
    } else {
        let elements: f64 =
            bodies.iter().filter(|body| body.elastic).map(|body| body.mesh.element_count() as f64).sum();
        let springs: f64 = bodies.iter().map(|body| body.springs.len() as f64).sum();
        let pairs = match &scene.world.nbody {
            Some(nbody) if nbody.tree.is_none() => 0.5 * (simulation.system().mass().len() as f64).powi(2),
            _ => 0.0,
        };
        let each = elements / ELEMENTS + springs / SPRINGS + pairs / PAIRS;
        let parts = [(elements, "elements"), (springs, "springs"), (pairs, "pairs of masses")];
        let parts = parts.iter().filter(|(count, _)| *count > 0.0);
        let parts: Vec<String> = parts.map(|(count, name)| format!("{count} {name}")).collect();
        let advice = if pairs > 0.0 {
            "`tree` in `nbody` takes less"
        } else {
            "a coarser mesh has a larger stable step, and implicit integrators are stable at larger ones"
        };
        (each, format!("each computes the forces of {}; {advice}", parts.join(", ")))
    };
    let hours = steps * each / 3600.0;
    if steps * each < LONG {
        return vec![];
    }
    vec![format!(
        "all {steps} steps of {h} take about {hours:.0} h on two ordinary cores: {what}; `--until` simulates \
         a part",
        h = Seconds(h)
    )]
}
