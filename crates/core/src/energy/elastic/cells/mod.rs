//! Quadrilaterals and hexahedra with one evaluation of the material and an hourglass energy.
//!
//! ```text
//! E = sum_e V psi(F) + 1/2 z . K z,   z_h = cof(F)^T q_h
//! ```
//!
//! with the mean deformation gradient `F` of [`rest`], the amplitudes `q` of the hourglass modes and
//! their stiffness `K` of [`hourglass`], from the material's tangent in the reference configuration. This
//! is Q1/E12 with the Jacobian at the centre and condensed enhanced strains: a function of the nodes,
//! without unknowns of its own. It passes the patch test, bends like a beam at any aspect ratio and does
//! not lock if it is nearly incompressible. Source: Reese, Wriggers 2000, "A stabilization technique to
//! avoid hourglassing in finite elasticity", Int. J. Numer. Meth. Eng. 48, 79; further sources in
//! [`hourglass`].
//!
//! The element is published for small strains; how amplitudes follow a large strain is a choice.
//! `cof(F)^T q` is a polynomial, exists for inverted cells and keeps the bending stiffness of a stretched
//! strip within a quarter from 0.7 to 1.5 times its length; beyond twice its length a strip is too soft.
//! The corotational `R^T q` of Belytschko and Bindeman is up to 2.2 times too stiff there and half as
//! stiff as the strip in compression. A material that is linear in `F` has `z = q`. The material sees one
//! `F`: a cell may fold at a corner while `det F` stays positive.

mod collapse;
mod distortion;
mod evaluated;
mod hessian;
mod hourglass;
mod kernels;
mod packs;
mod rest;
mod shape;
#[cfg(test)]
pub(super) mod tests;

pub use distortion::bending_excess;
pub use hourglass::PullBack;
pub(crate) use hourglass::{amplitude_rates, by_each, dot, times};
pub(crate) use packs::{CellPacks, HourglassSolid};
pub(crate) use rest::{Amplitudes, MOST_MODES, RestData, modes, outer_sum};
pub use shape::{CellShapes, CellTurns, ShapedCells, TurningCells};
use std::ops::Range;

use super::axes::in_space;
use super::block::{Block, BlockMaterial};
use super::predicted::is_nearly_incompressible;
use super::solid::{SolidElements, extremes};
use super::{centroids, points_of};
use crate::algebra::Mat;
use crate::element::{Barycentric, ElementState, Isoparametric};
use crate::energy::patch::{Patch, Patches, Scratch, Workspace};
use crate::energy::{
    DeformationExtremes, ElementTerm, ElementVisitor, EnergyKind, EnergyTerm, Fault, ForceLayout,
    Measurements, PredictedStresses, Stencils, StepLimit, TermProperties,
};
use crate::lanes::{Lanes, Portable, WIDTH, dispatch, dispatch_compact};
use crate::material::{Domain, Material, Psd, Stress, Tangent};
use crate::numbering::along_curve;
use hourglass::RestModuli;
use kernels::{CellDeformationKernel, CellEnergyKernel, CellExtremesKernel, CellForceKernel, CellPiece};
use rest::CellRest;

/// Packs that a kernel processes together: few enough to stay in the L1 cache, enough to make the call of
/// the material free.
const AT_ONCE: usize = 4;

/// Cells of `N` nodes of one material.
pub struct OnePointCells<const D: usize, const N: usize> {
    body: String,
    material: Box<dyn BlockMaterial<D>>,
    stress: Stress,
    pull_back: PullBack,
    cell: &'static Isoparametric<D, N>,
    patches: Patches<N>,
    packs: CellPacks<D, N>,
    /// Rotation of the material of every cell; empty without rotations.
    axes: Vec<Mat<f64, 3>>,
    /// Reference positions of the nodes of every cell, in the order of the mesh [m].
    nodes: Vec<[[f64; D]; N]>,
    /// True if it pays to predict pressures.
    nearly_incompressible: bool,
    workspace: Workspace<D>,
}

