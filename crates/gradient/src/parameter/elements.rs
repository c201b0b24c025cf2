//! Elements of a body one by one: triangles in 2D and tetrahedra in 3D, of first and second order, and
//! isoparametric elements with muscle forces at their points.
//!
//! An element has `E = sum_q w psi(F)` over its points of reference volumes `w` with gradients `b_a` of
//! the shape functions, `F = sum_a x_a b_a^T`. With `G` formed from `p` as `F` is from the positions, `p
//! . dE/dx = sum_q w P(F) : G`, which is linear in `psi`.

use pliant::algebra::Mat;
use pliant::element::{CellKind, CellVisitor, Isoparametric, QuadraturePoint};
use pliant::energy::elastic::points_of;
use pliant::material::{Material, MaterialSpec, MaterialVisitor, Psd};

use super::points::VolumePoints;
use super::{ForceUse, ModeUse, Parameter};

/// Stress of a material and its derivative in a direction.
pub(super) trait ElementEnergy<const D: usize>: Send {
    /// First Piola-Kirchhoff stress `P(F)` [Pa].
    fn stress(&self, f: &Mat<f64, D>) -> Mat<f64, D>;

    /// Derivative `dP/dF : G` [Pa].
    fn stress_along(&self, f: &Mat<f64, D>, g: &Mat<f64, D>) -> Mat<f64, D>;
}

struct Of<M>(M);

impl<const D: usize, M: Material<D>> ElementEnergy<D> for Of<M> {
    fn stress(&self, f: &Mat<f64, D>) -> Mat<f64, D> {
        self.0.pk1(f)
    }

    fn stress_along(&self, f: &Mat<f64, D>, g: &Mat<f64, D>) -> Mat<f64, D> {
        self.0.hessian(f, Psd::Exact).apply(g)
    }
}

/// Builder of an [`ElementEnergy`].
pub(super) struct Maker;

impl<const D: usize> MaterialVisitor<D> for Maker {
    type Output = Box<dyn ElementEnergy<D>>;

    fn visit<M: Material<D> + Material<3> + Clone>(self, material: M) -> Self::Output {
        Box::new(Of(material))
    }
}

/// Elements of a body with their reference geometry.
#[derive(Clone)]
pub(super) struct ModulusElements<const D: usize, const N: usize> {
    /// Vertices, by index in the simulation.
    vertices: Vec<[u32; N]>,
    /// Quadrature points of the energies.
    points: VolumePoints<D, N>,
}

impl<const D: usize, const N: usize> ModulusElements<D, N> {
    /// Simplices of first or second order.
    pub(super) fn simplices(cells: &[u32], rest: &[f64]) -> Self {
        let vertices = cells.as_chunks::<N>().0.to_vec();
        ModulusElements { points: VolumePoints::of_energy(&vertices, rest), vertices }
    }

    /// Isoparametric elements.
    pub(super) fn cells(cells: &[u32], rest: &[f64], cell: &Isoparametric<D, N>) -> Self {
        let vertices = cells.as_chunks::<N>().0.to_vec();
        ModulusElements { points: VolumePoints::of_cells(&vertices, rest, cell), vertices }
    }

    /// Element `i` at each of its points.
    pub(super) fn at(&self, i: usize) -> impl Iterator<Item = ElementPoint<'_, D, N>> {
        let (element, points) = (&self.vertices[i], self.points.all_of(i));
        let numbers = i * points.len()..;
        points.iter().zip(numbers).map(move |(point, number)| ElementPoint { element, point, number })
    }

    /// Nodes of the element of every point, by index in the simulation, with the shape functions there.
    pub(super) fn nodes(&self) -> impl Iterator<Item = (&[u32; N], &[f64; N])> {
        self.vertices.iter().flat_map(|element| self.points.values.iter().map(move |n| (element, n)))
    }

    /// Reference positions of all points, third component 0 in 2D; `rest` flat [m].
    pub(super) fn places(&self, rest: &[f64]) -> Vec<[f64; 3]> {
        self.points.places(&self.vertices, rest)
    }
}

/// Quadrature point of an element.
#[derive(Clone, Copy)]
pub(super) struct ElementPoint<'a, const D: usize, const N: usize> {
    element: &'a [u32; N],
    point: &'a QuadraturePoint<D, N>,
    /// Index among all points.
    pub(super) number: usize,
}

impl<const D: usize, const N: usize> ElementPoint<'_, D, N> {
    /// `F` of the positions and `G` of the direction.
    pub(super) fn deformation(&self, (x, p): (&[f64], &[f64])) -> [Mat<f64, D>; 2] {
        [x, p].map(|rows| self.point.deformation_gradient(&points_of(rows, self.element)))
    }

    /// Reference volume of the point.
    pub(super) fn volume(&self) -> f64 {
        self.point.weight
    }

    /// Adds `w T b_a` at the nodes, the gradient of `w T : G` by the direction that forms `G`.
    pub(super) fn add(&self, stress: &Mat<f64, D>, rows: &mut [f64]) {
        for (vertex, gradient) in self.element.iter().zip(&self.point.gradients) {
            let row = stress.mul_vec(gradient);
            let rows = &mut rows[*vertex as usize * D..][..D];
            rows.iter_mut().zip(row).for_each(|(sum, row)| *sum += self.point.weight * row);
        }
    }
}

