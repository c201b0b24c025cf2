//! Edges and boundaries, found by sorting, so that the result does not depend on hashes.

use rayon::prelude::*;

use super::Mesh;
use super::facets::for_each_equal;
use pliant::element::CellBlock;

/// Corners of the faces of a positive tetrahedron, each counter-clockwise seen from outside.
const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// Appends the edges of simplices with `N` vertices, both ends ascending.
fn append_edges<const N: usize>(edges: &mut Vec<[u32; 2]>, cells: &[[u32; N]]) {
    for cell in cells {
        for a in 0..N {
            for b in a + 1..N {
                edges.push([cell[a].min(cell[b]), cell[a].max(cell[b])]);
            }
        }
    }
}

/// Facets that occur once among `count` by their vertices, in the original order.
fn unpaired<const N: usize>(count: usize, facet: impl Fn(usize) -> [u32; N]) -> Vec<[u32; N]> {
    let key = |i: usize| {
        let mut key = facet(i);
        key.sort_unstable();
        key
    };
    let mut once: Vec<u32> = vec![];
    for_each_equal(count, key, |run| {
        if let [single] = run {
            once.push(*single);
        }
    });
    once.sort_unstable();
    once.into_iter().map(|i| facet(i as usize)).collect()
}

/// Index of the first cell with the same vertices in any order, for each cell. Cells not marked by `of`
/// represent themselves only. An empty `of` marks all.
pub(super) fn firsts<const N: usize>(cells: &[[u32; N]], of: &[bool]) -> Vec<u32> {
    let key = |(i, cell): (u32, &[u32; N])| {
        let mut key = *cell;
        key.sort_unstable();
        (key, i)
    };
    let counts = |i: &u32| of.get(*i as usize).is_none_or(|&of| of);
    let mut keys: Vec<([u32; N], u32)> = (0..).zip(cells).map(key).filter(|(_, i)| counts(i)).collect();
    keys.par_sort_unstable();
    let mut firsts: Vec<u32> = (0..cells.len() as u32).collect();
    for run in keys.chunk_by(|a, b| a.0 == b.0) {
        run.iter().for_each(|(_, i)| firsts[*i as usize] = run[0].1);
    }
    firsts
}

/// Edges that belong to a single triangle, in that triangle's direction: none for a closed surface.
pub(super) fn open_edges(triangles: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let side = |i: usize| [triangles[i / 3][i % 3], triangles[i / 3][(i + 1) % 3]];
    unpaired(3 * triangles.len(), side)
}

impl Mesh {
    /// Edges of the elements, each once: `[lower index, higher index]`, in lexicographic order. They
    /// become springs in a mesh without explicit [`edges`](Mesh::edges); in a mesh of edges only, these
    /// are returned.
    pub fn unique_edges(&self) -> Vec<[u32; 2]> {
        let mut edges = Vec::new();
        if let Some(block) = self.block() {
            edges.extend(block.edges());
        }
        match self.element_dimension() {
            3 => append_edges(&mut edges, &self.tetrahedra),
            2 => append_edges(&mut edges, &self.triangles),
            1 => append_edges(&mut edges, &self.edges),
            _ => {}
        }
        edges.sort_unstable();
        edges.dedup();
        edges
    }

