//! Scratch rows: the local copy of vertex positions or forces that packs gather from and add to.

/// Numbers in a buffer: 64 KiB, so that two of them stay in the second-level cache.
const LENGTH: usize = 8192;

#[derive(Clone)]
#[repr(C, align(64))]
struct Buffer([f64; LENGTH]);

/// A buffer of vertex rows of fixed capacity: `x, y` in 2D and `x, y, z, 0` in 3D.
///
/// The capacity is a power of two and every access wraps at it, so no index can be out of bounds and none is tested:
/// this is what makes [`crate::lanes::Lanes::gather`] both safe and fast. An index that would wrap is a bug of the
/// caller, caught by a debug assertion.
#[derive(Clone)]
pub struct Rows<const D: usize>(Box<Buffer>);

impl<const D: usize> Rows<D> {
    /// Numbers per row: a power of two, so that a row is one vector load.
    pub const STRIDE: usize = match D {
        2 => 2,
        3 => 4,
        _ => panic!("rows have 2 or 3 components"),
    };
    /// Rows in the buffer: 4096 in 2D, 2048 in 3D.
    pub const CAPACITY: usize = LENGTH / Self::STRIDE;

    /// All rows zero.
    pub fn new() -> Self {
        Rows(Box::new(Buffer([0.0; LENGTH])))
    }

    /// Where row `index` begins, wrapped at the capacity.
    #[inline(always)]
    fn start(index: usize) -> usize {
        debug_assert!(index < Self::CAPACITY, "row {index} of {}", Self::CAPACITY);
        (index & (Self::CAPACITY - 1)) * Self::STRIDE
    }

    /// The `STRIDE` numbers of row `index`, wrapped at the capacity.
    #[cfg(target_arch = "x86_64")]
    #[inline(always)]
    pub(super) fn row<const STRIDE: usize>(&self, index: u16) -> &[f64; STRIDE] {
        debug_assert!(STRIDE == Self::STRIDE);
        &self.0.0.as_chunks().0[Self::start(index as usize) / STRIDE]
    }

    /// The `STRIDE` numbers of row `index`, wrapped at the capacity.
    #[cfg(target_arch = "x86_64")]
    #[inline(always)]
    pub(super) fn row_mut<const STRIDE: usize>(&mut self, index: u16) -> &mut [f64; STRIDE] {
        debug_assert!(STRIDE == Self::STRIDE);
        &mut self.0.0.as_chunks_mut().0[Self::start(index as usize) / STRIDE]
    }

    /// Numbers `2 half` and `2 half + 1` of row `index`, wrapped at the capacity.
    #[cfg(target_arch = "x86_64")]
    #[inline(always)]
    pub(super) fn two(&self, index: u16, half: usize) -> &[f64; 2] {
        &self.0.0.as_chunks().0[(Self::start(index as usize) / 2 + half) & (LENGTH / 2 - 1)]
    }

    /// Row `index`.
    #[inline(always)]
    pub fn get(&self, index: usize) -> [f64; D] {
        let start = Self::start(index);
        let mut r = [0.0; D];
        r.copy_from_slice(&self.0.0[start..start + D]);
        r
    }

    /// Overwrites row `index`.
    #[inline(always)]
    pub fn set(&mut self, index: usize, row: [f64; D]) {
        let start = Self::start(index);
        self.0.0[start..start + D].copy_from_slice(&row);
    }

    /// Zeroes the first `count` rows.
    ///
    /// # Panics
    /// If `count` exceeds the capacity.
    #[inline(always)]
    pub fn clear(&mut self, count: usize) {
        self.0.0[..count * Self::STRIDE].fill(0.0);
    }

    /// Overwrites row `i` with the position of vertex `vertices[i]`, taken from a flat array of shape `(n, D)`.
    ///
    /// # Panics
    /// If a vertex lies beyond the end of `positions`, or there are more vertices than rows.
    #[inline(always)]
    pub fn load_vertices(&mut self, positions: &[f64], vertices: &[u32]) {
        assert!(vertices.len() <= Self::CAPACITY, "more vertices than rows");
        let (positions, _) = positions.as_chunks::<D>();
        for i in 0..vertices.len() {
            self.set(i, positions[vertices[i] as usize]);
        }
    }

    /// The buffer as it lies in memory, `STRIDE` numbers per row.
    #[inline(always)]
    pub fn as_slice(&self) -> &[f64] {
        &self.0.0
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
