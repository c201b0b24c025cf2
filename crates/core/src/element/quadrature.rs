//! Quadrature points of the energy of an element.

use super::cell::{point_count, second_order_cell};
use super::shape::{Barycentric, is_simplex, jacobian, leading, order, reference_gradients};
use crate::algebra::Mat;

/// Returns the number of quadrature points of the energy of the element with `N` nodes in `D` dimensions:
/// one for simplices of first order, whose `F` is constant, `D + 1` for simplices of second order; other
/// cells of second order have [their own](super::Isoparametric::points).
pub const fn quadrature_count<const D: usize, const N: usize>() -> usize {
    match point_count::<D, N>() {
        0 if order::<D, N>() == 1 => 1,
        0 => D + 1,
        points => points,
    }
}

/// The largest [`quadrature_count`].
pub const MOST_POINTS: usize = 27;

/// Returns the coordinate `lambda_q` of quadrature point `q` of second order; all others are [`far`].
///
/// The rule of `D + 1` points with equal weights is exact for polynomials of degree 2, which suffices for
/// the linear stiffness of a straight element. The coordinates are 2/3 and 1/6 in 2D (Strang, Fix
/// 1973, *An Analysis of the Finite Element Method*, table 4.1), `(5 + 3 sqrt 5)/20` and
/// `(5 - sqrt 5)/20` in 3D (Keast 1986, *Moderate-degree tetrahedral quadrature formulas*).
pub(super) const fn near<const D: usize>() -> f64 {
    if D == 2 { 2.0 / 3.0 } else { 0.585_410_196_624_968_5 }
}

/// Returns the other coordinates of a quadrature point, see [`near`].
pub(super) const fn far<const D: usize>() -> f64 {
    if D == 2 { 1.0 / 6.0 } else { 0.138_196_601_125_010_5 }
}

/// Returns the barycentric coordinates of quadrature point `q`; in cells other than simplices its
/// reference coordinates.
pub fn quadrature_position<const D: usize, const N: usize>(q: usize) -> Barycentric {
    let mut lambda = [0.0; 4];
    if let Some(cell) = second_order_cell::<D, N>() {
        lambda[..D].copy_from_slice(&cell.points[q].0);
        return lambda;
    }
    for (i, l) in lambda[..=D].iter_mut().enumerate() {
        *l = match order::<D, N>() {
            1 => 1.0 / (D + 1) as f64,
            _ if i == q => near::<D>(),
            _ => far::<D>(),
        };
    }
    lambda
}

/// Returns the coordinates of the centre of an element.
pub fn centroid<const D: usize, const N: usize>() -> Barycentric {
    let mut lambda = [0.0; 4];
    if is_simplex::<D, N>() {
        lambda[..=D].fill(1.0 / (D + 1) as f64);
    }
    lambda
}

/// Returns the weights that interpolate a function from the quadrature points to `lambda`; unused entries
/// are zero. In simplices they are exact for linear functions, such as `F` of a straight element and
/// `dx/dxi` of any. Other cells use the Lagrange polynomials through the points: exact for `dx/dxi` with
/// full integration, otherwise an extrapolation from the points at which strains are most accurate
/// (Barlow 1976, *Optimal stress locations in finite element models*).
pub fn interpolation<const D: usize, const N: usize>(lambda: &Barycentric) -> [f64; MOST_POINTS] {
    let mut weights = [0.0; MOST_POINTS];
    if let Some(cell) = second_order_cell::<D, N>() {
        let xi = leading::<D>(lambda);
        for (weight, (point, _)) in weights.iter_mut().zip(cell.points) {
            *weight = (0..D).map(|k| through_points(cell.points, k, point[k], xi[k])).product();
        }
        return weights;
    }
    if order::<D, N>() == 1 {
        weights[0] = 1.0;
        return weights;
    }
    for (weight, l) in weights[..=D].iter_mut().zip(lambda) {
        *weight = (l - far::<D>()) / (near::<D>() - far::<D>());
    }
    weights
}

/// Evaluates at `x` the Lagrange polynomial through coordinate `k` of a product rule that is one at
/// `own`.
fn through_points<const D: usize>(points: &[([f64; D], f64)], k: usize, own: f64, x: f64) -> f64 {
    let mut others: Vec<f64> =
        points.iter().map(|(point, _)| point[k]).filter(|other| *other != own).collect();
    others.sort_by(f64::total_cmp);
    others.dedup();
    others.iter().map(|other| (x - other) / (own - other)).product()
}

/// Returns the area or volume of an element with this constant determinant of the Jacobian.
pub(super) fn content<const D: usize, const N: usize>(determinant: f64) -> f64 {
    if is_simplex::<D, N>() { determinant / factorial::<D>() } else { determinant * (1 << D) as f64 }
}

