//! Newtonian gravity between all pairs of particles.

mod hessian;
mod kernels;
mod pair;
mod tree;

use std::ops::{BitAnd, Range};

use rayon::prelude::*;

use super::{EnergyKind, EnergyTerm, Fault, Measurements, Stencils, TermProperties, TermViews};
use crate::lanes::{WIDTH, dispatch, dispatch_compact};
use crate::material::Psd;
use kernels::{NBodyEnergyKernel, PairKernel, Particles};
use pair::{Block, FAR};

pub use tree::{ForceError, TreeGravity};

/// Particles per group, about 50 microseconds of work.
const PARTICLES_PER_GROUP: usize = 256;
/// Number of particles from which the search for the largest frequency uses a tree.
const STIFFNESS_BY_TREE: usize = 4096;
const STIFFNESS_OPENING_ANGLE: f64 = 0.5;
/// Maximum number of groups, which balances the load against the summation of arrays.
const MAX_GROUPS: usize = 16;

/// Newtonian gravity `E = -G sum_{i<j} m_i m_j / sqrt(|x_i - x_j|^2 + softening^2)` over a set of
/// vertices (lecture 8), with Plummer softening: Aarseth 2003, *Gravitational N-Body Simulations*.
///
/// Each pair is computed once and acts on both its particles. The pairs are distributed to groups, whose
/// number depends on the number of particles, never on the number of threads. Each group sums into its
/// own array and the arrays are added in order, so that the result is bit-identical on any machine.
pub struct NBody<const D: usize> {
    vertices: Vec<u32>,
    constant: f64,
    softening2: f64,
    mass: Vec<[f64; WIDTH]>,
    position: Vec<Block<D>>,
    /// Direction of products with the Hessian; empty until the first product.
    direction: Vec<Block<D>>,
    /// Sums of each group.
    partial: Vec<Vec<Block<D>>>,
    parts: Vec<f64>,
    /// Number of particles from which products for the search of the largest frequency are approximate.
    stiffness_by_tree: usize,
    /// Tree for these approximate products, while they are needed.
    stiffness: Option<Box<TreeGravity<D>>>,
    /// Every pair, after an implicit integrator has requested them.
    pairs: Vec<[u32; 2]>,
}

impl<const D: usize> NBody<D> {
    /// Creates the attraction with constant `constant` [m^3/(kg s^2)] and softening length `softening`
    /// [m] between `vertices` of masses `mass` [kg] (one per listed vertex).
    ///
    /// # Panics
    /// If the vertices are not listed in ascending order.
    pub fn new(vertices: Vec<u32>, mass: Vec<f64>, constant: f64, softening: f64) -> Self {
        assert!(vertices.is_sorted(), "vertices in ascending order");
        let blocks = vertices.len().div_ceil(WIDTH);
        let groups = (vertices.len() / PARTICLES_PER_GROUP).clamp(1, MAX_GROUPS);
        let mut masses = vec![[0.0; WIDTH]; blocks];
        for (i, m) in mass.into_iter().enumerate() {
            masses[i / WIDTH][i % WIDTH] = m;
        }
        NBody {
            vertices,
            constant,
            softening2: softening * softening,
            mass: masses,
            position: vec![[FAR; D]; blocks],
            direction: vec![],
            partial: vec![vec![[[0.0; WIDTH]; D]; blocks]; groups],
            parts: vec![0.0; groups],
            stiffness_by_tree: STIFFNESS_BY_TREE,
            stiffness: None,
            pairs: vec![],
        }
    }

