//! Against closed forms.

mod lowest;
mod sound;
mod superposition;

use pliant::modes::ModesError;
use pliant::simulation::Simulation;
use pliant_scene::Scene;
use pliant_scene::assembly::UnstableStep;

fn simulation(text: &str) -> Simulation {
    let scene = Scene::from_toml(text).unwrap();
    scene.assemble(UnstableStep::Refuse).map_err(|p| format!("{p:?}")).unwrap().simulation
}

/// Fourteen masses of 0.1 kg along x, held at both ends of the line, springs of 100 N/m.
fn strand() -> Simulation {
    simulation(
        "dimension = 2
        time = { integrator = 'implicit-euler', step = 0.01, duration = 1.0 }
        [[body]]
        mesh = { strand = { segments = 15, start = [0.0, 0.0], end = [15.0, 0.0] } }
        springs = { stiffness = 100.0 }
        mass = { per_vertex = 0.1 }
        pin = [{ vertices = [0, 15] }, { half_space = { normal = [0.0, 1.0], offset = 0.0 }, axes = ['y'] }]",
    )
}

// A5: omega_j = 2 sqrt(k/m) sin(j pi / (2 (N + 1))), N = 14.
#[test]
fn the_modes_of_a_chain_are_sines() {
    let mut simulation = strand();
    let found = simulation.modes(6).unwrap();
    assert_eq!(found.free_coordinates, 14);
    for (j, mode) in found.modes.iter().enumerate() {
        let angle = (j + 1) as f64 * std::f64::consts::PI / 30.0;
        let expected = 2.0 * (100.0f64 / 0.1).sqrt() * angle.sin();
        assert!((mode.omega / expected - 1.0).abs() < 1e-9, "mode {j}: {} for {expected}", mode.omega);
        // The shape is a sine, of unit length in the masses.
        let scale = (2.0 / (15.0 * 0.1f64)).sqrt();
        let sign = mode.shape[2].signum();
        for i in 0..=15 {
            let shape = sign * scale * (2.0 * angle * i as f64).sin();
            assert!((mode.shape[2 * i] - shape).abs() < 1e-8, "mode {j} at {i}");
        }
    }
    // All modes together have all the mass.
    let all = simulation.modes(14).unwrap();
    let mass: f64 = all.modes.iter().map(|m| m.effective_mass[0]).sum();
    assert!((mass - 1.0).abs() < 1e-10, "{mass}");
}

/// Masses of 0.1 kg along x on springs of 100 N/m, free to move along x; of the `held` ends.
fn long_chain(masses: usize, held: bool) -> Simulation {
    let last = if held { masses + 1 } else { masses - 1 };
    let ends = if held { format!("{{ vertices = [0, {last}] }}, ") } else { String::new() };
    simulation(&format!(
        "dimension = 2
        time = {{ integrator = 'implicit-euler', step = 0.01, duration = 1.0 }}
        [[body]]
        mesh = {{ strand = {{ segments = {last}, start = [0.0, 0.0], end = [{last}.0, 0.0] }} }}
        springs = {{ stiffness = 100.0 }}
        mass = {{ per_vertex = 0.1 }}
        pin = [{ends}{{ half_space = {{ normal = [0.0, 1.0], offset = 0.0 }}, axes = ['y'] }}]"
    ))
}

/// The lowest frequencies of what is long are orders below those of its elements, 1e-8 of their squares
/// here; rounding leaves 1e-16 / 1e-8 of the squares. A chain with free ends has the wave numbers `j pi /
/// N`.
#[test]
fn the_lowest_modes_of_a_long_chain_are_found() {
    for held in [true, false] {
        let masses = 10_000;
        let found = long_chain(masses, held).modes(10).unwrap();
        for (j, mode) in found.modes.iter().enumerate() {
            let (number, intervals) = if held { (j + 1, masses + 1) } else { (j, masses) };
            let angle = 0.5 * number as f64 * std::f64::consts::PI / intervals as f64;
            let expected = 2.0 * (100.0f64 / 0.1).sqrt() * angle.sin();
            let error = (mode.omega - expected).abs();
            assert!(error <= 1e-7 * expected, "held: {held}, mode {j}: {} for {expected}", mode.omega);
        }
    }
}

