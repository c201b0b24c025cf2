//! Linear triangles in the plane and linear tetrahedra in space, one by one.
//!
//! An element of rest volume `w` with edges `D_m` at rest has `E = w psi(F)`, `F = D_s D_m^-1`. With `G`
//! made of `p` as `F` is of the positions, `p . dE/dx = w P(F) : G`: linear in `psi`, and a function of
//! `D_m`.

use pliant::algebra::Mat;
use pliant::element::simplex_rest;
use pliant::material::{Material, MaterialSpec, MaterialVisitor, Psd};

use super::mass::{add_by_mass, by_mass, mode_by_mass, uniform_gravity};
use super::{ForceUse, ModeUse, Parameter};

/// Stress and its derivative in a direction, of whatever material.
trait ElementEnergy<const D: usize>: Send {
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
struct Maker;

impl<const D: usize> MaterialVisitor<D> for Maker {
    type Output = Box<dyn ElementEnergy<D>>;

    fn visit<M: Material<D> + Material<3> + Clone>(self, material: M) -> Self::Output {
        Box::new(Of(material))
    }
}

/// ModulusElements at rest.
#[derive(Clone)]
struct ModulusElements<const D: usize, const N: usize> {
    /// Vertices, by their numbers in the simulation.
    vertices: Vec<[u32; N]>,
    /// `D_m^-1` and `w`.
    rest: Vec<(Mat<f64, D>, f64)>,
}

impl<const D: usize, const N: usize> ModulusElements<D, N> {
    fn new(cells: &[u32], rest: &[f64]) -> Self {
        let vertices = cells.as_chunks::<N>().0.to_vec();
        let rest = vertices.iter().map(|element| simplex_rest(&points(rest, element))).collect();
        ModulusElements { vertices, rest }
    }

