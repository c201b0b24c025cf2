//! Tangents by parameters against adjoints, and products with the Gauss-Newton matrix.

use pliant::simulation::Simulation;
use pliant_gradient::{
    GradientError, LossFrame, ParameterSelection, RunDirection, RunGradient, RunTangent, UNLIMITED,
    gauss_newton_product, gradient, names, tangent_along,
};
use pliant_scene::Scene;

use crate::solid::{Further, assembled, scene};
use crate::support::{case, dot, scattered, schemes, solve_exactly};

/// Compares `w . (S u) = (S^T w) . u` for changes `u` of each of the numbers of these names.
pub(crate) fn compare(what: &str, scene: &Scene, names: &[&str], steps: u64) {
    let start = || {
        let (mut simulation, topology) = assembled(scene);
        solve_exactly(&mut simulation);
        (simulation, topology)
    };
    let (mut simulation, topology) = start();
    let n = simulation.state().x().len();
    let [w_x, w_v, w_middle] = [3.0, 4.0, 5.0].map(|seed| scattered(n, seed));
    let middle = steps / 2;
    let mut loss = |frame: &LossFrame<'_>, x_bar: &mut [f64], v_bar: &mut [f64]| {
        if frame.step == steps {
            x_bar.copy_from_slice(&w_x);
            v_bar.copy_from_slice(&w_v);
        }
        if frame.step == middle {
            x_bar.iter_mut().zip(&w_middle).for_each(|(bar, w)| *bar += w);
        }
        0.0
    };
    let mut chosen = ParameterSelection::new(scene, &topology, simulation.numbering(), names).unwrap();
    let back = gradient(&mut simulation, steps, &mut loss, chosen.parameters(), UNLIMITED).unwrap();
    for (i, (name, by)) in names.iter().zip(chosen.parts(&back)).enumerate() {
        let (mut simulation, _) = start();
        let changes: Vec<Vec<f64>> = chosen
            .parts(&back)
            .iter()
            .enumerate()
            .map(|(j, part)| if i == j { scattered(part.len(), 1.0) } else { vec![0.0; part.len()] })
            .collect();
        let zero = vec![0.0; n];
        let direction = RunDirection { position: &zero, velocity: &zero, parameters: &changes };
        let mut at_middle = vec![];
        let mut watch = |frame: &LossFrame<'_>, change: &RunTangent| {
            if frame.step == middle {
                at_middle.clone_from(&change.position);
            }
        };
        let forth = tangent_along(&mut simulation, steps, direction, chosen.parameters(), &mut watch);
        let forth = forth.unwrap_or_else(|error| panic!("{what}, {name}: {error}"));
        let forwards = dot(&w_x, &forth.position) + dot(&w_v, &forth.velocity) + dot(&w_middle, &at_middle);
        let backwards = dot(&by, &changes[i]);
        let sizes = [&forth.position, &forth.velocity, &at_middle].map(|dots| dot(dots, dots).sqrt());
        let size = sizes.iter().sum::<f64>() * (n as f64).sqrt();
        let error = (forwards - backwards).abs();
        assert!(error <= 1e-12 * size, "{what}, {name}: {forwards:e}, {backwards:e}: {:e}", error / size);
        assert!(forwards.abs() > 1e-4 * size, "{what}, {name}: nothing to compare");
    }
}

const SOLID: [&str; 7] = [
    "body.beam.elastic.young",
    "body.beam.elastic.poisson",
    "body.beam.elastic.young_per_element",
    "body.beam.elastic.poisson_per_element",
    "body.beam.mass.density",
    "body.beam.rest",
    "world.gravity",
];

#[test]
fn tangents_by_parameters_are_the_transpose_of_gradients() {
    for scheme in schemes() {
        let setup = &case("beam")["setup"];
        if scheme == "quasi-static" {
            let one = scene(setup, "neo-hookean", scheme, 1, Further::default());
            compare(scheme, &one, &[&SOLID[..5], &["world.gravity"]].concat(), 1);
            continue;
        }
        let beam = scene(setup, "neo-hookean", scheme, 12, Further::default());
        compare(scheme, &beam, &[&SOLID[..], &["forces"]].concat(), 12);
    }
    for scheme in ["velocity-verlet", "tr-bdf2", "bdf2"] {
        let solid = scene(&case("box")["setup"], "neo-hookean", scheme, 8, Further::default());
        compare(scheme, &solid, &SOLID, 8);
    }
}

