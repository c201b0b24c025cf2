//! Scratch rows: the local copy of vertex positions or forces that packs gather from and add to.
#![allow(unsafe_code)]

use std::ops::{Deref, DerefMut};

#[cfg(target_family = "wasm")]
use allocated::AllocatedMemory as Memory;
#[cfg(not(target_family = "wasm"))]
use mapped::MappedMemory as Memory;

/// One row for every `u16`.
const CAPACITY: usize = 1 << 16;
/// Numbers in a buffer, enough for rows of four.
const LENGTH: usize = 4 * CAPACITY;

/// Memory for [`RowSlice`], beginning at a page.
///
/// Pages are allocated as rows are first written, so a buffer whose first 500 rows are in use occupies 16 kB,
/// not the 2 MB it may grow to. The pages are requested from the system itself: an allocator would clear
/// memory that was freed before, tens of megabytes after a mesh has been read, and keep it from then on.
///
/// Where the system has no pages to give (WebAssembly), an allocator provides the whole buffer at once.
pub struct Rows<const D: usize> {
    memory: Memory,
}

impl<const D: usize> Rows<D> {
    /// Numbers per row: a power of two, so that a row is one vector load.
    pub const STRIDE: usize = RowSlice::<D>::STRIDE;
    /// Bytes reserved.
    pub const BYTES: usize = 8 * LENGTH;
    /// Number of usable rows.
    pub const CAPACITY: usize = CAPACITY - 1;
    /// Spare row, for additions whose result is discarded.
    pub const SPARE: u16 = u16::MAX;

    /// All rows zero.
    ///
    /// # Panics
    /// Ends the program, as any allocation does, if the system has no address space left.
    pub fn new() -> Self {
        let memory = Memory::new(Self::BYTES);
        assert!(memory.len() >= Self::BYTES && memory.as_ptr().cast::<RowSlice<D>>().is_aligned());
        Rows { memory }
    }
}

/// Zeroed memory of the system.
#[cfg(not(target_family = "wasm"))]
mod mapped {
    use std::alloc::{Layout, handle_alloc_error};

    use memmap2::MmapMut;

    pub(super) struct MappedMemory(MmapMut);

    impl MappedMemory {
        pub(super) fn new(bytes: usize) -> Self {
            let Ok(memory) = MmapMut::map_anon(bytes) else {
                handle_alloc_error(Layout::array::<u8>(bytes).unwrap_or(Layout::new::<u8>()))
            };
            // A huge page would back all of a buffer of which little is in use.
            #[cfg(target_os = "linux")]
            let _ = memory.advise(memmap2::Advice::NoHugePage);
            MappedMemory(memory)
        }

        pub(super) fn len(&self) -> usize {
            self.0.len()
        }

        #[inline(always)]
        pub(super) fn as_ptr(&self) -> *const u8 {
            self.0.as_ptr()
        }

        #[inline(always)]
        pub(super) fn as_mut_ptr(&mut self) -> *mut u8 {
            self.0.as_mut_ptr()
        }
    }
}

/// Zeroed memory of the allocator.
#[cfg(target_family = "wasm")]
mod allocated {
    /// A cache line; its alignment suits packs.
    #[derive(Clone, Copy)]
    #[repr(C, align(64))]
    struct AlignedLine([u64; 8]);

    pub(super) struct AllocatedMemory(Box<[AlignedLine]>);

    impl AllocatedMemory {
        pub(super) fn new(bytes: usize) -> Self {
            AllocatedMemory(
                vec![AlignedLine([0; 8]); bytes.div_ceil(size_of::<AlignedLine>())].into_boxed_slice(),
            )
        }

        pub(super) fn len(&self) -> usize {
            size_of_val(&*self.0)
        }

        #[inline(always)]
        pub(super) fn as_ptr(&self) -> *const u8 {
            self.0.as_ptr().cast()
        }

        #[inline(always)]
        pub(super) fn as_mut_ptr(&mut self) -> *mut u8 {
            self.0.as_mut_ptr().cast()
        }
    }
}

impl<const D: usize> Deref for Rows<D> {
    type Target = RowSlice<D>;
    #[inline(always)]
    fn deref(&self) -> &RowSlice<D> {
        // SAFETY: `RowSlice` is a transparent wrapper of `LENGTH` numbers, any bits of which are a number.
        // `new` has checked that the memory is so long and aligned; it stays where it is and is borrowed as
        // long as what is returned.
        unsafe { &*self.memory.as_ptr().cast() }
    }
}

impl<const D: usize> DerefMut for Rows<D> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut RowSlice<D> {
        // SAFETY: as above, and borrowed for writing.
        unsafe { &mut *self.memory.as_mut_ptr().cast() }
    }
}

