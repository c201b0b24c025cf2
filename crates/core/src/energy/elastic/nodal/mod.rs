//! Nodal integration with a stabiliser: linear elements that do not lock where they are nearly
//! incompressible.
//!
//! ```text
//! E = sum_a V_a psi_1(F_a) + sum_e V_e psi_2(F_e),   psi_1 + psi_2 = psi,
//! F_a = sum_(e at a) V_e/(D + 1) F_e / V_a
//! ```
//!
//! `psi_1` sees one mean deformation gradient for each node ([`rings`]), of which there are few: its bulk
//! modulus constrains as many volumes as there are nodes, not as there are elements. Means alone do not see
//! deformations that change from element to element; `psi_2`, the part `alpha` of the shear modulus with a
//! Poisson's ratio of at most 1/3, does, and does not lock. As every model is linear in its moduli, both
//! parts are materials of the same model, see [`Parameters::split`](crate::material::Parameters::split):
//! Puso and Solberg 2006, "A stabilized nodally integrated tetrahedral", Int. J. Numer. Meth. Engng 67, 841,
//! with `psi_1 = psi - alpha psi~`, `psi_2 = alpha psi~`. Under an affine motion both see the same `F`, and
//! the energy is that of plain elements.
//!
//! Two terms of the system: [`Nodal`], and ordinary elements of the second material.

mod hessian;
mod rings;
#[cfg(test)]
mod tests;

use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;

use super::Elastic;
use super::block::{Block, BlockMaterial};
use super::collapse::{MARGIN, first_root};
use super::kinematics::BLOCKS;
use crate::algebra::Mat;
use crate::element::ElementState;
use crate::energy::{
    EnergyKind, EnergyTerm, Fault, PredictedStresses, Stencils, StepLimit, TermProperties, TermViews,
};
use crate::lanes::{WIDTH, dispatch};
use crate::material::Stress;
use crate::material::{Domain, Material, MaterialSpec, MaterialVisitor, Psd};

use hessian::RingPart;
use rings::{Deform, Gather, NodeRings};

/// Nodes that go through the material together, and to one thread.
const CHUNK: usize = BLOCKS * WIDTH;

/// Below this many nodes a hand-over to other threads costs more than it saves.
const PARALLEL_FROM: usize = 8 * CHUNK;

/// The terms of linear elements `elements` (vertices of the system) of `body`, at rest at `rest` (flat) [m],
/// with nodal integration of all but the part `stabilisation` of the shear modulus; `None` for a model that
/// knows no Poisson's ratio.
///
/// # Panics
/// As [`Elastic::linear`].
pub fn nodal_integration<const D: usize, const N: usize>(
    body: &str,
    material: &MaterialSpec,
    stabilisation: f64,
    stress: Stress,
    elements: &[[u32; N]],
    rest: &[f64],
) -> Option<[Box<dyn EnergyTerm>; 2]> {
    let [at_nodes, in_elements] = material.split(stabilisation)?;
    let whole = material.visit::<D, _>(OnBlocks);
    let nodes = Arc::new(Nodes { rings: NodeRings::new(elements, rest), whole });
    let plain = ElementMaker { body, stress, elements, rest };
    let mut elements: Elastic<D, N> = in_elements.visit::<D, _>(plain);
    elements.nodes = Some(nodes.clone());
    let count = nodes.rings.count();
    let nodal = Nodal {
        body: body.into(),
        material: at_nodes.visit::<D, _>(OnBlocks),
        stress,
        first_piola: vec![Mat::zero(); count],
        gradient: vec![[0.0; D]; count],
        energies: vec![0.0; count.div_ceil(CHUNK)],
        parts: vec![],
        part_size: 0,
        nodes,
    };
    Some([Box::new(elements), Box::new(nodal)])
}

/// Any material behind a pointer.
struct OnBlocks;

impl<const D: usize> MaterialVisitor<D> for OnBlocks {
    type Output = Box<dyn BlockMaterial<D>>;

    fn visit<M: Material<D> + Material<3> + Clone>(self, material: M) -> Self::Output {
        Box::new(material)
    }
}

/// Ordinary elements of any material.
struct ElementMaker<'a, const N: usize> {
    body: &'a str,
    stress: Stress,
    elements: &'a [[u32; N]],
    rest: &'a [f64],
}

impl<const D: usize, const N: usize> MaterialVisitor<D> for ElementMaker<'_, N> {
    type Output = Elastic<D, N>;

    fn visit<M: Material<D> + Material<3> + Clone>(self, material: M) -> Self::Output {
        Elastic::linear(self.body, material, self.stress, self.elements, self.rest)
    }
}

