//! Springs between vertices in no particular order: the other ends are gathered one by one.

use std::ops::Range;

use rayon::prelude::*;

use super::half_springs::HalfSprings;
use super::kernels::tension;
use super::neighbours::{COPIED_AT_ONCE, Neighbours};
use super::slots::Slots;
use crate::lanes::{Lanes, VertexRows, WIDTH, copy_points, with_room};

/// Other ends in every slot; a vertex itself in lanes without a spring.
#[derive(Debug)]
pub(super) struct GatheredNeighbours {
    vertices: usize,
    index: Vec<[u32; WIDTH]>,
}

impl GatheredNeighbours {
    /// Creates the other ends of these springs, and their constants.
    pub(super) fn new(half: &HalfSprings, stiffness: &[f64], rest_length: &[f64]) -> (Self, Slots) {
        let own = |block| -> [usize; WIDTH] { std::array::from_fn(|lane| block * WIDTH + lane) };
        let most = |block| own(block).map(|i| half.of(i).len()).into_iter().max().unwrap_or(0);
        let count = (0..half.block_count()).map(most).sum();
        let (mut index, mut slots) = (with_room(count), Slots::new(stiffness, count));
        for block in 0..half.block_count() {
            let own = own(block);
            for k in 0..most(block) {
                let springs = own.map(|i| half.of(i).get(k));
                index.push(std::array::from_fn(|l| springs[l].map_or(own[l] as u32, |h| h.neighbour)));
                slots.push(&springs.map(|h| h.copied()), stiffness, rest_length);
            }
            slots.end_block();
        }
        slots.shrink();
        (GatheredNeighbours { vertices: half.vertex_count(), index }, slots)
    }
}

impl<const D: usize> Neighbours<D> for GatheredNeighbours {
    type Field = VertexRows<D>;
    type Tensions = ();

    fn field(&self) -> VertexRows<D> {
        // The last block may have more lanes than there are vertices left.
        VertexRows::new(self.vertices.next_multiple_of(WIDTH))
    }

    fn tensions(&self) {}

    fn copy(&self, x: &[f64], field: &mut VertexRows<D>) {
        let (per_task, stride) = (COPIED_AT_ONCE * D, COPIED_AT_ONCE * VertexRows::<D>::STRIDE);
        let rows = field.as_mut_slice();
        if x.len() <= per_task || rayon::current_num_threads() == 1 {
            copy_points::<D>(x, rows);
        } else {
            x.par_chunks(per_task).zip(rows.par_chunks_mut(stride)).for_each(|(x, r)| copy_points::<D>(x, r));
        }
    }

    #[inline(always)]
    fn own<L: Lanes>(&self, field: &VertexRows<D>, block: usize) -> [L; D] {
        let mut index = [0; WIDTH];
        for l in 0..WIDTH {
            index[l] = (block * WIDTH + l) as u32;
        }
        L::gather(field, &index)
    }

    #[inline(always)]
    fn difference<L: Lanes>(&self, field: &VertexRows<D>, own: &[L; D], _: usize, slot: usize) -> [L; D] {
        let other: [L; D] = L::gather(field, &self.index[slot]);
        let mut d = *own;
        for c in 0..D {
            d[c] = own[c] - other[c];
        }
        d
    }

    fn fewest_blocks(&self) -> usize {
        0
    }

    /// Computes every spring at both of its ends, bit-identical there: nothing is scattered.
    #[inline(always)]
    fn gradient<L: Lanes>(
        &self,
        slots: &Slots,
        field: &VertexRows<D>,
        (): &mut (),
        blocks: Range<usize>,
        out: &mut [[[f64; D]; WIDTH]],
    ) -> L {
        // Zero times a finite number is zero, times any other NaN.
        let mut zero = L::zero();
        for (block, out) in blocks.zip(out) {
            let own: [L; D] = self.own(field, block);
            let mut g = [L::zero(); D];
            let of_block = slots.of(block);
            let constants = slots.constants_of::<L>(of_block.clone());
            for (i, slot) in of_block.enumerate() {
                let d = self.difference(field, &own, block, slot);
                let t = tension(constants.get(i), &d);
                for c in 0..D {
                    g[c] = t.mul_add(d[c], g[c]);
                }
            }
            for c in 0..D {
                zero = g[c].mul_add(L::zero(), zero);
            }
            L::store_interleaved(g, out);
        }
        zero
    }

    fn neighbour(&self, block: usize, slot: usize, lane: usize) -> Option<usize> {
        let other = self.index[slot][lane] as usize;
        (other != block * WIDTH + lane).then_some(other)
    }
}
