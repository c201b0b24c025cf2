//! Elements of one term with samples of a tensor, and fields that need no patch.

use super::reference::RecoveryElement;
use crate::algebra::Mat;
use crate::element::{Barycentric, ElementState};
use crate::energy::ElementTerm;
use crate::numbering::Numbering;

/// Position in space [m]; third component 0 in 2D.
pub(super) type Point = [f64; 3];

/// Number of entries of a tensor.
pub(super) const TENSOR: usize = 9;

/// Entries of a tensor, by rows.
pub(super) type Tensor = [f64; TENSOR];

/// Configuration at which elements are evaluated.
#[derive(Clone, Copy)]
pub(crate) struct SampledConfiguration<'a> {
    /// Positions, flat, in the order of the simulation [m].
    pub(crate) x: &'a [f64],
    /// Reference positions, flat, in the order of the scene [m].
    pub(crate) rest: &'a [f64],
    /// Order of the simulation.
    pub(crate) numbering: &'a Numbering,
    /// 2 or 3.
    pub(crate) dimension: usize,
}

impl SampledConfiguration<'_> {
    /// Returns the reference position of a vertex of the scene.
    pub(super) fn rest_point(&self, vertex: u32) -> Point {
        let row = &self.rest[vertex as usize * self.dimension..][..self.dimension];
        std::array::from_fn(|c| row.get(c).copied().unwrap_or(0.0))
    }
}

/// Values at nodes.
pub(super) struct NodalRows {
    /// Vertex of each row, in the order of the scene.
    pub(super) vertices: Vec<u32>,
    pub(super) values: Vec<Tensor>,
    /// Number of patches with a lower degree than their element asks for.
    pub(super) lowered: usize,
}

/// Samples of a tensor at some points of every cell, in the order of the mesh.
pub(super) struct Samples {
    /// Points of a cell.
    pub(super) count: usize,
    /// Reference positions.
    pub(super) positions: Vec<Point>,
    pub(super) values: Vec<Tensor>,
}

impl Samples {
    /// Returns positions and values of a cell.
    pub(super) fn of_cell(&self, cell: usize) -> (&[Point], &[Tensor]) {
        let range = cell * self.count..(cell + 1) * self.count;
        (&self.positions[range.clone()], &self.values[range])
    }
}

/// Elements of one term.
pub(super) struct Cells<'a> {
    pub(super) element: RecoveryElement,
    pub(super) at: SampledConfiguration<'a>,
    /// Nodes of each cell, flat, in the order of the scene.
    pub(super) vertices: Vec<u32>,
    /// Samples for the field of an element.
    own: Samples,
    /// Samples for patches; `None` if they are those of the elements.
    patch: Option<Samples>,
}

impl<'a> Cells<'a> {
    /// Samples a tensor of the states of all elements; `None` if there are none.
    pub(super) fn sampled(
        term: &dyn ElementTerm,
        at: SampledConfiguration<'a>,
        of: impl Fn(&ElementState) -> Mat<f64, 3>,
    ) -> Option<Self> {
        let element = RecoveryElement::new(at.dimension, term.nodes())?;
        let (mut points, for_patches) = (element.element_points(), element.patch_points());
        let own = points.len();
        let has_more = for_patches != points;
        if has_more {
            points.extend(&for_patches);
        }
        let mut cells: Vec<(usize, Vec<u32>, Vec<Tensor>)> = Vec::with_capacity(term.element_count());
        term.each_at(at.x, &points, &mut |evaluated| {
            let vertices = evaluated.vertices.iter().map(|vertex| at.numbering.original(*vertex)).collect();
            let values = evaluated.states.iter().map(|state| entries(&of(state))).collect();
            cells.push((evaluated.number, vertices, values));
        });
        cells.sort_by_key(|(number, ..)| *number);
        let samples = |points: &[Barycentric], first: usize| {
            let shapes: Vec<Vec<f64>> = points.iter().map(|point| element.shape(point).values).collect();
            let mut samples = Samples { count: points.len(), positions: vec![], values: vec![] };
            for (_, vertices, values) in &cells {
                samples.positions.extend(shapes.iter().map(|shape| interpolated(shape, vertices, at)));
                samples.values.extend(&values[first..first + points.len()]);
            }
            samples
        };
        Some(Cells {
            own: samples(&points[..own], 0),
            patch: has_more.then(|| samples(&for_patches, own)),
            vertices: cells.into_iter().flat_map(|(_, vertices, _)| vertices).collect(),
            element,
            at,
        })
    }

    /// Returns the samples that patches are fitted to.
    pub(super) fn patch_samples(&self) -> &Samples {
        self.patch.as_ref().unwrap_or(&self.own)
    }

    /// Returns the nodes of each cell.
    pub(super) fn cells(&self) -> impl ExactSizeIterator<Item = &[u32]> {
        self.vertices.chunks_exact(self.element.nodes.len())
    }

    /// Returns the values at the nodes of every cell, flat, by the samples of the cell alone.
    pub(super) fn element_values(&self) -> Vec<Tensor> {
        let weights: Vec<_> =
            self.element.nodes.iter().map(|node| self.element.extrapolation(node)).collect();
        let cells = 0..self.cells().len();
        let values = cells.map(|cell| self.own.of_cell(cell).1);
        values.flat_map(|values| weights.iter().map(|weights| weighted(weights, values))).collect()
    }

    /// Returns the plain mean of the values of all cells at each node.
    pub(super) fn averaged(&self) -> NodalRows {
        let vertices = self.distinct_vertices();
        let mut values = vec![[0.0; TENSOR]; vertices.len()];
        let mut counts = vec![0.0; vertices.len()];
        for (vertex, value) in self.vertices.iter().zip(self.element_values()) {
            let row = row_of(&vertices, *vertex);
            values[row].iter_mut().zip(value).for_each(|(sum, value)| *sum += value);
            counts[row] += 1.0;
        }
        for (value, count) in values.iter_mut().zip(counts) {
            value.iter_mut().for_each(|entry| *entry /= count);
        }
        NodalRows { vertices, values, lowered: 0 }
    }

    /// Returns the vertices of the cells in ascending order, each once.
    pub(super) fn distinct_vertices(&self) -> Vec<u32> {
        let mut vertices = self.vertices.clone();
        vertices.sort_unstable();
        vertices.dedup();
        vertices
    }
}

/// Returns the row of a vertex that is one of these.
pub(super) fn row_of(vertices: &[u32], vertex: u32) -> usize {
    vertices.partition_point(|other| *other < vertex)
}

/// Returns the weighted sum of tensors.
pub(super) fn weighted(weights: &[f64], values: &[Tensor]) -> Tensor {
    let mut sum = [0.0; TENSOR];
    for (weight, value) in weights.iter().zip(values) {
        sum.iter_mut().zip(value).for_each(|(sum, value)| *sum += weight * value);
    }
    sum
}

/// Returns the reference position with these weights of the nodes.
pub(super) fn interpolated(weights: &[f64], vertices: &[u32], at: SampledConfiguration<'_>) -> Point {
    let mut sum = [0.0; 3];
    for (weight, vertex) in weights.iter().zip(vertices) {
        let point = at.rest_point(*vertex);
        (0..3).for_each(|c| sum[c] += weight * point[c]);
    }
    sum
}

fn entries(tensor: &Mat<f64, 3>) -> Tensor {
    let mut entries = [0.0; TENSOR];
    entries.copy_from_slice(tensor.0.as_flattened());
    entries
}
