//! States and tangents of cells at any of their points.

use super::hourglass::{RestModuli, gradient_at};
use super::rest::RestData;
use super::{OnePointCells, PullBack, in_space, rest_tangent};
use crate::algebra::Mat;
use crate::element::{Barycentric, ElementState};
use crate::energy::elastic::points_of;
use crate::energy::evaluated::tangent_in_space;
use crate::energy::{ElementVisitor, EvaluatedElement};
use crate::material::Psd;

impl<const D: usize, const N: usize> OnePointCells<D, N> {
    /// Returns the states at these points: the mean deformation gradient plus that of the hourglass modes
    /// with their enhanced strains.
    pub(super) fn states(
        &self,
        x: &[f64],
        (element, vertices): (usize, &[u32; N]),
        moduli: &RestModuli<f64, D>,
        points: &[Barycentric],
    ) -> Vec<ElementState> {
        let rest = self.rest(element);
        let (mean, q): (Mat<f64, D>, _) = rest.measure(&points_of(x, vertices));
        let cofactor = mean.cofactor();
        let z = self.pull_back.pulled(&cofactor, &q);
        let state = |at: &Barycentric| {
            let mut xi = [0.0; D];
            xi.copy_from_slice(&at[..D]);
            let gradient = gradient_at(&rest.inverse, moduli, &z, &xi);
            let f = match (self.pull_back, mean.determinant_with(&cofactor)) {
                (PullBack::None, _) => mean + gradient,
                (PullBack::Cofactor, j) if j > 0.0 => mean + mean.mul(&gradient).scale(1.0 / j),
                (PullBack::Cofactor, _) => mean,
            };
            in_space(self.axes.get(element), self.material.state(&f))
        };
        points.iter().map(state).collect()
    }

    /// Passes every cell, evaluated at these points, to `visit`.
    pub(super) fn evaluate_at(&self, x: &[f64], points: &[Barycentric], visit: &mut ElementVisitor<'_>) {
        let moduli = RestModuli::new(&rest_tangent(&*self.material));
        for (number, vertices, pack, lane) in self.elements() {
            let states = self.states(x, (number, &vertices), &moduli, points);
            let tangent = || {
                let f = self.deformation_of(x, &vertices, (pack, lane));
                let tangent = self.material.tangent(&f, Psd::Exact);
                Some(tangent_in_space(self.axes.get(number), &tangent))
            };
            visit(EvaluatedElement { number, vertices: &vertices, states: &states, tangent: &tangent });
        }
    }
}
