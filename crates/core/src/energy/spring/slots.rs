//! Slots: the springs of eight consecutive vertices, side by side.

use std::ops::Range;

use super::half_springs::HalfSpring;
use crate::lanes::{Aligned, Lanes, WIDTH};

/// Slots of all blocks of `WIDTH` vertices. A slot holds a half-spring for some or all vertices of its
/// block.
#[derive(Debug)]
pub(super) struct Slots {
    /// `start[b]..start[b + 1]` are the slots of block `b`.
    start: Vec<u32>,
    /// Rest lengths [m]; zero in lanes without a spring.
    rest_length: Aligned,
    stiffness: SlotStiffness,
    /// Index of every spring, at its first end: slot by slot, lane by lane.
    spring: Vec<u32>,
}

/// True if `own` is the end of its spring that counts as the first.
pub(super) fn is_first_end(own: usize, neighbour: usize) -> bool {
    own < neighbour
}

/// Stiffnesses [N/m].
#[derive(Debug)]
enum SlotStiffness {
    /// Common stiffness of all springs.
    Same(f64),
    /// Stiffnesses of the springs in every slot; zero in lanes without a spring.
    Varying(Aligned),
}

/// Constants of some slots, for an inner loop.
pub(super) struct SlotConstants<'a, L> {
    rest_length: &'a [[f64; WIDTH]],
    /// Stiffness [N/m] if all springs have the same.
    same: L,
    /// Stiffnesses [N/m] if they differ.
    varying: Option<&'a [[f64; WIDTH]]>,
}

impl<L: Lanes> SlotConstants<'_, L> {
    /// Returns stiffness [N/m] and rest length [m] of the slot with this index.
    #[inline(always)]
    pub(super) fn get(&self, index: usize) -> (L, L) {
        let stiffness = match self.varying {
            Some(k) => L::load(&k[index]),
            None => self.same,
        };
        (stiffness, L::load(&self.rest_length[index]))
    }
}

impl Slots {
    /// Creates an empty list with capacity for `count` slots, for springs of these stiffnesses.
    pub(super) fn new(stiffness: &[f64], count: usize) -> Self {
        let first = stiffness.first().copied().unwrap_or(0.0);
        let same = stiffness.iter().all(|k| *k == first);
        Slots {
            start: vec![0],
            rest_length: Aligned::with_room(count),
            stiffness: if same {
                SlotStiffness::Same(first)
            } else {
                SlotStiffness::Varying(Aligned::with_room(count))
            },
            spring: vec![],
        }
    }

    /// Appends a slot to the block being filled: a spring for each of its vertices, or none.
    pub(super) fn push(
        &mut self,
        half: &[Option<HalfSpring>; WIDTH],
        stiffness: &[f64],
        rest_length: &[f64],
    ) {
        self.rest_length.push(half.map(|h| h.map_or(0.0, |h| rest_length[h.spring as usize])));
        if let SlotStiffness::Varying(values) = &mut self.stiffness {
            values.push(half.map(|h| h.map_or(0.0, |h| stiffness[h.spring as usize])));
        }
        for (lane, h) in half.iter().enumerate() {
            let own = self.blocks() * WIDTH + lane;
            self.spring.extend(h.filter(|h| is_first_end(own, h.neighbour as usize)).map(|h| h.spring));
        }
    }

    /// Ends a block, which gets the slots pushed since the last end.
    pub(super) fn end_block(&mut self) {
        self.start.push((self.rest_length.len() / WIDTH) as u32);
    }

    /// Releases unused capacity.
    pub(super) fn shrink(&mut self) {
        self.start.shrink_to_fit();
        self.spring.shrink_to_fit();
        self.rest_length.shrink_to_fit();
        if let SlotStiffness::Varying(values) = &mut self.stiffness {
            values.shrink_to_fit();
        }
    }

    /// Returns the number of blocks.
    pub(super) fn blocks(&self) -> usize {
        self.start.len() - 1
    }

    /// Returns the slots of a block.
    #[inline(always)]
    pub(super) fn of(&self, block: usize) -> Range<usize> {
        self.start[block] as usize..self.start[block + 1] as usize
    }

    /// Returns the rest lengths of a slot [m].
    #[inline(always)]
    pub(super) fn rest_length<L: Lanes>(&self, slot: usize) -> L {
        L::load(self.rest_length.pack(slot))
    }

    /// Returns the stiffnesses of a slot [N/m]; finite in lanes without a spring.
    #[inline(always)]
    pub(super) fn stiffness<L: Lanes>(&self, slot: usize) -> L {
        match &self.stiffness {
            SlotStiffness::Same(k) => L::splat(*k),
            SlotStiffness::Varying(values) => L::load(values.pack(slot)),
        }
    }

    /// Returns the constants of some slots.
    #[inline(always)]
    pub(super) fn constants_of<L: Lanes>(&self, slots: Range<usize>) -> SlotConstants<'_, L> {
        let rest_length = &self.rest_length.as_chunks().0[slots.clone()];
        match &self.stiffness {
            SlotStiffness::Same(k) => SlotConstants { rest_length, same: L::splat(*k), varying: None },
            SlotStiffness::Varying(k) => {
                SlotConstants { rest_length, same: L::zero(), varying: Some(&k.as_chunks().0[slots]) }
            }
        }
    }

    /// Returns stiffness [N/m] and rest length [m] of the spring in a lane.
    pub(super) fn constants(&self, slot: usize, lane: usize) -> (f64, f64) {
        let stiffness = match &self.stiffness {
            SlotStiffness::Same(k) => *k,
            SlotStiffness::Varying(values) => values.pack(slot)[lane],
        };
        (stiffness, self.rest_length.pack(slot)[lane])
    }

    /// Returns the index of every spring, at its first end: slot by slot, lane by lane.
    pub(super) fn springs(&self) -> &[u32] {
        &self.spring
    }
}