impl<const D: usize, const N: usize> OnePointCells<D, N> {
    /// Creates the cells `cells` (global vertex indices) of `body` with the reference positions `rest`
    /// (flat, all vertices of the system) [m]; `stress` says how stresses are computed.
    ///
    /// # Panics
    /// If the volume of a cell is not positive; meshes are checked before.
    pub fn new<M: Material<D> + Material<3>>(
        body: &str,
        material: M,
        (stress, pull_back): (Stress, PullBack),
        cell: &'static Isoparametric<D, N>,
        cells: &[[u32; N]],
        rest: &[f64],
    ) -> Self {
        let order = along_curve::<D>(&centroids(cells, rest));
        let patches = Patches::new::<D>(cells, &order, rest.len() / D);
        let material: Box<dyn BlockMaterial<D>> = Box::new(material);
        let tangent = &rest_tangent(&*material);
        let solid = HourglassSolid { tangent, change: None, axes: &[] };
        OnePointCells {
            body: body.into(),
            nearly_incompressible: pull_back == PullBack::Cofactor && is_nearly_incompressible(&*material),
            material,
            stress,
            pull_back,
            cell,
            packs: CellPacks::new(body, cell, &patches, rest, solid),
            axes: vec![],
            nodes: cells.iter().map(|cell| points_of(rest, cell)).collect(),
            workspace: Workspace::new(&patches),
            patches,
        }
    }

    /// Rotates the material of each cell by the rotation `R` from its axes to those of space, in the
    /// order of the mesh: energy densities become `psi(F R)`, stresses `P(F R) R^T`. `rest` are the
    /// reference positions [m]. See [`material_axes`](crate::material::material_axes). In 2D rotations
    /// are about the normal of the plane.
    ///
    /// # Panics
    /// If the numbers of rotations and cells differ.
    #[must_use]
    pub fn with_axes(mut self, axes: &[Mat<f64, 3>], rest: &[f64]) -> Self {
        assert_eq!(self.nodes.len(), axes.len(), "one rotation for each cell");
        self.axes = axes.to_vec();
        let tangent = &rest_tangent(&*self.material);
        let solid = HourglassSolid { tangent, change: None, axes };
        self.packs = CellPacks::new(&self.body, self.cell, &self.patches, rest, solid);
        self
    }

    /// Returns the derivative of the energy of cells with respect to a parameter: of a solid with this
    /// initial `tangent` [Pa], whose energy changes by that of the material of `self`. The stiffness of
    /// hourglass modes is a nonlinear function of the material; all else is linear.
    #[must_use]
    pub fn as_change_of(mut self, tangent: &Tangent<D>, rest: &[f64]) -> Self {
        let change = Some(&self.material.tangent(&Mat::identity(), Psd::Exact));
        let solid = HourglassSolid { tangent, change, axes: &self.axes };
        self.packs = CellPacks::new(&self.body, self.cell, &self.patches, rest, solid);
        self
    }

    /// Returns the cells with their global vertices: `(element, vertices, pack, lane)`.
    fn elements(&self) -> impl Iterator<Item = (usize, [u32; N], usize, usize)> {
        self.patches.stencils()
    }

    /// Returns the reference data of a cell in material axes.
    fn rest(&self, element: usize) -> CellRest<f64, D, N> {
        let rest = CellRest::new(self.cell, &self.nodes[element]);
        self.axes.get(element).map_or(rest, |axes| rest.turned(&axes.leading()))
    }

    /// Returns `F` of the cell with these vertices.
    fn deformation_of(&self, x: &[f64], vertices: &[u32; N], (pack, lane): (usize, usize)) -> Mat<f64, D> {
        let (_, gradient) = self.packs.gradients_of_lane(pack, lane);
        outer_sum(&from_first(x, vertices), &gradient)
    }
}