/// The nodes of a body and all of its material.
pub(super) struct Nodes<const D: usize> {
    rings: NodeRings<D>,
    whole: Box<dyn BlockMaterial<D>>,
}

impl<const D: usize> Nodes<D> {
    /// The state of an element: its own `F`, and the means of Cauchy stress and energy density at its nodes.
    /// Those of its own `F` would be those of an element that locks.
    pub(super) fn state(&self, f: &Mat<f64, D>, vertices: &[u32], x: &[f64]) -> ElementState {
        let of_own = self.whole.state(f);
        let (mut cauchy, mut energy_density) = (Mat::zero(), 0.0);
        for v in vertices {
            let node = self.rings.vertices.binary_search(v).expect("a vertex of an element is a node");
            let at_node = self.rings.deformation_gradient(node, x.as_chunks::<D>().0);
            let state = self.whole.state(&at_node);
            cauchy += state.cauchy_stress().scale(1.0 / vertices.len() as f64);
            energy_density += state.energy_density / vertices.len() as f64;
        }
        let first_piola = cauchy.mul(&of_own.deformation_gradient.cofactor());
        ElementState { first_piola, energy_density, ..of_own }
    }

    /// Bytes held.
    fn bytes(&self) -> usize {
        self.rings.bytes()
    }
}

/// The energy `sum_a V_a psi_1(F_a)` of the nodes of a body.
struct Nodal<const D: usize> {
    body: String,
    material: Box<dyn BlockMaterial<D>>,
    stress: Stress,
    nodes: Arc<Nodes<D>>,
    /// `P(F_a)` [Pa] of every node, or its change along a direction.
    first_piola: Vec<Mat<f64, D>>,
    /// The gradient last evaluated, node by node [N].
    gradient: Vec<[f64; D]>,
    /// Sums over the nodes of a chunk [J].
    energies: Vec<f64>,
    /// Stencils of the Hessian, where they were asked for.
    parts: Vec<RingPart>,
    part_size: usize,
}

/// Runs `work` on chunks of the results, each with the number of its first node; whether it was true for
/// all. What is computed does not depend on who computes it.
fn for_chunks<T: Send>(
    results: &mut [T],
    size: usize,
    work: impl Fn(usize, &mut [T]) -> bool + Sync,
) -> bool {
    let nodes = results.len() / size * CHUNK;
    let run = |(chunk, results): (usize, &mut [T])| work(chunk * CHUNK, results);
    if nodes < PARALLEL_FROM || rayon::current_num_threads() == 1 {
        return results.chunks_mut(size).enumerate().fold(true, |all, chunk| all & run(chunk));
    }
    results.par_chunks_mut(size).enumerate().map(run).reduce(|| true, |a, b| a & b)
}

impl<const D: usize> Nodal<D> {
    /// Turns the deformation gradients into stresses by `material`, given the nodes of a chunk and their
    /// gradients.
    fn fill_stresses(
        &mut self,
        x: &[f64],
        material: impl Fn(&dyn BlockMaterial<D>, Range<usize>, &mut [Block<D>]) + Sync,
    ) {
        let Nodal { material: model, nodes, first_piola, .. } = self;
        let (model, rings, x) = (model.as_ref(), &nodes.rings, x.as_chunks::<D>().0);
        for_chunks(first_piola, CHUNK, |first, stresses| {
            let nodes = first..first + stresses.len();
            let mut blocks = [Block::ZERO; BLOCKS];
            let f = &mut blocks[..nodes.len().div_ceil(WIDTH)];
            dispatch(Deform { rings, nodes: nodes.clone(), x, f });
            material(model, nodes, f);
            for (i, stress) in stresses.iter_mut().enumerate() {
                *stress = f[i / WIDTH].lane(i % WIDTH);
            }
            true
        });
    }

    /// The gradients from the stresses; whether all are finite.
    fn gather(&mut self) -> bool {
        let Nodal { nodes, first_piola, gradient, .. } = self;
        let (rings, stress) = (&nodes.rings, &first_piola[..]);
        for_chunks(gradient, CHUNK, |first, gradient| dispatch(Gather { rings, first, stress, gradient }))
    }

    /// `F_a` of every node.
    fn deformation_gradients<'a>(&'a self, x: &'a [f64]) -> impl Iterator<Item = Mat<f64, D>> {
        let x = x.as_chunks::<D>().0;
        (0..self.nodes.rings.count()).map(move |node| self.nodes.rings.deformation_gradient(node, x))
    }
}

