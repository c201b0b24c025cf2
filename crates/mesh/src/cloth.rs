//! A rectangular sheet: triangles, and springs along the sides and both diagonals of every cell.

use super::build::{at_least_one, vector};
use super::{Mesh, MeshError, MeshSize};
use crate::spec::ClothSpec;

/// Counts of the sheet.
pub(super) fn size(spec: &ClothSpec, dimension: usize) -> Result<MeshSize, MeshError> {
    spec.cells.iter().try_for_each(|&count| at_least_one("cells", count))?;
    let [n0, n1] = spec.cells.map(|count| count as u64);
    let cells = n0.saturating_mul(n1);
    let triangles = cells.saturating_mul(2);
    // n0 (n1 + 1) along u, (n0 + 1) n1 along v, two diagonals per cell.
    let edges = cells.saturating_mul(4).saturating_add(n0).saturating_add(n1);
    let vertices = n0.saturating_add(1).saturating_mul(n1.saturating_add(1));
    MeshSize { vertices, edges, triangles, ..MeshSize::default() }.checked(dimension)
}

/// Builds the sheet. Vertex `(i, j)` has index `i (n1 + 1) + j` and lies at `origin + i/n0 u + j/n1 v`;
/// cells are split as in a grid.
///
/// Edges are listed by vertex in index order; those of vertex `(i, j)` are, where they exist: to
/// `(i+1, j)`, to `(i, j+1)`, to `(i+1, j+1)`, and the other diagonal `(i+1, j)` to `(i, j+1)`.
pub(super) fn build(spec: &ClothSpec, dimension: usize) -> Result<Mesh, MeshError> {
    let size = size(spec, dimension)?;
    for (field, value) in [("origin", &spec.origin), ("u", &spec.u), ("v", &spec.v)] {
        vector(field, value, dimension)?;
    }
    sides(&spec.u, &spec.v, dimension)?;
    let mut mesh = Mesh { dimension, ..Mesh::default() };
    size.reserve(&mut mesh.points, size.vertices * dimension as u64)?;
    size.reserve(&mut mesh.edges, size.edges)?;
    size.reserve(&mut mesh.triangles, size.triangles)?;
    let [n0, n1] = spec.cells;
    let index = |i: usize, j: usize| (i * (n1 + 1) + j) as u32;
    for i in 0..=n0 {
        for j in 0..=n1 {
            let (a, b) = (i as f64 / n0 as f64, j as f64 / n1 as f64);
            mesh.points
                .extend((0..dimension).map(|axis| spec.origin[axis] + a * spec.u[axis] + b * spec.v[axis]));
            if i < n0 {
                mesh.edges.push([index(i, j), index(i + 1, j)]);
            }
            if j < n1 {
                mesh.edges.push([index(i, j), index(i, j + 1)]);
            }
            if i < n0 && j < n1 {
                mesh.edges.push([index(i, j), index(i + 1, j + 1)]);
                mesh.edges.push([index(i + 1, j), index(i, j + 1)]);
                mesh.triangles.push([index(i, j), index(i + 1, j), index(i + 1, j + 1)]);
                mesh.triangles.push([index(i, j), index(i + 1, j + 1), index(i, j + 1)]);
            }
        }
    }
    Ok(mesh)
}

/// Rejects sides that span no area, and in 2D a clockwise pair.
fn sides(u: &[f64], v: &[f64], dimension: usize) -> Result<(), MeshError> {
    let mut corner = vec![0.0; dimension];
    corner.extend_from_slice(u);
    corner.extend_from_slice(v);
    let measure = super::geometry::measure(&corner, dimension, [0, 1, 2]);
    if measure.relative.is_nan() || measure.relative.abs() <= super::check::DEGENERATE {
        Err(MeshError::ParallelSides)
    } else if measure.relative < 0.0 {
        Err(MeshError::ClockwiseSides)
    } else {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::spec::MeshSpec;

    fn sheet(u: &[f64], v: &[f64]) -> ClothSpec {
        ClothSpec { cells: [2, 1], origin: vec![1.0; u.len()], u: u.to_vec(), v: v.to_vec() }
    }

    fn built(spec: ClothSpec) -> Result<Mesh, MeshError> {
        let dimension = spec.origin.len();
        crate::build(&MeshSpec::Cloth(spec), dimension, Path::new("."))
    }

    #[test]
    fn every_cell_has_sides_and_both_diagonals() {
        let mesh = built(sheet(&[4.0, 0.0, 0.0], &[0.0, 0.0, 3.0])).unwrap();
        assert_eq!(mesh.point(3), [3.0, 1.0, 4.0]);
        assert_eq!(
            mesh.edges,
            [[0, 2], [0, 1], [0, 3], [2, 1], [1, 3], [2, 4], [2, 3], [2, 5], [4, 3], [3, 5], [4, 5]]
        );
        assert_eq!(mesh.triangles, [[0, 2, 3], [0, 3, 1], [2, 4, 5], [2, 5, 3]]);
    }

    #[test]
    fn faults_of_the_specification_are_told_apart() {
        let error = |u: &[f64], v: &[f64]| built(sheet(u, v)).unwrap_err();
        assert!(matches!(error(&[1.0, 1.0, 0.0], &[2.0, 2.0, 0.0]), MeshError::ParallelSides));
        assert!(matches!(error(&[0.0, 0.0, 0.0], &[2.0, 2.0, 0.0]), MeshError::ParallelSides));
        assert!(matches!(error(&[0.0, 1.0], &[1.0, 0.0]), MeshError::ClockwiseSides));
        assert!(built(sheet(&[1.0, 0.0], &[0.0, 1.0])).is_ok());
        assert!(matches!(
            error(&[0.0, 1.0], &[1.0]),
            MeshError::Components { field: "v", expected: 2, found: 1 }
        ));
        let none = ClothSpec { cells: [1, 0], ..sheet(&[1.0, 0.0], &[0.0, 1.0]) };
        assert!(matches!(built(none).unwrap_err(), MeshError::ZeroCount { field: "cells" }));
    }
}
