//! Candidate pairs of the broad phase: primitives whose boxes intersect.
//!
//! Lists are sorted by primitive index, independent of the number of threads, and leave out pairs that
//! share a vertex.

use crate::broad_phase::{Bounds, BoundsTree};
use crate::closest::Primitives;
use crate::packs::{Screen, closest_points, screen};
use crate::pair::{EdgeEdge, PointTriangle};
use crate::surface::{ContactSurface, VertexKind};
use rayon::prelude::*;

/// Primitives per task of the pair search.
const PLACES: usize = 256;

/// Pairs per task of the distance computation.
const NEAR_TASK: usize = 1024;

/// Candidate pairs of a surface with itself.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CandidatePairs {
    /// Vertex and triangle (3D).
    pub point_triangle: Vec<[u32; 2]>,
    /// Edges, the lower index first (3D).
    pub edge_edge: Vec<[u32; 2]>,
    /// Vertex and edge; in 3D only wire ends and particles with wires.
    pub point_edge: Vec<[u32; 2]>,
    /// Particles, the lower index first.
    pub point_point: Vec<[u32; 2]>,
}

/// Contact filter: pairs of bodies that may touch, and bodies with self-contact.
#[derive(Clone, Debug)]
pub struct BodyPairs {
    count: usize,
    touch: Vec<bool>,
}

impl BodyPairs {
    /// Allows contact between all pairs of `count` bodies, including self-contact.
    pub fn all(count: usize) -> Self {
        BodyPairs { count, touch: vec![true; count * count] }
    }

    /// Enables or disables contact between two bodies.
    pub fn set(&mut self, a: u32, b: u32, touch: bool) {
        let (a, b) = (a as usize, b as usize);
        self.touch[a * self.count + b] = touch;
        self.touch[b * self.count + a] = touch;
    }

    /// Copy without self-contact.
    #[must_use]
    pub fn of_different_bodies(&self) -> Self {
        let mut pairs = self.clone();
        (0..self.count as u32).for_each(|body| pairs.set(body, body, false));
        pairs
    }

    /// True if contact between the two bodies is enabled.
    #[inline]
    pub fn touch(&self, a: u32, b: u32) -> bool {
        self.touch[a as usize * self.count + b as usize]
    }

    /// True if any pair of bodies of the surface may touch; without one, contact is with obstacles only.
    fn touch_on(&self, surface: &ContactSurface) -> bool {
        let mut own: Vec<u32> = surface.vertices.iter().map(|v| surface.bodies[*v as usize]).collect();
        own.sort_unstable();
        own.dedup();
        own.iter().enumerate().any(|(i, a)| own[i..].iter().any(|b| self.touch(*a, *b)))
    }
}

/// Trees of a surface's primitives, reused by successive searches. The result does not depend on earlier
/// searches.
#[derive(Clone, Debug, Default)]
pub struct SurfaceTrees<const D: usize> {
    vertices: BoundsTree<D>,
    edges: BoundsTree<D>,
    triangles: BoundsTree<D>,
}

