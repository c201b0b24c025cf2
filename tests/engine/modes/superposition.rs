//! Superposition against closed forms and against fine steps.

use std::f64::consts::PI;

use super::simulation;
use pliant::energy::gravity::UniformGravity;
use pliant::energy::spring::Springs;
use pliant::integrator::IntegratorSpec;
use pliant::modes::{ModesError, Superposition};
use pliant::simulation::Simulation;
use pliant::state::State;
use pliant::system::System;

/// Ten masses of 0.1 kg between two walls, joined by springs of 100 N/m whose rest length is zero: linear in
/// every direction.
fn string(gravity: f64) -> Simulation {
    let mass = vec![0.1; 12];
    let edges: Vec<[u32; 2]> = (0..11).map(|i| [i, i + 1]).collect();
    let mut system = System::new(2, mass.clone());
    system.add_term(Box::new(Springs::<2>::new("string", &edges, &[100.0; 11], &[0.0; 11], 12)));
    system.add_term(Box::new(UniformGravity::new(&[0.0, -gravity], &mass)));
    system.pin(&[0, 11]);
    let x = (0..12).flat_map(|i| [f64::from(i), 0.0]).collect();
    Simulation::new(system, State::new(x, vec![0.0; 24]), IntegratorSpec::Rk4.method(), 1e-4)
}

fn state_at(superposition: &Superposition, n: usize, t: f64) -> (Vec<f64>, Vec<f64>) {
    let (mut x, mut v) = (vec![0.0; n], vec![0.0; n]);
    superposition.state_at(t, &mut x, &mut v);
    (x, v)
}

// A5: N = 10, m = 0.1, k = 100, the first mass displaced by 1.
#[test]
fn a_displaced_chain_is_where_the_plan_has_it() {
    for (axis, c) in [("x", 0), ("y", 1)] {
        let mut chain = string(0.0);
        chain.state_mut().x_mut()[2 + c] += 1.0;
        let exact = chain.superposition(None).unwrap();
        let rows = [
            (1.0, [-0.476_280_915_542_335_7, -0.168_517_239_575_251_1, -0.114_906_277_002_299_4]),
            (10.0, [-0.032_935_764_409_860_31, 0.324_371_872_909_184_1, 0.189_318_132_579_711_4]),
        ];
        for (t, expected) in rows {
            let (x, v) = state_at(&exact, 24, t);
            for (i, expected) in [1usize, 5, 10].into_iter().zip(expected) {
                let u = x[2 * i + c] - if c == 0 { i as f64 } else { 0.0 };
                assert!((u - expected).abs() < 1e-11, "along {axis}, mass {i}, t = {t}: {u}");
            }
            if t == 1.0 {
                assert!((v[2 + c] - 2.119_392_883_014_632).abs() < 1e-9, "{}", v[2 + c]);
            }
        }
        assert!(exact.nonlinearity() < 1e-12, "{}", exact.nonlinearity());
        assert_eq!(exact.residual().kinetic, 0.0);
    }
}

/// The string let go under gravity: `y_i = -g sum_j 2/(N+1) s_ij sum_l s_lj (1 - cos w_j t)/w_j^2`, `s_ij =
/// sin(i j pi/(N+1))`.
#[test]
fn a_string_sags_and_swings_under_gravity_as_its_sines_do() {
    let mut string = string(9.81);
    let exact = string.superposition(None).unwrap();
    for t in [0.0, 0.013, 0.7, 30.0] {
        let (x, v) = state_at(&exact, 24, t);
        for i in 1..=10 {
            let (mut y, mut vy) = (0.0, 0.0);
            for j in 1..=10 {
                let s = |i: usize| ((i * j) as f64 * PI / 11.0).sin();
                let w = 2.0 * (100.0f64 / 0.1).sqrt() * (j as f64 * PI / 22.0).sin();
                let load: f64 = (1..=10).map(s).sum();
                y -= 9.81 * 2.0 / 11.0 * s(i) * load * (1.0 - (w * t).cos()) / (w * w);
                vy -= 9.81 * 2.0 / 11.0 * s(i) * load * (w * t).sin() / w;
            }
            assert!((x[2 * i + 1] - y).abs() < 1e-11, "t = {t}, mass {i}: {} for {y}", x[2 * i + 1]);
            assert!((v[2 * i + 1] - vy).abs() < 1e-9, "t = {t}, mass {i}: {} for {vy}", v[2 * i + 1]);
        }
    }
}

