//! Plane meshes that are the image of a rectangle of cells.

use super::{Group, Mesh, MeshError, MeshSize};
use crate::spec::WholeCell;
use pliant::element::CellBlock;

/// The two triangles of a cell, split as in a grid.
const HALVES: [[[usize; 2]; 3]; 2] = [[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]];

/// The corners of a whole cell.
const AROUND: [[usize; 2]; 4] = [[0, 0], [1, 0], [1, 1], [0, 1]];

/// Names of the four sides: first index 0 and last, second index 0 and last.
pub(super) type Sides = [&'static str; 4];

/// Counts of a rectangle of cells; `element` names whole cells.
///
/// # Errors
/// The element is not a plane one; the counts are too large.
pub(super) fn size([n0, n1]: [usize; 2], element: Option<WholeCell>) -> Result<MeshSize, MeshError> {
    let [n0, n1] = [n0 as u64, n1 as u64];
    let cells = n0.saturating_mul(n1);
    let size = MeshSize {
        vertices: n0.saturating_add(1).saturating_mul(n1.saturating_add(1)),
        lines: n0.saturating_add(n1).saturating_mul(2),
        ..MeshSize::default()
    };
    with_cells(size, cells, element)?.checked(2)
}

/// Counts with this number of plane cells.
///
/// # Errors
/// The element is not a plane one.
pub(super) fn with_cells(
    size: MeshSize,
    cells: u64,
    element: Option<WholeCell>,
) -> Result<MeshSize, MeshError> {
    match element.map(WholeCell::kind) {
        None => Ok(MeshSize { triangles: cells.saturating_mul(2), ..size }),
        Some(kind) if kind.dimension == 2 => {
            Ok(MeshSize { blocks: cells, block_nodes: kind.nodes as u64, ..size })
        }
        Some(kind) => {
            let (found, other) = (kind.name, "quadrilateral");
            Err(MeshError::WrongElement { found, dimension: 2, other })
        }
    }
}

/// Builds the mesh. Vertex `(i, j)` has index `i (n1 + 1) + j` and lies at `point(i, j)`; cells are split
/// as in a grid, unless `element` names whole cells. The sides are groups of lines, counter-clockwise
/// about the body.
pub(super) fn build(
    (cells, element): ([usize; 2], Option<WholeCell>),
    sides: Sides,
    point: impl Fn(usize, usize) -> [f64; 2],
) -> Result<Mesh, MeshError> {
    let size = size(cells, element)?;
    let mut mesh = Mesh { dimension: 2, ..Mesh::default() };
    size.reserve(&mut mesh.points, size.vertices * 2)?;
    size.reserve(&mut mesh.triangles, size.triangles)?;
    let [n0, n1] = cells;
    let index = |i: usize, j: usize| (i * (n1 + 1) + j) as u32;
    for i in 0..=n0 {
        for j in 0..=n1 {
            mesh.points.extend(point(i, j));
        }
    }
    let corners = (0..n0).flat_map(|i| (0..n1).map(move |j| [i, j]));
    if let Some(element) = element {
        let mut vertices = vec![];
        size.reserve(&mut vertices, size.blocks * size.block_nodes)?;
        vertices.extend(corners.flat_map(|[i, j]| AROUND.map(|[a, b]| index(i + a, j + b))));
        mesh.blocks.push(CellBlock { kind: element.kind(), vertices });
    } else {
        for [i, j] in corners {
            mesh.triangles.extend(HALVES.map(|half| half.map(|[a, b]| index(i + a, j + b))));
        }
    }
    let [first, last, bottom, top] = sides;
    add_lines(&mut mesh, bottom, (0..n0).map(|i| [index(i, 0), index(i + 1, 0)]));
    add_lines(&mut mesh, last, (0..n1).map(|j| [index(n0, j), index(n0, j + 1)]));
    add_lines(&mut mesh, top, (0..n0).rev().map(|i| [index(i + 1, n1), index(i, n1)]));
    add_lines(&mut mesh, first, (0..n1).rev().map(|j| [index(0, j + 1), index(0, j)]));
    Ok(mesh)
}

/// Appends lines as a group.
pub(super) fn add_lines(mesh: &mut Mesh, name: &str, lines: impl Iterator<Item = [u32; 2]>) {
    let first = mesh.lines.len();
    mesh.lines.extend(lines);
    let group = group(1, first, &mesh.lines);
    mesh.groups.insert(name.to_string(), group);
}

/// Appends boundary triangles as a group.
pub(super) fn add_triangles(mesh: &mut Mesh, name: &str, triangles: impl Iterator<Item = [u32; 3]>) {
    let first = mesh.triangles.len();
    mesh.triangles.extend(triangles);
    let group = group(2, first, &mesh.triangles);
    mesh.groups.insert(name.to_string(), group);
}

fn group<const N: usize>(topological_dimension: usize, first: usize, cells: &[[u32; N]]) -> Group {
    let mut vertices = cells[first..].as_flattened().to_vec();
    vertices.sort_unstable();
    vertices.dedup();
    Group { topological_dimension, cells: (first as u32..cells.len() as u32).collect(), vertices }
}