impl<const D: usize> SurfaceTrees<D> {
    /// Finds the pairs of the surface at `x`, flat `(n, D)` [m], whose gap may fall below `reach` [m] on
    /// the path to `x + dx`, or at `x` if nothing moves.
    ///
    /// # Panics
    /// If the surface has another dimension.
    pub fn gather(
        &mut self,
        surface: &ContactSurface,
        bodies: &BodyPairs,
        x: &[f64],
        dx: Option<&[f64]>,
        reach: f64,
    ) -> CandidatePairs {
        assert_eq!(surface.dimension, D, "dimension of the surface");
        if !bodies.touch_on(surface) {
            return CandidatePairs::default();
        }
        // Update of the trees.
        let shift = dx.map_or([0.0; D], |dx| mean::<D>(&surface.vertices, dx));
        let search = Search { surface, pairs: bodies, x, dx, shift, reach };
        let mut found = CandidatePairs { point_point: search.particles(), ..CandidatePairs::default() };
        let points: Vec<[u32; 1]> = surface.vertices.iter().map(|&v| [v]).collect();
        self.vertices.follow(&search.bounds(&points));
        self.edges.follow(&search.bounds(&surface.edges));
        if D == 2 {
            found.point_edge = search.points(&points, &self.vertices, &surface.edges, &self.edges);
            found.point_edge.par_sort_unstable();
            return found;
        }
        // Pairs of the 3D primitives.
        self.triangles.follow(&search.bounds(&surface.triangles));
        found.point_triangle = search.points(&points, &self.vertices, &surface.triangles, &self.triangles);
        found.edge_edge = search.pairs(&surface.edges, &self.edges);
        found.point_edge = search.wires();
        // Boxes of slanted neighbours intersect all over a surface: most of the pairs found are far
        // apart, or stay so on the path.
        search.keep_near::<PointTriangle>(&mut found.point_triangle, |[p, t]| {
            let [a, b, c] = surface.triangles[t as usize];
            [p, a, b, c]
        });
        search.keep_near::<EdgeEdge>(&mut found.edge_edge, |pair| {
            let [[a, b], [c, d]] = pair.map(|e| surface.edges[e as usize]);
            [a, b, c, d]
        });
        found.point_triangle.par_sort_unstable();
        found.edge_edge.par_sort_unstable();
        found
    }
}

impl CandidatePairs {
    /// Number of pairs of all kinds.
    pub fn count(&self) -> usize {
        let lists = [&self.point_triangle, &self.edge_edge, &self.point_edge, &self.point_point];
        lists.iter().map(|list| list.len()).sum()
    }

    /// Candidate pairs of a single search, see [`SurfaceTrees::gather`].
    ///
    /// # Panics
    /// If the surface has another dimension.
    pub fn gather<const D: usize>(
        surface: &ContactSurface,
        bodies: &BodyPairs,
        x: &[f64],
        dx: Option<&[f64]>,
        reach: f64,
    ) -> Self {
        SurfaceTrees::<D>::default().gather(surface, bodies, x, dx, reach)
    }

    /// Vertex pairs, one vertex of each primitive, of all candidate pairs.
    pub(crate) fn vertex_pairs(&self, surface: &ContactSurface) -> Vec<[u32; 2]> {
        let mut pairs = self.point_point.clone();
        let mut add = |first: &[u32], second: &[u32]| {
            pairs.extend(first.iter().flat_map(|a| second.iter().map(|b| [*a, *b])));
        };
        let edge = |e: &u32| &surface.edges[*e as usize];
        self.point_triangle.iter().for_each(|[p, t]| add(&[*p], &surface.triangles[*t as usize]));
        self.point_edge.iter().for_each(|[p, e]| add(&[*p], edge(e)));
        self.edge_edge.iter().for_each(|[a, b]| add(edge(a), edge(b)));
        pairs.sort_unstable();
        pairs.dedup();
        pairs
    }
}

/// Mean of the rows of `vertices` in `dx`, flat `(n, D)`. A common motion does not change whether
/// primitives meet.
fn mean<const D: usize>(vertices: &[u32], dx: &[f64]) -> [f64; D] {
    let mut sum = [0.0; D];
    for &v in vertices {
        (0..D).for_each(|k| sum[k] += dx[v as usize * D + k]);
    }
    sum.map(|s| s / vertices.len().max(1) as f64)
}

struct Search<'a, const D: usize> {
    surface: &'a ContactSurface,
    pairs: &'a BodyPairs,
    x: &'a [f64],
    dx: Option<&'a [f64]>,
    /// Common motion subtracted from every displacement [m].
    shift: [f64; D],
    reach: f64,
}

