//! Where energy comes from and where it goes: present energy, less what came in, plus what was lost, stays
//! the same to the order of the scheme, whatever a scene has in it.

use pliant::simulation::Simulation;
use pliant_scene::assembly::UnstableStep;
use pliant_scene::{Scene, SceneError};

use crate::support::{advance, assert_relative, methods};

/// Block of 2 x 1 m in 2D, of 2 x 1 cells, stretched at the start, in a `world`, with more `keys`.
pub(super) fn block(integrator: &str, step: f64, world: &str, keys: &str) -> Simulation {
    let text = format!(
        "dimension = 2\ntime = {{ integrator = '{integrator}', step = {step:?}, duration = 1.0 }}\nworld = \
         {{ {world} }}\n\
         [[body]]\nmesh = {{ grid = {{ cells = [2, 1], size = [2, 1] }} }}\n\
         elastic = {{ stable-neo-hookean = {{ young = 2e3, poisson = 0.3 }} }}\nmass = {{ density = 10.0 }}\n\
         position = {{ affine = {{ matrix = [[1.1, 0.0], [0.0, 0.95]] }} }}\n{keys}\n"
    );
    let mut scene = Scene::from_toml(&text).unwrap_or_else(|e| panic!("{e}\n{text}"));
    // As by studies, which compare all schemes: those that hold contact would solve for walls.
    scene.world.puts_back = true;
    scene.assemble(UnstableStep::Accept).map_err(SceneError::new).unwrap().simulation
}

/// Pin of the left side.
pub(super) const PINNED: &str = "pin = [{ half_space = { normal = [1, 0], offset = 0 } }]";

/// In weightlessness, one row of vertices meets a wall in the first step, and what moves on goes on to press
/// on it.
#[test]
fn what_a_wall_takes_is_the_energy_of_arrival() {
    let keys = "velocity = { rigid = { linear = [3.0, -2.0] } }";
    let world = "walls = [{ normal = [0, 1], offset = 0 }]";
    let mut simulation = block("velocity-verlet", 1e-7, world, keys);
    let (system, state) = (simulation.system(), simulation.state());
    let rows = state.x().chunks(2).zip(system.mass());
    let lowest: f64 = rows.filter(|(x, _)| x[1] < 0.1).map(|(_, m)| m).sum();
    simulation.step().unwrap();
    let lost = simulation.diagnostics().balance.unwrap().walls.unwrap();
    // The motion along the normal is gone; in 1e-7 s forces have not changed it.
    assert_relative(lost, 0.5 * lowest * 4.0, 1e-5, "the first step");
    advance(&mut simulation, 100);
    let later = simulation.diagnostics().balance.unwrap().walls.unwrap();
    assert_relative(later, lost, 1e-5, "what presses on a wall that it has reached loses nothing");
    simulation.state_mut();
    advance(&mut simulation, 1);
    let again = simulation.diagnostics().balance.unwrap().walls.unwrap();
    assert!(again < 1e-9 * lost, "a state that was changed by hand begins a balance of its own: {again}");
}

/// A force that goes away at once: its potential jumps, its power is finite.
#[test]
fn a_load_that_jumps_leaves_the_balance_closed() {
    let keys = format!("{PINNED}\nload = [{{ force = [0, '-200 * (t < 0.2)'] }}]");
    let residual = |steps: usize| {
        let mut simulation = block("rk4", 0.4 / steps as f64, "", &keys);
        let start = simulation.diagnostics();
        (0..steps).for_each(|_| simulation.step().unwrap());
        let end = simulation.diagnostics();
        assert!(end.balance.unwrap().loads.unwrap() > 1.0, "{end:?}");
        (end.conserved() - start.conserved()).abs()
    };
    // One order in the step of the jump.
    let (coarse, fine) = (residual(400), residual(1600));
    assert!(coarse < 1.0 && coarse / fine > 3.0, "{coarse:e} {fine:e}");
}

/// A mass that is moved through the ether at a steady pace: what moves it does the work of the drag, and
/// nothing else.
#[test]
fn what_moves_a_mass_through_the_ether_does_the_work_of_the_drag() {
    let (mass, drag, speed) = (3.0, 0.7, 2.0);
    for method in methods() {
        let name = method.documentation.name;
        let text = format!(
            "dimension = 2\ntime = {{ integrator = '{name}', step = 0.01, duration = 1.0 }}\nworld = {{ \
             ether_drag = {drag:?} }}\n\
             [[body]]\nmesh = {{ inline = {{ points = [[0, 0], [1, 0]] }} }}\nmass = {{ per_vertex = \
             {mass:?} }}\n\
             pin = [{{ vertices = [0], motion = {{ velocity = [0, {speed:?}] }} }}]\n"
        );
        let scene = Scene::from_toml(&text).unwrap_or_else(|e| panic!("{e}\n{text}"));
        let mut simulation =
            scene.assemble(UnstableStep::Accept).map_err(SceneError::new).unwrap().simulation;
        advance(&mut simulation, 50);
        let balance = simulation.diagnostics().balance.unwrap();
        let work = drag * mass * speed * speed * 0.5;
        assert_relative(balance.motion.unwrap(), work, 1e-12, name);
        assert_relative(balance.ether_drag.unwrap(), work, 1e-12, name);
        // And pulls with its force.
        assert_relative(simulation.reactions()[0].force[1], drag * mass * speed, 1e-12, name);
    }
}

/// Losses are not computed where nothing asks for them: there is no ledger.
#[test]
fn losses_are_counted_only_where_somebody_asks() {
    let world = "ether_drag = 0.5, walls = [{ normal = [0, 1], offset = -0.1 }]";
    for asked in [false, true] {
        let mut simulation = block("rk4", 1e-4, world, "damping = { mass_proportional = 0.5 }");
        simulation.count_losses(asked);
        simulation.step().unwrap();
        let balance = simulation.diagnostics().balance;
        assert_eq!(balance.is_some_and(|balance| balance.counts_losses()), asked);
    }
}
