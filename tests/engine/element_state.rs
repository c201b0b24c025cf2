use pliant::algebra::Mat;
use pliant::element::*;
use pliant::simulation::Simulation;
use pliant_scene::Scene;
use pliant_scene::assembly::UnstableStep;

/// A bar of two cells, nu = 0.3, E = 1 MPa, under `x = matrix X + (0.5, 0.2[, 0.1])`.
fn bar(matrix: &[&[f64]], material: &str) -> Simulation {
    let d = matrix.len();
    let shift = &[0.5, 0.2, 0.1][..d];
    let cells = &[2, 1, 1][..d];
    let text = format!(
        "dimension = {d}\ntime = {{ integrator = 'symplectic-euler', step = 1e-6, duration = 1.0 \
         }}\n[[body]]\n\
         mesh = {{ grid = {{ cells = {cells:?}, spacing = 0.5 }} }}\nmass = {{ density = 1000.0 }}\n\
         elastic = {{ {material} = {{ young = 1e6, poisson = 0.3 }} }}\n\
         position = {{ affine = {{ matrix = {matrix:?}, translation = {shift:?} }} }}\n"
    );
    let scene = Scene::from_toml(&text).unwrap();
    scene.assemble(UnstableStep::Accept).ok().unwrap().simulation
}

/// The states of its elements.
fn deformed(matrix: &[&[f64]], material: &str) -> Vec<ElementState> {
    let states = bar(matrix, material).element_states();
    assert_eq!(states.len(), if matrix.len() == 2 { 4 } else { 12 });
    states
}

/// Its elastic energy [J].
fn energy(matrix: &[&[f64]], material: &str) -> f64 {
    bar(matrix, material).diagnostics().elastic
}

fn assert_close(a: &Mat<f64, 3>, b: [[f64; 3]; 3], scale: f64) {
    assert!((*a - Mat(b)).norm_squared().sqrt() < 1e-12 * scale, "{a:?} is not {b:?}");
}

const IDENTITY: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

// lecture 13: translation gives F = I, rotation F = R, and neither strain nor stress.
#[test]
fn rigid_motion_gives_the_rotation_and_no_strain() {
    let turn: [&[f64]; 3] = [&[0.6, -0.8, 0.0], &[0.8, 0.6, 0.0], &[0.0, 0.0, 1.0]];
    for state in deformed(&turn, "corotated") {
        assert_close(&state.deformation_gradient, [[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]], 1.0);
        assert_close(&state.green_strain(), [[0.0; 3]; 3], 1.0);
        assert_close(&state.corotated_strain(), [[0.0; 3]; 3], 1.0);
        assert!(state.von_mises_stress() < 1e-6);
    }
    for state in deformed(&[&[1.0, 0.0], &[0.0, 1.0]], "stvk") {
        assert_close(&state.deformation_gradient, IDENTITY, 1.0);
    }
}

// lecture 15: F = R S, an inverted element has a negative stretch, and R is a rotation of the plane.
#[test]
fn corotated_strains_of_inverted_elements_in_the_plane_are_in_the_plane() {
    let turned = [[0.6, 0.8 * 1.5], [0.8, -0.6 * 1.5]];
    for state in deformed(&[&turned[0], &turned[1]], "corotated") {
        // The smaller stretch, that along x, is the one that changes its sign; in space it would be that
        // out of the plane.
        let (c, s) = (-0.6, -0.8);
        assert_close(&state.corotated_strain(), [[-2.0, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0; 3]], 1.0);
        let stretch = Mat([[-1.0, 0.0], [0.0, 1.5]]);
        let again = Mat([[c, -s], [s, c]]).mul(&stretch);
        assert!((again[0][0] - turned[0][0]).abs() + (again[0][1] - turned[0][1]).abs() < 1e-15);
    }
}

// lecture 14 and 18: psi by hand, and the sum over the volumes is the energy of the body.
#[test]
fn energy_densities_are_those_by_hand_and_add_up_to_the_energy() {
    let (mu, lambda) = (1e6 / 2.6, 0.3e6 / (1.3 * 0.4));
    for state in deformed(&[&[1.2, 0.0], &[0.0, 1.0]], "corotated") {
        // mu |F - R|^2 + lambda/2 tr(S - I)^2
        let expected = mu * 0.04 + 0.5 * lambda * 0.04;
        assert!((state.energy_density / expected - 1.0).abs() < 1e-12);
    }
    for (d, volume) in [(2, 0.5 * 0.5 * 0.5), (3, 0.5f64.powi(3) / 6.0)] {
        let row = |i: usize| [[1.1, 0.2, 0.1], [-0.1, 0.9, 0.3], [0.2, 0.0, 1.2]][i][..d].to_vec();
        let rows: Vec<Vec<f64>> = (0..d).map(row).collect();
        let rows: Vec<&[f64]> = rows.iter().map(Vec::as_slice).collect();
        for material in ["stvk", "neo-hookean", "hencky"] {
            let states = deformed(&rows, material);
            let sum: f64 = states.iter().map(|state| volume * state.energy_density).sum();
            let energy = energy(&rows, material);
            assert!((sum / energy - 1.0).abs() < 1e-12, "{d}D {material}: {sum} J of {energy} J");
        }
    }
}

// lecture 13, 15 and 16: a stretch of 1.2 along x, by hand.
#[test]
fn a_stretch_gives_the_strains_and_stresses_of_the_book() {
    let (mu, lambda) = (1e6 / 2.6, 0.3e6 / (1.3 * 0.4));
    for state in deformed(&[&[1.2, 0.0], &[0.0, 1.0]], "corotated") {
        assert!((state.j() - 1.2).abs() < 1e-12);
        assert!((state.principal_stretches()[0] - 1.2).abs() < 1e-12);
        assert_close(&state.green_strain(), [[0.22, 0.0, 0.0], [0.0; 3], [0.0; 3]], 1.0);
        assert_close(&state.corotated_strain(), [[0.2, 0.0, 0.0], [0.0; 3], [0.0; 3]], 1.0);
        let (along, across) = (2.0 * mu * 0.2 + lambda * 0.2, lambda * 0.2);
        let expected = [[along, 0.0, 0.0], [0.0, across, 0.0], [0.0, 0.0, across]];
        assert_close(&state.first_piola, expected, 1e6);
        // sigma_11 = P_11 * 1.2 / 1.2, the others P / 1.2.
        let von_mises = (along - across / 1.2).abs();
        assert!((state.von_mises_stress() - von_mises).abs() < 1e-6);
    }
}
