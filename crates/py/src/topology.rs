//! Cells of bodies, for Python.

use pliant::element::{CellKind, HEX20, HEX27, HEXAHEDRON, QUAD8, QUAD9, QUADRILATERAL};
use pliant::topology::{BodyTopology, Topology};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::arrays::indices;

/// One dictionary per body.
pub(crate) fn bodies<'py>(py: Python<'py>, topology: &Topology) -> PyResult<Bound<'py, PyList>> {
    let bodies = topology.bodies.iter().map(|body| described(py, body)).collect::<PyResult<Vec<_>>>()?;
    PyList::new(py, bodies)
}

fn described<'py>(py: Python<'py>, body: &BodyTopology) -> PyResult<Bound<'py, PyDict>> {
    let table = PyDict::new(py);
    table.set_item("name", &body.name)?;
    let kind = serde_json::to_value(body.kind).unwrap_or_default();
    table.set_item("kind", kind.as_str())?;
    table.set_item("vertices", (body.vertices.start, body.vertices.end))?;
    table.set_item("edges", indices(py, &body.edges)?)?;
    table.set_item("triangles", indices(py, &body.triangles)?)?;
    table.set_item("tetrahedra", indices(py, &body.tetrahedra)?)?;
    let block = |kind: &CellKind| body.blocks.iter().find(|block| block.kind == kind);
    let quadrilaterals = block(QUADRILATERAL.kind).map_or(&[][..], |block| block.of::<4>());
    table.set_item("quadrilaterals", indices(py, quadrilaterals)?)?;
    let hexahedra = block(HEXAHEDRON.kind).map_or(&[][..], |block| block.of::<8>());
    table.set_item("hexahedra", indices(py, hexahedra)?)?;
    let quad8 = block(QUAD8.kind).map_or(&[][..], |block| block.of::<8>());
    table.set_item("quad8", indices(py, quad8)?)?;
    let quad9 = block(QUAD9.kind).map_or(&[][..], |block| block.of::<9>());
    table.set_item("quad9", indices(py, quad9)?)?;
    let hex20 = block(HEX20.kind).map_or(&[][..], |block| block.of::<20>());
    table.set_item("hex20", indices(py, hex20)?)?;
    let hex27 = block(HEX27.kind).map_or(&[][..], |block| block.of::<27>());
    table.set_item("hex27", indices(py, hex27)?)?;
    table.set_item("triangle_middles", indices(py, &body.triangle_middles)?)?;
    table.set_item("tetrahedron_middles", indices(py, &body.tetrahedron_middles)?)?;
    table.set_item("surface", indices(py, &body.surface)?)?;
    Ok(table)
}