/// A linear block in `d` dimensions, with what else is asked for.
fn block(d: usize, world: &str, body: &str) -> Simulation {
    let cells = if d == 2 { "[3, 2]" } else { "[2, 1, 1]" };
    let gravity = match (d, world) {
        (2, WEIGHTLESS) => "0.0, 0.0",
        (2, _) => "0.0, -9.81",
        _ => "0.0, -9.81, 1.0",
    };
    simulation(&format!(
        "dimension = {d}
        time = {{ integrator = 'rk4', step = 2.5e-5, duration = 1.0 }}
        world = {{ gravity = [{gravity}], {world} }}
        [[body]]
        name = 'block'
        mesh = {{ grid = {{ cells = {cells}, spacing = 0.1 }} }}
        elastic = {{ linear = {{ young = 1e5, poisson = 0.3 }} }}
        mass = {{ density = 1000.0 }}
        {body}"
    ))
}

/// No drag, and no gravity either.
const WEIGHTLESS: &str = "ether_drag = 0.0";
const CLAMP_2D: &str = "pin = [{ half_space = { normal = [1.0, 0.0], offset = 0.0 } }]";
const CLAMP_3D: &str = "pin = [{ half_space = { normal = [1.0, 0.0, 0.0], offset = 0.0 } }]";

// The classical Runge-Kutta scheme in fine steps has an error of 1e-10 here; damped in proportion to the
// mass, by drag, with loads, strains and velocities at the start, held and free.
#[test]
fn the_sum_of_modes_is_what_fine_steps_tend_to() {
    let slowed = "damping = { mass_proportional = 0.8 }";
    let load = "load = [{ box = { min = [0.2, 0.0], max = [0.3, 0.2] }, force = [3.0, 5.0] }]";
    let stretched = "position = { affine = { matrix = [[1.05, 0.02], [0.0, 0.97]] } }";
    let cases = [
        (2, "", format!("{CLAMP_2D}\n{load}")),
        (2, "", format!("{CLAMP_2D}\n{slowed}\n{load}")),
        (2, "ether_drag = 1.5", CLAMP_2D.into()),
        (2, "", stretched.into()),
        (
            2,
            "ether_drag = 0.4",
            format!("{slowed}\n{stretched}\nvelocity = {{ rigid = {{ linear = [0.3, 0.1] }} }}"),
        ),
        (3, "", format!("{CLAMP_3D}\n{slowed}\norder = 2")),
    ];
    for (d, world, body) in cases {
        let mut simulation = block(d, world, &body);
        for (i, v) in simulation.state_mut().v_mut().iter_mut().enumerate() {
            *v += 0.3 * (1.7 * i as f64).sin();
        }
        // Held vertices have no velocity.
        let mut held = simulation.system().inverse_mass().to_vec();
        held.iter_mut().zip(simulation.state_mut().v_mut()).for_each(|(w, v)| {
            if *w == 0.0 {
                *v = 0.0;
            }
        });
        let exact = simulation.superposition(None).unwrap();
        assert!(exact.nonlinearity() < 1e-10, "{body}: {}", exact.nonlinearity());
        for steps in [800, 7200] {
            (0..steps).for_each(|_| simulation.step().unwrap());
            let t = simulation.state().time;
            let (x, v) = state_at(&exact, simulation.state().x().len(), t);
            let largest =
                |a: &[f64], b: &[f64]| a.iter().zip(b).fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
            let (x, v) = (largest(&x, &simulation.positions()), largest(&v, &simulation.velocities()));
            assert!(x < 1e-9 && v < 1e-7, "{d}D, {world} {body}, t = {t}: {x:e} m, {v:e} m/s");
        }
    }
}

// Damping in proportion to the stiffness of the linear material is constant: nothing is missed at any
// amplitude.
#[test]
fn small_vibrations_die_out_as_the_sum_of_modes_does() {
    let rayleigh = "damping = { mass_proportional = 0.8, stiffness_proportional = 2e-3 }";
    let missed = |amplitude: f64| {
        let mut simulation = block(2, WEIGHTLESS, &format!("{CLAMP_2D}\n{rayleigh}"));
        let held: Vec<bool> = simulation.system().inverse_mass().iter().map(|w| *w == 0.0).collect();
        for (i, v) in simulation.state_mut().v_mut().iter_mut().enumerate() {
            *v = if held[i] { 0.0 } else { amplitude * (1.7 * i as f64).sin() };
        }
        let exact = simulation.superposition(None).unwrap();
        assert!(exact.nonlinearity() < 10.0 * amplitude, "{}", exact.nonlinearity());
        (0..2000).for_each(|_| simulation.step().unwrap());
        let (x, _) = state_at(&exact, simulation.state().x().len(), simulation.state().time);
        let found = simulation.positions();
        x.iter().zip(found.iter()).fold(0.0f64, |m, (a, b)| m.max((a - b).abs())) / amplitude
    };
    // Without gravity: its sag would be a strain of its own.
    let (large, small) = (missed(1e-2), missed(1e-4));
    assert!(small < 1e-10 && large < 1e-10, "{large:e} s, {small:e} s");
}

