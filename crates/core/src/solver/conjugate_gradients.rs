//! Preconditioned conjugate gradients.

use super::block_matrix::{Block, BlockMatrix};
use super::cholesky::NotPositiveDefinite;
use crate::deadline::Stop;

/// Something that approximates `A^-1`: symmetric and positive definite.
pub trait Preconditioner<const D: usize>: Send + Sync {
    /// Takes note of a new matrix.
    ///
    /// # Errors
    /// The matrix was seen not to be positive definite.
    fn update(&mut self, matrix: &BlockMatrix<D>) -> Result<(), NotPositiveDefinite>;

    /// `z = P r`.
    fn apply(&mut self, r: &[f64], z: &mut [f64]);

    /// Bytes held.
    fn bytes(&self) -> usize;
}

/// Inverts the diagonal blocks.
#[derive(Default)]
pub struct BlockJacobi<const D: usize> {
    inverse: Vec<Block<D>>,
}

impl<const D: usize> Preconditioner<D> for BlockJacobi<D> {
    fn update(&mut self, matrix: &BlockMatrix<D>) -> Result<(), NotPositiveDefinite> {
        self.inverse.clear();
        self.inverse.extend(matrix.diagonal.iter().map(|at| inverse(&matrix.value[*at as usize])));
        Ok(())
    }

    fn apply(&mut self, r: &[f64], z: &mut [f64]) {
        let rows = r.as_chunks::<D>().0.iter().zip(z.as_chunks_mut::<D>().0);
        for ((r, z), block) in rows.zip(&self.inverse) {
            for k in 0..D {
                z[k] = (0..D).map(|l| block[k][l] * r[l]).sum();
            }
        }
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.inverse[..])
    }
}

/// The inverse of a positive definite block by Cholesky; where it is none, of its diagonal.
pub(super) fn inverse<const D: usize>(a: &Block<D>) -> Block<D> {
    let mut l = [[0.0; D]; D];
    for i in 0..D {
        for j in 0..=i {
            let sum = a[i][j] - (0..j).map(|k| l[i][k] * l[j][k]).sum::<f64>();
            if i == j && (sum.is_nan() || sum <= 1e-14 * a[i][i]) {
                return diagonal_inverse(a);
            }
            l[i][j] = if i == j { sum.sqrt() } else { sum / l[j][j] };
        }
    }
    let mut r = [[0.0; D]; D];
    for column in 0..D {
        let mut y = [0.0; D];
        for i in 0..D {
            let right = if i == column { 1.0 } else { 0.0 };
            y[i] = (right - (0..i).map(|k| l[i][k] * y[k]).sum::<f64>()) / l[i][i];
        }
        for i in (0..D).rev() {
            y[i] = (y[i] - (i + 1..D).map(|k| l[k][i] * y[k]).sum::<f64>()) / l[i][i];
        }
        for i in 0..D {
            r[i][column] = y[i];
        }
    }
    r
}

fn diagonal_inverse<const D: usize>(a: &Block<D>) -> Block<D> {
    let mut r = [[0.0; D]; D];
    for i in 0..D {
        r[i][i] = if a[i][i] > 0.0 { 1.0 / a[i][i] } else { 1.0 };
    }
    r
}

/// How a run of conjugate gradients ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CgEnd {
    /// The residual is small enough.
    Converged,
    /// A direction `p` with `p^T A p <= 0`, or a preconditioned residual with `r^T P r <= 0`: the matrix is not positive definite.
    Indefinite,
    /// The residual no longer falls, or the iterations are used up.
    Stalled,
    /// It was told to end.
    Stopped,
}

/// Outcome of conjugate gradients.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CgReport {
    /// How it ended.
    pub end: CgEnd,
    /// Iterations, each with one product.
    pub iterations: u64,
    /// `|b - A x| / |b|` as updated along the way.
    pub relative_residual: f64,
}

