//! Bodies of a recording with their elements.

use super::{FileInfo, Trajectory};
use crate::RecordError;
use pliant::element::{CELL_KINDS, CellBlock};
use pliant::topology::Skin;

/// All bodies of a recording.
#[derive(Clone, Debug)]
pub struct RecordedBodies {
    /// Bodies by ascending vertex range.
    pub bodies: Vec<RecordedBody>,
    /// Number of vertices of all bodies.
    pub vertex_count: usize,
}

/// Body of a recording; indices count the vertices of the whole recording.
#[derive(Clone, Debug)]
pub struct RecordedBody {
    /// Name.
    pub name: String,
    /// Vertex range.
    pub vertices: std::ops::Range<u32>,
    /// Springs and segments.
    pub edges: Vec<[u32; 2]>,
    /// Triangles that are elements.
    pub triangles: Vec<[u32; 3]>,
    /// Tetrahedra.
    pub tetrahedra: Vec<[u32; 4]>,
    /// Second-order triangles, corners first.
    pub quadratic_triangles: Vec<[u32; 6]>,
    /// Second-order tetrahedra, corners first.
    pub quadratic_tetrahedra: Vec<[u32; 10]>,
    /// Elements that are not simplices.
    pub blocks: Vec<CellBlock>,
    /// Boundary of the elements.
    pub surface: Vec<[u32; 3]>,
    /// Embedded surface, drawn instead of the boundary.
    pub skin: Option<RecordedSkin>,
}

/// Embedded surface with the index of its first vertex; its vertices are numbered after those of the
/// recording.
#[derive(Clone, Debug)]
pub struct RecordedSkin {
    /// Embedded surface.
    pub skin: Skin,
    /// Index of its first vertex.
    pub first_vertex: u32,
}

impl RecordedSkin {
    /// Triangles, numbered as in the recording.
    pub fn triangles(&self) -> Vec<[u32; 3]> {
        self.skin.triangles.iter().map(|triangle| triangle.map(|v| self.first_vertex + v)).collect()
    }

    /// Vertex range.
    pub fn vertices(&self) -> std::ops::Range<u32> {
        self.first_vertex..self.first_vertex + self.skin.vertex_count() as u32
    }
}

impl RecordedBody {
    /// Springs to draw, if there are no elements: those of a cloth are sides and diagonals of its
    /// triangles.
    pub fn lines(&self) -> &[[u32; 2]] {
        if self.has_cells() { &[] } else { &self.edges }
    }

    /// Triangles to draw: those of the embedded surface, otherwise of the boundary.
    pub fn drawn(&self) -> Vec<[u32; 3]> {
        self.skin.as_ref().map_or_else(|| self.surface.clone(), RecordedSkin::triangles)
    }

    /// True if the body has neither elements nor springs.
    pub fn is_particles(&self) -> bool {
        self.edges.is_empty() && !self.has_cells()
    }

    fn has_cells(&self) -> bool {
        let linear = !self.blocks.is_empty() || !self.triangles.is_empty() || !self.tetrahedra.is_empty();
        linear || !self.quadratic_triangles.is_empty() || !self.quadratic_tetrahedra.is_empty()
    }
}

impl RecordedBodies {
    /// Reads the bodies of a recording that `info` describes.
    ///
    /// # Errors
    /// [`RecordError::Unexpected`] if the elements do not fit the vertices; [`RecordError::Read`],
    /// [`RecordError::Damaged`].
    pub fn read(trajectory: &mut Trajectory, info: &FileInfo) -> Result<RecordedBodies, RecordError> {
        let vertex_count = trajectory.vertex_count();
        let mut bodies = Vec::new();
        let mut next = vertex_count;
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
            // The surface is not stored if it is all triangles.
            let surface = if surface.is_empty() { triangles.clone() } else { surface };
            let vertices = summary.first_vertex..last;
            let skin = cells.skin()?.map(|skin| RecordedSkin { skin, first_vertex: next as u32 });
            next += skin.as_ref().map_or(0, |skin| skin.skin.vertex_count());
            if u32::try_from(next).is_err() {
                return Err(unexpected(info, "skins have more vertices than can be numbered"));
            }
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
                skin,
            });
        }
        Ok(RecordedBodies { bodies, vertex_count })
    }

    /// Appends to a quantity of all vertices, flat `(vertex_count, D)`, its values at the vertices of
    /// embedded surfaces.
    pub fn with_skins<const D: usize>(&self, mut values: Vec<f64>) -> Vec<f64> {
        for recorded in self.bodies.iter().filter_map(|body| body.skin.as_ref()) {
            for vertex in 0..recorded.skin.vertex_count() {
                let value: [f64; D] = recorded.skin.interpolated(vertex, &values);
                values.extend(value);
            }
        }
        values
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
    /// Elements of each kind that is not a simplex.
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

    /// Embedded surface; `None` if the recording has none.
    fn skin(&mut self) -> Result<Option<Skin>, RecordError> {
        let (elements, nodes) = (self.words("skin_element")?, self.flat("skin_node", 1)?);
        let triangles = self.words("skin")?.as_chunks::<3>().0.to_vec();
        let name = format!("topology/{}.skin_weight.f64", self.name);
        let Some(bytes) = self.trajectory.attachment(&name)? else { return Ok(None) };
        let weights: Vec<f64> =
            bytes.as_chunks::<8>().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect();
        // The vertices are those named by triangles, each with the same number of nodes.
        let vertices = triangles.as_flattened().iter().max().map_or(0, |largest| *largest as usize + 1);
        let width = nodes.len().checked_div(vertices).unwrap_or(0);
        let fits = nodes.len() == width * vertices && weights.len() == nodes.len();
        if !fits || width == 0 || elements.len() != triangles.len() {
            return Err(unexpected(self.info, "the skin of a body is cut off"));
        }
        Ok(Some(Skin { triangles, elements, width, nodes, weights }))
    }

    /// Numbers in an attachment of a body.
    fn words(&mut self, kind: &str) -> Result<Vec<u32>, RecordError> {
        let attachment = self.trajectory.attachment(&format!("topology/{}.{kind}.u32", self.name))?;
        let bytes = attachment.unwrap_or_default();
        let (words, rest) = bytes.as_chunks::<4>();
        if !rest.is_empty() {
            return Err(unexpected(self.info, "the cells of a body are cut off"));
        }
        Ok(words.iter().map(|word| u32::from_le_bytes(*word)).collect())
    }

    /// Elements of one simplex kind; empty if the recording has no such attachment.
    fn of<const N: usize>(&mut self, kind: &str) -> Result<Vec<[u32; N]>, RecordError> {
        Ok(self.flat(kind, N)?.as_chunks::<N>().0.to_vec())
    }

    /// Vertices of the elements of a kind, `nodes` each.
    fn flat(&mut self, kind: &str, nodes: usize) -> Result<Vec<u32>, RecordError> {
        let indices = self.words(kind)?;
        if !indices.len().is_multiple_of(nodes) {
            return Err(unexpected(self.info, "the cells of a body are cut off"));
        }
        if indices.iter().any(|&vertex| vertex as usize >= self.vertex_count) {
            return Err(unexpected(self.info, "a cell has a vertex that does not exist"));
        }
        Ok(indices)
    }
}
