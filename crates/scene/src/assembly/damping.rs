//! The damping of a body.

use super::body::{BodyAssembly, renumbered};
use crate::Body;
use crate::DampingSpec;
use pliant::dissipation::{AtRest, DissipativeTerm, MassProportional, MeasuredRate, StrainRate, Viscosity};
use pliant::element::{CellBlock, CellVisitor, Isoparametric};
use pliant::energy::elastic::{flattened, points_of};
use pliant::energy::measure::{Length, StencilConstants};
use pliant::material::{MaterialSpec, Plane};
use pliant::numbering::Numbering;
use pliant::system::System;

/// Viscosities of the elements of a body by `strain_rate`.
fn strain_rate(damping: &DampingSpec) -> Viscosity {
    let rate = damping.strain_rate.as_ref();
    rate.map_or_else(Viscosity::default, |rate| Viscosity { shear: rate.shear, second: rate.second })
}

/// Viscosities of the elements of a body by `stiffness_proportional`.
fn stiffness_proportional(damping: &DampingSpec, material: &MaterialSpec, plane: Option<Plane>) -> Viscosity {
    let (Some(beta), Some(lame)) = (damping.stiffness_proportional, material.lame()) else {
        return Viscosity::default();
    };
    // In plane stress the sheet is free to change its thickness.
    let lambda = match plane {
        Some(Plane::Stress) => 2.0 * lame.mu * lame.lambda / (lame.lambda + 2.0 * lame.mu),
        _ => lame.lambda,
    };
    Viscosity { shear: beta * lame.mu, second: beta * lambda }
}

impl BodyAssembly {
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
            let rate = strain_rate(damping);
            let proportional = stiffness_proportional(damping, material, plane);
            let viscous = |viscosity| self.viscous::<D, N>(viscosity, rest, numbering);
            if let MaterialSpec::Linear(_) = material {
                viscous(rate).into_iter().for_each(|term| system.add_dissipation(term));
                let constant = viscous(proportional).map(|term| AtRest::new(term, rest));
                constant.into_iter().for_each(|term| system.add_dissipation(Box::new(term)));
            } else {
                viscous(rate.plus(proportional)).into_iter().for_each(|term| system.add_dissipation(term));
            }
        }
        let beta = damping.stiffness_proportional.unwrap_or(0.0);
        let constant = |k: &f64| StencilConstants {
            stiffness: damping.dashpot.unwrap_or(0.0) + beta * k,
            ..StencilConstants::default()
        };
        let constants: Vec<StencilConstants> = self.stiffness.iter().map(constant).collect();
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

    /// The term of elements of this `viscosity`; `None` where that is zero.
    fn viscous<const D: usize, const N: usize>(
        &self,
        viscosity: Viscosity,
        rest: &[f64],
        numbering: &Numbering,
    ) -> Option<Box<dyn DissipativeTerm>> {
        if viscosity == Viscosity::default() {
            return None;
        }
        let name = &self.name;
        if let Some(block) = self.mesh.block() {
            return Some(block.kind.visit(CellsViscosity { parts: self, block, viscosity, rest, numbering }));
        }
        Some(match (self.thickness, self.mesh.order(), D) {
            (Some(h), ..) => {
                let Viscosity { shear, second } = viscosity;
                let viscosity = Viscosity { shear: h * shear, second: h * second };
                let triangles: Vec<[u32; 3]> = self.elements(numbering);
                let shape = |triangle: &[u32; 3]| flattened(&points_of(rest, triangle)).0;
                Box::new(StrainRate::<3, 3, _>::linear(name, viscosity, &triangles, rest, shape))
            }
            (None, 1, _) => {
                let elements: Vec<[u32; N]> = self.elements(numbering);
                let shape = |element: &[u32; N]| points_of::<D, N>(rest, element);
                Box::new(StrainRate::<D, N, _>::linear(name, viscosity, &elements, rest, shape))
            }
            (None, _, 2) => {
                let elements = self.elements(numbering);
                Box::new(StrainRate::<2, 6, _>::quadratic(name, viscosity, &elements, rest))
            }
            _ => {
                let elements = self.elements(numbering);
                Box::new(StrainRate::<3, 10, _>::quadratic(name, viscosity, &elements, rest))
            }
        })
    }
}

/// Makes the dashpots of cells of whatever kind is visited.
struct CellsViscosity<'a> {
    parts: &'a BodyAssembly,
    block: &'a CellBlock,
    viscosity: Viscosity,
    rest: &'a [f64],
    numbering: &'a Numbering,
}

impl CellVisitor for CellsViscosity<'_> {
    type Output = Box<dyn DissipativeTerm>;

    fn visit<const D: usize, const N: usize>(self, cell: &'static Isoparametric<D, N>) -> Self::Output {
        let CellsViscosity { parts, block, viscosity, rest, numbering } = self;
        let cells = parts.renumbered_cells::<N>(block, numbering);
        Box::new(StrainRate::cells(&parts.name, viscosity, cell, &cells, rest))
    }
}
