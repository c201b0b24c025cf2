//! Interface of the kernels to a layout: lookup of the other ends of springs.

use std::ops::Range;

use super::slots::Slots;
use crate::lanes::{Lanes, WIDTH};

/// Vertices copied per task: few enough to stay in the L2 cache.
pub(super) const COPIED_AT_ONCE: usize = 2048;

/// Other ends of the springs in every slot.
pub(super) trait Neighbours<const D: usize>: Send + Sync {
    /// Copy of one vector per vertex, positions or displacements, laid out for loads.
    type Field: Send + Sync;
    /// Memory for tensions that one end of a spring computes and the other reads; one for every task.
    type Tensions: Send + Sync;

    /// Creates a field of zeros.
    fn field(&self) -> Self::Field;

    /// Creates the memory for tensions.
    fn tensions(&self) -> Self::Tensions;

    /// Copies the rows of the vertices from the first to the last with springs, flat `(n, D)`.
    fn copy(&self, x: &[f64], field: &mut Self::Field);

    /// Returns the vectors of the vertices of a block.
    fn own<L: Lanes>(&self, field: &Self::Field, block: usize) -> [L; D];

    /// Returns `own` minus the vectors of the other ends; zero in lanes without a spring (if `own` is
    /// finite).
    fn difference<L: Lanes>(&self, field: &Self::Field, own: &[L; D], block: usize, slot: usize) -> [L; D];

    /// Returns the least number of blocks of a task. In shorter tasks [`gradient`](Self::gradient) does
    /// not pay, because it also processes blocks before the first.
    fn fewest_blocks(&self) -> usize;

    /// Writes the gradient on the vertices of each block to a row of `out`. Returns zero in every lane,
    /// or NaN if something is not finite.
    fn gradient<L: Lanes>(
        &self,
        slots: &Slots,
        field: &Self::Field,
        tensions: &mut Self::Tensions,
        blocks: Range<usize>,
        out: &mut [[[f64; D]; WIDTH]],
    ) -> L;

    /// Returns the other end of the spring in a lane, counted from the first vertex; `None` without a
    /// spring.
    fn neighbour(&self, block: usize, slot: usize, lane: usize) -> Option<usize>;
}