/// Returns the rows of vertices relative to the first one.
fn from_first<const D: usize, const N: usize>(rows: &[f64], vertices: &[u32; N]) -> [[f64; D]; N] {
    let rows: [[f64; D]; N] = points_of(rows, vertices);
    rows.map(|mut row| {
        row.iter_mut().zip(rows[0]).for_each(|(row, first)| *row -= first);
        row
    })
}

/// Returns the initial tangent of a material, projected to a positive one.
fn rest_tangent<const D: usize>(material: &dyn BlockMaterial<D>) -> Tangent<D> {
    material.tangent(&Mat::identity(), Psd::Projected)
}

/// Iterates over a patch in pieces of a few packs.
struct CellPatch<'a, const D: usize, const N: usize> {
    packs: &'a CellPacks<D, N>,
    patches: &'a Patches<N>,
    pull_back: PullBack,
}

impl<'a, const D: usize, const N: usize> CellPatch<'a, D, N> {
    fn pieces(&self, patch: &Patch) -> impl Iterator<Item = CellPiece<'a, D, N>> {
        let CellPatch { packs, patches, pull_back } = *self;
        let Range { start, end } = patch.packs;
        (start..end).step_by(AT_ONCE).map(move |first| CellPiece {
            packs,
            index: &patches.index,
            pull_back,
            range: first..end.min(first + AT_ONCE),
        })
    }
}

/// Splits a term into its cells, workspace and material.
macro_rules! parts {
    ($term:ident) => {{
        let OnePointCells { patches, packs, workspace, material, pull_back, .. } = $term;
        (CellPatch { packs, patches, pull_back: *pull_back }, workspace, &**material)
    }};
}

impl<const D: usize, const N: usize> EnergyTerm for OnePointCells<D, N> {
    fn name(&self) -> String {
        format!("elements of `{}`", self.body)
    }

    fn properties(&self) -> TermProperties {
        TermProperties { fills_space: D == 3, ..TermProperties::of(EnergyKind::Elastic) }
    }

    fn energy(&mut self, x: &[f64]) -> f64 {
        let (cells, workspace, material) = parts!(self);
        cells.patches.sum(workspace, x, |patch, scratch| {
            let (mut blocks, mut psi) = ([Block::ZERO; AT_ONCE], [[0.0; WIDTH]; AT_ONCE]);
            let mut sum = [0.0; WIDTH];
            let position = &*scratch.position;
            for piece in cells.pieces(patch) {
                let piece = &piece;
                let f = &mut blocks[..piece.range.len()];
                let psi = &mut psi[..piece.range.len()];
                dispatch(CellDeformationKernel { piece, rows: position, f });
                material.density(f, psi);
                dispatch_compact(CellEnergyKernel { piece, psi, position, sum: &mut sum });
            }
            Portable::load(&sum).horizontal_sum()
        })
    }

    fn evaluate(&mut self, x: &[f64]) -> bool {
        let how = self.stress;
        let (cells, workspace, material) = parts!(self);
        cells.patches.evaluate(workspace, x, None, |patch, scratch| {
            let mut blocks = [Block::ZERO; AT_ONCE];
            let Scratch { position, direction, gradient } = scratch;
            for piece in cells.pieces(patch) {
                let piece = &piece;
                let stress = &mut blocks[..piece.range.len()];
                dispatch(CellDeformationKernel { piece, rows: position, f: stress });
                material.stress(how, stress);
                dispatch(CellForceKernel::<D, N, false> { piece, stress, position, direction, gradient });
            }
        })
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        self.patches.add_rows(&self.workspace, first, g);
    }

