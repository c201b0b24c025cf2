//! Newtonian gravity by a tree code (Barnes-Hut): distant groups of particles act as a whole.

mod kernels;
mod list;
mod octree;

use std::marker::PhantomData;

use rayon::prelude::*;

use super::{EnergyKind, EnergyTerm, Fault, Measurements, TermProperties, TermViews, coincident, gather};
use crate::lanes::{WIDTH, dispatch, dispatch_compact};
use kernels::{Derivative, Force, Law, ListKernel, Potential};
use list::List;
use octree::Octree;

/// Particles per task.
const PARTICLES_PER_TASK: usize = 256;
const MAX_TASKS: usize = 64;
/// Number of particles whose force is compared with the direct sum.
const SAMPLES: usize = 256;

/// Groups of particles, and memory for their lists and sums.
#[derive(Default)]
struct TreeTask<const D: usize> {
    /// Range of groups.
    groups: std::ops::Range<usize>,
    list: List<D>,
    sums: Vec<[f64; D]>,
    potential: Vec<[f64; 1]>,
    energy: f64,
}

/// Tree approximation of the energy of [`NBody`](super::NBody), in `O(N log N)` time.
///
/// The method is that of Barnes, Hut 1986, *Nature* 324. The tree is traversed once for each group of
/// neighbouring particles. Boxes seen under less than the opening angle act by their mass and quadrupole
/// moment about their centre of mass; others are opened, down to single particles. In the limit of a zero
/// opening angle the result is the direct sum.
///
/// Forces between two particles are not exactly opposite, because one may interact with a box that
/// contains the other. The total momentum therefore drifts by the error of the force. So does the energy,
/// because the force is its gradient only up to that error. [`force_error`](Self::force_error) measures
/// the error.
///
/// The tree depends only on the positions, and each particle's sum only on its list: the result is
/// bit-identical for any number of threads.
pub struct TreeGravity<const D: usize> {
    vertices: Vec<u32>,
    mass: Vec<f64>,
    constant: f64,
    softening2: f64,
    opening_angle: f64,
    /// Positions that the tree was built for.
    position: Vec<[f64; D]>,
    next_position: Vec<[f64; D]>,
    tree: Octree<D>,
    tasks: Vec<TreeTask<D>>,
    /// Gradient of each particle.
    gradient: Vec<[f64; D]>,
}

/// Error of the forces on a sample of particles, against the sum over all others.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct ForceError {
    /// Particles in the sample, evenly spread over their numbering.
    pub samples: usize,
    /// Root of the mean square of `|f - f_direct| / |f_direct|`.
    pub relative_rms: f64,
    /// Largest of these relative errors.
    pub relative_max: f64,
}

impl<const D: usize> TreeGravity<D> {
    /// Creates the attraction with constant `constant` [m^3/(kg s^2)] and softening length `softening`
    /// [m] between `vertices` of masses `mass` [kg] (one per listed vertex), by a tree with this opening
    /// angle [rad] in (0, 1].
    ///
    /// # Panics
    /// If the vertices are not listed in ascending order, or the opening angle is not in (0, 1].
    pub fn new(
        vertices: Vec<u32>,
        mass: Vec<f64>,
        constant: f64,
        softening: f64,
        opening_angle: f64,
    ) -> Self {
        assert!(vertices.is_sorted(), "vertices in ascending order");
        assert!(opening_angle > 0.0 && opening_angle <= 1.0, "an opening angle in (0, 1]");
        let tasks = (vertices.len() / PARTICLES_PER_TASK).clamp(1, MAX_TASKS);
        TreeGravity {
            gradient: vec![[0.0; D]; vertices.len()],
            vertices,
            mass,
            constant,
            softening2: softening * softening,
            opening_angle,
            position: vec![],
            next_position: vec![],
            tree: Octree::default(),
            tasks: (0..tasks).map(|_| TreeTask::default()).collect(),
        }
    }

    /// Builds the tree for `x`, unless it is up to date.
    fn build(&mut self, x: &[f64]) {
        gather(&mut self.next_position, &self.vertices, x);
        if self.next_position == self.position {
            return;
        }
        std::mem::swap(&mut self.position, &mut self.next_position);
        self.tree.build(&self.position, &self.mass, self.opening_angle);
        // Tasks with about equal numbers of particles.
        let (groups, count) = (&self.tree.groups, self.tasks.len());
        let begin = |k: usize| {
            groups.partition_point(|&g| self.tree.nodes[g].begin < k * self.vertices.len() / count)
        };
        for (k, task) in self.tasks.iter_mut().enumerate() {
            task.groups = begin(k)..begin(k + 1);
        }
    }

    /// Runs `work` on all tasks.
    fn for_each_task(&mut self, work: impl Fn(&Self, &mut TreeTask<D>) + Sync) {
        let mut tasks = std::mem::take(&mut self.tasks);
        if tasks.len() == 1 {
            tasks.iter_mut().for_each(|task| work(self, task));
        } else {
            tasks.par_iter_mut().for_each(|task| work(self, task));
        }
        self.tasks = tasks;
    }

