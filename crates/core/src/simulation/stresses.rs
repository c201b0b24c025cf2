//! Stress at nodes, and an estimate of its error.

use super::Simulation;
use crate::diagnostics::recovery::{
    NodalStress, Recovery, SampledConfiguration, StressError, nodal_stress, stress_error,
};
use crate::diagnostics::{SymmetricTensor, symmetric_tensor};
use crate::energy::ElementTerm;
use crate::topology::Topology;

/// Recovery of stresses for frames.
pub(super) struct FrameRecovery {
    recovery: Recovery,
    /// Reference positions, flat, in the order of the scene [m].
    rest: Vec<f64>,
}

impl Simulation {
    /// Sets the method of [`recovered_stress`](Self::recovered_stress), with the flat reference positions
    /// of all vertices, in the order of the scene [m]. Without it, nothing is recovered for frames.
    pub fn set_recovery(&mut self, recovery: Recovery, rest_positions: Vec<f64>) {
        self.recovery = Some(Box::new(FrameRecovery { recovery, rest: rest_positions }));
    }

    /// Returns the recovered Cauchy stress at every vertex, in the order of the scene [Pa]; NaN at a vertex
    /// of no element. `None` without a [recovery](Self::set_recovery), and by [`Recovery::Element`], which
    /// has several values at a vertex.
    pub fn recovered_stress(&self) -> Option<Vec<SymmetricTensor>> {
        let FrameRecovery { recovery, rest } = &**self.recovery.as_ref()?;
        if *recovery == Recovery::Element {
            return None;
        }
        let at = self.sampled_from(rest);
        let found = nodal_stress(self.element_terms(), at, *recovery);
        let mut stress = vec![[f64::NAN; 6]; rest.len() / at.dimension];
        for (vertex, tensor) in found.vertices.iter().zip(&found.stress) {
            stress[*vertex as usize] = symmetric_tensor(tensor);
        }
        Some(stress)
    }

    /// Returns the estimated error of the stress of every element, body after body [sqrt(J)]. `None`
    /// without a [recovery](Self::set_recovery), and where [`stress_error`](Self::stress_error) has none.
    pub fn recovered_error(&self) -> Option<Vec<f64>> {
        let FrameRecovery { recovery, rest } = &**self.recovery.as_ref()?;
        stress_error(self.element_terms(), self.sampled_from(rest), *recovery).map(|error| error.elements)
    }

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
        self.sampled_from(&topology.rest_positions)
    }

    /// Returns the present configuration with these reference positions.
    fn sampled_from<'a>(&'a self, rest: &'a [f64]) -> SampledConfiguration<'a> {
        let dimension = self.system.dimension();
        SampledConfiguration { x: self.state.x(), rest, numbering: &self.numbering, dimension }
    }
}
