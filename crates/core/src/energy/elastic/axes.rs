//! Material axes of the elements.

use super::Elastic;
use crate::algebra::Mat;
use crate::element::ElementState;
use crate::energy::ElementTerm;

impl<const D: usize, const N: usize> Elastic<D, N> {
    /// Rotates the material of each element by the rotation `R` from its axes to those of space, in the
    /// order of the mesh: energy densities become `psi(F R)`, stresses `P(F R) R^T`. See
    /// [`material_axes`](crate::material::material_axes). In 2D rotations are about the normal of the
    /// plane.
    ///
    /// # Panics
    /// If the numbers of rotations and elements differ.
    #[must_use]
    pub fn with_axes(mut self, axes: &[Mat<f64, 3>]) -> Self {
        assert_eq!(self.element_count(), axes.len(), "one rotation for each element");
        self.elements.each_rest(|element, point, lane| point.turn(lane, &axes[element].leading()));
        self.axes = axes.to_vec();
        self
    }

    /// Returns the state in the axes of space of an element, given its state in material axes.
    pub(super) fn in_space(&self, element: usize, state: ElementState) -> ElementState {
        in_space(self.axes.get(element), state)
    }
}

/// Returns the state in the axes of space, given the state in these material axes.
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
