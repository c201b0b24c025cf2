//! Local errors: what an embedded method says of a step, and how large that is beside what is allowed.

use std::ops::Range;

use rayon::prelude::*;

use crate::system::System;

/// Vertices in a block.
const BLOCK: usize = 128;
/// Blocks from which on threads share the work.
const PARALLEL_BLOCKS: usize = 64;

/// A second method on the same stages: the difference of the two is an estimate of the local error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Companion {
    /// Weights of the method less those of its companion, `d_i = b_i - b^_i`.
    pub difference: &'static [f64],
    /// Order of the companion.
    pub order: u32,
}

/// The errors that a step may make.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Tolerances {
    /// Of positions [m].
    pub position: f64,
    /// Of velocities [m/s].
    pub velocity: f64,
    /// Of velocities, as a part of the speed of each vertex.
    pub relative: f64,
}

/// Error estimate of a scheme for the step it has taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Judgement {
    /// The norm of the estimated error; 1 is just allowed. Tolerances say what 1 is.
    Error(f64),
    /// The step [s] that its own criterion would have taken.
    Step(f64),
    /// Matrices that an increment of statics took, iterations where none is made: it has no error in time.
    Matrices(u64),
}

/// Memory of the norm.
#[derive(Default)]
pub(crate) struct ErrorNorm {
    /// Sum of each block, and how many vertices of it are free to move.
    blocks: Vec<(f64, u32)>,
}

impl ErrorNorm {
    /// Memory for `unknowns` coordinates.
    pub(crate) fn new(unknowns: usize) -> Self {
        ErrorNorm { blocks: Vec::with_capacity(unknowns.div_ceil(BLOCK)) }
    }

    /// `sqrt(1/(2n) sum_i (|e_x|^2 / s_x^2 + |e_v|^2 / s_v^2))` over the `n` vertices that are free along
    /// any axis, with `s_x = position` and `s_v = velocity + relative max(|v_before|, |v_after|)` of each;
    /// Hairer, Norsett, Wanner 1993, *Solving Ordinary Differential Equations I*, eq. II.4.11, with vectors
    /// in place of components.
    ///
    /// `errors` writes those of positions [m] and of velocities [m/s] of a range of the flat arrays. Blocks
    /// are added in their order: threads do not show in the bits.
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

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        self.blocks.capacity() * size_of::<(f64, u32)>()
    }
}

/// A squared error over what is allowed, squared; no error at all is allowed even where nothing is.
fn over(square: f64, allowed: f64) -> f64 {
    if square == 0.0 { 0.0 } else { square / (allowed * allowed) }
}