    fn add_hessian_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) {
        let (cells, workspace, material) = parts!(self);
        cells.patches.evaluate(workspace, x, Some(p), |patch, scratch| {
            let (mut f, mut change) = ([Block::ZERO; AT_ONCE], [Block::ZERO; AT_ONCE]);
            let Scratch { position, direction, gradient } = scratch;
            for piece in cells.pieces(patch) {
                let piece = &piece;
                let (f, stress) = (&mut f[..piece.range.len()], &mut change[..piece.range.len()]);
                dispatch(CellDeformationKernel { piece, rows: position, f });
                dispatch(CellDeformationKernel { piece, rows: direction, f: stress });
                material.derivative(f, stress, None);
                dispatch_compact(CellForceKernel::<D, N, true> {
                    piece,
                    stress,
                    position,
                    direction,
                    gradient,
                });
            }
        });
        self.add_rows(0, y);
    }

    fn stencils(&mut self) -> Stencils {
        self.patches.lanes()
    }

    fn stencil_hessians(&self, stencils: Range<usize>, x: &[f64], psd: Psd, out: &mut [f64]) {
        hessian::fill(self, stencils, x, (psd, None), out);
    }

    fn fault(&self, x: &[f64]) -> Option<Fault> {
        self.elements().find_map(|(element, vertices, pack, lane)| {
            let f = self.deformation_of(x, &vertices, (pack, lane));
            let is_at_fault = self.material.is_at_fault(&f);
            is_at_fault.then(|| Fault::Element {
                body: self.body.clone(),
                element,
                j: f.determinant(),
                material_would_help: self.material.domain() == Domain::PositiveJ,
            })
        })
    }
}

impl<const D: usize, const N: usize> PredictedStresses for OnePointCells<D, N> {
    fn predicted_hessians(&self, stencils: Range<usize>, from: &[f64], x: &[f64], out: &mut [f64]) {
        let from = Some(from).filter(|_| self.nearly_incompressible);
        hessian::fill(self, stencils, x, (Psd::Exact, from), out);
    }
}

impl<const D: usize, const N: usize> SolidElements for OnePointCells<D, N> {
    fn is_finite_everywhere(&self) -> bool {
        self.material.domain() == Domain::Everywhere
    }
}

impl<const D: usize, const N: usize> ElementTerm for OnePointCells<D, N> {
    fn body(&self) -> &str {
        &self.body
    }

    fn each_state(&self, x: &[f64], visit: &mut dyn FnMut(usize, ElementState)) {
        for (element, vertices, pack, lane) in self.elements() {
            let f = self.deformation_of(x, &vertices, (pack, lane));
            visit(element, in_space(self.axes.get(element), self.material.state(&f)));
        }
    }

    fn element_count(&self) -> usize {
        self.nodes.len()
    }

    /// Adds to the mean deformation gradient that of the hourglass modes with their enhanced strains, in
    /// which a bending cell has no traction across it.
    fn state_at(&self, x: &[f64], element: usize, at: &Barycentric) -> Option<ElementState> {
        let (_, vertices, ..) = self.elements().find(|(number, ..)| *number == element)?;
        let moduli = RestModuli::new(&rest_tangent(&*self.material));
        let states = self.states(x, (element, &vertices), &moduli, std::slice::from_ref(at));
        states.into_iter().next()
    }

    fn nodes(&self) -> usize {
        N
    }

    fn each_at(&self, x: &[f64], points: &[Barycentric], visit: &mut ElementVisitor<'_>) {
        self.evaluate_at(x, points, visit);
    }
}

impl<const D: usize, const N: usize> Measurements for OnePointCells<D, N> {
    fn deformation(&mut self, x: &[f64]) -> Option<DeformationExtremes> {
        let (cells, workspace, _) = parts!(self);
        extremes(cells.patches, workspace, x, |patch, scratch| {
            let piece = &CellPiece {
                packs: cells.packs,
                index: &cells.patches.index,
                pull_back: cells.pull_back,
                range: patch.packs.clone(),
            };
            dispatch_compact(CellExtremesKernel { piece, position: &scratch.position })
        })
    }
}

impl<const D: usize, const N: usize> ForceLayout for OnePointCells<D, N> {
    fn rows(&self, first: usize, count: usize) -> Option<&[f64]> {
        self.patches.rows(&self.workspace, first, count)
    }
}

impl<const D: usize, const N: usize> StepLimit for OnePointCells<D, N> {
    fn max_step(&self, x: &[f64], dx: &[f64]) -> f64 {
        collapse::step_to_collapse(self, x, dx)
    }
}
