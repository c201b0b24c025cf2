//! Checks of an initial configuration: whether surfaces cross or overlap before the first step.

use crate::broad_phase::{Bounds, BoundsTree};
use crate::candidates::CandidatePairs;
use crate::closest::Primitives;
use crate::model::ContactModel;
use crate::pair::{EdgeEdge, PointEdge, PointPoint, PointTriangle};
use crate::vector::{cross, difference, dot, rows};
use pliant::algebra::scene_size;
use pliant::quantity::Rounded;

/// Two primitives that cross or overlap.
#[derive(Clone, Debug, PartialEq)]
pub struct BadStart {
    /// Vertices of the two primitives in the system; for obstacles the vertex that carries them.
    pub primitives: [Vec<u32>; 2],
    /// Position [m].
    pub place: [f64; 3],
    /// Distance minus the radii [m]; `None` if they cross.
    pub gap: Option<f64>,
}

impl BadStart {
    /// Describes the defect in words, with the position.
    pub fn described<const D: usize>(&self, model: &ContactModel) -> String {
        let [a, b] = self.primitives.each_ref().map(|primitive| model.named(primitive));
        let place = self.place[..D].iter().map(|x| format!("{x:.6}")).collect::<Vec<_>>().join(", ");
        match self.gap {
            None => format!("{a} crosses {b} at ({place}) m"),
            Some(0.0) => format!("{a} and {b} touch, without a gap between them, at ({place}) m"),
            Some(gap) => format!("{a} and {b} overlap by {} m at ({place}) m", Rounded::<4>(-gap)),
        }
    }
}

/// Finds pairs of primitives that cross at `x`, flat `(n, D)` [m], or are closer than their radii allow.
pub fn bad_starts<const D: usize>(model: &ContactModel, x: &[f64]) -> Vec<BadStart> {
    let mut found = if D == 3 { crossing_triangles(model, x) } else { crossing_edges(model, x) };
    found.extend(overlaps::<D>(model, x));
    found
}

/// Closest primitives of a body that share no vertex.
#[derive(Clone, Debug, PartialEq)]
pub struct LeastDistance {
    /// Distance [m].
    pub distance: f64,
    /// Vertices of the two primitives in the system.
    pub primitives: [Vec<u32>; 2],
}

/// Smallest reference distance between primitives of each body that share no vertex, if below twice the
/// largest self-contact distance: self-contact begins at no more than half of it.
pub fn least_distances<const D: usize>(model: &ContactModel, rest: &[f64]) -> Vec<Option<LeastDistance>> {
    let reach = 2.0 * model.own_reach();
    let mut least: Vec<Option<LeastDistance>> = vec![None; model.names.len()];
    let candidates = CandidatePairs::gather::<D>(&model.surface, &model.pairs, rest, None, reach);
    each_distance::<D>(model, &candidates, rest, |primitives, squared, _| {
        let (a, b) = (model.body(primitives[0][0]), model.body(primitives[1][0]));
        let at = &mut least[a as usize];
        let distance = squared.sqrt();
        if a == b && distance < reach && at.as_ref().is_none_or(|least| distance < least.distance) {
            *at = Some(LeastDistance { distance, primitives: primitives.map(<[u32]>::to_vec) });
        }
    });
    least
}

/// Calls `visit` with the two primitives of every candidate pair, their squared distance, and the
/// coefficients of their vertices in the shortest vector from the second to the first.
fn each_distance<const D: usize>(
    model: &ContactModel,
    candidates: &CandidatePairs,
    x: &[f64],
    mut visit: impl FnMut([&[u32]; 2], f64, &[f64]),
) {
    let surface = &model.surface;
    for &[p, q] in &candidates.point_point {
        let closest = PointPoint::closest(&rows::<D, 2>(x, &[p, q]));
        visit([&[p], &[q]], closest.squared_distance, &closest.coefficients);
    }
    for &[p, e] in &candidates.point_edge {
        let edge = surface.edges[e as usize];
        let closest = PointEdge::closest(&rows::<D, 3>(x, &[p, edge[0], edge[1]]));
        visit([&[p], &edge], closest.squared_distance, &closest.coefficients);
    }
    for &[p, t] in &candidates.point_triangle {
        let [a, b, c] = surface.triangles[t as usize];
        let closest = PointTriangle::closest(&rows::<3, 4>(x, &[p, a, b, c]));
        visit([&[p], &[a, b, c]], closest.squared_distance, &closest.coefficients);
    }
    for &[e, f] in &candidates.edge_edge {
        let ([a, b], [c, d]) = (surface.edges[e as usize], surface.edges[f as usize]);
        let closest = EdgeEdge::closest(&rows::<3, 4>(x, &[a, b, c, d]));
        visit([&[a, b], &[c, d]], closest.squared_distance, &closest.coefficients);
    }
}

