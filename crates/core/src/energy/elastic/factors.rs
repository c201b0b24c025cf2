//! Factors of the energy densities of elements.

use super::Elastic;
use crate::element::ElementState;
use crate::energy::ElementTerm;

impl<const D: usize, const N: usize> Elastic<D, N> {
    /// The same elements, each with its energy density, and so its stress and stiffness, times a factor, in
    /// the order of the mesh: what has the modulus `E` has `factor E` then.
    ///
    /// # Panics
    /// If there is not one factor for each element.
    #[must_use]
    pub fn with_factors(mut self, factors: &[f64]) -> Self {
        assert_eq!(self.element_count(), factors.len(), "one factor for each element");
        self.elements.each_rest(|element, point, lane| point.scale_weight(lane, factors[element]));
        self.factors = factors.to_vec();
        self
    }

    /// The state with stress and energy density times the factor of the element.
    pub(super) fn with_its_factor(&self, element: usize, state: ElementState) -> ElementState {
        match self.factors.get(element) {
            None => state,
            Some(factor) => ElementState {
                first_piola: state.first_piola.scale(*factor),
                energy_density: state.energy_density * factor,
                ..state
            },
        }
    }
}
