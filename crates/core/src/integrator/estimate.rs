//! Local error estimates: the embedded companion method of a tableau, and the error norm relative to
//! tolerances.

use std::ops::Range;

use rayon::prelude::*;

use crate::system::System;

/// Vertices per block.
const BLOCK: usize = 128;
/// Number of blocks from which threads share the work.
const PARALLEL_BLOCKS: usize = 64;

/// Companion method on the same stages. The difference of the two results estimates the local error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Companion {
    /// Weights of the method minus those of its companion, `d_i = b_i - b^_i`.
    pub difference: &'static [f64],
    /// Order of the companion.
    pub order: u32,
}

/// Error tolerances of a step.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Tolerances {
    /// Position tolerance [m].
    pub position: f64,
    /// Absolute velocity tolerance [m/s].
    pub velocity: f64,
    /// Relative velocity tolerance, as a fraction of the speed of each vertex.
    pub relative: f64,
}

/// Error estimate or step criterion of an integrator for the step it has taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Judgement {
    /// Norm of the estimated error relative to the tolerances; at most 1 is allowed.
    Error(f64),
    /// Step size [s] that the method's own criterion would have taken.
    Step(f64),
    /// Matrices of a static increment, or iterations if none was assembled; a static increment has no
    /// error in time.
    Matrices(u64),
}

/// Scratch memory of the error norm.
#[derive(Default)]
pub(crate) struct ErrorNorm {
    /// Sum and number of free vertices of each block.
    blocks: Vec<(f64, u32)>,
}

impl ErrorNorm {
    /// Allocates the norm for `unknowns` coordinates.
    pub(crate) fn new(unknowns: usize) -> Self {
        ErrorNorm { blocks: Vec::with_capacity(unknowns.div_ceil(BLOCK)) }
    }

    /// Computes `sqrt(1/(2n) sum_i (|e_x|^2 / s_x^2 + |e_v|^2 / s_v^2))` over the `n` vertices with a
    /// free coordinate, with `s_x = position` and `s_v = velocity + relative max(|v_before|, |v_after|)`
    /// for each vertex; Hairer, Norsett, Wanner 1993, *Solving Ordinary Differential Equations I*, eq.
    /// II.4.11, with vectors instead of components.
    ///
    /// `errors` writes the errors of positions [m] and velocities [m/s] for a range of the flat arrays.
    /// Blocks are added in order, so the result does not depend on the number of threads.
    pub(crate) fn of(
        &mut self,
        system: &System,
        tolerances: &Tolerances,
        before: &[f64],
        after: &[f64],
        errors: impl Fn(Range<usize>, &mut [f64], &mut [f64]) + Sync,
    ) -> f64 {
        let (d, free) = (system.dimension(), system.inverse_mass());
        let per_block = BLOCK * d;
        let count = before.len().div_ceil(per_block);
        // Error sum of one block of vertices, constrained coordinates masked.
        let block = |i: usize| {
            let range = i * per_block..before.len().min((i + 1) * per_block);
            let (mut x, mut v) = ([0.0; 3 * BLOCK], [0.0; 3 * BLOCK]);
            let (x, v) = (&mut x[..range.len()], &mut v[..range.len()]);
            errors(range.clone(), x, v);
            let (mut sum, mut vertices) = (0.0, 0);
            for (row, at) in range.step_by(d).enumerate() {
                let square = |a: &[f64]| a.iter().map(|a| a * a).sum::<f64>();
                let masked = |e: &[f64]| {
                    let free = free[at..at + d].iter();
                    e[row * d..][..d].iter().zip(free).map(|(e, w)| if *w == 0.0 { 0.0 } else { e * e }).sum()
                };
                if free[at..at + d].iter().all(|w| *w == 0.0) {
                    continue;
                }
                let speed = square(&before[at..at + d]).max(square(&after[at..at + d])).sqrt();
                let allowed = tolerances.velocity + tolerances.relative * speed;
                sum += over(masked(x), tolerances.position) + over(masked(v), allowed);
                vertices += 1;
            }
            (sum, vertices)
        };
        // All blocks, on several threads if there are enough; then their sum in order.
        self.blocks.clear();
        if count < PARALLEL_BLOCKS {
            self.blocks.extend((0..count).map(block));
        } else {
            self.blocks.resize(count, (0.0, 0));
            self.blocks.par_iter_mut().enumerate().for_each(|(i, sum)| *sum = block(i));
        }
        let (sum, vertices) = self.blocks.iter().fold((0.0, 0), |(s, n), (sum, count)| (s + sum, n + count));
        if vertices == 0 { 0.0 } else { (sum / (2.0 * f64::from(vertices))).sqrt() }
    }
}

/// Squared error over the squared tolerance; zero error passes a zero tolerance.
fn over(square: f64, allowed: f64) -> f64 {
    if square == 0.0 { 0.0 } else { square / (allowed * allowed) }
}
