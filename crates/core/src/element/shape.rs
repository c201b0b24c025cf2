//! Shape functions of simplices of first and second order.
//!
//! With barycentric coordinates `lambda_0 .. lambda_D` and `xi_k = lambda_k`, `k = 1 .. D`:
//! - first order, `D + 1` nodes: `N_i = lambda_i`;
//! - second order, 6 nodes in 2D and 10 in 3D: `N_i = lambda_i (2 lambda_i - 1)` at the corners, `N_ij = 4
//!   lambda_i lambda_j` in the middle of the edges, corners first, then edges in the order of VTK.
//!
//! Zienkiewicz, Taylor, Zhu 2013, *The Finite Element Method: Its Basis and Fundamentals*, section 6.3.2 and
//! 6.3.4.

use super::cell::{point_count, second_order_cell};
use crate::algebra::Mat;

/// Corners of the edges of a tetrahedron, in the order of their middle nodes.
pub const TETRAHEDRON_EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]];

/// Corners of the edges of a triangle, in the order of their middle nodes.
pub const TRIANGLE_EDGES: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];

/// Barycentric coordinates `lambda_0 .. lambda_D`, with sum 1; in 2D the last entry is 0. In cells other
/// than simplices: the reference coordinates `xi_k`, then zeros.
pub type Barycentric = [f64; 4];

/// Returns the order, 1 or 2, of the simplex with `N` nodes in `D` dimensions; 2 for [other
/// cells](crate::element::CELL_KINDS), which are of second order here.
///
/// # Panics
/// If no element has these numbers, when the function is compiled for them.
pub const fn order<const D: usize, const N: usize>() -> usize {
    match (D, N) {
        (2, 3) | (3, 4) => 1,
        (2, 6) | (3, 10) => 2,
        _ if point_count::<D, N>() > 0 => 2,
        _ => panic!("a simplex has 3 or 6 nodes in 2D, 4 or 10 in 3D"),
    }
}

/// True for simplices.
pub(crate) const fn is_simplex<const D: usize, const N: usize>() -> bool {
    point_count::<D, N>() == 0
}

/// Returns the corners of the edge of each middle node, in the order of these nodes; empty for first
/// order.
pub(crate) const fn middle_edges<const D: usize, const N: usize>() -> &'static [[usize; 2]] {
    match (order::<D, N>(), D) {
        (1, _) => &[],
        (_, 2) => &TRIANGLE_EDGES,
        _ => &TETRAHEDRON_EDGES,
    }
}

/// Returns the values `N_a` of the shape functions.
pub fn shape_functions<const D: usize, const N: usize>(lambda: &Barycentric) -> [f64; N] {
    if let Some(cell) = second_order_cell::<D, N>() {
        return (cell.shape)(&leading(lambda));
    }
    let mut values = [0.0; N];
    for i in 0..=D {
        values[i] = if order::<D, N>() == 1 { lambda[i] } else { lambda[i] * (2.0 * lambda[i] - 1.0) };
    }
    for (value, [i, j]) in values[D + 1..].iter_mut().zip(middle_edges::<D, N>()) {
        *value = 4.0 * lambda[*i] * lambda[*j];
    }
    values
}

/// Returns the first `D` coordinates.
pub(super) fn leading<const D: usize>(place: &Barycentric) -> [f64; D] {
    let mut xi = [0.0; D];
    xi.copy_from_slice(&place[..D]);
    xi
}

