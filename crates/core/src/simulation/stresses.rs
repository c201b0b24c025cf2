//! Stress at nodes, and an estimate of its error.

use super::Simulation;
use crate::diagnostics::recovery::{
    NodalStress, Recovery, SampledConfiguration, StressError, nodal_stress, stress_error,
};
use crate::energy::ElementTerm;
use crate::topology::Topology;

impl Simulation {
    /// Recovers the current Cauchy stress at the nodes of all elements [Pa]. `topology` must be that of
    /// the same assembly.
    ///
    /// ```
    /// use pliant::diagnostics::recovery::{NodalStress, Recovery};
    /// # fn show(simulation: &pliant::simulation::Simulation, topology: &pliant::topology::Topology) {
    /// let stress: NodalStress = simulation.nodal_stress(topology, Recovery::Patch);
    /// let largest = stress.von_mises().into_iter().fold(0.0, f64::max);
    /// # }
    /// ```
    pub fn nodal_stress(&self, topology: &Topology, recovery: Recovery) -> NodalStress {
        nodal_stress(self.element_terms(), self.sampled(topology), recovery)
    }

    /// Estimates the error of the current stress, in energy norms, by its difference from the recovered
    /// one. `topology` must be that of the same assembly. `None` if a body has elements without a
    /// tangent: membranes and materials with a history.
    ///
    /// The field of [`Recovery::Element`] is the stress itself in linear and quadratic simplices: the
    /// estimate is zero.
    pub fn stress_error(&self, topology: &Topology, recovery: Recovery) -> Option<StressError> {
        stress_error(self.element_terms(), self.sampled(topology), recovery)
    }

    pub(crate) fn element_terms(&self) -> impl Iterator<Item = &dyn ElementTerm> {
        self.system.terms().iter().filter_map(|term| term.elements())
    }

    pub(crate) fn sampled<'a>(&'a self, topology: &'a Topology) -> SampledConfiguration<'a> {
        SampledConfiguration {
            x: self.state.x(),
            rest: &topology.rest_positions,
            numbering: &self.numbering,
            dimension: topology.dimension,
        }
    }
}
