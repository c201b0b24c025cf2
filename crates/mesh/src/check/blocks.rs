//! Validity checks of quadrilaterals and hexahedra.

use crate::geometry::longest_edge;
use crate::{Cell, Mesh, MeshError};
use pliant::element::{CellBlock, CellVisitor, Isoparametric};

/// Checks that cells fit the dimension of the mesh, with one kind in each dimension.
pub(super) fn usable(mesh: &Mesh) -> Result<(), MeshError> {
    for (i, block) in mesh.blocks.iter().enumerate() {
        let kind = block.kind;
        if kind.dimension > mesh.dimension {
            return Err(MeshError::SolidsInPlane { count: block.len(), cells: kind.plural });
        }
        let simplices = match kind.dimension {
            2 if !mesh.triangles.is_empty() => Some("triangles"),
            3 if !mesh.tetrahedra.is_empty() => Some("tetrahedra"),
            _ => None,
        };
        let others = mesh.blocks[..i].iter().find(|other| other.kind.dimension == kind.dimension);
        if let Some(cells) = simplices.or(others.map(|other| other.kind.plural)) {
            return Err(MeshError::MixedCells { cells: [cells, kind.plural] });
        }
    }
    match mesh.block() {
        Some(block) if block.kind.dimension < mesh.dimension => {
            Err(MeshError::SheetOfCells { count: block.len(), cells: block.kind.plural })
        }
        _ => Ok(()),
    }
}

/// Checks that vertex indices are in range.
pub(super) fn in_range(mesh: &Mesh) -> Result<(), MeshError> {
    let count = mesh.vertex_count();
    for block in &mesh.blocks {
        if let Some(i) = block.vertices.iter().position(|vertex| *vertex as usize >= count) {
            let cell = Cell::Other(block.kind, i / block.kind.nodes);
            return Err(MeshError::IndexOutOfRange { cell, vertex: block.vertices[i], count });
        }
    }
    Ok(())
}

/// Checks that no cell has a vertex twice.
pub(super) fn different_vertices(mesh: &Mesh) -> Result<(), MeshError> {
    for block in &mesh.blocks {
        for (i, cell) in block.cells().enumerate() {
            let repeated = cell.iter().enumerate().find(|(a, vertex)| cell[..*a].contains(vertex));
            if let Some((_, &vertex)) = repeated {
                return Err(MeshError::RepeatedVertex { cell: Cell::Other(block.kind, i), vertex });
            }
        }
    }
    Ok(())
}

/// Checks that elements have positive volume, are not folded and occur once.
pub(super) fn check(mesh: &Mesh) -> Result<(), MeshError> {
    let Some(block) = mesh.block() else { return Ok(()) };
    block.kind.visit(Shapes { mesh, block })?;
    let mut sorted: Vec<(Vec<u32>, usize)> = block.cells().map(<[u32]>::to_vec).zip(0..).collect();
    sorted.iter_mut().for_each(|(vertices, _)| vertices.sort_unstable());
    sorted.sort_unstable();
    let repeats = || sorted.windows(2).filter(|pair| pair[0].0 == pair[1].0);
    match repeats().min_by_key(|pair| pair[1].1) {
        None => Ok(()),
        Some(pair) => {
            let cell = Cell::Other(block.kind, pair[1].1);
            Err(MeshError::RepeatedCell { cell, first: pair[0].1, count: repeats().count() })
        }
    }
}

/// For each cell of a block of the mesh's dimension: true if its volume is zero.
pub(crate) fn flat_cells(mesh: &Mesh, block: &CellBlock) -> Vec<bool> {
    block.kind.visit(Flat { mesh, block })
}

struct Flat<'a> {
    mesh: &'a Mesh,
    block: &'a CellBlock,
}

impl CellVisitor for Flat<'_> {
    type Output = Vec<bool>;

    fn visit<const D: usize, const N: usize>(self, kind: &'static Isoparametric<D, N>) -> Vec<bool> {
        let is_flat = |cell: &[u32; N]| {
            let nodes = self.mesh.nodes::<D, N>(cell);
            let relative = kind.volume(&nodes) / longest_edge(&nodes, kind.kind.edges).powi(D as i32);
            relative.is_nan() || relative.abs() <= super::DEGENERATE
        };
        self.block.of::<N>().iter().map(is_flat).collect()
    }
}

