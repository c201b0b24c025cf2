//! Copies of a mesh, side by side in one body.

use super::build::{at_least_one, vector};
use super::{Mesh, MeshError};
use crate::spec::RepeatSpec;

/// Makes `count[0] x count[1] [x count[2]]` copies. Copy `(i, j, k)` is translated by
/// `(i, j, k) spacing`, the last index varies fastest. Copies share no vertices. Vertex `v` of copy `c`
/// has index `c n + v`; a group has its cells of all copies.
pub(super) fn apply(spec: &RepeatSpec, mesh: &mut Mesh) -> Result<(), MeshError> {
    let dimension = mesh.dimension;
    if spec.count.len() != dimension {
        let found = spec.count.len();
        return Err(MeshError::Components { field: "count", expected: dimension, found });
    }
    spec.count.iter().try_for_each(|&count| at_least_one("count", count))?;
    vector("spacing", &spec.spacing, dimension)?;
    if (0..dimension).any(|axis| spec.count[axis] > 1 && spec.spacing[axis] == 0.0) {
        return Err(MeshError::Zero { field: "spacing" });
    }
    let copies = spec.copies();
    let vertices = (mesh.vertex_count() as u64).saturating_mul(copies);
    if vertices > u64::from(u32::MAX) {
        return Err(MeshError::TooMany { what: "vertices", count: vertices });
    }
    let one = mesh.clone();
    for copy in 1..copies {
        let mut steps = [0.0; 3];
        let mut rest = copy as usize;
        for axis in (0..dimension).rev() {
            steps[axis] = (rest % spec.count[axis]) as f64 * spec.spacing[axis];
            rest /= spec.count[axis];
        }
        append(mesh, &one, &steps);
    }
    Ok(())
}

/// Appends a copy of a mesh translated by `by`.
fn append(mesh: &mut Mesh, other: &Mesh, by: &[f64; 3]) {
    let first = mesh.vertex_count() as u32;
    let first_element = mesh.element_count() as u32;
    if let (Some(skin), Some(other)) = (&mut mesh.skin, &other.skin) {
        super::skin::append(skin, other, first, first_element);
    }
    for point in other.points.chunks_exact(mesh.dimension) {
        mesh.points.extend(point.iter().zip(by).map(|(x, by)| x + by));
    }
    let cells = [
        0,
        if other.lines.is_empty() { mesh.edges.len() } else { mesh.lines.len() },
        mesh.triangles.len(),
        mesh.tetrahedra.len(),
    ];
    let mut cells = cells;
    for block in &mesh.blocks {
        cells[block.kind.dimension] += block.len();
    }
    for (name, group) in &other.groups {
        let whole = mesh.groups.entry(name.clone()).or_default();
        // The cells of a point group are vertices.
        let dimension = group.topological_dimension.min(3);
        let offset = if dimension == 0 { first } else { cells[dimension] as u32 };
        whole.cells.extend(group.cells.iter().map(|cell| offset + cell));
        whole.vertices.extend(group.vertices.iter().map(|vertex| first + vertex));
    }
    extend(&mut mesh.edges, &other.edges, first);
    extend(&mut mesh.lines, &other.lines, first);
    extend(&mut mesh.triangles, &other.triangles, first);
    extend(&mut mesh.tetrahedra, &other.tetrahedra, first);
    for (block, other) in mesh.blocks.iter_mut().zip(&other.blocks) {
        block.vertices.extend(other.vertices.iter().map(|vertex| first + vertex));
    }
    extend(&mut mesh.triangle_middles, &other.triangle_middles, first);
    extend(&mut mesh.tetrahedron_middles, &other.tetrahedron_middles, first);
}