impl<const D: usize> EnergyTerm for Nodal<D> {
    fn name(&self) -> String {
        format!("nodes of `{}`", self.body)
    }

    fn properties(&self) -> TermProperties {
        TermProperties { fills_space: D == 3, ..TermProperties::of(EnergyKind::Elastic) }
    }

    fn energy(&mut self, x: &[f64]) -> f64 {
        let Nodal { material, nodes, energies, .. } = self;
        let (material, rings, x) = (material.as_ref(), &nodes.rings, x.as_chunks::<D>().0);
        for_chunks(energies, 1, |first, sum| {
            let nodes = first..(first + CHUNK).min(rings.count());
            let (mut blocks, mut psi) = ([Block::ZERO; BLOCKS], [[0.0; WIDTH]; BLOCKS]);
            let count = nodes.len().div_ceil(WIDTH);
            let (f, psi) = (&mut blocks[..count], &mut psi[..count]);
            dispatch(Deform { rings, nodes: nodes.clone(), x, f });
            material.density(f, psi);
            sum[0] =
                rings.volume[nodes].iter().zip(psi.as_flattened()).map(|(volume, psi)| volume * psi).sum();
            true
        });
        energies.iter().sum()
    }

    fn evaluate(&mut self, x: &[f64]) -> bool {
        let how = self.stress;
        self.fill_stresses(x, |material, _, f| material.stress(how, f));
        self.gather()
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        let (vertices, end) = (&self.nodes.rings.vertices, first + g.len() / D);
        let g = g.as_chunks_mut::<D>().0;
        let begin = vertices.partition_point(|v| (*v as usize) < first);
        for (v, gradient) in vertices[begin..].iter().zip(&self.gradient[begin..]) {
            let v = *v as usize;
            if v >= end {
                break;
            }
            for c in 0..D {
                g[v - first][c] += gradient[c];
            }
        }
    }

    fn add_hessian_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) {
        let (nodes, p) = (self.nodes.clone(), p.as_chunks::<D>().0);
        let rings = &nodes.rings;
        self.fill_stresses(x, |material, nodes, f| {
            let mut blocks = [Block::ZERO; BLOCKS];
            let df = &mut blocks[..f.len()];
            dispatch(Deform { rings, nodes, x: p, f: df });
            material.derivative(f, df, None);
            f.copy_from_slice(df);
        });
        self.gather();
        self.add_rows(0, y);
    }

    fn stencils(&mut self) -> Stencils {
        let (parts, stencils) = hessian::stencils(&self.nodes.rings);
        (self.parts, self.part_size) = (parts, stencils.size);
        stencils
    }

    fn stencil_hessians(&self, stencils: Range<usize>, x: &[f64], psd: Psd, out: &mut [f64]) {
        hessian::fill(self, stencils, x, (psd, None), out);
    }

    fn fault(&self, x: &[f64]) -> Option<Fault> {
        let mut nodes = self.deformation_gradients(x).enumerate();
        let (node, f) = nodes.find(|(_, f)| self.material.is_at_fault(f))?;
        let vertex = self.nodes.rings.vertices[node] as usize;
        let material_would_help = self.material.domain() == Domain::PositiveJ;
        Some(Fault::Node { body: self.body.clone(), vertex, j: f.determinant(), material_would_help })
    }

    fn bytes(&self) -> usize {
        self.nodes.bytes()
            + size_of_val(&self.first_piola[..])
            + size_of_val(&self.gradient[..])
            + size_of_val(&self.energies[..])
            + size_of_val(&self.parts[..])
    }
}

impl<const D: usize> PredictedStresses for Nodal<D> {
    fn predicted_hessians(&self, stencils: Range<usize>, from: &[f64], x: &[f64], out: &mut [f64]) {
        hessian::fill(self, stencils, x, (Psd::Exact, Some(from)), out);
    }
}

impl<const D: usize> TermViews for Nodal<D> {
    fn predicted(&self) -> Option<&dyn PredictedStresses> {
        Some(self)
    }

    fn limit(&self) -> Option<&dyn StepLimit> {
        match self.material.domain() {
            Domain::Everywhere => None,
            Domain::PositiveJ => Some(self),
        }
    }
}

impl<const D: usize> StepLimit for Nodal<D> {
    fn max_step(&self, x: &[f64], dx: &[f64]) -> f64 {
        let changes = self.deformation_gradients(dx);
        let roots = self.deformation_gradients(x).zip(changes).map(|(f, df)| MARGIN * first_root(&f, &df));
        roots.fold(1.0, f64::min)
    }
}
