//! The same bits, whatever the number of threads.

use pliant::control::StepControl;
use pliant::energy::EnergyTerm;
use pliant::energy::nbody::{NBody, TreeGravity};
use pliant::energy::spring::Springs;
use pliant::integrator::IntegratorSpec;
use pliant::integrator::estimate::Tolerances;
use pliant::lanes::{InstructionSet, level};
use pliant::simulation::Simulation;
use pliant::state::State;
use pliant::system::System;
use pliant_scene::Scene;
use pliant_scene::assembly::UnstableStep;

use crate::support::solid::{Solid, at_zero, every_material, isotropic, scattered};
use crate::support::{advance, method};

/// Positions, velocities, and the energies and momenta of the end, as bits.
fn outcome(simulation: &mut Simulation, steps: usize) -> Vec<u64> {
    advance(simulation, steps);
    let d = simulation.diagnostics();
    let numbers = [d.kinetic, d.elastic, d.gravitational, d.total, d.min_j.unwrap_or(0.0)];
    let state = simulation.state();
    let all = state.x().iter().chain(state.v()).chain(&numbers);
    all.chain(&d.linear_momentum).chain(&d.angular_momentum).map(|x| x.to_bits()).collect()
}

/// Builds and runs in pools of 1, 2, 3 and 8 threads.
fn assert_same_bits(what: &str, run: impl Fn() -> Vec<u64> + Sync) {
    let in_pool = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            assert_eq!(rayon::current_num_threads(), threads);
            run()
        })
    };
    let one = in_pool(1);
    assert!(one.iter().any(|bits| *bits != 0));
    for threads in [2, 3, 8] {
        let many = in_pool(threads);
        let different = one.iter().zip(&many).filter(|(a, b)| a != b).count();
        assert_eq!(different, 0, "{what}: numbers that differ on {threads} threads, of {}", one.len());
    }
}

// lecture 18; promise 1. 9 x 8 x 8 cells make 3,456 tetrahedra, 41 x 40 cells 3,280 triangles: as many
// patches as it takes for the work to be shared out.
#[test]
fn solids_give_the_same_bits_on_any_number_of_threads() {
    let cases = [
        ("corotated", &[9, 8, 8][..], &[0.9, 0.8, 0.8][..]),
        ("neo-hookean", &[41, 40][..], &[4.1, 4.0][..]),
    ];
    for (name, cells, size) in cases {
        let d = cells.len();
        let elastic = isotropic(name, 1e5, 0.4);
        // The fastest motion is that of a few cells.
        let few = Solid::grid(&vec![2; d], &vec![0.2; d], elastic.clone());
        let h = 0.3 * few.simulation(method("velocity-verlet"), 1.0).stability_limit(1.0).unwrap().step;
        let mut solid = Solid::grid(cells, size, elastic);
        solid.pin = at_zero(d, 0);
        solid.gravity = Some(vec![0.3; d]);
        assert_same_bits(&format!("{name} in {d}D"), || {
            // Assembled in the pool: the grouping into patches must not look at it either.
            let mut simulation = solid.simulation(method("velocity-verlet"), h);
            let rest = simulation.state().x().to_vec();
            for (k, v) in simulation.state_mut().v_mut().iter_mut().enumerate() {
                *v = if rest[k - k % d] == 0.0 { 0.0 } else { 0.1 * scattered(k) };
            }
            outcome(&mut simulation, 12)
        });
    }
}

