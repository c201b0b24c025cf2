//! Contacts of one configuration, visited in a fixed order.

use crate::broad_phase::Bounds;
use crate::candidates::CandidatePairs;
use crate::closest::{InnerKind, InnerPair, Primitives};
use crate::merge::{AreaOf, AreaPart, ContactStencils, PairSink, WeightedPairs, find_pairs};
use crate::model::{ContactLaw, ContactModel};
use crate::packs::{closest_points, near_box};
use crate::pair::{EdgeEdge, PointEdge, PointPoint, PointTriangle};
use crate::vector::rows;
use crate::visit::{ContactVisitor, PackVisitor, PlaneGeometry, visit_each, visit_pairs};
use std::ops::Range;

/// Vertex within the activation distance of a half-space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneContact {
    /// The contacting vertex and the vertex that carries the half-space.
    pub vertices: [u32; 2],
    /// Index of the half-space.
    pub half_space: u32,
    /// Weight [m^2].
    pub weight: f64,
}

/// All contacts of one configuration: point pairs, vertices at planes, points at edges, points at
/// triangles, edge pairs, nearly parallel edges. Each list is sorted by vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Contacts {
    /// Pairs of primitives.
    pub stencils: ContactStencils,
    /// Vertices at half-spaces.
    pub planes: Vec<PlaneContact>,
}

impl Contacts {
    /// Finds the contacts at `x`, flat `(n, D)` [m]: candidate pairs with a gap below `reach` [m], and
    /// all obstacles within their activation distance.
    pub fn find<const D: usize>(
        model: &ContactModel,
        candidates: &CandidatePairs,
        x: &[f64],
        reach: f64,
    ) -> Self {
        let (surface, duplicates) = (&model.surface, model.duplicates);
        let mut stencils = ContactStencils::find::<D>(surface, candidates, x, reach, duplicates);
        if !model.balls.is_empty() {
            let mut pairs = WeightedPairs { surface, stencils };
            balls::<D>(model, x, &mut pairs);
            stencils = pairs.stencils;
            stencils.merge();
        }
        Contacts { stencils, planes: planes::<D>(model, x) }
    }

    /// Passes the pairs of [`find`](Self::find) to `sink` one by one and returns the vertices at
    /// half-spaces.
    pub(crate) fn find_each<const D: usize>(
        model: &ContactModel,
        candidates: &CandidatePairs,
        x: &[f64],
        reach: f64,
        sink: &mut impl PairSink,
    ) -> Vec<PlaneContact> {
        find_pairs::<D>(&model.surface, candidates, x, (reach, model.duplicates), sink);
        balls::<D>(model, x, sink);
        planes::<D>(model, x)
    }

    /// Number of contacts of two, three and four vertices.
    fn sizes(&self) -> [usize; 3] {
        let s = &self.stencils;
        let four = s.point_triangle.len() + s.edge_edge.len() + s.mollified.len();
        [s.point_point.len() + self.planes.len(), s.point_edge.len(), four]
    }

    /// Total number of contacts.
    pub fn len(&self) -> usize {
        self.sizes().iter().sum()
    }

    /// Removes all contacts.
    pub(crate) fn clear(&mut self) {
        self.stencils.clear();
        self.planes.clear();
    }

    /// True if there are no contacts.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Index ranges of the contacts of two, three and four vertices.
    pub(crate) fn ranges(&self) -> [std::ops::Range<usize>; 3] {
        let [two, three, _] = self.sizes();
        [0..two, two..two + three, two + three..self.len()]
    }

    /// Vertices of the contacts of two, three and four vertices, flat.
    pub(crate) fn vertices(&self) -> [Vec<u32>; 3] {
        let s = &self.stencils;
        let of_points = s.point_point.iter().map(|pair| pair.vertices);
        let two = of_points.chain(self.planes.iter().map(|plane| plane.vertices)).flatten();
        let three = s.point_edge.iter().flat_map(|pair| pair.vertices);
        let four = s.point_triangle.iter().chain(&s.edge_edge).map(|pair| pair.vertices);
        let four = four.chain(s.mollified.iter().map(|pair| pair.vertices)).flatten();
        [two.collect(), three.collect(), four.collect()]
    }

    /// Visits the contacts in the index range at the positions `x`, in order.
    pub(crate) fn visit_packs<const D: usize>(
        &self,
        model: &ContactModel,
        x: &[f64],
        numbers: Range<usize>,
        visitor: &mut impl PackVisitor<D>,
    ) {
        let (s, mut window) = (&self.stencils, Window { first: 0, numbers });
        visit_pairs::<PointPoint, D, 2, 0>(model, x, window.of(&s.point_point), visitor);
        for contact in window.of(&self.planes) {
            let (geometry, law) = plane_geometry(model, x, contact);
            visitor.plane(&contact.vertices, &geometry, law, contact.weight);
        }
        visit_pairs::<PointEdge, D, 3, 1>(model, x, window.of(&s.point_edge), visitor);
        visit_pairs::<PointTriangle, D, 4, 2>(model, x, window.of(&s.point_triangle), visitor);
        visit_pairs::<EdgeEdge, D, 4, 2>(model, x, window.of(&s.edge_edge), visitor);
        for pair in window.of(&s.mollified) {
            let law = model.law(pair.vertices[0], pair.vertices[3]);
            visitor.mollified(pair, &in_space(x, D, &pair.vertices), law);
        }
    }

