//! Searches and steps that are asked to stop.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use pliant::deadline::Stopped;
use pliant::simulation::StepError;
use pliant::solver::SolveFailure;
use pliant_scene::Scene;

/// A clamped block of so many cells along x, with these keys of time.
fn block(cells: usize, time: &str) -> pliant::simulation::Simulation {
    let text = format!(
        "dimension = 3\ntime = {{ {time}, step = 1e-3, duration = 1.0 }}\nworld = {{ gravity = [0, 0, \
         -9.81] }}\n\
         [[body]]\nmesh = {{ grid = {{ cells = [{cells}, 2, 2], spacing = 0.5 }} }}\n\
         elastic = {{ neo-hookean = {{ young = 1e5, poisson = 0.3 }} }}\nmass = {{ density = 1000.0 }}\n\
         pin = [{{ half_space = {{ normal = [1, 0, 0], offset = 0 }} }}]\n"
    );
    let scene = Scene::from_toml(&text).unwrap();
    scene.assemble(pliant_scene::assembly::UnstableStep::Refuse).unwrap().simulation
}

/// Set beforehand, the flag ends them; taken back, they find what they look for.
#[test]
fn searches_end_where_they_are_stopped() {
    let mut simulation = block(20, "integrator = 'velocity-verlet'");
    let stop = Arc::new(AtomicBool::new(true));
    simulation.set_stop(Some(Arc::clone(&stop)));
    assert_eq!(simulation.stability_limit(1.0).unwrap_err(), Stopped);
    assert_eq!(simulation.modes(4).unwrap_err(), pliant::modes::ModesError::Stopped);
    stop.store(false, Ordering::Relaxed);
    assert!(simulation.stability_limit(1.0).unwrap().step.is_finite());
    assert_eq!(simulation.modes(4).unwrap().modes.len(), 4);
}

/// By every linear solver, multigrid with its set-up.
#[test]
fn steps_that_are_stopped_say_so_by_every_linear_solver() {
    for linear in ["cholesky", "cg", "multigrid", "matrix-free"] {
        let time = format!("integrator = 'implicit-euler', solver = {{ linear = '{linear}' }}");
        let mut simulation = block(4, &time);
        simulation.set_stop(Some(Arc::new(AtomicBool::new(true))));
        let error = simulation.step().unwrap_err();
        let stopped = matches!(error, StepError::Unsolved { verdict: SolveFailure::Stopped, .. });
        assert!(stopped, "{linear}: {error}");
    }
}

// A solve that has begun ends too, and leaves the state as it was.
#[test]
fn a_simulation_that_is_stopped_solves_no_more() {
    for (name, pace) in [
        ("'implicit-euler'", "step = 0.01"),
        ("'gauss2'", "step = 0.01"),
        ("{ ias15 = {} }", "step = 0.001"),
        ("'tr-bdf2'", "adaptive = { tolerance = 1e-3 }"),
        ("'bogacki-shampine3'", "adaptive = { tolerance = 1e-3 }"),
    ] {
        let mut simulation = Scene::from_toml(&format!(
            "dimension = 2\ntime = {{ integrator = {name}, {pace}, duration = 1.0 }}\nworld = {{ gravity = \
             [0, -9.81] }}\n\
             [[body]]\nmesh = {{ grid = {{ cells = [3, 1], spacing = 0.5 }} }}\n\
             elastic = {{ neo-hookean = {{ young = 1e5, poisson = 0.3 }} }}\nmass = {{ density = 1000.0 }}\n\
             pin = [{{ vertices = [0] }}]\n"
        ))
        .unwrap()
        .assemble(pliant_scene::assembly::UnstableStep::Accept)
        .unwrap()
        .simulation;
        simulation.step().unwrap();
        let before = (simulation.state().time, simulation.positions().into_owned());
        let stop = Arc::new(AtomicBool::new(true));
        simulation.system_mut().set_stop(Some(Arc::clone(&stop)));
        let error = simulation.step().unwrap_err();
        assert!(
            matches!(error, StepError::Unsolved { verdict: SolveFailure::Stopped, .. }),
            "{name}: {error}"
        );
        assert_eq!((simulation.state().time, simulation.positions().into_owned()), before, "{name}");
        stop.store(false, Ordering::Relaxed);
        simulation.step().unwrap();
    }
}
