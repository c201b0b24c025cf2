//! Damping of a body.

use super::body::{BodyAssembly, renumbered};
use crate::Body;
use crate::{DampingSpec, DashpotExpressionSpec};
use pliant::dissipation::{AtRest, DissipativeTerm, MassProportional, Viscosity};
use pliant::energy::measure::StencilConstants;
use pliant::material::{MaterialSpec, Plane};
use pliant::numbering::Numbering;
use pliant::system::System;
use pliant_terms::{ViscousSet, viscous_cells, viscous_membrane, viscous_simplices};

impl DampingSpec {
    /// Viscosities of the elements from `strain_rate`.
    pub fn strain_rate_viscosity(&self) -> Viscosity {
        let rate = self.strain_rate.as_ref();
        rate.map_or_else(Viscosity::default, |rate| Viscosity { shear: rate.shear, second: rate.second })
    }

    /// Viscosities from `stiffness_proportional` for elements of this material; `plane` matters in 2D.
    pub fn proportional_viscosity(&self, material: &MaterialSpec, plane: Option<Plane>) -> Viscosity {
        let (Some(beta), Some(lame)) = (self.stiffness_proportional, material.lame()) else {
            return Viscosity::default();
        };
        // In plane stress the thickness of the sheet changes freely.
        let lambda = match plane {
            Some(Plane::Stress) => 2.0 * lame.mu * lame.lambda / (lame.lambda + 2.0 * lame.mu),
            _ => lame.lambda,
        };
        Viscosity { shear: beta * lame.mu, second: beta * lambda }
    }
}

impl BodyAssembly {
    /// Adds the damping of this body to `system`; arguments as in `add_terms`. Damping of zero adds no
    /// term.
    pub(super) fn add_damping<const D: usize, const N: usize>(
        &self,
        spec: &Body,
        rest: &[f64],
        numbering: &Numbering,
        system: &mut System,
    ) {
        let Some(damping) = &spec.damping else { return };
        let (name, first) = (&self.name, self.first_vertex);
        // Elements. For the material `linear`, stiffness-proportional damping is evaluated in the
        // reference configuration.
        if let Some(material) = &spec.elastic {
            let plane =
                spec.membrane.as_ref().map(|membrane| membrane.plane_or_default()).or(material.plane());
            let rate = damping.strain_rate_viscosity();
            let proportional = damping.proportional_viscosity(material, plane);
            let viscous = |viscosity| self.viscous::<D, N>(viscosity, rest, numbering);
            if let MaterialSpec::Linear(_) = material {
                viscous(rate).into_iter().for_each(|term| system.add_dissipation(term));
                let constant = viscous(proportional).map(|term| AtRest::new(term, rest));
                constant.into_iter().for_each(|term| system.add_dissipation(Box::new(term)));
            } else {
                viscous(rate.plus(proportional)).into_iter().for_each(|term| system.add_dissipation(term));
            }
        }
        // Springs.
        let beta = damping.stiffness_proportional.unwrap_or(0.0);
        let constant = |k: &f64| StencilConstants {
            stiffness: damping.dashpot.unwrap_or(0.0) + beta * k,
            ..StencilConstants::default()
        };
        let constants: Vec<StencilConstants> = self.stiffness.iter().map(constant).collect();
        if constants.iter().any(|c| c.stiffness != 0.0) {
            let edges: Vec<[u32; 2]> = self.springs.iter().map(|e| renumbered(e, first, numbering)).collect();
            system.add_dissipation(pliant_terms::dashpots(D, name, &edges, &constants, rest));
        }
        if let Some(Ok(formula)) = damping.expression.as_ref().map(DashpotExpressionSpec::formula) {
            let edges: Vec<[u32; 2]> = self.springs.iter().map(|e| renumbered(e, first, numbering)).collect();
            let lengths = &self.rest_length;
            system.add_dissipation(pliant_terms::expressed_dashpots(D, name, formula, &edges, lengths, rest));
        }
        // Bending, and damping of the masses.
        if beta != 0.0 {
            self.bends.add_damping(beta, self, rest, numbering, system);
        }
        if let Some(alpha) = damping.mass_proportional.filter(|alpha| *alpha != 0.0) {
            let vertices = self.vertices();
            let vertices = vertices.start as usize..vertices.end as usize;
            let mass = system.mass()[vertices.clone()].to_vec();
            system.add_dissipation(Box::new(MassProportional::new(name, alpha, &mass, vertices, D)));
        }
    }

    /// Damping term of elements with this `viscosity`; `None` for zero.
    fn viscous<const D: usize, const N: usize>(
        &self,
        viscosity: Viscosity,
        rest: &[f64],
        numbering: &Numbering,
    ) -> Option<Box<dyn DissipativeTerm>> {
        if viscosity == Viscosity::default() {
            return None;
        }
        let cells = self.element_vertices::<D, N>(numbering);
        let set = ViscousSet { body: &self.name, dimension: D, cells: &cells, rest };
        Some(if let Some(block) = self.mesh.block() {
            viscous_cells(viscosity, block.kind, &set)
        } else if let Some(h) = self.thickness {
            let Viscosity { shear, second } = viscosity;
            viscous_membrane(Viscosity { shear: h * shear, second: h * second }, &set)
        } else {
            viscous_simplices(viscosity, self.mesh.order(), &set)
        })
    }
}
