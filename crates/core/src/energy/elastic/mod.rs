//! Hyperelastic elements: the energy `sum_e sum_q w_q Psi(F_q)` over the quadrature points of each, one for
//! linear ones.

mod axes;
mod block;
mod cells;
mod collapse;
mod factors;
mod hessian;
mod kernels;
mod membrane;
mod nodal;
mod predicted;
mod simplex;
mod solid;

use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

pub(crate) use cells::{
    Amplitudes, CellPacks, HourglassSolid, MOST_MODES, RestData, amplitude_rates, by_each, dot, modes,
    outer_sum, times,
};
pub use cells::{CellShapes, CellTurns, OnePointCells, PullBack, ShapedCells, TurningCells, bending_excess};
pub use membrane::flattened;
pub use membrane::{Membrane, Sheet};
pub use nodal::nodal_integration;

use block::{Block, BlockMaterial};
use kernels::{BLOCKS, DeformationKernel, EnergyKernel, ExtremesKernel, ForceKernel, packs_at_once};
pub(crate) use kernels::{gather, scatter};
use simplex::{Fused, SimplexForces};
pub(crate) use solid::SolidElements;
use solid::extremes;

use super::patch::{Patch, Patches, Scratch, Workspace};
use super::{
    DeformationExtremes, ElementTerm, EnergyKind, EnergyTerm, Fault, ForceLayout, Measurements,
    PredictedStresses, ShapeProducts, Stencils, StepLimit, TermProperties,
};
use crate::algebra::Mat;
use crate::element::ElementState;
use crate::element::{
    Barycentric, MassRule, QuadraticPositions, SimplexPack, centroid, edge_matrix, interpolation, is_simplex,
    jacobian, order, point_content, quadrature_count, quadrature_position,
};
use crate::lanes::{Lanes, Portable, RowSlice, WIDTH, dispatch, dispatch_compact, filled};
use crate::material::Stress;
use crate::material::{Domain, Material, Psd};
use crate::numbering::along_curve;

/// Elements of `N` vertices filled with one material: simplices, `N = 3` and `4` linear, `6` and `10`
/// quadratic, and cells of second order, 8 and 9 in 2D, 20 and 27 in 3D.
pub struct Elastic<const D: usize, const N: usize> {
    body: String,
    material: Box<dyn BlockMaterial<D>>,
    stress: Stress,
    /// The shorter way to the forces of linear elements whose stress has a closed form.
    fused: Option<Box<dyn SimplexForces<D, N>>>,
    patches: Patches<N>,
    /// Rest data of every pack, one after the other those of its quadrature points.
    rest: Vec<SimplexPack<D>>,
    workspace: Workspace<D>,
    /// Where these elements are the smaller part of a body with nodal integration: what has its stress.
    nodes: Option<Arc<nodal::Nodes<D>>>,
    /// Factor of the energy density of each element, in the order of the mesh; empty where all are 1. It is
    /// in the weights of `rest` already.
    factors: Vec<f64>,
    /// Rotation from the axes of the material to those of space of each element, likewise; empty where they
    /// are the same. It is in the inverses of `rest` already.
    axes: Vec<Mat<f64, 3>>,
    /// True if pressures are worth a prediction.
    nearly_incompressible: bool,
}

impl<const D: usize, const N: usize> Elastic<D, N> {
    /// Linear elements `elements` (global vertex indices) of `body`, at rest at `rest` (flat, all vertices
    /// of the system) [m], their stress computed as `stress` says.
    ///
    /// # Panics
    /// If `N` is not `D + 1`, or an element has no positive area or volume: meshes are checked before.
    pub fn linear<M: Material<D> + Material<3> + Clone>(
        body: &str,
        material: M,
        stress: Stress,
        elements: &[[u32; N]],
        rest: &[f64],
    ) -> Self {
        assert_eq!(order::<D, N>(), 1, "a linear simplex has one vertex more than dimensions");
        let fused: Option<Box<dyn SimplexForces<D, N>>> = match stress {
            Stress::Analytic => Some(Box::new(Fused(material.clone()))),
            Stress::Autodiff => None,
        };
        Self { fused, ..Self::on_blocks(body, Box::new(material), stress, elements, rest) }
    }

