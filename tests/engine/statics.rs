use pliant_scene::Scene;
use pliant_scene::assembly::UnstableStep;

/// Two bars of E = 1 MPa and nu = 0, the second pulled by 2 and 3 N at its right end, linear: `u = F L /
/// (E A)`, `sigma = F / A`.
#[test]
fn a_pulled_bar_has_the_displacement_the_stress_and_the_reactions_of_the_book() {
    let bar = |name: &str, origin: f64, load: &str| {
        format!(
            "[[body]]\nname = '{name}'\n\
             mesh = {{ grid = {{ cells = [4, 1], size = [2, 0.5], origin = [0, {origin}] }} }}\n\
             elastic = {{ linear = {{ young = 1e6, poisson = 0.0 }} }}\nmass = {{ density = 1.0 }}\n\
             pin = [{{ half_space = {{ normal = [1, 0], offset = 0 }}, axes = ['x'] }}, {{ vertices = [0], \
             axes = ['y'] }}]\n\
             load = [{{ half_space = {{ normal = [-1, 0], offset = -2 }}, traction = [{load}, 0] }}]\n"
        )
    };
    let text = format!(
        "dimension = 2\ntime = {{ integrator = 'quasi-static', step = 1.0, duration = 1.0 }}\n{}{}",
        bar("upper", 1.0, "-4.0"),
        bar("lower", 0.0, "6.0")
    );
    let mut assembly = Scene::from_toml(&text).unwrap().assemble(UnstableStep::Refuse).ok().unwrap();
    let (simulation, topology) = (&mut assembly.simulation, &assembly.topology);
    simulation.step().unwrap();
    let found = simulation.static_state(topology).unwrap();
    let close = |a: f64, b: f64| (a - b).abs() < 1e-9 * b.abs().max(1.0);
    assert!(close(found.displacement.value / 12e-6, 1.0), "{found:?}");
    assert_eq!(found.displacement.body, "lower");
    assert!(close(found.displacement.at[0], 2.0 + 12e-6), "{found:?}");
    let stress = found.von_mises.as_ref().unwrap();
    // Cauchy's is Piola's times the stretch, which is 1 + 6e-6.
    assert!((stress.value / 6.0 - 1.0).abs() < 1e-4 && stress.body == "lower", "{found:?}");
    assert!(close(found.reactions[0], 2.0 - 3.0) && close(found.reactions[1], 0.0), "{found:?}");
    assert!(found.residual < 1e-8, "{found:?}");
    // The number is that in the body.
    let first = topology.bodies[1].vertices.start as usize;
    let row = &topology.rest_positions[2 * (first + found.displacement.index)..][..2];
    assert!(row[0] == 2.0 && row[1] <= 0.5, "{row:?}");
    assert!(stress.index < 8 && stress.at[1] < 0.5, "{stress:?}");
}

/// A heavy block taken along by both its ends, as a rigid body, ever faster: time is a name for the load.
#[test]
fn nothing_has_inertia_in_statics() {
    let motion = "motion = { displacement = ['5 * t^2', '0'] }";
    let text = format!(
        "dimension = 2\ntime = {{ integrator = 'quasi-static', step = 0.1, duration = 1.0 }}\n\
         [[body]]\nmesh = {{ grid = {{ cells = [2, 2], size = [0.1, 0.1] }} }}\n\
         elastic = {{ neo-hookean = {{ young = 1e5, poisson = 0.3 }} }}\nmass = {{ density = 1e6 }}\n\
         pin = [{{ half_space = {{ normal = [0, 1], offset = 0.001 }}, {motion} }}, \
         {{ half_space = {{ normal = [0, -1], offset = -0.099 }}, {motion} }}]\n"
    );
    let assembly = Scene::from_toml(&text).unwrap().assemble(UnstableStep::Refuse).ok().unwrap();
    let mut simulation = assembly.simulation;
    (0..5).for_each(|_| simulation.step().unwrap());
    let measured = simulation.diagnostics();
    assert_eq!((measured.kinetic, measured.linear_momentum), (0.0, [0.0; 3]));
    assert!(measured.balance.unwrap().motion.unwrap().abs() < 1e-9, "{measured:?}");
    for reaction in simulation.reactions() {
        assert!(reaction.force.iter().all(|force| force.abs() < 1e-9), "{reaction:?}");
    }
}

/// Place of the end of a cantilever of hexahedra that a traction bends, and iterations of Newton's method.
fn bent(poisson: f64, traction: f64, increments: u32) -> (Vec<f64>, u64) {
    let text = format!(
        "dimension = 3\n\
         time = {{ integrator = 'quasi-static', step = {}, duration = 1.0 }}\n\
         [[body]]\nname = 'beam'\n\
         mesh = {{ grid = {{ cells = [20, 2, 1], size = [1, 0.1, 0.05], element = 'hexahedron' }} }}\n\
         elastic = {{ neo-hookean = {{ young = 1e6, poisson = {poisson} }} }}\nmass = {{ density = 1.0 }}\n\
         pin = [{{ half_space = {{ normal = [1, 0, 0], offset = 0 }} }}]\n\
         load = [{{ half_space = {{ normal = [-1, 0, 0], offset = -1 }}, traction = [0, '-{traction} * t', \
         0] }}]\n",
        1.0 / f64::from(increments),
    );
    let mut assembly = Scene::from_toml(&text).unwrap().assemble(UnstableStep::Refuse).ok().unwrap();
    let simulation = &mut assembly.simulation;
    (0..increments).for_each(|_| simulation.step().unwrap());
    let x = simulation.positions();
    let last = x.chunks_exact(3).last().unwrap().to_vec();
    (last, simulation.work().solver.unwrap().newton_iterations)
}

// A line search that asked every step for decrease took 49 iterations for the hexahedra, and ever shorter
// increments: whole steps raise the energy there by as much as the bulk modulus is larger.
#[test]
fn a_nearly_incompressible_beam_bends_far_in_a_few_iterations() {
    for poisson in [0.499, 0.4999] {
        let (at_once, iterations) = bent(poisson, 600.0, 1);
        assert!(iterations <= 9, "nu = {poisson}: {iterations} iterations");
        let (slowly, _) = bent(poisson, 600.0, 2);
        for (a, b) in at_once.iter().zip(&slowly) {
            assert!((a - b).abs() < 1e-7, "nu = {poisson}: {at_once:?}, {slowly:?}");
        }
        assert!(at_once[1] < -0.1, "{at_once:?}");
    }
}

// Loads so large that whole steps lead nowhere: what is watched is taken back, and the equilibrium is that of
// small increments. A search that goes on from where the watch ends finds it too, after 117 iterations.
#[test]
fn steps_that_lead_nowhere_are_taken_back() {
    let (at_once, iterations) = bent(0.45, 3000.0, 1);
    assert!(iterations <= 75, "{iterations} iterations");
    let (slowly, _) = bent(0.45, 3000.0, 4);
    for (a, b) in at_once.iter().zip(&slowly) {
        assert!((a - b).abs() < 1e-7, "{at_once:?}, {slowly:?}");
    }
    assert!(at_once[1] < -0.4, "{at_once:?}");
}
