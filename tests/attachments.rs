//! Soft attachments, and bodies of different kinds in one scene.

use std::path::Path;

use pliant::diagnostics::ElementState;
use pliant::topology::BodyKind;
use pliant_scene::Scene;
use pliant_scene::assembly::{Assembly, UnstableStep};
use serde_json::{Value, json};

use crate::support::{advance, assert_relative, largest_difference};

fn assembly(scene: &Value) -> Assembly {
    let scene: Scene = serde_json::from_value(scene.clone()).unwrap();
    scene.assemble(UnstableStep::Refuse).map_err(|p| format!("{p:?}")).unwrap()
}

fn pavilion() -> Scene {
    Scene::from_path(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/pavilion.toml")).unwrap()
}

/// A particle of 2 kg on a spring of 50 N/m to where it starts, moved by 0.3 m: it swings as cos(5 t),
/// damped as its dashpot says.
fn particle(dashpot: f64, time: f64) -> f64 {
    let mut assembly = assembly(&json!({
        "dimension": 3,
        "time": { "integrator": "velocity-verlet", "step": 1e-4, "duration": 1.0 },
        "body": [{
            "mesh": { "inline": { "points": [[0.1, 0.2, 0.3]] } },
            "mass": { "per_vertex": 2.0 },
        }],
        "attachment": [{ "vertices": [0], "stiffness": 50.0, "dashpot": dashpot }],
    }));
    let simulation = &mut assembly.simulation;
    simulation.state_mut().x_mut()[1] += 0.3;
    advance(simulation, (time / 1e-4).round() as usize);
    let x = simulation.positions();
    assert_eq!((x[0], x[2]), (0.1, 0.3));
    x[1] - 0.2
}

#[test]
fn a_particle_tied_to_a_place_is_an_oscillator() {
    for time in [0.2, 0.7, 1.3f64] {
        assert!((particle(0.0, time) - 0.3 * (5.0 * time).cos()).abs() < 1e-6, "at {time} s");
        // c = 4: x'' = -25 x - 2 x', a rate of 1 and a frequency of sqrt(24).
        let omega = 24f64.sqrt();
        let expected = 0.3 * (-time).exp() * ((omega * time).cos() + (omega * time).sin() / omega);
        assert!((particle(4.0, time) - expected).abs() < 1e-5, "damped, at {time} s");
    }
}

// The dashpot acts where the ends meet, too, and the limit of the step knows it: omega h = 2 without, (c/m)
// h = 2 with much damping.
#[test]
fn the_stability_limit_includes_attachments() {
    let limit = |dashpot: f64| {
        let scene = json!({
            "dimension": 3,
            "time": { "integrator": "symplectic-euler", "step": 1e-6, "duration": 1.0 },
            "body": [
                { "mesh": { "inline": { "points": [[0.0, 0.0, 0.0]] } }, "mass": { "per_vertex": 2.0 } },
            ],
            "attachment": [{ "vertices": [0], "stiffness": 50.0, "dashpot": dashpot }],
        });
        assembly(&scene).report.stability.unwrap().step
    };
    assert_relative(limit(0.0), 2.0 / 5.0, 1e-6, "undamped");
    assert_relative(limit(2000.0), 2.0 / 1000.0, 1e-3, "damped");
}

/// Two blocks of jelly side by side, tied face to face, thrown and spinning.
fn tied_blocks(target: &Value, dashpot: f64) -> Assembly {
    let block = |name: &str, x: f64| {
        json!({
            "name": name,
            "mesh": { "grid": { "cells": [2, 2, 2], "spacing": 0.1, "origin": [x, 0.0, 0.0] } },
            "elastic": { "stable-neo-hookean": { "young": 1e5, "poisson": 0.3 } },
            "mass": { "density": 1000.0 },
            "velocity": { "rigid": { "linear": [1.0, x, 2.0], "angular": [1.0, 5.0, 10.0 * x] } },
        })
    };
    assembly(&json!({
        "dimension": 3,
        "time": { "integrator": "velocity-verlet", "step": 1e-4, "duration": 1.0 },
        "body": [block("left", 0.0), block("right", 0.2)],
        "attachment": [{
            "body": "left",
            "half_space": { "normal": [-1.0, 0.0, 0.0], "offset": -0.2 },
            "target": target,
            "total_stiffness": 9e3,
            "dashpot": dashpot,
        }],
    }))
}

#[test]
fn ties_between_bodies_keep_momentum_spin_and_energy() {
    for (target, dashpot) in [
        (json!({ "body": "right", "nearest_vertex": 0.0 }), 0.0),
        (json!({ "body": "right", "nearest_point": 0.0 }), 5.0),
        (json!({ "body": "right", "vertices": [0, 1, 2, 3, 4, 5, 6, 7, 8] }), 0.0),
    ] {
        let mut assembly = tied_blocks(&target, dashpot);
        let simulation = &mut assembly.simulation;
        let start = simulation.diagnostics();
        advance(simulation, 3000);
        let end = simulation.diagnostics();
        let size = |m: [f64; 3]| m.iter().map(|m| m * m).sum::<f64>().sqrt();
        for c in 0..3 {
            let error = (end.linear_momentum[c] - start.linear_momentum[c]).abs();
            assert!(error < 1e-12 * size(start.linear_momentum), "{target}: momentum {c}: {error:e}");
            let error = (end.angular_momentum[c] - start.angular_momentum[c]).abs();
            assert!(error < 1e-11 * size(start.angular_momentum), "{target}: spin {c}: {error:e}");
        }
        let lost = (start.total - end.total) / start.total;
        assert!(if dashpot > 0.0 { lost > 1e-3 } else { lost.abs() < 1e-3 }, "{target}: {lost}");
        // Tied they stay together: 0.2 m apart at rest; apart they would be some metres.
        let x = simulation.positions();
        let centre = |first: usize| -> f64 { (0..27).map(|v| x[3 * (first + v)]).sum::<f64>() / 27.0 };
        assert!((centre(0) - centre(27)).abs() < 0.35, "{target}");
    }
}

// A weight on a tie to the middle of an element: the tie is as long as it is heavy, and the element's
// vertices carry it by their shares.
#[test]
fn a_point_inside_an_element_carries_by_its_shares() {
    let mut assembly = assembly(&json!({
        "dimension": 2,
        "time": { "integrator": "velocity-verlet", "step": 1e-3, "duration": 1.0 },
        "world": { "gravity": [0.0, -10.0] },
        "body": [
            {
                "name": "plate",
                "mesh": { "inline": {
                    "points": [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
                    "triangles": [[0, 1, 2]],
                } },
                "elastic": { "corotated": { "young": 1.0, "poisson": 0.3 } },
                "mass": { "per_vertex": 1.0 },
                "pin": [{ "vertices": [0, 1, 2] }],
            },
            {
                "name": "weight",
                "mesh": { "inline": { "points": [[0.2, 0.3]] } },
                "mass": { "per_vertex": 2.0 },
            },
        ],
        "attachment": [{
            "body": "weight",
            "vertices": [0],
            "target": { "body": "plate", "nearest_point": 0.0 },
            "stiffness": 100.0,
            "dashpot": 20.0,
        }],
    }));
    let simulation = &mut assembly.simulation;
    advance(simulation, 10_000);
    let x = simulation.positions()[6..].to_vec();
    assert_relative(x[1], 0.3 - 2.0 * 10.0 / 100.0, 1e-9, "the weight hangs");
    assert!((x[0] - 0.2).abs() < 1e-12);
    let terms = simulation.system().terms();
    let tie = terms.iter().find(|term| term.name() == "attachment `attachment0`").unwrap();
    let mut carried = vec![0.0; 8];
    tie.add_rows(0, &mut carried);
    for (v, share) in [0.5, 0.2, 0.3].into_iter().enumerate() {
        assert_relative(carried[2 * v + 1], 20.0 * share, 1e-6, &format!("vertex {v}"));
    }
}

// Without ties every body of the pavilion moves as it does alone in the world, to the last bit: sums go
// through each body by itself.
#[test]
fn bodies_of_different_kinds_do_not_disturb_one_another() {
    let mut all = pavilion();
    all.attachment.clear();
    all.probe.clear();
    let together = |scene: &Scene| {
        let mut assembly = scene.assemble(UnstableStep::Refuse).map_err(|p| format!("{p:?}")).unwrap();
        advance(&mut assembly.simulation, 100);
        let (x, v) = (assembly.simulation.positions().to_vec(), assembly.simulation.state().v().to_vec());
        (assembly, x, v)
    };
    let (assembly, x, v) = together(&all);
    let kinds: Vec<BodyKind> = assembly.topology.bodies.iter().map(|body| body.kind).collect();
    assert_eq!(kinds, [BodyKind::Membrane, BodyKind::Solid, BodyKind::Strand, BodyKind::Particles]);
    for (index, body) in assembly.topology.bodies.iter().enumerate() {
        let mut alone = all.clone();
        alone.body = vec![all.body[index].clone()];
        let (_, x_alone, v_alone) = together(&alone);
        let rows = 3 * body.vertices.start as usize..3 * body.vertices.end as usize;
        assert_eq!(x[rows.clone()], x_alone, "{}", body.name);
        assert_eq!(v[rows], v_alone, "{}", body.name);
    }
}

#[test]
fn the_elements_of_a_membrane_and_a_solid_follow_one_another() {
    let mut assembly = pavilion().assemble(UnstableStep::Refuse).map_err(|p| format!("{p:?}")).unwrap();
    let bodies = &assembly.report.bodies;
    assert_eq!(bodies.iter().map(|body| body.elements).collect::<Vec<_>>(), [160, 384, 0, 0]);
    let states = assembly.simulation.element_states();
    assert_eq!(states.len(), 160 + 384);
    // The probes show the elements that they are in: pull a vertex of one, and its state changes, and that
    // of its neighbours.
    for (probe, elements) in assembly.probes.iter().zip([0..160, 160..544]) {
        let point = probe.point.unwrap();
        let shown = assembly.simulation.point_states()[point];
        let before = assembly.simulation.element_states();
        let same = |state: &ElementState| {
            (state.deformation_gradient - shown.deformation_gradient).norm_squared() < 1e-24
        };
        assert!(before[elements.clone()].iter().any(same), "{}", probe.name);
        let vertex = 3 * probe.vertices[0] as usize;
        assembly.simulation.state_mut().x_mut()[vertex] += 1e-3;
        assert_ne!(assembly.simulation.point_states()[point], shown, "{}", probe.name);
        let after = assembly.simulation.element_states();
        assembly.simulation.state_mut().x_mut()[vertex] -= 1e-3;
        let sum: f64 = probe.weights.iter().sum();
        assert!((sum - 1.0).abs() < 1e-12);
        let changed = before.iter().zip(&after).enumerate().filter(|(_, (a, b))| a != b);
        assert!(changed.clone().all(|(i, _)| elements.contains(&i)) && changed.count() < 40);
    }
    let place = assembly.probes[0].rest;
    assert!(largest_difference(&place, &[0.97, 0.37, 0.4]) < 1e-12, "{place:?}");
}

// At length zero a tie that is to be 0.1 m long has no direction to push in, and its force is not a number.
#[test]
fn a_tie_of_some_length_that_starts_at_length_zero_is_refused() {
    let problems = |rest_length: f64| {
        let scene: Scene = serde_json::from_value(json!({
            "dimension": 3,
            "time": { "integrator": "velocity-verlet", "step": 1e-4, "duration": 1.0 },
            "body": [
                { "mesh": { "inline": { "points": [[0.1, 0.2, 0.3]] } }, "mass": { "per_vertex": 2.0 } },
            ],
            "attachment": [{ "vertices": [0], "stiffness": 50.0, "rest_length": rest_length }],
        }))
        .unwrap();
        scene.assemble(UnstableStep::Refuse).err().map(|problems| format!("{problems:?}"))
    };
    assert_eq!(problems(0.0), None);
    let said = problems(0.1).unwrap();
    assert!(said.contains("vertex 0") && said.contains("starts at length 0"), "{said}");
}
