//! Hyperelastic elements: the energy `sum_e sum_q w_q Psi(F_q)` over their quadrature points, one in
//! linear elements.

mod axes;
mod block;
mod cells;
mod collapse;
mod evaluated;
mod factors;
mod hessian;
mod history;
mod kinematics;
mod membrane;
mod predicted;
mod simplex;
mod solid;

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

pub(crate) use cells::{
    Amplitudes, CellPacks, HourglassSolid, MOST_MODES, RestData, amplitude_rates, by_each, dot, modes,
    outer_sum, times,
};
pub use cells::{CellShapes, CellTurns, OnePointCells, PullBack, ShapedCells, TurningCells, bending_excess};
pub use history::{HistoryLaw, RememberingElements};
pub use membrane::flattened;
pub use membrane::{Membrane, Sheet};

pub(crate) use block::Block;
use block::BlockMaterial;
use evaluated::{centroid_deformation, deformation_at};
use kinematics::edges_at;
pub(crate) use kinematics::{BLOCKS, Kinematics, gather, rest_gradients, scatter};
use simplex::{Fused, SimplexForces};
pub(crate) use solid::SolidElements;
use solid::{ExtremesKernel, extremes};

use super::patch::Workspace;
use super::{
    DeformationExtremes, ElementTerm, ElementVisitor, EnergyKind, EnergyTerm, Fault, ForceLayout,
    Measurements, PredictedStresses, ShapeProducts, Stencils, StepLimit, TermProperties,
};
use crate::algebra::Mat;
use crate::element::ElementState;
use crate::element::{Barycentric, MassRule, interpolation, order};
use crate::lanes::{Lanes, Portable, WIDTH, dispatch_compact};
use crate::material::Stress;
use crate::material::{Domain, Material, Psd};

/// Elements of `N` vertices of one material: simplices (`N = 3` and `4` linear, `6` and `10` quadratic)
/// and cells of second order (8 and 9 in 2D, 20 and 27 in 3D).
pub struct Elastic<const D: usize, const N: usize> {
    body: String,
    material: Box<dyn BlockMaterial<D>>,
    stress: Stress,
    /// Fused forces of linear elements whose stress has a closed form.
    fused: Option<Box<dyn SimplexForces<D, N>>>,
    elements: Kinematics<D, D, N>,
    workspace: Workspace<D>,
    /// Factor of the energy density of each element, in the order of the mesh; empty if all are 1. The
    /// weights of `rest` contain it already.
    factors: Vec<f64>,
    /// Rotation from the material axes to those of space of each element, in the order of the mesh; empty
    /// if the axes are the same. The reference data of the elements contain it already.
    axes: Vec<Mat<f64, 3>>,
    /// True if it pays to predict pressures.
    nearly_incompressible: bool,
}

impl<const D: usize, const N: usize> Elastic<D, N> {
    /// Creates the linear elements `elements` (global vertex indices) of `body` with the reference
    /// positions `rest` (flat, all vertices of the system) [m]; `stress` says how stresses are computed.
    ///
    /// # Panics
    /// If `N` is not `D + 1`, or an element has no positive area or volume; meshes are checked before.
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

    /// Creates quadratic elements likewise: corners first, then the vertices in the middle of the edges.
    ///
    /// # Panics
    /// If `N` is not 6, 8 or 9 in 2D or 10, 20 or 27 in 3D, or `det J` is not positive at all quadrature
    /// points; meshes are checked before.
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
        let elements = Kinematics::new(body, elements, rest, |vertices| points_of(rest, vertices));
        Elastic {
            body: body.into(),
            nearly_incompressible: predicted::is_nearly_incompressible(&*material),
            material,
            stress,
            fused: None,
            workspace: Workspace::new(&elements.patches),
            elements,
            factors: vec![],
            axes: vec![],
        }
    }

    /// Returns the elements with their global vertices, in the order of the patches:
    /// `(element, vertices, pack, lane)`.
    fn elements(&self) -> impl Iterator<Item = (usize, [u32; N], usize, usize)> {
        self.elements.patches.stencils()
    }

    /// Returns `dx/dxi` and `J^-1` at the quadrature points of one element.
    fn points(&self, x: &[f64], vertices: &[u32; N], pack: usize, lane: usize) -> Vec<[Mat<f64, D>; 2]> {
        let x = points_of::<D, N>(x, vertices);
        let inverses = self.elements.inverses(pack, lane);
        inverses.enumerate().map(|(q, inverse)| [edges_at(&x, q), inverse]).collect()
    }

    /// Returns deformation and stress of an element with this deformation gradient.
    fn state(&self, f: &Mat<f64, D>, element: usize) -> ElementState {
        self.in_space(element, self.with_its_factor(element, self.material.state(f)))
    }
}

/// Returns the sum of the vertices of each element: its centroid up to a factor.
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

