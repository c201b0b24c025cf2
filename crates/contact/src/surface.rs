//! Contact surfaces: vertices, edges and triangles with their areas.

use pliant::topology::DisjointSets;

use crate::vector::{cross, difference, dot, rows};

/// Primitives of a surface, given by vertices.
#[derive(Clone, Copy, Debug, Default)]
pub struct SurfacePrimitives<'a> {
    /// Triangles (3D).
    pub triangles: &'a [[u32; 3]],
    /// Quadrilaterals (3D), each of which becomes two triangles.
    pub quadrilaterals: &'a [[u32; 4]],
    /// Wires: edges that are not sides of a triangle. In 2D also outlines.
    pub edges: &'a [[u32; 2]],
    /// Particles: vertices without triangles and edges.
    pub particles: &'a [u32],
}

/// Role of a vertex in a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum VertexKind {
    /// Corner of triangles; in 2D an end of edges.
    #[default]
    Face,
    /// End of wires only (3D).
    Wire,
    /// Particle.
    Particle,
}

/// Boundary of bodies in 3D (triangles) or 2D (edges), wires and particles, with reference areas.
///
/// A vertex has a third of the area of its triangles, an edge a third of its two triangles. The corners of a
/// quadrilateral share the areas of its two triangles so that a parallelogram gives a quarter to each: the
/// weights of its corners do not depend on the diagonal that splits it. In 2D a vertex has half the length of
/// its edges, one metre deep. Wires and particles have the area that their [thickness](Self::thicken)
/// projects. Pairs weighted by these areas add up to the area in contact.
#[derive(Clone, Debug, Default)]
pub struct ContactSurface {
    /// 2 or 3.
    pub dimension: usize,
    /// Vertices of the surface, ascending.
    pub vertices: Vec<u32>,
    /// Edges `[a, b]` with `a < b`, ascending.
    pub edges: Vec<[u32; 2]>,
    /// Triangles in the order given, then the halves of quadrilaterals; none in 2D.
    pub triangles: Vec<[u32; 3]>,
    /// `n` of each corner of each triangle: the corner takes the area divided by `n`.
    pub corner_parts: Vec<[f64; 3]>,
    /// Reference area of each triangle [m^2].
    pub triangle_areas: Vec<f64>,
    /// Edges of each triangle, in the order `01 12 20` of its vertices.
    pub triangle_edges: Vec<[u32; 3]>,
    /// Area of every vertex of the system [m^2]; zero for interior ones.
    pub vertex_areas: Vec<f64>,
    /// Area of each edge [m^2]; in 2D its length, one metre deep.
    pub edge_areas: Vec<f64>,
    /// Squared reference length of each edge [m^2].
    pub squared_lengths: Vec<f64>,
    /// Triangles at each edge, `u32::MAX` for missing ones.
    pub edge_triangles: Vec<[u32; 2]>,
    /// Edges at each vertex of the system, ascending.
    pub vertex_edges: IncidenceLists,
    /// Triangles at each vertex of the system, ascending.
    pub vertex_triangles: IncidenceLists,
    /// True if the surface continues all around a vertex of the system.
    pub inner_vertices: Vec<bool>,
    /// Role of each vertex of the system in the surface.
    pub kinds: Vec<VertexKind>,
    /// Indices of the wire edges, ascending (3D).
    pub wires: Vec<u32>,
    /// Particles, ascending.
    pub particles: Vec<u32>,
    /// Body of each vertex of the system; pairs within a body are self-contact.
    pub bodies: Vec<u32>,
    /// Radius of each body around its primitives [m]; 0 for bodies not listed.
    pub radii: Vec<f64>,
}

/// Adjacency lists in one array.
#[derive(Clone, Debug, Default)]
pub struct IncidenceLists {
    starts: Vec<u32>,
    numbers: Vec<u32>,
}

impl IncidenceLists {
    /// Inverts groups: list `k` has the indices `i` with `k` in `groups(i)`, ascending.
    fn by_member<const N: usize>(lists: usize, groups: &[[u32; N]]) -> Self {
        let mut starts = vec![0; lists + 1];
        groups.iter().flatten().for_each(|&k| starts[k as usize + 1] += 1);
        for k in 0..lists {
            starts[k + 1] += starts[k];
        }
        let (mut next, mut numbers) = (starts.clone(), vec![0; N * groups.len()]);
        for (i, group) in (0..).zip(groups) {
            for &k in group {
                numbers[next[k as usize] as usize] = i;
                next[k as usize] += 1;
            }
        }
        IncidenceLists { starts, numbers }
    }

    /// List `k`.
    pub fn of(&self, k: u32) -> &[u32] {
        let k = k as usize;
        &self.numbers[self.starts[k] as usize..self.starts[k + 1] as usize]
    }
}

/// Marks a missing triangle.
const NONE: u32 = u32::MAX;

