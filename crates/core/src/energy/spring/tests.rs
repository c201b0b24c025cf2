//! Both layouts against a plain loop over the springs.

use super::*;

/// Returns numbers in `-1..1` without a pattern.
fn scattered(k: usize) -> f64 {
    let x = (k as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ x >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    ((x ^ x >> 32) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

struct Net {
    edges: Vec<[u32; 2]>,
    vertices: usize,
}

impl Net {
    /// Returns `n0` x `n1` vertices with springs to all eight neighbours.
    fn cloth(n0: usize, n1: usize) -> Self {
        let at = |i: usize, j: usize| (i * n1 + j) as u32;
        let mut edges = vec![];
        for i in 0..n0 {
            for j in 0..n1 {
                if i + 1 < n0 {
                    edges.push([at(i, j), at(i + 1, j)]);
                }
                if j + 1 < n1 {
                    edges.push([at(i, j), at(i, j + 1)]);
                }
                if i + 1 < n0 && j + 1 < n1 {
                    edges.push([at(i, j), at(i + 1, j + 1)]);
                    edges.push([at(i + 1, j), at(i, j + 1)]);
                }
            }
        }
        Net { edges, vertices: n0 * n1 }
    }

    fn strand(n: u32) -> Self {
        Net { edges: (1..n).map(|i| [i, i - 1]).collect(), vertices: n as usize }
    }

    /// Returns the same net with its vertices numbered at random.
    fn shuffled(mut self) -> Self {
        let mut order: Vec<usize> = (0..self.vertices).collect();
        order.sort_by(|a, b| scattered(*a).total_cmp(&scattered(*b)));
        self.edges.iter_mut().flatten().for_each(|v| *v = order[*v as usize] as u32);
        self
    }

    /// Surrounds the net by `before` and `after` vertices without springs.
    fn among_others(mut self, before: u32, after: usize) -> Self {
        self.edges.iter_mut().flatten().for_each(|v| *v += before);
        self.vertices += before as usize + after;
        self
    }
}

/// Energy, gradient and Hessian product, by a loop over the springs, and the sums of the absolute values
/// of their terms, by which rounding errors are measured.
#[derive(Default)]
struct Plain {
    energy: f64,
    gradient: Vec<f64>,
    product: Vec<f64>,
    gradient_scale: Vec<f64>,
    product_scale: Vec<f64>,
}

fn plain<const D: usize>(net: &Net, stiffness: &[f64], rest: &[f64], x: &[f64], p: &[f64]) -> Plain {
    let zeros = vec![0.0; net.vertices * D];
    let mut r = Plain {
        energy: 0.0,
        gradient: zeros.clone(),
        product: zeros.clone(),
        gradient_scale: zeros.clone(),
        product_scale: zeros,
    };
    for (i, [a, b]) in net.edges.iter().map(|e| e.map(|v| v as usize * D)).enumerate() {
        let (k, l0) = (stiffness[i], rest[i]);
        let d: Vec<f64> = (0..D).map(|c| x[a + c] - x[b + c]).collect();
        let dp: Vec<f64> = (0..D).map(|c| p[a + c] - p[b + c]).collect();
        let l = d.iter().map(|d| d * d).sum::<f64>().sqrt();
        r.energy += 0.5 * k * (l - l0).powi(2);
        if l == 0.0 {
            continue;
        }
        let along = d.iter().zip(&dp).map(|(d, p)| d / l * p).sum::<f64>();
        let along_scale = d.iter().zip(&dp).map(|(d, p)| (d / l * p).abs()).sum::<f64>();
        for c in 0..D {
            let n = d[c] / l;
            let force = k * (l - l0) * n;
            let q = k * (n * along + (l - l0) / l * (dp[c] - n * along));
            let q_scale = k * (along_scale * (1.0 + ((l - l0) / l).abs()) + (l + l0) / l * dp[c].abs());
            for (v, sign) in [(a, 1.0), (b, -1.0)] {
                r.gradient[v + c] += sign * force;
                r.product[v + c] += sign * q;
                r.gradient_scale[v + c] += k * (l + l0);
                r.product_scale[v + c] += q_scale;
            }
        }
    }
    r
}

/// True if the springs are laid out as runs.
fn runs<const D: usize>(springs: &Springs<D>) -> bool {
    matches!(springs.layout, Layout::Runs(_))
}

/// Compares everything with the plain loop; returns true if the layout was runs.
fn compare<const D: usize>(net: &Net, vary: bool) -> bool {
    let stiffness: Vec<f64> =
        (0..net.edges.len()).map(|i| if vary { 30.0 + 20.0 * scattered(i) } else { 30.0 }).collect();
    let rest: Vec<f64> = (0..net.edges.len()).map(|i| 0.5 + 0.3 * scattered(i + 7)).collect();
    let x: Vec<f64> = (0..net.vertices * D).map(|i| scattered(i + 1000)).collect();
    let p: Vec<f64> = (0..net.vertices * D).map(|i| scattered(i + 90_000)).collect();
    let expected = plain::<D>(net, &stiffness, &rest, &x, &p);
    let mut springs = Springs::<D>::new("net", &net.edges, &stiffness, &rest, net.vertices);
    let energy = springs.energy(&x);
    assert!((energy / expected.energy - 1.0).abs() < 1e-14, "{energy} instead of {}", expected.energy);
    assert!(springs.evaluate(&x));
    // Requested in pieces, from unaligned positions, added to existing values.
    let mut gradient = vec![1.0; x.len()];
    for (piece, g) in gradient.chunks_mut(37 * D).enumerate() {
        springs.add_rows(37 * piece, g);
    }
    for first in (0..net.vertices).step_by(16) {
        let count = (net.vertices - first).min(16);
        let mut sums = vec![0.0; count * D];
        springs.add_rows(first, &mut sums);
        let has_springs = |v: usize| net.edges.iter().flatten().any(|end| *end as usize == v);
        match springs.rows(first, count) {
            Some(rows) => assert_eq!(rows, sums),
            // Before the first or after the last vertex with springs.
            None => assert!(!has_springs(first) || !has_springs(first + count - 1)),
        }
    }
    let mut product = vec![1.0; x.len()];
    springs.add_hessian_product(&x, &p, &mut product);
    for i in 0..x.len() {
        let error = (gradient[i] - 1.0 - expected.gradient[i]).abs();
        assert!(error <= 1e-14 * (expected.gradient_scale[i] + 1.0), "force {i}: off by {error:e}");
        let error = (product[i] - 1.0 - expected.product[i]).abs();
        assert!(error <= 1e-14 * (expected.product_scale[i] + 1.0), "product {i}: off by {error:e}");
    }
    runs(&springs)
}

#[test]
fn a_cloth_is_made_of_runs_and_agrees_with_a_plain_loop() {
    for vary in [false, true] {
        assert!(compare::<3>(&Net::cloth(40, 33), vary));
        assert!(compare::<3>(&Net::cloth(9, 64).among_others(5, 3), vary));
        assert!(compare::<2>(&Net::cloth(21, 50), vary));
        assert!(compare::<2>(&Net::cloth(12, 40).among_others(13, 0), vary));
    }
}

#[test]
fn a_strand_is_made_of_runs_and_agrees_with_a_plain_loop() {
    for n in [8, 9, 100, 1000] {
        assert!(compare::<3>(&Net::strand(n), false));
        assert!(compare::<2>(&Net::strand(n).among_others(3, 10), true));
    }
}

#[test]
fn springs_in_no_order_are_gathered_and_agree_with_a_plain_loop() {
    for vary in [false, true] {
        assert!(!compare::<3>(&Net::cloth(40, 33).shuffled(), vary));
        assert!(!compare::<3>(&Net::strand(301).shuffled().among_others(4, 2), vary));
        assert!(!compare::<2>(&Net::cloth(21, 50).shuffled().among_others(1, 9), vary));
    }
}

// A hub with many springs, ends far apart, and two springs between the same vertices.
#[test]
fn odd_nets_agree_with_a_plain_loop() {
    let hub = Net { edges: (1..300).map(|i| [0, i]).collect(), vertices: 300 };
    let mut ring = Net::strand(200);
    ring.edges.push([0, 199]);
    let mut double = Net::strand(64);
    double.edges.extend((1..64).map(|i| [i - 1, i]));
    double.edges.extend([[3, 4], [60, 59]]);
    for net in [hub, ring, double] {
        compare::<3>(&net, true);
        compare::<2>(&net, true);
    }
    assert!(!compare::<3>(&Net { edges: vec![[2, 7]], vertices: 10 }, true), "one spring fills no run");
}

#[test]
fn both_ends_of_a_spring_feel_the_same_force() {
    for net in [Net::cloth(2, 2), Net::cloth(2, 2).shuffled(), Net { edges: vec![[9, 2]], vertices: 10 }] {
        for edge in net.edges {
            let mut springs = Springs::<3>::new("one", &[edge], &[3.0], &[0.1], net.vertices);
            let x: Vec<f64> = (0..3 * net.vertices).map(scattered).collect();
            let mut g = vec![0.0; x.len()];
            springs.add_gradient(&x, &mut g);
            let [a, b] = edge.map(|v| v as usize);
            assert!((0..3).all(|c| g[3 * a + c] == -g[3 * b + c] && g[3 * a + c] != 0.0));
        }
    }
}

#[test]
fn a_spring_of_length_zero_pulls_with_no_force() {
    for net in [Net::strand(40), Net::strand(40).shuffled()] {
        let (k, rest) = (vec![2.0; 39], vec![0.5; 39]);
        let mut springs = Springs::<3>::new("point", &net.edges, &k, &rest, 40);
        let mut g = vec![0.0; 120];
        springs.add_gradient(&[0.25; 120], &mut g);
        assert!(g.iter().all(|g| *g == 0.0));
        assert_eq!(springs.energy(&[0.25; 120]), 39.0 * 0.25);
    }
}

#[test]
fn a_force_that_is_not_finite_is_reported_with_its_spring() {
    for net in [Net::cloth(20, 24).among_others(2, 3), Net::cloth(20, 24).shuffled()] {
        let n = net.edges.len();
        let rest = vec![0.5; n];
        let x: Vec<f64> = (0..3 * net.vertices).map(scattered).collect();
        for spring in [0, 1, n / 2, n - 1] {
            // Positions are finite; the force of one spring overflows.
            let mut stiffness = vec![10.0; n];
            stiffness[spring] = 1.7e308;
            let mut far = x.clone();
            far[3 * net.edges[spring][0] as usize] += 1e3;
            let mut springs = Springs::<3>::new("net", &net.edges, &stiffness, &rest, net.vertices);
            assert!(!springs.evaluate(&far));
            let Some(Fault::Spring { body, spring: found, length }) = springs.fault(&far) else {
                panic!("no fault of spring {spring}");
            };
            assert_eq!((body.as_str(), found), ("net", spring));
            assert!((length - 1e3).abs() < 4.0);
        }
        let mut springs = Springs::<3>::new("net", &net.edges, &vec![10.0; n], &rest, net.vertices);
        assert!(springs.evaluate(&x));
        assert_eq!(springs.fault(&x), None);
        // The first of several faults is reported.
        let lost = net.edges[n / 3][1];
        let mut without = x.clone();
        without[3 * lost as usize] = f64::NAN;
        let first = net.edges.iter().position(|e| e.contains(&lost)).unwrap();
        assert!(matches!(springs.fault(&without), Some(Fault::Spring { spring, .. }) if spring == first));
    }
}

#[test]
fn a_vertex_that_is_lost_does_not_spoil_those_it_has_no_spring_to() {
    // Lanes without a spring of their own read other vertices, too.
    let net = Net::cloth(12, 20).among_others(3, 3);
    let (k, rest) = (vec![10.0; net.edges.len()], vec![0.5; net.edges.len()]);
    let mut springs = Springs::<2>::new("net", &net.edges, &k, &rest, net.vertices);
    assert!(runs(&springs));
    for lost in [3, 22, 23, 3 + 239] {
        let mut x: Vec<f64> = (0..2 * net.vertices).map(scattered).collect();
        x[2 * lost] = f64::NAN;
        assert!(!springs.evaluate(&x));
        let mut g = vec![0.0; x.len()];
        springs.add_rows(0, &mut g);
        for v in 0..net.vertices {
            let touched =
                v == lost || net.edges.iter().any(|e| e.contains(&(v as u32)) && e.contains(&(lost as u32)));
            assert_eq!(g[2 * v].is_nan(), touched && net.edges.iter().flatten().any(|e| *e == v as u32));
        }
    }
}

// promise 1. 3,660 vertices are enough for several tasks.
#[test]
fn the_bits_do_not_depend_on_the_number_of_threads() {
    for net in [Net::cloth(60, 61), Net::cloth(60, 61).shuffled()] {
        let (k, rest) = (vec![10.0; net.edges.len()], vec![0.5; net.edges.len()]);
        let x: Vec<f64> = (0..3 * net.vertices).map(scattered).collect();
        let p: Vec<f64> = (0..3 * net.vertices).map(|i| scattered(i + 5)).collect();
        let run = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let mut springs = Springs::<3>::new("net", &net.edges, &k, &rest, net.vertices);
                let (mut g, mut y) = (vec![0.0; x.len()], vec![0.0; x.len()]);
                springs.add_gradient(&x, &mut g);
                springs.add_hessian_product(&x, &p, &mut y);
                g.push(springs.energy(&x));
                g.into_iter().chain(y).map(f64::to_bits).collect::<Vec<_>>()
            })
        };
        let one = run(1);
        for threads in [2, 3, 8] {
            assert!(run(threads) == one, "{threads} threads");
        }
    }
}

#[test]
fn no_springs_are_no_springs() {
    let mut springs = Springs::<2>::new("none", &[], &[], &[], 4);
    assert!(springs.evaluate(&[1.0; 8]));
    assert_eq!(springs.energy(&[1.0; 8]), 0.0);
    springs.add_rows(0, &mut [0.0; 8]);
    springs.add_hessian_product(&[1.0; 8], &[1.0; 8], &mut [0.0; 8]);
}

#[test]
#[should_panic(expected = "spring 1 joins vertex 2 to itself")]
fn a_spring_has_two_ends() {
    Springs::<2>::new("loop", &[[0, 1], [2, 2]], &[1.0; 2], &[1.0; 2], 3);
}
