//! Stencils of contact: weighted pairs within reach, duplicates subtracted and equal pairs merged.
//!
//! A point over an edge has the same distance from two triangles. [`Duplicates::Sum`] counts both.
//! [`Duplicates::Max`] subtracts inner edges and adds inner vertices, so that flat and convex surfaces
//! are counted once (Li et al. 2023, arXiv 2307.15908). Pairs of edges weigh `w_e / 4` from each side;
//! where `n` edges of the other side meet at a vertex, `n - 1` of them are subtracted.
//!
//! Wires and particles have no triangles of their own. Against triangles the ends of a wire weigh `w_p /
//! 2` and its edges `w_e / 2`, against other wires half as much from each side. Particles weigh `w_p`
//! against everything, the mean of both against each other.

use crate::candidates::CandidatePairs;
use crate::closest::{InnerKind, InnerPair, Primitives};
use crate::model::Duplicates;
use crate::mollifier::{MollifiedPair, parallel_limit, squared_cross};
use crate::packs::{Screen, closest_points, screen};
use crate::pair::{EdgeEdge, PointEdge, PointTriangle};
use crate::surface::{ContactSurface, VertexKind};
use crate::vector::rows;

/// Pair of `N` vertices whose closest points are interior, with its weight [m^2].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WeightedPair<const N: usize> {
    /// The point first, then the others; for edges two vertices each.
    pub vertices: [u32; N],
    /// Sum of the weights; negative in concave corners.
    pub weight: f64,
}

/// Contact stencils, each list sorted by vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ContactStencils {
    /// Pairs of points.
    pub point_point: Vec<WeightedPair<2>>,
    /// Points and edges.
    pub point_edge: Vec<WeightedPair<3>>,
    /// Points and triangles.
    pub point_triangle: Vec<WeightedPair<4>>,
    /// Pairs of edges.
    pub edge_edge: Vec<WeightedPair<4>>,
    /// Pairs of nearly parallel edges, not merged.
    pub mollified: Vec<MollifiedPair>,
}

/// Primitive whose area enters a weight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum AreaOf {
    /// Vertex of the system.
    Vertex(u32),
    /// Edge by index.
    Edge(u32),
    /// Triangle by index.
    Triangle(u32),
}

/// Fraction of an area that enters a weight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AreaPart {
    pub(crate) of: AreaOf,
    pub(crate) part: f64,
}

impl AreaPart {
    /// Fraction of the area of a vertex of the system.
    pub(crate) fn of_vertex(vertex: u32, part: f64) -> Self {
        AreaPart { of: AreaOf::Vertex(vertex), part }
    }

    /// Multiple of this fraction.
    fn times(self, factor: f64) -> Self {
        AreaPart { part: self.part * factor, ..self }
    }
}

/// Receiver of the pairs that a search finds, before equal ones are merged.
pub(crate) trait PairSink {
    /// Takes the interior pair of these vertices; its weight is the sum of the parts.
    fn pair(&mut self, vertices: &[u32; 4], inner: &InnerPair, parts: &[AreaPart]);

    /// Takes two nearly parallel edges by index.
    fn parallel(&mut self, edges: [u32; 2], inner: &InnerPair, parts: &[AreaPart]);
}

/// Sink that collects weighted stencils.
pub(crate) struct WeightedPairs<'a> {
    pub(crate) surface: &'a ContactSurface,
    pub(crate) stencils: ContactStencils,
}

impl PairSink for WeightedPairs<'_> {
    fn pair(&mut self, vertices: &[u32; 4], inner: &InnerPair, parts: &[AreaPart]) {
        self.stencils.push(vertices, inner, self.surface.weight(parts));
    }

    fn parallel(&mut self, edges: [u32; 2], inner: &InnerPair, parts: &[AreaPart]) {
        let pair = self.surface.parallel_pair(edges, inner, self.surface.weight(parts));
        self.stencils.mollified.push(pair);
    }
}

