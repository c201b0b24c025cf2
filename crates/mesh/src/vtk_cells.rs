//! The cell types of VTK: <https://docs.vtk.org/en/latest/vtk_file_formats/vtk_legacy_file_format.html>.

use std::ops::Range;

use super::FormatError;
use super::cells::FileCells;
use super::file::Place;
use super::number_type::index;
use pliant::element::CELL_KINDS;

/// One vertex.
pub const VERTEX: u8 = 1;
const POLY_VERTEX: u8 = 2;
/// Two vertices.
pub const LINE: u8 = 3;
const POLY_LINE: u8 = 4;
/// Three vertices.
pub const TRIANGLE: u8 = 5;
const POLYGON: u8 = 7;
/// Four vertices.
pub const TETRAHEDRON: u8 = 10;
const QUADRATIC_LINE: u8 = 21;
/// Corners, then middles of the edges 01, 12, 20.
pub const QUADRATIC_TRIANGLE: u8 = 22;
/// Corners, then middles of the edges 01, 12, 20, 03, 13, 23.
pub const QUADRATIC_TETRAHEDRON: u8 = 24;

/// Kinds of untyped cell lists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ListKind {
    Vertices,
    Lines,
    Polygons,
}

impl ListKind {
    pub(super) fn cell_type(self) -> f64 {
        f64::from(match self {
            ListKind::Vertices => POLY_VERTEX,
            ListKind::Lines => POLY_LINE,
            ListKind::Polygons => POLYGON,
        })
    }
}

/// Adds one cell: `numbers` are the indices of its vertices among those of `range`, counted from 0. A
/// polyline becomes lines, a polygon a fan of triangles about its first vertex, which is right for convex
/// polygons.
///
/// # Errors
/// Cells of other kinds, a wrong number of vertices, an index out of range.
pub(super) fn enter(
    cells: &mut FileCells,
    cell_type: f64,
    numbers: &[f64],
    range: Range<usize>,
    place: Place,
) -> Result<(), FormatError> {
    let count = range.len();
    let mut vertices = Vec::with_capacity(numbers.len());
    for &number in numbers {
        let missing = FormatError::VertexNumber { number: number as i64, count: count as u64, first: 0 };
        vertices.push(range.start as u32 + index(number, count).ok_or(missing)?);
    }
    // Linear simplices go on; other kinds return early.
    let kind = index(cell_type, 256).map_or(0, |kind| kind as u8);
    let corners = match kind {
        VERTEX => 1,
        LINE => 2,
        TRIANGLE => 3,
        TETRAHEDRON => 4,
        QUADRATIC_LINE => return quadratic(cells, &vertices, 2, place),
        QUADRATIC_TRIANGLE => return quadratic(cells, &vertices, 3, place),
        QUADRATIC_TETRAHEDRON => return quadratic(cells, &vertices, 4, place),
        POLY_VERTEX => {
            vertices.iter().for_each(|&vertex| cells.push(&[vertex], place, &[]));
            return Ok(());
        }
        POLY_LINE => {
            at_least(2, vertices.len())?;
            vertices.windows(2).for_each(|line| cells.push(line, place, &[]));
            return Ok(());
        }
        POLYGON => {
            at_least(3, vertices.len())?;
            vertices[1..]
                .windows(2)
                .for_each(|edge| cells.push(&[vertices[0], edge[0], edge[1]], place, &[]));
            return Ok(());
        }
        _ => {
            let known = CELL_KINDS.iter().find(|known| known.vtk == kind);
            let known = known.ok_or_else(|| unsupported(cell_type))?;
            exactly(known.nodes, vertices.len())?;
            cells.push_kind(known, &vertices, place, &[]);
            return Ok(());
        }
    };
    exactly(corners, vertices.len())?;
    cells.push(&vertices, place, &[]);
    Ok(())
}

fn quadratic(
    cells: &mut FileCells,
    vertices: &[u32],
    corners: usize,
    place: Place,
) -> Result<(), FormatError> {
    exactly(corners + corners * (corners - 1) / 2, vertices.len())?;
    let (corners, middles) = vertices.split_at(corners);
    cells.push_quadratic(corners, middles, place, &[]);
    Ok(())
}

fn exactly(expected: usize, found: usize) -> Result<(), FormatError> {
    let what = "vertices of a cell of its type";
    let (expected, found) = (expected as u64, found as u64);
    if expected == found { Ok(()) } else { Err(FormatError::Count { what, expected, found }) }
}

fn at_least(least: usize, found: usize) -> Result<(), FormatError> {
    if found < least { exactly(least, found) } else { Ok(()) }
}

fn unsupported(cell_type: f64) -> FormatError {
    let name = match cell_type as u8 {
        6 => "triangle strip",
        8 => "pixel",
        11 => "voxel",
        13 => "6-node wedge",
        14 => "5-node pyramid",
        68..=82 => "cell of higher order",
        _ => "cell of another kind",
    };
    FormatError::Unsupported {
        found: format!("a {name} (cell type {cell_type})"),
        supported: "cells are vertices, lines, triangles, quadrilaterals, tetrahedra and hexahedra, of first \
                    or second order",
    }
}