    fn particles(&self) -> Particles<'_, D> {
        Particles { position: &self.position, mass: &self.mass, softening2: self.softening2 }
    }

    /// Runs the pair kernel in every group; returns true if all sums are finite. `ENERGY` also writes the
    /// energies to `parts`.
    fn sum_pairs<const DERIVATIVE: bool, const ENERGY: bool>(&mut self) -> bool {
        let mut partial = std::mem::take(&mut self.partial);
        let mut parts = std::mem::take(&mut self.parts);
        let (particles, groups) = (self.particles(), partial.len());
        let direction = if DERIVATIVE { &self.direction } else { &self.position };
        let run = |(group, (out, part)): (usize, (&mut Vec<Block<D>>, &mut f64))| {
            let kernel = PairKernel::<D, DERIVATIVE, ENERGY> { particles, direction, group, groups, out };
            let (finite, energy) = dispatch(kernel);
            *part = energy;
            finite
        };
        let finite = if groups == 1 {
            partial.iter_mut().zip(&mut parts).enumerate().map(run).fold(true, BitAnd::bitand)
        } else {
            let both = partial.par_iter_mut().zip(&mut parts);
            both.enumerate().map(run).reduce(|| true, BitAnd::bitand)
        };
        (self.partial, self.parts) = (partial, parts);
        finite
    }
}

/// Copies the rows of `vertices` from a flat array into blocks.
fn load<const D: usize>(blocks: &mut [Block<D>], vertices: &[u32], x: &[f64]) {
    for (i, &v) in vertices.iter().enumerate() {
        for c in 0..D {
            blocks[i / WIDTH][c][i % WIDTH] = x[v as usize * D + c];
        }
    }
}

impl<const D: usize> EnergyTerm for NBody<D> {
    fn name(&self) -> String {
        format!("mutual gravity of {} particles", self.vertices.len())
    }

    fn properties(&self) -> TermProperties {
        TermProperties { couples_all: true, ..TermProperties::of(EnergyKind::Gravitational) }
    }

    fn energy(&mut self, x: &[f64]) -> f64 {
        load(&mut self.position, &self.vertices, x);
        let mut parts = std::mem::take(&mut self.parts);
        let (particles, groups) = (self.particles(), parts.len());
        let run = |(group, out): (usize, &mut f64)| {
            *out = dispatch_compact(NBodyEnergyKernel { particles, group, groups })
        };
        if groups == 1 {
            parts.iter_mut().enumerate().for_each(run);
        } else {
            parts.par_iter_mut().enumerate().for_each(run);
        }
        self.parts = parts;
        -self.constant * self.parts.iter().sum::<f64>()
    }

    fn evaluate(&mut self, x: &[f64]) -> bool {
        load(&mut self.position, &self.vertices, x);
        self.sum_pairs::<false, false>()
    }

    fn stencils(&mut self) -> Stencils {
        if self.vertices.len() > hessian::MAX_PARTICLES {
            // The matrix omits gravity: Newton's method converges linearly, but fast, because gravity is
            // soft.
            return Stencils::default();
        }
        self.pairs = hessian::pairs(self.vertices.len());
        let vertices = self.pairs.iter().flat_map(|p| p.map(|i| self.vertices[i as usize])).collect();
        Stencils { size: 2, vertices }
    }

    fn stencil_hessians(&self, stencils: Range<usize>, x: &[f64], psd: Psd, out: &mut [f64]) {
        let x = x.as_chunks::<D>().0;
        for (pair, out) in self.pairs[stencils].iter().zip(out.chunks_exact_mut(3 * D * D)) {
            let [a, b] = pair.map(|i| &x[self.vertices[i as usize] as usize]);
            let mut d = *a;
            for c in 0..D {
                d[c] -= b[c];
            }
            let [m, n] = pair.map(|i| hessian::mass_of(&self.mass, i));
            hessian::pair_hessian(d, self.constant * m * n, self.softening2, psd, out);
        }
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        let end = first + g.len() / D;
        let start = self.vertices.partition_point(|&v| (v as usize) < first);
        for (i, &v) in self.vertices.iter().enumerate().skip(start) {
            if v as usize >= end {
                break;
            }
            let (block, lane) = (i / WIDTH, i % WIDTH);
            let factor = self.constant * self.mass[block][lane];
            for c in 0..D {
                let sum: f64 = self.partial.iter().map(|p| p[block][c][lane]).sum();
                g[(v as usize - first) * D + c] += factor * sum;
            }
        }
    }

    fn add_hessian_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) {
        load(&mut self.position, &self.vertices, x);
        self.direction.resize(self.position.len(), [[0.0; WIDTH]; D]);
        load(&mut self.direction, &self.vertices, p);
        self.sum_pairs::<true, false>();
        self.add_rows(0, y);
    }

    fn fault(&self, x: &[f64]) -> Option<Fault> {
        coincident::<D>(&self.vertices, self.softening2, x)
    }
}

