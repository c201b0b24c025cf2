//! Identity of a cell: by kind and index in a mesh, by number or position in a file.

use std::fmt;

use pliant::element::CellKind;

/// A cell of a mesh, named by its kind and its index among the cells of that kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cell {
    /// Index into `edges`.
    Edge(usize),
    /// Index into `lines`.
    Line(usize),
    /// Index into `triangles`.
    Triangle(usize),
    /// Index into `tetrahedra`.
    Tetrahedron(usize),
    /// Kind, and index into the block of that kind.
    Other(&'static CellKind, usize),
}

impl fmt::Display for Cell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (Cell::Edge(i) | Cell::Line(i) | Cell::Triangle(i) | Cell::Tetrahedron(i) | Cell::Other(_, i)) =
            self;
        write!(f, "{} {i}", self.noun())
    }
}

impl Cell {
    /// The word for a cell of its kind.
    pub(super) fn noun(&self) -> &'static str {
        match self {
            Cell::Edge(_) => "edge",
            Cell::Line(_) => "line",
            Cell::Triangle(_) => "triangle",
            Cell::Tetrahedron(_) => "tetrahedron",
            Cell::Other(kind, _) => kind.name,
        }
    }

    /// Name of its measure, and the unit.
    pub(super) fn measure(&self) -> (&'static str, &'static str) {
        match self {
            Cell::Edge(_) | Cell::Line(_) => ("length", "m"),
            Cell::Triangle(_) => ("area", "m^2"),
            Cell::Other(kind, _) if kind.dimension == 2 => ("area", "m^2"),
            Cell::Other(..) | Cell::Tetrahedron(_) => ("volume", "m^3"),
        }
    }
}

/// Name of a vertex or an element in a mesh file: a number, or in binary files the place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileTag {
    /// A vertex.
    Node(u64),
    /// An element.
    Element(u64),
    /// The record that begins at this offset of a binary file.
    Byte(u64),
}

impl fmt::Display for FileTag {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            FileTag::Node(tag) => write!(f, "node {tag}"),
            FileTag::Element(tag) => write!(f, "element {tag}"),
            FileTag::Byte(offset) => write!(f, "byte {offset}"),
        }
    }
}