impl ContactSurface {
    /// Sum of area fractions [m^2].
    #[inline]
    pub(crate) fn weight(&self, parts: &[AreaPart]) -> f64 {
        let area = |of: AreaOf| match of {
            AreaOf::Vertex(v) => self.vertex_areas[v as usize],
            AreaOf::Edge(e) => self.edge_areas[e as usize],
            AreaOf::Triangle(t) => self.triangle_areas[t as usize],
        };
        parts.iter().fold(0.0, |sum, part| sum + part.part * area(part.of))
    }

    /// Pair of nearly parallel edges `a < b` of this weight [m^2].
    pub(crate) fn parallel_pair(&self, [a, b]: [u32; 2], inner: &InnerPair, weight: f64) -> MollifiedPair {
        let [[p, q], [r, s]] = [a, b].map(|e| self.edges[e as usize]);
        let [of_a, of_b] = [a, b].map(|e| self.squared_lengths[e as usize]);
        MollifiedPair { vertices: [p, q, r, s], inner: *inner, weight, limit: parallel_limit(of_a, of_b) }
    }
}

/// Weights that cancel to less than this fraction of the sum of magnitudes are dropped.
const CANCELLED: f64 = 1e-12;

impl ContactStencils {
    /// Finds the stencils among the candidates whose gap, the distance minus the radii, is below `reach`
    /// [m] at `x`, flat `(n, D)` [m].
    pub fn find<const D: usize>(
        surface: &ContactSurface,
        candidates: &CandidatePairs,
        x: &[f64],
        reach: f64,
        duplicates: Duplicates,
    ) -> Self {
        let mut pairs = WeightedPairs { surface, stencils: Self::default() };
        find_pairs::<D>(surface, candidates, x, (reach, duplicates), &mut pairs);
        let mut found = pairs.stencils;
        found.merge();
        found
    }

    /// Sorts all lists and adds the weights of equal pairs.
    pub(crate) fn merge(&mut self) {
        merge(&mut self.point_point);
        merge(&mut self.point_edge);
        merge(&mut self.point_triangle);
        merge(&mut self.edge_edge);
        self.mollified.sort_by_key(|pair| (pair.vertices, pair.inner.slots));
    }

    /// True if the single pair of `one` is included with a positive weight; `self` must be merged.
    pub(crate) fn has_like(&self, one: &Self) -> bool {
        fn has<const N: usize>(all: &[WeightedPair<N>], one: &[WeightedPair<N>]) -> bool {
            let found = one.first().map(|one| all.binary_search_by_key(&one.vertices, |pair| pair.vertices));
            matches!(found, Some(Ok(at)) if all[at].weight > 0.0)
        }
        has(&self.point_point, &one.point_point)
            || has(&self.point_edge, &one.point_edge)
            || has(&self.point_triangle, &one.point_triangle)
            || has(&self.edge_edge, &one.edge_edge)
    }

    /// Removes all stencils.
    pub(crate) fn clear(&mut self) {
        self.point_point.clear();
        self.point_edge.clear();
        self.point_triangle.clear();
        self.edge_edge.clear();
        self.mollified.clear();
    }

    /// Adds the interior pair of these vertices, ordered so that equal pairs compare equal.
    pub(crate) fn push(&mut self, vertices: &[u32; 4], inner: &InnerPair, weight: f64) {
        let [p, q, r, s] = inner.slots.map(|slot| vertices[slot]);
        match inner.kind {
            InnerKind::PointPoint => {
                self.point_point.push(WeightedPair { vertices: [p.min(q), p.max(q)], weight });
            }
            InnerKind::PointEdge => {
                self.point_edge.push(WeightedPair { vertices: [p, q.min(r), q.max(r)], weight });
            }
            InnerKind::PointTriangle => {
                let mut corners = [q, r, s];
                corners.sort_unstable();
                let [q, r, s] = corners;
                self.point_triangle.push(WeightedPair { vertices: [p, q, r, s], weight });
            }
            InnerKind::EdgeEdge => {
                self.edge_edge.push(WeightedPair { vertices: [p, q, r, s], weight });
            }
        }
    }
}