/// A rod of steel, 1 m x 2 mm, in plane stress, free in the air: rigid motion, then Euler's and Bernoulli's
/// frequencies, `omega = beta^2 t sqrt(E / (12 rho)) / L^2` with `cos(beta) cosh(beta) = 1`; Clough, Penzien
/// 1993, *Dynamics of Structures*, section 18. What shear and the inertia of turning take is `beta^2 (1 +
/// 3.1) t^2 / (24 L^2) < 1e-4`. Quadratic elements bend with a curvature that is constant in a cell of length
/// `h`: the energy is too large by the part `(beta h / L)^2 / 12` of what varies in it, the frequency by half
/// of that.
#[test]
fn a_free_rod_has_the_frequencies_of_euler_and_bernoulli() {
    let mut rod = simulation(
        "dimension = 2
        time = { integrator = 'implicit-euler', step = 0.01, duration = 1.0 }
        [[body]]
        mesh = { grid = { cells = [80, 1], size = [1.0, 0.002] } }
        elastic = { linear = { young = 2e11, poisson = 0.3, plane = 'stress' } }
        order = 2
        mass = { density = 7800.0 }",
    );
    let found = rod.modes(6).unwrap();
    for (j, beta) in [0.0, 0.0, 0.0, 4.730_041, 7.853_205, 10.995_608].into_iter().enumerate() {
        let expected = beta * beta * 0.002 * (2e11f64 / (12.0 * 7800.0)).sqrt();
        let omega = found.modes[j].omega;
        let allowed = 1e-4 + (beta / 80.0).powi(2) / 24.0;
        assert!((omega - expected).abs() <= allowed * expected, "mode {j}: {omega} for {expected}");
    }
}

/// The same in space, of linear tetrahedra, as slender: six motions without stiffness and four with, in
/// either plane much too stiff.
#[test]
fn a_slender_bar_of_tetrahedra_has_modes() {
    let mut bar = simulation(
        "dimension = 3
        time = { integrator = 'implicit-euler', step = 0.1, duration = 1.0 }
        [[body]]
        mesh = { grid = { cells = [200, 1, 1], size = [1.0, 0.002, 0.002] } }
        elastic = { linear = { young = 2e11, poisson = 0.3 } }
        mass = { density = 7800.0 }",
    );
    let found = bar.modes(10).unwrap();
    let slowest = 4.730_041f64.powi(2) * 0.002 * (2e11f64 / (12.0 * 7800.0)).sqrt();
    for (j, mode) in found.modes.iter().enumerate() {
        assert_eq!(mode.omega == 0.0, j < 6, "mode {j}: {}", mode.omega);
        assert!(j < 6 || mode.omega > slowest, "mode {j}: {} for {slowest} at least", mode.omega);
    }
}

/// NAFEMS FV12: a free square plate of steel, 10 m x 10 m x 5 cm; 1.622, 2.360 and 2.922 Hz in *The
/// Standard NAFEMS Benchmarks*, rev. 3, 1990. Frequencies of Kirchhoff's plate are `lambda sqrt(E t^2 / (12
/// (1 - nu^2) rho)) / (2 pi a^2)`, lambda = 13.468_197, 19.596_136, 24.270_201 for nu = 0.3 by Ritz's
/// method with products of Legendre polynomials of degree up to 19 in either direction, the same digits
/// from degree 15 on. (Beam functions give 13.489, 19.789, 24.432; Leissa 1973, "The free vibration of
/// rectangular plates".) Elements of consistent mass come from above. Cells 33 and 17 times as wide as
/// thick still are too stiff in twist: errors fall at least with the size.
#[test]
fn a_free_plate_has_the_frequencies_of_nafems() {
    let frequencies = |cells: usize| {
        let mut plate = simulation(&format!(
            "dimension = 3
            time = {{ integrator = 'implicit-euler', step = 0.1, duration = 1.0 }}
            [[body]]
            mesh = {{ grid = {{ cells = [{cells}, {cells}, 1], size = [10.0, 10.0, 0.05] }} }}
            elastic = {{ linear = {{ young = 2e11, poisson = 0.3 }} }}
            order = 2
            mass = {{ density = 8000.0 }}"
        ));
        plate.modes(9).unwrap().modes.iter().map(|mode| mode.frequency).collect::<Vec<f64>>()
    };
    let (coarse, fine) = (frequencies(6), frequencies(12));
    assert_eq!((&coarse[..6], &fine[..6]), (&[0.0; 6][..], &[0.0; 6][..]));
    for (j, expected) in [1.621_654, 2.359_496, 2.922_282].into_iter().enumerate() {
        let errors = [coarse[6 + j], fine[6 + j]].map(|f| f / expected - 1.0);
        // What the thin plate leaves out takes less than 2e-3.
        assert!(errors[1] > -2e-3 && errors[1] < 0.5 * errors[0] + 2e-3, "mode {j}: {errors:?}");
    }
}