/// Cells that are folded at a node but not at a quadrature point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FoldedNodes {
    /// The number of cells.
    pub count: usize,
    /// Index of the most folded cell.
    pub worst: usize,
    /// Smallest `det J` in that cell, as a fraction of its mean.
    pub least: f64,
}

impl Mesh {
    /// Cells of the mesh's dimension that are folded at a node; `None` if there are none.
    pub fn folded_nodes(&self) -> Option<FoldedNodes> {
        let block = self.block().filter(|block| block.kind.dimension == self.dimension)?;
        let least = block.kind.visit(LeastJacobians { mesh: self, block });
        let folded = || least.iter().enumerate().filter(|(_, least)| **least <= 0.0);
        let (worst, least) = folded().min_by(|a, b| a.1.total_cmp(b.1))?;
        Some(FoldedNodes { count: folded().count(), worst, least: *least })
    }
}

struct LeastJacobians<'a> {
    mesh: &'a Mesh,
    block: &'a CellBlock,
}

impl CellVisitor for LeastJacobians<'_> {
    type Output = Vec<f64>;

    fn visit<const D: usize, const N: usize>(self, kind: &'static Isoparametric<D, N>) -> Vec<f64> {
        let cells = self.block.of::<N>().iter();
        cells.map(|cell| kind.least_jacobian(&self.mesh.nodes::<D, N>(cell))).collect()
    }
}

struct Shapes<'a> {
    mesh: &'a Mesh,
    block: &'a CellBlock,
}

impl CellVisitor for Shapes<'_> {
    type Output = Result<(), MeshError>;

    fn visit<const D: usize, const N: usize>(self, kind: &'static Isoparametric<D, N>) -> Self::Output {
        for (i, cell) in self.block.of::<N>().iter().enumerate() {
            let nodes = self.mesh.nodes::<D, N>(cell);
            let (volume, size) = (kind.volume(&nodes), longest_edge(&nodes, kind.kind.edges));
            let cell = Cell::Other(kind.kind, i);
            let relative = volume / size.powi(D as i32);
            if relative.is_nan() || relative.abs() <= super::DEGENERATE {
                return Err(MeshError::Degenerate { cell, volume, size });
            }
            // Bilinear cells may fold at a corner, where nothing is evaluated; curved sides must not
            // fold.
            let least = if kind.kind.order() == 1 {
                kind.least_at_points(&nodes)
            } else {
                kind.least_jacobian(&nodes)
            };
            if relative < 0.0 {
                return Err(MeshError::Inverted { cell, volume, size });
            }
            if least.is_nan() || least <= 0.0 {
                return Err(MeshError::FoldedCell { cell, least });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use crate::error::MeshError;
    use crate::test_support::build_inline;

    /// A unit square whose last corner is moved along its diagonal to `at`.
    fn drawn(at: f64) -> Result<crate::Mesh, MeshError> {
        let points = serde_json::json!([[0.0, 0.0], [1.0, 0.0], [at, at], [0.0, 1.0]]);
        let spec = serde_json::json!({ "points": points, "quadrilaterals": [[0, 1, 2, 3]] });
        build_inline(&serde_json::from_value(spec).unwrap(), 2)
    }

    // At 1/2 the angle is 180 degrees. The corner's `det J` is `(2 at - 1) / at` of the mean; at the
    // nearest quadrature point it is 0.29 of the mean for 0.45 and -0.73 for 0.25.
    #[test]
    fn cells_folded_at_a_corner_alone_are_counted_and_those_folded_inside_refused() {
        assert_eq!(drawn(0.51).unwrap().folded_nodes(), None);
        let folded = drawn(0.45).unwrap().folded_nodes().unwrap();
        assert_eq!((folded.count, folded.worst), (1, 0));
        assert!((folded.least - (2.0 * 0.45 - 1.0) / 0.45).abs() < 1e-12, "{folded:?}");
        assert!(matches!(drawn(0.25), Err(MeshError::FoldedCell { least, .. }) if least < 0.0));
    }
}