/// Sorts by vertices and adds the weights of equal pairs.
fn merge<const N: usize>(pairs: &mut Vec<WeightedPair<N>>) {
    // Stable: weights are added in the order of the candidates.
    pairs.sort_by_key(|pair| pair.vertices);
    let mut merged = 0;
    let mut i = 0;
    while i < pairs.len() {
        let (vertices, mut weight, mut size) = (pairs[i].vertices, 0.0, 0.0);
        while i < pairs.len() && pairs[i].vertices == vertices {
            weight += pairs[i].weight;
            size += pairs[i].weight.abs();
            i += 1;
        }
        if weight.abs() > CANCELLED * size {
            pairs[merged] = WeightedPair { vertices, weight };
            merged += 1;
        }
    }
    pairs.truncate(merged);
}

/// Ends of two edges, the edge with the lower index first.
fn ends_of(surface: &ContactSurface, a: u32, b: u32) -> [u32; 4] {
    let [[p, q], [r, s]] = [a.min(b), a.max(b)].map(|e| surface.edges[e as usize]);
    [p, q, r, s]
}

/// Passes the pairs of [`ContactStencils::find`] to `sink` before equal ones are merged.
pub(crate) fn find_pairs<const D: usize>(
    surface: &ContactSurface,
    candidates: &CandidatePairs,
    x: &[f64],
    (reach, duplicates): (f64, Duplicates),
    sink: &mut impl PairSink,
) {
    let mut finder = Finder { surface, x, reach, sink };
    let max = duplicates == Duplicates::Max;
    for &[p, q] in &candidates.point_point {
        finder.point_point::<D>(p, q, &[p, q].map(|v| AreaPart::of_vertex(v, 0.5)));
    }
    for &[p, e] in &candidates.point_edge {
        finder.point_and_edge::<D>(p, e, max);
    }
    if D == 3 {
        let of_triangle = |[p, t]: [u32; 2]| {
            let [a, b, c] = surface.triangles[t as usize];
            [p, a, b, c]
        };
        for (pair, _, coefficients) in finder.near::<PointTriangle>(&candidates.point_triangle, of_triangle) {
            finder.point_triangle(pair, &coefficients, max);
        }
        let of_edges = |[a, b]: [u32; 2]| ends_of(surface, a, b);
        for (pair, vertices, coefficients) in finder.near::<EdgeEdge>(&candidates.edge_edge, of_edges) {
            finder.edge_edge(pair, &vertices, &coefficients, max);
        }
    }
}

struct Finder<'a, S> {
    surface: &'a ContactSurface,
    x: &'a [f64],
    reach: f64,
    sink: &'a mut S,
}

