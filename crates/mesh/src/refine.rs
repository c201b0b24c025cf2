//! Uniform refinement: every cell is cut into cells of half its size.
//!
//! The new vertices are those of the mesh of second order with all nodes. A child at a corner has the nodes
//! between that corner and the others, in the parent's order: four children of a triangle with the one
//! between its mid-edge nodes (red refinement; Bank, Sherman, Weiser 1983, *Refinement algorithms and data
//! structures for regular local mesh refinement*, Scientific Computing, 3-17), four of a quadrilateral, eight
//! of a hexahedron. A tetrahedron has four children at its corners and an octahedron between them, which its
//! shortest diagonal cuts into four (Zhang 1995, *Successive subdivisions of tetrahedra and multigrid methods
//! on tetrahedral meshes*, Houston Journal of Mathematics 21, 541-556).

use std::collections::BTreeMap;

use super::quadratic::sorted;
use super::{Group, Mesh, MeshError};
use pliant::element::{CellBlock, CellKind};

/// Diagonal of the octahedron in a tetrahedron; mid-edge nodes by the corners of their edges.
struct Diagonal {
    ends: [[usize; 2]; 2],
    /// The other nodes, in order around the diagonal.
    around: [[usize; 2]; 4],
}

const DIAGONALS: [Diagonal; 3] = [
    Diagonal { ends: [[0, 1], [2, 3]], around: [[0, 2], [0, 3], [1, 3], [1, 2]] },
    Diagonal { ends: [[0, 2], [1, 3]], around: [[0, 1], [0, 3], [2, 3], [1, 2]] },
    Diagonal { ends: [[0, 3], [1, 2]], around: [[0, 1], [0, 2], [2, 3], [1, 3]] },
];

/// Cuts every cell of a mesh of first order once; `curve` moves the new vertices of round shapes.
///
/// # Errors
/// The mesh is of second order, has a surface that rides along or no cells, or would have too many vertices.
pub(super) fn refine(mesh: &Mesh, curve: impl FnOnce(&mut Mesh)) -> Result<Mesh, MeshError> {
    let refused = |why| Err(MeshError::Refine { why });
    if mesh.order() == 2 {
        return refused(
            "the cells of the file are of second order; drop_mid_nodes = true takes their corners",
        );
    }
    if mesh.skin.is_some() {
        return refused("a surface is embedded in the cells; give a smaller `spacing` instead");
    }
    if mesh.element_count() == 0 {
        return refused("the mesh has no cells");
    }
    let count = 7 * mesh.element_count() as u64;
    let mut whole = mesh.promoted_to_quadratic().ok_or(MeshError::TooMany { what: "vertices", count })?;
    curve(&mut whole);
    let mut middles = whole.middles();
    // Lines and springs that are no edges of cells have middles of their own.
    for &[a, b] in mesh.lines.iter().chain(&mesh.edges) {
        let next = u32::try_from(whole.vertex_count()).unwrap_or(u32::MAX);
        middles.entry(sorted(a, b)).or_insert_with(|| {
            let middle: Vec<f64> = whole
                .point(a as usize)
                .iter()
                .zip(whole.point(b as usize))
                .map(|(a, b)| 0.5 * a + 0.5 * b)
                .collect();
            whole.points.extend(middle);
            next
        });
    }
    let halves = |lines: &[[u32; 2]]| -> Vec<[u32; 2]> {
        let halves = |&[a, b]: &[u32; 2]| {
            let middle = middles[&sorted(a, b)];
            [[a, middle], [middle, b]]
        };
        lines.iter().flat_map(halves).collect()
    };
    let mut refined = Mesh {
        lines: halves(&mesh.lines),
        edges: halves(&mesh.edges),
        triangles: mesh.triangles.iter().flat_map(|cell| triangles(cell, &middles)).collect(),
        tetrahedra: mesh.tetrahedra.iter().flat_map(|cell| tetrahedra(cell, &middles, &whole)).collect(),
        triangle_middles: vec![],
        tetrahedron_middles: vec![],
        blocks: whole.blocks.iter().zip(&mesh.blocks).map(|(whole, block)| children(whole, block)).collect(),
        ..whole.clone()
    };
    for (name, group) in &mut refined.groups {
        *group = of_children(group, &mesh.groups[name], mesh, &middles);
    }
    Ok(refined)
}