impl<const D: usize> Search<'_, D> {
    /// Boxes of primitives, grown by the radius of their body.
    fn bounds<const N: usize>(&self, primitives: &[[u32; N]]) -> Vec<Bounds<D>> {
        let bounds = |vertices: &[u32; N]| {
            let way = self.dx.map(|dx| (dx, &self.shift));
            Bounds::of_vertices(vertices, self.x, way).grown(self.surface.radius(vertices[0]))
        };
        primitives.par_iter().map(bounds).collect()
    }

    /// Pairs of these vertices with other primitives, by index.
    fn points<const M: usize>(
        &self,
        vertices: &[[u32; 1]],
        of_vertices: &BoundsTree<D>,
        others: &[[u32; M]],
        of_others: &BoundsTree<D>,
    ) -> Vec<[u32; 2]> {
        let mut pairs = self.joined((vertices, of_vertices), (others, of_others));
        pairs.iter_mut().for_each(|pair| pair[0] = vertices[pair[0] as usize][0]);
        pairs
    }

    /// Pairs of wire ends or particles with wires.
    fn wires(&self) -> Vec<[u32; 2]> {
        let surface = self.surface;
        if surface.wires.is_empty() {
            return vec![];
        }
        let edges: Vec<[u32; 2]> = surface.wires.iter().map(|e| surface.edges[*e as usize]).collect();
        let is_thin = |v: &u32| surface.kinds[*v as usize] != VertexKind::Face;
        let thin: Vec<[u32; 1]> = surface.vertices.iter().copied().filter(is_thin).map(|v| [v]).collect();
        let [of_thin, of_edges] =
            [self.bounds(&thin), self.bounds(&edges)].map(|bounds| BoundsTree::new(&bounds));
        let mut pairs = self.points(&thin, &of_thin, &edges, &of_edges);
        pairs.iter_mut().for_each(|pair| pair[1] = surface.wires[pair[1] as usize]);
        pairs.par_sort_unstable();
        pairs
    }

    /// Pairs of particles.
    fn particles(&self) -> Vec<[u32; 2]> {
        let surface = self.surface;
        let particles: Vec<[u32; 1]> = surface.particles.iter().map(|&v| [v]).collect();
        let tree = BoundsTree::new(&self.bounds(&particles));
        let mut pairs = self.pairs(&particles, &tree);
        pairs.iter_mut().for_each(|pair| *pair = pair.map(|i| surface.particles[i as usize]));
        pairs.par_sort_unstable();
        pairs
    }

    /// Pairs of primitives of one kind whose boxes come within reach, the lower index first.
    fn pairs<const N: usize>(&self, primitives: &[[u32; N]], tree: &BoundsTree<D>) -> Vec<[u32; 2]> {
        let mut pairs = self.joined((primitives, tree), (primitives, tree));
        pairs.iter_mut().for_each(|pair| pair.sort_unstable());
        pairs
    }

    /// Pairs of primitives of two trees whose boxes come within reach.
    fn joined<const N: usize, const M: usize>(
        &self,
        (primitives, tree): (&[[u32; N]], &BoundsTree<D>),
        (others, of_others): (&[[u32; M]], &BoundsTree<D>),
    ) -> Vec<[u32; 2]> {
        let of_places = |first: usize| {
            let (mut pairs, end) = (vec![], (first + PLACES).min(tree.len()));
            tree.join(first..end, self.reach, of_others, |i, j| {
                if self.allows(&primitives[i as usize], &others[j as usize]) {
                    pairs.push([i, j]);
                }
            });
            pairs
        };
        let blocks: Vec<Vec<[u32; 2]>> =
            (0..tree.len().div_ceil(PLACES)).into_par_iter().map(|block| of_places(block * PLACES)).collect();
        blocks.concat()
    }

    /// Keeps the pairs whose gap is below the reach. If vertices move, keeps those that the quick tests
    /// cannot show to stay farther apart on the path. `vertices` gives the vertices of a pair.
    fn keep_near<K: Primitives<3, 4>>(
        &self,
        pairs: &mut Vec<[u32; 2]>,
        vertices: impl Fn([u32; 2]) -> [u32; 4] + Sync,
    ) {
        let reach = |vertices: &[u32; 4]| {
            let radii = self.surface.radius(vertices[0]) + self.surface.radius(vertices[3]);
            // Tolerance for rounding of distances.
            (self.reach + radii) * (1.0 + 1e-9)
        };
        let near = |pairs: &[[u32; 2]]| {
            let all: Vec<[u32; 4]> = pairs.iter().map(|pair| vertices(*pair)).collect();
            let by = Screen { boxes: self.dx.is_some(), across: true, motion: false };
            let may_be_near = screen::<K, 3, 4>(&all, (self.x, self.dx), reach, by);
            let numbered = pairs.iter().copied().zip(all).zip(may_be_near);
            let kept = numbered.filter(|(_, may_be_near)| *may_be_near).map(|(pair, _)| pair);
            let (mut near, at_hand): (Vec<_>, Vec<_>) = kept.unzip();
            if self.dx.is_some() {
                return near;
            }
            let closest = closest_points::<K, 3, 4>(self.x, &at_hand);
            let mut is_near =
                at_hand.iter().zip(closest).map(|(v, (_, squared))| squared < reach(v) * reach(v));
            near.retain(|_| is_near.next() == Some(true));
            near
        };
        *pairs = pairs.par_chunks(NEAR_TASK).map(near).collect::<Vec<_>>().concat();
    }

    #[inline]
    fn allows<const N: usize, const M: usize>(&self, a: &[u32; N], b: &[u32; M]) -> bool {
        let body = |v: u32| self.surface.bodies[v as usize];
        !a.iter().any(|v| b.contains(v)) && self.pairs.touch(body(a[0]), body(b[0]))
    }
}

