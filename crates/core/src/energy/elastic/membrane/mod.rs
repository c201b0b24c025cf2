//! Membranes: triangles in space with a two-dimensional material.

mod hessian;
mod kernels;
mod plane_stress;
#[cfg(test)]
mod tests;

use std::ops::Range;

use self::kernels::{AreaKernel, FactorKernel, FactorRateKernel, FrameKernel, FrameRateKernel, factors};
use self::plane_stress::PlaneStress;
use super::block::{Block, BlockMaterial};
use super::kinematics::{BLOCKS, Kinematics};
use super::points_of;
use super::solid::extremes;
use crate::algebra::{Mat, cross, signed_svd};
use crate::element::ElementState;
use crate::element::{Barycentric, Tangents};
use crate::energy::evaluated::visit_uniform;
use crate::energy::patch::Workspace;
use crate::energy::{
    DeformationExtremes, ElementTerm, ElementVisitor, EnergyKind, EnergyTerm, Fault, Measurements, Stencils,
    TermProperties, TermViews,
};
use crate::lanes::{Lanes, Portable, WIDTH, dispatch, dispatch_compact};
use crate::material::Stress;
use crate::material::{Domain, Lame, Material, Plane, Psd};

/// Returns the shape of a triangle in its own plane, with the first edge along the first axis, and the
/// axes in space.
pub fn flattened(corners: &[[f64; 3]; 3]) -> ([[f64; 2]; 3], Tangents<f64, 3, 2>) {
    let mut edges = [[0.0; 2]; 3];
    for c in 0..3 {
        edges[c] = [corners[1][c] - corners[0][c], corners[2][c] - corners[0][c]];
    }
    let (axes, g) = factors(&edges);
    ([[0.0; 2], [g[0][0], g[1][0]], [g[0][1], g[1][1]]], axes)
}

/// Additional stretch at which a sheet near the limit of its material is checked.
const NEAR_LIMIT: f64 = 1.1;

/// Properties of a membrane besides its material.
#[derive(Clone, Copy, Debug)]
pub struct Sheet {
    /// Thickness in the reference configuration [m].
    pub thickness: f64,
    /// Plane stress if its faces are free, plane strain if its thickness cannot change.
    pub plane: Plane,
    /// Small-strain Lame parameters of the material, if it has any.
    pub lame: Option<Lame>,
    /// Method by which stresses are computed.
    pub stress: Stress,
}

/// Linear triangles in space: `E = sum h A psi(G)` with the reference thickness `h` and area `A`.
///
/// `F`, 3 x 2, maps the reference tangents of a triangle to its present ones. With `F = Q G`, the columns
/// of `Q` orthonormal, the energy density of a frame-indifferent material is `psi(G)`, for any such `Q`.
/// The stress is `P = Q dpsi/dG`: a change `dQ` either rotates the frame in its plane, where
/// `dpsi/dG G^T` is symmetric, and does no work, or out of it, which changes no length. `det G` is the
/// area ratio and never negative: a membrane has no inverted state.
///
/// Sheets with free faces are in plane stress; in plane strain their thickness cannot change. A membrane
/// has no bending stiffness, and wrinkles finer than the mesh are not resolved: a compressed sheet
/// resists like a solid until its triangles turn.
///
/// Source: Bonet, Wood 2008, *Nonlinear Continuum Mechanics for Finite Element Analysis*, section 6.6
/// (plane stress).
pub struct Membrane {
    body: String,
    /// True in plane stress.
    frees_faces: bool,
    material: Box<dyn BlockMaterial<2>>,
    stress: Stress,
    /// The weights are volumes.
    elements: Kinematics<3, 2, 3>,
    /// Reference axes of every triangle, in the order of the mesh.
    axes: Vec<Tangents<f64, 3, 2>>,
    workspace: Workspace<3>,
}

