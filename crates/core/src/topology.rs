//! Topology of a simulation for readers of its output: the vertices of each body and the cells between them.
//! It is fixed for the length of a run.

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
    /// In a body of second order the vertices in the middle of the edges `01, 12, 20` of each triangle;
    /// otherwise empty.
    pub triangle_middles: Vec<[u32; 3]>,
    /// In a body of second order the vertices in the middle of the edges `01, 12, 02, 03, 13, 23` of each
    /// tetrahedron; otherwise empty.
    pub tetrahedron_middles: Vec<[u32; 6]>,
    /// Cells that are no simplices: the elements of a body of quadrilaterals or hexahedra.
    pub blocks: Vec<CellBlock>,
    /// Triangles to draw: the boundary of a solid, all of a cloth; four flat ones for each curved one.
    pub surface: Vec<[u32; 3]>,
    /// Surface that is drawn in its place.
    pub skin: Option<Skin>,
}

/// A surface that rides along with the elements of a body: each of its vertices is a fixed mean of the nodes
/// of one element, `x = sum_a w_a x_a`, and therefore moves as the element does.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Skin {
    /// Triangles, counter-clockwise seen from outside, by vertices of the skin from 0.
    pub triangles: Vec<[u32; 3]>,
    /// Element of the body that each triangle is in or nearest to, `(triangles,)`.
    pub elements: Vec<u32>,
    /// Number of nodes of a vertex.
    pub width: usize,
    /// Nodes of each vertex, flat `(vertices, width)`.
    pub nodes: Vec<u32>,
    /// Weights of these, flat `(vertices, width)`; those of a vertex sum to 1, and may be negative for one
    /// that lies outside of its element.
    pub weights: Vec<f64>,
}

impl Skin {
    /// Number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.nodes.len().checked_div(self.width).unwrap_or(0)
    }

    /// A quantity at a vertex from that of all nodes, flat `(n, D)`: its position from their positions.
    pub fn interpolated<const D: usize>(&self, vertex: usize, values: &[f64]) -> [f64; D] {
        let range = vertex * self.width..(vertex + 1) * self.width;
        let mut sum = [0.0; D];
        for (node, weight) in self.nodes[range.clone()].iter().zip(&self.weights[range]) {
            let value = &values[*node as usize * D..][..D];
            sum.iter_mut().zip(value).for_each(|(sum, value)| *sum += weight * value);
        }
        sum
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.triangles[..])
            + size_of_val(&self.elements[..])
            + size_of_val(&self.nodes[..])
            + size_of_val(&self.weights[..])
    }
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
        let skin = self.skin.iter().flat_map(|skin| &skin.nodes);
        edges.chain(triangles).chain(tetrahedra).chain(middles).chain(blocks).chain(skin).copied().max()
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
            + self.skin.as_ref().map_or(0, Skin::bytes)
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

/// Sets of things that links hold together, by joining trees; Tarjan 1975, "Efficiency of a good but not
/// linear set union algorithm".
#[derive(Clone, Debug)]
pub struct DisjointSets {
    /// Another thing of the same piece with a lower number, or the thing itself.
    above: Vec<u32>,
}

impl DisjointSets {
    /// As many pieces as things.
    pub fn new(things: usize) -> Self {
        DisjointSets { above: (0..things as u32).collect() }
    }

    /// Joins the pieces of all members of a link.
    pub fn connect(&mut self, link: &[u32]) {
        for pair in link.windows(2) {
            let (a, b) = (self.first(pair[0]), self.first(pair[1]));
            self.above[a.max(b) as usize] = a.min(b);
        }
    }

    /// The first thing of the piece that this one is in.
    pub fn first(&mut self, mut thing: u32) -> u32 {
        while self.above[thing as usize] != thing {
            // Paths are halved on the way.
            let next = self.above[self.above[thing as usize] as usize];
            self.above[thing as usize] = next;
            thing = next;
        }
        thing
    }

    /// Number of pieces.
    pub fn count(&self) -> usize {
        (0..).zip(&self.above).filter(|(thing, above)| thing == *above).count()
    }

    /// Number of the piece of each thing, from 0 in the order of their first things, and the number of
    /// pieces.
    pub fn numbered(mut self) -> (Vec<u32>, usize) {
        let (mut numbers, mut count) = (vec![0; self.above.len()], 0);
        for thing in 0..self.above.len() as u32 {
            let first = self.first(thing);
            numbers[thing as usize] = if first == thing { count as u32 } else { numbers[first as usize] };
            count += usize::from(first == thing);
        }
        (numbers, count)
    }
}