/// Returns the area or volume of quadrature point `q`, given the determinant of the Jacobian there.
pub(crate) fn point_content<const D: usize, const N: usize>(q: usize, determinant: f64) -> f64 {
    match second_order_cell::<D, N>() {
        Some(cell) => determinant * cell.points[q].1,
        None => determinant / (factorial::<D>() * quadrature_count::<D, N>() as f64),
    }
}

/// Contribution of one quadrature point to an element. With the shape gradients `b_a = dN_a/dX` there,
/// `F = sum_a x_a b_a^T` and `E = sum_q w_q psi(F_q)`. The gradient at node `a` is `sum_q w_q P_q b_a`.
/// Block `(a, b)` of the stiffness is `sum_q w_q b_a . (dP/dF)_q . b_b`, that is
/// `K_ik = w dP_ij/dF_kl b_aj b_bl`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuadraturePoint<const D: usize, const N: usize> {
    /// Reference area [m^2] or volume [m^3] of the point, `det J` times the weight of the rule; positive
    /// in a valid element.
    pub weight: f64,
    /// Shape gradients `dN_a / dX`, `(N, D)` [1/m].
    pub gradients: [[f64; D]; N],
}

impl<const D: usize, const N: usize> QuadraturePoint<D, N> {
    /// Creates the point `lambda` of the element with the reference positions `rest`, with the fraction
    /// `fraction` of the reference element as its weight.
    pub fn new(rest: &[[f64; D]; N], lambda: &Barycentric, fraction: f64) -> Self {
        let j = jacobian(rest, lambda);
        let inverse = j.inverse();
        let determinant = fraction * j.determinant();
        let mut gradients = [[0.0; D]; N];
        for (gradient, reference) in gradients.iter_mut().zip(reference_gradients::<D, N>(lambda)) {
            for r in 0..D {
                // dN/dX = J^-T dN/dxi.
                gradient[r] = (0..D).map(|c| inverse[c][r] * reference[c]).sum();
            }
        }
        QuadraturePoint { weight: content::<D, N>(determinant), gradients }
    }

    /// Returns `F = sum_a x_a b_a^T` for nodes at `x`; exact also far from the origin.
    pub fn deformation_gradient(&self, x: &[[f64; D]; N]) -> Mat<f64, D> {
        let mut f = Mat::zero();
        for (point, gradient) in x.iter().zip(&self.gradients) {
            for i in 0..D {
                for j in 0..D {
                    f[i][j] += (point[i] - x[0][i]) * gradient[j];
                }
            }
        }
        f
    }
}

/// Returns `D!`: the reference element has the volume `1 / D!`.
pub(super) const fn factorial<const D: usize>() -> f64 {
    if D == 2 { 2.0 } else { 6.0 }
}

/// Returns the quadrature points of the element with these reference positions, in order. Forces,
/// energies and stiffness of first and second order are sums over them.
pub fn quadrature_points<const D: usize, const N: usize>(
    rest: &[[f64; D]; N],
) -> impl Iterator<Item = QuadraturePoint<D, N>> {
    let count = quadrature_count::<D, N>();
    let fraction = move |q: usize| match second_order_cell::<D, N>() {
        Some(cell) => cell.points[q].1 / (1 << D) as f64,
        None => 1.0 / count as f64,
    };
    (0..count).map(move |q| QuadraturePoint::new(rest, &quadrature_position::<D, N>(q), fraction(q)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns `integral of lambda^alpha over the element / volume = D! prod(alpha!) / (D + sum alpha)!`.
    fn exact<const D: usize>(powers: &[i32]) -> f64 {
        let factorial = |n: i32| (1..=n).map(f64::from).product::<f64>();
        let sum = powers.iter().sum::<i32>() + D as i32;
        factorial(D as i32) * powers.iter().map(|&p| factorial(p)).product::<f64>() / factorial(sum)
    }

    fn degree<const D: usize, const N: usize>() -> i32 {
        let integral = |powers: &[i32]| {
            let count = quadrature_count::<D, N>();
            let value = |q: usize| {
                let lambda = quadrature_position::<D, N>(q);
                powers.iter().zip(lambda).map(|(&p, l)| l.powi(p)).product::<f64>()
            };
            (0..count).map(value).sum::<f64>() / count as f64
        };
        (1..9)
            .find(|&degree| {
                // Monomials in two of the coordinates suffice: the rules are symmetric.
                (0..=degree)
                    .any(|p| (integral(&[p, degree - p]) - exact::<D>(&[p, degree - p])).abs() > 1e-14)
            })
            .map_or(9, |first_wrong| first_wrong - 1)
    }

    #[test]
    fn the_rules_have_the_degree_that_the_stiffness_of_a_straight_element_needs() {
        assert_eq!([degree::<2, 3>(), degree::<3, 4>()], [1, 1]);
        assert_eq!([degree::<2, 6>(), degree::<3, 10>()], [2, 2]);
    }
}
