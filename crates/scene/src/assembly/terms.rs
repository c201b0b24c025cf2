//! Energy terms of a body: finite elements of every kind, springs, bending.

use super::body::{BodyAssembly, renumbered};
use crate::{Body, SpringsSpec};
use pliant::energy::EnergyTerm;
use pliant::energy::elastic::Sheet;
use pliant::material::{MaterialSpec, Plane};
use pliant::numbering::Numbering;
use pliant::system::System;
use pliant_terms::{ElementSet, expressed_springs};

impl BodyAssembly {
    /// Adds elements and springs to `system`; `rest` holds the reference positions of the whole system,
    /// in its `numbering`.
    pub(super) fn add_terms<const D: usize, const N: usize>(
        &self,
        spec: &Body,
        rest: &[f64],
        numbering: &Numbering,
        system: &mut System,
    ) {
        let BodyAssembly { name, first_vertex, springs, .. } = self;
        if let Some(material) = &spec.elastic {
            for term in self.elastic_terms::<D, N>(spec, material, rest, numbering) {
                system.add_term(term);
            }
        }
        self.bends.add_terms(self, rest, numbering, system);
        if !springs.is_empty() {
            let edges: Vec<[u32; 2]> =
                springs.iter().map(|e| renumbered(e, *first_vertex, numbering)).collect();
            let count = rest.len() / D;
            let lengths = &self.rest_length;
            system.add_term(match spec.springs.as_ref().and_then(SpringsSpec::formula) {
                Some(Ok(formula)) => expressed_springs(D, name, formula, &edges, lengths, rest),
                _ => pliant_terms::springs(D, name, &edges, (&self.stiffness, lengths), count),
            });
        }
    }

    /// Terms of the elements: simplices of `N` corners, or other cells.
    fn elastic_terms<const D: usize, const N: usize>(
        &self,
        spec: &Body,
        material: &MaterialSpec,
        rest: &[f64],
        numbering: &Numbering,
    ) -> Vec<Box<dyn EnergyTerm>> {
        let stress = spec.stress.unwrap_or_default();
        let factors = Some(&self.factors[..]).filter(|factors| !factors.is_empty());
        let cells = self.element_vertices::<D, N>(numbering);
        let axes = Some(&self.axes[..]).filter(|axes| !axes.is_empty());
        let body = &self.name;
        let elements = ElementSet { body, dimension: D, cells: &cells, rest, stress, factors, axes };
        vec![if let Some(block) = self.mesh.block() {
            pliant_terms::cells(material, block.kind, &elements)
        } else if let Some(thickness) = self.thickness {
            let plane = spec.membrane.as_ref().map_or(Plane::Stress, |m| m.plane_or_default());
            let sheet = Sheet { thickness, plane, lame: material.lame(), stress };
            pliant_terms::membrane(material, &elements, sheet)
        } else if self.mesh.order() == 1 {
            pliant_terms::linear(material, &elements)
        } else {
            pliant_terms::quadratic(material, &elements)
        }]
    }

    /// Vertices of the elements in the simulation, flat.
    pub(super) fn element_vertices<const D: usize, const N: usize>(&self, numbering: &Numbering) -> Vec<u32> {
        match (self.mesh.block(), self.mesh.order(), D) {
            (Some(block), ..) => {
                block.vertices.iter().map(|v| numbering.internal(self.first_vertex + v)).collect()
            }
            _ if self.thickness.is_some() => self.elements::<3>(numbering).into_flattened(),
            (None, 1, _) => self.elements::<N>(numbering).into_flattened(),
            (None, _, 2) => self.elements::<6>(numbering).into_flattened(),
            _ => self.elements::<10>(numbering).into_flattened(),
        }
    }
}
