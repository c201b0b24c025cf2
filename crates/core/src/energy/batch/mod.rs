//! Finite elements whose material is evaluated for many points at once, such as a user's functions in
//! Python. [`Elastic`](super::elastic::Elastic) is faster, because its material is known when it is
//! compiled.

mod tangent;

use std::ops::Range;

use super::elastic::points_of;
use super::evaluated::tangent_in_space;
use super::{
    DeformationExtremes, ElementTerm, ElementVisitor, EnergyKind, EnergyTerm, EvaluatedElement, Fault,
    MaterialOutput, Measurements, Stencils, TermProperties, TermViews,
};
use crate::algebra::Mat;
use crate::algebra::all_finite;
use crate::element::ElementState;
use crate::element::{
    Barycentric, QuadraturePoint, centroid, interpolation, quadrature_count, quadrature_points,
};
use crate::material::{Psd, Tangent};

/// Hyperelastic material for `m` deformation gradients at once, each `d x d` by rows, one after the
/// other. Functions return false if they could not be evaluated at all; values that are not finite are
/// valid results.
pub trait BatchMaterial: Send + Sync {
    /// Writes `Psi(F)` [J/m^3], `m` numbers; `+inf` outside the domain of the material.
    fn density(&self, f: &[f64], psi: &mut [f64]) -> bool;

    /// Writes `P = dPsi/dF` [Pa], `(m, d, d)`.
    fn stress(&self, f: &[f64], p: &mut [f64]) -> bool;

    /// Writes `dP_ij / dF_kl` [Pa], `(m, d, d, d, d)`; returns `None` if it is not available, and central
    /// differences of the stress replace it.
    fn tangent(&self, f: &[f64], tangent: &mut [f64]) -> Option<bool> {
        let _ = (f, tangent);
        None
    }
}

/// Elements of `N` nodes in `D` dimensions, 3 and 6 in 2D, 4 and 10 in 3D:
/// `E = sum_e sum_q w_q Psi(F_q)`.
pub struct BatchElastic<const D: usize, const N: usize> {
    body: String,
    material: Box<dyn BatchMaterial>,
    cells: Vec<[u32; N]>,
    /// Quadrature points, element by element.
    points: Vec<QuadraturePoint<D, N>>,
    /// Last evaluated gradient, flat over all vertices of the system [N].
    gradient: Vec<f64>,
    /// Scratch memory for deformation gradients, stresses and energy densities.
    f: Vec<f64>,
    p: Vec<f64>,
    psi: Vec<f64>,
}

impl<const D: usize, const N: usize> BatchElastic<D, N> {
    /// Creates elements `cells` (vertices of the system) of `body` with the reference positions `rest`,
    /// flat over all vertices of the system [m].
    ///
    /// # Panics
    /// If an element has no positive area or volume; meshes are checked before.
    pub fn new(body: &str, material: Box<dyn BatchMaterial>, cells: Vec<[u32; N]>, rest: &[f64]) -> Self {
        let mut points: Vec<QuadraturePoint<D, N>> = vec![];
        for cell in &cells {
            points.extend(quadrature_points(&points_of::<D, N>(rest, cell)));
        }
        let bad = points.iter().position(|point| point.weight <= 0.0);
        assert!(bad.is_none(), "point {bad:?} of {body} has no volume");
        BatchElastic {
            body: body.into(),
            material,
            gradient: vec![0.0; rest.len()],
            f: vec![0.0; points.len() * D * D],
            p: vec![0.0; points.len() * D * D],
            psi: vec![0.0; points.len()],
            cells,
            points,
        }
    }

    /// Returns the points of each of these elements, with the vertices of the element.
    fn points(&self, elements: Range<usize>) -> impl Iterator<Item = (&[u32; N], &QuadraturePoint<D, N>)> {
        let count = quadrature_count::<D, N>();
        let points = self.points[elements.start * count..elements.end * count].iter();
        points.enumerate().map(move |(i, point)| (&self.cells[elements.start + i / count], point))
    }

    /// Writes the deformation gradients of the points of these elements, `(points, D, D)`, or their
    /// change if `x` is a direction.
    fn deform(&self, elements: Range<usize>, x: &[f64], f: &mut [f64]) {
        for ((cell, point), f) in self.points(elements).zip(f.chunks_exact_mut(D * D)) {
            let at = point.deformation_gradient(&points_of::<D, N>(x, cell));
            f.copy_from_slice(at.0.as_flattened());
        }
    }

    /// Adds `w P b_a` of every point to the rows of its vertices.
    fn scatter(&self, p: &[f64], g: &mut [f64]) {
        for ((cell, point), p) in self.points(0..self.cells.len()).zip(p.chunks_exact(D * D)) {
            for (vertex, shape) in cell.iter().zip(&point.gradients) {
                for i in 0..D {
                    let force: f64 = (0..D).map(|j| p[i * D + j] * shape[j]).sum();
                    g[*vertex as usize * D + i] += point.weight * force;
                }
            }
        }
    }

