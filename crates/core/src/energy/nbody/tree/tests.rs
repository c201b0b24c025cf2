use super::*;
use crate::diagnostics::largest_frequency;
use crate::energy::nbody::NBody;
use crate::system::System;

/// Returns number `k` of a fixed sequence in (-1, 1).
fn scattered(k: usize) -> f64 {
    let mut h = (k as u64).wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    h = (h ^ (h >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    ((h ^ (h >> 32)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// Returns `n` particles of unequal masses, denser towards the middle.
fn cluster<const D: usize>(n: usize) -> (Vec<f64>, Vec<f64>) {
    let mut x = vec![];
    for i in 0..n {
        let r = scattered(9 * i + 7).abs();
        x.extend((0..D).map(|c| r * scattered(9 * i + c)));
    }
    (x, (0..n).map(|i| 1.5 + scattered(9 * i + 8)).collect())
}

fn tree<const D: usize>(mass: &[f64], softening: f64, opening_angle: f64) -> TreeGravity<D> {
    TreeGravity::new((0..mass.len() as u32).collect(), mass.to_vec(), 0.3, softening, opening_angle)
}

fn direct<const D: usize>(mass: &[f64], softening: f64) -> NBody<D> {
    NBody::new((0..mass.len() as u32).collect(), mass.to_vec(), 0.3, softening)
}

fn gradient(term: &mut impl EnergyTerm, x: &[f64]) -> Vec<f64> {
    let mut g = vec![0.0; x.len()];
    assert!(term.evaluate(x));
    term.add_rows(0, &mut g);
    g
}

fn product(term: &mut impl EnergyTerm, x: &[f64], p: &[f64]) -> Vec<f64> {
    let mut y = vec![0.0; x.len()];
    term.add_hessian_product(x, p, &mut y);
    y
}

/// Returns the length of the difference relative to the length of `b`.
fn distance(a: &[f64], b: &[f64]) -> f64 {
    let norm = |v: &mut dyn Iterator<Item = f64>| v.map(|x| x * x).sum::<f64>().sqrt();
    norm(&mut a.iter().zip(b).map(|(a, b)| a - b)) / norm(&mut b.iter().copied())
}

fn everything_opened_is_the_direct_sum<const D: usize>() {
    let (x, mass) = cluster::<D>(333);
    let p: Vec<f64> = (0..x.len()).map(|k| scattered(11 * k)).collect();
    // At this angle only nodes of a single particle act as a whole, which is exact.
    let (mut tree, mut direct) = (tree::<D>(&mass, 0.01, 1e-9), direct::<D>(&mass, 0.01));
    assert!(distance(&gradient(&mut tree, &x), &gradient(&mut direct, &x)) < 1e-13);
    assert!(distance(&product(&mut tree, &x, &p), &product(&mut direct, &x, &p)) < 1e-13);
    assert!((tree.energy(&x) / direct.energy(&x) - 1.0).abs() < 1e-13);
    let error = tree.force_error(&x);
    assert!(error.relative_max < 1e-11 && error.samples == 256, "{error:?}");
}

#[test]
fn a_tree_that_opens_everything_is_the_direct_sum() {
    everything_opened_is_the_direct_sum::<2>();
    everything_opened_is_the_direct_sum::<3>();
}

/// Returns errors for opening angles that halve: reported, of all forces, of the sum of all forces, of
/// the energy and of the Hessian.
fn errors<const D: usize>() -> [[f64; 5]; 3] {
    let (x, mass) = cluster::<D>(1500);
    let p: Vec<f64> = (0..x.len()).map(|k| scattered(11 * k)).collect();
    let mut direct = direct::<D>(&mass, 0.01);
    let (g, y, energy) = (gradient(&mut direct, &x), product(&mut direct, &x, &p), direct.energy(&x));
    let total: f64 = g.chunks(D).map(|g| g.iter().map(|g| g * g).sum::<f64>().sqrt()).sum();
    [1.0, 0.5, 0.25].map(|angle| {
        let mut tree = tree::<D>(&mass, 0.01, angle);
        let reported = tree.force_error(&x).relative_rms;
        let by_tree = gradient(&mut tree, &x);
        let drift = (0..D).map(|c| by_tree.iter().skip(c).step_by(D).sum::<f64>().abs()).fold(0.0, f64::max);
        let energy_error = (tree.energy(&x) / energy - 1.0).abs();
        [
            reported,
            distance(&by_tree, &g),
            drift / total,
            energy_error,
            distance(&product(&mut tree, &x, &p), &y),
        ]
    })
}

// The octupole is the first omitted moment: relative to the monopole, it falls as the third power of the
// opening angle. Products with the Hessian omit the differences of directions within a box: the first
// power.
#[test]
fn the_force_error_falls_with_the_third_power_of_the_opening_angle() {
    for (d, errors) in [(2, errors::<2>()), (3, errors::<3>())] {
        let order = |k: usize| 0.5 * (errors[0][k] / errors[2][k]).log2();
        for (k, expected) in [(0, 3.0), (1, 3.0), (4, 1.0)] {
            assert!(order(k) > expected, "{d}D: order {:.2} of error {k} in {errors:?}", order(k));
        }
        for [reported, all, drift, energy, _] in errors {
            assert!(reported > 0.3 * all && reported < 10.0 * all, "{d}D: {errors:?}");
            assert!(drift < 0.3 * all, "{d}D: the sum of all forces is well below their error: {errors:?}");
            assert!(energy < all, "{d}D: {errors:?}");
        }
        // Figures of the documentation, at 0.5.
        assert!(errors[1][0] < 2e-3 && errors[1][4] < 2e-2, "{d}D: {errors:?}");
    }
}

#[test]
fn one_and_two_particles() {
    let mut one = tree::<3>(&[2.0], 0.0, 0.5);
    assert_eq!(gradient(&mut one, &[1.0, 2.0, 3.0]), [0.0; 3]);
    assert_eq!(one.energy(&[1.0, 2.0, 3.0]), 0.0);
    assert_eq!(one.force_error(&[1.0, 2.0, 3.0]).relative_max, 0.0);
    let mut two = tree::<2>(&[2.0, 3.0], 0.0, 0.5);
    // G m1 m2 / r^2 = 0.3 * 6 / 4, along x.
    let g = gradient(&mut two, &[0.0, 0.0, 2.0, 0.0]);
    for (g, expected) in g.iter().zip([-0.45, 0.0, 0.45, 0.0]) {
        assert!((g - expected).abs() < 1e-15, "{g}");
    }
    assert!((two.energy(&[0.0, 0.0, 2.0, 0.0]) + 0.9).abs() < 1e-15);
}

#[test]
fn all_at_one_place() {
    let (n, place) = (100, [0.3, -0.2, 0.1]);
    let x: Vec<f64> = (0..3 * n).map(|k| place[k % 3]).collect();
    let mass = vec![1.0; n];
    let mut soft = tree::<3>(&mass, 0.1, 0.5);
    assert_eq!(gradient(&mut soft, &x), vec![0.0; 3 * n]);
    let energy = -0.3 * (n * (n - 1) / 2) as f64 / 0.1;
    assert!((soft.energy(&x) / energy - 1.0).abs() < 1e-13);
    // Without softening there is no force, and a fault is reported.
    let mut hard = tree::<3>(&mass, 0.0, 0.5);
    assert!(!hard.evaluate(&x));
    assert_eq!(hard.fault(&x), Some(Fault::Pair { first: 0, second: 1 }));
}

#[test]
fn two_coincident_particles_among_many_are_a_fault() {
    let (mut x, mass) = cluster::<2>(500);
    let mut hard = tree::<2>(&mass, 0.0, 0.7);
    assert!(hard.evaluate(&x) && hard.fault(&x).is_none());
    x.copy_within(2 * 123..2 * 124, 2 * 456);
    assert!(!hard.evaluate(&x));
    assert_eq!(hard.fault(&x), Some(Fault::Pair { first: 123, second: 456 }));
}

#[test]
fn a_force_that_is_not_finite_is_noticed() {
    let (mut x, mass) = cluster::<3>(500);
    let mut soft = tree::<3>(&mass, 0.1, 0.7);
    for bad in [f64::NAN, f64::INFINITY] {
        x[700] = bad;
        assert!(!soft.evaluate(&x), "{bad}");
    }
}

// One particle so far away that all others share the finest cell of the first key.
#[test]
fn outliers_do_not_coarsen_the_tree() {
    let (mut x, mass) = cluster::<3>(2000);
    for (k, x) in x[..6].iter_mut().enumerate() {
        *x = [1e12, -3e11, 2e10, -1e30, 0.0, 5.0][k];
    }
    let (mut tree, mut direct) = (tree::<3>(&mass, 0.01, 0.5), direct::<3>(&mass, 0.01));
    let (g, expected) = (gradient(&mut tree, &x), gradient(&mut direct, &x));
    assert!(distance(&g, &expected) < 2e-3, "{:e}", distance(&g, &expected));
    let leaves = tree.tree.nodes.iter().enumerate().filter(|(i, n)| n.is_leaf(*i));
    assert!(leaves.map(|(_, n)| n.end - n.begin).all(|count| count <= 16));
}

#[test]
fn the_result_does_not_depend_on_what_was_before() {
    let (x, mass) = cluster::<3>(1500);
    let moved: Vec<f64> = x.iter().enumerate().map(|(k, x)| x + 0.1 * scattered(5 * k + 1)).collect();
    let (mut used, mut fresh) = (tree::<3>(&mass, 0.01, 0.5), tree::<3>(&mass, 0.01, 0.5));
    gradient(&mut used, &x);
    product(&mut used, &x, &moved);
    assert_eq!(gradient(&mut used, &moved), gradient(&mut fresh, &moved));
    // Measurements do not change the gradient.
    used.energy(&x);
    let mut g = vec![0.0; x.len()];
    used.add_rows(0, &mut g);
    assert_eq!(g, gradient(&mut fresh, &moved));
}

#[test]
fn rows_of_a_block_are_those_of_its_vertices() {
    let (x, mass) = cluster::<2>(300);
    // Every third vertex is not a particle.
    let vertices: Vec<u32> = (0..300).filter(|v| v % 3 != 0).collect();
    let few = vertices.iter().map(|&v| mass[v as usize]).collect();
    let mut tree = TreeGravity::<2>::new(vertices, few, 0.3, 0.01, 0.5);
    let all = gradient(&mut tree, &x);
    let mut rows = vec![0.0; 2 * 70];
    tree.add_rows(101, &mut rows);
    assert_eq!(rows, all[2 * 101..2 * 171]);
    assert!(all[0] == 0.0 && all[2] != 0.0);
}

/// Direct sum without approximate products.
struct Exact(NBody<3>);

impl EnergyTerm for Exact {
    fn name(&self) -> String {
        self.0.name()
    }
    fn properties(&self) -> TermProperties {
        self.0.properties()
    }
    fn energy(&mut self, x: &[f64]) -> f64 {
        self.0.energy(x)
    }
    fn evaluate(&mut self, x: &[f64]) -> bool {
        self.0.evaluate(x)
    }
    fn add_rows(&self, first: usize, g: &mut [f64]) {
        self.0.add_rows(first, g);
    }
    fn add_hessian_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) {
        self.0.add_hessian_product(x, p, y);
    }
    fn fault(&self, x: &[f64]) -> Option<Fault> {
        self.0.fault(x)
    }
}

impl TermViews for Exact {}

// If many particles share the softening length, no single pair has the highest frequency.
#[test]
fn the_search_of_the_largest_frequency_by_a_tree_ends_where_the_direct_sum_does() {
    let (x, mass) = cluster::<3>(1000);
    let spectrum = |term: Box<dyn EnergyTerm>| {
        let mut system = System::new(3, mass.clone());
        system.add_term(term);
        largest_frequency(&mut system, &x)
    };
    let exact = spectrum(Box::new(Exact(direct(&mass, 0.05))));
    let mut approximate = direct::<3>(&mass, 0.05);
    approximate.stiffness_by_tree = 1000;
    let by_tree = spectrum(Box::new(approximate));
    let error = (by_tree.frequency / exact.frequency - 1.0).abs();
    assert!(exact.relative_error < 1e-7 && by_tree.relative_error < 3e-3, "{exact:?} {by_tree:?}");
    assert!(
        error > 0.0 && error < by_tree.relative_error && error < 1e-5,
        "{error:e}: {exact:?} {by_tree:?}"
    );
}
