//! Terms that store energy in a body: finite elements of every kind, springs, bending.

use super::body::{BodyAssembly, renumbered};
use crate::{Body, Stress};
use pliant::element::{CellBlock, CellVisitor, Isoparametric};
use pliant::energy::EnergyTerm;
use pliant::energy::elastic::{Dilatation, Elastic, MeanDilatation, Membrane, Sheet, nodal_integration};
use pliant::energy::spring::Springs;
use pliant::material::{Material, MaterialSpec, MaterialVisitor, Plane};
use pliant::numbering::Numbering;
use pliant::system::System;

impl BodyAssembly {
    /// Adds elements and springs to `system`; `rest` holds the rest positions of the whole system, in its `numbering`.
    pub(super) fn add_terms<const D: usize, const N: usize>(
        &self,
        spec: &Body,
        rest: &[f64],
        numbering: &Numbering,
        system: &mut System,
    ) {
        let BodyAssembly { name, first_vertex, springs, .. } = self;
        if let (Some(material), Some(nodal)) = (&spec.elastic, &spec.nodal_integration) {
            let ElementSet { body, cells, rest, stress } = self.elastic_elements::<N>(spec, rest, numbering);
            let terms = nodal_integration::<D, N>(
                body,
                material,
                nodal.stabilisation_or_default(),
                stress,
                &cells,
                rest,
            );
            for term in terms.into_iter().flatten() {
                system.add_term(term);
            }
        } else if let (Some(material), Some(block)) = (&spec.elastic, self.mesh.block()) {
            let stress = spec.stress.unwrap_or_default();
            let maker = CellsMaker { parts: self, block, material, stress, rest, numbering };
            system.add_term(block.kind.visit(maker));
        } else if let Some(material) = &spec.elastic {
            system.add_term(match (self.mesh.order(), D) {
                _ if self.thickness.is_some() => {
                    let plane = spec.membrane.as_ref().map_or(Plane::Stress, |m| m.plane_or_default());
                    let thickness = self.thickness.unwrap_or_default();
                    let elements = self.elastic_elements(spec, rest, numbering);
                    let sheet = Sheet { thickness, plane, lame: material.lame(), stress: elements.stress };
                    material.visit::<2, _>(MembraneMaker { elements, sheet })
                }
                (1, _) => {
                    material.visit::<D, _>(LinearMaker::<N>(self.elastic_elements(spec, rest, numbering)))
                }
                (_, 2) => {
                    material.visit::<2, _>(QuadraticMaker::<6>(self.elastic_elements(spec, rest, numbering)))
                }
                _ => {
                    material.visit::<3, _>(QuadraticMaker::<10>(self.elastic_elements(spec, rest, numbering)))
                }
            });
        }
        self.bends.add_terms::<D>(self, rest, numbering, system);
        if !springs.is_empty() {
            let edges: Vec<[u32; 2]> =
                springs.iter().map(|e| renumbered(e, *first_vertex, numbering)).collect();
            let count = rest.len() / D;
            system.add_term(Box::new(Springs::<D>::new(
                name,
                &edges,
                &self.stiffness,
                &self.rest_length,
                count,
            )));
        }
    }

    fn elastic_elements<'a, const N: usize>(
        &'a self,
        spec: &Body,
        rest: &'a [f64],
        numbering: &Numbering,
    ) -> ElementSet<'a, N> {
        let stress = spec.stress.unwrap_or_default();
        ElementSet { body: &self.name, cells: self.elements(numbering), rest, stress }
    }
}

/// Data of an elastic term, but for the material.
struct ElementSet<'a, const N: usize> {
    body: &'a str,
    cells: Vec<[u32; N]>,
    rest: &'a [f64],
    stress: Stress,
}

/// Makes the term of linear elements of whatever material is visited.
struct LinearMaker<'a, const N: usize>(ElementSet<'a, N>);

impl<const D: usize, const N: usize> MaterialVisitor<D> for LinearMaker<'_, N> {
    type Output = Box<dyn EnergyTerm>;

    fn visit<M: Material<D> + Material<3> + Clone>(self, material: M) -> Box<dyn EnergyTerm> {
        let ElementSet { body, cells, rest, stress } = self.0;
        Box::new(Elastic::<D, N>::linear(body, material, stress, &cells, rest))
    }
}

/// The same of quadratic elements.
struct QuadraticMaker<'a, const N: usize>(ElementSet<'a, N>);

impl<const D: usize, const N: usize> MaterialVisitor<D> for QuadraticMaker<'_, N> {
    type Output = Box<dyn EnergyTerm>;

    fn visit<M: Material<D> + Material<3> + Clone>(self, material: M) -> Box<dyn EnergyTerm> {
        let ElementSet { body, cells, rest, stress } = self.0;
        Box::new(Elastic::<D, N>::quadratic(body, material, stress, &cells, rest))
    }
}

/// Makes the term of cells of whatever kind is visited.
struct CellsMaker<'a> {
    parts: &'a BodyAssembly,
    block: &'a CellBlock,
    material: &'a MaterialSpec,
    stress: Stress,
    rest: &'a [f64],
    numbering: &'a Numbering,
}

impl CellVisitor for CellsMaker<'_> {
    type Output = Box<dyn EnergyTerm>;

    fn visit<const D: usize, const N: usize>(self, cell: &'static Isoparametric<D, N>) -> Self::Output {
        let CellsMaker { parts, block, material, stress, rest, numbering } = self;
        let how = (stress, Dilatation::of(material));
        let cells = parts.renumbered_cells(block, numbering);
        material.visit::<D, _>(MeanDilatationMaker { body: &parts.name, cells, cell, how, rest })
    }
}

/// Makes their term of whatever material is visited.
struct MeanDilatationMaker<'a, const D: usize, const N: usize> {
    body: &'a str,
    cells: Vec<[u32; N]>,
    cell: &'static Isoparametric<D, N>,
    how: (Stress, Dilatation),
    rest: &'a [f64],
}

impl<const D: usize, const N: usize> MaterialVisitor<D> for MeanDilatationMaker<'_, D, N> {
    type Output = Box<dyn EnergyTerm>;

    fn visit<M: Material<D> + Material<3> + Clone>(self, material: M) -> Box<dyn EnergyTerm> {
        let Self { body, cells, cell, how, rest } = self;
        Box::new(MeanDilatation::new(body, material, how, cell, &cells, rest))
    }
}

/// Makes a membrane of whatever material is visited.
struct MembraneMaker<'a> {
    elements: ElementSet<'a, 3>,
    sheet: Sheet,
}

impl MaterialVisitor<2> for MembraneMaker<'_> {
    type Output = Box<dyn EnergyTerm>;

    fn visit<M: Material<2> + Material<3> + Clone>(self, material: M) -> Box<dyn EnergyTerm> {
        let ElementSet { body, cells, rest, .. } = self.elements;
        Box::new(Membrane::new(body, material, self.sheet, &cells, rest))
    }
}
