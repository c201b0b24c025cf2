//! The iteration for the lowest modes against dense eigenproblems and closed forms.

use super::{block, simulation, strand};
use pliant::modes::eigen::Eigen;
use pliant::simulation::Simulation;
use pliant::solver::cholesky::Cholesky;

/// Points at (1, i) that move along x, each on its own spring of 100 N/m to a point at (0, i) that is held.
fn oscillators(masses: &[f64]) -> Simulation {
    let n = masses.len();
    let list = |of: &dyn Fn(usize) -> String| (0..n).map(of).collect::<Vec<String>>().join(", ");
    let points = list(&|i| format!("[0.0, {i}.0], [1.0, {i}.0]"));
    let edges = list(&|i| format!("[{}, {}]", 2 * i, 2 * i + 1));
    let per_vertex = list(&|i| format!("1.0, {:?}", masses[i]));
    simulation(&format!(
        "dimension = 2
        time = {{ integrator = 'implicit-euler', step = 0.01, duration = 1.0 }}
        [[body]]
        mesh = {{ inline = {{ points = [{points}], edges = [{edges}] }} }}
        springs = {{ stiffness = 100.0 }}
        mass = {{ per_vertex = [{per_vertex}] }}
        pin = [
            {{ half_space = {{ normal = [1.0, 0.0], offset = 0.5 }} }},
            {{ half_space = {{ normal = [0.0, 1.0], offset = 1e6 }}, axes = ['y'] }},
        ]"
    ))
}

/// `omega^2` of the `count` lowest modes, or of all from the dense eigenproblem.
fn squares<const D: usize>(simulation: &mut Simulation, count: Option<usize>) -> Vec<f64> {
    let found = Eigen::<D>::about(simulation, count).map_err(|e| e.to_string()).unwrap();
    found.squares().collect()
}

fn assert_iteration_finds_all<const D: usize>(mut simulation: Simulation) {
    let all = squares::<D>(&mut simulation, None);
    for count in [1, all.len() / 3, all.len() / 2, all.len() - 1, all.len()] {
        let found = squares::<D>(&mut simulation, Some(count));
        assert_eq!(found.len(), count);
        for (j, (found, dense)) in found.iter().zip(&all).enumerate() {
            // Dense eigenvalues are right to roundings of the largest one.
            let allowed = if *dense == 0.0 { 0.0 } else { 1e-9 * dense + 1e-13 * all[all.len() - 1] };
            assert!((found - dense).abs() <= allowed, "{j} of {count}: {found} for {dense}");
        }
    }
}

#[test]
fn the_iteration_finds_what_the_dense_eigenproblem_has() {
    assert_iteration_finds_all::<2>(strand());
    assert_iteration_finds_all::<2>(block(2, "[4, 4]"));
    assert_iteration_finds_all::<3>(block(3, "[2, 2, 2]"));
}

/// Twenty oscillators of 1 kg, and 140 of 1 / (1 + 0.1 j) kg: an iteration by blocks of eight converges to
/// eight copies of the lowest eigenvalue and to others above it.
#[test]
fn no_copy_of_an_eigenvalue_is_missing() {
    let masses: Vec<f64> = (0..160).map(|i: i32| 1.0 / (1.0 + 0.1 * f64::from((i - 19).max(0)))).collect();
    let mut oscillators = oscillators(&masses);
    for count in [1, 12, 23] {
        let found = oscillators.modes(count).unwrap();
        assert_eq!(found.free_coordinates, 160);
        for (mode, mass) in found.modes.iter().zip(&masses) {
            let expected = (100.0 / mass).sqrt();
            assert!((mode.omega - expected).abs() < 1e-9 * expected, "{} for {expected}", mode.omega);
        }
    }
}

/// Sylvester: `K - sigma M` has as many negative eigenvalues as modes lie below `sigma`. The factors of a
/// chain are found entry by entry, those of a large block by dense blocks.
#[test]
fn negative_pivots_count_the_modes_below_a_shift() {
    fn assert_counts<const D: usize>(mut simulation: Simulation) {
        let eigen = Eigen::<D>::about(&mut simulation, None).map_err(|e| e.to_string()).unwrap();
        let all: Vec<f64> = eigen.squares().collect();
        let cholesky = Cholesky::new(&eigen.shifted_matrix(0.0), eigen.positions()).unwrap();
        let mut counted = 0;
        for (j, pair) in all.windows(2).enumerate().filter(|(_, pair)| pair[1] - pair[0] > 1e-6 * pair[1]) {
            let matrix = eigen.shifted_matrix(-0.5 * (pair[0] + pair[1]));
            assert_eq!(cholesky.negative_eigenvalues(&matrix), Some(j + 1));
            counted += 1;
        }
        assert!(4 * counted > all.len(), "{counted} of {}", all.len());
    }
    assert_counts::<2>(strand());
    assert_counts::<3>(block(3, "[4, 4, 4]"));
}
