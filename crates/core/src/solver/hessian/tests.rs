//! Matrices of terms whose stencils repeat a vertex, or change.

use std::ops::Range;

use super::{Assembler, At, Weights};
use crate::energy::{ChangingStencils, EnergyKind, EnergyTerm, Fault, Stencils, TermProperties, TermViews};
use crate::material::Psd;
use crate::system::System;

/// Number of stencils: more than one group.
const COUNT: u32 = 700;
/// Gradients of the strain of a stencil with respect to its three positions.
const SLOPES: [[f64; 2]; 3] = [[1.0, 2.0], [-3.0, 0.5], [0.25, -4.0]];

/// Energy `E = sum_k 1/2 (sum_i g_i . x_i)^2` over stencils `[k, k + 1, k]` in 2D.
struct Folded;

impl EnergyTerm for Folded {
    fn name(&self) -> String {
        "folded".into()
    }
    fn properties(&self) -> TermProperties {
        TermProperties::of(EnergyKind::Elastic)
    }
    fn energy(&mut self, _: &[f64]) -> f64 {
        0.0
    }
    fn evaluate(&mut self, _: &[f64]) -> bool {
        true
    }
    fn add_rows(&self, _: usize, _: &mut [f64]) {}
    fn add_hessian_product(&mut self, _: &[f64], p: &[f64], y: &mut [f64]) {
        for k in 0..COUNT as usize {
            let places = [k, k + 1, k].into_iter().zip(SLOPES);
            let strain: f64 = places.clone().map(|(v, g)| g[0] * p[2 * v] + g[1] * p[2 * v + 1]).sum();
            for (v, g) in places {
                (0..2).for_each(|c| y[2 * v + c] += g[c] * strain);
            }
        }
    }
    fn stencils(&mut self) -> Stencils {
        Stencils { size: 3, vertices: (0..COUNT).flat_map(|k| [k, k + 1, k]).collect() }
    }
    fn stencil_hessians(&self, stencils: Range<usize>, _: &[f64], _: Psd, out: &mut [f64]) {
        let mut next = out.iter_mut();
        for _ in stencils {
            for (i, a) in SLOPES.iter().enumerate() {
                for b in &SLOPES[i..] {
                    for (a, b) in [(a[0], b[0]), (a[0], b[1]), (a[1], b[0]), (a[1], b[1])] {
                        *next.next().unwrap() = a * b;
                    }
                }
            }
        }
    }
    fn fault(&self, _: &[f64]) -> Option<Fault> {
        None
    }
}

impl TermViews for Folded {}

// The block of the first and last position is on the diagonal, and so is its transpose.
#[test]
fn a_stencil_may_name_a_vertex_at_two_places() {
    let count = COUNT as usize + 1;
    let mut system = System::new(2, vec![1.0; count]);
    system.add_term(Box::new(Folded));
    let x = vec![0.0; 2 * count];
    let p: Vec<f64> = (0..x.len()).map(|i| (0.7 * i as f64).sin()).collect();
    let mut assembler = Assembler::<2>::new(&mut system);
    let weights = Weights { inertia: 0.0, stiffness: 1.0, damping: 0.0 };
    assembler.assemble(&system, At { x: &x, v: &[], psd: Psd::Exact, predicted_from: None }, weights);
    let (mut assembled, mut exact) = (vec![0.0; x.len()], vec![0.0; x.len()]);
    assembler.matrix().multiply(&p, &mut assembled);
    system.hessian_product(&x, &p, &mut exact);
    // Sums of at most ten products, none above 16.
    for (assembled, exact) in assembled.iter().zip(&exact) {
        assert!((assembled - exact).abs() < 160.0 * f64::EPSILON, "{assembled} and {exact}");
    }
}

/// Blocks below the diagonal are transposes of those above it in every task, for several tasks.
#[test]
fn matrices_are_symmetric_and_the_same_on_any_number_of_threads() {
    let assembled = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut system = System::new(2, vec![1.0; COUNT as usize + 1]);
            system.add_term(Box::new(Folded));
            let x = vec![0.0; 2 * (COUNT as usize + 1)];
            let mut assembler = Assembler::<2>::new(&mut system);
            let weights = Weights { inertia: 3.0, stiffness: 0.7, damping: 0.0 };
            let at = At { x: &x, v: &[], psd: Psd::Exact, predicted_from: None };
            // Refilled entries do not depend on earlier ones.
            (0..2).for_each(|_| assembler.assemble(&system, at, weights));
            assembler.matrix().clone()
        })
    };
    let alone = assembled(1);
    assert_eq!(assembled(3), alone);
    let mut below = 0;
    for row in 0..alone.rows() {
        for (column, block) in alone.row(row).filter(|(column, _)| *column < row) {
            let (_, above) = alone.row(column).find(|(other, _)| *other == row).unwrap();
            assert_eq!([[block[0][0], block[1][0]], [block[0][1], block[1][1]]], *above);
            below += 1;
        }
    }
    assert_eq!(below, COUNT);
}