/// Bound of the relative motion divided by the largest motion of a vertex: by the vertex and the mean of
/// its body, within a body and between two of them.
const MOTIONS: f64 = 4.0;
/// A path shorter than this fraction of the margin is searched with the margin around its start, which
/// also serves later paths.
const SHORT: f64 = 0.5;

/// Growth of the margin after each search with fewer than one candidate per `FEW` vertices, up to
/// `MOST_GROWTH` in all: surfaces that are far apart are searched less often.
const GROWTH: f64 = 1.5;
const FEW: usize = 16;
const MOST_GROWTH: f64 = 8.0;

/// Factor of the margin; the pairs found within reach do not depend on it.
#[derive(Clone, Copy, Debug)]
struct Widening {
    factor: f64,
    /// Largest factor not yet known to find too many candidates.
    largest: f64,
}

impl Default for Widening {
    fn default() -> Self {
        Widening { factor: 1.0, largest: MOST_GROWTH }
    }
}

impl Widening {
    /// Adapts the factor to the numbers of candidates and vertices of a search.
    fn adapt(&mut self, candidates: usize, vertices: usize) {
        if candidates * FEW < vertices {
            self.factor = (GROWTH * self.factor).min(self.largest);
        } else {
            *self = Widening { factor: 1.0, largest: (self.factor / GROWTH).max(1.0) };
        }
    }
}

/// Candidates valid along a whole path and near it.
#[derive(Clone, Debug, Default)]
struct SweptPairs {
    from: Vec<f64>,
    dx: Vec<f64>,
    /// Gap that the candidates are complete for [m].
    reach: f64,
    /// Half of the distance that they extend beyond it [m].
    margin: f64,
    pairs: CandidatePairs,
}