    /// Returns the kernel of a law for the particles `range` of the tree's order.
    fn kernel<'a, Q: Law<D, N>, const N: usize>(
        &'a self,
        list: &'a List<D>,
        range: std::ops::Range<usize>,
        first: usize,
        out: &'a mut [[f64; N]],
    ) -> ListKernel<'a, Q, D, N> {
        let position = &self.tree.position[range.clone()];
        let direction = if Q::DIRECTED { &self.tree.direction[range] } else { position };
        ListKernel { law: PhantomData, position, direction, list, first, softening2: self.softening2, out }
    }

    /// Sums a vector over the list of every particle and stores it, times `G m`, in `gradient`. Returns
    /// true if all sums are finite.
    fn sum_vectors<Q: Law<D, D>>(&mut self, run: impl Fn(ListKernel<'_, Q, D, D>) + Sync) -> bool {
        self.for_each_task(|this, task| {
            task.sums.clear();
            for &group in &this.tree.groups[task.groups.clone()] {
                let range = this.tree.nodes[group].begin..this.tree.nodes[group].end;
                task.list.collect(&this.tree, group, Q::DIRECTED);
                let begin = task.sums.len();
                task.sums.resize(begin + range.len(), [0.0; D]);
                run(this.kernel(&task.list, range, 0, &mut task.sums[begin..]));
            }
        });
        let sums = self.tasks.iter().flat_map(|task| &task.sums);
        let mut zero = 0.0;
        for (sum, &i) in sums.zip(&self.tree.order) {
            let factor = self.constant * self.mass[i as usize];
            self.gradient[i as usize] = sum.map(|s| factor * s);
            // Zero times a finite number is zero, times any other NaN.
            zero += sum.iter().map(|s| 0.0 * s).sum::<f64>();
        }
        zero == 0.0
    }

    /// Compares the force at `x` with the direct sum, for a few hundred particles.
    pub fn force_error(&mut self, x: &[f64]) -> ForceError {
        self.evaluate(x);
        let n = self.vertices.len();
        let samples = SAMPLES.min(n);
        let mut all = List::default();
        all.collect_all(&self.tree);
        let (mut square, mut largest) = (0.0, 0.0f64);
        for k in 0..samples {
            // Index in the order of the tree, so that samples are spread over space.
            let place = k * n / samples;
            let mut direct = [[0.0; D]];
            // A kernel begins with a full pack.
            let first = place - place % WIDTH;
            let mut round = [[0.0; D]; WIDTH];
            let count = place - first + 1;
            dispatch(self.kernel::<Force, D>(&all, first..place + 1, first, &mut round[..count]));
            direct[0] = round[count - 1];
            let i = self.tree.order[place] as usize;
            let factor = self.constant * self.mass[i];
            let (mut error2, mut force2) = (0.0, 0.0);
            for c in 0..D {
                let force = factor * direct[0][c];
                error2 += (self.gradient[i][c] - force).powi(2);
                force2 += force * force;
            }
            let relative2 = if error2 == 0.0 { 0.0 } else { error2 / force2 };
            square += relative2;
            largest = largest.max(relative2.sqrt());
        }
        ForceError { samples, relative_rms: (square / samples.max(1) as f64).sqrt(), relative_max: largest }
    }
}

impl<const D: usize> EnergyTerm for TreeGravity<D> {
    fn name(&self) -> String {
        format!("mutual gravity of {} particles by a tree", self.vertices.len())
    }

    fn properties(&self) -> TermProperties {
        let gravity = TermProperties::of(EnergyKind::Gravitational);
        TermProperties { couples_all: true, approximates: true, ..gravity }
    }

    fn energy(&mut self, x: &[f64]) -> f64 {
        self.build(x);
        self.for_each_task(|this, task| {
            task.energy = 0.0;
            for &group in &this.tree.groups[task.groups.clone()] {
                let range = this.tree.nodes[group].begin..this.tree.nodes[group].end;
                task.list.collect(&this.tree, group, false);
                task.potential.clear();
                task.potential.resize(range.len(), [0.0]);
                dispatch_compact(this.kernel::<Potential, 1>(
                    &task.list,
                    range.clone(),
                    0,
                    &mut task.potential,
                ));
                let mass = &this.tree.mass[range];
                task.energy += task.potential.iter().zip(mass).map(|([p], m)| m * p).sum::<f64>();
            }
        });
        // Every pair was counted from both sides.
        -0.5 * self.constant * self.tasks.iter().map(|t| t.energy).sum::<f64>()
    }

    fn evaluate(&mut self, x: &[f64]) -> bool {
        self.build(x);
        self.sum_vectors::<Force>(|kernel| dispatch(kernel))
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        let end = first + g.len() / D;
        let start = self.vertices.partition_point(|&v| (v as usize) < first);
        for (&v, gradient) in self.vertices[start..].iter().zip(&self.gradient[start..]) {
            if v as usize >= end {
                break;
            }
            let row = (v as usize - first) * D;
            for c in 0..D {
                g[row + c] += gradient[c];
            }
        }
    }

    /// Adds approximate products: boxes that act as a whole use only their mass and move with the mean of
    /// their particles. The largest eigenvalue comes from close neighbours; its error is of the size of
    /// the force's (for 20,000 particles in a disk, at 0.5: one part in a thousand).
    fn add_hessian_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) {
        self.build(x);
        let mut direction = std::mem::take(&mut self.next_position);
        gather(&mut direction, &self.vertices, p);
        self.tree.set_direction(&direction);
        self.next_position = direction;
        self.sum_vectors::<Derivative>(|kernel| dispatch_compact(kernel));
        self.add_rows(0, y);
    }

    fn fault(&self, x: &[f64]) -> Option<Fault> {
        coincident::<D>(&self.vertices, self.softening2, x)
    }
}

impl<const D: usize> TermViews for TreeGravity<D> {
    fn measurements(&mut self) -> Option<&mut dyn Measurements> {
        Some(self)
    }
}

impl<const D: usize> Measurements for TreeGravity<D> {
    fn add_stiffness_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) -> bool {
        self.add_hessian_product(x, p, y);
        true
    }
}

#[cfg(test)]
mod tests;
