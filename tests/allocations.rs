//! Nothing is allocated in a step, and nothing for what a scene does not name.
//!
//! One test in a binary of its own: the allocator counts for all threads, and other tests would allocate
//! beside it.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::alloc::System;

use pliant_scene::assembly::UnstableStep;
use pliant_scene::{Scene, SceneError};
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};

#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// Bodies large enough for several threads, each with everything that acts in a step: gravity, drag, a wall
/// that it touches, pins.
const BODIES: [(&str, &str); 8] = [
    (
        "tetrahedra",
        "dimension = 3
        world = { gravity = [0.0, 0.0, -9.8], ether_drag = 0.5, walls = [{ normal = [0.0, 0.0, 1.0], offset \
        = 0.0 }] }
        [[body]]
        mesh = { grid = { cells = [12, 8, 8], size = [0.12, 0.08, 0.08] } }
        elastic = { stable-neo-hookean-log = { young = 1e5, poisson = 0.4 } }
        mass = { density = 1000.0 }
        pin = [{ half_space = { normal = [1.0, 0.0, 0.0], offset = 0.0 } }]
        muscle = [{ fibre = { direction = [0, 'X', 1] }, tension = '10 * X * t' }]
        load = [{ pressure = '10 * X * t' }, { traction = [1, 't', 0] }, { body_force = [0, 0, 'X * t'] }]",
    ),
    (
        "triangles",
        "dimension = 2
        world = { gravity = [0.0, -9.8], ether_drag = 0.5, walls = [{ normal = [0.0, 1.0], offset = 0.0 }] }
        [[body]]
        mesh = { grid = { cells = [52, 42], spacing = 0.01 } }
        elastic = { corotated = { young = 1e5, poisson = 0.3 } }
        mass = { density = 1000.0 }
        pin = [{ half_space = { normal = [1.0, 0.0], offset = 0.0 } }]",
    ),
    (
        "springs",
        "dimension = 3
        world = { gravity = [0.0, 0.0, -9.8], ether_drag = 0.5, walls = [{ normal = [0.0, 0.0, 1.0], offset \
        = 0.0 }] }
        [[body]]
        mesh = { cloth = { cells = [70, 70], origin = [0.0, 0.0, 0.0], u = [1.0, 0.0, 0.0], v = [0.0, 1.0, \
        0.0] } }
        springs = { stiffness = 500.0 }
        mass = { total = 0.3 }
        pin = [
            { vertices = [0, 70] },
            { vertices = [4970, 5040], axes = ['x', 'y'], motion = { velocity = [0.1, 0, 0], displacement = \
            [0, '1e-3 * X * sin(t)', 0], rotation = { axis = [0, 0, 1], speed = 1.0 } } },
            { vertices = [5000], motion = { keyframes = { times = [0, 1], displacements = [[0, 0, 0], [0, \
            0, 1]] } } },
        ]",
    ),
    (
        "hinges",
        "dimension = 3
        [[body]]
        mesh = { cloth = { cells = [9, 9], origin = [0.0, 0.0, 0.0], u = [1.0, 0.0, 0.0], v = [0.0, 1.0, \
        0.0] } }
        springs = { stiffness = 50.0 }
        bending = { stiffness = 1e-3 }
        damping = { stiffness_proportional = 1e-5 }
        mass = { total = 0.3 }",
    ),
    (
        "membrane",
        "dimension = 3
        [[body]]
        mesh = { cloth = { cells = [50, 50], origin = [0.0, 0.0, 0.0], u = [1.0, 0.0, 0.0], v = [0.0, 1.0, \
        0.0] } }
        elastic = { corotated = { young = 1e5, poisson = 0.3 } }
        membrane = { thickness = 1e-3 }
        damping = { strain_rate = { shear = 1.0, second = 1.0 } }
        mass = { density = 1000.0 }
        position = { affine = { matrix = [[1.01, 0, 0], [0, 1, 0], [0, 0, 1]] } }
        [[attachment]]
        half_space = { normal = [1.0, 0.0, 0.0], offset = 0.0 }
        stiffness = 10.0
        dashpot = 0.1",
    ),
    (
        "damped triangles",
        "dimension = 2
        [[body]]
        mesh = { grid = { cells = [12, 12], spacing = 0.01 } }
        elastic = { corotated = { young = 1e5, poisson = 0.3 } }
        springs = { stiffness = 10.0 }
        damping = { stiffness_proportional = 1e-5, mass_proportional = 0.1 }
        mass = { density = 1000.0 }",
    ),
    (
        "gravitating bodies",
        "dimension = 3
        world = { nbody = { constant = 1.0, softening = 0.02 }, ether_drag = 0.5, walls = [{ normal = [0.0, \
        0.0, 1.0], offset = 0.0 }] }
        [[body]]
        mesh = { disk = { count = 520, radius = 1.0, thickness = 0.02, seed = 1 } }
        mass = { total = 1.0 }
        pin = [{ vertices = [7] }]",
    ),
    (
        "gravitating bodies by a tree",
        "dimension = 3
        world = { nbody = { constant = 1.0, softening = 0.02, tree = { opening_angle = 0.7 } } }
        [[body]]
        mesh = { disk = { count = 1100, radius = 1.0, thickness = 0.02, seed = 1 } }
        mass = { total = 1.0 }",
    ),
];

