//! Walls of scenes without contact, at the end of each step.

use pliant::constraint::Wall;
use pliant::energy::gravity::UniformGravity;
use pliant::integrator::IntegratorSpec;
use pliant::simulation::Simulation;
use pliant::state::State;
use pliant::system::System;
use pliant_gradient::{LossFrame, RunGradient, UNLIMITED, WallEvent, gradient};
use pliant_scene::{Scene, Solver};

use crate::differences::{compare_number, compare_starts};
use crate::solid::assembled;
use crate::tangents::compare_with_tangents;

/// A square thrown into the corner of a sloping floor and a wall, with parts beside.
fn thrown(scheme: &str, parts: &str, world: &str) -> Scene {
    let text = format!(
        "dimension = 2
         [time]
         integrator = \"{scheme}\"
         duration = 0.1
         step = 2e-4
         [world]
         gravity = [1.0, -9.81]
         walls = [{{ normal = [0.1, 1.0], offset = -0.003 }}, {{ normal = [-1.0, 0.2], offset = -0.108 }}]
         {world}
         [[body]]
         name = \"square\"
         mesh = {{ grid = {{ cells = [2, 2], size = [0.1, 0.1] }} }}
         elastic = {{ neo-hookean = {{ young = 1e5, poisson = 0.3 }} }}
         mass = {{ density = 1000.0 }}
         velocity = {{ rigid = {{ linear = [0.5, -0.4], angular = 0.5 }} }}
         {parts}"
    );
    Scene::from_toml(&text).unwrap()
}

/// True if a wall holds any vertex.
fn is_held(simulation: &Simulation) -> bool {
    let system = simulation.system();
    let rows = || simulation.state().x().chunks_exact(system.dimension());
    system.walls().iter().any(|wall| rows().any(|row| wall.depth(row).abs() < 1e-15))
}

#[test]
fn walls_have_the_derivatives_of_their_steps() {
    for scheme in ["symplectic-euler", "velocity-verlet", "yoshida4", "rk4", "rk2-midpoint"] {
        let found = compare_starts(scheme, &thrown(scheme, "", ""), (200, 1e-7), is_held);
        assert!(!found.wall_events.is_empty(), "{scheme}");
    }
    // Of schemes that hold no contact walls act at the end of solved steps, too; of all others where a scene
    // is compared in several.
    for scheme in ["implicit-euler", "tr-bdf2", "gauss2", "bdf2", "newmark", "generalised-alpha"] {
        let mut solved = thrown(scheme, "", "");
        solved.world.puts_back = true;
        solved.time.step = Some(2e-3);
        solved.time.solver = Some(Solver { tolerance: Some(1e-14), ..Solver::default() });
        compare_starts(scheme, &solved, (20, 1e-7), is_held);
    }
    // What holds contact solves for walls.
    for scheme in ["implicit-euler", "tr-bdf2", "bdf2"] {
        let mut solved = thrown(scheme, "", "");
        solved.time.step = Some(2e-3);
        solved.time.solver = Some(Solver { tolerance: Some(1e-14), ..Solver::default() });
        let found = compare_starts(scheme, &solved, (20, 1e-6), |now| !now.contacts().is_empty());
        assert!(found.wall_events.is_empty() && found.contact_events.come > 0, "{scheme}");
    }
    let damped = thrown("velocity-verlet", "damping = { stiffness_proportional = 1e-4 }", "");
    compare_starts("damped", &damped, (200, 1e-7), is_held);
    let dragged = thrown("velocity-verlet", "", "ether_drag = 2.0");
    compare_starts("dragged", &dragged, (200, 1e-7), is_held);
    // Slides along x alone: walls move what can move.
    let pin = "pin = [{ vertices = [6], axes = [\"y\"] }]";
    compare_starts("slides", &thrown("velocity-verlet", pin, ""), (200, 1e-7), is_held);
}

