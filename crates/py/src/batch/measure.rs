//! Measurements of one copy, as rows of arrays of all.

use pliant::probe::Probe;
use pliant::simulation::Simulation;

/// Force and moment of each of these names; zero where a pin has let go, NaN where the force is not finite.
pub(super) fn reactions(simulation: &mut Simulation, names: &[String]) -> Vec<f64> {
    let found = simulation.reactions();
    let nothing = if found.is_empty() && !simulation.reaction_names().is_empty() { f64::NAN } else { 0.0 };
    let mut values = vec![];
    for name in names {
        let reaction = found.iter().find(|reaction| reaction.name == *name);
        values.extend(reaction.map_or([[nothing; 3]; 2], |reaction| [reaction.force, reaction.moment]));
    }
    values.into_flattened()
}

/// Mixture of rows that a probe is.
pub(super) fn mixed(probe: &Probe, rows: &[f64], dimension: usize) -> Vec<f64> {
    let mut sum = vec![0.0; dimension];
    for (&vertex, weight) in probe.vertices.iter().zip(&probe.weights) {
        let row = &rows[vertex as usize * dimension..][..dimension];
        sum.iter_mut().zip(row).for_each(|(sum, value)| *sum += weight * value);
    }
    sum
}

/// Sum of the normal forces and the friction on each of these bodies.
pub(super) fn contact_forces(simulation: &Simulation, bodies: &[String]) -> Vec<f64> {
    let mut sums = vec![[0.0; 3]; bodies.len()];
    for contact in simulation.contacts() {
        for (side, sign) in [(0, 1.0), (1, -1.0)] {
            let Some(body) = bodies.iter().position(|body| *body == contact.bodies[side]) else { continue };
            for (i, sum) in sums[body].iter_mut().enumerate() {
                *sum += sign * (contact.force * contact.normal[i] + contact.friction[i]);
            }
        }
    }
    sums.into_flattened()
}