fn triangles(&[a, b, c]: &[u32; 3], middles: &BTreeMap<[u32; 2], u32>) -> [[u32; 3]; 4] {
    let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[a, b]| middles[&sorted(a, b)]);
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
}

fn tetrahedra(cell: &[u32; 4], middles: &BTreeMap<[u32; 2], u32>, mesh: &Mesh) -> [[u32; 4]; 8] {
    let between = |a: usize, b: usize| if a == b { cell[a] } else { middles[&sorted(cell[a], cell[b])] };
    let mut children = [[0; 4]; 8];
    for corner in 0..4 {
        children[corner] = std::array::from_fn(|other| between(corner, other));
    }
    let length = |diagonal: &&Diagonal| {
        let [[a, b], [c, d]] = diagonal.ends;
        let ends = [between(a, b), between(c, d)].map(|node| mesh.point(node as usize));
        ends[0].iter().zip(ends[1]).map(|(a, b)| (a - b) * (a - b)).sum::<f64>()
    };
    let shortest = DIAGONALS.iter().min_by(|a, b| length(a).total_cmp(&length(b)));
    let Diagonal { ends, around } = shortest.unwrap_or(&DIAGONALS[0]);
    let [from, to] = ends.map(|[a, b]| between(a, b));
    for i in 0..4 {
        let [first, second] = [around[i], around[(i + 1) % 4]].map(|[a, b]| between(a, b));
        let child = [from, to, first, second];
        let is_right_handed = volume(&child.map(|node| mesh.point(node as usize))) > 0.0;
        children[4 + i] = if is_right_handed { child } else { [from, to, second, first] };
    }
    children
}

/// Six times the signed volume of a tetrahedron.
fn volume(corners: &[&[f64]; 4]) -> f64 {
    let edge = |corner: usize| std::array::from_fn::<f64, 3, _>(|c| corners[corner][c] - corners[0][c]);
    let [a, b, c] = [edge(1), edge(2), edge(3)];
    let cross = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
    (0..3).map(|i| a[i] * cross[i]).sum()
}

/// Children of quadrilaterals or hexahedra, from the same block with all nodes.
fn children(whole: &CellBlock, block: &CellBlock) -> CellBlock {
    let kind = whole.kind;
    let mut vertices = Vec::with_capacity(kind.corners * block.vertices.len());
    for cell in whole.cells() {
        for corner in 0..kind.corners {
            vertices.extend((0..kind.corners).map(|other| cell[between(kind, corner, other)]));
        }
    }
    CellBlock { vertices, ..block.clone() }
}

/// Node of a cell with all nodes in the middle between two corners.
fn between(kind: &CellKind, corner: usize, other: usize) -> usize {
    if corner == other {
        return corner;
    }
    let edge = kind.edges.iter().position(|edge| edge.contains(&corner) && edge.contains(&other));
    let side = kind.sides.iter().position(|side| side.contains(&corner) && side.contains(&other));
    match (edge, side) {
        (Some(edge), _) => kind.corners + edge,
        (None, Some(side)) if kind.dimension == 3 => kind.face_nodes().start + side,
        _ => kind.nodes - 1,
    }
}