// 15 x 15 x 14 hexahedra and 57 x 55 quadrilaterals are four patches: as many as it takes for the work to
// be shared out.
#[test]
fn cells_give_the_same_bits_on_any_number_of_threads() {
    let cases = [
        ("velocity-verlet", 1e-5, 1, &[15u32, 15, 14][..]),
        ("velocity-verlet", 1e-5, 2, &[57, 55][..]),
        ("implicit-euler", 5e-3, 1, &[57, 55][..]),
    ];
    for (name, h, steps, cells) in cases {
        let d = cells.len();
        let size: Vec<f64> = cells.iter().map(|n| 0.1 * f64::from(*n)).collect();
        let cells: Vec<usize> = cells.iter().map(|n| *n as usize).collect();
        let mut solid = Solid::grid(&cells, &size, isotropic("neo-hookean", 1e5, 0.49)).of_whole_cells();
        solid.pin = at_zero(d, 0);
        solid.gravity = Some(vec![0.3; d]);
        assert_same_bits(&format!("{name} in {d}D"), || {
            let mut simulation = solid.simulation(method(name), h);
            let rest = simulation.state().x().to_vec();
            for (k, v) in simulation.state_mut().v_mut().iter_mut().enumerate() {
                *v = if rest[k - k % d] == 0.0 { 0.0 } else { 0.1 * scattered(k) };
            }
            outcome(&mut simulation, steps)
        });
    }
}

/// A sheet of `n` x `n` masses with structural and diagonal springs, in the plane z = 0, shaken.
fn sheet(n: usize) -> Simulation {
    sheet_by(n, IntegratorSpec::SymplecticEuler)
}

fn sheet_by(n: usize, integrator: IntegratorSpec) -> Simulation {
    let at = |i: usize, j: usize| (i * n + j) as u32;
    let mut edges = vec![];
    for i in 0..n {
        for j in 0..n {
            if i + 1 < n {
                edges.push([at(i, j), at(i + 1, j)]);
            }
            if j + 1 < n {
                edges.push([at(i, j), at(i, j + 1)]);
            }
            if i + 1 < n && j + 1 < n {
                edges.push([at(i, j), at(i + 1, j + 1)]);
                edges.push([at(i, j + 1), at(i + 1, j)]);
            }
        }
    }
    let x: Vec<f64> = (0..n * n)
        .flat_map(|k| {
            [(k / n) as f64, (k % n) as f64, 0.0]
                .into_iter()
                .enumerate()
                .map(move |(c, x)| x + 0.2 * scattered(3 * k + c))
        })
        .collect();
    let stiffness = vec![10.0; edges.len()];
    let rest: Vec<f64> = edges
        .iter()
        .map(|[a, b]| if b - a == 1 || (b - a) as usize == n { 1.0 } else { 2f64.sqrt() })
        .collect();
    let mut system = System::new(3, vec![1.0; n * n]);
    system.add_term(Box::new(Springs::<3>::new("sheet", &edges, &stiffness, &rest, n * n)));
    let v = vec![0.0; x.len()];
    Simulation::new(system, State::new(x, v), integrator.method(), 0.05)
}

// lecture 9, 11; promise 1
#[test]
fn springs_give_the_same_bits_on_any_number_of_threads() {
    assert_same_bits("springs", || outcome(&mut sheet(50), 40));
}

/// A cloud of `n` bodies in the unit cube that attract each other directly or by a tree.
fn cloud(n: usize, by_tree: bool) -> Simulation {
    let x: Vec<f64> = (0..3 * n).map(scattered).collect();
    let v: Vec<f64> = (0..3 * n).map(|k| 0.1 * scattered(7 * k + 5)).collect();
    let mass: Vec<f64> = (0..n).map(|k| 1.5 + scattered(k)).collect();
    let mut system = System::new(3, mass.clone());
    let vertices = (0..n as u32).collect();
    let term: Box<dyn EnergyTerm> = if by_tree {
        Box::new(TreeGravity::<3>::new(vertices, mass, 1e-3, 0.05, 0.7))
    } else {
        Box::new(NBody::<3>::new(vertices, mass, 1e-3, 0.05))
    };
    system.add_term(term);
    Simulation::new(system, State::new(x, v), IntegratorSpec::SymplecticEuler.method(), 1e-2)
}

// lecture 8; promise 1. From 512 bodies on the work is shared out.
#[test]
fn gravitating_bodies_give_the_same_bits_on_any_number_of_threads() {
    for n in [511, 512, 1001] {
        assert_same_bits(&format!("{n} bodies"), || outcome(&mut cloud(n, false), 6));
        assert_same_bits(&format!("{n} bodies by a tree"), || outcome(&mut cloud(n, true), 6));
    }
}

