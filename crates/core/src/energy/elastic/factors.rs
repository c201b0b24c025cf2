//! Factors of the energy densities of elements.

use super::Elastic;
use crate::element::ElementState;
use crate::energy::ElementTerm;

impl<const D: usize, const N: usize> Elastic<D, N> {
    /// Multiplies the energy density of each element, and so its stress and stiffness, by a factor, in
    /// the order of the mesh: a modulus `E` becomes `factor E`.
    ///
    /// # Panics
    /// If the numbers of factors and elements differ.
    #[must_use]
    pub fn with_factors(mut self, factors: &[f64]) -> Self {
        assert_eq!(self.element_count(), factors.len(), "one factor for each element");
        self.elements.each_rest(|element, point, lane| point.scale_weight(lane, factors[element]));
        self.factors = factors.to_vec();
        self
    }

    /// Returns the state with stress and energy density multiplied by the factor of the element.
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
