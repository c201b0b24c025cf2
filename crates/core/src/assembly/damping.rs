//! The damping of a body.

use super::body::{Parts, renumbered};
use crate::dissipation::{
    DissipativeTerm, MassProportional, MeasuredRate, QuadraticStrainRate, StrainRate, Viscosity,
};
use crate::energy::elastic::{flattened, points_of};
use crate::energy::measure::{Constants, Length};
use crate::material::{MaterialSpec, Plane};
use crate::numbering::Numbering;
use crate::scene::{Body, DampingSpec};
use crate::system::System;

/// What the elements of a body are given: `strain_rate` and the part of `stiffness_proportional`.
fn viscosity(damping: &DampingSpec, material: &MaterialSpec, plane: Option<Plane>) -> Viscosity {
    let mut viscosity = Viscosity::default();
    if let Some(rate) = &damping.strain_rate {
        viscosity = Viscosity { shear: rate.shear, second: rate.second };
    }
    if let (Some(beta), Some(lame)) = (damping.stiffness_proportional, material.lame()) {
        // In plane stress the sheet is free to change its thickness.
        let lambda = match plane {
            Some(Plane::Stress) => 2.0 * lame.mu * lame.lambda / (lame.lambda + 2.0 * lame.mu),
            _ => lame.lambda,
        };
        viscosity.shear += beta * lame.mu;
        viscosity.second += beta * lambda;
    }
    viscosity
}

impl Parts {
    /// Adds what damps this body to `system`; arguments as of `add_terms`. What would damp nothing is left out.
    pub(super) fn add_damping<const D: usize, const N: usize>(
        &self,
        spec: &Body,
        rest: &[f64],
        numbering: &Numbering,
        system: &mut System,
    ) {
        let Some(damping) = &spec.damping else { return };
        let (name, first) = (&self.name, self.first_vertex);
        if let Some(material) = &spec.elastic {
            let plane =
                spec.membrane.as_ref().map(|membrane| membrane.plane_or_default()).or(material.plane());
            let viscosity = viscosity(damping, material, plane);
            if viscosity != Viscosity::default() {
                let term: Box<dyn DissipativeTerm> = match (self.thickness, self.mesh.order(), D) {
                    (Some(h), ..) => {
                        let Viscosity { shear, second } = viscosity;
                        let viscosity = Viscosity { shear: h * shear, second: h * second };
                        let triangles: Vec<[u32; 3]> = self.elements(numbering);
                        let shape = |triangle: &[u32; 3]| flattened(&points_of(rest, triangle)).0;
                        Box::new(StrainRate::<3, 2, 3>::new(name, viscosity, &triangles, rest, shape))
                    }
                    (None, 1, _) => {
                        let elements: Vec<[u32; N]> = self.elements(numbering);
                        let shape = |element: &[u32; N]| points_of::<D, N>(rest, element);
                        Box::new(StrainRate::<D, D, N>::new(name, viscosity, &elements, rest, shape))
                    }
                    (None, _, 2) => {
                        let elements = self.elements(numbering);
                        Box::new(QuadraticStrainRate::<2, 6>::new(name, viscosity, &elements, rest))
                    }
                    _ => {
                        let elements = self.elements(numbering);
                        Box::new(QuadraticStrainRate::<3, 10>::new(name, viscosity, &elements, rest))
                    }
                };
                system.add_dissipation(term);
            }
        }
        let beta = damping.stiffness_proportional.unwrap_or(0.0);
        let constant = |k: &f64| Constants {
            stiffness: damping.dashpot.unwrap_or(0.0) + beta * k,
            ..Constants::default()
        };
        let constants: Vec<Constants> = self.stiffness.iter().map(constant).collect();
        if constants.iter().any(|c| c.stiffness != 0.0) {
            let edges: Vec<[u32; 2]> = self.springs.iter().map(|e| renumbered(e, first, numbering)).collect();
            let dashpots = MeasuredRate::<Length, D, 2>::new(name, &edges, &constants, rest);
            system.add_dissipation(Box::new(dashpots));
        }
        if beta != 0.0 {
            self.bends.add_damping::<D>(beta, self, rest, numbering, system);
        }
        if let Some(alpha) = damping.mass_proportional.filter(|alpha| *alpha != 0.0) {
            let vertices = self.vertices();
            let vertices = vertices.start as usize..vertices.end as usize;
            let mass = system.mass()[vertices.clone()].to_vec();
            system.add_dissipation(Box::new(MassProportional::new(name, alpha, &mass, vertices, D)));
        }
    }
}