impl Membrane {
    /// Creates the triangles `elements` (global vertex indices) of `body` with the reference positions
    /// `rest` (flat, all vertices of the system) [m]: a `sheet` of a frame-indifferent `material`.
    ///
    /// # Panics
    /// If a triangle has no area; meshes are checked before.
    pub fn new<M: Material<2> + Material<3>>(
        body: &str,
        material: M,
        sheet: Sheet,
        elements: &[[u32; 3]],
        rest: &[f64],
    ) -> Self {
        let Sheet { thickness, plane, lame, stress } = sheet;
        let material: Box<dyn BlockMaterial<2>> = match plane {
            Plane::Strain => Box::new(material),
            Plane::Stress => {
                let narrowing = lame.map_or(0.0, |lame| lame.lambda / (lame.lambda + 2.0 * lame.mu));
                Box::new(PlaneStress::new(Box::new(material), narrowing))
            }
        };
        let shape = |triangle: &[u32; 3]| flattened(&points_of(rest, triangle));
        let axes = elements.iter().map(|triangle| shape(triangle).1).collect();
        let mut elements = Kinematics::new(body, elements, rest, |triangle| shape(triangle).0);
        elements.each_rest(|_, point, lane| point.scale_weight(lane, thickness));
        Membrane {
            body: body.into(),
            frees_faces: plane == Plane::Stress,
            material,
            stress,
            workspace: Workspace::new(&elements.patches),
            elements,
            axes,
        }
    }

    /// Returns the first triangle that is at fault if it is stretched by the factor `further`.
    fn fault_beyond(&self, x: &[f64], further: f64) -> Option<Fault> {
        self.elements.patches.stencils().find_map(|(element, vertices, pack, lane)| {
            let g = factors(&self.deformation_gradient(x, &vertices, pack, lane)).1;
            let j = g.determinant();
            let body = || self.body.clone();
            let material_would_help = self.material.domain() == Domain::PositiveJ;
            if j.is_nan() || j <= 0.0 {
                return Some(Fault::Element { body: body(), element, j, material_would_help });
            }
            let stretch = signed_svd(&g).sigma[0];
            let fault = self.material.is_at_fault(&Mat(g.0.map(|row| row.map(|entry| further * entry))));
            match self.frees_faces && stretch > 1.0 {
                _ if !fault => None,
                true => Some(Fault::Sheet { body: body(), element, stretch }),
                false => Some(Fault::Element { body: body(), element, j, material_would_help }),
            }
        })
    }

    /// Returns `F` of one triangle.
    fn deformation_gradient(
        &self,
        x: &[f64],
        vertices: &[u32; 3],
        pack: usize,
        lane: usize,
    ) -> Tangents<f64, 3, 2> {
        self.elements.at_points(x, vertices, (pack, lane)).map(|(f, ..)| f).next().expect("a point each")
    }

    /// Returns the state in space: the third axis is the normal, in the reference configuration and now,
    /// with the stretch of the thickness along it.
    fn state(
        &self,
        x: &[f64],
        (element, vertices, pack, lane): &(usize, [u32; 3], usize, usize),
    ) -> ElementState {
        let (q, g) = factors(&self.deformation_gradient(x, vertices, *pack, *lane));
        let (now, rest) = (with_normal(&q), with_normal(&self.axes[*element]));
        let turned = |m: &Mat<f64, 3>| now.mul(m).mul_transpose(&rest);
        let ElementState { deformation_gradient, first_piola, energy_density, .. } = self.material.state(&g);
        ElementState {
            deformation_gradient: turned(&deformation_gradient),
            first_piola: turned(&first_piola),
            energy_density,
            plane: false,
        }
    }
}

impl EnergyTerm for Membrane {
    fn name(&self) -> String {
        format!("membrane of `{}`", self.body)
    }

    fn properties(&self) -> TermProperties {
        TermProperties::of(EnergyKind::Elastic)
    }

    fn energy(&mut self, x: &[f64]) -> f64 {
        let Membrane { elements, material, workspace, .. } = self;
        elements.patches.sum(workspace, x, |patch, scratch| {
            let (mut f, mut g) = ([Block::ZERO; BLOCKS], [Block::ZERO; BLOCKS]);
            let (mut psi, mut sum) = ([[0.0; WIDTH]; BLOCKS], [0.0; WIDTH]);
            for piece in elements.pieces(patch) {
                let f = piece.deform(&scratch.position, &mut f);
                let (g, psi) = (&mut g[..f.len()], &mut psi[..f.len()]);
                dispatch(FactorKernel { f, g });
                material.density(g, psi);
                piece.add_weighted(psi, &mut sum);
            }
            Portable::load(&sum).horizontal_sum()
        })
    }

