//! Linear solvers of solids in contact, in steps of time.

use pliant::simulation::Simulation;

/// A block of 3,000 unknowns that has fallen onto a floor with friction for 8 steps.
fn fallen(young: f64, linear: &str) -> Simulation {
    let text = format!(
        "dimension = 3\n\
         time = {{ integrator = 'implicit-euler', step = 0.01, duration = 1.0, \
           solver = {{ tolerance = 1e-9, linear = '{linear}' }} }}\n\
         world = {{ gravity = [0, 0, -9.81] }}\ncontact = {{ distance = 1e-3, friction = 0.3 }}\n\
         [[body]]\n\
         mesh = {{ grid = {{ cells = [9, 9, 9], size = [0.2, 0.2, 0.2], origin = [0, 0, 2e-3] }} }}\n\
         elastic = {{ neo-hookean = {{ young = {young:e}, poisson = 0.3 }} }}\nmass = {{ density = 1000 }}\n\
         velocity = {{ rigid = {{ linear = [0.2, 0, -0.5] }} }}\n\
         [[obstacle]]\nshape = {{ half_space = {{ normal = [0, 0, 1], offset = 0 }} }}\n"
    );
    let mut simulation = super::assembled(&text).simulation;
    super::advance(&mut simulation, 8);
    simulation
}

/// Soft blocks take conjugate gradients with symmetric Gauss-Seidel alone. Stiff ones would take hundreds of
/// iterations: multigrid takes over, for longer after each time, and all end at the same place.
#[test]
fn conjugate_gradients_without_levels_come_first_while_they_are_quick() {
    for (young, are_quick, times_levels) in [(1e5, true, 1.5), (1e11, false, 3.0)] {
        let [auto, multigrid, exact] = ["auto", "multigrid", "cholesky"].map(|linear| fallen(young, linear));
        let [work, levels] = [&auto, &multigrid].map(|simulation| simulation.work().solver.unwrap());
        assert_eq!(work.factorizations, 0, "{young:e}: {work:?}");
        assert_eq!(work.fallbacks == 0, are_quick, "{young:e}: {work:?}");
        let [own, of_levels] = [work, levels].map(|work| work.cg_iterations as f64);
        assert!(own > times_levels * of_levels, "{young:e}: {work:?} and {levels:?}");
        let (found, expected) = (auto.positions(), exact.positions());
        let apart = found.iter().zip(expected.iter()).map(|(a, b)| (a - b).abs());
        let apart = apart.fold(0.0, f64::max);
        assert!(apart < 1e-7, "{young:e}: {apart:e} m");
    }
}

/// Solids so slender and soft for the step that solves with multigrid take longer than many iterations of
/// conjugate gradients without it: each that has shown that gives these more, and hardly any follow.
#[test]
fn conjugate_gradients_without_levels_are_given_more_where_levels_are_slow() {
    let pin = |side: f64, speed: f64| {
        format!(
            "{{ half_space = {{ normal = [{side:?}, 0, 0], offset = -0.4999 }}, motion = {{ rotation = \
             {{ axis = [1, 0, 0], point = [0, 0, 0], speed = '{speed} deg/s' }} }} }}"
        )
    };
    let pins = format!("pin = [{}, {}]", pin(1.0, 144.0), pin(-1.0, -144.0));
    let mut text = "dimension = 3\n\
        time = { integrator = 'implicit-euler', step = 0.1, duration = 10.0 }\ncontact = {}\n"
        .to_owned();
    for [y, z] in [[-0.025, -0.025], [0.005, -0.025], [-0.025, 0.005], [0.005, 0.005]] {
        text += &format!(
            "[[body]]\nmesh = {{ grid = {{ cells = [70, 1, 1], size = [1, 0.02, 0.02], \
             origin = [-0.5, {y:?}, {z:?}] }} }}\n\
             elastic = {{ neo-hookean = {{ young = 1e5, poisson = 0.4 }} }}\n\
             mass = {{ density = 1000 }}\n{pins}\n"
        );
    }
    let mut simulation = super::assembled(&text).simulation;
    super::advance(&mut simulation, 17);
    let work = simulation.work().solver.unwrap();
    assert_eq!(work.factorizations, 0, "{work:?}");
    // Seventy would not do, and a pause after each time would leave most solves to levels.
    assert!(work.fallbacks > 0 && work.cg_iterations > 70 * work.hessians, "{work:?}");
    // Each that failed doubled them at least: three lead from 70 to more than any takes.
    assert!(work.fallbacks < 4, "{work:?}");
}
