//! Against closed forms.

mod sound;
mod superposition;

use super::ModesError;
use crate::assembly::UnstableStep;
use crate::scene::Scene;
use crate::simulation::Simulation;

fn simulation(text: &str) -> Simulation {
    let scene = Scene::from_toml(text).unwrap();
    scene.assemble(UnstableStep::Refuse).map_err(|p| format!("{p:?}")).unwrap().simulation
}

/// Fourteen masses of 0.1 kg along x, held at both ends of the line, springs of 100 N/m.
fn strand() -> Simulation {
    simulation(
        "dimension = 2
        time = { integrator = 'implicit-euler', step = 0.01, duration = 1.0 }
        [[body]]
        mesh = { strand = { segments = 15, start = [0.0, 0.0], end = [15.0, 0.0] } }
        springs = { stiffness = 100.0 }
        mass = { per_vertex = 0.1 }
        pin = [{ vertices = [0, 15] }, { half_space = { normal = [0.0, 1.0], offset = 0.0 }, axes = ['y'] }]",
    )
}

// A5: omega_j = 2 sqrt(k/m) sin(j pi / (2 (N + 1))), N = 14.
#[test]
fn the_modes_of_a_chain_are_sines() {
    let mut simulation = strand();
    let found = simulation.modes(6).unwrap();
    assert_eq!(found.free_coordinates, 14);
    for (j, mode) in found.modes.iter().enumerate() {
        let angle = (j + 1) as f64 * std::f64::consts::PI / 30.0;
        let expected = 2.0 * (100.0f64 / 0.1).sqrt() * angle.sin();
        assert!((mode.omega / expected - 1.0).abs() < 1e-9, "mode {j}: {} for {expected}", mode.omega);
        // The shape is a sine, of unit length in the masses.
        let scale = (2.0 / (15.0 * 0.1f64)).sqrt();
        let sign = mode.shape[2].signum();
        for i in 0..=15 {
            let shape = sign * scale * (2.0 * angle * i as f64).sin();
            assert!((mode.shape[2 * i] - shape).abs() < 1e-8, "mode {j} at {i}");
        }
    }
    // All modes together have all the mass.
    let all = simulation.modes(14).unwrap();
    let mass: f64 = all.modes.iter().map(|m| m.effective_mass[0]).sum();
    assert!((mass - 1.0).abs() < 1e-10, "{mass}");
}

// D12: exactly three zero modes in the plane, six in space.
#[test]
fn a_free_body_has_the_modes_of_rigid_motion() {
    for (dimension, cells, rigid) in [(2, "[3, 3]", 3), (3, "[2, 2, 2]", 6)] {
        let mut simulation = simulation(&format!(
            "dimension = {dimension}
            time = {{ integrator = 'implicit-euler', step = 0.01, duration = 1.0 }}
            [[body]]
            mesh = {{ grid = {{ cells = {cells}, spacing = 0.3 }} }}
            elastic = {{ stable-neo-hookean = {{ young = 1e7, poisson = 0.3 }} }}
            mass = {{ density = 1000.0 }}"
        ));
        let found = simulation.modes(rigid + 4).unwrap();
        let first = found.modes[rigid].omega;
        for (j, mode) in found.modes.iter().enumerate() {
            assert_eq!(mode.omega == 0.0, j < rigid, "mode {j} of {rigid} + 4: {}", mode.omega);
            assert!(j <= rigid || mode.omega >= first);
        }
        let along_x: f64 = found.modes[..rigid].iter().map(|m| m.effective_mass[0]).sum();
        assert!((along_x - 1.0).abs() < 1e-8, "rigid motion has all the mass: {along_x}");
    }
}

#[test]
fn what_has_no_modes_says_so() {
    assert_eq!(strand().modes(15), Err(ModesError::TooMany { asked: 15, free: 14 }));
    // Pushed together, a chain gives way sideways.
    let mut squeezed = simulation(
        "dimension = 2
        time = { integrator = 'implicit-euler', step = 0.01, duration = 1.0 }
        [[body]]
        mesh = { strand = { segments = 4, start = [0.0, 0.0], end = [1.0, 0.0] } }
        springs = { stiffness = 100.0, rest_length = 0.3 }
        mass = { per_vertex = 0.1 }
        pin = [{ vertices = [0, 4] }]",
    );
    assert_eq!(squeezed.modes(2), Err(ModesError::NotStable));
}
