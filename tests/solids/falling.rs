//! A beam of 0.4 x 0.1 x 0.1 m that is held at x = 0 and falls, implicit Euler in steps of 0.01 s, against
//! heights of its tip that independent programs agree on (`E = 5e5`, `nu = 0.4`, stable neo-Hookean with its
//! logarithm). Lecture 6 and 22.

use pliant_scene::Scene;
use pliant_scene::assembly::UnstableStep;

/// Changes of the height of the corner with the largest coordinates [m] after every tenth of a second, for 6
/// cells across.
const COARSE: [f64; 6] = [-0.060887098, -0.117589080, -0.075367830, -0.025263639, -0.051955755, -0.095113554];
/// The same for 11 cells across.
const FINE: [f64; 1] = [-0.0628118];

fn heights(n: usize, solver: &str, count: usize) -> Vec<f64> {
    let scene = Scene::from_toml(&format!(
        "dimension = 3
        time = {{ integrator = 'implicit-euler', step = 0.01, duration = 1.0, solver = {{ {solver} }} }}
        world = {{ gravity = [0.0, 0.0, -9.81] }}
        [[body]]
        mesh = {{ grid = {{ cells = [{}, {n}, {n}], size = [0.4, 0.1, 0.1] }} }}
        elastic = {{ stable-neo-hookean-log = {{ young = 5e5, poisson = 0.4 }} }}
        mass = {{ density = 1000.0 }}
        pin = [{{ half_space = {{ normal = [1.0, 0.0, 0.0], offset = 0.0 }} }}]",
        4 * n
    ))
    .unwrap();
    let mut assembly = scene.assemble(UnstableStep::Accept).unwrap();
    let rest = &assembly.topology.rest_positions;
    let corner = (0..rest.len() / 3)
        .max_by(|a, b| rest[3 * a..][..3].iter().sum::<f64>().total_cmp(&rest[3 * b..][..3].iter().sum()))
        .unwrap();
    let mut heights = vec![];
    for _ in 0..count {
        for _ in 0..10 {
            assembly.simulation.step().unwrap();
        }
        heights.push(assembly.simulation.state().x()[3 * corner + 2] - 0.1);
    }
    heights
}

fn check(n: usize, solver: &str, expected: &[f64], given_to: f64) {
    for (k, (height, expected)) in heights(n, solver, expected.len()).iter().zip(expected).enumerate() {
        let error = (height - expected).abs() / expected.abs();
        assert!(
            error < given_to,
            "{n} cells, {solver}: {height} at {} s, not {expected}",
            0.1 * (k + 1) as f64
        );
    }
}

#[test]
fn the_tip_falls_as_independent_programs_say_with_a_factorisation() {
    check(6, "linear = 'cholesky', tolerance = 1e-8", &COARSE, 1e-6);
}

// Conjugate gradients solve only as far as Newton's method can use: no less accurate in the end.
#[test]
fn the_tip_falls_as_independent_programs_say_with_multigrid() {
    check(6, "linear = 'multigrid'", &COARSE, 1e-6);
}

// What is chosen for that size; the reference has six digits.
#[test]
fn a_finer_beam_falls_as_independent_programs_say() {
    check(11, "linear = 'auto'", &FINE, 1e-6);
}

// What `pliant bench` asks for in its row `implicit-euler`.
#[test]
fn corrections_of_a_tenth_of_a_micrometre_are_enough_for_that() {
    check(6, "linear = 'multigrid', tolerance = 1e-7", &COARSE, 1e-6);
    check(11, "tolerance = 1e-7", &FINE, 1e-6);
}
