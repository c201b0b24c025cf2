//! Preconditioner correction on the vertices of changing stencils, before and after a preconditioner that
//! does not see them.
//!
//! Contact is stiff compared with the elements, and the coarse multigrid levels do not see it: alone,
//! their iterations grow with the contact stiffness. Solving the matrix on the vertices in contact
//! exactly, before and after the cycle, nearly removes that growth (Petrides et al. 2025, arXiv
//! 2505.18576, "filtering"). The combination is symmetric, as conjugate gradients require.

use super::block_matrix::BlockMatrix;
use super::cholesky::{Cholesky, NotPositiveDefinite};
use super::conjugate_gradients::Preconditioner;

/// Exact solves on a subset of the vertices.
pub(super) struct Subspace<const D: usize> {
    /// Vertices, ascending.
    vertices: Vec<u32>,
    /// Pattern version of the factor.
    pattern: u64,
    factor: Option<Cholesky>,
    /// Right-hand side and solution on the subset.
    part: Vec<f64>,
    /// Residual and correction on all vertices.
    residual: Vec<f64>,
    correction: Vec<f64>,
}

impl<const D: usize> Subspace<D> {
    /// Creates an empty subset.
    pub(super) fn new() -> Self {
        Subspace {
            vertices: vec![],
            pattern: 0,
            factor: None,
            part: vec![],
            residual: vec![],
            correction: vec![],
        }
    }

    /// Sets the subset to the vertices at which `whole` differs from its `fixed` part; returns whether
    /// there are any.
    ///
    /// # Errors
    /// If the matrix on the subset is not positive definite.
    pub(super) fn update(
        &mut self,
        whole: &BlockMatrix<D>,
        fixed: &BlockMatrix<D>,
        (pattern, x): (u64, &[f64]),
    ) -> Result<bool, NotPositiveDefinite> {
        if std::ptr::eq(whole, fixed) {
            return Ok(false);
        }
        let diagonal = |matrix: &BlockMatrix<D>, row: usize| matrix.value[matrix.diagonal[row] as usize];
        let differs = |row: &u32| diagonal(whole, *row as usize) != diagonal(fixed, *row as usize);
        let vertices: Vec<u32> = (0..whole.rows() as u32).filter(differs).collect();
        if vertices != self.vertices || pattern != self.pattern {
            (self.vertices, self.pattern, self.factor) = (vertices, pattern, None);
        }
        if self.vertices.is_empty() {
            return Ok(false);
        }
        let matrix = restricted(whole, &self.vertices);
        if self.factor.is_none() {
            let places: Vec<f64> =
                self.vertices.iter().flat_map(|v| &x[*v as usize * D..][..D]).copied().collect();
            self.factor = Cholesky::new(&matrix, &places);
        }
        let Some(factor) = &mut self.factor else { return Err(NotPositiveDefinite) };
        factor.factorize(&matrix)?;
        Ok(true)
    }

    /// Returns the number of factor entries.
    pub(super) fn factor_entries(&self) -> usize {
        self.factor.as_ref().map_or(0, Cholesky::factor_entries)
    }

    /// Adds to `z` the solution for `r - A z` on the subset; without `product`, `A z` is taken as zero.
    fn add_solution(&mut self, product: Option<&BlockMatrix<D>>, r: &[f64], z: &mut [f64]) {
        let Some(factor) = &mut self.factor else { return };
        self.part.clear();
        for v in &self.vertices {
            let mut row = [0.0; D];
            row.copy_from_slice(&r[*v as usize * D..][..D]);
            if let Some(matrix) = product {
                for (c, block) in matrix.row(*v as usize) {
                    let z = &z[c * D..][..D];
                    for k in 0..D {
                        for l in 0..D {
                            row[k] -= block[k][l] * z[l];
                        }
                    }
                }
            }
            self.part.extend_from_slice(&row);
        }
        factor.solve(&mut self.part);
        for (v, solution) in self.vertices.iter().zip(self.part.chunks_exact(D)) {
            let row = &mut z[*v as usize * D..][..D];
            row.iter_mut().zip(solution).for_each(|(z, s)| *z += s);
        }
    }
}

/// Extracts the rows and columns of `vertices`, which ascend.
fn restricted<const D: usize>(matrix: &BlockMatrix<D>, vertices: &[u32]) -> BlockMatrix<D> {
    let (mut row_start, mut column, mut value) = (vec![0], vec![], vec![]);
    for v in vertices {
        for (c, block) in matrix.row(*v as usize) {
            if let Ok(local) = vertices.binary_search(&(c as u32)) {
                column.push(local as u32);
                value.push(*block);
            }
        }
        row_start.push(column.len() as u32);
    }
    BlockMatrix { value, ..BlockMatrix::zero(row_start, column) }
}

/// Symmetric sequence: subspace, inner preconditioner, subspace.
pub(super) struct Corrected<'a, const D: usize> {
    pub(super) matrix: &'a BlockMatrix<D>,
    pub(super) subspace: &'a mut Subspace<D>,
    pub(super) inner: &'a mut dyn Preconditioner<D>,
}

impl<const D: usize> Corrected<'_, D> {
    /// Sets the residual to `r - A z`, with `z` nonzero only on the subset.
    fn renew_residual(&mut self, r: &[f64], z: &[f64]) {
        let Subspace { residual, vertices, .. } = &mut *self.subspace;
        residual.clear();
        residual.extend_from_slice(r);
        for v in vertices {
            // The matrix is symmetric: rows serve as columns.
            let z = &z[*v as usize * D..][..D];
            for (c, block) in self.matrix.row(*v as usize) {
                let row = &mut residual[c * D..][..D];
                for l in 0..D {
                    for k in 0..D {
                        row[k] -= block[l][k] * z[l];
                    }
                }
            }
        }
    }
}

impl<const D: usize> Preconditioner<D> for Corrected<'_, D> {
    fn update(&mut self, matrix: &BlockMatrix<D>) -> Result<(), NotPositiveDefinite> {
        self.inner.update(matrix)
    }

    fn apply(&mut self, r: &[f64], z: &mut [f64]) {
        z.fill(0.0);
        self.subspace.add_solution(None, r, z);
        self.renew_residual(r, z);
        let mut correction = std::mem::take(&mut self.subspace.correction);
        correction.resize(r.len(), 0.0);
        self.inner.apply(&self.subspace.residual, &mut correction);
        z.iter_mut().zip(&correction).for_each(|(z, c)| *z += c);
        self.subspace.correction = correction;
        self.subspace.add_solution(Some(self.matrix), r, z);
    }
}
