//! Cells that are no simplices.

use pliant::element::{CellKind, CellVisitor, Isoparametric};
use pliant::energy::EnergyTerm;
use pliant::energy::elastic::{Dilatation, MeanDilatation};
use pliant::material::{Material, MaterialSpec, MaterialVisitor};

use crate::ElementSet;

/// Cells of a kind, as [`MeanDilatation::new`] has them.
///
/// # Panics
/// As there, and if the cells are not whole ones.
pub fn cells(material: &MaterialSpec, kind: &CellKind, elements: &ElementSet<'_>) -> Box<dyn EnergyTerm> {
    kind.visit(CellsMaker { material, elements })
}

/// Maker of cells of whatever kind is visited.
struct CellsMaker<'a> {
    material: &'a MaterialSpec,
    elements: &'a ElementSet<'a>,
}

impl CellVisitor for CellsMaker<'_> {
    type Output = Box<dyn EnergyTerm>;

    fn visit<const D: usize, const N: usize>(self, cell: &'static Isoparametric<D, N>) -> Self::Output {
        let dilatation = Dilatation::of(self.material);
        self.material.visit::<D, _>(MeanDilatationMaker { elements: self.elements, cell, dilatation })
    }
}

/// Their maker of whatever material is visited.
struct MeanDilatationMaker<'a, const D: usize, const N: usize> {
    elements: &'a ElementSet<'a>,
    cell: &'static Isoparametric<D, N>,
    dilatation: Dilatation,
}

impl<const D: usize, const N: usize> MaterialVisitor<D> for MeanDilatationMaker<'_, D, N> {
    type Output = Box<dyn EnergyTerm>;

    fn visit<M: Material<D> + Material<3> + Clone>(self, material: M) -> Box<dyn EnergyTerm> {
        let ElementSet { body, rest, stress, .. } = *self.elements;
        let how = (stress, self.dilatation);
        Box::new(MeanDilatation::new(body, material, how, self.cell, self.elements.of(), rest))
    }
}