#[test]
fn tangents_by_numbers_of_loads_and_muscles_are_the_transpose_of_gradients() {
    let with = |load: &'static str, scheme| {
        scene(&case("beam")["setup"], "neo-hookean", scheme, 12, Further { body: load, ..Further::default() })
    };
    let name = |key: &str| format!("body.beam.{key}");
    let all = |names: &[&str]| names.iter().map(|key| name(key)).collect::<Vec<_>>();
    for scheme in ["velocity-verlet", "implicit-euler", "newmark(.3025,.6)"] {
        let force = "load = [{ traction = ['A*sin(w*t) where A = 900, w = 20', '-300*cos(20*t)*(1 + X)'] }]";
        let names = all(&["load.0.traction", "load.0.factor", "load.0.parameters.A", "load.0.parameters.w"]);
        compare(scheme, &with(force, scheme), &names.iter().map(|name| &name[..]).collect::<Vec<_>>(), 12);
        let pressure = "load = [{ pressure = 'p*(1 + 20*t) where p = 900' }]";
        let names = all(&["load.0.pressure", "load.0.factor", "load.0.parameters.p"]);
        compare(scheme, &with(pressure, scheme), &names.iter().map(|name| &name[..]).collect::<Vec<_>>(), 12);
        let muscle = "muscle = [{ fibre = { direction = [2, 'X + 1'] },
             tension = 'A*(1 + Y)*sin(9*t + k*X) where A = 4e3, k = 0.5' }]";
        let names = all(&["muscle.0.tension", "muscle.0.factor", "muscle.0.parameters.k"]);
        compare(scheme, &with(muscle, scheme), &names.iter().map(|name| &name[..]).collect::<Vec<_>>(), 12);
    }
}

#[test]
fn tangents_by_springs_masses_and_contact_are_the_transpose_of_gradients() {
    for scheme in ["velocity-verlet", "rk4", "implicit-euler", "bdf2"] {
        let chain = format!(
            "dimension = 2
             [time]
             integrator = \"{scheme}\"
             step = 0.01
             duration = 1.0
             [world]
             gravity = [0.0, -9.81]
             [[body]]
             name = \"chain\"
             mesh = {{ strand = {{ segments = 3, start = [0, 0], end = [0.9, 0.3] }} }}
             springs = {{ stiffness = [40.0, 35.0, 50.0], rest_length = [0.3, 0.25, 0.3] }}
             mass = {{ per_vertex = [0.3, 0.2, 0.25, 0.3] }}
             pin = [{{ vertices = [0] }}]"
        );
        let names = ["springs.stiffness", "springs.rest_length", "mass.per_vertex"];
        let names = names.map(|key| format!("body.chain.{key}"));
        compare(scheme, &Scene::from_toml(&chain).unwrap(), &names.each_ref().map(|name| &name[..]), 20);
        let step = if scheme == "implicit-euler" || scheme == "bdf2" { 5e-3 } else { 1e-4 };
        let block = format!(
            "dimension = 2
             [time]
             integrator = \"{scheme}\"
             step = {step:?}
             duration = 1.0
             [world]
             gravity = [0.0, -9.81]
             [contact]
             distance = 4e-3
             stiffness = 1e5
             [[body]]
             name = \"block\"
             mesh = {{ grid = {{ cells = [2, 2], size = [0.1, 0.1], origin = [0.0, 0.003] }} }}
             elastic = {{ neo-hookean = {{ young = 1e5, poisson = 0.3 }} }}
             mass = {{ density = 1000.0 }}
             [[obstacle]]
             name = \"slope\"
             shape = {{ half_space = {{ normal = [0.05, 1.0], offset = 0.0 }} }}"
        );
        compare(scheme, &Scene::from_toml(&block).unwrap(), &["contact.stiffness"], 20);
    }
}

#[test]
fn parameters_without_tangents_are_refused() {
    let setup = &case("beam")["setup"];
    let scene = scene(setup, "neo-hookean", "velocity-verlet", 1, Further::default());
    let (mut simulation, topology) = assembled(&scene);
    let chosen = ["world.gravity", "pins"];
    let mut chosen = ParameterSelection::new(&scene, &topology, simulation.numbering(), &chosen).unwrap();
    let zero = vec![0.0; simulation.state().x().len()];
    let changes = [vec![0.0, 1.0], vec![0.0; 2 * zero.len()]];
    let direction = RunDirection { position: &zero, velocity: &zero, parameters: &changes };
    let error =
        tangent_along(&mut simulation, 1, direction, chosen.parameters(), &mut |_, _| {}).unwrap_err();
    assert!(matches!(error, GradientError::Unsupported { .. }), "{error}");
    assert!(error.to_string().contains("by parameter 1"), "{error}");
}