impl SweptPairs {
    /// True if all pairs within `reach` at `x` are included: no pair has come nearer by more than twice
    /// the margin since `from + part dx`. Two such points bound a straight path with the same property.
    fn hold<const D: usize>(&self, surface: &ContactSurface, x: &[f64], reach: f64) -> bool {
        if x.len() != self.from.len() || reach > self.reach {
            return false;
        }
        // Nearest point of the path.
        let (mut along, mut squared) = (0.0, 0.0);
        for ((x, from), dx) in x.iter().zip(&self.from).zip(&self.dx) {
            along += (x - from) * dx;
            squared += dx * dx;
        }
        let part = if squared > 0.0 { (along / squared).clamp(0.0, 1.0) } else { 0.0 };
        let way: Vec<f64> = self.from.iter().zip(&self.dx).map(|(from, dx)| from + part * dx).collect();
        MOTIONS * (D as f64).sqrt() * largest_difference(x, &way) <= self.margin
            || relative_motion::<D>(surface, &way, x) <= self.margin
    }
}

/// Candidates that stay complete while vertices move little.
///
/// They are gathered within the reach plus twice the `margin`, wider where there are few. They include
/// all pairs within reach until the motion of bodies relative to each other, plus that of vertices
/// relative to their bodies, exceeds the margin.
#[derive(Clone, Debug, Default)]
pub struct CandidateCache<const D: usize> {
    trees: SurfaceTrees<D>,
    pairs: CandidatePairs,
    gathered_at: Vec<f64>,
    /// Gap that they were gathered for [m].
    reach: f64,
    /// Half of the distance that they extend beyond it [m].
    margin: f64,
    swept: SweptPairs,
    /// Positions at which they were last found complete, flat [m], and the margin left there [m].
    seen_at: Vec<f64>,
    left: f64,
    widening: Widening,
    /// Number of searches so far.
    pub gatherings: u64,
}

impl<const D: usize> CandidateCache<D> {
    /// Candidates within `reach` [m] at `x`. Searches again, with at least this margin [m], if a vertex
    /// has moved too far and `x` is not on the last path.
    pub fn at(
        &mut self,
        surface: &ContactSurface,
        bodies: &BodyPairs,
        x: &[f64],
        reach: f64,
        margin: f64,
    ) -> &CandidatePairs {
        if !self.is_complete(surface, x, reach) {
            if self.swept.hold::<D>(surface, x, reach) {
                return &self.swept.pairs;
            }
            self.gather_around(surface, bodies, x, reach, margin);
        }
        &self.pairs
    }

    /// Candidates with all pairs that come nearer than `near` [m] on the path from `x` to `x + dx`, flat
    /// `(n, D)` [m]. Searches again if the stored ones are not complete: as [`at`](Self::at) does for a
    /// short path.
    pub fn on_way(
        &mut self,
        surface: &ContactSurface,
        bodies: &BodyPairs,
        (x, dx): (&[f64], &[f64]),
        near: f64,
        (reach, margin): (f64, f64),
    ) -> &CandidatePairs {
        let to: Vec<f64> = x.iter().zip(dx).map(|(x, dx)| x + dx).collect();
        // The region where the candidates are complete is a ball: it contains straight paths between its
        // points.
        if self.is_complete(surface, x, near) && self.is_complete(surface, &to, near) {
            return &self.pairs;
        }
        if self.swept.hold::<D>(surface, x, near) && self.swept.hold::<D>(surface, &to, near) {
            return &self.swept.pairs;
        }
        if relative_motion::<D>(surface, x, &to) <= SHORT * self.widening.factor * margin {
            self.gather_around(surface, bodies, x, reach, margin);
            return &self.pairs;
        }
        // Line searches try shorter steps after a long one, which may pass on either side of a primitive.
        let pairs = self.trees.gather(surface, bodies, x, Some(dx), near + 2.0 * margin);
        self.gatherings += 1;
        self.swept = SweptPairs { from: x.to_vec(), dx: dx.to_vec(), reach: near, margin, pairs };
        &self.swept.pairs
    }