#[test]
fn tangents_and_adjoints_agree_at_walls() {
    for scheme in ["symplectic-euler", "velocity-verlet", "rk4"] {
        compare_with_tangents(scheme, &thrown(scheme, "", ""), 200);
    }
    for scheme in ["bdf2", "newmark", "generalised-alpha"] {
        let mut solved = thrown(scheme, "", "");
        solved.world.puts_back = true;
        solved.time.step = Some(2e-3);
        solved.time.solver = Some(Solver { tolerance: Some(1e-15), ..Solver::default() });
        compare_with_tangents(scheme, &solved, 20);
    }
}

/// The derivatives of the height of a mass after so many steps of 1/8 s, thrown from 1 m at `v` towards a
/// wall at 0 under this gravity.
fn height(v: f64, gravity: f64, steps: u64) -> RunGradient {
    let mut system = System::new(2, vec![2.0]);
    system.add_term(Box::new(UniformGravity::new(&[0.0, gravity], &[2.0])));
    system.add_wall(Wall::new(&[0.0, 1.0], 0.0));
    let state = State::new(vec![0.0, 1.0], vec![0.0, v]);
    let mut simulation = Simulation::new(system, state, IntegratorSpec::VelocityVerlet.method(), 0.125);
    let mut loss = |frame: &LossFrame<'_>, x_bar: &mut [f64], _: &mut [f64]| {
        if frame.step < steps {
            return 0.0;
        }
        x_bar[1] = 1.0;
        frame.x[1]
    };
    gradient(&mut simulation, steps, &mut loss, &mut [], UNLIMITED).unwrap()
}

// What a wall has taken is gone, exactly.
#[test]
fn nothing_of_the_start_is_left_behind_a_wall() {
    for gravity in [0.0, -10.0] {
        let (before, after) = (height(-2.0, gravity, 1), height(-2.0, gravity, 8));
        assert_eq!((before.position[1], before.velocity[1]), (1.0, 0.125));
        assert_eq!((after.position[1], after.velocity[1]), (0.0, 0.0), "{gravity}");
        assert_eq!(before.wall_events, [], "{gravity}");
        // At 2 m/s from 1 m, or sooner with gravity: 1 - 2 t - 5 t^2 is below 0 from t = 0.29 on.
        let step = if gravity == 0.0 { 4 } else { 3 };
        assert_eq!(after.wall_events, [WallEvent { step, vertex: 0, wall: 0, has_come: true }], "{gravity}");
    }
    // It comes to rest on the wall, and is drawn away from there by nothing: one event.
    assert_eq!(height(-2.0, -10.0, 40).wall_events.len(), 1);
    // In the first step, too.
    assert_eq!(
        height(-16.0, 0.0, 2).wall_events,
        [WallEvent { step: 1, vertex: 0, wall: 0, has_come: true }]
    );
}

// A change of the run changes the count with it.
#[test]
fn events_are_counted_as_they_come_and_go() {
    let events = |speed: f64, budget| {
        let mut scene = thrown("velocity-verlet", "", "");
        scene.body[0].velocity = None;
        let mut simulation = assembled(&scene).0;
        for v in simulation.state_mut().v_mut().chunks_exact_mut(2) {
            v.copy_from_slice(&[0.0, speed]);
        }
        let mut loss = |_: &LossFrame<'_>, _: &mut [f64], _: &mut [f64]| 0.0;
        gradient(&mut simulation, 300, &mut loss, &mut [], budget).unwrap().wall_events
    };
    assert_eq!(events(1.0, UNLIMITED), []);
    let fallen = events(-0.5, UNLIMITED);
    assert!(!fallen.is_empty() && fallen.is_sorted());
    assert_eq!(events(-0.5, 0), fallen, "of few states in memory");
    assert_ne!(events(-3.0, UNLIMITED), fallen);
    // As the run has it: vertices on a wall at the end of a step, in the order of the scene.
    let scene = thrown("velocity-verlet", "", "");
    let mut simulation = assembled(&scene).0;
    let (mut before, mut expected) = (vec![false; 18], vec![]);
    for v in simulation.state_mut().v_mut().chunks_exact_mut(2) {
        v.copy_from_slice(&[0.0, -0.5]);
    }
    for step in 1..=300 {
        simulation.step().unwrap();
        let (x, walls) = (simulation.positions().into_owned(), simulation.system().walls());
        let touches = |vertex: usize, wall: usize| walls[wall].depth(&x[2 * vertex..][..2]).abs() < 1e-15;
        let after: Vec<bool> = (0..18).map(|i| touches(i / 2, i % 2)).collect();
        let changed = (0..18).filter(|i| before[*i] != after[*i]);
        expected.extend(changed.map(|i| WallEvent { step, vertex: i / 2, wall: i % 2, has_come: after[i] }));
        before = after;
    }
    assert_eq!(fallen, expected);
    assert!(fallen.iter().any(|event| event.vertex > 0));
}

