//! Muscles in scenes: equilibria in closed form, the force at a length that is held, stability, mistakes.

use pliant::simulation::Simulation;
use pliant_scene::assembly::{Assembly, UnstableStep};
use pliant_scene::{Scene, SceneError};

use crate::support::solid::affine;
use crate::support::{advance, assert_relative};

fn scene(text: &str) -> Scene {
    Scene::from_toml(text).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

fn assembled(text: &str) -> Assembly {
    scene(text).assemble(UnstableStep::Refuse).map_err(SceneError::new).unwrap()
}

/// Young's modulus of all bodies here [Pa]; with a Poisson's ratio of zero the shear modulus is half of it.
const YOUNG: f64 = 2e4;
const SIZE: [f64; 3] = [2.0, 1.0, 0.5];

/// Elements: dimension, and what a scene says of them in the mesh and in the body.
const ELEMENTS: [(usize, &str, &str); 6] = [
    (2, "", ""),
    (3, "", ""),
    (2, "", "order = 2"),
    (3, "", "order = 2"),
    (2, ", element = 'quadrilateral'", ""),
    (3, ", element = 'hexahedron'", ""),
];

/// A block of [`SIZE`] in these elements, with more `keys`.
fn block(time: &str, (dimension, mesh, body): (usize, &str, &str), poisson: f64, keys: &str) -> String {
    let (cells, size) = (&[4, 2, 2][..dimension], &SIZE[..dimension]);
    format!(
        "dimension = {dimension}\ntime = {{ {time} }}\n[[body]]\n\
         mesh = {{ grid = {{ cells = {cells:?}, size = {size:?}{mesh} }} }}\n{body}\n\
         elastic = {{ neo-hookean = {{ young = {YOUNG:?}, poisson = {poisson:?} }} }}\n\
         mass = {{ density = 10.0 }}\n{keys}\n"
    )
}

const STATIC: &str =
    "integrator = 'quasi-static', step = 0.25, duration = 1.0, solver = { tolerance = 1e-13 }";

/// Holds three planes through the origin in their normals: a block is free to change its sides.
fn supported(dimension: usize) -> String {
    let pin = |axis: usize| {
        let mut normal = vec![0.0; dimension];
        normal[axis] = 1.0;
        let name = ["x", "y", "z"][axis];
        format!(
            "{{ name = '{name}', half_space = {{ normal = {normal:?}, offset = 0 }}, axes = ['{name}'] }}"
        )
    };
    format!("pin = [{}]", (0..dimension).map(pin).collect::<Vec<_>>().join(", "))
}

fn muscle(dimension: usize, direction: [f64; 3], tension: &str) -> String {
    let direction = &direction[..dimension];
    format!("muscle = [{{ fibre = {{ direction = {direction:?} }}, tension = '{tension}' }}]")
}

/// Stretches along the fibres and across, in which a block of the neo-Hookean law
/// `psi = mu/2 (I1 - 3 - 2 ln J) + lambda/2 (ln J)^2` is free of force under a tension `T`:
/// `mu (f^2 - 1) + lambda ln J + T f^2 = 0` and `mu (a^2 - 1) + lambda ln J = 0`, with as many stretches `a`
/// across as there are. By bisection of `ln J`.
fn stretches(poisson: f64, tension: f64, across: i32) -> [f64; 2] {
    let (mu, lambda) =
        (0.5 * YOUNG / (1.0 + poisson), YOUNG * poisson / (1.0 + poisson) / (1.0 - 2.0 * poisson));
    let at = |log_j: f64| {
        let square = (mu - lambda * log_j) / mu;
        [square * mu / (mu + tension), square].map(|square| square.max(0.0).sqrt())
    };
    let (mut low, mut high) = (-3.0, 1.0);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        let [fibre, side] = at(middle);
        let is_above = (fibre * side.powi(across)).ln() > middle;
        if is_above { low = middle } else { high = middle }
    }
    at(low)
}

