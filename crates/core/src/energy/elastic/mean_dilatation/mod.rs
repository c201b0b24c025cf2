//! Cells whose volume changes as one: quadrilaterals and hexahedra that do not lock.
//!
//! ```text
//! E = sum_e sum_q w_q psi(Fb_q),   Fb_q = (theta / J_q)^(1/D) F_q,   J_q = det F_q,
//! theta = sum_q w_q J_q / sum_q w_q
//! ```
//!
//! The material sees one ratio of volumes for each cell, `det Fb_q = theta`, so that the bulk modulus
//! constrains one number for each cell and not one for each quadrature point: Simo, Taylor, Pister 1985,
//! "Variational and projection methods for the volume constraint in finite deformation elasto-plasticity",
//! Comput. Meth. Appl. Mech. Eng. 51, 177; B-bar of Hughes 1980 for finite strain. Forces are the gradient of
//! this energy. With `p_q = P(Fb_q) : Fb_q / D` and `pm` their mean by the weights, the stress that works on
//! `F_q` is
//!
//! ```text
//! P*_q = (theta / J_q)^(1/D) P(Fb_q) + (pm / theta - p_q / J_q) cof F_q
//! ```
//!
//! It exists where `J_q > 0` at every point, whatever the domain of the material. A material that is
//! linear in `F` stays so: there `Fb_q = F_q + (tm - tr F_q)/D I` with the mean `tm` of the traces, and
//! `P*_q = P + (pm - p_q) I`, `p_q = tr P / D`. A material without a Poisson's ratio does not lock: it
//! sees `F_q` itself. In [`packs`] stands of what nodes `F_q` is made, so that bending does not lock
//! either, and in [`bending`] the energy that makes up for what is then too soft.

mod axes;
mod bending;
mod collapse;
mod hessian;
mod kernels;
mod pack_hessian;
mod packs;
mod shape;
#[cfg(test)]
pub(super) mod tests;

pub use axes::{CellTurns, TurningCells};
pub use shape::{CellShapes, ShapedCells};
use std::ops::Range;

use super::axes::in_space;
use super::block::BlockMaterial;
use super::solid::{SolidElements, extremes};
use super::{centroids, points_of};
use crate::algebra::Mat;
use crate::element::{Barycentric, ElementState, Isoparametric};
use crate::energy::patch::{Patch, Patches, Scratch, Workspace};
use crate::energy::{
    DeformationExtremes, ElementTerm, EnergyKind, EnergyTerm, Fault, ForceLayout, Measurements,
    PredictedStresses, Stencils, StepLimit, TermProperties,
};
use crate::lanes::{Lanes, Portable, WIDTH, dispatch_compact};
use crate::material::{Domain, Material, MaterialSpec, Psd, Stress, Tangent};
use crate::numbering::along_curve;
use bending::{BendingEnergyKernel, BendingForceKernel};
pub(crate) use bending::{BendingPack, BendingSolid, CellBending};
use kernels::{CellDeformationKernel, CellEnergyKernel, CellForceKernel, MOST_POINTS, PointWork, Points};
pub(crate) use kernels::{cell_gradient, gradient_of_lane};
pub(crate) use packs::{CellPacks, PointPack};

/// How volumes are averaged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dilatation {
    /// By the ratio of volumes, for any material.
    Finite,
    /// By the trace of the displacement gradient, for materials that are linear in it.
    Small,
    /// Not at all: every point has its own, for materials without a Poisson's ratio, which do not lock.
    Own,
}

impl Dilatation {
    /// The one that suits a material.
    pub fn of(material: &MaterialSpec) -> Self {
        match material {
            MaterialSpec::Linear(_) => Dilatation::Small,
            _ if material.lame().is_none() => Dilatation::Own,
            _ => Dilatation::Finite,
        }
    }
}

