//! Topology of a simulation for readers of its output: the vertices of each body and the cells between them.
//! It is fixed for the length of a run.

use std::ops::Range;

use crate::element::CellBlock;

/// Kind of a body.
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
    /// A fixed body without interior elements, which others cannot penetrate.
    Obstacle,
}

/// One body. All indices count the vertices of the whole simulation, not those of the body.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyTopology {
    /// Name, unique in the simulation.
    pub name: String,
    /// Kind of the body.
    pub kind: BodyKind,
    /// Range of its vertices.
    pub vertices: Range<u32>,
    /// Springs and segments; drawn as lines.
    pub edges: Vec<[u32; 2]>,
    /// Triangles that are cells (2D solids, cloth).
    pub triangles: Vec<[u32; 3]>,
    /// Tetrahedra.
    pub tetrahedra: Vec<[u32; 4]>,
    /// Vertices in the middle of the edges `01, 12, 20` of each triangle in a second-order body; otherwise
    /// empty.
    pub triangle_middles: Vec<[u32; 3]>,
    /// Vertices in the middle of the edges `01, 12, 02, 03, 13, 23` of each tetrahedron in a second-order
    /// body; otherwise empty.
    pub tetrahedron_middles: Vec<[u32; 6]>,
    /// Cells that are no simplices: the elements of a body of quadrilaterals or hexahedra.
    pub blocks: Vec<CellBlock>,
    /// Triangles to draw: the boundary of a solid, all of a cloth; four flat ones for each curved one.
    pub surface: Vec<[u32; 3]>,
    /// Embedded surface that is drawn in its place.
    pub skin: Option<Skin>,
}

/// An embedded surface: each of its vertices is a fixed weighted sum of the nodes of one element, `x = sum_a
/// w_a x_a`, and therefore moves with the element.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Skin {
    /// Triangles, counter-clockwise seen from outside, by vertices of the skin from 0.
    pub triangles: Vec<[u32; 3]>,
    /// Element that contains each triangle or is nearest to it, `(triangles,)`.
    pub elements: Vec<u32>,
    /// Number of nodes of a vertex.
    pub width: usize,
    /// Nodes of each vertex, flat `(vertices, width)`.
    pub nodes: Vec<u32>,
    /// Weights of these nodes, flat `(vertices, width)`. Those of a vertex sum to 1; they may be negative for
    /// a vertex outside its element.
    pub weights: Vec<f64>,
}

impl Skin {
    /// Number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.nodes.len().checked_div(self.width).unwrap_or(0)
    }

    /// Interpolates a quantity at a vertex from that of all nodes, flat `(n, D)`, for example positions.
    pub fn interpolated<const D: usize>(&self, vertex: usize, values: &[f64]) -> [f64; D] {
        let range = vertex * self.width..(vertex + 1) * self.width;
        let mut sum = [0.0; D];
        for (node, weight) in self.nodes[range.clone()].iter().zip(&self.weights[range]) {
            let value = &values[*node as usize * D..][..D];
            sum.iter_mut().zip(value).for_each(|(sum, value)| *sum += weight * value);
        }
        sum
    }
}

impl BodyTopology {
    /// Corners of the body's finite elements, one element after the other, and the number of corners of each;
    /// `None` without elements. `dimension` is that of the simulation.
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
}

/// All bodies of a simulation.
#[derive(Clone, Debug, PartialEq)]
pub struct Topology {
    /// 2 or 3.
    pub dimension: usize,
    /// Number of vertices of all bodies.
    pub vertex_count: usize,
    /// Reference positions, flat `(vertex_count, dimension)` [m].
    pub rest_positions: Vec<f64>,
    /// Mass of each vertex [kg]; empty if it is not needed.
    pub masses: Vec<f64>,
    /// The bodies, by ascending vertex range.
    pub bodies: Vec<BodyTopology>,
}

/// Disjoint sets of items joined by links (union-find); Tarjan 1975, "Efficiency of a good but not linear set
/// union algorithm".
#[derive(Clone, Debug)]
pub struct DisjointSets {
    /// Another item of the same set with a lower number, or the item itself.
    above: Vec<u32>,
}

impl DisjointSets {
    /// Creates one set for each item.
    pub fn new(things: usize) -> Self {
        DisjointSets { above: (0..things as u32).collect() }
    }

    /// Joins the sets of all members of a link.
    pub fn connect(&mut self, link: &[u32]) {
        for pair in link.windows(2) {
            let (a, b) = (self.first(pair[0]), self.first(pair[1]));
            self.above[a.max(b) as usize] = a.min(b);
        }
    }

    /// First item of the set that contains this one.
    pub fn first(&mut self, mut thing: u32) -> u32 {
        while self.above[thing as usize] != thing {
            // Paths are halved on the way.
            let next = self.above[self.above[thing as usize] as usize];
            self.above[thing as usize] = next;
            thing = next;
        }
        thing
    }

    /// Number of sets.
    pub fn count(&self) -> usize {
        (0..).zip(&self.above).filter(|(thing, above)| thing == *above).count()
    }

    /// Set number of each item, from 0 in the order of their first items, and the number of sets.
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
