//! The bodies of a recording and their cells.

use super::{FileInfo, Trajectory};
use crate::RecordError;
use pliant::element::{CELL_KINDS, CellBlock};

/// All bodies.
#[derive(Clone, Debug)]
pub struct RecordedBodies {
    /// The bodies, by ascending vertex range.
    pub bodies: Vec<RecordedBody>,
    /// Number of vertices of all bodies.
    pub vertex_count: usize,
}

/// One body; indices count the vertices of the whole recording.
#[derive(Clone, Debug)]
pub struct RecordedBody {
    /// Name.
    pub name: String,
    /// Its vertices.
    pub vertices: std::ops::Range<u32>,
    /// Springs and segments.
    pub edges: Vec<[u32; 2]>,
    /// Triangles that are cells.
    pub triangles: Vec<[u32; 3]>,
    /// Tetrahedra.
    pub tetrahedra: Vec<[u32; 4]>,
    /// Triangles of second order, corners first.
    pub quadratic_triangles: Vec<[u32; 6]>,
    /// Tetrahedra of second order, corners first.
    pub quadratic_tetrahedra: Vec<[u32; 10]>,
    /// Cells that are no simplices.
    pub blocks: Vec<CellBlock>,
    /// Triangles to draw.
    pub surface: Vec<[u32; 3]>,
}

impl RecordedBody {
    /// The springs, where they are all there is: those of a cloth are the sides of its triangles and their
    /// diagonals.
    pub fn lines(&self) -> &[[u32; 2]] {
        if self.has_cells() { &[] } else { &self.edges }
    }

    /// True if it has neither cells nor springs.
    pub fn is_particles(&self) -> bool {
        self.edges.is_empty() && !self.has_cells()
    }

    fn has_cells(&self) -> bool {
        let linear = !self.blocks.is_empty() || !self.triangles.is_empty() || !self.tetrahedra.is_empty();
        linear || !self.quadratic_triangles.is_empty() || !self.quadratic_tetrahedra.is_empty()
    }
}

impl RecordedBodies {
    /// The bodies of a recording that `info` describes.
    ///
    /// # Errors
    /// [`RecordError::Unexpected`] if the cells do not fit the vertices; [`RecordError::Read`],
    /// [`RecordError::Damaged`].
    pub fn read(trajectory: &mut Trajectory, info: &FileInfo) -> Result<RecordedBodies, RecordError> {
        let vertex_count = trajectory.vertex_count();
        let mut bodies = Vec::new();
        for summary in &info.bodies {
            let name = summary.name.clone();
            let last = summary.first_vertex.checked_add(summary.vertices);
            let Some(last) = last.filter(|&last| last as usize <= vertex_count) else {
                return Err(unexpected(info, "a body has vertices that do not exist"));
            };
            let mut cells = BodyCells { trajectory, info, name: &name, vertex_count };
            let triangles = cells.of("tri")?;
            let tetrahedra = cells.of("tet")?;
            let quadratic_triangles = cells.of("tri6")?;
            let quadratic_tetrahedra = cells.of("tet10")?;
            let blocks = cells.blocks()?;
            let edges = cells.of("edge")?;
            let surface = cells.of("surface")?;
            // It is not written twice where it is all triangles.
            let surface = if surface.is_empty() { triangles.clone() } else { surface };
            let vertices = summary.first_vertex..last;
            bodies.push(RecordedBody {
                name,
                vertices,
                edges,
                triangles,
                tetrahedra,
                quadratic_triangles,
                quadratic_tetrahedra,
                blocks,
                surface,
            });
        }
        Ok(RecordedBodies { bodies, vertex_count })
    }
}

fn unexpected(info: &FileInfo, what: &'static str) -> RecordError {
    RecordError::Unexpected { path: info.path.clone(), what }
}

struct BodyCells<'a> {
    trajectory: &'a mut Trajectory,
    info: &'a FileInfo,
    name: &'a str,
    vertex_count: usize,
}

impl BodyCells<'_> {
    /// The cells of each kind that is no simplex.
    fn blocks(&mut self) -> Result<Vec<CellBlock>, RecordError> {
        let mut blocks = Vec::new();
        for &kind in CELL_KINDS {
            let vertices = self.flat(kind.suffix, kind.nodes)?;
            if !vertices.is_empty() {
                blocks.push(CellBlock { kind, vertices });
            }
        }
        Ok(blocks)
    }

    /// The cells of one kind of simplices; none if the recording has no such attachment.
    fn of<const N: usize>(&mut self, kind: &str) -> Result<Vec<[u32; N]>, RecordError> {
        Ok(self.flat(kind, N)?.as_chunks::<N>().0.to_vec())
    }

    /// The vertices of the cells of a kind, `nodes` each.
    fn flat(&mut self, kind: &str, nodes: usize) -> Result<Vec<u32>, RecordError> {
        let attachment = self.trajectory.attachment(&format!("topology/{}.{kind}.u32", self.name))?;
        let Some(bytes) = attachment else { return Ok(Vec::new()) };
        let (words, rest) = bytes.as_chunks::<4>();
        let indices: Vec<u32> = words.iter().map(|word| u32::from_le_bytes(*word)).collect();
        if !rest.is_empty() || !indices.len().is_multiple_of(nodes) {
            return Err(unexpected(self.info, "the cells of a body are cut off"));
        }
        if indices.iter().any(|&vertex| vertex as usize >= self.vertex_count) {
            return Err(unexpected(self.info, "a cell has a vertex that does not exist"));
        }
        Ok(indices)
    }
}