/// Pairs closer than their radii.
fn overlaps<const D: usize>(model: &ContactModel, x: &[f64]) -> Vec<BadStart> {
    let mut found = vec![];
    let place = |v: u32| padded::<D>(x, v);
    let reach = model.surface_reach();
    let candidates = CandidatePairs::gather::<D>(&model.surface, &model.pairs, x, None, reach);
    let mut add = |primitives: [&[u32]; 2], gap: f64, depth: f64| {
        if gap <= 0.0 {
            let (primitives, gap) = (primitives.map(<[u32]>::to_vec), Some(gap - depth));
            found.push(BadStart { place: place(primitives[0][0]), primitives, gap });
        }
    };
    each_distance::<D>(model, &candidates, x, |primitives, squared, _| {
        let law = model.law(primitives[0][0], primitives[1][0]);
        add(primitives, squared.sqrt() - law.barrier.offset, 0.0);
    });
    each_obstacle_gap::<D>(model, x, add);
    found
}

/// Calls `visit` with every surface primitive, the vertex of every half-space and ball it may touch, the
/// gap, and the depth of the half-space's plane behind its vertex, included in the gap [m].
fn each_obstacle_gap<const D: usize>(
    model: &ContactModel,
    x: &[f64],
    mut visit: impl FnMut([&[u32]; 2], f64, f64),
) {
    let surface = &model.surface;
    for half_space in &model.half_spaces {
        for &p in surface.vertices.iter().filter(|p| model.touch(model.body(**p), half_space.body)) {
            let law = model.law(p, half_space.vertex);
            let gap = half_space.distance::<D>(x, p) - law.barrier.offset;
            visit([&[p], &[half_space.vertex]], gap, half_space.depth);
        }
    }
    for ball in &model.balls {
        let mut add = |vertices: &[u32], squared: f64| {
            if model.touch(model.body(vertices[0]), ball.body) {
                let gap = squared.sqrt() - model.law(vertices[0], ball.vertex).barrier.offset;
                visit([vertices, &[ball.vertex]], gap, 0.0);
            }
        };
        for &[a, b, c] in &surface.triangles {
            let closest = PointTriangle::closest(&rows::<3, 4>(x, &[ball.vertex, a, b, c]));
            add(&[a, b, c], closest.squared_distance);
        }
        for [a, b] in surface.lone_edges().map(|e| surface.edges[e as usize]) {
            let closest = PointEdge::closest(&rows::<D, 3>(x, &[ball.vertex, a, b]));
            add(&[a, b], closest.squared_distance);
        }
        for &p in &surface.particles {
            let closest = PointPoint::closest(&rows::<D, 2>(x, &[ball.vertex, p]));
            add(&[p], closest.squared_distance);
        }
    }
}

/// Contact data of an initial configuration.
#[derive(Clone, Debug, PartialEq)]
pub struct StartSurvey {
    /// Number of candidate pairs of the first search.
    pub candidates: usize,
    /// Smallest gap between two bodies, or a body and an obstacle [m], with the vertices of the two
    /// primitives; `None` if no two may touch.
    pub least: Option<(f64, [Vec<u32>; 2])>,
}

/// Growth factor of the search distance for the nearest bodies.
const WIDER: f64 = 1.5;

/// Counts candidates and finds the smallest gap at `x`, flat `(n, D)` [m].
pub fn survey<const D: usize>(model: &ContactModel, x: &[f64]) -> StartSurvey {
    let gather = |pairs, reach| CandidatePairs::gather::<D>(&model.surface, pairs, x, None, reach);
    let candidates = gather(&model.pairs, model.surface_reach()).count();
    let mut least: Option<(f64, [Vec<u32>; 2])> = None;
    let look = |least: &mut Option<(f64, [Vec<u32>; 2])>, primitives: [&[u32]; 2], gap: f64| {
        if least.as_ref().is_none_or(|(least, _)| gap < *least) {
            *least = Some((gap, primitives.map(<[u32]>::to_vec)));
        }
    };
    each_obstacle_gap::<D>(model, x, |primitives, gap, depth| look(&mut least, primitives, gap - depth));
    let Some(apart) = least_gap_of_boxes::<D>(model, x) else { return StartSurvey { candidates, least } };
    let different = model.pairs.of_different_bodies();
    // Parallel faces of boxes are as far apart as the boxes.
    let (mut reach, most) = (1.01 * model.surface_reach().max(apart), WIDER * scene_size(x, D));
    loop {
        each_distance::<D>(model, &gather(&different, reach), x, |primitives, squared, _| {
            let law = model.law(primitives[0][0], primitives[1][0]);
            look(&mut least, primitives, squared.sqrt() - law.barrier.offset);
        });
        // All pairs closer than the reach have been found; a farther one may not be the nearest.
        if reach > most || least.as_ref().is_some_and(|(gap, _)| *gap <= reach) {
            break;
        }
        reach *= WIDER;
    }
    StartSurvey { candidates, least }
}

