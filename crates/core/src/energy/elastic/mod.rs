//! Hyperelastic elements: the energy `sum_e w_e Psi(F_e)`.

mod kernels;

use kernels::{DeformationKernel, EnergyKernel, GradientKernel, HessianKernel};

use super::patch::{Patches, Workspace};
use super::{DeformationExtremes, EnergyKind, EnergyTerm, Fault};
use crate::algebra::Mat;
use crate::diagnostics::ElementState;
use crate::element::{SimplexPack, edge_matrix, simplex_rest};
use crate::lanes::{dispatch, dispatch_compact};
use crate::material::{Domain, Material};
use crate::mesh::order::along_curve;
use crate::scene::Stress;

/// Linear simplices of `N = D + 1` vertices filled with one material.
pub struct Elastic<M, const D: usize, const N: usize> {
    body: String,
    material: M,
    stress: Stress,
    patches: Patches<N>,
    packs: Vec<SimplexPack<D>>,
    workspace: Workspace<D>,
}

impl<M: Material<D>, const D: usize, const N: usize> Elastic<M, D, N> {
    /// Elements `elements` (global vertex indices) of `body`, at rest at `rest` (flat, all vertices of the system) [m], their
    /// stress computed as `stress` says.
    ///
    /// # Panics
    /// If `N` is not `D + 1`, or an element has no positive area or volume: meshes are checked before.
    pub fn new(body: &str, material: M, stress: Stress, elements: &[[u32; N]], rest: &[f64]) -> Self {
        assert_eq!(N, D + 1, "a simplex has one vertex more than dimensions");
        let patches =
            Patches::new::<D>(elements, &along_curve::<D>(&centroids(elements, rest)), rest.len() / D);
        let mut packs = vec![SimplexPack::new(); patches.index.len()];
        for (element, vertices, pack, lane) in patches.stencils() {
            let (inverse_rest, weight) = simplex_rest(&points_of(rest, &vertices));
            assert!(weight > 0.0, "element {element} of {body} has volume {weight}");
            packs[pack].set(lane, &inverse_rest, weight);
        }
        for (pack, stencils) in packs.iter_mut().zip(&patches.stencil) {
            pack.fill_up(stencils.iter().flatten().count());
        }
        Elastic { body: body.into(), material, stress, workspace: Workspace::new(&patches), patches, packs }
    }

    /// The elements with their global vertices and rest data, in the order of the patches, one at a time.
    fn elements(&self) -> impl Iterator<Item = (usize, [u32; N], Mat<f64, D>, f64)> {
        self.patches.stencils().map(|(element, vertices, pack, lane)| {
            let (inverse_rest, weight) = self.packs[pack].lane(lane);
            (element, vertices, inverse_rest, weight)
        })
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
pub(crate) fn points_of<const D: usize, const N: usize>(x: &[f64], vertices: &[u32; N]) -> [[f64; D]; N] {
    let mut points = [[0.0; D]; N];
    for (point, &v) in points.iter_mut().zip(vertices) {
        point.copy_from_slice(&x[v as usize * D..v as usize * D + D]);
    }
    points
}

impl<M: Material<D> + Material<3>, const D: usize, const N: usize> EnergyTerm for Elastic<M, D, N> {
    fn name(&self) -> String {
        format!("elements of `{}`", self.body)
    }

    fn kind(&self) -> EnergyKind {
        EnergyKind::Elastic
    }

    fn energy(&mut self, x: &[f64]) -> f64 {
        let Elastic { patches, packs, material, workspace, .. } = self;
        patches.sum(workspace, x, |patch, scratch| {
            dispatch_compact(EnergyKernel { material, patches, packs, patch, scratch })
        })
    }

    fn evaluate(&mut self, x: &[f64]) -> bool {
        let Elastic { patches, packs, material, workspace, stress, .. } = self;
        match stress {
            Stress::Analytic => patches.evaluate(workspace, x, None, |patch, scratch| {
                dispatch(GradientKernel::<_, D, N, false> { material, patches, packs, patch, scratch });
            }),
            Stress::Autodiff => patches.evaluate(workspace, x, None, |patch, scratch| {
                dispatch(GradientKernel::<_, D, N, true> { material, patches, packs, patch, scratch });
            }),
        }
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        self.patches.add_rows(&self.workspace, first, g);
    }

    fn add_hessian_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) {
        let Elastic { patches, packs, material, workspace, .. } = self;
        patches.evaluate(workspace, x, Some(p), |patch, scratch| {
            dispatch_compact(HessianKernel { material, patches, packs, patch, scratch });
        });
        patches.add_rows(workspace, 0, y);
    }

    fn fault(&self, x: &[f64]) -> Option<Fault> {
        self.elements().find_map(|(element, vertices, inverse_rest, _)| {
            let f = edge_matrix(&points_of(x, &vertices)).mul(&inverse_rest);
            let j = f.determinant();
            let outside =
                Material::<D>::domain(&self.material) == Domain::PositiveJ && j.is_nan() | (j <= 0.0);
            let finite = self.material.pk1(&f).norm_squared().is_finite();
            (outside || !finite).then(|| Fault::Element { body: self.body.clone(), element, j })
        })
    }

    fn deformation(&mut self, x: &[f64]) -> Option<DeformationExtremes> {
        let Elastic { patches, packs, workspace, .. } = self;
        let mut parts =
            vec![DeformationExtremes { min_j: f64::INFINITY, inverted: 0 }; patches.patches.len()];
        patches.map(workspace, x, &mut parts, |patch, scratch| {
            dispatch_compact(DeformationKernel { patches, packs, patch, scratch })
        });
        parts.into_iter().reduce(DeformationExtremes::merge)
    }

    fn element_states(&self, x: &[f64]) -> Vec<ElementState> {
        let mut states: Vec<(usize, ElementState)> = self
            .elements()
            .map(|(element, vertices, inverse_rest, _)| {
                let f = edge_matrix(&points_of(x, &vertices)).mul(&inverse_rest);
                // In plane strain the third axis is neither stretched nor turned, but carries stress; in plane stress it is stretched.
                let mut in_space = Mat::<f64, 3>::identity();
                for i in 0..D {
                    in_space[i][..D].copy_from_slice(&f[i]);
                }
                if D == 2 {
                    in_space[2][2] = self.material.out_of_plane_stretch(&f);
                }
                let first_piola = Material::<3>::pk1(&self.material, &in_space);
                (element, ElementState { deformation_gradient: in_space, first_piola })
            })
            .collect();
        states.sort_unstable_by_key(|(element, _)| *element);
        states.into_iter().map(|(_, state)| state).collect()
    }

    fn bytes(&self) -> usize {
        self.patches.bytes() + size_of_val(&self.packs[..]) + self.workspace.bytes()
    }
}