/// `F = a I + (f - a) n n^T` with the unit vector `n` along the fibres.
fn deformation([fibre, across]: [f64; 2], direction: [f64; 3]) -> [[f64; 3]; 3] {
    let length = direction.iter().map(|c| c * c).sum::<f64>().sqrt();
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let n = direction[i] * direction[j] / (length * length);
            (if i == j { across } else { 0.0 }) + (fibre - across) * n
        })
    })
}

fn largest_force(simulation: &mut Simulation, x: &[f64]) -> f64 {
    let mut g = vec![0.0; x.len()];
    simulation.system_mut().gradient(x, &mut g);
    g.iter().fold(0.0, |largest: f64, g| largest.max(g.abs()))
}

#[test]
fn the_closed_form_without_a_second_modulus_is_what_the_search_finds() {
    let [fibre, across] = stretches(0.0, 1.5 * YOUNG, 2);
    assert_relative(fibre, 0.5, 1e-14, "1/sqrt(1 + T/mu)");
    assert_relative(across, 1.0, 1e-14, "across");
}

/// Fibres at any angle: a free block is in equilibrium, node by node, where stress and tension balance
/// along the fibres and the stress is zero across.
#[test]
fn a_free_block_is_at_rest_where_stress_and_tension_balance() {
    for element @ (dimension, mesh, body) in ELEMENTS {
        for (poisson, factor) in [(0.0, 1.5), (0.3, 0.4), (0.3, -0.2)] {
            let (tension, direction) = (factor * YOUNG, [3.0, if dimension == 2 { -4.0 } else { 1.0 }, 2.0]);
            let direction = if dimension == 2 { [3.0, -4.0, 0.0] } else { direction };
            let keys = muscle(dimension, direction, &format!("{tension:?}"));
            let mut simulation = assembled(&block(STATIC, element, poisson, &keys)).simulation;
            let f = deformation(stretches(poisson, tension, dimension as i32 - 1), direction);
            let rows: Vec<&[f64]> = f[..dimension].iter().map(|row| &row[..dimension]).collect();
            let rest = simulation.state().x().to_vec();
            let at_rest = largest_force(&mut simulation, &rest);
            let x = affine(&rest, &rows, &[0.3, -2.0, 1.0][..dimension]);
            let left = largest_force(&mut simulation, &x);
            // Products of positions of a few metres, their rounding, and the modulus.
            assert!(
                left < 1e-14 * 1e2 * YOUNG && at_rest > 1e2,
                "{dimension}D{mesh} {body}: {left:e} of {at_rest:e} N"
            );
        }
    }
}

/// Held against sliding alone, a block contracts to half its length under a tension of three shear moduli.
#[test]
fn a_muscle_contracts_to_the_length_of_its_equilibrium() {
    for element @ (dimension, mesh, body) in ELEMENTS {
        for (poisson, factor) in [(0.0, 1.5), (0.3, 0.4)] {
            let tension = format!("{} * t", factor * YOUNG);
            let keys = supported(dimension) + "\n" + &muscle(dimension, [-7.0, 0.0, 0.0], &tension);
            let mut simulation = assembled(&block(STATIC, element, poisson, &keys)).simulation;
            let rest = simulation.state().x().to_vec();
            advance(&mut simulation, 4);
            let [fibre, across] = stretches(poisson, factor * YOUNG, dimension as i32 - 1);
            for (x, rest) in simulation.state().x().chunks(dimension).zip(rest.chunks(dimension)) {
                for c in 0..dimension {
                    let expected = rest[c] * if c == 0 { fibre } else { across };
                    let error = (x[c] - expected).abs();
                    assert!(error < 1e-10, "{dimension}D{mesh} {body}: {x:?} of {rest:?}, {fibre} {across}");
                }
            }
        }
    }
}

