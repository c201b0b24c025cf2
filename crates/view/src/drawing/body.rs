//! Bodies as triangles, lines and points.

use std::ops::Range;

use pliant_record::read::{RecordedBody, RecordedSkin};

use super::elements::Elements;

/// One body; vertices are numbered as in the whole recording.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnBody {
    /// Name, unique in the recording.
    pub name: String,
    /// Its vertices.
    pub vertices: Range<u32>,
    /// Vertices of its skin, which follow those of the recording; empty without one.
    pub skin: Range<u32>,
    /// Triangles of its skin or surface, counter-clockwise seen from outside; of cells of second order four
    /// flat ones for each curved side.
    pub triangles: Vec<[u32; 3]>,
    /// Element of each triangle, by its number in the body; `None` without elements.
    pub elements: Option<Vec<u32>>,
    /// Vertices of the boundary that the skin covers, ascending.
    pub beneath: Vec<u32>,
    /// Segments of strands and nets: springs of a body without cells.
    pub lines: Vec<[u32; 2]>,
    /// Particles: all vertices of a body with neither cells nor springs.
    pub points: Vec<u32>,
    /// Vertices of each element, flat.
    pub element_vertices: Vec<u32>,
    /// Vertices of one element; 0 without elements.
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

    /// Number of cells that may be elements.
    pub fn element_count(&self) -> usize {
        self.element_vertices.len().checked_div(self.element_size).unwrap_or(0)
    }

    /// Place of a vertex of the body or of its skin among numbers of its vertices.
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

/// Ascending, each once.
fn distinct(numbers: &[u32]) -> Vec<u32> {
    let mut numbers = numbers.to_vec();
    numbers.sort_unstable();
    numbers.dedup();
    numbers
}
