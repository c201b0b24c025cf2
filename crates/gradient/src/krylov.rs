//! Solutions by a matrix that is known by its products, by corrections with a factorisation of a part of it.
//!
//! Of friction and of viscosity that follows positions the matrix has a part that is not symmetric, and that
//! no factorisation here has. It is of low rank, as many as there are contacts that rub, and not small beside
//! the stiffness of contact: corrections by the factorisation alone need not shrink. The correction with the
//! least residual in the space that they span does: Saad, Schultz 1986, "GMRES", SIAM Journal on Scientific
//! and Statistical Computing 7, 856, preconditioned from the right.

use pliant::system::System;

use crate::adjoint::{add_scaled, dot};

/// Products of one correction: no more rows of the unknowns are kept.
const PRODUCTS: usize = 60;
/// Residuals that have shrunk by this factor are done with.
const SHRUNK: f64 = 1e-14;

/// Corrections of a solution.
const CORRECTIONS: u32 = 40;
/// Residuals below this part of the right-hand side are rounding.
const ROUNDING: f64 = 1e-13;
/// Residuals above this part are no solution.
const NO_SOLUTION: f64 = 1e-9;
/// A correction by conjugate gradients that leaves more of the residual than this costs more than factors.
const ROUGH: f64 = 0.02;
/// Part of a residual below its goal that corrections after the first aim at: norms of iterations are not
/// those of residuals here.
const AIM: f64 = 0.1;
/// The largest part of a residual that such a correction may leave.
const ROUGHEST: f64 = 1e-3;
/// A correction that leaves more of the residual than this makes the next one span a space.
const SLOW: f64 = 0.5;

/// Equations `A p = b` and a matrix `B` near `A^-1`.
pub(crate) trait CorrectedEquations {
    /// Replaces `b` by `B b`. Iterations may end where this part of `b` is left; 0 asks for all they can.
    fn approximate(&mut self, b: &mut [f64], left: f64);

    /// Writes `A p`, zero where held.
    fn product(&mut self, p: &[f64], y: &mut [f64]);

    /// Writes `b - A p`, zero where held; gives its largest component, infinite where one is no number.
    fn residual(&mut self, p: &[f64], residual: &mut [f64]) -> f64;

    /// True if `B` is made by conjugate gradients, and factors may take their place.
    fn is_iterative(&self) -> bool {
        false
    }

    /// The largest residual that the rounding of a solution `p` to the precision of numbers alone can leave,
    /// zero where that is not known: `epsilon max_i (sum_j |A_ij p_j| + |b_i|)` times a small number.
    /// Corrections of the same precision lead no further; Arioli, Demmel, Duff 1989, "Solving sparse linear
    /// systems with sparse backward error", SIAM Journal on Matrix Analysis and Applications 10, 165.
    fn rounding(&self, p: &[f64]) -> f64 {
        let _ = p;
        0.0
    }
}

/// Adds the solution to `p`, zero before, of the `residual` `b` whose largest component is `size`; false
/// where there is none, or conjugate gradients lead there slowly. The residual that is written last is that
/// of the solution.
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

/// Makes held components zero, of several states one after the other; gives the largest of the others,
/// infinite where one is no number.
pub(crate) fn keep_free(system: &System, rows: &mut [f64]) -> f64 {
    let weights = system.inverse_mass();
    rows.iter_mut().enumerate().fold(0.0, |largest: f64, (i, row)| {
        *row = if weights[i % weights.len()] == 0.0 { 0.0 } else { *row };
        if row.is_nan() { f64::INFINITY } else { largest.max(row.abs()) }
    })
}

/// The correction `c` with the least `|r - A c|` in the space of `B r, B A B r, ..`.
fn correction(residual: &[f64], equations: &mut dyn CorrectedEquations) -> Vec<f64> {
    let (n, size) = (residual.len(), norm(residual));
    let mut basis = vec![residual.iter().map(|r| r / size).collect::<Vec<f64>>()];
    // Columns of the triangle, the rotations that made it, and the right-hand side.
    let (mut columns, mut rotations, mut right) = (vec![], vec![], vec![size]);
    let mut direction = vec![0.0; n];
    while columns.len() < PRODUCTS.min(n) {
        let k = columns.len();
        direction.copy_from_slice(&basis[k]);
        equations.approximate(&mut direction, 0.0);
        let mut next = vec![0.0; n];
        equations.product(&direction, &mut next);
        let mut column = vec![0.0; k + 2];
        // Twice, because the first time leaves rounding of the whole of it.
        for _ in 0..2 {
            for (entry, row) in column.iter_mut().zip(&basis) {
                let part = dot(&next, row);
                *entry += part;
                add_scaled(&mut next, -part, row);
            }
        }
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
    let mut sum = vec![0.0; n];
    for k in (0..columns.len()).rev() {
        let factor = right[k] / columns[k][k];
        (0..k).for_each(|i| right[i] -= factor * columns[k][i]);
        add_scaled(&mut sum, factor, &basis[k]);
    }
    equations.approximate(&mut sum, 0.0);
    sum
}

/// Turns entries `i` and `i + 1` by an angle of this cosine and sine.
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

    /// `I + sum_k u_k w_k^T`, corrected by the identity, which makes nothing smaller.
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
