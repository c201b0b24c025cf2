//! Surfaces that touch: their vertices, edges and triangles, and the area that each stands for.

/// Boundary of bodies in space (triangles) or in the plane (edges), with areas at rest.
///
/// A vertex has a third of the area of its triangles, an edge a third of its two triangles; in the plane a
/// vertex has half the length of its edges, one metre deep. Pairs weighted by them add up to the area in
/// contact.
#[derive(Clone, Debug, Default)]
pub struct ContactSurface {
    /// 2 or 3.
    pub dimension: usize,
    /// Vertices of the surface, ascending.
    pub vertices: Vec<u32>,
    /// Edges `[a, b]` with `a < b`, ascending.
    pub edges: Vec<[u32; 2]>,
    /// Triangles, as they were given; none in the plane.
    pub triangles: Vec<[u32; 3]>,
    /// Area of each triangle at rest [m^2].
    pub triangle_areas: Vec<f64>,
    /// Edges of each triangle, in the order `01 12 20` of its vertices.
    pub triangle_edges: Vec<[u32; 3]>,
    /// Area of every vertex of the system [m^2]; zero for those inside.
    pub vertex_areas: Vec<f64>,
    /// Area of each edge [m^2].
    pub edge_areas: Vec<f64>,
    /// Squared length of each edge at rest [m^2].
    pub squared_lengths: Vec<f64>,
    /// Triangles at each edge, `u32::MAX` where there are fewer than two.
    pub edge_triangles: Vec<[u32; 2]>,
    /// Edges at each vertex of the system, ascending.
    pub vertex_edges: IncidenceLists,
    /// Triangles at each vertex of the system, ascending.
    pub vertex_triangles: IncidenceLists,
    /// Whether the surface goes on around each vertex of the system.
    pub inner_vertices: Vec<bool>,
    /// Body of each vertex of the system; pairs of one body are self-contact.
    pub bodies: Vec<u32>,
}

/// IncidenceLists of numbers, one after the other.
#[derive(Clone, Debug, Default)]
pub struct IncidenceLists {
    starts: Vec<u32>,
    numbers: Vec<u32>,
}

impl IncidenceLists {
    /// Members of the groups: list `k` has the members `i` with `k` in `groups(i)`, ascending.
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

/// No triangle.
const NONE: u32 = u32::MAX;

impl ContactSurface {
    /// Surface of triangles in space; `rest` flat `(n, 3)` [m], `bodies` by vertex.
    pub fn of_triangles(triangles: &[[u32; 3]], rest: &[f64], bodies: &[u32]) -> Self {
        let mut edges: Vec<[u32; 2]> = triangles.iter().flat_map(sides).collect();
        edges.sort_unstable();
        edges.dedup();
        let mut surface = ContactSurface::of_edges(3, edges, rest, bodies);
        surface.edge_areas = vec![0.0; surface.edges.len()];
        surface.edge_triangles = vec![[NONE; 2]; surface.edges.len()];
        surface.vertex_areas.fill(0.0);
        for (t, triangle) in (0..).zip(triangles) {
            let third = area(triangle, rest) / 3.0;
            let of_triangle = sides(triangle).map(|edge| surface.edge(edge));
            for (k, e) in of_triangle.into_iter().enumerate() {
                surface.vertex_areas[triangle[k] as usize] += third;
                surface.edge_areas[e as usize] += third;
                let at = &mut surface.edge_triangles[e as usize];
                at[usize::from(at[0] != NONE)] = t;
            }
            surface.triangle_edges.push(of_triangle);
            surface.triangle_areas.push(3.0 * third);
        }
        surface.triangles = triangles.to_vec();
        surface.vertex_triangles = IncidenceLists::by_member(surface.bodies.len(), triangles);
        let closed = |e: &u32| surface.edge_triangles[*e as usize][1] != NONE;
        surface.inner_vertices =
            (0..).zip(bodies).map(|(v, _)| surface.vertex_edges.of(v).iter().all(closed)).collect();
        surface
    }

    /// Boundary of edges in the plane; `rest` flat `(n, 2)` [m], `bodies` by vertex.
    pub fn of_plane_edges(edges: &[[u32; 2]], rest: &[f64], bodies: &[u32]) -> Self {
        let mut edges: Vec<[u32; 2]> = edges.iter().map(|&[a, b]| [a.min(b), a.max(b)]).collect();
        edges.sort_unstable();
        edges.dedup();
        ContactSurface::of_edges(2, edges, rest, bodies)
    }

    fn of_edges(dimension: usize, edges: Vec<[u32; 2]>, rest: &[f64], bodies: &[u32]) -> Self {
        let mut vertices: Vec<u32> = edges.iter().flatten().copied().collect();
        vertices.sort_unstable();
        vertices.dedup();
        let squared_length = |[a, b]: &[u32; 2]| {
            let (a, b) = (*a as usize * dimension, *b as usize * dimension);
            (0..dimension).map(|k| (rest[a + k] - rest[b + k]) * (rest[a + k] - rest[b + k])).sum()
        };
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
            bodies: bodies.to_vec(),
            ..ContactSurface::default()
        }
    }

    /// Number of the edge `[a, b]` with `a < b`, which is one of the surface.
    fn edge(&self, edge: [u32; 2]) -> u32 {
        self.edges.partition_point(|other| *other < edge) as u32
    }

    /// True if two triangles meet at the edge.
    pub fn is_inner_edge(&self, edge: u32) -> bool {
        self.edge_triangles[edge as usize][1] != NONE
    }
}

/// Edges `01 12 20` of a triangle, lower vertex first.
fn sides(&[a, b, c]: &[u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]].map(|[a, b]| [a.min(b), a.max(b)])
}

fn area(triangle: &[u32; 3], rest: &[f64]) -> f64 {
    let [a, b, c] = triangle.map(|v| {
        let row = &rest[3 * v as usize..][..3];
        [row[0], row[1], row[2]]
    });
    let (u, v) = (crate::vector::difference(&b, &a), crate::vector::difference(&c, &a));
    let normal = crate::vector::cross(&u, &v);
    0.5 * crate::vector::dot(&normal, &normal).sqrt()
}
