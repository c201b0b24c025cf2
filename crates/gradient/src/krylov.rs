//! Corrections of solutions by a matrix that is known by its products, from a factorisation of a part of it.
//!
//! Of friction and of viscosity that follows positions the matrix has a part that is not symmetric, and that
//! no factorisation here has. It is of low rank, as many as there are contacts that rub, and not small beside
//! the stiffness of contact: corrections by the factorisation alone need not shrink. The correction with the
//! least residual in the space that they span does: Saad, Schultz 1986, "GMRES", SIAM Journal on Scientific
//! and Statistical Computing 7, 856, preconditioned from the right.

use crate::adjoint::{add_scaled, dot};

/// Products of one correction: no more rows of the unknowns are kept.
const PRODUCTS: usize = 60;
/// Residuals that have shrunk by this factor are done with.
const SHRUNK: f64 = 1e-14;

/// The correction `c` with the least `|r - A c|` in the space of `B r, B A B r, ..`: `product` writes `A p`
/// over its second argument, `approximate` replaces a vector by its product with `B`, near `A^-1`.
pub(crate) fn correction(
    residual: &[f64],
    approximate: &mut dyn FnMut(&mut [f64]),
    product: &mut dyn FnMut(&[f64], &mut [f64]),
) -> Vec<f64> {
    let (n, size) = (residual.len(), norm(residual));
    let mut basis = vec![residual.iter().map(|r| r / size).collect::<Vec<f64>>()];
    // Columns of the triangle, the rotations that made it, and the right-hand side.
    let (mut columns, mut rotations, mut right) = (vec![], vec![], vec![size]);
    let mut direction = vec![0.0; n];
    while columns.len() < PRODUCTS.min(n) {
        let k = columns.len();
        direction.copy_from_slice(&basis[k]);
        approximate(&mut direction);
        let mut next = vec![0.0; n];
        product(&direction, &mut next);
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
    approximate(&mut sum);
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

    // `I + u w^T` with a large product of rank two: corrections by the identity alone grow.
    #[test]
    fn a_part_of_low_rank_takes_as_many_products() {
        let n = 40;
        let rows: Vec<Vec<f64>> =
            (0..4).map(|k| (0..n).map(|i| (7.3 * (i * i + 11 * k + 1) as f64).sin()).collect()).collect();
        let solution: Vec<f64> = (0..n).map(|i| (i as f64).cos()).collect();
        let mut products = 0;
        let mut product = |p: &[f64], y: &mut [f64]| {
            products += 1;
            y.copy_from_slice(p);
            for pair in rows.chunks_exact(2) {
                add_scaled(y, 10.0 * dot(&pair[1], p), &pair[0]);
            }
        };
        let mut right = vec![0.0; n];
        product(&solution, &mut right);
        let found = correction(&right, &mut |_| {}, &mut product);
        let error = found.iter().zip(&solution).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
        assert!(error < 1e-11, "{error:e}");
        assert!(products <= 1 + 4, "{products}");
    }
}