/// 65,536 rows of a vertex each: `x, y` in 2D and `x, y, z, 0` in 3D.
///
/// There is a row for every `u16`, so no index can be out of bounds and none is checked: this makes
/// [`crate::lanes::Lanes::gather`] both safe and fast. A loop should take the slice out of its [`Rows`] once,
/// before it begins: a reference stays in a register, a field would be read again after every row written.
#[repr(transparent)]
pub struct RowSlice<const D: usize>([f64; LENGTH]);

/// Copies points, flat, to rows as they lie in memory, from the first on.
pub(crate) fn copy_points<const D: usize>(points: &[f64], rows: &mut [f64]) {
    let rows = rows.chunks_exact_mut(RowSlice::<D>::STRIDE);
    for (row, point) in rows.zip(points.as_chunks::<D>().0) {
        row[..D].copy_from_slice(point);
    }
}

/// Rows of vertices that [`Lanes::gather`](super::Lanes::gather) takes: 2 numbers each in 2D, 4 in 3D.
pub trait RowSource<const D: usize> {
    /// Index of a row.
    type Index: Copy;

    /// The numbers of row `index`; `STRIDE` is 2 for `D = 2` and 4 for `D = 3`.
    fn row<const STRIDE: usize>(&self, index: Self::Index) -> &[f64; STRIDE];

    /// The first two and the last two numbers of row `index`; rows of four only.
    #[inline(always)]
    fn halves(&self, index: Self::Index) -> [&[f64; 2]; 2] {
        let row = self.row::<4>(index).as_chunks::<2>().0;
        [&row[0], &row[1]]
    }

    /// The `D` components of row `index`.
    #[inline(always)]
    fn components(&self, index: Self::Index) -> [f64; D] {
        let mut r = [0.0; D];
        if D == 3 {
            r.copy_from_slice(&self.row::<4>(index)[..D]);
        } else {
            r.copy_from_slice(&self.row::<2>(index)[..D]);
        }
        r
    }
}

impl<const D: usize> RowSource<D> for RowSlice<D> {
    type Index = u16;

    #[inline(always)]
    fn row<const STRIDE: usize>(&self, index: u16) -> &[f64; STRIDE] {
        debug_assert!(STRIDE == Self::STRIDE);
        &self.0.as_chunks().0[index as usize]
    }
}

impl<const D: usize> RowSource<D> for Rows<D> {
    type Index = u16;

    #[inline(always)]
    fn row<const STRIDE: usize>(&self, index: u16) -> &[f64; STRIDE] {
        RowSource::row(&**self, index)
    }
}

impl<const D: usize> RowSlice<D> {
    const STRIDE: usize = match D {
        2 => 2,
        3 => 4,
        _ => panic!("rows have 2 or 3 components"),
    };

    /// The `STRIDE` numbers of row `index`.
    #[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
    #[inline(always)]
    pub(super) fn row_mut<const STRIDE: usize>(&mut self, index: u16) -> &mut [f64; STRIDE] {
        debug_assert!(STRIDE == Self::STRIDE);
        &mut self.0.as_chunks_mut().0[index as usize]
    }

    /// Row `index`.
    #[inline(always)]
    pub fn get(&self, index: u16) -> [f64; D] {
        let start = index as usize * Self::STRIDE;
        let mut r = [0.0; D];
        r.copy_from_slice(&self.0[start..start + D]);
        r
    }

    /// Overwrites row `index`.
    #[inline(always)]
    pub fn set(&mut self, index: u16, row: [f64; D]) {
        let start = index as usize * Self::STRIDE;
        self.0[start..start + D].copy_from_slice(&row);
    }

    /// Zeroes the first `count` rows.
    ///
    /// # Panics
    /// If `count` exceeds the capacity.
    #[inline(always)]
    pub fn clear(&mut self, count: usize) {
        self.0[..count * Self::STRIDE].fill(0.0);
    }

    /// Overwrites the rows from `first` on with the points of a flat array of shape `(n, D)`.
    ///
    /// # Panics
    /// If there are more points than rows.
    #[inline(always)]
    pub fn load(&mut self, first: usize, points: &[f64]) {
        copy_points::<D>(points, &mut self.0[first * Self::STRIDE..][..points.len() / D * Self::STRIDE]);
    }

    /// The buffer as it lies in memory, [`Rows::STRIDE`] numbers per row.
    #[inline(always)]
    pub fn as_slice(&self) -> &[f64] {
        &self.0[..CAPACITY * Self::STRIDE]
    }
}

impl<const D: usize> Default for Rows<D> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const D: usize> std::fmt::Debug for Rows<D> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Rows").field("dimension", &D).finish_non_exhaustive()
    }
}
