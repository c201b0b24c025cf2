//! Springs: force and stiffness as the lecture means them.

use pliant::energy::EnergyTerm;
use pliant::energy::spring::Springs;
use pliant_scene::Scene;
use pliant_scene::assembly::UnstableStep;

use crate::support::solid::scattered;

/// One spring from the origin to `x`.
fn spring<const D: usize>(stiffness: f64, rest_length: f64) -> Springs<D> {
    Springs::<D>::new("spring", &[[0, 1]], &[stiffness], &[rest_length], 2)
}

// lecture 9; B4 (i): f = -k (l - l0) (x_i - x_j) / l. Dividing by l0 would make this force 1.5 times as
// large.
#[test]
fn a_spring_pulls_with_stiffness_times_stretch() {
    let mut term = spring::<3>(100.0, 1.0);
    let direction = [2.0 / 7.0, 3.0 / 7.0, 6.0 / 7.0];
    for length in [1.5, 0.5, 1.0, 20.0] {
        let x: Vec<f64> = [0.0; 3].into_iter().chain(direction.map(|d| d * length)).collect();
        let mut g = vec![0.0; 6];
        term.add_gradient(&x, &mut g);
        for c in 0..3 {
            let expected = 100.0 * (length - 1.0) * direction[c];
            assert!(
                (g[3 + c] - expected).abs() < 1e-12 * 100.0 * length,
                "{} instead of {expected}",
                g[3 + c]
            );
            assert_eq!(g[c], -g[3 + c], "action and reaction");
        }
        let energy = 0.5 * 100.0 * (length - 1.0) * (length - 1.0);
        assert!((term.energy(&x) - energy).abs() < 1e-12 * energy.max(1.0));
    }
}

// lecture 10: Psi = mu (|F| - 1)^2, E = l0 Psi, k = 2 mu / l0.
#[test]
fn a_spring_is_an_element_with_a_law_of_its_own() {
    let (mu, rest) = (37.0, 0.4);
    let mut term = spring::<2>(2.0 * mu / rest, rest);
    let x = [0.0, 0.0, 0.3, -0.55];
    let stretch = 0.3f64.hypot(0.55) / rest;
    let energy = rest * mu * (stretch - 1.0) * (stretch - 1.0);
    assert!((term.energy(&x) / energy - 1.0).abs() < 1e-14);
}