/// Parameter: one number for each element, with `d psi/d theta = sum_i c_i psi_i` as in
/// [`Modulus`](super::Modulus) for the whole body.
struct ElementModuli<const D: usize, const N: usize> {
    elements: ModulusElements<D, N>,
    parts: Vec<(f64, Box<dyn ElementEnergy<D>>)>,
}

impl<const D: usize, const N: usize> Parameter for ElementModuli<D, N> {
    fn len(&self) -> usize {
        self.elements.vertices.len()
    }

    fn add_mode(&mut self, of: &ModeUse<'_>, derivative: &mut [f64]) -> bool {
        for (i, derivative) in derivative.iter_mut().enumerate() {
            for at in self.elements.at(i) {
                let [f, g] = at.deformation((of.x, of.shape));
                let along = |(factor, psi): &(f64, Box<dyn ElementEnergy<D>>)| {
                    factor * psi.stress_along(&f, &g).dot(&g)
                };
                *derivative += at.volume() * self.parts.iter().map(along).sum::<f64>();
            }
        }
        true
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        for (i, change) in change.iter().enumerate() {
            for at in self.elements.at(i) {
                let [f, _] = at.deformation((of.x, of.x));
                let mut stress = Mat::zero();
                self.parts.iter().for_each(|(factor, psi)| stress += psi.stress(&f).scale(-factor * change));
                at.add(&stress, force);
            }
        }
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        for (i, derivative) in derivative.iter_mut().enumerate() {
            for at in self.elements.at(i) {
                let [f, g] = at.deformation((of.x, of.p));
                let along: f64 = self.parts.iter().map(|(factor, psi)| factor * psi.stress(&f).dot(&g)).sum();
                *derivative -= at.volume() * along;
            }
        }
    }
}

/// Elements of a body with their reference positions.
#[derive(Clone, Copy, Debug)]
pub struct BodyElements<'a> {
    /// Dimension, 2 or 3.
    pub dimension: usize,
    /// Order of simplices, 1 or 2.
    pub order: u32,
    /// Kind of isoparametric elements; `None` for simplices.
    pub kind: Option<&'a CellKind>,
    /// Vertices, by index in the simulation, flat: corners, then midside nodes, of each element.
    pub cells: &'a [u32],
    /// Reference positions of all vertices of the simulation, flat [m].
    pub rest: &'a [f64],
}

/// Builder of a parameter from elements of any kind.
pub(super) trait ElementsVisitor {
    /// Builds the parameter.
    fn visit<const D: usize, const N: usize>(self, elements: ModulusElements<D, N>) -> Box<dyn Parameter>;
}

/// Adapter of the visitor for isoparametric elements.
struct OfCells<'a, V> {
    of: &'a BodyElements<'a>,
    visitor: V,
}

impl<V: ElementsVisitor> CellVisitor for OfCells<'_, V> {
    type Output = Box<dyn Parameter>;

    fn visit<const D: usize, const N: usize>(self, cell: &'static Isoparametric<D, N>) -> Self::Output {
        self.visitor.visit(ModulusElements::<D, N>::cells(self.of.cells, self.of.rest, cell))
    }
}

impl BodyElements<'_> {
    /// Builds a parameter from the elements.
    pub(super) fn visit(&self, visitor: impl ElementsVisitor) -> Box<dyn Parameter> {
        let BodyElements { cells, rest, .. } = *self;
        if let Some(kind) = self.kind {
            return kind.visit(OfCells { of: self, visitor });
        }
        match (self.dimension, self.order) {
            (2, 1) => visitor.visit(ModulusElements::<2, 3>::simplices(cells, rest)),
            (2, _) => visitor.visit(ModulusElements::<2, 6>::simplices(cells, rest)),
            (_, 1) => visitor.visit(ModulusElements::<3, 4>::simplices(cells, rest)),
            _ => visitor.visit(ModulusElements::<3, 10>::simplices(cells, rest)),
        }
    }

    /// Parameter with one number for each simplex or second-order cell, given by the factors and
    /// materials of its energy densities: see [`Modulus`](super::Modulus).
    ///
    /// # Panics
    /// For first-order cells, which compute their own stresses.
    pub fn moduli(&self, parts: &[(f64, MaterialSpec)]) -> Box<dyn Parameter> {
        let is_first_order = self.kind.is_some_and(|kind| kind.order() == 1);
        assert!(!is_first_order, "cells have stresses of their own");
        self.visit(ModuliMaker(parts))
    }
}

/// Builder of the moduli of single elements.
struct ModuliMaker<'a>(&'a [(f64, MaterialSpec)]);

impl ElementsVisitor for ModuliMaker<'_> {
    fn visit<const D: usize, const N: usize>(self, elements: ModulusElements<D, N>) -> Box<dyn Parameter> {
        let parts = self.0.iter().map(|(factor, material)| (*factor, material.visit::<D, _>(Maker)));
        Box::new(ElementModuli { elements, parts: parts.collect() })
    }
}
