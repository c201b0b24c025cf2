//! Multigrid preconditioner: the number of iterations hardly depends on the mesh size.
//!
//! Coarser levels solve for smooth errors, which a smoother hardly reduces. Each level is the Galerkin
//! product `P^T A P` of the finer one; `P` interpolates from a lattice of twice the spacing
//! (`lattice.rs`) and is built once from positions and structure. One application is a symmetric V-cycle
//! with Chebyshev smoothing (`smoother.rs`) in single precision, and a sparse Cholesky solve on the
//! coarsest level. Briggs, Henson, McCormick 2000, *A multigrid tutorial*, chapters 3 and 10.

mod coarsest;
pub mod galerkin;
pub mod lattice;
pub mod prolongation;
mod smoother;

use crate::deadline::Stop;
use coarsest::Coarsest;
use galerkin::Galerkin;
use lattice::{Coarsening, coarsen, mean_edge};
use prolongation::Prolongation;
use smoother::Smoother;
pub use smoother::TASK_ROWS;

use super::block_matrix::BlockMatrix;
use super::cholesky::NotPositiveDefinite;
use super::conjugate_gradients::Preconditioner;

/// Unknowns up to which a level is solved directly.
const DIRECT: usize = 300;
/// Spacing of the first lattice, in mean edge lengths.
const FIRST_SPACING: f64 = 2.0;
/// Largest ratio of the rows of a level to those of the finer one.
const COARSER: f64 = 0.7;
/// Relative shift of the coarsest diagonal: nodes may be linearly dependent to rounding.
const SHIFT: f64 = 1e-9;

/// Approximates `A^-1` by one V-cycle.
pub struct Multigrid<const D: usize> {
    levels: Vec<GridLevel<D>>,
    coarsest: Coarsest<D>,
    held: HeldCoordinates,
    /// Power of two by which all levels scale the matrix.
    scale: f64,
    /// Pattern version of the finest level.
    pattern: u64,
}

/// A level and its transfer to the next.
struct GridLevel<const D: usize> {
    smoother: Smoother<D>,
    prolongation: Prolongation,
    galerkin: Galerkin<D>,
    /// Matrix of the next level.
    coarse: BlockMatrix<D>,
}

/// Constrained coordinates, whose rows and columns are zero except for the diagonal; they are solved
/// separately.
pub struct HeldCoordinates {
    coordinates: Vec<u32>,
    /// `1 / A_ii` of each.
    inverse: Vec<f64>,
    /// Bit `k` of entry `i` is set if component `k` of vertex `i` is constrained. Empty if no vertex is
    /// constrained in part.
    mask: Vec<u8>,
}

impl<const D: usize> Multigrid<D> {
    /// Returns the matrix below level `level` (0 is the finest), in the units of
    /// [`Preconditioner::update`].
    pub fn coarse(&self, level: usize) -> &BlockMatrix<D> {
        &self.levels[level].coarse
    }

    /// Builds the levels for matrices with the structure of `matrix`, whose vertices are at `x` (flat).
    /// `held` has for each coordinate whether it is constrained: its row and column are zero except for
    /// the diagonal, and a fully constrained vertex has no other block. `None` if the factor of the
    /// coarsest level would not fit memory.
    pub fn new(matrix: &BlockMatrix<D>, x: &[f64], held: &[bool]) -> Option<Self> {
        Self::until(matrix, x, held, &Stop::default())
    }

    /// Builds the levels as [`new`](Self::new) does; also returns `None` if the flag is set, which each
    /// level checks.
    pub(crate) fn until(matrix: &BlockMatrix<D>, x: &[f64], held: &[bool], stop: &Stop) -> Option<Self> {
        let mut positions = x.as_chunks::<D>().0.to_vec();
        let mut spacing = FIRST_SPACING * mean_edge(matrix, &positions);
        let extent = |(low, high): (f64, f64), x: &f64| (low.min(*x), high.max(*x));
        let (low, high) = x.iter().fold((f64::INFINITY, f64::NEG_INFINITY), extent);
        let mut levels: Vec<GridLevel<D>> = vec![];
        loop {
            if stop.is_set() {
                return None;
            }
            let fine = levels.last().map_or(matrix, |level| &level.coarse);
            // If all vertices are within a cube or two, a wider lattice is no coarser.
            if fine.rows() * D <= DIRECT || !(spacing > 0.0 && spacing <= 4.0 * (high - low)) {
                break;
            }
            let Coarsening { prolongation, positions: nodes } = coarsen(fine, &positions, spacing);
            spacing *= 2.0;
            if nodes.is_empty() || nodes.len() as f64 > COARSER * fine.rows() as f64 {
                continue;
            }
            let (galerkin, coarse) = Galerkin::new(fine, &prolongation);
            levels.push(GridLevel { smoother: Smoother::new(fine), prolongation, galerkin, coarse });
            positions = nodes;
        }
        let last = levels.last().map_or(matrix, |level| &level.coarse);
        let coarsest = Coarsest::new(last, positions.as_flattened())?;
        Some(Multigrid { levels, coarsest, held: HeldCoordinates::new::<D>(held), scale: 1.0, pattern: 0 })
    }

    /// Returns the rows of all levels, the finest first.
    pub fn rows(&self) -> Vec<usize> {
        let levels = self.levels.iter().map(|level| level.prolongation.rows());
        levels.chain([self.coarsest.rows()]).collect()
    }