    /// Quadratic elements, likewise: corners first, then the vertices in the middle of the edges.
    ///
    /// # Panics
    /// If `N` is not 6, 8 or 9 in 2D or 10, 20 or 27 in 3D, or `det J` is not positive at all quadrature
    /// points: meshes are checked before.
    pub fn quadratic<M: Material<D> + Material<3>>(
        body: &str,
        material: M,
        stress: Stress,
        elements: &[[u32; N]],
        rest: &[f64],
    ) -> Self {
        assert_eq!(
            order::<D, N>(),
            2,
            "a quadratic element has 6, 8 or 9 vertices in 2D, 10, 20 or 27 in 3D"
        );
        Self::on_blocks(body, Box::new(material), stress, elements, rest)
    }

    fn on_blocks(
        body: &str,
        material: Box<dyn BlockMaterial<D>>,
        stress: Stress,
        elements: &[[u32; N]],
        rest: &[f64],
    ) -> Self {
        let patches =
            Patches::new::<D>(elements, &along_curve::<D>(&centroids(elements, rest)), rest.len() / D);
        let packs = rest_packs::<D, N>(body, &patches, rest);
        let workspace = Workspace::new(&patches);
        Elastic {
            body: body.into(),
            nearly_incompressible: predicted::is_nearly_incompressible(&*material),
            material,
            stress,
            fused: None,
            workspace,
            patches,
            rest: packs,
            nodes: None,
            factors: vec![],
            axes: vec![],
        }
    }

    /// The elements with their global vertices, in the order of the patches: `(element, vertices, pack,
    /// lane)`.
    fn elements(&self) -> impl Iterator<Item = (usize, [u32; N], usize, usize)> {
        self.patches.stencils()
    }

    /// `dx/dxi` and `J^-1` at the quadrature points of one element.
    fn points(&self, x: &[f64], vertices: &[u32; N], pack: usize, lane: usize) -> Vec<[Mat<f64, D>; 2]> {
        let x = points_of::<D, N>(x, vertices);
        let count = quadrature_count::<D, N>();
        let inverse = |q: usize| self.rest[pack * count + q].lane(lane).0;
        if order::<D, N>() == 1 {
            return vec![[edge_matrix(&x), inverse(0)]];
        }
        let positions = QuadraticPositions::new(x);
        (0..count).map(|q| [positions.at(q), inverse(q)]).collect()
    }

    /// Deformation and stress of an element with this deformation gradient.
    fn state(&self, f: &Mat<f64, D>, element: usize, vertices: &[u32; N], x: &[f64]) -> ElementState {
        match &self.nodes {
            None => self.in_space(element, self.with_its_factor(element, self.material.state(f))),
            Some(nodes) => nodes.state(f, vertices, x),
        }
    }
}

/// The rest data of every pack, one after the other those of its quadrature points.
///
/// # Panics
/// If `det J` is not positive at one of them.
pub(crate) fn rest_packs<const D: usize, const N: usize>(
    body: &str,
    patches: &Patches<N>,
    rest: &[f64],
) -> Vec<SimplexPack<D>> {
    let points = quadrature_count::<D, N>();
    let mut packs = filled(SimplexPack::new(), patches.index.len() * points);
    for (element, vertices, pack, lane) in patches.stencils() {
        let nodes = points_of(rest, &vertices);
        for q in 0..points {
            let j = jacobian(&nodes, &quadrature_position::<D, N>(q));
            let weight = point_content::<D, N>(q, j.determinant());
            assert!(weight > 0.0, "element {element} of {body} has volume {weight} at point {q}");
            packs[pack * points + q].set(lane, &j.inverse(), weight);
        }
    }
    for (packs, stencils) in packs.chunks_exact_mut(points).zip(&patches.stencil) {
        packs.iter_mut().for_each(|pack| pack.fill_up(stencils.iter().flatten().count()));
    }
    packs
}

