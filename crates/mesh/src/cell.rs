//! Cells, and what calls them: the mesh by kind and index, a file by a number or a place.

use std::fmt;

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
}

impl fmt::Display for Cell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (Cell::Edge(i) | Cell::Line(i) | Cell::Triangle(i) | Cell::Tetrahedron(i)) = self;
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
        }
    }

    /// What its measure is called, and the unit.
    pub(super) fn measure(&self) -> (&'static str, &'static str) {
        match self {
            Cell::Edge(_) | Cell::Line(_) => ("length", "m"),
            Cell::Triangle(_) => ("area", "m^2"),
            Cell::Tetrahedron(_) => ("volume", "m^3"),
        }
    }
}

/// What a mesh file calls a vertex or an element: a number, or in binary files the place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileTag {
    /// A vertex.
    Node(u64),
    /// An element.
    Element(u64),
    /// What begins at this offset of a binary file.
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
