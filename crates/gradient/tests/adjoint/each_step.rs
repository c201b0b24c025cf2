//! What could be done to a run at each of its steps: forces, and places of pins.

use pliant::energy::load::ExternalForce;
use pliant::simulation::Simulation;
use pliant_gradient::{LossFrame, ParameterSelection, UNLIMITED, gradient};

use crate::solid::{Further, assembled, scene};
use crate::support::{case, compare_with_differences};

const STEPS: u64 = 12;
/// The last vertex of the beam, and a held one.
const TIP: usize = 7;

fn beam(scheme: &str) -> (pliant_scene::Scene, Simulation, pliant::topology::Topology) {
    let body = "damping = { stiffness_proportional = 0.004 }";
    let scene =
        scene(&case("beam")["setup"], "neo-hookean", scheme, STEPS, Further { body, ..Further::default() });
    let (simulation, topology) = assembled(&scene);
    (scene, simulation, topology)
}

/// The derivatives of the height of the tip at the end by this array.
fn found(scheme: &str, name: &str, budget: usize) -> Vec<f64> {
    let (scene, mut simulation, topology) = beam(scheme);
    let mut selection = ParameterSelection::new(&scene, &topology, simulation.numbering(), &[name]).unwrap();
    let mut loss = |frame: &LossFrame<'_>, x_bar: &mut [f64], _: &mut [f64]| {
        if frame.step < STEPS {
            return 0.0;
        }
        x_bar[2 * TIP + 1] = 1.0;
        frame.x[2 * TIP + 1]
    };
    let found = gradient(&mut simulation, STEPS, &mut loss, selection.parameters(), budget).unwrap();
    selection.parts(&found).remove(0)
}

/// The height of the tip at the end of a run in which something is done `before` each step.
fn height(scheme: &str, mut before: impl FnMut(u64, &mut Simulation)) -> f64 {
    let (_, mut simulation, _) = beam(scheme);
    for step in 0..STEPS {
        before(step, &mut simulation);
        simulation.step().unwrap();
    }
    before(STEPS, &mut simulation);
    simulation.positions()[2 * TIP + 1]
}

#[test]
fn forces_of_each_step_have_derivatives() {
    for scheme in ["velocity-verlet", "rk4", "implicit-euler", "sdirk2"] {
        let all = found(scheme, "forces", UNLIMITED);
        let n = all.len() / STEPS as usize;
        for (step, coordinate) in [(0, 11), (5, 2 * TIP + 1), (11, 2 * TIP + 1), (7, 6)] {
            let by = all[step as usize * n + coordinate];
            let value = |change: f64| {
                height(scheme, |now, simulation| {
                    let mut force = vec![0.0; n];
                    force[coordinate] = change;
                    simulation.set_external_forces((now == step).then_some(ExternalForce::Constant(force)));
                })
            };
            compare_with_differences(&format!("{scheme}, {step}"), (by, by.abs()), (10.0, 1e-6), value);
        }
    }
}

// Of few states in memory, steps are taken again, and each is counted once.
#[test]
fn arrays_over_steps_do_not_depend_on_memory() {
    for name in ["forces", "pins"] {
        assert_eq!(found("velocity-verlet", name, 0), found("velocity-verlet", name, UNLIMITED), "{name}");
    }
}

#[test]
fn places_of_pins_from_each_state_on_have_derivatives() {
    for scheme in ["velocity-verlet", "implicit-euler", "sdirk2"] {
        let all = found(scheme, "pins", UNLIMITED);
        let n = all.len() / (STEPS as usize + 1);
        let held: Vec<usize> = (0..n).filter(|i| all[*i] != 0.0).collect();
        assert_eq!(held.len(), 4, "two vertices are held: {held:?}");
        for (state, coordinate) in [(0, held[0]), (4, held[3]), (7, held[1])] {
            let by = all[state as usize * n + coordinate];
            let value = |change: f64| {
                height(scheme, |now, simulation| {
                    if now == state {
                        let vertex = simulation.numbering().internal((coordinate / 2) as u32) as usize;
                        simulation.state_mut().x_mut()[2 * vertex + coordinate % 2] += change;
                    }
                })
            };
            compare_with_differences(&format!("{scheme}, {state}"), (by, by.abs()), (1e-3, 1e-6), value);
        }
        assert!(all[STEPS as usize * n..].iter().all(|by| *by == 0.0), "no pin moves the tip at the end");
    }
}