const STEPS: u64 = 20;
const FITTED: [&str; 3] = ["body.beam.elastic.young", "body.beam.elastic.poisson", "world.gravity"];

/// The tip, vertex 7 of the beam.
fn is_tip(i: usize) -> bool {
    i / 2 == 7
}

/// The beam, its constants changed by parts of themselves.
fn fitted(scheme: &str, changes: [f64; 4]) -> (Simulation, ParameterSelection) {
    let mut setup = case("beam")["setup"].clone();
    let scaled = |key: &str, by: &[f64]| {
        let numbers = crate::support::numbers(&setup[key]);
        let scaled: Vec<f64> = numbers.iter().zip(by).map(|(number, by)| number * (1.0 + by)).collect();
        serde_json::Value::from(scaled)
    };
    let [young, poisson, x, y] = changes;
    let [young, poisson, gravity] =
        [scaled("young", &[young]), scaled("poisson", &[poisson]), scaled("gravity", &[x, y])];
    (setup["young"], setup["poisson"], setup["gravity"]) = (young, poisson, gravity);
    let scene = scene(&setup, "neo-hookean", scheme, STEPS, Further::default());
    let (mut simulation, topology) = assembled(&scene);
    solve_exactly(&mut simulation);
    let chosen = ParameterSelection::new(&scene, &topology, simulation.numbering(), &FITTED).unwrap();
    (simulation, chosen)
}

/// Sizes of the four numbers: products are compared in parts of them.
const SIZES: [f64; 4] = [5e4, 0.35, 0.7, -9.81];

/// The product of the Gauss-Newton matrix of half the squares of the tip at every fifth state with changes of
/// the four numbers, positions and velocities, all by their sizes.
fn product(scheme: &str, of: [f64; 4], by_start: f64, budget: usize) -> (RunGradient, [f64; 4]) {
    let (mut simulation, mut chosen) = fitted(scheme, [0.0; 4]);
    let n = simulation.state().x().len();
    let start: Vec<f64> = scattered(n, 2.0).iter().map(|s| by_start * s).collect();
    let changes = [vec![of[0] * SIZES[0]], vec![of[1] * SIZES[1]], vec![of[2] * SIZES[2], of[3] * SIZES[3]]];
    let direction = RunDirection { position: &start, velocity: &start, parameters: &changes };
    let mut curvature = |frame: &LossFrame<'_>, change: &RunTangent, x_bar: &mut [f64], _: &mut [f64]| {
        if frame.step.is_multiple_of(5) {
            let rows = x_bar.iter_mut().zip(&change.position).enumerate();
            rows.filter(|(i, _)| is_tip(*i)).for_each(|(_, (bar, change))| *bar = *change);
        }
    };
    let parameters = chosen.parameters();
    let found =
        gauss_newton_product(&mut simulation, STEPS, direction, &mut curvature, parameters, budget).unwrap();
    assert_eq!(simulation.state().step, STEPS);
    let by = chosen.parts(&found).concat();
    (found, std::array::from_fn(|i| by[i] * SIZES[i]))
}

#[test]
fn products_with_the_gauss_newton_matrix_are_symmetric_and_those_of_the_jacobians() {
    for scheme in ["velocity-verlet", "implicit-euler", "bdf2", "generalised-alpha(.5)", "gauss2"] {
        let unit = |i: usize| std::array::from_fn(|j| f64::from(u8::from(i == j)));
        let matrix: [[f64; 4]; 4] = std::array::from_fn(|i| product(scheme, unit(i), 0.0, UNLIMITED).1);
        // Rows of the Jacobian, one sweep for each.
        let mut expected = [[0.0; 4]; 4];
        for row in 0..10 {
            let (mut simulation, mut chosen) = fitted(scheme, [0.0; 4]);
            let (step, i) = (5 * (row / 2), 14 + row % 2);
            let mut loss = |frame: &LossFrame<'_>, x_bar: &mut [f64], _: &mut [f64]| {
                x_bar[i as usize] = if frame.step == step { 1.0 } else { 0.0 };
                0.0
            };
            let found = gradient(&mut simulation, STEPS, &mut loss, chosen.parameters(), UNLIMITED).unwrap();
            let by = chosen.parts(&found).concat();
            let by: [f64; 4] = std::array::from_fn(|k| by[k] * SIZES[k]);
            (0..4).for_each(|k| (0..4).for_each(|l| expected[k][l] += by[k] * by[l]));
        }
        let largest = expected.iter().flatten().fold(0.0, |largest: f64, e| largest.max(e.abs()));
        for k in 0..4 {
            assert!(matrix[k][k] > 0.0, "{scheme}: {matrix:?}");
            for l in 0..4 {
                let (found, expected) = (matrix[k][l], expected[k][l]);
                let scale = (matrix[k][k] * matrix[l][l]).sqrt();
                assert!((found - expected).abs() <= 1e-11 * largest, "{scheme}: {found:e}, {expected:e}");
                assert!((found - matrix[l][k]).abs() <= 1e-10 * scale, "{scheme}: {matrix:?}");
            }
        }
        // With changes of the start too: d . G d, and few states in memory.
        let (whole, by) = product(scheme, [0.3, -0.2, 0.1, 0.05], 0.1, UNLIMITED);
        let start: Vec<f64> = scattered(whole.position.len(), 2.0).iter().map(|s| 0.1 * s).collect();
        let along =
            dot(&by, &[0.3, -0.2, 0.1, 0.05]) + dot(&whole.position, &start) + dot(&whole.velocity, &start);
        assert!((along - whole.value).abs() <= 1e-10 * whole.value, "{scheme}: {along:e}, {:e}", whole.value);
        let few = product(scheme, [0.3, -0.2, 0.1, 0.05], 0.1, 0).0;
        assert!((few.value - whole.value).abs() <= 1e-12 * whole.value);
        assert!(few.position.iter().zip(&whole.position).all(|(a, b)| (a - b).abs() < 1e-9));
    }
}