    /// Edges between two triangles, each with the opposite vertices:
    /// `[a, b, of the triangle with direction a to b, of the other]`, by ascending `(min, max)` of the
    /// edge.
    ///
    /// # Errors
    /// An edge of more than two triangles, or of two triangles with opposite orientations.
    pub fn hinges(&self) -> Result<Vec<[u32; 4]>, String> {
        // (lower, higher, runs from lower to higher, opposite)
        let mut sides: Vec<(u32, u32, bool, u32)> = vec![];
        for &[a, b, c] in &self.triangles {
            for [from, to, opposite] in [[a, b, c], [b, c, a], [c, a, b]] {
                sides.push((from.min(to), from.max(to), from < to, opposite));
            }
        }
        sides.sort_unstable();
        let mut hinges = vec![];
        for side in sides.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            let (low, high) = (side[0].0, side[0].1);
            match side {
                [_] => {}
                [(.., false, backward), (.., true, forward)] => hinges.push([low, high, *forward, *backward]),
                [_, _] => {
                    return Err(format!(
                        "the two triangles at the edge from vertex {low} to {high} have opposite \
                         orientations; in a file, `orient = true` next to `path` turns one of them"
                    ));
                }
                more => {
                    return Err(format!(
                        "{} triangles meet at the edge from vertex {low} to {high}: it cannot be bent",
                        more.len()
                    ));
                }
            }
        }
        Ok(hinges)
    }

    /// Surface of a solid: faces that belong to a single tetrahedron, counter-clockwise seen from
    /// outside, in the order of the tetrahedra. A mesh without tetrahedra returns its triangles.
    /// Quadrilaterals, also those of hexahedra, are split in two.
    pub fn surface_triangles(&self) -> Vec<[u32; 3]> {
        if let Some(block) = self.block() {
            let halves = |[a, b, c, d]: [u32; 4]| [[a, b, c], [a, c, d]];
            return self.quadrilaterals(block).into_iter().flat_map(halves).collect();
        }
        if self.tetrahedra.is_empty() {
            return self.triangles.clone();
        }
        let face = |i: usize| FACES[i % 4].map(|corner| self.tetrahedra[i / 4][corner]);
        unpaired(4 * self.tetrahedra.len(), face)
    }

    /// Surface quadrilaterals of a block, counter-clockwise seen from outside; all cells if they are
    /// plane. Second-order ones are given by their corners.
    pub(super) fn quadrilaterals(&self, block: &CellBlock) -> Vec<[u32; 4]> {
        if block.kind.dimension == 2 {
            block.of_first_order().of::<4>().to_vec()
        } else {
            let sides: Vec<[u32; 4]> = block.sides().collect();
            unpaired(sides.len(), |i| sides[i])
        }
    }

    /// Boundary edges: edges of a single triangle of [`surface_triangles`](Mesh::surface_triangles), in
    /// the triangle's direction. They are the outline of a plane mesh, counter-clockwise, or the hem of a
    /// cloth; a closed surface, as of a solid, has none.
    pub fn boundary_edges(&self) -> Vec<[u32; 2]> {
        open_edges(&self.surface_triangles())
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::spec::{GridSpec, MeshSpec, StrandSpec};
    use crate::test_support::{build_grid, grid};

    #[test]
    fn edges_are_unique_sorted_and_as_many_as_euler_says() {
        let mesh = build_grid(&grid(&[3, 2], 1.0), 2).unwrap();
        let edges = mesh.unique_edges();
        // V - E + F = 1 for a disk.
        assert_eq!(edges.len(), mesh.vertex_count() + mesh.triangles.len() - 1);
        assert!(edges.is_sorted() && edges.iter().all(|[a, b]| a < b));
        assert_eq!(edges[..3], [[0, 1], [0, 3], [0, 4]]);

        let mesh = build_grid(&grid(&[2, 3, 4], 1.0), 3).unwrap();
        // Kuhn: three families of edges, three of face diagonals, one of body diagonals.
        let (x, y, z) = (2, 3, 4);
        let along = x * (y + 1) * (z + 1) + (x + 1) * y * (z + 1) + (x + 1) * (y + 1) * z;
        let diagonals = x * y * (z + 1) + x * (y + 1) * z + (x + 1) * y * z;
        assert_eq!(mesh.unique_edges().len(), along + diagonals + x * y * z);
    }

    #[test]
    fn edges_of_a_strand_are_its_segments() {
        let spec = StrandSpec { segments: 2, start: vec![0.0, 0.0], end: vec![1.0, 0.0] };
        let mut mesh = crate::build(&MeshSpec::Strand(spec), 2, Path::new(".")).unwrap();
        mesh.edges = vec![[2, 1], [1, 0], [0, 1]];
        assert_eq!(mesh.unique_edges(), [[0, 1], [1, 2]]);
        assert!(mesh.surface_triangles().is_empty() && mesh.boundary_edges().is_empty());
    }

    /// An outward surface encloses the volume of its solid, by the divergence theorem.
    #[test]
    fn the_surface_of_a_solid_is_closed_and_points_outwards() {
        let mesh = build_grid(&grid(&[2, 3, 4], 0.5), 3).unwrap();
        let surface = mesh.surface_triangles();
        assert_eq!(surface.len(), 2 * 2 * (2 * 3 + 3 * 4 + 4 * 2));
        assert!(mesh.boundary_edges().is_empty());
        assert_eq!(enclosed(&mesh.points, &surface), 24.0 * 0.125);
        // The origin is outside, so that every face contributes.
        let spec = GridSpec { origin: Some(vec![1.0, 2.0, 4.0]), ..grid(&[1, 1, 1], 1.0) };
        let single = build_grid(&spec, 3).unwrap();
        let one = crate::Mesh { tetrahedra: vec![single.tetrahedra[0]], ..single };
        assert_eq!(one.surface_triangles().len(), 4);
        assert!((enclosed(&one.points, &one.surface_triangles()) - 1.0 / 6.0).abs() < 1e-14);
    }

    fn enclosed(points: &[f64], surface: &[[u32; 3]]) -> f64 {
        let x = |i: u32| [points[3 * i as usize], points[3 * i as usize + 1], points[3 * i as usize + 2]];
        let volume = |[a, b, c]: [[f64; 3]; 3]| {
            a[0] * (b[1] * c[2] - b[2] * c[1])
                + a[1] * (b[2] * c[0] - b[0] * c[2])
                + a[2] * (b[0] * c[1] - b[1] * c[0])
        };
        surface.iter().map(|triangle| volume(triangle.map(x)) / 6.0).sum()
    }

    #[test]
    fn the_outline_of_a_plane_mesh_runs_counter_clockwise() {
        let mesh = build_grid(&grid(&[3, 2], 1.0), 2).unwrap();
        let outline = mesh.boundary_edges();
        assert_eq!(outline.len(), 10);
        let area: f64 = outline
            .iter()
            .map(|&[a, b]| {
                let (a, b) = (mesh.point(a as usize), mesh.point(b as usize));
                (a[0] * b[1] - a[1] * b[0]) / 2.0
            })
            .sum();
        assert_eq!(area, 6.0);
    }
}