/// Energy `E = sum_(a, b) 1/2 k_ab (g . (x_a - x_b))^2`, `k_ab = 1 + a + b / 100`, over pairs set from
/// outside.
struct ChangingSprings {
    pairs: Vec<[u32; 2]>,
    lists: [Stencils; 1],
}

const SPRING: [f64; 2] = [0.5, -2.0];

fn stiffness([a, b]: [u32; 2]) -> f64 {
    1.0 + f64::from(a) + f64::from(b) / 100.0
}

impl EnergyTerm for ChangingSprings {
    fn name(&self) -> String {
        "changing springs".into()
    }
    fn properties(&self) -> TermProperties {
        TermProperties::of(EnergyKind::Elastic)
    }
    fn energy(&mut self, _: &[f64]) -> f64 {
        0.0
    }
    fn evaluate(&mut self, _: &[f64]) -> bool {
        true
    }
    fn add_rows(&self, _: usize, _: &mut [f64]) {}
    fn add_hessian_product(&mut self, _: &[f64], p: &[f64], y: &mut [f64]) {
        for pair in &self.pairs {
            let [a, b] = pair.map(|v| 2 * v as usize);
            let strain: f64 = (0..2).map(|k| SPRING[k] * (p[a + k] - p[b + k])).sum();
            for k in 0..2 {
                y[a + k] += stiffness(*pair) * strain * SPRING[k];
                y[b + k] -= stiffness(*pair) * strain * SPRING[k];
            }
        }
    }
    fn fault(&self, _: &[f64]) -> Option<Fault> {
        None
    }
}

impl TermViews for ChangingSprings {
    fn changing(&self) -> Option<&dyn ChangingStencils> {
        Some(self)
    }
    fn changing_mut(&mut self) -> Option<&mut dyn ChangingStencils> {
        Some(self)
    }
}

/// Changing stencils: the pairs are given by whole numbers in the positions `x`.
impl ChangingStencils for ChangingSprings {
    fn find(&mut self, x: &[f64]) -> bool {
        let round = x[0] as u32;
        let every = |pair: &[u32; 2]| !(7 * pair[0] + 4 * pair[1] + round).is_multiple_of(2 + round % 5);
        // Runs of neighbours come and go, too, longer than the search distance.
        let run = |pair: &[u32; 2]| round % 3 != 1 || !(20 * round..20 * round + 90).contains(&pair[0]);
        let all = (0..300).flat_map(|a| [[a, a + 1], [a, a + 5]]);
        self.pairs = all.filter(every).filter(run).collect();
        let vertices = self.pairs.as_flattened().to_vec();
        let changed = self.lists[0].vertices != vertices;
        self.lists[0].vertices = vertices;
        changed
    }
    fn lists(&self) -> &[Stencils] {
        &self.lists
    }
    fn blocks(&self, _: usize, stencils: Range<usize>, _: (&[f64], &[f64]), _: Psd, out: &mut [f64]) {
        for (pair, out) in self.pairs[stencils].iter().zip(out.chunks_exact_mut(12)) {
            for (block, sign) in out.chunks_exact_mut(4).zip([1.0, -1.0, 1.0]) {
                for (i, entry) in block.iter_mut().enumerate() {
                    *entry = sign * stiffness(*pair) * SPRING[i / 2] * SPRING[i % 2];
                }
            }
        }
    }
}

/// Stencils that stay keep their positions in the matrix, whatever comes and goes among them.
#[test]
fn matrices_of_changing_stencils_are_their_sums() {
    let count = 400;
    let mut system = System::new(2, vec![1.0; count]);
    let lists = [Stencils { size: 2, vertices: vec![] }];
    system.add_term(Box::new(ChangingSprings { pairs: vec![], lists }));
    let p: Vec<f64> = (0..2 * count).map(|i| (0.7 * i as f64).sin()).collect();
    let mut assembler = Assembler::<2>::new(&mut system);
    let weights = Weights { inertia: 0.0, stiffness: 1.0, damping: 0.0 };
    let mut patterns = vec![];
    for round in [0, 1, 2, 3, 3, 9, 4, 7, 1, 12] {
        let x = vec![f64::from(round); 2 * count];
        system.find_stencils(&x);
        assembler.assemble(&system, At { x: &x, v: &[], psd: Psd::Exact, predicted_from: None }, weights);
        let (mut assembled, mut exact) = (vec![0.0; x.len()], vec![0.0; x.len()]);
        assembler.matrix().multiply(&p, &mut assembled);
        system.hessian_product(&x, &p, &mut exact);
        let size = exact.iter().fold(0.0, |most: f64, y| most.max(y.abs()));
        for (assembled, exact) in assembled.iter().zip(&exact) {
            assert!((assembled - exact).abs() < 1e-13 * size, "round {round}: {assembled} and {exact}");
        }
        patterns.push(assembler.pattern());
    }
    patterns.dedup();
    assert!((2..9).contains(&patterns.len()), "{patterns:?}: most rounds have the places of others");
}
