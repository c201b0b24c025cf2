//! Contact and friction against independent references: quadratures, closed forms, and trajectories of
//! programs that share nothing with this one. Scenes of the long cases of `pliant stress` are here in small
//! sizes.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]
#![allow(clippy::excessive_precision, reason = "references keep the digits they were computed to")]

mod arch;
#[path = "../../crates/lab/src/stress/rows/long/chain.rs"]
mod chain;
mod collision;
mod conservation;
mod dynamics;
mod explicit;
mod friction;
mod linked;
mod particle;
mod prescribed;
mod pressed;
mod scenes;
#[path = "../../crates/lab/src/stress/rows/long/setups.rs"]
mod setups;
mod sharp;
mod solvers;
mod start;
mod statics;
mod thin;
mod torture;
mod tractions;
mod units;
mod walls;

use pliant::simulation::Simulation;
use pliant_scene::Scene;
use pliant_scene::assembly::{Assembly, UnstableStep};

/// The scene of a text.
fn scene(text: &str) -> Scene {
    Scene::from_toml(text).unwrap_or_else(|error| panic!("{error}"))
}

/// The scene of a text, made ready to run.
fn assembled(text: &str) -> Assembly {
    scene(text).assemble(UnstableStep::Refuse).unwrap_or_else(|problems| panic!("{problems:?}"))
}

/// What is wrong with a scene that cannot be assembled.
fn problems(text: &str) -> String {
    match scene(text).assemble(UnstableStep::Refuse) {
        Ok(_) => panic!("the scene was assembled"),
        Err(problems) => format!("{problems:?}"),
    }
}

fn advance(simulation: &mut Simulation, steps: usize) {
    for _ in 0..steps {
        simulation.step().unwrap_or_else(|error| panic!("{error}"));
    }
}

/// Energy that is conserved: total less work done from outside, plus what friction took.
fn conserved(simulation: &mut Simulation) -> f64 {
    simulation.diagnostics().conserved()
}

/// A block of soft rubber, 0.2 m x 0.1 m in 3 x 2 cells, at rest on a floor that carries it: the scene with
/// these lines for its run and for its floor.
fn block_on_floor(time: &str, contact: &str, velocity: &str, floor: &str) -> Simulation {
    let scene = |time: &str, contact: &str, pin: &str, velocity: &str, position: &str, floor: &str| {
        format!(
            "dimension = 2\ntime = {time}\nworld = {{ gravity = [0, -9.81] }}\ncontact = {contact}\n\
             [[body]]\nname = 'block'\nmesh = {{ grid = {{ cells = [3, 2], size = [0.2, 0.1], origin = [0, \
             0.95e-3] }} }}\n\
             elastic = {{ neo-hookean = {{ young = 1e6, poisson = 0.3 }} }}\nmass = {{ density = 1000 }}\n\
             {pin}\n{velocity}\n{position}\n\
             [[obstacle]]\nname = 'floor'\nshape = {{ half_space = {{ normal = [0, 1], offset = 0 }} \
             }}\n{floor}\n"
        )
    };
    let held = "pin = [{ vertices = [0], axes = ['x'] }]";
    let statics =
        "{ integrator = 'quasi-static', step = 1.0, duration = 1.0, solver = { tolerance = 1e-14 } }";
    let frictionless = "{ distance = 1e-3, stiffness = 1e5 }";
    let mut settled = assembled(&scene(statics, frictionless, held, "", "", "")).simulation;
    advance(&mut settled, 1);
    let rows: Vec<String> =
        settled.positions().chunks(2).take(12).map(|x| format!("[{:?}, {:?}]", x[0], x[1])).collect();
    let position = format!("position = {{ per_vertex = [{}] }}", rows.join(", "));
    assembled(&scene(time, contact, "", velocity, &position, floor)).simulation
}