/// Smallest gap between the boxes of two bodies that may touch [m], a lower bound of that of their
/// surfaces.
fn least_gap_of_boxes<const D: usize>(model: &ContactModel, x: &[f64]) -> Option<f64> {
    let count = model.names.len();
    let mut boxes = vec![Bounds::<D>::EMPTY; count];
    for &v in &model.surface.vertices {
        boxes[model.body(v) as usize].include(&Bounds::of_vertices(&[v], x, None));
    }
    let pairs = (0..count).flat_map(|a| (a + 1..count).map(move |b| (a, b)));
    let touching = pairs.filter(|(a, b)| model.touch(*a as u32, *b as u32));
    let gaps = touching
        .map(|(a, b)| boxes[a].distance(&boxes[b]) - model.laws.of(a as u32, b as u32).barrier.offset);
    // Bodies without a surface have no box.
    gaps.filter(|gap| gap.is_finite()).reduce(f64::min)
}

/// Edges that cross triangles.
fn crossing_triangles(model: &ContactModel, x: &[f64]) -> Vec<BadStart> {
    let surface = &model.surface;
    let bounds: Vec<Bounds<3>> = surface.triangles.iter().map(|t| Bounds::of_vertices(t, x, None)).collect();
    let tree = BoundsTree::new(&bounds);
    let (mut found, mut near) = (vec![], vec![]);
    for edge in &surface.edges {
        near.clear();
        tree.find(&Bounds::of_vertices(edge, x, None), &mut near);
        for &t in &near {
            let triangle = surface.triangles[t as usize];
            let shares = edge.iter().any(|v| triangle.contains(v));
            if shares || !model.touch(model.body(edge[0]), model.body(triangle[0])) {
                continue;
            }
            let ends = edge.map(|v| padded::<3>(x, v));
            let corners = triangle.map(|v| padded::<3>(x, v));
            if let Some(place) = crossing(&ends, &corners) {
                let primitives = [edge.to_vec(), triangle.to_vec()];
                found.push(BadStart { primitives, place, gap: None });
            }
        }
    }
    found
}

/// Intersection of a segment and a triangle, by the signs of tetrahedron volumes; touching counts.
fn crossing([p, q]: &[[f64; 3]; 2], [a, b, c]: &[[f64; 3]; 3]) -> Option<[f64; 3]> {
    let volume = |a: &[f64; 3], b: &[f64; 3], c: &[f64; 3], d: &[f64; 3]| orientation(a, b, c, d);
    let (side_p, side_q) = (volume(a, b, c, p), volume(a, b, c, q));
    if side_p * side_q > 0.0 || (side_p == 0.0 && side_q == 0.0) {
        return None;
    }
    let around = [volume(p, q, a, b), volume(p, q, b, c), volume(p, q, c, a)];
    let inside = around.iter().all(|v| *v >= 0.0) || around.iter().all(|v| *v <= 0.0);
    let part = side_p / (side_p - side_q);
    inside.then(|| [0, 1, 2].map(|k| p[k] + part * (q[k] - p[k])))
}

/// Signed volume of a tetrahedron, times six (robust predicate).
fn orientation(a: &[f64; 3], b: &[f64; 3], c: &[f64; 3], d: &[f64; 3]) -> f64 {
    let coord = |p: &[f64; 3]| robust::Coord3D { x: p[0], y: p[1], z: p[2] };
    robust::orient3d(coord(a), coord(b), coord(c), coord(d))
}

/// Edges that cross in 2D.
fn crossing_edges(model: &ContactModel, x: &[f64]) -> Vec<BadStart> {
    let surface = &model.surface;
    let bounds: Vec<Bounds<2>> = surface.edges.iter().map(|e| Bounds::of_vertices(e, x, None)).collect();
    let tree = BoundsTree::new(&bounds);
    let (mut found, mut near) = (vec![], vec![]);
    for (i, edge) in (0..).zip(&surface.edges) {
        near.clear();
        tree.find(&bounds[i as usize], &mut near);
        for &j in near.iter().filter(|&&j| j > i) {
            let other = surface.edges[j as usize];
            let shares = edge.iter().any(|v| other.contains(v));
            if shares || !model.touch(model.body(edge[0]), model.body(other[0])) {
                continue;
            }
            if let Some(place) = crossing_in_plane(x, edge, &other) {
                found.push(BadStart { primitives: [edge.to_vec(), other.to_vec()], place, gap: None });
            }
        }
    }
    found
}