// Where residuals are zero it is all of the Hessian: the change of the gradient.
#[test]
fn products_are_differences_of_gradients_where_the_data_are_met() {
    for scheme in ["velocity-verlet", "implicit-euler"] {
        let mut data = vec![];
        let (mut simulation, _) = fitted(scheme, [0.0; 4]);
        for step in 0..=STEPS {
            if step > 0 {
                simulation.step().unwrap();
            }
            data.push(simulation.positions().into_owned());
        }
        let of = [0.3, -0.2, 0.1, 0.05];
        let slope = |h: f64| -> [f64; 4] {
            let (mut simulation, mut chosen) = fitted(scheme, of.map(|c| h * c));
            let mut loss = |frame: &LossFrame<'_>, x_bar: &mut [f64], _: &mut [f64]| {
                if frame.step.is_multiple_of(5) {
                    let rows = x_bar.iter_mut().enumerate().filter(|(i, _)| is_tip(*i));
                    rows.for_each(|(i, bar)| *bar = frame.x[i] - data[frame.step as usize][i]);
                }
                0.0
            };
            let found = gradient(&mut simulation, STEPS, &mut loss, chosen.parameters(), UNLIMITED).unwrap();
            let by = chosen.parts(&found).concat();
            std::array::from_fn(|i| by[i] * SIZES[i])
        };
        let (_, found) = product(scheme, of, 0.0, UNLIMITED);
        let h = 1e-4;
        let [near, far] = [h, 2.0 * h].map(|h| [slope(h), slope(-h)]);
        for i in 0..4 {
            let difference = (8.0 * (near[0][i] - near[1][i]) - (far[0][i] - far[1][i])) / (12.0 * h);
            let largest = found.iter().fold(0.0, |largest: f64, by| largest.max(by.abs()));
            assert!(
                (found[i] - difference).abs() <= 1e-6 * largest,
                "{scheme}, {i}: {found:?}, {difference:e}"
            );
        }
    }
}

#[test]
fn every_parameter_but_those_of_held_places_has_a_tangent() {
    let body = "load = [{ force = ['A*t where A = 2', 0] }]
                muscle = [{ fibre = { direction = [1, 0] }, tension = 100 }]
                damping = { mass_proportional = 1.0 }";
    let setup = &case("beam")["setup"];
    let scene = scene(setup, "neo-hookean", "velocity-verlet", 2, Further { body, ..Further::default() });
    let topology = assembled(&scene).1;
    for name in names(&scene, &topology) {
        if ["position", "velocity"].contains(&&name[..]) {
            continue;
        }
        let mut simulation = assembled(&scene).0;
        let n = simulation.state().x().len();
        let mut chosen =
            ParameterSelection::new(&scene, &topology, simulation.numbering(), &[&name]).unwrap();
        chosen.parameters()[0].begin(2);
        let changes = [vec![0.0; chosen.parameters()[0].len()]];
        let zero = vec![0.0; n];
        let direction = RunDirection { position: &zero, velocity: &zero, parameters: &changes };
        let found = tangent_along(&mut simulation, 2, direction, chosen.parameters(), &mut |_, _| {});
        assert_eq!(found.is_ok(), name != "pins", "{name}");
    }
}