/// Returns the rows of `vertices` in a flat array.
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
        let Elastic { elements, material, workspace, .. } = self;
        elements.patches.sum(workspace, x, |patch, scratch| {
            let (mut blocks, mut psi) = ([Block::ZERO; BLOCKS], [[0.0; WIDTH]; BLOCKS]);
            let mut sum = [0.0; WIDTH];
            for piece in elements.pieces(patch) {
                let f = piece.deform(&scratch.position, &mut blocks);
                let psi = &mut psi[..f.len()];
                material.density(f, psi);
                piece.add_weighted(psi, &mut sum);
            }
            Portable::load(&sum).horizontal_sum()
        })
    }

    fn evaluate(&mut self, x: &[f64]) -> bool {
        let Elastic { elements, material, fused, workspace, stress, .. } = self;
        elements.patches.evaluate(workspace, x, None, |patch, scratch| {
            if let Some(fused) = &*fused {
                return fused.add(&elements.patches, &elements.rest, patch, scratch);
            }
            let mut blocks = [Block::ZERO; BLOCKS];
            for piece in elements.pieces(patch) {
                let f = piece.deform(&scratch.position, &mut blocks);
                material.stress(*stress, f);
                piece.add_forces(f, &mut scratch.gradient);
            }
        })
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        self.elements.patches.add_rows(&self.workspace, first, g);
    }

    fn add_hessian_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) {
        let Elastic { elements, material, workspace, .. } = self;
        elements.patches.evaluate(workspace, x, Some(p), |patch, scratch| {
            let (mut f, mut df) = ([Block::ZERO; BLOCKS], [Block::ZERO; BLOCKS]);
            for piece in elements.pieces(patch) {
                let f = piece.deform(&scratch.position, &mut f);
                let df = piece.deform(&scratch.direction, &mut df);
                material.derivative(f, df, None);
                piece.add_forces(df, &mut scratch.gradient);
            }
        });
        self.add_rows(0, y);
    }

    /// Also returns `p . dE/dx = sum_q w_q P : dF`, from the stresses of the product.
    fn add_transposed_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) -> Option<f64> {
        let Elastic { elements, material, workspace, .. } = self;
        let is_known = AtomicBool::new(true);
        let along = elements.patches.evaluate_with_sum(workspace, x, p, |patch, scratch| {
            let (mut f, mut df) = ([Block::ZERO; BLOCKS], [Block::ZERO; BLOCKS]);
            let (mut work, mut sum) = ([[0.0; WIDTH]; BLOCKS], [0.0; WIDTH]);
            for piece in elements.pieces(patch) {
                let f = piece.deform(&scratch.position, &mut f);
                let df = piece.deform(&scratch.direction, &mut df);
                let work = &mut work[..f.len()];
                if !material.derivative(f, df, Some(work)) {
                    is_known.store(false, Ordering::Relaxed);
                }
                piece.add_weighted(work, &mut sum);
                piece.add_forces(df, &mut scratch.gradient);
            }
            Portable::load(&sum).horizontal_sum()
        });
        self.add_rows(0, y);
        is_known.into_inner().then_some(along)
    }

    fn stencils(&mut self) -> Stencils {
        self.elements.patches.lanes()
    }

    fn stencil_hessians(&self, stencils: Range<usize>, x: &[f64], psd: Psd, out: &mut [f64]) {
        hessian::fill(self, stencils, x, (psd, None), out);
    }

    /// Reports `J` at the first faulty quadrature point of an element.
    fn fault(&self, x: &[f64]) -> Option<Fault> {
        self.elements().find_map(|(element, vertices, pack, lane)| {
            let f = self.points(x, &vertices, pack, lane).into_iter().map(|[dx, inverse]| dx.mul(&inverse));
            let fault = f.filter(|f| self.material.is_at_fault(f)).map(|f| f.determinant()).next();
            let material_would_help = self.material.domain() == Domain::PositiveJ;
            fault.map(|j| Fault::Element { body: self.body.clone(), element, j, material_would_help })
        })
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

    /// Evaluates quadratic elements at their centroid, where strains are most accurate.
    fn each_state(&self, x: &[f64], visit: &mut dyn FnMut(usize, ElementState)) {
        for (element, vertices, pack, lane) in self.elements() {
            let f = centroid_deformation::<D, N>(&self.points(x, &vertices, pack, lane));
            visit(element, self.state(&f, element));
        }
    }

    fn shape_products(&self) -> Option<ShapeProducts> {
        if order::<D, N>() == 1 {
            return None;
        }
        let mass = MassRule::<D, N>::new();
        let mut all = ShapeProducts { nodes: N, ..ShapeProducts::default() };
        for (_, vertices, pack, lane) in self.elements() {
            let at_points: Vec<Mat<f64, D>> =
                self.elements.inverses(pack, lane).map(|inverse| inverse.inverse()).collect();
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
            return Some(self.state(&centroid_deformation::<D, N>(&points), element));
        }
        Some(self.state(&deformation_at(&points, &interpolation::<D, N>(at)), element))
    }

    fn nodes(&self) -> usize {
        N
    }

    fn each_at(&self, x: &[f64], points: &[Barycentric], visit: &mut ElementVisitor<'_>) {
        self.evaluate_at(x, points, visit);
    }
}

impl<const D: usize, const N: usize> Measurements for Elastic<D, N> {
    fn deformation(&mut self, x: &[f64]) -> Option<DeformationExtremes> {
        let Elastic { elements, workspace, .. } = self;
        extremes(&elements.patches, workspace, x, |patch, scratch| {
            dispatch_compact(ExtremesKernel { elements, patch, scratch })
        })
    }
}

impl<const D: usize, const N: usize> ForceLayout for Elastic<D, N> {
    fn rows(&self, first: usize, count: usize) -> Option<&[f64]> {
        self.elements.patches.rows(&self.workspace, first, count)
    }
}

impl<const D: usize, const N: usize> StepLimit for Elastic<D, N> {
    fn max_step(&self, x: &[f64], dx: &[f64]) -> f64 {
        collapse::step_to_collapse(self, x, dx)
    }
}

#[cfg(test)]
mod tests;
