//! Linear triangles in the plane and linear tetrahedra in space, one by one.
//!
//! An element of rest volume `w` with edges `D_m` at rest has `E = w psi(F)`, `F = D_s D_m^-1`. With `G`
//! made of `p` as `F` is of the positions, `p . dE/dx = w P(F) : G`: linear in `psi`.

use pliant::algebra::Mat;
use pliant::element::simplex_rest;
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

/// Linear elements at rest.
#[derive(Clone)]
pub(super) struct ModulusElements<const D: usize, const N: usize> {
    /// Vertices, by their numbers in the simulation.
    vertices: Vec<[u32; N]>,
    /// `D_m^-1` and `w`.
    rest: Vec<(Mat<f64, D>, f64)>,
}

impl<const D: usize, const N: usize> ModulusElements<D, N> {
    pub(super) fn new(cells: &[u32], rest: &[f64]) -> Self {
        let vertices = cells.as_chunks::<N>().0.to_vec();
        let rest = vertices.iter().map(|element| simplex_rest(&points_of(rest, element))).collect();
        ModulusElements { vertices, rest }
    }

    /// `F` of the positions and `G` of the direction of element `i`.
    pub(super) fn deformation(&self, i: usize, (x, p): (&[f64], &[f64])) -> [Mat<f64, D>; 2] {
        let (inverse, _) = &self.rest[i];
        [x, p].map(|rows| edges(&points_of::<D, N>(rows, &self.vertices[i])).mul(inverse))
    }

    /// Volume of element `i` at rest.
    pub(super) fn volume(&self, i: usize) -> f64 {
        self.rest[i].1
    }

    /// Adds `w T D_m^-T` at the vertices of element `i`: what `w T : G` is the product of with the direction
    /// that `G` is made of.
    pub(super) fn add_at(&self, i: usize, stress: &Mat<f64, D>, rows: &mut [f64]) {
        let (element, (inverse, volume)) = (&self.vertices[i], &self.rest[i]);
        let by_edges = stress.mul_transpose(inverse).scale(*volume);
        for (a, vertex) in element[1..].iter().enumerate() {
            for (end, sign) in [(*vertex, 1.0), (element[0], -1.0)] {
                let row = &mut rows[end as usize * D..][..D];
                (0..D).for_each(|k| row[k] += sign * by_edges[k][a]);
            }
        }
    }
}

/// `[x_1 - x_0, .., x_D - x_0]`, by columns.
fn edges<const D: usize, const N: usize>(points: &[[f64; D]; N]) -> Mat<f64, D> {
    let mut edges = Mat::zero();
    for i in 0..D {
        for a in 0..D {
            edges[i][a] = points[a + 1][i] - points[0][i];
        }
    }
    edges
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
            let [f, g] = self.elements.deformation(i, (of.x, of.shape));
            let along =
                |(factor, psi): &(f64, Box<dyn ElementEnergy<D>>)| factor * psi.stress_along(&f, &g).dot(&g);
            *derivative += self.elements.rest[i].1 * self.parts.iter().map(along).sum::<f64>();
        }
        true
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        for (i, change) in change.iter().enumerate() {
            let [f, _] = self.elements.deformation(i, (of.x, of.x));
            let mut stress = Mat::zero();
            self.parts.iter().for_each(|(factor, psi)| stress += psi.stress(&f).scale(-factor * change));
            self.elements.add_at(i, &stress, force);
        }
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        for (i, derivative) in derivative.iter_mut().enumerate() {
            let [f, g] = self.elements.deformation(i, (of.x, of.p));
            let along: f64 = self.parts.iter().map(|(factor, psi)| factor * psi.stress(&f).dot(&g)).sum();
            *derivative -= self.elements.rest[i].1 * along;
        }
    }
}

/// Linear elements of a body at rest, and where they are.
#[derive(Clone, Copy, Debug)]
pub struct LinearElements<'a> {
    /// 2 or 3.
    pub dimension: usize,
    /// Vertices, by their numbers in the simulation, flat: three of each triangle, four of each tetrahedron.
    pub cells: &'a [u32],
    /// Rest positions of all vertices of the simulation, flat [m].
    pub rest: &'a [f64],
}

impl LinearElements<'_> {
    /// A number of each element whose energy densities are these, factors first: see
    /// [`Modulus`](super::Modulus).
    pub fn moduli(&self, parts: &[(f64, MaterialSpec)]) -> Box<dyn Parameter> {
        match self.dimension {
            2 => self.moduli_of::<2, 3>(parts),
            _ => self.moduli_of::<3, 4>(parts),
        }
    }

    fn moduli_of<const D: usize, const N: usize>(&self, parts: &[(f64, MaterialSpec)]) -> Box<dyn Parameter> {
        let parts = parts.iter().map(|(factor, material)| (*factor, material.visit::<D, _>(Maker)));
        let elements = ModulusElements::<D, N>::new(self.cells, self.rest);
        Box::new(ElementModuli { elements, parts: parts.collect() })
    }
}
