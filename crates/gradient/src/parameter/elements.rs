//! Triangles in the plane and tetrahedra in space, of first and second order, one by one.
//!
//! An element has `E = sum_q w psi(F)` over its points of rest volumes `w` with gradients `b_a` of the shape
//! functions, `F = sum_a x_a b_a^T`. With `G` made of `p` as `F` is of the positions, `p . dE/dx = sum_q w
//! P(F) : G`: linear in `psi`.

use pliant::algebra::Mat;
use pliant::element::{
    QuadraturePoint, quadrature_count, quadrature_points, quadrature_position, shape_functions,
};
use pliant::energy::elastic::points_of;
use pliant::material::{Material, MaterialSpec, MaterialVisitor, Psd};

use super::{ForceUse, ModeUse, Parameter};

/// Stress and its derivative in a direction, of whatever material.
pub(super) trait ElementEnergy<const D: usize>: Send {
    /// `P(F)` [Pa].
    fn stress(&self, f: &Mat<f64, D>) -> Mat<f64, D>;

    /// `dP/dF : G` [Pa].
    fn stress_along(&self, f: &Mat<f64, D>, g: &Mat<f64, D>) -> Mat<f64, D>;
}

/// Whatever material is visited.
struct Of<M>(M);

impl<const D: usize, M: Material<D>> ElementEnergy<D> for Of<M> {
    fn stress(&self, f: &Mat<f64, D>) -> Mat<f64, D> {
        self.0.pk1(f)
    }

    fn stress_along(&self, f: &Mat<f64, D>, g: &Mat<f64, D>) -> Mat<f64, D> {
        self.0.hessian(f, Psd::Exact).apply(g)
    }
}

/// Maker of it.
pub(super) struct Maker;

impl<const D: usize> MaterialVisitor<D> for Maker {
    type Output = Box<dyn ElementEnergy<D>>;

    fn visit<M: Material<D> + Material<3> + Clone>(self, material: M) -> Self::Output {
        Box::new(Of(material))
    }
}

/// Simplices of first or second order at rest.
#[derive(Clone)]
pub(super) struct ModulusElements<const D: usize, const N: usize> {
    /// Vertices, by their numbers in the simulation.
    vertices: Vec<[u32; N]>,
    /// Points at which energies are summed, those of one element after those of another.
    points: Vec<QuadraturePoint<D, N>>,
}

impl<const D: usize, const N: usize> ModulusElements<D, N> {
    pub(super) fn new(cells: &[u32], rest: &[f64]) -> Self {
        let vertices = cells.as_chunks::<N>().0.to_vec();
        let of_element = |element: &[u32; N]| -> Vec<QuadraturePoint<D, N>> {
            quadrature_points(&points_of(rest, element)).collect()
        };
        ModulusElements { points: vertices.iter().flat_map(of_element).collect(), vertices }
    }

    /// Element `i` at each of its points.
    pub(super) fn at(&self, i: usize) -> impl Iterator<Item = ElementPoint<'_, D, N>> {
        let count = quadrature_count::<D, N>();
        let element = &self.vertices[i];
        let numbers = i * count..;
        let points = self.points[i * count..][..count].iter().zip(numbers);
        points.map(move |(point, number)| ElementPoint { element, point, number })
    }

    /// Nodes of the element of every point, by their numbers in the simulation, and shape functions there.
    pub(super) fn nodes(&self) -> impl Iterator<Item = (&[u32; N], [f64; N])> {
        let of_point = |q| shape_functions::<D, N>(&quadrature_position::<D, N>(q));
        let values: Vec<[f64; N]> = (0..quadrature_count::<D, N>()).map(of_point).collect();
        self.vertices.iter().flat_map(move |element| values.clone().into_iter().map(move |n| (element, n)))
    }

    /// Places of all points at rest, third component 0 in 2D; `rest` flat [m].
    pub(super) fn places(&self, rest: &[f64]) -> Vec<[f64; 3]> {
        let place = |(element, values): (&[u32; N], [f64; N])| {
            let mut place = [0.0; 3];
            for (node, n) in points_of::<D, N>(rest, element).iter().zip(values) {
                place.iter_mut().zip(node).for_each(|(sum, x)| *sum += n * x);
            }
            place
        };
        self.nodes().map(place).collect()
    }
}

/// A point of an element.
#[derive(Clone, Copy)]
pub(super) struct ElementPoint<'a, const D: usize, const N: usize> {
    element: &'a [u32; N],
    point: &'a QuadraturePoint<D, N>,
    /// Its number among all points.
    pub(super) number: usize,
}

impl<const D: usize, const N: usize> ElementPoint<'_, D, N> {
    /// `F` of the positions and `G` of the direction.
    pub(super) fn deformation(&self, (x, p): (&[f64], &[f64])) -> [Mat<f64, D>; 2] {
        [x, p].map(|rows| self.point.deformation_gradient(&points_of(rows, self.element)))
    }

    /// Volume at rest that it stands for.
    pub(super) fn volume(&self) -> f64 {
        self.point.weight
    }

    /// Adds `w T b_a` at the nodes: what `w T : G` is the product of with the direction that `G` is made of.
    pub(super) fn add(&self, stress: &Mat<f64, D>, rows: &mut [f64]) {
        for (vertex, gradient) in self.element.iter().zip(&self.point.gradients) {
            let row = stress.mul_vec(gradient);
            let rows = &mut rows[*vertex as usize * D..][..D];
            rows.iter_mut().zip(row).for_each(|(sum, row)| *sum += self.point.weight * row);
        }
    }
}

/// A number of each element, with `d psi/d theta = sum_i c_i psi_i` as [`Modulus`](super::Modulus) has it
/// of the whole body.
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

/// Simplices of a body at rest, and where they are.
#[derive(Clone, Copy, Debug)]
pub struct BodySimplices<'a> {
    /// 2 or 3.
    pub dimension: usize,
    /// 1 or 2.
    pub order: u32,
    /// Vertices, by their numbers in the simulation, flat: corners, then middles of edges, of each element.
    pub cells: &'a [u32],
    /// Rest positions of all vertices of the simulation, flat [m].
    pub rest: &'a [f64],
}

impl BodySimplices<'_> {
    /// A number of each element whose energy densities are these, factors first: see
    /// [`Modulus`](super::Modulus).
    pub fn moduli(&self, parts: &[(f64, MaterialSpec)]) -> Box<dyn Parameter> {
        match (self.dimension, self.order) {
            (2, 1) => self.moduli_of::<2, 3>(parts),
            (2, _) => self.moduli_of::<2, 6>(parts),
            (_, 1) => self.moduli_of::<3, 4>(parts),
            _ => self.moduli_of::<3, 10>(parts),
        }
    }

    fn moduli_of<const D: usize, const N: usize>(&self, parts: &[(f64, MaterialSpec)]) -> Box<dyn Parameter> {
        let parts = parts.iter().map(|(factor, material)| (*factor, material.visit::<D, _>(Maker)));
        let elements = ModulusElements::<D, N>::new(self.cells, self.rest);
        Box::new(ElementModuli { elements, parts: parts.collect() })
    }
}
