//! All springs of a term in one layout: loops over its vertices, on one thread or several.

use rayon::prelude::*;

use super::kernels::{SpringBlocks, SpringEnergyKernel, SpringGradientKernel, SpringHessianKernel};
use super::neighbours::Neighbours;
use super::slots::{Slots, is_first_end};
use crate::lanes::{Aligned, WIDTH, dispatch};

/// Blocks of `WIDTH` vertices that one task takes.
const TASK_BLOCKS: usize = 128;

/// Number of tasks, of some 8 microseconds each, below which other threads cost about what they save.
const PARALLEL_FROM_TASKS: usize = 3;

/// One row for each vertex of a block.
type Rows<const D: usize> = [[f64; D]; WIDTH];

/// Springs in a layout, with the memory for their sums.
/// Every vertex adds up its own springs, in the order of its slots. Nothing is scattered, a tension is
/// bit-identical at both ends of its spring on every thread, and no sum depends on the number of threads.
/// same bits at both ends of its spring on every thread, and no sum depends on the number of threads.
pub(super) struct Arrangement<const D: usize, N: Neighbours<D>> {
    neighbours: N,
    slots: Slots,
    /// Positions of the last evaluation.
    position: N::Field,
    /// Direction of a product with the Hessian, after the first product.
    direction: Option<N::Field>,
    /// Last evaluated gradient, block by block, a row of `D` for each vertex.
    gradient: Aligned,
    /// Tensions, one buffer for every task of an evaluation.
    tensions: Vec<N::Tensions>,
    /// Energy of every task.
    parts: Vec<f64>,
}

impl<const D: usize, N: Neighbours<D>> Arrangement<D, N> {
    /// Creates an arrangement from the other ends of springs and their constants.
    pub(super) fn new((neighbours, slots): (N, Slots)) -> Self {
        Arrangement {
            parts: vec![0.0; slots.blocks().div_ceil(TASK_BLOCKS)],
            gradient: Aligned::packs(D * slots.blocks()),
            tensions: vec![neighbours.tensions()],
            position: neighbours.field(),
            direction: None,
            neighbours,
            slots,
        }
    }

    /// True if several threads pay.
    fn in_parallel(&self) -> bool {
        self.parts.len() >= PARALLEL_FROM_TASKS && rayon::current_num_threads() > 1
    }

    /// Returns `count` blocks from block `first` on.
    fn blocks(&self, first: usize, count: usize) -> SpringBlocks<'_, D, N> {
        let Arrangement { neighbours, slots, position, .. } = self;
        SpringBlocks { neighbours, slots, position, blocks: first..first + count }
    }

    /// Evaluates the gradient at `x`, the rows from the first to the last vertex. Returns true if it is
    /// finite.
    pub(super) fn evaluate(&mut self, x: &[f64]) -> bool {
        self.neighbours.copy(x, &mut self.position);
        let mut gradient = std::mem::take(&mut self.gradient);
        let mut tensions = std::mem::take(&mut self.tensions);
        let rows = gradient.as_chunks_mut::<D>().0.as_chunks_mut::<WIDTH>().0;
        let per_task = match self.in_parallel() {
            true => self.neighbours.fewest_blocks().max(TASK_BLOCKS),
            false => rows.len().max(1),
        };
        // Only once: a step allocates nothing after the first.
        tensions
            .resize_with(tensions.len().max(rows.len().div_ceil(per_task)), || self.neighbours.tensions());
        let run = |((task, out), tensions): ((usize, &mut [Rows<D>]), &mut N::Tensions)| {
            dispatch(SpringGradientKernel { of: self.blocks(task * per_task, out.len()), tensions, out })
        };
        let finite = if self.in_parallel() {
            let tasks = rows.par_chunks_mut(per_task).enumerate().zip(&mut tensions);
            tasks.map(run).reduce(|| true, |a, b| a & b)
        } else {
            rows.chunks_mut(per_task).enumerate().zip(&mut tensions).map(run).fold(true, |a, b| a & b)
        };
        (self.gradient, self.tensions) = (gradient, tensions);
        finite
    }

    /// Returns the last evaluated gradient, flat, from the first to the last vertex.
    pub(super) fn gradient(&self) -> &[f64] {
        &self.gradient
    }

    /// Returns the energy at `x`.
    pub(super) fn energy(&mut self, x: &[f64]) -> f64 {
        self.neighbours.copy(x, &mut self.position);
        let in_parallel = self.in_parallel();
        let mut parts = std::mem::take(&mut self.parts);
        let run = |(task, part): (usize, &mut f64)| {
            let left = self.slots.blocks() - task * TASK_BLOCKS;
            *part = dispatch(SpringEnergyKernel(self.blocks(task * TASK_BLOCKS, left.min(TASK_BLOCKS))));
        };
        if in_parallel {
            parts.par_iter_mut().enumerate().for_each(run);
        } else {
            parts.iter_mut().enumerate().for_each(run);
        }
        self.parts = parts;
        self.parts.iter().sum()
    }

    /// Adds the product of the Hessian at `x` and `p` to `y`.
    pub(super) fn add_hessian_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) {
        self.neighbours.copy(x, &mut self.position);
        // Taken out while the tasks borrow the rest.
        let mut direction = self.direction.take().unwrap_or_else(|| self.neighbours.field());
        self.neighbours.copy(p, &mut direction);
        let run = |(task, out): (usize, &mut [[f64; D]])| {
            let of = self.blocks(task * TASK_BLOCKS, out.len().div_ceil(WIDTH));
            dispatch(SpringHessianKernel { of, direction: &direction, out });
        };
        let rows = y.as_chunks_mut().0;
        if self.in_parallel() {
            rows.par_chunks_mut(TASK_BLOCKS * WIDTH).enumerate().for_each(run);
        } else {
            rows.chunks_mut(TASK_BLOCKS * WIDTH).enumerate().for_each(run);
        }
        self.direction = Some(direction);
    }

    /// Returns every spring: its index, its ends counted from the first vertex, stiffness [N/m] and rest
    /// length [m].
    pub(super) fn springs(&self) -> impl Iterator<Item = (u32, [usize; 2], f64, f64)> {
        let ends = (0..self.slots.blocks()).flat_map(move |block| {
            self.slots.of(block).flat_map(move |slot| {
                (0..WIDTH).filter_map(move |lane| {
                    let own = block * WIDTH + lane;
                    let other = self.neighbours.neighbour(block, slot, lane)?;
                    is_first_end(own, other).then(|| ([own, other], self.slots.constants(slot, lane)))
                })
            })
        });
        ends.zip(self.slots.springs()).map(|((ends, (k, rest)), spring)| (*spring, ends, k, rest))
    }
}