/// Between plates that hold its length and let it slide, a muscle pulls with its tension times its area.
#[test]
fn the_force_at_a_held_length_is_area_times_tension() {
    for element @ (dimension, mesh, body) in ELEMENTS {
        let mut to = vec![0.0; dimension];
        to[0] = -1.0;
        let pins = supported(dimension).replace(
            "pin = [",
            &format!(
                "pin = [{{ name = 'end', half_space = {{ normal = {to:?}, offset = -2 }}, axes = ['x'] }}, "
            ),
        );
        let keys = pins + "\n" + &muscle(dimension, [1.0, 0.0, 0.0], "300 * t^2");
        let mut simulation = assembled(&block(STATIC, element, 0.3, &keys)).simulation;
        let area = SIZE[1..dimension].iter().product::<f64>();
        for step in 1..=4 {
            advance(&mut simulation, 1);
            let t = 0.25 * f64::from(step);
            let reactions = simulation.reactions();
            let of = |name: &str| reactions.iter().find(|r| r.name.ends_with(name)).unwrap().force[0];
            let expected = 300.0 * t * t * area;
            assert_relative(of("end"), expected, 1e-11, &format!("{dimension}D{mesh} {body}"));
            assert_relative(of("/x"), -expected, 1e-11, &format!("{dimension}D{mesh} {body}"));
        }
    }
}

/// Tension that is the same at all times has a potential, zero at rest: nothing is brought in.
#[test]
fn steady_tension_is_potential_energy() {
    let element = (2, "", "");
    let time = "integrator = 'velocity-verlet', step = 2e-4, duration = 1.0";
    let mut simulation =
        assembled(&block(time, element, 0.3, &muscle(2, [1.0, 0.5, 0.0], "5 kPa"))).simulation;
    let start = simulation.diagnostics();
    assert!(start.loads.unwrap().abs() < 1e-10, "{start:?}");
    advance(&mut simulation, 1000);
    let end = simulation.diagnostics();
    assert!(end.balance.is_none() && end.loads.unwrap() < -100.0, "{end:?}");
    assert!((end.total - start.total).abs() < 1e-3 * end.kinetic.max(end.elastic), "{start:?} {end:?}");
}

/// Nothing outside holds it: it moves and turns as a whole as it did.
#[test]
fn a_muscle_brings_neither_momentum_nor_spin_in() {
    for element in ELEMENTS {
        let keys = muscle(element.0, [1.0, 0.5, 0.2], "5e3 * X * sin(30*t)");
        let time = "integrator = 'velocity-verlet', step = 1e-4, duration = 1.0";
        let mut simulation = assembled(&block(time, element, 0.3, &keys)).simulation;
        advance(&mut simulation, 200);
        let end = simulation.diagnostics();
        assert!(end.kinetic > 0.5, "{element:?} {end:?}");
        let all = end.linear_momentum.iter().chain(&end.angular_momentum);
        // 200 sums of forces of some kN at 1e-16, for 1e-4 s each.
        all.for_each(|p| assert!(p.abs() < 1e-12, "{element:?} {end:?}"));
    }
}

/// The limit counts a tension that comes later: explicit steps just below it stay bounded at full tension,
/// those of the passive block do not. The stiffness of this material is the same at every length.
#[test]
fn explicit_steps_are_stable_under_the_tension_to_come() {
    let simulation = |step: f64, tension: &str| {
        let time = format!("integrator = 'velocity-verlet', step = {step:?}, duration = 0.5");
        let keys = muscle(2, [1.0, 0.0, 0.0], tension) + "\ndamping = { mass_proportional = 20 }";
        let text = block(&time, (2, "", ""), 0.3, &keys).replace("neo-hookean", "corotated");
        scene(&text).assemble(UnstableStep::Accept).map_err(SceneError::new).unwrap().simulation
    };
    let limit = |tension: &str| simulation(1e-7, tension).stability_limit(0.5).unwrap().step;
    let (passive, steady) = (limit("1e-3"), limit("2e4"));
    let [ramp, pulse] = ["2e4 * smoothstep(0, 0.2, t)", "2e4 * pulse(0.4, 0.401, t)"].map(limit);
    let limits = format!("{passive:e} {steady:e} {ramp:e} {pulse:e}");
    // With the tension there from the start it is computed, with one to come bounded.
    assert!((ramp / pulse - 1.0).abs() < 1e-9 && ramp <= steady && steady < passive, "{limits}");
    assert!(ramp > 0.9 * steady, "{limits}");
    let kinetic = |step: f64| {
        let mut simulation = simulation(step, "2e4 * smoothstep(0, 0.2, t)");
        while simulation.state().time < 0.5 {
            simulation.step().ok()?;
        }
        Some(simulation.diagnostics().kinetic)
    };
    // What the contraction started is damped by exp(-20 * 0.3).
    let [stable, unstable] = [0.97 * ramp, 0.97 * passive].map(kinetic);
    assert!(stable.is_some_and(|kinetic| kinetic < 1.0), "{stable:?}");
    assert!(unstable.is_none_or(|kinetic| kinetic > 1e3 || kinetic.is_nan()), "{unstable:?}");
}