fn extend<const N: usize>(cells: &mut Vec<[u32; N]>, other: &[[u32; N]], first: u32) {
    cells.extend(other.iter().map(|cell| cell.map(|vertex| first + vertex)));
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::spec::{AnnulusSpec, BallSpec, MeshSpec};
    use crate::test_support::{build_grid, grid};

    fn repeated(mesh: &Mesh, count: &[usize], spacing: &[f64]) -> Result<Mesh, MeshError> {
        let mut mesh = mesh.clone();
        apply(&RepeatSpec { count: count.to_vec(), spacing: spacing.to_vec() }, &mut mesh)?;
        super::super::check::check(&mesh).unwrap();
        Ok(mesh)
    }

    #[test]
    fn copies_are_moved_and_share_nothing() {
        let one = build_grid(&grid(&[2, 1], 0.5), 2).unwrap();
        let many = repeated(&one, &[2, 3], &[2.0, -1.0]).unwrap();
        let n = one.vertex_count();
        assert_eq!((many.vertex_count(), many.triangles.len()), (6 * n, 6 * one.triangles.len()));
        for (copy, [i, j]) in [[0, 0], [0, 1], [0, 2], [1, 0], [1, 1], [1, 2]].into_iter().enumerate() {
            for vertex in 0..n {
                let x = one.point(vertex);
                assert_eq!(many.point(copy * n + vertex), [x[0] + 2.0 * i as f64, x[1] - j as f64]);
            }
            let cell = many.triangles[copy * one.triangles.len()];
            assert_eq!(cell, one.triangles[0].map(|v| v + (copy * n) as u32));
        }
        assert_eq!(many.unique_edges().len(), 6 * one.unique_edges().len());
        assert_eq!(repeated(&one, &[1, 1], &[0.0, 0.0]).unwrap(), one);
    }

    #[test]
    fn groups_hold_their_cells_in_all_copies() {
        let ball = BallSpec { radius: 1.0, cells: 1, centre: None };
        let ball = super::super::build(&MeshSpec::Ball(ball), 3, Path::new(".")).unwrap();
        let three = repeated(&ball, &[1, 1, 3], &[0.0, 0.0, 3.0]).unwrap();
        let surface = &three.groups["surface"];
        assert_eq!((surface.cells.len(), surface.vertices.len()), (60, 36));
        let outwards = three.surface_triangles();
        let mut named: Vec<[u32; 3]> =
            surface.cells.iter().map(|&cell| three.triangles[cell as usize]).collect();
        named.iter_mut().for_each(|cell| cell.sort_unstable());
        assert!(outwards.into_iter().all(|mut cell| {
            cell.sort_unstable();
            named.contains(&cell)
        }));
        let ring =
            AnnulusSpec { inner_radius: 1.0, outer_radius: 2.0, cells: [1, 4], centre: None, element: None };
        let ring = super::super::build(&MeshSpec::Annulus(ring), 2, Path::new(".")).unwrap();
        let two = repeated(&ring, &[2, 1], &[5.0, 0.0]).unwrap();
        let inner = &two.groups["inner"];
        let ends: Vec<u32> = inner.cells.iter().flat_map(|&line| two.lines[line as usize]).collect();
        assert!(ends.iter().all(|v| inner.vertices.contains(v)) && inner.vertices.len() == 8);
    }

    /// Checks a group of the last cell of a kind (`n` per copy): it has the last cell of every copy.
    #[track_caller]
    fn check_group(mut one: Mesh, topological_dimension: usize, count: u32, vertices: &[u32]) {
        let cells = vec![count - 1];
        let group = crate::Group { topological_dimension, cells, vertices: vertices.to_vec() };
        one.groups.insert("last".into(), group);
        let mut counts = vec![1; one.dimension];
        counts[0] = 3;
        let many = repeated(&one, &counts, &vec![9.0; one.dimension]).unwrap();
        let (group, n) = (&many.groups["last"], one.vertex_count() as u32);
        assert_eq!(group.cells, [count - 1, 2 * count - 1, 3 * count - 1]);
        let all: Vec<u32> = (0..3).flat_map(|copy| vertices.iter().map(move |v| copy * n + v)).collect();
        assert_eq!(group.vertices, all);
    }

    // Cells of every dimension are numbered separately: whole cells next to simplices of a lower
    // dimension, lines next to the edges that become springs.
    #[test]
    fn groups_count_cells_of_their_own_kind() {
        let points = vec![0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0];
        let square = Mesh { dimension: 2, points, ..Mesh::default() };
        check_group(square.clone(), 0, 4, &[3]);
        let edges = vec![[0, 1], [1, 2], [2, 3]];
        check_group(Mesh { edges: edges.clone(), ..square.clone() }, 1, 3, &[2, 3]);
        let (lines, triangles) = (vec![[0, 1], [1, 2]], vec![[0, 1, 2], [0, 2, 3]]);
        let filled = Mesh { edges, lines, triangles, ..square };
        check_group(filled.clone(), 0, 4, &[3]);
        check_group(filled.clone(), 1, 2, &[1, 2]);
        check_group(filled, 2, 2, &[0, 2, 3]);
        let whole = |cells: &[usize], element| {
            let spec = crate::spec::GridSpec { element: Some(element), ..grid(cells, 0.5) };
            build_grid(&spec, cells.len()).unwrap()
        };
        let mut quadrilaterals = whole(&[2, 1], crate::spec::WholeCell::Quadrilateral);
        check_group(quadrilaterals.clone(), 2, 2, &[2, 3, 4, 5]);
        quadrilaterals.lines = vec![[0, 2], [2, 4], [4, 5]];
        check_group(quadrilaterals, 1, 3, &[4, 5]);
        let mut hexahedra = whole(&[2, 1, 1], crate::spec::WholeCell::Hexahedron);
        hexahedra.triangles = vec![[0, 1, 2], [1, 3, 2]];
        check_group(hexahedra.clone(), 3, 2, &[4, 5, 6, 7, 8, 9, 10, 11]);
        check_group(hexahedra, 2, 2, &[1, 2, 3]);
        let simplices = build_grid(&grid(&[1, 1, 1], 0.5), 3).unwrap();
        check_group(simplices, 3, 6, &[0, 4, 5, 7]);
    }

    #[test]
    fn faults_are_told_apart() {
        let one = build_grid(&grid(&[1, 1], 0.5), 2).unwrap();
        let fault = |count: &[usize], spacing: &[f64]| repeated(&one, count, spacing).unwrap_err();
        assert!(matches!(fault(&[2], &[1.0, 1.0]), MeshError::Components { field: "count", .. }));
        assert!(matches!(fault(&[2, 0], &[1.0, 1.0]), MeshError::ZeroCount { field: "count" }));
        assert!(matches!(fault(&[2, 1], &[1.0]), MeshError::Components { field: "spacing", .. }));
        assert!(matches!(fault(&[2, 1], &[0.0, 1.0]), MeshError::Zero { field: "spacing" }));
        assert!(matches!(fault(&[1 << 40, 1], &[1.0, 1.0]), MeshError::TooMany { what: "vertices", .. }));
    }
}
