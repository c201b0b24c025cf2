//! Second-order elements at their quadrature points, for kernels.
//!
//! At quadrature point `q` one barycentric coordinate is `n` ([`near`]), the others are `f` ([`far`]).
//! Let `S_i` be the sum of the nodes in the middle of the edges at corner `i`, and `y_iq` the node
//! between the corners `i` and `q` (the corner itself for `i = q`). The derivative of the position with
//! respect to `lambda_i` is
//!
//! `A_i = (4 f - 1) x_i + 4 f S_i + 4 (n - f) y_iq`,
//!
//! and column `k` of `dx/dxi` is `A_k - A_0`. Only the last term depends on `q`. The gradient uses the
//! transpose. In cells other than simplices both are sums over the derivatives of the shape functions at
//! the points.

use super::cell::second_order_cell;
use super::quadrature::{far, near};
use super::shape::is_simplex;
use crate::algebra::Mat;
use crate::scalar::Scalar;

/// Returns the node between two corners of a simplex; the corner itself if both are the same.
#[inline(always)]
const fn between<const D: usize>(i: usize, q: usize) -> usize {
    const TRIANGLE: [[usize; 3]; 3] = [[0, 3, 5], [3, 1, 4], [5, 4, 2]];
    const TETRAHEDRON: [[usize; 4]; 4] = [[0, 4, 6, 7], [4, 1, 5, 8], [6, 5, 2, 9], [7, 8, 9, 3]];
    if D == 2 { TRIANGLE[i][q] } else { TETRAHEDRON[i][q] }
}

/// Positions of an element, prepared for its quadrature points.
pub(crate) struct QuadraticPositions<S, const D: usize, const N: usize> {
    /// Positions relative to the first corner, in simplices times `4 (n - f)`.
    nodes: [[S; D]; N],
    /// Part independent of `q`: entry `k - 1` is `(4 f - 1)(x_k - x_0) + 4 f (S_k - S_0)`.
    common: [[S; D]; D],
}

impl<S: Scalar, const D: usize, const N: usize> QuadraticPositions<S, D, N> {
    #[inline(always)]
    pub(crate) fn new(mut x: [[S; D]; N]) -> Self {
        // Relative to the first corner: positions far from the origin lose no digits.
        for a in 1..N {
            for c in 0..D {
                x[a][c] -= x[0][c];
            }
        }
        x[0] = [S::zero(); D];
        let mut common = [[S::zero(); D]; D];
        if !is_simplex::<D, N>() {
            return QuadraticPositions { nodes: x, common };
        }
        let middle = S::splat(4.0 * far::<D>());
        let corner = S::splat(4.0 * far::<D>() - 1.0);
        for c in 0..D {
            let mut first = x[between::<D>(0, 1)][c];
            for j in 2..D + 1 {
                first += x[between::<D>(0, j)][c];
            }
            for k in 1..D + 1 {
                let mut sum = -first;
                for j in 0..D + 1 {
                    if j != k {
                        sum += x[between::<D>(k, j)][c];
                    }
                }
                common[k - 1][c] = corner.mul_add(x[k][c], middle * sum);
            }
        }
        let own = S::splat(4.0 * (near::<D>() - far::<D>()));
        for a in 1..N {
            for c in 0..D {
                x[a][c] = own * x[a][c];
            }
        }
        QuadraticPositions { nodes: x, common }
    }

    /// Returns `dx/dxi` at quadrature point `q`.
    #[inline(always)]
    pub(crate) fn at(&self, q: usize) -> Mat<S, D> {
        if let Some(cell) = second_order_cell::<D, N>() {
            return self.by_slopes(&cell.slopes_at_points[q]);
        }
        let first = &self.nodes[between::<D>(0, q)];
        let mut m = Mat::zero();
        for k in 1..D + 1 {
            let own = &self.nodes[between::<D>(k, q)];
            for c in 0..D {
                m[c][k - 1] = self.common[k - 1][c] + (own[c] - first[c]);
            }
        }
        m
    }

    /// Returns `sum_a (x_a - x_0) (dN_a/dxi)^T`.
    #[inline(always)]
    fn by_slopes(&self, slopes: &[[f64; D]; N]) -> Mat<S, D> {
        let mut m = Mat::zero();
        for a in 1..N {
            for k in 0..D {
                let slope = S::splat(slopes[a][k]);
                for c in 0..D {
                    m[c][k] = slope.mul_add(self.nodes[a][c], m[c][k]);
                }
            }
        }
        m
    }
}

/// Sum of the gradient of an element at its nodes.
pub(crate) struct QuadraticGradients<S, const D: usize, const N: usize> {
    /// Sums of the contributions of quadrature points to `y_iq`.
    nodes: [[S; D]; N],
    /// Sums over all `q` of the columns `1 .. D`.
    common: [[S; D]; D],
}

