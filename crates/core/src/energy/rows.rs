//! Bulk processing of vertex rows: groups of adjacent rows, and their transfer out of scratch memory.

use crate::lanes::{Kernel, Lanes, WIDTH};

/// Consecutive vertices with consecutive rows. One entry replaces many indices: rows of a patch follow its
/// vertices in ascending order, so that neighbours in a well-numbered mesh mostly come in runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct IndexRun {
    /// First vertex.
    pub(super) vertex: u32,
    /// First row.
    pub(super) row: u32,
    /// Number of vertices.
    pub(super) count: u32,
}

impl IndexRun {
    /// Splits these ascending vertices into runs, with rows counted from `row`; no run crosses a multiple of
    /// `longest`.
    pub(super) fn of(vertices: &[u32], row: usize, longest: u32) -> impl Iterator<Item = IndexRun> {
        let mut row = row as u32;
        vertices.chunk_by(move |a, b| b - a == 1 && b % longest != 0).map(move |run| {
            let count = run.len() as u32;
            row += count;
            IndexRun { vertex: run[0], row: row - count, count }
        })
    }
}

/// Copies numbers and returns whether all are finite.
pub(super) struct CopyKernel<'a> {
    pub(super) from: &'a [f64],
    pub(super) to: &'a mut [f64],
}

impl Kernel for CopyKernel<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<L: Lanes>(self) -> bool {
        let (from, from_rest) = self.from.as_chunks::<WIDTH>();
        let (to, to_rest) = self.to.as_chunks_mut::<WIDTH>();
        // Zero times a finite number is zero, times any other NaN.
        let mut sum = L::zero();
        for (from, to) in from.iter().zip(to) {
            let numbers = L::load(from);
            numbers.store(to);
            sum = L::zero().mul_add(numbers, sum);
        }
        let mut sum = sum.horizontal_sum();
        for (from, to) in from_rest.iter().zip(to_rest) {
            *to = *from;
            sum += 0.0 * from;
        }
        sum == 0.0
    }
}

/// Adds `from` to `to`.
pub(super) struct Add<'a> {
    pub(super) from: &'a [f64],
    pub(super) to: &'a mut [f64],
}

impl Kernel for Add<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let (from, from_rest) = self.from.as_chunks::<WIDTH>();
        let (to, to_rest) = self.to.as_chunks_mut::<WIDTH>();
        for (from, to) in from.iter().zip(to) {
            (L::load(to) + L::load(from)).store(to);
        }
        for (from, to) in from_rest.iter().zip(to_rest) {
            *to += from;
        }
    }
}