/// The work of one patch in pieces of a few packs.
struct Pieces<'a, const D: usize, const N: usize> {
    patches: &'a Patches<N>,
    rest: &'a [SimplexPack<D>],
    patch: &'a Patch,
}

impl<'a, const D: usize, const N: usize> Pieces<'a, D, N> {
    /// Rest data and vertices of each piece.
    fn iter(&self) -> impl Iterator<Item = (&'a [SimplexPack<D>], &'a [[[u16; WIDTH]; N]])> {
        let (points, at_once) = (quadrature_count::<D, N>(), packs_at_once::<D, N>());
        let packs = self.patch.packs.clone();
        let rest = &self.rest[packs.start * points..packs.end * points];
        rest.chunks(at_once * points).zip(self.patches.index[packs].chunks(at_once))
    }
}

/// Deformation gradients of a piece: of positions, or of a direction, in which they are linear.
fn deform<'a, const D: usize, const N: usize>(
    (rest, index): (&[SimplexPack<D>], &[[[u16; WIDTH]; N]]),
    rows: &RowSlice<D>,
    f: &'a mut [Block<D>; BLOCKS],
) -> &'a mut [Block<D>] {
    let f = &mut f[..rest.len()];
    dispatch(DeformationKernel { rest, index, rows, f });
    f
}

/// Keeps the gradient of a patch in `scratch`, the stresses from the deformation gradients by `material`.
fn add_forces<const D: usize, const N: usize>(
    pieces: &Pieces<'_, D, N>,
    scratch: &mut Scratch<D>,
    material: impl Fn(&mut [Block<D>]),
) {
    let mut blocks = [Block::ZERO; BLOCKS];
    for piece @ (rest, index) in pieces.iter() {
        let f = deform(piece, &scratch.position, &mut blocks);
        material(f);
        dispatch(ForceKernel { rest, index, stress: f, gradient: &mut scratch.gradient });
    }
}

/// Sums of the vertices of each element: their centroids, but for a factor.
pub(crate) fn centroids<const D: usize, const N: usize>(
    elements: &[[u32; N]],
    rest: &[f64],
) -> Vec<[f64; D]> {
    let sum = |element: &[u32; N]| {
        points_of::<D, N>(rest, element).iter().fold([0.0; D], |mut sum, point| {
            for c in 0..D {
                sum[c] += point[c];
            }
            sum
        })
    };
    elements.iter().map(sum).collect()
}

/// The rows of `vertices` in a flat array.
pub fn points_of<const D: usize, const N: usize>(x: &[f64], vertices: &[u32; N]) -> [[f64; D]; N] {
    let mut points = [[0.0; D]; N];
    for (point, &v) in points.iter_mut().zip(vertices) {
        point.copy_from_slice(&x[v as usize * D..v as usize * D + D]);
    }
    points
}

impl<const D: usize, const N: usize> EnergyTerm for Elastic<D, N> {
    fn name(&self) -> String {
        format!("elements of `{}`", self.body)
    }

    fn properties(&self) -> TermProperties {
        TermProperties { fills_space: D == 3, ..TermProperties::of(EnergyKind::Elastic) }
    }

    fn energy(&mut self, x: &[f64]) -> f64 {
        let Elastic { patches, rest, material, workspace, .. } = self;
        patches.sum(workspace, x, |patch, scratch| {
            let (mut blocks, mut psi) = ([Block::ZERO; BLOCKS], [[0.0; WIDTH]; BLOCKS]);
            let mut sum = [0.0; WIDTH];
            for piece @ (rest, _) in (Pieces { patches, rest, patch }).iter() {
                let psi = &mut psi[..rest.len()];
                material.density(deform(piece, &scratch.position, &mut blocks), psi);
                dispatch_compact(EnergyKernel { rest, psi, sum: &mut sum });
            }
            Portable::load(&sum).horizontal_sum()
        })
    }

    fn evaluate(&mut self, x: &[f64]) -> bool {
        let Elastic { patches, rest, material, fused, workspace, stress, .. } = self;
        match fused {
            Some(fused) => patches.evaluate(workspace, x, None, |patch, scratch| {
                fused.add(patches, rest, patch, scratch);
            }),
            None => patches.evaluate(workspace, x, None, |patch, scratch| {
                add_forces(&Pieces { patches, rest, patch }, scratch, |f| material.stress(*stress, f));
            }),
        }
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        self.patches.add_rows(&self.workspace, first, g);
    }