/// Cells of `N` nodes filled with one material.
pub struct MeanDilatation<const D: usize, const N: usize> {
    body: String,
    material: Box<dyn BlockMaterial<D>>,
    stress: Stress,
    dilatation: Dilatation,
    cell: &'static Isoparametric<D, N>,
    patches: Patches<N>,
    packs: CellPacks<D, N>,
    /// `None` where no cell lacks stiffness.
    bending: Option<CellBending<D, N>>,
    /// Rotation of the material of every cell; none where there is none.
    axes: Vec<Mat<f64, 3>>,
    /// Nodes at rest of every cell, in the order of the mesh [m].
    nodes: Vec<[[f64; D]; N]>,
    workspace: Workspace<D>,
}

impl<const D: usize, const N: usize> MeanDilatation<D, N> {
    /// Cells `cells` (global vertex indices) of `body`, at rest at `rest` (flat, all vertices of the system)
    /// [m], their stress computed as `stress` says.
    ///
    /// # Panics
    /// If `det J` is not positive at a quadrature point: meshes are checked before.
    pub fn new<M: Material<D> + Material<3>>(
        body: &str,
        material: M,
        (stress, dilatation): (Stress, Dilatation),
        cell: &'static Isoparametric<D, N>,
        cells: &[[u32; N]],
        rest: &[f64],
    ) -> Self {
        assert!(cell.points.len() <= MOST_POINTS, "a {} has too many points", cell.kind.name);
        let order = along_curve::<D>(&centroids(cells, rest));
        let patches = Patches::new::<D>(cells, &order, rest.len() / D);
        let packs = CellPacks::new(body, cell, &patches, rest);
        let material: Box<dyn BlockMaterial<D>> = Box::new(material);
        let tangent = &material.tangent(&Mat::identity(), Psd::Exact);
        let solid = BendingSolid { tangent, change: None, axes: &[], turning: None, dilatation };
        MeanDilatation {
            body: body.into(),
            material,
            stress,
            dilatation,
            cell,
            bending: CellBending::new(cell, &patches, &packs, solid, rest),
            packs,
            axes: vec![],
            nodes: cells.iter().map(|cell| points_of(rest, cell)).collect(),
            workspace: Workspace::new(&patches),
            patches,
        }
    }

    /// The change of the energy of cells with a parameter: of a solid with this `tangent` [Pa] at rest, whose
    /// energy changes by that of the material of `self`. The stiffness in bending that cells lack is no
    /// linear function of the material, as all else is.
    #[must_use]
    pub fn as_change_of(mut self, tangent: &Tangent<D>, rest: &[f64]) -> Self {
        let change = self.material.tangent(&Mat::identity(), Psd::Exact);
        self.bending = self.lacking((tangent, Some(&change)), rest);
        self
    }

    /// The cells with their global vertices: `(element, vertices, pack, lane)`.
    fn elements(&self) -> impl Iterator<Item = (usize, [u32; N], usize, usize)> {
        self.patches.stencils()
    }

    /// `F` at the quadrature points of one cell.
    fn deformations(&self, x: &[f64], vertices: &[u32; N], pack: usize, lane: usize) -> Vec<Mat<f64, D>> {
        let x = points_of::<D, N>(x, vertices);
        self.packs.rest(pack).iter().map(|rest| gradient_of_lane(&x, &rest.lane(lane).0)).collect()
    }

    /// `Fb` at a place of a cell of which `f` is the deformation gradient there.
    fn dilated(&self, f: &Mat<f64, D>, at_points: &[Mat<f64, D>], pack: usize, lane: usize) -> Mat<f64, D> {
        let rest = self.packs.rest(pack);
        let mean = |of: fn(&Mat<f64, D>) -> f64| {
            at_points.iter().zip(rest).map(|(f, rest)| rest.lane(lane).1 * of(f)).sum::<f64>()
        };
        match self.dilatation {
            Dilatation::Finite => {
                let theta = mean(Mat::determinant);
                f.scale(kernels::root::<f64, D>(theta, f.determinant()))
            }
            Dilatation::Small => *f + Mat::scalar((mean(Mat::trace) - f.trace()) / D as f64),
            Dilatation::Own => *f,
        }
    }