/// With the lowest modes alone, what is missing is known: the energies of the modes that are left out.
#[test]
fn the_residual_is_the_energy_of_the_modes_that_are_left_out() {
    for body in [CLAMP_2D, "position = { affine = { matrix = [[1.05, 0.02], [0.0, 0.97]] } }"] {
        let mut simulation = block(2, "", body);
        for (i, v) in simulation.state_mut().v_mut().iter_mut().enumerate() {
            *v += 0.3 * (1.7 * i as f64).sin();
        }
        let all = simulation.superposition(None).unwrap();
        for count in [4, 7] {
            let some = simulation.superposition(Some(count)).unwrap();
            let left = &all.oscillators()[count..];
            let kinetic: f64 = left.iter().map(|o| 0.5 * o.velocity * o.velocity).sum();
            let elastic: f64 = left.iter().map(|o| 0.5 * o.force * o.force / o.square).sum();
            let residual = some.residual();
            assert!((residual.kinetic / kinetic - 1.0).abs() < 1e-6, "{residual:?} for {kinetic}");
            assert!((residual.elastic / elastic - 1.0).abs() < 1e-6, "{residual:?} for {elastic}");
            let elastic: f64 = all
                .oscillators()
                .iter()
                .filter(|o| o.square > 0.0)
                .map(|o| 0.5 * o.force * o.force / o.square)
                .sum();
            assert!((residual.elastic_total / elastic - 1.0).abs() < 1e-6, "{residual:?} for {elastic}");
            for (some, all) in some.oscillators().iter().zip(all.oscillators()) {
                assert!((some.square - all.square).abs() <= 1e-8 * all.square.max(1.0), "{some:?} {all:?}");
            }
        }
    }
}

#[test]
fn what_is_not_linear_is_said() {
    let not_linear = |mut simulation: Simulation| match simulation.superposition(None) {
        Err(ModesError::NotLinear { what }) => what,
        other => panic!("{:?}", other.map(|_| ())),
    };
    assert!(not_linear(block(2, "walls = [{ normal = [0.0, 1.0], offset = -1.0 }]", "")).contains("walls"));
    let pulled = "load = [{ force = ['sin(t)', 0.0] }]";
    assert!(not_linear(block(2, "", pulled)).contains("changes with time"));
    let moved = "pin = [{ vertices = [0], motion = { velocity = [1.0, 0.0] } }]";
    assert!(not_linear(block(2, "", moved)).contains("moves"));
    let ends = "pin = [{ vertices = [0], until = 0.5 }]";
    assert!(not_linear(block(2, "", ends)).contains("is released at 0.5 s"));
    let followed = "load = [{ half_space = { normal = [-1.0, 0.0], offset = -0.3 }, pressure = 10.0 }]";
    assert!(not_linear(block(2, "", followed)).contains("follows the body"));

    // Damping of strains with its own ratio of bulk and shear is in no proportion to the stiffness.
    let viscous = format!("{CLAMP_2D}\ndamping = {{ strain_rate = {{ shear = 10.0, second = 0.0 }} }}");
    assert!(matches!(
        block(2, "", &viscous).superposition(None),
        Err(ModesError::Coupled { coupling }) if coupling > 1e-3
    ));

    // Of a body that turns and stretches far, the linearisation is another motion.
    let mut rubber = simulation(
        "dimension = 2
        time = { integrator = 'rk4', step = 5e-5, duration = 1.0 }
        [[body]]
        mesh = { grid = { cells = [3, 2], spacing = 0.1 } }
        elastic = { stable-neo-hookean = { young = 1e5, poisson = 0.3 } }
        mass = { density = 1000.0 }
        velocity = { rigid = { angular = [3.0] } }",
    );
    assert!(rubber.superposition(None).unwrap().nonlinearity() > 1e-3);
}

#[test]
fn particles_under_mutual_gravity_have_no_modes() {
    let mut pair = simulation(
        "dimension = 2
        time = { integrator = 'velocity-verlet', step = 1e-3, duration = 1.0 }
        world = { nbody = { constant = 1.0, softening = 0.0 } }
        [[body]]
        mesh = { inline = { points = [[0.0, 0.0], [1.0, 0.0]] } }
        mass = { per_vertex = 1.0 }",
    );
    assert_eq!(pair.modes(1), Err(ModesError::Attraction));
}
