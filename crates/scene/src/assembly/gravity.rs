//! Gravity of a scene.
//!
//! In dynamics gravity acts on the lumped masses: every vertex falls alike, to the last bit, and free fall
//! causes no strain. Statics has no inertia: the load on a vertex is `rho g` times the integral of its shape
//! function. Without this consistent load, quadratic elements are of first order in the strain instead of
//! second.

use crate::OverTime;
use crate::Scene;
use pliant::energy::EnergyTerm;
use pliant::energy::gravity::UniformGravity;
use pliant::energy::gravity_over_time::GravityOverTime;
use pliant::integrator::Scheme;

/// Number of samples of a formula over the run in search of its largest value.
const SAMPLES: u32 = 1000;

/// Gravity of the scene; `None` if it is zero at all times.
pub(super) fn named(scene: &Scene) -> Option<&[OverTime]> {
    scene.world.gravity.as_deref().filter(|gravity| !gravity.iter().all(OverTime::is_zero))
}

/// Magnitude of uniform gravity at the start [m/s^2].
pub(super) fn strength_at_start(scene: &Scene) -> f64 {
    let components = named(scene).unwrap_or_default().iter().map(|component| component.at(0.0));
    components.map(|g| g * g).sum::<f64>().sqrt()
}

/// Gravity as an energy term, for vertices of these masses [kg], in statics of these weights [kg].
pub(super) fn term(
    scene: &Scene,
    mass: &[f64],
    weights: impl Fn() -> Vec<f64>,
) -> Option<Box<dyn EnergyTerm>> {
    let gravity = named(scene)?;
    let on_vertices = |acceleration: &[f64]| match scene.time.integrator.method().scheme {
        Scheme::QuasiStatic => UniformGravity::without_inertia(acceleration, &weights()),
        _ => UniformGravity::new(acceleration, mass),
    };
    if !scene.world.gravity_changes() {
        let acceleration: Vec<f64> = gravity.iter().filter_map(OverTime::constant).collect();
        return Some(Box::new(on_vertices(&acceleration)));
    }
    let components = gravity.to_vec();
    let acceleration = move |t: f64| {
        let mut acceleration = [0.0; 3];
        for (a, component) in acceleration.iter_mut().zip(&components) {
            *a = component.at(t);
        }
        acceleration
    };
    let magnitude = |sample: u32| {
        let t = scene.time.duration * f64::from(sample) / f64::from(SAMPLES);
        acceleration(t).iter().map(|a| a * a).sum::<f64>().sqrt()
    };
    let largest = (0..=SAMPLES).map(magnitude).filter(|g| g.is_finite()).fold(0.0, f64::max);
    let field = on_vertices(&acceleration(0.0)[..gravity.len()]);
    Some(Box::new(GravityOverTime::new(acceleration, largest, field)))
}
