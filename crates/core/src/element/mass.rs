//! Mass of elements: consistent, and lumped with positive entries.

use super::cell::second_order_cell;
use super::quadrature::content;
use super::shape::{Barycentric, is_simplex, jacobian, middle_edges, order, shape_functions};
use super::validity::volume;
use crate::algebra::Mat;

/// Returns abscissas in (0, 1) and weights of the Gauss-Legendre rule of five points, exact to degree 9:
/// Abramowitz, Stegun 1964, *Handbook of Mathematical Functions*, 25.4.30, in closed form.
fn gauss_legendre() -> [(f64, f64); 5] {
    let root = 2.0 * (10.0f64 / 7.0).sqrt();
    let (inner, outer) = ((5.0 - root).sqrt() / 6.0, (5.0 + root).sqrt() / 6.0);
    let part = 13.0 * 70.0f64.sqrt();
    let (heavy, light) = ((322.0 + part) / 1800.0, (322.0 - part) / 1800.0);
    [
        (0.5 - outer, light),
        (0.5 - inner, heavy),
        (0.5, 64.0 / 225.0),
        (0.5 + inner, heavy),
        (0.5 + outer, light),
    ]
}

/// Returns a rule with `5^D` positive weights of sum 1, exact to degree 7 in 3D and 8 in 2D. The product
/// `N_a N_b det J` of a curved element has degree 7 in 3D and 6 in 2D. The points are products of Gauss
/// rules on the cube, contracted to the simplex: Stroud 1971, *Approximate Calculation of Multiple
/// Integrals*, section 2.4.
fn simplex_mass_rule<const D: usize>() -> Vec<(Barycentric, f64)> {
    let gauss = gauss_legendre();
    let mut rule = vec![];
    for (u, wu) in gauss {
        for (v, wv) in gauss {
            if D == 2 {
                let l2 = v * (1.0 - u);
                rule.push(([1.0 - u - l2, u, l2, 0.0], 2.0 * wu * wv * (1.0 - u)));
                continue;
            }
            for (t, wt) in gauss {
                let l2 = v * (1.0 - u);
                let l3 = t * (1.0 - u) * (1.0 - v);
                let weight = 6.0 * wu * wv * wt * (1.0 - u).powi(2) * (1.0 - v);
                rule.push(([1.0 - u - l2 - l3, u, l2, l3], weight));
            }
        }
    }
    rule
}

/// Returns the product of the five-point rule on the reference cell of quadrilaterals and hexahedra, with
/// weights of sum 1. The rule is exact to degree 9 in each coordinate, the degree of `N_a N_b det J` of a
/// curved second-order hexahedron.
fn cell_mass_rule<const D: usize>() -> Vec<(Barycentric, f64)> {
    let gauss = gauss_legendre();
    let mut rule = vec![([0.0; 4], 1.0)];
    for k in 0..D {
        let with = |&(at, weight): &(Barycentric, f64)| {
            gauss.map(|(x, share)| {
                let mut at: Barycentric = at;
                at[k] = 2.0 * x - 1.0;
                (at, weight * share)
            })
        };
        rule = rule.iter().flat_map(with).collect();
    }
    rule
}

/// Returns the points of a rule that is exact for the masses of second-order elements, curved ones too,
/// and their weights as fractions of the area or volume of the reference element.
pub fn mass_rule<const D: usize, const N: usize>() -> Vec<(Barycentric, f64)> {
    if is_simplex::<D, N>() { simplex_mass_rule::<D>() } else { cell_mass_rule::<D>() }
}

/// Integrates masses of elements of one kind.
#[derive(Clone, Debug)]
pub struct MassRule<const D: usize, const N: usize> {
    rule: Vec<(Barycentric, f64)>,
    /// Mass matrix of a straight element of unit area or volume.
    straight: [[f64; N]; N],
}

impl<const D: usize, const N: usize> MassRule<D, N> {
    /// Creates the rule and the mass matrix that all straight elements share.
    pub fn new() -> Self {
        let rule = mass_rule::<D, N>();
        let straight = integrate::<D, N>(&rule, |_| 1.0);
        MassRule { rule, straight }
    }

    /// Returns the consistent mass matrix of a straight element of unit area or volume, for unit density.
    pub fn of_straight(&self) -> [[f64; N]; N] {
        self.straight
    }

    /// Returns the consistent mass matrix for unit density, `M_ab = integral of N_a N_b` over the element
    /// in the reference configuration [m^2 or m^3], exact up to rounding for straight and curved
    /// elements. The mass matrix of the element is `density M_ab I` for every coordinate alike. The sum
    /// of all entries is the volume.
    pub fn consistent(&self, rest: &[[f64; D]; N]) -> [[f64; N]; N] {
        if is_straight(rest) {
            let volume = volume(rest);
            return self.straight.map(|row| row.map(|m| volume * m));
        }
        self.by_jacobian(|lambda| jacobian(rest, lambda))
    }

