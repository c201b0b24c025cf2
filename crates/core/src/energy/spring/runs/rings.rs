//! Ring buffers of tensions: the lower ends of springs compute them, the upper ends read them later.

use std::collections::BTreeMap;

use crate::lanes::{Lanes, WIDTH};

/// Marks a run without a ring.
pub(super) const NO_RING: u32 = u32::MAX;

/// Maximum number of values in all rings of a task, so that they stay in the second-level cache.
const MOST_NUMBERS: usize = 1 << 16;

/// A ring is there for a class of springs in at least one of as many blocks.
const RARE: usize = 16;

/// Springs whose ends are equally far apart in the numbering; between the same vertices, first, second and
/// further ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Class {
    /// Number of the upper end minus that of the lower.
    pub(super) offset: u32,
    /// Number of springs before it between the same vertices.
    pub(super) rank: usize,
}

/// One ring of packs for each class of springs that is frequent enough and whose ends are not too far apart.
///
/// The pack of a block begins at its first vertex, modulo the length, so that the tensions of eight
/// consecutive vertices, wherever they begin, lie side by side: the first pack is there once more after the
/// last.
#[derive(Debug)]
pub(super) struct SpringRings {
    classes: Vec<Class>,
    /// Numbers in a ring, its second first pack left out: a power of two.
    length: usize,
}

impl SpringRings {
    /// Rings for classes in as many of `blocks` blocks as stands beside each.
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

    /// Start of the ring of a class in the memory of all rings, or [`NO_RING`].
    pub(super) fn of(&self, class: Class) -> u32 {
        self.classes.binary_search(&class).map_or(NO_RING, |ring| (ring * self.stride()) as u32)
    }

    /// Blocks before a block whose tensions are read there, at most.
    pub(super) fn reach(&self) -> usize {
        self.classes.last().map_or(0, |class| (class.offset as usize).div_ceil(WIDTH))
    }

    /// Numbers of a ring, with its second first pack.
    fn stride(&self) -> usize {
        self.length + WIDTH
    }

    /// Numbers in all rings.
    pub(super) fn numbers(&self) -> usize {
        self.classes.len() * self.stride()
    }

    /// The rings of a task, in memory of [`numbers`](Self::numbers).
    #[inline(always)]
    pub(super) fn in_memory<'a>(&self, numbers: &'a mut [f64]) -> Tensions<'a> {
        Tensions { numbers, length: self.length, mask: self.length as u32 - 1 }
    }
}

/// The rings of a task.
pub(super) struct Tensions<'a> {
    numbers: &'a mut [f64],
    length: usize,
    mask: u32,
}

impl Tensions<'_> {
    /// Index of the tension of vertex `from + offset`, in the ring that begins at `ring`.
    #[inline(always)]
    fn place(&self, ring: u32, from: usize, offset: i32) -> usize {
        // In 32 bits: the length divides their number of values, and the compiler sees that a few more do
        // not overflow.
        (ring + ((from as u32).wrapping_add_signed(offset) & self.mask)) as usize
    }

    /// Keeps the tensions of the block that begins at vertex `from`.
    #[inline(always)]
    pub(super) fn keep<L: Lanes>(&mut self, ring: u32, from: usize, tensions: L) {
        let at = self.place(ring, from, 0);
        tensions.store(&mut self.numbers[at..at + WIDTH].as_chunks_mut().0[0]);
    }

    /// Tensions kept for eight vertices from `from + offset` on.
    #[inline(always)]
    pub(super) fn read<L: Lanes>(&self, ring: u32, from: usize, offset: i32) -> L {
        let at = self.place(ring, from, offset);
        L::load(&self.numbers[at..at + WIDTH].as_chunks().0[0])
    }

    /// After the tensions of the block that begins at vertex `from` are kept.
    #[inline(always)]
    pub(super) fn end_block(&mut self, from: usize) {
        if from as u32 & self.mask == 0 {
            for ring in self.numbers.chunks_exact_mut(self.length + WIDTH) {
                ring.copy_within(..WIDTH, self.length);
            }
        }
    }
}