// Few states in memory make no other derivatives: what a scheme remembers is among them.
#[test]
fn schemes_with_memory_go_back_from_few_states() {
    for scheme in ["bdf2", "newmark", "generalised-alpha"] {
        let mut solved = thrown(scheme, "", "");
        solved.world.puts_back = true;
        solved.time.step = Some(2e-3);
        let found = |budget| {
            let mut simulation = assembled(&solved).0;
            let mut loss = |frame: &LossFrame<'_>, x_bar: &mut [f64], _: &mut [f64]| {
                x_bar[4] = if frame.step == 20 { 1.0 } else { 0.0 };
                0.0
            };
            gradient(&mut simulation, 20, &mut loss, &mut [], budget).unwrap()
        };
        let (all, few) = (found(UNLIMITED), found(4000));
        assert_eq!(all.wall_events, few.wall_events, "{scheme}");
        assert!(!all.wall_events.is_empty(), "{scheme}");
        let largest = all.velocity.iter().fold(0.0, |largest: f64, by| largest.max(by.abs()));
        let near = |(a, b): (&f64, &f64)| (a - b).abs() <= 1e-7 * largest;
        assert!(all.velocity.iter().zip(&few.velocity).all(near), "{scheme}");
    }
}

// Equilibria are those of what walls push, too; what dissipates begins the next one from there.
#[test]
fn equilibria_at_walls_have_derivatives() {
    let sagging = |young: f64, damping: &str| {
        let text = format!(
            "dimension = 2
             [time]
             integrator = \"quasi-static\"
             duration = 4.0
             step = 1.0
             solver = {{ tolerance = 1e-14 }}
             [world]
             gravity = [\"0.3*t\", \"-3*t\"]
             walls = [{{ normal = [0.1, 1.0], offset = -0.005 }}]
             [contact]
             stiffness = 1e5
             [[body]]
             name = \"beam\"
             mesh = {{ grid = {{ cells = [4, 1], size = [0.4, 0.1] }} }}
             elastic = {{ neo-hookean = {{ young = {young:?}, poisson = 0.3 }} }}
             mass = {{ density = 1000.0 }}
             pin = [{{ half_space = {{ normal = [1.0, 0.0], offset = 0.0 }} }}]
             {damping}"
        );
        Scene::from_toml(&text).unwrap()
    };
    for damping in ["", "damping = { stiffness_proportional = 0.5, mass_proportional = 9.0 }"] {
        let scene = sagging(1e5, damping);
        let found = compare_starts(damping, &scene, (3, 1e-7), |now| !now.contacts().is_empty());
        assert!(found.contact_events.come > 0, "{:?}", found.contact_events);
        compare_with_tangents(damping, &scene, 3);
        let of_young = |young| sagging(young, damping);
        compare_number(damping, of_young, ("body.beam.elastic.young", 1e5, 1e5), (3, 1e-6));
    }
}