/// The group of the children of a group's cells, with the vertices of the promoted group.
fn of_children(promoted: &Group, group: &Group, mesh: &Mesh, middles: &BTreeMap<[u32; 2], u32>) -> Group {
    let dimension = group.topological_dimension;
    let is_block = mesh.blocks.iter().any(|block| block.kind.dimension == dimension);
    let count = match (dimension, is_block) {
        (0, _) => return promoted.clone(),
        (1, _) => 2,
        (2, _) => 4,
        _ => 8,
    };
    let cells = group.cells.iter().flat_map(|cell| (0..count).map(move |child| count * cell + child));
    let mut vertices = promoted.vertices.clone();
    if dimension == 1 {
        let lines = if mesh.lines.is_empty() { &mesh.edges } else { &mesh.lines };
        vertices.extend(
            group.cells.iter().map(|cell| lines[*cell as usize]).map(|[a, b]| middles[&sorted(a, b)]),
        );
        vertices.sort_unstable();
        vertices.dedup();
    }
    Group { topological_dimension: dimension, cells: cells.collect(), vertices }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::spec::{BodyMesh, CellOrder, MeshSpec};
    use crate::{build_body, check::check};

    fn built(shape: &str, dimension: usize, refine: usize, order: CellOrder) -> Mesh {
        let shape: MeshSpec = serde_json::from_str(shape).unwrap();
        let body = BodyMesh { shape: &shape, order, refine, transform: None, repeat: None };
        build_body(&body, dimension, Path::new(".")).unwrap_or_else(|error| panic!("{error}"))
    }

    /// Area or volume.
    fn content(mesh: &Mesh) -> f64 {
        mesh.quality().elements.unwrap().total_volume
    }

    #[test]
    fn cells_fill_what_their_parents_filled() {
        let shapes = [
            (r#"{ "grid": { "cells": [3, 2], "size": [3.0, 1.0] } }"#, 2, 4),
            (r#"{ "grid": { "cells": [3, 2], "size": [3.0, 1.0], "element": "quadrilateral" } }"#, 2, 4),
            (r#"{ "grid": { "cells": [2, 1, 3], "size": [2.0, 1.0, 4.0] } }"#, 3, 8),
            (r#"{ "grid": { "cells": [2, 1, 3], "size": [2.0, 1.0, 4.0], "element": "hexahedron" } }"#, 3, 8),
            (r#"{ "cooks_membrane": { "cells": [2, 3] } }"#, 2, 4),
        ];
        for (shape, dimension, children) in shapes {
            let coarse = built(shape, dimension, 0, CellOrder::Linear);
            for times in 1..=2 {
                let fine = built(shape, dimension, times, CellOrder::Linear);
                check(&fine).unwrap_or_else(|error| panic!("{shape}: {error}"));
                assert_eq!(fine.element_count(), coarse.element_count() * children_of(children, times));
                assert!((content(&fine) / content(&coarse) - 1.0).abs() < 1e-12, "{shape}");
                // Neighbours share their vertices: a surface of the same area, of cells as many times four.
                let surface = |mesh: &Mesh| match dimension {
                    2 => mesh.boundary_edges().len(),
                    _ => mesh.flat_faces().len(),
                };
                assert_eq!(surface(&fine), surface(&coarse) * children_of(children / 2, times), "{shape}");
                for (name, group) in &coarse.groups {
                    let dimension = group.topological_dimension as u32;
                    let own = &fine.groups[name];
                    assert_eq!(own.cells.len(), group.cells.len() << (dimension as usize * times), "{name}");
                    assert!(own.vertices.len() > group.vertices.len(), "{name}");
                }
            }
        }
    }

    fn children_of(children: usize, times: usize) -> usize {
        children.pow(times as u32)
    }

    /// Tetrahedra do not become flatter and flatter: the third refinement has the quality of the second.
    #[test]
    fn tetrahedra_keep_their_quality() {
        let shape = r#"{ "inline": { "points": [[0,0,0],[1,0,0],[0.3,0.9,0],[0.2,0.4,0.7]],
            "tetrahedra": [[0,1,2,3]] } }"#;
        let quality = |times| {
            let mesh = built(shape, 3, times, CellOrder::Linear);
            let worst = |cell: &[u32; 4]| {
                let corners = cell.map(|v| mesh.point(v as usize));
                let longest = (0..4)
                    .flat_map(|a| (0..a).map(move |b| (a, b)))
                    .map(|(a, b)| (0..3).map(|c| (corners[a][c] - corners[b][c]).powi(2)).sum::<f64>());
                volume(&corners) / longest.fold(0.0, f64::max).powf(1.5)
            };
            mesh.tetrahedra.iter().map(worst).fold(f64::INFINITY, f64::min)
        };
        let [first, second, third] = [1, 2, 3].map(quality);
        assert!(first > 0.0 && (third / second - 1.0).abs() < 1e-9, "{first}, {second}, {third}");
    }

    /// Round shapes are refined onto their curves: the ring that is cut is the ring of twice the cells.
    #[test]
    fn round_shapes_stay_round() {
        let ring = |cells: [usize; 2]| {
            format!(r#"{{ "annulus": {{ "inner_radius": 1.0, "outer_radius": 2.0, "cells": {cells:?} }} }}"#)
        };
        let cut = built(&ring([2, 12]), 2, 1, CellOrder::Linear);
        let twice = built(&ring([4, 24]), 2, 0, CellOrder::Linear);
        assert!((content(&cut) / content(&twice) - 1.0).abs() < 1e-12);
        let cut = built(&ring([2, 12]), 2, 1, CellOrder::Quadratic);
        let twice = built(&ring([4, 24]), 2, 0, CellOrder::Quadratic);
        assert!((content(&cut) / content(&twice) - 1.0).abs() < 1e-12);
    }
}
