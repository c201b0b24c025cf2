//! A box of cells.

use super::build::{at_least_one, positive, vector};
use super::{Mesh, MeshError, MeshSize};
use crate::spec::GridSpec;
use pliant::element::CellBlock;

/// Corners `(i, j, k)` of the six tetrahedra of Kuhn's split, as offsets from the cell's lower corner.
/// All contain the diagonal from (0, 0, 0) to (1, 1, 1), so that neighbouring cells match without
/// alternating; all have positive volume.
const KUHN: [[[usize; 3]; 4]; 6] = [
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 1]],
    [[0, 0, 0], [1, 1, 0], [0, 1, 0], [1, 1, 1]],
    [[0, 0, 0], [0, 1, 0], [0, 1, 1], [1, 1, 1]],
    [[0, 0, 0], [0, 1, 1], [0, 0, 1], [1, 1, 1]],
    [[0, 0, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1]],
    [[0, 0, 0], [1, 0, 1], [1, 0, 0], [1, 1, 1]],
];

/// The two triangles of a 2D cell, split along the diagonal from (0, 0) to (1, 1).
const HALVES: [[[usize; 2]; 3]; 2] = [[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]];

/// Counts of the grid; rejects an invalid specification.
pub(super) fn size(spec: &GridSpec, dimension: usize) -> Result<MeshSize, MeshError> {
    if spec.cells.len() != dimension {
        return Err(MeshError::Components { field: "cells", expected: dimension, found: spec.cells.len() });
    }
    spec.cells.iter().try_for_each(|&count| at_least_one("cells", count))?;
    let product = |extra: u64| {
        spec.cells.iter().fold(1_u64, |all, &count| all.saturating_mul((count as u64).saturating_add(extra)))
    };
    let cells = product(0);
    if let Some(kind) = spec.cell_kind() {
        if kind.dimension != dimension {
            let (found, other) = (kind.name, if dimension == 2 { "quadrilateral" } else { "hexahedron" });
            return Err(MeshError::WrongElement { found, dimension, other });
        }
        let size = MeshSize {
            vertices: product(1),
            blocks: cells,
            block_nodes: kind.nodes as u64,
            ..MeshSize::default()
        };
        return size.checked(dimension);
    }
    let (triangles, tetrahedra) =
        if dimension == 2 { (cells.saturating_mul(2), 0) } else { (0, cells.saturating_mul(6)) };
    MeshSize { vertices: product(1), triangles, tetrahedra, ..MeshSize::default() }.checked(dimension)
}

