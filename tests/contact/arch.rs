//! An arch of 25 stones without mortar: friction holds it, or does not.

use std::f64::consts::PI;
use std::fmt::Write;

use super::torture::{endured, vertices};

const STONES: usize = 25;
/// Radii of the arch [m].
const RADII: [f64; 2] = [0.85, 1.15];

/// Half a circle of stones on a floor, faces just within the reach `distance` [m] of each other.
fn arch(distance: f64, friction: f64) -> String {
    let gap = 0.999 * distance;
    let turn = PI / STONES as f64;
    // Stones moved out by so much leave a gap between their faces.
    let out = 0.5 * gap / (0.5 * turn).sin();
    let mut text = format!(
        "dimension = 2\ntime = {{ integrator = 'implicit-euler', step = 0.01, duration = 100.0 }}\n\
         world = {{ gravity = [0, -9.81] }}\n\
         contact = {{ distance = {distance:?}, friction = {friction:?}, threshold_speed = 1e-4 }}\n\
         [[obstacle]]\nname = 'floor'\nshape = {{ half_space = {{ normal = [0, 1], offset = 0 }} }}\n"
    );
    for k in 0..STONES {
        let (sin, cos) = ((k as f64 + 0.5) * turn).sin_cos();
        let corner = |radius: f64, angle: f64| {
            let (s, c) = angle.sin_cos();
            [radius * c + out * cos, radius * s + out * sin + 0.5 * gap]
        };
        let (from, to) = (k as f64 * turn, (k + 1) as f64 * turn);
        let points =
            [corner(RADII[0], from), corner(RADII[1], from), corner(RADII[1], to), corner(RADII[0], to)];
        let _ = write!(
            text,
            "[[body]]\nname = 'stone{k}'\n\
             mesh = {{ inline = {{ points = {points:?}, triangles = [[0, 1, 2], [0, 2, 3]] }} }}\n\
             elastic = {{ neo-hookean = {{ young = 2e10, poisson = 0.2 }} }}\nmass = {{ density = 2300 }}\n"
        );
    }
    text
}

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
fn holds(distance: f64, seconds: usize) {
    let sunk = sinks(distance, 0.5, 100 * seconds);
    let most = 2.5e-4 * seconds as f64 + distance;
    assert!(sunk < most, "with mu = 0.5 and gaps of {distance} m it sinks by {sunk} m, more than {most} m");
    let sunk = sinks(distance, 0.2, 30);
    assert!(sunk > 0.05, "with mu = 0.2 and gaps of {distance} m it sinks by {sunk} m only");
}

#[test]
fn an_arch_stands_by_friction_alone() {
    holds(1e-3, 1);
}

#[test]
#[ignore = "ten seconds: cargo test --release -p pliant-scene --test contact -- --ignored"]
fn torture_an_arch_stands_for_twenty_seconds() {
    for distance in [1e-3, 1e-6] {
        holds(distance, 20);
    }
}
