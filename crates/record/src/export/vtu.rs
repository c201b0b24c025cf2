//! Export as VTK's XML format for unstructured grids:
//! <https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html>.
//!
//! Arrays are inline in base 64, uncompressed: the one variant that meshio, PyVista and ParaView all
//! read.

use std::io::{self, Write};

use super::{ExportFrame, principal_stresses};
use crate::read::{RecordedBodies, RecordedRows};
use pliant::diagnostics::{FieldRows, RecordedField};
use pliant::element::CellBlock;
use pliant_files::base64;
use pliant_mesh::vtk_cells::{
    LINE, QUADRATIC_TETRAHEDRON, QUADRATIC_TRIANGLE, TETRAHEDRON, TRIANGLE, VERTEX,
};

/// Cells of all bodies in the layout of the format.
#[derive(Default)]
struct VtuGrid {
    connectivity: Vec<u8>,
    offsets: Vec<u8>,
    types: Vec<u8>,
    body: Vec<u8>,
    vertices: u64,
    cells: u64,
    /// Range of cells of each body that may be elements: first cell and number.
    solids: Vec<(String, usize, usize)>,
}

impl VtuGrid {
    fn new(bodies: &RecordedBodies) -> VtuGrid {
        let mut grid = VtuGrid::default();
        for (number, body) in bodies.bodies.iter().enumerate() {
            let number = number as i32;
            // Triangles of a 3D solid are its surface, not its elements.
            let solids = body.tetrahedra.len() + body.quadratic_tetrahedra.len();
            let flat = body.triangles.len() + body.quadratic_triangles.len();
            let of_blocks: usize = body.blocks.iter().map(CellBlock::len).sum();
            let count = [of_blocks, solids, flat].into_iter().find(|count| *count > 0).unwrap_or(0);
            grid.solids.push((body.name.clone(), grid.cells as usize, count));
            for block in &body.blocks {
                block.cells().for_each(|cell| grid.push(block.kind.vtk, cell, number));
            }
            body.tetrahedra.iter().for_each(|cell| grid.push(TETRAHEDRON, cell, number));
            body.triangles.iter().for_each(|cell| grid.push(TRIANGLE, cell, number));
            body.quadratic_tetrahedra.iter().for_each(|cell| grid.push(QUADRATIC_TETRAHEDRON, cell, number));
            body.quadratic_triangles.iter().for_each(|cell| grid.push(QUADRATIC_TRIANGLE, cell, number));
            body.lines().iter().for_each(|cell| grid.push(LINE, cell, number));
            if body.is_particles() {
                body.vertices.clone().for_each(|vertex| grid.push(VERTEX, &[vertex], number));
            }
        }
        grid
    }

    fn push(&mut self, cell_type: u8, vertices: &[u32], body: i32) {
        for &vertex in vertices {
            self.connectivity.extend(i64::from(vertex).to_le_bytes());
        }
        self.vertices += vertices.len() as u64;
        self.cells += 1;
        self.offsets.extend(self.vertices.to_le_bytes());
        self.types.push(cell_type);
        self.body.extend(body.to_le_bytes());
    }
}

/// Names of the principal stresses at points.
const PRINCIPAL: [&str; 3] = ["principal-1", "principal-2", "principal-3"];

/// `type`, name and components of an array.
type Kind<'a> = (&'a str, &'a str, usize);

/// Writes one array: its length as a 64-bit number, then its bytes, both in one piece of base 64.
fn array(out: &mut dyn Write, (kind, name, components): Kind, bytes: &[u8]) -> io::Result<()> {
    let mut block = Vec::with_capacity(8 + bytes.len());
    block.extend((bytes.len() as u64).to_le_bytes());
    block.extend_from_slice(bytes);
    writeln!(
        out,
        "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"binary\">"
    )?;
    writeln!(out, "{}", base64::encode(&block))?;
    writeln!(out, "</DataArray>")
}

fn bytes(numbers: impl Iterator<Item = f64>) -> Vec<u8> {
    numbers.flat_map(f64::to_le_bytes).collect()
}

/// One row for each cell: that of its element, NaN if it is not an element.
fn of_cells(grid: &VtuGrid, rows: &RecordedRows) -> Vec<u8> {
    let width = rows.fields.len();
    let mut values = vec![f64::NAN; grid.cells as usize * width];
    for (name, first, count) in &grid.solids {
        let body = rows.bodies.iter().find(|body| body.name == *name && body.count == *count);
        let of_body = body.and_then(|body| rows.values.get(body.first * width..(body.first + count) * width));
        if let Some(of_body) = of_body {
            values[first * width..(first + count) * width].copy_from_slice(of_body);
        }
    }
    bytes(values.into_iter())
}

/// Writes one frame.
pub(super) fn write(
    bodies: &RecordedBodies,
    rest: Option<&[f64]>,
    frame: &ExportFrame,
    fields: &[(RecordedField, RecordedRows)],
    out: &mut dyn Write,
) -> io::Result<()> {
    let grid = VtuGrid::new(bodies);
    writeln!(out, "<?xml version=\"1.0\"?>")?;
    writeln!(
        out,
        "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" \
         header_type=\"UInt64\">"
    )?;
    writeln!(out, "<UnstructuredGrid>\n<FieldData>")?;
    writeln!(out, "<DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" format=\"ascii\">")?;
    writeln!(out, "{:?}\n</DataArray>\n</FieldData>", frame.time)?;
    writeln!(out, "<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">", bodies.vertex_count, grid.cells)?;
    writeln!(out, "<Points>")?;
    array(out, ("Float64", "Points", 3), &bytes(frame.x[..3 * bodies.vertex_count].iter().copied()))?;
    writeln!(out, "</Points>\n<Cells>")?;
    array(out, ("Int64", "connectivity", 1), &grid.connectivity)?;
    array(out, ("Int64", "offsets", 1), &grid.offsets)?;
    array(out, ("UInt8", "types", 1), &grid.types)?;
    writeln!(out, "</Cells>\n<PointData>")?;
    if let Some(rest) = rest {
        let displacement = bytes(frame.x.iter().zip(rest).map(|(x, rest)| x - rest));
        array(out, ("Float64", "displacement", 3), &displacement)?;
    }
    array(out, ("Float64", "velocity", 3), &bytes(frame.v.iter().copied()))?;
    let of = |wanted: FieldRows| fields.iter().filter(move |(field, _)| field.rows == wanted);
    for (field, rows) in of(FieldRows::Vertices) {
        let values = bytes(rows.values.iter().copied());
        array(out, ("Float64", field.name, rows.fields.len()), &values)?;
        if rows.fields.len() > 1 {
            let principal = principal_stresses(&rows.values);
            for (k, name) in PRINCIPAL.into_iter().enumerate() {
                array(out, ("Float64", name, 1), &bytes(principal.iter().map(|values| values[k])))?;
            }
        }
    }
    writeln!(out, "</PointData>\n<CellData>")?;
    array(out, ("Int32", "body", 1), &grid.body)?;
    for (field, rows) in of(FieldRows::Elements) {
        array(out, ("Float64", field.name, rows.fields.len()), &of_cells(&grid, rows))?;
    }
    writeln!(out, "</CellData>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>")
}