    /// Returns [`consistent`](Self::consistent) of an element with this derivative `J` of the reference
    /// position.
    pub(crate) fn by_jacobian(&self, jacobian: impl Fn(&Barycentric) -> Mat<f64, D>) -> [[f64; N]; N] {
        integrate::<D, N>(&self.rule, |lambda| content::<D, N>(jacobian(lambda).determinant()))
    }

    /// Returns the lumped masses for unit density [m^2 or m^3], one per node: the diagonal of
    /// [`consistent`](Self::consistent) scaled to the volume, `m_a = V M_aa / sum_b M_bb`. Source:
    /// Hinton, Rock, Zienkiewicz 1976, *A note on mass lumping and related processes in the finite
    /// element method*, Earthquake Engineering and Structural Dynamics 4, 245.
    ///
    /// In first order each mass is `V / (D + 1)`, equal to the row sums. Row sums fail in second order:
    /// corners get 0 in a triangle and `-V/20` in a tetrahedron, and an explicit integrator needs
    /// positive masses. Here straight triangles give `V/19` to a corner and `16 V/57` to the middle of an
    /// edge, tetrahedra `V/36` and `4 V/27`. A square of 9 nodes gives 1/36, 1/9 and 4/9, equal to its
    /// row sums.
    pub fn lumped(&self, rest: &[[f64; D]; N]) -> [f64; N] {
        let consistent = self.consistent(rest);
        let volume: f64 = consistent.as_flattened().iter().sum();
        let diagonal: [f64; N] = std::array::from_fn(|a| consistent[a][a]);
        let trace: f64 = diagonal.iter().sum();
        diagonal.map(|m| volume * m / trace)
    }
}

impl<const D: usize, const N: usize> Default for MassRule<D, N> {
    fn default() -> Self {
        Self::new()
    }
}

/// Returns `integral of N_a N_b volume_at(lambda)`, the mean over the element.
fn integrate<const D: usize, const N: usize>(
    rule: &[(Barycentric, f64)],
    volume_at: impl Fn(&Barycentric) -> f64,
) -> [[f64; N]; N] {
    let mut mass = [[0.0; N]; N];
    for (lambda, weight) in rule {
        let values = shape_functions::<D, N>(lambda);
        let weight = weight * volume_at(lambda);
        for a in 0..N {
            for b in 0..N {
                mass[a][b] += weight * values[a] * values[b];
            }
        }
    }
    mass
}