    /// Returns deformation, stress and energy density at a deformation gradient. The out-of-plane stress
    /// in 2D is unknown: NaN.
    fn state(&self, f: &[f64]) -> ElementState {
        let (mut p, mut psi) = (vec![f64::NAN; D * D], [f64::NAN]);
        if !self.material.stress(f, &mut p) {
            p.fill(f64::NAN);
        }
        if !self.material.density(f, &mut psi) {
            psi = [f64::NAN];
        }
        let full = |part: &[f64], out: f64| {
            let mut matrix = Mat::diagonal(&[out; 3]);
            for (row, part) in matrix.0.iter_mut().zip(part.chunks_exact(D)) {
                row[..D].copy_from_slice(part);
            }
            matrix
        };
        let [energy_density] = psi;
        ElementState {
            deformation_gradient: full(f, 1.0),
            first_piola: full(&p, f64::NAN),
            energy_density,
            plane: D == 2,
        }
    }

    /// Returns `F` of an element at a point.
    fn deformation_at(&self, x: &[f64], element: usize, at: &Barycentric) -> Vec<f64> {
        let count = quadrature_count::<D, N>();
        let mut f = vec![0.0; count * D * D];
        self.deform(element..element + 1, x, &mut f);
        if count == 1 {
            return f;
        }
        // dx/dxi and J are linear in the position, and F is their quotient: exact where J is constant.
        let weights = interpolation::<D, N>(at);
        let mut sum = vec![0.0; D * D];
        for (f, weight) in f.chunks_exact(D * D).zip(weights) {
            sum.iter_mut().zip(f).for_each(|(sum, f)| *sum += weight * f);
        }
        sum
    }
}

fn determinant<const D: usize>(f: &[f64]) -> f64 {
    let mut matrix = Mat::<f64, D>::zero();
    matrix.0.as_flattened_mut().copy_from_slice(f);
    matrix.determinant()
}

impl<const D: usize, const N: usize> EnergyTerm for BatchElastic<D, N> {
    fn name(&self) -> String {
        format!("elements of `{}`", self.body)
    }

    fn properties(&self) -> TermProperties {
        TermProperties::of(EnergyKind::Elastic)
    }

    /// Returns NaN if the material could not be evaluated.
    fn energy(&mut self, x: &[f64]) -> f64 {
        let (mut f, mut psi) = (std::mem::take(&mut self.f), std::mem::take(&mut self.psi));
        self.deform(0..self.cells.len(), x, &mut f);
        let done = self.material.density(&f, &mut psi);
        let energy = self.points.iter().zip(&psi).map(|(point, psi)| point.weight * psi).sum();
        (self.f, self.psi) = (f, psi);
        if done { energy } else { f64::NAN }
    }

    fn evaluate(&mut self, x: &[f64]) -> bool {
        let (mut f, mut p) = (std::mem::take(&mut self.f), std::mem::take(&mut self.p));
        self.deform(0..self.cells.len(), x, &mut f);
        let done = self.material.stress(&f, &mut p);
        let mut gradient = std::mem::take(&mut self.gradient);
        gradient.fill(if done { 0.0 } else { f64::NAN });
        if done {
            self.scatter(&p, &mut gradient);
        }
        (self.f, self.p, self.gradient) = (f, p, gradient);
        all_finite(&self.gradient)
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        let rows = &self.gradient[first * D..];
        g.iter_mut().zip(rows).for_each(|(g, row)| *g += row);
    }

