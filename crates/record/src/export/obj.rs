//! Export as Wavefront OBJ.

use std::io::{self, Write};

use super::ExportFrame;
use crate::read::{RecordedBodies, RecordedBody};

/// Visible vertices of a body, ascending.
fn shown(body: &RecordedBody) -> Vec<u32> {
    if body.is_particles() {
        return body.vertices.clone().collect();
    }
    let mut vertices: Vec<u32> =
        body.drawn().as_flattened().iter().chain(body.lines().as_flattened()).copied().collect();
    vertices.sort_unstable();
    vertices.dedup();
    vertices
}

/// Writes one frame. `{:?}` of a number is the shortest text that reads back to the same number.
pub(super) fn write(bodies: &RecordedBodies, frame: &ExportFrame, out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "# t = {:?} s", frame.time)?;
    let mut first = 1;
    for body in &bodies.bodies {
        writeln!(out, "o {}", body.name)?;
        let vertices = shown(body);
        for &vertex in &vertices {
            let x = &frame.x[3 * vertex as usize..][..3];
            writeln!(out, "v {:?} {:?} {:?}", x[0], x[1], x[2])?;
        }
        let number = |vertex: &u32| first + vertices.binary_search(vertex).unwrap_or_else(|at| at);
        for cell in &body.drawn() {
            writeln!(out, "f {} {} {}", number(&cell[0]), number(&cell[1]), number(&cell[2]))?;
        }
        for line in body.lines() {
            writeln!(out, "l {} {}", number(&line[0]), number(&line[1]))?;
        }
        if body.is_particles() {
            vertices.iter().try_for_each(|vertex| writeln!(out, "p {}", number(vertex)))?;
        }
        first += vertices.len();
    }
    Ok(())
}
