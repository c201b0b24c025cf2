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
             pin = [{{ half_space = {{ normal = [1, 0], offset = 0 }}, axes = ['x'] }}, {{ vertices = [0], axes = ['y'] }}]\n\
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
