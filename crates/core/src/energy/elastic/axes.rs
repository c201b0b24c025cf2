//! Axes of the material in each element.

use super::Elastic;
use crate::algebra::Mat;
use crate::element::ElementState;
use crate::energy::ElementTerm;

impl<const D: usize, const N: usize> Elastic<D, N> {
    /// The same elements, the material of each turned by the rotation `R` from its axes to those of space, in
    /// the order of the mesh: energy densities are `psi(F R)`, stresses `P(F R) R^T`. See
    /// [`material_axes`](crate::material::material_axes). In the plane rotations are about its normal.
    ///
    /// # Panics
    /// If there is not one rotation for each element.
    #[must_use]
    pub fn with_axes(mut self, axes: &[Mat<f64, 3>]) -> Self {
        assert_eq!(self.element_count(), axes.len(), "one rotation for each element");
        self.elements.each_rest(|element, point, lane| point.turn(lane, &axes[element].leading()));
        self.axes = axes.to_vec();
        self
    }

    /// The state in the axes of space, of an element whose state in those of its material is given.
    pub(super) fn in_space(&self, element: usize, state: ElementState) -> ElementState {
        in_space(self.axes.get(element), state)
    }
}

/// The state in the axes of space, of an element whose state in these axes of its material is given.
pub(super) fn in_space(axes: Option<&Mat<f64, 3>>, state: ElementState) -> ElementState {
    match axes {
        None => state,
        Some(axes) => ElementState {
            deformation_gradient: state.deformation_gradient.mul_transpose(axes),
            first_piola: state.first_piola.mul_transpose(axes),
            ..state
        },
    }
}