fn crossing_in_plane(x: &[f64], &[a, b]: &[u32; 2], &[c, d]: &[u32; 2]) -> Option<[f64; 3]> {
    let coord = |v: u32| robust::Coord { x: x[2 * v as usize], y: x[2 * v as usize + 1] };
    let side = |a, b, c| robust::orient2d(coord(a), coord(b), coord(c));
    let (of_c, of_d, of_a, of_b) = (side(a, b, c), side(a, b, d), side(c, d, a), side(c, d, b));
    let parallel = of_c == 0.0 && of_d == 0.0;
    if parallel || of_c * of_d > 0.0 || of_a * of_b > 0.0 {
        return None;
    }
    let (p, q, part) = (coord(c), coord(d), of_c / (of_c - of_d));
    Some([p.x + part * (q.x - p.x), p.y + part * (q.y - p.y), 0.0])
}

/// Finds bodies inside closed ones, the inner first, by the parity of ray crossings: nested boxes have no
/// crossing surfaces. One vertex of each body suffices, if no surfaces cross.
pub fn enclosed_bodies<const D: usize>(model: &ContactModel, x: &[f64]) -> Vec<[u32; 2]> {
    let surface = &model.surface;
    let count = model.names.len() as u32;
    let is_closed = |e: usize| {
        let ends = &surface.edges[e];
        if D == 3 {
            surface.is_inner_edge(e as u32)
        } else {
            ends.iter().all(|v| surface.inner_vertices[*v as usize])
        }
    };
    let closed: Vec<bool> = (0..count)
        .map(|body| {
            let own = |e: &usize| model.body(surface.edges[*e][0]) == body;
            let mut edges = (0..surface.edges.len()).filter(own).peekable();
            edges.peek().is_some() && edges.all(is_closed)
        })
        .collect();
    let place = |body: u32| {
        let on_surface = surface.vertices.iter().copied().find(|v| model.body(*v) == body);
        on_surface.or_else(|| model.balls.iter().find(|ball| ball.body == body).map(|ball| ball.vertex))
    };
    let mut found = vec![];
    for inner in 0..count {
        let Some(v) = place(inner) else { continue };
        for outer in (0..count).filter(|&outer| outer != inner && closed[outer as usize]) {
            if model.touch(inner, outer) && crossings_of_ray::<D>(model, x, v, outer) % 2 == 1 {
                found.push([inner, outer]);
            }
        }
    }
    found
}

/// First defect at `x`, flat `(n, D)` [m], in words: crossing or overlapping surfaces, or a body inside
/// another.
pub fn conflict<const D: usize>(model: &ContactModel, x: &[f64]) -> Option<String> {
    if let Some(bad) = bad_starts::<D>(model, x).first() {
        return Some(bad.described::<D>(model));
    }
    let [inner, outer] = *enclosed_bodies::<D>(model, x).first()?;
    let name = |body: u32| &model.names[body as usize];
    Some(format!("`{}` lies inside `{}`", name(inner), name(outer)))
}

/// Ray direction: no handmade or grid mesh has faces along it.
const RAY: [f64; 3] = [0.577_215_664_901_532_9, 0.713_147_180_559_945_3, 0.430_775_180_316_498];

/// Number of triangles (2D: edges) of a body that a ray from the vertex meets.
fn crossings_of_ray<const D: usize>(model: &ContactModel, x: &[f64], vertex: u32, body: u32) -> usize {
    let from = padded::<D>(x, vertex);
    if D == 2 {
        let own = model.surface.edges.iter().filter(|edge| model.body(edge[0]) == body);
        return own
            .filter(|edge| {
                let [a, b] = edge.map(|v| difference(&padded::<D>(x, v), &from));
                let side = |p: &[f64; 3], q: &[f64; 3]| p[0] * q[1] - p[1] * q[0];
                let (of_a, of_b) = (side(&RAY, &a), side(&RAY, &b));
                // True if the ray meets the line in front of the vertex.
                (of_a > 0.0) != (of_b > 0.0) && side(&a, &b) * (of_b - of_a) > 0.0
            })
            .count();
    }
    let own = model.surface.triangles.iter().filter(|t| model.body(t[0]) == body);
    own.filter(|triangle| {
        let [a, b, c] = triangle.map(|v| difference(&padded::<3>(x, v), &from));
        let sides = [dot(&cross(&a, &b), &RAY), dot(&cross(&b, &c), &RAY), dot(&cross(&c, &a), &RAY)];
        let through = sides.iter().all(|s| *s > 0.0) || sides.iter().all(|s| *s < 0.0);
        let normal = cross(&difference(&b, &a), &difference(&c, &a));
        through && dot(&a, &normal) * dot(&RAY, &normal) > 0.0
    })
    .count()
}

fn padded<const D: usize>(x: &[f64], v: u32) -> [f64; 3] {
    let mut row = [0.0; 3];
    row[..D].copy_from_slice(&x[v as usize * D..][..D]);
    row
}
