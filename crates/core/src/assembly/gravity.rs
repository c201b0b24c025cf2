//! The gravity of a scene.

use crate::energy::EnergyTerm;
use crate::energy::gravity::UniformGravity;
use crate::energy::gravity_over_time::GravityOverTime;
use crate::scene::{OverTime, Scene};

/// How often a formula is looked at over the run for its largest value.
const SAMPLES: u32 = 1000;

/// The gravity that the scene names, unless it is zero at all times.
pub(super) fn named(scene: &Scene) -> Option<&[OverTime]> {
    scene.world.gravity.as_deref().filter(|gravity| !gravity.iter().all(OverTime::is_zero))
}

/// The gravity of the scene on vertices of these masses [kg], as an energy.
pub(super) fn term(scene: &Scene, mass: &[f64]) -> Option<Box<dyn EnergyTerm>> {
    let gravity = named(scene)?;
    if !scene.world.gravity_changes() {
        let acceleration: Vec<f64> = gravity.iter().filter_map(OverTime::constant).collect();
        return Some(Box::new(UniformGravity::new(&acceleration, mass)));
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
    Some(Box::new(GravityOverTime::new(acceleration, gravity.len(), largest, mass)))
}