impl<S: Scalar, const D: usize, const N: usize> QuadraticGradients<S, D, N> {
    #[inline(always)]
    pub(crate) fn new() -> Self {
        QuadraticGradients { nodes: [[S::zero(); D]; N], common: [[S::zero(); D]; D] }
    }

    /// Adds the contribution of quadrature point `q`, given `H = w P J^-T` there.
    #[inline(always)]
    pub(crate) fn add(&mut self, q: usize, h: &Mat<S, D>) {
        if let Some(cell) = second_order_cell::<D, N>() {
            return self.add_by_slopes(&cell.slopes_at_points[q], h);
        }
        for c in 0..D {
            let mut sum = h[c][0];
            for k in 1..D {
                sum += h[c][k];
            }
            self.nodes[between::<D>(0, q)][c] -= sum;
            for k in 0..D {
                self.nodes[between::<D>(k + 1, q)][c] += h[c][k];
                self.common[k][c] += h[c][k];
            }
        }
    }

    #[inline(always)]
    fn add_by_slopes(&mut self, slopes: &[[f64; D]; N], h: &Mat<S, D>) {
        for a in 1..N {
            for k in 0..D {
                let slope = S::splat(slopes[a][k]);
                for c in 0..D {
                    self.nodes[a][c] = slope.mul_add(h[c][k], self.nodes[a][c]);
                }
            }
        }
    }

    /// Returns the gradients at the nodes. The first corner gets minus the sum of all others, so that the
    /// net force is zero.
    #[inline(always)]
    pub(crate) fn finish(mut self) -> [[S; D]; N] {
        if is_simplex::<D, N>() {
            self.add_common();
        }
        let mut g = self.nodes;
        for c in 0..D {
            let mut sum = g[1][c];
            for a in 2..N {
                sum += g[a][c];
            }
            g[0][c] = -sum;
        }
        g
    }

    /// Adds the part of a simplex that is independent of the quadrature point.
    #[inline(always)]
    fn add_common(&mut self) {
        let QuadraticGradients { nodes: g, common } = self;
        let middle = S::splat(4.0 * far::<D>());
        let corner = S::splat(4.0 * far::<D>() - 1.0);
        let own = S::splat(4.0 * (near::<D>() - far::<D>()));
        for c in 0..D {
            let mut first = common[0][c];
            for k in 1..D {
                first += common[k][c];
            }
            for k in 1..D + 1 {
                g[k][c] = own.mul_add(g[k][c], corner * common[k - 1][c]);
                let node = between::<D>(0, k);
                g[node][c] = own.mul_add(g[node][c], middle * (common[k - 1][c] - first));
                for j in k + 1..D + 1 {
                    let node = between::<D>(k, j);
                    g[node][c] = own.mul_add(g[node][c], middle * (common[k - 1][c] + common[j - 1][c]));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::algebra::tests::sample::Random;
    use crate::element::shape::middle_edges;
    use crate::element::{jacobian, quadrature_position, reference_gradients};

    fn agrees<const D: usize, const N: usize>() {
        for (k, [i, j]) in middle_edges::<D, N>().iter().enumerate().filter(|_| is_simplex::<D, N>()) {
            assert_eq!([between::<D>(*i, *j), between::<D>(*j, *i)], [D + 1 + k; 2]);
        }
        let mut random = Random(5);
        let x: [[f64; D]; N] = std::array::from_fn(|_| std::array::from_fn(|_| random.uniform(-1.0, 1.0)));
        let positions = QuadraticPositions::new(x);
        let mut gradients = QuadraticGradients::<f64, D, N>::new();
        let mut expected = [[0.0; D]; N];
        for q in 0..crate::element::quadrature_count::<D, N>() {
            let lambda = quadrature_position::<D, N>(q);
            let error = (positions.at(q) - jacobian(&x, &lambda)).norm_squared().sqrt();
            let bound = if is_simplex::<D, N>() { 1e-14 } else { 1e-14 * N as f64 };
            assert!(error < bound, "point {q}: dx/dxi off by {error:e}");
            let h = random.gaussian::<D>();
            gradients.add(q, &h);
            for (e, n) in expected.iter_mut().zip(reference_gradients::<D, N>(&lambda)) {
                let pull = h.mul_vec(&n);
                (0..D).for_each(|c| e[c] += pull[c]);
            }
        }
        let found = gradients.finish();
        let bound = if is_simplex::<D, N>() { 2e-14 } else { 5e-15 * N as f64 };
        for a in 0..N {
            for c in 0..D {
                assert!((found[a][c] - expected[a][c]).abs() < bound, "{D}D, node {a}");
            }
        }
    }

    #[test]
    fn the_short_forms_for_kernels_are_the_sums_over_shape_gradients() {
        agrees::<2, 6>();
        agrees::<3, 10>();
        agrees::<2, 8>();
        agrees::<2, 9>();
        agrees::<3, 20>();
        agrees::<3, 27>();
    }
}
