//! Solids extruded from a plane mesh along z.

use super::mapped::add_triangles;
use super::{Mesh, MeshError, MeshSize};

/// Counts of the extruded solid, from those of its base.
pub(super) fn size(base: &MeshSize, layers: usize) -> Result<MeshSize, MeshError> {
    let layers = layers as u64;
    let sides = base.lines.saturating_mul(layers).saturating_mul(2);
    MeshSize {
        vertices: base.vertices.saturating_mul(layers.saturating_add(1)),
        triangles: sides.saturating_add(base.triangles.saturating_mul(2)),
        tetrahedra: base.triangles.saturating_mul(layers).saturating_mul(3),
        ..MeshSize::default()
    }
    .checked(3)
}

/// Extrudes `base` from `z` to `z + height` in `layers` layers of prisms, each split into three
/// tetrahedra. Vertex `i` of the base has index `k n + i` in layer `k`. Line groups of the base
/// (counter-clockwise outline) become groups of the sides above them; the groups `bottom` and `top` are
/// added. Their triangles face outwards.
pub(super) fn build(base: &Mesh, layers: usize, z: f64, height: f64) -> Result<Mesh, MeshError> {
    let plane = MeshSize {
        vertices: base.vertex_count() as u64,
        triangles: base.triangles.len() as u64,
        lines: base.lines.len() as u64,
        ..MeshSize::default()
    };
    let size = size(&plane, layers)?;
    let mut mesh = Mesh { dimension: 3, ..Mesh::default() };
    size.reserve(&mut mesh.points, size.vertices * 3)?;
    size.reserve(&mut mesh.triangles, size.triangles)?;
    size.reserve(&mut mesh.tetrahedra, size.tetrahedra)?;
    for layer in 0..=layers {
        let above = z + layer as f64 / layers as f64 * height;
        base.points.chunks_exact(2).for_each(|x| mesh.points.extend([x[0], x[1], above]));
    }
    let count = base.vertex_count() as u32;
    for layer in 0..layers as u32 {
        let at = |vertex: u32, up: u32| (layer + up) * count + vertex;
        for triangle in &base.triangles {
            mesh.tetrahedra.extend(prism(triangle).map(|tet| tet.map(|(vertex, up)| at(vertex, up))));
        }
    }
    for (name, group) in &base.groups {
        let sides = (0..layers as u32).flat_map(|layer| {
            let at = move |(vertex, up): (u32, u32)| (layer + up) * count + vertex;
            let lines = group.cells.iter().map(|&line| base.lines[line as usize]);
            lines.flat_map(move |line| side(line).map(|triangle| triangle.map(at)))
        });
        add_triangles(&mut mesh, name, sides);
    }
    let last = layers as u32 * count;
    add_triangles(&mut mesh, "bottom", base.triangles.iter().map(|&[a, b, c]| [a, c, b]));
    add_triangles(&mut mesh, "top", base.triangles.iter().map(|cell| cell.map(|vertex| last + vertex)));
    Ok(mesh)
}

/// The three tetrahedra of the prism over a triangle; the second number of a vertex is 0 for the lower
/// and 1 for the upper layer. The diagonals of the sides rise from the lower index to the higher, so that
/// neighbouring prisms match.
fn prism(triangle: &[u32; 3]) -> [[(u32, u32); 4]; 3] {
    let mut sorted = *triangle;
    sorted.sort_unstable();
    let [a, b, c] = sorted;
    let turns = (0..3).any(|i| [triangle[i], triangle[(i + 1) % 3], triangle[(i + 2) % 3]] == sorted);
    let mut cells = [
        [(a, 0), (b, 0), (c, 0), (c, 1)],
        [(a, 0), (b, 0), (c, 1), (b, 1)],
        [(a, 0), (a, 1), (b, 1), (c, 1)],
    ];
    if !turns {
        cells.iter_mut().for_each(|cell| cell.swap(2, 3));
    }
    cells
}

/// The two triangles of the side over a line, with the diagonal of [`prism`].
fn side([a, b]: [u32; 2]) -> [[(u32, u32); 3]; 2] {
    if a < b {
        [[(a, 0), (b, 0), (b, 1)], [(a, 0), (b, 1), (a, 1)]]
    } else {
        [[(a, 0), (b, 0), (a, 1)], [(b, 0), (b, 1), (a, 1)]]
    }
}