    fn evaluate(&mut self, x: &[f64]) -> bool {
        let Membrane { elements, material, workspace, stress, .. } = self;
        elements.patches.evaluate(workspace, x, None, |patch, scratch| {
            let (mut f, mut g) = ([Block::ZERO; BLOCKS], [Block::ZERO; BLOCKS]);
            for piece in elements.pieces(patch) {
                let f = piece.deform(&scratch.position, &mut f);
                let g = &mut g[..f.len()];
                dispatch(FactorKernel { f, g });
                material.stress(*stress, g);
                dispatch(FrameKernel { q: f, stress: g });
                piece.add_forces(f, &mut scratch.gradient);
            }
        })
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        self.elements.patches.add_rows(&self.workspace, first, g);
    }

    /// Adds the product with `dP = dQ P_2 + Q dP_2`.
    fn add_hessian_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) {
        let Membrane { elements, material, workspace, .. } = self;
        elements.patches.evaluate(workspace, x, Some(p), |patch, scratch| {
            let (mut f, mut df) = ([Block::ZERO; BLOCKS], [Block::ZERO; BLOCKS]);
            let (mut g, mut dg) = ([Block::ZERO; BLOCKS], [Block::ZERO; BLOCKS]);
            for piece in elements.pieces(patch) {
                let f = piece.deform(&scratch.position, &mut f);
                let df = piece.deform(&scratch.direction, &mut df);
                let (g, dg) = (&mut g[..f.len()], &mut dg[..f.len()]);
                dispatch_compact(FactorRateKernel { f, df, g, dg });
                material.derivative(g, dg, None);
                material.stress(Stress::Analytic, g);
                dispatch_compact(FrameRateKernel { q: f, dq: df, stress: g, change: dg });
                piece.add_forces(df, &mut scratch.gradient);
            }
        });
        self.add_rows(0, y);
    }

    /// Reports the area ratio as `J`.
    fn fault(&self, x: &[f64]) -> Option<Fault> {
        self.fault_beyond(x, 1.0)
    }

    fn stencils(&mut self) -> Stencils {
        self.elements.patches.lanes()
    }

    fn stencil_hessians(&self, stencils: Range<usize>, x: &[f64], psd: Psd, out: &mut [f64]) {
        hessian::fill(self, stencils, x, psd, out);
    }
}

impl TermViews for Membrane {
    fn elements(&self) -> Option<&dyn ElementTerm> {
        Some(self)
    }

    fn measurements(&mut self) -> Option<&mut dyn Measurements> {
        Some(self)
    }
}

impl ElementTerm for Membrane {
    fn body(&self) -> &str {
        &self.body
    }

    fn each_state(&self, x: &[f64], visit: &mut dyn FnMut(usize, ElementState)) {
        self.elements.patches.stencils().for_each(|stencil| visit(stencil.0, self.state(x, &stencil)));
    }

    fn element_count(&self) -> usize {
        self.axes.len()
    }

    /// Returns the same state everywhere in the element.
    fn state_at(&self, x: &[f64], element: usize, _at: &Barycentric) -> Option<ElementState> {
        let stencil = self.elements.patches.stencils().find(|(number, ..)| *number == element)?;
        Some(self.state(x, &stencil))
    }

    fn nodes(&self) -> usize {
        3
    }

    fn each_at(&self, x: &[f64], points: &[Barycentric], visit: &mut ElementVisitor<'_>) {
        for stencil in self.elements.patches.stencils() {
            visit_uniform((stencil.0, &stencil.1), self.state(x, &stencil), points, visit);
        }
    }

    fn near_fault(&self, x: &[f64]) -> Option<Fault> {
        self.fault_beyond(x, NEAR_LIMIT)
    }
}

impl Measurements for Membrane {
    /// Returns the extremes of the area ratio in place of `J`.
    fn deformation(&mut self, x: &[f64]) -> Option<DeformationExtremes> {
        let Membrane { elements, workspace, .. } = self;
        extremes(&elements.patches, workspace, x, |patch, scratch| {
            dispatch_compact(AreaKernel { elements, patch, scratch })
        })
    }
}

/// Returns the rotation with these first two columns.
fn with_normal(axes: &Tangents<f64, 3, 2>) -> Mat<f64, 3> {
    let column = |j: usize| [axes[0][j], axes[1][j], axes[2][j]];
    let normal = cross(&column(0), &column(1));
    Mat([0, 1, 2].map(|i| [axes[i][0], axes[i][1], normal[i]]))
}
