//! Gravity between particles, by the number of dimensions.

use pliant::energy::EnergyTerm;
use pliant::energy::nbody::{ForceError, NBody, TreeGravity};

/// Every particle attracts every other, as [`NBody::new`] has it: vertices, which ascend, their masses [kg],
/// the constant of gravity and the softening length [m].
///
/// # Panics
/// As there.
pub fn direct_gravity(
    dimension: usize,
    (vertices, mass): (Vec<u32>, Vec<f64>),
    (constant, softening): (f64, f64),
) -> Box<dyn EnergyTerm> {
    match dimension {
        2 => Box::new(NBody::<2>::new(vertices, mass, constant, softening)),
        _ => Box::new(NBody::<3>::new(vertices, mass, constant, softening)),
    }
}

/// Particles attract each other through a tree with this opening angle [rad], as [`TreeGravity::new`] has it;
/// with the error of their forces at `x`, flat [m], as [`TreeGravity::force_error`] tells it.
///
/// # Panics
/// As there.
pub fn tree_gravity(
    dimension: usize,
    (vertices, mass): (Vec<u32>, Vec<f64>),
    (constant, softening): (f64, f64),
    opening_angle: f64,
    x: &[f64],
) -> (Box<dyn EnergyTerm>, ForceError) {
    match dimension {
        2 => {
            let mut tree = TreeGravity::<2>::new(vertices, mass, constant, softening, opening_angle);
            let error = tree.force_error(x);
            (Box::new(tree), error)
        }
        _ => {
            let mut tree = TreeGravity::<3>::new(vertices, mass, constant, softening, opening_angle);
            let error = tree.force_error(x);
            (Box::new(tree), error)
        }
    }
}
