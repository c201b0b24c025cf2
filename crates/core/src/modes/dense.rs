//! All modes at once, by a dense eigensolver.

use pliant_sparse::symmetric_eigen;

use super::eigen::square;
use super::lanczos::EigenPair;
use crate::solver::block_matrix::BlockMatrix;

/// Most free coordinates: the matrix and its vectors take 128 MB each.
pub(super) const MOST: usize = 4000;

/// Computes all pairs of `K phi = omega^2 M phi`, lowest first, with `M` diagonal and zero at constrained
/// coordinates: the dense eigenproblem of `M^-1/2 K M^-1/2`, whose eigenvectors are accurate to a few
/// roundings of the largest eigenvalue. The squares are Rayleigh quotients. `None` if the iteration
/// fails.
pub(super) fn all<const D: usize>(matrix: &BlockMatrix<D>, mass: &[f64]) -> Option<Vec<(f64, EigenPair)>> {
    let free: Vec<usize> = (0..mass.len()).filter(|n| mass[*n] > 0.0).collect();
    let mut place = vec![usize::MAX; mass.len()];
    free.iter().enumerate().for_each(|(at, n)| place[*n] = at);
    let n = free.len();
    let mut scaled = vec![0.0; n * n];
    for row in 0..matrix.rows() {
        for (column, block) in matrix.row(row) {
            for k in 0..D {
                for l in 0..D {
                    let (i, j) = (row * D + k, column * D + l);
                    if mass[i] > 0.0 && mass[j] > 0.0 {
                        scaled[place[i] * n + place[j]] = block[k][l] / (mass[i] * mass[j]).sqrt();
                    }
                }
            }
        }
    }
    let eigen = symmetric_eigen(n, |i, j| scaled[i * n + j])?;
    let largest = eigen.values.iter().fold(0.0, |m: f64, value| m.max(value.abs()));
    let rounding = 64.0 * free.len() as f64 * f64::EPSILON * largest;
    let pair = |j: usize| {
        let mut vector = vec![0.0; mass.len()];
        free.iter().enumerate().for_each(|(i, n)| vector[*n] = eigen.vector(i, j) / mass[*n].sqrt());
        let square = square(matrix, &vector, largest);
        let residual = if square == 0.0 { 0.0 } else { rounding / square.abs() };
        (square, EigenPair { residual, vector })
    };
    let mut pairs: Vec<(f64, EigenPair)> = (0..free.len()).map(pair).collect();
    pairs.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    Some(pairs)
}