impl ContactSurface {
    /// Surface of these primitives in 3D; `rest` flat `(n, 3)` [m], `bodies` by vertex. Wires and
    /// particles have no area until [`thicken`](Self::thicken).
    pub fn in_space(primitives: &SurfacePrimitives<'_>, rest: &[f64], bodies: &[u32]) -> Self {
        let halves = primitives
            .quadrilaterals
            .iter()
            .flat_map(|&[a, b, c, d]| [([a, b, c], [4.0, 2.0, 4.0]), ([a, c, d], [4.0, 4.0, 2.0])]);
        let whole = primitives.triangles.iter().map(|triangle| (*triangle, [3.0; 3]));
        let (triangles, corner_parts): (Vec<_>, Vec<_>) = whole.chain(halves).unzip();
        let wires = primitives.edges.iter().copied().map(sorted);
        let edges = triangles.iter().flat_map(sides).chain(wires).collect();
        let mut surface = ContactSurface::of_edges(3, edges, primitives.particles, rest, bodies);
        surface.edge_areas = vec![0.0; surface.edges.len()];
        surface.edge_triangles = vec![[NONE; 2]; surface.edges.len()];
        surface.vertex_areas.fill(0.0);
        surface.kinds.fill(VertexKind::Wire);
        for ((t, triangle), parts) in (0..).zip(&triangles).zip(&corner_parts) {
            let area = area(triangle, rest);
            let third = area / 3.0;
            let of_triangle = sides(triangle).map(|edge| surface.edge(edge));
            for (k, e) in of_triangle.into_iter().enumerate() {
                surface.vertex_areas[triangle[k] as usize] += area / parts[k];
                surface.kinds[triangle[k] as usize] = VertexKind::Face;
                surface.edge_areas[e as usize] += third;
                let at = &mut surface.edge_triangles[e as usize];
                at[usize::from(at[0] != NONE)] = t;
            }
            surface.triangle_edges.push(of_triangle);
            surface.triangle_areas.push(area);
        }
        surface.vertex_triangles = IncidenceLists::by_member(surface.bodies.len(), &triangles);
        (surface.triangles, surface.corner_parts) = (triangles, corner_parts);
        surface.wires = (0..surface.edges.len() as u32).filter(|e| surface.is_wire(*e)).collect();
        for &p in primitives.particles {
            surface.kinds[p as usize] = VertexKind::Particle;
        }
        let closed = |e: &u32| surface.is_wire(*e) || surface.is_inner_edge(*e);
        surface.inner_vertices =
            (0..).zip(bodies).map(|(v, _)| surface.vertex_edges.of(v).iter().all(closed)).collect();
        surface
    }

    /// Surface of these edges and particles in 2D; `rest` flat `(n, 2)` [m], `bodies` by vertex.
    pub fn in_plane(primitives: &SurfacePrimitives<'_>, rest: &[f64], bodies: &[u32]) -> Self {
        let edges = primitives.edges.iter().copied().map(sorted).collect();
        let mut surface = ContactSurface::of_edges(2, edges, primitives.particles, rest, bodies);
        surface.edge_areas = surface.squared_lengths.iter().map(|squared| squared.sqrt()).collect();
        for &p in primitives.particles {
            surface.kinds[p as usize] = VertexKind::Particle;
        }
        surface
    }

    fn of_edges(
        dimension: usize,
        mut edges: Vec<[u32; 2]>,
        particles: &[u32],
        rest: &[f64],
        bodies: &[u32],
    ) -> Self {
        edges.sort_unstable();
        edges.dedup();
        let mut particles = particles.to_vec();
        particles.sort_unstable();
        let mut vertices: Vec<u32> = edges.iter().flatten().chain(&particles).copied().collect();
        vertices.sort_unstable();
        vertices.dedup();
        let squared_length = |[a, b]: &[u32; 2]| {
            let (a, b) = (*a as usize * dimension, *b as usize * dimension);
            (0..dimension).map(|k| (rest[a + k] - rest[b + k]) * (rest[a + k] - rest[b + k])).sum()
        };
        // Areas: half of each edge's length at each end.
        let squared_lengths: Vec<f64> = edges.iter().map(squared_length).collect();
        let mut vertex_areas = vec![0.0; bodies.len()];
        for (edge, squared) in edges.iter().zip(&squared_lengths) {
            edge.iter().for_each(|&v| vertex_areas[v as usize] += 0.5 * squared.sqrt());
        }
        let vertex_edges = IncidenceLists::by_member(bodies.len(), &edges);
        let inner_vertices = (0..).zip(bodies).map(|(v, _)| vertex_edges.of(v).len() == 2).collect();
        ContactSurface {
            dimension,
            vertices,
            edges,
            vertex_areas,
            squared_lengths,
            vertex_edges,
            inner_vertices,
            kinds: vec![VertexKind::Face; bodies.len()],
            particles,
            bodies: bodies.to_vec(),
            ..ContactSurface::default()
        }
    }

