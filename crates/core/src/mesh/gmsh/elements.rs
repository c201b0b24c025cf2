//! `$Elements`: simplices of first and second order; what else Gmsh writes is refused by its name.

use super::nodes::Nodes;
use super::{Entities, Version};
use crate::mesh::MeshError;
use crate::mesh::cells::Cells;
use crate::mesh::file::Place;
use crate::mesh::quadratic::MidNodes;
use crate::mesh::tokens::{Fault, Tokens};

/// Reads the section up to its end.
pub(super) fn read(
    tokens: &mut Tokens,
    version: Version,
    nodes: &Nodes,
    entities: &Entities,
    mid_nodes: MidNodes,
) -> Result<Cells, Fault> {
    let mut cells = Cells::default();
    match version {
        Version::Two => flat(tokens, nodes, mid_nodes, &mut cells)?,
        Version::Four => blocks(tokens, nodes, entities, mid_nodes, &mut cells)?,
    }
    tokens.keyword("$EndElements")?;
    Ok(cells)
}

/// Version 2.2: `tag type number-of-tags tags nodes`; the first of the tags is the physical group.
fn flat(tokens: &mut Tokens, nodes: &Nodes, mid_nodes: MidNodes, cells: &mut Cells) -> Result<(), Fault> {
    let count: u64 = tokens.number("the number of elements")?;
    for _ in 0..count {
        let tag = tokens.number("the tag of an element")?;
        let line = tokens.line;
        let kind = tokens.number("the type of an element")?;
        let corners = corners(kind, mid_nodes).ok_or_else(|| tokens.fault(unsupported(tag, kind)))?;
        let tags: u64 = tokens.number("the number of tags of an element")?;
        let mut physical = 0_u64;
        for i in 0..tags {
            let value: i64 = tokens.number("a tag of an element")?;
            if i == 0 {
                physical = value.unsigned_abs();
            }
        }
        let groups = if physical == 0 { &[][..] } else { &[physical] };
        cell(tokens, nodes, cells, corners, Place { tag, line }, groups)?;
    }
    Ok(())
}

/// Version 4.1, blocks of one entity each: `dimension entity type count`, then `tag nodes`.
fn blocks(
    tokens: &mut Tokens,
    nodes: &Nodes,
    entities: &Entities,
    mid_nodes: MidNodes,
    cells: &mut Cells,
) -> Result<(), Fault> {
    let blocks: u64 = tokens.number("the number of element blocks")?;
    for expected in ["the number of elements", "the least element tag", "the greatest element tag"] {
        tokens.number::<u64>(expected)?;
    }
    for _ in 0..blocks {
        let dimension: u8 = tokens.number("the dimension of an entity")?;
        let entity: i64 = tokens.number("the tag of an entity")?;
        let kind = tokens.number("the type of an element")?;
        let block_line = tokens.line;
        let count: u64 = tokens.number("the number of elements in the block")?;
        let groups = entities.get(&(dimension, entity)).map_or(&[][..], Vec::as_slice);
        for _ in 0..count {
            let tag = tokens.number("the tag of an element")?;
            let corners =
                corners(kind, mid_nodes).ok_or_else(|| Fault::in_line(block_line, unsupported(tag, kind)))?;
            let line = tokens.line;
            cell(tokens, nodes, cells, corners, Place { tag, line }, groups)?;
        }
    }
    Ok(())
}

/// Reads the nodes of one element and enters it.
fn cell(
    tokens: &mut Tokens,
    nodes: &Nodes,
    cells: &mut Cells,
    (corners, middles): (usize, usize),
    place: Place,
    groups: &[u64],
) -> Result<(), Fault> {
    let mut vertices = [0_u32; 10];
    let vertices = &mut vertices[..corners + middles];
    for vertex in &mut *vertices {
        let node = tokens.number("the tag of a node")?;
        *vertex = nodes
            .index(node)
            .ok_or_else(|| tokens.fault(MeshError::UnknownNode { element: place.tag, node }))?;
    }
    if let [.., last_but_one, last] = vertices
        && middles == 6
    {
        // Gmsh has edge 23 before edge 13.
        std::mem::swap(last_but_one, last);
    }
    match vertices.split_at(corners) {
        (corners, []) => cells.push(corners, place, groups),
        (corners, middles) => cells.push_quadratic(corners, middles, place, groups),
    }
    Ok(())
}

/// Number of corners and of nodes in the middle of edges of a simplex, by the type's number in Gmsh.
fn corners(kind: u64, mid_nodes: MidNodes) -> Option<(usize, usize)> {
    match kind {
        15 => Some((1, 0)),
        1 => Some((2, 0)),
        2 => Some((3, 0)),
        4 => Some((4, 0)),
        _ if mid_nodes == MidNodes::Refuse => None,
        8 => Some((2, 1)),
        9 => Some((3, 3)),
        11 => Some((4, 6)),
        _ => None,
    }
}

fn unsupported(element: u64, kind: u64) -> MeshError {
    let name = match kind {
        3 => "4-node quadrangle",
        5 => "8-node hexahedron",
        6 => "6-node prism",
        7 => "5-node pyramid",
        8 => "3-node second-order line",
        9 => "6-node second-order triangle",
        10 => "9-node second-order quadrangle",
        11 => "10-node second-order tetrahedron",
        12 => "27-node second-order hexahedron",
        13 => "18-node second-order prism",
        14 => "14-node second-order pyramid",
        16 => "8-node second-order quadrangle",
        17 => "20-node second-order hexahedron",
        18 => "15-node second-order prism",
        19 => "13-node second-order pyramid",
        20 | 21 => "third-order triangle",
        22..=25 => "triangle of order four or five",
        26..=28 => "line of order three to five",
        29..=31 => "tetrahedron of order three to five",
        _ => "element of another kind",
    };
    MeshError::ElementType { element, kind, name }
}
