//! Pressure and friction of contact at vertices, against forces that are known.

use pliant::simulation::Simulation;
use pliant_scene::assembly::Assembly;

/// Blocks of width 2 m under a uniform load of 100 Pa on a table, in two dimensions and in three.
const BLOCKS: [&str; 2] = [
    "dimension = 2
    time = { integrator = 'quasi-static', step = 1.0, duration = 1.0 }
    contact = { distance = 1e-3, stiffness = 1e7 }
    obstacle = [{ name = 'table', shape = { half_space = { normal = [0, 1], offset = 0 } } }]
    [[body]]
    name = 'block'
    mesh = { grid = { cells = [5, 2], size = [2.0, 1.0] } }
    transform = { translate = [0.0, 0.0009] }
    elastic = { neo-hookean = { young = 1e5, poisson = 0 } }
    mass = { total = 1.0 }
    pin = [{ half_space = { normal = [0, 1], offset = 10 }, axes = ['x'] }]
    load = [{ half_space = { normal = [0, -1], offset = -1 }, traction = ['0', '-100'] }]",
    "dimension = 3
    time = { integrator = 'quasi-static', step = 1.0, duration = 1.0 }
    contact = { distance = 1e-3, stiffness = 1e7 }
    obstacle = [{ name = 'table', shape = { half_space = { normal = [0, 0, 1], offset = 0 } } }]
    [[body]]
    name = 'block'
    mesh = { grid = { cells = [3, 2, 2], size = [2.0, 1.0, 1.0], element = 'hexahedron' } }
    transform = { translate = [0.0, 0.0, 0.0009] }
    elastic = { neo-hookean = { young = 1e5, poisson = 0 } }
    mass = { total = 1.0 }
    pin = [{ half_space = { normal = [0, 0, 1], offset = 10 }, axes = ['x', 'y'] }]
    load = [{ half_space = { normal = [0, 0, -1], offset = -1 }, traction = ['0', '0', '-100'] }]",
];

/// Pressures at the vertices below this height [m], without those of no surface.
fn pressures_below(height: f64, simulation: &Simulation) -> Vec<f64> {
    let d = simulation.system().dimension();
    let (x, tractions) = (simulation.positions(), simulation.contact_tractions());
    let low = x.chunks_exact(d).zip(tractions).filter(|(x, _)| x[d - 1] < height);
    low.map(|(_, traction)| traction.pressure).filter(|pressure| !pressure.is_nan()).collect()
}

#[test]
fn a_uniform_load_is_a_uniform_pressure_up_to_the_corners() {
    for block in BLOCKS {
        let mut simulation = super::assembled(block).simulation;
        super::advance(&mut simulation, 1);
        let pressures = pressures_below(0.01, &simulation);
        assert!(pressures.len() >= 6, "{pressures:?}");
        // Corners have the areas of sides in their weights, and so other gaps: the load is not quite even.
        for pressure in &pressures {
            assert!((pressure - 100.0).abs() < 0.01, "{pressures:?}");
        }
        // All other vertices of the surface carry nothing.
        let others = simulation.contact_tractions();
        let sum: f64 = others.iter().map(|t| t.pressure).filter(|p| !p.is_nan()).sum();
        assert!((sum - 100.0 * pressures.len() as f64).abs() < 0.1, "{sum}");
    }
}

/// Half a disk on a table (Johnson, *Contact Mechanics*, 1985, section 4.2): `p^2 = p0^2 (1 - x^2/a^2)` with
/// `p0 = 2 F / (pi a)`.
#[test]
fn pressures_under_half_a_disk_are_those_of_hertz() {
    let Assembly { mut simulation, .. } = super::scenes::opened("hertz_2d.toml");
    super::advance(&mut simulation, 4);
    let force: f64 = simulation.contacts().iter().map(|contact| contact.force).sum();
    let a = (4.0 * force / (1e6 / (1.0 - 0.09) * std::f64::consts::PI)).sqrt();
    // Per present area: the surface is compressed by (1 - 2 nu) (1 + nu) p / E along itself.
    let nominal = 2.0 * force / (std::f64::consts::PI * a);
    let expected = nominal / (1.0 - 0.4 * 1.3 * nominal / 1e6);
    let (x, tractions) = (simulation.positions(), simulation.contact_tractions());
    let of_vertex = x.chunks_exact(2).zip(tractions).map(|(x, traction)| [x[0].abs(), traction.pressure]);
    let pressures: Vec<[f64; 2]> = of_vertex.filter(|[_, pressure]| *pressure > 0.0).collect();
    let [greatest, width] = super::statics::hertzian(&pressures, a);
    assert!((greatest - expected).abs() < 5e-3 * expected, "{greatest} Pa for {expected}");
    let present = a - 0.4 * 1.3 * 0.5 * force / 1e6;
    assert!((width - present).abs() < 0.02 * present, "{width} m for {present}");
}

/// A block that slides over a table: friction per area is the coefficient times the pressure, against the
/// motion.
#[test]
fn friction_per_area_of_what_slides_is_the_coefficient_times_the_pressure() {
    let mut simulation = super::assembled(
        "dimension = 2
        time = { integrator = 'implicit-euler', step = 0.01, duration = 1.0 }
        contact = { distance = 1e-3, stiffness = 1e7, friction = 0.3, threshold_speed = 1e-4 }
        world = { gravity = [0.0, -10.0] }
        obstacle = [{ name = 'table', shape = { half_space = { normal = [0, 1], offset = 0 } } }]
        [[body]]
        name = 'block'
        mesh = { grid = { cells = [4, 2], size = [2.0, 1.0] } }
        transform = { translate = [0.0, 0.0009] }
        elastic = { neo-hookean = { young = 1e6, poisson = 0.3 } }
        mass = { density = 100.0 }
        velocity = { rigid = { linear = [3.0, 0.0] } }",
    )
    .simulation;
    super::advance(&mut simulation, 20);
    let tractions = simulation.contact_tractions();
    let loaded: Vec<_> = tractions.iter().filter(|traction| traction.pressure > 1.0).collect();
    assert!(loaded.len() >= 4, "{tractions:?}");
    for traction in loaded {
        let [x, y, z] = traction.shear;
        assert!((x + 0.3 * traction.pressure).abs() < 1e-9 * traction.pressure, "{traction:?}");
        assert!(y.abs() < 1e-9 * traction.pressure && z == 0.0, "{traction:?}");
    }
}
