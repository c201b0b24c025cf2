//! An arch of 25 stones without mortar: friction holds it, or does not.

use super::setups::{STONES, arch};
use super::torture::{endured, vertices};

/// How far the highest stone has sunk after so many steps [m].
fn sinks(distance: f64, friction: f64, steps: usize) -> f64 {
    let mut assembly = super::assembled(&arch(distance, friction));
    let key = vertices(&assembly, &format!("stone{}", STONES / 2));
    let height = |assembly: &pliant_scene::assembly::Assembly| {
        let x = assembly.simulation.positions();
        key.clone().map(|v| x[2 * v + 1]).sum::<f64>() / key.len() as f64
    };
    let start = height(&assembly);
    endured("arch", &mut assembly, steps, steps);
    start - height(&assembly)
}

/// Sticking faces creep at less than the threshold speed of 0.1 mm/s; what slides falls a good part of
/// `g t^2 / 2`, which is 0.44 m in 0.3 s.
#[test]
fn an_arch_stands_by_friction_alone() {
    let sunk = sinks(1e-3, 0.5, 100);
    assert!(sunk < 1.25e-3, "with mu = 0.5 it sinks by {sunk} m");
    let sunk = sinks(1e-3, 0.2, 30);
    assert!(sunk > 0.05, "with mu = 0.2 it sinks by {sunk} m only");
}
