//! Kernels over eight vertices at a time, for any layout of their springs.

use std::ops::Range;

use super::neighbours::Neighbours;
use super::slots::Slots;
use crate::lanes::{Kernel, Lanes, WIDTH};
use crate::scalar::Compared;

/// Keeps the reciprocal of a length finite; no realistic spring is as short.
const TINY: f64 = 1e-300;

/// Blocks of vertices with their springs and positions.
pub(super) struct SpringBlocks<'a, const D: usize, N: Neighbours<D>> {
    pub(super) neighbours: &'a N,
    pub(super) slots: &'a Slots,
    pub(super) position: &'a N::Field,
    pub(super) blocks: Range<usize>,
}

/// Returns the squared length of a vector in every lane.
#[inline(always)]
fn square<L: Lanes, const D: usize>(d: &[L; D]) -> L {
    let mut sum = d[0] * d[0];
    for c in 1..D {
        sum = d[c].mul_add(d[c], sum);
    }
    sum
}

/// Returns `k (l - l0) / l` [N/m], the force of a spring divided by the difference `d` of its ends.
#[inline(always)]
pub(super) fn tension<L: Lanes, const D: usize>((stiffness, rest_length): (L, L), d: &[L; D]) -> L {
    let l = Compared::max(square(d), L::splat(TINY)).sqrt();
    stiffness * ((l - rest_length) / l)
}

/// Writes the gradient on the vertices of each block to a row of `out`; returns true if all of it is
/// finite.
pub(super) struct SpringGradientKernel<'a, const D: usize, N: Neighbours<D>> {
    pub(super) of: SpringBlocks<'a, D, N>,
    pub(super) tensions: &'a mut N::Tensions,
    pub(super) out: &'a mut [[[f64; D]; WIDTH]],
}

impl<const D: usize, N: Neighbours<D>> Kernel for SpringGradientKernel<'_, D, N> {
    type Output = bool;

    #[inline(always)]
    fn run<L: Lanes>(self) -> bool {
        let SpringBlocks { neighbours, slots, position, blocks } = self.of;
        let zero: L = neighbours.gradient(slots, position, self.tensions, blocks, self.out);
        zero.horizontal_sum() == 0.0
    }
}

/// Sums the energy of the springs, half of each at either end.
pub(super) struct SpringEnergyKernel<'a, const D: usize, N: Neighbours<D>>(pub(super) SpringBlocks<'a, D, N>);

impl<const D: usize, N: Neighbours<D>> Kernel for SpringEnergyKernel<'_, D, N> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f64 {
        let SpringBlocks { neighbours, slots, position, blocks } = self.0;
        let mut sum = L::zero();
        for block in blocks {
            let own: [L; D] = neighbours.own(position, block);
            for slot in slots.of(block) {
                let d = neighbours.difference(position, &own, block, slot);
                let stretch = square(&d).sqrt() - slots.rest_length(slot);
                sum = (slots.stiffness::<L>(slot) * stretch).mul_add(stretch, sum);
            }
        }
        // Every spring was counted twice.
        0.25 * sum.horizontal_sum()
    }
}

/// Adds `H p` of the vertices of each block to its rows of `out`, which may end within the last block.
///
/// `H = k [n n^T + (1 - l0/l) (I - n n^T)]` on the difference of the two ends (verified against differences).
pub(super) struct SpringHessianKernel<'a, const D: usize, N: Neighbours<D>> {
    pub(super) of: SpringBlocks<'a, D, N>,
    pub(super) direction: &'a N::Field,
    pub(super) out: &'a mut [[f64; D]],
}

impl<const D: usize, N: Neighbours<D>> Kernel for SpringHessianKernel<'_, D, N> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let SpringBlocks { neighbours, slots, position, blocks } = self.of;
        for (block, out) in blocks.zip(self.out.chunks_mut(WIDTH)) {
            let own: [L; D] = neighbours.own(position, block);
            let own_p: [L; D] = neighbours.own(self.direction, block);
            let mut y = [L::zero(); D];
            for slot in slots.of(block) {
                let d = neighbours.difference(position, &own, block, slot);
                let dp = neighbours.difference(self.direction, &own_p, block, slot);
                let l = Compared::max(square(&d), L::splat(TINY)).sqrt();
                let reciprocal = L::one() / l;
                let mut n = d;
                let mut along = L::zero();
                for c in 0..D {
                    n[c] = d[c] * reciprocal;
                    along = n[c].mul_add(dp[c], along);
                }
                let k = slots.stiffness::<L>(slot);
                // (l - l0) / l
                let across = (l - slots.rest_length(slot)) * reciprocal;
                for c in 0..D {
                    let sideways = dp[c] - n[c] * along;
                    y[c] = k.mul_add(n[c].mul_add(along, across * sideways), y[c]);
                }
            }
            let mut rows = [[0.0; D]; WIDTH];
            L::store_interleaved(y, &mut rows);
            for (out, row) in out.as_flattened_mut().iter_mut().zip(rows.as_flattened()) {
                *out += row;
            }
        }
    }
}