// promise 1: the norm of the error is the same on any number of threads, and so are the steps that it
// chooses.
#[test]
fn steps_that_follow_the_error_are_the_same_on_any_number_of_threads() {
    assert_same_bits("a sheet in adaptive steps", || {
        let mut simulation = sheet_by(120, IntegratorSpec::DormandPrince5);
        let tolerances = Tolerances { position: 1e-8, velocity: 1e-6, relative: 1e-6 };
        simulation.set_step_control(StepControl { tolerances, first: None, smallest: 0.0, largest: 1.0 });
        let mut bits = outcome(&mut simulation, 12);
        bits.push(simulation.state().time.to_bits());
        bits
    });
}

// promise 1: so are the steps that are not solved, and their parts.
#[test]
fn steps_in_parts_are_the_same_on_any_number_of_threads() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/pressed_block_2d.toml");
    assert_same_bits("a block pressed in parts of steps", || {
        let mut scene = Scene::from_path(path).unwrap();
        scene.body[0].mesh =
            serde_json::from_str(r#"{ "grid": { "cells": [41, 40], "size": [0.08, 0.1] } }"#).unwrap();
        scene.time.integrator = IntegratorSpec::ImplicitEuler;
        scene.time.step = Some(0.25);
        let mut simulation =
            scene.assemble(UnstableStep::Refuse).map_err(|p| format!("{p:?}")).unwrap().simulation;
        let bits = outcome(&mut simulation, 1);
        assert!(simulation.work().retried.unwrap().parts > 1);
        bits
    });
}

/// The name of the test below, and the variable by which it asks a copy of itself for the bits.
const CHILD: (&str, &str) =
    ("determinism::every_instruction_set_gives_the_same_bits", "PLIANT_TEST_PRINT_FINGERPRINT");

/// FNV-1a of all bits of a few runs of every material, of springs and of gravitating bodies.
fn fingerprint() -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325u64;
    let mut add = |bits: Vec<u64>| {
        for byte in bits.iter().flat_map(|b| b.to_le_bytes()) {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    };
    for (_, elastic) in every_material() {
        for (cells, size) in [(&[3, 4, 5][..], &[0.3, 0.4, 0.5][..]), (&[7, 9][..], &[0.7, 0.9][..])] {
            let mut solid = Solid::grid(cells, size, elastic.clone());
            solid.gravity = Some(vec![1.0; cells.len()]);
            for solid in [solid.clone(), solid.of_whole_cells()] {
                let mut simulation = solid.simulation(method("symplectic-euler"), 1e-5);
                for (k, x) in simulation.state_mut().x_mut().iter_mut().enumerate() {
                    *x += 0.015 * scattered(k);
                }
                add(outcome(&mut simulation, 20));
            }
        }
    }
    add(outcome(&mut sheet(9), 100));
    add(outcome(&mut cloud(203, false), 20));
    add(outcome(&mut cloud(603, true), 20));
    hash
}

// promise 1. The level is chosen once in a process, so every level gets a process of its own.
#[test]
fn every_instruction_set_gives_the_same_bits() {
    if std::env::var_os(CHILD.1).is_some() {
        // A failing test is what prints for certain.
        panic!("fingerprint {:016x} level {}", fingerprint(), level().name());
    }
    let of = |wanted: InstructionSet| {
        let output = std::process::Command::new(std::env::current_exe().unwrap())
            .args(["--exact", CHILD.0, "--nocapture"])
            .env(CHILD.1, "1")
            .env("PLIANT_SIMD", wanted.name())
            .output()
            .unwrap();
        let text = [output.stdout, output.stderr].concat();
        let text = String::from_utf8_lossy(&text).into_owned();
        assert!(text.contains(&format!("level {}", wanted.name())), "{text}");
        let start = text.find("fingerprint ").unwrap() + "fingerprint ".len();
        text[start..start + 16].to_string()
    };
    let portable = of(InstructionSet::Portable);
    for wanted in InstructionSet::ALL.into_iter().filter(|l| l.is_available()) {
        assert_eq!(of(wanted), portable, "{}", wanted.name());
    }
}