/// Every way through a step: kicks first and last, several of them, stages.
const INTEGRATORS: [&str; 5] = ["symplectic-euler", "velocity-verlet", "yoshida4", "rk4", "dormand-prince5"];

/// Calls of the allocator in ten steps, after three to warm up: the least of three times. A thread of the
/// pool that finds work for
/// the first time makes itself known to the others, and may do so late; what a step does it does every time.
fn calls(scene: &Scene, threads: usize) -> usize {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| {
        let mut simulation =
            scene.assemble(UnstableStep::Accept).map_err(SceneError::new).unwrap().simulation;
        for _ in 0..3 {
            simulation.step().unwrap();
        }
        let mut ten_steps = || {
            let region = Region::new(ALLOCATOR);
            for _ in 0..10 {
                simulation.step().unwrap();
            }
            let change = region.change();
            change.allocations + change.deallocations + change.reallocations
        };
        (0..3).map(|_| ten_steps()).min().unwrap()
    })
}

fn a_step_allocates_nothing() {
    let mut failures = vec![];
    for (name, text) in BODIES {
        // What the schemes differ in does not depend on the energies.
        let integrators = if name.ends_with("triangles") { &INTEGRATORS[..] } else { &INTEGRATORS[..1] };
        for integrator in integrators {
            // Steps that follow the error estimate it, and some are taken back.
            let follows = (*integrator == "dormand-prince5").then_some("adaptive = { largest = 1e-4 }");
            for step in [Some("step = 1e-5"), follows].into_iter().flatten() {
                let time = format!("time = {{ integrator = '{integrator}', {step}, duration = 1.0 }}\n");
                let scene = Scene::from_toml(&(time + text)).unwrap();
                for threads in [1, 2] {
                    let calls = calls(&scene, threads);
                    if calls > 0 {
                        failures.push(format!(
                            "{name}, {integrator}, {step}, {threads} threads: {calls} calls in 10 steps"
                        ));
                    }
                }
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// Bytes for each particle, once they are assembled and a step is taken, with these keys of the world and of
/// the body; and calls of the allocator in that step.
fn bytes_each(world: &str, body: &str) -> (f64, usize) {
    let of = |count: usize| {
        let text = format!(
            "dimension = 3\ntime = {{ integrator = 'symplectic-euler', step = 1e-5, duration = 1.0 }}\n\
             world = {{ {world} }}\n[[body]]\nmass = {{ per_vertex = 1.0 }}\n{body}\n\
             mesh = {{ disk = {{ count = {count}, radius = 1.0, thickness = 0.02, seed = 1 }} }}\n"
        );
        let scene = Scene::from_toml(&text).unwrap();
        let before = Region::new(ALLOCATOR);
        let mut assembly = scene.assemble(UnstableStep::Accept).map_err(SceneError::new).unwrap();
        let step = Region::new(ALLOCATOR);
        assembly.simulation.step().unwrap();
        let (step, all) = (step.change(), before.change());
        (all.bytes_allocated as f64 - all.bytes_deallocated as f64, step.allocations + step.reallocations)
    };
    let (few, many) = (of(1000), of(2000));
    ((many.0 - few.0) / 1000.0, many.1)
}

/// A scene that names particles alone holds their places as they were read, at rest and now, velocities as
/// they were read and now, masses as they were read and now, and the inverse ones of coordinates: 20 numbers
/// each. Features that are named cost more: one of these would show if it were there in any case.
fn what_a_scene_does_not_name_takes_no_memory() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    pool.install(|| {
        let (bare, calls) = bytes_each("", "");
        assert!((bare - 160.0).abs() < 1.0, "{bare} bytes for each particle");
        assert_eq!(calls, 0, "calls of the allocator in the first step");
        let named = [
            ("nbody = { constant = 1.0, softening = 0.02 }", ""),
            ("gravity = [0, 0, -9.8]", ""),
            ("", "load = [{ force = [0, 0, 1] }]"),
            ("", "pin = [{ half_space = { normal = [1, 0, 0], offset = 2 } }]"),
        ];
        for (world, body) in named {
            let (more, _) = bytes_each(world, body);
            assert!(more > bare + 3.0, "{world}{body}: {more} bytes for each particle");
        }
    });
}

#[test]
fn steps_and_what_is_not_named_cost_no_memory() {
    let region = Region::new(ALLOCATOR);
    drop(std::hint::black_box(vec![1]));
    assert_eq!((region.change().allocations, region.change().deallocations), (1, 1), "the allocator counts");
    what_a_scene_does_not_name_takes_no_memory();
    a_step_allocates_nothing();
}