/// Largest error of a derivative by central differences, relative to the largest entry.
fn defect<const D: usize>(term: &mut Springs<D>, x: &[f64]) -> (f64, f64) {
    let n = x.len();
    let h = 1e-6;
    let mut gradient = vec![0.0; n];
    term.add_gradient(x, &mut gradient);
    let (mut force_error, mut stiffness_error, mut force_scale, mut stiffness_scale) =
        (0f64, 0f64, 0f64, 0f64);
    for j in 0..n {
        let (mut plus, mut minus) = (x.to_vec(), x.to_vec());
        plus[j] += h;
        minus[j] -= h;
        let slope = (term.energy(&plus) - term.energy(&minus)) / (2.0 * h);
        force_error = force_error.max((slope - gradient[j]).abs());
        force_scale = force_scale.max(gradient[j].abs());
        let (mut g_plus, mut g_minus, mut unit, mut column) =
            (vec![0.0; n], vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        term.add_gradient(&plus, &mut g_plus);
        term.add_gradient(&minus, &mut g_minus);
        unit[j] = 1.0;
        term.add_hessian_product(x, &unit, &mut column);
        for i in 0..n {
            let slope = (g_plus[i] - g_minus[i]) / (2.0 * h);
            stiffness_error = stiffness_error.max((slope - column[i]).abs());
            stiffness_scale = stiffness_scale.max(column[i].abs());
        }
    }
    (force_error / force_scale, stiffness_error / stiffness_scale)
}

// lecture 1, 9; B4 (i) and (ii)
#[test]
fn spring_forces_and_stiffness_are_derivatives_of_the_energy() {
    // A tangle of 5 points with springs between all of them, more than one pack, stretched and squeezed.
    let edges: Vec<[u32; 2]> = (0..5).flat_map(|i| (i + 1..5).map(move |j| [i, j])).collect();
    let stiffness: Vec<f64> = (0..10).map(|k| 20.0 + 10.0 * scattered(k)).collect();
    let rest: Vec<f64> = (0..10).map(|k| 0.8 + 0.5 * scattered(k + 50)).collect();
    let mut space = Springs::<3>::new("tangle", &edges, &stiffness, &rest, 5);
    let (force, hessian) = defect(&mut space, &(0..15).map(scattered).collect::<Vec<_>>());
    assert!(force < 1e-8 && hessian < 1e-8, "3D: {force:e}, {hessian:e}");
    let mut plane = Springs::<2>::new("tangle", &edges, &stiffness, &rest, 5);
    let (force, hessian) = defect(&mut plane, &(0..10).map(scattered).collect::<Vec<_>>());
    assert!(force < 1e-8 && hessian < 1e-8, "2D: {force:e}, {hessian:e}");
}

// lecture 9; B4 (i): K = k [n n^T + (1 - l0/l) (I - n n^T)].
#[test]
fn a_squeezed_spring_is_soft_sideways() {
    for length in [0.5, 1.0, 2.0] {
        let mut term = spring::<2>(100.0, 1.0);
        let x = [0.0, 0.0, length, 0.0];
        let mut stiffness = |c: usize| {
            let (mut unit, mut column) = ([0.0; 4], [0.0; 4]);
            unit[2 + c] = 1.0;
            term.add_hessian_product(&x, &unit, &mut column);
            column[2 + c]
        };
        assert!((stiffness(0) - 100.0).abs() < 1e-12);
        assert!((stiffness(1) - 100.0 * (1.0 - 1.0 / length)).abs() < 1e-12);
    }
}

// lecture 12: springs do not resist the inversion of an area.
#[test]
fn a_triangle_of_springs_is_as_happy_inside_out() {
    let mut term = Springs::<2>::new("triangle", &[[0, 1], [1, 2], [2, 0]], &[50.0; 3], &[1.0; 3], 3);
    let height = 0.75f64.sqrt();
    for sign in [1.0, -1.0] {
        let x = [0.0, 0.0, 1.0, 0.0, 0.5, sign * height];
        let mut g = vec![0.0; 6];
        term.add_gradient(&x, &mut g);
        assert!(term.energy(&x) < 1e-28 && g.iter().all(|g| g.abs() < 1e-13));
    }
}

// lecture 9: every triangle of a cloth gives a third of its mass to each corner, every segment of a strand
// half of its own to each end.
#[test]
fn the_masses_of_sheets_and_strands_are_shared_equally_by_corners() {
    let masses = |body: &str| {
        let text = format!(
            "dimension = 3\ntime = {{ integrator = 'velocity-verlet', step = 1e-6, duration = 1.0 \
             }}\n[[body]]\n{body}\n"
        );
        Scene::from_toml(&text).unwrap().assemble(UnstableStep::Accept).ok().unwrap().topology.masses
    };
    let is = |found: Vec<f64>, expected: &[f64]| {
        assert_eq!(found.len(), expected.len());
        let error = found.iter().zip(expected).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
        assert!(error < 1e-15, "{found:?} instead of {expected:?}");
    };
    // Two cells of 1 m^2 in a row, each cut from its first corner to the one across: thirds of 0.5 m^2 of 0.6
    // kg/m^2 are 0.1 kg.
    let mesh = "mesh = { cloth = { cells = [2, 1], origin = [0, 0, 0], u = [2, 0, 0], v = [0, 0.6, 0.8] } }";
    let cloth = [0.2, 0.1, 0.3, 0.3, 0.1, 0.2];
    is(masses(&format!("{mesh}\nsprings = {{ stiffness = 1.0 }}\nmass = {{ density = 0.6 }}")), &cloth);
    let membrane = "membrane = { thickness = 0.1 }\nelastic = { stvk = { young = 1e3, poisson = 0.3 } }";
    is(masses(&format!("{mesh}\n{membrane}\nmass = {{ density = 6.0 }}")), &cloth);
    let strand =
        "mesh = { inline = { points = [[0, 0, 0], [1, 0, 0], [1, 3, 0]], edges = [[0, 1], [1, 2]] } }";
    is(
        masses(&format!("{strand}\nsprings = {{ stiffness = 1.0 }}\nmass = {{ density = 0.2 }}")),
        &[0.1, 0.4, 0.3],
    );
}