    fn add_hessian_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) {
        let Elastic { patches, rest, material, workspace, .. } = self;
        patches.evaluate(workspace, x, Some(p), |patch, scratch| {
            let (mut f, mut df) = ([Block::ZERO; BLOCKS], [Block::ZERO; BLOCKS]);
            for piece @ (rest, index) in (Pieces { patches, rest, patch }).iter() {
                let f = deform(piece, &scratch.position, &mut f);
                let df = deform(piece, &scratch.direction, &mut df);
                material.derivative(f, df, None);
                dispatch(ForceKernel { rest, index, stress: df, gradient: &mut scratch.gradient });
            }
        });
        patches.add_rows(workspace, 0, y);
    }

    /// `p . dE/dx = sum_q w_q P : dF`, of the stresses that the product is made of.
    fn add_transposed_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) -> Option<f64> {
        let Elastic { patches, rest, material, workspace, .. } = self;
        let is_known = AtomicBool::new(true);
        let along = patches.evaluate_with_sum(workspace, x, p, |patch, scratch| {
            let (mut f, mut df) = ([Block::ZERO; BLOCKS], [Block::ZERO; BLOCKS]);
            let (mut work, mut sum) = ([[0.0; WIDTH]; BLOCKS], [0.0; WIDTH]);
            for piece @ (rest, index) in (Pieces { patches, rest, patch }).iter() {
                let f = deform(piece, &scratch.position, &mut f);
                let df = deform(piece, &scratch.direction, &mut df);
                let work = &mut work[..f.len()];
                if !material.derivative(f, df, Some(work)) {
                    is_known.store(false, Ordering::Relaxed);
                }
                dispatch_compact(EnergyKernel { rest, psi: work, sum: &mut sum });
                dispatch(ForceKernel { rest, index, stress: df, gradient: &mut scratch.gradient });
            }
            Portable::load(&sum).horizontal_sum()
        });
        patches.add_rows(workspace, 0, y);
        is_known.into_inner().then_some(along)
    }

    fn stencils(&mut self) -> Stencils {
        self.patches.lanes()
    }

    fn stencil_hessians(&self, stencils: Range<usize>, x: &[f64], psd: Psd, out: &mut [f64]) {
        hessian::fill(self, stencils, x, (psd, None), out);
    }

    /// Of elements with several quadrature points, `J` at the first that is at fault.
    fn fault(&self, x: &[f64]) -> Option<Fault> {
        self.elements().find_map(|(element, vertices, pack, lane)| {
            let f = self.points(x, &vertices, pack, lane).into_iter().map(|[dx, inverse]| dx.mul(&inverse));
            let fault = f.filter(|f| self.material.is_at_fault(f)).map(|f| f.determinant()).next();
            let material_would_help = self.material.domain() == Domain::PositiveJ;
            fault.map(|j| Fault::Element { body: self.body.clone(), element, j, material_would_help })
        })
    }

    fn bytes(&self) -> usize {
        self.patches.bytes() + size_of_val(&self.rest[..]) + self.bytes_by_element() + self.workspace.bytes()
    }
}

impl<const D: usize, const N: usize> PredictedStresses for Elastic<D, N> {
    fn predicted_hessians(&self, stencils: Range<usize>, from: &[f64], x: &[f64], out: &mut [f64]) {
        let from = Some(from).filter(|_| self.nearly_incompressible);
        hessian::fill(self, stencils, x, (Psd::Exact, from), out);
    }
}

impl<const D: usize, const N: usize> SolidElements for Elastic<D, N> {
    fn is_finite_everywhere(&self) -> bool {
        self.material.domain() == Domain::Everywhere
    }
}

impl<const D: usize, const N: usize> ElementTerm for Elastic<D, N> {
    fn body(&self) -> &str {
        &self.body
    }

    fn is_whole(&self) -> bool {
        self.nodes.is_none()
    }