    fn gather_around(
        &mut self,
        surface: &ContactSurface,
        bodies: &BodyPairs,
        x: &[f64],
        reach: f64,
        margin: f64,
    ) {
        let margin = self.widening.factor * margin;
        self.pairs = self.trees.gather(surface, bodies, x, None, reach + 2.0 * margin);
        self.widening.adapt(self.pairs.count(), surface.vertices.len());
        self.gathered_at.clear();
        self.gathered_at.extend_from_slice(x);
        self.seen_at.clone_from(&self.gathered_at);
        (self.reach, self.margin, self.left) = (reach, margin, margin);
        self.gatherings += 1;
    }

    /// True if no pair within `reach` can be missing: none has come nearer by more than twice the margin.
    fn is_complete(&mut self, surface: &ContactSurface, x: &[f64], reach: f64) -> bool {
        if self.gathered_at.len() != x.len() || reach > self.reach {
            return false;
        }
        let moved = (D as f64).sqrt() * largest_difference(x, &self.seen_at);
        if MOTIONS * moved <= self.left {
            return true;
        }
        let left = self.margin - relative_motion::<D>(surface, &self.gathered_at, x);
        if left >= 0.0 {
            self.seen_at.clear();
            self.seen_at.extend_from_slice(x);
            self.left = left;
        }
        left >= 0.0
    }
}

/// Largest absolute difference of two arrays, element by element, in the order of SIMD lanes.
fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    const LANES: usize = 8;
    let ((a, of_a), (b, of_b)) = (a.as_chunks::<LANES>(), b.as_chunks::<LANES>());
    let mut most = [0.0; LANES];
    for (a, b) in a.iter().zip(b) {
        for k in 0..LANES {
            let difference = (a[k] - b[k]).abs();
            most[k] = if difference > most[k] { difference } else { most[k] };
        }
    }
    let rest = of_a.iter().zip(of_b).map(|(a, b)| (a - b).abs());
    most.into_iter().chain(rest).fold(0.0, f64::max)
}

/// Bound of half the approach of any two vertices between `from` and `to`, flat `(n, D)` [m]: largest
/// motion of bodies relative to each other plus that of vertices relative to their bodies.
fn relative_motion<const D: usize>(surface: &ContactSurface, from: &[f64], to: &[f64]) -> f64 {
    let moved = |v: u32| {
        let at = v as usize * D;
        let (to, from) = (&to[at..][..D], &from[at..][..D]);
        let mut moved = [0.0; D];
        (0..D).for_each(|k| moved[k] = to[k] - from[k]);
        moved
    };
    let body = |v: u32| surface.bodies[v as usize] as usize;
    // Sums of motions and numbers of vertices, by body.
    let mut means: Vec<([f64; D], f64)> = vec![];
    for &v in &surface.vertices {
        if means.len() <= body(v) {
            means.resize(body(v) + 1, ([0.0; D], 0.0));
        }
        let (own, (sum, count)) = (moved(v), &mut means[body(v)]);
        (0..D).for_each(|k| sum[k] += own[k]);
        *count += 1.0;
    }
    for (mean, count) in means.iter_mut().filter(|(_, count)| *count > 0.0) {
        mean.iter_mut().for_each(|m| *m /= *count);
    }
    // Largest motion within bodies.
    let squared = |a: &[f64; D], b: &[f64; D]| {
        let mut sum = 0.0;
        (0..D).for_each(|k| sum += (a[k] - b[k]) * (a[k] - b[k]));
        sum
    };
    let within = surface.vertices.iter().map(|&v| squared(&moved(v), &means[body(v)].0));
    let within = within.fold(0.0, f64::max).sqrt();
    // Two bodies differ by at most twice the largest difference from the first body.
    let present = means.iter().filter(|(_, count)| *count > 0.0).map(|(mean, _)| mean);
    let first = present.clone().next().copied().unwrap_or([0.0; D]);
    let between = present.map(|mean| squared(mean, &first)).fold(0.0, f64::max).sqrt();
    within + between
}
