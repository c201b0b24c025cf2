//! Order in which a simulation stores its vertices.
//!
//! If neighbours in a mesh have far-apart numbers, every step waits for memory (a shuffled mesh of 100,000
//! tetrahedra: several times slower). Such bodies are renumbered along a space-filling curve when a scene is
//! assembled. Frames, messages and all other output keep the numbers of the mesh.

mod curve;

use std::borrow::Cow;
use std::ops::Range;

pub use curve::along_curve;

/// Number of vertices up to which the state of a body fits the cache in any order.
const MIN_VERTICES: usize = 8192;
/// Bound of a local numbering: the vertices of a cell are at most so many layers apart, a layer being
/// `n^((d-1)/d)` of `n` vertices in `d` dimensions, as in the best order of a grid.
const MAX_LAYERS: f64 = 8.0;

/// Map between the vertex numbers of the scene and of the simulation.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Numbering {
    /// `original[i]` is the number in the scene of vertex `i` of the simulation; empty for the identity.
    original: Vec<u32>,
    /// The inverse.
    internal: Vec<u32>,
}

impl Numbering {
    /// The identity: every vertex keeps its number.
    pub fn identity() -> Self {
        Self::default()
    }

    /// True if every vertex keeps its number.
    pub fn is_identity(&self) -> bool {
        self.original.is_empty()
    }

    /// Renumbers the vertices in `range` of `count`, at `points` (flat, those of the range), along a curve.
    pub fn renumber<const D: usize>(&mut self, range: Range<u32>, count: usize, points: &[f64]) {
        if self.is_identity() {
            self.original = (0..count as u32).collect();
            self.internal = self.original.clone();
        }
        let first = range.start;
        for (i, local) in range.zip(along_curve(points.as_chunks::<D>().0)) {
            self.original[i as usize] = first + local;
            self.internal[(first + local) as usize] = i;
        }
    }

    /// The number in the simulation of vertex `vertex` of the scene.
    pub fn internal(&self, vertex: u32) -> u32 {
        self.internal.get(vertex as usize).copied().unwrap_or(vertex)
    }

    /// The number in the scene of vertex `vertex` of the simulation.
    pub fn original(&self, vertex: u32) -> u32 {
        self.original.get(vertex as usize).copied().unwrap_or(vertex)
    }

    /// Permutes rows of `width` numbers from the order of the scene to that of the simulation.
    pub fn to_internal<'a>(&self, rows: &'a [f64], width: usize) -> Cow<'a, [f64]> {
        permuted(&self.original, rows, width)
    }

    /// Permutes rows of `width` numbers from the order of the simulation to that of the scene.
    pub fn to_original<'a>(&self, rows: &'a [f64], width: usize) -> Cow<'a, [f64]> {
        permuted(&self.internal, rows, width)
    }

    /// Writes rows of `width` numbers in the order of the simulation to `out`, in that of the scene, without
    /// an allocation.
    ///
    /// # Panics
    /// If `out` has another length.
    pub fn write_original(&self, rows: &[f64], width: usize, out: &mut [f64]) {
        if self.is_identity() {
            return out.copy_from_slice(rows);
        }
        for (out, &i) in out.chunks_exact_mut(width).zip(&self.internal) {
            out.copy_from_slice(&rows[i as usize * width..][..width]);
        }
    }
}

/// Row `i` of the result is row `from[i]`.
fn permuted<'a>(from: &[u32], rows: &'a [f64], width: usize) -> Cow<'a, [f64]> {
    if from.is_empty() {
        return Cow::Borrowed(rows);
    }
    Cow::Owned(from.iter().flat_map(|&i| &rows[i as usize * width..][..width]).copied().collect())
}

/// True if the vertices of most of these cells, of a body of `vertices` vertices in `dimension` dimensions,
/// are numbered near one another.
pub fn is_local<const N: usize>(cells: &[[u32; N]], vertices: usize, dimension: usize) -> bool {
    if vertices <= MIN_VERTICES || cells.is_empty() {
        return true;
    }
    let span = |cell: &[u32; N]| {
        let (low, high) = cell.iter().fold((u32::MAX, 0), |(low, high), &v| (low.min(v), high.max(v)));
        u64::from(high - low)
    };
    let mean = cells.iter().map(span).sum::<u64>() as f64 / cells.len() as f64;
    mean <= MAX_LAYERS * (vertices as f64).powf(1.0 - 1.0 / dimension as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_ways_undo_each_other() {
        let points: Vec<f64> = (0..20).map(|i| f64::from(i * 7 % 20)).collect();
        let mut numbering = Numbering::identity();
        assert_eq!(numbering.to_internal(&points, 2), &points[..]);
        numbering.renumber::<2>(4..14, 15, &points);
        let rows: Vec<f64> = (0..45).map(f64::from).collect();
        let internal = numbering.to_internal(&rows, 3);
        assert_ne!(internal, &rows[..]);
        assert_eq!(numbering.to_original(&internal, 3), &rows[..]);
        for numbering in [&numbering, &Numbering::identity()] {
            let mut written = vec![f64::NAN; 45];
            numbering.write_original(&internal, 3, &mut written);
            assert_eq!(written, &*numbering.to_original(&internal, 3));
        }
        for v in 0..15 {
            assert_eq!(numbering.original(numbering.internal(v)), v);
            assert_eq!(internal[3 * numbering.internal(v) as usize], rows[3 * v as usize]);
            assert!((4..14).contains(&v) == (4..14).contains(&numbering.internal(v)));
        }
    }

    #[test]
    fn neighbours_are_near_in_a_grid_and_far_in_a_shuffled_one() {
        let side = 128u32;
        let cells: Vec<[u32; 3]> =
            (0..side * (side - 1)).filter(|v| v % side + 1 < side).map(|v| [v, v + 1, v + side]).collect();
        let count = (side * side) as usize;
        assert!(is_local(&cells, count, 2));
        // An odd factor permutes the numbers up to a power of two.
        let shuffled: Vec<[u32; 3]> = cells.iter().map(|c| c.map(|v| v * 6151 % (side * side))).collect();
        assert!(!is_local(&shuffled, count, 2));
        assert!(is_local(&shuffled[..], MIN_VERTICES, 2));
    }
}
