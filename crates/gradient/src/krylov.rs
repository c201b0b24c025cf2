//! Linear solver for a matrix known by its products: iterative refinement with a factorisation of its
//! symmetric part, and GMRES.
//!
//! Friction, and viscosity that depends on positions, give the matrix a nonsymmetric part that the
//! factorisation leaves out. Its rank is low, one per contact with friction, but it is not small compared
//! with the stiffness of contact: refinement by the factorisation alone need not converge. The correction
//! with the least residual in the Krylov space does: Saad, Schultz 1986, "GMRES", SIAM Journal on
//! Scientific and Statistical Computing 7, 856, preconditioned from the right.

use pliant::system::System;

use crate::adjoint::add_scaled;
use pliant::algebra::dot;

/// Limit on the products of one GMRES correction, and so on the basis vectors kept.
const PRODUCTS: usize = 60;
/// Relative residual at which a GMRES correction ends.
const SHRUNK: f64 = 1e-14;

/// Limit on the corrections of a solution.
const CORRECTIONS: u32 = 40;
/// Relative residual below which only rounding is left.
const ROUNDING: f64 = 1e-13;
/// Relative residual above which a solution is rejected.
const NO_SOLUTION: f64 = 1e-9;
/// Residual reduction per correction above which conjugate gradients cost more than a factorisation.
const ROUGH: f64 = 0.02;
/// Fraction of the residual goal that later corrections aim at: the norms of the iterations differ from
/// those of residuals here.
const AIM: f64 = 0.1;
/// Largest fraction of a residual that such a correction may leave.
const ROUGHEST: f64 = 1e-3;
/// Residual reduction above which the next correction uses GMRES.
const SLOW: f64 = 0.5;

/// Equations `A p = b` and a matrix `B` close to `A^-1`.
pub(crate) trait CorrectedEquations {
    /// Replaces `b` by `B b`. Iterations may end once the fraction `left` of `b` is left; 0 asks for full
    /// accuracy.
    fn approximate(&mut self, b: &mut [f64], left: f64);

    /// Writes `A p`, zero where fixed.
    fn product(&mut self, p: &[f64], y: &mut [f64]);

    /// Writes `b - A p`, zero where fixed, and returns its largest component, infinite if one is NaN.
    fn residual(&mut self, p: &[f64], residual: &mut [f64]) -> f64;

    /// True if `B` is applied by conjugate gradients, which a factorisation may replace.
    fn is_iterative(&self) -> bool {
        false
    }

    /// Largest residual that rounding of a solution `p` alone can leave, zero if unknown: `epsilon max_i
    /// (sum_j |A_ij p_j| + |b_i|)` times a small number. Corrections in the same precision get no
    /// further; Arioli, Demmel, Duff 1989, "Solving sparse linear systems with sparse backward error",
    /// SIAM Journal on Matrix Analysis and Applications 10, 165.
    fn rounding(&self, p: &[f64]) -> f64 {
        let _ = p;
        0.0
    }
}

/// Solves the equations: adds to `p`, initially zero, the solution for the `residual` `b` with the
/// largest component `size`.
///
/// Returns false if there is no solution, or if conjugate gradients converge slowly. The residual written
/// last is that of the solution.
pub(crate) fn solve(
    equations: &mut dyn CorrectedEquations,
    size: f64,
    residual: &mut Vec<f64>,
    p: &mut [f64],
) -> bool {
    let (mut last, mut is_slow, mut part) = (f64::INFINITY, false, 0.0);
    for _ in 0..CORRECTIONS {
        if is_slow {
            *residual = correction(residual, equations);
        } else {
            equations.approximate(residual, part);
        }
        p.iter_mut().zip(&*residual).for_each(|(p, correction)| *p += correction);
        let left = equations.residual(p, residual);
        let goal = (ROUNDING * size).max(equations.rounding(p));
        if left <= goal || (left <= NO_SOLUTION * size && left >= SLOW * last) {
            return true;
        }
        let is_waste = equations.is_iterative() && (left >= ROUGH * last || !left.is_finite());
        if is_slow && left >= SLOW * last || is_waste && left > NO_SOLUTION * size {
            break;
        }
        is_slow |= left >= SLOW * last;
        (last, part) = (left, (AIM * goal / left).min(ROUGHEST));
    }
    false
}

/// Sets fixed components to zero, in several states one after the other. Returns the largest of the
/// others, infinite if one is NaN.
pub(crate) fn keep_free(system: &System, rows: &mut [f64]) -> f64 {
    let weights = system.inverse_mass();
    rows.iter_mut().enumerate().fold(0.0, |largest: f64, (i, row)| {
        *row = if weights[i % weights.len()] == 0.0 { 0.0 } else { *row };
        if row.is_nan() { f64::INFINITY } else { largest.max(row.abs()) }
    })
}