    /// Visits contact `i` at the positions `x`.
    pub(crate) fn visit<const D: usize>(
        &self,
        model: &ContactModel,
        x: &[f64],
        i: usize,
        visitor: &mut impl ContactVisitor<D>,
    ) {
        let (s, mut window) = (&self.stencils, Window { first: 0, numbers: i..i + 1 });
        visit_each::<PointPoint, D, 2, 0>(model, x, window.of(&s.point_point), visitor);
        for contact in window.of(&self.planes) {
            let (geometry, law) = plane_geometry(model, x, contact);
            visitor.plane(&contact.vertices, &geometry, law, contact.weight);
        }
        visit_each::<PointEdge, D, 3, 1>(model, x, window.of(&s.point_edge), visitor);
        visit_each::<PointTriangle, D, 4, 2>(model, x, window.of(&s.point_triangle), visitor);
        visit_each::<EdgeEdge, D, 4, 2>(model, x, window.of(&s.edge_edge), visitor);
        for pair in window.of(&s.mollified) {
            let law = model.law(pair.vertices[0], pair.vertices[3]);
            visitor.mollified(pair, &in_space(x, D, &pair.vertices), law);
        }
    }
}

/// The part of a range of contacts that the lists have, one list after the other.
struct Window {
    /// Number of the first contact of the next list.
    first: usize,
    numbers: Range<usize>,
}

impl Window {
    /// Returns the contacts of the next list that are in the range.
    fn of<'a, T>(&mut self, list: &'a [T]) -> &'a [T] {
        let first = self.first;
        self.first += list.len();
        let within = |i: usize| i.clamp(first, first + list.len()) - first;
        let start = within(self.numbers.start);
        &list[start..within(self.numbers.end).max(start)]
    }
}

/// Geometry of a contact with a half-space, and its contact parameters.
fn plane_geometry<'a, const D: usize>(
    model: &'a ContactModel,
    x: &[f64],
    contact: &PlaneContact,
) -> (PlaneGeometry<D>, &'a ContactLaw) {
    let half_space = &model.half_spaces[contact.half_space as usize];
    let mut normal = [0.0; D];
    normal.copy_from_slice(&half_space.normal[..D]);
    let distance = half_space.distance::<D>(x, contact.vertices[0]);
    let geometry = PlaneGeometry { normal, distance, depth: half_space.depth };
    (geometry, model.law(contact.vertices[0], contact.vertices[1]))
}

/// Positions of four vertices in 3D, padded with zeros.
fn in_space(x: &[f64], dimension: usize, vertices: &[u32; 4]) -> [[f64; 3]; 4] {
    let mut rows = [[0.0; 3]; 4];
    for i in 0..4 {
        rows[i][..dimension].copy_from_slice(&x[vertices[i] as usize * dimension..][..dimension]);
    }
    rows
}

/// Vertices within the activation distance of half-spaces, weighted by their areas.
fn planes<const D: usize>(model: &ContactModel, x: &[f64]) -> Vec<PlaneContact> {
    let mut found = vec![];
    for (i, half_space) in (0..).zip(&model.half_spaces) {
        for &p in &model.surface.vertices {
            let body = model.body(p);
            if !model.touch(body, half_space.body) {
                continue;
            }
            let law = model.laws.of(body, half_space.body);
            let vertices = [p, half_space.vertex];
            if half_space.distance::<D>(x, p) < law.barrier.reach + law.barrier.offset {
                let weight = model.surface.vertex_areas[p as usize];
                found.push(PlaneContact { vertices, half_space: i, weight });
            }
        }
    }
    found
}

/// Passes the triangles, wires and particles near balls to `sink`, weighted by their own areas.
fn balls<const D: usize>(model: &ContactModel, x: &[f64], sink: &mut impl PairSink) {
    let surface = &model.surface;
    for ball in &model.balls {
        let near = |v: u32, squared: f64| {
            let body = model.body(v);
            model.touch(body, ball.body) && squared < model.laws.of(body, ball.body).barrier.squared_reach()
        };
        // Particles and lone edges, one by one.
        for &p in &surface.particles {
            let closest = PointPoint::closest(&rows::<D, 2>(x, &[ball.vertex, p]));
            if near(p, closest.squared_distance) {
                let inner = InnerPair { kind: InnerKind::PointPoint, slots: [0, 1, 0, 0] };
                sink.pair(&[ball.vertex, p, 0, 0], &inner, &[AreaPart::of_vertex(p, 1.0)]);
            }
        }
        for e in surface.lone_edges() {
            let [a, b] = surface.edges[e as usize];
            let closest = PointEdge::closest(&rows::<D, 3>(x, &[ball.vertex, a, b]));
            if near(a, closest.squared_distance) {
                let inner = InnerPair::of_point_edge(&closest.coefficients);
                let whole = AreaPart { of: AreaOf::Edge(e), part: 1.0 };
                sink.pair(&[ball.vertex, a, b, 0], &inner, &[whole]);
            }
        }
        if D == 2 {
            continue;
        }
        // Triangles near the centre, in packs.
        let centre = Bounds::<3>::of_vertices(&[ball.vertex], x, None);
        let mut at_hand: Vec<[u32; 4]> = vec![];
        let mut areas = vec![];
        for t in near_box(&surface.triangles, (x, None), &centre, model.squared_reach_of(ball)) {
            let [a, b, c] = surface.triangles[t as usize];
            if model.touch(model.body(a), ball.body) {
                at_hand.push([ball.vertex, a, b, c]);
                areas.push(AreaPart { of: AreaOf::Triangle(t), part: 1.0 });
            }
        }
        let closest = closest_points::<PointTriangle, 3, 4>(x, &at_hand);
        for ((vertices, area), (coefficients, squared_distance)) in at_hand.iter().zip(areas).zip(closest) {
            if near(vertices[1], squared_distance) {
                sink.pair(vertices, &InnerPair::of_point_triangle(&coefficients), &[area]);
            }
        }
    }
}