    /// `F` of the positions and `G` of the direction of element `i`.
    fn deformation(&self, i: usize, (x, p): (&[f64], &[f64])) -> [Mat<f64, D>; 2] {
        let (inverse, _) = &self.rest[i];
        [x, p].map(|rows| edges(&points::<D, N>(rows, &self.vertices[i])).mul(inverse))
    }
}

/// Adds `w T D_m^-T` at the vertices of an element: what `w T : G` is the product of with the direction that
/// `G` is made of.
fn add_at<const D: usize, const N: usize>(
    element: &[u32; N],
    (inverse, volume): &(Mat<f64, D>, f64),
    stress: &Mat<f64, D>,
    rows: &mut [f64],
) {
    let by_edges = stress.mul_transpose(inverse).scale(*volume);
    for (a, vertex) in element[1..].iter().enumerate() {
        for (end, sign) in [(*vertex, 1.0), (element[0], -1.0)] {
            let row = &mut rows[end as usize * D..][..D];
            (0..D).for_each(|k| row[k] += sign * by_edges[k][a]);
        }
    }
}

/// Rows of these vertices in a flat array.
fn points<const D: usize, const N: usize>(rows: &[f64], vertices: &[u32; N]) -> [[f64; D]; N] {
    let mut points = [[0.0; D]; N];
    for (point, vertex) in points.iter_mut().zip(vertices) {
        point.copy_from_slice(&rows[*vertex as usize * D..][..D]);
    }
    points
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
            add_at(&self.elements.vertices[i], &self.elements.rest[i], &stress, force);
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

/// Rest positions of the vertices of a body.
struct RestShape<const D: usize, const N: usize> {
    elements: ModulusElements<D, N>,
    psi: Box<dyn ElementEnergy<D>>,
    /// ElementEnergy [kg/m^3]; zero where masses do not go by volumes.
    density: f64,
    /// Place of each vertex of the simulation among those of the body.
    place: Vec<u32>,
    vertices: usize,
}

impl<const D: usize, const N: usize> RestShape<D, N> {
    /// `K` of `d(p . dE/dx) = w K : dD_m D_m^-1` of element `i`.
    fn rate(&self, i: usize, of: &ForceUse<'_>) -> Mat<f64, D> {
        let [f, g] = self.elements.deformation(i, (of.x, of.p));
        let (stress, along) = (self.psi.stress(&f), self.psi.stress_along(&f, &g));
        Mat::scalar(stress.dot(&g)) - f.transpose_mul(&along) - g.transpose_mul(&stress)
    }
}

impl<const D: usize, const N: usize> Parameter for RestShape<D, N> {
    fn len(&self) -> usize {
        D * self.vertices
    }

    fn needs_force(&self) -> bool {
        self.density != 0.0
    }

    /// The state goes with the shape at rest: `F` stays, and `G` of a mode changes by `-G dD_m D_m^-1`.
    fn add_mode(&mut self, of: &ModeUse<'_>, derivative: &mut [f64]) -> bool {
        let rate = |i: usize| {
            let [f, g] = self.elements.deformation(i, (of.x, of.shape));
            let along = self.psi.stress_along(&f, &g);
            Mat::scalar(along.dot(&g)) - g.transpose_mul(&along).scale(2.0)
        };
        self.spread(rate, |vertex| mode_by_mass(of, vertex), derivative);
        of.is_lumped
    }

    /// With `B = dD_m D_m^-1`: `dP = P tr B - dP/dF : F B - P B^T`.
    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        let gravity = uniform_gravity(of.system);
        for (element, rest) in self.elements.vertices.iter().zip(&self.elements.rest) {
            let moved = element.map(|vertex| {
                let mut moved = [0.0; D];
                moved.copy_from_slice(&change[self.place[vertex as usize] as usize * D..][..D]);
                moved
            });
            let b = edges(&moved).mul(&rest.0);
            let f = edges(&points::<D, N>(of.x, element)).mul(&rest.0);
            let (stress, growth) = (self.psi.stress(&f), b.trace());
            let along = self.psi.stress_along(&f, &f.mul(&b));
            let by_shape = stress.mul_transpose(&b) + along - stress.scale(growth);
            add_at(element, rest, &by_shape, force);
            if self.density != 0.0 {
                let mass = self.density / N as f64 * rest.1 * growth;
                element.iter().for_each(|vertex| {
                    add_by_mass(of, &gravity, *vertex as usize, mass, force);
                });
            }
        }
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        let gravity = uniform_gravity(of.system);
        self.spread(|i| -self.rate(i, of), |vertex| by_mass(of, &gravity, vertex), derivative);
    }
}

impl<const D: usize, const N: usize> RestShape<D, N> {
    /// Adds what rest positions make of `w K : dD_m D_m^-1` with `K` of each element, and of masses, by a
    /// derivative at each vertex.
    fn spread(
        &self,
        rate: impl Fn(usize) -> Mat<f64, D>,
        by_mass: impl Fn(usize) -> f64,
        derivative: &mut [f64],
    ) {
        for (i, element) in self.elements.vertices.iter().enumerate() {
            let mut rate = rate(i);
            if self.density != 0.0 {
                let masses = element.iter().map(|vertex| by_mass(*vertex as usize));
                rate += Mat::scalar(self.density / N as f64 * masses.sum::<f64>());
            }
            let (inverse, volume) = &self.elements.rest[i];
            let by_edges = rate.mul_transpose(inverse).scale(*volume);
            for (a, vertex) in element[1..].iter().enumerate() {
                for (end, sign) in [(*vertex, 1.0), (element[0], -1.0)] {
                    let place = self.place[end as usize] as usize * D;
                    (0..D).for_each(|k| derivative[place + k] += sign * by_edges[k][a]);
                }
            }
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

    /// Rest positions of `vertices`, by their numbers in the simulation: all that the elements have, and no
    /// others. They change deformation, volumes, and masses of the `density` [kg/m^3], where there is one;
    /// the start of the run stays as it is.
    pub fn rest_shape(
        &self,
        material: &MaterialSpec,
        density: Option<f64>,
        vertices: &[u32],
    ) -> Box<dyn Parameter> {
        let density = density.unwrap_or(0.0);
        match self.dimension {
            2 => self.rest_shape_of::<2, 3>(material, density, vertices),
            _ => self.rest_shape_of::<3, 4>(material, density, vertices),
        }
    }

    fn rest_shape_of<const D: usize, const N: usize>(
        &self,
        material: &MaterialSpec,
        density: f64,
        vertices: &[u32],
    ) -> Box<dyn Parameter> {
        let mut place = vec![0; self.rest.len() / D];
        vertices.iter().zip(0..).for_each(|(vertex, i)| place[*vertex as usize] = i);
        let (elements, psi) =
            (ModulusElements::<D, N>::new(self.cells, self.rest), material.visit::<D, _>(Maker));
        Box::new(RestShape { elements, psi, density, place, vertices: vertices.len() })
    }
}