    /// Updates the levels for a matrix whose pattern, of version `pattern`, has more blocks than they
    /// were built for. The finest level smooths with the whole matrix; coarser ones use the `fixed` part.
    /// The preconditioner stays symmetric and positive definite, as for any positive definite coarse
    /// matrix.
    ///
    /// # Errors
    /// [`NotPositiveDefinite`] if the fixed part is not positive definite.
    pub(crate) fn update_parts(
        &mut self,
        fixed: &BlockMatrix<D>,
        whole: &BlockMatrix<D>,
        pattern: u64,
    ) -> Result<(), NotPositiveDefinite> {
        let Multigrid { levels, coarsest, held, scale, .. } = self;
        for (i, inverse) in held.coordinates.iter().zip(&mut held.inverse) {
            let (vertex, k) = (*i as usize / D, *i as usize % D);
            *inverse = 1.0 / whole.value[whole.diagonal[vertex] as usize][k][k];
        }
        // A power of two that scales the largest entries to about 1, within single precision.
        let diagonal = whole.diagonal.iter().map(|at| whole.value[*at as usize]);
        let largest = diagonal.flat_map(|block| (0..D).map(move |k| block[k][k])).fold(0.0, f64::max);
        *scale =
            if largest > 0.0 { libm::exp2((-libm::log2(largest).floor()).clamp(-120.0, 120.0)) } else { 1.0 };
        if std::mem::replace(&mut self.pattern, pattern) != pattern {
            levels.iter_mut().take(1).for_each(|finest| finest.smoother = Smoother::new(whole));
        }
        let mut fine = fixed;
        for (l, GridLevel { smoother, prolongation, galerkin, coarse }) in levels.iter_mut().enumerate() {
            smoother.set(if l == 0 { whole } else { fine }, *scale);
            galerkin.compute(fine, prolongation, if l == 0 { &held.mask } else { &[] }, coarse);
            fine = coarse;
        }
        if let Some(GridLevel { coarse, .. }) = levels.last_mut() {
            for at in &coarse.diagonal {
                (0..D).for_each(|k| coarse.value[*at as usize][k][k] *= 1.0 + SHIFT);
            }
        }
        coarsest.set(levels.last().map_or(fixed, |level| &level.coarse), *scale)
    }

    /// Applies one V-cycle to the right-hand side of the first level.
    fn cycle(&mut self) {
        let Multigrid { levels, coarsest, held, .. } = self;
        // Downwards: smooth, and restrict the residual.
        for l in 0..levels.len() {
            let (before, after) = levels.split_at_mut(l + 1);
            let GridLevel { smoother, prolongation, .. } = &mut before[l];
            smoother.smooth_from_zero();
            let next = after.first_mut().map_or(&mut coarsest.x, |level| &mut level.smoother.b);
            prolongation.restrict(&smoother.r, next);
        }
        coarsest.solve();
        // Upwards: add the coarse correction, and smooth.
        for l in (0..levels.len()).rev() {
            let (before, after) = levels.split_at_mut(l + 1);
            let GridLevel { smoother, prolongation, .. } = &mut before[l];
            let next = after.first().map_or(&coarsest.x, |level| &level.smoother.x);
            prolongation.add(next, &mut smoother.x);
            if l == 0 && !held.mask.is_empty() {
                for i in &held.coordinates {
                    smoother.x[*i as usize / D][*i as usize % D] = 0.0;
                }
            }
            smoother.smooth();
        }
    }
}

impl HeldCoordinates {
    /// Collects the coordinates marked in `held`, flat `(vertices, D)`.
    pub fn new<const D: usize>(held: &[bool]) -> Self {
        let bits = |vertex: &[bool; D]| (0..D).map(|k| u8::from(vertex[k]) << k).sum();
        let mut mask: Vec<u8> = held.as_chunks::<D>().0.iter().map(bits).collect();
        let all = (1 << D) - 1;
        if mask.iter().all(|mask| *mask == 0 || *mask == all) {
            mask = vec![];
        }
        let coordinates: Vec<u32> = (0..held.len()).filter(|i| held[*i]).map(|i| i as u32).collect();
        HeldCoordinates { inverse: vec![1.0; coordinates.len()], coordinates, mask }
    }

    /// Returns a byte per vertex, with bit `k` set if component `k` is constrained; empty if no vertex is
    /// constrained in part.
    pub fn mask(&self) -> &[u8] {
        &self.mask
    }
}

impl<const D: usize> Preconditioner<D> for Multigrid<D> {
    fn update(&mut self, matrix: &BlockMatrix<D>) -> Result<(), NotPositiveDefinite> {
        self.update_parts(matrix, matrix, self.pattern)
    }

    fn apply(&mut self, r: &[f64], z: &mut [f64]) {
        if self.levels.is_empty() {
            return self.coarsest.solve_flat(r, z);
        }
        // Normalised, so that residuals of any size fit single precision.
        let largest = r.iter().fold(0.0, |m: f64, r| m.max(r.abs()));
        if !(largest > 0.0 && largest.is_finite()) {
            return z.copy_from_slice(r);
        }
        let smoother = &mut self.levels[0].smoother;
        for (b, r) in smoother.b.iter_mut().zip(r.as_chunks::<D>().0) {
            (0..D).for_each(|k| b[k] = (r[k] / largest) as f32);
        }
        for i in &self.held.coordinates {
            smoother.b[*i as usize / D][*i as usize % D] = 0.0;
        }
        self.cycle();
        let factor = largest * self.scale;
        for (x, z) in self.levels[0].smoother.x.iter().zip(z.as_chunks_mut::<D>().0) {
            (0..D).for_each(|k| z[k] = factor * f64::from(x[k]));
        }
        for (i, inverse) in self.held.coordinates.iter().zip(&self.held.inverse) {
            z[*i as usize] = inverse * r[*i as usize];
        }
    }
}