/// True if mid-edge nodes lie in the middle, up to rounding, and a quadrilateral or hexahedron is a
/// parallelepiped. The Jacobian is then constant.
pub(super) fn is_straight<const D: usize, const N: usize>(rest: &[[f64; D]; N]) -> bool {
    if let Some(cell) = second_order_cell::<D, N>() {
        let middle = jacobian(rest, &[0.0; 4]);
        let most = rest.iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
        let rounding = 1e-13 * middle.norm_squared().sqrt() + 4.0 * most * f64::EPSILON;
        return rest.iter().zip(cell.nodes).all(|(node, xi)| {
            let arm: [f64; D] = std::array::from_fn(|k| xi[k] - cell.nodes[0][k]);
            let expected = middle.mul_vec(&arm);
            (0..D).all(|c| (node[c] - rest[0][c] - expected[c]).abs() <= rounding)
        });
    }
    if order::<D, N>() == 1 {
        return true;
    }
    rest[D + 1..].iter().zip(middle_edges::<D, N>()).all(|(middle, &[i, j])| {
        let (a, b) = (&rest[i], &rest[j]);
        let length = (0..D).fold(0.0, |l: f64, c| l.max((b[c] - a[c]).abs()));
        // Coordinates in a file may be rounded in the last digits.
        let rounding = (0..D).fold(0.0, |l: f64, c| l.max(a[c].abs().max(b[c].abs()))) * f64::EPSILON;
        (0..D).all(|c| (middle[c] - (0.5 * a[c] + 0.5 * b[c])).abs() <= 1e-13 * length + rounding)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::validity::tests::{curved, regular};

    fn sum<const N: usize>(mass: &[[f64; N]; N]) -> f64 {
        mass.as_flattened().iter().sum()
    }

    /// Compares `integral of x_i x_j`, a sum over the mass matrix, with the closed form for straight
    /// elements: with `s` the sum of the corners, `V ( s s^T + sum x x^T ) / ((D + 1)(D + 2))`.
    fn second_moments<const D: usize, const N: usize>() {
        let rest = regular::<D, N>(0.7);
        let mass = MassRule::<D, N>::new().consistent(&rest);
        let volume = volume(&rest);
        assert!((sum(&mass) / volume - 1.0).abs() < 1e-14);
        for i in 0..D {
            for j in 0..D {
                let mut found = 0.0;
                for a in 0..N {
                    for b in 0..N {
                        found += mass[a][b] * rest[a][i] * rest[b][j];
                        assert!((mass[a][b] - mass[b][a]).abs() < 1e-15);
                    }
                }
                let total = |c: usize| rest[..=D].iter().map(|x| x[c]).sum::<f64>();
                let squares: f64 = rest[..=D].iter().map(|x| x[i] * x[j]).sum();
                let exact = volume * (total(i) * total(j) + squares) / ((D + 1) * (D + 2)) as f64;
                assert!((found - exact).abs() < 1e-14, "{D}D, {N} nodes: {found} is not {exact}");
            }
        }
    }

    #[test]
    fn consistent_masses_have_the_volume_and_the_exact_second_moments() {
        second_moments::<2, 3>();
        second_moments::<3, 4>();
        second_moments::<2, 6>();
        second_moments::<3, 10>();
    }

    /// Zienkiewicz, Taylor, Zhu 2013, section 6.3: integrals of monomials of the coordinates.
    #[test]
    fn entries_of_straight_elements_are_those_of_the_books() {
        let triangle = MassRule::<2, 6>::new().straight;
        let close = |m: f64, exact: f64| assert!((m - exact).abs() < 1e-16, "{m} is not {exact}");
        close(triangle[0][0], 6.0 / 180.0);
        close(triangle[0][1], -1.0 / 180.0);
        close(triangle[0][3], 0.0);
        close(triangle[0][4], -4.0 / 180.0);
        close(triangle[3][3], 32.0 / 180.0);
        close(triangle[3][4], 16.0 / 180.0);
        let tetrahedron = MassRule::<3, 10>::new().straight;
        close(tetrahedron[0][0], 6.0 / 420.0);
        close(tetrahedron[0][1], 1.0 / 420.0);
        close(tetrahedron[0][4], -4.0 / 420.0);
        close(tetrahedron[0][5], -6.0 / 420.0);
        close(tetrahedron[4][4], 32.0 / 420.0);
        close(tetrahedron[4][5], 16.0 / 420.0);
        close(tetrahedron[4][9], 8.0 / 420.0);
    }

    fn lumps_are<const D: usize, const N: usize>(corner: f64, middle: f64) {
        let rest = regular::<D, N>(1.0);
        let volume = volume(&rest);
        for (a, m) in MassRule::<D, N>::new().lumped(&rest).iter().enumerate() {
            let expected = if a <= D { corner } else { middle };
            assert!((m / volume - expected).abs() < 1e-15, "{D}D, node {a} of {N}: {m}");
        }
        // Row sums, for comparison, which no explicit integrator can use.
        if N > D + 1 {
            let rows = MassRule::<D, N>::new().consistent(&rest)[0].iter().sum::<f64>() / volume;
            assert!((rows - if D == 2 { 0.0 } else { -0.05 }).abs() < 1e-15);
        }
    }

    #[test]
    fn lumped_masses_are_positive_and_add_up() {
        lumps_are::<2, 3>(1.0 / 3.0, 0.0);
        lumps_are::<3, 4>(0.25, 0.0);
        lumps_are::<2, 6>(1.0 / 19.0, 16.0 / 57.0);
        lumps_are::<3, 10>(1.0 / 36.0, 4.0 / 27.0);
        let rest = curved::<3, 10>(0.1);
        let mass = MassRule::<3, 10>::new();
        let lumped = mass.lumped(&rest);
        assert!(lumped.iter().all(|m| *m > 0.0));
        assert!((lumped.iter().sum::<f64>() / sum(&mass.consistent(&rest)) - 1.0).abs() < 1e-14);
    }

    /// Compares the rule with a finer one, made of the rule on two halves of the element: both integrate
    /// the polynomials exactly.
    fn is_exact_for_curved_elements<const D: usize, const N: usize>() {
        let rest = curved::<D, N>(0.15);
        let mass = MassRule::<D, N>::new();
        let found = mass.consistent(&rest);
        // The element is cut at the middle of edge 01: each half is the image of the whole by a linear
        // map of the coordinates.
        let halves = |lambda: &Barycentric, first: bool| {
            let mut l = *lambda;
            if first {
                (l[0], l[1]) = (lambda[0] + 0.5 * lambda[1], 0.5 * lambda[1]);
            } else {
                (l[0], l[1]) = (0.5 * lambda[0], lambda[1] + 0.5 * lambda[0]);
            }
            l
        };
        let mut fine = vec![];
        for (lambda, weight) in &mass.rule {
            fine.push((halves(lambda, true), 0.5 * weight));
            fine.push((halves(lambda, false), 0.5 * weight));
        }
        let expected = integrate::<D, N>(&fine, |lambda| {
            jacobian(&rest, lambda).determinant() / super::super::quadrature::factorial::<D>()
        });
        for (m, e) in found.as_flattened().iter().zip(expected.as_flattened()) {
            assert!((m - e).abs() < 1e-16, "{m} is not {e}");
        }
    }

    #[test]
    fn masses_of_curved_elements_are_exact() {
        is_exact_for_curved_elements::<2, 6>();
        is_exact_for_curved_elements::<3, 10>();
    }
}