/// Memory of [`ConjugateGradients::solve`].
#[derive(Debug, Default)]
pub struct ConjugateGradients {
    r: Vec<f64>,
    z: Vec<f64>,
    p: Vec<f64>,
    q: Vec<f64>,
    stop: Stop,
}

impl ConjugateGradients {
    /// Ends solves while the flag is set, which is looked at in every iteration.
    pub(crate) fn set_stop(&mut self, stop: Stop) {
        self.stop = stop;
    }

    /// Solves `A x = b` from `x = 0` until `|b - A x| <= tolerance |b|`; Shewchuk 1994, *An introduction to the conjugate
    /// gradient method without the agonizing pain*, B3. `product(p, q)` writes `A p` to `q`.
    ///
    /// Where `A` is indefinite, `x` is the iterate before the direction in which that showed, or in the first iteration a part of that
    /// direction: a way down for who minimises; Nocedal, Wright 2006, *Numerical optimization*, algorithm 7.1.
    pub fn solve<const D: usize>(
        &mut self,
        mut product: impl FnMut(&[f64], &mut [f64]),
        preconditioner: &mut dyn Preconditioner<D>,
        b: &[f64],
        x: &mut [f64],
        tolerance: f64,
        max_iterations: u64,
    ) -> CgReport {
        let ConjugateGradients { r, z, p, q, stop } = self;
        for v in [&mut *r, &mut *z, &mut *p, &mut *q] {
            v.resize(b.len(), 0.0);
        }
        x.fill(0.0);
        r.copy_from_slice(b);
        let length = dot(b, b).sqrt();
        let report = |end, iterations, residual: f64| CgReport {
            end,
            iterations,
            relative_residual: if length > 0.0 { residual / length } else { 0.0 },
        };
        if length == 0.0 {
            return report(CgEnd::Converged, 0, 0.0);
        }
        preconditioner.apply(r, z);
        p.copy_from_slice(z);
        let mut rz = dot(r, z);
        for iteration in 1..=max_iterations {
            if stop.is_set() {
                return report(CgEnd::Stopped, iteration - 1, dot(r, r).sqrt());
            }
            product(p, q);
            let curvature = dot(p, q);
            if curvature.is_nan() || curvature <= 0.0 {
                let residual = dot(r, r).sqrt();
                let end = if curvature.is_nan() { CgEnd::Stalled } else { CgEnd::Indefinite };
                if iteration == 1 && curvature < 0.0 {
                    x.iter_mut().zip(&*p).for_each(|(x, p)| *x = rz / -curvature * p);
                }
                return report(end, iteration, residual);
            }
            let alpha = rz / curvature;
            for i in 0..x.len() {
                x[i] += alpha * p[i];
                r[i] -= alpha * q[i];
            }
            let residual = dot(r, r).sqrt();
            if residual <= tolerance * length {
                return report(CgEnd::Converged, iteration, residual);
            }
            preconditioner.apply(r, z);
            let next = dot(r, z);
            if next.is_nan() || next <= 0.0 {
                let end = if next.is_nan() { CgEnd::Stalled } else { CgEnd::Indefinite };
                return report(end, iteration, residual);
            }
            let beta = next / rz;
            rz = next;
            for i in 0..p.len() {
                p[i] = z[i] + beta * p[i];
            }
        }
        let residual = dot(r, r).sqrt();
        report(CgEnd::Stalled, max_iterations, residual)
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        8 * (self.r.len() + self.z.len() + self.p.len() + self.q.len())
    }
}

/// Bytes that a solver of so many unknowns holds.
pub(super) fn bytes(unknowns: usize) -> usize {
    8 * 4 * unknowns
}

/// The sum of products, in an order that does not depend on the number of threads.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (a, a_rest) = a.as_chunks::<8>();
    let (b, b_rest) = b.as_chunks::<8>();
    for (a, b) in a.iter().zip(b) {
        for k in 0..8 {
            sums[k] += a[k] * b[k];
        }
    }
    sums.iter().sum::<f64>() + a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum::<f64>()
}
