//! What a simulation is made of, as a reader of its output needs it: which vertices belong together, and the cells
//! between them. Fixed for the length of a run.

use std::ops::Range;

use crate::element::CellBlock;

/// What kind of thing a body is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum BodyKind {
    /// Filled with triangles or quadrilaterals (2D), tetrahedra or hexahedra (3D).
    Solid,
    /// A surface in space, of finite elements.
    Membrane,
    /// A surface in space, of springs.
    Cloth,
    /// A curve.
    Strand,
    /// A net of springs without cells.
    Springs,
    /// Vertices without any connection.
    Particles,
    /// Held, and nothing inside: what others cannot enter.
    Obstacle,
}

/// One body. All indices count the vertices of the whole simulation, not those of the body.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyTopology {
    /// Name, unique in the simulation.
    pub name: String,
    /// What it is.
    pub kind: BodyKind,
    /// Its vertices.
    pub vertices: Range<u32>,
    /// Springs and segments; drawn as lines.
    pub edges: Vec<[u32; 2]>,
    /// Triangles that are cells (2D solids, cloth).
    pub triangles: Vec<[u32; 3]>,
    /// Tetrahedra.
    pub tetrahedra: Vec<[u32; 4]>,
    /// In a body of second order the vertices in the middle of the edges `01, 12, 20` of each triangle; otherwise empty.
    pub triangle_middles: Vec<[u32; 3]>,
    /// In a body of second order the vertices in the middle of the edges `01, 12, 02, 03, 13, 23` of each tetrahedron; otherwise
    /// empty.
    pub tetrahedron_middles: Vec<[u32; 6]>,
    /// Cells that are no simplices: the elements of a body of quadrilaterals or hexahedra.
    pub blocks: Vec<CellBlock>,
    /// Triangles to draw: the boundary of a solid, all of a cloth; four flat ones for each curved one.
    pub surface: Vec<[u32; 3]>,
}

impl BodyTopology {
    /// The corners of its finite elements, one element after the other, and how many corners each has; `None`
    /// without elements. In a simulation of this `dimension`.
    pub fn elements(&self, dimension: usize) -> Option<(&[u32], usize)> {
        match (self.kind, dimension) {
            (BodyKind::Solid, _) if !self.blocks.is_empty() => {
                self.blocks.first().map(|block| (&block.vertices[..], block.kind.nodes))
            }
            (BodyKind::Solid, 3) => Some((self.tetrahedra.as_flattened(), 4)),
            (BodyKind::Solid | BodyKind::Membrane, _) => Some((self.triangles.as_flattened(), 3)),
            _ => None,
        }
    }

    /// The largest vertex index of any cell.
    pub fn largest_index(&self) -> Option<u32> {
        let edges = self.edges.iter().flatten();
        let triangles = self.triangles.iter().chain(&self.surface).flatten();
        let tetrahedra = self.tetrahedra.iter().flatten();
        let middles = self.triangle_middles.iter().flatten().chain(self.tetrahedron_middles.iter().flatten());
        let blocks = self.blocks.iter().flat_map(|block| &block.vertices);
        edges.chain(triangles).chain(tetrahedra).chain(middles).chain(blocks).copied().max()
    }

    /// Bytes of its cells.
    fn bytes(&self) -> usize {
        size_of_val(&self.edges[..])
            + size_of_val(&self.triangles[..])
            + size_of_val(&self.tetrahedra[..])
            + size_of_val(&self.triangle_middles[..])
            + size_of_val(&self.tetrahedron_middles[..])
            + self.blocks.iter().map(|block| size_of_val(&block.vertices[..])).sum::<usize>()
            + size_of_val(&self.surface[..])
    }
}

impl Topology {
    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let bodies: usize = self.bodies.iter().map(BodyTopology::bytes).sum();
        bodies + 8 * (self.rest_positions.len() + self.masses.len())
    }
}

/// All bodies of a simulation.
#[derive(Clone, Debug, PartialEq)]
pub struct Topology {
    /// 2 or 3.
    pub dimension: usize,
    /// Number of vertices of all bodies.
    pub vertex_count: usize,
    /// Rest positions, flat `(vertex_count, dimension)` [m].
    pub rest_positions: Vec<f64>,
    /// Mass of each vertex [kg]; empty where it is not needed.
    pub masses: Vec<f64>,
    /// The bodies, by ascending vertex range.
    pub bodies: Vec<BodyTopology>,
}