    /// Deformation and stress of a cell, its deformation gradient from those at its quadrature points.
    fn state(
        &self,
        x: &[f64],
        (vertices, pack, lane): ([u32; N], usize, usize),
        at: impl FnOnce(&[Mat<f64, D>]) -> Mat<f64, D>,
    ) -> ElementState {
        let at_points = self.deformations(x, &vertices, pack, lane);
        self.material.state(&self.dilated(&at(&at_points), &at_points, pack, lane))
    }

    /// The mean over a cell.
    fn mean(&self, at_points: &[Mat<f64, D>], pack: usize, lane: usize) -> Mat<f64, D> {
        let points = at_points.iter().zip(self.packs.rest(pack));
        points.fold(Mat::zero(), |sum, (f, rest)| f.scale_add(rest.lane(lane).1, &sum))
    }
}

/// Inputs of the loop over patches.
struct PatchInputs<'a, const D: usize, const N: usize> {
    patches: &'a Patches<N>,
    packs: &'a CellPacks<D, N>,
    bending: Option<&'a CellBending<D, N>>,
    dilatation: Dilatation,
}

impl<'a, const D: usize, const N: usize> PatchInputs<'a, D, N> {
    /// The packs of a patch that lack stiffness in bending.
    fn bending(&self, patch: &Patch) -> impl Iterator<Item = BendingPack<'a, D, N>> {
        let PatchInputs { patches, bending, dilatation, .. } = *self;
        let of_pack = move |(bending, pack)| BendingPack {
            bending,
            index: &patches.index[pack],
            pack,
            turns: dilatation != Dilatation::Small,
        };
        let packs = patch.packs.clone();
        bending
            .into_iter()
            .flat_map(move |bending| packs.clone().map(move |pack| (bending, pack)))
            .map(of_pack)
    }

    /// The packs of a patch.
    fn packs(&self, patch: &Patch) -> impl Iterator<Item = Points<'a, D, N>> {
        let PatchInputs { patches, packs, dilatation, .. } = *self;
        patch.packs.clone().map(move |pack| Points {
            rest: packs.rest(pack),
            volume: &packs.volume[pack],
            index: &patches.index[pack],
            dilatation,
        })
    }
}

/// The parts of a term, its workspace and its material.
macro_rules! parts {
    ($term:ident) => {{
        let MeanDilatation { patches, packs, bending, workspace, material, dilatation, .. } = $term;
        let (dilatation, bending) = (*dilatation, bending.as_ref());
        (PatchInputs { patches, packs, bending, dilatation }, workspace, &**material)
    }};
}

impl<const D: usize, const N: usize> EnergyTerm for MeanDilatation<D, N> {
    fn name(&self) -> String {
        format!("elements of `{}`", self.body)
    }

    fn properties(&self) -> TermProperties {
        TermProperties { fills_space: D == 3, ..TermProperties::of(EnergyKind::Elastic) }
    }

    fn energy(&mut self, x: &[f64]) -> f64 {
        let (parts, workspace, material) = parts!(self);
        parts.patches.sum(workspace, x, |patch, scratch| {
            let (mut work, mut change) = (PointWork::ZERO, PointWork::ZERO);
            let mut psi = [[0.0; WIDTH]; MOST_POINTS];
            let mut sum = [0.0; WIDTH];
            for points in parts.packs(patch) {
                deform::<D, N, false>(points, scratch, &mut work, &mut change);
                let psi = &mut psi[..points.rest.len()];
                material.density(&work.f[..points.rest.len()], psi);
                dispatch_compact(CellEnergyKernel { points, work: &work, psi, sum: &mut sum });
            }
            for pack in parts.bending(patch) {
                let position = &*scratch.position;
                dispatch_compact(BendingEnergyKernel { pack, position, sum: &mut sum });
            }
            Portable::load(&sum).horizontal_sum()
        })
    }

