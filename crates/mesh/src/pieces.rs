//! Statistics of a mesh: cells of each kind, unconnected pieces, coincident vertices.

use rayon::prelude::*;
use serde::Serialize;

use super::{Cleaned, Mesh};
use pliant::element::CellBlock;
use pliant::topology::DisjointSets;

/// Number of cells of a kind.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct BlockCount {
    /// Name of the kind, singular and plural.
    pub kind: [&'static str; 2],
    /// Topological dimension.
    pub dimension: usize,
    /// Number of cells.
    pub count: usize,
}

impl BlockCount {
    fn of(block: &CellBlock) -> Self {
        let kind = block.kind;
        BlockCount { kind: [kind.name, kind.plural], dimension: kind.dimension, count: block.len() }
    }
}

/// Statistics of a mesh.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct Contents {
    /// 2 if there are mid-edge nodes, otherwise 1.
    pub order: usize,
    /// Tetrahedra.
    pub tetrahedra: usize,
    /// Triangles; next to tetrahedra they are sides that carry groups.
    pub triangles: usize,
    /// Cells other than simplices; those of lower dimension than the elements are sides that carry
    /// groups.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub blocks: Vec<BlockCount>,
    /// Edges that become springs.
    pub edges: usize,
    /// Lines that carry groups.
    pub lines: usize,
    /// Number of unconnected pieces; 0 for a point cloud.
    pub pieces: usize,
    /// Vertices at exactly the position of a vertex with a lower number. Nothing connects them.
    pub coincident_vertices: usize,
    /// Result of each step of cleaning that the scene asked for, in order.
    pub cleaned: Vec<Cleaned>,
    /// Names of the unread contents of the file.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub passed_over: Vec<String>,
}

impl Mesh {
    /// Collects the statistics; `O(n log n)`.
    pub fn contents(&self) -> Contents {
        let is_cloud = self.element_dimension() == 0;
        Contents {
            order: self.order(),
            tetrahedra: self.tetrahedra.len(),
            triangles: self.triangles.len(),
            blocks: self.blocks.iter().map(BlockCount::of).collect(),
            edges: self.edges.len(),
            lines: self.lines.len(),
            pieces: if is_cloud { 0 } else { self.piece_count() },
            coincident_vertices: if is_cloud { 0 } else { self.coincident_count() },
            cleaned: self.cleaned.clone(),
            passed_over: self.passed_over.clone(),
        }
    }

    /// Number of pieces that no element and no edge connects. A vertex without elements and edges counts
    /// as one.
    fn piece_count(&self) -> usize {
        let mut pieces = DisjointSets::new(self.vertex_count());
        self.edges.iter().for_each(|cell| pieces.connect(cell));
        if let Some(block) = self.block() {
            block.cells().for_each(|cell| pieces.connect(cell));
        } else if self.tetrahedra.is_empty() {
            connect_cells(&mut pieces, &self.triangles, &self.triangle_middles);
        } else {
            connect_cells(&mut pieces, &self.tetrahedra, &self.tetrahedron_middles);
        }
        pieces.count()
    }

    /// Number of vertices at exactly the position of a vertex with a lower number.
    fn coincident_count(&self) -> usize {
        let key = |vertex: usize| {
            let mut key = [0_u64; 3];
            // Adding 0.0 turns -0 into 0.
            key.iter_mut().zip(self.point(vertex)).for_each(|(key, x)| *key = (x + 0.0).to_bits());
            key
        };
        let mut places: Vec<[u64; 3]> = (0..self.vertex_count()).map(key).collect();
        places.par_sort_unstable();
        places.windows(2).filter(|pair| pair[0] == pair[1]).count()
    }
}

/// Connects the corners and the mid-edge nodes of each cell.
fn connect_cells<const N: usize, const M: usize>(
    pieces: &mut DisjointSets,
    cells: &[[u32; N]],
    middles: &[[u32; M]],
) {
    cells.iter().for_each(|cell| pieces.connect(cell));
    cells.iter().zip(middles).for_each(|(cell, middles)| {
        pieces.connect(&[cell[0], middles[0]]);
        pieces.connect(middles);
    });
}

#[cfg(test)]
mod tests {
    use crate::spec::InlineSpec;
    use crate::test_support::{build_grid, build_inline, grid, points};

    #[test]
    fn pieces_hang_together_by_elements_and_edges_only() {
        let spec = InlineSpec {
            points: points(&[
                [0.0, 0.0],
                [1.0, 0.0],
                [0.0, 1.0],
                [1.0, 0.0],
                [2.0, 0.0],
                [1.0, 1.0],
                [5.0, 0.0],
                [6.0, 0.0],
            ]),
            triangles: vec![[0, 1, 2], [3, 4, 5]],
            edges: vec![[7, 6]],
            ..InlineSpec::default()
        };
        let contents = build_inline(&spec, 2).unwrap().contents();
        assert_eq!((contents.pieces, contents.coincident_vertices), (3, 1));
        assert_eq!((contents.triangles, contents.edges, contents.tetrahedra, contents.order), (2, 1, 0, 1));
        let tied = InlineSpec { edges: vec![[7, 6], [1, 4], [6, 2]], ..spec.clone() };
        assert_eq!(build_inline(&tied, 2).unwrap().contents().pieces, 1);
        let cloud = InlineSpec { triangles: vec![], edges: vec![], ..spec };
        let contents = build_inline(&cloud, 2).unwrap().contents();
        assert_eq!((contents.pieces, contents.coincident_vertices), (0, 0));
    }

    #[test]
    fn a_grid_is_one_piece_of_either_order() {
        let mesh = build_grid(&grid(&[3, 2, 2], 0.5), 3).unwrap();
        assert_eq!((mesh.contents().pieces, mesh.contents().tetrahedra), (1, 72));
        let quadratic = mesh.promoted_to_quadratic().unwrap().contents();
        assert_eq!((quadratic.pieces, quadratic.order, quadratic.coincident_vertices), (1, 2, 0));
    }
}
