//! Numbers in memory that begins at a cache line.
#![allow(unsafe_code)]

use std::ops::{Deref, DerefMut};

use super::{RowSource, WIDTH};

/// A cache line.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
struct Line([f64; WIDTH]);

/// A vector of `f64` that begins at a cache line, so that no pack of `WIDTH` and no row of 2 or 4 counted from there straddles two.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Aligned(Vec<Line>);

impl Aligned {
    /// `count` packs of zeros.
    pub fn packs(count: usize) -> Self {
        Aligned(vec![Line([0.0; WIDTH]); count])
    }

    /// Appends a pack.
    pub fn push(&mut self, pack: [f64; WIDTH]) {
        self.0.push(Line(pack));
    }

    /// Gives back what was allocated in vain.
    pub fn shrink_to_fit(&mut self) {
        self.0.shrink_to_fit();
    }

    /// Pack `index`.
    ///
    /// # Panics
    /// If there is none.
    #[inline(always)]
    pub fn pack(&self, index: usize) -> &[f64; WIDTH] {
        &self.0[index].0
    }
}

impl Deref for Aligned {
    type Target = [f64];

    #[inline(always)]
    fn deref(&self) -> &[f64] {
        // SAFETY: a line is `WIDTH` numbers and nothing else (`repr(C)`, and 64 bytes are its size and its alignment), so lines in
        // a row are `WIDTH` times as many numbers in a row, borrowed as long as `self` is.
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

/// A row for each of any number of vertices: `x, y` in 2D and `x, y, z, 0` in 3D.
///
/// Where [`Rows`](super::Rows) holds the few vertices of a patch, this holds all of them; an index is tested.
#[derive(Clone, Debug, PartialEq)]
pub struct VertexRows<const D: usize>(Aligned);

impl<const D: usize> VertexRows<D> {
    /// Numbers per row: a power of two, so that a row is one vector load.
    pub const STRIDE: usize = super::Rows::<D>::STRIDE;

    /// Rows of `count` vertices, all zero.
    pub fn new(count: usize) -> Self {
        VertexRows(Aligned::packs((count * Self::STRIDE).div_ceil(WIDTH)))
    }

    /// The rows as they lie in memory, [`STRIDE`](Self::STRIDE) numbers each; the last ones may belong to no vertex.
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