impl<S: PairSink> Finder<'_, S> {
    fn rows<const D: usize, const N: usize>(&self, vertices: &[u32; N]) -> [[f64; D]; N] {
        rows(self.x, vertices)
    }

    /// Distance below which the primitives of these two vertices interact [m].
    #[inline]
    fn distance(&self, a: u32, b: u32) -> f64 {
        self.reach + (self.surface.radius(a) + self.surface.radius(b))
    }

    /// Pairs of primitives within reach, with their vertices and the coefficients of their closest
    /// points.
    fn near<K: Primitives<3, 4>>(
        &self,
        pairs: &[[u32; 2]],
        vertices: impl Fn([u32; 2]) -> [u32; 4],
    ) -> Vec<([u32; 2], [u32; 4], [f64; 4])> {
        let all: Vec<[u32; 4]> = pairs.iter().map(|pair| vertices(*pair)).collect();
        // Tolerance for the rounding of distances.
        let reach = |v: &[u32; 4]| self.distance(v[0], v[3]) * (1.0 + 1e-9);
        let by = Screen { boxes: true, across: false, motion: false };
        let may_be_near = screen::<K, 3, 4>(&all, (self.x, None), reach, by);
        let numbered = pairs.iter().copied().zip(all).zip(may_be_near);
        let kept = numbered.filter(|(_, may_be_near)| *may_be_near).map(|(pair, _)| pair);
        let (numbers, at_hand): (Vec<[u32; 2]>, Vec<[u32; 4]>) = kept.unzip();
        let closest = closest_points::<K, 3, 4>(self.x, &at_hand);
        let mut near = vec![];
        for ((pair, vertices), (coefficients, squared_distance)) in
            numbers.into_iter().zip(at_hand).zip(closest)
        {
            let distance = self.distance(vertices[0], vertices[3]);
            if squared_distance < distance * distance {
                near.push((pair, vertices, coefficients));
            }
        }
        near
    }

    /// Pairs of a point and an edge: any edge in 2D, a wire in 3D. Subtracts duplicates at its inner
    /// vertices once for all of their edges.
    fn point_and_edge<const D: usize>(&mut self, p: u32, e: u32, max: bool) {
        let surface = self.surface;
        let part = match surface.kinds[p as usize] {
            VertexKind::Particle => 1.0,
            _ if D == 2 => 0.5,
            _ => 0.25,
        };
        let part = AreaPart::of_vertex(p, part);
        let edge = surface.edges[e as usize];
        self.point_edge::<D>(p, edge, part);
        for v in edge.into_iter().filter(|_| max) {
            let meets = |f: &&u32| {
                let is_other = !surface.edges[**f as usize].contains(&p);
                is_other && (D == 2 || surface.is_wire(**f))
            };
            let mut others = surface.vertex_edges.of(v).iter().filter(meets);
            if others.next() != Some(&e) {
                continue;
            }
            // An edge that ends at the point itself was not counted.
            let twice = others.count();
            if twice > 0 {
                self.point_point::<D>(p, v, &[part.times(-(twice as f64))]);
            }
        }
    }

    /// Pair of a point and a triangle. Corrects duplicates at inner edges and vertices once for all of
    /// their triangles.
    fn point_triangle(&mut self, [p, t]: [u32; 2], coefficients: &[f64; 4], max: bool) {
        let surface = self.surface;
        let part = match surface.kinds[p as usize] {
            VertexKind::Face => 0.25,
            VertexKind::Wire => 0.5,
            VertexKind::Particle => 1.0,
        };
        let part = AreaPart::of_vertex(p, part);
        let [a, b, c] = surface.triangles[t as usize];
        self.sink.pair(&[p, a, b, c], &InnerPair::of_point_triangle(coefficients), &[part]);
        if !max {
            return;
        }
        // If the point is a corner of one of them, fewer are counted, and none twice.
        let is_first = |others: &[u32]| {
            let has_point = |t: &u32| surface.triangles[*t as usize].contains(&p);
            others.first() == Some(&t) && !others.iter().any(has_point)
        };
        for e in surface.triangle_edges[t as usize] {
            if surface.is_inner_edge(e) && is_first(&surface.edge_triangles[e as usize]) {
                self.point_edge::<3>(p, surface.edges[e as usize], part.times(-1.0));
            }
        }
        for v in [a, b, c] {
            if surface.inner_vertices[v as usize] && is_first(surface.vertex_triangles.of(v)) {
                self.point_point::<3>(p, v, &[part]);
            }
        }
    }

    fn edge_edge(&mut self, [a, b]: [u32; 2], vertices: &[u32; 4], coefficients: &[f64; 4], max: bool) {
        let surface = self.surface;
        let parts = [self.share(a, b), self.share(b, a)];
        let inner = InnerPair::of_edge_edge(coefficients);
        if squared_cross(&self.rows::<3, 4>(vertices)) < self.parallel_limit(a, b) {
            self.sink.parallel([a.min(b), a.max(b)], &inner, &parts);
        } else {
            self.sink.pair(vertices, &inner, &parts);
        }
        if max {
            surface.edges[b as usize].iter().for_each(|&p| self.edges_at(a, p, b));
            surface.edges[a as usize].iter().for_each(|&p| self.edges_at(b, p, a));
        }
    }

    /// Subtracts all but one of the edges at `p` that the edge `e` is paired with. Called for each of
    /// them, acts for the first.
    fn edges_at(&mut self, e: u32, p: u32, told_by: u32) {
        let surface = self.surface;
        let ends = surface.edges[e as usize];
        let touches = |f: u32| surface.edges[f as usize].iter().any(|v| ends.contains(v));
        let others = surface.vertex_edges.of(p);
        if others.iter().find(|&&f| !touches(f)) != Some(&told_by) {
            return;
        }
        // Nothing to subtract if the edge is out of reach of the point.
        let [q, r] = ends;
        let closest = PointEdge::closest(&self.rows::<3, 3>(&[p, q, r]));
        let distance = self.distance(p, q);
        if closest.squared_distance >= distance * distance {
            return;
        }
        let inner = InnerPair::of_point_edge(&closest.coefficients);
        // For faces and for wires: the share of `e` in a pair, and the number of pairs; one is kept.
        let mut shares = [AreaPart { of: AreaOf::Edge(e), part: 0.0 }; 2];
        let mut counts = [0.0; 2];
        for &f in others.iter().filter(|&&f| !touches(f)) {
            let kind = usize::from(surface.is_wire(f));
            shares[kind] = self.share(e, f);
            let vertices = ends_of(surface, e, f);
            if squared_cross(&self.rows::<3, 4>(&vertices)) < self.parallel_limit(e, f) {
                let inner = InnerPair { slots: self.slots(&vertices, &[p, q, r], &inner), ..inner };
                self.sink.parallel([e.min(f), e.max(f)], &inner, &[shares[kind].times(-1.0)]);
            } else {
                counts[kind] += 1.0;
            }
        }
        counts[usize::from(shares[1].part > shares[0].part)] -= 1.0;
        let parts = [0, 1].map(|kind| shares[kind].times(-counts[kind]));
        if surface.weight(&parts) != 0.0 {
            self.sink.pair(&[p, q, r, 0], &inner, &parts);
        }
    }

    /// Fraction of its area that the edge `e` contributes to its pair with `f`.
    fn share(&self, e: u32, f: u32) -> AreaPart {
        let part = match [e, f].map(|edge| self.surface.is_wire(edge)) {
            [true, false] => 0.5,
            [false, true] => 0.0,
            _ => 0.25,
        };
        AreaPart { of: AreaOf::Edge(e), part }
    }

    /// Positions in `vertices` of the vertices that `inner` names by their slots in `own`.
    fn slots(&self, vertices: &[u32; 4], own: &[u32; 3], inner: &InnerPair) -> [usize; 4] {
        let mut slots = [0; 4];
        for i in 0..inner.vertices() {
            let vertex = own[inner.slots[i]];
            slots[i] = vertices.iter().position(|v| *v == vertex).unwrap_or_default();
        }
        slots
    }

    fn parallel_limit(&self, a: u32, b: u32) -> f64 {
        let squared = &self.surface.squared_lengths;
        parallel_limit(squared[a as usize], squared[b as usize])
    }

    fn point_edge<const D: usize>(&mut self, p: u32, [a, b]: [u32; 2], part: AreaPart) {
        let closest = PointEdge::closest(&self.rows::<D, 3>(&[p, a, b]));
        let distance = self.distance(p, a);
        if closest.squared_distance < distance * distance {
            self.sink.pair(&[p, a, b, 0], &InnerPair::of_point_edge(&closest.coefficients), &[part]);
        }
    }

    fn point_point<const D: usize>(&mut self, p: u32, v: u32, parts: &[AreaPart]) {
        let [a, b] = self.rows::<D, 2>(&[p, v]);
        let squared: f64 = (0..D).map(|k| (a[k] - b[k]) * (a[k] - b[k])).sum();
        let distance = self.distance(p, v);
        if squared < distance * distance {
            let inner = InnerPair { kind: InnerKind::PointPoint, slots: [0, 1, 0, 0] };
            self.sink.pair(&[p, v, 0, 0], &inner, parts);
        }
    }
}