/// Returns the derivatives `dN_a / dxi_k`, `(N, D)`, with `d/dxi_k = d/dlambda_k - d/dlambda_0`.
pub fn reference_gradients<const D: usize, const N: usize>(lambda: &Barycentric) -> [[f64; D]; N] {
    if let Some(cell) = second_order_cell::<D, N>() {
        return (cell.slopes)(&leading(lambda));
    }
    // Adds `slope` times the derivative of `lambda_i`.
    let add = |gradient: &mut [f64; D], i: usize, slope: f64| {
        if i == 0 {
            gradient.iter_mut().for_each(|g| *g -= slope);
        } else {
            gradient[i - 1] += slope;
        }
    };
    let mut gradients = [[0.0; D]; N];
    for i in 0..=D {
        let slope = if order::<D, N>() == 1 { 1.0 } else { 4.0 * lambda[i] - 1.0 };
        add(&mut gradients[i], i, slope);
    }
    for (gradient, &[i, j]) in gradients[D + 1..].iter_mut().zip(middle_edges::<D, N>()) {
        add(gradient, i, 4.0 * lambda[j]);
        add(gradient, j, 4.0 * lambda[i]);
    }
    gradients
}

/// Returns `J = sum_a X_a (dN_a / dxi)^T`; column `k` is the derivative of the position by `xi_k` [m].
pub fn jacobian<const D: usize, const N: usize>(points: &[[f64; D]; N], lambda: &Barycentric) -> Mat<f64, D> {
    let mut j = Mat::zero();
    for (point, gradient) in points.iter().zip(reference_gradients::<D, N>(lambda)) {
        for r in 0..D {
            for c in 0..D {
                // Relative to the first corner: positions far from the origin lose no digits.
                j[r][c] += (point[r] - points[0][r]) * gradient[c];
            }
        }
    }
    j
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::algebra::tests::sample::Random;

    /// Returns a random point inside the element.
    pub(crate) fn inside<const D: usize>(random: &mut Random) -> Barycentric {
        let mut lambda = [0.0; 4];
        for l in &mut lambda[..=D] {
            *l = random.uniform(0.0, 1.0);
        }
        let sum: f64 = lambda.iter().sum();
        lambda.map(|l| l / sum)
    }

    /// Returns the nodes of the reference element, in barycentric coordinates.
    fn nodes<const D: usize, const N: usize>() -> Vec<Barycentric> {
        let corner = |i: usize| std::array::from_fn(|k| f64::from(u8::from(k == i)));
        let mut nodes: Vec<Barycentric> = (0..=D).map(corner).collect();
        for [i, j] in middle_edges::<D, N>() {
            nodes.push(std::array::from_fn(|k| 0.5 * (nodes[*i][k] + nodes[*j][k])));
        }
        nodes
    }

    fn is_a_lagrange_basis<const D: usize, const N: usize>() {
        for (a, node) in nodes::<D, N>().iter().enumerate() {
            let values = shape_functions::<D, N>(node);
            for (b, value) in values.iter().enumerate() {
                assert_eq!(*value, f64::from(u8::from(a == b)), "{D}D, {N} nodes: N_{b} at node {a}");
            }
        }
        let mut random = Random(3);
        for _ in 0..20 {
            let lambda = inside::<D>(&mut random);
            let sum: f64 = shape_functions::<D, N>(&lambda).iter().sum();
            assert!((sum - 1.0).abs() < 1e-15, "{sum}");
            let gradients = reference_gradients::<D, N>(&lambda);
            for k in 0..D {
                assert!(gradients.iter().map(|g| g[k]).sum::<f64>().abs() < 2e-15);
                // Central differences of quadratic functions are exact.
                let moved = |step: f64| {
                    let mut at = lambda;
                    at[k + 1] += step;
                    at[0] -= step;
                    shape_functions::<D, N>(&at)
                };
                let (ahead, behind) = (moved(0.125), moved(-0.125));
                for a in 0..N {
                    assert!((gradients[a][k] - 4.0 * (ahead[a] - behind[a])).abs() < 1e-14);
                }
            }
        }
    }

    #[test]
    fn shape_functions_are_one_at_their_node_and_zero_at_the_others_and_have_these_derivatives() {
        is_a_lagrange_basis::<2, 3>();
        is_a_lagrange_basis::<3, 4>();
        is_a_lagrange_basis::<2, 6>();
        is_a_lagrange_basis::<3, 10>();
    }
}
