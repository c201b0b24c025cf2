//! Bodies as triangles, lines and points.

use std::ops::Range;

use pliant_record::read::{RecordedBody, RecordedSkin};

use super::elements::Elements;

/// Drawn body; vertices are numbered as in the whole recording.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnBody {
    /// Name, unique in the recording.
    pub name: String,
    /// Vertex range.
    pub vertices: Range<u32>,
    /// Vertex range of its embedded surface, after the vertices of the recording; empty if there is none.
    pub skin: Range<u32>,
    /// Triangles of its embedded surface or boundary, counter-clockwise seen from outside; second-order
    /// elements have four flat ones for each curved side.
    pub triangles: Vec<[u32; 3]>,
    /// Element of each triangle, by index in the body; `None` without elements.
    pub elements: Option<Vec<u32>>,
    /// Boundary vertices covered by the embedded surface, ascending.
    pub beneath: Vec<u32>,
    /// Segments of strands and nets: springs of a body without elements.
    pub lines: Vec<[u32; 2]>,
    /// Particles: all vertices of a body with neither elements nor springs.
    pub points: Vec<u32>,
    /// Vertices of each element, flat.
    pub element_vertices: Vec<u32>,
    /// Number of vertices of an element; 0 without elements.
    pub element_size: usize,
}

impl DrawnBody {
    pub(super) fn new(body: &RecordedBody, dimension: usize) -> DrawnBody {
        let cells = Elements::of(body, dimension);
        let is_particles = body.is_particles();
        DrawnBody {
            name: body.name.clone(),
            vertices: body.vertices.clone(),
            skin: body.skin.as_ref().map_or(0..0, RecordedSkin::vertices),
            triangles: body.drawn(),
            elements: match &body.skin {
                Some(recorded) => {
                    let count = cells.as_ref().map_or(0, |cells| cells.vertices.len() / cells.size);
                    let elements = Some(recorded.skin.elements.clone());
                    elements.filter(|elements| elements.iter().all(|element| (*element as usize) < count))
                }
                None => cells.as_ref().and_then(|cells| cells.of_triangles(&body.surface)),
            },
            beneath: if body.skin.is_some() { distinct(body.surface.as_flattened()) } else { vec![] },
            lines: body.lines().to_vec(),
            points: if is_particles { body.vertices.clone().collect() } else { vec![] },
            element_size: cells.as_ref().map_or(0, |cells| cells.size),
            element_vertices: cells.map(|cells| cells.vertices).unwrap_or_default(),
        }
    }

    /// Number of elements.
    pub fn element_count(&self) -> usize {
        self.element_vertices.len().checked_div(self.element_size).unwrap_or(0)
    }

    /// Index of a vertex of the body or its embedded surface in per-vertex values.
    pub fn place(&self, vertex: u32) -> usize {
        match vertex.checked_sub(self.skin.start) {
            Some(of_skin) if !self.skin.is_empty() => self.vertex_count() + of_skin as usize,
            _ => (vertex - self.vertices.start) as usize,
        }
    }

    /// Number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.vertices.len()
    }
}

/// Sorted distinct numbers.
fn distinct(numbers: &[u32]) -> Vec<u32> {
    let mut numbers = numbers.to_vec();
    numbers.sort_unstable();
    numbers.dedup();
    numbers
}