    /// Sets the radii of bodies [m], and the areas of wires and particles.
    ///
    /// Their effective width `t` is twice the radius plus the activation distance `reach` [m]. A wire of
    /// the length `l` has the area `l t`, half of it at each end; a particle `pi t^2 / 4`, in 2D `t`, one
    /// metre deep. Outlines keep their areas.
    pub fn thicken(&mut self, radii: Vec<f64>, reach: f64) {
        self.radii = radii;
        let width = |v: u32| 2.0 * self.radii[self.bodies[v as usize] as usize] + reach;
        for &e in &self.wires {
            let ends = self.edges[e as usize];
            let area = self.squared_lengths[e as usize].sqrt() * width(ends[0]);
            self.edge_areas[e as usize] = area;
            for v in ends.into_iter().filter(|v| self.kinds[*v as usize] == VertexKind::Wire) {
                self.vertex_areas[v as usize] += 0.5 * area;
            }
        }
        for &p in &self.particles {
            let t = width(p);
            let area = if self.dimension == 3 { 0.25 * std::f64::consts::PI * t * t } else { t };
            self.vertex_areas[p as usize] = area;
        }
    }

    /// Calls `add(vertex, area, normal)` for the parts of the present area at each vertex [m^2], with their
    /// unit normals, at the positions `x`, flat [m].
    pub(crate) fn each_area(&self, x: &[f64], mut add: impl FnMut(u32, f64, [f64; 3])) {
        for (triangle, parts) in self.triangles.iter().zip(&self.corner_parts) {
            let normal = doubled_area(triangle, x);
            let doubled = dot(&normal, &normal).sqrt();
            let unit = normal.map(|n| if doubled > 0.0 { n / doubled } else { 0.0 });
            triangle.iter().zip(parts).for_each(|(v, part)| add(*v, 0.5 * doubled / part, unit));
        }
        let outlines = if self.dimension == 2 { &self.edges[..] } else { &[] };
        for edge in outlines {
            let [a, b] = edge.map(|v| &x[2 * v as usize..][..2]);
            let way = [b[0] - a[0], b[1] - a[1]];
            let length = dot(&way, &way).sqrt();
            let unit = [way[1], -way[0], 0.0].map(|n| if length > 0.0 { n / length } else { 0.0 });
            edge.iter().for_each(|v| add(*v, 0.5 * length, unit));
        }
    }

    /// Area that wires and particles project in the reference configuration [m^2], by vertex.
    pub(crate) fn projected_areas(&self) -> impl Iterator<Item = (u32, f64)> + '_ {
        let is_kept = |v: &&u32| match self.kinds[**v as usize] {
            VertexKind::Face => false,
            VertexKind::Wire => self.dimension == 3,
            VertexKind::Particle => true,
        };
        self.vertices.iter().filter(is_kept).map(|v| (*v, self.vertex_areas[*v as usize]))
    }

    /// Connected component of each vertex of the system, see [`DisjointSets::numbered`]; edges connect
    /// vertices.
    pub(crate) fn pieces(&self) -> Vec<u32> {
        let mut pieces = DisjointSets::new(self.bodies.len());
        self.edges.iter().for_each(|edge| pieces.connect(edge));
        pieces.numbered().0
    }

    /// True for each of `count` bodies with more than one connected component.
    pub(crate) fn divided(&self, pieces: &[u32], count: usize) -> Vec<bool> {
        let (mut first, mut divided) = (vec![None; count], vec![false; count]);
        for &v in &self.vertices {
            let (body, piece) = (self.bodies[v as usize] as usize, pieces[v as usize]);
            divided[body] |= *first[body].get_or_insert(piece) != piece;
        }
        divided
    }

    /// Radius around a vertex of the system [m].
    #[inline]
    pub fn radius(&self, vertex: u32) -> f64 {
        self.radii.get(self.bodies[vertex as usize] as usize).copied().unwrap_or(0.0)
    }

    /// Indices of the edges that are not sides of triangles: wires, in 2D all edges.
    pub fn lone_edges(&self) -> impl Iterator<Item = u32> + '_ {
        let all = if self.dimension == 2 { self.edges.len() as u32 } else { 0 };
        (0..all).chain(self.wires.iter().copied())
    }

    /// True if no triangle meets the edge (3D).
    #[inline]
    pub fn is_wire(&self, edge: u32) -> bool {
        self.edge_triangles[edge as usize][0] == NONE
    }

    /// Index of the edge `[a, b]` with `a < b`, which must be in the surface.
    fn edge(&self, edge: [u32; 2]) -> u32 {
        self.edges.partition_point(|other| *other < edge) as u32
    }

    /// True if two triangles meet at the edge.
    pub fn is_inner_edge(&self, edge: u32) -> bool {
        self.edge_triangles[edge as usize][1] != NONE
    }
}

/// Edge with the lower vertex first.
fn sorted([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// Edges `01 12 20` of a triangle, lower vertex first.
fn sides(&[a, b, c]: &[u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]].map(sorted)
}

fn area(triangle: &[u32; 3], rest: &[f64]) -> f64 {
    let normal = doubled_area(triangle, rest);
    0.5 * dot(&normal, &normal).sqrt()
}

/// Normal of a triangle, as long as twice its area [m^2].
fn doubled_area(triangle: &[u32; 3], x: &[f64]) -> [f64; 3] {
    let [a, b, c] = rows::<3, 3>(x, triangle);
    cross(&difference(&b, &a), &difference(&c, &a))
}
