//! Axes of the material in simplices and in isoparametric elements.
//!
//! At a point of reference volume `w` whose material is rotated by `R`, with `F` of the positions and `G`
//! of `p`, `p . dE/dx = w P(F R) : G R`. If `R` changes by `dR`, this changes by `w K : dR`, `K = F^T
//! (dP/dF : G R) + G^T P(F R)`. Isoparametric elements compute this themselves.

use pliant::algebra::{Dual, Mat};
use pliant::element::CellKind;
use pliant::energy::elastic::CellTurns;
use pliant::material::{MaterialSpec, material_axes};
use pliant_terms::ElementSet;

use super::elements::{BodyElements, ElementEnergy, ElementsVisitor, Maker, ModulusElements};
use super::{ForceUse, Parameter};
use crate::adjoint::add_scaled;

/// Directions of the material axes in each element, third components 0 in 2D, as used by
/// [`material_axes`].
#[derive(Clone, Copy, Debug)]
pub struct AxisDirections<'a> {
    /// Direction of the first axis, one for each element.
    pub first: &'a [[f64; 3]],
    /// Direction in the plane of the first two axes, one for each element, if any.
    pub second: Option<&'a [[f64; 3]]>,
    /// True for derivatives by the second directions.
    pub by_second: bool,
}

impl AxisDirections<'_> {
    /// Rotation of element `i` and its derivative by component `c` of the direction.
    fn axes(&self, i: usize, c: usize) -> (Mat<f64, 3>, Mat<f64, 3>) {
        let moved = |direction: &[f64; 3], is_by: bool| {
            let mut dual = direction.map(Dual::constant);
            dual[c].derivative = if is_by { 1.0 } else { 0.0 };
            dual
        };
        let first = moved(&self.first[i], !self.by_second);
        let second = self.second.map(|second| moved(&second[i], self.by_second));
        Dual::parts(&material_axes(&first, second.as_ref()))
    }
}

/// Parameter: components of a direction in each element.
struct ElementAxes<const D: usize, const N: usize> {
    elements: ModulusElements<D, N>,
    energy: Box<dyn ElementEnergy<D>>,
    /// Factor of the energy density of each element.
    factors: Vec<f64>,
    /// Rotation of each element, and its derivatives by the components of the direction.
    axes: Vec<(Mat<f64, D>, [Mat<f64, D>; D])>,
}

impl<const D: usize, const N: usize> Parameter for ElementAxes<D, N> {
    fn len(&self) -> usize {
        D * self.axes.len()
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        for (i, (change, (axes, by))) in change.as_chunks::<D>().0.iter().zip(&self.axes).enumerate() {
            let turn =
                by.iter().zip(change).fold(Mat::zero(), |turn, (by, change)| by.scale_add(*change, &turn));
            for at in self.elements.at(i) {
                let [f, _] = at.deformation((of.x, of.x));
                let turned = f.mul(axes);
                let along = self.energy.stress_along(&turned, &f.mul(&turn)).mul_transpose(axes);
                let stress = along + self.energy.stress(&turned).mul_transpose(&turn);
                at.add(&stress.scale(-self.factors[i]), force);
            }
        }
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        let each = derivative.as_chunks_mut::<D>().0.iter_mut().zip(&self.axes);
        for (i, (derivative, (axes, by))) in each.enumerate() {
            for at in self.elements.at(i) {
                let [f, g] = at.deformation((of.x, of.p));
                let (turned, along) = (f.mul(axes), g.mul(axes));
                let by_axes = f.transpose_mul(&self.energy.stress_along(&turned, &along))
                    + g.transpose_mul(&self.energy.stress(&turned));
                let weight = at.volume() * self.factors[i];
                derivative.iter_mut().zip(by).for_each(|(d, by)| *d -= weight * by_axes.dot(by));
            }
        }
    }
}

/// Parameter: components of a direction in each isoparametric element.
struct CellAxes {
    cells: Box<dyn CellTurns>,
    components: usize,
}

impl Parameter for CellAxes {
    fn len(&self) -> usize {
        self.components
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        let opposite: Vec<f64> = change.iter().map(|change| -change).collect();
        self.cells.add_gradients(of.x, &opposite, force);
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        let mut works = vec![0.0; self.components];
        self.cells.add_works(of.x, of.p, &mut works);
        add_scaled(derivative, -1.0, &works);
    }
}

/// Parameter for the components of the axis directions of `material` in each isoparametric element of a
/// kind, flat `(cells, dimension)`; the axes of `elements` must be those of these directions.
pub fn cell_axes(
    material: &MaterialSpec,
    kind: &CellKind,
    elements: &ElementSet<'_>,
    directions: AxisDirections<'_>,
) -> Box<dyn Parameter> {
    let count = directions.first.len();
    // In 2D the third component is not used.
    let turns = |i: usize| std::array::from_fn(|c| directions.axes(i, c).1);
    let turns: Vec<[Mat<f64, 3>; 3]> = (0..count).map(turns).collect();
    let cells = pliant_terms::turning_cells(material, kind, elements, &turns);
    Box::new(CellAxes { cells, components: elements.dimension * count })
}

/// Builder of the parameter for axis directions.
struct AxesMaker<'a> {
    material: &'a MaterialSpec,
    factors: &'a [f64],
    directions: AxisDirections<'a>,
}

impl ElementsVisitor for AxesMaker<'_> {
    fn visit<const D: usize, const N: usize>(self, elements: ModulusElements<D, N>) -> Box<dyn Parameter> {
        let AxesMaker { material, factors, directions } = self;
        let count = directions.first.len();
        let of_element = |i: usize| {
            let mut by = [Mat::zero(); D];
            (0..D).for_each(|c| by[c] = directions.axes(i, c).1.leading());
            (directions.axes(i, 0).0.leading(), by)
        };
        Box::new(ElementAxes {
            elements,
            energy: material.visit::<D, _>(Maker),
            factors: if factors.is_empty() { vec![1.0; count] } else { factors.to_vec() },
            axes: (0..count).map(of_element).collect(),
        })
    }
}

impl BodyElements<'_> {
    /// Parameter for the components of the axis directions of `material` in each simplex, flat
    /// `(elements, dimension)`. Energy densities are multiplied by `factors`; empty `factors` are 1. For
    /// isoparametric elements see [`cell_axes`].
    ///
    /// # Panics
    /// For isoparametric elements.
    pub fn axes(
        &self,
        material: &MaterialSpec,
        factors: &[f64],
        directions: AxisDirections<'_>,
    ) -> Box<dyn Parameter> {
        let is_first_order = self.kind.is_some_and(|kind| kind.order() == 1);
        assert!(!is_first_order, "cells have stresses of their own");
        self.visit(AxesMaker { material, factors, directions })
    }
}
