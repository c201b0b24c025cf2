//! Matrices of terms whose stencils name a vertex more than once.

use std::ops::Range;

use super::{Assembler, At, Weights};
use crate::energy::{EnergyKind, EnergyTerm, Fault, Stencils, TermProperties, TermViews};
use crate::material::Psd;
use crate::system::System;

/// Number of stencils: more than a group has.
const COUNT: u32 = 700;
/// Gradients of the strain of a stencil by the positions of its three places.
const SLOPES: [[f64; 2]; 3] = [[1.0, 2.0], [-3.0, 0.5], [0.25, -4.0]];

/// `E = sum_k 1/2 (sum_i g_i . x_i)^2` over stencils `[k, k + 1, k]` in the plane.
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
    fn bytes(&self) -> usize {
        0
    }
}

impl TermViews for Folded {}

// The block of the first and the last place is on the diagonal, and so is its transpose.
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

/// Blocks below the diagonal are transposes of those above it, in every task; tasks are as many as threads
/// ask for, and their rows more than one task has.
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
            // What is filled anew does not depend on what was there.
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