    fn evaluate(&mut self, x: &[f64]) -> bool {
        let how = self.stress;
        let (parts, workspace, material) = parts!(self);
        parts.patches.evaluate(workspace, x, None, |patch, scratch| {
            let (mut work, mut change) = (PointWork::ZERO, PointWork::ZERO);
            for points in parts.packs(patch) {
                deform::<D, N, false>(points, scratch, &mut work, &mut change);
                work.p = work.f;
                material.stress(how, &mut work.p[..points.rest.len()]);
                add_forces::<D, N, false>(points, &work, &change, scratch);
            }
            parts.bending(patch).for_each(|pack| bend::<D, N, false>(pack, scratch));
        })
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        self.patches.add_rows(&self.workspace, first, g);
    }

    fn add_hessian_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) {
        let (parts, workspace, material) = parts!(self);
        parts.patches.evaluate(workspace, x, Some(p), |patch, scratch| {
            let (mut work, mut change) = (PointWork::ZERO, PointWork::ZERO);
            for points in parts.packs(patch) {
                let count = points.rest.len();
                deform::<D, N, true>(points, scratch, &mut work, &mut change);
                (work.p, change.p) = (work.f, change.f);
                material.stress(Stress::Analytic, &mut work.p[..count]);
                material.derivative(&work.f[..count], &mut change.p[..count], None);
                add_forces::<D, N, true>(points, &work, &change, scratch);
            }
            parts.bending(patch).for_each(|pack| bend::<D, N, true>(pack, scratch));
        });
        self.add_rows(0, y);
    }

    fn stencils(&mut self) -> Stencils {
        self.patches.lanes()
    }

    fn stencil_hessians(&self, stencils: Range<usize>, x: &[f64], psd: Psd, out: &mut [f64]) {
        hessian::fill(self, stencils, x, (psd, None), out);
    }

    /// `J` at the first quadrature point that is at fault.
    fn fault(&self, x: &[f64]) -> Option<Fault> {
        self.elements().find_map(|(element, vertices, pack, lane)| {
            let at_points = self.deformations(x, &vertices, pack, lane);
            let finite = self.dilatation == Dilatation::Finite;
            let is_at_fault = |f: &&Mat<f64, D>| {
                let folded = finite && f.determinant() <= 0.0;
                folded || self.material.is_at_fault(&self.dilated(f, &at_points, pack, lane))
            };
            let j = at_points.iter().find(is_at_fault)?.determinant();
            // Of those that can be inverted volumes are averaged as well, and a mean needs positive ones.
            Some(Fault::Element { body: self.body.clone(), element, j, material_would_help: false })
        })
    }

    fn bytes(&self) -> usize {
        let bending = self.bending.as_ref().map_or(0, CellBending::bytes);
        let elements =
            self.packs.bytes() + bending + size_of_val(&self.nodes[..]) + size_of_val(&self.axes[..]);
        self.patches.bytes() + elements + self.workspace.bytes()
    }
}

impl<const D: usize, const N: usize> PredictedStresses for MeanDilatation<D, N> {
    fn predicted_hessians(&self, stencils: Range<usize>, from: &[f64], x: &[f64], out: &mut [f64]) {
        let from = Some(from).filter(|_| self.dilatation == Dilatation::Finite);
        hessian::fill(self, stencils, x, (Psd::Exact, from), out);
    }
}

impl<const D: usize, const N: usize> SolidElements for MeanDilatation<D, N> {
    fn is_finite_everywhere(&self) -> bool {
        self.dilatation != Dilatation::Finite && self.material.domain() == Domain::Everywhere
    }
}

impl<const D: usize, const N: usize> ElementTerm for MeanDilatation<D, N> {
    fn body(&self) -> &str {
        &self.body
    }

    /// The mean deformation gradients of the cells, where strains are most accurate.
    fn each_state(&self, x: &[f64], visit: &mut dyn FnMut(usize, ElementState)) {
        for (element, vertices, pack, lane) in self.elements() {
            let mean = |at_points: &_| self.mean(at_points, pack, lane);
            visit(element, in_space(self.axes.get(element), self.state(x, (vertices, pack, lane), mean)));
        }
    }