/// A free sphere: five torsional modes of degree 2, `omega = x sqrt(mu / rho) / R` with `j_2(x) = x j_3(x)`;
/// H. Lamb 1882, "On the vibrations of an elastic sphere", Proceedings of the London Mathematical Society 13,
/// 189-212. Sides are curved: between straight ones the ball is too small, and 5 % too fast.
#[test]
fn a_free_sphere_has_the_frequencies_of_lamb() {
    let errors = [1, 2].map(|cells| {
        let mut ball = simulation(&format!(
            "dimension = 3
            time = {{ integrator = 'implicit-euler', step = 0.1, duration = 1.0 }}
            [[body]]
            mesh = {{ ball = {{ radius = 0.5, cells = {cells} }} }}
            elastic = {{ linear = {{ young = 2e11, poisson = 0.25 }} }}
            order = 2
            mass = {{ density = 8000.0 }}"
        ));
        let found = ball.modes(11).unwrap();
        let expected = 2.501_132_6 * (2e11f64 / (2.0 * 1.25) / 8000.0).sqrt() / 0.5;
        assert!(found.modes[5].omega == 0.0 && found.modes[6].omega > 0.0, "six motions without stiffness");
        found.modes[10].omega / expected - 1.0
    });
    // Elements of consistent mass come from above; with straight sides 160 of them are off by 5 %.
    assert!(errors[1] > 0.0 && errors[1] < 0.015 && errors[1] < 0.5 * errors[0], "{errors:?}");
}

/// More motions without stiffness than a block of the iteration has vectors: 21 vertices in space on 20
/// springs have 63 - 20.
#[test]
fn a_strand_without_bending_has_all_its_loose_motions() {
    let mut strand = simulation(
        "dimension = 3
        time = { integrator = 'implicit-euler', step = 0.1, duration = 1.0 }
        [[body]]
        mesh = { strand = { segments = 20, start = [0.0, 0.0, 0.0], end = [1.0, 0.0, 0.0] } }
        springs = { stiffness = 100.0 }
        mass = { per_vertex = 0.1 }",
    );
    let found = strand.modes(46).unwrap();
    for (j, mode) in found.modes.iter().enumerate() {
        // Free ends, 21 masses: the wave numbers j pi / 21 along the strand.
        let angle = 0.5 * j.saturating_sub(42) as f64 * std::f64::consts::PI / 21.0;
        let expected = 2.0 * (100.0f64 / 0.1).sqrt() * angle.sin();
        assert!((mode.omega - expected).abs() <= 1e-9 * expected, "mode {j}: {} for {expected}", mode.omega);
    }
}

/// A free block of cells of side 0.3 m.
fn block(dimension: usize, cells: &str) -> Simulation {
    simulation(&format!(
        "dimension = {dimension}
        time = {{ integrator = 'implicit-euler', step = 0.01, duration = 1.0 }}
        [[body]]
        mesh = {{ grid = {{ cells = {cells}, spacing = 0.3 }} }}
        elastic = {{ stable-neo-hookean = {{ young = 1e7, poisson = 0.3 }} }}
        mass = {{ density = 1000.0 }}"
    ))
}

// D12: exactly three zero modes in the plane, six in space.
#[test]
fn a_free_body_has_the_modes_of_rigid_motion() {
    for (dimension, cells, rigid) in [(2, "[3, 3]", 3), (3, "[2, 2, 2]", 6)] {
        let mut simulation = block(dimension, cells);
        let found = simulation.modes(rigid + 4).unwrap();
        let first = found.modes[rigid].omega;
        for (j, mode) in found.modes.iter().enumerate() {
            assert_eq!(mode.omega == 0.0, j < rigid, "mode {j} of {rigid} + 4: {}", mode.omega);
            assert!(j <= rigid || mode.omega >= first);
        }
        let along_x: f64 = found.modes[..rigid].iter().map(|m| m.effective_mass[0]).sum();
        assert!((along_x - 1.0).abs() < 1e-8, "rigid motion has all the mass: {along_x}");
    }
}

#[test]
fn what_has_no_modes_says_so() {
    assert_eq!(strand().modes(15), Err(ModesError::TooMany { asked: 15, free: 14 }));
    // Pushed together, a chain gives way sideways.
    let mut squeezed = simulation(
        "dimension = 2
        time = { integrator = 'implicit-euler', step = 0.01, duration = 1.0 }
        [[body]]
        mesh = { strand = { segments = 4, start = [0.0, 0.0], end = [1.0, 0.0] } }
        springs = { stiffness = 100.0, rest_length = 0.3 }
        mass = { per_vertex = 0.1 }
        pin = [{ vertices = [0, 4] }]",
    );
    assert_eq!(squeezed.modes(2), Err(ModesError::NotStable));
}
