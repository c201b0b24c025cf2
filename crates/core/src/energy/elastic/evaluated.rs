//! States and tangents of elements at any of their points.

use super::Elastic;
use crate::algebra::Mat;
use crate::element::{Barycentric, ElementState, centroid, interpolation, is_simplex, order};
use crate::energy::evaluated::tangent_in_space;
use crate::energy::{ElementVisitor, EvaluatedElement};
use crate::material::{Psd, Tangent};

impl<const D: usize, const N: usize> Elastic<D, N> {
    /// Passes every element, evaluated at these points, to `visit`.
    pub(super) fn evaluate_at(&self, x: &[f64], points: &[Barycentric], visit: &mut ElementVisitor<'_>) {
        let weights: Vec<_> = points.iter().map(interpolation::<D, N>).collect();
        for (number, vertices, pack, lane) in self.elements() {
            let at_points = self.points(x, &vertices, pack, lane);
            let at = |f: &Mat<f64, D>| self.state(f, number);
            let states: Vec<ElementState> = if order::<D, N>() == 1 {
                vec![at(&centroid_deformation::<D, N>(&at_points)); points.len()]
            } else {
                weights.iter().map(|weights| at(&deformation_at(&at_points, weights))).collect()
            };
            let tangent = || Some(self.tangent(&centroid_deformation::<D, N>(&at_points), number));
            visit(EvaluatedElement { number, vertices: &vertices, states: &states, tangent: &tangent });
        }
    }

    /// Returns `dP/dF` of an element with this deformation gradient.
    fn tangent(&self, f: &Mat<f64, D>, element: usize) -> Tangent<3> {
        let factor = self.factors.get(element).copied().unwrap_or(1.0);
        tangent_in_space(self.axes.get(element), &self.material.tangent(f, Psd::Exact).scale(factor))
    }
}

/// Returns `F` at the centroid of an element. In simplices both `dx/dxi` and `J` are linear: their means
/// over the points are their values there.
pub(super) fn centroid_deformation<const D: usize, const N: usize>(
    points: &[[Mat<f64, D>; 2]],
) -> Mat<f64, D> {
    if let [[dx, inverse]] = points {
        return dx.mul(inverse);
    }
    if !is_simplex::<D, N>() {
        return deformation_at(points, &interpolation::<D, N>(&centroid::<D, N>()));
    }
    let (mut dx, mut j) = (Mat::zero(), Mat::zero());
    for [at_point, inverse] in points {
        dx += *at_point;
        j += inverse.inverse();
    }
    dx.mul(&j.inverse())
}

/// Returns `F` at a position in an element with several points: the quotient of `dx/dxi` and `J`, which
/// are interpolated between the points with these [weights](interpolation).
pub(super) fn deformation_at<const D: usize>(points: &[[Mat<f64, D>; 2]], weights: &[f64]) -> Mat<f64, D> {
    let (mut dx, mut j) = (Mat::zero(), Mat::zero());
    for ([at_point, inverse], &weight) in points.iter().zip(weights) {
        dx += at_point.scale(weight);
        j += inverse.inverse().scale(weight);
    }
    dx.mul(&j.inverse())
}