    /// Quadratic elements at their centroid, where strains are most accurate.
    fn each_state(&self, x: &[f64], visit: &mut dyn FnMut(usize, ElementState)) {
        for (element, vertices, pack, lane) in self.elements() {
            let f = centroid_deformation::<D, N>(&self.points(x, &vertices, pack, lane));
            visit(element, self.state(&f, element, &vertices, x));
        }
    }

    fn shape_products(&self) -> Option<ShapeProducts> {
        if order::<D, N>() == 1 {
            return None;
        }
        let (mass, count) = (MassRule::<D, N>::new(), quadrature_count::<D, N>());
        let mut all = ShapeProducts { nodes: N, ..ShapeProducts::default() };
        for (_, vertices, pack, lane) in self.elements() {
            let at_points: Vec<Mat<f64, D>> =
                (0..count).map(|q| self.rest[pack * count + q].lane(lane).0.inverse()).collect();
            let jacobian = |at: &Barycentric| {
                let weights = interpolation::<D, N>(at);
                at_points.iter().zip(weights).fold(Mat::zero(), |sum, (j, weight)| j.scale_add(weight, &sum))
            };
            all.vertices.extend(vertices);
            all.products.extend(mass.by_jacobian(jacobian).as_flattened());
        }
        Some(all)
    }

    fn element_count(&self) -> usize {
        self.elements().count()
    }

    fn state_at(&self, x: &[f64], element: usize, at: &Barycentric) -> Option<ElementState> {
        let (_, vertices, pack, lane) = self.elements().find(|(number, ..)| *number == element)?;
        let points = self.points(x, &vertices, pack, lane);
        if order::<D, N>() == 1 {
            return Some(self.state(&centroid_deformation::<D, N>(&points), element, &vertices, x));
        }
        Some(self.state(&deformation_at::<D, N>(&points, at), element, &vertices, x))
    }
}

impl<const D: usize, const N: usize> Measurements for Elastic<D, N> {
    fn deformation(&mut self, x: &[f64]) -> Option<DeformationExtremes> {
        let Elastic { patches, rest, workspace, .. } = self;
        extremes(patches, workspace, x, |patch, scratch| {
            dispatch_compact(ExtremesKernel { patches, rest, patch, scratch })
        })
    }
}

impl<const D: usize, const N: usize> ForceLayout for Elastic<D, N> {
    fn rows(&self, first: usize, count: usize) -> Option<&[f64]> {
        self.patches.rows(&self.workspace, first, count)
    }
}

impl<const D: usize, const N: usize> StepLimit for Elastic<D, N> {
    fn max_step(&self, x: &[f64], dx: &[f64]) -> f64 {
        collapse::step_to_collapse(self, x, dx)
    }
}

/// `F` at the centroid of an element; in simplices both `dx/dxi` and `J` are linear, their means over the
/// points are their values.
fn centroid_deformation<const D: usize, const N: usize>(points: &[[Mat<f64, D>; 2]]) -> Mat<f64, D> {
    if let [[dx, inverse]] = points {
        return dx.mul(inverse);
    }
    if !is_simplex::<D, N>() {
        return deformation_at::<D, N>(points, &centroid::<D, N>());
    }
    let (mut dx, mut j) = (Mat::zero(), Mat::zero());
    for [at_point, inverse] in points {
        dx += *at_point;
        j += inverse.inverse();
    }
    dx.mul(&j.inverse())
}

/// `F` at a place of an element with several points: the quotient of `dx/dxi` and `J`, which are
/// [interpolated](interpolation) between them.
fn deformation_at<const D: usize, const N: usize>(
    points: &[[Mat<f64, D>; 2]],
    at: &Barycentric,
) -> Mat<f64, D> {
    let (mut dx, mut j) = (Mat::zero(), Mat::zero());
    let weights = interpolation::<D, N>(at);
    for ([at_point, inverse], weight) in points.iter().zip(weights) {
        dx += at_point.scale(weight);
        j += inverse.inverse().scale(weight);
    }
    dx.mul(&j.inverse())
}

#[cfg(test)]
mod tests;
