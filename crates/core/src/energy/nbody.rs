//! Newtonian attraction between all pairs of particles.

use rayon::prelude::*;

use super::{EnergyKind, EnergyTerm, Fault};

/// Particles are dealt out to this many groups of rows, whatever the number of threads; each group sums into its own
/// array and the arrays are added in order, so that the result has the same bits on any machine.
const GROUPS: usize = 16;

/// Below this many particles a hand-over to other threads costs more than it saves (about 50 microseconds of work).
const PARALLEL_FROM: usize = 512;

/// `E = -G sum_{i<j} m_i m_j / sqrt(|x_i - x_j|^2 + softening^2)` over a contiguous set of vertices (lecture 8);
/// Plummer softening, Aarseth 2003, *Gravitational N-Body Simulations*, eq. 2.3.
///
/// Each pair is computed once, its two forces equal and opposite to the last bit.
pub struct NBody<const D: usize> {
    vertices: Vec<u32>,
    mass: Vec<f64>,
    constant: f64,
    softening2: f64,
    /// `GROUPS` arrays of gradients, rows of D; one array where there are few particles.
    partial: Vec<Vec<[f64; D]>>,
    position: Vec<[f64; D]>,
}

impl<const D: usize> NBody<D> {
    /// Attraction with constant `constant` [m^3/(kg s^2)] and softening length `softening` [m] between `vertices` of
    /// masses `mass` [kg] (one per listed vertex).
    pub fn new(vertices: Vec<u32>, mass: Vec<f64>, constant: f64, softening: f64) -> Self {
        let n = vertices.len();
        let groups = if n < PARALLEL_FROM { 1 } else { GROUPS };
        NBody {
            position: vec![[0.0; D]; n],
            partial: vec![vec![[0.0; D]; n]; groups],
            vertices,
            mass,
            constant,
            softening2: softening * softening,
        }
    }

    /// Rows of group `group`: dealt out round robin, because row `i` has `n - i - 1` pairs.
    fn rows(&self, group: usize, groups: usize) -> impl Iterator<Item = usize> + use<D> {
        (group..self.vertices.len()).step_by(groups)
    }

    fn load(&mut self, x: &[f64]) {
        for (row, &i) in self.position.iter_mut().zip(&self.vertices) {
            row.copy_from_slice(&x[i as usize * D..i as usize * D + D]);
        }
    }
}

/// Difference and softened squared distance of two points.
#[inline(always)]
fn separation<const D: usize>(a: &[f64; D], b: &[f64; D], softening2: f64) -> ([f64; D], f64) {
    let mut d = [0.0; D];
    let mut r2 = softening2;
    for k in 0..D {
        d[k] = a[k] - b[k];
        r2 += d[k] * d[k];
    }
    (d, r2)
}

impl<const D: usize> EnergyTerm for NBody<D> {
    fn name(&self) -> String {
        format!("mutual gravity of {} particles", self.vertices.len())
    }

    fn kind(&self) -> EnergyKind {
        EnergyKind::Gravitational
    }

    fn energy(&mut self, x: &[f64]) -> f64 {
        self.load(x);
        let this = &*self;
        let groups = this.partial.len();
        let group_energy = |group: usize| -> f64 {
            let mut e = 0.0;
            for i in this.rows(group, groups) {
                for j in i + 1..this.vertices.len() {
                    let (_, r2) = separation(&this.position[i], &this.position[j], this.softening2);
                    e -= this.constant * this.mass[i] * this.mass[j] / r2.sqrt();
                }
            }
            e
        };
        let parts: Vec<f64> = (0..groups).into_par_iter().map(group_energy).collect();
        parts.iter().sum()
    }

    fn add_gradient(&mut self, x: &[f64], g: &mut [f64]) {
        self.load(x);
        let mut partial = std::mem::take(&mut self.partial);
        let this = &*self;
        let groups = partial.len();
        let fill = |(group, out): (usize, &mut Vec<[f64; D]>)| {
            out.fill([0.0; D]);
            for i in this.rows(group, groups) {
                let mut own = [0.0; D];
                let (before, after) = out.split_at_mut(i + 1);
                for (k, other) in after.iter_mut().enumerate() {
                    let j = i + 1 + k;
                    let (d, r2) = separation(&this.position[i], &this.position[j], this.softening2);
                    let s = this.constant * this.mass[i] * this.mass[j] / (r2 * r2.sqrt());
                    for c in 0..D {
                        own[c] += s * d[c];
                        other[c] -= s * d[c];
                    }
                }
                for c in 0..D {
                    before[i][c] += own[c];
                }
            }
        };
        if groups == 1 {
            partial.iter_mut().enumerate().for_each(fill);
        } else {
            partial.par_iter_mut().enumerate().for_each(fill);
        }
        for (row, &i) in self.vertices.iter().enumerate() {
            for c in 0..D {
                let mut sum = 0.0;
                for part in &partial {
                    sum += part[row][c];
                }
                g[i as usize * D + c] += sum;
            }
        }
        self.partial = partial;
    }

    fn add_hessian_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) {
        let n = self.vertices.len();
        let row = |i: usize| self.vertices[i] as usize * D;
        for i in 0..n {
            for j in i + 1..n {
                let (a, b) = (row(i), row(j));
                let (mut xa, mut xb) = ([0.0; D], [0.0; D]);
                xa.copy_from_slice(&x[a..a + D]);
                xb.copy_from_slice(&x[b..b + D]);
                let (d, r2) = separation(&xa, &xb, self.softening2);
                let s = self.constant * self.mass[i] * self.mass[j] / (r2 * r2.sqrt());
                let mut along = 0.0;
                for c in 0..D {
                    along += d[c] * (p[a + c] - p[b + c]);
                }
                for c in 0..D {
                    let q = s * ((p[a + c] - p[b + c]) - 3.0 * along / r2 * d[c]);
                    y[a + c] += q;
                    y[b + c] -= q;
                }
            }
        }
    }

    fn fault(&self, x: &[f64]) -> Option<Fault> {
        if self.softening2 > 0.0 {
            return None;
        }
        // Sorted, equal positions are neighbours.
        let row = |i: u32| &x[i as usize * D..i as usize * D + D];
        let mut order = self.vertices.clone();
        order.sort_by(|&a, &b| {
            let by_component = row(a).iter().zip(row(b)).map(|(a, b)| a.total_cmp(b));
            by_component.fold(std::cmp::Ordering::Equal, |o, c| o.then(c))
        });
        let pair = order.windows(2).find(|w| row(w[0]) == row(w[1]))?;
        let (first, second) = (pair[0].min(pair[1]) as usize, pair[0].max(pair[1]) as usize);
        Some(Fault::Pair { first, second })
    }

    fn bytes(&self) -> usize {
        self.vertices.len() * (4 + 8 + 8 * D * (1 + self.partial.len()))
    }
}