    fn add_hessian_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) {
        let mut change = vec![0.0; self.f.len()];
        let mut f = std::mem::take(&mut self.f);
        self.deform(0..self.cells.len(), x, &mut f);
        self.deform(0..self.cells.len(), p, &mut change);
        tangent::along::<D>(self.material.as_ref(), &f, &mut change);
        self.scatter(&change, y);
        self.f = f;
    }

    fn stencils(&mut self) -> Stencils {
        Stencils { size: N, vertices: self.cells.as_flattened().to_vec() }
    }

    fn stencil_hessians(&self, stencils: Range<usize>, x: &[f64], psd: Psd, out: &mut [f64]) {
        let (count, block) = (quadrature_count::<D, N>(), D * D);
        let mut f = vec![0.0; stencils.len() * count * block];
        self.deform(stencils.clone(), x, &mut f);
        let tangents = tangent::tangents::<D>(self.material.as_ref(), &f, psd);
        out.fill(0.0);
        let points = self.points[stencils.start * count..stencils.end * count].iter();
        let pairs = N * (N + 1) / 2;
        for (i, (point, tangent)) in points.zip(tangents.chunks_exact(block * block)).enumerate() {
            let mut blocks = out[i / count * pairs * block..].chunks_exact_mut(block);
            for a in 0..N {
                for b in a..N {
                    let Some(out) = blocks.next() else { return };
                    let (a, b) = (&point.gradients[a], &point.gradients[b]);
                    // K_ik = w dP_ij/dF_kl b_aj b_bl
                    for (ik, out) in out.iter_mut().enumerate() {
                        let (i, k) = (ik / D, ik % D);
                        let entry = |jl: usize| {
                            let (j, l) = (jl / D, jl % D);
                            tangent[(i * D + j) * block + k * D + l] * a[j] * b[l]
                        };
                        *out += point.weight * (0..block).map(entry).sum::<f64>();
                    }
                }
            }
        }
    }

    fn fault(&self, x: &[f64]) -> Option<Fault> {
        let mut f = vec![0.0; self.f.len()];
        self.deform(0..self.cells.len(), x, &mut f);
        let (mut p, mut psi) = (vec![0.0; f.len()], vec![0.0; self.psi.len()]);
        if !(self.material.stress(&f, &mut p) && self.material.density(&f, &mut psi)) {
            return None;
        }
        let points = f.chunks_exact(D * D).zip(p.chunks_exact(D * D)).zip(&psi);
        let bad = |p: &[f64], psi: f64| match (all_finite(p), psi.is_finite()) {
            (true, true) => None,
            (false, _) => Some(MaterialOutput::Stress),
            (true, false) => Some(MaterialOutput::Density),
        };
        let mut found = points.enumerate().filter_map(|(i, ((f, p), psi))| Some((i, f, bad(p, *psi)?)));
        let (i, f, what) = found.next()?;
        let (element, j) = (i / quadrature_count::<D, N>(), determinant::<D>(f));
        let body = self.body.clone();
        // Most materials have no stress in an inverted element: the step is too large.
        Some(if j > 0.0 {
            Fault::Material { what, body, element, j }
        } else {
            Fault::Element { body, element, j, material_would_help: true }
        })
    }
}

impl<const D: usize, const N: usize> TermViews for BatchElastic<D, N> {
    fn elements(&self) -> Option<&dyn ElementTerm> {
        Some(self)
    }

    fn measurements(&mut self) -> Option<&mut dyn Measurements> {
        Some(self)
    }
}

impl<const D: usize, const N: usize> ElementTerm for BatchElastic<D, N> {
    fn body(&self) -> &str {
        &self.body
    }

    fn each_state(&self, x: &[f64], visit: &mut dyn FnMut(usize, ElementState)) {
        let centre = centroid::<D, N>();
        for element in 0..self.cells.len() {
            visit(element, self.state(&self.deformation_at(x, element, &centre)));
        }
    }

    fn element_count(&self) -> usize {
        self.cells.len()
    }

    fn state_at(&self, x: &[f64], element: usize, at: &Barycentric) -> Option<ElementState> {
        (element < self.cells.len()).then(|| self.state(&self.deformation_at(x, element, at)))
    }

    fn nodes(&self) -> usize {
        N
    }

    fn each_at(&self, x: &[f64], points: &[Barycentric], visit: &mut ElementVisitor<'_>) {
        for (number, vertices) in self.cells.iter().enumerate() {
            let states: Vec<ElementState> =
                points.iter().map(|at| self.state(&self.deformation_at(x, number, at))).collect();
            let tangent = || {
                let f = self.deformation_at(x, number, &centroid::<D, N>());
                let flat = tangent::tangents::<D>(self.material.as_ref(), &f, Psd::Exact);
                let mut tangent = Tangent::<D>::zero();
                tangent
                    .0
                    .as_flattened_mut()
                    .iter_mut()
                    .zip(flat.chunks_exact(D * D))
                    .for_each(|(rows, flat)| rows.0.as_flattened_mut().copy_from_slice(flat));
                Some(tangent_in_space(None, &tangent))
            };
            visit(EvaluatedElement { number, vertices, states: &states, tangent: &tangent });
        }
    }
}

impl<const D: usize, const N: usize> Measurements for BatchElastic<D, N> {
    fn deformation(&mut self, x: &[f64]) -> Option<DeformationExtremes> {
        let mut f = std::mem::take(&mut self.f);
        self.deform(0..self.cells.len(), x, &mut f);
        let points = quadrature_count::<D, N>();
        let extremes = f.chunks_exact(points * D * D).map(|element| {
            let j = element.chunks_exact(D * D).map(determinant::<D>).fold(f64::INFINITY, f64::min);
            DeformationExtremes { min_j: j, inverted: u64::from(j <= 0.0) }
        });
        let found = extremes.reduce(DeformationExtremes::merge);
        self.f = f;
        found
    }
}