    fn element_count(&self) -> usize {
        self.elements().count()
    }

    fn state_at(&self, x: &[f64], element: usize, at: &Barycentric) -> Option<ElementState> {
        let (_, vertices, pack, lane) = self.elements().find(|(number, ..)| *number == element)?;
        let mut xi = [0.0; D];
        xi.copy_from_slice(&at[..D]);
        let j = self.cell.jacobian(&self.nodes[element], &xi);
        let f = self.cell.jacobian(&points_of(x, &vertices), &xi).mul(&j.inverse());
        let axes = self.axes.get(element);
        let turned = axes.map_or(f, |axes| f.mul(&axes.leading()));
        Some(in_space(axes, self.state(x, (vertices, pack, lane), |_| turned)))
    }
}

impl<const D: usize, const N: usize> Measurements for MeanDilatation<D, N> {
    fn deformation(&mut self, x: &[f64]) -> Option<DeformationExtremes> {
        let (parts, workspace, _) = parts!(self);
        extremes(parts.patches, workspace, x, |patch, scratch| {
            let (mut work, mut change) = (PointWork::ZERO, PointWork::ZERO);
            let of_pack = |points: Points<'_, D, N>| {
                deform::<D, N, false>(points, scratch, &mut work, &mut change);
                work.extremes(&points)
            };
            parts.packs(patch).map(of_pack).fold(DeformationExtremes::NONE, DeformationExtremes::merge)
        })
    }
}

impl<const D: usize, const N: usize> ForceLayout for MeanDilatation<D, N> {
    fn rows(&self, first: usize, count: usize) -> Option<&[f64]> {
        self.patches.rows(&self.workspace, first, count)
    }
}

impl<const D: usize, const N: usize> StepLimit for MeanDilatation<D, N> {
    fn max_step(&self, x: &[f64], dx: &[f64]) -> f64 {
        collapse::step_to_collapse(self, x, dx)
    }
}

/// Positions of the nodes of a pack of cells.
fn in_lanes<const D: usize, const N: usize>(x: &[f64], cells: &[[u32; N]]) -> [[[f64; WIDTH]; D]; N] {
    let mut nodes = [[[0.0; WIDTH]; D]; N];
    for (lane, vertices) in cells.iter().enumerate() {
        for (node, at) in nodes.iter_mut().zip(points_of::<D, N>(x, vertices)) {
            node.iter_mut().zip(at).for_each(|(component, at)| component[lane] = at);
        }
    }
    nodes
}

/// Writes `Fb` of a pack, and `ALONG` the direction its change.
fn deform<const D: usize, const N: usize, const ALONG: bool>(
    points: Points<'_, D, N>,
    scratch: &Scratch<D>,
    work: &mut PointWork<D>,
    change: &mut PointWork<D>,
) {
    let (position, direction) = (&*scratch.position, &*scratch.direction);
    dispatch_compact(CellDeformationKernel::<D, N, ALONG> { points, position, direction, work, change });
}

/// Adds the gradients of a pack, or `ALONG` the direction their change.
fn add_forces<const D: usize, const N: usize, const ALONG: bool>(
    points: Points<'_, D, N>,
    work: &PointWork<D>,
    change: &PointWork<D>,
    scratch: &mut Scratch<D>,
) {
    let gradient = &mut scratch.gradient;
    dispatch_compact(CellForceKernel::<D, N, ALONG> { points, work, change, gradient });
}

/// Adds the gradients in bending of a pack, or `ALONG` the direction their change.
fn bend<const D: usize, const N: usize, const ALONG: bool>(
    pack: BendingPack<'_, D, N>,
    scratch: &mut Scratch<D>,
) {
    let Scratch { position, direction, gradient } = scratch;
    dispatch_compact(BendingForceKernel::<D, N, ALONG> { pack, position, direction, gradient });
}