/// Several in one body add up; a direction of elements is what a formula gives at their centres.
#[test]
fn muscles_of_a_body_add_up_and_directions_may_be_listed() {
    let force = |muscle: &str| {
        let mut simulation = assembled(&block(STATIC, (2, "", ""), 0.3, muscle)).simulation;
        let x: Vec<f64> =
            simulation.state().x().iter().enumerate().map(|(i, x)| x + 0.01 * (i as f64).sin()).collect();
        let mut g = vec![0.0; x.len()];
        simulation.system_mut().gradient(&x, &mut g);
        g
    };
    let [one, other] = [
        "{ fibre = { direction = [1, 0] }, tension = 3e3 }",
        "{ fibre = { direction = ['-Y', 'X'] }, tension = 2e3 }",
    ];
    let passive = force("");
    let [first, second, both] = [one.to_owned(), other.to_owned(), format!("{one}, {other}")]
        .map(|muscles| force(&format!("muscle = [{muscles}]")));
    let sum = |i: usize| first[i] + second[i] - passive[i];
    assert!(both.iter().enumerate().all(|(i, g)| (g - sum(i)).abs() < 1e-9));
    // Two triangles in each cell of half a metre.
    let mesh = scene(&block(STATIC, (2, "", ""), 0.3, "")).body[0].body_mesh().shape.clone();
    let mesh = pliant_mesh::build(&mesh, 2, ".".as_ref()).unwrap();
    let centre =
        |t: &[u32; 3]| [0, 1].map(|c| t.iter().map(|v| mesh.point(*v as usize)[c]).sum::<f64>() / 3.0);
    let listed: Vec<[f64; 2]> = mesh.triangles.iter().map(centre).map(|[x, y]| [-5.0 * y, 5.0 * x]).collect();
    let listed = force(&format!("muscle = [{{ fibre = {{ per_element = {listed:?} }}, tension = 2e3 }}]"));
    assert!(listed.iter().zip(&second).all(|(a, b)| (a - b).abs() < 1e-10));
    assert!(first.iter().zip(&second).any(|(a, b)| (a - b).abs() > 1e2));
}

/// Mistakes that only show once the mesh is there.
#[test]
fn fibres_without_a_direction_are_mistakes() {
    let problem = |fibre: &str| {
        let keys = format!("muscle = [{{ fibre = {fibre}, tension = 1e3 }}]");
        let problems =
            scene(&block(STATIC, (2, "", ""), 0.3, &keys)).assemble(UnstableStep::Accept).err().unwrap();
        format!("{}: {}", problems[0].path, problems[0].message)
    };
    assert_eq!(
        problem("{ per_element = [[1, 0]] }"),
        "body.0.muscle.0.fibre.per_element: the list has 1 direction, the body has 16 elements"
    );
    let nowhere = problem("{ direction = ['step(0.5, X)', 0] }");
    assert_eq!(
        nowhere,
        "body.0.muscle.0.fibre.direction: fibres of element 0, whose centre is at [0.333333, 0.166667] m at \
         rest, have the direction [0, 0]"
    );
}
