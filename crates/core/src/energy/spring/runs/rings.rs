//! Ring buffers of tensions: the lower ends of springs compute them, the upper ends read them later.

use std::collections::BTreeMap;

use crate::lanes::{Lanes, WIDTH};

/// Marks a run without a ring.
pub(super) const NO_RING: u32 = u32::MAX;

/// Maximum number of values in all rings of a task, so that they stay in the L2 cache.
const MOST_NUMBERS: usize = 1 << 16;

/// A class of springs has a ring if it occurs in at least one of this many blocks.
const RARE: usize = 16;

/// Springs whose ends are equally far apart in the numbering. Springs between the same vertices are in
/// different classes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Class {
    /// Number of the upper end minus that of the lower.
    pub(super) offset: u32,
    /// Number of earlier springs between the same vertices.
    pub(super) rank: usize,
}

/// One ring of packs for each class of springs that is frequent enough and whose ends are near each
/// other.
///
/// The pack of a block begins at its first vertex, modulo the length. The first pack is repeated after
/// the last, so that the tensions of any eight consecutive vertices are adjacent.
#[derive(Debug)]
pub(super) struct SpringRings {
    classes: Vec<Class>,
    /// Numbers in a ring, without the repeated first pack: a power of two.
    length: usize,
}

impl SpringRings {
    /// Creates rings for classes that occur in enough of `blocks` blocks; `frequency` counts the blocks
    /// of each.
    pub(super) fn new(frequency: &BTreeMap<Class, usize>, blocks: usize) -> Self {
        let mut rings = SpringRings { classes: vec![], length: WIDTH };
        for (&class, &count) in frequency {
            let length = (class.offset as usize + WIDTH).next_power_of_two();
            let fits = (rings.classes.len() + 1) * (length + WIDTH) <= MOST_NUMBERS;
            if fits && RARE * count >= blocks {
                rings.classes.push(class);
                rings.length = length;
            }
        }
        rings
    }

    /// Returns the start of the ring of a class in the memory of all rings, or [`NO_RING`].
    pub(super) fn of(&self, class: Class) -> u32 {
        self.classes.binary_search(&class).map_or(NO_RING, |ring| (ring * self.stride()) as u32)
    }

    /// Returns how many blocks back a block reads tensions, at most.
    pub(super) fn reach(&self) -> usize {
        self.classes.last().map_or(0, |class| (class.offset as usize).div_ceil(WIDTH))
    }

    /// Returns the numbers in a ring, with the repeated first pack.
    fn stride(&self) -> usize {
        self.length + WIDTH
    }

    /// Returns the numbers in all rings.
    pub(super) fn numbers(&self) -> usize {
        self.classes.len() * self.stride()
    }

    /// Returns the rings of a task, in memory of [`numbers`](Self::numbers).
    #[inline(always)]
    pub(super) fn in_memory<'a>(&self, numbers: &'a mut [f64]) -> Tensions<'a> {
        Tensions { numbers, length: self.length, mask: self.length as u32 - 1 }
    }
}

/// Rings of a task.
pub(super) struct Tensions<'a> {
    numbers: &'a mut [f64],
    length: usize,
    mask: u32,
}

impl Tensions<'_> {
    /// Returns the index of the tension of vertex `from + offset`, in the ring that begins at `ring`.
    #[inline(always)]
    fn place(&self, ring: u32, from: usize, offset: i32) -> usize {
        // In 32 bits: the length divides their number of values, and the compiler sees that a few more do
        // not overflow.
        (ring + ((from as u32).wrapping_add_signed(offset) & self.mask)) as usize
    }

    /// Stores the tensions of the block that begins at vertex `from`.
    #[inline(always)]
    pub(super) fn keep<L: Lanes>(&mut self, ring: u32, from: usize, tensions: L) {
        let at = self.place(ring, from, 0);
        tensions.store(&mut self.numbers[at..at + WIDTH].as_chunks_mut().0[0]);
    }

    /// Returns the tensions stored for eight vertices from `from + offset` on.
    #[inline(always)]
    pub(super) fn read<L: Lanes>(&self, ring: u32, from: usize, offset: i32) -> L {
        let at = self.place(ring, from, offset);
        L::load(&self.numbers[at..at + WIDTH].as_chunks().0[0])
    }

    /// Repeats the first packs of the rings, after the tensions of the block that begins at `from` are
    /// stored.
    #[inline(always)]
    pub(super) fn end_block(&mut self, from: usize) {
        if from as u32 & self.mask == 0 {
            for ring in self.numbers.chunks_exact_mut(self.length + WIDTH) {
                ring.copy_within(..WIDTH, self.length);
            }
        }
    }
}
