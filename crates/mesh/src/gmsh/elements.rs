//! `$Elements`: simplices, quadrilaterals and hexahedra of first and second order; other element types
//! are rejected by name.

use super::nodes::GmshNodes;
use super::source::GmshSource;
use super::{Entities, Version};
use crate::MeshError;
use crate::cells::FileCells;
use crate::file::Place;
use crate::quadratic::MidNodes;
use crate::tokens::FileFault;
use pliant::element::{CELL_KINDS, CellKind};

/// Reads the section up to its end.
pub(super) fn read(
    source: &mut GmshSource,
    version: Version,
    nodes: &GmshNodes,
    entities: &Entities,
    mid_nodes: MidNodes,
) -> Result<FileCells, FileFault> {
    let mut elements = ElementReader { version, nodes, mid_nodes, cells: FileCells::default() };
    match version {
        Version::Two if source.is_binary() => elements.packets(source)?,
        Version::Two => elements.flat(source)?,
        Version::Four => elements.blocks(source, entities)?,
    }
    source.tokens.keyword("$EndElements")?;
    Ok(elements.cells)
}

/// Number of nodes of the largest cell.
const MOST_NODES: usize = 27;

/// Shape of an element type of Gmsh.
#[derive(Clone, Copy)]
enum Shape {
    /// A simplex: number of corners, number of mid-edge nodes.
    Simplex((usize, usize)),
    Block(&'static CellKind),
}

struct ElementReader<'a> {
    version: Version,
    nodes: &'a GmshNodes,
    mid_nodes: MidNodes,
    cells: FileCells,
}

impl ElementReader<'_> {
    /// Version 2.2, ASCII: `tag type number-of-tags tags nodes`.
    fn flat(&mut self, source: &mut GmshSource) -> Result<(), FileFault> {
        let count = source.size("the number of elements")?;
        for _ in 0..count {
            let tag = source.natural("the tag of an element")?;
            let place = source.place(tag);
            let kind = source.natural("the type of an element")?;
            let corners = self.shape(kind).ok_or_else(|| source.fault(unsupported(tag, kind)))?;
            let tags = source.natural("the number of tags of an element")?;
            let groups = physical(source, tags)?;
            self.cell(source, corners, tag, place, groups.as_slice())?;
        }
        Ok(())
    }

    /// Version 2.2, binary: packets of `type count number-of-tags` and `count` times `tag tags nodes`,
    /// until the announced number of elements.
    fn packets(&mut self, source: &mut GmshSource) -> Result<(), FileFault> {
        let count: u64 = source.tokens.number("the number of elements")?;
        source.begin_numbers();
        let mut left = count;
        while left > 0 {
            let kind = source.natural("the type of an element")?;
            let place = source.place(0);
            let packet = source.natural("the number of elements of one type")?;
            let tags = source.natural("the number of tags of an element")?;
            for _ in 0..packet {
                let tag = source.natural("the tag of an element")?;
                let corners = self.shape(kind).ok_or_else(|| FileFault::at(place, unsupported(tag, kind)))?;
                let place = source.place(tag);
                let groups = physical(source, tags)?;
                self.cell(source, corners, tag, place, groups.as_slice())?;
            }
            left = left.saturating_sub(packet);
        }
        Ok(())
    }

    /// Version 4.1, blocks of one entity each: `dimension entity type count`, then `tag nodes`.
    fn blocks(&mut self, source: &mut GmshSource, entities: &Entities) -> Result<(), FileFault> {
        source.begin_numbers();
        let blocks = source.size("the number of element blocks")?;
        for expected in ["the number of elements", "the least element tag", "the greatest element tag"] {
            source.size(expected)?;
        }
        for _ in 0..blocks {
            let dimension = source.natural("the dimension of an entity")?;
            let entity = source.int("the tag of an entity")?;
            let kind = source.natural("the type of an element")?;
            let block = source.place(0);
            let count = source.size("the number of elements in the block")?;
            let groups = entities.get(&(dimension, entity)).map_or(&[][..], Vec::as_slice);
            for _ in 0..count {
                let tag = source.size("the tag of an element")?;
                let corners = self.shape(kind).ok_or_else(|| FileFault::at(block, unsupported(tag, kind)))?;
                let place = source.place(tag);
                self.cell(source, corners, tag, place, groups)?;
            }
        }
        Ok(())
    }

    fn node(&self, source: &mut GmshSource) -> Result<u64, FileFault> {
        let expected = "the tag of a node";
        if self.version == Version::Two { source.natural(expected) } else { source.size(expected) }
    }

    /// Shape by Gmsh's number of the type.
    fn shape(&self, kind: u64) -> Option<Shape> {
        let is_read = |known: &CellKind| known.order() == 1 || self.mid_nodes != MidNodes::Refuse;
        let known = CELL_KINDS.iter().find(|known| known.gmsh == kind && is_read(known));
        let block = || known.map(|known| Shape::Block(known));
        self.corners(kind).map(Shape::Simplex).or_else(block)
    }

    /// Number of corners and of mid-edge nodes of a simplex, by Gmsh's number of the type.
    fn corners(&self, kind: u64) -> Option<(usize, usize)> {
        match kind {
            15 => Some((1, 0)),
            1 => Some((2, 0)),
            2 => Some((3, 0)),
            4 => Some((4, 0)),
            _ if self.mid_nodes == MidNodes::Refuse => None,
            8 => Some((2, 1)),
            9 => Some((3, 3)),
            11 => Some((4, 6)),
            _ => None,
        }
    }

    /// Reads the nodes of one element and adds the cell.
    fn cell(
        &mut self,
        source: &mut GmshSource,
        shape: Shape,
        element: u64,
        place: Place,
        groups: &[u64],
    ) -> Result<(), FileFault> {
        let mut vertices = [0_u32; MOST_NODES];
        let (corners, middles) = match shape {
            Shape::Simplex(counts) => counts,
            Shape::Block(kind) => (kind.nodes, 0),
        };
        let vertices = &mut vertices[..corners + middles];
        for vertex in &mut *vertices {
            let node = self.node(source)?;
            *vertex = self
                .nodes
                .index(node)
                .ok_or_else(|| source.fault(MeshError::UnknownNode { element, node }))?;
        }
        if let [.., last_but_one, last] = vertices
            && middles == 6
        {
            // Gmsh lists edge 23 before edge 13.
            std::mem::swap(last_but_one, last);
        }
        // Other kinds are reordered from Gmsh's node order.
        if let Shape::Block(kind) = shape {
            let read = |node: usize| vertices[kind.gmsh_nodes.get(node).copied().unwrap_or(node)];
            let in_order: Vec<u32> = (0..kind.nodes).map(read).collect();
            self.cells.push_kind(kind, &in_order, place, groups);
            return Ok(());
        }
        match vertices.split_at(corners) {
            (corners, []) => self.cells.push(corners, place, groups),
            (corners, middles) => self.cells.push_quadratic(corners, middles, place, groups),
        }
        Ok(())
    }
}

/// Reads the tags of an element of version 2.2; the first is its physical group, 0 for none.
fn physical(source: &mut GmshSource, tags: u64) -> Result<Option<u64>, FileFault> {
    let mut group = None;
    for i in 0..tags {
        let value = source.int("a tag of an element")?;
        if i == 0 && value != 0 {
            group = Some(value.unsigned_abs());
        }
    }
    Ok(group)
}

fn unsupported(element: u64, kind: u64) -> MeshError {
    let name = match kind {
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
