//! Arrays of `f64` whose memory begins at a cache line.
#![allow(unsafe_code)]

use std::ops::{Deref, DerefMut};

use super::pages::{filled, with_room};
use super::{Lanes, RowSource, WIDTH};

/// A cache line.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
struct CacheLine([f64; WIDTH]);

/// A vector of `f64` that begins at a cache line, so that no pack of `WIDTH` and no row of 2 or 4, counted
/// from there, straddles two lines.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Aligned(Vec<CacheLine>);

impl Aligned {
    /// `count` packs of zeros.
    pub fn packs(count: usize) -> Self {
        Aligned(filled(CacheLine([0.0; WIDTH]), count))
    }

    /// An empty vector with capacity for `count` packs.
    pub fn with_room(count: usize) -> Self {
        Aligned(with_room(count))
    }

    /// Appends a pack.
    pub fn push(&mut self, pack: [f64; WIDTH]) {
        self.0.push(CacheLine(pack));
    }

    /// Releases unused capacity.
    pub fn shrink_to_fit(&mut self) {
        self.0.shrink_to_fit();
    }

    /// Pack `index`.
    ///
    /// # Panics
    /// If `index` is out of range.
    #[inline(always)]
    pub fn pack(&self, index: usize) -> &[f64; WIDTH] {
        &self.0[index].0
    }
}

impl Deref for Aligned {
    type Target = [f64];

    #[inline(always)]
    fn deref(&self) -> &[f64] {
        // SAFETY: a line is `WIDTH` numbers and nothing else (`repr(C)`, and 64 bytes are its size and its
        // alignment), so lines in a row are `WIDTH` times as many numbers in a row, borrowed as long as
        // `self` is.
        unsafe { std::slice::from_raw_parts(self.0.as_ptr().cast(), WIDTH * self.0.len()) }
    }
}

impl DerefMut for Aligned {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [f64] {
        // SAFETY: as in `deref`; the borrow is exclusive, as `self` is, and any bits are an `f64`.
        unsafe { std::slice::from_raw_parts_mut(self.0.as_mut_ptr().cast(), WIDTH * self.0.len()) }
    }
}

/// A vector of any number of `f64` that begins at a cache line. On AVX-512 a store that straddles two lines
/// costs several that do not.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Numbers {
    packs: Aligned,
    length: usize,
}

impl Numbers {
    /// `length` zeros.
    pub fn zeros(length: usize) -> Self {
        Numbers { packs: Aligned::packs(length.div_ceil(WIDTH)), length }
    }
}

impl From<&[f64]> for Numbers {
    fn from(numbers: &[f64]) -> Self {
        let mut aligned = Numbers::zeros(numbers.len());
        aligned.copy_from_slice(numbers);
        aligned
    }
}

impl Deref for Numbers {
    type Target = [f64];

    #[inline(always)]
    fn deref(&self) -> &[f64] {
        &self.packs[..self.length]
    }
}

impl DerefMut for Numbers {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [f64] {
        &mut self.packs[..self.length]
    }
}

/// One column of numbers per component, so that a component of eight consecutive vertices is one load, from
/// any first vertex.
///
/// A pack of zeros precedes the first vertex and at least one follows the last: loads may reach that far.
#[derive(Clone, Debug, PartialEq)]
pub struct Columns<const D: usize> {
    /// `D * length` of them.
    numbers: Aligned,
    /// Length of a column: whole packs, two at least.
    length: usize,
}

impl<const D: usize> Columns<D> {
    /// Columns for `count` vertices, all zero.
    pub fn new(count: usize) -> Self {
        let packs = count.div_ceil(WIDTH) + 2;
        Columns { numbers: Aligned::packs(D * packs), length: packs * WIDTH }
    }

    /// Each column, from the first vertex on; the padding after the last must stay zero.
    pub fn each_mut(&mut self) -> [&mut [f64]; D] {
        let mut columns: [&mut [f64]; D] = std::array::from_fn(|_| Default::default());
        for (column, numbers) in columns.iter_mut().zip(self.numbers.chunks_exact_mut(self.length)) {
            *column = &mut numbers[WIDTH..];
        }
        columns
    }

    /// A view for loads. It is passed by value, so that an inner loop that writes elsewhere keeps it in
    /// registers.
    #[inline(always)]
    pub fn view(&self) -> ColumnsView<'_, D> {
        ColumnsView { numbers: &self.numbers, length: self.length }
    }
}

/// [`Columns`] to load from.
#[derive(Clone, Copy, Debug)]
pub struct ColumnsView<'a, const D: usize> {
    numbers: &'a [f64],
    length: usize,
}

impl<const D: usize> ColumnsView<'_, D> {
    /// Loads eight vertices from `from` on, which may begin a pack before the first or end a pack after the
    /// last.
    ///
    /// # Panics
    /// If they reach further.
    #[inline(always)]
    pub fn load<L: Lanes>(&self, from: isize) -> [L; D] {
        let at = WIDTH.wrapping_add_signed(from);
        // One test for all columns: this is an inner loop.
        assert!(at <= self.length - WIDTH, "beyond the columns");
        let mut r = [L::zero(); D];
        for c in 0..D {
            // SAFETY: as `Columns` has it, there are `D * length` numbers, and `c < D`: column `c` is
            // `length` of them from `c * length` on. Of these `at + WIDTH` are there, as was tested;
            // `length` is two packs at least. An array of numbers is aligned as a number is.
            let pack = unsafe { &*self.numbers.as_ptr().add(c * self.length + at).cast::<[f64; WIDTH]>() };
            r[c] = L::load(pack);
        }
        r
    }
}

/// One row for each of any number of vertices: `x, y` in 2D and `x, y, z, 0` in 3D.
///
/// [`Rows`](super::Rows) holds the few vertices of a patch, this type all of them; indices are checked.
#[derive(Clone, Debug, PartialEq)]
pub struct VertexRows<const D: usize>(Aligned);

impl<const D: usize> VertexRows<D> {
    /// Numbers per row: a power of two, so that a row is one vector load.
    pub const STRIDE: usize = super::Rows::<D>::STRIDE;

    /// Rows of `count` vertices, all zero.
    pub fn new(count: usize) -> Self {
        VertexRows(Aligned::packs((count * Self::STRIDE).div_ceil(WIDTH)))
    }

    /// The rows as they lie in memory, [`STRIDE`](Self::STRIDE) numbers each; the last ones may be padding.
    #[inline(always)]
    pub fn as_mut_slice(&mut self) -> &mut [f64] {
        &mut self.0
    }
}

impl<const D: usize> RowSource<D> for VertexRows<D> {
    type Index = u32;

    #[inline(always)]
    fn row<const STRIDE: usize>(&self, index: u32) -> &[f64; STRIDE] {
        debug_assert!(STRIDE == Self::STRIDE);
        &self.0.as_chunks().0[index as usize]
    }
}