impl<const D: usize> TermViews for NBody<D> {
    fn measurements(&mut self) -> Option<&mut dyn Measurements> {
        Some(self)
    }
}

impl<const D: usize> Measurements for NBody<D> {
    fn evaluate_with_energy(&mut self, x: &[f64]) -> (bool, Option<f64>) {
        load(&mut self.position, &self.vertices, x);
        let finite = self.sum_pairs::<false, true>();
        (finite, Some(-self.constant * self.parts.iter().sum::<f64>()))
    }

    fn add_stiffness_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) -> bool {
        if self.vertices.len() < self.stiffness_by_tree {
            self.add_hessian_product(x, p, y);
            return false;
        }
        let tree = self.stiffness.get_or_insert_with(|| {
            let mass = self.mass.iter().flatten().copied().take(self.vertices.len()).collect();
            let softening = self.softening2.sqrt();
            let angle = STIFFNESS_OPENING_ANGLE;
            Box::new(TreeGravity::new(self.vertices.clone(), mass, self.constant, softening, angle))
        });
        tree.add_hessian_product(x, p, y);
        true
    }

    fn end_stiffness_products(&mut self) {
        self.stiffness = None;
    }
}

/// Finds two vertices at the same position, which is an error without softening.
fn coincident<const D: usize>(vertices: &[u32], softening2: f64, x: &[f64]) -> Option<Fault> {
    if softening2 > 0.0 {
        return None;
    }
    // Sorted, equal positions are neighbours.
    let row = |i: u32| &x[i as usize * D..i as usize * D + D];
    let mut order = vertices.to_vec();
    order.sort_by(|&a, &b| {
        let by_component = row(a).iter().zip(row(b)).map(|(a, b)| a.total_cmp(b));
        by_component.fold(std::cmp::Ordering::Equal, |o, c| o.then(c))
    });
    let pair = order.windows(2).find(|w| row(w[0]) == row(w[1]))?;
    let (first, second) = (pair[0].min(pair[1]) as usize, pair[0].max(pair[1]) as usize);
    Some(Fault::Pair { first, second })
}

/// Copies the rows of `vertices` of a flat array.
fn gather<const D: usize>(rows: &mut Vec<[f64; D]>, vertices: &[u32], x: &[f64]) {
    rows.clear();
    rows.extend(vertices.iter().map(|&v| {
        let mut row = [0.0; D];
        row.copy_from_slice(&x[v as usize * D..][..D]);
        row
    }));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_energy_comes_with_the_force_and_leaves_it_alone() {
        // One block, several blocks of one group, several groups; the last block is not full.
        for count in [2, 11, 300, 1001] {
            let x: Vec<f64> = (0..3 * count).map(|i| (0.37 * i as f64).sin() * 2.0).collect();
            let mass: Vec<f64> = (0..count).map(|i| 1.0 + 0.5 * (i as f64).cos()).collect();
            let mut term = NBody::<3>::new((0..count as u32).collect(), mass.clone(), 0.7, 0.05);
            let (mut alone, mut beside) = (vec![0.0; x.len()], vec![0.0; x.len()]);
            assert!(term.evaluate(&x));
            term.add_rows(0, &mut alone);
            let (finite, energy) = term.evaluate_with_energy(&x);
            term.add_rows(0, &mut beside);
            assert!(finite && alone == beside);
            let pair = |i: usize, j: usize| {
                let r2: f64 = (0..3).map(|c| (x[3 * i + c] - x[3 * j + c]).powi(2)).sum();
                mass[i] * mass[j] / (r2 + 0.05 * 0.05).sqrt()
            };
            let sum: f64 =
                (0..count).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| pair(i, j)).sum();
            let relative = |value: f64| (value / (-0.7 * sum) - 1.0).abs();
            // Half a million terms of one sign, added in blocks: far below the bound of n units in the
            // last place.
            assert!(relative(energy.unwrap()) < 1e-13 && relative(term.energy(&x)) < 1e-13);
        }
    }
}