/// GMRES correction `c` with the least `|r - A c|` in the space of `B r, B A B r, ..`.
fn correction(residual: &[f64], equations: &mut dyn CorrectedEquations) -> Vec<f64> {
    let (n, size) = (residual.len(), norm(residual));
    let mut basis = vec![residual.iter().map(|r| r / size).collect::<Vec<f64>>()];
    // Columns of the triangular factor, its rotations, and the right-hand side.
    let (mut columns, mut rotations, mut right) = (vec![], vec![], vec![size]);
    let mut direction = vec![0.0; n];
    while columns.len() < PRODUCTS.min(n) {
        // Next product, made orthogonal to the basis.
        let k = columns.len();
        direction.copy_from_slice(&basis[k]);
        equations.approximate(&mut direction, 0.0);
        let mut next = vec![0.0; n];
        equations.product(&direction, &mut next);
        let mut column = vec![0.0; k + 2];
        // Orthogonalise twice: the first pass leaves rounding relative to the whole vector.
        for _ in 0..2 {
            for (entry, row) in column.iter_mut().zip(&basis) {
                let part = dot(&next, row);
                *entry += part;
                add_scaled(&mut next, -part, row);
            }
        }
        // Rotations that make the column triangular.
        column[k + 1] = norm(&next);
        for (i, rotation) in rotations.iter().enumerate() {
            rotate(*rotation, &mut column, i);
        }
        let length = column[k].hypot(column[k + 1]);
        if !(length.is_finite() && length > 0.0) {
            break;
        }
        let (rotation, left) = ((column[k] / length, column[k + 1] / length), column[k + 1]);
        rotate(rotation, &mut column, k);
        right.push(0.0);
        rotate(rotation, &mut right, k);
        rotations.push(rotation);
        columns.push(column);
        if right[k + 1].abs() <= SHRUNK * size || left == 0.0 {
            break;
        }
        next.iter_mut().for_each(|next| *next /= left);
        basis.push(next);
    }
    // Back substitution.
    let mut sum = vec![0.0; n];
    for k in (0..columns.len()).rev() {
        let factor = right[k] / columns[k][k];
        (0..k).for_each(|i| right[i] -= factor * columns[k][i]);
        add_scaled(&mut sum, factor, &basis[k]);
    }
    equations.approximate(&mut sum, 0.0);
    sum
}

/// Rotates entries `i` and `i + 1` by the angle of this cosine and sine.
fn rotate((cosine, sine): (f64, f64), entries: &mut [f64], i: usize) {
    let (a, b) = (entries[i], entries[i + 1]);
    (entries[i], entries[i + 1]) = (cosine * a + sine * b, cosine * b - sine * a);
}

fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `I + sum_k u_k w_k^T`, preconditioned by the identity, which reduces no residual.
    struct LowRank {
        rows: Vec<Vec<f64>>,
        b: Vec<f64>,
        products: usize,
    }

    impl CorrectedEquations for LowRank {
        fn approximate(&mut self, _: &mut [f64], _: f64) {}

        fn product(&mut self, p: &[f64], y: &mut [f64]) {
            self.products += 1;
            y.copy_from_slice(p);
            for pair in self.rows.chunks_exact(2) {
                add_scaled(y, 10.0 * dot(&pair[1], p), &pair[0]);
            }
        }

        fn residual(&mut self, p: &[f64], residual: &mut [f64]) -> f64 {
            self.product(p, residual);
            residual.iter_mut().zip(&self.b).for_each(|(r, b)| *r = b - *r);
            residual.iter().fold(0.0, |largest: f64, r| largest.max(r.abs()))
        }
    }

    #[test]
    fn a_part_of_low_rank_takes_as_many_products() {
        let n = 40;
        let rows: Vec<Vec<f64>> =
            (0..4).map(|k| (0..n).map(|i| (7.3 * (i * i + 11 * k + 1) as f64).sin()).collect()).collect();
        let solution: Vec<f64> = (0..n).map(|i| (i as f64).cos()).collect();
        let mut equations = LowRank { rows, b: vec![0.0; n], products: 0 };
        let mut right = vec![0.0; n];
        equations.product(&solution, &mut right);
        equations.b.clone_from(&right);
        let error =
            |found: &[f64]| found.iter().zip(&solution).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
        let found = correction(&right, &mut equations);
        assert!(error(&found) < 1e-11, "{:e}", error(&found));
        assert!(equations.products <= 1 + 4, "{}", equations.products);
        let (size, mut p) = (norm(&right), vec![0.0; n]);
        assert!(solve(&mut equations, size, &mut right, &mut p));
        assert!(error(&p) < 1e-11, "{:e}", error(&p));
    }
}