/// Builds the grid. Vertex `(i, j, k)` has index `(i (ny + 1) + j) (nz + 1) + k` and lies at
/// `origin + spacing (i, j, k)` or at `origin + size (i/nx, j/ny, k/nz)`. A 2D cell is split into
/// `(i,j) (i+1,j) (i+1,j+1)` and `(i,j) (i+1,j+1) (i,j+1)`, a 3D cell into the six tetrahedra of `KUHN`;
/// if `element` names a whole cell, it is not split. Cells are in the order of their lower corners.
pub(super) fn build(spec: &GridSpec, dimension: usize) -> Result<Mesh, MeshError> {
    let size = size(spec, dimension)?;
    let origin = spec.origin.clone().unwrap_or_else(|| vec![0.0; dimension]);
    vector("origin", &origin, dimension)?;
    match (&spec.spacing, &spec.size) {
        (Some(spacing), None) => positive("spacing", *spacing)?,
        (None, Some(size)) => {
            vector("size", size, dimension)?;
            size.iter().try_for_each(|&value| positive("size", value))?;
        }
        (spacing, _) => return Err(MeshError::SpacingOrSize { both: spacing.is_some() }),
    }
    let coordinate = |axis: usize, i: usize| {
        let i = i as f64;
        origin[axis]
            + match (&spec.spacing, &spec.size) {
                (Some(spacing), _) => i * spacing,
                (None, Some(size)) => i / spec.cells[axis] as f64 * size[axis],
                (None, None) => 0.0,
            }
    };
    let mut mesh = Mesh { dimension, ..Mesh::default() };
    size.reserve(&mut mesh.points, size.vertices * dimension as u64)?;
    size.reserve(&mut mesh.triangles, size.triangles)?;
    size.reserve(&mut mesh.tetrahedra, size.tetrahedra)?;
    let mut whole = spec.cell_kind().map(|kind| CellBlock { kind, vertices: vec![] });
    if let Some(block) = &mut whole {
        size.reserve(&mut block.vertices, size.blocks * size.block_nodes)?;
    }
    // A 2D grid is a 3D grid with a single layer of vertices.
    let [nx, ny, nz] = [spec.cells[0], spec.cells[1], spec.cells.get(2).copied().unwrap_or(0)];
    let index = |i: usize, j: usize, k: usize| ((i * (ny + 1) + j) * (nz + 1) + k) as u32;
    for i in 0..=nx {
        for j in 0..=ny {
            for k in 0..=nz {
                let lattice = [i, j, k];
                mesh.points.extend((0..dimension).map(|axis| coordinate(axis, lattice[axis])));
            }
        }
    }
    // Cells: whole ones, triangles or tetrahedra.
    for i in 0..nx {
        for j in 0..ny {
            if let Some(block) = &mut whole {
                let layers = if dimension == 2 { 0..1 } else { 0..nz };
                let around = [[0, 0], [1, 0], [1, 1], [0, 1]];
                for k in layers {
                    for c in (0..dimension - 1).take(block.kind.nodes / 4) {
                        block.vertices.extend(around.map(|[a, b]| index(i + a, j + b, k + c)));
                    }
                }
                continue;
            }
            if dimension == 2 {
                mesh.triangles.extend(HALVES.map(|half| half.map(|[a, b]| index(i + a, j + b, 0))));
            }
            for k in 0..nz {
                mesh.tetrahedra.extend(KUHN.map(|tet| tet.map(|[a, b, c]| index(i + a, j + b, k + c))));
            }
        }
    }
    mesh.blocks.extend(whole);
    Ok(mesh)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spec::WholeCell;
    use crate::test_support::{build_grid, grid};

    #[test]
    fn a_plane_cell_is_split_along_its_rising_diagonal() {
        let mesh = build_grid(&grid(&[2, 1], 0.5), 2).unwrap();
        assert_eq!(mesh.points, [0.0, 0.0, 0.0, 0.5, 0.5, 0.0, 0.5, 0.5, 1.0, 0.0, 1.0, 0.5]);
        assert_eq!(mesh.triangles, [[0, 2, 3], [0, 3, 1], [2, 4, 5], [2, 5, 3]]);
        assert_eq!(mesh.element_count(), 4);
    }

    /// Whole cells have the vertices of their simplices; mirrored and repeated they keep a positive
    /// volume.
    #[test]
    fn whole_cells_fill_the_box_mirrored_and_repeated_too() {
        for (cells, element) in
            [(&[3, 2][..], WholeCell::Quadrilateral), (&[3, 2, 2][..], WholeCell::Hexahedron)]
        {
            let spec = GridSpec { element: Some(element), ..grid(cells, 0.5) };
            let d = cells.len();
            let body = crate::spec::BodyMesh {
                shape: &crate::spec::MeshSpec::Grid(spec.clone()),
                transform: Some(&crate::spec::TransformSpec {
                    scale: Some(pliant::value::OneOrMany::Many([-1.0, 1.0, 1.0][..d].to_vec())),
                    ..Default::default()
                }),
                repeat: Some(&crate::spec::RepeatSpec { count: vec![2; d], spacing: vec![9.0; d] }),
                order: crate::spec::CellOrder::Linear,
                refine: 0,
            };
            let mesh = crate::build_body(&body, d, ".".as_ref()).unwrap();
            let count = cells.iter().product::<usize>() << d;
            assert_eq!((mesh.element_count(), mesh.contents().pieces), (count, 1 << d));
            let quality = mesh.quality().elements.unwrap();
            assert!((quality.total_volume - count as f64 * 0.5f64.powi(d as i32)).abs() < 1e-12);
            assert!((quality.worst_mean_ratio - 1.0).abs() < 1e-12);
            assert!((mesh.lumped_measure().iter().sum::<f64>() - quality.total_volume).abs() < 1e-12);
            let simplices = build_grid(&grid(cells, 0.5), d).unwrap();
            assert_eq!(build_grid(&spec, d).unwrap().points, simplices.points);
            let size = size(&spec, d).unwrap();
            let one = build_grid(&spec, d).unwrap();
            let bytes = size_of_val(&one.points[..]) + size_of_val(&one.blocks[0].vertices[..]);
            assert_eq!((size.bytes, size.blocks), (bytes as u64, one.element_count() as u64));
            let wrong = build_grid(&GridSpec { cells: vec![1; 5 - d], ..spec }, 5 - d);
            assert!(matches!(wrong, Err(MeshError::WrongElement { .. })));
        }
    }

    #[test]
    fn vertices_are_numbered_with_the_last_axis_fastest() {
        let spec = GridSpec { origin: Some(vec![1.0, 2.0, 3.0]), ..grid(&[2, 3, 4], 0.25) };
        let mesh = build_grid(&spec, 3).unwrap();
        for (i, j, k) in [(0, 0, 0), (1, 2, 3), (2, 3, 4), (2, 0, 1)] {
            let expected = [1.0 + 0.25 * i as f64, 2.0 + 0.25 * j as f64, 3.0 + 0.25 * k as f64];
            assert_eq!(mesh.point((i * 4 + j) * 5 + k), expected);
        }
    }

    #[test]
    fn a_space_cell_is_split_into_the_six_kuhn_tetrahedra() {
        let mesh = build_grid(&grid(&[1, 1, 1], 1.0), 3).unwrap();
        // Vertex 4 i + 2 j + k; every tetrahedron holds 0 and 7.
        assert_eq!(
            mesh.tetrahedra,
            [[0, 4, 6, 7], [0, 6, 2, 7], [0, 2, 3, 7], [0, 3, 1, 7], [0, 1, 5, 7], [0, 5, 4, 7]]
        );
        for &tetrahedron in &mesh.tetrahedra {
            let m = crate::geometry::measure(&mesh.points, 3, tetrahedron);
            assert_eq!(m.volume, 1.0 / 6.0);
        }
    }

    #[test]
    fn the_size_is_reached_exactly_and_filled() {
        let spec = GridSpec {
            cells: vec![3, 5, 7],
            size: Some(vec![0.3, 0.7, 1.1]),
            origin: Some(vec![-1.0, 0.0, 2.0]),
            spacing: None,
            element: None,
        };
        let mesh = build_grid(&spec, 3).unwrap();
        assert_eq!(mesh.bounding_box(), (vec![-1.0, 0.0, 2.0], vec![-1.0 + 0.3, 0.7, 2.0 + 1.1]));
        let volume: f64 =
            mesh.tetrahedra.iter().map(|&t| crate::geometry::measure(&mesh.points, 3, t).volume).sum();
        assert!((volume / (0.3 * 0.7 * 1.1) - 1.0).abs() < 1e-13, "{volume}");
    }

    #[test]
    fn faults_of_the_specification_are_told_apart() {
        let error = |spec: GridSpec, dimension| build_grid(&spec, dimension).unwrap_err();
        let cells = |cells: &[usize]| grid(cells, 1.0);
        assert!(matches!(
            error(cells(&[1, 1]), 3),
            MeshError::Components { field: "cells", expected: 3, found: 2 }
        ));
        assert!(matches!(error(cells(&[1, 0]), 2), MeshError::ZeroCount { field: "cells" }));
        assert!(matches!(
            error(grid(&[1, 1], -1.0), 2),
            MeshError::NotPositive { field: "spacing", value: -1.0 }
        ));
        assert!(matches!(error(grid(&[1, 1], f64::NAN), 2), MeshError::NotFinite { field: "spacing", .. }));
        let both = GridSpec { size: Some(vec![1.0, 1.0]), ..cells(&[1, 1]) };
        assert!(matches!(error(both.clone(), 2), MeshError::SpacingOrSize { both: true }));
        assert!(matches!(
            error(GridSpec { spacing: None, size: None, ..both.clone() }, 2),
            MeshError::SpacingOrSize { both: false }
        ));
        let flat = GridSpec { spacing: None, size: Some(vec![1.0, 0.0]), ..both };
        assert!(matches!(error(flat, 2), MeshError::NotPositive { field: "size", value: 0.0 }));
        let origin = GridSpec { origin: Some(vec![0.0; 3]), ..cells(&[1, 1]) };
        assert!(matches!(error(origin, 2), MeshError::Components { field: "origin", expected: 2, found: 3 }));
        assert!(matches!(error(cells(&[1, 1]), 4), MeshError::Dimension { dimension: 4 }));
        assert!(matches!(
            error(cells(&[usize::MAX; 3]), 3),
            MeshError::TooMany { what: "vertices", count: u64::MAX }
        ));
        assert!(matches!(
            error(cells(&[1_000_000_000, 3]), 2),
            MeshError::TooMany { what: "triangles", count: 6_000_000_000 }
        ));
    }
}
